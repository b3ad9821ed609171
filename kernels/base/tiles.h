// The tiles of a view, and the lists of what touches each.

#pragma once

#include "base/lanes.h"

// The tile of the calling work-group, and its first texel.
HS_INLINE int2 tile_origin_px(const HsView view) {
  const uint tile = get_group_id(0);
  return (int2)(tile % view.tiles_x, tile / view.tiles_x) * HS_TILE;
}

// A list of things that touch each tile: the references of tile t are refs[offsets[t] .. offsets[t+1]).
// Where the total is more than the buffer holds, refs is unusable and the tile goes through all rects instead: slow, but whole.
HS_INLINE bool bins_overflow(__global const uint* offsets, uint tile_count, uint capacity) {
  return offsets[tile_count] > capacity;
}

// The tiles a primitive may touch: x0, y0 inclusive, x1, y1 exclusive; all 0 for none.
HS_INLINE bool rect_has(ushort4 rect, uint tile, uint tiles_x) {
  const uint x = tile % tiles_x, y = tile / tiles_x;
  return x >= rect.x && x < rect.z && y >= rect.y && y < rect.w;
}

// A rectangle in texels, inclusive, to tiles. Empty where it misses the map.
HS_INLINE ushort4 rect_of_texels(const HsView view, int x0, int y0, int x1, int y1) {
  x0 = max(x0, 0);
  y0 = max(y0, 0);
  x1 = min(x1, (int)view.width_px - 1);
  y1 = min(y1, (int)view.height_px - 1);
  if (x0 > x1 || y0 > y1) return (ushort4)(0);
  return convert_ushort4((int4)(x0 / HS_TILE, y0 / HS_TILE, x1 / HS_TILE + 1, y1 / HS_TILE + 1));
}

HS_INLINE void count_rect(ushort4 rect, uint tiles_x, __global uint* tile_counts) {
  for (uint y = rect.y; y < rect.w; ++y)
    for (uint x = rect.x; x < rect.z; ++x) atomic_inc(&tile_counts[y * tiles_x + x]);
}

HS_INLINE void fill_rect(ushort4 rect, uint tiles_x, uint id, __global uint* tile_cursors, __global uint* refs, uint capacity) {
  for (uint y = rect.y; y < rect.w; ++y)
    for (uint x = rect.x; x < rect.z; ++x) {
      const uint slot = atomic_inc(&tile_cursors[y * tiles_x + x]);
      if (slot < capacity) refs[slot] = id;
    }
}
