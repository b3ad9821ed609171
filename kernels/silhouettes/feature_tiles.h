// Tile rasterization of silhouette features, and what each method makes of a texel's signed distance delta from a feature
// (positive outside the caster) and of 1/Lb at the feature's nearest point.
//
// A tile's texels belong to one work-group, each to one work-item: minimum, maximum and nearest need no atomics and do not depend
// on the order of features. Buffers are written in every tile that a 2x2 footprint which meets a feature's texel can touch; other
// tiles are not written, and tile_near_fins says so.

#pragma once

#include "silhouettes/fin_shape.h"

// Features, and the tiles' lists of them (silhouettes/features.cl), layer by layer; their number is in `status`.
#define HS_ARGS_FEATURE_TILES                                                                                 \
  __global const HsStatus *status, __global const HsFeature *features, __global const ushort4 *feature_rects, \
      __global const uint *feature_offsets, __global const uint *feature_refs, const uint feature_capacity

// A feature as a tile sees it: positions relative to the tile's first texel centre.
typedef struct {
  float2 a, t, h0, h1;
  float ad, d_step, length_px;
  // Where the light is a sphere: sphere_q of a and of the tile's first texel centre, texels to q, sphere_skew at both ends of an
  // edge.
  float2 q, tile_q;
  float q_per_px, skew, end_skew;
  float d_low, d_high;  // of its points
  // It lies between four lines: in row a.y + ry, beyond (or, where not low, before) x = span + ry * span_step.
  float4 span, span_step;
  int4 span_is_low;
  uint kind;
  bool inner;          // it has an inner fin
  float width_px;      // of its caster: feature_width_px
  int x0, y0, x1, y1;  // texels of the tile that it may reach, inclusive
} TileFeature;

// Boxes and spans are wider than what they hold by more than their own rounding, and than HS_SLACK_PX.
#define HS_SPAN_SLACK_PX (1.0f / 64.0f)

HS_INLINE TileFeature set_up_feature(const HsView view, const HsFinShape shape, const HsFeature f, int2 tile_px, int x_end,
                                     int y_end) {
  TileFeature t;
  t.a = (float2)(f.ax, f.ay) - convert_float2(tile_px) - 0.5f;
  t.ad = f.ad;
  t.d_low = t.d_high = f.ad;
  t.kind = f.kind_and_layer & ((1u << HS_FEATURE_KIND_BITS) - 1u);
  t.inner = t.kind != HS_FEATURE_OUTER_EDGE;
  t.width_px = feature_width_px(f);
  if (t.kind == HS_FEATURE_OUTER_EDGE) t.kind = HS_FEATURE_EDGE;
  t.t = (float2)(0.0f);
  t.h0 = (float2)(f.bx, f.by);
  t.h1 = (float2)(f.bd, f.c);
  t.length_px = t.d_step = t.skew = t.end_skew = 0.0f;
  t.q_per_px = shape.sphere_q_per_px;
  t.q = sphere_q(view, shape, (float2)(f.ax, f.ay));
  t.tile_q = sphere_q(view, shape, convert_float2(tile_px) + 0.5f);
  float2 low, high;
  float reach = reach_at(shape, t.q, f.ad, view.d_far);
  if (t.kind == HS_FEATURE_EDGE) {
    const float2 b = (float2)(f.bx, f.by) - convert_float2(tile_px) - 0.5f;
    t.length_px = sqrt(dot(b - t.a, b - t.a));
    t.t = (b - t.a) / t.length_px;
    t.d_step = (f.bd - f.ad) / t.length_px;
    t.d_low = min(f.ad, f.bd);
    t.d_high = max(f.ad, f.bd);
    const float2 outward = (float2)(t.t.y, -t.t.x), end_q = sphere_q(view, shape, (float2)(f.bx, f.by));
    t.skew = sphere_skew(t.q, outward, t.t);
    t.end_skew = sphere_skew(end_q, outward, t.t);
    reach = max(reach, reach_at(shape, end_q, f.bd, view.d_far));
    bound_quad(shape, (float3)(t.a, f.ad), (float3)(b, f.bd), t.q, end_q, outward, view.d_far, &low, &high);
  } else {
    bound_sector(t.a, t.h0, t.h1, reach, &low, &high);
  }
  // Lines slope.x rx + slope.y ry + offset = 0 with the feature where that is positive. One that runs along a row bounds no x.
  const float none = 1e9f;
  float4 slope_x, slope_y, offset;
  if (t.kind == HS_FEATURE_EDGE) {
    const float2 first = t.t - (float2)(t.t.y, -t.t.x) * t.skew, last = t.t - (float2)(t.t.y, -t.t.x) * t.end_skew;
    slope_x = (float4)(first.x, -last.x, -t.t.y, t.t.y);
    slope_y = (float4)(first.y, -last.y, t.t.x, -t.t.x);
    offset = (float4)(0.0f, t.length_px, reach, shape.two_sided ? reach : 0.0f);
  } else {
    slope_x = (float4)(t.h0.x, t.h1.x, 1.0f, -1.0f);
    slope_y = (float4)(t.h0.y, t.h1.y, 0.0f, 0.0f);
    offset = (float4)(0.0f, 0.0f, reach, reach);
  }
  const int4 bounds_x = fabs(slope_x) > 1e-6f;
  t.span_is_low = slope_x > 0.0f;
  t.span =
      select(select((float4)(none), (float4)(-none), t.span_is_low), t.a.x - (offset + HS_SPAN_SLACK_PX) / slope_x, bounds_x);
  t.span_step = select((float4)(0.0f), -slope_y / slope_x, bounds_x);
  low -= HS_SPAN_SLACK_PX;
  high += HS_SPAN_SLACK_PX;
  t.x0 = max((int)ceil(max(low.x, -1.0f)), 0);
  t.x1 = min((int)floor(min(high.x, (float)HS_TILE)), x_end - 1);
  t.y0 = max((int)ceil(max(low.y, -1.0f)), 0);
  t.y1 = min((int)floor(min(high.y, (float)HS_TILE)), y_end - 1);
  return t;
}

