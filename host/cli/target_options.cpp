#include "cli/target_options.hpp"

#include <fmt/format.h>

#include "base/shared.h"
#include "cli/parse.hpp"
#include "image/image_io.hpp"
#include "scene/animation.hpp"

namespace halfshade {

void TargetOptions::add(CLI::App& command, std::string_view threads_of) {
  command.add_option("--resolution", resolution, "Instead of the scene's camera resolution")->option_text("WxH");
  command.add_option("--device", device, "OpenCL device: index, P:D or part of a name (see: devices)")->option_text("D");
  command.add_option("--threads", threads, fmt::format("Threads of {}, 0 for all cores (default: 0)", threads_of))
      ->option_text("N");
  command.add_flag("--allow-outside", allow_outside, "Scenes may name meshes and textures outside of their folder");
}

Scene TargetOptions::load(const std::filesystem::path& scene_path) const {
  Scene scene = load_scene(scene_path, read_light_texture, allow_outside ? ScenePaths::anywhere : ScenePaths::inside);
  if (resolution.empty()) return scene;
  const std::vector<std::string> sides = split(resolution, 'x');
  if (sides.size() != 2) throw InputError(fmt::format("--resolution: expected WxH, as 1024x1024 (found '{}')", resolution));
  const auto side = [](const std::string& text) {
    return static_cast<unsigned>(parse_integer("--resolution", text, 1, HS_MAX_RESOLUTION));
  };
  scene.camera.resolution = {side(sides[0]), side(sides[1])};
  return scene;
}

Scene TargetOptions::load_first_frame(const std::filesystem::path& scene_path) const {
  Scene scene = load(scene_path);
  const int frame = scene.animation.first_frame;
  check_frames(scene, frame, frame, scene_path.string());
  pose(scene, frame);
  return scene;
}

unsigned TargetOptions::thread_count() const {
  constexpr long max_threads = 4096;
  return threads.empty() ? 0 : static_cast<unsigned>(parse_integer("--threads", threads, 0, max_threads));
}

std::shared_ptr<Device> TargetOptions::open_device() const {
  if (!threads.empty()) set_cpu_threads(thread_count());
  return Device::open(device);
}

}  // namespace halfshade
