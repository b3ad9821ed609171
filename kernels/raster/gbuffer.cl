// The G-buffer: depth, normal and face of what the camera sees.

#include "base/faces.h"
#include "raster/triangles.h"

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

// depth, normal, face: the planes of GBuffer (halfshade.hpp); 0, 0 and 0xffffffff where nothing is seen. unit: of the view, in
// that of the depth.
__kernel __attribute__((reqd_work_group_size(HS_TILE_ITEMS, 1, 1))) void raster_gbuffer(
    const HsView view, HS_ARGS_TRIANGLE_TILES, HS_ARGS_TRIANGLES, __global const float4* face_normals, const float unit,
    __global float* depth, __global float4* normal, __global uint* face) {
  const int2 tile_px = tile_origin_px(view);
  float nearest_d[HS_TILE_STORAGE];
  int nearest_face[HS_TILE_STORAGE];
  for (int i = 0; i < HS_TILE_STORAGE; ++i) nearest_d[i] = view.d_far;
  for (int i = 0; i < HS_TILE_STORAGE; ++i) nearest_face[i] = -1;

  HS_FOR_TILE_TRIANGLES(triangle) {
    const uint3 corner = vload3(triangle, triangles);
    TileTriangle t;
    HS_FOR_PIECES(view, corner, vertices_vs, vertices_px, tile_px, t) {
      HS_FOR_COLUMNS(x, t.x0, t.x1) {
        const Columns columns = columns_of(&t, x);
        HS_FOR_ROWS(y, t.y0, t.y1) {
          vfloat d;
          const vint covered = cover(&t, &columns, y, &d);
          float* d_slot = nearest_d + HS_SLOT(x, y);
          int* face_slot = nearest_face + HS_SLOT(x, y);
          const vfloat old_d = v_load(d_slot);
          const vint old_face = v_load(face_slot);
          const vint wins = covered & ((d > old_d) | ((d == old_d) & ((vint)((int)triangle) < old_face)));
          v_store(v_select(old_d, d, wins), d_slot);
          v_store(v_select(old_face, (vint)((int)triangle), wins), face_slot);
        }
      }
    }
  }

  const int x_end = min(HS_TILE, (int)view.width_px - tile_px.x), y_end = min(HS_TILE, (int)view.height_px - tile_px.y);
  HS_FOR_TEXELS(x, y, 0, 0, x_end - 1, y_end - 1) {
    const size_t first = (size_t)(tile_px.y + y) * view.width_px + tile_px.x + x;
    const int valid = min(HS_LANES, x_end - x);
    const vint seen = v_load(nearest_face + HS_SLOT(x, y));
    stream_lanes(v_select((vfloat)(0.0f), unit / v_load(nearest_d + HS_SLOT(x, y)), seen >= 0), depth, first, valid);
    int last = v_first(seen);
    float4 n = last < 0 ? (float4)(0.0f) : face_normals[last];
    if (valid == HS_LANES && v_all(seen == last)) {
      for (int i = 0; i < HS_LANES; ++i) stream_float4(n, normal + first + i);
      stream_lanes(v_as_float(seen), (__global float*)face, first, valid);
    } else {
      for (int i = 0; i < valid; ++i) {
        const int here = nearest_face[HS_SLOT(x, y) + i];
        if (here != last) n = here < 0 ? (float4)(0.0f) : face_normals[here];  // neighbours mostly share a face
        last = here;
        stream_float4(n, normal + first + i);
        face[first + i] = (uint)here;
      }
    }
  }
}
