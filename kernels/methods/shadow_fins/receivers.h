// Receivers near fins, as they are listed for tiles.

#pragma once

#include "base/receiver.h"

// Receivers near fins, tile by tile: runs of pixels (see list_fin_receivers), depth of each tile's farthest as float bits, a
// word a pixel, and what of the light lies above a receiver's horizon where that is not all of it.
#define HS_ARGS_FIN_RECEIVERS                                                                       \
  __global const uint *receiver_offsets, __global const uint *listed, __global const int *tile_far, \
      __global const uint *receiver_words, __global const float *horizon_limits

#define HS_LIT_SHIFT 24  // of a receiver's word: (tile + 1) | lit texels of its footprint << HS_LIT_SHIFT; 0 where no fin is near
#define HS_WORD_TILE ((1 << HS_LIT_SHIFT) - 1)
#define HS_WORD_LIMITED \
  (1 << (HS_LIT_SHIFT + 4))  // the pixel may not have all of the light: what it may have is in `horizon_limits`

// Runs of HS_LANES pixels are listed by tile, those that lie in more than one tile in each. Where a run begins: px | py << 16.
#define HS_RUN_Y_SHIFT 16
