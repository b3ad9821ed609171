// Tile rasterization of smoothies: Chan & Durand 2003 §3 step 4 and §3.1.

// 1 - b/r at a texel, with b = 1/d the fin's depth and r = 1/d_receiver the receiver's, and alpha' = alpha / (1 - b/r) (Eq. 1).
// Both vanish at contact, where the penumbra has no width: a fin texel with b >= r lies behind the surface and is dropped before.
inline vfloat smoothie_alpha(const HsFinShape shape, vfloat distance_px, vfloat d, vfloat d_receiver) {
  const vfloat beyond = d - d_receiver;
  return shape.width_px > 0.0f ? distance_px * d / (shape.width_px * beyond) : distance_px / (shape.radius_px * beyond);
}

// fin_depth: float a texel: z of the nearest smoothie, HS_EMPTY_Z where there is none.
// fin_alpha: float a texel: the minimum of alpha' over all smoothies, 1 where there is none.
// tile_near_fins: uchar a tile: 1 if a 2x2 footprint that begins in the tile can meet a fin texel. Must be 0 before.
// Tiles without features, and with none beside them, are not written. A texel belongs to one work-item, so minimum and nearest need no atomics; they do not
// depend on the order of features. A smoothie texel with alpha' >= 1 shadows nothing and is not stored.
__kernel __attribute__((reqd_work_group_size(HS_TILE_ITEMS, 1, 1))) void raster_fins(
    const HsView view, const HsFinShape shape, __global const HsStatus* status, __global const ushort4* rects,
    __global const uint* offsets, __global const uint* refs, const uint capacity, __global const HsFeature* features,
    __global const float* shadow_map, __global float* fin_depth, __global float* fin_alpha, __global uchar* tile_near_fins) {
  const uint tile = get_group_id(0);
  const bool overflow = bins_overflow(offsets, view.tiles_x * view.tiles_y, capacity);
  const uint first = overflow ? 0 : offsets[tile], last = overflow ? status->feature_count : offsets[tile + 1];
  const uint tx = tile % view.tiles_x, ty = tile / view.tiles_x;
  const bool touched = offsets[tile] != offsets[tile + 1];
  bool beside = touched;  // a footprint that begins near a fin may reach into this tile
  for (uint v = ty > 0 ? ty - 1 : 0; v <= min(ty + 1, view.tiles_y - 1); ++v)
    for (uint u = tx > 0 ? tx - 1 : 0; u <= min(tx + 1, view.tiles_x - 1); ++u)
      beside |= offsets[v * view.tiles_x + u] != offsets[v * view.tiles_x + u + 1];
  const int2 tile_px = tile_origin_px(view);
  const int x_end = min(HS_TILE, (int)view.width_px - tile_px.x), y_end = min(HS_TILE, (int)view.height_px - tile_px.y);

  if (beside) {
    // Neighbouring features overlap by what rounding could have torn open between them.
    const float slack_px = 1.0f / 1024.0f;
    float d_receiver[HS_TILE_STORAGE], nearest_d[HS_TILE_STORAGE], least_alpha[HS_TILE_STORAGE];
    for (int i = 0; i < HS_TILE_STORAGE; ++i) nearest_d[i] = 0.0f;
    for (int i = 0; i < HS_TILE_STORAGE; ++i) least_alpha[i] = 1.0f;
    HS_FOR_TEXELS(x, y, 0, 0, x_end - 1, y_end - 1) {
      __global const float* z = shadow_map + (size_t)(tile_px.y + y) * view.width_px + tile_px.x + x;
      for (int i = 0; i < HS_LANES; ++i)
        d_receiver[HS_SLOT(x, y) + i] = x + i < x_end ? fmax(1.0f / z[i], view.d_far) : view.d_far;
    }

    for (uint i = first; i < last; ++i) {
      if (overflow && !rect_has(rects[i], tile, view.tiles_x)) continue;
      const HsFeature f = features[overflow ? i : refs[i]];
      const bool is_edge = f.kind == HS_FEATURE_EDGE;
      // Everything relative to the tile's first texel centre.
      const float2 a = (float2)(f.ax, f.ay) - convert_float2(tile_px) - 0.5f;
      float2 low = a, high = a, t = (float2)(0.0f), h0 = (float2)(f.bx, f.by), h1 = (float2)(f.bd, f.c);
      float length_px = 0.0f, d_step = 0.0f;
      const float reach_a = smoothie_reach_px(shape, f.ad, view.d_far);
      if (is_edge) {
        const float2 b = (float2)(f.bx, f.by) - convert_float2(tile_px) - 0.5f;
        length_px = sqrt(dot(b - a, b - a));
        t = (b - a) / length_px;
        d_step = (f.bd - f.ad) / length_px;
        const float2 outward = (float2)(t.y, -t.x);
        const float2 a_out = a + outward * reach_a, b_out = b + outward * smoothie_reach_px(shape, f.bd, view.d_far);
        low = fmin(fmin(a, b), fmin(a_out, b_out));
        high = fmax(fmax(a, b), fmax(a_out, b_out));
      } else {
        low = a - reach_a;
        high = a + reach_a;
      }
      const int x0 = max((int)ceil(fmax(low.x, -1.0f)), 0), x1 = min((int)floor(fmin(high.x, (float)HS_TILE)), x_end - 1);
      const int y0 = max((int)ceil(fmax(low.y, -1.0f)), 0), y1 = min((int)floor(fmin(high.y, (float)HS_TILE)), y_end - 1);
      HS_FOR_TEXELS(x, y, x0, y0, x1, y1) {
        const vfloat rx = v_float(x + v_iota) - a.x;
        const float ry = (float)y - a.y;
        vfloat distance_px, d;
        vint inside;
        if (is_edge) {
          const vfloat along = rx * t.x + ry * t.y;
          distance_px = rx * t.y - ry * t.x;
          d = f.ad + along * d_step;
          inside = (along >= -slack_px) & (along <= length_px + slack_px) & (distance_px >= -slack_px);
          distance_px = fmax(distance_px, 0.0f);
        } else {
          distance_px = sqrt(rx * rx + ry * ry);
          d = (vfloat)(f.ad);
          inside = (rx * h0.x + ry * h0.y >= -slack_px) & (rx * h1.x + ry * h1.y >= -slack_px);
        }
        const int slot = HS_SLOT(x, y);
        const vfloat d_r = v_load(d_receiver + slot);
        const vfloat alpha = smoothie_alpha(shape, distance_px, d, d_r);
        const vint shadows = inside & (d > d_r) & (alpha < 1.0f);
        v_store(v_select(v_load(nearest_d + slot), fmax(v_load(nearest_d + slot), d), shadows), nearest_d + slot);
        v_store(v_select(v_load(least_alpha + slot), fmin(v_load(least_alpha + slot), alpha), shadows), least_alpha + slot);
      }
    }

    HS_FOR_TEXELS(x, y, 0, 0, x_end - 1, y_end - 1) {
      const size_t out = (size_t)(tile_px.y + y) * view.width_px + tile_px.x + x;
      for (int i = 0; i < HS_LANES && x + i < x_end; ++i) {
        const float d = nearest_d[HS_SLOT(x, y) + i];
        fin_depth[out + i] = d > 0.0f ? 1.0f / d : HS_EMPTY_Z;
        fin_alpha[out + i] = least_alpha[HS_SLOT(x, y) + i];
      }
    }
    if (touched && get_local_id(0) == 0) {
      // Footprints that begin in the last row or column of the tiles before reach into this one.
      for (uint v = ty > 0 ? ty - 1 : 0; v <= ty; ++v)
        for (uint u = tx > 0 ? tx - 1 : 0; u <= tx; ++u) tile_near_fins[v * view.tiles_x + u] = 1;
    }
  }
}
