// Method exact: which samples of the light each listed receiver sees.

#include "methods/exact/swept_edges.h"
#include "raster/triangles.h"

#if HS_LANES == 16
// Groups of fewer receivers count each for itself, as do those whose edges times receivers are little work. By trial.
#define HS_MIN_GROUP 4
#define HS_LITTLE_WORK 8192
#define HS_PAIRS_LEFT 0.6f  // of pairs to an edge, in half of a group
#define HS_NARROW_AGAIN 2
#define HS_MAX_PARTS 64
#else
#define HS_MIN_GROUP 1
#define HS_LITTLE_WORK 0
#define HS_PAIRS_LEFT 1.0f
#define HS_NARROW_AGAIN 1
#define HS_MAX_PARTS 1
#endif

// What is known of a light, its map and what casts.
typedef struct {
  HsView view;
  HsDisc disc;
  SampleSet set;
  __global const float* shadow_map;
  CasterFaces faces;
} Casters;

// How many surfaces hide the light's centre from receivers first .. first + count: by the map where it is clear and no
// silhouette near, else by counting. Where no sample is less hidden than the centre (not `brighter`), hidden or not is enough.
void count_centres(const Casters* casters, const Batch* batch, const Region* batch_region, int first, int count, uint tile,
                   const Walk* walks, const int* brighter, FacesBefore* faces, int* centre) {
  int asking[HS_GROUP], crossings[HS_GROUP];
  int asking_count = 0;
  const bool touched = casters->faces.touching[0] > 0;  // by faces that the map has, but the count has not
  for (int i = 0; i < count; ++i) {
    const int lit = walks[i].near || touched ? 2 : lit_by_map(casters->view, casters->shadow_map, batch, first + i);
    centre[i] = lit == 1 ? 0 : 1;
    if (lit == 2 || (lit == 0 && brighter[i])) asking[asking_count++] = i;
  }
  if (asking_count == 0) return;
  count_triangles(casters->view, &casters->faces, batch, batch_region, first, asking, asking_count, tile, faces, crossings);
  for (int i = 0; i < asking_count; ++i) centre[asking[i]] = crossings[i];
}

// Where outputs go.
typedef struct {
  __global float* visibility;  // of the plane
  __global float4* tints;      // of the plane
  __global HsStatus* status;
} Outputs;

HS_INLINE void store_visible(const Outputs* outputs, const Casters* casters, uint pixel, float seen, bool negative,
                             const v_short* counts, int centre) {
  if (negative) atomic_inc(&outputs->status->negative_count);
  outputs->visibility[pixel] = seen;
  if (casters->disc.tinted)
    outputs->tints[pixel] = counts ? tint_of(counts, centre, (int)casters->disc.sample_count, casters->set.weights)
                                   : (float4)(seen, seen, seen, 1.0f);
}

// A work-item's own memory.
typedef struct {
  Batch batch;
  Region batch_region;
  FacesBefore faces_before;
  EdgePool pool;
  Passing passing;
  v_short counts[HS_GROUP * HS_MAX_SAMPLES / HS_LANES];  // a vector's alignment: compilers split loads and stores of less
  Walk walks[HS_GROUP];
  int brighter[HS_GROUP], centre[HS_GROUP];
#if HS_LANES == 16
  v_short base[HS_MAX_SAMPLES / HS_LANES];
  Sweep sweep;
  NearFaces near_faces;
#endif
} Workspace;

HS_INLINE v_short* counts_of(Workspace* w, int i) {
  return w->counts + i * (HS_MAX_SAMPLES / HS_LANES);
}

// What the samples of receiver k are turned by.
HS_INLINE float2 turn_of_samples(const Casters* casters, const Workspace* w, int k) {
  return casters->disc.rotated ? rotation_of(w->batch.pixel[k]) : (float2)(1.0f, 0.0f);
}

