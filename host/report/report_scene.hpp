// A scene ready to be measured: on the device, with its G-buffer, and as trees for rays and for the truth.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "halfshade/halfshade.hpp"
#include "report/candidates.hpp"
#include "report/device_plane.hpp"
#include "report/precise_scene.hpp"
#include "report/rays.hpp"
#include "report/truth.hpp"
#include "report/truth_check.hpp"

namespace halfshade {

/// One light of a scene, ready to be measured: the receivers and the ray-traced truth.
struct LightCase {
  std::size_t light = 0;  ///< its index in the scene
  RayReceivers receivers;
  std::vector<float> truth;
  std::string key;   ///< of the truth, see truth_key
  TruthCheck check;  ///< of the truth
};

/// A scene on the device, its G-buffer, and its tree.
class ReportScene {
 public:
  /// `threads` trace rays, 0 for all cores. Throws DeviceError where the device or Embree fails.
  ReportScene(Scene scene, std::shared_ptr<Device> device, unsigned threads);

  const Scene& scene() const { return scene_; }
  const RayScene& rays() const { return rays_; }
  std::uint32_t triangle_count();

  /// A light with its truth of so many samples, from the cache or traced now, and checked either way. `progress` is called with
  /// what is being done and the fraction of it.
  LightCase light_case(std::size_t light, const TruthCache& cache, unsigned truth_samples,
                       const std::function<void(const char* what, double done)>& progress);

  /// Runs a candidate once and returns its wall time in ms; its plane goes to `visibility`, if given.
  double run(const LightCase& light_case, const Candidate& candidate, std::vector<float>* visibility = nullptr);
  /// Time of each pass of a method for one light, from one whole frame; none for rays.
  std::vector<StageTime> stage_times(const LightCase& light_case, const Candidate& candidate);
  /// FrameStats::PerLight::negative_pixels of the frame that stage_times drew last; nothing for rays.
  std::optional<std::uint32_t> negative_pixels(const LightCase& light_case, const Candidate& candidate);
  /// The shaded picture with this light's visibility 0 or 1 everywhere, and that of all others 1. Linear.
  std::vector<glm::vec4> shaded(const LightCase& light_case, float visibility);

 private:
  std::size_t pixel_count() const { return std::size_t{scene_.camera.resolution.x} * scene_.camera.resolution.y; }
  void draw_gbuffer();

  Scene scene_;
  std::shared_ptr<Device> device_;
  Renderer renderer_;
  RayScene rays_;
  PreciseScene precise_;
  Reference reference_;
  GBuffer gbuffer_;
  DevicePlane<float> plane_;
};

}  // namespace halfshade
