// Normals of faces, the same whichever corner a file begins with.

#pragma once

#include "base/view.h"

// Normal (not unit) of a triangle, from the corners' differences: exact enough far from the origin.
inline float3 face_normal(float3 a, float3 b, float3 c, float3* anchor) {
  const bool odd = sort_corners(&a, &b, &c);
  const float3 n = cross(b - a, c - a);
  *anchor = a;
  return odd ? -n : n;
}

// Of length 1, or 0 for a face without area. Scaled first: the square of a tiny face's normal would underflow.
HS_INLINE float3 unit_normal(float3 n) {
  const float largest = max(fabs(n.x), max(fabs(n.y), fabs(n.z)));
  if (!(largest > 0.0f)) return (float3)(0.0f);
  n /= largest;
  return n * (1.0f / sqrt(dot(n, n)));
}
