#include "passes/placed_scene.hpp"

#include "light/light_model.hpp"
#include "scene/placement.hpp"

namespace halfshade {

PlacedScene PlacedScene::of(const DeviceImpl& device, const Scene& scene, const ResidentScene* before) {
  PlacedScene placed;
  placed.scene = scene;
  placed.resident = before && before->holds(scene) ? *before : ResidentScene::upload(device, scene);
  std::vector<cl_float4> materials;
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
    const SceneMesh& mesh = scene.meshes[i];
    placed.placed.push_back({mesh.mesh.get(), world_from_local(mesh), placed.resident.bounds[i], placed.resident.orientations[i],
                             mesh.casts_shadow, mesh.receives_shadow});
    materials.push_back({{mesh.base_color.x, mesh.base_color.y, mesh.base_color.z, mesh.receives_shadow ? 1.0f : 0.0f}});
  }
  placed.materials = upload<cl_float4>(device, materials, "materials");
  const Frustum frustum = camera_frustum(scene.camera);
  placed.camera = draw_list(device, placed.resident, placed.placed, camera_view(scene.camera, device.tile_px),
                            camera_view_from_world(scene.camera),
                            meshes_in_view(frustum, placed.placed, scene.camera.znear, scene.camera.zfar));
  for (std::size_t light = 0; light < scene.lights.size(); ++light) {
    for (const Light& face : faces_of(scene.lights[light])) placed.faces.push_back({light, face, {}});
    placed.tint_planes.push_back(scene.lights[light].texture ? static_cast<cl_int>(placed.tint_plane_count++) : -1);
  }
  placed.counters.reserve(device, std::max<std::size_t>(1, placed.faces.size()), "counters");
  return placed;
}

}  // namespace halfshade
