// What a group of neighbouring receivers sees, from what one of them sees, for methods/exact.
//
// Let p go straight from the group's first receiver p0 to another. D(s) changes only where a silhouette passes over the sample s,
// or where p goes through a face. Most samples are passed by none, and then hold for the whole group what was counted for p0. The
// others change by a piece of classical shadow volumes (Crow 1977): the edges A -> B whose shadow quad, seen from s, the segment
// from p0 to p crosses, each by its multiplicity:
//
//   D_p(s) = D_p0(s) + J(s) + F(s)
//   J(s) = sum of m_s(e) (s left of e as p sees it) - (s left of e as p0 sees it)
//          over edges whose ends lie on different sides of the plane through s, p0 and p, and that meet it before the segment
//          does
//   F(s) = sum over faces that the segment goes through of +1 where s is on p0's side of them, -1 where it is on p's
//
// Which side of an edge s is on is the sign of a triple product, and where that is as small as rounding the very expression that
// the walk over the edges decides by; which side of that plane a vertex lies on is decided for the vertex, whichever edge asks:
// neighbours get what the walk would have given them. An edge that nearly meets the segment itself makes the group walk.
// Cost follows what moves before the light's samples, not receivers times edges.

#pragma once

#include "methods/exact/crossed_edges.h"

#if HS_LANES == 16
#define HS_PAIRS 16384
#define HS_BANDS 128   // edges at once
#define HS_LOADED 128  // pairs at once
#define HS_PAIR_CAPACITY (HS_PAIRS + HS_BANDS * HS_WINDOW_SAMPLES + HS_MAX_SAMPLES + HS_LANES)
#define HS_GROUP_VECTORS (HS_GROUP / HS_LANES)
#define HS_NEAR_FACES 2048
#define HS_CROSSED 16
#define HS_DIRECTIONS 64
#define HS_UNSURE 2e-6f  // of the product of lengths; with half of it all scenes that were compared come out the same

// The middles of some bounds, and half their sizes.
typedef struct {
  float x[HS_GROUP_VECTORS], y[HS_GROUP_VECTORS], z[HS_GROUP_VECTORS];
  float half_x[HS_GROUP_VECTORS], half_y[HS_GROUP_VECTORS], half_z[HS_GROUP_VECTORS];
} Bounds;

typedef struct {
  float x[HS_GROUP], y[HS_GROUP], z[HS_GROUP];     // the receivers, about in the order of the segments to them: see load_swept
  float dx[HS_GROUP], dy[HS_GROUP], dz[HS_GROUP];  // the segments to them from the first one
  ushort order[HS_GROUP];                          // where they are in the batch, from the group's first on
  int count;
  Bounds segment, direction;       // of each vector of segments, and of those as unit vectors
  int run_edge[HS_PAIR_CAPACITY];  // edges, and the samples that they may pass over: pairs, in runs of one edge each
  int run_end[HS_PAIR_CAPACITY];   // where runs end in the pairs
  int run_count;
  int pair_what[HS_PAIR_CAPACITY];  // a sample's number, and in the high half the edge's multiplicity as the sample has it
  int pair_count;
  float pairs_per_edge;            // where there were too many; else 0
  ushort changes[HS_MAX_SAMPLES];  // 1 for samples of pairs, 0 for the others
  ushort changing[HS_MAX_SAMPLES];
  int changing_count;
  short16 deltas[HS_GROUP_VECTORS * HS_MAX_SAMPLES];  // J, sample by sample for each vector of receivers
  short depth[HS_GROUP];                              // F for the light's centre
  uint crossed[HS_GROUP * HS_CROSSED];  // faces that the segment to each receiver goes through and whose plane cuts the disc,
  int crossed_count[HS_GROUP];          //   twice the number + 1 if the centre is on p0's side
} Sweep;

// Triangles near some receivers, by their bounds in light space. (Longer than need be: see EdgePool.)
typedef struct {
  float low_x[HS_NEAR_FACES + HS_LANES], low_y[HS_NEAR_FACES + HS_LANES], low_z[HS_NEAR_FACES + HS_LANES];
  float high_x[HS_NEAR_FACES + HS_LANES], high_y[HS_NEAR_FACES + HS_LANES], high_z[HS_NEAR_FACES + HS_LANES];
  uint triangle[HS_NEAR_FACES + HS_LANES];
  int count;
  int first, end;  // the receivers, in their batch; none where there are too many triangles
} NearFaces;

// The box that holds all receivers of a region and the segments between them.
HS_INLINE void box_of_region(const Region* region, float3* low, float3* high) {
  *low = region->middle - region->half_size * 1.001f;
  *high = region->middle + region->half_size * 1.001f;
}

// Bounds of a coordinate of an edge's end as receivers at low_p .. high_p see it: a + (a - p) t.
HS_INLINE void projected_bounds(vfloat low_a, vfloat high_a, float low_p, float high_p, vfloat low_t, vfloat high_t, float slack,
                                vfloat* low, vfloat* high) {
#pragma OPENCL FP_CONTRACT ON
  const vfloat l = low_a - high_p, h = high_a - low_p;
  const vfloat lt = l * v_select(low_t, high_t, l < 0.0f), ht = h * v_select(high_t, low_t, h < 0.0f);
  *low = low_a + lt - (fabs(low_a) + fabs(lt)) * 2e-6f - slack;
  *high = high_a + ht + (fabs(high_a) + fabs(ht)) * 2e-6f + slack;
}

