// How long a frame takes: each stage by the device's clock, whole paths by the wall's.
#include <CL/cl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/commands.hpp"
#include "cli/draw_options.hpp"
#include "cli/parse.hpp"
#include "cli/progress.hpp"
#include "cli/target_options.hpp"
#include "halfshade/halfshade.hpp"
#include "methods/option.hpp"
#include "report/device_plane.hpp"
#include "report/timing.hpp"

namespace halfshade {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view default_methods = "all";

struct BenchOptions {
  std::filesystem::path scene_path;
  DrawOptions draw;
  TargetOptions target;
  std::string repeat = "11";
  bool json = false;
};

/// A named series of times in milliseconds, one a repeat.
struct Series {
  std::string name;
  std::vector<double> times_ms;

  double median_ms() const { return median_of(times_ms); }
  double min_ms() const { return min_of(times_ms); }
};

struct MethodTimes {
  Settings settings;
  std::vector<Series> stages;  ///< of `render`, from OpenCL events; launches of one name within a frame are summed
  Series gbuffer{"G-buffer", {}};
  std::vector<Series> visibility;  ///< one a light: every pass from resident meshes and G-buffer to the finished plane
  Series frame{"whole frame", {}};
  FrameStats stats;
};

/// Wall time of enqueueing `work` and everything it leads to on the device.
template <typename Work>
double wall_ms(const Device& device, Work work) {
  const Clock::time_point begin = Clock::now();
  work();
  finish(device);
  return ms_since(begin);
}

/// Adds one frame's stage times to the series of their names, in the order of first appearance.
void add_stages(std::vector<Series>& stages, const std::vector<StageTime>& times, std::size_t repeat) {
  for (const StageTime& time : times) {
    auto series = std::find_if(stages.begin(), stages.end(), [&](const Series& known) { return known.name == time.stage; });
    if (series == stages.end()) series = stages.insert(stages.end(), Series{time.stage, {}});
    series->times_ms.resize(repeat + 1);
    series->times_ms[repeat] += time.time_ms;
  }
}

MethodTimes measure(Renderer& renderer, const Device& device, const Scene& scene, const Settings& settings, std::size_t repeats,
                    FirstFrameWatch& watch) {
  MethodTimes times;
  times.settings = settings;
  for (const Light& light : scene.lights) times.visibility.push_back({light.name, {}});
  const glm::uvec2 resolution = scene.camera.resolution;
  const DevicePlane<float> plane(device, std::size_t{resolution.x} * resolution.y);
  const auto run_once = [&](MethodTimes& into, std::size_t repeat) {
    GBuffer gbuffer;
    into.gbuffer.times_ms.push_back(wall_ms(device, [&] { gbuffer = renderer.enqueue_gbuffer(); }));
    for (std::size_t light = 0; light < scene.lights.size(); ++light) {
      into.visibility[light].times_ms.push_back(wall_ms(device, [&] {
        renderer.enqueue_visibility({.gbuffer = gbuffer, .light = light, .settings = settings, .visibility = plane.get()});
      }));
    }
    into.frame.times_ms.push_back(wall_ms(device, [&] { renderer.render(settings); }));
    add_stages(into.stages, renderer.stage_times(), repeat);
  };
  MethodTimes warm_up = times;  // builds kernels for each local size and grows buffers; not counted
  run_once(warm_up, 0);
  watch.arrived();
  for (std::size_t repeat = 0; repeat < repeats; ++repeat) run_once(times, repeat);
  times.stats = renderer.stats();
  return times;
}

Json to_json(const Series& series) {
  return {{"median", series.median_ms()}, {"min", series.min_ms()}};
}

Json to_json(const MethodTimes& times) {
  Json json;
  for (const auto& [name, value] : describe(times.settings)) json[name] = value;
  json["stages_ms"] = Json::object();
  for (const Series& stage : times.stages) json["stages_ms"][stage.name] = to_json(stage);
  json["gbuffer_ms"] = to_json(times.gbuffer);
  json["lights"] = Json::array();
  for (std::size_t i = 0; i < times.visibility.size(); ++i) {
    const FrameStats::PerLight& stats = times.stats.lights.at(i);
    json["lights"].push_back({{"name", times.visibility[i].name},
                              {"visibility_ms", to_json(times.visibility[i])},
                              {"light_map_px", {stats.light_map_px.x, stats.light_map_px.y}},
                              {"silhouette_edges", stats.silhouette_edges},
                              {"features", stats.features},
                              {"feature_tile_references", stats.feature_tile_references},
                              {"triangle_tile_references", stats.triangle_tile_references},
                              {"negative_pixels", stats.negative_pixels.value_or(0)},
                              {"skipped", stats.skipped}});
  }
  json["frame_ms"] = to_json(times.frame);
  return json;
}

void print_table(const MethodTimes& times) {
  std::string title;
  for (const auto& [name, value] : describe(times.settings)) title += title.empty() ? value : fmt::format(", {} {}", name, value);
  const auto row = [](const std::string& name, const Series& series, const std::string& note = "") {
    fmt::print("  {:<44} {:>9.3f} {:>9.3f}{}\n", name, series.median_ms(), series.min_ms(), note);
  };
  fmt::print("\n{}\n  {:<44} {:>9} {:>9}\n", title, "stage", "median ms", "min ms");
  for (const Series& stage : times.stages) row(stage.name, stage);
  fmt::print("  wall clock\n");
  row("G-buffer", times.gbuffer);
  for (std::size_t i = 0; i < times.visibility.size(); ++i) {
    const FrameStats::PerLight& stats = times.stats.lights.at(i);
    const std::string note = stats.skipped ? "  nothing casts"
                                           : fmt::format("  map {}x{}, {} silhouette edges", stats.light_map_px.x,
                                                         stats.light_map_px.y, stats.silhouette_edges);
    row(times.visibility[i].name + ": all passes", times.visibility[i], note);
  }
  row("whole frame", times.frame);
}

void run_bench(const BenchOptions& options) {
  const std::vector<Settings> all_settings = options.draw.settings(default_methods);
  const auto repeats = static_cast<std::size_t>(parse_integer("--repeat", options.repeat, 1, 100'000));
  const Scene scene = options.target.load_first_frame(options.scene_path);

  const Clock::time_point begin = Clock::now();
  const std::shared_ptr<Device> device = options.target.open_device();
  Renderer renderer(device);
  const double start_up_ms = ms_since(begin);
  renderer.set_scene(scene);

  const glm::uvec2 resolution = scene.camera.resolution;
  Json json = {{"version", version()},
               {"scene", scene.name},
               {"device", device->info().name},
               {"resolution", {resolution.x, resolution.y}},
               {"repeat", repeats},
               {"start_up_ms", start_up_ms},
               {"methods", Json::array()}};
  if (!options.json) {
    fmt::print("{}, {}x{}, {} repeats after a warm-up; start-up with kernels {:.0f} ms\non {}\n", scene.name, resolution.x,
               resolution.y, repeats, start_up_ms, device->info().name);
  }
  Progress progress;
  for (const Settings& settings : all_settings) {
    FirstFrameWatch watch(progress, device->info());
    const MethodTimes times = measure(renderer, *device, scene, settings, repeats, watch);
    json["triangles"] = times.stats.triangles;
    json["methods"].push_back(to_json(times));
    if (!options.json) print_table(times);
    std::fflush(stdout);
  }
  if (options.json) fmt::print("{}\n", json.dump(2));
}

}  // namespace

void add_bench(CLI::App& program) {
  CLI::App* command = program.add_subcommand("bench", "Measure each stage and the whole path on a scene's first frame");
  const auto options = std::make_shared<BenchOptions>();
  command->add_option("SCENE", options->scene_path, "Scene file (JSON, see README)")->required()->option_text(" ");
  options->draw.add(*command, default_methods);
  options->target.add(*command, "a CPU device");
  command->add_option("--repeat", options->repeat, "Counted runs after a warm-up (default: 11)")->option_text("N");
  command->add_flag("--json", options->json, "Print JSON instead of tables");
  command->footer(
      "Stages are timed by OpenCL events during a whole frame. 'All passes' is the wall clock of one light's\n"
      "visibility, meshes and G-buffer being on the device; 'whole frame' adds the G-buffer and shading.\n\n"
      "Examples:\n"
      "  halfshade bench data/scenes/primitives.json\n"
      "  halfshade bench data/scenes/boxes.json -m exact --repeat 51 --json\n");
  command->callback([options] { run_bench(*options); });
}

}  // namespace halfshade
