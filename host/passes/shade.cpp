#include "passes/shade.hpp"

#include "passes/receiver_view.hpp"

namespace halfshade {

void shade(Launcher& launcher, const Scene& scene, const ResidentScene& resident, const GBufferPlanes& gbuffer,
           const ShadeInputs& inputs, const Buffer<cl_float4>& rgb) {
  std::vector<HsShadeLight> lights;
  for (const Light& light : scene.lights) lights.push_back(shade_light(scene.camera, light));
  if (inputs.tints)
    for (std::size_t i = 0; i < lights.size(); ++i) lights[i].tint_plane = inputs.tint_planes[i];
  launcher.launch_pixels(gbuffer.resolution,
                         kernels::Shade{.light_count = static_cast<cl_uint>(lights.size()),
                                        .lights = upload<HsShadeLight>(launcher.device(), lights, "lights"),
                                        .ambient = cl_float4{{scene.ambient.x, scene.ambient.y, scene.ambient.z, 0.0f}},
                                        .camera = shade_view(scene.camera, gbuffer.resolution, gbuffer.has_depth),
                                        .gbuffer = gbuffer.arguments(),
                                        .surface = {.base_color = inputs.base_color,
                                                    .faces = inputs.face,
                                                    .face_meshes = resident.face_meshes,
                                                    .materials = inputs.materials},
                                        .visibility = inputs.visibility,
                                        .tints = inputs.tints,
                                        .rgb = rgb});
}

}  // namespace halfshade