HS_INLINE void bound_lanes(vfloat v, float* middle, float* half_size) {
  const float low = v_reduce_min(v), high = -v_reduce_min(-v);
  *middle = 0.5f * (low + high);
  *half_size = 0.5f * (high - low);
}

HS_INLINE void bound_vector(vfloat x, vfloat y, vfloat z, int i, Bounds* bounds) {
  bound_lanes(x, bounds->x + i, bounds->half_x + i);
  bound_lanes(y, bounds->y + i, bounds->half_y + i);
  bound_lanes(z, bounds->z + i, bounds->half_z + i);
}

// Puts the receivers of a group into the sweep, sorted by the direction in which they lie from the first one: an edge is passed
// by few segments, and these then are in few vectors.
void load_swept(const Batch* batch, const Region* region, int first, int count, Sweep* sweep) {
  // Directions in the plane in which the group is widest.
  const float3 size = region->half_size;
  const bool across_x = size.x <= min(size.y, size.z), across_y = !across_x && size.y <= size.z;
  const float* us = (across_x ? batch->y : batch->x) + first;
  const float* vs = (across_x || across_y ? batch->z : batch->y) + first;
  int places[HS_GROUP], next[HS_DIRECTIONS + 1];
  for (int i = 0; i <= HS_DIRECTIONS; ++i) next[i] = 0;
  for (int i = 0; i < count; i += HS_LANES) {
    const vfloat place = turn_of(v_load(us + i) - us[0], v_load(vs + i) - vs[0]) * (HS_DIRECTIONS / 4.0f);
    v_store(clamp(v_int(place), (vint)(0), (vint)(HS_DIRECTIONS - 1)), places + i);
  }
  for (int i = 1; i < count; ++i) ++next[places[i] + 1];
  next[0] = 1;
  for (int i = 1; i <= HS_DIRECTIONS; ++i) next[i] += next[i - 1];
  sweep->order[0] = 0;
  for (int i = 1; i < count; ++i) sweep->order[next[places[i]]++] = (ushort)i;

  sweep->count = count;
  for (int i = 0; i < (count + HS_LANES - 1) / HS_LANES * HS_LANES; ++i) {
    const int k = first + sweep->order[min(i, count - 1)];
    sweep->x[i] = batch->x[k];
    sweep->y[i] = batch->y[k];
    sweep->z[i] = batch->z[k];
  }
  for (int v = 0; v * HS_LANES < count; ++v) {
    const int i = v * HS_LANES;
    const vfloat x = v_load(sweep->x + i), y = v_load(sweep->y + i), z = v_load(sweep->z + i);
    const vfloat dx = x - sweep->x[0], dy = y - sweep->y[0], dz = z - sweep->z[0];
    v_store(dx, sweep->dx + i);
    v_store(dy, sweep->dy + i);
    v_store(dz, sweep->dz + i);
    bound_vector(dx, dy, dz, v, &sweep->segment);
    const vfloat length = sqrt(dx * dx + dy * dy + dz * dz);
    const vint none = length == 0.0f;
    const vfloat to_unit = 1.0f / v_select(length, (vfloat)(1.0f), none);
    const vfloat ux = dx * to_unit, uy = dy * to_unit, uz = dz * to_unit;
    bound_vector(v_select(ux, (vfloat)(ux.sf), none), v_select(uy, (vfloat)(uy.sf), none), v_select(uz, (vfloat)(uz.sf), none), v,
                 &sweep->direction);
  }
}

// What tells an edge's multiplicity as seen from samples of the unit disc.
typedef struct {
  float n0x, n0y, n0w, n1x, n1y, n1w;
  int m, o0, o1;
} EdgeSides;

HS_INLINE void load_sides(const EdgePool* list, int i, float radius, EdgeSides* sides) {
  sides->n0x = list->n0x[i] * radius;
  sides->n0y = list->n0y[i] * radius;
  sides->n0w = list->n0w[i];
  sides->n1x = list->n1x[i] * radius;
  sides->n1y = list->n1y[i] * radius;
  sides->n1w = list->n1w[i];
  sides->m = list->m[i];
  sides->o0 = list->o0[i];
  sides->o1 = list->o1[i];
}

// It: a receiver that the edge passes before them is on the other side of its faces' planes.
HS_INLINE vint multiplicity_at(const EdgeSides* sides, vfloat sx, vfloat sy) {
  const vint front0 = sx * sides->n0x + sy * sides->n0y >= sides->n0w, front1 = sx * sides->n1x + sy * sides->n1y >= sides->n1w;
  return sides->m + v_select((vint)(sides->o0), (vint)(-sides->o0), front0) +
         v_select((vint)(sides->o1), (vint)(-sides->o1), front1);
}

// Where coordinates of the unit disc lie in a grid; limited while they are not integers yet, for which they may be too large.
HS_INLINE vint place_along(vfloat x, int cells) {
  return clamp(v_int(min(max((x + 1.0f) * (0.5f * (float)cells), 0.0f), (float)(cells - 1))), (vint)(0), (vint)(cells - 1));
}

// Adds a pair of an edge, which has multiplicity m, and each of the lanes `swept` of samples, whose numbers are in `samples`,
// where m is not 0.
HS_INLINE void add_pairs(int edge, vint m, __global const ushort* samples, uint swept, Sweep* sweep, int* run_count,
                         int* pair_count) {
  const uint bits = swept & lane_bits(m != 0);
  append_chosen(m << 16 | convert_int16(vload16(0, samples)), bits, sweep->pair_what, pair_count);
  sweep->run_edge[*run_count] = edge;
  sweep->run_end[*run_count] = *pair_count;
  *run_count += bits != 0;
}

