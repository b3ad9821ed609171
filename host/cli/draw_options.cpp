#include "cli/draw_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>

#include "image_io.hpp"
#include "shared.h"

namespace halfshade {
namespace {

constexpr long largest_layer_count = 1024;
constexpr long largest_sample_count = 1 << 20;

bool uses(const MethodInfo& method, std::string_view option) {
  const std::vector<std::string> options = split(method.options, ' ');
  return std::find(options.begin(), options.end(), option) != options.end();
}

std::vector<Method> chosen_methods(const std::vector<std::string>& names) {
  std::vector<Method> chosen;
  const auto add = [&](Method method) {
    if (std::find(chosen.begin(), chosen.end(), method) == chosen.end()) chosen.push_back(method);
  };
  for (const std::string& name : names) {
    if (name == "all") {
      for (const MethodInfo& info : methods()) add(info.method);
    } else {
      add(method_from_name(name));
    }
  }
  return chosen;
}

double parse_smoothie_width(const std::string& text) {
  if (text == "auto") return 0;
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value > 0 && value <= 2)) {
    throw InputError(
        fmt::format("--smoothie-width: expected 'auto' or a width above 0 and up to 2, the light's whole cone (found '{}'); 0.02 "
                    "to 0.2 is usual",
                    text));
  }
  return value;
}

}  // namespace

std::vector<std::string> split(std::string_view text, char separator) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(separator, begin), text.size());
    parts.emplace_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

long parse_integer(std::string_view option, const std::string& text, long lowest, long highest) {
  long value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < lowest || value > highest) {
    throw InputError(fmt::format("{}: expected a whole number from {} to {} (found '{}')", option, lowest, highest, text));
  }
  return value;
}

void DrawOptions::add(CLI::App& command, std::string_view default_methods) {
  const Settings defaults;
  command.add_option("SCENE", scene_path, "Scene file (JSON, see README)")->required()->option_text(" ");
  // One value an occurrence: otherwise an option that can repeat would swallow the scene's path.
  command.add_option("-m,--method", methods, fmt::format("Methods, or 'all' (default: {})", default_methods))
      ->delimiter(',')
      ->allow_extra_args(false)
      ->option_text("M[,M...]");
  command
      .add_option("--light-res", light_res,
                  fmt::format("Light map: at most N texels a side (default: {})", defaults.light_resolution_px))
      ->option_text("N");
  command
      .add_option("--pcf-filter", pcf_filter, fmt::format("pcf: 2x2 bilinear or 4x4 bicubic (default: {})", defaults.pcf_filter))
      ->option_text("2|4");
  command.add_option("--pcss-taps", pcss_taps, fmt::format("pcss: look-ups of each step (default: {})", defaults.pcss_taps))
      ->option_text("16|32");
  command.add_option("--smoothie-width", smoothie_width, "smoothies: width, or from the light's radius (default: auto)")
      ->option_text("T|auto");
  command.add_option("--falloff", falloff, "linear, bernstein, sine or disc (default: the method's best)")->option_text("F");
  command.add_option("--layers", layers, "layered-fins: 1 to 1024, or as the scene needs (default: auto)")->option_text("N|auto");
  command
      .add_option("--samples", samples,
                  fmt::format("Points of the light (default: light-samples {}, exact {})",
                              chosen_samples({.method = Method::light_samples}), chosen_samples({.method = Method::exact})))
      ->option_text("N");
  command.add_flag("--faithful", faithful, "As published, without this program's improvements");
  command
      .add_option("--sample-pattern", sample_pattern,
                  fmt::format("exact: fixed, or rotated from pixel to pixel (default: {})", name_of(defaults.sample_pattern)))
      ->option_text("P");
  command.add_flag("--alias-free", alias_free, "exact: every pixel by geometry, none by the shadow map");
  command.add_option("--resolution", resolution, "Instead of the scene's camera resolution")->option_text("WxH");
  command.add_option("--device", device, "OpenCL device: index, P:D or part of a name (see: devices)")->option_text("D");
  command.add_option("--threads", threads, "Threads of a CPU device, 0 for all cores (default: 0)")->option_text("N");
}