// From a signed distance and 1/Lb in the map to what they would be if the disc that faces the texel lay in the light's plane. At
// place p, with the silhouette's nearest point at q, an angle theta away: its part along the ray to p gives 1/L =
// d (1 + p^2) / (1 + q . p), and the distance is tan(theta) sqrt(1 + p^2). False where theta is a right angle or more.
HS_INLINE vint sphere_distance(const TileFeature* f, int x, int y, vfloat* delta_px, vfloat* d) {
  const vfloat px = f->tile_q.x + f->q_per_px * v_float(x + v_iota);
  const float py = f->tile_q.y + f->q_per_px * (float)y;
  const vfloat p2 = 1.0f + px * px + py * py;
  vfloat facing, distance;
  if (f->kind == HS_FEATURE_EDGE) {
    // sin(theta) = delta / sqrt((1 + s^2) (1 + p^2)) for a line in the map that passes s from the axis.
    const vfloat delta = *delta_px * f->q_per_px;
    const float s = f->q.x * f->t.y - f->q.y * f->t.x, skew = 0.5f * (f->skew + f->end_skew);
    facing = p2 - delta * (px * (f->t.y + skew * f->t.x) + py * (skew * f->t.y - f->t.x));
    distance = delta / sqrt(max(1.0f + s * s - delta * delta / p2, 1e-6f));
  } else {
    const vfloat rx = px - f->q.x, turned = px * f->q.y - py * f->q.x;
    const float ry = py - f->q.y;
    facing = 1.0f + px * f->q.x + py * f->q.y;
    distance = copysign(sqrt((rx * rx + ry * ry + turned * turned) * p2) / max(facing, 1e-6f), *delta_px);
  }
  *delta_px = distance / f->q_per_px;
  *d *= p2 / max(facing, 1e-6f);
  return facing > 0.0f;
}

