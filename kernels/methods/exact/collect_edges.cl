// Edges that are a silhouette for some point of the light's disc, for methods/exact (docs/design.md, "Exact soft shadows").

#include "base/faces.h"
#include "methods/exact/edge_block.h"

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
    const float3 n =
        unit_normal(face_normal(vertices_ls[corner.x].xyz, vertices_ls[corner.y].xyz, vertices_ls[corner.z].xyz, &anchor));
    const float w = dot(n, anchor);
    // Rounding: of the normal and the product. Undecided is always right, only slower.
    const float slack = 4e-6f * (fabs(anchor.x) + fabs(anchor.y) + fabs(anchor.z) + radius);
    const bool decided = fabs(w) > radius * sqrt(n.x * n.x + n.y * n.y) + slack;
    planes[triangle] = (float4)(n, w);
    disc_sides[triangle] = decided ? (w > 0.0f ? 1 : 0) : 2;  // the disc is on the other side, that of the origin
  }
}

// The part of an edge before the light's plane; false if there is none. The cut is the same whichever face asks.
HS_INLINE bool clip_to_light_plane(float3* a, float3* b) {
  if (!(max(a->z, b->z) > 0.0f)) return false;
  const float3 from = *a, to = *b;
  const float t = from.z / (from.z - to.z);
  const float3 cut = (float3)(from.xy + (to.xy - from.xy) * t, 0.0f);
  if (from.z < 0.0f) *a = cut;
  if (to.z < 0.0f) *b = cut;
  return true;
}

// edges: the potential silhouettes: those with m_p(e) != 0 for some receiver that sees them before the disc. Decided faces are
// summed in `m`; an edge with more than two undecided ones (non-manifold) has several records, whose sums add up. A work-group
// appends all of its records at once: devices' cores would wait for each other at every one.
__kernel void collect_edges(__global const HsBlock* blocks, __global const uint2* edge_ends,
                            __global const uint* edge_face_offsets, __global const uint* edge_faces,
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
      else
        m += side ? o : -o;
    }
    const uint2 ends = edge_ends[edge];
    a = vertices_ls[ends.x].xyz;
    b = vertices_ls[ends.y].xyz;
    if ((m != 0 || undecided > 0) && clip_to_light_plane(&a, &b)) {
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

// Where a face passes through the light's own plane, what lies before it ends at a cut: an edge of its own.
__kernel void collect_cuts(__global const HsBlock* blocks, __global const uint* triangles, __global const uchar* disc_sides,
                           __global const float4* planes, __global const float4* vertices_ls, const float radius,
                           __global EdgeBlock* edges, __global HsStatus* status) {
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
      const float t = clamp(-dot(leaving.xy, along) / max(dot(along, along), 1e-30f), 0.0f, 1.0f);
      const float2 nearest = leaving.xy + along * t;
      const uint side = disc_sides[triangle];
      if (dot(nearest, nearest) <= radius * radius * 1.01f)
        store_edge(edges, atomic_inc(&status->feature_count), leaving, entering,
                   side == 2 ? 0
                   : side    ? 1
                             : -1,
                   side == 2 ? 1 : 0, planes[triangle], 0, (float4)(0.0f));
    }
  }
}
