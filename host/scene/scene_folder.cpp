#include "scene/scene_folder.hpp"

#include <algorithm>

namespace halfshade {
namespace {

namespace fs = std::filesystem;

/// In a folder, a file of this name says that all below belongs together: scenes there may name whatever is in that folder.
constexpr std::string_view root_marker = ".halfshade-root";

/// What packages install there is the same for everybody.
constexpr std::string_view packages_folder = "/usr/share";

/// The nearest folder with a marker, of a scene's folder and those above it; without any, the scene's own.
fs::path root_of(const fs::path& folder) {
  std::error_code error;
  for (fs::path above = folder;; above = above.parent_path()) {
    if (fs::is_regular_file(above / root_marker, error)) return above;
    if (above == above.parent_path()) return folder;
  }
}

/// Both without `..` and links.
bool is_below(const fs::path& path, const fs::path& folder) {
  return std::ranges::mismatch(folder, path).in1 == folder.end();
}

}  // namespace

SceneFolder::SceneFolder(const fs::path& scene_file, ScenePaths allowed) : folder_(scene_file.parent_path()), allowed_(allowed) {
  std::error_code error;
  root_ = root_of(fs::weakly_canonical(folder_.empty() ? "." : folder_, error));
}

fs::path SceneFolder::file_at(const Node& node) const {
  const auto text = node.as<std::string>();
  if (std::ranges::any_of(text, [](unsigned char c) { return c < 0x20; })) node.fail("a path without control characters");
  const fs::path path = folder_ / text;
  if (allowed_ == ScenePaths::anywhere) return path;
  std::error_code error;
  const fs::path resolved = fs::weakly_canonical(path, error);
  if (error || !(is_below(resolved, root_) || is_below(resolved, packages_folder)))
    node.fail(fmt::format("a path that does not lead out of {}, the scene's folder", root_.string()),
              "; move the file there, or allow such paths with --allow-outside");
  return path;
}

}  // namespace halfshade