// Signed distance from the feature and 1/Lb at its nearest point, for the texels that begin at (x, y) of the tile. False where
// another feature is nearer: beyond an edge's ends, outside a corner's sector. Neighbouring features overlap by what rounding
// could have torn open between them.
#define HS_SLACK_PX (1.0f / 1024.0f)
HS_INLINE vint near_feature(const TileFeature* f, int x, int y, vfloat* delta_px, vfloat* d) {
  const vfloat rx = v_float(x + v_iota) - f->a.x;
  const float ry = (float)y - f->a.y;
  if (f->kind == HS_FEATURE_EDGE) {
    const vfloat along = rx * f->t.x + ry * f->t.y;
    *delta_px = rx * f->t.y - ry * f->t.x;
    if (f->q_per_px > 0.0f) {
      const vfloat from = along - *delta_px * f->skew, to = along - *delta_px * f->end_skew;
      *d = f->ad + clamp(0.5f * (from + to), 0.0f, f->length_px) * f->d_step;
      return (from >= -HS_SLACK_PX) & (to <= f->length_px + HS_SLACK_PX) & sphere_distance(f, x, y, delta_px, d);
    }
    *d = f->ad + along * f->d_step;
    return (along >= -HS_SLACK_PX) & (along <= f->length_px + HS_SLACK_PX);
  }
  const vfloat distance_px = sqrt(rx * rx + ry * ry);
  *delta_px = f->kind == HS_FEATURE_CORNER ? distance_px : -distance_px;
  *d = (vfloat)(f->ad);
  vint inside = (vint)(-1);
  if (f->q_per_px > 0.0f) inside = sphere_distance(f, x, y, delta_px, d);
  return inside & (rx * f->h0.x + ry * f->h0.y >= -HS_SLACK_PX) & (rx * f->h1.x + ry * f->h1.y >= -HS_SLACK_PX);
}

// The texels of row y that a feature may reach, inclusive: most are long and thin, or slices of a disc, and fill little of their
// box.
HS_INLINE int2 feature_span(const TileFeature* f, int y) {
  const float ry = (float)y - f->a.y;
  const float4 at = f->span + ry * f->span_step;
  const float4 low = select((float4)(-1.0f), at, f->span_is_low), high = select(at, (float4)(HS_TILE), f->span_is_low);
  return (int2)((int)ceil(clamp(max(max(low.x, low.y), max(low.z, low.w)), -1.0f, (float)HS_TILE)),
                (int)floor(clamp(min(min(high.x, high.y), min(high.z, high.w)), -1.0f, (float)HS_TILE)));
}

// A tile's part in a rasterization of features.
typedef struct {
  int2 px;           // its first texel
  int x_end, y_end;  // of its texels within the map
  uint layer;
  uint first, last;  // of its features: references, or where the lists overflowed all features
  bool overflow, touched;
} FeatureTile;

// Whether a layer has features in the calling work-group's tile.
HS_INLINE bool layer_touches(const HsFinShape shape, uint layer, __global const uint* offsets) {
  offsets += layer * (shape.tiles_x * shape.tiles_y) + get_group_id(0);
  return offsets[0] != offsets[1];
}

HS_INLINE FeatureTile feature_tile(const HsView view, const HsFinShape shape, uint layer, uint layer_count,
                                   __global const HsStatus* status, __global const uint* offsets, uint capacity) {
  FeatureTile t;
  const uint tile = get_group_id(0), tx = tile % shape.tiles_x, ty = tile / shape.tiles_x,
             tile_count = shape.tiles_x * shape.tiles_y;
  t.px = (int2)((int)tx, (int)ty) * (int)shape.tile_step;
  t.x_end = min(HS_TILE, (int)view.width_px - t.px.x);
  t.y_end = min(HS_TILE, (int)view.height_px - t.px.y);
  t.layer = layer;
  t.overflow = bins_overflow(offsets, tile_count * layer_count, capacity);
  offsets += layer * tile_count;
  t.first = t.overflow ? 0 : offsets[tile];
  t.last = t.overflow ? status->feature_count : offsets[tile + 1];
  t.touched = offsets[tile] != offsets[tile + 1];
  return t;
}

