// Polygons to triangles.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

namespace halfshade {

/// Cuts polygons into triangles. A polygon of n corners always gives n - 2 triangles that keep its sides and its winding,
/// whatever its shape, so that neighbours stay joined. (tinyobjloader's own triangulation depends on where the origin is.)
class Triangulator {
 public:
  Triangulator();
  ~Triangulator();
  Triangulator(const Triangulator&) = delete;
  Triangulator& operator=(const Triangulator&) = delete;

  /// Appends the triangles of one polygon of at least three corners, in time that is in proportion to their number but for a
  /// logarithm. Returns false, with nothing appended, for a face that would take more than limits::ear_steps a corner.
  bool cut(std::span<const std::uint32_t> corners, std::span<const glm::dvec3> positions, std::vector<glm::uvec3>& triangles);

 private:
  class EarCutter;

  void flatten(std::span<const std::uint32_t> corners, std::span<const glm::dvec3> positions);
  bool is_strictly_convex() const;

  std::vector<glm::dvec2> flat_;
  std::unique_ptr<EarCutter> ears_;
};

}  // namespace halfshade
