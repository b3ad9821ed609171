// Speed against error: every method over its natural settings, and rays as the rival, measured in one process on the same pixels
// against the ray-traced truth.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "error_figures.hpp"
#include "halfshade/halfshade.hpp"
#include "rays.hpp"

namespace halfshade {

/// One row of a report: a method with its settings, or rays.
struct Candidate {
  std::string name;                                           ///< "smoothies", "rays", "rays-adaptive"
  std::vector<std::pair<std::string, std::string>> settings;  ///< what tells it from others of its name
  std::variant<Settings, RaySettings> how;
  bool is_default = false;  ///< its settings are the method's own

  bool is_rival() const { return std::holds_alternative<RaySettings>(how); }
  /// "smoothies light_resolution_px=1024 falloff=sine"
  std::string label() const;
};

struct ReportOptions {
  std::vector<std::string> names;              ///< methods and rivals to measure; empty: all
  std::vector<unsigned> light_resolutions_px;  ///< empty: 256 to 4096
  unsigned truth_samples = 1024;
  unsigned repeats = 11;
  bool quick = false;  ///< fewer settings
};

/// What `options` asks for, in the order of the report. Throws InputError for a name that is neither a method's nor a rival's.
std::vector<Candidate> candidates(const ReportOptions& options);

/// Times and error of one candidate for one light.
struct Measurement {
  Candidate candidate;
  double cold_ms = 0.0;           ///< the first run: kernels are built or loaded, buffers grow
  std::vector<double> times_ms;   ///< of warm runs: from meshes and G-buffer on the device to the finished plane
  std::vector<StageTime> stages;  ///< median of each pass, from OpenCL events; none for rays
  ErrorFigures figures;
  std::optional<std::uint32_t> negative_pixels;  ///< FrameStats::PerLight::negative_pixels; of method exact alone

  std::string picture;  ///< file name of the visibility as 8-bit PNG, in the report's folder

  double median_ms() const;
  double min_ms() const;
};

double median_of(std::vector<double> values);

/// Time and error of a row.
struct Tradeoff {
  double time_ms, error;
};

/// Which points no other one beats: none is at most as slow and at most as wrong, and better in one of them.
std::vector<bool> pareto_front(std::span<const Tradeoff> points);

/// The time in which `rays` come down to `error`, on straight lines between their points in a log-log plot of the fastest that
/// reach each error. Their fastest where even that has no more than `error`; nothing where none of them comes down to it.
std::optional<double> rays_time_at_error(std::span<const Tradeoff> rays, double error);

/// One light of a scene, ready to be measured: the tree is built, the truth known.
struct LightCase {
  std::size_t light = 0;
  RayReceivers receivers;
  std::vector<float> truth;
  std::string key;  ///< of the truth
};

/// A scene on the device, its G-buffer, and its tree.
class ReportScene {
 public:
  ReportScene(Scene scene, std::shared_ptr<Device> device, unsigned threads);
  ~ReportScene();

  const Scene& scene() const { return scene_; }
  const RayScene& rays() const { return rays_; }
  std::uint32_t triangle_count();

  LightCase light_case(std::size_t light, const TruthCache& cache, unsigned truth_samples,
                       const std::function<void(double)>& progress);

  /// Runs a candidate once and returns its wall time in ms; its plane goes to `visibility`, if given.
  double run(const LightCase& light_case, const Candidate& candidate, std::vector<float>* visibility = nullptr);
  /// Time of each pass of a method for one light, from one whole frame.
  std::vector<StageTime> stage_times(const LightCase& light_case, const Candidate& candidate);
  /// Pixels with a negative depth complexity in the frame that stage_times drew last; nothing for candidates that count none.
  std::optional<std::uint32_t> negative_pixels(const LightCase& light_case, const Candidate& candidate);
  /// The shaded picture with this light's visibility 0 or 1 everywhere, and that of all others 1. Linear.
  std::vector<glm::vec4> shaded(const LightCase& light_case, float visibility);

 private:
  void draw_gbuffer();

  Scene scene_;
  std::shared_ptr<Device> device_;
  Renderer renderer_;
  RayScene rays_;
  GBuffer gbuffer_;
  cl_mem plane_ = nullptr;
};

}  // namespace halfshade
