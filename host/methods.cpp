// The table of methods: names, sources, and the settings each uses.
#include <fmt/format.h>

#include <array>

#include "halfshade/halfshade.hpp"

namespace halfshade {
namespace {

constexpr std::array<MethodInfo, 9> method_table{{
    {Method::hard, "hard", "shadow map, nearest texel; no penumbra", "Williams 1978", "light-res", Falloff::linear,
     Falloff::linear, true},
    {Method::pcf, "pcf", "shadow map, filtered comparisons (2x2 bilinear or 4x4 bicubic); antialiased, no penumbra",
     "Reeves, Salesin & Cook 1987", "light-res pcf-filter", Falloff::linear, Falloff::linear, true},
    {Method::pcss, "pcss", "shadow map, comparisons filtered as widely as the mean depth of the blockers around asks for",
     "Fernando 2005", "light-res pcss-taps", Falloff::linear, Falloff::linear},
    {Method::smoothies, "smoothies", "outer penumbra from quads and corners at the silhouettes, minimum alpha",
     "Chan & Durand 2003", "light-res smoothie-width falloff faithful", Falloff::sine, Falloff::sine},
    {Method::penumbra_maps, "penumbra-maps", "outer penumbra from cones and sheets at the silhouettes, darkest wins",
     "Wyman & Hansen 2003", "light-res falloff faithful", Falloff::bernstein, Falloff::bernstein},
    {Method::fins, "fins", "inner and outer penumbra from fins at the silhouettes", "Cai et al. 2006, one layer",
     "light-res falloff faithful", Falloff::disc, Falloff::bernstein},
    {Method::layered_fins, "layered-fins", "the same, layer by layer of depth: casters below one another", "Cai et al. 2006",
     "light-res layers falloff faithful", Falloff::disc, Falloff::bernstein},
    {Method::light_samples, "light-samples", "the mean of hard shadows from points of the light", "Heckbert & Herf 1997",
     "light-res samples", Falloff::linear, Falloff::linear, true},
    {Method::exact, "exact",
     "the light's sample points counted as rays would, by crossings of silhouettes; no artefacts but noise", "halfshade",
     "light-res samples sample-pattern alias-free", Falloff::linear, Falloff::linear, true},
}};

constexpr std::array<std::string_view, 4> falloff_names{"linear", "bernstein", "sine", "disc"};

}  // namespace

std::string_view version() {
  return HALFSHADE_VERSION;
}

std::span<const MethodInfo> methods() {
  return method_table;
}

const MethodInfo& info_of(Method method) {
  for (const MethodInfo& info : method_table)
    if (info.method == method) return info;
  throw std::logic_error("a method without an entry in method_table");
}

std::string_view name_of(Method method) {
  return info_of(method).name;
}

std::optional<unsigned> chosen_layers(const Settings& settings) {
  if (!settings.layers && settings.faithful) return 16;
  return settings.layers;
}

unsigned chosen_samples(const Settings& settings) {
  return settings.samples.value_or(settings.method == Method::exact ? 256 : 64);
}

bool can_draw(const Settings& settings, const Light& light) {
  // A smoothie's width is of the light's cone.
  if (light.type == LightType::directional && settings.method == Method::smoothies && settings.smoothie_width > 0.0) return false;
  if (light.shape == LightShape::disc) return true;
  const bool turned = settings.method == Method::exact && settings.sample_pattern == SamplePattern::rotated;
  return info_of(settings.method).any_shape && !turned;
}

Falloff chosen_falloff(const Settings& settings) {
  const MethodInfo& info = info_of(settings.method);
  return settings.falloff.value_or(settings.faithful ? info.faithful_falloff : info.falloff);
}

std::string_view name_of(SamplePattern pattern) {
  return pattern == SamplePattern::fixed ? "fixed" : "rotated";
}

std::string_view name_of(Falloff falloff) {
  return falloff_names.at(static_cast<std::size_t>(falloff));
}

Method method_from_name(std::string_view name) {
  std::string known;
  for (const MethodInfo& info : method_table) {
    if (info.name == name) return info.method;
    known += fmt::format("{}{}", known.empty() ? "" : ", ", info.name);
  }
  throw InputError(fmt::format("unknown method '{}'; use one of: {}", name, known));
}

Falloff falloff_from_name(std::string_view name) {
  for (std::size_t i = 0; i < falloff_names.size(); ++i)
    if (falloff_names[i] == name) return static_cast<Falloff>(i);
  throw InputError(fmt::format("unknown falloff '{}'; use one of: {}", name, fmt::join(falloff_names, ", ")));
}

SamplePattern sample_pattern_from_name(std::string_view name) {
  for (const SamplePattern pattern : {SamplePattern::fixed, SamplePattern::rotated})
    if (name == name_of(pattern)) return pattern;
  throw InputError(fmt::format("unknown sample pattern '{}'; use one of: fixed, rotated", name));
}

}  // namespace halfshade
