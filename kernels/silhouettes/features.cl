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
  uint layer_count;
  __global const uint* sublayer_layers;
} FinSource;

// The layer of features whose edge has its middle at depth z.
HS_INLINE uint layer_of_depth(const FinSource* from, float z) {
  return from->layer_count == 1 ? 0 : layer_at(from->view, from->sublayer_layers, z);
}

// Where features go.
typedef struct {
  uint layer;
  __global HsFeature* features;
  __global ushort4* rects;
  __global uint* tile_counts;
  __global HsStatus* status;
} FeatureSink;

// width_px: see local_width. A caster without width casts nothing.
HS_INLINE void emit(const HsFinShape shape, const FeatureSink* sink, HsFeature feature, float width_px, ushort4 rect) {
  const bool reaches = rect.x < rect.z && width_px > 0.0f;
  if (reaches) {
    const uint i = atomic_inc(&sink->status->feature_count);
    feature.kind_and_layer |= sink->layer << HS_FEATURE_KIND_BITS;
    const uint widest = (1u << (32 - HS_FEATURE_NARROW_SHIFT)) - 2u;
    const float narrow = width_px * (float)HS_NARROW_STEPS;
    if (narrow < (float)widest) feature.kind_and_layer |= ((uint)narrow + 1u) << HS_FEATURE_NARROW_SHIFT;
    sink->features[i] = feature;
    sink->rects[i] = rect;
    count_rect(rect, shape.tiles_x, sink->tile_counts + sink->layer * (shape.tiles_x * shape.tiles_y));
  }
}

HS_INLINE void emit_corner(const HsView view, const HsFinShape shape, const FeatureSink* sink, uint kind, float3 apex, float2 h0,
                           float2 h1, float width_px) {
  const HsFeature corner = {apex.x, apex.y, apex.z, h0.x, h0.y, h1.x, h1.y, kind};
  const float2 q = sphere_q(view, shape, apex.xy);
  if (sphere_misses_face(shape, q, apex.z, 0.0f)) return;
  const float reach = reach_at(shape, q, apex.z, view.d_far);
  float2 low, high;
  bound_sector(apex.xy, h0, h1, reach, &low, &high);
  emit(shape, sink, corner, width_px, rect_of_feature(view, shape, low, high));
}

// A vertex in texels, where the rasterizer drew it: fins begin exactly where coverage ends.
HS_INLINE float3 drawn_px(const HsView view, float3 p_ls, int4 vertex_px) {
  if (vertex_px.w != 0) return project_px(view, p_ls);
  return (float3)(convert_float2(vertex_px.xy) * (1.0f / HS_SUBPIXEL) + (float2)(view.mid_x_px, view.mid_y_px),
                  as_float(vertex_px.z));
}

// How far from the middle of the map the points lie that features are made of, in texels: 1/z and places of points farther away
// would lose their digits.
#define HS_FEATURES_END_PX (4.0f * HS_GUARD_PX)

// Where p stands to the pyramid that reaches so far, and to the near plane: none is negative within.
HS_INLINE float inside_drawable(const HsView view, float3 p, int plane) {
  if (plane == 0) return p.z - view.znear;
  const float3 h = homogeneous_px(view, p);
  const float side = plane < 3 ? h.x : h.y;
  return HS_FEATURES_END_PX * h.z - ((plane & 1) != 0 ? side : -side);
}

HS_INLINE bool is_drawable(const HsView view, float3 p) {
  bool inside = true;
  for (int plane = 0; plane < 5; ++plane) inside &= inside_drawable(view, p, plane) >= 0.0f;
  return inside;
}

