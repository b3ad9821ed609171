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

// Whether a receiver within `half_px` of `middle`, no farther than 1/d_far, can have the edge before its disc, or within
// HS_NEAR_PX of it in the map.
HS_INLINE bool capsule_touches(const Capsule* c, float radius_px, float2 middle, float2 half_px, float d_far) {
  if (c->everywhere) return true;
  if (fmax(c->da, c->db) < d_far * HS_BEYOND) return false;
  const float slack = HS_NEAR_PX + 0.25f;
  const float ra = radius_px * fmax(c->da - d_far, 0.0f) + slack, rb = radius_px * fmax(c->db - d_far, 0.0f) + slack;
  const float2 low = fmin(c->a - ra, c->b - rb), high = fmax(c->a + ra, c->b + rb);
  if (low.x > middle.x + half_px.x || low.y > middle.y + half_px.y || high.x < middle.x - half_px.x ||
      high.y < middle.y - half_px.y)
    return false;
  return fabs(dot(c->normal, middle - c->a)) <= fmax(ra, rb) + dot(fabs(c->normal), half_px);
}

HS_INLINE ushort4 capsule_rect(const HsView view, const Capsule* c, float radius_px) {
  if (c->everywhere) return (ushort4)(0, 0, view.tiles_x, view.tiles_y);
  const float slack = HS_NEAR_PX + 0.25f;
  const float ra = radius_px * fmax(c->da - view.d_far, 0.0f) + slack, rb = radius_px * fmax(c->db - view.d_far, 0.0f) + slack;
  return rect_of_points(view, fmin(c->a - ra, c->b - rb), fmax(c->a + ra, c->b + rb));
}

HS_INLINE bool tile_has_edge(const HsView view, const Capsule* c, float radius_px, uint x, uint y,
                             __global const float* tile_far) {
  const float far = tile_far[y * view.tiles_x + x];
  return far > 0.0f &&
         capsule_touches(c, radius_px, ((float2)(x, y) + 0.5f) * (float)HS_TILE, (float2)(HS_TILE * 0.5f), 1.0f / far);
}

// Any number of work-items. tile_counts must be 0.
__kernel void count_edges(const HsView view, const float radius_px, __global const HsStatus* status, __global const HsEdge* edges,
                          __global const float* tile_far, __global uint* tile_counts) {
  for (uint i = get_global_id(0); i < status->feature_count; i += get_global_size(0)) {
    const Capsule c = capsule_of(view, edges[i].a.xyz, edges[i].b.xyz);
    const ushort4 rect = capsule_rect(view, &c, radius_px);
    for (uint y = rect.y; y < rect.w; ++y)
      for (uint x = rect.x; x < rect.z; ++x)
        if (tile_has_edge(view, &c, radius_px, x, y, tile_far)) atomic_inc(&tile_counts[y * view.tiles_x + x]);
  }
}

__kernel void fill_edges(const HsView view, const float radius_px, __global const HsStatus* status, __global const HsEdge* edges,
                         __global const float* tile_far, __global uint* tile_cursors, __global uint* refs, const uint capacity) {
  for (uint i = get_global_id(0); i < status->feature_count; i += get_global_size(0)) {
    const Capsule c = capsule_of(view, edges[i].a.xyz, edges[i].b.xyz);
    const ushort4 rect = capsule_rect(view, &c, radius_px);
    for (uint y = rect.y; y < rect.w; ++y)
      for (uint x = rect.x; x < rect.z; ++x)
        if (tile_has_edge(view, &c, radius_px, x, y, tile_far)) {
          const uint slot = atomic_inc(&tile_cursors[y * view.tiles_x + x]);
          if (slot < capacity) refs[slot] = i;
        }
  }
}
