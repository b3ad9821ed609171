// layered-fins: Cai et al. 2006 §4, fins in layers parallel to the light.
#include "methods/shadow_fins.hpp"

namespace halfshade {
namespace {

constexpr OptionText layers_text{"layers",  "layers", "N|auto", "1 to 1024, or as many as the scene's depths call for",
                                 "4 16 64", "16"};

void set_layers(Settings& settings, std::string_view typed) {
  if (typed == "auto")
    settings.layers.reset();
  else
    number<&Settings::layers, 1, HS_MAX_LAYERS>(layers_text).set(settings, typed);
}

std::string layers_as_text(const Settings& settings) {
  const std::optional<unsigned> count = chosen_layers(settings);
  return count ? fmt::format("{}", *count) : "auto";
}

constexpr Option options[] = {light_res_option, falloff_option, {layers_text, set_layers, layers_as_text}, faithful_option};

class LayeredFinsPasses final : public ShadowFinsPasses {
 public:
  using ShadowFinsPasses::ShadowFinsPasses;

 protected:
  HsLayers layers_of(const Settings& settings) const override {
    HsLayers layers = ShadowFinsPasses::layers_of(settings);
    layers.count = chosen_layers(settings).value_or(HS_AUTO_LAYERS);
    layers.automatic = !chosen_layers(settings);
    return layers;
  }
};

}  // namespace

extern const MethodDeclaration layered_fins_method;
constinit const MethodDeclaration layered_fins_method{
    .info = {.method = Method::layered_fins,
             .name = "layered-fins",
             .summary = "the same, layer by layer of depth: casters below one another",
             .source = "Cai et al. 2006",
             .exact_when = "straight edges far apart, a layer for each caster",
             .receivers = "any",
             .time = "triangles + silhouettes + layers x pixels",
             .falloff = Falloff::disc,
             .faithful_falloff = Falloff::bernstein},
    .options = options,
    .create = create<LayeredFinsPasses>,
    .features_name = "fins"};

}  // namespace halfshade