// A tile's buffers are written where a footprint that begins near a feature may reach into it.
HS_INLINE bool is_written(const HsFinShape shape, __global const uint* offsets) {
  const uint tx = get_group_id(0) % shape.tiles_x, ty = get_group_id(0) / shape.tiles_x;
  bool any = false;
  for (uint v = ty > 0 ? ty - 1 : 0; v <= min(ty + 1, shape.tiles_y - 1); ++v)
    for (uint u = tx > 0 ? tx - 1 : 0; u <= min(tx + 1, shape.tiles_x - 1); ++u)
      any |= offsets[v * shape.tiles_x + u] != offsets[v * shape.tiles_x + u + 1];
  return any;
}

// The next feature of a tile's list; false where it is another tile's or another layer's.
HS_INLINE bool next_feature(const FeatureTile* tile, uint i, uint tiles_x, __global const uint* refs,
                            __global const ushort4* rects, __global const HsFeature* features, HsFeature* f) {
  *f = features[tile->overflow ? i : refs[i]];
  return !tile->overflow || (rect_has(rects[i], get_group_id(0), tiles_x) && feature_layer(*f) == tile->layer);
}

// tile_near_fins: uchar a tile: 1 if a 2x2 footprint that begins in the tile can meet a feature's texel. That is where features
// are listed: their boxes have a texel to spare (texels_of_points), so that those of the next tile's first texels are listed
// here, too. Must be 0 before.
HS_INLINE void flag_near_tile(bool touched, __global uchar* tile_near_fins) {
  if (touched && get_local_id(0) == 0) tile_near_fins[get_group_id(0)] = 1;
}

// Runs `prepare` for each `feature` of the tile, and the body for each run of texels it may reach, with `slot`, `delta_px`, `d`
// and the mask `inside`.
#define HS_FOR_FEATURE_TEXELS(tile, prepare, body)                                                              \
  for (uint hs_i = tile.first; hs_i < tile.last; ++hs_i) {                                                      \
    HsFeature hs_stored;                                                                                        \
    if (!next_feature(&tile, hs_i, shape.tiles_x, feature_refs, feature_rects, features, &hs_stored)) continue; \
    const TileFeature feature = set_up_feature(view, shape, hs_stored, tile.px, tile.x_end, tile.y_end);        \
    prepare HS_FOR_ROWS(hs_y, feature.y0, feature.y1) {                                                         \
      const int2 hs_span = feature_span(&feature, hs_y);                                                        \
      HS_FOR_COLUMNS(hs_x, max(hs_span.x, feature.x0), min(hs_span.y, feature.x1)) {                            \
        const int slot = HS_SLOT(hs_x, hs_y);                                                                   \
        vfloat delta_px, d;                                                                                     \
        const vint inside = near_feature(&feature, hs_x, hs_y, &delta_px, &d);                                  \
        body                                                                                                    \
      }                                                                                                         \
    }                                                                                                           \
  }

// Runs the body for all texels of the tile, `valid` <= HS_LANES at a time: `slot` is the first one's, `texel` its index in the
// map.
#define HS_FOR_TILE_TEXELS(tile, body)                                                  \
  HS_FOR_TEXELS(hs_x, hs_y, 0, 0, tile.x_end - 1, tile.y_end - 1) {                     \
    const int slot = HS_SLOT(hs_x, hs_y), valid = min(HS_LANES, tile.x_end - hs_x);     \
    const size_t texel = (size_t)(tile.px.y + hs_y) * view.width_px + tile.px.x + hs_x; \
    body                                                                                \
  }

// 1/Lr of what the shadow map holds at the tile's texels: the farthest receiver where it is empty. Returns the least of them.
HS_INLINE float load_receivers(const HsView view, const FeatureTile tile, __global const float* shadow_map, float* d_receiver) {
  vfloat least = (vfloat)(INFINITY);
  HS_FOR_TILE_TEXELS(tile, {
    const vfloat d = max(1.0f / load_lanes(shadow_map, texel, valid), view.d_far);
    v_store(d, d_receiver + slot);
    least = min(least, d);
  })
  return max(v_reduce_min(least), view.d_far);
}
