// A tile's fins of one layer: which of them count at each texel, and what they weigh.

#pragma once

#include "methods/shadow_fins/caster_bits.h"
#include "silhouettes/feature_tiles.h"

#define HS_TEXELS (HS_TILE * HS_TILE)
#if HS_LANES == 16
#define HS_SHARED  // by the work-items of a tile
#define HS_TILE_BARRIER()
#define HS_PUT_INT(v, i, value) (((int*)&(v))[i] = (value))
#define HS_PUT_FLOAT(v, i, value) (((float*)&(v))[i] = (value))
HS_INLINE void v_tile_pair(const float* p, int16 i, float16* left, float16* right) {
#define HS_PAIR(k) as_ulong(vload2(0, p + i.k))
  const float16 a = as_float16(
      (ulong8)(HS_PAIR(s0), HS_PAIR(s1), HS_PAIR(s2), HS_PAIR(s3), HS_PAIR(s4), HS_PAIR(s5), HS_PAIR(s6), HS_PAIR(s7)));
  const float16 b = as_float16(
      (ulong8)(HS_PAIR(s8), HS_PAIR(s9), HS_PAIR(sa), HS_PAIR(sb), HS_PAIR(sc), HS_PAIR(sd), HS_PAIR(se), HS_PAIR(sf)));
#undef HS_PAIR
  *left = (float16)(a.even, b.even);
  *right = (float16)(a.odd, b.odd);
}
HS_INLINE float16 v_tile(const float* p, int16 i) {
  return (float16)(p[i.s0], p[i.s1], p[i.s2], p[i.s3], p[i.s4], p[i.s5], p[i.s6], p[i.s7], p[i.s8], p[i.s9], p[i.sa], p[i.sb],
                   p[i.sc], p[i.sd], p[i.se], p[i.sf]);
}
#else
#define HS_SHARED __local
#define HS_TILE_BARRIER() barrier(CLK_LOCAL_MEM_FENCE)
#define HS_PUT_INT(v, i, value) ((v) = (value))
#define HS_PUT_FLOAT(v, i, value) ((v) = (value))
HS_INLINE void v_tile_pair(const __local float* p, int i, float* left, float* right) {
  *left = p[i];
  *right = p[i + 1];
}
#define v_tile(p, i) ((p)[i])
#endif

// The fins that count at each texel of a tile: weight for the reference plane L0 (Cai §3.3, Eq. 1), 1/Lb (0 where there is none),
// and the unit direction out of the shadow, towards which the light appears.
typedef struct {
  float s[HS_TEXELS], d[HS_TEXELS], nx[HS_TEXELS], ny[HS_TEXELS];
} Fins;

// Of those that face in another direction, the strongest; c: cosine of the angle to the first.
typedef struct {
  float s[HS_TEXELS], d[HS_TEXELS], c[HS_TEXELS];
} SecondFins;

typedef struct {
  Fins inner, outer;
  SecondFins inner2, outer2;
  // Inner fins count for receivers at 1/reach_d and before: behind it stands what the light that passes by the silhouette falls
  // on.
  float reach_d[HS_TEXELS];
  int own_casters[HS_TEXELS];  // depths at which casters of inner fins may stand
} TileFins;

// Fins whose directions lie closer together than this hide the same part of the light.
#define HS_SAME_DIRECTION 0.3f

#define HS_CELL_PX 8
#define HS_CELLS (HS_TILE / HS_CELL_PX)

// A fin's own side begins HS_EDGE_PX before the silhouette, there with weight 1/2: which side a texel is on the shadow map
// decides, and where outlines fold it need not agree with a single edge.
#define HS_EDGE_PX 1.0f

// Which of two overlapping fins counts: the one with the greater weight, or with the smaller. Equal weights go to the nearer fin,
// and of equal depths to one direction, so that the order of features does not matter.
HS_INLINE void keep_fin(vint candidate, bool greater, vfloat s, vfloat d, vfloat nx, vfloat ny, HS_SHARED Fins* kept, int slot) {
  const vfloat old_s = v_load(kept->s + slot), old_d = v_load(kept->d + slot);
  vint wins = candidate & ((old_d == 0.0f) | (greater ? s > old_s : s < old_s) | ((s == old_s) & (d > old_d)));
  const vint equal = candidate & (s == old_s) & (d == old_d);
  if (v_any(equal)) {
    const vfloat old_nx = v_load(kept->nx + slot), old_ny = v_load(kept->ny + slot);
    wins |= equal & ((nx > old_nx) | ((nx == old_nx) & (ny > old_ny)));
  }
  if (v_any(wins)) {
    v_store(v_select(old_s, s, wins), kept->s + slot);
    v_store(v_select(old_d, d, wins), kept->d + slot);
    v_store(v_select(v_load(kept->nx + slot), nx, wins), kept->nx + slot);
    v_store(v_select(v_load(kept->ny + slot), ny, wins), kept->ny + slot);
  }
}

