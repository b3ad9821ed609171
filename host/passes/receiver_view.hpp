// G-buffer pixels to the space of a light's map, and lights as shading reads them.
#pragma once

#include "light/fit.hpp"

namespace halfshade {

/// What turns pixels with their view depths, or positions in the world, into the space of a light's map. `resolution` is the
/// G-buffer's; the camera's field of view is vertical. `tolerance`: see GBuffer::tolerance.
HsReceiverView receiver_view(const Camera& camera, glm::uvec2 resolution, bool has_depth, double tolerance, const Light& light,
                             const LightView& fitted);

/// The light relative to the camera's position, as shading reads it.
HsShadeLight shade_light(const Camera& camera, const Light& light);
/// View rays in world axes from the camera's position.
HsReceiverView shade_view(const Camera& camera, glm::uvec2 resolution, bool has_depth);

}  // namespace halfshade
