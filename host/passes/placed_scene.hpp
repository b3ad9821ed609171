// A scene ready to be drawn: its meshes on the device, where they stand, and its lights' faces.
#pragma once

#include <algorithm>
#include <span>

#include "passes/resident_scene.hpp"

namespace halfshade {

/// A light, or one face of a point light, with the map it was last drawn with.
struct LightFace {
  std::size_t light;  ///< of the scene
  Light as;           ///< the light as this face sees it (faces_of)
  LightView fitted;
};

/// Copied back after a frame; a row a light's face.
struct FaceCounters {
  HsStatus status;
  cl_uint triangle_refs, feature_refs;
  cl_uint padding[2];
};

/// What follows from a scene: all of it is replaced at once.
struct PlacedScene {
  Scene scene;
  ResidentScene resident;
  std::vector<PlacedMesh> placed;
  Buffer<cl_float4> materials;  // a mesh: base colour, w = receives
  DrawList camera;
  std::vector<LightFace> faces;     // of all lights, one light's behind the other's
  Buffer<FaceCounters> counters;    // a face
  std::vector<cl_int> tint_planes;  // a light: its plane of tints, -1 for those without a texture
  std::size_t tint_plane_count = 0;

  std::span<LightFace> faces_of_light(std::size_t light) {
    return {std::ranges::lower_bound(faces, light, {}, &LightFace::light),
            std::ranges::upper_bound(faces, light, {}, &LightFace::light)};
  }

  /// Uploads what `before`, if given, does not already hold. Throws as Renderer::set_scene.
  static PlacedScene of(const DeviceImpl& device, const Scene& scene, const ResidentScene* before);
};

}  // namespace halfshade
