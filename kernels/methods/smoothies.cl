// smoothies: Chan & Durand 2003.

#include "base/falloff.h"
#include "silhouettes/feature_tiles.h"
#include "silhouettes/fin_lookup.h"

// ------------------------------------------------------------------------------------------------------------- smoothies

// 1 - b/r at a texel, with b = 1/d the fin's depth and r = 1/d_receiver the receiver's, and alpha' = alpha / (1 - b/r) (Chan &
// Durand 2003 Eq. 1). Both vanish at contact, where the penumbra has no width: a fin texel with b >= r lies behind the surface
// and is dropped before.
// A caster narrower than its penumbra is wide there darkens by its share of that.
HS_INLINE vfloat smoothie_alpha(const HsFinShape shape, const TileFeature* f, vfloat distance_px, vfloat d, vfloat d_receiver) {
  const vfloat beyond = d - d_receiver;
  if (f->width_px == INFINITY)
    return shape.width_px > 0.0f ? distance_px * d / (shape.width_px * beyond) : distance_px / (shape.radius_px * beyond);
  const vfloat per_px = shape.width_px > 0.0f ? d / (shape.width_px * beyond) : 1.0f / (shape.radius_px * beyond);
  return 1.0f - (1.0f - distance_px * per_px) * min(f->width_px * per_px, 1.0f);
}

// Chan & Durand 2003 §3 step 4 and §3.1.
// fin_depth: float a texel: z of the nearest smoothie, HS_EMPTY_Z where there is none.
// fin_alpha: float a texel: the minimum of alpha' over all smoothies, 1 where there is none.
// A smoothie texel with alpha' >= 1 shadows nothing and is not stored.
__kernel __attribute__((reqd_work_group_size(HS_TILE_ITEMS, 1, 1))) void raster_smoothies(
    const HsView light, const HsFinShape shape, HS_ARGS_FEATURE_TILES, __global const float* shadow_map,
    __global uchar* tile_near_fins, __global float* fin_depth, __global float* fin_alpha) {
  HsView view = light;
  const FeatureTile tile = feature_tile(view, shape, 0, 1, status, feature_offsets, feature_capacity);
  if (is_written(shape, feature_offsets)) {
    float d_receiver[HS_TILE_STORAGE], nearest_d[HS_TILE_STORAGE], min_alpha[HS_TILE_STORAGE];
    for (int i = 0; i < HS_TILE_STORAGE; ++i) nearest_d[i] = 0.0f;
    for (int i = 0; i < HS_TILE_STORAGE; ++i) min_alpha[i] = 1.0f;
    // A fin that falls on nothing farther reaches no farther than for that: most of them lie on the caster itself.
    view.d_far = load_receivers(view, tile, shadow_map, d_receiver);
    HS_FOR_FEATURE_TEXELS(tile, , {
      const vfloat d_r = v_load(d_receiver + slot);
      const vfloat alpha = smoothie_alpha(shape, &feature, max(delta_px, 0.0f), d, d_r);
      const vint shadows = inside & (delta_px >= -HS_SLACK_PX) & (d > d_r) & (alpha < 1.0f);
      v_store(v_select(v_load(nearest_d + slot), max(v_load(nearest_d + slot), d), shadows), nearest_d + slot);
      v_store(v_select(v_load(min_alpha + slot), min(v_load(min_alpha + slot), alpha), shadows), min_alpha + slot);
    })
    HS_FOR_TILE_TEXELS(tile, {
      const vfloat nearest = v_load(nearest_d + slot);
      store_lanes(v_select((vfloat)(HS_EMPTY_Z), 1.0f / nearest, nearest > 0.0f), fin_depth, texel, valid);
      store_lanes(v_load(min_alpha + slot), fin_alpha, texel, valid);
    })
    flag_near_tile(tile.touched, tile_near_fins);
  }
}

// smoothies: Chan & Durand 2003 §3 step 5. At each of the four nearest texels: behind the shadow map 0, else behind the smoothie
// its alpha', else 1; then bilinear, then the falloff.
HS_INLINE vfloat visibility_smoothies(const HsView light, __global const float* shadow_map, __global const float* fin_depth,
                                      __global const float* fin_alpha, __global const uchar* tile_near_fins, uint falloff,
                                      const Receiver* r) {
  const Footprint f = footprint(light, r);
  Taps v = lit_taps(light, shadow_map, r, &f);
  const vint near = near_fins(light, &f, r, tile_near_fins);
  if (v_any(near)) {
    const vint first = v_select((vint)(0), f.y * (int)light.width_px + f.x, near);
    const Taps z = taps(fin_depth, first, (int)light.width_px), alpha = taps(fin_alpha, first, (int)light.width_px);
    v.v00 = v_select(v.v00, v.v00 * alpha.v00, near & (z.v00 * r->plane_d < 1.0f));
    v.v10 = v_select(v.v10, v.v10 * alpha.v10, near & (z.v10 * r->plane_d < 1.0f));
    v.v01 = v_select(v.v01, v.v01 * alpha.v01, near & (z.v01 * r->plane_d < 1.0f));
    v.v11 = v_select(v.v11, v.v11 * alpha.v11, near & (z.v11 * r->plane_d < 1.0f));
  }
  return falloff_of(bilinear(&f, &v), falloff);
}

__kernel void receive_smoothies(const HsView light, const HsReceiverView view, HS_ARGS_GBUFFER, __global const float* shadow_map,
                                __global const float* fin_depth, __global const float* fin_alpha,
                                __global const uchar* tile_near_fins, const uint falloff, HS_ARGS_VISIBILITY) {
  HS_FOR_RECEIVERS(visibility_smoothies(light, shadow_map, fin_depth, fin_alpha, tile_near_fins, falloff, &r))
}
