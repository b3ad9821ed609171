// Medians and durations.
#include "report/timing.hpp"

#include <gtest/gtest.h>

namespace halfshade {
namespace {

TEST(Median, OfEvenAndOddNumbers) {
  EXPECT_EQ(median_of({3, 1, 2}), 2);
  EXPECT_EQ(median_of({4, 1, 2, 3}), 2.5);
  EXPECT_EQ(median_of({}), 0);
}

TEST(Duration, IsInWholeSeconds) {
  EXPECT_EQ(duration_text(89'600), "00:01:30");
  EXPECT_EQ(time_left_text(Clock::now(), 0.0), "");
  EXPECT_EQ(time_left_text(Clock::now() - std::chrono::minutes(1), 0.25), ", 00:03:00 left");
}

}  // namespace
}  // namespace halfshade
