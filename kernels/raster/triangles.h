// Tile rasterization of triangles: fixed-point coverage with the top-left rule, nearest depth.
// The result does not depend on the order of triangles, of their corners, or of threads: coverage is integer, depth is computed
// from corners in a canonical order, and the nearest depth (then the lowest index) wins.

#pragma once

#include "base/tiles.h"
#include "raster/clip.h"

// A view's triangles, and the tiles' lists of them (raster/bin.cl): blocks, as many slots as they have in all, a rectangle of
// tiles a slot, and references to triangles tile by tile.
#define HS_ARGS_TRIANGLE_TILES                                                                                     \
  __global const HsBlock *triangle_blocks, const uint triangle_slot_count, __global const ushort4 *triangle_rects, \
      __global const uint *triangle_offsets, __global const uint *triangle_refs, const uint triangle_capacity

typedef struct {
  int3 a, b, e;         // edge i holds where e + a x + b y >= 0, for texel (x, y) of the tile
  float d, d_dx, d_dy;  // 1/z at texel (0, 0) of the tile, and its steps
  float d_min, d_max;   // of the corners: extrapolation stops there
  int x0, y0, x1, y1;   // texels of the tile that may be covered, inclusive
} TileTriangle;

HS_INLINE bool before_px(int4 p, int4 q) {
  return p.y < q.y || (p.y == q.y && (p.x < q.x || (p.x == q.x && p.z < q.z)));
}

// One edge function at the tile's first texel centre, from p to q with the inside to the left (y down: e >= 0).
// Its value is a multiple-of-256 step away from that of any other texel of the tile, so the lowest 8 bits never matter but for
// the fill rule: they are floored away, after the top-left rule took one off an edge that does not own its points.
// Far edges are clamped: the steps over a tile sum to less than 2^30, so the sign cannot change.
HS_INLINE void set_edge(TileTriangle* t, int i, int2 p, int2 q, int2 first_centre) {
  const int2 v = q - p;
  const int a = -v.y, b = v.x;
  const bool owns = v.y < 0 || (v.y == 0 && v.x > 0);
  const long e = (long)a * (first_centre.x - p.x) + (long)b * (first_centre.y - p.y) - (owns ? 0 : 1);
  const int clamped = (int)clamp(e >> HS_SUBPIXEL_BITS, -(long)(1 << 30), (long)(1 << 30));
  if (i == 0) {
    t->a.x = a;
    t->b.x = b;
    t->e.x = clamped;
  }
  if (i == 1) {
    t->a.y = a;
    t->b.y = b;
    t->e.y = clamped;
  }
  if (i == 2) {
    t->a.z = a;
    t->b.z = b;
    t->e.z = clamped;
  }
}

// Prepares a triangle for a tile; false if it has no area or misses the tile's texel centres.
HS_INLINE bool set_up_triangle(const HsView view, int4 p, int4 q, int4 r, int2 tile_px, TileTriangle* t) {
  int4 swap;
  if (before_px(q, p)) {
    swap = p;
    p = q;
    q = swap;
  }
  if (before_px(r, q)) {
    swap = q;
    q = r;
    r = swap;
    if (before_px(q, p)) {
      swap = p;
      p = q;
      q = swap;
    }
  }
  const int2 low = (int2)(min(p.x, min(q.x, r.x)), p.y), high = (int2)(max(p.x, max(q.x, r.x)), r.y);
  t->x0 = max(first_texel(low.x, view.mid_x_px) - tile_px.x, 0);
  t->y0 = max(first_texel(low.y, view.mid_y_px) - tile_px.y, 0);
  t->x1 = min(last_texel(high.x, view.mid_x_px) - tile_px.x, HS_TILE - 1);
  t->y1 = min(last_texel(high.y, view.mid_y_px) - tile_px.y, HS_TILE - 1);
  if (t->x0 > t->x1 || t->y0 > t->y1) return false;

  const int2 pq = q.xy - p.xy, pr = r.xy - p.xy;
  const long area = (long)pq.x * pr.y - (long)pq.y * pr.x;
  if (area == 0) return false;
  const int2 first_centre = (tile_px - (int2)((int)view.mid_x_px, (int)view.mid_y_px)) * HS_SUBPIXEL + HS_SUBPIXEL / 2;
  // Positive area runs clockwise on the screen (y down), which puts the inside where e >= 0.
  const bool forward = area > 0;
  set_edge(t, 0, p.xy, forward ? q.xy : r.xy, first_centre);
  set_edge(t, 1, forward ? q.xy : r.xy, forward ? r.xy : q.xy, first_centre);
  set_edge(t, 2, forward ? r.xy : q.xy, p.xy, first_centre);

  // The plane of 1/z, anchored at the corner farthest away: there the terms are smallest, so that near corners with their large
  // 1/z do not cost the far ones their digits.
  const float dp = as_float(p.z), dq = as_float(q.z), dr = as_float(r.z);
  const float scale = (float)HS_SUBPIXEL / (float)area;
  t->d_dx = ((dq - dp) * (float)pr.y - (dr - dp) * (float)pq.y) * scale;
  t->d_dy = ((dr - dp) * (float)pq.x - (dq - dp) * (float)pr.x) * scale;
  t->d_min = min(dp, min(dq, dr));
  t->d_max = max(dp, max(dq, dr));
  const int2 anchor = dp == t->d_min ? p.xy : dq == t->d_min ? q.xy : r.xy;
  const float2 from_anchor = convert_float2(first_centre - anchor) * (1.0f / HS_SUBPIXEL);
  t->d = t->d_min + (t->d_dx * from_anchor.x + t->d_dy * from_anchor.y);
  return true;
}

