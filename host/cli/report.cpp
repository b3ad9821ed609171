// Speed against error, measured: report.json, report.csv and a page.
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "cli/draw_options.hpp"
#include "commit.hpp"
#include "image_io.hpp"
#include "light_view.hpp"
#include "read_file.hpp"
#include "report.hpp"
#include "report_page.hpp"

namespace halfshade {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using Json = nlohmann::ordered_json;

constexpr int report_format = 1;

struct ReportArguments {
  std::vector<fs::path> scenes;
  std::vector<std::string> methods, light_res;
  std::string truth_samples, repeat, resolution, device, threads;
  fs::path folder = "out/report", cache;
  bool quick = false, table = false;
};

ReportOptions options_of(const ReportArguments& arguments) {
  ReportOptions options;
  options.names = arguments.methods;
  options.quick = arguments.quick;
  if (arguments.quick) {
    options.truth_samples = 256;
    options.repeats = 5;
  }
  for (const std::string& text : arguments.light_res)
    options.light_resolutions_px.push_back(static_cast<unsigned>(parse_integer("--light-res", text, 1, 16384)));
  if (!arguments.truth_samples.empty())
    options.truth_samples = static_cast<unsigned>(parse_integer("--truth-samples", arguments.truth_samples, 1, 65536));
  if (!arguments.repeat.empty()) options.repeats = static_cast<unsigned>(parse_integer("--repeat", arguments.repeat, 1, 10'000));
  return options;
}

/// One line that changes on a terminal, and a line a step where the output is kept.
class Progress {
 public:
  Progress() : on_terminal_(isatty(STDERR_FILENO) != 0) {}
  ~Progress() { clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// What is being done now; shown on terminals only.
  void now(const std::string& text) {
    if (!on_terminal_) return;
    fmt::print(stderr, "\r\x1b[K{}", text);
    std::fflush(stderr);
  }
  /// What is worth a line.
  void step(const std::string& text) {
    clear();
    fmt::print(stderr, "{}\n", text);
  }
  void clear() {
    if (on_terminal_) fmt::print(stderr, "\r\x1b[K");
  }

 private:
  bool on_terminal_;
};

std::string duration_text(double ms) {
  return fmt::format("{:%H:%M:%S}", std::chrono::seconds(std::lround(ms / 1000.0)));
}

std::string processor_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.starts_with("model name")) return line.substr(line.find(": ") + 2);
  return "unknown";
}

Json to_json(const ErrorFigures& figures) {
  Json json = Json::object();
  for (const NamedFigure& figure : named_figures(figures)) {
    if (figure.is_count)
      json[std::string(figure.name)] = static_cast<std::uint64_t>(figure.value);
    else
      json[std::string(figure.name)] = figure.value;
  }
  return json;
}

ErrorFigures figures_from(const Json& json) {
  ErrorFigures figures;
  figures.rmse = json.at("rmse");
  figures.penumbra_rmse = json.at("penumbra_rmse");
  figures.bias = json.at("bias");
  figures.max_error = json.at("max_error");
  figures.p999_error = json.at("p999_error");
  figures.bad_fraction = json.at("bad_fraction");
  figures.false_lit = json.at("false_lit");
  figures.false_umbra = json.at("false_umbra");
  figures.nonfinite = json.at("nonfinite");
  figures.counted_pixels = json.at("counted_pixels");
  figures.penumbra_pixels = json.at("penumbra_pixels");
  return figures;
}

Json to_json(const Measurement& row) {
  Json settings = Json::object(), stages = Json::object();
  for (const auto& [name, value] : row.candidate.settings) settings[name] = value;
  for (const StageTime& stage : row.stages) stages[stage.stage] = stage.time_ms;
  return {{"method", row.candidate.name},
          {"kind", row.candidate.is_rival() ? "rival" : "method"},
          {"label", row.candidate.label()},
          {"is_default", row.candidate.is_default},
          {"settings", settings},
          {"time_ms", {{"median", row.median_ms()}, {"min", row.min_ms()}, {"cold", row.cold_ms}, {"runs", row.times_ms}}},
          {"stages_ms", stages},
          {"figures", to_json(row.figures)},
          {"negative_pixels", row.negative_pixels ? Json(*row.negative_pixels) : Json(nullptr)},
          {"picture", row.picture}};
}

/// Takes over what an interrupted run has measured of this row.
void restore(Measurement& row, const Json& json) {
  row.cold_ms = json.at("time_ms").at("cold");
  row.times_ms = json.at("time_ms").at("runs").get<std::vector<double>>();
  for (const auto& [stage, ms] : json.at("stages_ms").items()) row.stages.push_back({stage, ms.get<double>()});
  row.figures = figures_from(json.at("figures"));
  if (!json.at("negative_pixels").is_null()) row.negative_pixels = json.at("negative_pixels").get<std::uint32_t>();
  row.picture = json.at("picture");
}

/// Rows with what follows from all of them together: which are not beaten, and what rays need for the same error.
Json results_of(const std::vector<Measurement>& rows) {
  std::vector<Tradeoff> all, rays;
  for (const Measurement& row : rows) {
    all.push_back({row.median_ms(), row.figures.penumbra_rmse});
    if (row.candidate.is_rival()) rays.push_back(all.back());
  }
  const std::vector<bool> on_front = pareto_front(all);
  Json results = Json::array();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    Json result = to_json(rows[i]);
    result["pareto"] = static_cast<bool>(on_front[i]);
    const std::optional<double> rays_ms = rays_time_at_error(rays, all[i].error);
    result["rays_time_at_error_ms"] = rays_ms ? Json(*rays_ms) : Json(nullptr);
    results.push_back(std::move(result));
  }
  return results;
}

/// report.json and what belongs to it. Saved after every step, so that an interruption keeps what is done.
class ReportFolder {
 public:
  ReportFolder(fs::path folder, Json head) : folder_(std::move(folder)), json_(std::move(head)) {
    std::error_code error;
    fs::create_directories(folder_ / "pictures", error);
    if (error || access(folder_.c_str(), W_OK | X_OK) != 0) {
      throw InputError(fmt::format("{}: expected an output folder that can be written to ({}); choose another with -o",
                                   folder_.string(), error ? error.message() : "no permission"));
    }
    const fs::path path = folder_ / "report.json";
    if (!fs::exists(path)) return;
    // Only what the same program has begun, and not finished, is gone on with. Kernels read from a folder can be any.
    const Json before = Json::parse(read_file(path, "a report"), nullptr, false);
    if (!before.is_object() || before.value("complete", true) || std::getenv("HALFSHADE_KERNELS") != nullptr) return;
    const auto same = [&](const char* key) { return before.contains(key) && before[key] == json_[key]; };
    if (!(same("format") && same("version") && same("commit") && same("device") && same("host"))) return;
    for (const Json& scene : before.at("scenes"))
      for (const Json& light : scene.at("lights")) earlier_.push_back(light);
    if (before.contains("earlier")) earlier_.insert(earlier_.end(), before["earlier"].begin(), before["earlier"].end());
  }

