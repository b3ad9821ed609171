// What the user is told while nothing is to be seen yet.
#include "cli/progress.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <string>

namespace halfshade {
namespace {

using namespace std::chrono_literals;

DeviceInfo device(bool has_wide_kernels) {
  DeviceInfo info{};
  info.name = "Test device";
  info.has_wide_kernels = has_wide_kernels;
  return info;
}

/// What is written to stderr when no frame arrives. Waits until something is, however long that takes.
std::string noted(bool has_wide_kernels) {
  int ends[2];
  EXPECT_EQ(pipe(ends), 0);
  const int before = dup(STDERR_FILENO);
  dup2(ends[1], STDERR_FILENO);
  close(ends[1]);
  std::string text(4096, '\0');
  ssize_t length = 0;
  {
    Progress progress;
    FirstFrameWatch watch(progress, device(has_wide_kernels), 1ms);
    length = std::max<ssize_t>(::read(ends[0], text.data(), text.size()), 0);
  }
  dup2(before, STDERR_FILENO);
  close(before);
  char more = 0;
  EXPECT_EQ(::read(ends[0], &more, 1), 0);  // said once
  close(ends[0]);
  text.resize(static_cast<std::size_t>(length));
  return text;
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
