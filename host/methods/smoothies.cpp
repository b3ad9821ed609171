// smoothies: Chan & Durand 2003, "Rendering Fake Soft Shadows with Smoothies".
#include "light/light_model.hpp"
#include "methods/method.hpp"

namespace halfshade {
namespace {

void set_width(Settings& settings, std::string_view typed) {
  if (typed == "auto") {
    settings.smoothie_width = 0.0;
    return;
  }
  double value = 0.0;
  const auto [end, error] = std::from_chars(typed.data(), typed.data() + typed.size(), value);
  if (error != std::errc() || end != typed.data() + typed.size() || !(value > 0.0 && value <= 2.0))
    throw InputError(
        fmt::format("expected 'auto' or a width above 0 and up to 2, the light's whole cone (found '{}'); 0.02 "
                    "to 0.2 is usual",
                    typed));
  settings.smoothie_width = value;
}

std::string width_text(const Settings& settings) {
  return settings.smoothie_width == 0.0 ? "auto" : fmt::format("{}", settings.smoothie_width);
}

constexpr Option options[] = {
    light_res_option,
    {{"smoothie-width", "smoothie_width", "T|auto", "Width t in normalised device coordinates, or from the light's radius",
      "auto 0.02 0.05 0.1 0.2", "auto"},
     set_width,
     width_text},
    falloff_option,
    faithful_option};

bool has_smoothies(const Settings& settings, const Light& light) {
  return settings.smoothie_width > 0.0 || disc_radius(light) > 0.0;
}

std::string refusal(const Settings& settings, const Light& light) {
  if (settings.smoothie_width <= 0.0 || !model_of(light.type).is_projective) return {};
  return fmt::format("smoothie width {}: it is of a light's cone, and light '{}' is directional; use 0 (from its radius)",
                     settings.smoothie_width, light.name);
}

class SmoothiesPasses final : public FinMethodPasses {
 public:
  using FinMethodPasses::FinMethodPasses;

  FeatureTotal draw_buffers(const LightFrame& frame, const LightFace& face) override {
    const DrawList list = draw_list_of(frame, face.fitted);
    shared_.shadow_map.run(shared_.triangles, frame.resident, list);
    if (!has_smoothies(frame.settings, face.as)) return {};
    HsFinShape shape = fin_shape(face.as, face.fitted, device().tile_px);
    shape.drop_hidden = frame.settings.faithful ? 0 : 1;
    if (frame.settings.smoothie_width > 0.0) {
      shape.radius_px = 0.0f;
      shape.width_px =
          static_cast<float>(frame.settings.smoothie_width * face.fitted.frustum.tan_half_x / face.fitted.lm_from_px_scale);
    }
    const FeatureTotal total = draw_features(frame, list, shape);
    depth_.reserve(device(), pixels_of(list.view), "fin depth");
    alpha_.reserve(device(), pixels_of(list.view), "fin alpha");
    launcher().launch_tiles(tiles_of(list.view),
                            kernels::RasterSmoothies{.light = list.view,
                                                     .shape = shape,
                                                     .feature_tiles = shared_.features.tiles(shared_.triangles),
                                                     .shadow_map = shared_.shadow_map.map(),
                                                     .tile_near_fins = shared_.features.tile_near_fins(),
                                                     .fin_depth = depth_,
                                                     .fin_alpha = alpha_});
    return total;
  }

  std::vector<LightBuffers::Plane> read_buffers(const LightFrame& frame, const LightFace& face) override {
    if (!has_smoothies(frame.settings, face.as)) return {};
    return {{"fin.Z", read_fin_plane(face.fitted.view, depth_, HS_EMPTY_Z)},
            {"fin.A", read_fin_plane(face.fitted.view, alpha_, 1.0f)}};
  }

 protected:
  void receive(const LightFrame& frame, const LightFace& face) override {
    if (!has_smoothies(frame.settings, face.as)) return receive_hard(frame, face);
    launcher().launch_pixels(frame.gbuffer.resolution,
                             kernels::ReceiveSmoothies{.light = face.fitted.view,
                                                       .view = frame.receiver(face),
                                                       .gbuffer = frame.gbuffer.arguments(),
                                                       .shadow_map = shared_.shadow_map.map(),
                                                       .fin_depth = depth_,
                                                       .fin_alpha = alpha_,
                                                       .tile_near_fins = shared_.features.tile_near_fins(),
                                                       .falloff = static_cast<cl_uint>(chosen_falloff(frame.settings)),
                                                       .visibility = frame.output()});
  }

 private:
  Buffer<cl_float> depth_, alpha_;  // a texel
};

}  // namespace

extern const MethodDeclaration smoothies_method;
constinit const MethodDeclaration smoothies_method{
    .info = {.method = Method::smoothies,
             .name = "smoothies",
             .summary = "outer penumbra from quads and corners at the silhouettes, minimum alpha",
             .source = "Chan & Durand 2003",
             .exact_when = "never: outer penumbra alone",
             .receivers = "any",
             .time = "triangles + silhouettes + pixels",
             .falloff = Falloff::sine,
             .faithful_falloff = Falloff::sine},
    .options = options,
    .create = create<SmoothiesPasses>,
    .refusal = refusal,
    .features_name = "fins"};

}  // namespace halfshade
