// Options of methods: each is declared once, in the file of the method that has it, or here if several do. The command line, the
// checks, pictures' metadata, the report's axes, `halfshade methods` and the README's tables all follow from the declaration.
#pragma once

#include <fmt/format.h>

#include <charconv>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "base/shared.h"
#include "halfshade/halfshade.hpp"

namespace halfshade {

/// What an option is called and what it says of itself.
struct OptionText {
  std::string_view name;     ///< "pcf-filter"; on the command line --pcf-filter
  std::string_view key;      ///< "pcf_filter": in pictures' metadata and in reports
  std::string_view values;   ///< "2|4", for usage lines; empty for switches
  std::string_view summary;  ///< one line, without the default
  /// Values that the report measures beside the defaults, separated by spaces, and those of a quick one.
  std::string_view measured = {}, measured_quickly = {};
};

/// One option of a method.
struct Option : OptionText {
  /// Takes a value as typed. Throws InputError("expected ... (found '...')"), to which the caller adds where it was typed.
  void (*set)(Settings& settings, std::string_view text);
  /// The value that these settings draw with, as it could be typed.
  std::string (*text)(const Settings& settings);

  bool is_switch() const { return values.empty(); }
  /// Throws InputError as `set` does for a value that a program has put into the settings and nobody could have typed.
  void check(const Settings& settings) const {
    Settings copy = settings;
    set(copy, text(settings));
  }
};

/// The options of a method, and each one's name.
std::span<const Option> options_of(Method method);
const Option* find_option(Method method, std::string_view name);

/// What settings draw with: method and options, as key and value. Goes into pictures, bench tables and reports.
std::vector<std::pair<std::string, std::string>> describe(const Settings& settings);

/// Throws InputError, beginning with `caller`, for an option of the method that is out of range.
void check_settings(const Settings& settings, std::string_view caller);

/// Throws InputError, beginning with `caller`, where a method cannot draw a light; says which methods can.
void check_light(const Settings& settings, const Light& light, std::string_view caller);

// --------------------------------------------------------------------------------------------------- kinds of options

/// A whole number, or nothing where `text` is not all of one.
inline std::optional<long long> whole_number(std::string_view text) {
  long long value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return {};
  return value;
}

/// "16, 64 or 256"
inline std::string one_of(std::initializer_list<unsigned> numbers) {
  std::string text;
  for (const unsigned& number : numbers)
    text += fmt::format("{}{}", &number == numbers.begin() ? "" : &number + 1 == numbers.end() ? " or " : ", ", number);
  return text;
}

/// The text of a member that is unsigned, or an optional of it for which none stands for `by_default`.
template <auto member, unsigned by_default>
std::string number_text(const Settings& settings) {
  if constexpr (std::is_same_v<std::remove_cvref_t<decltype(settings.*member)>, unsigned>)
    return fmt::format("{}", settings.*member);
  else
    return fmt::format("{}", (settings.*member).value_or(by_default));
}

/// A whole number from `low` to `high`, in a member that is unsigned or an optional of it; `by_default` is what none stands for.
template <auto member, unsigned low, unsigned high, unsigned by_default = 0>
constexpr Option number(const OptionText& text) {
  return {text,
          [](Settings& settings, std::string_view typed) {
            const std::optional<long long> value = whole_number(typed);
            if (!value || *value < low || *value > high)
              throw InputError(fmt::format("expected a whole number from {} to {} (found '{}')", low, high, typed));
            settings.*member = static_cast<unsigned>(*value);
          },
          number_text<member, by_default>};
}

/// One of a few numbers, in such a member; `by_default` is what none stands for.
template <auto member, unsigned by_default, unsigned... allowed>
constexpr Option choice(const OptionText& text) {
  return {text,
          [](Settings& settings, std::string_view typed) {
            const std::optional<long long> value = whole_number(typed);
            if (!value || !((*value == allowed) || ...))
              throw InputError(fmt::format("expected {} (found '{}')", one_of({allowed...}), typed));
            settings.*member = static_cast<unsigned>(*value);
          },
          number_text<member, by_default>};
}

/// On or off.
template <bool Settings::*member>
constexpr Option flag(const OptionText& text) {
  return {text,
          [](Settings& settings, std::string_view typed) {
            if (typed != "yes" && typed != "no") throw InputError(fmt::format("expected yes or no (found '{}')", typed));
            settings.*member = typed == "yes";
          },
          [](const Settings& settings) { return std::string(settings.*member ? "yes" : "no"); }};
}

// ------------------------------------------------------------------------------------------ options that methods share

constexpr Option light_res_option = number<&Settings::light_resolution_px, 1, HS_MAX_RESOLUTION>(
    {"light-res", "light_resolution_px", "N", "Light map: at most N texels a side", "256 512 2048 4096", "512 2048"});

constexpr Option falloff_option{
    {"falloff", "falloff", "F", "linear, bernstein, sine or disc: from where in the penumbra to visibility",
     "linear bernstein sine disc", ""},
    [](Settings& settings, std::string_view typed) { settings.falloff = falloff_from_name(typed); },
    [](const Settings& settings) { return std::string(name_of(chosen_falloff(settings))); }};

constexpr Option faithful_option =
    flag<&Settings::faithful>({"faithful", "faithful", "", "As published, without this program's improvements", "yes", "yes"});

}  // namespace halfshade
