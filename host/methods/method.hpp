// What a method is to the renderer. docs/adding-a-method.md walks through one.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "methods/option.hpp"
#include "passes/features.hpp"
#include "passes/gbuffer.hpp"
#include "passes/placed_scene.hpp"
#include "passes/shadow_map.hpp"

namespace halfshade {

/// Passes that methods share; they take turns with the buffers.
struct SharedPasses {
  explicit SharedPasses(std::shared_ptr<DeviceImpl> device) : launcher(std::move(device)) {}
  SharedPasses(const SharedPasses&) = delete;
  SharedPasses& operator=(const SharedPasses&) = delete;

  Launcher launcher;
  TrianglesPass triangles{launcher};
  ShadowMapPass shadow_map{launcher};
  FeaturesPass features{launcher};
};

/// Where the colour of a textured light is counted.
struct Tints {
  Buffer<cl_float4> planes = {};
  cl_int plane = -1;  ///< -1: not

  bool counted() const { return plane >= 0; }
  kernels::args::Tints arguments() const { return {.tints = planes, .tint_plane = static_cast<cl_uint>(std::max(0, plane))}; }
};

/// What is wanted of a method for one light: its visibility over a G-buffer.
struct LightFrame {
  const Scene& scene;
  const ResidentScene& resident;
  const std::vector<PlacedMesh>& placed;
  const Settings& settings;
  GBufferPlanes gbuffer;
  double receiver_tolerance;         ///< GBuffer::tolerance
  std::span<LightFace> faces;        ///< of the light, fitted
  Buffer<cl_float> visibility = {};  ///< planes, of which `plane` is this light's
  cl_uint plane = 0;
  Tints tints = {};

  const Light& light() const { return scene.lights[faces.front().light]; }
  kernels::args::Visibility output() const { return {.visibility = visibility, .plane = plane}; }
  /// What turns the G-buffer's pixels into the light space of a face, or of a light that stands for a part of it.
  HsReceiverView receiver(const Light& as, const LightView& fitted) const;
  HsReceiverView receiver(const LightFace& face) const { return receiver(face.as, face.fitted); }
};

/// Where a method has put the number of what its tiles refer to: an element of a buffer. None for methods without.
struct FeatureTotal {
  Buffer<cl_uint> offsets = {};
  std::size_t index = 0;
};

/// A method at work: owns the buffers that it alone needs, and enqueues its passes.
class MethodPasses {
 public:
  explicit MethodPasses(SharedPasses& shared) : shared_(shared) {}
  virtual ~MethodPasses() = default;
  MethodPasses(const MethodPasses&) = delete;
  MethodPasses& operator=(const MethodPasses&) = delete;

  /// Called after a face has been drawn, with the view that was drawn last, to keep its counters.
  using KeepCounts = std::function<void(const LightFace& face, const LightView& drawn, const FeatureTotal& total)>;

  /// Every pass of a light from meshes to its finished plane. By default face by face.
  virtual void draw_light(const LightFrame& frame, const KeepCounts& keep);

  /// The light's side of a face's passes: shadow map and what the method keeps beside it. Something casts there.
  virtual FeatureTotal draw_buffers(const LightFrame& frame, const LightFace& face);

  /// What draw_buffers has left beside the shadow map, for `--light-buffers`.
  virtual std::vector<LightBuffers::Plane> read_buffers(const LightFrame& frame, const LightFace& face);

  /// Whether look-ups search the map beyond a face's border, as wide as penumbrae (fit_light_view).
  virtual bool searches_map() const { return false; }

  /// Room for the next frame, from the number of tile references that this one wanted.
  virtual void learn(std::size_t /*wanted_refs*/) {}

 protected:
  /// Every pass of one face, where something casts. By default draw_buffers, then receive.
  virtual FeatureTotal draw_face(const LightFrame& frame, const LightFace& face);
  /// Visibility from what draw_buffers has left. By default hard shadows.
  virtual void receive(const LightFrame& frame, const LightFace& face);

  /// Look-ups of the nearest texel: for methods that have no penumbra to draw, as of lights without extent.
  void receive_hard(const LightFrame& frame, const LightFace& face);
  DrawList draw_list_of(const LightFrame& frame, const LightView& fitted) const;
  Launcher& launcher() { return shared_.launcher; }
  const DeviceImpl& device() const { return shared_.launcher.device(); }

  SharedPasses& shared_;
};

/// A method that draws fins: features of silhouettes in tiles.
class FinMethodPasses : public MethodPasses {
 public:
  using MethodPasses::MethodPasses;
  void learn(std::size_t wanted_refs) override { shared_.features.learn(wanted_refs); }

 protected:
  /// One layer of fins: silhouettes, features, tiles. Returns their total.
  FeatureTotal draw_features(const LightFrame& frame, const DrawList& list, const HsFinShape& shape);
  /// A plane of the light map whose tiles without fins are not written by the kernels.
  std::vector<float> read_fin_plane(const HsView& view, const Buffer<cl_float>& plane, float where_none);
};

/// A method, declared once: in its own file, as `const MethodDeclaration <enumerator>_method`.
struct MethodDeclaration {
  MethodInfo info;                  ///< but for `options`, which the registry fills in
  std::span<const Option> options;  ///< that it uses
  std::unique_ptr<MethodPasses> (*create)(SharedPasses& shared);
  /// Why it cannot draw a light with these settings, "expected ..." or the like; empty where it can. Null: lights of every shape
  /// that `info` names.
  std::string (*refusal)(const Settings& settings, const Light& light) = nullptr;
  std::string_view features_name = {};   ///< what FrameStats::PerLight::features counts
  bool counts_depth_complexity = false;  ///< fills HsStatus::negative_count
};

const MethodDeclaration& declaration_of(Method method);

template <class Passes>
std::unique_ptr<MethodPasses> create(SharedPasses& shared) {
  return std::make_unique<Passes>(shared);
}

}  // namespace halfshade
