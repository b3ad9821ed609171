// What the values of a scene mean, checked: messages that name the place.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <string>
#include <string_view>

#include "halfshade/halfshade.hpp"
#include "light/light_model.hpp"
#include "scene/json_node.hpp"

namespace halfshade {

template <class T>
bool is_finite(const glm::vec<3, T>& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

inline std::string shown(double x) {
  return fmt::format("{}", x);
}
template <class T>
std::string shown(const glm::vec<2, T>& v) {
  return fmt::format("[{}, {}]", v.x, v.y);
}
template <class T>
std::string shown(const glm::vec<3, T>& v) {
  return fmt::format("[{}, {}, {}]", v.x, v.y, v.z);
}

inline std::string shown(const std::optional<glm::dvec3>& v) {
  return v ? shown(*v) : "none";
}

/// One thing of a scene under examination; the text of where it stands is made only when something is wrong with it.
struct Checker {
  std::string_view where, list;
  std::size_t index = no_index;
  static constexpr std::size_t no_index = ~std::size_t{0};

  /// Throws InputError.
  [[noreturn]] void fail(std::string_view member, std::string_view expected, std::string_view found) const {
    const auto place = index == no_index ? std::string(list) : fmt::format("{}[{}]", list, index);
    throw InputError(fmt::format("{}: {}{}{}: expected {} (found {})", where, place, place.empty() || member.empty() ? "" : ".",
                                 member, expected, found));
  }

  template <class T>
  void expect(bool holds, std::string_view member, const T& value, std::string_view expected) const {
    if (!holds) fail(member, expected, shown(value));
  }

  template <class T>
  void rule(std::string_view member, const T& value, const Rule<T>& rule) const {
    expect(rule.holds(value), member, value, rule.expected);
  }

  template <class T>
  void finite(std::string_view member, const T& value) const {
    expect(is_finite(value), member, value, "finite numbers");
  }

  template <class T>
  void color(std::string_view member, const T& value, double max) const {
    finite(member, value);
    const auto is_valid = [max](double part) { return part >= 0.0 && part <= max; };
    expect(is_valid(value.x) && is_valid(value.y) && is_valid(value.z), member, value,
           fmt::format("numbers of at least 0 and at most {:g}", max));
  }

  void scale(std::string_view member, const glm::dvec3& value) const {
    finite(member, value);
    expect(value.x != 0.0 && value.y != 0.0 && value.z != 0.0, member, value, "numbers other than 0");
  }
};

}  // namespace halfshade
