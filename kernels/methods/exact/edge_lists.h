// Which edges a group of neighbouring receivers may have before its disc, for methods/exact: from the tile's list to a
// batch's, from that to those of ever fewer of its receivers.

#pragma once

#include "base/receiver.h"
#include "methods/exact/map_edges.h"

// Receivers to be counted, tile by tile: where each tile's begin and end in the list of pixel numbers.
#define HS_ARGS_LISTED_RECEIVERS \
  __global const uint *receiver_offsets, __global const uint *receiver_ends, __global const uint *listed

// Sizes by trial on the scenes of data/ and scanned figures (docs/decisions): HS_BATCH receivers of a tile have one list of at
// most HS_LISTED edges; what is narrowed from it for fewer of them lies behind it, HS_POOL edges in all. At most HS_GROUP
// receivers are counted together.
#if HS_LANES == 16
#define HS_GROUP 128
#define HS_BATCH 2048
#define HS_LISTED 8192
#define HS_POOL (3 * HS_LISTED + HS_LANES)
#define HS_FACES 16384
#else
#define HS_GROUP 1
#define HS_BATCH 1
#define HS_LISTED 1
#define HS_POOL 2
#define HS_FACES 1
#endif

// Receivers with one list in common. (Longer than need be: see EdgePool.)
typedef struct {
  uint pixel[HS_BATCH + HS_LANES];
  float x[HS_BATCH + HS_LANES], y[HS_BATCH + HS_LANES], z[HS_BATCH + HS_LANES];  // light space, lifted off their surface
  float u[HS_BATCH + HS_LANES], v[HS_BATCH + HS_LANES];  // texels, centres at half-integers as rasterizers have it
  float plane_d[HS_BATCH + HS_LANES], plane_dx[HS_BATCH + HS_LANES], plane_dy[HS_BATCH + HS_LANES];  // see Receiver
} Batch;

// Where some of them are.
typedef struct {
  float3 middle, half_size;   // light space
  float2 middle_px, half_px;  // map
  float far_z, d_far;         // depth of the farthest, and its 1/z
} Region;

// Edges that some receiver of a region may have before its disc: EdgeBlock, longer. Each list in the pool begins at a
// whole number of vectors. (Arrays a multiple of 4096 bytes long would put all fields of an edge into one set of the cache.)
typedef struct {
  float ax[HS_POOL], ay[HS_POOL], az[HS_POOL], bx[HS_POOL], by[HS_POOL], bz[HS_POOL];
  float n0x[HS_POOL], n0y[HS_POOL], n0z[HS_POOL], n0w[HS_POOL];
  float n1x[HS_POOL], n1y[HS_POOL], n1z[HS_POOL], n1w[HS_POOL];
  int m[HS_POOL], o0[HS_POOL], o1[HS_POOL];
} EdgePool;

