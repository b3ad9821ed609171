// Potential silhouettes in the light map, and which receivers may have them before the disc.

#pragma once

#include "methods/exact/edge_block.h"
#include "silhouettes/fin_shape.h"

// A surface nearer to a receiver than this part of its depth is the receiver itself.
#define HS_BEYOND 0.99999905f  // 1 - 2^-20

// How many blocks so many edges fill, and how many of them are in a block.
HS_INLINE uint blocks_of(uint edge_count) {
  return (edge_count + HS_LANES - 1) / HS_LANES;
}

HS_INLINE int edges_in_block(uint block, uint edge_count) {
  return (int)min(edge_count - block * HS_LANES, (uint)HS_LANES);
}

// Edges in the map. One is seen before the disc from within R (d_edge - d_receiver) of its projection, a radius that is linear
// along it, as is the projection in d = 1/z: from within the convex hull of two discs.
typedef struct {
  vfloat ax, ay, bx, by;  // texels
  vfloat da, db;          // 1/z
  vint everywhere;        // it comes too near to the light's plane, or behind it, to be projected
} MapEdges;

HS_INLINE void project_to_map(const HsView view, vfloat ax, vfloat ay, vfloat az, vfloat bx, vfloat by, vfloat bz, MapEdges* e) {
#pragma OPENCL FP_CONTRACT ON
  e->everywhere = min(az, bz) * view.d_far < 1e-6f;
  e->da = 1.0f / az;
  e->db = 1.0f / bz;
  e->ax = ax * e->da * view.px_from_q.x + view.px_from_q.y;
  e->ay = ay * e->da * view.px_from_q.z + view.px_from_q.w;
  e->bx = bx * e->db * view.px_from_q.x + view.px_from_q.y;
  e->by = by * e->db * view.px_from_q.z + view.px_from_q.w;
}

// How far from an end of an edge in the map receivers may be that have it before their disc, or within HS_NEAR_PX of it.
HS_INLINE vfloat edge_reach(float radius_px, vfloat d, vfloat d_far) {
  return radius_px * max(d - d_far, 0.0f) + (HS_NEAR_PX + 0.25f);
}

// Which edges receivers within half_px of a place in the map may be as near to. d_far: 1/z of the farthest of them.
HS_INLINE vint reach_receivers(const MapEdges* e, float radius_px, float2 middle_px, float2 half_px, float d_far) {
#pragma OPENCL FP_CONTRACT ON
  const vfloat ax = e->ax - middle_px.x, ay = e->ay - middle_px.y, bx = e->bx - middle_px.x, by = e->by - middle_px.y;
  const vfloat ra = edge_reach(radius_px, e->da, (vfloat)(d_far)), rb = edge_reach(radius_px, e->db, (vfloat)(d_far));
  const vfloat ex = bx - ax, ey = by - ay;
  const vfloat limit = max(ra, rb) * sqrt(ex * ex + ey * ey) * 1.00001f + fabs(ex) * half_px.y + fabs(ey) * half_px.x;
  const vint near = (min(ax - ra, bx - rb) <= half_px.x) & (max(ax + ra, bx + rb) >= -half_px.x) &
                    (min(ay - ra, by - rb) <= half_px.y) & (max(ay + ra, by + rb) >= -half_px.y) &
                    (fabs(ax * ey - ay * ex) <= limit);
  return e->everywhere | (near & (max(e->da, e->db) >= d_far * HS_BEYOND));
}
