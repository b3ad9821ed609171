// pcss: Fernando 2005, "Percentage-Closer Soft Shadows". What blocks the light around the receiver is searched for in the shadow
// map; its mean depth gives the width of the penumbra, and that the width of a filter over comparisons.
//
// Widths are in texels, from R (1/Lb - 1/Lr) with R in texels at unit distance: that of the part of the map that the light's disc
// covers, as the receiver sees it, at Lb. The same points of the unit disc serve both steps: every x, then every y.
//
// The search is as wide as the nearest caster asks for that reaches the receiver's tile of the map; where it finds nothing, it is
// tried again as wide as those ask for that stand in the tile or beside it, which may be much less.

#include "base/receiver.h"

// How many of the tiles that bound searches a map has across, or down.
HS_INLINE uint search_tiles(uint texels) {
  return (texels + HS_SEARCH_TILE - 1) / HS_SEARCH_TILE;
}

// tile_depths: float a search tile, the greatest 1/z of what the map holds there. Any number of work-items.
__kernel void bound_map_depths(const HsView light, __global const float* shadow_map, __global float* tile_depths) {
  const uint tiles_x = search_tiles(light.width_px), tiles = tiles_x * search_tiles(light.height_px);
  for (uint tile = get_global_id(0); tile < tiles; tile += get_global_size(0)) {
    const uint x0 = tile % tiles_x * HS_SEARCH_TILE, y0 = tile / tiles_x * HS_SEARCH_TILE;
    const uint x_end = min(x0 + HS_SEARCH_TILE, light.width_px), y_end = min(y0 + HS_SEARCH_TILE, light.height_px);
    vfloat nearest = (vfloat)(HS_EMPTY_Z);
    for (uint y = y0; y < y_end; ++y)
      for (uint x = x0; x < x_end; x += HS_LANES)
        nearest = min(nearest, load_lanes(shadow_map, (size_t)y * light.width_px + x, min(HS_LANES, (int)(x_end - x))));
    tile_depths[tile] = 1.0f / v_reduce_min(nearest);
  }
}

// How far apart the texels of two columns or rows of tiles lie, at least, but for a texel that look-ups may round away.
HS_INLINE float tile_gap_px(uint a, uint b) {
  return a == b ? 0.0f : max((float)(abs_diff(a, b) - 1u) * HS_SEARCH_TILE - 1.0f, 0.0f);
}

// search_depths: two floats a search tile: the greatest 1/z of what may hide light from a receiver in it, and of what stands in
// it or beside it. A penumbra is at most R (1/Lb - 1/L0) wide. Neither is more than nearest_d. Any number of work-items.
__kernel void spread_map_depths(const HsView light, const HsFinShape shape, const float nearest_d,
                                __global const float* tile_depths, __global float* search_depths) {
  const uint tiles_x = search_tiles(light.width_px), tiles_y = search_tiles(light.height_px);
  for (uint tile = get_global_id(0); tile < tiles_x * tiles_y; tile += get_global_size(0)) {
    const uint tx = tile % tiles_x, ty = tile / tiles_x;
    const float2 low = convert_float2((uint2)(tx, ty) * HS_SEARCH_TILE) - light.px_from_q.yw;
    const float2 q = max(fabs(low), fabs(low + HS_SEARCH_TILE)) * shape.sphere_q_per_px;
    const float radius_px = shape.radius_px * sqrt(1.0f + dot(q, q));
    float most = 0.0f, beside = 0.0f;
    for (uint v = 0; v < tiles_y; ++v) {
      const float down = tile_gap_px(v, ty);
      for (uint u = 0; u < tiles_x; ++u) {
        const float d = min(tile_depths[v * tiles_x + u], nearest_d), across = tile_gap_px(u, tx);
        const float reach = radius_px * max(d - light.d_far, 0.0f);
        if (d > most && across * across + down * down <= reach * reach) most = d;
        if (max(abs_diff(u, tx), abs_diff(v, ty)) <= 1u) beside = max(beside, d);
      }
    }
    vstore2((float2)(most, beside), tile, search_depths);
  }
}