// Loads receivers. Their positions are lifted off their surfaces by what they may be wrong: a 128th of a pixel, because the
// rasterizer snaps vertices to a 256th, or the rounding of coordinates; host/report/rays.cpp lifts as far.
HS_INLINE void load_batch(const HsView light, const HsReceiverView view, __global const uint* pixels, int count,
                          __global const float* depth_or_position, __global const float4* normal, Batch* batch) {
  const int width = (int)view.width_px;
  for (int i = 0; i < count; i += HS_LANES) {
    const vint pixel = load_int_lanes((__global const int*)pixels, i, min(count - i, HS_LANES));
    vfloat x, y, z, w, error;
    if (view.has_depth) {
      const vfloat z_vs = v_gather(depth_or_position, pixel);
      vint row = v_int(v_float(pixel) / (float)view.width_px);  // or one off
      row += v_select(v_select((vint)(0), (vint)(1), pixel - row * width >= width), (vint)(-1), pixel < row * width);
      light_space_of_depth(view, v_float(pixel - row * width), v_float(row), z_vs, &x, &y, &z, &w);
      error = max(z_vs * (2.0f * view.error_per_distance + 0x1p-21f / view.unit) + 2.0f * view.error,
                  max(max(fabs(x), fabs(y)), fabs(view.axis_ws.w != 0.0f ? z : w)) * 0x1p-22f);
    } else {
      vfloat x_ws, y_ws, z_ws, seen;
      v_gather4((__global const float4*)depth_or_position, pixel, &x_ws, &y_ws, &z_ws, &seen);
      light_space_of_position(view, x_ws, y_ws, z_ws, &x, &y, &z, &w);
      error = ((fabs(x_ws) + fabs(y_ws) + fabs(z_ws)) / view.unit + fabs(view.from_world_x.w) + fabs(view.from_world_y.w) +
               fabs(view.axis_ws.w != 0.0f ? view.from_world_z.w : view.from_world_w.w)) *
                  1e-6f +
              2.0f * (distance_from_light(x, y, z) * view.error_per_distance + view.error);
    }
    vfloat nx, ny, nz, receives;
    v_gather4(normal, pixel, &nx, &ny, &nz, &receives);
    vfloat slope_x, slope_y, slope_z;
    turn_to_light(view, nx, ny, nz, &slope_x, &slope_y, &slope_z);
    x += slope_x * error;
    y += slope_y * error;
    z += along_axis(view.from_world_z.xyz, nx, ny, nz) * (view.unit * error);
    w += along_axis(view.from_world_w.xyz, nx, ny, nz) * (view.unit * error);
    // As in locate.
    const vfloat to_slope = 1.0f / min(view.axis_ws.w * (slope_x * x + slope_y * y) + slope_z * z, (vfloat)(-1e-30f));
    const vfloat inverse_w = 1.0f / max(w, (vfloat)(1e-20f));
    x *= inverse_w;
    y *= inverse_w;
    z *= inverse_w;
    const vfloat d = 1.0f / z;
    v_store(v_as_float(pixel), (float*)batch->pixel + i);
    v_store(x, batch->x + i);
    v_store(y, batch->y + i);
    v_store(z, batch->z + i);
    v_store(x * d * light.px_from_q.x + light.px_from_q.y, batch->u + i);
    v_store(y * d * light.px_from_q.z + light.px_from_q.w, batch->v + i);
    v_store(d, batch->plane_d + i);
    v_store(slope_x * to_slope / light.px_from_q.x, batch->plane_dx + i);
    v_store(slope_y * to_slope / light.px_from_q.z, batch->plane_dy + i);
  }
}

HS_INLINE void bound_values(const float* values, int first, int end, float* middle, float* half_size) {
  vfloat low = (vfloat)(INFINITY), high = (vfloat)(-INFINITY);
  for (int i = first; i < end; i += HS_LANES) {
    const vint some = v_iota < end - i;
    const vfloat v = v_load(values + i);
    low = v_select(low, min(low, v), some);
    high = v_select(high, max(high, v), some);
  }
  const float least = v_reduce_min(low), most = -v_reduce_min(-high);
  *middle = 0.5f * (least + most);
  *half_size = 0.5f * (most - least);
}

// Not returned: what a returned struct brings with it when it is inlined is unknown to Oclgrind 21.10.
HS_INLINE void bound_region(const Batch* batch, int first, int end, Region* region) {
  float mx, my, mz, hx, hy, hz, mu, mv, hu, hv;
  bound_values(batch->x, first, end, &mx, &hx);
  bound_values(batch->y, first, end, &my, &hy);
  bound_values(batch->z, first, end, &mz, &hz);
  bound_values(batch->u, first, end, &mu, &hu);
  bound_values(batch->v, first, end, &mv, &hv);
  region->middle = (float3)(mx, my, mz);
  region->half_size = (float3)(hx, hy, hz);
  region->middle_px = (float2)(mu, mv);
  region->half_px = (float2)(hu, hv);
  region->far_z = (mz + hz) * 1.000001f;  // not rounded below the farthest
  region->d_far = 1.0f / region->far_z;
}

// The side of a plane that a region is on: 1 or -1, or 0 if the plane cuts it or comes too near.
HS_INLINE vint side_of_region(const Region* region, vfloat nx, vfloat ny, vfloat nz, vfloat w) {
#pragma OPENCL FP_CONTRACT ON
  const vfloat v = nx * region->middle.x + ny * region->middle.y + nz * region->middle.z - w;
  const vfloat reach = fabs(nx) * region->half_size.x + fabs(ny) * region->half_size.y + fabs(nz) * region->half_size.z +
                       1e-6f * (fabs(w) + fabs(region->middle.x) + fabs(region->middle.y) + fabs(region->middle.z));
  return v_select((vint)(0), (vint)(1), v > reach) - v_select((vint)(0), (vint)(1), v < -reach);
}

