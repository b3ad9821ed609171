// Tile binning for everything that is rasterized: count, scan, fill, with the true sizes.
// Counting is done by the kernel that makes the primitives (bound_triangles here, build_features in features.cl).

// Clips a triangle against the near plane and the guard band, before the divide (Sutherland & Hodgman), into fixed-point
// vertices of a convex polygon. Returns their number, 0 or 3 .. HS_CLIP_VERTICES.
// A cut point is computed from the inside vertex to the outside one, whichever triangle asks, so that neighbours agree about it.
// The polygon does not depend on where the file begins the triangle.
#define HS_CLIP_VERTICES 8
inline int clip_triangle(const HsView view, float3 a, float3 b, float3 c, int4* polygon) {
  float3 in[HS_CLIP_VERTICES], out[HS_CLIP_VERTICES];
  sort_corners(&a, &b, &c);
  in[0] = homogeneous_px(view, a);
  in[1] = homogeneous_px(view, b);
  in[2] = homogeneous_px(view, c);
  int count = 3;
  for (int plane = 0; plane < 5 && count > 0; ++plane) {
    int kept = 0;
    for (int i = 0; i < count; ++i) {
      const float3 p = in[i], q = in[i + 1 < count ? i + 1 : 0];
      const float guard = (float)HS_GUARD_PX;
      const float fp = plane == 0   ? p.z - view.znear
                       : plane == 1 ? guard * p.z - p.x
                       : plane == 2 ? guard * p.z + p.x
                       : plane == 3 ? guard * p.z - p.y
                                    : guard * p.z + p.y;
      const float fq = plane == 0   ? q.z - view.znear
                       : plane == 1 ? guard * q.z - q.x
                       : plane == 2 ? guard * q.z + q.x
                       : plane == 3 ? guard * q.z - q.y
                                    : guard * q.z + q.y;
      if (fp >= 0.0f && kept < HS_CLIP_VERTICES) out[kept++] = p;
      if ((fp >= 0.0f) != (fq >= 0.0f) && kept < HS_CLIP_VERTICES)
        out[kept++] = fp >= 0.0f ? p + (fp / (fp - fq)) * (q - p) : q + (fq / (fq - fp)) * (p - q);
    }
    for (int i = 0; i < kept; ++i) in[i] = out[i];
    count = kept;
  }
  for (int i = 0; i < count; ++i) {
    in[i].z = max(in[i].z, view.znear);
    polygon[i] = (int4)(snap_px(in[i]), as_int(1.0f / in[i].z), 0);
  }
  return count;
}

// First texel whose centre is at or after a fixed-point coordinate, and last whose centre is at or before it.
inline int first_texel(int fixed_px, uint mid_px) {
  return ((fixed_px + HS_SUBPIXEL / 2 - 1) >> HS_SUBPIXEL_BITS) + (int)mid_px;
}
inline int last_texel(int fixed_px, uint mid_px) {
  return ((fixed_px - HS_SUBPIXEL / 2) >> HS_SUBPIXEL_BITS) + (int)mid_px;
}

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
__kernel void bound_triangles(const HsView view, __global const HsBlock* blocks, __global const uint* triangles,
                              __global const float4* vertices_vs, __global const int4* vertices_px, __global ushort4* rects,
                              __global uint* tile_counts, __global HsStatus* status) {
  const HsBlock block = blocks[get_group_id(0)];
  ushort4 rect = (ushort4)(0);
  if (get_local_id(0) < block.count) {
    rect = triangle_rect(view, vload3(block.first + get_local_id(0), triangles), block.cull, vertices_vs, vertices_px, status);
    count_rect(rect, view.tiles_x, tile_counts);
  }
  rects[get_global_id(0)] = rect;
}

// As bound_triangles, but conservative: every tile that the triangle touches, whether it covers a texel's centre there or not,
// for the centre count asks at any point of the map.
__kernel void bound_triangles_wide(const HsView view, __global const HsBlock* blocks, __global const uint* triangles,
                                   __global const float4* vertices_vs, __global const int4* vertices_px, __global ushort4* rects,
                                   __global uint* tile_counts, __global HsStatus* status) {
  const HsBlock block = blocks[get_group_id(0)];
  ushort4 rect = (ushort4)(0);
  if (get_local_id(0) < block.count) {
    const uint3 corner = vload3(block.first + get_local_id(0), triangles);
    int4 polygon[HS_CLIP_VERTICES];
    polygon[0] = vertices_px[corner.x];
    polygon[1] = vertices_px[corner.y];
    polygon[2] = vertices_px[corner.z];
    const uint flags = as_uint(polygon[0].w | polygon[1].w | polygon[2].w);
    int count = 3;
    if (flags & HS_VERTEX_INVALID) {
      atomic_inc(&status->dropped_triangle_count);
      count = 0;
    } else if (flags != 0) {
      count = clip_triangle(view, vertices_vs[corner.x].xyz, vertices_vs[corner.y].xyz, vertices_vs[corner.z].xyz, polygon);
    }
    if (count >= 3) {
      int2 low = polygon[0].xy, high = polygon[0].xy;
      for (int i = 1; i < count; ++i) {
        low = min(low, polygon[i].xy);
        high = max(high, polygon[i].xy);
      }
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

// refs: feature indices, layer by layer and tile by tile. Any number of work-items.
__kernel void fill_features(const HsFinShape shape, __global const HsStatus* status, __global const HsFeature* features,
                            __global const ushort4* rects, __global uint* tile_cursors, __global uint* refs,
                            const uint capacity) {
  for (uint i = get_global_id(0); i < status->feature_count; i += get_global_size(0)) {
    const uint layer = features[i].kind_and_layer >> HS_FEATURE_KIND_BITS;
    fill_rect(rects[i], shape.tiles_x, i, tile_cursors + layer * (shape.tiles_x * shape.tiles_y), refs, capacity);
  }
}
