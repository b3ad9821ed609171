// A scene's frames as pictures.
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cstdio>
#include <ctime>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "cli/commands.hpp"
#include "cli/draw_options.hpp"
#include "cli/frame_files.hpp"
#include "cli/light_metadata.hpp"
#include "cli/progress.hpp"
#include "cli/target_options.hpp"
#include "halfshade/halfshade.hpp"
#include "image/image_io.hpp"
#include "image/whole_file.hpp"
#include "light/light_model.hpp"
#include "methods/option.hpp"
#include "report/timing.hpp"
#include "scene/animation.hpp"

namespace halfshade {
namespace {

namespace fs = std::filesystem;

/// The method where none is given: the library's own default.
std::string_view default_method() {
  return name_of(Settings{}.method);
}

struct RenderOptions {
  fs::path scene_path;
  DrawOptions draw;
  TargetOptions target;
  fs::path folder = "out";
  std::string frames;
  bool png = false, half = false, light_buffers = false, stats = false, quiet = false;
};

Metadata frame_metadata(const RenderOptions& options, const Settings& settings, const Scene& scene, int frame_number,
                        const DeviceInfo& device, double render_ms) {
  Metadata metadata = describe(settings);
  metadata.emplace_back("scene", options.scene_path.filename().string());
  metadata.emplace_back("frame", fmt::format("{}", frame_number));
  metadata.emplace_back("device", fmt::format("{} ({})", device.name, device.version));
  metadata.emplace_back("version", std::string(version()));
  metadata.emplace_back("time", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr))));
  metadata.emplace_back("render_ms", fmt::format("{:.3f}", render_ms));
  for (const Light& light : scene.lights) metadata.push_back(light_metadata(light));
  return metadata;
}

/// What the last frame was made of. A number that the method does not have is left out.
void print_stats(const std::string& title, const FrameStats& stats) {
  fmt::print("{}: {} triangles, {} vertices, {} edges\n", title, stats.triangles, stats.vertices, stats.edges);
  for (const FrameStats::PerLight& light : stats.lights) {
    if (light.skipped) {
      fmt::print("  {}: nothing casts a shadow in its reach\n", light.name);
      continue;
    }
    fmt::print("  {}: light map {}x{}, {} triangles in tiles", light.name, light.light_map_px.x, light.light_map_px.y,
               light.triangle_tile_references);
    if (!stats.features_name.empty() && light.silhouette_edges > 0)
      fmt::print(", {} silhouette edges, {} {}, {} in tiles", light.silhouette_edges, light.features, stats.features_name,
                 light.feature_tile_references);
    if (light.negative_pixels) fmt::print(", {} pixels with negative depth complexity", *light.negative_pixels);
    fmt::print("\n");
  }
  std::fflush(stdout);
}

/// Writes each map of each light beside the frame.
void write_light_buffers(const fs::path& folder, const std::string& stem, Renderer& renderer, std::span<const Light> lights,
                         const Metadata& metadata, Progress& progress) {
  for (std::size_t light = 0; light < lights.size(); ++light) {
    const std::span<const std::string_view> faces = model_of(lights[light].type).faces;
    for (std::size_t face = 0; face < faces.size(); ++face) {
      const std::string name = fmt::format("{}{}{}", lights[light].name, faces[face].empty() ? "" : ".", faces[face]);
      const LightBuffers buffers = renderer.read_light_buffers(light, face);
      if (buffers.planes.empty()) {
        progress.note(fmt::format("light '{}': nothing casts a shadow in its reach; it has no buffers", name));
        continue;
      }
      Metadata light_metadata = metadata;
      light_metadata.emplace_back("light", name);
      write_light_buffers_exr(folder / FrameFiles::light_buffers(stem, lights[light].name, faces[face]), buffers, light_metadata);
    }
  }
}

