// Exact soft shadows: centre-anchored depth complexity (docs/design.md, "Exact soft shadows").
//
// For a receiver p and a point s of the light's disc, D(s) is the number of surfaces that the segment from p to s crosses; s is
// seen iff D(s) = 0. Project the scene from p onto the light's plane (origin: the centre c). With sigma_f = +1 where p is before
// face f, the projected triangle turns counter-clockwise, and D(s) = sum over faces of sigma_f times the winding number of the
// triangle about s. Summed over edges, only silhouettes as seen from p remain, with multiplicity m_p(e) = sum of o(e,f) sigma_f:
//
//   D(s) = D(c) - sum of m_p(e) over edges A -> B that the path from c to s crosses from their left to their right
//               + sum of m_p(e) over those that it crosses from right to left
//
// What keeps the sums whole in floating point: a face has one sign for one p, and a vertex one projection, whichever edge asks;
// "c is left of AB" is one expression, in the edge's stored direction, in the walk as in the centre count; and which samples lie
// between the directions of A and B is decided a vertex at a time, by angles, by which the samples are sorted. The last is
// also what makes it fast: an edge is tested only against the samples in its own wedge, mostly none or one of hundreds. Of 256
// samples, the wedges of the 57 edges that pass before the disc from an average pixel of a scanned figure (39,000 triangles) hold
// 80 vectors of 16 in all, where testing every edge against every sample takes 57 x 16 = 912; bit-sliced counters would take
// 57 x 8 words and as many masks to make. The counting itself is then a quarter of the time; another quarter projects edges.

#pragma once

#include "methods/exact/edge_lists.h"
#include "methods/exact/touching_faces.h"
#include "raster/clip.h"

// Planes of the triangles, their sides of the disc, and those that touch the light: see orient_faces_to_disc.
#define HS_ARGS_DISC_FACES __global const float4 *planes, __global const uchar *disc_sides, __global const uint *touching

// The light's sample points as host/light/samples.hpp's SampleTable has them.
#define HS_ARGS_SAMPLES                                                                                                      \
  __global const float *samples, __global const ushort *below, __global const float *weights, __global const float *cell_xy, \
      __global const ushort *cells, __global const float *window_xy, __global const ushort *windows

#if HS_LANES == 16
typedef short16 v_short;
#define v_short_of convert_short16
#define v_int_of_short convert_int16
HS_INLINE int short_lane_count(short16 mask) {
  return lane_count(convert_int16(mask));
}
#else
typedef short v_short;
#define v_short_of(mask) ((short)-((mask) != 0))
#define v_int_of_short (int)
#define short_lane_count(mask) ((mask) != 0)
#endif

