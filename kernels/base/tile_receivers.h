// Receivers to the tiles that they lie in.

#pragma once

#include "base/lanes.h"

// Takes the lanes of the least tile out of those that are left.
HS_INLINE vint next_tile(vint tiles, vint* left, int* tile) {
  *tile = v_reduce_min_int(v_select((vint)(INT_MAX), tiles, *left));
  const vint same = *left & (tiles == *tile);
  *left &= v_not(same);
  return same;
}

// Adds receivers of a tile to its number, and the farthest one's depth to its bound, float bits.
HS_INLINE void bound_tile(vint receivers, vfloat z, __global int* far, __global uint* count, uint more) {
  atomic_max(far, -v_reduce_min_int(v_select((vint)(0), -v_as_int(z), receivers)));
  atomic_add(count, more);
}
