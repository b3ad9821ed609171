// What the user is told while nothing is to be seen yet.
#include "cli/progress.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <thread>

namespace halfshade {
namespace {

using namespace std::chrono_literals;

DeviceInfo device(bool has_wide_kernels) {
  DeviceInfo info{};
  info.name = "Test device";
  info.has_wide_kernels = has_wide_kernels;
  return info;
}

std::string noted(bool has_wide_kernels) {
  testing::internal::CaptureStderr();
  {
    Progress progress;
    FirstFrameWatch watch(progress, device(has_wide_kernels), 1ms);
    std::this_thread::sleep_for(200ms);
  }
  return testing::internal::GetCapturedStderr();
}

TEST(FirstFrameWatch, SaysOnceWhatItWaitsForAndWhatToDo) {
  const std::string wide = noted(true);
  EXPECT_NE(wide.find("Test device: no frame after 0 s"), std::string::npos) << wide;
  EXPECT_NE(wide.find("wide kernels"), std::string::npos) << wide;
  EXPECT_NE(wide.find("HALFSHADE_KERNEL_SHAPE=narrow"), std::string::npos) << wide;
  EXPECT_EQ(wide.find('\n'), wide.size() - 1) << wide;
  EXPECT_EQ(noted(false).find("HALFSHADE_KERNEL_SHAPE"), std::string::npos);
}

TEST(FirstFrameWatch, IsSilentWhereTheFrameHasArrivedAndDoesNotHoldTheCommandUp) {
  testing::internal::CaptureStderr();
  const auto begin = std::chrono::steady_clock::now();
  {
    Progress progress;
    FirstFrameWatch watch(progress, device(true), 10min);
    watch.arrived();
    watch.arrived();
  }
  {
    Progress progress;
    FirstFrameWatch given_up(progress, device(true), 10min);
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 1min);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace halfshade
