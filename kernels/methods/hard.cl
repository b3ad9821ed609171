// hard: Williams 1978. The nearest texel of the shadow map decides.

#include "base/receiver.h"

__kernel void receive_hard(const HsView light, const HsReceiverView view, HS_ARGS_GBUFFER, __global const float* shadow_map,
                           HS_ARGS_VISIBILITY) {
  HS_FOR_RECEIVERS(visibility_hard(light, &r, shadow_map))
}
