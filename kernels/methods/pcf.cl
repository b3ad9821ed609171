// pcf: Reeves, Salesin & Cook 1987. Comparisons first, then their filter.

#include "base/receiver.h"

// pcf 2x2: Reeves et al. 1987. Comparisons at the four nearest texels, then bilinear.
HS_INLINE vfloat visibility_pcf2(const HsView light, const Receiver* r, __global const float* shadow_map) {
  const Footprint f = footprint(light, r);
  const Taps lit = lit_taps(light, shadow_map, r, &f);
  return bilinear(&f, &lit);
}

// Weight of tap 0..3 of the uniform cubic B-spline at t in 0..1 between taps 1 and 2.
HS_INLINE vfloat cubic_weight(int tap, vfloat t) {
  const vfloat s = 1.0f - t;
  if (tap == 0) return s * s * s * (1.0f / 6.0f);
  if (tap == 1) return (4.0f - 6.0f * t * t + 3.0f * t * t * t) * (1.0f / 6.0f);
  if (tap == 2) return (4.0f - 6.0f * s * s + 3.0f * s * s * s) * (1.0f / 6.0f);
  return t * t * t * (1.0f / 6.0f);
}

// pcf 4x4: comparisons weighted by the uniform cubic B-spline.
HS_INLINE vfloat visibility_pcf4(const HsView light, const Receiver* r, __global const float* shadow_map) {
  const vfloat u = floor(r->u), v = floor(r->v);
  vfloat sum = (vfloat)(0.0f);
  for (int j = 0; j < 4; ++j) {
    vfloat along = (vfloat)(0.0f);
    for (int i = 0; i < 4; ++i)
      along += cubic_weight(i, r->u - u) *
               lit_at(light, shadow_map, r, column(light, v_int(u) + (i - 1)), row(light, v_int(v) + (j - 1)));
    sum += cubic_weight(j, r->v - v) * along;
  }
  return min(sum, 1.0f);  // the weights add up to 1 but for rounding
}

__kernel void receive_pcf2(const HsView light, const HsReceiverView view, HS_ARGS_GBUFFER, __global const float* shadow_map,
                           HS_ARGS_VISIBILITY){HS_FOR_RECEIVERS(visibility_pcf2(light, &r, shadow_map))}

__kernel void receive_pcf4(const HsView light, const HsReceiverView view, HS_ARGS_GBUFFER, __global const float* shadow_map,
                           HS_ARGS_VISIBILITY) {
  HS_FOR_RECEIVERS(visibility_pcf4(light, &r, shadow_map))
}
