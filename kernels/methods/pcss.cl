// pcss: Fernando 2005, "Percentage-Closer Soft Shadows". What blocks the light around the receiver is searched for in the shadow
// map; its mean depth gives the width of the penumbra, and that the width of a filter over comparisons.
//
// Widths are in texels, from R (1/Lb - 1/Lr) with R in texels at unit distance: that of the part of the map that the light's disc
// covers, as the receiver sees it, at Lb. The same points of the unit disc serve both steps: every x, then every y.

#include "base/receiver.h"

// Beyond the map nothing casts.
HS_INLINE vint outside_map(const HsView light, vfloat u, vfloat v) {
  return (u < -0.5f) | (u > (float)light.width_px - 0.5f) | (v < -0.5f) | (v > (float)light.height_px - 0.5f);
}

HS_INLINE vfloat visibility_pcss(const HsView light, __global const float* shadow_map, const HsFinShape shape, float nearest_d,
                                 uint point_count, __global const float* points, const Receiver* r) {
  const float radius_px = shape.radius_px;
  const vfloat qx = (r->u + (0.5f - light.px_from_q.y)) * shape.sphere_q_per_px,
               qy = (r->v + (0.5f - light.px_from_q.w)) * shape.sphere_q_per_px;
  // The part of the map that a sphere light's disc covers is sqrt(1 + q^2) times as long away from the axis as it is across.
  const vfloat stretch = 1.0f / (sqrt(1.0f + qx * qx + qy * qy) + 1.0f);
  const vfloat xx = 1.0f + qx * qx * stretch, xy = qx * qy * stretch, yy = 1.0f + qy * qy * stretch;
  // Step 1, blockers: up to where the nearest caster's depth would be one's.
  const vfloat reach = radius_px * max(nearest_d - r->plane_d, 0.0f);
  vfloat blocker_count = (vfloat)(0.0f), sum_d = (vfloat)(0.0f);
  for (uint i = 0; i < point_count; ++i) {
    const float px = points[i], py = points[point_count + i];
    const vfloat u = r->u + reach * (xx * px + xy * py), v = r->v + reach * (xy * px + yy * py);
    const vint x = column(light, v_int(rint(u))), y = row(light, v_int(rint(v)));
    const vfloat z = v_gather(shadow_map, y * (int)light.width_px + x);
    const vint blocks = (is_lit(r, v_float(x), v_float(y), z) == 0.0f) & v_not(outside_map(light, u, v));
    blocker_count += v_select((vfloat)(0.0f), (vfloat)(1.0f), blocks);
    sum_d += v_select((vfloat)(0.0f), 1.0f / z, blocks);
  }
  const vint lit = blocker_count == 0.0f;
  if (v_all(lit | r->decided)) return (vfloat)(1.0f);

  // Step 2, the penumbra: as wide as it were with all blockers at the mean of their 1/z.
  const vfloat width = radius_px * max(sum_d / max(blocker_count, 1.0f) - r->plane_d, 0.0f);

  // Step 3, percentage-closer filtering of that width, each look-up bilinear.
  vfloat sum = (vfloat)(0.0f);
  for (uint i = 0; i < point_count; ++i) {
    const float px = points[i], py = points[point_count + i];
    const vfloat u = r->u + width * (xx * px + xy * py), v = r->v + width * (xy * px + yy * py);
    const Footprint f = footprint_at(light, u, v);
    const Taps taps_lit = lit_taps(light, shadow_map, r, &f);
    sum += v_select(bilinear(&f, &taps_lit), (vfloat)(1.0f), outside_map(light, u, v));
  }
  return v_select(min(sum / (float)point_count, 1.0f), (vfloat)(1.0f), lit);
}

__kernel void receive_pcss(const HsView light, const HsReceiverView view, HS_ARGS_GBUFFER, __global const float* shadow_map,
                           const HsFinShape shape, const float nearest_d, const uint point_count, __global const float* points,
                           HS_ARGS_VISIBILITY) {
  HS_FOR_RECEIVERS(visibility_pcss(light, shadow_map, shape, nearest_d, point_count, points, &r))
}