// Where edges of a list sweep before the light as receivers of a region move: within a box, and within a band along a line.
typedef struct {
  float mx[HS_BANDS], my[HS_BANDS], half_x[HS_BANDS], half_y[HS_BANDS];  // the box, in units of the light's radius
  float ex[HS_BANDS], ey[HS_BANDS], c[HS_BANDS], reach[HS_BANDS];        // points s with |s x e - c| <= reach
  int x0[HS_BANDS], y0[HS_BANDS], x1[HS_BANDS], y1[HS_BANDS];            // the box in the finer grid of the samples
  int window[HS_BANDS];                                                  // of the samples
  int small[HS_BANDS + HS_LANES], small_count;                           // which of them may pass over samples of one window
  int wide[HS_BANDS + HS_LANES], wide_count;                             // and of more
} Bands;

// Finds them for a vector of edges, from number i of the list on, to place `to`.
HS_INLINE void bound_sweeps(float radius, int fine, const Region* region, const EdgePool* list, int i, int to, Bands* bands) {
#pragma OPENCL FP_CONTRACT ON
  const float slack = radius * 4e-6f, per_radius = 1.0f / radius;
  const float3 low_p = region->middle - region->half_size, high_p = region->middle + region->half_size;
  const float beyond = low_p.z * HS_BEYOND;
  const vfloat ax = v_load(list->ax + i), ay = v_load(list->ay + i), az = v_load(list->az + i);
  const vfloat bx = v_load(list->bx + i), by = v_load(list->by + i), bz = v_load(list->bz + i);
  // An end that some receiver lies before is cut off, somewhere along the edge.
  const vint a_cut = az >= beyond, b_cut = bz >= beyond, cut = a_cut | b_cut;
  vfloat low_ta = az / (high_p.z - az), low_tb = bz / (high_p.z - bz), high_ta = az / (low_p.z - az),
         high_tb = bz / (low_p.z - bz);
  vfloat low_ax = ax, high_ax = ax, low_ay = ay, high_ay = ay, low_bx = bx, high_bx = bx, low_by = by, high_by = by;
  if (v_any(cut)) {
    const vfloat least = v_select(v_select(min(low_ta, low_tb), low_tb, a_cut), low_ta, b_cut);
    const vfloat low_t = v_select(least, (vfloat)(0.0f), a_cut & b_cut);
    low_ax = v_select(ax, min(ax, bx), a_cut);
    high_ax = v_select(ax, max(ax, bx), a_cut);
    low_ay = v_select(ay, min(ay, by), a_cut);
    high_ay = v_select(ay, max(ay, by), a_cut);
    low_bx = v_select(bx, min(ax, bx), b_cut);
    high_bx = v_select(bx, max(ax, bx), b_cut);
    low_by = v_select(by, min(ay, by), b_cut);
    high_by = v_select(by, max(ay, by), b_cut);
    low_ta = v_select(low_ta, low_t, a_cut);
    low_tb = v_select(low_tb, low_t, b_cut);
    high_ta = v_select(high_ta, (vfloat)(2e6f), a_cut);  // HS_BEYOND / (1 - HS_BEYOND), and more
    high_tb = v_select(high_tb, (vfloat)(2e6f), b_cut);
  }
  vfloat alx, ahx, aly, ahy, blx, bhx, bly, bhy;
  projected_bounds(low_ax, high_ax, low_p.x, high_p.x, low_ta, high_ta, slack, &alx, &ahx);
  projected_bounds(low_ay, high_ay, low_p.y, high_p.y, low_ta, high_ta, slack, &aly, &ahy);
  projected_bounds(low_bx, high_bx, low_p.x, high_p.x, low_tb, high_tb, slack, &blx, &bhx);
  projected_bounds(low_by, high_by, low_p.y, high_p.y, low_tb, high_tb, slack, &bly, &bhy);
  const vfloat lx = min(alx, blx), hx = max(ahx, bhx), ly = min(aly, bly), hy = max(ahy, bhy);
  // Where it sweeps lies in a band along the line through the middles of its ends' bounds.
  const vfloat amx = 0.5f * (alx + ahx), amy = 0.5f * (aly + ahy), ex = 0.5f * (blx + bhx) - amx, ey = 0.5f * (bly + bhy) - amy;
  const vfloat c = amx * ey - amy * ex, length = sqrt(ex * ex + ey * ey);
  const vfloat half_band =
      0.5f * max(fabs(ey) * (ahx - alx) + fabs(ex) * (ahy - aly), fabs(ey) * (bhx - blx) + fabs(ex) * (bhy - bly)) +
      4e-6f * (fabs(amx * ey) + fabs(amy * ex) + radius * length);
  const vint is_edge = (v_load(list->m + i) | v_load(list->o0 + i) | v_load(list->o1 + i)) != 0;
  const vint reaches =
      is_edge & (lx <= radius) & (hx >= -radius) & (ly <= radius) & (hy >= -radius) & (fabs(c) <= half_band + radius * length);

  // In units of the radius, and cut to where samples may be: sizes are small then, and little is lost by rounding.
  const vfloat low_x = max(lx * per_radius, -2.0f), high_x = min(hx * per_radius, 2.0f);
  const vfloat low_y = max(ly * per_radius, -2.0f), high_y = min(hy * per_radius, 2.0f);
  const vint x0 = place_along(low_x, fine), x1 = place_along(high_x, fine), y0 = place_along(low_y, fine),
             y1 = place_along(high_y, fine);
  v_store(0.5f * (low_x + high_x), bands->mx + to);
  v_store(0.5f * (low_y + high_y), bands->my + to);
  v_store(0.5f * (high_x - low_x) + 1e-6f, bands->half_x + to);
  v_store(0.5f * (high_y - low_y) + 1e-6f, bands->half_y + to);
  v_store(ex * radius, bands->ex + to);
  v_store(ey * radius, bands->ey + to);
  v_store(c, bands->c + to);
  v_store(half_band, bands->reach + to);
  v_store(x0, bands->x0 + to);
  v_store(y0, bands->y0 + to);
  v_store(x1, bands->x1 + to);
  v_store(y1, bands->y1 + to);
  v_store(y0 * fine + x0, bands->window + to);
  const uint reach_bits = lane_bits(reaches),
             small_bits = reach_bits & lane_bits((x1 - x0 < HS_WINDOW_CELLS) & (y1 - y0 < HS_WINDOW_CELLS));
  append_chosen(to + v_iota, small_bits, bands->small, &bands->small_count);
  append_chosen(to + v_iota, reach_bits & ~small_bits, bands->wide, &bands->wide_count);
}

