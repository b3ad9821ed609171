#include "cli/frame_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "cli/parse.hpp"
#include "image/whole_file.hpp"
#include "light/light_model.hpp"
#include "scene/limits.hpp"

namespace halfshade {

FrameRange frame_range(const std::string& text, const Animation& animation) {
  if (text.empty()) return {animation.first_frame, animation.last_frame};
  const std::vector<std::string> ends = split(text, '-');
  if (ends.size() > 2) throw InputError(fmt::format("--frames: expected A-B or A, as 1-48 (found '{}')", text));
  const auto frame = [](const std::string& end) {
    return static_cast<int>(parse_integer("--frames", end, 0, limits::last_frame));
  };
  const FrameRange range{frame(ends.front()), frame(ends.back())};
  if (range.last < range.first) throw InputError(fmt::format("--frames: expected A-B with A <= B (found '{}')", text));
  return range;
}

FrameFiles::FrameFiles(const Scene& scene, bool png, bool light_buffers)
    : scene_(scene), png_(png), light_buffers_(light_buffers) {}

std::string FrameFiles::stem(Method method, int frame) const {
  return fmt::format("{}.{}.{:04}", scene_.name, name_of(method), frame);
}

std::string FrameFiles::light_buffers(const std::string& stem, std::string_view light, std::string_view face) {
  return fmt::format("{}.{}{}{}.exr", stem, light, face.empty() ? "" : ".", face);
}

std::vector<std::string> FrameFiles::files_of(const std::string& stem) const {
  std::vector<std::string> files{stem + ".exr"};
  if (png_) files.push_back(stem + ".png");
  if (light_buffers_)
    for (const Light& light : scene_.lights)
      for (const std::string_view face : model_of(light.type).faces) files.push_back(light_buffers(stem, light.name, face));
  return files;
}

bool FrameFiles::has(std::string_view file, std::span<const Settings> settings, FrameRange range) const {
  return std::ranges::any_of(settings, [&](const Settings& one) {
    const std::string start = fmt::format("{}.{}.", scene_.name, name_of(one.method));
    int frame = 0;
    if (!file.starts_with(start)) return false;
    const auto [end, error] = std::from_chars(file.data() + start.size(), file.data() + file.size(), frame);
    if (error != std::errc() || frame < range.first || frame > range.last) return false;
    const std::vector<std::string> files = files_of(stem(one.method, frame));
    return std::ranges::find(files, file) != files.end();
  });
}

void FrameFiles::check_lengths(std::span<const Settings> settings, int frame) const {
  for (const Settings& one : settings)
    for (const std::string& file : files_of(stem(one.method, frame)))
      if (file.size() > max_output_name)
        throw InputError(
            fmt::format("{}: expected a file name of at most {} bytes (found {}); shorten the name of the scene's "
                        "file or of its lights",
                        file, max_output_name, file.size()));
}

}  // namespace halfshade
