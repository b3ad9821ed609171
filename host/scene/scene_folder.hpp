// Which files a scene may name: those in its own folder, unless its user allows others.
#pragma once

#include <filesystem>

#include "halfshade/halfshade.hpp"
#include "scene/json_node.hpp"

namespace halfshade {

/// The folder of a scene file.
class SceneFolder {
 public:
  SceneFolder(const std::filesystem::path& scene_file, ScenePaths allowed);

  /// The file that a path in the scene names. Throws InputError, with the place, for one that the scene may not name.
  std::filesystem::path file_at(const Node& node) const;

 private:
  std::filesystem::path folder_;
  std::filesystem::path root_;  ///< what paths must not leave, resolved
  ScenePaths allowed_;
};

}  // namespace halfshade
