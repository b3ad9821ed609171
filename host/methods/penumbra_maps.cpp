// penumbra-maps: Wyman & Hansen 2003, "Penumbra Maps: Approximate Soft Shadows in Real-Time".
#include "light/light_model.hpp"
#include "methods/method.hpp"

namespace halfshade {
namespace {

constexpr Option options[] = {light_res_option, falloff_option, faithful_option};

class PenumbraMapsPasses final : public FinMethodPasses {
 public:
  using FinMethodPasses::FinMethodPasses;

  FeatureTotal draw_buffers(const LightFrame& frame, const LightFace& face) override {
    const DrawList list = draw_list_of(frame, face.fitted);
    shared_.shadow_map.run(shared_.triangles, frame.resident, list);
    if (disc_radius(face.as) <= 0.0) return {};
    HsFinShape shape = fin_shape(face.as, face.fitted, device().tile_px);
    shape.drop_hidden = frame.settings.faithful ? 0 : 1;
    const FeatureTotal total = draw_features(frame, list, shape);
    map_.reserve(device(), pixels_of(list.view), "penumbra map");
    launcher().launch_tiles(tiles_of(list.view),
                            kernels::RasterPenumbraMap{.light = list.view,
                                                       .shape = shape,
                                                       .feature_tiles = shared_.features.tiles(shared_.triangles),
                                                       .shadow_map = shared_.shadow_map.map(),
                                                       .tile_near_fins = shared_.features.tile_near_fins(),
                                                       .penumbra_map = map_,
                                                       .falloff = static_cast<cl_uint>(chosen_falloff(frame.settings))});
    return total;
  }

  std::vector<LightBuffers::Plane> read_buffers(const LightFrame&, const LightFace& face) override {
    if (disc_radius(face.as) <= 0.0) return {};
    return {{"penumbra_map.Y", read_fin_plane(face.fitted.view, map_, 1.0f)}};
  }

 protected:
  void receive(const LightFrame& frame, const LightFace& face) override {
    if (disc_radius(face.as) <= 0.0) return receive_hard(frame, face);
    launcher().launch_pixels(frame.gbuffer.resolution,
                             kernels::ReceivePenumbraMap{.light = face.fitted.view,
                                                         .view = frame.receiver(face),
                                                         .gbuffer = frame.gbuffer.arguments(),
                                                         .shadow_map = shared_.shadow_map.map(),
                                                         .penumbra_map = map_,
                                                         .tile_near_fins = shared_.features.tile_near_fins(),
                                                         .visibility = frame.output()});
  }

 private:
  Buffer<cl_float> map_;  // a texel
};

}  // namespace

extern const MethodDeclaration penumbra_maps_method;
constinit const MethodDeclaration penumbra_maps_method{
    .info = {.method = Method::penumbra_maps,
             .name = "penumbra-maps",
             .summary = "outer penumbra from cones and sheets at the silhouettes, darkest wins",
             .source = "Wyman & Hansen 2003",
             .exact_when = "never: outer penumbra alone",
             .receivers = "any",
             .time = "triangles + silhouettes + pixels",
             .falloff = Falloff::bernstein,
             .faithful_falloff = Falloff::bernstein},
    .options = options,
    .create = create<PenumbraMapsPasses>,
    .features_name = "fins"};

}  // namespace halfshade
