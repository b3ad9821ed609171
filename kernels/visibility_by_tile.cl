// Receivers to the light map's tiles: how far they are, and which of them must be counted, sample by sample
// (visibility_exact.cl).

// The tile of a receiver, from its position in texels (centres at integers).
HS_INLINE vint tile_of(const HsView light, const Receiver* r) {
  return row(light, v_int(rint(r->v))) / HS_TILE * (int)light.tiles_x + column(light, v_int(rint(r->u))) / HS_TILE;
}

// True if all lanes of `mask` hold the same tile, which is then *tile.
HS_INLINE bool one_tile(vint tiles, vint mask, int* tile) {
  *tile = v_min(v_select((vint)(INT_MAX), tiles, mask));
  return *tile == -v_min(v_select((vint)(INT_MAX), -tiles, mask));
}

// tile_far: float bits a tile: depth of its farthest receiver; 0 without. tile_counts: its receivers. Both must be 0.
__kernel void bound_receivers(const HsView light, const HsReceiverView view, __global const float* depth_or_position,
                              __global const float4* normal, __global int* tile_far, __global uint* tile_counts) {
  HS_FOR_PIXELS(px, py, valid, view.width_px, view.height_px) {
    const Receiver r = locate(light, view, px, py, valid, depth_or_position, normal);
    const vint mine = v_not(r.decided) & (v_iota < valid);
    if (!v_any(mine)) continue;
    const vint tiles = tile_of(light, &r), z_bits = v_as_int(r.z);
    int tile;
    if (one_tile(tiles, mine, &tile)) {
      const int far = -v_min(v_select((vint)(0), -z_bits, mine));
      atomic_max(&tile_far[tile], far);
      atomic_add(&tile_counts[tile], (uint)lane_count(mine));
    } else {
      for (int i = 0; i < HS_LANES; ++i) {
        if (!HS_LANE(mine, i)) continue;
        atomic_max(&tile_far[HS_LANE(tiles, i)], HS_LANE(z_bits, i));
        atomic_inc(&tile_counts[HS_LANE(tiles, i)]);
      }
    }
  }
}

// By the map: a surface whose 1/z in a texel is at most the receiver's plane there plus the first is the receiver's own or beyond
// it; one whose 1/z is more than the second stands before it whatever the surface does within two texels.
#define HS_SAME_SURFACE(d, slope) ((slope) * (1.0f / 64.0f) + (d)*4e-6f)
#define HS_CLEARLY_BEFORE(d, slope) ((d)*1.01f + 2.0f * (slope))

// Answers the receivers that no silhouette comes near by the shadow map, and lists the others, tile by tile.
// listed: pixel numbers; those of tile t begin at the offset that tile_cursors[t] had, and end where it ends up.
__kernel void list_receivers(const HsView light, const HsReceiverView view, __global const float* depth_or_position,
                             __global const float4* normal, __global const float* shadow_map, __global const uint* edge_offsets,
                             const uint all, __global uint* tile_cursors, __global uint* listed, __global float* visibility,
                             const uint plane) {
  HS_FOR_PIXELS(px, py, valid, view.width_px, view.height_px) {
    const Receiver r = locate(light, view, px, py, valid, depth_or_position, normal);
    vfloat result = r.visibility;
    const vint mine = v_not(r.decided) & (v_iota < valid);
    if (v_any(mine)) {
      const vint tiles = tile_of(light, &r);
      int tile;
      const bool together = one_tile(tiles, mine, &tile);
      vint chosen = mine;
      if (!all && !(together && edge_offsets[tile] != edge_offsets[tile + 1])) {
        const vint x = column(light, v_int(rint(r.u))), y = row(light, v_int(rint(r.v)));
        const vfloat z_map = v_gather(shadow_map, y * (int)light.width_px + x);
        const vfloat slope = fabs(r.plane_dx) + fabs(r.plane_dy);
        const vfloat plane_d = r.plane_d + r.plane_dx * (v_float(x) - r.u) + r.plane_dy * (v_float(y) - r.v);
        const vint lit = z_map * (plane_d + HS_SAME_SURFACE(r.plane_d, slope)) >= 1.0f;
        const vint dark = z_map * HS_CLEARLY_BEFORE(r.plane_d, slope) < 1.0f;
        chosen = mine & v_not(lit | dark);
        if (!together)
          for (int i = 0; i < HS_LANES; ++i)
            if (HS_LANE(mine, i) && edge_offsets[HS_LANE(tiles, i)] != edge_offsets[HS_LANE(tiles, i) + 1])
              HS_SET_LANE(chosen, i);
        result = v_select(v_select((vfloat)(0.0f), (vfloat)(1.0f), lit), r.visibility, r.decided);
      }
      if (v_any(chosen)) {
        const uint pixel = (uint)py * view.width_px + (uint)px;
        uint slot = together ? atomic_add(&tile_cursors[tile], (uint)lane_count(chosen)) : 0;
        for (int i = 0; i < HS_LANES; ++i) {
          if (!HS_LANE(chosen, i)) continue;
          listed[together ? slot++ : atomic_inc(&tile_cursors[HS_LANE(tiles, i)])] = pixel + i;
        }
      }
    }
    store_visibility(&r, result, visibility, ((size_t)plane * view.height_px + py) * view.width_px + px, valid);
  }
}
