// Silhouette edges to fin geometry in the light map: one quad an edge, sectors at the corners.
// Chan & Durand 2003 §3 step 3; Cai et al. 2006 §3.1. All fin methods use it.

#include "base/faces.h"
#include "raster/clip.h"
#include "silhouettes/fin_shape.h"
#include "silhouettes/layers.h"
#include "silhouettes/topology.h"

// What fins are made from: topology, vertices in the light's view, and what the light's centre sees.
typedef struct {
  HsView view;
  HsFinShape shape;
  __global const uint2* edges;
  __global const uint *edge_face_offsets, *edge_faces, *vertex_edge_offsets, *vertex_edges, *triangles;
  __global const char* multiplicities;
  __global const float4* vertices_ls;
  __global const int4* vertices_px;
  __global const float* shadow_map;
} FinSource;

// Where features go.
typedef struct {
  uint layer;
  __global HsFeature* features;
  __global ushort4* rects;
  __global uint* tile_counts;
  __global HsStatus* status;
} FeatureSink;

HS_INLINE void emit(const HsFinShape shape, const FeatureSink* sink, HsFeature feature, ushort4 rect) {
  const bool reaches = rect.x < rect.z;
  if (reaches) {
    const uint i = atomic_inc(&sink->status->feature_count);
    feature.kind_and_layer |= sink->layer << HS_FEATURE_KIND_BITS;
    sink->features[i] = feature;
    sink->rects[i] = rect;
    count_rect(rect, shape.tiles_x, sink->tile_counts + sink->layer * (shape.tiles_x * shape.tiles_y));
  }
}

HS_INLINE void emit_corner(const HsView view, const HsFinShape shape, const FeatureSink* sink, uint kind, float3 apex, float2 h0,
                           float2 h1) {
  const HsFeature corner = {apex.x, apex.y, apex.z, h0.x, h0.y, h1.x, h1.y, kind};
  const float2 q = sphere_q(view, shape, apex.xy);
  if (sphere_misses_face(shape, q, apex.z, 0.0f)) return;
  const float reach = reach_at(shape, q, apex.z, view.d_far);
  float2 low, high;
  bound_sector(apex.xy, h0, h1, reach, &low, &high);
  emit(shape, sink, corner, rect_of_feature(view, shape, low, high));
}

// A vertex in texels, where the rasterizer drew it: fins begin exactly where coverage ends.
HS_INLINE float3 drawn_px(const HsView view, float3 p_ls, int4 vertex_px) {
  if (vertex_px.w != 0) return project_px(view, p_ls);
  return (float3)(convert_float2(vertex_px.xy) * (1.0f / HS_SUBPIXEL) + (float2)(view.mid_x_px, view.mid_y_px),
                  as_float(vertex_px.z));
}

// A silhouette edge at a vertex, in texels: the unit direction that leads into the vertex along it, and the outward unit normal.
// What lies beyond its end is where r . beyond >= 0: the same as into, but where the light is a sphere.
typedef struct {
  float2 into, outward, beyond;
} EdgeAtVertex;

HS_INLINE EdgeAtVertex edge_at_vertex(const FinSource* from, uint edge, uint vertex, float3 apex_px) {
  const HsView view = from->view;
  const HsFinShape shape = from->shape;
  const uint2 ends = from->edges[edge];
  const int multiplicity = from->multiplicities[edge];
  // The other end may lie before the near plane: the direction comes from a point of the edge that does not.
  const uint other = ends.x == vertex ? ends.y : ends.x;
  const float3 v = from->vertices_ls[vertex].xyz;
  float3 o = from->vertices_ls[other].xyz;
  if (o.z < view.znear) o = v + (v.z - view.znear) / (v.z - o.z) * (o - v);
  o.z = max(o.z, view.znear);
  EdgeAtVertex e;
  const float2 along = apex_px.xy - drawn_px(view, o, from->vertices_px[other]).xy;
  const float length_px = sqrt(dot(along, along));
  // An edge seen end-on has no direction: any will do, as long as the corners at both of its ends agree about it.
  e.into = length_px > 0.0f ? along / length_px : (float2)(ends.y == vertex ? 1.0f : -1.0f, 0.0f);
  // The stored direction ends.x -> ends.y has the surface to its right where m > 0 (q space, y up): outward is left.
  const bool outward_left = (multiplicity > 0) == (ends.y == vertex);
  e.outward = outward_left ? (float2)(e.into.y, -e.into.x) : (float2)(-e.into.y, e.into.x);
  const float skew = sphere_skew(sphere_q(view, shape, apex_px.xy), e.outward, e.into);
  e.beyond = skew != 0.0f ? (e.into - e.outward * skew) / sqrt(1.0f + skew * skew) : e.into;
  return e;
}

