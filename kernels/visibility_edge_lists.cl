// Which edges a group of neighbouring receivers may have before its disc, for visibility_exact.cl: from the tile's list to a
// batch's, from that to those of ever fewer of its receivers.

// HS_BATCH receivers of a tile share one list of at most HS_LISTED edges; what is narrowed from it for fewer of them lies behind
// it, HS_POOL edges in all. At most HS_GROUP receivers are counted together.
#if HS_LANES == 16
#define HS_GROUP 128
#define HS_BATCH 2048
#define HS_LISTED 8192
#define HS_POOL (3 * HS_LISTED + HS_LANES)
#else
#define HS_GROUP 1
#define HS_BATCH 1
#define HS_LISTED 1
#define HS_POOL 2
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

// A receiver's position in light space, lifted off its surface by what the position may be wrong: a 128th of its pixel, because
// the rasterizer snaps vertices to a 256th, or the rounding of coordinates; host/rays.cpp lifts as far. slope_ls: of its plane's
// 1/z in q.
HS_INLINE float3 lifted_receiver(const HsReceiverView view, uint pixel, __global const float* depth_or_position,
                                 __global const float4* normal, float2* slope_ls) {
  float4 p;
  float error;
  if (view.has_depth) {
    const float z = depth_or_position[pixel];
    p = z * (view.ray0 + (float)(pixel % view.width_px) * view.ray_dx + (float)(pixel / view.width_px) * view.ray_dy) +
        view.origin;
    error = fmax(z * (view.size_per_px * (1.0f / 128.0f) + 0x1p-21f),
                 view.unit * fmax(fmax(fabs(p.x), fabs(p.y)), fabs(view.axis_ws.w != 0.0f ? p.z : p.w)) * 0x1p-22f);
  } else {
    const float4 q = ((__global const float4*)depth_or_position)[pixel];
    const float4 h = (float4)(q.xyz, 1.0f);
    p = (float4)(dot(view.from_world_x, h), dot(view.from_world_y, h), dot(view.from_world_z, h), dot(view.from_world_w, h));
    error = (fabs(q.x) + fabs(q.y) + fabs(q.z) +
             view.unit * (fabs(view.from_world_x.w) + fabs(view.from_world_y.w) +
                          fabs(view.axis_ws.w != 0.0f ? view.from_world_z.w : view.from_world_w.w))) *
                1e-6f +
            distance_from_camera(view, p) * view.size_per_px * (1.0f / 128.0f);
  }
  const float3 n = normal[pixel].xyz;
  p += (float4)(dot(view.from_world_x.xyz, n), dot(view.from_world_y.xyz, n), dot(view.from_world_z.xyz, n),
                dot(view.from_world_w.xyz, n)) *
       error;
  // As in locate.
  *slope_ls = (float2)(dot(view.from_world_x.xyz, n), dot(view.from_world_y.xyz, n));
  *slope_ls /= fmin(view.axis_ws.w * dot(*slope_ls, p.xy) + dot(view.axis_ws.xyz, n) * p.z, -1e-30f);
  return p.xyz / fmax(p.w, 1e-20f);
}

HS_INLINE void load_batch(const HsView light, const HsReceiverView view, __global const uint* pixels, int count,
                          __global const float* depth_or_position, __global const float4* normal, Batch* batch) {
  for (int i = 0; i < count; ++i) {
    float2 slope;
    batch->pixel[i] = pixels[i];
    const float3 p = lifted_receiver(view, pixels[i], depth_or_position, normal, &slope);
    const float3 px = project_px(light, p);
    batch->x[i] = p.x;
    batch->y[i] = p.y;
    batch->z[i] = p.z;
    batch->u[i] = px.x;
    batch->v[i] = px.y;
    batch->plane_d[i] = px.z;
    batch->plane_dx[i] = slope.x / light.px_from_q.x;
    batch->plane_dy[i] = slope.y / light.px_from_q.z;
  }
}

