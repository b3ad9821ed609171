// hard: Williams 1978, "Casting Curved Shadows on Curved Surfaces".
#include "methods/method.hpp"

namespace halfshade {
namespace {

constexpr Option options[] = {light_res_option};

}  // namespace

extern const MethodDeclaration hard_method;
constinit const MethodDeclaration hard_method{.info = {.method = Method::hard,
                                                       .name = "hard",
                                                       .summary = "shadow map, nearest texel; no penumbra",
                                                       .source = "Williams 1978",
                                                       .exact_when = "never: no penumbra",
                                                       .receivers = "any",
                                                       .time = "triangles + pixels",
                                                       .falloff = Falloff::linear,
                                                       .faithful_falloff = Falloff::linear,
                                                       .any_shape = true},
                                              .options = options,
                                              .create = create<MethodPasses>};

}  // namespace halfshade