// Edge functions and 1/z of the texels from x on, in row 0 of the tile; rows are steps from there.
typedef struct {
  vint e0, e1, e2;
  vfloat d;
} Columns;

HS_INLINE Columns columns_of(const TileTriangle* t, int x) {
  const vint xs = x + v_iota;
  const Columns c = {t->e.x + t->a.x * xs, t->e.y + t->a.y * xs, t->e.z + t->a.z * xs, t->d_dx * v_float(xs)};
  return c;
}

// Coverage mask and 1/z of a row of them.
HS_INLINE vint cover(const TileTriangle* t, const Columns* c, int y, vfloat* d) {
  *d = min(max((t->d + t->d_dy * (float)y) + c->d, t->d_min), t->d_max);
  return ((c->e0 + t->b.x * y) | (c->e1 + t->b.y * y) | (c->e2 + t->b.z * y)) >= 0;
}

// Calls draw(triangle) for each piece of a scene triangle that reaches this tile: itself, or the fan of its clipped polygon.
#define HS_FOR_PIECES(view, corner, vertices_vs, vertices_px, tile_px, tile_triangle)                                            \
  int4 hs_polygon[HS_CLIP_VERTICES];                                                                                             \
  hs_polygon[0] = vertices_px[corner.x];                                                                                         \
  hs_polygon[1] = vertices_px[corner.y];                                                                                         \
  hs_polygon[2] = vertices_px[corner.z];                                                                                         \
  int hs_count = 3;                                                                                                              \
  if ((hs_polygon[0].w | hs_polygon[1].w | hs_polygon[2].w) != 0)                                                                \
    hs_count = clip_triangle(view, vertices_vs[corner.x].xyz, vertices_vs[corner.y].xyz, vertices_vs[corner.z].xyz, hs_polygon); \
  for (int hs_piece = 2; hs_piece < hs_count; ++hs_piece)                                                                        \
    if (set_up_triangle(view, hs_polygon[0], hs_polygon[hs_piece - 1], hs_polygon[hs_piece], tile_px, &tile_triangle))

// Calls the body with `triangle` for each triangle listed for this tile.
#define HS_FOR_TILE_TRIANGLES(triangle)                                                                            \
  const uint hs_tile = get_group_id(0);                                                                            \
  const bool hs_overflow = bins_overflow(triangle_offsets, view.tiles_x * view.tiles_y, triangle_capacity);        \
  const uint hs_first = hs_overflow ? 0 : triangle_offsets[hs_tile],                                               \
             hs_last = hs_overflow ? triangle_slot_count : triangle_offsets[hs_tile + 1];                          \
  for (uint hs_i = hs_first, triangle; hs_i < hs_last; ++hs_i)                                                     \
    if (hs_overflow ? (rect_has(triangle_rects[hs_i], hs_tile, view.tiles_x)                                       \
                           ? (triangle = triangle_blocks[hs_i / HS_BLOCK_SIZE].first + hs_i % HS_BLOCK_SIZE, true) \
                           : false)                                                                                \
                    : (triangle = triangle_refs[hs_i], true))