// Which samples an edge may pass over.
HS_INLINE vint swept_by(const Bands* bands, int k, vfloat sx, vfloat sy) {
  return v_not((fabs(sx - bands->mx[k]) > bands->half_x[k]) | (fabs(sy - bands->my[k]) > bands->half_y[k]) |
               (fabs(sx * bands->ey[k] - sy * bands->ex[k] - bands->c[k]) > bands->reach[k]));
}

// Finds the samples that each edge of the list may pass over as receivers of the region move. False if they are, or seem to
// become, many more than `most`.
bool find_swept(const HsDisc disc, const SampleSet* set, const Region* region, const EdgePool* list, int first, int count,
                int most, Sweep* sweep) {
  const int n = (int)disc.sample_count, grid = (int)disc.cells_across, fine = 2 * grid;
  __global const float* cell_x = set->cell_xy;
  __global const float* cell_y = set->cell_xy + n + HS_LANES;
  __global const ushort* cell_first = set->cells;
  __global const ushort* cell_sample = set->cells + grid * grid + 1;
  Bands bands;
  int run_count = 0, pair_count = 0;
  sweep->pairs_per_edge = 0.0f;
  // Step by step for many edges: what a step of one edge waits for is hidden by those of others. Few at first, for there may soon
  // be too many samples.
  for (int from = first, end; from < first + count; from = end) {
    end = min(from + min(HS_LANES + (from - first), HS_BANDS), first + count);
    bands.small_count = bands.wide_count = 0;
    for (int i = from; i < end; i += HS_LANES) bound_sweeps(disc.radius, fine, region, list, i, i - from, &bands);

    int swept[HS_BANDS], swept_bits[HS_BANDS], swept_count = 0;
    for (int i = 0; i < bands.small_count; ++i) {
      const int k = bands.small[i], window = bands.window[k];
      if (set->windows[window * HS_WINDOW_SAMPLES] == HS_WINDOW_FULL) {
        bands.wide[bands.wide_count++] = k;
        continue;
      }
      __global const float* xy = set->window_xy + window * (2 * HS_WINDOW_SAMPLES);
      swept[swept_count] = k;
      swept_bits[swept_count] = (int)lane_bits(swept_by(&bands, k, v_load(xy), v_load(xy + HS_WINDOW_SAMPLES)));
      swept_count += swept_bits[swept_count] != 0;
    }
    for (int i = 0; i < swept_count; ++i) {
      const int k = swept[i], window = bands.window[k];
      __global const float* xy = set->window_xy + window * (2 * HS_WINDOW_SAMPLES);
      EdgeSides sides;
      load_sides(list, from + k, disc.radius, &sides);
      add_pairs(from + k - first, multiplicity_at(&sides, v_load(xy), v_load(xy + HS_WINDOW_SAMPLES)),
                set->windows + window * HS_WINDOW_SAMPLES, (uint)swept_bits[i], sweep, &run_count, &pair_count);
    }
    // So many are not yet too many, if the rest of the list is like its beginning.
    const int allowed = min(256 + most / 4 + (int)((float)most * (float)(from - first) / (float)count), HS_PAIRS);
    for (int i = 0; i < bands.wide_count && pair_count <= allowed; ++i) {
      const int k = bands.wide[i];
      EdgeSides sides;
      load_sides(list, from + k, disc.radius, &sides);
      for (int y = bands.y0[k] / 2; y <= bands.y1[k] / 2; ++y) {
        const int row_end = cell_first[y * grid + bands.x1[k] / 2 + 1];
        for (int cell = cell_first[y * grid + bands.x0[k] / 2]; cell < row_end; cell += HS_LANES) {
          const vfloat sx = v_load(cell_x + cell), sy = v_load(cell_y + cell);
          const vint inside = (v_iota < row_end - cell) & swept_by(&bands, k, sx, sy);
          add_pairs(from + k - first, multiplicity_at(&sides, sx, sy), cell_sample + cell, lane_bits(inside), sweep, &run_count,
                    &pair_count);
        }
      }
    }
    if (pair_count > allowed) {
      sweep->pairs_per_edge = (float)pair_count / (float)(end - first);
      return false;
    }
  }
  sweep->run_count = run_count;
  sweep->pair_count = pair_count;
  return true;
}

