// The geometry of a view: projection to texels, fixed point, and an order of corners that files cannot change.

#pragma once

#include "base/lanes.h"

// View space to texels: (px, py, 1/z). Only for z >= znear.
HS_INLINE float3 project_px(const HsView view, float3 p) {
  const float d = 1.0f / p.z;
  return (float3)(p.x * d * view.px_from_q.x + view.px_from_q.y, p.y * d * view.px_from_q.z + view.px_from_q.w, d);
}

// View space to texels from the middle of the map, times z: (x z, y z, z). Linear, so that clipping can cut it.
inline float3 homogeneous_px(const HsView view, float3 p) {
  return (float3)(p.x * view.px_from_q.x + p.z * (view.px_from_q.y - (float)view.mid_x_px),
                  p.y * view.px_from_q.z + p.z * (view.px_from_q.w - (float)view.mid_y_px), p.z);
}

// To fixed point, for 0 < z and |x|, |y| within the guard band. The one place where vertices are snapped: a triangle that was
// clipped and its neighbour that was not agree about their common corners.
inline int2 snap_px(float3 p) {
  const float2 from_mid = clamp(p.xy * (1.0f / p.z), -(float)HS_GUARD_PX, (float)HS_GUARD_PX);
  return convert_int2_rte(from_mid * (float)HS_SUBPIXEL);
}

// Orders three points so that the result of a computation on them does not depend on where the file begins the triangle.
// Returns true if the order was odd (the winding is reversed).
inline bool sort_corners(float3* a, float3* b, float3* c) {
#define HS_LESS(p, q) ((p).x < (q).x || ((p).x == (q).x && ((p).y < (q).y || ((p).y == (q).y && (p).z < (q).z))))
  bool odd = false;
  float3 t;
  if (HS_LESS(*b, *a)) {
    t = *a;
    *a = *b;
    *b = t;
    odd = !odd;
  }
  if (HS_LESS(*c, *b)) {
    t = *b;
    *b = *c;
    *c = t;
    odd = !odd;
    if (HS_LESS(*b, *a)) {
      t = *a;
      *a = *b;
      *b = t;
      odd = !odd;
    }
  }
#undef HS_LESS
  return odd;
}
