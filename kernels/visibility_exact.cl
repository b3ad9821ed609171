// Exact soft shadows: centre-anchored depth complexity (DESIGN.md §5).
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
// between the directions of A and B is decided a vertex at a time, as their rank among the samples sorted by angle. The last is
// also what makes it fast: an edge is tested only against the samples in its own wedge, mostly none or one of hundreds. Of 256
// samples, the wedges of the 57 edges that pass before the disc from an average pixel of a scanned figure (39,000 triangles) hold
// 80 vectors of 16 in all, where testing every edge against every sample takes 57 x 16 = 912; bit-sliced counters would take
// 57 x 8 words and as many masks to make. The counting itself is then a quarter of the time; another quarter projects edges.

// HS_BATCH receivers of a tile share one list of at most HS_LISTED edges, HS_CHUNK neighbours of them a shorter one.
#if HS_LANES == 16
#define HS_CHUNK 64
#define HS_BATCH 1024
#define HS_LISTED 2048
#define v_as_int as_int16
typedef short16 v_short;
#define v_load_short(p) vload16(0, p)
#define v_store_short(v, p) vstore16(v, 0, p)
#define v_short_of convert_short16
#define HS_LANE(v, i) (((const int*)&(v))[i])
#define HS_FLOAT_LANE(v, i) (((const float*)&(v))[i])
#define HS_SET_LANE(v, i) (((int*)&(v))[i] = -1)
HS_INLINE int v_min(int16 v) {
  const int8 a = min(v.lo, v.hi);
  const int4 b = min(a.lo, a.hi);
  const int2 c = min(b.lo, b.hi);
  return min(c.x, c.y);
}
HS_INLINE int lane_count(int16 mask) {
  const int8 a = mask.lo + mask.hi;
  const int4 b = a.lo + a.hi;
  const int2 c = b.lo + b.hi;
  return -(c.x + c.y);
}
HS_INLINE int short_lane_count(short16 mask) {
  return lane_count(convert_int16(mask));
}
// Bit i for lane i.
HS_INLINE uint lane_bits(int16 mask) {
  const int16 bit = (int16)(1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768);
  const int16 bits = mask & bit;
  const int8 a = bits.lo | bits.hi;
  const int4 b = a.lo | a.hi;
  const int2 c = b.lo | b.hi;
  return (uint)(c.x | c.y);
}
#else
#define HS_CHUNK 1
#define HS_BATCH 1
#define HS_LISTED 1
#define v_as_int as_int
typedef short v_short;
#define v_load_short(p) (*(p))
#define v_store_short(v, p) (*(p) = (v))
#define v_short_of(mask) ((short)-((mask) != 0))
#define HS_LANE(v, i) (v)
#define HS_FLOAT_LANE(v, i) (v)
#define HS_SET_LANE(v, i) ((v) = -1)
#define v_min(v) (v)
#define lane_count(mask) ((mask) != 0)
#define short_lane_count(mask) ((mask) != 0)
#define lane_bits(mask) ((uint)((mask) != 0))
#endif

// A surface nearer to a receiver than this part of its depth is the receiver itself.
#define HS_BEYOND 0.99999905f  // 1 - 2^-20

// -------------------------------------------------------------------------------------------------- potential silhouettes

// planes: float4 a triangle: n and n . a in light space, unit where it has an area.
// disc_sides: uchar a triangle: on which side of it (1: n . p >= n . a) a receiver lies if the segment from it to a point of the
// disc crosses the face's plane; 2 where that depends on the point: the plane cuts the disc, |n . a| <= R |(n.x, n.y)|.
__kernel void orient_faces_to_disc(__global const HsBlock* blocks, __global const uint* triangles,
                                   __global const float4* vertices_ls, const float radius, __global float4* planes,
                                   __global uchar* disc_sides) {
  const HsBlock block = blocks[get_group_id(0)];
  if (get_local_id(0) < block.count) {
    const uint triangle = block.first + get_local_id(0);
    const uint3 corner = vload3(triangle, triangles);
    float3 anchor;
    float3 n = face_normal(vertices_ls[corner.x].xyz, vertices_ls[corner.y].xyz, vertices_ls[corner.z].xyz, &anchor);
    const float largest = fmax(fabs(n.x), fmax(fabs(n.y), fabs(n.z)));
    if (largest > 0.0f) {
      n /= largest;
      n /= sqrt(dot(n, n));
    }
    const float w = dot(n, anchor);
    // Rounding: of the normal and the product. Undecided is always right, only slower.
    const float slack = 4e-6f * (fabs(anchor.x) + fabs(anchor.y) + fabs(anchor.z) + radius);
    const bool decided = fabs(w) > radius * sqrt(n.x * n.x + n.y * n.y) + slack;
    planes[triangle] = (float4)(n, w);
    disc_sides[triangle] = decided ? (w > 0.0f ? 1 : 0) : 2;  // the disc is on the other side, that of the origin
  }
}

// Appends one record; a.w and b.w carry its integers.
HS_INLINE void emit_edge(float3 a, float3 b, int m, int o0, float4 plane0, int o1, float4 plane1, __global HsEdge* edges,
                         __global HsStatus* status) {
  HsEdge edge;
  edge.a = (float4)(a, as_float(m));
  edge.b = (float4)(b, as_float((o0 + 1) | (o1 + 1) << 2));
  edge.plane0 = plane0;
  edge.plane1 = plane1;
  edges[atomic_inc(&status->feature_count)] = edge;
}

// The part of an edge before the light's plane; false if there is none. The cut is the same whichever face asks.
HS_INLINE bool clip_to_light_plane(float3* a, float3* b) {
  if (!(fmax(a->z, b->z) > 0.0f)) return false;
  const float3 from = *a, to = *b;
  const float t = from.z / (from.z - to.z);
  const float3 cut = (float3)(from.xy + (to.xy - from.xy) * t, 0.0f);
  if (from.z < 0.0f) *a = cut;
  if (to.z < 0.0f) *b = cut;
  return true;
}

