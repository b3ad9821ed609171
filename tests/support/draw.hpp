// Frames by the renderer, and the settings that tests go through.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "methods/option.hpp"
#include "support/kernel_fixture.hpp"
#include "support/temp_folder.hpp"

namespace halfshade {

struct Drawn {
  Frame frame;  ///< the normals' w is 1 where something is seen, as in G-buffers
  FrameStats stats;
};

inline Drawn draw(Renderer& renderer, const Scene& scene, const Settings& settings) {
  renderer.set_scene(scene);
  renderer.render(settings);
  Drawn drawn{renderer.read_frame(), renderer.stats()};
  for (std::size_t i = 0; i < drawn.frame.depth.size(); ++i)
    drawn.frame.normal_ws[i].w = drawn.frame.depth[i] > 0.0f ? 1.0f : 0.0f;
  return drawn;
}

inline Drawn draw(const std::shared_ptr<Device>& device, const Scene& scene, const Settings& settings) {
  Renderer renderer(device);
  return draw(renderer, scene, settings);
}

inline Frame draw_frame(const std::shared_ptr<Device>& device, const Scene& scene, const Settings& settings) {
  return draw(device, scene, settings).frame;
}

/// A method's name as part of a test's.
inline std::string test_name_of(Method method) {
  std::string name(name_of(method));
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

/// As describe() says it, in one line.
inline std::string description_of(const Settings& settings) {
  std::string text;
  for (const auto& [key, value] : describe(settings)) text += key + "=" + value + " ";
  return text;
}

/// A method with its defaults, but a small light map and few samples: tests draw many pictures.
inline Settings small_settings(Method method, unsigned light_resolution_px = 256) {
  return {.method = method, .light_resolution_px = light_resolution_px, .samples = 16};
}

/// Those, of every method.
inline std::vector<Settings> every_method(unsigned light_resolution_px = 256) {
  std::vector<Settings> all;
  for (const MethodInfo& info : methods()) all.push_back(small_settings(info.method, light_resolution_px));
  return all;
}

/// A method with each value of each option that the report measures, one at a time, the defaults first. Not light-res, which
/// tests choose, nor large numbers of samples.
inline std::vector<Settings> with_each_option(Method method, unsigned light_resolution_px = 256) {
  std::vector<Settings> all{small_settings(method, light_resolution_px)};
  std::vector<std::string> seen{description_of(all.front())};
  for (const Option& option : options_of(method)) {
    if (option.name == "light-res" || option.name == "samples") continue;
    std::istringstream values{std::string(option.measured)};
    for (std::string value; values >> value;) {
      Settings settings = small_settings(method, light_resolution_px);
      option.set(settings, value);
      if (std::find(seen.begin(), seen.end(), description_of(settings)) != seen.end()) continue;
      seen.push_back(description_of(settings));
      all.push_back(settings);
    }
  }
  return all;
}

}  // namespace halfshade