  const fs::path& path() const { return folder_; }

  /// What an interrupted run holds of a row of the light with this truth.
  const Json* before(const std::string& truth_key, const std::string& label) const {
    for (const Json& light : earlier_)
      if (light.at("truth_key") == truth_key)
        for (const Json& result : light.at("results"))
          if (result.at("label") == label && fs::exists(folder_ / result.at("picture").get<std::string>())) return &result;
    return nullptr;
  }

  Json& json() { return json_; }

  void save() const {
    // What the run before has of lights that this one has not come to yet stays until it has.
    Json all = json_;
    if (!json_.at("complete").get<bool>()) {
      Json waiting = Json::array();
      std::copy_if(earlier_.begin(), earlier_.end(), std::back_inserter(waiting),
                   [this](const Json& light) { return !has_light(light.at("truth_key")); });
      if (!waiting.empty()) all["earlier"] = std::move(waiting);
    }
    write("report.json", all.dump(1) + "\n");
  }
  void save_all(bool complete) {
    json_["complete"] = complete;
    write("report.csv", report_csv(json_));
    write("index.html", report_page(json_, folder_));
    save();
  }

  std::string save_picture(const std::string& name, glm::uvec2 resolution, int channels,
                           std::span<const unsigned char> bytes) const {
    const std::string file = "pictures/" + name + ".png";
    write_file_whole(folder_ / file, encode_png(resolution, channels, bytes));
    return file;
  }
  std::string save_plane(const std::string& name, glm::uvec2 resolution, const std::vector<float>& plane) const {
    std::vector<unsigned char> bytes(plane.size());
    for (std::size_t i = 0; i < plane.size(); ++i)
      bytes[i] = static_cast<unsigned char>(255.0f * std::clamp(plane[i] > 0.0f ? plane[i] : 0.0f, 0.0f, 1.0f) + 0.5f);
    return save_picture(name, resolution, 1, bytes);
  }
  std::string save_shaded(const std::string& name, glm::uvec2 resolution, const std::vector<glm::vec4>& rgb) const {
    std::vector<unsigned char> bytes;
    bytes.reserve(rgb.size() * 3);
    for (const glm::vec4& pixel : rgb)
      for (int c = 0; c < 3; ++c) bytes.push_back(srgb_byte_from_linear(pixel[c]));
    return save_picture(name, resolution, 3, bytes);
  }

