// light-samples: Heckbert & Herf 1997. The mean of hard shadows from points of the light's disc, one shadow map at a time.

// visibility: float a pixel: the number of the samples before that see it, this one added; must be 0 before the first. A sample
// behind the receiver's face sees nothing of it.
__kernel void receive_sample(const HsView light, const HsReceiverView view, __global const float* depth_or_position,
                             __global const float4* normal, __global const float* shadow_map, const uint casts,
                             __global float* visibility, const uint plane) {
  HS_FOR_PIXELS(px, py, valid, view.width_px, view.height_px) {
    const Receiver r = locate(light, view, px, py, valid, depth_or_position, normal);
    vfloat seen = r.visibility;
    if (casts && !v_all(r.decided)) seen = v_select(visibility_hard(light, &r, shadow_map), r.visibility, r.decided);
    if (!casts) seen = v_select((vfloat)(1.0f), r.visibility, r.decided);
    seen = v_select(seen, (vfloat)(0.0f), r.elsewhere);
    const size_t first = ((size_t)plane * view.height_px + py) * view.width_px + px;
    store_lanes(load_lanes(visibility, first, valid) + seen, visibility, first, valid);
  }
}

// Counts to means. What the light's centre decides without a look-up, such as the cone's border, holds for all samples.
__kernel void receive_samples_end(const HsView light, const HsReceiverView view, __global const float* depth_or_position,
                                  __global const float4* normal, const uint count, __global float* visibility, const uint plane) {
  HS_FOR_RECEIVERS(load_lanes(visibility, ((size_t)plane * view.height_px + py) * view.width_px + px, valid) / (float)count)
}
