#include "light/region.hpp"

#include <algorithm>
#include <cmath>

namespace halfshade {
namespace {

using Polygon = std::vector<glm::dvec3>;

/// Sutherland & Hodgman. Where the border was cut goes to `cuts`, if given, too.
Polygon clipped(const Polygon& polygon, const HalfSpace& half_space, Polygon* cuts) {
  Polygon kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const glm::dvec3 &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    const double dp = half_space.depth_of(p), dq = half_space.depth_of(q);
    if (dp >= 0.0) kept.push_back(p);
    if ((dp >= 0.0) == (dq >= 0.0)) continue;
    kept.push_back(p + (q - p) * (dp / (dp - dq)));
    if (cuts) cuts->push_back(kept.back());
  }
  return kept;
}

/// The face that a cut leaves: its corners in order about their middle.
Polygon cap_of(Polygon cuts, const glm::dvec3& normal) {
  glm::dvec3 middle(0.0);
  for (const glm::dvec3& p : cuts) middle += p / static_cast<double>(cuts.size());
  const glm::dvec3 size = glm::abs(normal);
  const glm::dvec3 other = size.x <= size.y && size.x <= size.z ? glm::dvec3(1, 0, 0)
                           : size.y <= size.z                   ? glm::dvec3(0, 1, 0)
                                                                : glm::dvec3(0, 0, 1);
  const glm::dvec3 x = glm::cross(normal, other), y = glm::cross(normal, x);
  const double x2 = glm::dot(x, x), y2 = glm::dot(y, y);
  const auto angle = [&](const glm::dvec3& p) {
    return std::atan2(glm::dot(p - middle, y) / std::sqrt(y2), glm::dot(p - middle, x) / std::sqrt(x2));
  };
  std::ranges::sort(cuts, {}, angle);
  return cuts;
}

bool holds_all(const HalfSpace& half_space, std::span<const glm::dvec3> points) {
  return std::ranges::all_of(points, [&](const glm::dvec3& p) { return half_space.depth_of(p) >= 0.0; });
}

}  // namespace

std::vector<glm::dvec3> box_within(const std::array<glm::dvec3, 8>& box, std::span<const HalfSpace> region) {
  std::vector<Polygon> faces;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3;
    for (const int side : {0, 1 << axis}) faces.push_back({box[side], box[side | u], box[side | u | v], box[side | v]});
  }
  for (const HalfSpace& half_space : region) {
    if (holds_all(half_space, box)) continue;
    Polygon cuts;
    std::vector<Polygon> kept;
    for (const Polygon& face : faces)
      if (Polygon part = clipped(face, half_space, &cuts); !part.empty()) kept.push_back(std::move(part));
    if (cuts.size() >= 3) kept.push_back(cap_of(std::move(cuts), half_space.normal));
    faces = std::move(kept);
  }
  std::vector<glm::dvec3> corners;
  for (const Polygon& face : faces) corners.insert(corners.end(), face.begin(), face.end());
  return corners;
}

std::vector<glm::dvec3> triangle_within(const std::array<glm::dvec3, 3>& triangle, std::span<const HalfSpace> region) {
  Polygon polygon(triangle.begin(), triangle.end());
  for (const HalfSpace& half_space : region) polygon = clipped(polygon, half_space, nullptr);
  return polygon;
}

}  // namespace halfshade