// The depths at which the caster of a silhouette between 1/d_high and 1/d_low may stand: what an inner fin brightens may be
// shadowed by its own caster alone.
HS_INLINE uint caster_bits(const HsView view, const HsFinShape shape, float d_low, float d_high,
                           __global const float* caster_range) {
  const float depth = caster_depth(view, shape, d_low);
  const uint first = caster_bit(caster_range, 1.0f / d_high - depth),
             last = caster_bit(caster_range, 1.0f / d_low + 0.25f * depth);
  return (0xffffffffu >> (HS_CASTER_BITS - 1u - last)) & (0xffffffffu << first);
}

// Those of an edge that reaches deeper than from one caster to the next: where it is nearest to each texel its own one stands.
HS_INLINE vint caster_bits_along(const HsView view, const HsFinShape shape, vfloat d, __global const float* caster_range) {
  const vfloat z = 1.0f / d, depth = caster_depth_times(view, shape, d), most = (vfloat)(HS_CASTER_BITS - 1.0f);
  const vint first = v_int(clamp((z * (1.0f - depth) - caster_range[0]) * caster_range[1], (vfloat)(0.0f), most));
  const vint last = v_int(clamp((z * (1.0f + 0.25f * depth) - caster_range[0]) * caster_range[1], (vfloat)(0.0f), most));
  return ((vint)(2) << last) - ((vint)(1) << first);
}

// The cells of a row between two texels, a bit each.
HS_INLINE uint row_cells(int x0, int x1, int y) {
  return ((2u << x1 / HS_CELL_PX) - (1u << x0 / HS_CELL_PX)) << y / HS_CELL_PX * HS_CELLS;
}

// Where the texels of a row that begin at x lie to a feature, and the direction out of its shadow there.
typedef struct {
  vint inside;
  vfloat delta_px, d, nx, ny;
} FinPlace;

HS_INLINE FinPlace fin_place(const TileFeature* f, int x, int y) {
  FinPlace p;
  p.inside = near_feature(f, x, y, &p.delta_px, &p.d);
  if (f->kind == HS_FEATURE_EDGE) {
    p.nx = (vfloat)(f->t.y);
    p.ny = (vfloat)(-f->t.x);
  } else {
    const vfloat to = 1.0f / v_select(max(p.delta_px, 1e-6f), min(p.delta_px, -1e-6f), p.delta_px < 0.0f);
    p.nx = (v_float(x + v_iota) - f->a.x) * to;
    p.ny = ((float)y - f->a.y) * to;
  }
  return p;
}

// The fins there. Cai et al. 2006 §3.1 and §3.3: to either side of the silhouette, sized for the reference plane L0, the light's
// far plane (Eq. 3), with the weight s0 = (1 - t) / 2 (Eq. 1).
typedef struct {
  vint is_inner, is_outer;
  vfloat inner_s, outer_s;
} FinWeights;

