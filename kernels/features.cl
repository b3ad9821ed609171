// Silhouette edges to fin geometry in the light map: one quad an edge, sectors at the corners.
// Chan & Durand 2003 §3 step 3; Cai et al. 2006 §3.1. All fin methods share it.

// Where the light is a ball, a receiver sees the disc that faces it, so that distances in the penumbra are angles, not lengths in
// the map. Here q is a point's place in the map, y down; 0 for discs, for which all of this comes to nothing.
HS_INLINE float2 sphere_q(const HsView view, const HsFinShape shape, float2 px) {
  return (px - view.px_from_q.yw) * shape.sphere_q_per_px;
}

// How far along an edge with this unit normal, for each step across it, the points lead that are nearest to q by angle: towards
// normal + (q . normal) q.
HS_INLINE float sphere_skew(float2 q, float2 normal, float2 along) {
  const float s = dot(q, normal);
  return s * dot(q, along) / (1.0f + s * s);
}

// As reach_px, for a point of a ball's silhouette at q: see sphere_distance in fins.cl. Its angle is one for which
// |q - p| < R d sqrt(1 + p^2) - R d_far (1 + q . p) / sqrt(1 + p^2), with p the receiver's place, within the face.
HS_INLINE float sphere_reach_px(const HsFinShape shape, float2 q, float d, float d_far) {
  const float radius = (shape.width_px > 0.0f ? shape.width_px / d : shape.radius_px) * shape.sphere_q_per_px;
  const float from_axis = sqrt(dot(q, q)) + 2.0f * radius * d, stretch = min(sqrt(1.0f + from_axis * from_axis), 3.0f);
  return radius * (stretch * d - d_far * max(1.0f - 1.5f * stretch * radius * d, 0.0f)) / shape.sphere_q_per_px;
}

HS_INLINE float reach_at(const HsFinShape shape, float2 q, float d, float d_far) {
  return shape.sphere_q_per_px > 0.0f ? sphere_reach_px(shape, q, d, d_far) : reach_px(shape, d, d_far);
}

// Whether all of a piece of a ball's silhouette lies at an angle to the face's receivers at which it cannot hide anything. It is
// as long as `length`, and begins at 1/d and q.
HS_INLINE bool sphere_misses_face(const HsFinShape shape, float2 q, float d, float length) {
  if (shape.sphere_q_per_px == 0.0f || shape.width_px > 0.0f) return false;
  const float slant = sqrt(1.0f + dot(q, q)), nearest = slant / d - length, radius = shape.radius_px * shape.sphere_q_per_px;
  if (nearest <= radius || nearest <= length) return false;
  const float face = 1.0f;  // 54.7 degrees, to the face's corners, and room for its border
  return acos(1.0f / slant) > face + asin(radius / nearest) + asin(length / nearest);
}

// The box about an edge's quad, and about the one on its inner side where fins have two.
HS_INLINE void bound_quad(const HsFinShape shape, float3 a, float3 b, float2 qa, float2 qb, float2 outward, float d_far,
                          float2* low, float2* high) {
  const float2 along = (float2)(-outward.y, outward.x);
  const float2 a_reach = (outward + along * sphere_skew(qa, outward, along)) * reach_at(shape, qa, a.z, d_far),
               b_reach = (outward + along * sphere_skew(qb, outward, along)) * reach_at(shape, qb, b.z, d_far);
  const float inner = shape.two_sided ? 1.0f : 0.0f;
  const float2 a_out = a.xy + a_reach, b_out = b.xy + b_reach, a_in = a.xy - a_reach * inner, b_in = b.xy - b_reach * inner;
  *low = min(min(a_in, b_in), min(a_out, b_out));
  *high = max(max(a_in, b_in), max(a_out, b_out));
}

// The box about a corner's sector (the wedge of HsFeature, out to `reach`): its apex, its two sides, and the axes inside it.
HS_INLINE void bound_sector(float2 apex, float2 h0, float2 h1, float reach, float2* low, float2* high) {
  const float2 side0 = (float2)(-h0.y, h0.x) * (h0.x * h1.y - h0.y * h1.x >= 0.0f ? 1.0f : -1.0f);
  const float2 side1 = (float2)(-h1.y, h1.x) * (h1.x * h0.y - h1.y * h0.x >= 0.0f ? 1.0f : -1.0f);
  const float2 most = (float2)(h0.x >= 0.0f && h1.x >= 0.0f, h0.y >= 0.0f && h1.y >= 0.0f);
  const float2 least = (float2)(h0.x <= 0.0f && h1.x <= 0.0f, h0.y <= 0.0f && h1.y <= 0.0f);
  *low = apex + reach * min(min(side0, side1), -least);
  *high = apex + reach * max(max(side0, side1), most);
  *low = min(*low, apex);
  *high = max(*high, apex);
}