 private:
  bool has_light(const Json& truth_key) const {
    for (const Json& scene : json_.at("scenes"))
      for (const Json& light : scene.at("lights"))
        if (light.at("truth_key") == truth_key) return true;
    return false;
  }
  void write(const char* name, const std::string& text) const {
    write_file_whole(folder_ / name, {reinterpret_cast<const unsigned char*>(text.data()), text.size()});
  }

  fs::path folder_;
  Json json_;
  std::vector<Json> earlier_;  ///< lights of the interrupted run
};

/// A name as part of a file's.
std::string file_name_part(std::string name) {
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-') c = '_';
  return name;
}

/// Measures all rows of one light in turns. `saved` is called after each step that should outlast an interruption.
void measure(ReportScene& scene, const LightCase& light_case, std::vector<Measurement>& rows, unsigned repeats,
             const std::string& title, Progress& progress,
             const std::function<void(std::size_t row, const std::vector<float>& visibility)>& planes,
             const std::function<void()>& saved) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    Measurement& row = rows[i];
    if (row.times_ms.size() >= repeats) continue;
    progress.now(fmt::format("{}: first run {}/{}, {}", title, i + 1, rows.size(), row.candidate.label()));
    // A run that goes on still warms up: kernels and buffers are this process's.
    std::vector<float> visibility;
    const double first_ms = scene.run(light_case, row.candidate, &visibility);
    if (row.cold_ms > 0.0) continue;
    row.cold_ms = first_ms;
    row.figures = compare_visibility(visibility, light_case.truth, light_case.receivers.kinds);
    planes(i, visibility);
    // The median of each pass over a few frames.
    std::vector<std::vector<double>> passes;
    for (unsigned frame = 0; frame < std::min(repeats, 5u); ++frame) {
      row.stages = scene.stage_times(light_case, row.candidate);
      passes.resize(row.stages.size());
      for (std::size_t stage = 0; stage < row.stages.size(); ++stage) passes[stage].push_back(row.stages[stage].time_ms);
    }
    for (std::size_t stage = 0; stage < row.stages.size(); ++stage) row.stages[stage].time_ms = median_of(passes[stage]);
    row.negative_pixels = scene.negative_pixels(light_case, row.candidate);
    saved();
  }
  // In turns, so that drift of the machine hits all alike.
  for (unsigned round = 0; round < repeats; ++round) {
    double left_ms = 0.0;
    for (const Measurement& row : rows) {
      const double run_ms = row.times_ms.empty() ? row.cold_ms : row.median_ms();
      left_ms += run_ms *
                 static_cast<double>(repeats - std::min<std::size_t>(repeats, std::max<std::size_t>(round, row.times_ms.size())));
    }
    progress.now(fmt::format("{}: round {}/{}, {} left for this light", title, round + 1, repeats, duration_text(left_ms)));
    bool ran = false;
    for (Measurement& row : rows) {
      if (row.times_ms.size() > round) continue;
      row.times_ms.push_back(scene.run(light_case, row.candidate));
      ran = true;
    }
    if (ran) saved();
  }
}

void print_table(const Scene& scene, const Light& light, const RayScene& rays, const std::vector<Measurement>& rows) {
  const Json results = results_of(rows);
  const ErrorFigures first = rows.empty() ? ErrorFigures{} : rows.front().figures;
  fmt::print("\n{}, light {}, {}x{}; {} counted pixels, {} in penumbra; tree built in {:.1f} ms\n", scene.name, light.name,
             scene.camera.resolution.x, scene.camera.resolution.y, first.counted_pixels, first.penumbra_pixels, rays.build_ms());
  fmt::print("{:<80} {:>9} {:>9} {:>8} {:>8} {:>8} {:>7} {:>7} {:>7} {:>6} {:>6} {:>4} {:>4} {:>9}\n", "method (* not beaten)",
             "median ms", "min ms", "rmse", "pen_rmse", "bias", "max", "p99.9", "bad", "lit!", "umbra!", "nan", "neg",
             "rays need");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Measurement& row = rows[i];
    const ErrorFigures& f = row.figures;
    const Json& rays_ms = results[i]["rays_time_at_error_ms"];
    fmt::print("{:<80} {:>9.2f} {:>9.2f} {:>8.5f} {:>8.5f} {:>+8.4f} {:>7.4f} {:>7.4f} {:>7.4f} {:>6} {:>6} {:>4} {:>4} {:>9}\n",
               (results[i]["pareto"].get<bool>() ? "* " : "  ") + row.candidate.label(), row.median_ms(), row.min_ms(), f.rmse,
               f.penumbra_rmse, f.bias, f.max_error, f.p999_error, f.bad_fraction, f.false_lit, f.false_umbra, f.nonfinite,
               row.negative_pixels ? fmt::format("{}", *row.negative_pixels) : "",
               rays_ms.is_null() ? ">" : fmt::format("{:.1f}", rays_ms.get<double>()));
  }
  std::fflush(stdout);
}

