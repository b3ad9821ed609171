// How a method compares with the reference in double precision (host/report/reference.hpp), light by light, on the frame of a
// scene file:
//
//   halfshade_compare_exact SCENE... [--method exact] [--samples 256] [--resolution WxH] [--light-res 1024] [--alias-free]
//                           [--shape wide|narrow] [--truth 0] [--frame N] [--worst 0]
//
// Prints one line a light: counted pixels; rmse and largest error; `differing`, pixels off by more than one and a half samples;
// `unexplained`, those of them that no place of the receiver within the G-buffer's tolerance makes up for; false_lit and
// false_umbra; negative pixels; pixels whose surface was not found; values that are not finite or not in 0..1.
// --truth 0 compares with the light's points of exact, --truth N with N points of another seed. --worst N lists the N worst
// pixels. The exit code says only whether it ran.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <numeric>

#include "light/light_model.hpp"
#include "report/reference.hpp"

namespace {

using namespace halfshade;

struct Options {
  std::vector<std::string> scenes;
  std::string method = "exact", resolution, shape;
  unsigned samples = 256, light_res = 1024, truth = 0, worst = 0;
  int frame = 0;
  bool alias_free = false;
};

void print_worst(const SurfacePixels& pixels, const Camera& camera, std::span<const float> depth, std::span<const float> seen,
                 std::span<const float> truth, unsigned count) {
  std::vector<std::size_t> order(pixels.pixels.size());
  std::iota(order.begin(), order.end(), 0);
  const auto error = [&](std::size_t i) { return std::abs(seen[pixels.pixels[i]] - truth[pixels.pixels[i]]); };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return error(a) > error(b); });
  for (std::size_t k = 0; k < std::min<std::size_t>(count, order.size()); ++k) {
    const std::uint32_t pixel = pixels.pixels[order[k]];
    const glm::dvec3 p = camera.position + pixels.points[order[k]].position;
    const double z = glm::dot(glm::normalize(camera.target - camera.position), p - camera.position);
    fmt::print("    pixel {},{} at ({:.9g}, {:.9g}, {:.9g}), depth off by {:.2g}: {:.6f}, reference {:.6f}\n",
               pixel % camera.resolution.x, pixel / camera.resolution.x, p.x, p.y, p.z, depth[pixel] - z, seen[pixel],
               truth[pixel]);
  }
}

void compare(const std::string& path, const Options& options, Renderer& renderer) {
  Scene scene = load_scene(path);
  if (options.frame != 0) scene = scene_at_frame(scene, options.frame);
  if (!options.resolution.empty() &&
      std::sscanf(options.resolution.c_str(), "%ux%u", &scene.camera.resolution.x, &scene.camera.resolution.y) != 2)
    throw InputError("--resolution: expected WIDTHxHEIGHT, found " + options.resolution);
  renderer.set_scene(scene);
  renderer.render({.method = method_from_name(options.method),
                   .light_resolution_px = options.light_res,
                   .samples = options.samples,
                   .alias_free = options.alias_free});
  const Frame frame = renderer.read_frame();
  const FrameStats stats = renderer.stats();
  const Reference reference(scene);
  for (std::size_t l = 0; l < scene.lights.size(); ++l) {
    const Light& light = scene.lights[l];
    const SurfacePixels pixels = reference.surface_pixels(scene.camera, frame.depth, frame.normal_ws, light);
    const unsigned count = disc_radius(light) <= 0.0 ? 1 : options.truth > 0 ? options.truth : options.samples;
    const std::vector<glm::dvec2> points = light_points(light, count, options.truth > 0 ? 0x7275'7468 : 0).points;
    const std::vector<float>& seen = frame.visibility[l];
    const ReferenceFigures figures = compare_with_reference(reference, light, pixels, seen, points);
    const auto outside = std::count_if(seen.begin(), seen.end(), [](float v) { return !(v >= 0.0f && v <= 1.0f); });
    fmt::print(
        "{} {} {}: counted {} penumbra {} rmse {:.6f} max {:.4f} differing {} unexplained {} false_lit {} false_umbra {} "
        "negative {} unplaced {} outside {}\n",
        path, light.name, options.method, figures.error.counted_pixels, figures.error.penumbra_pixels, figures.error.rmse,
        figures.error.max_error, figures.differing, figures.unexplained, figures.error.false_lit, figures.error.false_umbra,
        stats.lights[l].negative_pixels.value_or(0), pixels.unplaced, outside);
    if (options.worst > 0)
      print_worst(pixels, scene.camera, frame.depth, seen, reference.visibility(light, pixels, points), options.worst);
  }
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app("Compares a method with the reference in double precision");
  app.add_option("scenes", options.scenes, "scene files")->required();
  app.add_option("--method", options.method);
  app.add_option("--samples", options.samples);
  app.add_option("--resolution", options.resolution, "WIDTHxHEIGHT; by default the scene's");
  app.add_option("--light-res", options.light_res);
  app.add_option("--truth", options.truth, "points of the reference; 0: those of the method");
  app.add_option("--worst", options.worst, "how many pixels to list");
  app.add_option("--frame", options.frame, "of an animation");
  app.add_option("--shape", options.shape, "wide or narrow; by default the device's");
  app.add_flag("--alias-free", options.alias_free);
  CLI11_PARSE(app, argc, argv);
  try {
    if (!options.shape.empty()) setenv("HALFSHADE_KERNEL_SHAPE", options.shape.c_str(), 1);
    Renderer renderer(Device::open(""));
    for (const std::string& scene : options.scenes) compare(scene, options, renderer);
  } catch (const std::exception& error) {
    std::cerr << "halfshade_compare_exact: " << error.what() << '\n';
    return 1;
  }
}