/// Draws a frame by one method and writes what is asked for. Returns the frame's file.
fs::path render_frame(const RenderOptions& options, const FrameFiles& files, Renderer& renderer, const Device& device,
                      const Scene& posed, int frame_number, const Settings& settings, Progress& progress, double& render_ms) {
  const Clock::time_point begin = Clock::now();
  renderer.render(settings);
  render_ms = ms_since(begin);

  const Frame frame = renderer.read_frame();
  const Metadata metadata = frame_metadata(options, settings, posed, frame_number, device.info(), render_ms);
  const std::string stem = files.stem(settings.method, frame_number);
  const fs::path path = options.folder / (stem + ".exr");
  std::vector<std::string> light_names;
  for (const Light& light : posed.lights) light_names.push_back(light.name);
  write_frame_exr(path, frame, light_names, options.half, metadata);
  if (options.png) write_frame_png(options.folder / (stem + ".png"), frame);
  if (options.light_buffers) write_light_buffers(options.folder, stem, renderer, posed.lights, metadata, progress);
  if (options.stats) {
    progress.clear();
    print_stats(stem, renderer.stats());
  }
  return path;
}

void run_render(const RenderOptions& options) {
  const std::vector<Settings> all_settings = options.draw.settings(default_method());
  const Scene scene = options.target.load(options.scene_path);
  const FrameRange range = frame_range(options.frames, scene.animation);
  const FrameFiles files(scene, options.png, options.light_buffers);
  check_frames(scene, range.first, range.last, options.scene_path.string());
  files.check_lengths(all_settings, range.last);
  prepare_output_folder(options.folder);
  remove_abandoned_files(options.folder, [&](std::string_view name) { return files.has(name, all_settings, range); });
  const std::shared_ptr<Device> device = options.target.open_device();
  Renderer renderer(device);

  const std::size_t steps = (static_cast<std::size_t>(range.last - range.first) + 1) * all_settings.size();
  std::size_t done = 0;
  const Clock::time_point begin = Clock::now();
  Progress progress(options.quiet);
  FirstFrameWatch watch(progress, device->info());
  for (int frame_number = range.first; frame_number <= range.last; ++frame_number) {
    const Scene posed = scene_at_frame(scene, frame_number);
    renderer.set_scene(posed);
    for (const Settings& settings : all_settings) {
      const double done_fraction = static_cast<double>(done) / static_cast<double>(steps);
      progress.now(fmt::format("{}/{}: frame {}, {}{}", done + 1, steps, frame_number, name_of(settings.method),
                               time_left_text(begin, done_fraction)));
      double render_ms = 0.0;
      const fs::path path = render_frame(options, files, renderer, *device, posed, frame_number, settings, progress, render_ms);
      watch.arrived();
      progress.done(fmt::format("{}/{}: {} ({:.1f} ms)", ++done, steps, path.string(), render_ms));
    }
  }
}

}  // namespace

void add_render(CLI::App& program) {
  CLI::App* command = program.add_subcommand("render", "Render a scene's frames to EXR");
  const auto options = std::make_shared<RenderOptions>();
  command->add_option("SCENE", options->scene_path, "Scene file (JSON, see README)")->required()->option_text(" ");
  options->draw.add(*command, default_method());
  options->target.add(*command, "a CPU device");
  command->add_option("-o,--output", options->folder, "Output folder, made if missing (default: out)")->option_text("DIR");
  command->add_option("--frames", options->frames, "Frames to render (default: the scene's animation range)")->option_text("A-B");
  command->add_flag("--png", options->png, "Also a PNG beside each EXR (clipped, sRGB)");
  command->add_flag("--half", options->half, "16-bit floats for shaded and visibility channels");
  command->add_flag("--light-buffers", options->light_buffers, "Also each light's buffers: shadow map, fins");
  command->add_flag("--stats", options->stats, "Print what each frame was made of: edges, tiles, light maps");
  command->add_flag("-q,--quiet", options->quiet, "No progress");
  command->footer(
      "Writes DIR/<scene>.<method>.<frame>.exr. An option that no chosen method uses is an error.\n\n"
      "Examples:\n"
      "  halfshade render data/scenes/primitives.json --png\n"
      "  halfshade render data/scenes/boxes.json -m pcss,exact --light-res 2048 -o boxes\n"
      "  halfshade render data/scenes/turntable.json --frames 1-24 --resolution 512x512 --half\n");
  command->callback([options] { run_render(*options); });
}

}  // namespace halfshade