Json report_head(const ReportOptions& options, const Device& device, const std::string& command) {
  const DeviceInfo& info = device.info();
  return {{"format", report_format},
          {"complete", false},
          {"version", version()},
          {"commit", HALFSHADE_COMMIT},
          {"date", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)))},
          {"command", command},
          {"device", {{"name", info.name}, {"driver", info.driver}, {"platform", info.platform_name}, {"version", info.version}}},
          {"host", processor_name()},
          {"truth_samples", options.truth_samples},
          {"repeats", options.repeats},
          {"scenes", Json::array()}};
}

void run_report(const ReportArguments& arguments, const std::string& command) {
  const ReportOptions options = options_of(arguments);
  const std::vector<Candidate> all = candidates(options);
  const unsigned threads =
      arguments.threads.empty() ? 0 : static_cast<unsigned>(parse_integer("--threads", arguments.threads, 0, 1024));
  const TruthCache cache(arguments.cache);
  DrawOptions draw;
  draw.resolution = arguments.resolution;
  draw.device = arguments.device;
  draw.threads = arguments.threads;
  std::vector<Scene> scenes;  // all read before any is measured: a long run must not fail at its end
  for (const fs::path& path : arguments.scenes) {
    draw.scene_path = path;
    const Scene loaded = draw.load();
    scenes.push_back(scene_at_frame(loaded, loaded.animation.first_frame));
  }
  const std::shared_ptr<Device> device = draw.open_device();
  std::optional<ReportFolder> folder;
  if (!arguments.table) folder.emplace(arguments.folder, report_head(options, *device, command));

  Progress progress;
  for (std::size_t s = 0; s < scenes.size(); ++s) {
    ReportScene scene(scenes[s], device, threads);
    const glm::uvec2 resolution = scenes[s].camera.resolution;
    if (folder) {
      folder->json()["scenes"].push_back({{"name", scenes[s].name},
                                          {"path", arguments.scenes[s].string()},
                                          {"resolution", {resolution.x, resolution.y}},
                                          {"triangles", scene.triangle_count()},
                                          {"lights", Json::array()}});
    }
    for (std::size_t light = 0; light < scenes[s].lights.size(); ++light) {
      const std::string& light_name = scenes[s].lights[light].name;
      const std::string title = fmt::format("{}/{} {}, light {}", s + 1, scenes.size(), scenes[s].name, light_name);
      const Clock::time_point begin = Clock::now();
      const LightCase light_case = scene.light_case(light, cache, options.truth_samples, [&](double done) {
        const double elapsed_ms = std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
        const std::string left = done > 0.05 ? fmt::format(", {} left", duration_text(elapsed_ms * (1.0 - done) / done)) : "";
        progress.now(fmt::format("{}: truth {:.0f} %{}", title, 100 * done, left));
      });
      std::vector<Measurement> rows;
      for (const Candidate& candidate : all) {
        const Settings* settings = std::get_if<Settings>(&candidate.how);
        if (settings != nullptr &&
            !std::ranges::all_of(scenes[s].lights, [&](const Light& one) { return can_draw(*settings, one); }))
          continue;  // frames are drawn with all lights
        Measurement& row = rows.emplace_back();
        row.candidate = candidate;
      }
      if (!folder) {
        measure(
            scene, light_case, rows, options.repeats, title, progress, [](auto...) {}, [] {});
      } else {
        for (Measurement& row : rows)
          if (const Json* before = folder->before(light_case.key, row.candidate.label())) restore(row, *before);
        const std::string prefix =
            fmt::format("{}-{}-{}", file_name_part(scenes[s].name), file_name_part(light_name), light_case.key.substr(0, 8));
        Json& lights = folder->json()["scenes"][s]["lights"];
        lights.push_back(
            {{"name", light_name},
             {"radius", disc_radius(scenes[s].lights[light])},
             {"truth_key", light_case.key},
             {"tree_build_ms", scene.rays().build_ms()},
             {"rays_threads", scene.rays().threads()},
             {"pictures",
              {{"truth", {{"picture", folder->save_plane(prefix + "-truth", resolution, light_case.truth)}}},
               {"dark", {{"picture", folder->save_shaded(prefix + "-dark", resolution, scene.shaded(light_case, 0.0f))}}},
               {"lit", {{"picture", folder->save_shaded(prefix + "-lit", resolution, scene.shaded(light_case, 1.0f))}}}}},
             {"results", Json::array()}});
        measure(
            scene, light_case, rows, options.repeats, title, progress,
            [&](std::size_t row, const std::vector<float>& visibility) {
              const std::string name = fmt::format("{}-{}", prefix, file_name_part(rows[row].candidate.label()));
              rows[row].picture = folder->save_plane(name, resolution, visibility);
            },
            [&] {
              std::vector<Measurement> done;  // rows without figures yet are none
              std::copy_if(rows.begin(), rows.end(), std::back_inserter(done),
                           [](const Measurement& row) { return row.cold_ms > 0.0; });
              lights.back()["results"] = results_of(done);
              folder->save();
            });
        lights.back()["results"] = results_of(rows);
        folder->save_all(s + 1 == scenes.size() && light + 1 == scenes[s].lights.size());
        progress.step(fmt::format("{}: {} rows done", title, rows.size()));
      }
      progress.clear();
      print_table(scenes[s], scenes[s].lights[light], scene.rays(), rows);
    }
  }
  if (folder) fmt::print("\nThe page: {}\n", fs::absolute(folder->path() / "index.html").lexically_normal().string());
}

