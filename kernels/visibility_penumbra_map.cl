// penumbra-maps: Wyman & Hansen 2003 §2. At each of the four nearest texels: in the hard shadow 0, else what the penumbra map
// holds; then bilinear.
HS_INLINE vfloat visibility_penumbra_map(const HsView light, __global const float* shadow_map, __global const float* penumbra_map,
                                         __global const uchar* tile_near_fins, const Receiver* r) {
  const Footprint f = footprint(light, r);
  Taps v = lit_taps(light, shadow_map, r, &f);
  const vint near = near_fins(light, &f, r, tile_near_fins);
  if (v_any(near)) {
    const Taps stored = taps(penumbra_map, v_select((vint)(0), f.y * (int)light.width_px + f.x, near), (int)light.width_px);
    v.v00 = v_select(v.v00, v.v00 * stored.v00, near);
    v.v10 = v_select(v.v10, v.v10 * stored.v10, near);
    v.v01 = v_select(v.v01, v.v01 * stored.v01, near);
    v.v11 = v_select(v.v11, v.v11 * stored.v11, near);
  }
  return bilinear(&f, &v);
}

__kernel void receive_penumbra_map(const HsView light, const HsReceiverView view, __global const float* depth_or_position,
                                   __global const float4* normal, __global const float* shadow_map,
                                   __global const float* penumbra_map, __global const uchar* tile_near_fins,
                                   __global float* visibility, const uint plane) {
  HS_FOR_RECEIVERS(visibility_penumbra_map(light, shadow_map, penumbra_map, tile_near_fins, &r))
}
