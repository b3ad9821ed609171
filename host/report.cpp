#include "report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "cli/draw_options.hpp"

namespace halfshade {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

void check(cl_int status, const char* call) {
  if (status != CL_SUCCESS) throw DeviceError(fmt::format("{}: failed with OpenCL error {}", call, status));
}

/// A buffer on the device.
class OwnedBuffer {
 public:
  OwnedBuffer(const Device& device, std::size_t bytes) {
    cl_int status = CL_SUCCESS;
    buffer_ = clCreateBuffer(device.context(), CL_MEM_READ_WRITE, bytes, nullptr, &status);
    check(status, "clCreateBuffer");
  }
  ~OwnedBuffer() { clReleaseMemObject(buffer_); }
  OwnedBuffer(const OwnedBuffer&) = delete;
  OwnedBuffer& operator=(const OwnedBuffer&) = delete;
  cl_mem get() const { return buffer_; }

 private:
  cl_mem buffer_ = nullptr;
};

/// The natural values of a setting, by the name that MethodInfo::options gives it. A method is measured with its defaults at each
/// light map resolution, and with each value of its other settings in turn at the default resolution.
struct SettingAxis {
  std::string_view option;
  std::vector<double> values, quick_values;
  void (*apply)(Settings& settings, double value);
};

const std::vector<SettingAxis>& setting_axes() {
  static const std::vector<SettingAxis> axes{
      {"pcf-filter", {2, 4}, {2, 4}, [](Settings& s, double v) { s.pcf_filter = static_cast<unsigned>(v); }},
      {"pcss-taps", {16, 32}, {16, 32}, [](Settings& s, double v) { s.pcss_taps = static_cast<unsigned>(v); }},
      {"smoothie-width", {0.0, 0.02, 0.05, 0.1, 0.2}, {0.0}, [](Settings& s, double v) { s.smoothie_width = v; }},
      {"samples", {16, 64, 256, 1024}, {16, 64, 256}, [](Settings& s, double v) { s.samples = static_cast<unsigned>(v); }},
      {"sample-pattern",
       {0, 1},
       {},
       [](Settings& s, double v) { s.sample_pattern = v > 0 ? SamplePattern::rotated : SamplePattern::fixed; }},
      {"alias-free", {0, 1}, {}, [](Settings& s, double v) { s.alias_free = v > 0; }},
      {"falloff", {0, 1, 2, 3}, {}, [](Settings& s, double v) { s.falloff = static_cast<Falloff>(static_cast<int>(v)); }},
      {"layers", {4, 16, 64}, {16}, [](Settings& s, double v) { s.layers = static_cast<unsigned>(v); }},  // and auto by default
      {"faithful", {1}, {1}, [](Settings& s, double v) { s.faithful = v != 0; }},
  };
  return axes;
}

std::vector<Candidate> method_candidates(const MethodInfo& info, const ReportOptions& options) {
  std::vector<Candidate> all;
  const auto add = [&](const Settings& settings, bool is_default) {
    Candidate candidate{std::string(info.name), describe(settings), settings, is_default};
    // What tells rows apart: not the name, and not what is the same but for one of them.
    std::erase_if(candidate.settings, [](const auto& entry) {
      return entry.first == "method" || (entry.first == "faithful" && entry.second == "no");
    });
    const auto known = [&](const Candidate& other) { return other.settings == candidate.settings; };
    if (std::none_of(all.begin(), all.end(), known)) all.push_back(std::move(candidate));
  };
  const std::vector<std::string> used_options = split(info.options, ' ');
  const auto uses = [&](std::string_view option) {
    return std::find(used_options.begin(), used_options.end(), option) != used_options.end();
  };

  std::vector<unsigned> resolutions = options.light_resolutions_px;
  const unsigned usual = Settings{}.light_resolution_px;
  if (resolutions.empty())
    resolutions = options.quick ? std::vector<unsigned>{512, usual, 2048} : std::vector<unsigned>{256, 512, usual, 2048, 4096};
  const bool has_usual = std::find(resolutions.begin(), resolutions.end(), usual) != resolutions.end();
  Settings base;
  base.method = info.method;
  base.light_resolution_px = has_usual ? usual : resolutions.back();
  const Settings defaults = base;
  if (uses("light-res")) {
    for (const unsigned resolution : resolutions) {
      Settings settings = defaults;
      settings.light_resolution_px = resolution;
      add(settings, resolution == defaults.light_resolution_px);
    }
  }
  add(defaults, true);
  for (const SettingAxis& axis : setting_axes()) {
    if (!uses(axis.option)) continue;
    for (const double value : options.quick ? axis.quick_values : axis.values) {
      Settings settings = defaults;
      axis.apply(settings, value);
      add(settings, false);
    }
  }
  return all;
}

struct Rival {
  std::string_view name;
  std::vector<RaySettings> settings, quick_settings;
};

const std::vector<Rival>& rivals() {
  static const std::vector<Rival> all{
      {"rays",
       {{.samples = 1}, {.samples = 4}, {.samples = 16}, {.samples = 64}, {.samples = 256}},
       {{.samples = 1}, {.samples = 4}, {.samples = 16}, {.samples = 64}}},
      {"rays-adaptive",
       {{.samples = 16, .more_samples = 64}, {.samples = 16, .more_samples = 256}},
       {{.samples = 16, .more_samples = 64}}},
  };
  return all;
}

}  // namespace

