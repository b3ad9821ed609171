// A disc of `radius`.
#include "light/light_model.hpp"

namespace halfshade {
namespace {

constexpr LightKey disc_keys[] = {
    light_key("radius", &Light::radius, &is_not_negative_rule, Presence::optional, Motion::animated),
};

}  // namespace

const ShapeModel& disc_shape_model() {
  static constexpr ShapeModel model{.keys = disc_keys,
                                    .has_texture = false,
                                    .is_round = true,
                                    .other_keys_expected = "none for a disc",
                                    .other_keys_remedy = "; leave it out, or give the light the shape \"rectangle\"",
                                    .radius = [](const Light& light) { return light.radius; },
                                    .points =
                                        [](const Light&, unsigned n, std::uint32_t seed) {
                                          return LightPoints{disc_samples(n, seed), {}};
                                        }};
  return model;
}

}  // namespace halfshade