// edges: the potential silhouettes: those with m_p(e) != 0 for some receiver that sees them before the disc. Decided faces are
// summed in `m`; an edge with more than two undecided ones (non-manifold) has several records, whose sums add up.
__kernel void collect_edges(__global const HsBlock* blocks, __global const uint2* edge_ends,
                            __global const uint* edge_face_offsets, __global const uint* edge_faces,
                            __global const uchar* disc_sides, __global const float4* planes, __global const float4* vertices_ls,
                            __global HsEdge* edges, __global HsStatus* status) {
  const HsBlock block = blocks[get_group_id(0)];
  if (get_local_id(0) < block.count) {
    const uint edge = block.first + get_local_id(0);
    int m = 0, undecided = 0;
    for (uint i = edge_face_offsets[edge]; i < edge_face_offsets[edge + 1]; ++i) {
      const uint face = edge_faces[i];
      const uint side = disc_sides[face >> 1];
      const int o = (face & 1) ? -1 : 1;
      if (side == 2)
        ++undecided;
      else
        m += side ? o : -o;
    }
    const uint2 ends = edge_ends[edge];
    float3 a = vertices_ls[ends.x].xyz, b = vertices_ls[ends.y].xyz;
    if ((m != 0 || undecided > 0) && clip_to_light_plane(&a, &b)) {
      atomic_inc(&status->silhouette_count);
      int pending = 0;
      float4 pending_plane = (float4)(0.0f);
      for (uint i = edge_face_offsets[edge]; i < edge_face_offsets[edge + 1]; ++i) {
        const uint face = edge_faces[i];
        if (disc_sides[face >> 1] != 2) continue;
        const int o = (face & 1) ? -1 : 1;
        if (pending == 0) {
          pending = o;
          pending_plane = planes[face >> 1];
        } else {
          emit_edge(a, b, m, pending, pending_plane, o, planes[face >> 1], edges, status);
          m = 0;
          pending = 0;
        }
      }
      if (m != 0 || pending != 0) emit_edge(a, b, m, pending, pending_plane, 0, (float4)(0.0f), edges, status);
    }
  }
}

// Where a face passes through the light's own plane, what lies before it ends at a cut: an edge of its own.
__kernel void collect_cuts(__global const HsBlock* blocks, __global const uint* triangles, __global const uchar* disc_sides,
                           __global const float4* planes, __global const float4* vertices_ls, const float radius,
                           __global HsEdge* edges, __global HsStatus* status) {
  const HsBlock block = blocks[get_group_id(0)];
  if (get_local_id(0) < block.count) {
    const uint triangle = block.first + get_local_id(0);
    const uint3 corner = vload3(triangle, triangles);
    const uint index[3] = {corner.x, corner.y, corner.z};
    float3 leaving = (float3)(0.0f), entering = (float3)(0.0f);
    int cuts = 0;
    for (int i = 0; i < 3; ++i) {
      const uint from = index[i], to = index[i < 2 ? i + 1 : 0];
      float3 low = vertices_ls[min(from, to)].xyz, high = vertices_ls[max(from, to)].xyz;
      if ((low.z < 0.0f) == (high.z < 0.0f)) continue;
      const bool low_behind = low.z < 0.0f;
      clip_to_light_plane(&low, &high);
      const float3 cut = low_behind ? low : high;
      if (low_behind == (from < to))
        entering = cut;  // the loop comes from behind the plane
      else
        leaving = cut;
      ++cuts;
    }
    if (cuts == 2) {
      const float2 along = entering.xy - leaving.xy;
      const float t = clamp(-dot(leaving.xy, along) / fmax(dot(along, along), 1e-30f), 0.0f, 1.0f);
      const float2 nearest = leaving.xy + along * t;
      const uint side = disc_sides[triangle];
      if (dot(nearest, nearest) <= radius * radius * 1.01f)
        emit_edge(leaving, entering,
                  side == 2 ? 0
                  : side    ? 1
                            : -1,
                  side == 2 ? 1 : 0, planes[triangle], 0, (float4)(0.0f), edges, status);
    }
  }
}

// ---------------------------------------------------------------------------------------------------------------- binning

// As bound_triangles, but conservative: every tile that the triangle touches, whether it covers a texel's centre there or not,
// for the centre count asks at any point of the map.
__kernel void bound_triangles_wide(const HsView view, __global const HsBlock* blocks, __global const uint* triangles,
                                   __global const float4* vertices_vs, __global const int4* vertices_px, __global ushort4* rects,
                                   __global uint* tile_counts, __global HsStatus* status) {
  const HsBlock block = blocks[get_group_id(0)];
  ushort4 rect = (ushort4)(0);
  if (get_local_id(0) < block.count) {
    const uint3 corner = vload3(block.first + get_local_id(0), triangles);
    int4 polygon[HS_CLIP_VERTICES];
    polygon[0] = vertices_px[corner.x];
    polygon[1] = vertices_px[corner.y];
    polygon[2] = vertices_px[corner.z];
    const uint flags = as_uint(polygon[0].w | polygon[1].w | polygon[2].w);
    int count = 3;
    if (flags & HS_VERTEX_INVALID) {
      atomic_inc(&status->dropped_triangle_count);
      count = 0;
    } else if (flags != 0) {
      count = clip_triangle(view, vertices_vs[corner.x].xyz, vertices_vs[corner.y].xyz, vertices_vs[corner.z].xyz, polygon);
    }
    if (count >= 3) {
      int2 low = polygon[0].xy, high = polygon[0].xy;
      for (int i = 1; i < count; ++i) {
        low = min(low, polygon[i].xy);
        high = max(high, polygon[i].xy);
      }
      rect = rect_of_texels(
          view, ((low.x - 4) >> HS_SUBPIXEL_BITS) + (int)view.mid_x_px, ((low.y - 4) >> HS_SUBPIXEL_BITS) + (int)view.mid_y_px,
          ((high.x + 4) >> HS_SUBPIXEL_BITS) + (int)view.mid_x_px, ((high.y + 4) >> HS_SUBPIXEL_BITS) + (int)view.mid_y_px);
      count_rect(rect, view.tiles_x, tile_counts);
    }
  }
  rects[get_global_id(0)] = rect;
}

