// Points of lights: spread over their shape, and where they are bright.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "light/light_model.hpp"
#include "light/samples.hpp"

namespace halfshade {
namespace {

Light rectangle(glm::dvec2 size, glm::uvec2 resolution = {0, 0}, std::vector<glm::vec3> texels = {}) {
  Light light;
  light.shape = LightShape::rectangle;
  light.size = size;
  if (!texels.empty()) light.texture = std::make_shared<LightTexture>(LightTexture{"test", resolution, std::move(texels)});
  return light;
}

TEST(LightPoints, OfADiscAreDiscSamples) {
  EXPECT_EQ(light_points(Light{}, 64, 3).points, disc_samples(64, 3));
  EXPECT_TRUE(light_points(Light{}, 64).weights.empty());
}

TEST(LightPoints, FillARectangleOneAStratum) {
  const Light light = rectangle({3, 4});
  EXPECT_EQ(disc_radius(light), 2.5);
  std::set<std::pair<int, int>> cells;
  for (const glm::dvec2& p : light_points(light, 64).points) {
    const glm::dvec2 square = p * 2.5 / glm::dvec2(3, 4) + 0.5;
    EXPECT_TRUE(square.x > 0 && square.x < 1 && square.y > 0 && square.y < 1);
    cells.insert({static_cast<int>(square.x * 8), static_cast<int>(square.y * 8)});
  }
  EXPECT_EQ(cells.size(), 64u);
  EXPECT_NE(light_points(light, 64, 1).points, light_points(light, 64, 2).points);
  EXPECT_EQ(light_points(light, 1).points, std::vector<glm::dvec2>{glm::dvec2(0.0)});
  EXPECT_EQ(light_points(rectangle({0, 0}), 4).points, std::vector<glm::dvec2>(4, glm::dvec2(0.0)));
}

TEST(LightPoints, OfATextureAreWhereItIsBright) {
  // Top row: black, 1, 0; bottom row: 2, 0, 1.
  const auto grey = [](float v) { return glm::vec3(v); };
  const Light light = rectangle({2, 2}, {3, 2}, {grey(0), grey(1), grey(0), grey(2), grey(0), grey(1)});
  const double radius = disc_radius(light);
  int counts[2][3] = {};
  const LightPoints points = light_points(light, 256);
  for (const glm::dvec2& p : points.points) {
    const glm::dvec2 at = (p * radius + 1.0) / 2.0;  // up is the first row
    ++counts[at.y > 0.5 ? 0 : 1][static_cast<int>(at.x * 3)];
  }
  EXPECT_EQ(counts[0][0] + counts[0][2] + counts[1][1], 0);
  EXPECT_NEAR(counts[0][1], 64, 1);
  EXPECT_NEAR(counts[1][0], 128, 8);
  EXPECT_NEAR(counts[1][2], 64, 8);
  for (const glm::vec3& weight : points.weights) EXPECT_NEAR(weight.g, 1.0f, 1e-5f);
  EXPECT_EQ(mean_color(light), glm::dvec3(4.0 / 6.0));
}

TEST(LightPoints, HaveWeightsThatAreOneOnAverageInEachChannel) {
  const Light light = rectangle({2, 1}, {2, 2}, {{1, 0, 0}, {0, 0.5, 0}, {0.25, 0.25, 0}, {0, 0, 0}});
  glm::dvec3 sum(0.0);
  const LightPoints points = light_points(light, 64);
  for (const glm::vec3& weight : points.weights) sum += glm::dvec3(weight);
  EXPECT_NEAR(sum.r, 64.0, 1e-4);
  EXPECT_NEAR(sum.g, 64.0, 1e-4);
  EXPECT_EQ(sum.b, 0.0);  // it has no blue
}

TEST(LightPoints, LieInTheirCells) {
  for (const unsigned n : {16u, 64u, 256u, 1024u}) {
    const SampleTable table = sample_table(light_points(rectangle({2, 1}, {1, 1}, {{1, 1, 1}}), n));
    const unsigned across = table.cells_across, cells = across * across;
    ASSERT_EQ(table.cells.size(), cells + 1 + n + 16);
    EXPECT_EQ(table.cells[cells], n);
    std::vector<unsigned> met(n, 0);
    for (unsigned cell = 0; cell < cells; ++cell)
      for (unsigned i = table.cells[cell]; i < table.cells[cell + 1]; ++i) {
        const unsigned sample = table.cells[cells + 1 + i];
        ++met[sample];
        const float x = table.cell_xy[i], y = table.cell_xy[table.cell_xy.size() / 2 + i];
        EXPECT_EQ(x, table.samples[sample]);
        EXPECT_EQ(y, table.samples[n + sample]);
        EXPECT_EQ(static_cast<unsigned>((x + 1) / 2 * static_cast<float>(across)), cell % across);
        EXPECT_EQ(static_cast<unsigned>((y + 1) / 2 * static_cast<float>(across)), cell / across);
      }
    EXPECT_EQ(met, std::vector<unsigned>(n, 1));
  }
}

TEST(LightPoints, AreCountedBelowEachStepOfATurn) {
  for (const unsigned n : {16u, 64u, 256u, 1024u}) {
    const SampleTable table = sample_table(light_points(Light{}, n));
    ASSERT_EQ(table.below.size(), static_cast<std::size_t>(4 * table.per_turn) + 2);
    const auto turns = table.samples.begin() + 2 * n;
    EXPECT_TRUE(std::is_sorted(turns, turns + n));
    for (std::size_t i = 0; i < table.below.size(); ++i)
      EXPECT_EQ(table.below[i],
                std::count_if(turns, turns + n, [&](float turn) { return turn < static_cast<float>(i) / table.per_turn; }));
  }
}

TEST(LightPoints, AreInTheWindowsAboutTheirCells) {
  for (const auto& [light, n] : {std::pair{Light{}, 16u},
                                 {Light{}, 64u},
                                 {Light{}, 256u},
                                 {Light{}, 1024u},
                                 {rectangle({2, 1}, {1, 1}, {{1, 1, 1}}), 256u}}) {
    const SampleTable table = sample_table(light_points(light, n));
    const int across = static_cast<int>(2 * table.cells_across);
    const auto cell = [&](float x) { return static_cast<int>((x + 1) / 2 * static_cast<float>(across)); };
    ASSERT_EQ(table.windows.size(), 16u * across * across);
    ASSERT_EQ(table.window_xy.size(), 2 * table.windows.size());
    int full = 0;
    for (int window = 0; window < across * across; ++window) {
      const int column = window % across, row = window / across;
      std::vector<unsigned> inside;
      for (unsigned i = 0; i < n; ++i) {
        const int x = cell(table.samples[i]) - column, y = cell(table.samples[n + i]) - row;
        if (x >= 0 && x < 3 && y >= 0 && y < 3) inside.push_back(i);
      }
      const std::uint16_t* listed = &table.windows[16u * window];
      const float* xs = &table.window_xy[32u * window];
      if (inside.size() > 16) {
        EXPECT_EQ(listed[0], 65535);
        ++full;
        continue;
      }
      for (unsigned k = 0; k < 16; ++k) {
        if (k < inside.size()) {
          EXPECT_EQ(listed[k], inside[k]);
          EXPECT_EQ(xs[k], table.samples[inside[k]]);
          EXPECT_EQ(xs[16 + k], table.samples[n + inside[k]]);
        } else {
          EXPECT_GT(xs[k], 1e9f);  // met by nothing
        }
      }
    }
    if (light.shape == LightShape::disc) {
      EXPECT_LT(full, across * across / 16);
    }
  }
}

TEST(LightPoints, KeepTheirWeightsWhenSorted) {
  const Light light = rectangle({2, 1}, {2, 1}, {{1, 0, 0}, {0, 0, 1}});
  const SampleTable table = sample_table(light_points(light, 64));
  ASSERT_EQ(table.weights.size(), 3 * 64u);
  for (std::size_t i = 0; i < 64; ++i) EXPECT_EQ(table.weights[i] > 0.0f, table.samples[i] < 0.0f);
}

}  // namespace
}  // namespace halfshade
