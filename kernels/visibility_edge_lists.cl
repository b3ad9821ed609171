// Which edges a group of neighbouring receivers may have before its disc, for visibility_exact.cl: from the tile's list to a
// batch's, from that to those of ever fewer of its receivers.

// HS_BATCH receivers of a tile share one list of at most HS_LISTED edges; what is narrowed from it for fewer of them lies behind
// it, HS_POOL edges in all. At most HS_GROUP receivers are counted together.
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

// Receivers that share a list. (Longer than need be: see EdgePool.)
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

// Edges that some receiver of a region may have before its disc: HsEdge, a field an array. Each list in the pool begins at a
// whole number of vectors. (Arrays a multiple of 4096 bytes long would have all fields of an edge share one set of the cache.)
typedef struct {
  float ax[HS_POOL], ay[HS_POOL], az[HS_POOL], bx[HS_POOL], by[HS_POOL], bz[HS_POOL];
  float n0x[HS_POOL], n0y[HS_POOL], n0z[HS_POOL], n0w[HS_POOL];
  float n1x[HS_POOL], n1y[HS_POOL], n1z[HS_POOL], n1w[HS_POOL];
  int m[HS_POOL], o0[HS_POOL], o1[HS_POOL];
} EdgePool;

// Loads receivers. Their positions are lifted off their surfaces by what they may be wrong: a 128th of a pixel, because the
// rasterizer snaps vertices to a 256th, or the rounding of coordinates; host/rays.cpp lifts as far.
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
      error = fmax(z_vs * (view.size_per_px * (1.0f / 128.0f) + 0x1p-21f),
                   view.unit * fmax(fmax(fabs(x), fabs(y)), fabs(view.axis_ws.w != 0.0f ? z : w)) * 0x1p-22f);
    } else {
      vfloat x_ws, y_ws, z_ws, seen;
      v_gather4((__global const float4*)depth_or_position, pixel, &x_ws, &y_ws, &z_ws, &seen);
      light_space_of_position(view, x_ws, y_ws, z_ws, &x, &y, &z, &w);
      error = (fabs(x_ws) + fabs(y_ws) + fabs(z_ws) +
               view.unit * (fabs(view.from_world_x.w) + fabs(view.from_world_y.w) +
                            fabs(view.axis_ws.w != 0.0f ? view.from_world_z.w : view.from_world_w.w))) *
                  1e-6f +
              distance_from_camera(view, x, y, z, w) * (view.size_per_px * (1.0f / 128.0f));
    }
    vfloat nx, ny, nz, receives;
    v_gather4(normal, pixel, &nx, &ny, &nz, &receives);
    vfloat slope_x = along_axis(view.from_world_x.xyz, nx, ny, nz), slope_y = along_axis(view.from_world_y.xyz, nx, ny, nz);
    x += slope_x * error;
    y += slope_y * error;
    z += along_axis(view.from_world_z.xyz, nx, ny, nz) * error;
    w += along_axis(view.from_world_w.xyz, nx, ny, nz) * error;
    // As in locate.
    const vfloat to_slope =
        1.0f /
        fmin(view.axis_ws.w * (slope_x * x + slope_y * y) + along_axis(view.axis_ws.xyz, nx, ny, nz) * z, (vfloat)(-1e-30f));
    const vfloat inverse_w = 1.0f / fmax(w, (vfloat)(1e-20f));
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
    low = v_select(low, fmin(low, v), some);
    high = v_select(high, fmax(high, v), some);
  }
  const float least = v_least(low), most = -v_least(-high);
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