// On which side of an edge receivers see a sample, as the walk decides it. `left`: the result where the walk leaves the edge out.
HS_INLINE vint left_as_walked(float3 a, float3 b, float2 s, float radius, vfloat px, vfloat py, vfloat pz, vint left) {
  const ProjectedEdge e =
      project_edge((vfloat)(a.x), (vfloat)(a.y), (vfloat)(a.z), (vfloat)(b.x), (vfloat)(b.y), (vfloat)(b.z), px, py, pz);
  vfloat c;
  distance2_of(&e, &c);
  return v_select(left, s.x * ((e.by - e.ay) * radius) - s.y * ((e.bx - e.ax) * radius) <= c, e.seen);
}

HS_INLINE vfloat sum_of_sizes(vfloat x, vfloat y, vfloat z) {
  return fabs(x) + fabs(y) + fabs(z);
}

// What sum_deltas needs of some pairs of edge a -> b and sample s: n is the normal of the plane through them, away from p0's side
// of the edge, from0 how far p0 is on the other side; m_a and m_b are the normals of the planes through s, p0 and an end; delta
// is what is added to D(s) where the edge is passed.
typedef struct {
  float ax[HS_LOADED], ay[HS_LOADED], az[HS_LOADED], bx[HS_LOADED], by[HS_LOADED], bz[HS_LOADED];
  float sx[HS_LOADED], sy[HS_LOADED];  // unit disc
  float nx[HS_LOADED], ny[HS_LOADED], nz[HS_LOADED], from0[HS_LOADED], unsure[HS_LOADED];
  float m_ax[HS_LOADED], m_ay[HS_LOADED], m_az[HS_LOADED], m_bx[HS_LOADED], m_by[HS_LOADED], m_bz[HS_LOADED];
  int left0[HS_LOADED], delta[HS_LOADED];
  int sample[HS_LOADED];
  int edge_before[HS_LOADED];  // not 0 where the edge is before all receivers: what passes it passes behind it
  // Those that may be passed on the segment to one vector of receivers; of these, with edges before and with edges that may not
  // be.
  int before[HS_LOADED + HS_LANES], beside[HS_LOADED + HS_LANES];
  int before_count, beside_count;
} Pairs;

// Loads the pairs of runs from number *run on, which begins at pair `at`, as many as fit; *run: the first that is
// left. Returns their number.
int load_pairs(const HsDisc disc, const SampleSet* set, const Region* region, const EdgePool* list, int first, Sweep* sweep,
               int at, int* run, Pairs* pairs) {
  const float3 p0 = (float3)(sweep->x[0], sweep->y[0], sweep->z[0]);
  const float across = 2.0f * (region->half_size.x + region->half_size.y + region->half_size.z);
  const float nearest_z = (region->middle.z - region->half_size.z) * (1.0f - 1e-5f);
  const int n = (int)disc.sample_count;
  const float radius = disc.radius;
  int count = 0;
  for (; *run < sweep->run_count && count <= HS_LOADED - HS_LANES; ++*run) {
    const int i = first + sweep->run_edge[*run];
    const int end = sweep->run_end[*run] - at;
    const float eax = list->ax[i], eay = list->ay[i], eaz = list->az[i], ebx = list->bx[i], eby = list->by[i], ebz = list->bz[i];
    for (int k = count; k < end; k += 4) {
      vstore4((float4)(eax), 0, pairs->ax + k);
      vstore4((float4)(eay), 0, pairs->ay + k);
      vstore4((float4)(eaz), 0, pairs->az + k);
      vstore4((float4)(ebx), 0, pairs->bx + k);
      vstore4((float4)(eby), 0, pairs->by + k);
      vstore4((float4)(ebz), 0, pairs->bz + k);
    }
    count = end;
  }
  for (int k = 0; k < count; ++k) {
    const int sample = sweep->pair_what[at + k] & 0xffff;
    sweep->changes[sample] = 1;
    pairs->sx[k] = set->samples[sample];
    pairs->sy[k] = set->samples[n + sample];
  }
  for (int to = 0; to < count; to += HS_LANES) {
    const vfloat ax = v_load(pairs->ax + to), ay = v_load(pairs->ay + to), az = v_load(pairs->az + to);
    const vfloat bx = v_load(pairs->bx + to), by = v_load(pairs->by + to), bz = v_load(pairs->bz + to);
    const vfloat sx = v_load(pairs->sx + to) * radius, sy = v_load(pairs->sy + to) * radius;
    const vfloat ex = bx - ax, ey = by - ay, ez = bz - az;                // edge
    const vfloat ux = ax - sx, uy = ay - sy, wx = bx - sx, wy = by - sy;  // ends from the sample; uz is az, wz bz
    const vfloat fx = p0.x - ax, fy = p0.y - ay, fz = p0.z - az, gx = p0.x - bx, gy = p0.y - by, gz = p0.z - bz;
    const vfloat nx = uy * ez - az * ey, ny = az * ex - ux * ez, nz = ux * ey - uy * ex;
    const vfloat from0 = nx * fx + ny * fy + nz * fz;
    // Nearer than this the walk's rounding may find the sample on the other side.
    const vfloat unsure = HS_UNSURE * sum_of_sizes(ux, uy, az) * sum_of_sizes(ex, ey, ez) * (sum_of_sizes(fx, fy, fz) + across);
    v_store(from0 > 0.0f, pairs->left0 + to);
    const vint some = v_iota < count - to;
    v_store(max(az, bz) < nearest_z, pairs->edge_before + to);
    for (uint bits = lane_bits(some & (fabs(from0) <= unsure)); bits != 0; bits &= bits - 1) {
      const int k = to + first_lane(bits);
      const vint left = left_as_walked((float3)(pairs->ax[k], pairs->ay[k], pairs->az[k]),
                                       (float3)(pairs->bx[k], pairs->by[k], pairs->bz[k]), (float2)(pairs->sx[k], pairs->sy[k]),
                                       radius, (vfloat)(p0.x), (vfloat)(p0.y), (vfloat)(p0.z), (vint)(pairs->left0[k]));
      pairs->left0[k] = HS_LANE(left, 0);
    }
    const vfloat m_ax = uy * fz - az * fy, m_ay = az * fx - ux * fz, m_az = ux * fy - uy * fx;
    const vfloat m_bx = wy * gz - bz * gy, m_by = bz * gx - wx * gz, m_bz = wx * gy - wy * gx;
    const vint left0 = v_load(pairs->left0 + to), what = v_load(sweep->pair_what + at + to), m = what >> 16;
    v_store(what & 0xffff, pairs->sample + to);
    const vfloat away = v_select((vfloat)(1.0f), (vfloat)(-1.0f), left0), away_x = nx * away, away_y = ny * away,
                 away_z = nz * away, away0 = from0 * away;
    v_store(v_select(m, -m, left0), pairs->delta + to);
    v_store(away_x, pairs->nx + to);
    v_store(away_y, pairs->ny + to);
    v_store(away_z, pairs->nz + to);
    v_store(away0, pairs->from0 + to);
    v_store(unsure, pairs->unsure + to);
    v_store(m_ax, pairs->m_ax + to);
    v_store(m_ay, pairs->m_ay + to);
    v_store(m_az, pairs->m_az + to);
    v_store(m_bx, pairs->m_bx + to);
    v_store(m_by, pairs->m_by + to);
    v_store(m_bz, pairs->m_bz + to);
  }
  return count;
}

