// Depths at which casters stand, as bits.

#pragma once

#include "base/lanes.h"

// The bit that a depth has in a texel's mask of casters.
HS_INLINE uint caster_bit(__global const float* caster_range, float z) {
  return (uint)clamp((z - caster_range[0]) * caster_range[1], 0.0f, HS_CASTER_BITS - 1.0f);
}