// Makes a list a whole number of vectors long, with edges that are none.
HS_INLINE void pad_list(EdgePool* list, int first, int count) {
  for (int i = first + count; i & (HS_LANES - 1); ++i) {
    list->m[i] = list->o0[i] = list->o1[i] = 0;
    list->ax[i] = list->ay[i] = list->bx[i] = list->by[i] = 0.0f;
    list->az[i] = list->bz[i] = 1.0f;
  }
}

// A vector of edges.
typedef struct {
  vfloat ax, ay, az, bx, by, bz;
  vfloat n0x, n0y, n0z, n0w, n1x, n1y, n1z, n1w;
  vint m, o0, o1;
} Edges;

// Loads what blocks and pools call by the same names.
#define HS_LOAD_EDGES(edges, list, i)      \
  (edges).ax = v_load((list)->ax + (i));   \
  (edges).ay = v_load((list)->ay + (i));   \
  (edges).az = v_load((list)->az + (i));   \
  (edges).bx = v_load((list)->bx + (i));   \
  (edges).by = v_load((list)->by + (i));   \
  (edges).bz = v_load((list)->bz + (i));   \
  (edges).n0x = v_load((list)->n0x + (i)); \
  (edges).n0y = v_load((list)->n0y + (i)); \
  (edges).n0z = v_load((list)->n0z + (i)); \
  (edges).n0w = v_load((list)->n0w + (i)); \
  (edges).n1x = v_load((list)->n1x + (i)); \
  (edges).n1y = v_load((list)->n1y + (i)); \
  (edges).n1z = v_load((list)->n1z + (i)); \
  (edges).n1w = v_load((list)->n1w + (i));

// Puts those of the edges that receivers of a region may need into the pool. A face's side that is the same for all of them is
// added to m, and most edges, silhouettes for some other part of the tile, then have none left. Returns their number.
HS_INLINE int keep_edges(const HsView light, float radius_px, const Region* region, const Edges* e, EdgePool* pool, int to) {
  MapEdges in_map;
  project_to_map(light, e->ax, e->ay, e->az, e->bx, e->by, e->bz, &in_map);
  const vint near = reach_receivers(&in_map, radius_px, region->middle_px, region->half_px, region->d_far);
  if (!v_any(near)) return 0;
  const vint side0 = side_of_region(region, e->n0x, e->n0y, e->n0z, e->n0w);
  const vint side1 = side_of_region(region, e->n1x, e->n1y, e->n1z, e->n1w);
  const vint m = e->m + e->o0 * side0 + e->o1 * side1;
  const vint o0 = v_select(e->o0, (vint)(0), side0 != 0), o1 = v_select(e->o1, (vint)(0), side1 != 0);
  const vint keep = near & ((m | o0 | o1) != 0);
  const uint bits = lane_bits(keep);
  v_store_chosen(e->ax, bits, pool->ax + to);
  v_store_chosen(e->ay, bits, pool->ay + to);
  v_store_chosen(e->az, bits, pool->az + to);
  v_store_chosen(e->bx, bits, pool->bx + to);
  v_store_chosen(e->by, bits, pool->by + to);
  v_store_chosen(e->bz, bits, pool->bz + to);
  v_store_chosen(e->n0x, bits, pool->n0x + to);
  v_store_chosen(e->n0y, bits, pool->n0y + to);
  v_store_chosen(e->n0z, bits, pool->n0z + to);
  v_store_chosen(e->n0w, bits, pool->n0w + to);
  v_store_chosen(e->n1x, bits, pool->n1x + to);
  v_store_chosen(e->n1y, bits, pool->n1y + to);
  v_store_chosen(e->n1z, bits, pool->n1z + to);
  v_store_chosen(e->n1w, bits, pool->n1w + to);
  v_store_chosen_ints(m, bits, pool->m + to);
  v_store_chosen_ints(o0, bits, pool->o0 + to);
  v_store_chosen_ints(o1, bits, pool->o1 + to);
  return (int)popcount(bits);
}