// The tile of a receiver, from its position in texels (centres at integers).
HS_INLINE vint tile_of(const HsView light, const Receiver* r) {
  return row(light, v_int(rint(r->v))) / HS_TILE * (int)light.tiles_x + column(light, v_int(rint(r->u))) / HS_TILE;
}

// True if all lanes of `mask` hold the same tile, which is then *tile.
HS_INLINE bool one_tile(vint tiles, vint mask, int* tile) {
  *tile = v_min(v_select((vint)(INT_MAX), tiles, mask));
  return *tile == -v_min(v_select((vint)(INT_MAX), -tiles, mask));
}

// tile_far: float bits a tile: depth of its farthest receiver; 0 without. tile_counts: its receivers. Both must be 0.
__kernel void bound_receivers(const HsView light, const HsReceiverView view, __global const float* depth_or_position,
                              __global const float4* normal, __global int* tile_far, __global uint* tile_counts) {
  HS_FOR_PIXELS(px, py, valid, view.width_px, view.height_px) {
    const Receiver r = locate(light, view, px, py, valid, depth_or_position, normal);
    const vint mine = v_not(r.decided) & (v_iota < valid);
    if (!v_any(mine)) continue;
    const vint tiles = tile_of(light, &r), z_bits = v_as_int(r.z);
    int tile;
    if (one_tile(tiles, mine, &tile)) {
      const int far = -v_min(v_select((vint)(0), -z_bits, mine));
      atomic_max(&tile_far[tile], far);
      atomic_add(&tile_counts[tile], (uint)lane_count(mine));
    } else {
      for (int i = 0; i < HS_LANES; ++i) {
        if (!HS_LANE(mine, i)) continue;
        atomic_max(&tile_far[HS_LANE(tiles, i)], HS_LANE(z_bits, i));
        atomic_inc(&tile_counts[HS_LANE(tiles, i)]);
      }
    }
  }
}

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

// By the map: a surface whose 1/z in a texel is at most the receiver's plane there plus the first is the receiver's own or beyond
// it; one whose 1/z is more than the second stands before it whatever the surface does within two texels.
#define HS_SAME_SURFACE(d, slope) ((slope) * (1.0f / 64.0f) + (d)*4e-6f)
#define HS_CLEARLY_BEFORE(d, slope) ((d)*1.01f + 2.0f * (slope))

// Answers the receivers that no silhouette comes near by the shadow map, and lists the others, tile by tile.
// listed: pixel numbers; those of tile t begin at the offset that tile_cursors[t] had, and end where it ends up.
__kernel void list_receivers(const HsView light, const HsReceiverView view, __global const float* depth_or_position,
                             __global const float4* normal, __global const float* shadow_map, __global const uint* edge_offsets,
                             const uint all, __global uint* tile_cursors, __global uint* listed, __global float* visibility,
                             const uint plane) {
  HS_FOR_PIXELS(px, py, valid, view.width_px, view.height_px) {
    const Receiver r = locate(light, view, px, py, valid, depth_or_position, normal);
    vfloat result = r.visibility;
    const vint mine = v_not(r.decided) & (v_iota < valid);
    if (v_any(mine)) {
      const vint tiles = tile_of(light, &r);
      int tile;
      const bool together = one_tile(tiles, mine, &tile);
      vint chosen = mine;
      if (!all && !(together && edge_offsets[tile] != edge_offsets[tile + 1])) {
        const vint x = column(light, v_int(rint(r.u))), y = row(light, v_int(rint(r.v)));
        const vfloat z_map = v_gather(shadow_map, y * (int)light.width_px + x);
        const vfloat slope = fabs(r.plane_dx) + fabs(r.plane_dy);
        const vfloat plane_d = r.plane_d + r.plane_dx * (v_float(x) - r.u) + r.plane_dy * (v_float(y) - r.v);
        const vint lit = z_map * (plane_d + HS_SAME_SURFACE(r.plane_d, slope)) >= 1.0f;
        const vint dark = z_map * HS_CLEARLY_BEFORE(r.plane_d, slope) < 1.0f;
        chosen = mine & v_not(lit | dark);
        if (!together)
          for (int i = 0; i < HS_LANES; ++i)
            if (HS_LANE(mine, i) && edge_offsets[HS_LANE(tiles, i)] != edge_offsets[HS_LANE(tiles, i) + 1])
              HS_SET_LANE(chosen, i);
        result = v_select(v_select((vfloat)(0.0f), (vfloat)(1.0f), lit), r.visibility, r.decided);
      }
      if (v_any(chosen)) {
        const uint pixel = (uint)py * view.width_px + (uint)px;
        uint slot = together ? atomic_add(&tile_cursors[tile], (uint)lane_count(chosen)) : 0;
        for (int i = 0; i < HS_LANES; ++i) {
          if (!HS_LANE(chosen, i)) continue;
          listed[together ? slot++ : atomic_inc(&tile_cursors[HS_LANE(tiles, i)])] = pixel + i;
        }
      }
    }
    store_lanes(result, visibility, ((size_t)plane * view.height_px + py) * view.width_px + px, valid);
  }
}

// ---------------------------------------------------------------------------------------------------------------- counting

// Receivers that are counted together.
typedef struct {
  float x[HS_BATCH], y[HS_BATCH], z[HS_BATCH];                      // light space, lifted off their surface
  float u[HS_BATCH], v[HS_BATCH];                                   // texels, centres at half-integers as rasterizers have it
  float plane_d[HS_BATCH], plane_dx[HS_BATCH], plane_dy[HS_BATCH];  // see Receiver
} Batch;

// Where some of them are.
typedef struct {
  float3 middle, half_size;   // light space
  float2 middle_px, half_px;  // map
  float far_z, d_far;         // depth of the farthest, and its 1/z
} Region;

