// Every method, from the list in halfshade.hpp and the declaration in each method's file; and what follows from declarations.
#include <algorithm>

#include "light/light_model.hpp"
#include "methods/method.hpp"

namespace halfshade {

#define HALFSHADE_DECLARED(name) extern const MethodDeclaration name##_method;
HALFSHADE_METHODS(HALFSHADE_DECLARED)
#undef HALFSHADE_DECLARED

const MethodDeclaration& declaration_of(Method method) {
#define HALFSHADE_CASE(name) \
  case Method::name:         \
    return name##_method;
  switch (method) { HALFSHADE_METHODS(HALFSHADE_CASE) }
#undef HALFSHADE_CASE
  throw InputError(fmt::format("Settings::method: expected one of the methods (found number {})", static_cast<int>(method)));
}

namespace {

constexpr Method all_methods[] = {
#define HALFSHADE_VALUE(name) Method::name,
    HALFSHADE_METHODS(HALFSHADE_VALUE)
#undef HALFSHADE_VALUE
};

/// Names of options, separated by spaces, for MethodInfo::options.
std::string option_names(std::span<const Option> options) {
  std::string names;
  for (const Option& option : options) names += fmt::format("{}{}", names.empty() ? "" : " ", option.name);
  return names;
}

std::string names_of_methods_for_any_shape() {
  std::string names;
  for (const MethodInfo& info : methods())
    if (info.any_shape) names += fmt::format("{}{}", names.empty() ? "" : ", ", info.name);
  return names;
}

/// Why a light cannot be drawn; empty where it can.
std::string refusal_of(const Settings& settings, const Light& light) {
  const MethodDeclaration& method = declaration_of(settings.method);
  if (!method.info.any_shape && light.shape != LightShape::disc)  // discs are what all methods draw
    return fmt::format("light '{}' is a rectangle: method {} knows discs alone; choose {}", light.name, method.info.name,
                       names_of_methods_for_any_shape());
  return method.refusal ? method.refusal(settings, light) : std::string();
}

constexpr Falloff all_falloffs[] = {Falloff::linear, Falloff::bernstein, Falloff::sine, Falloff::disc};
// Kernels get the enumerator's number.
static_assert(static_cast<unsigned>(Falloff::linear) == HS_FALLOFF_LINEAR &&
              static_cast<unsigned>(Falloff::bernstein) == HS_FALLOFF_BERNSTEIN &&
              static_cast<unsigned>(Falloff::sine) == HS_FALLOFF_SINE && static_cast<unsigned>(Falloff::disc) == HS_FALLOFF_DISC);

}  // namespace

std::string_view version() {
  return HALFSHADE_VERSION;
}

std::span<const MethodInfo> methods() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const Method method : all_methods) all.push_back(option_names(options_of(method)));
    return all;
  }();
  static const std::vector<MethodInfo> infos = [] {
    std::vector<MethodInfo> all;
    for (const Method method : all_methods) {
      all.push_back(declaration_of(method).info);
      all.back().options = names[all.size() - 1];
    }
    return all;
  }();
  return infos;
}

const MethodInfo& info_of(Method method) {
  for (const MethodInfo& info : methods())
    if (info.method == method) return info;
  return declaration_of(method).info;  // throws
}

std::string_view name_of(Method method) {
  return info_of(method).name;
}

std::span<const Option> options_of(Method method) {
  return declaration_of(method).options;
}

const Option* find_option(Method method, std::string_view name) {
  const std::span<const Option> options = options_of(method);
  const auto found = std::ranges::find(options, name, &Option::name);
  return found == options.end() ? nullptr : &*found;
}

std::vector<std::pair<std::string, std::string>> describe(const Settings& settings) {
  std::vector<std::pair<std::string, std::string>> entries = {{"method", std::string(name_of(settings.method))}};
  for (const Option& option : options_of(settings.method)) entries.emplace_back(option.key, option.text(settings));
  return entries;
}

void check_settings(const Settings& settings, std::string_view caller) {
  for (const Option& option : options_of(settings.method)) {
    try {
      option.check(settings);
    } catch (const InputError& error) {
      throw InputError(fmt::format("{}: {}: {}", caller, option.name, error.what()));
    }
  }
}

void check_light(const Settings& settings, const Light& light, std::string_view caller) {
  if (const std::string refusal = refusal_of(settings, light); !refusal.empty())
    throw InputError(fmt::format("{}: {}", caller, refusal));
}

bool can_draw(const Settings& settings, const Light& light) {
  return refusal_of(settings, light).empty();
}

std::optional<unsigned> chosen_layers(const Settings& settings) {
  if (!settings.layers && settings.faithful) return 16;
  return settings.layers;
}

unsigned chosen_samples(const Settings& settings) {
  if (settings.samples) return *settings.samples;
  const Option* option = find_option(settings.method, "samples");
  return option ? static_cast<unsigned>(*whole_number(option->text(settings))) : 1;
}

Falloff chosen_falloff(const Settings& settings) {
  const MethodInfo& info = declaration_of(settings.method).info;
  return settings.falloff.value_or(settings.faithful ? info.faithful_falloff : info.falloff);
}

std::string_view name_of(SamplePattern pattern) {
  switch (pattern) {
    case SamplePattern::fixed:
      return "fixed";
    case SamplePattern::rotated:
      return "rotated";
  }
  throw InputError("Settings::sample_pattern: expected fixed or rotated");
}

std::string_view name_of(Falloff falloff) {
  switch (falloff) {
    case Falloff::linear:
      return "linear";
    case Falloff::bernstein:
      return "bernstein";
    case Falloff::sine:
      return "sine";
    case Falloff::disc:
      return "disc";
  }
  throw InputError("Settings::falloff: expected linear, bernstein, sine or disc");
}

Method method_from_name(std::string_view name) {
  std::string known;
  for (const MethodInfo& info : methods()) {
    if (info.name == name) return info.method;
    known += fmt::format("{}{}", known.empty() ? "" : ", ", info.name);
  }
  throw InputError(fmt::format("unknown method '{}'; use one of: {}", name, known));
}

Falloff falloff_from_name(std::string_view name) {
  std::string known;
  for (const Falloff falloff : all_falloffs) {
    if (name_of(falloff) == name) return falloff;
    known += fmt::format("{}{}", known.empty() ? "" : ", ", name_of(falloff));
  }
  throw InputError(fmt::format("unknown falloff '{}'; use one of: {}", name, known));
}

SamplePattern sample_pattern_from_name(std::string_view name) {
  for (const SamplePattern pattern : {SamplePattern::fixed, SamplePattern::rotated})
    if (name == name_of(pattern)) return pattern;
  throw InputError(fmt::format("unknown sample pattern '{}'; use one of: fixed, rotated", name));
}

}  // namespace halfshade
