// fins: Cai et al. 2006 §3, one layer of inner and outer fins.
#include "methods/shadow_fins.hpp"

namespace halfshade {
namespace {

constexpr Option options[] = {light_res_option, falloff_option, faithful_option};

}  // namespace

extern const MethodDeclaration fins_method;
constinit const MethodDeclaration fins_method{.info = {.method = Method::fins,
                                                       .name = "fins",
                                                       .summary = "inner and outer penumbra from fins at the silhouettes",
                                                       .source = "Cai et al. 2006, one layer",
                                                       .exact_when = "straight edges far apart, no caster above another",
                                                       .receivers = "any",
                                                       .time = "triangles + silhouettes + pixels",
                                                       .falloff = Falloff::disc,
                                                       .faithful_falloff = Falloff::bernstein},
                                              .options = options,
                                              .create = create<ShadowFinsPasses>,
                                              .features_name = "fins"};

}  // namespace halfshade