// The texels that a box may reach, inclusive: centres lie at +0.5; a texel of slack absorbs the rounding of coordinates far
// outside the map.
HS_INLINE int4 texels_of_points(const HsView view, float2 low, float2 high) {
  const float2 limit = (float2)(view.width_px + 2, view.height_px + 2);
  return (int4)(convert_int2_rtn(clamp(low - 1.0f, (float2)(-2.0f), limit)),
                convert_int2_rtn(clamp(high + 1.0f, (float2)(-2.0f), limit)));
}

HS_INLINE ushort4 rect_of_points(const HsView view, float2 low, float2 high) {
  const int4 box = texels_of_points(view, low, high);
  return rect_of_texels(view, box.x, box.y, box.z, box.w);
}

// The tiles of HsFinShape that hold texels of a box.
HS_INLINE ushort4 rect_of_feature(const HsView view, const HsFinShape shape, float2 low, float2 high) {
  const int4 box = texels_of_points(view, low, high);
  const int2 first = max(box.xy, 0), last = min(box.zw, (int2)((int)view.width_px, (int)view.height_px) - 1);
  if (first.x > last.x || first.y > last.y) return (ushort4)(0);
  const int step = (int)shape.tile_step;
  const int2 overlap = HS_TILE - step, tiles = (int2)((int)shape.tiles_x, (int)shape.tiles_y);
  return convert_ushort4((int4)(max(first - overlap, 0) / step, min(last / step + 1, tiles)));
}

HS_INLINE void emit(const HsFinShape shape, uint layer, HsFeature feature, ushort4 rect, __global HsFeature* features,
                    __global ushort4* rects, __global uint* tile_counts, __global HsStatus* status) {
  const bool reaches = rect.x < rect.z;
  if (reaches) {
    const uint i = atomic_inc(&status->feature_count);
    feature.kind_and_layer |= layer << HS_FEATURE_KIND_BITS;
    features[i] = feature;
    rects[i] = rect;
    count_rect(rect, shape.tiles_x, tile_counts + layer * (shape.tiles_x * shape.tiles_y));
  }
}

HS_INLINE void emit_corner(const HsView view, const HsFinShape shape, uint layer, uint kind, float3 apex, float2 h0, float2 h1,
                           __global HsFeature* features, __global ushort4* rects, __global uint* tile_counts,
                           __global HsStatus* status) {
  const HsFeature corner = {apex.x, apex.y, apex.z, h0.x, h0.y, h1.x, h1.y, kind};
  const float2 q = sphere_q(view, shape, apex.xy);
  if (sphere_misses_face(shape, q, apex.z, 0.0f)) return;
  const float reach = reach_at(shape, q, apex.z, view.d_far);
  float2 low, high;
  bound_sector(apex.xy, h0, h1, reach, &low, &high);
  emit(shape, layer, corner, rect_of_feature(view, shape, low, high), features, rects, tile_counts, status);
}

// A vertex in texels, where the rasterizer drew it: fins begin exactly where coverage ends.
HS_INLINE float3 drawn_px(const HsView view, float3 p_ls, int4 vertex_px) {
  if (vertex_px.w != 0) return project_px(view, p_ls);
  return (float3)(convert_float2(vertex_px.xy) * (1.0f / HS_SUBPIXEL) + (float2)(view.mid_x_px, view.mid_y_px),
                  as_float(vertex_px.z));
}

// A silhouette edge at a vertex, in texels: the unit direction that leads into the vertex along it, and the outward unit normal.
// What lies beyond its end is where r . beyond >= 0: the same as into, but where the light is a ball.
typedef struct {
  float2 into, outward, beyond;
} EdgeAtVertex;