// Adds the crossings of a list's edges to the counts of receiver first + i.
void walk_edges(const Casters* casters, Workspace* w, int list_first, int list_count, int first, int i) {
  const int k = first + i;
  const int passing_count = project_edges(&w->pool, list_first, list_count, casters->disc, w->batch.x[k], w->batch.y[k],
                                          w->batch.z[k], &w->passing, &w->walks[i]);
  if (passing_count > 0)
    count_crossings(&w->passing, passing_count, casters->disc, turn_of_samples(casters, w, k), &casters->set, counts_of(w, i),
                    &w->walks[i]);
}

// Adds to the counts of receivers first .. first + count, whose edges have been walked, the faces that touch the light.
void add_touching_faces(const Casters* casters, Workspace* w, int first, int count) {
  if (casters->faces.touching[0] == 0) return;
  for (int i = 0; i < count; ++i) {
    const int k = first + i;
    touch_counts(&w->walks[i], (int)casters->disc.sample_count, counts_of(w, i));
    count_touching_faces(&casters->faces, casters->disc, &casters->set, turn_of_samples(casters, w, k),
                         (float3)(w->batch.x[k], w->batch.y[k], w->batch.z[k]), counts_of(w, i));
  }
}

// Whether some count is below 0: without, nothing is less hidden than the centre.
bool finds_brighter(const v_short* counts, int n) {
  v_short below = (v_short)((short)0);
  for (int k = 0; k < n / HS_LANES; ++k) below |= counts[k] < (v_short)((short)0);
  return short_lane_count(below) != 0;
}

// Outputs a receiver by its counts; 0: all are 0.
void store_counts(const Casters* casters, const Outputs* outputs, uint pixel, const v_short* counts, int centre) {
  const int n = (int)casters->disc.sample_count;
  float seen = centre <= 0 ? 1.0f : 0.0f;
  bool negative = centre < 0;
  if (counts) {
    int seen_count = 0;
    for (int k = 0; k < n / HS_LANES; ++k) {
      const v_short depth = counts[k] + (v_short)((short)centre);
      seen_count += short_lane_count(depth <= (v_short)((short)0));
      negative |= short_lane_count(depth < (v_short)((short)0)) != 0;
    }
    seen = (float)seen_count / (float)n;
  }
  store_visible(outputs, casters, pixel, seen, negative, counts, centre);
}

// Outputs receivers first .. first + count whose edges have been walked.
void store_walked(const Casters* casters, Workspace* w, int first, int count, uint tile, const Outputs* outputs) {
  add_touching_faces(casters, w, first, count);
  for (int i = 0; i < count; ++i)
    w->brighter[i] = w->walks[i].touched && finds_brighter(counts_of(w, i), (int)casters->disc.sample_count);
  count_centres(casters, &w->batch, &w->batch_region, first, count, tile, w->walks, w->brighter, &w->faces_before, w->centre);
  for (int i = 0; i < count; ++i)
    store_counts(casters, outputs, w->batch.pixel[first + i], w->walks[i].touched ? counts_of(w, i) : 0, w->centre[i]);
}

HS_INLINE void forget_walks(Workspace* w, int count) {
  for (int i = 0; i < count; ++i) w->walks[i].touched = w->walks[i].near = false;
}