// Lists from `to_first` on those of the `count` edges from `first` on that receivers of the region may need. Returns their
// number.
HS_INLINE int narrow_list(const HsView light, float radius_px, const Region* region, EdgePool* pool, int first, int count,
                          int to_first) {
  int to = to_first;
  for (int i = first; i < first + count; i += HS_LANES) {
    Edges e;
    HS_LOAD_EDGES(e, pool, i)
    e.m = v_load(pool->m + i);
    e.o0 = v_load(pool->o0 + i);
    e.o1 = v_load(pool->o1 + i);
    to += keep_edges(light, radius_px, region, &e, pool, to);
  }
  pad_list(pool, to_first, to - to_first);
  return to - to_first;
}

// Edges of a tile, in blocks.
typedef struct {
  __global const EdgeBlock* edges;
  uint edge_count;
  __global const uint* refs;  // 0: all blocks
  uint first, end;
} TileEdges;

// Lists, from the pool's beginning, the edges of a tile from block *from on that receivers of the region may need, as many as
// fit; *from: the first that is left. Returns their number.
HS_INLINE int list_edges(const HsView light, float radius_px, const Region* region, const TileEdges* tile_edges, EdgePool* pool,
                         uint* from) {
  int count = 0;
  for (; *from < tile_edges->end && count + HS_LANES <= HS_LISTED; ++*from) {
    const uint number = tile_edges->refs ? tile_edges->refs[*from] : *from;
    __global const EdgeBlock* block = tile_edges->edges + number;
    Edges e;
    HS_LOAD_EDGES(e, block, 0)
    const vint some = v_iota < edges_in_block(number, tile_edges->edge_count), orientations = v_load(block->orientations);
    e.m = v_select((vint)(0), v_load(block->m), some);
    e.o0 = v_select((vint)(0), (orientations & 3) - 1, some);
    e.o1 = v_select((vint)(0), (orientations >> 2) - 1, some);
    count += keep_edges(light, radius_px, region, &e, pool, count);
  }
  pad_list(pool, 0, count);
  return count;
}

// Puts the chosen of values first .. end before the others, in order. chosen: as lane_bits has them, a vector each.
HS_INLINE void part_values(float* values, int first, int end, const ushort* chosen) {
  float others[HS_BATCH + HS_LANES];
  const vfloat behind = v_load(values + end);  // stores of vectors reach past the end
  int to = first, other_count = 0;
  for (int i = first; i < end; i += HS_LANES) {
    const vfloat v = v_load(values + i);
    const uint bits = chosen[(i - first) / HS_LANES], all = (1u << min(end - i, HS_LANES)) - 1u;
    v_store_chosen(v, bits, values + to);
    v_store_chosen(v, all & ~bits, others + other_count);
    to += (int)popcount(bits);
    other_count += (int)popcount(all & ~bits);
  }
  for (int i = 0; i < other_count; i += HS_LANES) v_store(v_load(others + i), values + to + i);
  v_store(behind, values + end);
}

// Parts receivers first .. end in the middle of where they reach farthest. Returns where the second part begins.
HS_INLINE int split_receivers(Batch* batch, int first, int end, const Region* region) {
  const float3 size = region->half_size;
  const float* at = size.x >= max(size.y, size.z) ? batch->x : size.y >= size.z ? batch->y : batch->z;
  const float middle = at == batch->x ? region->middle.x : at == batch->y ? region->middle.y : region->middle.z;
  ushort chosen[HS_BATCH / HS_LANES + 1];
  int low = first;
  for (int i = first; i < end; i += HS_LANES) {
    const uint bits = lane_bits((v_load(at + i) < middle) & (v_iota < end - i));
    chosen[(i - first) / HS_LANES] = (ushort)bits;
    low += (int)popcount(bits);
  }
  part_values((float*)batch->pixel, first, end, chosen);
  part_values(batch->x, first, end, chosen);
  part_values(batch->y, first, end, chosen);
  part_values(batch->z, first, end, chosen);
  part_values(batch->u, first, end, chosen);
  part_values(batch->v, first, end, chosen);
  part_values(batch->plane_d, first, end, chosen);
  part_values(batch->plane_dx, first, end, chosen);
  part_values(batch->plane_dy, first, end, chosen);
  return low == first || low == end ? (first + end) / 2 : low;
}