std::vector<Settings> DrawOptions::settings(std::string_view default_methods) const {
  const std::vector<Method> chosen = chosen_methods(methods.empty() ? split(default_methods, ',') : methods);
  for (const auto& [option, text] : {std::pair<std::string_view, std::string>{"light-res", light_res},
                                     {"pcf-filter", pcf_filter},
                                     {"pcss-taps", pcss_taps},
                                     {"smoothie-width", smoothie_width},
                                     {"falloff", falloff},
                                     {"layers", layers},
                                     {"faithful", faithful ? "yes" : ""},
                                     {"samples", samples},
                                     {"sample-pattern", sample_pattern},
                                     {"alias-free", alias_free ? "on" : ""}}) {
    const auto used_options = [&option](Method method) { return uses(info_of(method), option); };
    if (text.empty() || std::any_of(chosen.begin(), chosen.end(), used_options)) continue;
    std::vector<std::string_view> names, using_option;
    for (Method method : chosen) names.push_back(name_of(method));
    for (const MethodInfo& info : halfshade::methods()) {
      if (uses(info, option)) using_option.push_back(info.name);
    }
    throw InputError(fmt::format("--{}: method {} has no use for it (found '{}'); leave it out or choose {}", option,
                                 fmt::join(names, ", "), text, fmt::join(using_option, " or ")));
  }

  Settings settings;
  if (!light_res.empty()) {
    settings.light_resolution_px = static_cast<unsigned>(parse_integer("--light-res", light_res, 1, HS_MAX_RESOLUTION));
  }
  if (!pcf_filter.empty()) {
    if (pcf_filter != "2" && pcf_filter != "4") {
      throw InputError(fmt::format("--pcf-filter: expected 2 or 4 (found '{}')", pcf_filter));
    }
    settings.pcf_filter = pcf_filter == "2" ? 2 : 4;
  }
  if (!pcss_taps.empty()) {
    if (pcss_taps != "16" && pcss_taps != "32") {
      throw InputError(fmt::format("--pcss-taps: expected 16 or 32 (found '{}')", pcss_taps));
    }
    settings.pcss_taps = pcss_taps == "16" ? 16 : 32;
  }
  if (!smoothie_width.empty()) settings.smoothie_width = parse_smoothie_width(smoothie_width);
  if (!falloff.empty()) settings.falloff = falloff_from_name(falloff);
  if (!layers.empty() && layers != "auto")
    settings.layers = static_cast<unsigned>(parse_integer("--layers", layers, 1, largest_layer_count));
  if (!samples.empty()) settings.samples = static_cast<unsigned>(parse_integer("--samples", samples, 1, largest_sample_count));
  settings.faithful = faithful;

  const bool exact = std::find(chosen.begin(), chosen.end(), Method::exact) != chosen.end();
  if (exact && settings.samples && *settings.samples != 16 && *settings.samples != 64 && *settings.samples != 256 &&
      *settings.samples != 1024)
    throw InputError(fmt::format("--samples: method exact: expected 16, 64, 256 or 1024 (found '{}')", samples));
  if (!sample_pattern.empty()) settings.sample_pattern = sample_pattern_from_name(sample_pattern);
  settings.alias_free = alias_free;

  std::vector<Settings> all;
  for (Method method : chosen) {
    all.push_back(settings);
    all.back().method = method;
  }
  return all;
}

Scene DrawOptions::load() const {
  Scene scene = load_scene(scene_path, read_light_texture);
  if (!resolution.empty()) {
    const std::vector<std::string> sides = split(resolution, 'x');
    if (sides.size() != 2) throw InputError(fmt::format("--resolution: expected WxH, as 1024x1024 (found '{}')", resolution));
    const auto side = [&](const std::string& text) {
      return static_cast<unsigned>(parse_integer("--resolution", text, 1, HS_MAX_RESOLUTION));
    };
    scene.camera.resolution = {side(sides[0]), side(sides[1])};
  }
  return scene;
}

std::shared_ptr<Device> DrawOptions::open_device() const {
  if (!threads.empty()) set_cpu_threads(static_cast<unsigned>(parse_integer("--threads", threads, 0, 4096)));
  return Device::open(device);
}

std::vector<std::pair<std::string, std::string>> describe(const Settings& settings) {
  const MethodInfo& info = info_of(settings.method);
  std::vector<std::pair<std::string, std::string>> entries = {{"method", std::string(info.name)}};
  if (uses(info, "light-res")) entries.emplace_back("light_resolution_px", fmt::format("{}", settings.light_resolution_px));
  if (uses(info, "pcf-filter")) entries.emplace_back("pcf_filter", fmt::format("{}", settings.pcf_filter));
  if (uses(info, "pcss-taps")) entries.emplace_back("pcss_taps", fmt::format("{}", settings.pcss_taps));
  if (uses(info, "smoothie-width")) {
    const bool automatic = settings.smoothie_width == 0;
    entries.emplace_back("smoothie_width", automatic ? "auto" : fmt::format("{}", settings.smoothie_width));
  }
  if (uses(info, "falloff")) entries.emplace_back("falloff", std::string(name_of(chosen_falloff(settings))));
  if (uses(info, "layers")) {
    const std::optional<unsigned> count = chosen_layers(settings);
    entries.emplace_back("layers", count ? fmt::format("{}", *count) : "auto");
  }
  if (uses(info, "samples")) entries.emplace_back("samples", fmt::format("{}", chosen_samples(settings)));
  if (uses(info, "faithful")) entries.emplace_back("faithful", settings.faithful ? "yes" : "no");
  if (uses(info, "sample-pattern")) entries.emplace_back("sample_pattern", std::string(name_of(settings.sample_pattern)));
  if (uses(info, "alias-free")) entries.emplace_back("alias_free", settings.alias_free ? "yes" : "no");
  return entries;
}

}  // namespace halfshade
