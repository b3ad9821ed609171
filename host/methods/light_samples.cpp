// light-samples: Heckbert & Herf 1997, "Simulating Soft Shadows with Graphics Hardware".
#include "light/light_model.hpp"
#include "light/samples.hpp"
#include "methods/method.hpp"

namespace halfshade {
namespace {

constexpr unsigned default_samples = 64, max_samples = 1u << 16;

constexpr Option options[] = {light_res_option,
                              number<&Settings::samples, 1, max_samples, default_samples>(
                                  {"samples", "samples", "N", "Points of the light", "16 64 256 1024", "16 64 256"})};

/// A part of the light that one shadow map is drawn for, and what each channel gets of it.
struct Part {
  std::vector<Light> faces;
  cl_float4 weight;  // w: 0 where the light has no tint
};

class LightSamplesPasses final : public MethodPasses {
 public:
  using MethodPasses::MethodPasses;

  /// Shadow map after shadow map, each from another point of the light; the plane counts those that see a pixel, then holds the
  /// mean.
  void draw_light(const LightFrame& frame, const KeepCounts& keep) override {
    const cl_uint count = chosen_samples(frame.settings);
    const bool casts = std::ranges::any_of(frame.faces, [](const LightFace& face) { return !face.fitted.casters.empty(); });
    if (!casts || count <= 1 || disc_radius(frame.light()) <= 0.0) return MethodPasses::draw_light(frame, keep);

    const LightFace& centre = frame.faces.front();
    const LightPoints points = model_of(centre.as.shape).is_round ? LightPoints{} : light_points(centre.as, count);
    const std::size_t pixels = frame.gbuffer.pixel_count();
    launcher().fill(frame.visibility, cl_float{0.0f}, pixels, frame.plane * pixels);
    for (cl_uint i = 0; i < count; ++i) draw_part(frame, part_of(frame, points, i, count), i + 1 == count, keep);
    for (const LightFace& face : frame.faces)
      launcher().launch_pixels(frame.gbuffer.resolution,
                               kernels::ReceiveSamplesEnd{.light = whole_cone_view(face.fitted),
                                                          .view = frame.receiver(face),
                                                          .gbuffer = frame.gbuffer.arguments(),
                                                          .count = count,
                                                          .tinted = static_cast<cl_uint>(frame.tints.counted()),
                                                          .tints = frame.tints.arguments(),
                                                          .visibility = frame.output()});
  }

 private:
  static Part part_of(const LightFrame& frame, const LightPoints& points, cl_uint index, cl_uint count) {
    const LightFace& centre = frame.faces.front();
    const Light light = points.points.empty() ? light_sample(centre.as, centre.fitted, index, count)
                                              : light_at_point(centre.as, centre.fitted, points.points[index]);
    const glm::vec3 channels = points.weights.empty() ? glm::vec3(1.0f) : points.weights[index];
    return {faces_of(light), {{channels.r, channels.g, channels.b, frame.tints.counted() ? 1.0f : 0.0f}}};
  }

  void draw_part(const LightFrame& frame, const Part& part, bool last, const KeepCounts& keep) {
    for (std::size_t face = 0; face < part.faces.size(); ++face) {
      const Light& sample = part.faces[face];
      const LightView from = fit_light_view(sample, frame.placed, frame.settings.light_resolution_px, device().tile_px,
                                            /*searched=*/false, frame.gbuffer.has_depth ? &frame.scene.camera : nullptr);
      const cl_uint casts = !from.casters.empty();
      if (casts)
        shared_.shadow_map.run(
            shared_.triangles, frame.resident,
            draw_list(device(), frame.resident, frame.placed, from.view, from.frustum.view_from_world, from.drawn));
      HsReceiverView view = frame.receiver(sample, from);
      if (!view.is_face) view.tan_half_cone = HS_EMPTY_Z;  // the cone is the centre's, see receive_samples_end
      launcher().launch_pixels(frame.gbuffer.resolution, kernels::ReceiveSample{.light = from.view,
                                                                                .view = view,
                                                                                .gbuffer = frame.gbuffer.arguments(),
                                                                                .shadow_map = shared_.shadow_map.map(),
                                                                                .casts = casts,
                                                                                .weight = part.weight,
                                                                                .tints = frame.tints.arguments(),
                                                                                .visibility = frame.output()});
      if (last) keep(frame.faces[face], from, {});
    }
  }
};

}  // namespace

extern const MethodDeclaration light_samples_method;
constinit const MethodDeclaration light_samples_method{.info = {.method = Method::light_samples,
                                                                .name = "light-samples",
                                                                .summary = "the mean of hard shadows from points of the light",
                                                                .source = "Heckbert & Herf 1997",
                                                                .exact_when = "in the limit of many samples and texels",
                                                                .receivers = "any",
                                                                .time = "samples x (triangles + pixels)",
                                                                .falloff = Falloff::linear,
                                                                .faithful_falloff = Falloff::linear,
                                                                .any_shape = true},
                                                       .options = options,
                                                       .create = create<LightSamplesPasses>};

}  // namespace halfshade
