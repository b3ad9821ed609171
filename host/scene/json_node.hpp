// JSON values that know where they stand in their file.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "halfshade/halfshade.hpp"

namespace halfshade {

/// A value as a message can show it: on one line and not too long.
std::string shown(const nlohmann::json& value);

/// Where a JSON text nests deeper than limits::json_depth, if it does: "line 1, column 65". Whoever walks over values by
/// recursion, as dump() does, would run out of stack.
std::optional<std::string> place_too_deep(std::string_view text);

/// The value of a JSON text. Throws InputError, which names `file`, line and column, for what is no JSON or nests too deeply, and
/// for an object with a key twice.
nlohmann::json parse_json(const std::string& text, const std::string& file);

/// A JSON value that knows where it stands, so that whatever is wrong with it is reported with file and place.
class Node {
 public:
  Node(const nlohmann::json& value, std::string_view file, std::string place)
      : value_(&value), file_(file), place_(std::move(place)) {}

  /// Throws InputError: file, place, what was expected, what is here instead, and what to do.
  [[noreturn]] void fail(std::string_view expected, std::string_view remedy = "") const;

  /// This value, once it is an object.
  const Node& object() const {
    if (!value_->is_object()) fail("an object");
    return *this;
  }
  /// The same, with no other keys than these.
  const Node& object(const std::vector<std::string_view>& known_keys) const;

  bool has(std::string_view key) const { return value_->contains(key); }

  /// The value of a key that must be there.
  Node at(std::string_view key) const;

  /// The items of an array.
  std::vector<Node> items() const;
  /// The items of an array of exactly `count`.
  std::vector<Node> items(std::size_t count, std::string_view expected) const;

  /// The value as a T, once it is one.
  template <class T>
  T as() const {
    if constexpr (std::is_same_v<T, bool>) {
      if (!value_->is_boolean()) fail("true or false");
      return value_->get<bool>();
    } else if constexpr (std::is_same_v<T, std::string>) {
      if (!value_->is_string()) fail("a string");
      return value_->get<std::string>();
    } else if constexpr (std::is_same_v<T, double>) {
      if (!value_->is_number()) fail("a number");
      return value_->get<double>();
    } else if constexpr (std::is_integral_v<T>) {
      using Limits = std::numeric_limits<T>;
      const double value = value_->is_number_integer() ? value_->get<double>() : NAN;
      if (!(value >= Limits::min() && value <= Limits::max())) {
        fail(fmt::format("a whole number from {} to {}", Limits::min(), Limits::max()));
      }
      return value_->get<T>();
    } else if constexpr (std::is_same_v<T, std::optional<glm::dvec3>>) {
      return as<glm::dvec3>();
    } else if constexpr (std::is_same_v<T, glm::uvec2>) {
      const auto parts = items(2, "an array of two whole numbers");
      return {parts[0].as<std::uint32_t>(), parts[1].as<std::uint32_t>()};
    } else if constexpr (std::is_same_v<T, glm::dvec2>) {
      const auto parts = items(2, "an array of two numbers");
      return {parts[0].as<double>(), parts[1].as<double>()};
    } else {
      static_assert(std::is_same_v<T, glm::dvec3> || std::is_same_v<T, glm::vec3>);
      const auto parts = items(3, "an array of three numbers");
      return T(parts[0].as<double>(), parts[1].as<double>(), parts[2].as<double>());
    }
  }

  /// Reads a key that must be there.
  template <class T>
  void require(std::string_view key, T& out) const {
    out = at(key).as<T>();
  }

  /// Reads a key, or leaves `out` at its default.
  template <class T>
  void read(std::string_view key, T& out) const {
    if (has(key)) require(key, out);
  }

 private:
  std::string start_of_message() const;
  std::string child_place(std::string_view key) const;

  const nlohmann::json* value_;
  std::string_view file_;
  std::string place_;
};

}  // namespace halfshade
