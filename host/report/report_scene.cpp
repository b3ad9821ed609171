#include "report/report_scene.hpp"

#include <algorithm>
#include <utility>

#include "report/timing.hpp"

namespace halfshade {

ReportScene::ReportScene(Scene scene, std::shared_ptr<Device> device, unsigned threads)
    : scene_(std::move(scene)),
      device_(std::move(device)),
      renderer_(device_),
      rays_(scene_, threads),
      precise_(scene_, threads),
      reference_(scene_),
      plane_(*device_, pixel_count()) {
  renderer_.set_scene(scene_);
  draw_gbuffer();
}

void ReportScene::draw_gbuffer() {
  gbuffer_ = renderer_.enqueue_gbuffer();
  finish(*device_);
}

std::uint32_t ReportScene::triangle_count() {
  return renderer_.stats().triangles;
}

LightCase ReportScene::light_case(std::size_t index, const TruthCache& cache, unsigned truth_samples,
                                  const std::function<void(const char* what, double done)>& progress) {
  const Light& light = scene_.lights.at(index);
  const auto depth = read_elements<float>(*device_, gbuffer_.depth, pixel_count());
  const auto normal_ws = read_elements<glm::vec4>(*device_, gbuffer_.normal, pixel_count());
  LightCase result;
  result.light = index;
  result.receivers = receivers_of(precise_, scene_.camera, depth, normal_ws, light);
  result.key = truth_key(scene_, light, result.receivers, truth_samples);
  result.truth =
      cache.truth(result.key, precise_, light, result.receivers, truth_samples, [&](double done) { progress("truth", done); });
  result.check = check_truth(reference_, light, result.receivers, result.truth, truth_samples, rays_.threads(),
                             [&](double done) { progress("check of the truth", done); });
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
  renderer_.enqueue_visibility({.gbuffer = gbuffer_,
                                .light = light_case.light,
                                .settings = std::get<Settings>(candidate.how),
                                .visibility = plane_.get()});
  finish(*device_);
  const double ms = ms_since(begin);
  if (visibility != nullptr) *visibility = read_elements<float>(*device_, plane_.get(), pixel_count());
  return ms;
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

std::optional<std::uint32_t> ReportScene::negative_pixels(const LightCase& light_case, const Candidate& candidate) {
  if (candidate.is_rival()) return {};
  return renderer_.stats().lights.at(light_case.light).negative_pixels;
}

std::vector<glm::vec4> ReportScene::shaded(const LightCase& light_case, float visibility) {
  std::vector<float> planes(pixel_count() * scene_.lights.size(), 1.0f);
  const auto begin = planes.begin() + static_cast<std::ptrdiff_t>(light_case.light * pixel_count());
  std::fill_n(begin, pixel_count(), visibility);
  const DevicePlane<float> visibilities(*device_, planes);
  const DevicePlane<glm::vec4> rgb(*device_, pixel_count());
  renderer_.enqueue_shade({.gbuffer = gbuffer_, .visibility = visibilities.get(), .rgb = rgb.get()});
  return read_elements<glm::vec4>(*device_, rgb.get(), pixel_count());
}

}  // namespace halfshade