#if HS_LANES == 16
// Lists the triangles of the tile that come near the region of receivers first .. end.
void find_near_faces(const Casters* casters, const Region* region, uint tile, int first, int end, NearFaces* faces) {
  float3 low, high;
  box_of_region(region, &low, &high);
  faces->count = faces->first = faces->end = 0;
  if (bins_overflow(casters->faces.offsets, casters->view.tiles_x * casters->view.tiles_y, casters->faces.capacity)) return;
  for (uint i = casters->faces.offsets[tile]; i < casters->faces.offsets[tile + 1]; ++i) {
    const uint triangle = casters->faces.refs[i];
    const uint3 corner = vload3(triangle, casters->faces.triangles);
    const float3 a = casters->faces.vertices_ls[corner.x].xyz, b = casters->faces.vertices_ls[corner.y].xyz,
                 c = casters->faces.vertices_ls[corner.z].xyz;
    const float3 least = min(a, min(b, c)), most = max(a, max(b, c));
    if (any(least > high) || any(most < low)) continue;
    const int at = faces->count;
    if (at == HS_NEAR_FACES) return;
    faces->low_x[at] = least.x;
    faces->low_y[at] = least.y;
    faces->low_z[at] = least.z;
    faces->high_x[at] = most.x;
    faces->high_y[at] = most.y;
    faces->high_z[at] = most.z;
    faces->triangle[at] = triangle;
    ++faces->count;
  }
  faces->first = first;
  faces->end = end;
}

// So many pairs of an edge and a sample that it may pass over, and a group is cheaper propagated than in halves, of which each
// needs a walk and has more than half of them, and than walked. By trial, as the cost of a pair.
HS_INLINE int max_pairs(int count, int list_count) {
  return min(4 * list_count + 3072, count * (4 + list_count / 3));
}

// Outputs a group by one walk and what changes from there. False, and nothing done, where walks are cheaper or have to decide.
bool propagate_in_group(const Casters* casters, Workspace* w, const Region* region, int list_first, int list_count, int first,
                        int count, uint tile, const Outputs* outputs) {
  Sweep* sweep = &w->sweep;
  const int n = (int)casters->disc.sample_count;
  if (!find_swept(casters->disc, &casters->set, region, &w->pool, list_first, list_count, max_pairs(count, list_count), sweep))
    return false;
  load_swept(&w->batch, region, first, count, sweep);
  if (first < w->near_faces.first || first + count > w->near_faces.end) {
    find_near_faces(casters, region, tile, first, first + count, &w->near_faces);
    if (w->near_faces.end == 0) return false;
  }
  if (!find_crossed(region, &w->near_faces, casters->faces.triangles, casters->faces.vertices_ls, casters->faces.planes,
                    casters->faces.disc_sides, sweep) ||
      !sum_deltas(casters->disc, &casters->set, region, &w->pool, list_first, sweep))
    return false;

  forget_walks(w, 1);
  walk_edges(casters, w, list_first, list_count, first, 0);
  const int brighter = 1;  // than p0 some neighbour may be
  count_centres(casters, &w->batch, &w->batch_region, first, 1, tile, w->walks, &brighter, &w->faces_before, w->centre);
  for (int k = 0; k < n / HS_LANES; ++k)
    w->base[k] = (w->walks[0].touched ? w->counts[k] : (v_short)(0)) + (v_short)((short)w->centre[0]);
  float seen[HS_GROUP];
  int negative[HS_GROUP];
  see_by_sweep(casters->disc, sweep, w->base, seen, negative);
  for (int i = 0; i < count; ++i) {
    const uint pixel = w->batch.pixel[first + sweep->order[i]];
    if (casters->disc.tinted || sweep->crossed_count[i] > 0) {
      counts_by_sweep(casters->disc, &casters->set, sweep, w->base, casters->faces.planes, i, w->counts);
      store_counts(casters, outputs, pixel, w->counts, 0);
    } else {
      store_visible(outputs, casters, pixel, seen[i], negative[i], 0, 0);
    }
  }
  return true;
}
#endif

// Counts receivers whose edges are too many for a list even if they are few: they go through all of them, a listful at a time.
void count_in_listfuls(const Casters* casters, Workspace* w, const Region* region, int first, int count, uint tile,
                       const TileEdges* tile_edges, const Outputs* outputs) {
  for (int group = first; group < first + count; group += HS_GROUP) {
    const int group_count = min(first + count - group, HS_GROUP);
    forget_walks(w, group_count);
    for (uint from = tile_edges->first; from < tile_edges->end;) {
      const int list_count = list_edges(casters->view, casters->disc.radius_px, region, tile_edges, &w->pool, &from);
      if (list_count > 0)
        for (int i = 0; i < group_count; ++i) walk_edges(casters, w, 0, list_count, group, i);
    }
    store_walked(casters, w, group, group_count, tile, outputs);
  }
}

