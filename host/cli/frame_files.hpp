// Which frames `render` draws, and what the files that it makes of them are called.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "halfshade/halfshade.hpp"

namespace halfshade {

/// Frames, both ends included.
struct FrameRange {
  int first, last;
};

/// "A-B" or "A"; of an empty text the scene's own range. Throws InputError, naming the option --frames.
FrameRange frame_range(const std::string& text, const Animation& animation);

/// The files that are made of a scene's frames.
class FrameFiles {
 public:
  FrameFiles(const Scene& scene, bool png, bool light_buffers);

  /// "<scene>.<method>.<frame, 4 digits>": a frame's EXR with ".exr", its PNG with ".png".
  std::string stem(Method method, int frame) const;
  /// The buffers of a light, or of a face of it where faces have names.
  static std::string light_buffers(const std::string& stem, std::string_view light, std::string_view face);

  /// Whether a file is one of those of the frames of a range.
  bool has(std::string_view file, std::span<const Settings> settings, FrameRange range) const;

  /// Throws InputError where the files of a frame would have names that are too long.
  void check_lengths(std::span<const Settings> settings, int frame) const;

 private:
  std::vector<std::string> files_of(const std::string& stem) const;

  const Scene& scene_;
  bool png_, light_buffers_;
};

}  // namespace halfshade
