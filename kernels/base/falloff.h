// From where in the penumbra to visibility: one function for all methods.

#pragma once

#include "base/lanes.h"

// sin(pi y) for |y| <= 1/2, to 1e-7: library functions are not vectorized on every device.
HS_INLINE vfloat sin_pi(vfloat y) {
  const vfloat s = y * y;
  return y * (3.14159265f - s * (5.16771278f - s * (2.55016404f - s * (0.59926453f - s * (0.08214589f - s * 0.00737043f)))));
}

// asin(u) for |u| <= 1, to 3e-8 (Abramowitz & Stegun 4.4.46).
HS_INLINE vfloat arc_sine(vfloat u) {
  const vfloat x = fabs(u);
  const vfloat p =
      1.5707963050f +
      x * (-0.2145988016f +
           x * (0.0889789874f +
                x * (-0.0501743046f + x * (0.0308918810f + x * (-0.0170881256f + x * (0.0066700901f - x * 0.0012624911f))))));
  return copysign(M_PI_2_F - sqrt(1.0f - x) * p, u);
}

// From where in the penumbra, 0..1, to visibility (Falloff in halfshade.hpp).
HS_INLINE vfloat falloff_of(vfloat x, uint falloff) {
  if (falloff == HS_FALLOFF_BERNSTEIN) return x * x * (3.0f - 2.0f * x);
  if (falloff == HS_FALLOFF_SINE) return clamp(0.5f + 0.5f * sin_pi(x - 0.5f), 0.0f, 1.0f);
  if (falloff == HS_FALLOFF_DISC) {
    const vfloat u = clamp(2.0f * x - 1.0f, -1.0f, 1.0f);
    return clamp(0.5f + (arc_sine(u) + u * sqrt(1.0f - u * u)) * M_1_PI_F, 0.0f, 1.0f);
  }
  return x;
}
