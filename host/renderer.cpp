// The renderer: what is wrong with a call is said before anything is enqueued, and the frame is a list of stages.
#include <algorithm>
#include <map>

#include "methods/method.hpp"
#include "passes/shade.hpp"
#include "renderer_checks.hpp"

namespace halfshade {

struct Renderer::State {
  explicit State(std::shared_ptr<DeviceImpl> device) : passes(std::move(device)) {}

  SharedPasses passes;
  GBufferPass gbuffer_pass{passes.launcher};
  std::map<Method, std::unique_ptr<MethodPasses>> methods;  // those that were asked for
  std::optional<PlacedScene> placed;
  Buffer<cl_float> visibility;       // of `render`: a plane a light
  Buffer<cl_float4> rgb, tints;      // of `render`
  std::optional<Settings> rendered;  // what `render` last drew with

  const DeviceImpl& device() const { return passes.launcher.device(); }

  MethodPasses& method(Method which) {
    std::unique_ptr<MethodPasses>& found = methods[which];
    if (!found) found = declaration_of(which).create(passes);
    return *found;
  }

  PlacedScene& scene(std::string_view caller) {
    if (!placed) throw InputError(fmt::format("{}: no scene; call set_scene first", caller));
    return *placed;
  }

  /// The scene that `render` has drawn.
  PlacedScene& rendered_scene(std::string_view caller) {
    if (!rendered) throw InputError(fmt::format("{}: nothing rendered; call render first", caller));
    return *placed;
  }

  GBuffer draw_gbuffer() {
    passes.launcher.set_label("camera");
    return gbuffer_pass.run(passes.triangles, placed->resident, placed->camera, camera_unit(placed->scene.camera),
                            placed->materials);
  }

  /// `has_depth`: receivers are what the scene's camera sees.
  LightFrame light_frame(const GBuffer& gbuffer, bool has_depth, std::size_t light, const Settings& settings) {
    PlacedScene& s = *placed;
    const std::span<LightFace> faces = s.faces_of_light(light);
    for (LightFace& face : faces)
      face.fitted = fit_light_view(face.as, s.placed, settings.light_resolution_px, device().tile_px,
                                   method(settings.method).searches_map(), has_depth ? &s.scene.camera : nullptr);
    return {.scene = s.scene,
            .resident = s.resident,
            .placed = s.placed,
            .settings = settings,
            .gbuffer = GBufferPlanes::of(gbuffer),
            .receiver_tolerance = gbuffer.tolerance,
            .faces = faces};
  }

  /// Every pass of one light over a G-buffer.
  void draw_visibility(const GBuffer& gbuffer, std::size_t light, const Settings& settings, const Buffer<cl_float>& out,
                       std::size_t plane, const Buffer<cl_float4>& tint_planes) {
    LightFrame frame = light_frame(gbuffer, gbuffer.depth != nullptr, light, settings);
    frame.visibility = out;
    frame.plane = static_cast<cl_uint>(plane);
    frame.tints = {tint_planes, tint_planes ? placed->tint_planes[light] : -1};
    Launcher& launcher = passes.launcher;
    const std::size_t pixels = frame.gbuffer.pixel_count();
    launcher.set_label(frame.light().name);
    if (frame.tints.counted())
      launcher.fill(tint_planes.as<cl_float>(), cl_float{0.0f}, 4 * pixels,
                    static_cast<std::size_t>(frame.tints.plane) * 4 * pixels);
    if (frame.faces.size() > 1)  // where no face reaches: the light's very centre
      launcher.fill(out, cl_float{1.0f}, pixels, plane * pixels);
    method(settings.method).draw_light(frame, [this](const LightFace& face, const LightView& drawn, const FeatureTotal& total) {
      keep_counters(face, drawn, total);
    });
  }

  /// Copies a face's counters aside, on the device. `drawn` is what was drawn last.
  void keep_counters(const LightFace& face, const LightView& drawn, const FeatureTotal& total) {
    const std::size_t row = static_cast<std::size_t>(&face - placed->faces.data()) * sizeof(FaceCounters);
    const cl::CommandQueue& queue = passes.launcher.queue();
    const cl::Buffer& counters = placed->counters.memory();
    queue.enqueueFillBuffer(counters, cl_uint{0}, row, sizeof(FaceCounters));
    if (drawn.casters.empty()) return;
    const auto keep = [&](const auto& from, std::size_t from_bytes, std::size_t at, std::size_t bytes) {
      queue.enqueueCopyBuffer(from.memory(), counters, from_bytes, row + at, bytes);
    };
    keep(passes.triangles.status(), 0, 0, sizeof(HsStatus));
    keep(passes.triangles.bins().offsets, tiles_of(drawn.view) * sizeof(cl_uint), offsetof(FaceCounters, triangle_refs),
         sizeof(cl_uint));
    if (total.offsets) keep(total.offsets, total.index * sizeof(cl_uint), offsetof(FaceCounters, feature_refs), sizeof(cl_uint));
  }

