#include "report/embree_tree.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/placement.hpp"

namespace halfshade {

PlacedMeshes place_meshes(const Scene& scene, bool casters_only) {
  PlacedMeshes placed;
  glm::dvec3 low(std::numeric_limits<double>::infinity()), high(-low);
  for (const SceneMesh& mesh : scene.meshes) {
    if (casters_only && !mesh.casts_shadow) continue;
    const glm::dmat4 to_world = world_from_local(mesh);
    std::vector<glm::dvec3>& positions = placed.meshes.emplace_back(PlacedPositions{mesh.mesh, mesh.casts_shadow, {}}).positions;
    positions.reserve(mesh.mesh->positions.size());
    for (const glm::vec3& p : mesh.mesh->positions) {
      positions.emplace_back(to_world * glm::dvec4(p, 1.0));
      low = glm::min(low, positions.back());
      high = glm::max(high, positions.back());
    }
  }
  if (!(low.x <= high.x)) {  // nothing at all
    placed.origin_ws = scene.camera.target;
    return placed;
  }
  placed.origin_ws = low + (high - low) / 2.0;
  const glm::dvec3 half = high - placed.origin_ws;
  const double extent = std::max({half.x, half.y, half.z});
  if (extent > 0.0) placed.unit = std::exp2(std::ceil(std::log2(extent)));
  for (PlacedPositions& mesh : placed.meshes)
    for (glm::dvec3& p : mesh.positions) p = (p - placed.origin_ws) / placed.unit;
  return placed;
}

EmbreeTree::EmbreeTree(unsigned threads) : device_(rtcNewDevice(fmt::format("threads={}", threads).c_str())) {
  if (!device_) throw DeviceError(fmt::format("Embree: no device (error {})", static_cast<int>(rtcGetDeviceError(nullptr))));
  scene_.reset(rtcNewScene(device_.get()));
  rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
}

void EmbreeTree::commit() {
  rtcCommitScene(scene_.get());
  if (const RTCError error = rtcGetDeviceError(device_.get()); error != RTC_ERROR_NONE)
    throw DeviceError(
        fmt::format("Embree: building the tree failed (error {}); is there enough memory?", static_cast<int>(error)));
}

}  // namespace halfshade
