// Visibility by ray tracing on the host, with Embree 3 as it comes: the rival that methods have to beat. Belongs to the report
// and the tests: the library does not need Embree.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "halfshade/halfshade.hpp"
#include "report/embree_tree.hpp"
#include "report/receivers.hpp"

namespace halfshade {

/// A scene's casters in a tree, in coordinates of its own: (world - origin_ws) / unit, single precision.
class RayScene {
 public:
  /// Builds the tree on `threads` threads, 0 for all cores. Throws DeviceError for Embree's errors.
  explicit RayScene(const Scene& scene, unsigned threads = 0);

  double build_ms() const { return build_ms_; }  ///< vertices transformed and tree built
  unsigned threads() const { return threads_; }
  RTCScene handle() const { return tree_.scene(); }

  const glm::dvec3& origin_ws() const { return origin_ws_; }  ///< as of PlacedMeshes
  double unit() const { return unit_; }

 private:
  unsigned threads_;
  EmbreeTree tree_;
  glm::dvec3 origin_ws_{0.0};
  double unit_ = 1.0, build_ms_ = 0.0;
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

/// The samples that settings ask of a light: one where all are the same.
std::vector<glm::dvec2> pattern_of(const Light& light, const RaySettings& settings);

/// What pixels have that no ray is traced for: 1 for ignored ones, 0 for those turned away; counted ones have 1.
std::vector<float> untraced_visibility(const RayReceivers& receivers);

/// The fraction of the light that each receiver sees: 1 for ignored pixels, 0 for those turned away.
std::vector<float> trace_visibility(const RayScene& scene, const Light& light, const RayReceivers& receivers,
                                    const RaySettings& settings);

}  // namespace halfshade
