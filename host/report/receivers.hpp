// The pixels that a report is about, as the points where shadow rays begin.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "halfshade/halfshade.hpp"
#include "report/error_figures.hpp"
#include "report/precise_scene.hpp"

namespace halfshade {

/// The counted pixels of a G-buffer for one light, as origins of rays.
struct RayReceivers {
  glm::uvec2 resolution{0, 0};
  std::vector<PixelKind> kinds;       ///< of each pixel
  std::vector<std::uint32_t> pixels;  ///< the counted ones, tile by tile of 8×8, so that neighbours are traced together
  std::vector<glm::dvec3> points_ws;  ///< of `pixels`, lifted off their own surface
  std::vector<double> lifts;          ///< of `pixels`: how far that is
  std::vector<glm::vec3> normals_ws;  ///< of `pixels`, on the side that is seen
};

/// Receivers of a G-buffer as the renderer makes it: `depth` is view-space z, normals have w = 0 where no shadow is received.
/// They are lifted along their normals by what the rasterizer may be off their surface: it snaps vertices to 1/256 of a pixel and
/// keeps depth in single precision. Where the scene is so large that the rounding of its corners adds to that, the surface itself
/// is looked for, and they are lifted off that.
RayReceivers receivers_of(const PreciseScene& scene, const Camera& camera, std::span<const float> depth,
                          std::span<const glm::vec4> normal_ws, const Light& light);

/// Receivers at given points, which are on their surface but for rounding.
RayReceivers receivers_of(const PreciseScene& scene, glm::uvec2 resolution, std::span<const glm::dvec3> position_ws,
                          std::span<const glm::vec4> normal_ws, const Light& light);

}  // namespace halfshade
