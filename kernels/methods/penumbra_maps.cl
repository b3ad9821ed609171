// penumbra-maps: Wyman & Hansen 2003 §3.

#include "base/falloff.h"
#include "silhouettes/feature_tiles.h"
#include "silhouettes/fin_lookup.h"

// --------------------------------------------------------------------------------------------------------- penumbra maps

// Wyman & Hansen 2003 §3. At distance delta from a silhouette point of depth Zv, its cone (or the sheet between cones) lies at
// depth Z_F with 1/Z_F = 1/Zv - delta/R: nothing need be tessellated. Behind the shadow map's surface Z_P it is discarded, else
// I = (Z_F - Zv) / (Z_P - Zv) (Eq. 1). At contact, Z_P <= Zv, the cone lies behind the surface.
// penumbra_map: float a texel: the darkest falloff(I), 1 where there is none.
__kernel __attribute__((reqd_work_group_size(HS_TILE_ITEMS, 1, 1))) void raster_penumbra_map(
    const HsView light, const HsFinShape shape, HS_ARGS_FEATURE_TILES, __global const float* shadow_map,
    __global uchar* tile_near_fins, __global float* penumbra_map, const uint falloff) {
  HsView view = light;
  const FeatureTile tile = feature_tile(view, shape, 0, 1, status, feature_offsets, feature_capacity);
  if (is_written(shape, feature_offsets)) {
    float d_receiver[HS_TILE_STORAGE], darkest[HS_TILE_STORAGE];
    for (int i = 0; i < HS_TILE_STORAGE; ++i) darkest[i] = 1.0f;
    view.d_far = load_receivers(view, tile, shadow_map, d_receiver);
    const float inverse_radius = 1.0f / shape.radius_px;
    HS_FOR_FEATURE_TEXELS(tile, , {
      const vfloat d_r = v_load(d_receiver + slot);
      const vfloat d_f = d - max(delta_px, 0.0f) * inverse_radius;
      const vint shadows = inside & (delta_px >= -HS_SLACK_PX) & (d > d_r) & (d_f > d_r);
      // (1/d_f - 1/d) / (1/d_r - 1/d) over one denominator.
      vfloat intensity = (d - d_f) * d_r / ((d - d_r) * d_f);
      // A caster narrower than its penumbra darkens by its share of that.
      if (feature.width_px < INFINITY)
        intensity = 1.0f - (1.0f - intensity) * min(feature.width_px / (shape.radius_px * (d - d_r)), 1.0f);
      v_store(v_select(v_load(darkest + slot), min(v_load(darkest + slot), intensity), shadows), darkest + slot);
    })
    // Falloffs rise, so the darkest stays the darkest.
    HS_FOR_TILE_TEXELS(tile, store_lanes(falloff_of(v_load(darkest + slot), falloff), penumbra_map, texel, valid);)
    flag_near_tile(tile.touched, tile_near_fins);
  }
}

// penumbra-maps: Wyman & Hansen 2003 §3. At each of the four nearest texels: in the hard shadow 0, else what the penumbra map
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

__kernel void receive_penumbra_map(const HsView light, const HsReceiverView view, HS_ARGS_GBUFFER,
                                   __global const float* shadow_map, __global const float* penumbra_map,
                                   __global const uchar* tile_near_fins, HS_ARGS_VISIBILITY) {
  HS_FOR_RECEIVERS(visibility_penumbra_map(light, shadow_map, penumbra_map, tile_near_fins, &r))
}
