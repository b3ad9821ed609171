// What every method shows where nothing casts in the light's reach.

#include "base/receiver.h"

// Nothing casts in the light's reach: lit, but for what is turned away.
__kernel void receive_all(const HsView light, const HsReceiverView view, HS_ARGS_GBUFFER, HS_ARGS_VISIBILITY) {
  HS_FOR_RECEIVERS((vfloat)(1.0f))
}
