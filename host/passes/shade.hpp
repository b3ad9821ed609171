// Deferred shading.
#pragma once

#include "passes/gbuffer.hpp"
#include "passes/resident_scene.hpp"

namespace halfshade {

/// What shading reads beside G-buffer and lights.
struct ShadeInputs {
  Buffer<cl_float> visibility;      ///< a plane a light, in the scene's order
  Buffer<cl_float4> tints;          ///< of textured lights; or none
  std::vector<cl_int> tint_planes;  ///< a light's plane of tints, -1 for none
  Buffer<cl_float4> base_color;     ///< a pixel; or none: by the mesh of `face`
  Buffer<cl_uint> face;             ///< a pixel
  Buffer<cl_float4> materials;      ///< a mesh's base colour
};

/// Enqueues the shaded picture into `rgb`, float4 a pixel.
void shade(Launcher& launcher, const Scene& scene, const ResidentScene& resident, const GBufferPlanes& gbuffer,
           const ShadeInputs& inputs, const Buffer<cl_float4>& rgb);

}  // namespace halfshade
