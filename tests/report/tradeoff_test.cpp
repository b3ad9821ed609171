// The Pareto front, and the time in which rays reach an error.
#include "report/tradeoff.hpp"

#include <gtest/gtest.h>

namespace halfshade {
namespace {

TEST(ParetoFront, HoldsWhatNoOtherPointBeats) {
  const std::vector<Tradeoff> points{{1, 9}, {2, 5}, {2, 6}, {3, 5}, {4, 1}, {5, 2}, {4, 1}};
  EXPECT_EQ(pareto_front(points), (std::vector<bool>{true, true, false, false, true, false, true}));
  EXPECT_TRUE(pareto_front({}).empty());
}

TEST(RaysTimeAtError, IsOnStraightLinesOfTheLogLogPlot) {
  // Error falls with the square root of time; a slow and bad one among them does not matter.
  const std::vector<Tradeoff> rays{{1, 0.1}, {100, 0.01}, {50, 0.2}, {10000, 0.001}};
  EXPECT_NEAR(*rays_time_at_error(rays, 0.0316227766), 10.0, 1e-6);
  EXPECT_NEAR(*rays_time_at_error(rays, 0.00316227766), 1000.0, 1e-4);
  EXPECT_DOUBLE_EQ(*rays_time_at_error(rays, 0.01), 100.0);
  EXPECT_DOUBLE_EQ(*rays_time_at_error(rays, 0.5), 1.0);
  EXPECT_EQ(rays_time_at_error(rays, 0.0009), std::nullopt);
  EXPECT_EQ(rays_time_at_error({}, 0.5), std::nullopt);
}

}  // namespace
}  // namespace halfshade
