#include "report/report.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <ctime>
#include <fstream>
#include <optional>

#include "commit.hpp"
#include "light/light_model.hpp"
#include "report/measure.hpp"
#include "report/report_folder.hpp"
#include "report/report_json.hpp"
#include "report/report_scene.hpp"
#include "report/report_table.hpp"
#include "report/timing.hpp"

namespace halfshade {
namespace {

constexpr int report_format = 1;

std::string processor_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.starts_with("model name")) return line.substr(line.find(": ") + 2);
  return "unknown";
}

/// A name as part of a file's.
std::string file_name_part(std::string name) {
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-') c = '_';
  return name;
}

Json head_of(const ReportOptions& options, const DeviceInfo& device) {
  return {{"format", report_format},
          {"complete", false},
          {"version", version()},
          {"commit", HALFSHADE_COMMIT},
          {"date", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)))},
          {"command", options.command},
          {"device",
           {{"name", device.name}, {"driver", device.driver}, {"platform", device.platform_name}, {"version", device.version}}},
          {"host", processor_name()},
          {"truth_samples", options.truth_samples},
          {"repeats", options.repeats}};
}

/// The candidates that can draw a scene, whose frames are drawn with all lights.
std::vector<Measurement> rows_for(const std::vector<Candidate>& all, const Scene& scene) {
  std::vector<Measurement> rows;
  for (const Candidate& candidate : all) {
    const Settings* settings = std::get_if<Settings>(&candidate.how);
    if (settings != nullptr && !std::ranges::all_of(scene.lights, [&](const Light& light) { return can_draw(*settings, light); }))
      continue;
    rows.emplace_back().candidate = candidate;
  }
  return rows;
}

/// The measured rows: those of an unfinished run may have no figures yet.
Json results_so_far(const std::vector<Measurement>& rows) {
  std::vector<Measurement> measured;
  std::ranges::copy_if(rows, std::back_inserter(measured), [](const Measurement& row) { return row.cold_ms > 0.0; });
  return results_of(measured);
}

/// A report while it is made.
class ReportRun {
 public:
  ReportRun(const ReportOptions& options, const ReportEvents& events, const std::shared_ptr<Device>& device)
      : options_(options), events_(events), device_(device), candidates_(candidates(options.candidates)), cache_(options.cache) {
    if (!options.folder.empty()) folder_.emplace(options.folder, head_of(options, device->info()));
  }

  /// Measures all lights of a scene. `title` says which it is.
  void add(const ReportInput& input, const std::string& title, bool is_last) {
    ReportScene scene(input.scene, device_, options_.threads);
    const glm::uvec2 resolution = scene.scene().camera.resolution;
    if (folder_)
      folder_->begin_scene({{"name", input.scene.name},
                            {"path", input.path.string()},
                            {"resolution", {resolution.x, resolution.y}},
                            {"triangles", scene.triangle_count()}});
    const std::vector<Light>& lights = scene.scene().lights;
    for (std::size_t i = 0; i < lights.size(); ++i) {
      title_ = fmt::format("{}, light {}", title, lights[i].name);
      const LightCase light_case = light_case_of(scene, i);
      if (!light_case.check.holds() && folder_) folder_->withdraw();
      require(light_case.check, scene.scene().name, lights[i].name, resolution, cache_.path(light_case.key));
      std::vector<Measurement> rows = rows_for(candidates_, scene.scene());
      measure_light(scene, light_case, rows, is_last && i + 1 == lights.size());
      events_.table(report_table(scene.scene(), lights[i], scene.rays().build_ms(), rows));
    }
  }

 private:
  void now(const std::string& text) const { events_.now(fmt::format("{}: {}", title_, text)); }

  LightCase light_case_of(ReportScene& scene, std::size_t light) const {
    std::string doing;
    Clock::time_point begin;
    return scene.light_case(light, cache_, options_.truth_samples, [&](const char* what, double done) {
      if (doing != what) begin = Clock::now();
      doing = what;
      now(fmt::format("{} {:.0f} %{}", what, 100 * done, done > 0.05 ? time_left_text(begin, done) : ""));
    });
  }

  void measure_light(ReportScene& scene, const LightCase& light_case, std::vector<Measurement>& rows, bool is_last) {
    MeasureEvents events;
    events.now = [this](const std::string& text) { now(text); };
    if (!folder_) {
      measure(scene, light_case, rows, options_.repeats, events);
      return;
    }
    for (Measurement& row : rows)
      if (const Json* earlier = folder_->earlier_result(light_case.key, row.candidate.label())) restore(row, *earlier);
    const std::string prefix = begin_light(scene, light_case);
    events.has_figures = [&](Measurement& row, const std::vector<float>& visibility) {
      const std::string name = fmt::format("{}-{}", prefix, file_name_part(row.candidate.label()));
      row.picture = folder_->save_plane(name, scene.scene().camera.resolution, visibility);
    };
    events.saved = [&] {
      folder_->set_results(results_so_far(rows));
      folder_->save();
    };
    measure(scene, light_case, rows, options_.repeats, events);
    folder_->set_results(results_of(rows));
    folder_->save_all(is_last);
    events_.done(fmt::format("{}: {} rows done", title_, rows.size()));
  }

  /// Adds the light to the report and returns what its pictures' names begin with.
  std::string begin_light(ReportScene& scene, const LightCase& light_case) {
    const Light& light = scene.scene().lights[light_case.light];
    const glm::uvec2 resolution = scene.scene().camera.resolution;
    const std::string prefix =
        fmt::format("{}-{}-{}", file_name_part(scene.scene().name), file_name_part(light.name), light_case.key.substr(0, 8));
    const std::string truth = folder_->save_plane(prefix + "-truth", resolution, light_case.truth);
    const std::string dark = folder_->save_shaded(prefix + "-dark", resolution, scene.shaded(light_case, 0.0f));
    const std::string lit = folder_->save_shaded(prefix + "-lit", resolution, scene.shaded(light_case, 1.0f));
    folder_->begin_light(
        {{"name", light.name},
         {"radius", disc_radius(light)},
         {"truth_key", light_case.key},
         {"truth_check", to_json(light_case.check)},
         {"tree_build_ms", scene.rays().build_ms()},
         {"rays_threads", scene.rays().threads()},
         {"pictures", {{"truth", {{"picture", truth}}}, {"dark", {{"picture", dark}}}, {"lit", {{"picture", lit}}}}}});
    return prefix;
  }

  const ReportOptions& options_;
  const ReportEvents& events_;
  std::shared_ptr<Device> device_;
  std::vector<Candidate> candidates_;
  TruthCache cache_;
  std::optional<ReportFolder> folder_;
  std::string title_;  ///< of the light that is being measured
};

}  // namespace

void make_report(const std::vector<ReportInput>& inputs, const std::shared_ptr<Device>& device, const ReportOptions& options,
                 const ReportEvents& events) {
  ReportRun run(options, events, device);
  for (std::size_t i = 0; i < inputs.size(); ++i)
    run.add(inputs[i], fmt::format("{}/{} {}", i + 1, inputs.size(), inputs[i].scene.name), i + 1 == inputs.size());
}

}  // namespace halfshade
