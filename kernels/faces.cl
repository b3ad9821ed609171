// What each face is to a view: which side it turns to a light, and its normal on the side that the camera sees.

// Normal (not unit) of a triangle, from the corners' differences: exact enough far from the origin.
inline float3 face_normal(float3 a, float3 b, float3 c, float3* anchor) {
  const bool odd = sort_corners(&a, &b, &c);
  const float3 n = cross(b - a, c - a);
  *anchor = a;
  return odd ? -n : n;
}

// Of length 1, or 0 for a face without area. Scaled first: the square of a tiny face's normal would underflow.
HS_INLINE float3 unit_normal(float3 n) {
  const float largest = max(fabs(n.x), max(fabs(n.y), fabs(n.z)));
  if (!(largest > 0.0f)) return (float3)(0.0f);
  n /= largest;
  return n * (1.0f / sqrt(dot(n, n)));
}

// sides: uchar a triangle, one bit for the side of its plane that the light is on: 1 where n . (light - a) >= 0 for n formed in
// light space, whose axes are left-handed (for an outward face of a solid, 1 is turned away). Decided here, once, and read by
// every edge: whatever rounding does to a face seen edge-on, silhouettes form closed loops.
__kernel void orient_faces(__global const HsBlock* blocks, __global const uint* triangles, __global const float4* vertices_ls,
                           __global uchar* sides) {
  const HsBlock block = blocks[get_group_id(0)];
  if (get_local_id(0) < block.count) {
    const uint triangle = block.first + get_local_id(0);
    const uint3 corner = vload3(triangle, triangles);
    float3 anchor;
    const float3 n = face_normal(vertices_ls[corner.x].xyz, vertices_ls[corner.y].xyz, vertices_ls[corner.z].xyz, &anchor);
    sides[triangle] = dot(n, anchor) <= 0.0f;
  }
}

// normals: float4 a triangle: unit geometric normal in world space on the side that the camera sees (0 for a face without area);
// w = 1 where the mesh receives shadows. Not written for triangles that touch no tile.
__kernel void face_normals(const HsView view, __global const HsBlock* blocks, __global const ushort4* rects,
                           __global const uint* triangles, __global const float4* vertices_vs, __global const float4* materials,
                           __global float4* normals) {
  const HsBlock block = blocks[get_group_id(0)];
  if (get_local_id(0) < block.count && rects[get_global_id(0)].z != 0) {
    const uint triangle = block.first + get_local_id(0);
    const uint3 corner = vload3(triangle, triangles);
    float3 anchor;
    float3 n = unit_normal(face_normal(vertices_vs[corner.x].xyz, vertices_vs[corner.y].xyz, vertices_vs[corner.z].xyz, &anchor));
    if (dot(n, anchor) > 0.0f) n = -n;
    const float3 n_ws = n.x * view.world_from_view_x.xyz + n.y * view.world_from_view_y.xyz + n.z * view.world_from_view_z.xyz;
    normals[triangle] = (float4)(n_ws, materials[block.mesh].w);
  }
}