// Not returned: what a returned struct brings with it when it is inlined is unknown to Oclgrind 21.10.
HS_INLINE void bound_region(const Batch* batch, int first, int end, Region* region) {
  float3 low = (float3)(1e30f), high = (float3)(-1e30f);
  float2 low_px = (float2)(1e30f), high_px = (float2)(-1e30f);
  for (int i = first; i < end; ++i) {
    const float3 p = (float3)(batch->x[i], batch->y[i], batch->z[i]);
    const float2 px = (float2)(batch->u[i], batch->v[i]);
    low = fmin(low, p);
    high = fmax(high, p);
    low_px = fmin(low_px, px);
    high_px = fmax(high_px, px);
  }
  region->middle = 0.5f * (low + high);
  region->half_size = 0.5f * (high - low);
  region->middle_px = 0.5f * (low_px + high_px);
  region->half_px = 0.5f * (high_px - low_px);
  region->far_z = high.z;
  region->d_far = 1.0f / high.z;
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

    // As tiles_with_edge, for many edges and one region.
    const vfloat az = v_load(pool->az + i), bz = v_load(pool->bz + i);
    const vint everywhere = fmin(az, bz) < light.znear * 0.5f;
    const vfloat da = 1.0f / az, db = 1.0f / bz;
    const vfloat ax = v_load(pool->ax + i) * da * light.px_from_q.x + (light.px_from_q.y - region->middle_px.x);
    const vfloat ay = v_load(pool->ay + i) * da * light.px_from_q.z + (light.px_from_q.w - region->middle_px.y);
    const vfloat bx = v_load(pool->bx + i) * db * light.px_from_q.x + (light.px_from_q.y - region->middle_px.x);
    const vfloat by = v_load(pool->by + i) * db * light.px_from_q.z + (light.px_from_q.w - region->middle_px.y);
    const float slack = HS_NEAR_PX + 0.25f;
    const vfloat ra = radius_px * fmax(da - region->d_far, 0.0f) + slack, rb = radius_px * fmax(db - region->d_far, 0.0f) + slack;
    const vfloat ex = bx - ax, ey = by - ay;
    const vfloat across = ax * ey - ay * ex, reach = fmax(ra, rb);
    const vfloat limit = reach * sqrt(ex * ex + ey * ey) * 1.00001f + fabs(ex) * region->half_px.y + fabs(ey) * region->half_px.x;
    const vint touches = (fmin(az, bz) < region->far_z) & (fmin(ax - ra, bx - rb) <= region->half_px.x) &
                         (fmax(ax + ra, bx + rb) >= -region->half_px.x) & (fmin(ay - ra, by - rb) <= region->half_px.y) &
                         (fmax(ay + ra, by + rb) >= -region->half_px.y) & (fabs(across) <= limit);
    keep &= touches | everywhere;
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

// Edges of a tile.
typedef struct {
  __global const HsEdge* edges;
  __global const uint* refs;  // 0: all edges
  uint first, end;
} TileEdges;

// Puts a vector of a tile's edges, from its first + `from` on, where the pool has room for as many; past the tile's end, none.
HS_INLINE void load_edges(const TileEdges* tile_edges, uint from, EdgePool* pool, int to) {
  vfloat field[16];
#if HS_LANES == 16
  for (uint i = 0; i < 16; ++i) {
    const uint at = min(from + i, tile_edges->end - 1);
    field[i] = vload16(0, (__global const float*)(tile_edges->edges + (tile_edges->refs ? tile_edges->refs[at] : at)));
  }
  // Transposed: each turn takes the lowest bit of where a number is in its vector to the top of which vector it is in.
#pragma unroll
  for (int turn = 0; turn < 4; ++turn) {
    vfloat turned[16];
#pragma unroll
    for (int i = 0; i < 8; ++i) {
      turned[i] = (float16)(field[2 * i].even, field[2 * i + 1].even);
      turned[8 + i] = (float16)(field[2 * i].odd, field[2 * i + 1].odd);
    }
#pragma unroll
    for (int i = 0; i < 16; ++i) field[i] = turned[i];
  }
#else
  __global const float* edge = (__global const float*)(tile_edges->edges + (tile_edges->refs ? tile_edges->refs[from] : from));
  for (int i = 0; i < 16; ++i) field[i] = edge[i];
#endif
  v_store(field[0], pool->ax + to);
  v_store(field[1], pool->ay + to);
  v_store(field[2], pool->az + to);
  v_store(field[4], pool->bx + to);
  v_store(field[5], pool->by + to);
  v_store(field[6], pool->bz + to);
  v_store(field[8], pool->n0x + to);
  v_store(field[9], pool->n0y + to);
  v_store(field[10], pool->n0z + to);
  v_store(field[11], pool->n0w + to);
  v_store(field[12], pool->n1x + to);
  v_store(field[13], pool->n1y + to);
  v_store(field[14], pool->n1z + to);
  v_store(field[15], pool->n1w + to);
  const vint some = v_iota < (int)(tile_edges->end - from), orientations = v_as_int(field[7]);
  v_store(v_select((vint)(0), v_as_int(field[3]), some), pool->m + to);
  v_store(v_select((vint)(0), (orientations & 3) - 1, some), pool->o0 + to);
  v_store(v_select((vint)(0), (orientations >> 2) - 1, some), pool->o1 + to);
}

// Lists, from the pool's beginning, the edges of a tile from *from on that receivers of the region may need, as many as there is
// room for; *from: the first that is left. Returns their number.
HS_INLINE int list_edges(const HsView light, float radius_px, const Region* region, const TileEdges* tile_edges, EdgePool* pool,
                         uint* from) {
  int count = 0;
  for (; *from < tile_edges->end && count + HS_LANES <= HS_LISTED; *from += HS_LANES) {
    load_edges(tile_edges, *from, pool, count);
    count += narrow_list(light, radius_px, region, pool, count, HS_LANES, count);
  }
  *from = min(*from, tile_edges->end);
  return count;
}

HS_INLINE void swap_floats(float* values, int i, int k) {
  const float value = values[i];
  values[i] = values[k];
  values[k] = value;
}

HS_INLINE void swap_receivers(Batch* batch, int i, int k) {
  const uint pixel = batch->pixel[i];
  batch->pixel[i] = batch->pixel[k];
  batch->pixel[k] = pixel;
  swap_floats(batch->x, i, k);
  swap_floats(batch->y, i, k);
  swap_floats(batch->z, i, k);
  swap_floats(batch->u, i, k);
  swap_floats(batch->v, i, k);
  swap_floats(batch->plane_d, i, k);
  swap_floats(batch->plane_dx, i, k);
  swap_floats(batch->plane_dy, i, k);
}

// Parts receivers first .. end in the middle of where they reach farthest. Returns where the second part begins.
HS_INLINE int split_receivers(Batch* batch, int first, int end, const Region* region) {
  const float3 size = region->half_size;
  const float* at = size.x >= fmax(size.y, size.z) ? batch->x : size.y >= size.z ? batch->y : batch->z;
  const float middle = at == batch->x ? region->middle.x : at == batch->y ? region->middle.y : region->middle.z;
  int low = first, high = end;
  for (;;) {
    while (low < high && at[low] < middle) ++low;
    while (low < high && at[high - 1] >= middle) --high;
    if (low >= high) break;
    swap_receivers(batch, low, high - 1);
  }
  return low == first || low == end ? (first + end) / 2 : low;
}