  void draw_shade(const ShadeRequest& request) {
    passes.launcher.set_label("camera");
    const GBuffer& gbuffer = request.gbuffer;
    shade(passes.launcher, placed->scene, placed->resident, GBufferPlanes::of(gbuffer),
          {.visibility = Buffer<cl_float>::of(request.visibility),
           .tints = Buffer<cl_float4>::of(request.tints),
           .tint_planes = placed->tint_planes,
           .base_color = Buffer<cl_float4>::of(gbuffer.base_color),
           .face = Buffer<cl_uint>::of(gbuffer.base_color ? nullptr : gbuffer.face),
           .materials = placed->materials},
          Buffer<cl_float4>::of(request.rgb));
  }

  std::vector<FaceCounters> read_counters() {
    return read<FaceCounters>(passes.launcher.queue(), placed->counters, placed->faces.size());
  }
};

Renderer::Renderer(std::shared_ptr<Device> device) {
  auto own = std::dynamic_pointer_cast<DeviceImpl>(std::move(device));
  if (!own) throw InputError("Renderer: expected a device from Device::open or Device::adopt");
  state_ = std::make_unique<State>(std::move(own));
}

Renderer::~Renderer() {
  // Where a frame was cut short by an error, PoCL may still be compiling its kernels: the process must not exit under it. A
  // caller's queue is the caller's to wait for.
  if (state_->device().owns_queue) clFinish(state_->device().cl_queue());
}

void Renderer::set_scene(const Scene& scene) {
  validate(scene, scene.name.empty() ? "scene" : scene.name);
  guarded("set_scene", [&] {
    State& s = *state_;
    PlacedScene next = PlacedScene::of(s.device(), scene, s.placed ? &s.placed->resident : nullptr);
    s.placed = std::move(next);
    s.rendered.reset();
  });
}

GBuffer Renderer::enqueue_gbuffer() {
  state_->scene("enqueue_gbuffer");
  return guarded("enqueue_gbuffer", [&] { return state_->draw_gbuffer(); });
}

void Renderer::enqueue_visibility(const VisibilityRequest& request) {
  State& s = *state_;
  const PlacedScene& placed = s.scene("enqueue_visibility");
  const RequestChecks checks(s.device(), "enqueue_visibility");
  checks.visibility(request, placed.scene, placed.tint_plane_count);
  guarded("enqueue_visibility", [&] {
    const cl_command_queue queue = s.device().cl_queue();
    if (!request.wait.empty()) {
      if (const cl_int code =
              clEnqueueBarrierWithWaitList(queue, static_cast<cl_uint>(request.wait.size()), request.wait.data(), nullptr))
        throw cl::Error(code, "clEnqueueBarrierWithWaitList");
    }
    s.draw_visibility(request.gbuffer, request.light, request.settings, Buffer<cl_float>::of(request.visibility), request.plane,
                      Buffer<cl_float4>::of(request.tints));
    if (request.done) {
      if (const cl_int code = clEnqueueMarkerWithWaitList(queue, 0, nullptr, request.done))
        throw cl::Error(code, "clEnqueueMarkerWithWaitList");
    }
  });
}

void Renderer::enqueue_shade(const ShadeRequest& request) {
  const PlacedScene& placed = state_->scene("enqueue_shade");
  RequestChecks(state_->device(), "enqueue_shade").shade(request, placed.scene, placed.tint_plane_count);
  guarded("enqueue_shade", [&] { state_->draw_shade(request); });
}

void Renderer::render(const Settings& settings) {
  State& s = *state_;
  PlacedScene& placed = s.scene("render");
  check_settings(settings, "render");
  for (const Light& light : placed.scene.lights) check_light(settings, light, "render");
  guarded("render", [&] {
    const std::size_t lights = placed.scene.lights.size(), pixels = pixels_of(placed.camera.view);
    // The frame of before stays whole where there is no room for this one.
    Buffer<cl_float> visibility = s.visibility;
    Buffer<cl_float4> rgb = s.rgb, grown_tints = s.tints;
    visibility.reserve(s.device(), std::max<std::size_t>(1, lights) * pixels, "visibility");
    rgb.reserve(s.device(), pixels, "shaded picture");
    if (placed.tint_plane_count > 0)
      grown_tints.reserve(s.device(), placed.tint_plane_count * pixels, "tints of textured lights");
    s.rendered.reset();
    s.visibility = visibility;
    s.rgb = rgb;
    s.tints = grown_tints;
    const Buffer<cl_float4> tints = placed.tint_plane_count > 0 ? s.tints : Buffer<cl_float4>();

    Launcher& launcher = s.passes.launcher;
    launcher.time(true);
    const struct StopTiming {
      Launcher& launcher;
      ~StopTiming() { launcher.time(false); }
    } stop_timing{launcher};

    const GBuffer gbuffer = s.draw_gbuffer();
    for (std::size_t light = 0; light < lights; ++light) s.draw_visibility(gbuffer, light, settings, s.visibility, light, tints);
    s.draw_shade({.gbuffer = gbuffer, .visibility = s.visibility.memory()(), .rgb = s.rgb.memory()(), .tints = tints.memory()()});
    launcher.queue().finish();
    for (const FaceCounters& face : s.read_counters()) {
      s.passes.triangles.learn(face.triangle_refs);
      s.method(settings.method).learn(face.feature_refs);
    }
    s.rendered = settings;
  });
}

Frame Renderer::read_frame() {
  State& s = *state_;
  const PlacedScene& placed = s.rendered_scene("read_frame");
  return guarded("read_frame", [&] {
    const cl::CommandQueue& queue = s.passes.launcher.queue();
    const std::size_t pixels = pixels_of(placed.camera.view);
    Frame frame;
    frame.resolution = placed.scene.camera.resolution;
    frame.depth = read<float>(queue, s.gbuffer_pass.depth(), pixels);
    frame.normal_ws = read<glm::vec4>(queue, s.gbuffer_pass.normal(), pixels);
    frame.rgb = read<glm::vec4>(queue, s.rgb, pixels);
    for (std::size_t light = 0; light < placed.scene.lights.size(); ++light)
      frame.visibility.push_back(read<float>(queue, s.visibility, pixels, light * pixels));
    frame.position_ws = positions_of(placed.scene.camera, frame.depth);
    for (glm::vec4& normal : frame.normal_ws) normal.w = 0.0f;
    return frame;
  });
}

LightBuffers Renderer::read_light_buffers(std::size_t light, std::size_t face) {
  State& s = *state_;
  PlacedScene& placed = s.rendered_scene("read_light_buffers");
  RequestChecks(s.device(), "read_light_buffers").light(light, placed.scene);
  const std::span<LightFace> own = placed.faces_of_light(light);
  if (face >= own.size())
    throw InputError(fmt::format("read_light_buffers: face {} of light {}: it has {}", face, light, own.size()));
  return guarded("read_light_buffers", [&] {
    const LightFrame frame = s.light_frame({}, /*has_depth=*/true, light, *s.rendered);
    const LightView& fitted = own[face].fitted;
    if (fitted.casters.empty()) return LightBuffers{};
    // Lights take turns with the buffers, so this one's are drawn again.
    MethodPasses& method = s.method(s.rendered->method);
    method.draw_buffers(frame, own[face]);
    std::vector<LightBuffers::Plane> planes{
        {"shadow_map.Z", read<float>(s.passes.launcher.queue(), s.passes.shadow_map.map(), pixels_of(fitted.view))}};
    for (LightBuffers::Plane& plane : method.read_buffers(frame, own[face])) planes.push_back(std::move(plane));
    return light_buffers_of(fitted, std::move(planes));
  });
}

std::vector<StageTime> Renderer::stage_times() {
  return guarded("stage_times", [&] {
    std::vector<StageTime> times;
    if (!state_->rendered) return times;
    for (const auto& [stage, event] : state_->passes.launcher.timed()) {
      event.wait();
      const double ns = static_cast<double>(event.getProfilingInfo<CL_PROFILING_COMMAND_END>() -
                                            event.getProfilingInfo<CL_PROFILING_COMMAND_START>());
      times.push_back({stage, ns * 1e-6});
    }
    return times;
  });
}

FrameStats Renderer::stats() {
  State& s = *state_;
  FrameStats stats;
  if (!s.placed) return stats;
  const PlacedScene& placed = *s.placed;
  stats.triangles = placed.resident.triangle_count;
  stats.vertices = placed.resident.vertex_count;
  stats.edges = placed.resident.edge_count;
  if (!s.rendered) return stats;
  return guarded("stats", [&] {
    const MethodDeclaration& method = declaration_of(s.rendered->method);
    stats.features_name = method.features_name;
    for (const Light& light : placed.scene.lights) stats.lights.push_back({.name = light.name, .skipped = true});
    const std::vector<FaceCounters> counters = s.read_counters();
    for (std::size_t i = 0; i < counters.size(); ++i) {
      const LightView& fitted = placed.faces[i].fitted;
      FrameStats::PerLight& light = stats.lights[placed.faces[i].light];
      light.silhouette_edges += counters[i].status.silhouette_count;
      light.features += counters[i].status.feature_count;
      light.feature_tile_references += counters[i].feature_refs;
      light.triangle_tile_references += counters[i].triangle_refs;
      light.light_map_px = glm::max(light.light_map_px, glm::uvec2(fitted.view.width_px, fitted.view.height_px));
      light.skipped &= fitted.casters.empty();
      if (method.counts_depth_complexity)
        light.negative_pixels = light.negative_pixels.value_or(0) + counters[i].status.negative_count;
    }
    return stats;
  });
}

}  // namespace halfshade
