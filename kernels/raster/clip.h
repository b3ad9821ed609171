// Triangles that reach beyond the near plane or the guard band.

#pragma once

#include "base/view.h"

// Triangles of a view: uint[3] a triangle, and vertices as raster/transform.cl writes them.
#define HS_ARGS_TRIANGLES __global const uint *triangles, __global const float4 *vertices_vs, __global const int4 *vertices_px

// Clips a triangle against the near plane and the guard band, before the divide (Sutherland & Hodgman), into fixed-point
// vertices of a convex polygon. Returns their number, 0 or 3 .. HS_CLIP_VERTICES.
// A cut point is computed from the inside vertex to the outside one, whichever triangle asks, so that neighbours agree about it.
// The polygon does not depend on where the file begins the triangle.
#define HS_CLIP_VERTICES 8
inline int clip_triangle(const HsView view, float3 a, float3 b, float3 c, int4* polygon) {
  float3 in[HS_CLIP_VERTICES], out[HS_CLIP_VERTICES];
  sort_corners(&a, &b, &c);
  in[0] = homogeneous_px(view, a);
  in[1] = homogeneous_px(view, b);
  in[2] = homogeneous_px(view, c);
  int count = 3;
  for (int plane = 0; plane < 5 && count > 0; ++plane) {
    int kept = 0;
    for (int i = 0; i < count; ++i) {
      const float3 p = in[i], q = in[i + 1 < count ? i + 1 : 0];
      const float guard = (float)HS_GUARD_PX;
      const float fp = plane == 0   ? p.z - view.znear
                       : plane == 1 ? guard * p.z - p.x
                       : plane == 2 ? guard * p.z + p.x
                       : plane == 3 ? guard * p.z - p.y
                                    : guard * p.z + p.y;
      const float fq = plane == 0   ? q.z - view.znear
                       : plane == 1 ? guard * q.z - q.x
                       : plane == 2 ? guard * q.z + q.x
                       : plane == 3 ? guard * q.z - q.y
                                    : guard * q.z + q.y;
      if (fp >= 0.0f && kept < HS_CLIP_VERTICES) out[kept++] = p;
      if ((fp >= 0.0f) != (fq >= 0.0f) && kept < HS_CLIP_VERTICES)
        out[kept++] = fp >= 0.0f ? p + (fp / (fp - fq)) * (q - p) : q + (fq / (fq - fp)) * (p - q);
    }
    for (int i = 0; i < kept; ++i) in[i] = out[i];
    count = kept;
  }
  for (int i = 0; i < count; ++i) {
    in[i].z = max(in[i].z, view.znear);
    polygon[i] = (int4)(snap_px(in[i]), as_int(1.0f / in[i].z), 0);
  }
  return count;
}

// First texel whose centre is at or after a fixed-point coordinate, and last whose centre is at or before it.
inline int first_texel(int fixed_px, uint mid_px) {
  return ((fixed_px + HS_SUBPIXEL / 2 - 1) >> HS_SUBPIXEL_BITS) + (int)mid_px;
}
inline int last_texel(int fixed_px, uint mid_px) {
  return ((fixed_px - HS_SUBPIXEL / 2) >> HS_SUBPIXEL_BITS) + (int)mid_px;
}