std::string Candidate::label() const {
  std::string text = name;
  for (const auto& [key, value] : settings) text += fmt::format(" {}={}", key, value);
  return text;
}

std::vector<Candidate> candidates(const ReportOptions& options) {
  std::vector<std::string> known;
  for (const MethodInfo& info : methods()) known.emplace_back(info.name);
  for (const Rival& rival : rivals()) known.emplace_back(rival.name);
  for (const std::string& name : options.names) {
    if (name != "all" && std::find(known.begin(), known.end(), name) == known.end())
      throw InputError(fmt::format("--methods: unknown method '{}'; use 'all' or some of: {}", name, fmt::join(known, ", ")));
  }
  const auto wanted = [&](std::string_view name) {
    return options.names.empty() || std::any_of(options.names.begin(), options.names.end(),
                                                [&](const std::string& asked) { return asked == "all" || asked == name; });
  };
  std::vector<Candidate> all;
  for (const MethodInfo& info : methods()) {
    if (!wanted(info.name)) continue;
    for (Candidate& candidate : method_candidates(info, options)) all.push_back(std::move(candidate));
  }
  for (const Rival& rival : rivals()) {
    if (!wanted(rival.name)) continue;
    for (const RaySettings& settings : options.quick ? rival.quick_settings : rival.settings) {
      Candidate candidate{std::string(rival.name), {{"samples", fmt::format("{}", settings.samples)}}, settings};
      if (settings.more_samples > 0) candidate.settings.emplace_back("more_samples", fmt::format("{}", settings.more_samples));
      all.push_back(std::move(candidate));
    }
  }
  return all;
}

double median_of(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
}

double Measurement::median_ms() const {
  return median_of(times_ms);
}

double Measurement::min_ms() const {
  return times_ms.empty() ? 0.0 : *std::min_element(times_ms.begin(), times_ms.end());
}

std::vector<bool> pareto_front(std::span<const Tradeoff> points) {
  std::vector<bool> on_front;
  for (const Tradeoff& point : points) {
    on_front.push_back(std::none_of(points.begin(), points.end(), [&](const Tradeoff& other) {
      return other.time_ms <= point.time_ms && other.error <= point.error &&
             (other.time_ms < point.time_ms || other.error < point.error);
    }));
  }
  return on_front;
}

std::optional<double> rays_time_at_error(std::span<const Tradeoff> rays, double error) {
  std::vector<Tradeoff> front;
  const std::vector<bool> on_front = pareto_front(rays);
  for (std::size_t i = 0; i < rays.size(); ++i)
    if (on_front[i]) front.push_back(rays[i]);
  std::sort(front.begin(), front.end(), [](const Tradeoff& a, const Tradeoff& b) { return a.time_ms < b.time_ms; });
  for (std::size_t i = 0; i < front.size(); ++i) {
    if (front[i].error > error) continue;
    if (i == 0 || front[i].error <= 0.0 || front[i].error == error) return front[i].time_ms;
    const Tradeoff &slower = front[i], &faster = front[i - 1];
    const double t = std::log(faster.error / error) / std::log(faster.error / slower.error);
    return faster.time_ms * std::pow(slower.time_ms / faster.time_ms, t);
  }
  return {};
}

ReportScene::ReportScene(Scene scene, std::shared_ptr<Device> device, unsigned threads)
    : scene_(std::move(scene)), device_(std::move(device)), renderer_(device_), rays_(scene_, threads) {
  renderer_.set_scene(scene_);
  draw_gbuffer();
  cl_int status = CL_SUCCESS;
  const std::size_t pixels = std::size_t{scene_.camera.resolution.x} * scene_.camera.resolution.y;
  plane_ = clCreateBuffer(device_->context(), CL_MEM_READ_WRITE, pixels * sizeof(float), nullptr, &status);
  check(status, "clCreateBuffer");
}

ReportScene::~ReportScene() {
  clReleaseMemObject(plane_);
}

void ReportScene::draw_gbuffer() {
  gbuffer_ = renderer_.enqueue_gbuffer();
  check(clFinish(device_->queue()), "clFinish");
}