// Finds which of `count` pairs the segments to vector v of receivers may pass: by the vector's bounds some may see the sample on
// another side of the edge than p0 does, with segments for which its ends are on different sides of the plane through sample and
// segment.
HS_INLINE void find_between(const Sweep* sweep, int count, int v, Pairs* pairs) {
#pragma OPENCL FP_CONTRACT ON
  const Bounds *segment = &sweep->segment, *direction = &sweep->direction;
  const float slack = 1e-5f;
  const float hx = direction->half_x[v] + slack, hy = direction->half_y[v] + slack, hz = direction->half_z[v] + slack;
  int before_count = 0, beside_count = 0;
  for (int k = 0; k < count; k += HS_LANES) {
    const vfloat nx = v_load(pairs->nx + k), ny = v_load(pairs->ny + k), nz = v_load(pairs->nz + k);
    const vfloat from = nx * segment->x[v] + ny * segment->y[v] + nz * segment->z[v] + v_load(pairs->from0 + k);
    const vfloat from_reach =
        fabs(nx) * segment->half_x[v] + fabs(ny) * segment->half_y[v] + fabs(nz) * segment->half_z[v] + v_load(pairs->unsure + k);
    const vfloat m_ax = v_load(pairs->m_ax + k), m_ay = v_load(pairs->m_ay + k), m_az = v_load(pairs->m_az + k);
    const vfloat m_bx = v_load(pairs->m_bx + k), m_by = v_load(pairs->m_by + k), m_bz = v_load(pairs->m_bz + k);
    const vfloat a_side = m_ax * direction->x[v] + m_ay * direction->y[v] + m_az * direction->z[v],
                 a_reach = fabs(m_ax) * hx + fabs(m_ay) * hy + fabs(m_az) * hz;
    const vfloat b_side = m_bx * direction->x[v] + m_by * direction->y[v] + m_bz * direction->z[v],
                 b_reach = fabs(m_bx) * hx + fabs(m_by) * hy + fabs(m_bz) * hz;
    const vint same = ((a_side > a_reach) & (b_side > b_reach)) | ((a_side < -a_reach) & (b_side < -b_reach));
    const uint bits = lane_bits((v_iota < count - k) & v_not(same) & (from >= -from_reach));
    const uint edge_before = lane_bits(v_load(pairs->edge_before + k) != 0);
    append_chosen(k + v_iota, bits & edge_before, pairs->before, &before_count);
    append_chosen(k + v_iota, bits & ~edge_before, pairs->beside, &beside_count);
  }
  pairs->before_count = before_count;
  pairs->beside_count = beside_count;
}