HS_INLINE FinWeights fin_weights(const HsView view, const HsFinShape shape, float d_farthest, float own_depth,
                                 const TileFeature* f, const FinPlace* p, vfloat d_receiver) {
  FinWeights w;
  const vfloat distance_px = fabs(p->delta_px);
  const vfloat s = 0.5f - 0.5f * distance_px / (shape.radius_px * (p->d - view.d_far));
  const vint in_fin = p->inside & (s > 0.0f) & (distance_px < shape.radius_px * (p->d - d_farthest));
  // A fin behind the surface that the light sees cannot darken that, and in one layer must not hide one that can. With layers it
  // counts for what lies deeper, unless the surface is its own caster's. Beneath another caster the map does not say on which
  // side of the silhouette a texel lies, and neither fin reaches over to the other's.
  vint matters = p->d > d_receiver;
  // Nor does a fin reach over a caster that is narrower than that: the other side's is there.
  vfloat over_px = (vfloat)(min(HS_EDGE_PX, 0.5f * f->width_px));
  if (own_depth < INFINITY && !v_all(matters)) {
    const vint beneath = 1.0f / p->d - 1.0f / d_receiver > own_depth;
    matters |= beneath;
    over_px = v_select(over_px, (vfloat)(0.0f), beneath);
  }
  w.is_inner = f->inner ? in_fin & (p->delta_px < over_px) : (vint)(0);
  w.is_outer = in_fin & (p->delta_px > -over_px) & matters;
  w.inner_s = v_select(s, (vfloat)(0.5f), p->delta_px >= 0.0f);
  w.outer_s = v_select(s, (vfloat)(0.5f), p->delta_px <= 0.0f);
  // The inner fin of a narrow caster's other side leaves its share of what lies along its edges; beyond their ends there is none.
  if (f->kind == HS_FEATURE_CORNER && f->width_px < INFINITY)
    w.outer_s *= min(f->width_px / (shape.radius_px * (p->d - view.d_far)), 1.0f);
  return w;
}

// Which of several second fins counts: the one that adds most. c: cosine to the first.
HS_INLINE void keep_second(vint candidate, vfloat s, vfloat d, vfloat c, HS_SHARED SecondFins* kept, int slot) {
  const vfloat old_s = v_load(kept->s + slot), old_d = v_load(kept->d + slot), old_c = v_load(kept->c + slot);
  const vfloat adds = s * (1.0f - c), added = old_s * (1.0f - old_c);
  const vint wins =
      candidate & ((old_d == 0.0f) | (adds > added) | ((adds == added) & ((d > old_d) | ((d == old_d) & (s > old_s)))));
  v_store(v_select(old_s, s, wins), kept->s + slot);
  v_store(v_select(old_d, d, wins), kept->d + slot);
  v_store(v_select(old_c, c, wins), kept->c + slot);
}

HS_INLINE vfloat cosine_to(const FinPlace* p, HS_SHARED const Fins* first, int slot) {
  return p->nx * v_load(first->nx + slot) + p->ny * v_load(first->ny + slot);
}

// Whether there is a first fin that faces in another direction.
HS_INLINE vint other_direction(const FinPlace* p, vfloat c, HS_SHARED const Fins* first, int slot) {
  return p->inside & (c < HS_SAME_DIRECTION) & (v_load(first->d + slot) > 0.0f);
}

// Whether a feature is too narrow to reach the tile: mostly so where it lies before its own caster, but is listed for the light's
// farthest receiver.
HS_INLINE bool misses_tile(const HsView bounded, const HsFinShape shape, const HsFeature f, const FeatureTile* tile) {
  if (shape.sphere_q_per_px > 0.0f) return false;
  const uint kind = f.kind_and_layer & ((1u << HS_FEATURE_KIND_BITS) - 1u);
  const bool edge = kind == HS_FEATURE_EDGE || kind == HS_FEATURE_OUTER_EDGE;
  const float2 a = (float2)(f.ax, f.ay), b = edge ? (float2)(f.bx, f.by) : a;
  const float reach = reach_px(shape, edge ? max(f.ad, f.bd) : f.ad, bounded.d_far);
  const float2 first = convert_float2(tile->px) + (0.5f - HS_SPAN_SLACK_PX) - reach, low = min(a, b), high = max(a, b);
  const float2 last = convert_float2(tile->px + (int2)(tile->x_end, tile->y_end)) - (0.5f - HS_SPAN_SLACK_PX) + reach;
  return reach <= 0.0f || high.x < first.x || high.y < first.y || low.x > last.x || low.y > last.y;
}

// Runs the body for each `feature` of the tile and each run of texels (x, y), x a multiple of HS_LANES, that it may reach between
// span.x and span.y.
#define HS_FOR_FIN_RUNS(tile, prepare, body)                                                                \
  for (uint hs_i = tile.first; hs_i < tile.last; ++hs_i) {                                                  \
    HsFeature hs_stored;                                                                                    \
    if (!next_feature(&tile, hs_i, shape.tiles_x, refs, rects, features, &hs_stored)) continue;             \
    if (misses_tile(bounded, shape, hs_stored, &tile)) continue;                                            \
    const TileFeature feature = set_up_feature(bounded, shape, hs_stored, tile.px, tile.x_end, tile.y_end); \
    if (feature.x0 > feature.x1 || feature.y0 > feature.y1) continue;                                       \
    prepare HS_FOR_ROWS(y, feature.y0, feature.y1) {                                                        \
      int2 span = feature_span(&feature, y);                                                                \
      span = (int2)(max(span.x, feature.x0), min(span.y, feature.x1));                                      \
      if (span.x <= span.y) {                                                                               \
        HS_FOR_COLUMNS(x, span.x & ~(HS_LANES - 1), span.y) body                                            \
      }                                                                                                     \
    }                                                                                                       \
  }