// Edges that some receiver of a region may have before its disc: HsEdge, a field an array.
typedef struct {
  float ax[HS_LISTED], ay[HS_LISTED], az[HS_LISTED], bx[HS_LISTED], by[HS_LISTED], bz[HS_LISTED];
  float n0x[HS_LISTED], n0y[HS_LISTED], n0z[HS_LISTED], n0w[HS_LISTED];
  float n1x[HS_LISTED], n1y[HS_LISTED], n1z[HS_LISTED], n1w[HS_LISTED];
  int m[HS_LISTED], o0[HS_LISTED], o1[HS_LISTED];
} EdgeList;

// A receiver's position in light space, lifted off its surface by what the position may be wrong: a 128th of its pixel, because
// the rasterizer snaps vertices to a 256th, and the rounding of coordinates.
HS_INLINE float3 lifted_receiver(const HsReceiverView view, uint pixel, __global const float* depth_or_position,
                                 __global const float4* normal, float3* n_ls) {
  float3 p;
  float error;
  if (view.has_depth) {
    const float z = depth_or_position[pixel];
    p = z * (view.ray0.xyz + (float)(pixel % view.width_px) * view.ray_dx.xyz +
             (float)(pixel / view.width_px) * view.ray_dy.xyz) +
        view.origin.xyz;
    error = z * (sqrt(dot(view.ray_dx.xyz, view.ray_dx.xyz)) * (1.0f / 128.0f) + 0x1p-21f) +
            fmax(fabs(p.x), fmax(fabs(p.y), fabs(p.z))) * 0x1p-23f;
  } else {
    const float4 q = ((__global const float4*)depth_or_position)[pixel];
    const float4 h = (float4)(q.xyz, 1.0f);
    p = (float3)(dot(view.from_world_x, h), dot(view.from_world_y, h), dot(view.from_world_z, h));
    error =
        (fabs(q.x) + fabs(q.y) + fabs(q.z) + fabs(view.from_world_x.w) + fabs(view.from_world_y.w) + fabs(view.from_world_z.w)) *
        1e-6f;
  }
  const float3 n = normal[pixel].xyz;
  *n_ls = (float3)(dot(view.from_world_x.xyz, n), dot(view.from_world_y.xyz, n), dot(view.from_world_z.xyz, n));
  return p + *n_ls * error;
}

HS_INLINE void load_batch(const HsView light, const HsReceiverView view, __global const uint* pixels, int count,
                          __global const float* depth_or_position, __global const float4* normal, Batch* batch) {
  for (int i = 0; i < count; ++i) {
    float3 n;
    const float3 p = lifted_receiver(view, pixels[i], depth_or_position, normal, &n);
    const float3 px = project_px(light, p);
    batch->x[i] = p.x;
    batch->y[i] = p.y;
    batch->z[i] = p.z;
    batch->u[i] = px.x;
    batch->v[i] = px.y;
    const float inverse = 1.0f / fmin(dot(n, p), -1e-30f);
    batch->plane_d[i] = px.z;
    batch->plane_dx[i] = n.x * inverse / light.px_from_q.x;
    batch->plane_dy[i] = n.y * inverse / light.px_from_q.z;
  }
}

HS_INLINE Region region_of(const Batch* batch, int first, int end) {
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
  const Region region = {0.5f * (low + high), 0.5f * (high - low), 0.5f * (low_px + high_px), 0.5f * (high_px - low_px), high.z,
                         1.0f / high.z};
  return region;
}

// The side of a plane that a region is on: 1 or -1, or 0 if the plane cuts it or comes too near.
HS_INLINE vint side_of_region(const Region* region, vfloat nx, vfloat ny, vfloat nz, vfloat w) {
  const vfloat v = nx * region->middle.x + ny * region->middle.y + nz * region->middle.z - w;
  const vfloat reach = fabs(nx) * region->half_size.x + fabs(ny) * region->half_size.y + fabs(nz) * region->half_size.z +
                       1e-6f * (fabs(w) + fabs(region->middle.x) + fabs(region->middle.y) + fabs(region->middle.z));
  return v_select((vint)(0), (vint)(1), v > reach) - v_select((vint)(0), (vint)(1), v < -reach);
}

HS_INLINE int side_of_region1(const Region* region, float4 plane) {
  const float v = dot(plane.xyz, region->middle) - plane.w;
  const float reach = dot(fabs(plane.xyz), region->half_size) +
                      1e-6f * (fabs(plane.w) + fabs(region->middle.x) + fabs(region->middle.y) + fabs(region->middle.z));
  return v > reach ? 1 : v < -reach ? -1 : 0;
}

// Copies an edge of the tile if a receiver of the region may need it.
HS_INLINE bool take_edge(const HsView light, float radius_px, const Region* region, __global const HsEdge* from, EdgeList* to,
                         int slot) {
  const float4 a = from->a, b = from->b;
  if (fmin(a.z, b.z) >= region->far_z) return false;
  const float4 plane0 = from->plane0, plane1 = from->plane1;
  const int m = as_int(a.w), o0 = (as_int(b.w) & 3) - 1, o1 = (as_int(b.w) >> 2) - 1;
  const int side0 = side_of_region1(region, plane0), side1 = side_of_region1(region, plane1);
  if ((o0 == 0 || side0 != 0) && (o1 == 0 || side1 != 0) && m + o0 * side0 + o1 * side1 == 0) return false;
  const Capsule capsule = capsule_of(light, a.xyz, b.xyz);
  if (!capsule_touches(&capsule, radius_px, region->middle_px, region->half_px, region->d_far)) return false;
  to->ax[slot] = a.x;
  to->ay[slot] = a.y;
  to->az[slot] = a.z;
  to->bx[slot] = b.x;
  to->by[slot] = b.y;
  to->bz[slot] = b.z;
  to->n0x[slot] = plane0.x;
  to->n0y[slot] = plane0.y;
  to->n0z[slot] = plane0.z;
  to->n0w[slot] = plane0.w;
  to->n1x[slot] = plane1.x;
  to->n1y[slot] = plane1.y;
  to->n1z[slot] = plane1.z;
  to->n1w[slot] = plane1.w;
  to->m[slot] = m;
  to->o0[slot] = o0;
  to->o1[slot] = o1;
  return true;
}

