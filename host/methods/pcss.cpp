// pcss: Fernando 2005, "Percentage-Closer Soft Shadows".
#include "light/light_model.hpp"
#include "methods/method.hpp"
#include "passes/light_points.hpp"

namespace halfshade {
namespace {

constexpr Option options[] = {
    light_res_option,
    choice<&Settings::pcss_taps, 32, 16, 32>(
        {"pcss-taps", "pcss_taps", "16|32", "Look-ups of the search for blockers, and of the filter", "16 32", "16 32"})};

class PcssPasses final : public MethodPasses {
 public:
  using MethodPasses::MethodPasses;
  bool searches_map() const override { return true; }

 protected:
  void receive(const LightFrame& frame, const LightFace& face) override {
    if (disc_radius(face.as) <= 0.0) return receive_hard(frame, face);
    const HsFinShape shape = fin_shape(face.as, face.fitted, device().tile_px);
    bound_search(face, shape);
    launcher().launch_pixels(frame.gbuffer.resolution,
                             kernels::ReceivePcss{.light = face.fitted.view,
                                                  .view = frame.receiver(face),
                                                  .gbuffer = frame.gbuffer.arguments(),
                                                  .shadow_map = shared_.shadow_map.map(),
                                                  .shape = shape,
                                                  .search_depths = search_depths_,
                                                  .point_count = cl_uint{frame.settings.pcss_taps},
                                                  .points = points_.of(device(), face.as, frame.settings.pcss_taps).samples,
                                                  .visibility = frame.output()});
  }

 private:
  /// bound_map_depths and spread_map_depths: how far each tile's receivers search.
  void bound_search(const LightFace& face, const HsFinShape& shape) {
    // As many as fill the map.
    const HsView& view = face.fitted.view;
    const std::size_t tiles = std::size_t{view.width_px / HS_SEARCH_TILE + 1} * (view.height_px / HS_SEARCH_TILE + 1);
    tile_depths_.reserve(device(), tiles, "tile depths");
    search_depths_.reserve(device(), 2 * tiles, "search depths");
    launcher().launch_strided(
        kernels::BoundMapDepths{.light = view, .shadow_map = shared_.shadow_map.map(), .tile_depths = tile_depths_});
    launcher().launch_strided(kernels::SpreadMapDepths{.light = face.fitted.view,
                                                       .shape = shape,
                                                       .nearest_d = static_cast<cl_float>(1.0 / face.fitted.casters_znear),
                                                       .tile_depths = tile_depths_,
                                                       .search_depths = search_depths_});
  }

  LightPointBuffers points_;
  Buffer<cl_float> tile_depths_;    // a tile
  Buffer<cl_float> search_depths_;  // two a tile
};

}  // namespace

extern const MethodDeclaration pcss_method;
constinit const MethodDeclaration pcss_method{
    .info = {.method = Method::pcss,
             .name = "pcss",
             .summary = "shadow map, comparisons filtered as widely as the mean depth of the blockers around asks for",
             .source = "Fernando 2005",
             .exact_when = "one blocker parallel to light and receiver",
             .receivers = "any",
             .time = "triangles + pixels x taps",
             .falloff = Falloff::linear,
             .faithful_falloff = Falloff::linear},
    .options = options,
    .create = create<PcssPasses>};

}  // namespace halfshade
