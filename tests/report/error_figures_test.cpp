// The comparator itself, on images whose figures are worked out by hand, planted differences included.
#include "report/error_figures.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/temp_folder.hpp"

namespace halfshade {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

std::vector<PixelKind> all_counted(std::size_t n) {
  return std::vector<PixelKind>(n, PixelKind::counted);
}

TEST(ErrorFigures, AreZeroForEqualPlanes) {
  const std::vector<float> plane{0.0f, 0.25f, 0.5f, 1.0f};
  const ErrorFigures figures = compare_visibility(plane, plane, all_counted(4));
  EXPECT_EQ(figures.counted_pixels, 4u);
  EXPECT_EQ(figures.penumbra_pixels, 2u);
  for (const NamedFigure& figure : named_figures(figures)) {
    if (!figure.name.ends_with("_pixels")) {
      EXPECT_EQ(figure.value, 0.0) << figure.name;
    }
  }
}

TEST(ErrorFigures, AgreeWithFourPixelsWorkedOutByHand) {
  // errors: 0, +0.25 (penumbra), -0.5 (penumbra), -0.125
  const std::vector<float> truth{0.0f, 0.25f, 0.75f, 1.0f}, seen{0.0f, 0.5f, 0.25f, 0.875f};
  const ErrorFigures figures = compare_visibility(seen, truth, all_counted(4));
  EXPECT_DOUBLE_EQ(figures.rmse, std::sqrt((0.0625 + 0.25 + 0.015625) / 4));
  EXPECT_DOUBLE_EQ(figures.penumbra_rmse, std::sqrt((0.0625 + 0.25) / 2));
  EXPECT_DOUBLE_EQ(figures.bias, -0.125);
  EXPECT_DOUBLE_EQ(figures.max_error, 0.5);
  EXPECT_DOUBLE_EQ(figures.p999_error, 0.5);
  EXPECT_DOUBLE_EQ(figures.bad_fraction, 0.75);
  EXPECT_EQ(figures.false_lit, 0u);
  EXPECT_EQ(figures.false_umbra, 0u);
}

TEST(ErrorFigures, FindFalseLightAndFalseUmbraOnlyWhereTheTruthIsCertain) {
  const std::vector<float> truth{0.0f, 0.0f, 0.001f, 1.0f, 1.0f, 0.999f}, seen{0.51f, 0.5f, 1.0f, 0.49f, 0.5f, 0.0f};
  const ErrorFigures figures = compare_visibility(seen, truth, all_counted(6));
  EXPECT_EQ(figures.false_lit, 1u);
  EXPECT_EQ(figures.false_umbra, 1u);
}

TEST(ErrorFigures, DrawThePenumbrasBordersStrictly) {
  const std::vector<float> truth{0.001f, 0.0021f, 0.9979f, 0.999f};
  EXPECT_EQ(compare_visibility(truth, truth, all_counted(4)).penumbra_pixels, 2u);
}

TEST(ErrorFigures, IgnoreWhatIsNotCounted) {
  const std::vector<float> truth{0.5f, 0.5f, 0.5f}, seen{0.5f, 1.0f, 0.0f};
  const std::vector<PixelKind> kinds{PixelKind::counted, PixelKind::away, PixelKind::ignored};
  const ErrorFigures figures = compare_visibility(seen, truth, kinds);
  EXPECT_EQ(figures.counted_pixels, 1u);
  EXPECT_EQ(figures.max_error, 0.0);
}

TEST(ErrorFigures, SeeOnePlantedPixelInAMillion) {
  std::vector<float> truth(1'000'000, 1.0f), seen = truth;
  seen[123'456] = 0.0f;
  const ErrorFigures figures = compare_visibility(seen, truth, all_counted(truth.size()));
  EXPECT_DOUBLE_EQ(figures.rmse, 1e-3);
  EXPECT_EQ(figures.max_error, 1.0);
  EXPECT_EQ(figures.false_umbra, 1u);
  EXPECT_EQ(figures.p999_error, 0.0);
}

TEST(ErrorFigures, TakeThe999thOfAThousandAsPercentile) {
  std::vector<float> truth(1000, 0.0f), seen = truth;
  seen[10] = 0.5f;
  EXPECT_EQ(compare_visibility(seen, truth, all_counted(1000)).p999_error, 0.0);
  seen[700] = 0.25f;
  EXPECT_EQ(compare_visibility(seen, truth, all_counted(1000)).p999_error, 0.25);
}

TEST(ErrorFigures, CannotBeImprovedByNotANumber) {
  const std::vector<float> truth{0.5f, 0.5f, 1.0f, 1.0f};
  const std::vector<float> seen{nan, 0.75f, 1.0f, std::numeric_limits<float>::infinity()};
  std::vector<PixelKind> kinds = all_counted(4);
  kinds[3] = PixelKind::ignored;
  const ErrorFigures figures = compare_visibility(seen, truth, kinds);
  EXPECT_EQ(figures.nonfinite, 2u);
  EXPECT_EQ(figures.max_error, 1.0);
  EXPECT_DOUBLE_EQ(figures.penumbra_rmse, std::sqrt((1.0 + 0.0625) / 2));
  EXPECT_DOUBLE_EQ(figures.bias, 0.25);
}

TEST(ErrorFigures, RefusePlanesOfDifferentSizesAndATruthThatIsNone) {
  const std::vector<float> three(3), four(4), none{nan};
  expect_error<InputError>([&] { compare_visibility(three, four, all_counted(4)); }, {"3", "4"});
  expect_error<InputError>([&] { compare_visibility(three, three, all_counted(4)); }, {"3", "4"});
  expect_error<InputError>([&] { compare_visibility(four, none, all_counted(1)); }, {"4", "1"});
  expect_error<InputError>([&] { compare_visibility(none, none, all_counted(1)); }, {"truth", "pixel 0"});
}

TEST(PixelKinds, FollowNormalConeAndSide) {
  Light light;
  light.position = {0, 10, 0};
  light.target = {0, 0, 0};
  light.cone_deg = 90;  // reaches 10 units to each side at the ground
  const glm::vec4 up(0, 1, 0, 1), down(0, -1, 0, 1), unseen(0);
  const std::vector<glm::dvec3> positions{{0, 0, 0},    {0, 0, 0},     {0, 0, 0}, {9.9, 0, 9.9},
                                          {10.1, 0, 0}, {0, 0, -10.1}, {0, 11, 0}};
  const std::vector<glm::vec4> normals{up, down, unseen, up, up, up, down};
  using enum PixelKind;
  const std::vector<PixelKind> expected{counted, away, ignored, counted, ignored, ignored, ignored};
  EXPECT_EQ(pixel_kinds(positions, normals, light), expected);
}

}  // namespace
}  // namespace halfshade