// Makes a list a whole number of vectors long, with edges that are none.
HS_INLINE void pad_list(EdgeList* list, int count) {
  for (int i = count; i & (HS_LANES - 1); ++i) {
    list->m[i] = list->o0[i] = list->o1[i] = 0;
    list->ax[i] = list->ay[i] = list->bx[i] = list->by[i] = 0.0f;
    list->az[i] = list->bz[i] = 1.0f;
  }
}

// The edges of `from` that receivers of the region may need. A face's side that is the same for all of them is added to m, and
// most edges, silhouettes for some other part of the tile, then have none left. Returns their number.
HS_INLINE int narrow_list(const HsView light, float radius_px, const Region* region, const EdgeList* from, int count,
                          EdgeList* to) {
  int taken = 0;
  for (int i = 0; i < count; i += HS_LANES) {
    vint o0 = v_load(from->o0 + i), o1 = v_load(from->o1 + i);
    const vint side0 =
        side_of_region(region, v_load(from->n0x + i), v_load(from->n0y + i), v_load(from->n0z + i), v_load(from->n0w + i));
    const vint side1 =
        side_of_region(region, v_load(from->n1x + i), v_load(from->n1y + i), v_load(from->n1z + i), v_load(from->n1w + i));
    const vint m = v_load(from->m + i) + o0 * side0 + o1 * side1;
    o0 = v_select(o0, (vint)(0), side0 != 0);
    o1 = v_select(o1, (vint)(0), side1 != 0);
    vint keep = (m | o0 | o1) != 0;
    if (!v_any(keep)) continue;

    // As capsule_touches.
    const vfloat az = v_load(from->az + i), bz = v_load(from->bz + i);
    const vint everywhere = fmin(az, bz) < light.znear * 0.5f;
    const vfloat da = 1.0f / az, db = 1.0f / bz;
    const vfloat ax = v_load(from->ax + i) * da * light.px_from_q.x + (light.px_from_q.y - region->middle_px.x);
    const vfloat ay = v_load(from->ay + i) * da * light.px_from_q.z + (light.px_from_q.w - region->middle_px.y);
    const vfloat bx = v_load(from->bx + i) * db * light.px_from_q.x + (light.px_from_q.y - region->middle_px.x);
    const vfloat by = v_load(from->by + i) * db * light.px_from_q.z + (light.px_from_q.w - region->middle_px.y);
    const float slack = HS_NEAR_PX + 0.25f;
    const vfloat ra = radius_px * fmax(da - region->d_far, 0.0f) + slack, rb = radius_px * fmax(db - region->d_far, 0.0f) + slack;
    const vfloat ex = bx - ax, ey = by - ay;
    const vfloat across = ax * ey - ay * ex, reach = fmax(ra, rb);
    const vfloat limit = reach * sqrt(ex * ex + ey * ey) * 1.00001f + fabs(ex) * region->half_px.y + fabs(ey) * region->half_px.x;
    const vint touches = (fmin(az, bz) < region->far_z) & (fmin(ax - ra, bx - rb) <= region->half_px.x) &
                         (fmax(ax + ra, bx + rb) >= -region->half_px.x) & (fmin(ay - ra, by - rb) <= region->half_px.y) &
                         (fmax(ay + ra, by + rb) >= -region->half_px.y) & (fabs(across) <= limit);
    keep &= touches | everywhere;
    for (uint bits = lane_bits(keep); bits != 0; bits &= bits - 1) {
      const int lane = 31 - (int)clz(bits & -bits), k = i + lane;
      to->ax[taken] = from->ax[k];
      to->ay[taken] = from->ay[k];
      to->az[taken] = from->az[k];
      to->bx[taken] = from->bx[k];
      to->by[taken] = from->by[k];
      to->bz[taken] = from->bz[k];
      to->n0x[taken] = from->n0x[k];
      to->n0y[taken] = from->n0y[k];
      to->n0z[taken] = from->n0z[k];
      to->n0w[taken] = from->n0w[k];
      to->n1x[taken] = from->n1x[k];
      to->n1y[taken] = from->n1y[k];
      to->n1z[taken] = from->n1z[k];
      to->n1w[taken] = from->n1w[k];
      to->m[taken] = HS_LANE(m, lane);
      to->o0[taken] = HS_LANE(o0, lane);
      to->o1[taken] = HS_LANE(o1, lane);
      ++taken;
    }
  }
  pad_list(to, taken);
  return taken;
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
  e.far_z = fmax(az, bz);
  return e;
}

// Grows with the angle from the x axis, 0 .. 4, a quarter turn being 1 (L1 norm). host/light_samples.cpp has the same.
HS_INLINE vfloat turn_of(vfloat x, vfloat y) {
  const vfloat t = x / fmax(fabs(x) + fabs(y), 1e-30f);
  return v_select(3.0f + t, 1.0f - t, y >= 0.0f);
}

HS_INLINE vint gather_rank(__global const ushort* p, vint i) {
#if HS_LANES == 16
  return (int16)(p[i.s0], p[i.s1], p[i.s2], p[i.s3], p[i.s4], p[i.s5], p[i.s6], p[i.s7], p[i.s8], p[i.s9], p[i.sa], p[i.sb],
                 p[i.sc], p[i.sd], p[i.se], p[i.sf]);
#else
  return p[i];
#endif
}

// Samples before an angle in their order.
HS_INLINE vint rank_of(const HsDisc disc, __global const ushort* rank_table, __global const float* sample_turns, vfloat turn) {
  vint rank = gather_rank(rank_table, v_int(turn * disc.table_per_turn));
  for (;;) {
    const vint behind = v_gather(sample_turns, rank) < turn;
    if (!v_any(behind)) break;
    rank += v_select((vint)(0), (vint)(1), behind);
  }
  return rank;
}