HS_INLINE EdgeAtVertex edge_at_vertex(const HsView view, const HsFinShape shape, uint2 ends, uint vertex, int multiplicity,
                                      __global const float4* vertices_ls, __global const int4* vertices_px, float3 apex_px) {
  // The other end may lie before the near plane: the direction comes from a point of the edge that does not.
  const uint other = ends.x == vertex ? ends.y : ends.x;
  const float3 v = vertices_ls[vertex].xyz;
  float3 o = vertices_ls[other].xyz;
  if (o.z < view.znear) o = v + (v.z - view.znear) / (v.z - o.z) * (o - v);
  o.z = max(o.z, view.znear);
  EdgeAtVertex e;
  const float2 along = apex_px.xy - drawn_px(view, o, vertices_px[other]).xy;
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
HS_INLINE int outward_of(const HsView view, const HsFinShape shape, __global const float* shadow_map, float2 silhouette_px,
                         float2 outward, float d) {
  const int2 texel = convert_int2_rtn(silhouette_px + 1.5f * outward);
  if (texel.x < 0 || texel.y < 0 || texel.x >= (int)view.width_px || texel.y >= (int)view.height_px) return HS_OPEN;
  const float z_map = shadow_map[texel.y * view.width_px + texel.x], z = 1.0f / d, depth = caster_depth(view, shape, d);
  if (z_map < z * 0.9999f) return shape.drop_hidden == 2 || z_map >= z - depth ? HS_HIDDEN : HS_OPEN;
  return z_map < z + 0.25f * depth ? HS_CLOSED : HS_OPEN;
}

// One corner: called by the first silhouette edge of the vertex, so that each vertex is done once.
HS_INLINE void build_corner(const HsView view, const HsFinShape shape, uint layer, uint vertex, uint owner,
                            __global const uint2* edges, __global const uint* edge_face_offsets, __global const uint* edge_faces,
                            __global const uint* triangles, __global const uint* vertex_edge_offsets,
                            __global const uint* vertex_edges, __global const char* multiplicities,
                            __global const float4* vertices_ls, __global const int4* vertices_px,
                            __global const float* shadow_map, __global HsFeature* features, __global ushort4* rects,
                            __global uint* tile_counts, __global HsStatus* status) {
  const float3 v = vertices_ls[vertex].xyz;
  if (!(v.z >= view.znear)) return;
  const uint begin = vertex_edge_offsets[vertex], end = vertex_edge_offsets[vertex + 1];
  uint count = 0, second = owner;
  for (uint i = begin; i < end; ++i) {
    const uint edge = vertex_edges[i];
    if (multiplicities[edge] == 0) continue;
    if (edge < owner) return;
    if (edge != owner && count == 1) second = edge;
    ++count;
  }
  const float3 apex = drawn_px(view, v, vertices_px[vertex]);
  if (count == 2) {
    // Beyond both edges' ends: the region whose nearest silhouette point is the vertex. It lies outside where the outward normals
    // diverge, inside where the corner is concave.
    const EdgeAtVertex e0 =
        edge_at_vertex(view, shape, edges[owner], vertex, multiplicities[owner], vertices_ls, vertices_px, apex);
    const EdgeAtVertex e1 =
        edge_at_vertex(view, shape, edges[second], vertex, multiplicities[second], vertices_ls, vertices_px, apex);
    const float diverging = dot(e0.outward + e1.outward, e0.into + e1.into);
    if (shape.drop_hidden) {
      const int covered = max(outward_of(view, shape, shadow_map, apex.xy - 1.5f * e0.into, e0.outward, apex.z),
                              outward_of(view, shape, shadow_map, apex.xy - 1.5f * e1.into, e1.outward, apex.z));
      if (covered == HS_HIDDEN || (covered == HS_CLOSED && diverging < 0.0f)) return;
    }
    if (diverging > 0.0f || (diverging < 0.0f && shape.two_sided))
      emit_corner(view, shape, layer, diverging > 0.0f ? HS_FEATURE_CORNER : HS_FEATURE_INNER_CORNER, apex, e0.beyond, e1.beyond,
                  features, rects, tile_counts, status);
  } else if (count > 2) {
    // "We average the adjacent face normals to obtain a shared vertex normal n [...] Then we draw triangles that connect n with
    // each of the adjacent smoothie edges" (Chan & Durand §3). As it turns with the point on the surface, q = p.xy/p.z moves
    // along (n.x - q.x n.z, n.y - q.y n.z).
    float3 normal = (float3)(0.0f);
    for (uint i = begin; i < end; ++i) {
      const uint edge = vertex_edges[i];
      for (uint k = edge_face_offsets[edge]; k < edge_face_offsets[edge + 1]; ++k) {
        const uint3 corner = vload3(edge_faces[k] >> 1, triangles);
        float3 anchor;
        const float3 n = face_normal(vertices_ls[corner.x].xyz, vertices_ls[corner.y].xyz, vertices_ls[corner.z].xyz, &anchor);
        const float n_length = sqrt(dot(n, n));
        if (n_length > 0.0f) normal += n / n_length;
      }
    }
    const float2 moved = normal.xy - v.xy * (normal.z / v.z);
    float2 shared = (float2)(moved.x, -moved.y);  // texel rows count downwards
    const float shared_length = sqrt(dot(shared, shared));
    // Whichever way the mesh is wound, it leads away from what the fins' edges bound.
    float2 outward = (float2)(0.0f);
    for (uint i = begin; i < end; ++i) {
      const uint edge = vertex_edges[i];
      if (multiplicities[edge] != 0)
        outward += edge_at_vertex(view, shape, edges[edge], vertex, multiplicities[edge], vertices_ls, vertices_px, apex).outward;
    }
    if (dot(shared, outward) < 0.0f) shared = -shared;
    for (uint i = begin; i < end; ++i) {
      const uint edge = vertex_edges[i];
      if (multiplicities[edge] == 0) continue;
      const EdgeAtVertex e =
          edge_at_vertex(view, shape, edges[edge], vertex, multiplicities[edge], vertices_ls, vertices_px, apex);
      // Where the normals cancel out there is no shared direction: a quarter disc closes each fin.
      const float2 to = shared_length > 1e-6f ? shared / shared_length : e.into;
      const float2 from = (float2)(-e.beyond.y, e.beyond.x);  // the line between the fin and what is beyond its end
      const float2 h0 = half_plane(from, to), h1 = half_plane(to, e.outward);
      emit_corner(view, shape, layer, HS_FEATURE_CORNER, apex, h0, h1, features, rects, tile_counts, status);
      if (shape.two_sided)
        emit_corner(view, shape, layer, HS_FEATURE_INNER_CORNER, apex, -h0, -h1, features, rects, tile_counts, status);
    }
  }
}

// features, rects: one a feature, in no particular order; tile_counts, a row of tiles a layer, must be 0. Any number of
// work-items.
__kernel void build_features(const HsView view, HsFinShape shape, const uint layer_count, __global const uint* sublayer_layers,
                             __global const uint* silhouettes, __global const uint2* edges,
                             __global const uint* edge_face_offsets, __global const uint* edge_faces,
                             __global const uint* triangles, __global const uint* vertex_edge_offsets,
                             __global const uint* vertex_edges, __global const char* multiplicities,
                             __global const float4* vertices_ls, __global const int4* vertices_px,
                             __global const float* shadow_map, __global HsFeature* features, __global ushort4* rects,
                             __global uint* tile_counts, __global HsStatus* status) {
  if (layer_count > 1 && shape.drop_hidden && sublayer_layers[HS_SUBLAYERS] == 1) shape.drop_hidden = 2;
  for (uint i = get_global_id(0); i < status->silhouette_count; i += get_global_size(0)) {
    const uint edge = silhouettes[i];
    const uint2 ends = edges[edge];
    const uint layer = layer_count == 1 ? 0 : layer_at(view, sublayer_layers, middle_z(ends, vertices_ls));
    for (int end = 0; end < 2; ++end)
      build_corner(view, shape, layer, end == 0 ? ends.x : ends.y, edge, edges, edge_face_offsets, edge_faces, triangles,
                   vertex_edge_offsets, vertex_edges, multiplicities, vertices_ls, vertices_px, shadow_map, features, rects,
                   tile_counts, status);

    float3 a = vertices_ls[ends.x].xyz, b = vertices_ls[ends.y].xyz;
    if (!(max(a.z, b.z) > view.znear)) continue;
    if (a.z < view.znear) a = b + (b.z - view.znear) / (b.z - a.z) * (a - b);
    if (b.z < view.znear) b = a + (a.z - view.znear) / (a.z - b.z) * (b - a);
    a.z = max(a.z, view.znear);
    b.z = max(b.z, view.znear);
    float3 from = drawn_px(view, a, vertices_px[ends.x]), to = drawn_px(view, b, vertices_px[ends.y]);
    if (multiplicities[edge] < 0) {
      const float3 swap = from;
      from = to;
      to = swap;
    }
    const float2 along = to.xy - from.xy;
    const float length_px = sqrt(dot(along, along));
    if (!(length_px > 0.0f)) continue;  // seen end-on: the corners at its ends meet
    const float2 outward = (float2)(along.y, -along.x) / length_px;
    int min_covered = HS_OPEN;
    if (shape.drop_hidden) {
      min_covered = HS_HIDDEN;
      for (int k = 1; k < 4; ++k) {
        const float3 at = from + (to - from) * (0.25f * (float)k);
        min_covered = min(min_covered, outward_of(view, shape, shadow_map, at.xy, outward, at.z));
      }
      if (min_covered == HS_HIDDEN) continue;
    }
    const HsFeature quad = {from.x, from.y, from.z, to.x,
                            to.y,   to.z,   0.0f,   min_covered == HS_CLOSED ? HS_FEATURE_OUTER_EDGE : HS_FEATURE_EDGE};
    float2 low, high;
    const float2 from_q = sphere_q(view, shape, from.xy), to_q = sphere_q(view, shape, to.xy);
    const float3 across = (float3)(from_q / from.z - to_q / to.z, 1.0f / from.z - 1.0f / to.z);
    const float length = sqrt(dot(across, across));
    if (sphere_misses_face(shape, from_q, from.z, length) && sphere_misses_face(shape, to_q, to.z, length)) continue;
    bound_quad(shape, from, to, from_q, to_q, outward, view.d_far, &low, &high);
    emit(shape, layer, quad, rect_of_feature(view, shape, low, high), features, rects, tile_counts, status);
  }
}
