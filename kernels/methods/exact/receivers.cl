// Receivers to the light map's tiles: how far they are, and which of them must be counted, sample by sample
// (methods/exact).

#include "base/receiver.h"
#include "base/tile_receivers.h"

#define HS_WORD_UNCLEAR (1 << 30)  // of a receiver's word, tile + 1: the map does not tell whether it is lit

// Prefetches what the shadow map holds where pixels (px .., py) lie: what the next row's look-ups would wait for is there by
// then, which matters where other programs load the memory.
HS_INLINE void prefetch_texels(const HsView light, const HsReceiverView view, int px, int py, int valid,
                               __global const float* depth_or_position, __global const float* shadow_map) {
#if HS_LANES == 16
  if (py >= (int)view.height_px) return;
  const PixelPlace p = place_pixels(light, view, px, py, valid, depth_or_position);
  const vint texels = row(light, v_int(rint(p.v))) * (int)light.width_px + column(light, v_int(rint(p.u)));
  prefetch(shadow_map + texels.s0);
  prefetch(shadow_map + texels.s5);
  prefetch(shadow_map + texels.sa);
  prefetch(shadow_map + texels.sf);
#endif
}

// What the shadow map outputs; where silhouettes may come near, and where it does not tell, count_samples outputs instead.
// receiver_words: uint a pixel, 0 for none. tile_far: float bits a tile: depth of its farthest receiver; 0 without. tile_counts:
// its receivers. Both must be 0.
__kernel void receive_by_map(const HsView light, const HsReceiverView view, HS_ARGS_GBUFFER, __global const float* shadow_map,
                             __global uint* receiver_words, __global int* tile_far, __global uint* tile_counts,
                             HS_ARGS_VISIBILITY) {
  HS_FOR_PIXELS(px, py, valid, view.width_px, view.height_px) {
    prefetch_texels(light, view, px, py + 1, valid, depth_or_position, shadow_map);
    const Receiver r = locate(light, view, px, py, valid, depth_or_position, normal);
    vfloat result = r.visibility;
    vint words = (vint)(0);
    vint left = v_not(r.decided) & (v_iota < valid);
    if (v_any(left)) {
      const vint x = column(light, v_int(rint(r.u))), y = row(light, v_int(rint(r.v)));
      const vint tiles = y / HS_TILE * (int)light.tiles_x + x / HS_TILE;
      const vfloat z_map = v_gather(shadow_map, y * (int)light.width_px + x);
      const vfloat slope = fabs(r.plane_dx) + fabs(r.plane_dy);
      const vfloat plane_d = r.plane_d + r.plane_dx * (v_float(x) - r.u) + r.plane_dy * (v_float(y) - r.v);
      const vint lit = z_map * (plane_d + HS_SAME_SURFACE(r.plane_d, slope)) >= 1.0f;
      const vint dark = z_map * HS_CLEARLY_BEFORE(r.plane_d, slope) < 1.0f;
      result = v_select(v_select((vfloat)(0.0f), (vfloat)(1.0f), lit), r.visibility, r.decided);
      words = v_select((vint)(0), (tiles + 1) | v_select((vint)(HS_WORD_UNCLEAR), (vint)(0), lit | dark), left);
      while (v_any(left)) {
        int tile;
        const vint same = next_tile(tiles, &left, &tile);
        bound_tile(same, r.z, tile_far + tile, tile_counts + tile, (uint)lane_count(same));
      }
    }
    store_lanes(v_as_float(words), (__global float*)receiver_words, HS_PIXEL, valid);
    store_visibility(&r, result, visibility, (size_t)plane * view.height_px * view.width_px + HS_PIXEL, valid);
  }
}

// Lists the receivers to be counted, tile by tile; `all`, or where faces touch the light (touching_faces.h): every one.
// listed: pixel numbers; those of tile t begin at the offset that tile_cursors[t] had, and end where it ends up.
__kernel void list_receivers(const HsReceiverView view, __global const uint* receiver_words, __global const uint* edge_offsets,
                             const uint all, __global const uint* touching, __global uint* tile_cursors, __global uint* listed) {
  HS_FOR_PIXELS(px, py, valid, view.width_px, view.height_px) {
    const vint words = load_int_lanes((__global const int*)receiver_words, HS_PIXEL, valid);
    for (vint left = (words != 0) & (v_iota < valid); v_any(left);) {
      int tile;
      vint chosen = next_tile(words & (HS_WORD_UNCLEAR - 1), &left, &tile);
      if (!all && touching[0] == 0 && edge_offsets[tile - 1] == edge_offsets[tile]) chosen &= (words & HS_WORD_UNCLEAR) != 0;
      uint bits = lane_bits(chosen);
      if (bits == 0) continue;
      for (uint slot = atomic_add(&tile_cursors[tile - 1], (uint)popcount(bits)); bits != 0; bits &= bits - 1)
        listed[slot++] = (uint)HS_PIXEL + (uint)first_lane(bits);
    }
  }
}
