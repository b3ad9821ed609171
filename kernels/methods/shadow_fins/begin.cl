// Hard shadows and receivers for shadow fins: which pixels are near fins, and how much of the light their own plane leaves.

#include "base/falloff.h"
#include "base/tile_receivers.h"
#include "methods/shadow_fins/receivers.h"
#include "silhouettes/fin_shape.h"
#include "silhouettes/layers.h"

// The part of the light that is above a receiver's own plane, in the falloff's terms. The plane's 1/z has the gradient g in the
// light map (see Receiver), and the light's centre stands 1/(R |g|) radii above it. Where the light is a sphere, its disc faces
// the receiver p: with the plane's normal n scaled to n . p = -1, 1/(R |n - (n . p) p / p^2|).
HS_INLINE vfloat above_horizon(const HsView light, const HsFinShape shape, const Receiver* r, uint falloff) {
  vfloat g2 = r->plane_dx * r->plane_dx + r->plane_dy * r->plane_dy;
  const float per_px = shape.sphere_q_per_px;
  if (per_px > 0.0f) {
    const vfloat qx = (r->u + (0.5f - light.px_from_q.y)) * per_px, qy = (r->v + (0.5f - light.px_from_q.w)) * per_px;
    const vfloat nz = r->plane_d - (r->plane_dx * qx + r->plane_dy * qy) / per_px;
    g2 += (nz * nz - r->plane_d * r->plane_d / (1.0f + qx * qx + qy * qy)) * (per_px * per_px);
  }
  const vfloat g = sqrt(max(g2, 0.0f)) * shape.radius_px;
  if (!v_any(g > 1.0f)) return (vfloat)(1.0f);
  return falloff_of(0.5f + 0.5f / max(g, 1.0f), falloff);
}

// Hard shadows, and which pixels are near fins: for those, tiles replace the result where a fin reaches them.
// receiver_words: uint a pixel; horizon_limits: float a pixel, see above_horizon. tile_counts: runs of each tile; tile_far: float
// bits a tile, depth of its farthest receiver. Both must be 0.
__kernel void begin_fins(const HsView light, const HsReceiverView view, HS_ARGS_GBUFFER, __global const float* shadow_map,
                         __global const uchar* near, const HsFinShape shape, const HsLayers layers,
                         __global const float* caster_range, __global uint* receiver_words, __global float* horizon_limits,
                         __global uint* tile_counts, __global int* tile_far, HS_ARGS_VISIBILITY) {
  const size_t pixels = (size_t)view.width_px * view.height_px;
  const float per_step = 1.0f / (float)shape.tile_step;
  const bool single = used_layers(layers, caster_range) == 1;
  HS_FOR_PIXELS(px, py, valid, view.width_px, view.height_px) {
    const Receiver r = locate(light, view, px, py, valid, depth_or_position, normal);
    vfloat result = r.visibility;
    vint words = (vint)(0);
    if (!v_all(r.decided)) {
      const Footprint f = footprint(light, &r);
      const Taps lit = lit_taps(light, shadow_map, &r, &f);
      const vfloat hard = bilinear(&f, &lit);
      result = v_select(falloff_of(hard, layers.falloff), r.visibility, r.decided);
      const vfloat most = layers.faithful ? (vfloat)(1.0f) : above_horizon(light, shape, &r, layers.falloff);
      const vint tiles = v_int((v_float(f.y) + 0.5f) * per_step) * (int)shape.tiles_x + v_int((v_float(f.x) + 0.5f) * per_step);
      vint chosen = (vint)(0);
      for (vint left = v_not(r.decided) & (v_iota < valid); v_any(left);) {
        int tile;
        const vint same = next_tile(tiles, &left, &tile);
        if (near[tile]) {
          chosen |= same;
          bound_tile(same, r.z, tile_far + tile, tile_counts + tile, 1);
        }
      }
      if (v_any(chosen)) {
        const vint bits = v_int(lit.v00 + 2.0f * lit.v10 + 4.0f * lit.v01 + 8.0f * lit.v11);
        const vint capped = most < 1.0f;
        words = (tiles + 1) | (bits << HS_LIT_SHIFT) | v_select((vint)(0), (vint)(HS_WORD_LIMITED), capped);
        words = v_select((vint)(0), words, chosen);
        if (v_any(chosen & capped)) store_lanes(most, horizon_limits, HS_PIXEL, valid);
        // Layers add up before the falloff.
        if (!single && !layers.faithful) result = v_select(result, hard, chosen);
      }
      result = min(result, v_select(most, (vfloat)(1.0f), r.decided));
    }
    store_lanes(v_as_float(words), (__global float*)receiver_words, HS_PIXEL, valid);
    store_visibility(&r, result, visibility, (size_t)plane * pixels + HS_PIXEL, valid);
  }
}

// listed: runs of each tile's receivers.
__kernel void list_fin_receivers(const HsReceiverView view, __global const uint* receiver_words, __global uint* tile_cursors,
                                 __global uint* listed) {
  HS_FOR_PIXELS(px, py, valid, view.width_px, view.height_px) {
    const vint words = load_int_lanes((__global const int*)receiver_words, HS_PIXEL, valid);
    for (vint left = (words != 0) & (v_iota < valid); v_any(left);) {
      int tile;
      next_tile(words & HS_WORD_TILE, &left, &tile);
      listed[atomic_inc(&tile_cursors[tile - 1])] = (uint)px | (uint)py << HS_RUN_Y_SHIFT;
    }
  }
}