// p, or where the way from there to `towards`, which is drawable or is cut in its turn, enters the pyramid.
HS_INLINE float3 drawable_point(const HsView view, float3 p, float3 towards) {
  for (int plane = 0; plane < 5; ++plane) {
    const float a = inside_drawable(view, p, plane), b = inside_drawable(view, towards, plane);
    if (a < 0.0f && b > 0.0f) p = towards + b / (b - a) * (p - towards);
  }
  p.z = max(p.z, view.znear);
  return p;
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
  // The other end may lie before the near plane, or far away: the direction comes from a point of the edge that does not.
  const uint other = ends.x == vertex ? ends.y : ends.x;
  const float3 v = from->vertices_ls[vertex].xyz;
  const float3 o = drawable_point(view, from->vertices_ls[other].xyz, v);
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
// The same holds where another caster abuts: where the surfaces on both sides meet at the silhouette, as those of two pieces of
// one wall do, or so nearly that light that passes between them draws no penumbra of a quarter of a texel.
//
// And where the outward side is covered by a surface close behind, next to no light passes: the fin matters to that surface
// alone, and were its inner side to brighten what lies deeper, it would where an outline ends in a cusp on its own caster.
#define HS_OPEN 0
#define HS_CLOSED 1  // close behind
#define HS_HIDDEN 2
HS_INLINE bool in_map(const HsView view, int2 texel) {
  return texel.x >= 0 && texel.y >= 0 && texel.x < (int)view.width_px && texel.y < (int)view.height_px;
}

// Whether the surface that the map shows at `texel`, r_px outward of the silhouette, meets it: by no more than its own slope, or
// that of the surface inward, makes it lie deeper there.
HS_INLINE bool surfaces_meet(const FinSource* from, float2 silhouette_px, float2 outward, float d, float d_out) {
  const HsView view = from->view;
  const int2 farther = convert_int2_rtn(silhouette_px + 3.0f * outward),
             inward = convert_int2_rtn(silhouette_px - 1.5f * outward);
  if (!in_map(view, farther) || !in_map(view, inward)) return false;
  const float slope = min(fabs(d_out - 1.0f / from->shadow_map[farther.y * view.width_px + farther.x]),
                          fabs(1.0f / from->shadow_map[inward.y * view.width_px + inward.x] - d));
  const float apart = from->shape.radius_px > 0.0f ? 0.25f / from->shape.radius_px : 0.25f * d / from->shape.width_px;
  return d - d_out <= 2.0f * slope + apart + d * 1e-5f;
}

HS_INLINE int outward_of(const FinSource* from, float2 silhouette_px, float2 outward, float d) {
  const HsView view = from->view;
  const HsFinShape shape = from->shape;
  const int2 texel = convert_int2_rtn(silhouette_px + 1.5f * outward);
  if (!in_map(view, texel)) return HS_OPEN;
  const float z_map = from->shadow_map[texel.y * view.width_px + texel.x], z = 1.0f / d, depth = caster_depth(view, shape, d);
  if (z_map < z * 0.9999f) return shape.drop_hidden == 2 || z_map >= z - depth ? HS_HIDDEN : HS_OPEN;
  if (z_map >= z + 0.25f * depth) return HS_OPEN;
  return surfaces_meet(from, silhouette_px, outward, d, 1.0f / z_map) ? HS_HIDDEN : HS_CLOSED;
}

// A silhouette edge that can be drawn: its ends in texels, with the caster to the right; the unit normal away from it; and how
// wide the caster is there.
typedef struct {
  float3 from, to;
  float2 outward;
  float length_px, width_px;
} SilhouetteEdge;

// How far inward the caster reaches: at least as far as its faces at the edge, and as far as the map shows no surface much deeper
// than the silhouette. INFINITY where that is as far as its penumbrae reach. Where it is less, the caster hides less of the light
// than a half-plane would, and where it is 0, nothing.
HS_INLINE float local_width(const FinSource* source, uint edge, const SilhouetteEdge* e) {
  const HsView view = source->view;
  const HsFinShape shape = source->shape;
  const float d = 0.5f * (e->from.z + e->to.z), reach = reach_px(shape, d, view.d_far);
  float width = 0.0f;
  for (uint i = source->edge_face_offsets[edge]; i < source->edge_face_offsets[edge + 1]; ++i) {
    const uint3 corner = vload3(source->edge_faces[i] >> 1, source->triangles);
    const uint vertices[3] = {corner.x, corner.y, corner.z};
    for (int k = 0; k < 3; ++k) {
      const float3 p = source->vertices_ls[vertices[k]].xyz;
      if (!is_drawable(view, p)) return INFINITY;
      width = max(width, dot(e->from.xy - drawn_px(view, p, source->vertices_px[vertices[k]]).xy, e->outward));
    }
  }
  const float2 middle = 0.5f * (e->from.xy + e->to.xy);
  const float deepest = 1.0f / d + caster_depth(view, shape, d);
  for (float at = 1.5f; width < reach; at *= 1.5f) {
    const int2 texel = convert_int2_rtn(middle - at * e->outward);
    if (!in_map(view, texel)) return INFINITY;
    if (source->shadow_map[texel.y * view.width_px + texel.x] > deepest) return width;
    width = max(width, at - 0.75f);
  }
  return INFINITY;
}

// False where it is none: before the near plane, or seen end-on.
HS_INLINE bool silhouette_edge(const FinSource* source, uint edge, SilhouetteEdge* e) {
  const HsView view = source->view;
  const uint2 ends = source->edges[edge];
  const float3 p = source->vertices_ls[ends.x].xyz, q = source->vertices_ls[ends.y].xyz;
  if (!(max(p.z, q.z) > view.znear)) return false;
  const float3 a = drawable_point(view, p, q), b = drawable_point(view, q, a);
  // Where a plane stays between the pyramid and all of the edge, nothing has been cut.
  for (int plane = 0; plane < 5; ++plane)
    if (inside_drawable(view, p, plane) < 0.0f && inside_drawable(view, q, plane) < 0.0f) return false;
  e->from = drawn_px(view, a, source->vertices_px[ends.x]);
  e->to = drawn_px(view, b, source->vertices_px[ends.y]);
  if (source->multiplicities[edge] < 0) {
    const float3 swap = e->from;
    e->from = e->to;
    e->to = swap;
  }
  const float2 along = e->to.xy - e->from.xy;
  e->length_px = sqrt(dot(along, along));
  if (!(e->length_px > 0.0f)) return false;
  e->outward = (float2)(along.y, -along.x) / e->length_px;
  e->width_px = source->shape.drop_hidden ? local_width(source, edge, e) : INFINITY;
  return true;
}

// Of an edge that is none, the corners at its ends meet.
HS_INLINE float edge_width(const FinSource* source, uint edge) {
  SilhouetteEdge e;
  if (!source->shape.drop_hidden) return INFINITY;
  return silhouette_edge(source, edge, &e) ? e.width_px : INFINITY;
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
    emit_corner(view, shape, sink, diverging > 0.0f ? HS_FEATURE_CORNER : HS_FEATURE_INNER_CORNER, apex, e0.beyond, e1.beyond,
                min(edge_width(from, owner), edge_width(from, second)));
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
      normal += unit_normal(n);
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
    const float width_px = edge_width(from, edge);
    emit_corner(view, shape, sink, HS_FEATURE_CORNER, apex, h0, h1, width_px);
    if (shape.two_sided) emit_corner(view, shape, sink, HS_FEATURE_INNER_CORNER, apex, -h0, -h1, width_px);
  }
}