/// The command line as it could be typed again.
std::string command_text(const CLI::App& program) {
  std::string text = "halfshade report";
  for (const CLI::Option* option : program.get_options()) {
    for (const std::string& result : option->results()) {
      const std::string name = option->get_positional() ? "" : option->get_name() + (option->get_expected_min() == 0 ? "" : " ");
      const std::string value = option->get_expected_min() == 0 && !option->get_positional() ? "" : result;
      text += " " + name + value;
    }
  }
  return text;
}

}  // namespace

void add_report(CLI::App& program) {
  CLI::App* command = program.add_subcommand("report", "Measure speed against error, with rays as truth and rival");
  const auto arguments = std::make_shared<ReportArguments>();
  command->add_option("SCENE", arguments->scenes, "Scene files (JSON, see README)")->required()->option_text("...");
  command->add_option("-o,--output", arguments->folder, "Output folder, made if missing (default: out/report)")
      ->option_text("DIR");
  command->add_option("-m,--methods", arguments->methods, "Methods and rivals (rays, rays-adaptive) (default: all)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->option_text("M[,M...]");
  command->add_option("--light-res", arguments->light_res, "Light map resolutions (default: 256 to 4096)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->option_text("N[,N...]");
  command->add_option("--truth-samples", arguments->truth_samples, "Rays a pixel of the truth (default: 1024)")->option_text("N");
  command->add_option("--repeat", arguments->repeat, "Timed runs after a warm-up (default: 11)")->option_text("N");
  command->add_flag("--quick", arguments->quick, "A minute: fewer settings, 256 rays, 5 runs");
  command->add_flag("--table", arguments->table, "Only print the table, write nothing");
  command->add_option("--cache", arguments->cache, "Where truths are kept (default: the user's cache)")->option_text("DIR");
  command->add_option("--resolution", arguments->resolution, "Instead of the scenes' camera resolution")->option_text("WxH");
  command->add_option("--device", arguments->device, "OpenCL device: index, P:D or part of a name (see: devices)")
      ->option_text("D");
  command->add_option("--threads", arguments->threads, "Threads of a CPU device and of rays, 0 for all (default: 0)")
      ->option_text("N");
  command->footer(
      "Writes DIR/report.json, report.csv and index.html, a page that needs nothing else. Interrupted, it goes\n"
      "on where it was when called again. Times are whole paths, meshes and G-buffer being on the device.\n\n"
      "Examples:\n"
      "  halfshade report data/scenes/primitives.json --quick\n"
      "  halfshade report data/scenes/*.json -o out/all\n"
      "  halfshade report data/scenes/boxes.json -m smoothies,rays --light-res 512,1024 --table\n");
  command->callback([arguments, command] { run_report(*arguments, command_text(*command)); });
}

}  // namespace halfshade