HS_INLINE float3 cross3(float3 a, float3 b) {
  return (float3)(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

// A point's place in the light map relative to p's, times both depths.
HS_INLINE vfloat map_x(vfloat a, vfloat az, vfloat p, vfloat pz) {
  return a * pz - p * az;
}

// Whether the light's centre, as seen from p, is left of the edge a -> b, given by map_x and in its stored direction. The one
// place where it is decided.
HS_INLINE vint left_of_centre(vfloat ax, vfloat ay, vfloat bx, vfloat by) {
  return ax * by - ay * bx > 0.0f;
}

// An edge projected from p onto the light's plane, its part at or beyond p cut off.
typedef struct {
  vfloat ax, ay, bx, by;
  vfloat far_z;  // of the end farther from the light
  vint seen;     // 0: all of it lies beyond p
} ProjectedEdge;

HS_INLINE ProjectedEdge project_edge(vfloat ax, vfloat ay, vfloat az, vfloat bx, vfloat by, vfloat bz, vfloat px, vfloat py,
                                     vfloat pz) {
  const vfloat limit = pz * HS_BEYOND;
  const vint a_beyond = az > limit, b_beyond = bz > limit;
  ProjectedEdge e;
  e.seen = v_not(a_beyond & b_beyond);
  if (v_any(a_beyond | b_beyond)) {
    const vfloat t = (limit - bz) / v_select(az - bz, (vfloat)(1.0f), az == bz);
    const vfloat cut_x = bx + (ax - bx) * t, cut_y = by + (ay - by) * t;
    ax = v_select(ax, cut_x, a_beyond);
    ay = v_select(ay, cut_y, a_beyond);
    az = v_select(az, limit, a_beyond);
    bx = v_select(bx, cut_x, b_beyond);
    by = v_select(by, cut_y, b_beyond);
    bz = v_select(bz, limit, b_beyond);
  }
  const vfloat ta = az / (pz - az), tb = bz / (pz - bz);
  e.ax = ax + (ax - px) * ta;
  e.ay = ay + (ay - py) * ta;
  e.bx = bx + (bx - px) * tb;
  e.by = by + (by - py) * tb;
  e.far_z = max(az, bz);
  return e;
}

// Grows with the angle from the x axis, 0 .. 4, a quarter turn being 1 (L1 norm). host/light_samples.cpp has the same.
HS_INLINE vfloat turn_of(vfloat x, vfloat y) {
  const vfloat t = x / max(fabs(x) + fabs(y), 1e-30f);
  return v_select(3.0f + t, 1.0f - t, y >= 0.0f);
}

// Numbers of a table.
HS_INLINE vint gather_ushorts(__global const ushort* p, vint i) {
#if HS_LANES == 16
  return (int16)(p[i.s0], p[i.s1], p[i.s2], p[i.s3], p[i.s4], p[i.s5], p[i.s6], p[i.s7], p[i.s8], p[i.s9], p[i.sa], p[i.sb],
                 p[i.sc], p[i.sd], p[i.se], p[i.sf]);
#else
  return p[i];
#endif
}

// The light's sample points: SampleTable in host/light_samples.hpp.
typedef struct {
  __global const float* samples;    // x of all, y of all, turns of all: sorted by angle
  __global const ushort* below;     // for turns in equal steps: how many samples' are below
  __global const float* weights;    // red, green, blue of all, of a light with a texture
  __global const float* cell_xy;    // x of all, padding, y of all, padding: sorted by cell
  __global const ushort* cells;     // where each cell begins in them, one more, then their numbers in `samples`, padding
  __global const float* window_xy;  // x of 16, y of 16, for each cell of a grid twice as fine: those of 3 columns and rows
  __global const ushort* windows;   // their numbers in `samples`; the first is 65535 where there are more
} SampleSet;

// What the walk over the edges finds out about one receiver.
typedef struct {
  bool touched;  // its counts are set
  bool near;     // a silhouette passes so near that the shadow map cannot be asked about the centre
} Walk;

HS_INLINE void touch_counts(Walk* walk, int n, v_short* counts) {
  if (walk->touched) return;
  walk->touched = true;
  for (int k = 0; k < n / HS_LANES; ++k) counts[k] = (v_short)((short)0);
}

// The axes of a sphere light's disc that faces a receiver: light space turned about its origin, as little as brings z to where p
// is.
typedef struct {
  float3 x, y, z;
} Facing;

HS_INLINE Facing facing_of(float px, float py, float pz) {
  const float3 z = (float3)(px, py, pz) / sqrt(px * px + py * py + pz * pz);
  const float k = 1.0f / (1.0f + z.z);
  const Facing f = {(float3)(1.0f - z.x * z.x * k, -z.x * z.y * k, -z.x), (float3)(-z.x * z.y * k, 1.0f - z.y * z.y * k, -z.y),
                    z};
  return f;
}

// An edge projected onto the plane of the disc that faces a receiver, from p_z before its centre. What lies behind that plane is
// cut off: edges near a sphere light have not been cut before.
HS_INLINE ProjectedEdge project_to_facing_disc(const Facing* facing, float p_z, vfloat ax_ls, vfloat ay_ls, vfloat az_ls,
                                               vfloat bx_ls, vfloat by_ls, vfloat bz_ls) {
  vfloat ax = along_axis(facing->x, ax_ls, ay_ls, az_ls), ay = along_axis(facing->y, ax_ls, ay_ls, az_ls),
         az = along_axis(facing->z, ax_ls, ay_ls, az_ls);
  vfloat bx = along_axis(facing->x, bx_ls, by_ls, bz_ls), by = along_axis(facing->y, bx_ls, by_ls, bz_ls),
         bz = along_axis(facing->z, bx_ls, by_ls, bz_ls);
  const vint a_behind = az < 0.0f, b_behind = bz < 0.0f;
  if (v_any(a_behind | b_behind)) {
    const vfloat t = az / v_select(az - bz, (vfloat)(1.0f), az == bz);
    const vfloat cut_x = ax + (bx - ax) * t, cut_y = ay + (by - ay) * t;
    ax = v_select(ax, cut_x, a_behind);
    ay = v_select(ay, cut_y, a_behind);
    bx = v_select(bx, cut_x, b_behind);
    by = v_select(by, cut_y, b_behind);
  }
  ProjectedEdge e = project_edge(ax, ay, max(az, 0.0f), bx, by, max(bz, 0.0f), (vfloat)(0.0f), (vfloat)(0.0f), (vfloat)(p_z));
  e.seen &= v_not(a_behind & b_behind);
  return e;
}

// Edges that pass before a receiver's disc, projected onto the light's plane. (Longer than need be: see EdgePool.)
typedef struct {
  float ax[HS_LISTED + HS_LANES], ay[HS_LISTED + HS_LANES], bx[HS_LISTED + HS_LANES], by[HS_LISTED + HS_LANES];
  float c[HS_LISTED + HS_LANES];   // a x b
  int left[HS_LISTED + HS_LANES];  // not 0 where the centre is left of a -> b
  int m[HS_LISTED + HS_LANES];
} Passing;

// Of a projected edge's distance from the centre the square; *c: a x b. The line is held by its nearer end: the other may be very
// far.
HS_INLINE vfloat distance2_of(const ProjectedEdge* e, vfloat* c) {
  const vfloat ex = e->bx - e->ax, ey = e->by - e->ay;
  const vfloat a2 = e->ax * e->ax + e->ay * e->ay, b2 = e->bx * e->bx + e->by * e->by, e2 = max(ex * ex + ey * ey, 1e-30f);
  *c = v_select(e->bx * ey - e->by * ex, e->ax * ey - e->ay * ex, a2 <= b2);
  const vint foot_inside = (e->ax * ex + e->ay * ey < 0.0f) & (e->bx * ex + e->by * ey > 0.0f);
  return v_select(min(a2, b2), *c * *c / e2, foot_inside);
}

// Whether that is within HS_NEAR_PX in the map, of a receiver at depth p_z.
HS_INLINE vint passes_near(const HsDisc disc, const ProjectedEdge* e, vfloat distance2, vfloat p_z) {
  const vfloat near = disc.near_q * e->far_z * p_z;  // times p_z - far_z, against which it stands
  const vfloat gap = p_z - e->far_z;
  return distance2 * gap * gap <= near * near;
}

// Finds the silhouettes of `list` as seen from p that pass before the disc. Returns their number, padded with edges that hide
// nothing.
HS_INLINE int project_edges(const EdgePool* list, int first, int count, const HsDisc disc, float px, float py, float pz,
                            Passing* passing, Walk* walk) {
  int taken = 0;
  const Facing facing = facing_of(px, py, pz);
  const float p_z = disc.sphere ? dot(facing.z, (float3)(px, py, pz)) : pz;  // how far p lies before the disc's plane
  for (int i = first; i < first + count; i += HS_LANES) {
    const vint front0 =
        v_load(list->n0x + i) * px + v_load(list->n0y + i) * py + v_load(list->n0z + i) * pz >= v_load(list->n0w + i);
    const vint front1 =
        v_load(list->n1x + i) * px + v_load(list->n1y + i) * py + v_load(list->n1z + i) * pz >= v_load(list->n1w + i);
    const vint o0 = v_load(list->o0 + i), o1 = v_load(list->o1 + i);
    const vint m = v_load(list->m + i) + v_select(-o0, o0, front0) + v_select(-o1, o1, front1);
    if (!v_any(m != 0)) continue;
    const vfloat ax_ls = v_load(list->ax + i), ay_ls = v_load(list->ay + i), az_ls = v_load(list->az + i);
    const vfloat bx_ls = v_load(list->bx + i), by_ls = v_load(list->by + i), bz_ls = v_load(list->bz + i);
    const ProjectedEdge e = disc.sphere ? project_to_facing_disc(&facing, p_z, ax_ls, ay_ls, az_ls, bx_ls, by_ls, bz_ls)
                                        : project_edge(ax_ls, ay_ls, az_ls, bx_ls, by_ls, bz_ls, px, py, pz);
    const vint live = (m != 0) & e.seen;

    vfloat c;
    const vfloat distance2 = distance2_of(&e, &c);
    if (v_any(live & passes_near(disc, &e, distance2, (vfloat)(p_z)))) walk->near = true;
    const vint reaches = live & (distance2 < disc.reach2);
    const uint bits = lane_bits(reaches);
    if (bits == 0) continue;
    const vint left = left_of_centre(map_x(ax_ls, az_ls, px, pz), map_x(ay_ls, az_ls, py, pz), map_x(bx_ls, bz_ls, px, pz),
                                     map_x(by_ls, bz_ls, py, pz));
    v_store_chosen(e.ax, bits, passing->ax + taken);
    v_store_chosen(e.ay, bits, passing->ay + taken);
    v_store_chosen(e.bx, bits, passing->bx + taken);
    v_store_chosen(e.by, bits, passing->by + taken);
    v_store_chosen(c, bits, passing->c + taken);
    v_store_chosen_ints(left, bits, passing->left + taken);
    v_store_chosen_ints(m, bits, passing->m + taken);
    taken += (int)popcount(bits);
  }
  for (int i = taken; i & (HS_LANES - 1); ++i) {
    passing->ax[i] = passing->ay[i] = passing->bx[i] = passing->by[i] = passing->c[i] = 0.0f;
    passing->left[i] = passing->m[i] = 0;
  }
  return taken;
}

// Capacities for edges, and for vectors of samples. For one of each registers do.
#if HS_LANES == 16
#define HS_WEDGES 128
#define HS_REACHED 512
#else
#define HS_WEDGES 1
#define HS_REACHED 1
#endif

// Edges, and the vectors of samples that their wedges reach into: one list, for loops for each edge, seldom as long as the one
// before, would take twice as long; and of many edges, for what one of them waits for is hidden by others.
typedef struct {
  float ex[HS_WEDGES], ey[HS_WEDGES], c[HS_WEDGES];
  int crossings[HS_WEDGES];                  // what an edge adds to the samples in the wedge that are beyond it
  int reached[HS_REACHED];                   // an edge, and HS_WEDGES times the first sample of a vector
  float begin[HS_REACHED], end[HS_REACHED];  // which turns of the vector's samples are in the wedge
} Wedges;

// Adds the crossings of all that is listed to the counts, and empties the list.
HS_INLINE void cross_wedges(const SampleSet* set, int n, const Wedges* wedges, int* reached_count, v_short* counts) {
  for (int i = 0; i < *reached_count; ++i) {
    const uint reached = (uint)wedges->reached[i], edge = reached & (HS_WEDGES - 1), k = reached / HS_WEDGES;
    const vfloat x = v_load(set->samples + k), y = v_load(set->samples + n + k), turns = v_load(set->samples + 2 * n + k);
    const vint crossed =
        (turns >= wedges->begin[i]) & (turns < wedges->end[i]) & (x * wedges->ey[edge] - y * wedges->ex[edge] > wedges->c[edge]);
    counts[k / HS_LANES] += v_short_of(crossed) & (short)wedges->crossings[edge];
  }
  *reached_count = 0;
}

// Adds the crossings of those edges to the receiver's counts, one a sample.
HS_INLINE void count_crossings(const Passing* passing, int passing_count, const HsDisc disc, float2 rotation,
                               const SampleSet* set, v_short* counts, Walk* walk) {
  const int n = (int)disc.sample_count;
  Wedges wedges;
  int reached_count = 0;
  for (int i = 0; i < passing_count; i += HS_LANES) {
    const int to = i & (HS_WEDGES - 1);
    if (to == 0) cross_wedges(set, n, &wedges, &reached_count, counts);
    vfloat ax = v_load(passing->ax + i), ay = v_load(passing->ay + i), bx = v_load(passing->bx + i), by = v_load(passing->by + i);
    vfloat ex = bx - ax, ey = by - ay, c = v_load(passing->c + i);
    // Cut to the disc: the wedge holds no more samples than the edge can hide. Ends within the disc stay as they are, so that
    // the edges that meet there agree about every sample.
    const vfloat inverse = 1.0f / max(ex * ex + ey * ey, 1e-30f);
    const vfloat half_chord = sqrt(max(disc.reach2 - c * c * inverse, 0.0f) * inverse);
    const vfloat foot_x = c * ey * inverse, foot_y = -c * ex * inverse;
    const vint a_out = ax * ax + ay * ay > disc.reach2, b_out = bx * bx + by * by > disc.reach2;
    ax = v_select(ax, foot_x - ex * half_chord, a_out);
    ay = v_select(ay, foot_y - ey * half_chord, a_out);
    bx = v_select(bx, foot_x + ex * half_chord, b_out);
    by = v_select(by, foot_y + ey * half_chord, b_out);
    if (disc.rotated) {
      vfloat t;
      t = ax * rotation.x - ay * rotation.y;
      ay = ax * rotation.y + ay * rotation.x;
      ax = t;
      t = bx * rotation.x - by * rotation.y;
      by = bx * rotation.y + by * rotation.x;
      bx = t;
      t = ex * rotation.x - ey * rotation.y;
      ey = ex * rotation.y + ey * rotation.x;
      ex = t;
    }
    const vfloat turn_a = turn_of(ax, ay), turn_b = turn_of(bx, by);
    vfloat turned = turn_b - turn_a;
    turned += v_select((vfloat)(0.0f), (vfloat)(4.0f), turned < -2.0f) - v_select((vfloat)(0.0f), (vfloat)(4.0f), turned >= 2.0f);
    // Beyond a quarter turn the edge passes before the centre, and the side it passes on is the centre count's decision too.
    const vint centre_left = v_select(turned > 0.0f, v_load(passing->left + i) != 0, fabs(turned) > 1.0f);
    // The wedge's samples are those with turns from `begin` to `end`; where it goes past a whole turn, those from `begin` on and
    // those up to `end`. In their order they are all between `first` and `last`, which are a whole turn more there.
    const vfloat begin = v_select(turn_b, turn_a, centre_left), end = v_select(turn_a, turn_b, centre_left);
    const vint whole_turn = end < begin;
    const vint most_turn = (vint)((int)(4.0f * disc.table_per_turn) + 1);
    const vint first = gather_ushorts(set->below, clamp(v_int(begin * disc.table_per_turn), (vint)(0), most_turn));
    const vint last = gather_ushorts(set->below, clamp(v_int(end * disc.table_per_turn) + 1, (vint)(0), most_turn)) +
                      v_select((vint)(0), (vint)(n), whole_turn);
    const vint m = v_load(passing->m + i);
    const vint hides = (m != 0) & (first < last);
    if (!v_any(hides)) continue;

    // The edge is crossed by s in the wedge with c - s x e beyond it. The walk from right to left is that of the edge reversed.
    const vfloat direction = v_select((vfloat)(-1.0f), (vfloat)(1.0f), centre_left);
    v_store(c * direction, wedges.c + to);
    v_store(ex * (direction * disc.radius), wedges.ex + to);
    v_store(ey * (direction * disc.radius), wedges.ey + to);
    v_store(v_select(m, -m, centre_left), wedges.crossings + to);
    touch_counts(walk, n, counts);
    vint at = first & -HS_LANES;
    for (uint bits = lane_bits(hides); bits != 0; bits = lane_bits(hides & (at < last))) {
      if (reached_count > HS_REACHED - HS_LANES) cross_wedges(set, n, &wedges, &reached_count, counts);
      const vint again = at >= n;  // after a whole turn
      v_store_chosen_ints((at & (n - 1)) * HS_WEDGES + to + v_iota, bits, wedges.reached + reached_count);
      v_store_chosen(v_select(begin, (vfloat)(-1.0f), again), bits, wedges.begin + reached_count);
      v_store_chosen(v_select(end, (vfloat)(5.0f), whole_turn & v_not(again)), bits, wedges.end + reached_count);
      reached_count += (int)popcount(bits);
      at += HS_LANES;
    }
  }
  cross_wedges(set, n, &wedges, &reached_count, counts);
}

// Whether nothing stands before the receiver in its texel and the eight around it, by the receiver's own plane there.
// 0: something does, 1: nothing, lit; 2: whatever does is so near that it may be the receiver's own surface.
HS_INLINE int lit_by_map(const HsView light, __global const float* shadow_map, const Batch* batch, int i) {
  const int x = clamp(convert_int_rtn(batch->u[i]), 0, (int)light.width_px - 1),
            y = clamp(convert_int_rtn(batch->v[i]), 0, (int)light.height_px - 1);
  const float d = batch->plane_d[i], dx = batch->plane_dx[i], dy = batch->plane_dy[i];
  const float slope = fabs(dx) + fabs(dy);
  int result = 1;
  for (int ty = max(y - 1, 0); ty <= min(y + 1, (int)light.height_px - 1); ++ty)
    for (int tx = max(x - 1, 0); tx <= min(x + 1, (int)light.width_px - 1); ++tx) {
      const float plane_d = d + dx * ((float)tx + 0.5f - batch->u[i]) + dy * ((float)ty + 0.5f - batch->v[i]);
      const float map_d = 1.0f / shadow_map[ty * (int)light.width_px + tx];
      if (map_d > plane_d + HS_SAME_SURFACE(d, slope)) result = 2;
    }
  if (result == 2) {
    const float map_d = 1.0f / shadow_map[y * (int)light.width_px + x];
    if (map_d > HS_CLEARLY_BEFORE(d, slope)) result = 0;
  }
  return result;
}

// How the centre's direction from p, drawn into the light map, passes an edge a -> b given there relative to p (as left_of_centre
// has it): +1 where it crosses the half-line y = 0, x > 0 upwards, -1 downwards. Summed over a triangle, its winding number.
HS_INLINE vint winding_of(vfloat ax, vfloat ay, vfloat bx, vfloat by) {
  const vint a_up = ay >= 0.0f, b_up = by >= 0.0f, left = left_of_centre(ax, ay, bx, by);
  return v_select((vint)(0), (vint)(1), v_not(a_up) & b_up & left) - v_select((vint)(0), (vint)(1), a_up & v_not(b_up | left));
}

// The triangles that cast, and those in each tile.
typedef struct {
  __global const HsBlock* blocks;
  uint slot_count;
  __global const ushort4* rects;
  __global const uint* offsets;
  __global const uint* refs;
  uint capacity;
  __global const uint* triangles;
  __global const float4* vertices_ls;
  __global const int4* vertices_px;
  __global const float4* planes;
  __global const uchar* disc_sides;
  __global const uint* touching;
} CasterFaces;

// Triangles of a tile that stand before a batch, by their bounds in the map, fixed point. (Longer than need be: see EdgePool.)
typedef struct {
  int low_u[HS_FACES + HS_LANES], low_v[HS_FACES + HS_LANES], high_u[HS_FACES + HS_LANES], high_v[HS_FACES + HS_LANES];
  uint triangle[HS_FACES + HS_LANES];
  int count;
  uint from, to;  // in the tile's list: which of its triangles have been gone through; from = to: none
} FacesBefore;

// A part of the map in fixed point, with what snapped vertices may be off.
HS_INLINE void fixed_bounds(const HsView view, float2 low_px, float2 high_px, int2* low, int2* high) {
  const float2 mid_px = (float2)(view.mid_x_px, view.mid_y_px);
  *low = convert_int2_rtn((low_px - mid_px) * (float)HS_SUBPIXEL) - 4;
  *high = convert_int2_rtp((high_px - mid_px) * (float)HS_SUBPIXEL) + 4;
}

// Goes through a tile's triangles from `from` on, and keeps those that come before receivers of a region, while they fit.
void load_faces_before(const HsView view, const CasterFaces* casters, const Region* region, uint tile, uint from, uint end,
                       bool overflow, FacesBefore* faces) {
  int2 region_low, region_high;
  fixed_bounds(view, region->middle_px - region->half_px, region->middle_px + region->half_px, &region_low, &region_high);
  faces->count = 0;
  faces->from = from;
  for (; from < end && faces->count < HS_FACES; ++from) {
    if (overflow && !rect_has(casters->rects[from], tile, view.tiles_x)) continue;
    const uint triangle = overflow ? casters->blocks[from / HS_BLOCK_SIZE].first + from % HS_BLOCK_SIZE : casters->refs[from];
    const uint3 corner = vload3(triangle, casters->triangles);
    const int4 a_px = casters->vertices_px[corner.x], b_px = casters->vertices_px[corner.y],
               c_px = casters->vertices_px[corner.z];
    int2 low = (int2)(INT_MIN), high = (int2)(INT_MAX);  // of triangles without a place in the map
    if ((a_px.w | b_px.w | c_px.w) == 0) {
      low = min(a_px.xy, min(b_px.xy, c_px.xy));
      high = max(a_px.xy, max(b_px.xy, c_px.xy));
      if (high.x < region_low.x || high.y < region_low.y || low.x > region_high.x || low.y > region_high.y) continue;
    }
    if (min(casters->vertices_ls[corner.x].z, min(casters->vertices_ls[corner.y].z, casters->vertices_ls[corner.z].z)) >=
        region->far_z)
      continue;
    const int at = faces->count++;
    faces->low_u[at] = low.x;
    faces->low_v[at] = low.y;
    faces->high_u[at] = high.x;
    faces->high_v[at] = high.y;
    faces->triangle[at] = triangle;
  }
  faces->to = from;
}

// Sorts a triangle's corners by their numbers, for every edge is decided in its stored direction. Returns -1 where that turns the
// triangle over, else 1.
HS_INLINE int sort_by_number(uint3* corner) {
  int odd = 1;
  uint swap;
  if (corner->y < corner->x) {
    swap = corner->x;
    corner->x = corner->y;
    corner->y = swap;
    odd = -odd;
  }
  if (corner->z < corner->y) {
    swap = corner->y;
    corner->y = corner->z;
    corner->z = swap;
    odd = -odd;
  }
  if (corner->y < corner->x) {
    swap = corner->x;
    corner->x = corner->y;
    corner->y = swap;
    odd = -odd;
  }
  return odd;
}

// Adds to the crossings of the segments from receivers to the light's centre those of one triangle.
HS_INLINE void count_triangle(const CasterFaces* casters, uint triangle, const float* xs, const float* ys, const float* zs,
                              int count, int* crossings) {
  if (casters->disc_sides[triangle] == HS_TOUCHES) return;
  uint3 corner = vload3(triangle, casters->triangles);
  const int odd = sort_by_number(&corner);
  const float3 a = casters->vertices_ls[corner.x].xyz, b = casters->vertices_ls[corner.y].xyz,
               c = casters->vertices_ls[corner.z].xyz;
  const float4 f = casters->planes[triangle];
  for (int k = 0; k < count; k += HS_LANES) {
    const vfloat px = v_load(xs + k), py = v_load(ys + k), pz = v_load(zs + k);
    const vint front = f.x * px + f.y * py + f.z * pz >= f.w;
    const vint between = 0.0f >= f.w ? v_not(front) : front;
    if (!v_any(between)) continue;
    const vfloat ax = map_x(a.x, a.z, px, pz), ay = map_x(a.y, a.z, py, pz);
    const vfloat bx = map_x(b.x, b.z, px, pz), by = map_x(b.y, b.z, py, pz);
    const vfloat cx = map_x(c.x, c.z, px, pz), cy = map_x(c.y, c.z, py, pz);
    vint turns;
    if (min(a.z, min(b.z, c.z)) > 0.0f) {
      turns = winding_of(ax, ay, bx, by) + winding_of(bx, by, cx, cy) - winding_of(ax, ay, cx, cy);
    } else {  // part of it has no place in the map: by the sides of its edges' planes
      const vint ab = left_of_centre(ax, ay, bx, by), bc = left_of_centre(bx, by, cx, cy), ac = left_of_centre(ax, ay, cx, cy);
      turns = v_select((vint)(0), (vint)(1), ab & bc & v_not(ac)) - v_select((vint)(0), (vint)(1), v_not(ab | bc) & ac);
    }
    const vint crossed = v_select((vint)(0), v_select(-turns, turns, front) * odd, between);
    v_store(v_load(crossings + k) + crossed, crossings + k);
  }
}

// D(c) for the receivers in `asking`: crossings of the segment to the light's centre with the triangles of the tile.
// batch_region holds the batch, for which `faces` are loaded.
HS_INLINE void count_triangles(const HsView view, const CasterFaces* casters, const Batch* batch, const Region* batch_region,
                               int first, const int* asking, int asking_count, uint tile, FacesBefore* faces, int* crossings) {
  float xs[HS_GROUP], ys[HS_GROUP], zs[HS_GROUP];
  float2 low_px = (float2)(1e30f), high_px = (float2)(-1e30f);
  for (int i = 0; i < (asking_count + HS_LANES - 1) / HS_LANES * HS_LANES; ++i) {
    const int from = first + asking[min(i, asking_count - 1)];
    xs[i] = batch->x[from];
    ys[i] = batch->y[from];
    zs[i] = batch->z[from];
    crossings[i] = 0;
    low_px = min(low_px, (float2)(batch->u[from], batch->v[from]));
    high_px = max(high_px, (float2)(batch->u[from], batch->v[from]));
  }
  int2 low, high;
  fixed_bounds(view, low_px, high_px, &low, &high);
  const bool overflow = bins_overflow(casters->offsets, view.tiles_x * view.tiles_y, casters->capacity);
  const uint begin = overflow ? 0 : casters->offsets[tile], end = overflow ? casters->slot_count : casters->offsets[tile + 1];
  for (uint from = begin; from < end; from = faces->to) {
    if (faces->from != from || faces->to == from)
      load_faces_before(view, casters, batch_region, tile, from, end, overflow, faces);
    for (int k = 0; k < faces->count; k += HS_LANES) {
      const vint near = (v_iota < faces->count - k) & (v_load(faces->low_u + k) <= high.x) &
                        (v_load(faces->high_u + k) >= low.x) & (v_load(faces->low_v + k) <= high.y) &
                        (v_load(faces->high_v + k) >= low.y);
      for (uint bits = lane_bits(near); bits != 0; bits &= bits - 1)
        count_triangle(casters, faces->triangle[k + first_lane(bits)], xs, ys, zs, asking_count, crossings);
    }
  }
}

// Adds to the counts of a receiver those faces that touch the light, sample by sample. rotation: as rotation_of has it.
HS_INLINE void count_touching_faces(const CasterFaces* casters, const HsDisc disc, const SampleSet* set, float2 rotation,
                                    float3 p, v_short* counts) {
  const int n = (int)disc.sample_count;
  const Facing facing = facing_of(p.x, p.y, p.z);
  for (uint i = 1; i <= casters->touching[0]; ++i) {
    const uint triangle = casters->touching[i];
    uint3 corner = vload3(triangle, casters->triangles);
    sort_by_number(&corner);
    const float3 normal = casters->planes[triangle].xyz;
    const float3 a = casters->vertices_ls[corner.x].xyz, b = casters->vertices_ls[corner.y].xyz,
                 c = casters->vertices_ls[corner.z].xyz;
    const float3 ab = cross3(a - p, b - p), bc = cross3(b - p, c - p), ac = cross3(a - p, c - p);
    const vint front = (vfloat)(dot(normal, p - a)) >= 0.0f;
    for (int k = 0; k < n; k += HS_LANES) {
      const vfloat x = v_load(set->samples + k) * disc.radius, y = v_load(set->samples + n + k) * disc.radius;
      const vfloat u = x * rotation.x + y * rotation.y, v = y * rotation.x - x * rotation.y;
      vfloat sx = u, sy = v, sz = (vfloat)(0.0f);
      if (disc.sphere) {
        sx = facing.x.x * u + facing.y.x * v;
        sy = facing.x.y * u + facing.y.y * v;
        sz = facing.x.z * u + facing.y.z * v;
      }
      const vint through = front ^ (along_axis(normal, sx - a.x, sy - a.y, sz - a.z) >= 0.0f);
      const vint left_ab = along_axis(ab, sx - p.x, sy - p.y, sz - p.z) > 0.0f,
                 left_bc = along_axis(bc, sx - p.x, sy - p.y, sz - p.z) > 0.0f,
                 left_ac = along_axis(ac, sx - p.x, sy - p.y, sz - p.z) > 0.0f;
      const vint inside = v_not(left_ab ^ left_bc) & (left_ab ^ left_ac);
      counts[k / HS_LANES] -= v_short_of(through & inside);
    }
  }
}

// Turns light-plane coordinates to a pixel's own axes: by minus the angle that its samples are turned by, the same as rays use
// (host/light_samples.hpp).
HS_INLINE float2 rotation_of(uint pixel) {
  uint h = (pixel ^ 0x7bb2fe2u) * 747796405u + 2891336453u;  // the hash of seed 0, and of that with the pixel
  h = ((h >> ((h >> 28u) + 4u)) ^ h) * 277803737u;
  h = (h >> 22u) ^ h;
  const float angle = ((float)h + 0.5f) * (6.28318531f / 4294967296.0f);
  return (float2)(cos(angle), -sin(angle));
}

// What the samples in sight, where the count is not above -centre, add to each channel; w = 1.
HS_INLINE float4 tint_of(const v_short* counts, int centre, int n, __global const float* weights) {
  vfloat red = (vfloat)(0.0f), green = red, blue = red;
  for (int k = 0; k < n; k += HS_LANES) {
    const vint seen = v_int_of_short(counts[k / HS_LANES] + (v_short)((short)centre) <= (v_short)((short)0));
    red += v_select((vfloat)(0.0f), v_load(weights + k), seen);
    green += v_select((vfloat)(0.0f), v_load(weights + n + k), seen);
    blue += v_select((vfloat)(0.0f), v_load(weights + 2 * n + k), seen);
  }
  return (float4)((float3)(v_reduce_add(red), v_reduce_add(green), v_reduce_add(blue)) / (float)n, 1.0f);
}
