// A scene's meshes in a tree of Embree's, in coordinates that suit single precision.
#pragma once

#include <embree3/rtcore.h>

#include <glm/glm.hpp>
#include <memory>
#include <type_traits>
#include <vector>

#include "halfshade/halfshade.hpp"

namespace halfshade {

/// A mesh where it stands, in coordinates (world - origin_ws) / unit.
struct PlacedPositions {
  std::shared_ptr<const Mesh> mesh;
  bool casts_shadow = true;
  std::vector<glm::dvec3> positions;
};

/// Meshes about their middle, so that single precision holds far from the world's origin, in a unit in which nothing lies beyond
/// -1..1, so that it holds at any size.
struct PlacedMeshes {
  glm::dvec3 origin_ws{0.0};
  double unit = 1.0;  ///< a power of two: dividing by it rounds nothing
  std::vector<PlacedPositions> meshes;
};

/// A scene's casters, or all of its meshes.
PlacedMeshes place_meshes(const Scene& scene, bool casters_only);

/// Embree's device and one scene on it, with the robust flag.
class EmbreeTree {
 public:
  /// Throws DeviceError where Embree makes none.
  explicit EmbreeTree(unsigned threads);

  RTCDevice device() const { return device_.get(); }
  RTCScene scene() const { return scene_.get(); }

  /// Builds the tree of what has been attached. Throws DeviceError for this or any earlier error.
  void commit();

 private:
  struct Release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  };
  std::unique_ptr<std::remove_pointer_t<RTCDevice>, Release> device_;
  std::unique_ptr<std::remove_pointer_t<RTCScene>, Release> scene_;
};

}  // namespace halfshade
