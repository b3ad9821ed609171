#include "report/receivers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "light/view.hpp"

namespace halfshade {
namespace {

/// A point on its surface, and how far rays of it begin above that.
struct Lifted {
  glm::dvec3 surface_ws;
  double lift;
};

/// Lists the counted pixels. `place(pixel)` is where they are.
RayReceivers list_receivers(glm::uvec2 resolution, std::vector<PixelKind> kinds, std::span<const glm::vec4> normal_ws,
                            const std::function<Lifted(std::size_t pixel)>& place) {
  if (kinds.size() != std::size_t{resolution.x} * resolution.y)
    throw InputError(fmt::format("receivers: {} points, expected {}x{}", kinds.size(), resolution.x, resolution.y));
  RayReceivers receivers{resolution, std::move(kinds), {}, {}, {}, {}};
  constexpr unsigned tile = 8;
  for (unsigned tile_y = 0; tile_y < resolution.y; tile_y += tile)
    for (unsigned tile_x = 0; tile_x < resolution.x; tile_x += tile)
      for (unsigned y = tile_y; y < std::min(tile_y + tile, resolution.y); ++y)
        for (unsigned x = tile_x; x < std::min(tile_x + tile, resolution.x); ++x) {
          const std::size_t i = std::size_t{y} * resolution.x + x;
          if (receivers.kinds[i] != PixelKind::counted) continue;
          receivers.pixels.push_back(static_cast<std::uint32_t>(i));
          const Lifted at = place(i);
          receivers.normals_ws.emplace_back(normal_ws[i]);
          receivers.points_ws.push_back(at.surface_ws + at.lift * glm::dvec3(normal_ws[i]));
          receivers.lifts.push_back(at.lift);
        }
  return receivers;
}

}  // namespace

RayReceivers receivers_of(const PreciseScene& scene, const Camera& camera, std::span<const float> depth,
                          std::span<const glm::vec4> normal_ws, const Light& light) {
  const Frustum frustum = camera_frustum(camera);
  const glm::dmat3 world_from_view = glm::transpose(glm::dmat3(frustum.view_from_world));
  const double q_per_px = 2.0 * frustum.tan_half_y / camera.resolution.y;
  std::vector<glm::dvec3> positions(depth.size());
  std::vector<glm::vec4> normals(normal_ws.begin(), normal_ws.end());
  for (std::size_t i = 0; i < depth.size(); ++i) {
    const double z = depth[i];
    if (!(z > 0.0)) {
      normals[i].w = 0.0f;
      continue;
    }
    const double qx = (static_cast<double>(i % camera.resolution.x) + 0.5) * q_per_px - frustum.tan_half_x;
    const double qy = frustum.tan_half_y - (static_cast<double>(i / camera.resolution.x) + 0.5) * q_per_px;
    positions[i] = camera.position + world_from_view * (z * glm::dvec3(qx, qy, 1.0));
  }
  // Corners are rounded to single precision relative to the camera, and what lies between them with them.
  const double reach = 0x1p-21 * (glm::length(camera.position - scene.origin_ws()) + 2.0 * scene.unit());
  return list_receivers(camera.resolution, pixel_kinds(positions, normals, light), normals, [&](std::size_t i) {
    // kernels/methods/exact/edge_lists.h lifts as far: where they differ, so do the samples that are seen from near contacts.
    const double lift = depth[i] * (q_per_px / 128.0 + 0x1p-21);
    const glm::dvec3 normal(normals[i]);
    const double height = reach < lift / 4.0 ? 0.0 : scene.height_over_surface(positions[i], normal, reach + lift);
    return Lifted{positions[i] - height * normal, lift};
  });
}

RayReceivers receivers_of(const PreciseScene& scene, glm::uvec2 resolution, std::span<const glm::dvec3> position_ws,
                          std::span<const glm::vec4> normal_ws, const Light& light) {
  return list_receivers(resolution, pixel_kinds(position_ws, normal_ws, light), normal_ws, [&](std::size_t i) {
    const double lift = 0x1p-40 * scene.unit() + 0x1p-48 * glm::length(position_ws[i]);
    return Lifted{position_ws[i], lift};
  });
}

}  // namespace halfshade
