// Potential silhouettes to the tiles of receivers that may have them before the disc: each as a capsule, as wide as its penumbra
// at the tile's farthest receiver.

// A surface nearer to a receiver than this part of its depth is the receiver itself.
#define HS_BEYOND 0.99999905f  // 1 - 2^-20

// An edge's capsule in the map: it is seen before the disc from within R (d_edge - d_receiver) of its projection, a radius that
// is linear along it, as is the projection in d = 1/z: the convex hull of two discs.
typedef struct {
  float2 a, b;      // texels
  float da, db;     // 1/z
  float2 normal;    // unit, across
  bool everywhere;  // it comes too near to the light's plane to be projected
} Capsule;

HS_INLINE Capsule capsule_of(const HsView view, float3 a, float3 b) {
  Capsule c;
  c.everywhere = fmin(a.z, b.z) < view.znear * 0.5f;
  const float3 from = project_px(view, c.everywhere ? (float3)(0.0f, 0.0f, 1.0f) : a);
  const float3 to = project_px(view, c.everywhere ? (float3)(0.0f, 0.0f, 1.0f) : b);
  c.a = from.xy;
  c.b = to.xy;
  c.da = from.z;
  c.db = to.z;
  const float2 along = c.b - c.a;
  const float length_px = sqrt(dot(along, along));
  c.normal = length_px > 0.0f ? (float2)(-along.y, along.x) / length_px : (float2)(0.0f);
  return c;
}

HS_INLINE ushort4 capsule_rect(const HsView view, const Capsule* c, float radius_px) {
  if (c->everywhere) return (ushort4)(0, 0, view.tiles_x, view.tiles_y);
  const float slack = HS_NEAR_PX + 0.25f;
  const float ra = radius_px * fmax(c->da - view.d_far, 0.0f) + slack, rb = radius_px * fmax(c->db - view.d_far, 0.0f) + slack;
  return rect_of_points(view, fmin(c->a - ra, c->b - rb), fmax(c->a + ra, c->b + rb));
}

// Which of the tiles from x on, up to `end`, of a row have a receiver that can have the edge before its disc, or within
// HS_NEAR_PX of it in the map: as lane_bits. tile_far: depth of the farthest receiver of each tile, 0 for none;
// a vector may be read from any of them on.
HS_INLINE uint tiles_with_edge(const HsView view, const Capsule* c, float radius_px, uint x, uint end, uint y,
                               __global const float* tile_far) {
  const vfloat far = v_load(tile_far + y * view.tiles_x + x);
  const vint have = (v_iota < (int)(end - x)) & (far > 0.0f);
  if (c->everywhere || !v_any(have)) return lane_bits(have);
  const vfloat d_far = 1.0f / far;
  const float half_px = HS_TILE * 0.5f, slack = HS_NEAR_PX + 0.25f;
  const vfloat ra = radius_px * fmax(c->da - d_far, 0.0f) + slack, rb = radius_px * fmax(c->db - d_far, 0.0f) + slack;
  const vfloat middle_x = (v_float((int)x + v_iota) + 0.5f) * (float)HS_TILE;
  const float middle_y = ((float)y + 0.5f) * (float)HS_TILE;
  const vint touches = (fmax(c->da, c->db) >= d_far * HS_BEYOND) & (fmin(c->a.x - ra, c->b.x - rb) <= middle_x + half_px) &
                       (fmax(c->a.x + ra, c->b.x + rb) >= middle_x - half_px) &
                       (fmin(c->a.y - ra, c->b.y - rb) <= middle_y + half_px) &
                       (fmax(c->a.y + ra, c->b.y + rb) >= middle_y - half_px) &
                       (fabs(c->normal.x * (middle_x - c->a.x) + c->normal.y * (middle_y - c->a.y)) <=
                        fmax(ra, rb) + half_px * (fabs(c->normal.x) + fabs(c->normal.y)));
  return lane_bits(have & touches);
}

// Runs the body for each `tile` that has edge i. They are listed first: loops for each row would hardly ever be as long as the
// one before.
#if HS_LANES == 16
#define HS_LISTED_TILES 512
#else
#define HS_LISTED_TILES 1
#endif
#define HS_FOR_EDGE_TILES(tile, i, body)                                                      \
  {                                                                                           \
    const Capsule capsule = capsule_of(view, edges[i].a.xyz, edges[i].b.xyz);                 \
    const ushort4 rect = capsule_rect(view, &capsule, radius_px);                             \
    for (uint x = rect.x, y = rect.y; y < rect.w;) {                                          \
      int listed[HS_LISTED_TILES], listed_count = 0;                                          \
      while (y < rect.w && listed_count <= HS_LISTED_TILES - HS_LANES) {                      \
        const uint bits = tiles_with_edge(view, &capsule, radius_px, x, rect.z, y, tile_far); \
        append_chosen((int)(y * view.tiles_x + x) + v_iota, bits, listed, &listed_count);     \
        x += HS_LANES;                                                                        \
        if (x >= rect.z) {                                                                    \
          x = rect.x;                                                                         \
          ++y;                                                                                \
        }                                                                                     \
      }                                                                                       \
      for (int k = 0; k < listed_count; ++k) {                                                \
        const int tile = listed[k];                                                           \
        body                                                                                  \
      }                                                                                       \
    }                                                                                         \
  }

// Adds one to a tile's count and returns what it was.
#if HS_LANES == 16
#define HS_COUNT_UP(count) ((*(count))++)  // which is the work-item's own
#else
#define HS_COUNT_UP atomic_inc
#endif

// tile_counts: uint a tile, `copies` times, must be 0: on CPU devices as many as work-items, one for each, for cores that count
// in the same lines of the cache wait for each other.
__kernel void count_edges(const HsView view, const float radius_px, __global const HsStatus* status, __global const HsEdge* edges,
                          __global const float* tile_far, __global uint* tile_counts, const uint copies) {
  __global uint* own_counts = tile_counts + get_global_id(0) % copies * (view.tiles_x * view.tiles_y);
  for (uint i = get_global_id(0); i < status->feature_count; i += get_global_size(0))
    HS_FOR_EDGE_TILES(tile, i, { HS_COUNT_UP(&own_counts[tile]); })
}

__kernel void fill_edges(const HsView view, const float radius_px, __global const HsStatus* status, __global const HsEdge* edges,
                         __global const float* tile_far, __global uint* tile_cursors, const uint copies, __global uint* refs,
                         const uint capacity) {
  __global uint* own_cursors = tile_cursors + get_global_id(0) % copies * (view.tiles_x * view.tiles_y);
  for (uint i = get_global_id(0); i < status->feature_count; i += get_global_size(0))
    HS_FOR_EDGE_TILES(tile, i, {
      const uint slot = HS_COUNT_UP(&own_cursors[tile]);
      if (slot < capacity) refs[slot] = i;
    })
}