// Counts a batch: in halves, until the edges of a half fit into the list and one receiver's result can be propagated to all, or
// there is too little to propagate.
void count_batch(const Casters* casters, Workspace* w, int batch_count, uint tile, const TileEdges* tile_edges,
                 const Outputs* outputs) {
  struct {
    int first, count;
    int list_first, list_count;  // in the pool; list_count < 0: not listed yet
    int narrowed_for;            // receivers
    float pairs_per_edge;        // what propagation would take, about; 0: not known
  } parts[HS_MAX_PARTS];
  bound_region(&w->batch, 0, batch_count, &w->batch_region);
  w->faces_before.from = w->faces_before.to = 0;
#if HS_LANES == 16
  find_near_faces(casters, &w->batch_region, tile, 0, batch_count, &w->near_faces);
#endif
  parts[0].first = parts[0].list_first = 0;
  parts[0].count = parts[0].narrowed_for = batch_count;
  parts[0].list_count = -1;
  parts[0].pairs_per_edge = 0.0f;
  for (int waiting = 1; waiting > 0;) {
    --waiting;
    const int first = parts[waiting].first, count = parts[waiting].count;
    int list_first = parts[waiting].list_first, list_count = parts[waiting].list_count,
        narrowed_for = parts[waiting].narrowed_for;
    float pairs_per_edge = parts[waiting].pairs_per_edge;
    Region region;
    bound_region(&w->batch, first, first + count, &region);
    bool listed = list_count >= 0;
    if (!listed) {
      uint from = tile_edges->first;
      list_count = list_edges(casters->view, casters->disc.radius_px, &region, tile_edges, &w->pool, &from);
      narrowed_for = count;
      listed = from == tile_edges->end;
      if (!listed && (count <= HS_GROUP || waiting + 2 > HS_MAX_PARTS)) {
        count_in_listfuls(casters, w, &region, first, count, tile, tile_edges, outputs);
        continue;
      }
    } else {
      const int behind = list_first + (list_count + HS_LANES - 1) / HS_LANES * HS_LANES;
      if (list_count > 0 && (count * HS_NARROW_AGAIN <= narrowed_for) && behind + list_count + HS_LANES <= HS_POOL) {
        list_count = narrow_list(casters->view, casters->disc.radius_px, &region, &w->pool, list_first, list_count, behind);
        list_first = behind;
        narrowed_for = count;
      }
    }
    if (listed && count <= HS_GROUP) {
      bool propagates = false;
#if HS_LANES == 16
      propagates = casters->disc.radius > 0.0f && !casters->disc.sphere && !casters->disc.rotated && count >= HS_MIN_GROUP &&
                   list_count > 0 && casters->faces.touching[0] == 0;
      if (propagates && pairs_per_edge * (float)list_count <= (float)max_pairs(count, list_count)) {
        if (propagate_in_group(casters, w, &region, list_first, list_count, first, count, tile, outputs)) continue;
        pairs_per_edge = w->sweep.pairs_per_edge;
      }
#endif
      if (!propagates || count < 2 * HS_MIN_GROUP || count * list_count < HS_LITTLE_WORK || waiting + 2 > HS_MAX_PARTS) {
        forget_walks(w, count);
        if (list_count > 0)
          for (int i = 0; i < count; ++i) walk_edges(casters, w, list_first, list_count, first, i);
        store_walked(casters, w, first, count, tile, outputs);
        continue;
      }
    }
    const int middle = split_receivers(&w->batch, first, first + count, &region);
    for (int second = 1; second >= 0; --second) {
      parts[waiting].first = second ? middle : first;
      parts[waiting].count = second ? first + count - middle : middle - first;
      parts[waiting].list_first = list_first;
      parts[waiting].list_count = listed ? list_count : -1;
      parts[waiting].narrowed_for = narrowed_for;
      parts[waiting].pairs_per_edge = pairs_per_edge * HS_PAIRS_LEFT;
      ++waiting;
    }
  }
}