// What the walk over the edges finds out about one receiver.
typedef struct {
  bool touched;  // its counts are set
  bool near;     // a silhouette passes so near that the shadow map cannot be asked about the centre
} Walk;

// Edges that pass before a receiver's disc, projected onto the light's plane.
typedef struct {
  float ax[HS_LISTED], ay[HS_LISTED], bx[HS_LISTED], by[HS_LISTED];
  float c[HS_LISTED];   // a x b
  int left[HS_LISTED];  // not 0 where the centre is left of a -> b
  int m[HS_LISTED];
} Passing;

// Finds the silhouettes of `list` as seen from p that pass before the disc. Returns their number, padded with edges that hide
// nothing.
HS_INLINE int project_edges(const EdgeList* list, int count, const HsDisc disc, float px, float py, float pz, Passing* passing,
                            Walk* walk) {
  int taken = 0;
  for (int i = 0; i < count; i += HS_LANES) {
    const vint front0 =
        v_load(list->n0x + i) * px + v_load(list->n0y + i) * py + v_load(list->n0z + i) * pz >= v_load(list->n0w + i);
    const vint front1 =
        v_load(list->n1x + i) * px + v_load(list->n1y + i) * py + v_load(list->n1z + i) * pz >= v_load(list->n1w + i);
    const vint o0 = v_load(list->o0 + i), o1 = v_load(list->o1 + i);
    const vint m = v_load(list->m + i) + v_select(-o0, o0, front0) + v_select(-o1, o1, front1);
    if (!v_any(m != 0)) continue;
    const vfloat ax_ls = v_load(list->ax + i), ay_ls = v_load(list->ay + i), az_ls = v_load(list->az + i);
    const vfloat bx_ls = v_load(list->bx + i), by_ls = v_load(list->by + i), bz_ls = v_load(list->bz + i);
    const ProjectedEdge e = project_edge(ax_ls, ay_ls, az_ls, bx_ls, by_ls, bz_ls, px, py, pz);
    const vint live = (m != 0) & e.seen;

    // Distance from the centre. The line is held by its nearer end: the other may be very far.
    const vfloat ex = e.bx - e.ax, ey = e.by - e.ay;
    const vfloat a2 = e.ax * e.ax + e.ay * e.ay, b2 = e.bx * e.bx + e.by * e.by, e2 = fmax(ex * ex + ey * ey, 1e-30f);
    const vfloat c = v_select(e.bx * ey - e.by * ex, e.ax * ey - e.ay * ex, a2 <= b2);
    const vint foot_inside = (e.ax * ex + e.ay * ey < 0.0f) & (e.bx * ex + e.by * ey > 0.0f);
    const vfloat distance2 = v_select(fmin(a2, b2), c * c / e2, foot_inside);
    const vfloat near = disc.near_q * e.far_z * pz;  // times pz - far_z, against which it stands
    const vfloat gap = pz - e.far_z;
    if (v_any(live & (distance2 * gap * gap <= near * near))) walk->near = true;
    const vint reaches = live & (distance2 < disc.reach2);
    uint bits = lane_bits(reaches);
    if (bits == 0) continue;
    const vint left = left_of_centre(map_x(ax_ls, az_ls, px, pz), map_x(ay_ls, az_ls, py, pz), map_x(bx_ls, bz_ls, px, pz),
                                     map_x(by_ls, bz_ls, py, pz));
    for (; bits != 0; bits &= bits - 1) {
      const int lane = 31 - (int)clz(bits & -bits);
      passing->ax[taken] = HS_FLOAT_LANE(e.ax, lane);
      passing->ay[taken] = HS_FLOAT_LANE(e.ay, lane);
      passing->bx[taken] = HS_FLOAT_LANE(e.bx, lane);
      passing->by[taken] = HS_FLOAT_LANE(e.by, lane);
      passing->c[taken] = HS_FLOAT_LANE(c, lane);
      passing->left[taken] = HS_LANE(left, lane);
      passing->m[taken] = HS_LANE(m, lane);
      ++taken;
    }
  }
  for (int i = taken; i & (HS_LANES - 1); ++i) {
    passing->ax[i] = passing->ay[i] = passing->bx[i] = passing->by[i] = passing->c[i] = 0.0f;
    passing->left[i] = passing->m[i] = 0;
  }
  return taken;
}