// The part of the map that the light's disc covers, for a radius of 1: of a sphere light's, it is sqrt(1 + q^2) times as long
// away from the axis as it is across.
typedef struct {
  vfloat xx, xy, yy;
} DiscInMap;

HS_INLINE DiscInMap disc_in_map(const HsView light, const HsFinShape shape, const Receiver* r) {
  const vfloat qx = (r->u + (0.5f - light.px_from_q.y)) * shape.sphere_q_per_px,
               qy = (r->v + (0.5f - light.px_from_q.w)) * shape.sphere_q_per_px;
  const vfloat stretch = 1.0f / (sqrt(1.0f + qx * qx + qy * qy) + 1.0f);
  const DiscInMap disc = {1.0f + qx * qx * stretch, qx * qy * stretch, 1.0f + qy * qy * stretch};
  return disc;
}

// Beyond the map nothing casts, within the cone. What stands beyond the cone is not known.
HS_INLINE vint outside_map(const HsView light, vfloat u, vfloat v) {
  return (u < -0.5f) | (u > (float)light.width_px - 0.5f) | (v < -0.5f) | (v > (float)light.height_px - 0.5f);
}
HS_INLINE vint outside_cone(const HsView light, float tan_half_cone, vfloat u, vfloat v) {
  return (fabs(u + (0.5f - light.px_from_q.y)) > tan_half_cone * light.px_from_q.x) |
         (fabs(v + (0.5f - light.px_from_q.w)) > tan_half_cone * -light.px_from_q.z);
}

// How many look-ups of a search as wide as `reach` meet a blocker, and the sum of their 1/z; and the greatest 1/z of what lies
// before the receiver's plane, but not where it hides anything. 0 where there is none.
typedef struct {
  vfloat count, sum_d, beside_d;
} Blockers;

// A texel's surface at 1/z = d' is one if it lies before the receiver's plane, and if the disc covers it: within R (d' - d) of
// the receiver. So the wall of a concave corner, which lies before the floor's plane but hides nothing from it, is none. Look-ups
// round to texels, which may stand farther away than they.
HS_INLINE Blockers search_blockers(const HsView light, __global const float* shadow_map, float radius_px, uint point_count,
                                   __global const float* points, const Receiver* r, const DiscInMap* disc, vfloat reach) {
  Blockers found = {(vfloat)(0.0f), (vfloat)(0.0f), (vfloat)(0.0f)};
  const float inverse_radius = radius_px > 0.0f ? 1.0f / radius_px : 0.0f;
  for (uint i = 0; i < point_count; ++i) {
    const float px = points[i], py = points[point_count + i];
    const vfloat u = r->u + reach * (disc->xx * px + disc->xy * py), v = r->v + reach * (disc->xy * px + disc->yy * py);
    const vint x = column(light, v_int(rint(u))), y = row(light, v_int(rint(v)));
    const vfloat z = v_gather(shadow_map, y * (int)light.width_px + x);
    const vfloat texel_px = max(fabs(v_float(x) - r->u), fabs(v_float(y) - r->v));
    const vfloat distance_px = max(reach * sqrt(px * px + py * py), 0.5f * texel_px);
    const vfloat d = 1.0f / z;
    const vint before = (is_lit(r, v_float(x), v_float(y), z) == 0.0f) & v_not(outside_map(light, u, v));
    const vint blocks = before & (d > r->plane_d + distance_px * inverse_radius);
    found.count += v_select((vfloat)(0.0f), (vfloat)(1.0f), blocks);
    found.sum_d += v_select((vfloat)(0.0f), d, blocks);
    found.beside_d = max(found.beside_d, v_select((vfloat)(0.0f), d, before));
  }
  return found;
}