// Cosines between a feature's directions out of the shadow (one of an edge, the outermost two of a corner) and the first one's.
HS_INLINE float2 feature_directions(const TileFeature* f, float2* first) {
  float2 a = (float2)(f->t.y, -f->t.x), b = a;
  if (f->kind != HS_FEATURE_EDGE) {
    const float turn = f->h0.x * f->h1.y - f->h0.y * f->h1.x >= 0.0f ? 1.0f : -1.0f;
    const float side = f->kind == HS_FEATURE_CORNER ? turn : -turn;
    a = (float2)(-f->h0.y, f->h0.x) * side;
    b = (float2)(f->h1.y, -f->h1.x) * side;
  }
  if (first->x == 0.0f && first->y == 0.0f) *first = a;
  return (float2)(dot(a, *first), dot(b, *first));
}

// What the map shows there, where it shows anything.
HS_INLINE vfloat map_z_at(const HsView view, __global const float* shadow_map, vfloat x, vfloat y, vint* shown) {
  *shown &= (x >= 0.0f) & (y >= 0.0f) & (x < (float)view.width_px) & (y < (float)view.height_px);
  const vint column = v_int(v_select((vfloat)(0.0f), x, *shown)), row = v_int(v_select((vfloat)(0.0f), y, *shown));
  const vfloat z = v_gather(shadow_map, row * (int)view.width_px + column);
  *shown &= z < HS_EMPTY_Z;
  return z;
}

// Finds out what the light that passes by the silhouettes of inner fins falls on: what the map shows a little beyond them, and as
// far again, from where its plane is followed back. Surfaces as far apart as a caster may be deep are taken for one. With layers,
// casters before the silhouette have fins of their own.
HS_INLINE void bound_inner_fins(const HsView view, const HsFinShape shape, bool single, const FeatureTile tile,
                                __global const float* shadow_map, HS_SHARED TileFins* fins) {
  HS_FOR_TEXELS(x, y, 0, 0, HS_TILE - 1, HS_TILE - 1) {
    const int slot = y * HS_TILE + x;
    const vfloat d = v_load(fins->inner.d + slot);
    vint shown = d > 0.0f;
    if (v_any(shown)) {
      vfloat nx = v_load(fins->inner.nx + slot), ny = v_load(fins->inner.ny + slot);
      const vfloat px = v_float(tile.px.x + x + v_iota) + 0.5f;
      const float py = (float)(tile.px.y + y) + 0.5f;
      vfloat past_px = (1.0f - 2.0f * v_load(fins->inner.s + slot)) * shape.radius_px * (d - view.d_far);
      if (shape.sphere_q_per_px > 0.0f) {
        // From an angle back to the map, see sphere_distance and sphere_skew: rather too far than short of the silhouette.
        const vfloat qx = (px - view.px_from_q.y) * shape.sphere_q_per_px;
        const float qy = (py - view.px_from_q.w) * shape.sphere_q_per_px;
        const vfloat from_axis = qx * nx + qy * ny, stretch = 1.0f + from_axis * from_axis;
        const vfloat skew = from_axis * (qy * nx - qx * ny) / stretch, turned_x = nx - ny * skew;
        past_px *= stretch;
        ny += nx * skew;
        nx = turned_x;
      }
      past_px += 1.5f;
      const vfloat z1 = map_z_at(view, shadow_map, px + past_px * nx, py + past_px * ny, &shown);
      const vfloat z2 = map_z_at(view, shadow_map, px + 2.0f * past_px * nx, py + 2.0f * past_px * ny, &shown);
      const vfloat depth = caster_depth_times(view, shape, d);
      if (!single) shown &= z1 * d > 1.0f - depth;
      // 1/z there is the lesser of 1/z1 and 2/z1 - 1/z2; to its inverse the depth is added.
      const vfloat over = min(z2, 2.0f * z2 - z1);
      v_store(v_select((vfloat)(0.0f), over * d / (z1 * z2 * d + depth * over), shown & (over > 0.0f)), fins->reach_d + slot);
    }
  }
}

