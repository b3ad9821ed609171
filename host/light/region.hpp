// Convex regions of space, and what lies in them.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace halfshade {

/// The points p with normal . p + offset >= 0.
struct HalfSpace {
  glm::dvec3 normal;
  double offset;

  double depth_of(const glm::dvec3& p) const { return glm::dot(normal, p) + offset; }
};

/// The corners of what of a parallelepiped lies in all half-spaces, each maybe several times; none where nothing does. `box` in
/// the order of corner_of; a flat one will do.
std::vector<glm::dvec3> box_within(const std::array<glm::dvec3, 8>& box, std::span<const HalfSpace> region);

/// The same of a triangle, once each.
std::vector<glm::dvec3> triangle_within(const std::array<glm::dvec3, 3>& triangle, std::span<const HalfSpace> region);

}  // namespace halfshade
