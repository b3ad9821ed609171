// Tile binning for everything that is rasterized: count, scan, fill, with the true sizes.
// Counting is done by the kernel that makes the primitives (bound_triangles here, build_features in silhouettes/features.cl).

#include "base/tiles.h"
#include "raster/clip.h"

// The tiles a triangle may touch; none if it covers no texel centre, is culled or has a vertex that is not finite.
inline ushort4 triangle_rect(const HsView view, uint3 corner, uint cull, __global const float4* vertices_vs,
                             __global const int4* vertices_px, __global HsStatus* status) {
  const int4 a = vertices_px[corner.x], b = vertices_px[corner.y], c = vertices_px[corner.z];
  const uint flags = as_uint(a.w | b.w | c.w);
  int2 low, high;
  if (flags == 0) {
    if (cull != HS_CULL_NONE) {
      const long area = (long)(b.x - a.x) * (c.y - a.y) - (long)(b.y - a.y) * (c.x - a.x);
      if (cull == HS_CULL_POSITIVE ? area >= 0 : area <= 0) return (ushort4)(0);
    }
    low = min(a.xy, min(b.xy, c.xy));
    high = max(a.xy, max(b.xy, c.xy));
  } else {
    if (flags & HS_VERTEX_INVALID) {
      atomic_inc(&status->dropped_triangle_count);
      return (ushort4)(0);
    }
    int4 polygon[HS_CLIP_VERTICES];
    const int count =
        clip_triangle(view, vertices_vs[corner.x].xyz, vertices_vs[corner.y].xyz, vertices_vs[corner.z].xyz, polygon);
    if (count < 3) return (ushort4)(0);
    low = high = polygon[0].xy;
    for (int i = 1; i < count; ++i) {
      low = min(low, polygon[i].xy);
      high = max(high, polygon[i].xy);
    }
  }
  return rect_of_texels(view, first_texel(low.x, view.mid_x_px), first_texel(low.y, view.mid_y_px),
                        last_texel(high.x, view.mid_x_px), last_texel(high.y, view.mid_y_px));
}

// rects: ushort4 a launched triangle (slot = group * HS_BLOCK_SIZE + local id). tile_counts must be 0.
__kernel void bound_triangles(const HsView view, __global const HsBlock* blocks, HS_ARGS_TRIANGLES, __global ushort4* rects,
                              __global uint* tile_counts, __global HsStatus* status) {
  const HsBlock block = blocks[get_group_id(0)];
  ushort4 rect = (ushort4)(0);
  if (get_local_id(0) < block.count) {
    rect = triangle_rect(view, vload3(block.first + get_local_id(0), triangles), block.cull, vertices_vs, vertices_px, status);
    count_rect(rect, view.tiles_x, tile_counts);
  }
  rects[get_global_id(0)] = rect;
}

// The box in the map, fixed point, about what of a triangle lies before the view's plane, when some of its corners lie before the
// near plane or outside the guard band: as far as the guard band where it is not bounded. Empty where there is nothing.
HS_INLINE void bound_clipped(const HsView view, float3 a, float3 b, float3 c, int2* low, int2* high) {
  const float3 corners[3] = {a, b, c};
  const float guard = (float)HS_GUARD_PX;
  float2 least = (float2)(INFINITY), most = (float2)(-INFINITY);
  for (int i = 0; i < 3; ++i) {
    const float3 from = homogeneous_px(view, corners[i]), to = homogeneous_px(view, corners[i < 2 ? i + 1 : 0]);
    if (from.z > 0.0f) {
      const float2 at = clamp(from.xy / from.z, -guard, guard);
      least = min(least, at);
      most = max(most, at);
    }
    if ((from.z > 0.0f) == (to.z > 0.0f)) continue;
    // Towards the plane it leads to infinity, in the direction of the cut with it.
    const float2 cut = from.xy + (to.xy - from.xy) * (from.z / (from.z - to.z));
    const float2 rounding = (fabs(from.xy) + fabs(to.xy)) * 1e-6f;
    least = select(least, (float2)(-guard), cut <= rounding);
    most = select(most, (float2)(guard), cut >= -rounding);
  }
  *low = convert_int2_rtn(least * (float)HS_SUBPIXEL);
  *high = convert_int2_rtp(most * (float)HS_SUBPIXEL);
}

