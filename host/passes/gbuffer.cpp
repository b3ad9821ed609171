#include "passes/gbuffer.hpp"

namespace halfshade {

GBuffer GBufferPass::run(TrianglesPass& triangles, const ResidentScene& resident, const DrawList& camera, double unit,
                         const Buffer<cl_float4>& materials) {
  const DeviceImpl& device = launcher_.device();
  const HsView& view = camera.view;
  depth_.reserve(device, pixels_of(view), "G-buffer depth");
  normal_.reserve(device, pixels_of(view), "G-buffer normals");
  face_.reserve(device, pixels_of(view), "G-buffer faces");
  face_normals_.reserve(device, resident.triangle_count, "face normals");

  triangles.run(resident, camera, Coverage::texel_centres);
  launcher_.launch_blocks(camera.triangles, kernels::FaceNormals{.view = view,
                                                                 .blocks = camera.triangles.blocks,
                                                                 .rects = triangles.bins().rects,
                                                                 .triangles = resident.triangle_corners,
                                                                 .vertices_vs = triangles.vertices_vs(),
                                                                 .materials = materials,
                                                                 .normals = face_normals_});
  launcher_.launch_tiles(tiles_of(view), kernels::RasterGbuffer{.view = view,
                                                                .triangle_tiles = triangles.tiles(camera),
                                                                .triangles = triangles.triangles(resident),
                                                                .face_normals = face_normals_,
                                                                .unit = static_cast<cl_float>(unit),
                                                                .depth = depth_,
                                                                .normal = normal_,
                                                                .face = face_});
  return {.resolution = {view.width_px, view.height_px},
          .depth = depth_.memory()(),
          .normal = normal_.memory()(),
          .face = face_.memory()()};
}

}  // namespace halfshade
