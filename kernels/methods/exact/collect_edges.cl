// Edges that are a silhouette for some point of the light's disc, for methods/exact (docs/design.md, "Exact soft shadows").

#include "base/faces.h"
#include "methods/exact/edge_block.h"
#include "methods/exact/touching_faces.h"

// The nearest that a segment comes to the light's centre, squared.
HS_INLINE float segment_distance2(float3 a, float3 b) {
  const float3 e = b - a;
  const float t = clamp(-dot(a, e) / max(dot(e, e), FLT_MIN), 0.0f, 1.0f);
  const float3 nearest = a + e * t;
  return dot(nearest, nearest);
}

// Whether a face touches a flat light of a radius: what lies before the light's plane, z > 0, begins at a cut within the disc.
HS_INLINE bool touches_disc(const float3* corners, float radius2) {
  float3 cuts[2];
  int count = 0;
  for (int i = 0; i < 3; ++i) {
    const float3 a = corners[i], b = corners[i < 2 ? i + 1 : 0];
    if ((a.z > 0.0f) == (b.z > 0.0f) || count == 2) continue;
    cuts[count++] = (float3)(a.xy + (b.xy - a.xy) * (a.z / (a.z - b.z)), 0.0f);
  }
  return count == 2 && segment_distance2(cuts[0], cuts[1]) <= radius2;
}

// Whether a face touches a sphere light: comes as near to its centre as its radius. n: the face's unit normal, w = n . p on it.
HS_INLINE bool touches_ball(const float3* corners, float3 n, float w, float radius2) {
  if (w * w > radius2) return false;
  float nearest2 = INFINITY;
  int inside = 0;
  for (int i = 0; i < 3; ++i) {
    const float3 a = corners[i], b = corners[i < 2 ? i + 1 : 0];
    nearest2 = min(nearest2, segment_distance2(a, b));
    inside += dot(cross(b - a, n * w - a), n) > 0.0f ? 1 : -1;
  }
  return nearest2 <= radius2 || inside == 3 || inside == -3;
}

// planes: float4 a triangle: n and n . a in light space, unit where it has an area.
// disc_sides: uchar a triangle: on which side of it (1: n . p >= n . a) a receiver lies if the segment from it to a point of the
// light crosses the face's plane; 2 where that depends on the point: the plane cuts the disc, |n . a| <= R |(n.x, n.y)|, or the
// ball; HS_TOUCHES where the face itself does.
// touching: how many do, then which. Its first element must be 0. radius: on the light's plane, of all receivers' discs.
__kernel void orient_faces_to_disc(__global const HsBlock* blocks, __global const uint* triangles,
                                   __global const float4* vertices_ls, const HsDisc disc, const float radius,
                                   __global float4* planes, __global uchar* disc_sides, __global uint* touching) {
  const HsBlock block = blocks[get_group_id(0)];
  if (get_local_id(0) < block.count) {
    const uint triangle = block.first + get_local_id(0);
    const uint3 corner = vload3(triangle, triangles);
    const float3 corners[3] = {vertices_ls[corner.x].xyz, vertices_ls[corner.y].xyz, vertices_ls[corner.z].xyz};
    float3 anchor;
    const float3 n = unit_normal(face_normal(corners[0], corners[1], corners[2], &anchor));
    const float w = dot(n, anchor);
    // Rounding: of the normal and the product. Undecided is always right, only slower.
    const float slack = 4e-6f * (fabs(anchor.x) + fabs(anchor.y) + fabs(anchor.z) + radius);
    const float reach = (disc.sphere ? disc.radius : radius * sqrt(n.x * n.x + n.y * n.y)) + slack;
    uchar side = fabs(w) > reach ? (w > 0.0f ? 1 : 0) : 2;  // the disc is on the other side, that of the origin
    if (side == 2) {
      const float near = disc.radius * 1.001f + slack;
      if (disc.sphere ? touches_ball(corners, n, w, near * near) : touches_disc(corners, near * near)) {
        side = HS_TOUCHES;
        touching[1 + atomic_inc(&touching[0])] = triangle;
      }
    }
    planes[triangle] = (float4)(n, w);
    disc_sides[triangle] = side;
  }
}

// The part of an edge before the light's plane; false if there is none. The cut is the same whichever face asks. What comes near
// a sphere light is left as it is: each receiver cuts it where its own disc lies.
HS_INLINE bool clip_to_light_plane(const HsDisc disc, float3* a, float3* b) {
  const float near = 2.0f * disc.radius;
  if (disc.sphere && max(a->z, b->z) > -near && segment_distance2(*a, *b) < near * near) return true;
  if (!(max(a->z, b->z) > 0.0f)) return false;
  const float3 from = *a, to = *b;
  const float t = from.z / (from.z - to.z);
  const float3 cut = (float3)(from.xy + (to.xy - from.xy) * t, 0.0f);
  if (from.z < 0.0f) *a = cut;
  if (to.z < 0.0f) *b = cut;
  return true;
}

// edges: the potential silhouettes: those with m_p(e) != 0 for some receiver that sees them before the disc. Faces that touch the
// light are left out: see touching_faces.h. Decided ones are summed in `m`; an edge with more than two undecided ones
// (non-manifold) has several records, whose sums add up. A work-group appends all of its records at once: devices' cores would
// wait for each other at every one.
__kernel void collect_edges(__global const HsBlock* blocks, __global const uint2* edge_ends,
                            __global const uint* edge_face_offsets, __global const uint* edge_faces, const HsDisc disc,
                            __global const uchar* disc_sides, __global const float4* planes, __global const float4* vertices_ls,
                            __global EdgeBlock* edges, __global HsStatus* status) {
  __local uint group_edges, group_records, group_first;
  if (get_local_id(0) == 0) group_edges = group_records = 0;
  barrier(CLK_LOCAL_MEM_FENCE);
  const HsBlock block = blocks[get_group_id(0)];
  const uint edge = block.first + get_local_id(0);
  int m = 0, undecided = 0;
  uint records = 0, first = 0;
  float3 a = (float3)(0.0f), b = (float3)(0.0f);
  if (get_local_id(0) < block.count) {
    for (uint i = edge_face_offsets[edge]; i < edge_face_offsets[edge + 1]; ++i) {
      const uint face = edge_faces[i];
      const uint side = disc_sides[face >> 1];
      const int o = (face & 1) ? -1 : 1;
      if (side == 2)
        ++undecided;
      else if (side != HS_TOUCHES)
        m += side ? o : -o;
    }
    const uint2 ends = edge_ends[edge];
    a = vertices_ls[ends.x].xyz;
    b = vertices_ls[ends.y].xyz;
    if ((m != 0 || undecided > 0) && clip_to_light_plane(disc, &a, &b)) {
      records = max((undecided + 1) / 2, 1);
      first = atomic_add(&group_records, records);
      atomic_inc(&group_edges);
    }
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  if (get_local_id(0) == 0 && group_records > 0) {
    group_first = atomic_add(&status->feature_count, group_records);
    atomic_add(&status->silhouette_count, group_edges);
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  if (records > 0) {
    first += group_first;
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
        store_edge(edges, first++, a, b, m, pending, pending_plane, o, planes[face >> 1]);
        m = 0;
        pending = 0;
      }
    }
    if (m != 0 || pending != 0) store_edge(edges, first, a, b, m, pending, pending_plane, 0, (float4)(0.0f));
  }
}
