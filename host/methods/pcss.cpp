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
    launcher().launch_pixels(frame.gbuffer.resolution,
                             kernels::ReceivePcss{.light = face.fitted.view,
                                                  .view = frame.receiver(face),
                                                  .gbuffer = frame.gbuffer.arguments(),
                                                  .shadow_map = shared_.shadow_map.map(),
                                                  .shape = fin_shape(face.as, face.fitted, device().tile_px),
                                                  .nearest_d = static_cast<cl_float>(1.0 / face.fitted.casters_znear),
                                                  .point_count = cl_uint{frame.settings.pcss_taps},
                                                  .points = points_.of(device(), face.as, frame.settings.pcss_taps).samples,
                                                  .visibility = frame.output()});
  }

 private:
  LightPointBuffers points_;
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
