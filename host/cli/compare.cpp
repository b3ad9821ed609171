// The error of one picture against another, of any origin.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/commands.hpp"
#include "cli/light_metadata.hpp"
#include "image/image_io.hpp"
#include "report/error_figures.hpp"
#include "report/figures_json.hpp"
#include "scene/picture_names.hpp"
#include "scene/printable.hpp"

namespace halfshade {
namespace {

struct CompareOptions {
  std::filesystem::path a, b;
  std::vector<std::string> channels;
  std::string fail_rmse;
  bool json = false;
};

struct ChannelFigures {
  std::string channel;
  std::string pixels;  ///< which ones count, in words
  ErrorFigures figures;
};

/// The channels of a picture, for messages.
std::string shown_channels(const ExrImage& image) {
  std::vector<std::string> names;
  for (const std::string& name : image.channel_names) names.push_back(printable(name));
  std::ranges::sort(names);
  return fmt::format("{}", fmt::join(names, ", "));
}

/// Whether a channel may have a part in what is compared.
bool is_wanted(std::string_view channel, const CompareOptions& options) {
  if (channel.starts_with("P.") || channel.starts_with("N.")) return true;
  return options.channels.empty() ? !light_of_channel(channel).empty()
                                  : std::ranges::find(options.channels, channel) != options.channels.end();
}

const std::vector<float>& channel_of(const ExrImage& image, const std::string& channel, const std::string& path) {
  const auto found = image.channels.find(channel);
  if (found == image.channels.end()) {
    throw InputError(
        fmt::format("{}: expected a channel '{}' (found {}); choose with --channel", path, channel, shown_channels(image)));
  }
  return found->second;
}

/// The pixels that count by docs/design.md, "Error", if the picture tells positions, normals and the light.
std::optional<std::vector<PixelKind>> kinds_from(const ExrImage& image, const std::string& light_name, const std::string& path) {
  const std::optional<Light> light = light_from_metadata(image, light_name, path);
  if (!light) return {};
  for (const char* name : {"P.X", "P.Y", "P.Z", "N.X", "N.Y", "N.Z"})
    if (!image.channels.contains(name)) return {};
  const auto vector_at = [&](const std::string& layer, std::size_t i) {
    return glm::dvec3(image.channels.at(layer + ".X")[i], image.channels.at(layer + ".Y")[i], image.channels.at(layer + ".Z")[i]);
  };
  const std::size_t pixels = image.channels.at("P.X").size();
  std::vector<glm::dvec3> positions(pixels);
  std::vector<glm::vec4> normals(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    positions[i] = vector_at("P", i);
    const glm::dvec3 normal = vector_at("N", i);
    normals[i] = glm::vec4(normal, normal == glm::dvec3(0.0) ? 0.0 : 1.0);
  }
  return pixel_kinds(positions, normals, *light);
}

ChannelFigures compare_channel(const ExrImage& a, const ExrImage& b, const std::string& channel, const CompareOptions& options) {
  const std::vector<float>& seen = channel_of(a, channel, options.a.string());
  const std::vector<float>& truth = channel_of(b, channel, options.b.string());
  ChannelFigures result{channel, "all pixels", {}};
  std::optional<std::vector<PixelKind>> kinds;
  if (const std::string light(light_of_channel(channel)); !light.empty()) {
    kinds = kinds_from(b, light, options.b.string());
    if (!kinds) kinds = kinds_from(a, light, options.a.string());
    if (kinds) result.pixels = fmt::format("pixels facing light '{}'", light);
  }
  if (!kinds) kinds.emplace(truth.size(), PixelKind::counted);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if ((*kinds)[i] == PixelKind::counted && !std::isfinite(truth[i]))
      throw InputError(
          fmt::format("{}: channel {}: expected numbers to compare with (found {} at pixel {}, {}); choose another reference",
                      options.b.string(), channel, truth[i], i % b.resolution.x, i / b.resolution.x));
  }
  result.figures = compare_visibility(seen, truth, *kinds);
  return result;
}

double parse_limit(const std::string& text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value >= 0.0) || !std::isfinite(value))
    throw InputError(fmt::format("--fail-rmse: expected a number of 0 or more (found '{}')", text));
  return value;
}

