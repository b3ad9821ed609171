// Potential silhouettes to the tiles of receivers that may have them before the disc: block by block, as far as their penumbrae
// reach at the tile's farthest receiver.

#include "methods/exact/map_edges.h"

// A block of edges in the map, and the rectangle that holds them.
typedef struct {
  MapEdges edges;
  vint some;         // which lanes have an edge
  float2 low, high;  // texels
  float d;           // 1/z of what is nearest to the light
  bool everywhere;
} MapBlock;

HS_INLINE void load_block(const HsView view, __global const EdgeBlock* block, int count, MapBlock* in_map) {
  MapEdges* e = &in_map->edges;
  project_to_map(view, v_load(block->ax), v_load(block->ay), v_load(block->az), v_load(block->bx), v_load(block->by),
                 v_load(block->bz), e);
  const vint some = v_iota < count;
  const vfloat none = (vfloat)(INFINITY);
  in_map->some = some;
  in_map->everywhere = v_any(some & e->everywhere);
  in_map->low =
      (float2)(v_reduce_min(v_select(none, min(e->ax, e->bx), some)), v_reduce_min(v_select(none, min(e->ay, e->by), some)));
  in_map->high =
      -(float2)(v_reduce_min(v_select(none, min(-e->ax, -e->bx), some)), v_reduce_min(v_select(none, min(-e->ay, -e->by), some)));
  in_map->d = -v_reduce_min(v_select(none, min(-e->da, -e->db), some));
}

HS_INLINE ushort4 rect_of_block(const HsView view, const MapBlock* block, float radius_px) {
  if (block->everywhere) return (ushort4)(0, 0, view.tiles_x, view.tiles_y);
  const float reach = v_reduce_min(edge_reach(radius_px, (vfloat)(block->d), (vfloat)(view.d_far)));  // the same in all lanes
  return rect_of_points(view, block->low - reach, block->high + reach);
}

// Which of the tiles from x on, up to `end`, of a row have a receiver that can have an edge of a block before its disc, or within
// HS_NEAR_PX of it in the map: as lane_bits. tile_far: depth of the farthest receiver of each tile, 0 for none;
// a vector may be read from any of them on.
HS_INLINE uint tiles_with_block(const HsView view, const MapBlock* block, float radius_px, uint x, uint end, uint y,
                                __global const float* tile_far) {
  const vfloat far = v_load(tile_far + y * view.tiles_x + x);
  const vint have = (v_iota < (int)(end - x)) & (far > 0.0f);
  if (block->everywhere || !v_any(have)) return lane_bits(have);
  const float half_px = HS_TILE * 0.5f;
  const vfloat d_far = 1.0f / far, reach = edge_reach(radius_px, (vfloat)(block->d), d_far) + half_px;
  const vfloat middle_x = (v_float((int)x + v_iota) + 0.5f) * (float)HS_TILE;
  const float middle_y = ((float)y + 0.5f) * (float)HS_TILE;
  const vint touches = have & (block->d >= d_far * HS_BEYOND) & (block->low.x - reach <= middle_x) &
                       (block->high.x + reach >= middle_x) & (block->low.y - reach <= middle_y) &
                       (block->high.y + reach >= middle_y);
  // Where a block is not small against its penumbrae, some of those tiles have none of its edges.
  const float2 size = block->high - block->low;
  uint bits = lane_bits(touches);
  for (uint left = bits & lane_bits(reach < 4.0f * max(size.x, size.y)); left != 0; left &= left - 1) {
    const int lane = first_lane(left);
    const float2 middle_px = (float2)(HS_FLOAT_LANE(middle_x, lane), middle_y);
    if (!v_any(block->some & reach_receivers(&block->edges, radius_px, middle_px, (float2)(half_px), HS_FLOAT_LANE(d_far, lane))))
      bits &= ~(1u << lane);
  }
  return bits;
}

// Runs the body for each `tile` that has edges of block i. They are listed first: loops for each row would hardly ever be as long
// as the one before.
#if HS_LANES == 16
#define HS_LISTED_TILES 512
#else
#define HS_LISTED_TILES 1
#endif
#define HS_FOR_BLOCK_TILES(tile, i, body)                                                    \
  {                                                                                          \
    MapBlock block;                                                                          \
    load_block(view, edges + i, edges_in_block(i, status->feature_count), &block);           \
    const ushort4 rect = rect_of_block(view, &block, radius_px);                             \
    for (uint x = rect.x, y = rect.y; y < rect.w;) {                                         \
      int listed[HS_LISTED_TILES], listed_count = 0;                                         \
      while (y < rect.w && listed_count <= HS_LISTED_TILES - HS_LANES) {                     \
        const uint bits = tiles_with_block(view, &block, radius_px, x, rect.z, y, tile_far); \
        append_chosen((int)(y * view.tiles_x + x) + v_iota, bits, listed, &listed_count);    \
        x += HS_LANES;                                                                       \
        if (x >= rect.z) {                                                                   \
          x = rect.x;                                                                        \
          ++y;                                                                               \
        }                                                                                    \
      }                                                                                      \
      for (int k = 0; k < listed_count; ++k) {                                               \
        const int tile = listed[k];                                                          \
        body                                                                                 \
      }                                                                                      \
    }                                                                                        \
  }

// Adds one to a tile's count and returns what it was.
#if HS_LANES == 16
#define HS_COUNT_UP(count) ((*(count))++)  // which is the work-item's own
#else
#define HS_COUNT_UP atomic_inc
#endif

// tile_counts: uint a tile, `copies` times, must be 0: on CPU devices as many as work-items, one for each, for cores that count
// in the same lines of the cache wait for each other.
__kernel void count_edges(const HsView view, const float radius_px, __global const HsStatus* status,
                          __global const EdgeBlock* edges, __global const float* tile_far, __global uint* tile_counts,
                          const uint copies) {
  __global uint* own_counts = tile_counts + get_global_id(0) % copies * (view.tiles_x * view.tiles_y);
  for (uint i = get_global_id(0); i < blocks_of(status->feature_count); i += get_global_size(0))
    HS_FOR_BLOCK_TILES(tile, i, { HS_COUNT_UP(&own_counts[tile]); })
}

// refs: blocks of edges, tile by tile.
__kernel void fill_edges(const HsView view, const float radius_px, __global const HsStatus* status,
                         __global const EdgeBlock* edges, __global const float* tile_far, __global uint* tile_cursors,
                         const uint copies, __global uint* refs, const uint capacity) {
  __global uint* own_cursors = tile_cursors + get_global_id(0) % copies * (view.tiles_x * view.tiles_y);
  for (uint i = get_global_id(0); i < blocks_of(status->feature_count); i += get_global_size(0))
    HS_FOR_BLOCK_TILES(tile, i, {
      const uint slot = HS_COUNT_UP(&own_cursors[tile]);
      if (slot < capacity) refs[slot] = i;
    })
}