// The half-plane through the apex, bounded by `edge`, that holds `inside`: its inner normal.
HS_INLINE float2 half_plane(float2 edge, float2 inside) {
  const float2 normal = (float2)(-edge.y, edge.x);
  return dot(normal, inside) >= 0.0f ? normal : -normal;
}

// True where a silhouette's outward side is covered by the same caster, so that no shadow ends there: a fold of the mesh's
// outline, or an edge beneath the surface. Its fins would brighten the umbra, or darken what the true outline's inner fins
// brighten. The same caster's, if its surface is not much nearer than the silhouette: see caster_depth. In one layer any other's
// will do.
//
// And where the outward side is covered by a surface close behind, next to no light passes: the fin matters to that surface
// alone, and were its inner side to brighten what lies deeper, it would where an outline ends in a cusp on its own caster.
#define HS_OPEN 0
#define HS_CLOSED 1  // close behind
#define HS_HIDDEN 2
HS_INLINE int outward_of(const FinSource* from, float2 silhouette_px, float2 outward, float d) {
  const HsView view = from->view;
  const HsFinShape shape = from->shape;
  const int2 texel = convert_int2_rtn(silhouette_px + 1.5f * outward);
  if (texel.x < 0 || texel.y < 0 || texel.x >= (int)view.width_px || texel.y >= (int)view.height_px) return HS_OPEN;
  const float z_map = from->shadow_map[texel.y * view.width_px + texel.x], z = 1.0f / d, depth = caster_depth(view, shape, d);
  if (z_map < z * 0.9999f) return shape.drop_hidden == 2 || z_map >= z - depth ? HS_HIDDEN : HS_OPEN;
  return z_map < z + 0.25f * depth ? HS_CLOSED : HS_OPEN;
}

// The corner of a vertex with two silhouette edges.
HS_INLINE void build_simple_corner(const FinSource* from, const FeatureSink* sink, uint vertex, uint owner, uint second,
                                   float3 apex) {
  const HsView view = from->view;
  const HsFinShape shape = from->shape;
  // Beyond both edges' ends: the region whose nearest silhouette point is the vertex. It lies outside where the outward normals
  // diverge, inside where the corner is concave.
  const EdgeAtVertex e0 = edge_at_vertex(from, owner, vertex, apex);
  const EdgeAtVertex e1 = edge_at_vertex(from, second, vertex, apex);
  const float diverging = dot(e0.outward + e1.outward, e0.into + e1.into);
  if (shape.drop_hidden) {
    const int covered = max(outward_of(from, apex.xy - 1.5f * e0.into, e0.outward, apex.z),
                            outward_of(from, apex.xy - 1.5f * e1.into, e1.outward, apex.z));
    if (covered == HS_HIDDEN || (covered == HS_CLOSED && diverging < 0.0f)) return;
  }
  if (diverging > 0.0f || (diverging < 0.0f && shape.two_sided))
    emit_corner(view, shape, sink, diverging > 0.0f ? HS_FEATURE_CORNER : HS_FEATURE_INNER_CORNER, apex, e0.beyond, e1.beyond);
}

