// pcf: Reeves, Salesin & Cook 1987, "Rendering Antialiased Shadows with Depth Maps".
#include "methods/method.hpp"

namespace halfshade {
namespace {

constexpr Option options[] = {light_res_option,
                              choice<&Settings::pcf_filter, 2, 2, 4>(
                                  {"pcf-filter", "pcf_filter", "2|4", "2x2 bilinear or 4x4 bicubic B-spline", "2 4", "2 4"})};

class PcfPasses final : public MethodPasses {
 public:
  using MethodPasses::MethodPasses;

 protected:
  void receive(const LightFrame& frame, const LightFace& face) override {
    const auto look_up = [&]<class Kernel>(std::type_identity<Kernel>) {
      launcher().launch_pixels(frame.gbuffer.resolution, Kernel{.light = face.fitted.view,
                                                                .view = frame.receiver(face),
                                                                .gbuffer = frame.gbuffer.arguments(),
                                                                .shadow_map = shared_.shadow_map.map(),
                                                                .visibility = frame.output()});
    };
    if (frame.settings.pcf_filter == 4)
      look_up(std::type_identity<kernels::ReceivePcf4>{});
    else
      look_up(std::type_identity<kernels::ReceivePcf2>{});
  }
};

}  // namespace

extern const MethodDeclaration pcf_method;
constinit const MethodDeclaration pcf_method{
    .info = {.method = Method::pcf,
             .name = "pcf",
             .summary = "shadow map, filtered comparisons (2x2 bilinear or 4x4 bicubic); antialiased, no penumbra",
             .source = "Reeves, Salesin & Cook 1987",
             .exact_when = "never: no penumbra",
             .receivers = "any",
             .time = "triangles + pixels",
             .falloff = Falloff::linear,
             .faithful_falloff = Falloff::linear,
             .any_shape = true},
    .options = options,
    .create = create<PcfPasses>};

}  // namespace halfshade