// Draws a layer's fins, no farther than for receivers at 1/bounded.d_far. Returns the cells that they reach. *varied: some face
// another direction than others, and the second fins hold something.
HS_INLINE uint draw_tile_fins(const HsView view, const HsView bounded, const HsFinShape shape, const HsLayers layers, bool single,
                              const FeatureTile tile, __global const uint* refs, __global const ushort4* rects,
                              __global const HsFeature* features, __global const float* shadow_map, const float* d_receiver,
                              __global const float* caster_range, HS_SHARED TileFins* fins, bool* varied) {
  HS_FOR_TEXELS(x, y, 0, 0, HS_TILE - 1, HS_TILE - 1) {
    v_store((vfloat)(0.0f), fins->inner.d + y * HS_TILE + x);
    v_store((vfloat)(0.0f), fins->outer.d + y * HS_TILE + x);
  }
  uint cells = 0;
  float2 direction = (float2)(0.0f);
  bool varied_directions = false;
  HS_FOR_FIN_RUNS(
      tile, const float own_depth = single ? INFINITY : caster_depth(view, shape, feature.d_low); uint casters = 0;
      bool deep = false; if (!single && feature.inner) {
        casters = caster_bits(view, shape, feature.d_low, feature.d_high, caster_range);
        deep = !layers.faithful && casters != caster_bits(view, shape, feature.d_low, feature.d_low, caster_range);
      } const float2 cosines = feature_directions(&feature, &direction);
      varied_directions |= min(cosines.x, cosines.y) < 0.82f;
      ,
      {
        cells |= row_cells(span.x, span.y, y);
        const int slot = y * HS_TILE + x;
        const FinPlace p = fin_place(&feature, x, y);
        const FinWeights w = fin_weights(view, shape, bounded.d_far, own_depth, &feature, &p, v_load(d_receiver + HS_SLOT(x, y)));
        keep_fin(w.is_inner, !layers.faithful, w.inner_s, p.d, p.nx, p.ny, &fins->inner, slot);
        keep_fin(w.is_outer, true, w.outer_s, p.d, p.nx, p.ny, &fins->outer, slot);
        if (casters != 0 && v_any(w.is_inner)) {
          const vint own = deep ? caster_bits_along(view, shape, p.d, caster_range) : (vint)((int)casters);
          v_store(v_load(fins->own_casters + slot) | v_select((vint)(0), own, w.is_inner), fins->own_casters + slot);
        }
      })
  if (!layers.faithful) bound_inner_fins(view, shape, single, tile, shadow_map, fins);
  *varied = varied_directions && !layers.faithful;
  if (*varied) {
    HS_FOR_TEXELS(x, y, 0, 0, HS_TILE - 1, HS_TILE - 1) {
      v_store((vfloat)(0.0f), fins->inner2.d + y * HS_TILE + x);
      v_store((vfloat)(0.0f), fins->outer2.d + y * HS_TILE + x);
    }
    HS_FOR_FIN_RUNS(tile, const float own_depth = single ? INFINITY : caster_depth(view, shape, feature.d_low);, {
      const int slot = y * HS_TILE + x;
      const FinPlace p = fin_place(&feature, x, y);
      const vfloat inner_c = cosine_to(&p, &fins->inner, slot);
      const vfloat outer_c = cosine_to(&p, &fins->outer, slot);
      const vint inner = other_direction(&p, inner_c, &fins->inner, slot) & (p.delta_px < 0.0f);
      const vint outer = other_direction(&p, outer_c, &fins->outer, slot) & (p.delta_px > 0.0f);
      if (v_any(inner | outer)) {
        const FinWeights w = fin_weights(view, shape, bounded.d_far, own_depth, &feature, &p, v_load(d_receiver + HS_SLOT(x, y)));
        keep_second(inner & w.is_inner, w.inner_s, p.d, inner_c, &fins->inner2, slot);
        keep_second(outer & w.is_outer, w.outer_s, p.d, outer_c, &fins->outer2, slot);
      }
    })
  }
  return cells;
}