// Those of a vertex with more silhouette edges, which are edges begin .. end of vertex_edges.
HS_INLINE void build_shared_corner(const FinSource* from, const FeatureSink* sink, uint vertex, uint begin, uint end,
                                   float3 apex) {
  const HsView view = from->view;
  const HsFinShape shape = from->shape;
  const float3 v = from->vertices_ls[vertex].xyz;
  // "We average the adjacent face normals to obtain a shared vertex normal n [...] Then we draw triangles that connect n with
  // each of the adjacent smoothie edges" (Chan & Durand §3). As it turns with the point on the surface, q = p.xy/p.z moves
  // along (n.x - q.x n.z, n.y - q.y n.z).
  float3 normal = (float3)(0.0f);
  for (uint i = begin; i < end; ++i) {
    const uint edge = from->vertex_edges[i];
    for (uint k = from->edge_face_offsets[edge]; k < from->edge_face_offsets[edge + 1]; ++k) {
      const uint3 corner = vload3(from->edge_faces[k] >> 1, from->triangles);
      float3 anchor;
      const float3 n =
          face_normal(from->vertices_ls[corner.x].xyz, from->vertices_ls[corner.y].xyz, from->vertices_ls[corner.z].xyz, &anchor);
      const float n_length = sqrt(dot(n, n));
      if (n_length > 0.0f) normal += n / n_length;
    }
  }
  const float2 moved = normal.xy - v.xy * (normal.z / v.z);
  float2 shared = (float2)(moved.x, -moved.y);  // texel rows count downwards
  const float shared_length = sqrt(dot(shared, shared));
  // However the mesh is wound, it leads away from what the fins' edges bound.
  float2 outward = (float2)(0.0f);
  for (uint i = begin; i < end; ++i) {
    const uint edge = from->vertex_edges[i];
    if (from->multiplicities[edge] != 0) outward += edge_at_vertex(from, edge, vertex, apex).outward;
  }
  if (dot(shared, outward) < 0.0f) shared = -shared;
  for (uint i = begin; i < end; ++i) {
    const uint edge = from->vertex_edges[i];
    if (from->multiplicities[edge] == 0) continue;
    const EdgeAtVertex e = edge_at_vertex(from, edge, vertex, apex);
    // Where the normals cancel out there is no shared direction: a quarter disc closes each fin.
    const float2 to = shared_length > 1e-6f ? shared / shared_length : e.into;
    const float2 beside = (float2)(-e.beyond.y, e.beyond.x);  // the line between the fin and what is beyond its end
    const float2 h0 = half_plane(beside, to), h1 = half_plane(to, e.outward);
    emit_corner(view, shape, sink, HS_FEATURE_CORNER, apex, h0, h1);
    if (shape.two_sided) emit_corner(view, shape, sink, HS_FEATURE_INNER_CORNER, apex, -h0, -h1);
  }
}

// One vertex's corners: called for the first of its silhouette edges, so that each vertex is done once.
HS_INLINE void build_corner(const FinSource* from, const FeatureSink* sink, uint vertex, uint owner) {
  const HsView view = from->view;
  const float3 v = from->vertices_ls[vertex].xyz;
  if (!(v.z >= view.znear)) return;
  const uint begin = from->vertex_edge_offsets[vertex], end = from->vertex_edge_offsets[vertex + 1];
  uint count = 0, second = owner;
  for (uint i = begin; i < end; ++i) {
    const uint edge = from->vertex_edges[i];
    if (from->multiplicities[edge] == 0) continue;
    if (edge < owner) return;
    if (edge != owner && count == 1) second = edge;
    ++count;
  }
  const float3 apex = drawn_px(view, v, from->vertices_px[vertex]);
  if (count == 2)
    build_simple_corner(from, sink, vertex, owner, second, apex);
  else if (count > 2)
    build_shared_corner(from, sink, vertex, begin, end, apex);
}