// As bound_triangles, but conservative: every tile that the triangle touches, whether it covers a texel's centre there or not,
// for the centre count asks at any point of the map.
__kernel void bound_triangles_wide(const HsView view, __global const HsBlock* blocks, HS_ARGS_TRIANGLES, __global ushort4* rects,
                                   __global uint* tile_counts, __global HsStatus* status) {
  const HsBlock block = blocks[get_group_id(0)];
  ushort4 rect = (ushort4)(0);
  if (get_local_id(0) < block.count) {
    const uint3 corner = vload3(block.first + get_local_id(0), triangles);
    const int4 a = vertices_px[corner.x], b = vertices_px[corner.y], c = vertices_px[corner.z];
    const uint flags = as_uint(a.w | b.w | c.w);
    if (flags & HS_VERTEX_INVALID) {
      atomic_inc(&status->dropped_triangle_count);
    } else {
      int2 low = min(a.xy, min(b.xy, c.xy)), high = max(a.xy, max(b.xy, c.xy));
      if (flags != 0)
        bound_clipped(view, vertices_vs[corner.x].xyz, vertices_vs[corner.y].xyz, vertices_vs[corner.z].xyz, &low, &high);
      rect = rect_of_texels(
          view, ((low.x - 4) >> HS_SUBPIXEL_BITS) + (int)view.mid_x_px, ((low.y - 4) >> HS_SUBPIXEL_BITS) + (int)view.mid_y_px,
          ((high.x + 4) >> HS_SUBPIXEL_BITS) + (int)view.mid_x_px, ((high.y + 4) >> HS_SUBPIXEL_BITS) + (int)view.mid_y_px);
      count_rect(rect, view.tiles_x, tile_counts);
    }
  }
  rects[get_global_id(0)] = rect;
}

// Counts to offsets: offsets[t] = sum of counts before t, offsets[tile_count] = total; counts become the fill's cursors.
// counts: uint a tile, `copies` times.
// One work-group; each work-item sums a run of tiles, the first one scans the runs.
#define HS_SCAN_ITEMS 64
__kernel __attribute__((reqd_work_group_size(HS_SCAN_ITEMS, 1, 1))) void scan_tiles(const uint tile_count, const uint copies,
                                                                                    __global uint* counts,
                                                                                    __global uint* offsets) {
  __local uint run_totals[HS_SCAN_ITEMS];
  const uint run = (tile_count + HS_SCAN_ITEMS - 1) / HS_SCAN_ITEMS;
  const uint begin = min(run * (uint)get_local_id(0), tile_count), end = min(begin + run, tile_count);
  uint total = 0;
  for (uint copy = 0; copy < copies; ++copy)
    for (uint t = begin; t < end; ++t) total += counts[copy * tile_count + t];
  run_totals[get_local_id(0)] = total;
  barrier(CLK_LOCAL_MEM_FENCE);
  uint before = 0;
  for (uint i = 0; i < get_local_id(0); ++i) before += run_totals[i];
  for (uint t = begin; t < end; ++t) {
    offsets[t] = before;
    for (uint i = t; i < copies * tile_count; i += tile_count) {
      const uint count = counts[i];
      counts[i] = before;
      before += count;
    }
  }
  if (get_local_id(0) == HS_SCAN_ITEMS - 1) offsets[tile_count] = before;
}

// refs: triangle indices, tile by tile.
__kernel void fill_triangles(const HsView view, __global const HsBlock* blocks, __global const ushort4* rects,
                             __global uint* tile_cursors, __global uint* refs, const uint capacity) {
  const HsBlock block = blocks[get_group_id(0)];
  if (get_local_id(0) < block.count)
    fill_rect(rects[get_global_id(0)], view.tiles_x, block.first + get_local_id(0), tile_cursors, refs, capacity);
}
