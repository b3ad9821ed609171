#include "scene/triangulate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numeric>
#include <random>

namespace {

using halfshade::Triangulator;
using Triangles = std::vector<glm::uvec3>;

double turn(glm::dvec2 a, glm::dvec2 b, glm::dvec2 c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Ear clipping by its definition, in cubic time.
Triangles cut_slowly(const std::vector<glm::dvec2>& flat) {
  std::vector<std::uint32_t> left(flat.size());
  std::iota(left.begin(), left.end(), 0u);
  const auto is_ear = [&](glm::dvec2 a, glm::dvec2 b, glm::dvec2 c) {
    if (!(turn(a, b, c) > 0.0)) return false;
    for (const std::uint32_t i : left) {
      const glm::dvec2 p = flat[i];
      if (p == a || p == b || p == c) continue;
      if (turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0) return false;
    }
    return true;
  };
  Triangles triangles;
  std::size_t at = 0, misses = 0;
  while (left.size() >= 3) {
    const std::size_t count = left.size();
    const std::uint32_t a = left[(at + count - 1) % count], b = left[at], c = left[(at + 1) % count];
    if (count == 3 || misses == count || is_ear(flat[a], flat[b], flat[c])) {
      triangles.emplace_back(a, b, c);
      left.erase(left.begin() + static_cast<std::ptrdiff_t>(at));
      misses = 0;
    } else {
      ++at;
      ++misses;
    }
    if (at >= left.size()) at = 0;
  }
  return triangles;
}

/// Cuts a polygon of the plane z = 0, whose corners are numbered as they come.
bool cut(const std::vector<glm::dvec2>& flat, Triangles& triangles) {
  std::vector<glm::dvec3> positions;
  for (const glm::dvec2 p : flat) positions.emplace_back(p, 0.0);
  std::vector<std::uint32_t> corners(flat.size());
  std::iota(corners.begin(), corners.end(), 0u);
  Triangulator triangulator;
  return triangulator.cut(corners, positions, triangles);
}

double area_of(const std::vector<glm::dvec2>& flat) {
  double sum = 0.0;
  for (std::size_t i = 0; i < flat.size(); ++i) {
    const glm::dvec2 a = flat[i], b = flat[(i + 1) % flat.size()];
    sum += 0.5 * (a.x * b.y - a.y * b.x);
  }
  return sum;
}

/// A ring whose radius changes at random from corner to corner: no two sides cross.
std::vector<glm::dvec2> star(std::size_t count, std::mt19937& random) {
  std::uniform_real_distribution<double> radius(0.1, 1.0);
  std::vector<glm::dvec2> flat;
  for (std::size_t i = 0; i < count; ++i) {
    const double angle = 2.0 * M_PI * static_cast<double>(i) / static_cast<double>(count), r = radius(random);
    flat.emplace_back(r * std::cos(angle), r * std::sin(angle));
  }
  return flat;
}

TEST(Triangulate, CutsTheSameEarsAsTheDefinition) {
  std::mt19937 random(7);
  for (int turn_number = 0; turn_number < 300; ++turn_number) {
    SCOPED_TRACE(turn_number);
    std::vector<glm::dvec2> flat = star(4 + turn_number % 57, random);
    if (turn_number % 3 == 1) {  // corners on a coarse grid: many at one point or on one line, sides that cross
      for (glm::dvec2& p : flat) p = glm::round(p * 4.0);
    } else if (turn_number % 3 == 2) {
      std::shuffle(flat.begin(), flat.end(), random);
    }
    if (!(area_of(flat) > 0.0)) std::reverse(flat.begin(), flat.end());
    bool is_convex = true;
    for (std::size_t i = 0; i < flat.size(); ++i)
      is_convex &= turn(flat[i], flat[(i + 1) % flat.size()], flat[(i + 2) % flat.size()]) > 0.0;
    if (is_convex || area_of(flat) == 0.0) continue;
    const glm::dvec2 first = flat[0];
    for (glm::dvec2& p : flat) p -= first;  // as the triangulator does
    Triangles triangles;
    ASSERT_TRUE(cut(flat, triangles));
    EXPECT_EQ(triangles, cut_slowly(flat));
  }
}

/// Expects triangles that cover the polygon, each the right way round.
void expect_covered(const std::vector<glm::dvec2>& flat) {
  Triangles triangles;
  ASSERT_TRUE(cut(flat, triangles));
  ASSERT_EQ(triangles.size(), flat.size() - 2);
  double sum = 0.0;
  for (const glm::uvec3& t : triangles) {
    const double area = 0.5 * turn(flat[t.x], flat[t.y], flat[t.z]);
    EXPECT_GE(area, 0.0);
    sum += area;
  }
  EXPECT_NEAR(sum, area_of(flat), 1e-9 * std::abs(area_of(flat)));
}

TEST(Triangulate, LargeConcaveFacesAreCut) {
  std::mt19937 random(1);
  expect_covered(star(40'000, random));

  std::vector<glm::dvec2> comb{{0.0, -1.0}};
  constexpr int teeth = 20'000;
  for (int i = 0; i < teeth; ++i) {
    comb.emplace_back(i, 0.0);
    comb.emplace_back(i + 0.5, 10.0 + i % 7);
  }
  comb.emplace_back(teeth, -1.0);
  std::reverse(comb.begin(), comb.end());
  expect_covered(comb);

  // Each corner's triangle holds all that lies further in.
  std::vector<glm::dvec2> spiral;
  constexpr int turns = 10'000;
  for (int i = 0; i < turns; ++i) {
    const double angle = i * 2.0 * M_PI / 3.0;
    spiral.push_back((1.0 + i) * glm::dvec2(std::cos(angle), std::sin(angle)));
  }
  for (int i = turns; i-- > 0;) {
    const double angle = i * 2.0 * M_PI / 3.0;
    spiral.push_back((0.5 + i) * glm::dvec2(std::cos(angle), std::sin(angle)));
  }
  if (area_of(spiral) < 0.0) std::reverse(spiral.begin(), spiral.end());
  expect_covered(spiral);
}

TEST(Triangulate, ManyCornersAtFewPointsAreCut) {
  // Three points again and again, around six that lie within.
  std::vector<glm::dvec2> flat;
  const glm::dvec2 three[] = {{0, 1}, {-0.87, -0.5}, {0.87, -0.5}};
  for (int i = 0; i < 100'000; ++i) flat.push_back(three[i % 3]);
  for (int i = 0; i < 6; ++i) flat.emplace_back(0.05 * i - 0.1, 0.02 * i);
  Triangles triangles;
  ASSERT_TRUE(cut(flat, triangles));
  EXPECT_EQ(triangles.size(), flat.size() - 2);
}

}  // namespace
