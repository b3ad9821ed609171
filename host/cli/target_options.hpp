// What render, bench and report have in common on the command line: at which resolution a scene is drawn, and on which device.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "halfshade/halfshade.hpp"

namespace halfshade {

/// Texts as given; empty where not given. `add` declares them, the other functions read them and throw InputError, naming the
/// option.
struct TargetOptions {
  std::string resolution, device, threads;
  bool allow_outside = false;

  /// `threads_of` is what has the threads, for the help.
  void add(CLI::App& command, std::string_view threads_of);

  /// The scene of a file, with the resolution asked for.
  Scene load(const std::filesystem::path& scene_path) const;
  /// The same at the first frame of its range.
  Scene load_first_frame(const std::filesystem::path& scene_path) const;
  /// The number of threads asked for; 0 for all cores.
  unsigned thread_count() const;
  /// Opens the device asked for; it keeps to the threads asked for.
  std::shared_ptr<Device> open_device() const;
};

}  // namespace halfshade
