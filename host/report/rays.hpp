// Visibility by ray tracing on the host, with Embree 3: the truth that methods are measured against, and the rival that they have
// to beat. Belongs to the report and the tests: the library does not need Embree.
#pragma once

#include <embree3/rtcore.h>

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "halfshade/halfshade.hpp"
#include "light/samples.hpp"
#include "report/error_figures.hpp"

namespace halfshade {

/// The counted pixels of a G-buffer for one light, as origins of rays.
struct RayReceivers {
  glm::uvec2 resolution{0, 0};
  std::vector<PixelKind> kinds;       ///< of each pixel
  std::vector<std::uint32_t> pixels;  ///< the counted ones, tile by tile of 8×8, so that neighbours are traced together
  std::vector<glm::vec3> origins;     ///< of `pixels`: relative to RayScene::origin_ws, lifted off their own surface
};

/// A scene's casters in a tree.
class RayScene {
 public:
  /// Builds the tree on `threads` threads, 0 for all cores. Throws DeviceError for Embree's errors.
  explicit RayScene(const Scene& scene, unsigned threads = 0);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  double build_ms() const { return build_ms_; }  ///< vertices transformed and tree built
  unsigned threads() const { return threads_; }
  const glm::dvec3& origin_ws() const { return origin_ws_; }  ///< what Embree's coordinates are relative to
  RTCScene handle() const { return scene_; }

  /// Receivers of a G-buffer as the renderer makes it: `depth` is view-space z, normals have w = 0 where no shadow is received.
  RayReceivers receivers(const Camera& camera, std::span<const float> depth, std::span<const glm::vec4> normal_ws,
                         const Light& light) const;
  /// Receivers at given points. `footprint` is how far a point may be off its surface.
  RayReceivers receivers(glm::uvec2 resolution, std::span<const glm::dvec3> position_ws, std::span<const glm::vec4> normal_ws,
                         const Light& light, std::span<const double> footprint = {}) const;

 private:
  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
  glm::dvec3 origin_ws_{0.0};
  double build_ms_ = 0.0;
  unsigned threads_ = 1;
};

struct RaySettings {
  unsigned samples = 16;
  /// 0: all samples for every pixel. Otherwise `samples` first, and this many more where those disagree.
  unsigned more_samples = 0;
  /// Turns the pattern by another angle at every pixel, so that its error is noise. Without, every pixel has the same samples, as
  /// have lights that are not discs.
  bool rotate = true;
  /// Of jitter and turns. The truth has one of its own: a rival with its samples would look better than it is.
  std::uint32_t seed = 0;
  /// Samples (light space x, y in units of disc_radius) instead of light_points(light, samples). `samples` is then ignored.
  std::vector<glm::dvec2> pattern = {};
};

/// The fraction of the light that each receiver sees: 1 for ignored pixels, 0 for those turned away. `progress`, if given,
/// is called with the fraction done, from the calling thread.
std::vector<float> trace_visibility(const RayScene& scene, const Light& light, const RayReceivers& receivers,
                                    const RaySettings& settings, const std::function<void(double)>& progress = {});

/// A name for all that a truth depends on: meshes, transforms, light, receivers, number of samples.
std::string truth_key(const Scene& scene, const RayScene& rays, const Light& light, const RayReceivers& receivers,
                      unsigned samples);

/// Truth planes on disk, by their keys.
class TruthCache {
 public:
  /// `folder` empty: $XDG_CACHE_HOME/halfshade, or ~/.cache/halfshade.
  explicit TruthCache(std::filesystem::path folder = {});

  /// The plane as stored, or traced now and stored.
  std::vector<float> truth(const Scene& scene, const RayScene& rays, const Light& light, const RayReceivers& receivers,
                           unsigned samples, const std::function<void(double)>& progress = {}) const;
  const std::filesystem::path& folder() const { return folder_; }

 private:
  std::filesystem::path folder_;
};

}  // namespace halfshade
