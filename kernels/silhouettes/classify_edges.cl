// Parallel edge classification by multiplicity, compacted on the device.

#include "base/faces.h"

// sides: uchar a triangle, one bit for the side of its plane that the light is on: 1 where n . (light - a) >= 0 for n formed in
// light space, whose axes are left-handed (for an outward face of a solid, 1 is turned away). Decided here, once, and read by
// every edge: whatever rounding does to a face seen edge-on, silhouettes form closed loops. A second bit, HS_SIDE_AWAY, is for
// the side of the surface: whether the face is turned away from the light, where its mesh's winding tells inside from outside.
__kernel void orient_faces(__global const HsBlock* blocks, __global const uint* triangles, __global const float4* vertices_ls,
                           __global uchar* sides) {
  const HsBlock block = blocks[get_group_id(0)];
  if (get_local_id(0) < block.count) {
    const uint triangle = block.first + get_local_id(0);
    const uint3 corner = vload3(triangle, triangles);
    float3 anchor;
    const float3 n = face_normal(vertices_ls[corner.x].xyz, vertices_ls[corner.y].xyz, vertices_ls[corner.z].xyz, &anchor);
    const bool side = dot(n, anchor) <= 0.0f;
    const bool away = block.cull != HS_CULL_NONE && side == (block.cull == HS_CULL_POSITIVE);
    sides[triangle] = (side ? HS_SIDE : 0) | (away ? HS_SIDE_AWAY : 0);
  }
}

// multiplicities: char an edge, m(e) = sum over its faces of o(e,f) side(f), with o = +1 for a face that runs along the edge in
// its stored direction and side = +1 or -1 for the side of its plane that the light is on. The edge is a silhouette iff m is not
// 0; its sign says on which side the surface lies. Holds for open, non-manifold and inconsistently wound meshes alike.
// silhouettes: indices of the edges with m != 0, in no particular order.
__kernel void classify_edges(__global const HsBlock* blocks, __global const uint* edge_face_offsets,
                             __global const uint* edge_faces, __global const uchar* sides, __global char* multiplicities,
                             __global uint* silhouettes, __global HsStatus* status) {
  const HsBlock block = blocks[get_group_id(0)];
  if (get_local_id(0) < block.count) {
    const uint edge = block.first + get_local_id(0);
    int m = 0;
    for (uint i = edge_face_offsets[edge]; i < edge_face_offsets[edge + 1]; ++i) {
      const uint face = edge_faces[i];
      const bool along = (face & 1) == 0, towards = (sides[face >> 1] & HS_SIDE) != 0;
      m += along == towards ? 1 : -1;
    }
    multiplicities[edge] = (char)clamp(m, -127, 127);
    if (m != 0) silhouettes[atomic_inc(&status->silhouette_count)] = edge;
  }
}
