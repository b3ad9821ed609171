// Do two pictures agree? The three-number rule of OpenImageIO's idiff.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string>

namespace halfshade {

/// Two pictures agree unless more than `percent` % of their pixels differ by more than `threshold`, or any one by more than
/// `hard`.
struct ImageRule {
  double percent, threshold, hard;
};

/// Empty if the pictures agree, else what is wrong. A pixel differs by the largest difference of its `channels` values; one that
/// is not a number in either picture differs by infinity.
inline std::string image_difference(std::span<const float> a, std::span<const float> b, std::size_t channels,
                                    const ImageRule& rule) {
  if (a.size() != b.size() || channels == 0 || a.size() % channels != 0 || a.empty())
    return fmt::format("sizes: {} and {} values of {} channels", a.size(), b.size(), channels);
  const std::size_t pixels = a.size() / channels;
  std::size_t over = 0, worst_pixel = 0;
  double worst = 0.0;
  for (std::size_t i = 0; i < pixels; ++i) {
    double max_difference = 0.0;
    for (std::size_t c = i * channels; c < (i + 1) * channels; ++c) {
      const double difference = std::abs(double{a[c]} - double{b[c]});
      max_difference = std::max(max_difference, std::isnan(difference) ? HUGE_VAL : difference);
    }
    if (max_difference > rule.threshold) ++over;
    if (max_difference > worst) {
      worst = max_difference;
      worst_pixel = i;
    }
  }
  const double over_percent = 100.0 * static_cast<double>(over) / static_cast<double>(pixels);
  if (over_percent <= rule.percent && worst <= rule.hard) return {};
  return fmt::format("{:.3f} % of pixels differ by more than {} (allowed: {} %), pixel {} by {} (allowed: {})", over_percent,
                     rule.threshold, rule.percent, worst_pixel, worst, rule.hard);
}

}  // namespace halfshade
