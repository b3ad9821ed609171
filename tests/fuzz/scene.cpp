// A scene file: read, and its first frames posed and checked. Meshes are those that the folder of the corpus' scenes would have.
#include <algorithm>
#include <fstream>

#include "fuzz.hpp"
#include "scene/animation.hpp"

namespace {

/// A folder with a mesh, gone at the end.
struct Folder {
  std::filesystem::path path;

  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "halfshade-fuzz-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) std::abort();
    path = name;
    std::ofstream(path / "box.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  }
  ~Folder() { std::filesystem::remove_all(path); }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Folder folder;
  const auto path = folder.path / "scene.json";
  std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  refuse_or_do([&] {
    const auto texture = [](const std::filesystem::path& file) {
      return std::make_shared<halfshade::LightTexture>(halfshade::LightTexture{file.string(), {1, 1}, {glm::vec3(1.0f)}});
    };
    const halfshade::Scene scene = halfshade::load_scene(path, texture);
    const int first = scene.animation.first_frame, last = std::min(scene.animation.last_frame, first + 20);
    halfshade::check_frames(scene, first, last, "scene");
    halfshade::validate(halfshade::scene_at_frame(scene, last), "scene");
  });
  return 0;
}