// Adds the crossings of those edges to the receiver's counts, one a sample.
HS_INLINE void count_crossings(const Passing* passing, int count, const HsDisc disc, float2 rotation,
                               __global const float* samples, __global const ushort* rank_table, short* counts, Walk* walk) {
  const int n = (int)disc.sample_count;
  __global const float* sample_x = samples;
  __global const float* sample_y = samples + n;
  __global const float* sample_turns = samples + 2 * n;
  for (int i = 0; i < count; i += HS_LANES) {
    vfloat ax = v_load(passing->ax + i), ay = v_load(passing->ay + i), bx = v_load(passing->bx + i), by = v_load(passing->by + i);
    vfloat ex = bx - ax, ey = by - ay, c = v_load(passing->c + i);
    // Cut to the disc: the wedge holds no more samples than the edge can hide. Ends within the disc stay as they are, so that
    // the edges that meet there agree about every sample.
    const vfloat inverse = 1.0f / fmax(ex * ex + ey * ey, 1e-30f);
    const vfloat half_chord = sqrt(fmax(disc.reach2 - c * c * inverse, 0.0f) * inverse);
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
    const vint rank_a = rank_of(disc, rank_table, sample_turns, turn_a), rank_b = rank_of(disc, rank_table, sample_turns, turn_b);
    const vint first = v_select(rank_b, rank_a, centre_left);
    vint last = v_select(rank_a, rank_b, centre_left);
    last += v_select((vint)(0), (vint)(n), last < first);
    const vint m = v_load(passing->m + i);
    uint bits = lane_bits((m != 0) & (first != last));
    if (bits == 0) continue;

    // The edge is crossed by s in the wedge with c - s x e beyond it. The walk from right to left is that of the edge reversed.
    const vfloat direction = v_select((vfloat)(-1.0f), (vfloat)(1.0f), centre_left);
    c *= direction;
    ex *= direction * disc.radius;
    ey *= direction * disc.radius;
    const vint crossings = v_select(m, -m, centre_left);
    if (!walk->touched) {
      walk->touched = true;
      for (int k = 0; k < n; k += HS_LANES) v_store_short((v_short)(0), counts + k);
    }
    for (; bits != 0; bits &= bits - 1) {
      const int lane = 31 - (int)clz(bits & -bits);
      const int begin = HS_LANE(first, lane), end = HS_LANE(last, lane);
      const float lane_c = HS_FLOAT_LANE(c, lane), lane_ex = HS_FLOAT_LANE(ex, lane), lane_ey = HS_FLOAT_LANE(ey, lane);
      const short lane_m = (short)HS_LANE(crossings, lane);
      for (int k = begin & -HS_LANES; k < end; k += HS_LANES) {
        const int at = k & (n - 1);
        const vint ks = k + v_iota;
        const vint crossed =
            (ks >= begin) & (ks < end) & (v_load(sample_x + at) * lane_ey - v_load(sample_y + at) * lane_ex > lane_c);
        v_store_short(v_load_short(counts + at) + (v_short_of(crossed) & lane_m), counts + at);
      }
    }
  }
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

// D(c) for the receivers in `asking`: crossings of the segment to the light's centre with the triangles of the tile.
HS_INLINE void count_centre(const HsView view, const Batch* batch, int first, const int* asking, int asking_count, uint tile,
                            __global const HsBlock* blocks, uint slot_count, __global const ushort4* rects,
                            __global const uint* offsets, __global const uint* refs, uint capacity,
                            __global const uint* triangles, __global const float4* vertices_ls, __global const int4* vertices_px,
                            __global const float4* planes, int* crossings) {
  float xs[HS_CHUNK], ys[HS_CHUNK], zs[HS_CHUNK];
  float2 low_px = (float2)(1e30f), high_px = (float2)(-1e30f);
  float far_z = 0.0f;
  for (int i = 0; i < HS_CHUNK; ++i) {
    const int from = first + asking[min(i, asking_count - 1)];
    xs[i] = batch->x[from];
    ys[i] = batch->y[from];
    zs[i] = batch->z[from];
    crossings[i] = 0;
    low_px = fmin(low_px, (float2)(batch->u[from], batch->v[from]));
    high_px = fmax(high_px, (float2)(batch->u[from], batch->v[from]));
    far_z = fmax(far_z, batch->z[from]);
  }
  const float2 mid_px = (float2)(view.mid_x_px, view.mid_y_px);
  const int2 low = convert_int2_rtn((low_px - mid_px) * (float)HS_SUBPIXEL) - 4;
  const int2 high = convert_int2_rtp((high_px - mid_px) * (float)HS_SUBPIXEL) + 4;

  const bool overflow = bins_overflow(offsets, view.tiles_x * view.tiles_y, capacity);
  const uint begin = overflow ? 0 : offsets[tile], end = overflow ? slot_count : offsets[tile + 1];
  for (uint i = begin; i < end; ++i) {
    if (overflow && !rect_has(rects[i], tile, view.tiles_x)) continue;
    const uint triangle = overflow ? blocks[i / HS_BLOCK_SIZE].first + i % HS_BLOCK_SIZE : refs[i];
    uint3 corner = vload3(triangle, triangles);
    const int4 a_px = vertices_px[corner.x], b_px = vertices_px[corner.y], c_px = vertices_px[corner.z];
    if ((a_px.w | b_px.w | c_px.w) == 0) {
      const int2 least = min(a_px.xy, min(b_px.xy, c_px.xy)), most = max(a_px.xy, max(b_px.xy, c_px.xy));
      if (most.x < low.x || most.y < low.y || least.x > high.x || least.y > high.y) continue;
    }
    // Corners in the order of their numbers, for every edge is decided in its stored direction.
    int odd = 1;
    uint swap;
    if (corner.y < corner.x) {
      swap = corner.x;
      corner.x = corner.y;
      corner.y = swap;
      odd = -odd;
    }
    if (corner.z < corner.y) {
      swap = corner.y;
      corner.y = corner.z;
      corner.z = swap;
      odd = -odd;
    }
    if (corner.y < corner.x) {
      swap = corner.x;
      corner.x = corner.y;
      corner.y = swap;
      odd = -odd;
    }
    const float3 a = vertices_ls[corner.x].xyz, b = vertices_ls[corner.y].xyz, c = vertices_ls[corner.z].xyz;
    if (fmin(a.z, fmin(b.z, c.z)) >= far_z) continue;
    const float4 f = planes[triangle];
    for (int k = 0; k < asking_count; k += HS_LANES) {
      const vfloat px = v_load(xs + k), py = v_load(ys + k), pz = v_load(zs + k);
      const vint front = f.x * px + f.y * py + f.z * pz >= f.w;
      const vint between = 0.0f >= f.w ? v_not(front) : front;
      if (!v_any(between)) continue;
      const vfloat ax = map_x(a.x, a.z, px, pz), ay = map_x(a.y, a.z, py, pz);
      const vfloat bx = map_x(b.x, b.z, px, pz), by = map_x(b.y, b.z, py, pz);
      const vfloat cx = map_x(c.x, c.z, px, pz), cy = map_x(c.y, c.z, py, pz);
      vint turns;
      if (fmin(a.z, fmin(b.z, c.z)) > 0.0f) {
        turns = winding_of(ax, ay, bx, by) + winding_of(bx, by, cx, cy) - winding_of(ax, ay, cx, cy);
      } else {  // part of it has no place in the map: by the sides of its edges' planes
        const vint ab = left_of_centre(ax, ay, bx, by), bc = left_of_centre(bx, by, cx, cy), ac = left_of_centre(ax, ay, cx, cy);
        turns = v_select((vint)(0), (vint)(1), ab & bc & v_not(ac)) - v_select((vint)(0), (vint)(1), v_not(ab | bc) & ac);
      }
      const vint crossed = v_select((vint)(0), v_select(-turns, turns, front) * odd, between);
      v_store(v_load(crossings + k) + crossed, crossings + k);
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

// Counts for the listed receivers: work-items take tiles from `queue` (CPU) or are a tile's pixels (GPU).
// samples: x, y of the unit disc's sample points, sorted by angle, and their turns: 3 sample_count floats, then infinity.
__kernel void count_samples(const HsView light, const HsReceiverView view, const HsDisc disc,
                            __global const float* depth_or_position, __global const float4* normal,
                            __global const float* shadow_map, __global const HsEdge* edges, __global const uint* edge_offsets,
                            __global const uint* edge_refs, const uint edge_capacity, __global const float* samples,
                            __global const ushort* rank_table, __global const HsBlock* blocks, const uint slot_count,
                            __global const ushort4* rects, __global const uint* triangle_offsets,
                            __global const uint* triangle_refs, const uint triangle_capacity, __global const uint* triangles,
                            __global const float4* vertices_ls, __global const int4* vertices_px, __global const float4* planes,
                            __global const uint* receiver_offsets, __global const uint* receiver_ends,
                            __global const uint* listed, __global int* queue, __global float* visibility, const uint plane,
                            __global HsStatus* status) {
  const uint tile_count = light.tiles_x * light.tiles_y;
  const bool overflow = bins_overflow(edge_offsets, tile_count, edge_capacity);
  Batch batch;
  EdgeList lists[2];
  Passing passing;
  short counts[HS_CHUNK * HS_MAX_SAMPLES];
  Walk walks[HS_CHUNK];
  int asking[HS_CHUNK], crossings[HS_CHUNK];
  const int n = (int)disc.sample_count;
#if HS_LANES == 16
  for (uint tile = atomic_inc(queue); tile < tile_count; tile = atomic_inc(queue)) {
    const uint step = HS_BATCH, begin_at = receiver_offsets[tile];
#else
  {
    const uint tile = get_group_id(0), step = get_local_size(0), begin_at = receiver_offsets[tile] + get_local_id(0);
#endif
    const uint first_edge = overflow ? 0 : edge_offsets[tile],
               end_edge = overflow ? status->feature_count : edge_offsets[tile + 1];
    for (uint batch_first = begin_at; batch_first < receiver_ends[tile]; batch_first += step) {
      const int batch_count = min((int)(receiver_ends[tile] - batch_first), HS_BATCH);
      load_batch(light, view, listed + batch_first, batch_count, depth_or_position, normal, &batch);
      const Region whole = region_of(&batch, 0, batch_count);
      int listed_count = 0;
      uint edge = first_edge;
      for (; edge < end_edge && listed_count < HS_LISTED; ++edge)
        if (take_edge(light, disc.radius_px, &whole, edges + (overflow ? edge : edge_refs[edge]), &lists[0], listed_count))
          ++listed_count;
      const bool complete = edge == end_edge;
      pad_list(&lists[0], listed_count);

      for (int first = 0; first < batch_count; first += HS_CHUNK) {
        const int count = min(batch_count - first, HS_CHUNK);
        const Region region = region_of(&batch, first, first + count);
        for (int i = 0; i < count; ++i) walks[i].touched = walks[i].near = false;
        // Where the batch's list has no room for all, each chunk goes through the tile's edges by itself, a listful at a time.
        for (uint from = complete ? end_edge : first_edge, once = 1; once || from < end_edge; once = 0) {
          if (!complete) {
            listed_count = 0;
            for (; from < end_edge && listed_count < HS_LISTED; ++from)
              if (take_edge(light, disc.radius_px, &region, edges + (overflow ? from : edge_refs[from]), &lists[0], listed_count))
                ++listed_count;
            pad_list(&lists[0], listed_count);
          }
          const int near_count = narrow_list(light, disc.radius_px, &region, &lists[0], listed_count, &lists[1]);
          if (near_count == 0) continue;
          for (int i = 0; i < count; ++i) {
            const int k = first + i;
            const int passing_count =
                project_edges(&lists[1], near_count, disc, batch.x[k], batch.y[k], batch.z[k], &passing, &walks[i]);
            if (passing_count == 0) continue;
            const float2 rotation = disc.rotated ? rotation_of(listed[batch_first + k]) : (float2)(1.0f, 0.0f);
            count_crossings(&passing, passing_count, disc, rotation, samples, rank_table, counts + i * HS_MAX_SAMPLES, &walks[i]);
          }
        }

        // The centre: by the map where it is clear, else by counting.
        int asking_count = 0;
        int centre[HS_CHUNK];
        for (int i = 0; i < count; ++i) {
          const int lit = walks[i].near ? 2 : lit_by_map(light, shadow_map, &batch, first + i);
          centre[i] = lit == 1 ? 0 : 1;
          if (lit == 2 || (lit == 0 && walks[i].touched)) asking[asking_count++] = i;
        }
        if (asking_count > 0) {
          count_centre(light, &batch, first, asking, asking_count, tile, blocks, slot_count, rects, triangle_offsets,
                       triangle_refs, triangle_capacity, triangles, vertices_ls, vertices_px, planes, crossings);
          for (int i = 0; i < asking_count; ++i) centre[asking[i]] = crossings[i];
        }

        for (int i = 0; i < count; ++i) {
          float seen = centre[i] <= 0 ? 1.0f : 0.0f;
          bool negative = centre[i] < 0;
          if (walks[i].touched) {
            int seen_count = 0;
            for (int k = 0; k < n; k += HS_LANES) {
              const v_short depth = v_load_short(counts + i * HS_MAX_SAMPLES + k) + (v_short)((short)centre[i]);
              seen_count += short_lane_count(depth <= (short)0);
              negative |= short_lane_count(depth < (short)0) != 0;
            }
            seen = (float)seen_count / (float)n;
          }
          if (negative) atomic_inc(&status->negative_count);
          visibility[(size_t)plane * view.width_px * view.height_px + listed[batch_first + first + i]] = seen;
        }
      }
    }
  }
}
