// The G-buffer that the renderer makes of its own camera, and G-buffers as passes read them.
#pragma once

#include "passes/triangles.hpp"

namespace halfshade {

/// The planes of a G-buffer that passes read, ours or a caller's.
struct GBufferPlanes {
  glm::uvec2 resolution{0, 0};
  bool has_depth = true;               ///< else positions
  Buffer<cl_float> depth_or_position;  ///< float a pixel, or float4
  Buffer<cl_float4> normal;

  static GBufferPlanes of(const GBuffer& gbuffer) {
    const bool has_depth = gbuffer.depth != nullptr;
    return {gbuffer.resolution, has_depth, Buffer<cl_float>::of(has_depth ? gbuffer.depth : gbuffer.position),
            Buffer<cl_float4>::of(gbuffer.normal)};
  }

  std::size_t pixel_count() const { return std::size_t{resolution.x} * resolution.y; }
  kernels::args::Gbuffer arguments() const { return {.depth_or_position = depth_or_position, .normal = normal}; }
};

/// Owns the G-buffer.
class GBufferPass {
 public:
  explicit GBufferPass(Launcher& launcher) : launcher_(launcher) {}

  /// Draws the camera's view, whose unit is `unit` of the scene's. `materials`: a mesh's base colour, w = 1 where it receives
  /// shadows.
  GBuffer run(TrianglesPass& triangles, const ResidentScene& resident, const DrawList& camera, double unit,
              const Buffer<cl_float4>& materials);

  const Buffer<cl_float>& depth() const { return depth_; }
  const Buffer<cl_float4>& normal() const { return normal_; }

 private:
  Launcher& launcher_;
  Buffer<cl_float> depth_;
  Buffer<cl_float4> normal_;
  Buffer<cl_uint> face_;
  Buffer<cl_float4> face_normals_;  // a triangle of the scene
};

}  // namespace halfshade