std::uint32_t ReportScene::triangle_count() {
  return renderer_.stats().triangles;
}

std::optional<std::uint32_t> ReportScene::negative_pixels(const LightCase& light_case, const Candidate& candidate) {
  const Settings* settings = std::get_if<Settings>(&candidate.how);
  if (settings == nullptr || settings->method != Method::exact) return {};
  return renderer_.stats().lights.at(light_case.light).negative_pixels;
}

LightCase ReportScene::light_case(std::size_t light, const TruthCache& cache, unsigned truth_samples,
                                  const std::function<void(double)>& progress) {
  const std::size_t pixels = std::size_t{scene_.camera.resolution.x} * scene_.camera.resolution.y;
  std::vector<float> depth(pixels);
  std::vector<glm::vec4> normal(pixels);
  const auto read = [&](cl_mem from, void* to, std::size_t bytes) {
    check(clEnqueueReadBuffer(device_->queue(), from, CL_TRUE, 0, bytes, to, 0, nullptr, nullptr), "clEnqueueReadBuffer");
  };
  read(gbuffer_.depth, depth.data(), pixels * sizeof(float));
  read(gbuffer_.normal, normal.data(), pixels * sizeof(glm::vec4));
  LightCase result;
  result.light = light;
  result.receivers = rays_.receivers(scene_.camera, depth, normal, scene_.lights.at(light));
  result.key = truth_key(scene_, rays_, scene_.lights[light], result.receivers, truth_samples);
  result.truth = cache.truth(scene_, rays_, scene_.lights[light], result.receivers, truth_samples, progress);
  return result;
}

double ReportScene::run(const LightCase& light_case, const Candidate& candidate, std::vector<float>* visibility) {
  if (const RaySettings* ray_settings = std::get_if<RaySettings>(&candidate.how)) {
    const Clock::time_point begin = Clock::now();
    std::vector<float> plane = trace_visibility(rays_, scene_.lights[light_case.light], light_case.receivers, *ray_settings);
    const double ms = ms_since(begin);
    if (visibility != nullptr) *visibility = std::move(plane);
    return ms;
  }
  const Clock::time_point begin = Clock::now();
  renderer_.enqueue_visibility(gbuffer_, light_case.light, std::get<Settings>(candidate.how), plane_);
  check(clFinish(device_->queue()), "clFinish");
  const double ms = ms_since(begin);
  if (visibility != nullptr) {
    visibility->resize(light_case.truth.size());
    check(clEnqueueReadBuffer(device_->queue(), plane_, CL_TRUE, 0, visibility->size() * sizeof(float), visibility->data(), 0,
                              nullptr, nullptr),
          "clEnqueueReadBuffer");
  }
  return ms;
}

std::vector<glm::vec4> ReportScene::shaded(const LightCase& light_case, float visibility) {
  const std::size_t pixels = light_case.truth.size();
  std::vector<float> planes(pixels * scene_.lights.size(), 1.0f);
  std::fill_n(planes.begin() + static_cast<std::ptrdiff_t>(light_case.light * pixels), pixels, visibility);
  const OwnedBuffer visibilities(*device_, planes.size() * sizeof(float)), rgb(*device_, pixels * sizeof(glm::vec4));
  const cl_command_queue queue = device_->queue();
  check(clEnqueueWriteBuffer(queue, visibilities.get(), CL_TRUE, 0, planes.size() * sizeof(float), planes.data(), 0, nullptr,
                             nullptr),
        "clEnqueueWriteBuffer");
  renderer_.enqueue_shade(gbuffer_, visibilities.get(), rgb.get());
  std::vector<glm::vec4> picture(pixels);
  check(clEnqueueReadBuffer(queue, rgb.get(), CL_TRUE, 0, pixels * sizeof(glm::vec4), picture.data(), 0, nullptr, nullptr),
        "clEnqueueReadBuffer");
  return picture;
}

std::vector<StageTime> ReportScene::stage_times(const LightCase& light_case, const Candidate& candidate) {
  const Settings* settings = std::get_if<Settings>(&candidate.how);
  if (settings == nullptr) return {};
  renderer_.render(*settings);
  const std::string prefix = scene_.lights[light_case.light].name + "/";
  std::vector<StageTime> stages;
  for (const StageTime& time : renderer_.stage_times()) {
    if (!time.stage.starts_with(prefix)) continue;
    const std::string name = time.stage.substr(prefix.size());
    const auto same = std::find_if(stages.begin(), stages.end(), [&](const StageTime& known) { return known.stage == name; });
    if (same != stages.end())
      same->time_ms += time.time_ms;
    else
      stages.push_back({name, time.time_ms});
  }
  draw_gbuffer();
  return stages;
}

}  // namespace halfshade