// One vertex's corners: called for the first of its silhouette edges, so that each vertex is done once. They belong to the layer
// of the nearest of these, whichever is the first.
HS_INLINE void build_corner(const FinSource* from, const FeatureSink* sink, uint vertex, uint owner) {
  const HsView view = from->view;
  const float3 v = from->vertices_ls[vertex].xyz;
  if (!is_drawable(view, v)) return;
  const uint begin = from->vertex_edge_offsets[vertex], end = from->vertex_edge_offsets[vertex + 1];
  uint count = 0, second = owner;
  float nearest_z = INFINITY;
  for (uint i = begin; i < end; ++i) {
    const uint edge = from->vertex_edges[i];
    if (from->multiplicities[edge] == 0) continue;
    if (edge < owner) return;
    if (edge != owner && count == 1) second = edge;
    ++count;
    nearest_z = min(nearest_z, middle_z(from->edges[edge], from->vertices_ls));
  }
  FeatureSink corners = *sink;
  corners.layer = layer_of_depth(from, nearest_z);
  const float3 apex = drawn_px(view, v, from->vertices_px[vertex]);
  if (count == 2)
    build_simple_corner(from, &corners, vertex, owner, second, apex);
  else if (count > 2)
    build_shared_corner(from, &corners, vertex, begin, end, apex);
}

// An edge's quad.
HS_INLINE void build_quad(const FinSource* source, const FeatureSink* sink, uint edge_index) {
  const HsView view = source->view;
  const HsFinShape shape = source->shape;
  SilhouetteEdge edge;
  if (!silhouette_edge(source, edge_index, &edge)) return;
  const float3 from = edge.from, to = edge.to;
  const float2 outward = edge.outward;
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
  emit(shape, sink, quad, edge.width_px, rect_of_feature(view, shape, low, high));
}

// features, rects: one a feature, in no particular order; tile_counts, a row of tiles a layer, must be 0. Any number of
// work-items.
__kernel void build_features(const HsView view, HsFinShape shape, const uint layer_count, __global const uint* sublayer_layers,
                             __global const uint* silhouettes, HS_ARGS_TOPOLOGY, HS_ARGS_TRIANGLES,
                             __global const char* multiplicities, __global const float* shadow_map, __global HsFeature* features,
                             __global ushort4* rects, __global uint* tile_counts, __global HsStatus* status) {
  if (layer_count > 1 && shape.drop_hidden && sublayer_layers[HS_SUBLAYERS] == 1) shape.drop_hidden = 2;
  const FinSource source = {view,         shape,          edges,          edge_face_offsets, edge_faces,  vertex_edge_offsets,
                            vertex_edges, triangles,      multiplicities, vertices_vs,       vertices_px, shadow_map,
                            layer_count,  sublayer_layers};
  for (uint i = get_global_id(0); i < status->silhouette_count; i += get_global_size(0)) {
    const uint edge = silhouettes[i];
    const uint2 ends = edges[edge];
    const FeatureSink sink = {layer_of_depth(&source, middle_z(ends, vertices_vs)), features, rects, tile_counts, status};
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
    const uint layer = feature_layer(features[i]);
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
