// What is known in closed form of the parts of a disc that simple casters hide.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

namespace halfshade {

/// The part of a unit disc on the far side of a chord at signed distance u from the centre.
inline double disc_beyond(double u) {
  u = std::clamp(u, -1.0, 1.0);
  return 0.5 - (std::asin(u) + u * std::sqrt(1 - u * u)) / std::numbers::pi;
}

/// The area that discs of radius 1 and r, their centres d apart, have in common.
inline double lens(double r, double d) {
  if (d >= 1 + r) return 0.0;
  if (d <= std::abs(1 - r)) return std::numbers::pi * std::min(1.0, r * r);
  const double along = (d * d + 1 - r * r) / (2 * d);  // from the first centre to the common chord
  const double half_angle = std::acos(along), other = std::acos((d - along) / r);
  return half_angle - std::sin(2 * half_angle) / 2 + r * r * (other - std::sin(2 * other) / 2);
}

}  // namespace halfshade