HS_INLINE vfloat visibility_pcss(const HsView light, float tan_half_cone, __global const float* shadow_map,
                                 const HsFinShape shape, __global const float* search_depths, uint point_count,
                                 __global const float* points, const Receiver* r) {
  const float radius_px = shape.radius_px;
  const vint x = column(light, v_int(rint(r->u))), y = row(light, v_int(rint(r->v)));
  const vint tile = y / HS_SEARCH_TILE * (int)search_tiles(light.width_px) + x / HS_SEARCH_TILE;
  vfloat nearest_d, beside_d;
  v_gather_pair(search_depths, tile * 2, &nearest_d, &beside_d);
  // Step 1, blockers.
  const vfloat reach = radius_px * max(nearest_d - r->plane_d, 0.0f);
  if (v_all((nearest_d <= r->plane_d) | r->decided)) return (vfloat)(1.0f);
  const DiscInMap disc = disc_in_map(light, shape, r);
  Blockers found = search_blockers(light, shadow_map, radius_px, point_count, points, r, &disc, reach);
  const vint nothing = (found.count == 0.0f) & v_not(r->decided);
  if (v_any(nothing)) {
    // Too few look-ups for what they should have met: again, as wide as what hides the light's centre asks for, or what lies
    // beside, or may.
    const vfloat centre_d = 1.0f / v_gather(shadow_map, y * (int)light.width_px + x);
    const vint dark = centre_d > plane_d_at(r, v_float(x) - r->u, v_float(y) - r->v);
    const vfloat near_d = v_select(v_select(found.beside_d, beside_d, found.beside_d == 0.0f), centre_d, dark);
    const vfloat near_reach = radius_px * max(near_d - r->plane_d, 0.0f);
    const vint again = nothing & (near_reach > 0.0f) & (dark | (near_reach < 0.5f * reach) | (found.beside_d > 0.0f));
    if (v_any(again)) {
      const Blockers near = search_blockers(light, shadow_map, radius_px, point_count, points, r, &disc, near_reach);
      const vint centre_alone = dark & (near.count == 0.0f);
      found.count = v_select(found.count, v_select(near.count, (vfloat)(1.0f), centre_alone), again);
      found.sum_d = v_select(found.sum_d, v_select(near.sum_d, centre_d, centre_alone), again);
    }
  }
  const vint lit = found.count == 0.0f;
  if (v_all(lit | r->decided)) return (vfloat)(1.0f);

  // Step 2, the penumbra: as wide as it were with all blockers at the mean of their 1/z.
  const vfloat width = radius_px * max(found.sum_d / max(found.count, 1.0f) - r->plane_d, 0.0f);

  // Step 3, percentage-closer filtering of that width, each look-up bilinear; those beyond the cone do not count.
  vfloat sum = (vfloat)(0.0f), known = (vfloat)(0.0f);
  for (uint i = 0; i < point_count; ++i) {
    const float px = points[i], py = points[point_count + i];
    const vfloat u = r->u + width * (disc.xx * px + disc.xy * py), v = r->v + width * (disc.xy * px + disc.yy * py);
    const Footprint f = footprint_at(light, u, v);
    const Taps taps_lit = lit_taps(light, shadow_map, r, &f);
    const vint outside = outside_map(light, u, v), unknown = outside & outside_cone(light, tan_half_cone, u, v);
    known += v_select((vfloat)(1.0f), (vfloat)(0.0f), unknown);
    sum += v_select(v_select(bilinear(&f, &taps_lit), (vfloat)(1.0f), outside), (vfloat)(0.0f), unknown);
  }
  return v_select(min(sum / max(known, 1.0f), 1.0f), (vfloat)(1.0f), lit);
}

// search_depths: see spread_map_depths.
__kernel void receive_pcss(const HsView light, const HsReceiverView view, HS_ARGS_GBUFFER, __global const float* shadow_map,
                           const HsFinShape shape, __global const float* search_depths, const uint point_count,
                           __global const float* points, HS_ARGS_VISIBILITY) {
  HS_FOR_RECEIVERS(visibility_pcss(light, view.tan_half_cone, shadow_map, shape, search_depths, point_count, points, &r))
}