/// The channels asked for, or every visibility of the reference.
std::vector<std::string> chosen_channels(const ExrImage& reference, const CompareOptions& options) {
  if (!options.channels.empty()) return options.channels;
  std::vector<std::string> channels;
  for (const auto& [name, plane] : reference.channels)
    if (!light_of_channel(name).empty()) channels.push_back(name);
  if (channels.empty()) {
    throw InputError(fmt::format("{}: expected a visibility channel, shadow_<light>.Y (found {}); choose with --channel",
                                 options.b.string(), shown_channels(reference)));
  }
  return channels;
}

void print_json(const std::vector<ChannelFigures>& all) {
  Json json = Json::array();
  for (const ChannelFigures& one : all) {
    Json figures = {{"channel", one.channel}, {"pixels", one.pixels}};
    figures.update(to_json(one.figures));
    json.push_back(figures);
  }
  fmt::print("{}\n", json.dump(2));
}

void print_text(const std::vector<ChannelFigures>& all) {
  for (const ChannelFigures& one : all) {
    fmt::print("{} over {}\n", one.channel, one.pixels);
    for (const NamedFigure& figure : named_figures(one.figures)) {
      if (figure.is_count)
        fmt::print("  {:<16} {:>12.0f}\n", figure.name, figure.value);
      else
        fmt::print("  {:<16} {:>12.6f}\n", figure.name, figure.value);
    }
  }
}

/// Throws std::runtime_error where a channel's rmse is beyond the limit, or a value is not finite.
void check_limit(const std::vector<ChannelFigures>& all, double limit, const CompareOptions& options) {
  for (const ChannelFigures& one : all) {
    if (one.figures.nonfinite > 0)
      throw std::runtime_error(fmt::format("{}: {} of {} has values that are not finite ({})", options.a.string(), one.channel,
                                           options.b.string(), one.figures.nonfinite));
    if (one.figures.rmse > limit)
      throw std::runtime_error(fmt::format("{}: rmse {:.6g} of {} against {} is beyond --fail-rmse {}", options.a.string(),
                                           one.figures.rmse, one.channel, options.b.string(), limit));
  }
}

void run_compare(const CompareOptions& options) {
  const bool has_limit = !options.fail_rmse.empty();
  const double limit = has_limit ? parse_limit(options.fail_rmse) : 0.0;
  const auto choice = [&](std::string_view channel) { return is_wanted(channel, options); };
  const ExrImage a = read_exr(options.a, choice), b = read_exr(options.b, choice);
  if (a.resolution != b.resolution) {
    throw InputError(fmt::format("{}: expected a picture of {}x{}, as {} is (found {}x{})", options.a.string(), b.resolution.x,
                                 b.resolution.y, options.b.string(), a.resolution.x, a.resolution.y));
  }
  const std::vector<std::string> channels = chosen_channels(b, options);
  std::vector<ChannelFigures> all;
  for (const std::string& channel : channels) all.push_back(compare_channel(a, b, channel, options));
  if (options.json)
    print_json(all);
  else
    print_text(all);
  if (has_limit) check_limit(all, limit, options);
}

}  // namespace

void add_compare(CLI::App& program) {
  CLI::App* command = program.add_subcommand("compare", "Print the error of a picture against another");
  const auto options = std::make_shared<CompareOptions>();
  command->add_option("A", options->a, "EXR to judge")->required()->option_text(" ");
  command->add_option("B", options->b, "EXR taken as the truth")->required()->option_text(" ");
  command->add_option("--channel", options->channels, "Channels (default: every shadow_<light>.Y of B)")
      ->allow_extra_args(false)
      ->option_text("NAME");
  command->add_option("--fail-rmse", options->fail_rmse, "Exit code 1 where the rmse is beyond X, or a value not finite")
      ->option_text("X");
  command->add_flag("--json", options->json, "Print JSON");
  command->footer(
      "Counts pixels that face the light, where a picture holds P, N and the light (as those of 'render' do),\n"
      "otherwise all. The penumbra is where B is between 0.002 and 0.998.\n\n"
      "Examples:\n"
      "  halfshade compare out/boxes.smoothies.0001.exr out/boxes.pcf.0001.exr\n"
      "  halfshade compare mine.exr reference.exr --channel shadow_key.Y --fail-rmse 0.01\n");
  command->callback([options] { run_compare(*options); });
}

}  // namespace halfshade
