// Speed against error, measured.
#include <fmt/format.h>

#include <memory>

#include "cli/commands.hpp"
#include "cli/draw_options.hpp"
#include "report.hpp"

namespace halfshade {
namespace {

namespace fs = std::filesystem;

struct ReportArguments {
  std::vector<fs::path> scenes;
  std::vector<std::string> methods, light_res;
  std::string truth_samples, repeat, resolution, device, threads;
  fs::path cache;
  bool quick = false;
};

void print_table(const Scene& scene, const Light& light, const RayScene& rays, const std::vector<Measurement>& rows) {
  fmt::print("\n{}, light {}, {}x{}; {} counted pixels, {} in penumbra; tree built in {:.1f} ms\n", scene.name, light.name,
             scene.camera.resolution.x, scene.camera.resolution.y, rows.empty() ? 0 : rows[0].figures.counted_pixels,
             rows.empty() ? 0 : rows[0].figures.penumbra_pixels, rays.build_ms());
  fmt::print("{:<72} {:>9} {:>9} {:>8} {:>8} {:>8} {:>7} {:>7} {:>7} {:>6} {:>6} {:>4}\n", "method", "median ms", "min ms",
             "rmse", "pen_rmse", "bias", "max", "p99.9", "bad", "lit!", "umbra!", "nan");
  for (const Measurement& row : rows) {
    const ErrorFigures& f = row.figures;
    fmt::print("{:<72} {:>9.2f} {:>9.2f} {:>8.5f} {:>8.5f} {:>+8.4f} {:>7.4f} {:>7.4f} {:>7.4f} {:>6} {:>6} {:>4}\n",
               row.candidate.label(), row.median_ms(), row.min_ms(), f.rmse, f.penumbra_rmse, f.bias, f.max_error, f.p999_error,
               f.bad_fraction, f.false_lit, f.false_umbra, f.nonfinite);
  }
}

void run_report(const ReportArguments& arguments) {
  ReportOptions options;
  options.names = arguments.methods;
  options.quick = arguments.quick;
  for (const std::string& text : arguments.light_res)
    options.light_resolutions_px.push_back(static_cast<unsigned>(parse_integer("--light-res", text, 1, 16384)));
  if (!arguments.truth_samples.empty())
    options.truth_samples = static_cast<unsigned>(parse_integer("--truth-samples", arguments.truth_samples, 1, 65536));
  if (!arguments.repeat.empty()) options.repeats = static_cast<unsigned>(parse_integer("--repeat", arguments.repeat, 1, 10'000));
  const std::vector<Candidate> all = candidates(options);

  const TruthCache cache(arguments.cache);
  std::shared_ptr<Device> device;
  for (const fs::path& path : arguments.scenes) {
    DrawOptions draw;
    draw.scene_path = path;
    draw.resolution = arguments.resolution;
    draw.device = arguments.device;
    draw.threads = arguments.threads;
    const Scene loaded = draw.load();
    if (!device) device = draw.open_device();
    const unsigned threads =
        arguments.threads.empty() ? 0 : static_cast<unsigned>(parse_integer("--threads", arguments.threads, 0, 1024));
    ReportScene scene(scene_at_frame(loaded, loaded.animation.first_frame), device, threads);
    for (std::size_t light = 0; light < loaded.lights.size(); ++light) {
      const LightCase light_case = scene.light_case(light, cache, options.truth_samples, {});
      std::vector<Measurement> rows;
      for (const Candidate& candidate : all) {
        Measurement& row = rows.emplace_back();
        row.candidate = candidate;
        std::vector<float> visibility;
        row.cold_ms = scene.run(light_case, candidate, &visibility);
        row.figures = compare_visibility(visibility, light_case.truth, light_case.receivers.kinds);
      }
      // In turns, so that drift of the machine hits all alike.
      for (unsigned repeat = 0; repeat < options.repeats; ++repeat)
        for (Measurement& row : rows) row.times_ms.push_back(scene.run(light_case, row.candidate));
      print_table(loaded, loaded.lights[light], scene.rays(), rows);
      std::fflush(stdout);
    }
  }
}

}  // namespace

void add_report(CLI::App& program) {
  CLI::App* command = program.add_subcommand("report", "Measure speed against error, with rays as truth and rival");
  const auto arguments = std::make_shared<ReportArguments>();
  command->add_option("SCENE", arguments->scenes, "Scene files (JSON, see README)")->required()->option_text("...");
  command->add_option("-m,--methods", arguments->methods, "Methods and rivals (rays, rays-adaptive), or 'all' (default: all)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->option_text("M[,M...]");
  command->add_option("--light-res", arguments->light_res, "Light map resolutions (default: 256,512,1024,2048,4096)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->option_text("N[,N...]");
  command->add_option("--truth-samples", arguments->truth_samples, "Rays a pixel of the truth (default: 1024)")->option_text("N");
  command->add_option("--repeat", arguments->repeat, "Timed runs after a warm-up (default: 11)")->option_text("N");
  command->add_flag("--quick", arguments->quick, "Fewer settings: about a minute a scene");
  command->add_option("--cache", arguments->cache, "Where truths are kept (default: $XDG_CACHE_HOME/halfshade)")
      ->option_text("DIR");
  command->add_option("--resolution", arguments->resolution, "Instead of the scenes' camera resolution")->option_text("WxH");
  command->add_option("--device", arguments->device, "OpenCL device: index, P:D or part of a name (see: devices)")
      ->option_text("D");
  command->add_option("--threads", arguments->threads, "Threads of a CPU device and of rays, 0 for all (default: 0)")
      ->option_text("N");
  command->callback([arguments] { run_report(*arguments); });
}

}  // namespace halfshade