// An edge's quad.
HS_INLINE void build_quad(const FinSource* source, const FeatureSink* sink, uint edge) {
  const HsView view = source->view;
  const HsFinShape shape = source->shape;
  const uint2 ends = source->edges[edge];
  float3 a = source->vertices_ls[ends.x].xyz, b = source->vertices_ls[ends.y].xyz;
  if (!(max(a.z, b.z) > view.znear)) return;
  if (a.z < view.znear) a = b + (b.z - view.znear) / (b.z - a.z) * (a - b);
  if (b.z < view.znear) b = a + (a.z - view.znear) / (a.z - b.z) * (b - a);
  a.z = max(a.z, view.znear);
  b.z = max(b.z, view.znear);
  float3 from = drawn_px(view, a, source->vertices_px[ends.x]), to = drawn_px(view, b, source->vertices_px[ends.y]);
  if (source->multiplicities[edge] < 0) {
    const float3 swap = from;
    from = to;
    to = swap;
  }
  const float2 along = to.xy - from.xy;
  const float length_px = sqrt(dot(along, along));
  if (!(length_px > 0.0f)) return;  // seen end-on: the corners at its ends meet
  const float2 outward = (float2)(along.y, -along.x) / length_px;
  int min_covered = HS_OPEN;
  if (shape.drop_hidden) {
    min_covered = HS_HIDDEN;
    for (int k = 1; k < 4; ++k) {
      const float3 at = from + (to - from) * (0.25f * (float)k);
      min_covered = min(min_covered, outward_of(source, at.xy, outward, at.z));
    }
    if (min_covered == HS_HIDDEN) return;
  }
  const HsFeature quad = {from.x, from.y, from.z, to.x,
                          to.y,   to.z,   0.0f,   min_covered == HS_CLOSED ? HS_FEATURE_OUTER_EDGE : HS_FEATURE_EDGE};
  float2 low, high;
  const float2 from_q = sphere_q(view, shape, from.xy), to_q = sphere_q(view, shape, to.xy);
  const float3 across = (float3)(from_q / from.z - to_q / to.z, 1.0f / from.z - 1.0f / to.z);
  const float length = sqrt(dot(across, across));
  if (sphere_misses_face(shape, from_q, from.z, length) && sphere_misses_face(shape, to_q, to.z, length)) return;
  bound_quad(shape, from, to, from_q, to_q, outward, view.d_far, &low, &high);
  emit(shape, sink, quad, rect_of_feature(view, shape, low, high));
}

// features, rects: one a feature, in no particular order; tile_counts, a row of tiles a layer, must be 0. Any number of
// work-items.
__kernel void build_features(const HsView view, HsFinShape shape, const uint layer_count, __global const uint* sublayer_layers,
                             __global const uint* silhouettes, HS_ARGS_TOPOLOGY, HS_ARGS_TRIANGLES,
                             __global const char* multiplicities, __global const float* shadow_map, __global HsFeature* features,
                             __global ushort4* rects, __global uint* tile_counts, __global HsStatus* status) {
  if (layer_count > 1 && shape.drop_hidden && sublayer_layers[HS_SUBLAYERS] == 1) shape.drop_hidden = 2;
  const FinSource source = {view,         shape,     edges,          edge_face_offsets, edge_faces,  vertex_edge_offsets,
                            vertex_edges, triangles, multiplicities, vertices_vs,       vertices_px, shadow_map};
  for (uint i = get_global_id(0); i < status->silhouette_count; i += get_global_size(0)) {
    const uint edge = silhouettes[i];
    const uint2 ends = edges[edge];
    const uint layer = layer_count == 1 ? 0 : layer_at(view, sublayer_layers, middle_z(ends, vertices_vs));
    const FeatureSink sink = {layer, features, rects, tile_counts, status};
    build_corner(&source, &sink, ends.x, edge);
    build_corner(&source, &sink, ends.y, edge);
    build_quad(&source, &sink, edge);
  }
}

// refs: feature indices, layer by layer and tile by tile. Any number of work-items.
__kernel void fill_features(const HsFinShape shape, __global const HsStatus* status, __global const HsFeature* features,
                            __global const ushort4* rects, __global uint* tile_cursors, __global uint* refs,
                            const uint capacity) {
  for (uint i = get_global_id(0); i < status->feature_count; i += get_global_size(0)) {
    const uint layer = features[i].kind_and_layer >> HS_FEATURE_KIND_BITS;
    fill_rect(rects[i], shape.tiles_x, i, tile_cursors + layer * (shape.tiles_x * shape.tiles_y), refs, capacity);
  }
}

// near: uchar a tile of the features': 1 if it holds any. Must be 0 before. Any number of work-items.
__kernel void flag_feature_tiles(const HsFinShape shape, __global const HsStatus* status, __global const ushort4* rects,
                                 __global uchar* near) {
  for (uint i = get_global_id(0); i < status->feature_count; i += get_global_size(0)) {
    const ushort4 rect = rects[i];
    for (uint y = rect.y; y < rect.w; ++y)
      for (uint x = rect.x; x < rect.z; ++x) near[y * shape.tiles_x + x] = 1;
  }
}
