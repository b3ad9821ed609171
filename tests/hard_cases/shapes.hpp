// Meshes that hard cases are made of.
#pragma once

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "support/scenes.hpp"

namespace halfshade {

/// Corners and triangles, put together piece by piece. Positions are in the world.
struct Shape {
  std::vector<glm::dvec3> corners;
  std::vector<glm::uvec3> triangles;

  unsigned corner(const glm::dvec3& p) {
    corners.push_back(p);
    return static_cast<unsigned>(corners.size() - 1);
  }
  Shape& triangle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    const unsigned first = corner(a);
    corner(b);
    corner(c);
    triangles.emplace_back(first, first + 1, first + 2);
    return *this;
  }
  Shape& quad(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d) {
    return triangle(a, b, c).triangle(a, c, d);
  }
  /// A horizontal rectangle, facing up.
  Shape& sheet(const glm::dvec2& low, const glm::dvec2& high, double y) {
    return quad({low.x, y, low.y}, {low.x, y, high.y}, {high.x, y, high.y}, {high.x, y, low.y});
  }
  /// The same of columns x rows cells.
  Shape& sheet_of_cells(const glm::dvec2& low, const glm::dvec2& high, double y, int columns, int rows) {
    const glm::dvec2 step = (high - low) / glm::dvec2(columns, rows);
    for (int i = 0; i < columns; ++i)
      for (int j = 0; j < rows; ++j) sheet(low + step * glm::dvec2(i, j), low + step * glm::dvec2(i + 1, j + 1), y);
    return *this;
  }
  /// A closed box, facing outwards.
  Shape& box(const glm::dvec3& low, const glm::dvec3& high) {
    const auto at = [&](int i) { return glm::dvec3(i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z); };
    for (const glm::ivec4& f : {glm::ivec4(0, 2, 3, 1), glm::ivec4(4, 5, 7, 6), glm::ivec4(0, 1, 5, 4), glm::ivec4(2, 6, 7, 3),
                                glm::ivec4(0, 4, 6, 2), glm::ivec4(1, 3, 7, 5)})
      quad(at(f.x), at(f.y), at(f.z), at(f.w));
    return *this;
  }
  /// A sphere of `rings` rings of twice as many quads.
  Shape& sphere(const glm::dvec3& centre, double radius, int rings) {
    const auto at = [&](int ring, int i) {
      const double down = std::numbers::pi * ring / rings, around = std::numbers::pi * i / rings;
      return centre + radius * glm::dvec3(std::sin(down) * std::cos(around), std::cos(down), std::sin(down) * std::sin(around));
    };
    for (int ring = 0; ring < rings; ++ring)
      for (int i = 0; i < 2 * rings; ++i) {
        if (ring > 0) triangle(at(ring, i), at(ring, (i + 1) % (2 * rings)), at(ring + 1, i));
        if (ring + 1 < rings) triangle(at(ring, (i + 1) % (2 * rings)), at(ring + 1, (i + 1) % (2 * rings)), at(ring + 1, i));
      }
    return *this;
  }
  /// A tube about a vertical axis, open at both ends.
  Shape& tube(const glm::dvec3& foot, double radius, double height, int sides) {
    const auto at = [&](int i, double y) {
      const double around = 2 * std::numbers::pi * (i % sides) / sides;
      return foot + glm::dvec3(radius * std::cos(around), y, radius * std::sin(around));
    };
    for (int i = 0; i < sides; ++i) quad(at(i, 0), at(i, height), at(i + 1, height), at(i + 1, 0));
    return *this;
  }
  /// A thin quad from a to b, `width` across in direction `across`.
  Shape& wire(const glm::dvec3& a, const glm::dvec3& b, double width, const glm::dvec3& across = {1, 0, 0}) {
    const glm::dvec3 half = 0.5 * width * across;
    return quad(a - half, b - half, b + half, a + half);
  }
  Shape& also(const Shape& other) {
    for (const glm::uvec3& t : other.triangles) triangle(other.corners[t.x], other.corners[t.y], other.corners[t.z]);
    return *this;
  }
  Shape& reverse() {
    for (glm::uvec3& t : triangles) std::swap(t.y, t.z);
    return *this;
  }
  /// Rotated about the origin, then moved.
  Shape& move(const glm::dvec3& rotation_deg, const glm::dvec3& translation = glm::dvec3(0.0)) {
    const glm::dmat4 m = matrix_of({.translation = translation, .rotation_deg = rotation_deg});
    for (glm::dvec3& p : corners) p = glm::dvec3(m * glm::dvec4(p, 1.0));
    return *this;
  }
  SceneMesh mesh(const std::string& name) const {
    return placed(name, std::make_shared<Mesh>(make_mesh(name, corners, triangles)), glm::dvec3(0.0), glm::dvec3(1.0));
  }
};

inline Shape box_of(const glm::dvec3& centre, const glm::dvec3& size, const glm::dvec3& rotation_deg = glm::dvec3(0.0)) {
  return Shape().box(-0.5 * size, 0.5 * size).move(rotation_deg, centre);
}

inline Shape sheet_of(const glm::dvec2& low, const glm::dvec2& high, double y) {
  return Shape().sheet(low, high, y);
}

}  // namespace halfshade