// Which segments to vector v of receivers pass pair k's edge, or the line of sight beyond it: those after which the sample is on
// the edge's other side, while its ends are on different sides of the plane through the sample and the segment. *from, *da, *db:
// how far they are.
HS_INLINE vint segments_across(const HsDisc disc, const Sweep* sweep, const Pairs* pairs, int v, int k, vfloat dx, vfloat dy,
                               vfloat dz, vfloat* from, vfloat* da, vfloat* db) {
#pragma OPENCL FP_CONTRACT ON
  *from = pairs->from0[k] + pairs->nx[k] * dx + pairs->ny[k] * dy + pairs->nz[k] * dz;
  vfloat side = *from;
  const vint doubtful = fabs(*from) <= pairs->unsure[k];
  if (v_any(doubtful)) {
    const vint left0 = (vint)(pairs->left0[k]), turned = side > 0.0f;
    const vint left =
        left_as_walked((float3)(pairs->ax[k], pairs->ay[k], pairs->az[k]), (float3)(pairs->bx[k], pairs->by[k], pairs->bz[k]),
                       (float2)(pairs->sx[k], pairs->sy[k]), disc.radius, v_load(sweep->x + v * HS_LANES),
                       v_load(sweep->y + v * HS_LANES), v_load(sweep->z + v * HS_LANES), turned ^ left0);
    side = v_select(side, v_select((vfloat)(-1.0f), (vfloat)(1.0f), left ^ left0), doubtful);
  }
  // Fused alike for both ends, so that a vertex is on one side of the segment, by its sign bit, whichever edge asks.
  *da = pairs->m_ax[k] * dx + pairs->m_ay[k] * dy + pairs->m_az[k] * dz;
  *db = pairs->m_bx[k] * dx + pairs->m_by[k] * dy + pairs->m_bz[k] * dz;
  return ((v_as_int(*da) ^ v_as_int(*db)) & ~v_as_int(side)) < 0;
}

HS_INLINE void add_delta(Sweep* sweep, const Pairs* pairs, int v, int k, vint passes) {
  sweep->deltas[v * HS_MAX_SAMPLES + pairs->sample[k]] += v_short_of(passes) & (short16)((short)pairs->delta[k]);
}

// Adds up J of all changing samples and receivers. False if an edge meets the segment between receivers, as nearly as can be
// decided.
bool sum_deltas(const HsDisc disc, const SampleSet* set, const Region* region, const EdgePool* list, int first, Sweep* sweep) {
  Pairs pairs;
  const int n = (int)disc.sample_count;
  for (int sample = 0; sample < n; ++sample) sweep->changes[sample] = 0;
  for (int v = 0; v * HS_LANES < sweep->count; ++v)
    for (int sample = 0; sample < n; ++sample) sweep->deltas[v * HS_MAX_SAMPLES + sample] = (short16)(0);
  for (int at = 0, run = 0, loaded; at < sweep->pair_count; at += loaded) {
    loaded = load_pairs(disc, set, region, list, first, sweep, at, &run, &pairs);
    vint meets = (vint)(0);
    for (int v = 0; v * HS_LANES < sweep->count; ++v) {
      find_between(sweep, loaded, v, &pairs);
      const vfloat dx = v_load(sweep->dx + v * HS_LANES), dy = v_load(sweep->dy + v * HS_LANES),
                   dz = v_load(sweep->dz + v * HS_LANES);
      for (int i = 0; i < pairs.before_count; ++i) {
        const int k = pairs.before[i];
        vfloat from, da, db;
        add_delta(sweep, &pairs, v, k, segments_across(disc, sweep, &pairs, v, k, dx, dy, dz, &from, &da, &db));
      }
      for (int i = 0; i < pairs.beside_count; ++i) {
#pragma OPENCL FP_CONTRACT ON
        const int k = pairs.beside[i];
        vfloat from, da, db;
        const vint passes = segments_across(disc, sweep, &pairs, v, k, dx, dy, dz, &from, &da, &db);
        // Where the edge meets the plane, and where the segment does: depths, each times the other's weight.
        const vfloat size0 = (vfloat)(fabs(pairs.from0[k])), size_a = fabs(da), size_b = fabs(db), sum = size0 + fabs(from);
        const vfloat edge_z = (pairs.az[k] * size_b + pairs.bz[k] * size_a) * sum;
        const vfloat segment_z = (sweep->z[0] * sum + dz * size0) * (size_a + size_b);
        meets |= passes & (fabs(edge_z - segment_z) <= 4e-6f * segment_z);
        add_delta(sweep, &pairs, v, k, passes & (edge_z < segment_z));
      }
    }
    if (v_any(meets)) return false;
  }
  sweep->changing_count = 0;
  for (int sample = 0; sample < n; ++sample) {
    sweep->changing[sweep->changing_count] = (ushort)sample;
    sweep->changing_count += sweep->changes[sample];
  }
  return true;
}

// A segment from p0 to p and an edge: on which side it passes. The ends in the order of their numbers, so that faces agree.
HS_INLINE vint passes_left(float3 p0, vfloat dx, vfloat dy, vfloat dz, float3 a, float3 b, bool reversed) {
  const float3 m = cross3(a - p0, b - a);
  const vint left = along_axis(m, dx, dy, dz) > 0.0f;
  return reversed ? v_not(left) : left;
}