// How much there is to do in a tile, about.
HS_INLINE uint work_of_tile(uint tile, __global const uint* receiver_offsets, __global const uint* receiver_ends,
                            __global const uint* edge_offsets) {
  const float receivers = (float)(receiver_ends[tile] - receiver_offsets[tile]);
  return convert_uint_sat(receivers * (float)(edge_offsets[tile + 1] - edge_offsets[tile] + 1));
}

// Counts for the listed receivers: work-items take tiles from `queue` (CPU) or are a tile's pixels (GPU).
// tints: float4 a pixel of a light with a texture: in xyz, relative to the whole light, how much of each channel is seen, where
// w = 1; where w = 0 it is as much of each, the visibility. weights: as SampleTable has them.
// samples: x, y of the unit disc's sample points, sorted by angle, and their turns: 3 sample_count floats. below: as SampleTable
// has it.
__kernel void count_samples(const HsView light, const HsReceiverView view, const HsDisc disc, HS_ARGS_GBUFFER,
                            __global const float* shadow_map, HS_ARGS_EDGE_TILES, HS_ARGS_SAMPLES, HS_ARGS_TINTS,
                            HS_ARGS_TRIANGLE_TILES, HS_ARGS_TRIANGLES, HS_ARGS_DISC_FACES, HS_ARGS_LISTED_RECEIVERS,
                            __global int* queue, HS_ARGS_VISIBILITY, __global HsStatus* status) {
  const uint tile_count = light.tiles_x * light.tiles_y;
  const bool overflow = bins_overflow(edge_offsets, tile_count, edge_capacity);
  const size_t pixels = (size_t)view.width_px * view.height_px;
  const Casters casters = {light,
                           disc,
                           {samples, below, weights, cell_xy, cells, window_xy, windows},
                           shadow_map,
                           {triangle_blocks, triangle_slot_count, triangle_rects, triangle_offsets, triangle_refs,
                            triangle_capacity, triangles, vertices_vs, vertices_px, planes, disc_sides, touching}};
  const Outputs outputs = {visibility + plane * pixels, tints + tint_plane * pixels, status};
  Workspace w;
#if HS_LANES == 16
  // Tiles with much to do first: one that is begun last is waited for.
  uint most = 0;
  for (uint tile = 0; tile < tile_count; ++tile)
    most = max(most, work_of_tile(tile, receiver_offsets, receiver_ends, edge_offsets));
  for (uint next = atomic_inc(queue); next < 2 * tile_count; next = atomic_inc(queue)) {
    const uint tile = next % tile_count;
    const bool much = work_of_tile(tile, receiver_offsets, receiver_ends, edge_offsets) > most / 3;
    if (much != (next < tile_count)) continue;
    const uint step = HS_BATCH, begin_at = receiver_offsets[tile];
#else
  {
    const uint tile = get_group_id(0), step = get_local_size(0), begin_at = receiver_offsets[tile] + get_local_id(0);
#endif
    const TileEdges tile_edges = {edges, status->feature_count, overflow ? 0 : edge_refs, overflow ? 0 : edge_offsets[tile],
                                  overflow ? blocks_of(status->feature_count) : edge_offsets[tile + 1]};
    for (uint batch_first = begin_at; batch_first < receiver_ends[tile]; batch_first += step) {
      const int batch_count = min((int)(receiver_ends[tile] - batch_first), HS_BATCH);
      load_batch(light, view, listed + batch_first, batch_count, depth_or_position, normal, &w.batch);
      count_batch(&casters, &w, batch_count, tile, &tile_edges, &outputs);
    }
  }
}
