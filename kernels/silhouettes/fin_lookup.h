// Where look-ups of fin buffers are needed.

#pragma once

#include "base/receiver.h"

// Lanes whose 2x2 footprint can meet a fin. Fin buffers hold values in every tile that such a footprint can touch.
HS_INLINE vint near_fins(const HsView light, const Footprint* f, const Receiver* r, __global const uchar* tile_near_fins) {
  const vint tile = f->y / HS_TILE * (int)light.tiles_x + f->x / HS_TILE;
#if HS_LANES == 16
  // Neighbouring pixels mostly share a tile.
  const int first = tile.s0;
  if (v_all((tile == first) | r->decided)) return tile_near_fins[first] ? v_not(r->decided) : (vint)(0);
  int lanes[16];
  for (int k = 0; k < 16; ++k) lanes[k] = tile_near_fins[((const int*)&tile)[k]];
  return (vload16(0, lanes) != 0) & !r->decided;
#else
  return tile_near_fins[tile] != 0;
#endif
}
