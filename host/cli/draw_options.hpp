// What render and bench have in common on the command line: which scene, how shadows are computed, and where.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "halfshade/halfshade.hpp"

namespace halfshade {

/// Texts as given; empty where not given, for no option has an empty value. `add` declares them, the other functions read them
/// and throw InputError, naming the option.
struct DrawOptions {
  std::filesystem::path scene_path;
  std::vector<std::string> methods;
  std::string light_res, pcf_filter, pcss_taps, smoothie_width, falloff, layers, samples, sample_pattern, resolution, device,
      threads;
  bool faithful = false, alias_free = false;

  void add(CLI::App& command, std::string_view default_methods);

  /// One a method, in the order given and without repeats; `default_methods` where none is given, "all" is every method.
  /// An option that none of them uses is an error.
  std::vector<Settings> settings(std::string_view default_methods) const;
  /// The scene, with the resolution asked for.
  Scene load() const;
  std::shared_ptr<Device> open_device() const;
};

/// An integer in [lowest, highest]. Throws InputError with the option's name.
long parse_integer(std::string_view option, const std::string& text, long lowest, long highest);

/// The settings that a method uses, as name and value: what is written into pictures and bench tables.
std::vector<std::pair<std::string, std::string>> describe(const Settings& settings);

/// Parts of a text between separators.
std::vector<std::string> split(std::string_view text, char separator);

}  // namespace halfshade