// Lists from `to_first` on, which may be `first`, those of the `count` edges from `first` on that receivers of the region may
// need. A face's side that is the same for all of them is added to m, and most edges, silhouettes for some other part of the
// tile, then have none left. Returns their number.
HS_INLINE int narrow_list(const HsView light, float radius_px, const Region* region, EdgePool* pool, int first, int count,
                          int to_first) {
  int to = to_first;
  for (int i = first; i < first + count; i += HS_LANES) {
    vint o0 = v_load(pool->o0 + i), o1 = v_load(pool->o1 + i);
    const vint side0 =
        side_of_region(region, v_load(pool->n0x + i), v_load(pool->n0y + i), v_load(pool->n0z + i), v_load(pool->n0w + i));
    const vint side1 =
        side_of_region(region, v_load(pool->n1x + i), v_load(pool->n1y + i), v_load(pool->n1z + i), v_load(pool->n1w + i));
    const vint m = v_load(pool->m + i) + o0 * side0 + o1 * side1;
    o0 = v_select(o0, (vint)(0), side0 != 0);
    o1 = v_select(o1, (vint)(0), side1 != 0);
    vint keep = (m | o0 | o1) != 0;
    if (!v_any(keep)) continue;

    MapEdges in_map;
    project_to_map(light, v_load(pool->ax + i), v_load(pool->ay + i), v_load(pool->az + i), v_load(pool->bx + i),
                   v_load(pool->by + i), v_load(pool->bz + i), &in_map);
    keep &= reach_receivers(&in_map, radius_px, region->middle_px, region->half_px, region->d_far);
    const uint bits = lane_bits(keep);
    v_store_chosen(v_load(pool->ax + i), bits, pool->ax + to);
    v_store_chosen(v_load(pool->ay + i), bits, pool->ay + to);
    v_store_chosen(v_load(pool->az + i), bits, pool->az + to);
    v_store_chosen(v_load(pool->bx + i), bits, pool->bx + to);
    v_store_chosen(v_load(pool->by + i), bits, pool->by + to);
    v_store_chosen(v_load(pool->bz + i), bits, pool->bz + to);
    v_store_chosen(v_load(pool->n0x + i), bits, pool->n0x + to);
    v_store_chosen(v_load(pool->n0y + i), bits, pool->n0y + to);
    v_store_chosen(v_load(pool->n0z + i), bits, pool->n0z + to);
    v_store_chosen(v_load(pool->n0w + i), bits, pool->n0w + to);
    v_store_chosen(v_load(pool->n1x + i), bits, pool->n1x + to);
    v_store_chosen(v_load(pool->n1y + i), bits, pool->n1y + to);
    v_store_chosen(v_load(pool->n1z + i), bits, pool->n1z + to);
    v_store_chosen(v_load(pool->n1w + i), bits, pool->n1w + to);
    v_store_chosen_ints(m, bits, pool->m + to);
    v_store_chosen_ints(o0, bits, pool->o0 + to);
    v_store_chosen_ints(o1, bits, pool->o1 + to);
    to += (int)popcount(bits);
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

// Puts a block of a tile's edges where the pool has room for as many.
HS_INLINE void load_edges(const TileEdges* tile_edges, uint at, EdgePool* pool, int to) {
  const uint number = tile_edges->refs ? tile_edges->refs[at] : at;
  __global const EdgeBlock* block = tile_edges->edges + number;
  v_store(v_load(block->ax), pool->ax + to);
  v_store(v_load(block->ay), pool->ay + to);
  v_store(v_load(block->az), pool->az + to);
  v_store(v_load(block->bx), pool->bx + to);
  v_store(v_load(block->by), pool->by + to);
  v_store(v_load(block->bz), pool->bz + to);
  v_store(v_load(block->n0x), pool->n0x + to);
  v_store(v_load(block->n0y), pool->n0y + to);
  v_store(v_load(block->n0z), pool->n0z + to);
  v_store(v_load(block->n0w), pool->n0w + to);
  v_store(v_load(block->n1x), pool->n1x + to);
  v_store(v_load(block->n1y), pool->n1y + to);
  v_store(v_load(block->n1z), pool->n1z + to);
  v_store(v_load(block->n1w), pool->n1w + to);
  const vint some = v_iota < edges_in_block(number, tile_edges->edge_count), orientations = v_load(block->orientations);
  v_store(v_select((vint)(0), v_load(block->m), some), pool->m + to);
  v_store(v_select((vint)(0), (orientations & 3) - 1, some), pool->o0 + to);
  v_store(v_select((vint)(0), (orientations >> 2) - 1, some), pool->o1 + to);
}

// Lists, from the pool's beginning, the edges of a tile from block *from on that receivers of the region may need, as many as
// there is room for; *from: the first that is left. Returns their number.
HS_INLINE int list_edges(const HsView light, float radius_px, const Region* region, const TileEdges* tile_edges, EdgePool* pool,
                         uint* from) {
  int count = 0;
  for (; *from < tile_edges->end && count + HS_LANES <= HS_LISTED; ++*from) {
    load_edges(tile_edges, *from, pool, count);
    count += narrow_list(light, radius_px, region, pool, count, HS_LANES, count);
  }
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
  const float* at = size.x >= fmax(size.y, size.z) ? batch->x : size.y >= size.z ? batch->y : batch->z;
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