// Finds F: the faces that the segment from the group's first receiver to each other goes through. False if there are too many.
bool find_crossed(const Region* region, const NearFaces* faces, __global const uint* triangles,
                  __global const float4* vertices_ls, __global const float4* planes, __global const uchar* disc_sides,
                  Sweep* sweep) {
  float3 low, high;
  box_of_region(region, &low, &high);
  const float3 p0 = (float3)(sweep->x[0], sweep->y[0], sweep->z[0]);
  for (int i = 0; i < HS_GROUP; ++i) sweep->crossed_count[i] = sweep->depth[i] = 0;
  for (int k = 0; k < faces->count; k += HS_LANES) {
    const vint meets = (v_iota < faces->count - k) & (v_load(faces->low_x + k) <= high.x) & (v_load(faces->high_x + k) >= low.x) &
                       (v_load(faces->low_y + k) <= high.y) & (v_load(faces->high_y + k) >= low.y) &
                       (v_load(faces->low_z + k) <= high.z) & (v_load(faces->high_z + k) >= low.z);
    for (uint bits = lane_bits(meets); bits != 0; bits &= bits - 1) {
      const uint triangle = faces->triangle[k + first_lane(bits)];
      const uint3 corner = vload3(triangle, triangles);
      const float4 f = planes[triangle];
      const float3 a = vertices_ls[corner.x].xyz, b = vertices_ls[corner.y].xyz, c = vertices_ls[corner.z].xyz;
      // From a corner: what is decided near the face has to be right, and not only the same whoever asks.
      const bool front0 = f.x * (p0.x - a.x) + f.y * (p0.y - a.y) + f.z * (p0.z - a.z) >= 0.0f, centre_front = 0.0f >= f.w;
      const bool cuts = disc_sides[triangle] == 2;
      for (int v = 0; v < sweep->count; v += HS_LANES) {
        const vfloat px = v_load(sweep->x + v), py = v_load(sweep->y + v), pz = v_load(sweep->z + v);
        const vint front = along_axis(f.xyz, px - a.x, py - a.y, pz - a.z) >= 0.0f;
        vint through = front0 ? v_not(front) : front;
        if (!v_any(through)) continue;
        const vfloat dx = px - p0.x, dy = py - p0.y, dz = pz - p0.z;
        const vint ab = corner.x < corner.y ? passes_left(p0, dx, dy, dz, a, b, false) : passes_left(p0, dx, dy, dz, b, a, true);
        const vint bc = corner.y < corner.z ? passes_left(p0, dx, dy, dz, b, c, false) : passes_left(p0, dx, dy, dz, c, b, true);
        const vint ca = corner.z < corner.x ? passes_left(p0, dx, dy, dz, c, a, false) : passes_left(p0, dx, dy, dz, a, c, true);
        through &= v_not(ab ^ bc) & v_not(bc ^ ca);
        for (uint lanes = lane_bits(through); lanes != 0; lanes &= lanes - 1) {
          const int i = v + first_lane(lanes);
          sweep->depth[i] += centre_front == front0 ? 1 : -1;
          if (!cuts) continue;
          if (sweep->crossed_count[i] == HS_CROSSED) return false;
          sweep->crossed[i * HS_CROSSED + sweep->crossed_count[i]++] = triangle << 1 | (uint)(centre_front == front0);
        }
      }
    }
  }
  return true;
}

// The samples that each receiver sees, but for those with faces in `crossed`; base: D of the first. negative: whether a count is
// below 0.
void see_by_sweep(const HsDisc disc, const Sweep* sweep, const v_short* base, float* seen, int* negative) {
  const int n = (int)disc.sample_count;
  int known_depth = INT_MIN, known_count = 0;
  bool known_negative = false;
  for (int first = 0; first < sweep->count; first += HS_LANES) {
    const short16 depth = vload16(0, sweep->depth + first);
    short16 count = (short16)(0), below = (short16)(0);
    for (int i = 0; i < sweep->changing_count; ++i) {
      const int sample = sweep->changing[i];
      const short16 sum =
          sweep->deltas[first / HS_LANES * HS_MAX_SAMPLES + sample] + (short16)(((const short*)base)[sample]) + depth;
      count -= sum <= (short16)(0);
      below |= sum < (short16)(0);
    }
    for (int i = 0; i < min(HS_LANES, sweep->count - first); ++i) {
      const int lane_depth = sweep->depth[first + i];
      if (lane_depth != known_depth) {
        known_depth = lane_depth;
        known_count = 0;
        known_negative = false;
        for (int k = 0; k < n; k += HS_LANES) {
          const short16 sum = base[k / HS_LANES] + (short16)((short)lane_depth);
          const short16 still = vload16(0, sweep->changes + k) == (ushort16)(0);
          known_count += short_lane_count((sum <= (short16)(0)) & still);
          known_negative |= short_lane_count((sum < (short16)(0)) & still) != 0;
        }
      }
      seen[first + i] = (float)(((const short*)&count)[i] + known_count) / (float)n;
      negative[first + i] = ((const short*)&below)[i] != 0 || known_negative;
    }
  }
}

// D of one of the receivers, sample by sample.
void counts_by_sweep(const HsDisc disc, const SampleSet* set, const Sweep* sweep, const v_short* base,
                     __global const float4* planes, int i, v_short* counts) {
  const int n = (int)disc.sample_count;
  for (int k = 0; k < n / HS_LANES; ++k) counts[k] = base[k] + (v_short)(sweep->depth[i]);
  for (int k = 0; k < sweep->changing_count; ++k)
    ((short*)counts)[sweep->changing[k]] +=
        ((const short*)(sweep->deltas + i / HS_LANES * HS_MAX_SAMPLES + sweep->changing[k]))[i % HS_LANES];
  for (int k = 0; k < sweep->crossed_count[i]; ++k) {
    const uint crossed = sweep->crossed[i * HS_CROSSED + k];
    const float4 f = planes[crossed >> 1];
    const vint centre_front = 0.0f >= f.w ? (vint)(-1) : (vint)(0);
    const short16 change = (crossed & 1) ? (short16)(-2) : (short16)(2);  // against what `depth` has for the centre
    for (int at = 0; at < n; at += HS_LANES) {
      const vint front =
          v_load(set->samples + at) * (f.x * disc.radius) + v_load(set->samples + n + at) * (f.y * disc.radius) >= f.w;
      counts[at / HS_LANES] += v_short_of(front ^ centre_front) & change;
    }
  }
}
#endif
