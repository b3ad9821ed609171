// Wall-clock times: how they are taken, summed up and written.
#pragma once

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <vector>

namespace halfshade {

using Clock = std::chrono::steady_clock;

/// Milliseconds since `begin`.
inline double ms_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

/// The median; of an even number of values the mean of the two in the middle, of none 0.
inline double median_of(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
}

/// The smallest value; of none 0.
inline double min_of(const std::vector<double>& values) {
  return values.empty() ? 0.0 : *std::min_element(values.begin(), values.end());
}

/// "00:01:30", rounded to seconds.
inline std::string duration_text(double ms) {
  return fmt::format("{:%H:%M:%S}", std::chrono::seconds(std::lround(ms / 1000.0)));
}

/// The time that is left where `done` of all (0..1) took from `begin` to now, as ", 00:01:30 left"; empty while nothing is done.
inline std::string time_left_text(Clock::time_point begin, double done) {
  return done > 0.0 ? fmt::format(", {} left", duration_text(ms_since(begin) * (1.0 - done) / done)) : "";
}

}  // namespace halfshade
