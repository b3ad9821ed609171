// Shadow fins: Cai et al. 2006, in one layer (§3) and in many (§4), tile by tile of the light map.
//
// Pixels near fins are listed by the tile that their 2x2 footprint lies in (tiles overlap by a texel, see HsFinShape). A tile's
// work-group draws the fins of one layer after the other into the same few arrays, and adds each to what its pixels have seen so
// far: no fin buffer nor illuminance buffer need be in memory, and what no fin reaches costs nothing.

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

// The fins that count at each texel of a tile: weight for the reference plane L0 (Cai §3.1 Eq. 1), 1/Lb (0 where there is none),
// and the unit direction out of the shadow, towards which the light appears.
typedef struct {
  float s[HS_TEXELS], d[HS_TEXELS], nx[HS_TEXELS], ny[HS_TEXELS];
} Fins;

// Of those that face another way, the strongest; c: cosine of the angle to the first.
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
// so that the order of features does not matter.
HS_INLINE void keep_fin(vint candidate, bool greater, vfloat s, vfloat d, vfloat nx, vfloat ny, HS_SHARED Fins* kept, int slot) {
  const vfloat old_s = v_load(kept->s + slot), old_d = v_load(kept->d + slot);
  const vint wins = candidate & ((old_d == 0.0f) | (greater ? s > old_s : s < old_s) | ((s == old_s) & (d > old_d)));
  if (v_any(wins)) {
    v_store(v_select(old_s, s, wins), kept->s + slot);
    v_store(v_select(old_d, d, wins), kept->d + slot);
    v_store(v_select(v_load(kept->nx + slot), nx, wins), kept->nx + slot);
    v_store(v_select(v_load(kept->ny + slot), ny, wins), kept->ny + slot);
  }
}

// As caster_depth of silhouettes at 1/d, times d.
HS_INLINE vfloat caster_depth_times(const HsView view, const HsFinShape shape, vfloat d) {
  return 4.0f * shape.radius_px / view.px_from_q.x * (d - view.d_far);
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

HS_INLINE FinWeights fin_weights(const HsView view, const HsFinShape shape, float d_farthest, float own_depth, bool inner,
                                 const FinPlace* p, vfloat d_receiver) {
  FinWeights w;
  const vfloat distance_px = fabs(p->delta_px);
  const vfloat s = 0.5f - 0.5f * distance_px / (shape.radius_px * (p->d - view.d_far));
  const vint in_fin = p->inside & (s > 0.0f) & (distance_px < shape.radius_px * (p->d - d_farthest));
  // A fin behind the surface that the light sees cannot darken that, and in one layer must not hide one that can. With layers it
  // counts for what lies deeper, unless the surface is its own caster's. Beneath another caster the map does not say on which
  // side of the silhouette a texel lies, and neither fin reaches over to the other's.
  vint matters = p->d > d_receiver;
  vfloat over_px = (vfloat)(HS_EDGE_PX);
  if (own_depth < INFINITY && !v_all(matters)) {
    const vint beneath = 1.0f / p->d - 1.0f / d_receiver > own_depth;
    matters |= beneath;
    over_px = v_select(over_px, (vfloat)(0.0f), beneath);
  }
  w.is_inner = inner ? in_fin & (p->delta_px < over_px) : (vint)(0);
  w.is_outer = in_fin & (p->delta_px > -over_px) & matters;
  w.inner_s = v_select(s, (vfloat)(0.5f), p->delta_px >= 0.0f);
  w.outer_s = v_select(s, (vfloat)(0.5f), p->delta_px <= 0.0f);
  return w;
}

// Which of several second fins counts: the one that adds most. c: cosine to the first.
HS_INLINE void keep_second(vint candidate, vfloat s, vfloat d, vfloat c, HS_SHARED SecondFins* kept, int slot) {
  const vfloat old_s = v_load(kept->s + slot), old_d = v_load(kept->d + slot), old_c = v_load(kept->c + slot);
  const vfloat adds = s * (1.0f - c), added = old_s * (1.0f - old_c);
  const vint wins = candidate & ((old_d == 0.0f) | (adds > added) | ((adds == added) & (d > old_d)));
  v_store(v_select(old_s, s, wins), kept->s + slot);
  v_store(v_select(old_d, d, wins), kept->d + slot);
  v_store(v_select(old_c, c, wins), kept->c + slot);
}

HS_INLINE vfloat cosine_to(const FinPlace* p, HS_SHARED const Fins* first, int slot) {
  return p->nx * v_load(first->nx + slot) + p->ny * v_load(first->ny + slot);
}

// Whether there is a first fin that looks another way.
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
// another way than others, and the second fins hold something.
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
        const FinWeights w =
            fin_weights(view, shape, bounded.d_far, own_depth, feature.inner, &p, v_load(d_receiver + HS_SLOT(x, y)));
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
        const FinWeights w =
            fin_weights(view, shape, bounded.d_far, own_depth, feature.inner, &p, v_load(d_receiver + HS_SLOT(x, y)));
        keep_second(inner & w.is_inner, w.inner_s, p.d, inner_c, &fins->inner2, slot);
        keep_second(outer & w.is_outer, w.outer_s, p.d, outer_c, &fins->outer2, slot);
      }
    })
  }
  return cells;
}

// ------------------------------------------------------------------------------------------------------------- receivers

// The part of the light that is above a receiver's own plane, in the falloff's terms. The plane's 1/z has the gradient g in the
// light map (see Receiver), and the light's centre stands 1/(R |g|) radii above it. Where the light is a ball, its disc faces the
// receiver p: with the plane's normal n scaled to n . p = -1, 1/(R |n - (n . p) p / p^2|).
HS_INLINE vfloat above_horizon(const HsView light, const HsFinShape shape, const Receiver* r, uint falloff) {
  vfloat g2 = r->plane_dx * r->plane_dx + r->plane_dy * r->plane_dy;
  const float per_px = shape.sphere_q_per_px;
  if (per_px > 0.0f) {
    const vfloat qx = (r->u + (0.5f - light.px_from_q.y)) * per_px, qy = (r->v + (0.5f - light.px_from_q.w)) * per_px;
    const vfloat nz = r->plane_d - (r->plane_dx * qx + r->plane_dy * qy) / per_px;
    g2 += (nz * nz - r->plane_d * r->plane_d / (1.0f + qx * qx + qy * qy)) * (per_px * per_px);
  }
  const vfloat g = sqrt(max(g2, 0.0f)) * shape.radius_px;
  if (!v_any(g > 1.0f)) return (vfloat)(1.0f);
  return falloff_of(0.5f + 0.5f / max(g, 1.0f), falloff);
}

#define HS_LIT_SHIFT 24  // of a receiver's word: (tile + 1) | lit texels of its footprint << HS_LIT_SHIFT; 0 where no fin is near
#define HS_WORD_TILE ((1 << HS_LIT_SHIFT) - 1)
#define HS_WORD_LIMITED \
  (1 << (HS_LIT_SHIFT + 4))  // the pixel may not have all of the light: what it may have is in `horizon_limits`

// Runs of HS_LANES pixels are listed by tile, those that lie in more than one tile in each. Where a run begins: px | py << 16.
#define HS_RUN_Y_SHIFT 16

// Hard shadows, and which pixels are near fins: to those the tiles give an answer where a fin reaches them.
// receiver_words: uint a pixel; horizon_limits: float a pixel, see above_horizon. tile_counts: runs of each tile; tile_far: float
// bits a tile, depth of its farthest receiver. Both must be 0.
__kernel void begin_fins(const HsView light, const HsReceiverView view, __global const float* depth_or_position,
                         __global const float4* normal, __global const float* shadow_map, __global const uchar* near,
                         const HsFinShape shape, const HsLayers layers, __global const float* caster_range,
                         __global uint* receiver_words, __global float* horizon_limits, __global uint* tile_counts,
                         __global int* tile_far, __global float* visibility, const uint plane) {
  const size_t pixels = (size_t)view.width_px * view.height_px;
  const float per_step = 1.0f / (float)shape.tile_step;
  const bool single = used_layers(layers, caster_range) == 1;
  HS_FOR_PIXELS(px, py, valid, view.width_px, view.height_px) {
    const Receiver r = locate(light, view, px, py, valid, depth_or_position, normal);
    vfloat result = r.visibility;
    vint words = (vint)(0);
    if (!v_all(r.decided)) {
      const Footprint f = footprint(light, &r);
      const Taps lit = lit_taps(light, shadow_map, &r, &f);
      const vfloat hard = bilinear(&f, &lit);
      result = v_select(falloff_of(hard, layers.falloff), r.visibility, r.decided);
      const vfloat most = layers.faithful ? (vfloat)(1.0f) : above_horizon(light, shape, &r, layers.falloff);
      const vint tiles = v_int((v_float(f.y) + 0.5f) * per_step) * (int)shape.tiles_x + v_int((v_float(f.x) + 0.5f) * per_step);
      vint chosen = (vint)(0);
      for (vint left = v_not(r.decided) & (v_iota < valid); v_any(left);) {
        int tile;
        const vint same = next_tile(tiles, &left, &tile);
        if (near[tile]) {
          chosen |= same;
          bound_tile(same, r.z, tile_far + tile, tile_counts + tile, 1);
        }
      }
      if (v_any(chosen)) {
        const vint bits = v_int(lit.v00 + 2.0f * lit.v10 + 4.0f * lit.v01 + 8.0f * lit.v11);
        const vint capped = most < 1.0f;
        words = (tiles + 1) | (bits << HS_LIT_SHIFT) | v_select((vint)(0), (vint)(HS_WORD_LIMITED), capped);
        words = v_select((vint)(0), words, chosen);
        if (v_any(chosen & capped)) store_lanes(most, horizon_limits, HS_PIXEL, valid);
        // Layers add up before the falloff.
        if (!single && !layers.faithful) result = v_select(result, hard, chosen);
      }
      result = min(result, v_select(most, (vfloat)(1.0f), r.decided));
    }
    store_lanes(v_as_float(words), (__global float*)receiver_words, HS_PIXEL, valid);
    store_visibility(&r, result, visibility, (size_t)plane * pixels + HS_PIXEL, valid);
  }
}

// listed: runs of each tile's receivers.
__kernel void list_fin_receivers(const HsReceiverView view, __global const uint* receiver_words, __global uint* tile_cursors,
                                 __global uint* listed) {
  HS_FOR_PIXELS(px, py, valid, view.width_px, view.height_px) {
    const vint words = load_int_lanes((__global const int*)receiver_words, HS_PIXEL, valid);
    for (vint left = (words != 0) & (v_iota < valid); v_any(left);) {
      int tile;
      next_tile(words & HS_WORD_TILE, &left, &tile);
      listed[atomic_inc(&tile_cursors[tile - 1])] = (uint)px | (uint)py << HS_RUN_Y_SHIFT;
    }
  }
}

// --------------------------------------------------------------------------------------------------------------- weights

// A fin's weight for this receiver, from the one for the reference plane (Eq. 5): s_r = 1/2 + (B_0/B_r) (s_0 - 1/2), and with
// Eq. 3 B_0/B_r = w(Lb, L0) / w(Lb, Lr). A receiver before the fin sees nothing of it; at contact w vanishes, and with it the
// weight.
HS_INLINE vfloat refined_weight(const HsView light, vfloat receiver_d, vfloat s, vfloat d) {
  const vfloat beyond = d - receiver_d;
  const vfloat refined = 0.5f + (d - light.d_far) / max(beyond, 1e-30f) * (s - 0.5f);
  return v_select((vfloat)(0.0f), clamp(refined, 0.0f, 0.5f), beyond > 0.0f);
}

// A receiver's footprint in its tile.
typedef struct {
  vint mine;        // there is such a receiver
  vfloat d;         // 1/Lr
  vfloat behind_d;  // 1/Lb of fins that are too far to matter, or farther
  vint texel;       // the first, in the tile
  vfloat w[4];      // bilinear weights
  vint lit[4];      // not in hard shadow
} TileReceiver;

// A run of receivers, HS_LANES pixels from `pixel` on.
typedef struct {
  size_t pixel;
  int valid;
  vint words, mine;  // mine: lie in the tile
  vfloat s, t, d;    // where in the footprint's texels; 1/Lr
  vint x, y;         // the footprint's first texel in the tile
} TileRun;

HS_INLINE void load_run(const HsView light, const HsReceiverView view, int2 tile_px, uint begins,
                        __global const float* depth_or_position, __global const uint* receiver_words, TileRun* run) {
  const int px = (int)(begins & ((1u << HS_RUN_Y_SHIFT) - 1u)), py = (int)(begins >> HS_RUN_Y_SHIFT);
  run->pixel = HS_PIXEL;
  run->valid = min(HS_LANES, (int)view.width_px - px);
  run->words = load_int_lanes((__global const int*)receiver_words, run->pixel, run->valid);
  run->mine = ((run->words & HS_WORD_TILE) == (int)get_group_id(0) + 1) & (v_iota < run->valid);
  const PixelPlace p = place_pixels(light, view, px, py, run->valid, depth_or_position);
  const Footprint f = footprint_at(light, p.u, p.v);
  run->d = p.d;
  run->s = f.s;
  run->t = f.t;
  run->x = clamp(f.x - tile_px.x, (vint)(0), (vint)(HS_TILE - 2));
  run->y = clamp(f.y - tile_px.y, (vint)(0), (vint)(HS_TILE - 2));
}

// Whether a footprint of the run lies in one of the cells.
HS_INLINE bool meets_cells(const TileRun* run, uint cells) {
  if (cells == 0) return false;
  const vint one = (vint)(1);
  const vint columns = (one << run->x / HS_CELL_PX) | (one << (run->x + 1) / HS_CELL_PX);
  const vint its = (columns << run->y / HS_CELL_PX * HS_CELLS) | (columns << (run->y + 1) / HS_CELL_PX * HS_CELLS);
  return v_any(run->mine & ((its & (int)cells) != 0));
}

// Not returned: what a returned array brings with it when it is inlined is unknown to Oclgrind 21.10. So below, too.
HS_INLINE void tile_receiver(const TileRun* run, bool faithful, TileReceiver* r) {
  r->mine = run->mine;
  r->d = run->d;
  r->behind_d = faithful ? (vfloat)(0.0f) : run->d;
  r->texel = run->y * HS_TILE + run->x;
  r->w[0] = (1.0f - run->s) * (1.0f - run->t);
  r->w[1] = run->s * (1.0f - run->t);
  r->w[2] = (1.0f - run->s) * run->t;
  r->w[3] = run->s * run->t;
  for (int k = 0; k < 4; ++k) r->lit[k] = (run->words & (1 << (HS_LIT_SHIFT + k))) != 0;
}

// Loads a run and its receivers; false, and no receivers, where none of its footprints lies in one of the cells.
HS_INLINE bool load_in_cells(const HsView light, const HsReceiverView view, int2 tile_px, uint begins,
                             __global const float* depth_or_position, __global const uint* receiver_words, uint cells,
                             bool faithful, TileRun* run, TileReceiver* r) {
  load_run(light, view, tile_px, begins, depth_or_position, receiver_words, run);
  if (!meets_cells(run, cells)) return false;
  tile_receiver(run, faithful, r);
  return true;
}

// What the texels of a footprint hold in one array.
typedef struct {
  vfloat v[4];
} TileTaps;

HS_INLINE void tile_taps(HS_SHARED const float* values, vint texel, TileTaps* t) {
  v_tile_pair(values, texel, &t->v[0], &t->v[1]);
  v_tile_pair(values, texel + HS_TILE, &t->v[2], &t->v[3]);
}

// The fins at footprints. Where no footprint has any of a kind, nothing else is known of that kind.
typedef struct {
  TileTaps inner_s, inner_d, outer_s, outer_d;
  TileTaps inner2_s, inner2_d, inner2_c, outer2_s, outer2_d, outer2_c;
  bool inner, outer, inner2, outer2;
  vint any;
  vint short_of[4];  // inner fins that do not reach the receiver
} FinTaps;

// The depths at footprints: 0 where the receiver stands before all of them, and none matters. Returns which have any that does.
// *there: some have fins.
HS_INLINE vint load_depths(HS_SHARED const float* depths, const TileReceiver* r, TileTaps* d, bool* there) {
  tile_taps(depths, r->texel, d);
  const vfloat nearest = max(max(d->v[0], d->v[1]), max(d->v[2], d->v[3]));
  const vint any = r->mine & (nearest > r->behind_d), behind = r->mine & (nearest > 0.0f) & (nearest <= r->behind_d);
  *there = v_any(any | behind);
  if (v_any(behind)) {
    for (int k = 0; k < 4; ++k) d->v[k] = v_select((vfloat)(0.0f), d->v[k], any);
  }
  return any;
}

HS_INLINE void load_fins(HS_SHARED const TileFins* fins, const TileReceiver* r, bool varied, bool single, bool faithful,
                         FinTaps* f) {
  bool inner, outer, unused;
  const vint inner_any = load_depths(fins->inner.d, r, &f->inner_d, &inner);
  const vint outer_any = load_depths(fins->outer.d, r, &f->outer_d, &outer);
  f->any = inner_any | outer_any;
  f->inner = v_any(inner_any);
  f->outer = v_any(outer_any);
  f->inner2 = f->outer2 = false;
  // The first fin may lie behind a receiver that the second matters to.
  if (varied && inner) {
    const vint any = load_depths(fins->inner2.d, r, &f->inner2_d, &unused);
    f->any |= any;
    f->inner2 = v_any(any);
  }
  if (varied && outer) {
    const vint any = load_depths(fins->outer2.d, r, &f->outer2_d, &unused);
    f->any |= any;
    f->outer2 = v_any(any);
  }
  if (f->outer) tile_taps(fins->outer.s, r->texel, &f->outer_s);
  for (int k = 0; k < 4; ++k) f->short_of[k] = (vint)(0);
  if (f->inner) {
    tile_taps(fins->inner.s, r->texel, &f->inner_s);
    if (!faithful) {
      TileTaps reach_d;
      tile_taps(fins->reach_d, r->texel, &reach_d);
      for (int k = 0; k < 4; ++k) f->short_of[k] = (f->inner_d.v[k] > 0.0f) & (r->d < reach_d.v[k]);
    }
    if (single) {
      for (int k = 0; k < 4; ++k) f->inner_d.v[k] = v_select(f->inner_d.v[k], (vfloat)(0.0f), f->short_of[k]);
    }
  }
  if (f->inner2) {
    tile_taps(fins->inner2.s, r->texel, &f->inner2_s);
    tile_taps(fins->inner2.c, r->texel, &f->inner2_c);
  }
  if (f->outer2) {
    tile_taps(fins->outer2.s, r->texel, &f->outer2_s);
    tile_taps(fins->outer2.c, r->texel, &f->outer2_c);
  }
}

// The refined weight of the fins at some texels of a footprint, w their bilinear weights, those without counting as 0.
HS_INLINE vfloat mean_weight(const HsView light, const TileReceiver* r, const vfloat* w, const vint* other_side,
                             const TileTaps* s, const TileTaps* d, vfloat all, vfloat* mean_d) {
  vfloat has = (vfloat)(0.0f), sum_s = has, sum_d = has;
  for (int k = 0; k < 4; ++k) {
    // Weight 1/2 marks the fin of the other side, which reaches over the silhouette.
    const vint mine = (d->v[k] > 0.0f) & v_not(other_side[k] & (s->v[k] >= 0.5f));
    const vfloat weight = v_select((vfloat)(0.0f), w[k], mine);
    has += weight;
    sum_s += weight * v_select((vfloat)(0.0f), s->v[k], mine);
    sum_d += weight * v_select((vfloat)(0.0f), d->v[k], mine);
  }
  const vfloat per = 1.0f / max(has, 1e-12f);
  *mean_d = sum_d * per;
  return v_select((vfloat)(0.0f), refined_weight(light, r->d, sum_s * per, *mean_d) * (has / max(all, 1e-12f)), has > 0.0f);
}

HS_INLINE vfloat mean_cosine(const vfloat* w, const TileTaps* d, const TileTaps* c) {
  vfloat has = (vfloat)(0.0f), sum = has;
  for (int k = 0; k < 4; ++k) {
    const vfloat weight = v_select((vfloat)(0.0f), w[k], d->v[k] > 0.0f);
    has += weight;
    sum += weight * v_select((vfloat)(0.0f), c->v[k], d->v[k] > 0.0f);
  }
  return sum / max(has, 1e-12f);
}

// What two fins hide together that hide a and b of the light each, by the cosine c between their directions: the same part, so
// that the greater counts; parts as good as independent, at a right angle; opposite parts.
HS_INLINE vfloat hidden_by_both(vfloat a, vfloat b, vfloat c) {
  const vfloat same = max(a, b), across = a + b - a * b, opposite = min(a + b, 1.0f);
  return v_select(lerp(across, same, min(c * (1.0f / HS_SAME_DIRECTION), 1.0f)), lerp(across, opposite, -c), c < 0.0f);
}

// Illuminance: `hard` (0 or 1) plus what the inner fins let in less what the outer ones hide (Cai §3.4), each after the falloff.
// w: bilinear weights of the texels that count, `all` their sum; lit: the light sees these.
HS_INLINE vfloat illuminance(const HsView light, const HsLayers layers, const TileReceiver* r, const FinTaps* f, const vfloat* w,
                             vfloat all, float hard, bool lit, vfloat* inner_d) {
  vint inner_other[4], outer_other[4];
  for (int k = 0; k < 4; ++k) {
    inner_other[k] = lit ? (vint)(-1) : (vint)(0);
    outer_other[k] = lit ? (vint)(0) : (vint)(-1);
  }
  const uint falloff = layers.faithful ? HS_FALLOFF_LINEAR : layers.falloff;
  vfloat inner = (vfloat)(0.0f), outer = inner, lets_in = inner, hides = inner, unused;
  *inner_d = inner;
  if (f->inner) inner = mean_weight(light, r, w, inner_other, &f->inner_s, &f->inner_d, all, inner_d);
  if (f->outer) outer = mean_weight(light, r, w, outer_other, &f->outer_s, &f->outer_d, all, &unused);
  if (v_any(inner > 0.0f)) lets_in = falloff_of(inner, falloff);
  if (v_any(outer > 0.0f)) hides = falloff_of(outer, falloff);
  if (f->outer2) {
    const vfloat outer2 = mean_weight(light, r, w, outer_other, &f->outer2_s, &f->outer2_d, all, &unused);
    if (v_any(outer2 > 0.0f))
      hides = hidden_by_both(hides, falloff_of(outer2, falloff), mean_cosine(w, &f->outer2_d, &f->outer2_c));
  }
  if (f->inner2) {
    vfloat second_d;
    const vfloat inner2 = mean_weight(light, r, w, inner_other, &f->inner2_s, &f->inner2_d, all, &second_d);
    *inner_d = v_select(*inner_d, second_d, *inner_d == 0.0f);
    if (v_any(inner2 > 0.0f)) {
      const vfloat b = falloff_of(inner2, falloff), c = mean_cosine(w, &f->inner2_d, &f->inner2_c);
      lets_in = hidden_by_both(lets_in, b, c);
    }
  }
  return clamp(hard + lets_in - hides, 0.0f, 1.0f);
}

HS_INLINE vfloat sum_of(const vfloat* w) {
  return (w[0] + w[1]) + (w[2] + w[3]);
}

// One layer of fins.
HS_INLINE vfloat one_layer(const HsView light, const HsLayers layers, const TileReceiver* r, const FinTaps* f) {
  vfloat lit_w[4], dark_w[4];
  for (int k = 0; k < 4; ++k) {
    lit_w[k] = v_select((vfloat)(0.0f), r->w[k], r->lit[k]);
    dark_w[k] = r->w[k] - lit_w[k];
  }
  const vfloat lit = sum_of(lit_w), dark = sum_of(dark_w);
  vfloat sum = (vfloat)(0.0f), unused;
  if (v_any(lit > 0.0f)) sum = lit * illuminance(light, layers, r, f, lit_w, lit, 1.0f, true, &unused);
  if (v_any(dark > 0.0f)) sum += dark * illuminance(light, layers, r, f, dark_w, dark, 0.0f, false, &unused);
  return sum;
}

// ---------------------------------------------------------------------------------------------------------------- layers
// Cai's combination of a layer with those before it (§4.2): lit here, the previous illuminance; in penumbra here, the lesser of
// the two; in umbra here, this layer's. A layer whose caster does not cover the pixel has illuminance 1 less its outer weight, so
// that all three are the lesser of the two. What is left is to know where a layer's caster covers the pixel:
//   - where its inner fin lies on the hard shadow, which can be of a caster before it: then the lesser of the two is right again;
//   - where an inner fin of another layer belongs to the same caster, the outline runs through both layers: the greater of the
//   two;
//   - where a caster has no inner fin at all, or none that reaches the receiver: umbra, see raster_casters.

// As published the lesser of two takes for granted that what hides less hides nothing else. By default directions tell, as they
// do within a layer (hidden_by_both): where one caster's shadow begins as that of another one ends, each leaves what the other
// hides.

// Part of the light, and the direction in the map towards which it appears: shorter than 1 where that is not clear.
typedef struct {
  vfloat part, nx, ny;
} Seen;

// What a pixel has seen so far, apart for the texels of its footprint that the light sees and for those in hard shadow.
typedef struct {
  Seen lit;
  Seen done;     // in hard shadow, of the casters done with
  Seen at_hand;  // of the caster at hand
  // 1/Lb where that was last met, 0 if never; less than 0 where its inner fin ends before the receiver (TileFins.reach_d): umbra,
  // unless another caster's fin follows.
  vfloat at_d;
} Illuminance;

// What is left of `seen` where `mask` is set and another caster leaves b.
HS_INLINE void leave(bool faithful, vint mask, const Seen* b, Seen* seen) {
  const vfloat hidden = 1.0f - seen->part, more = 1.0f - b->part;
  const vint both = mask & (hidden > 0.0f) & (more > 0.0f);
  vfloat part = min(seen->part, b->part);
  if (!faithful && v_any(both)) {
    const vfloat both_hide = hidden_by_both(hidden, more, seen->nx * b->nx + seen->ny * b->ny);
    part = v_select(part, 1.0f - both_hide, both);
  }
  const vfloat per = 1.0f / max(hidden + more, 1e-12f);
  seen->nx = v_select(seen->nx, (seen->nx * hidden + b->nx * more) * per, mask);
  seen->ny = v_select(seen->ny, (seen->ny * hidden + b->ny * more) * per, mask);
  seen->part = v_select(seen->part, part, mask);
}

// The direction of the fin that has most weight in a footprint.
HS_INLINE void direction_of_fin(HS_SHARED const Fins* fins, const TileReceiver* r, const TileTaps* d, Seen* seen) {
  vint texel = r->texel;
  vfloat most = v_select((vfloat)(0.0f), r->w[0], d->v[0] > 0.0f);
  for (int k = 1; k < 4; ++k) {
    const vfloat weight = v_select((vfloat)(0.0f), r->w[k], d->v[k] > 0.0f);
    texel = v_select(texel, r->texel + (k >> 1) * HS_TILE + (k & 1), weight > most);
    most = max(most, weight);
  }
  seen->nx = v_select((vfloat)(0.0f), v_tile(fins->nx, texel), most > 0.0f);
  seen->ny = v_select((vfloat)(0.0f), v_tile(fins->ny, texel), most > 0.0f);
}

HS_INLINE void add_layer(const HsView light, const HsFinShape shape, const HsLayers layers, HS_SHARED const TileFins* fins,
                         const TileReceiver* r, const FinTaps* f, Illuminance* seen) {
  vfloat lit_w[4], other_w[4], inner_w[4];
  for (int k = 0; k < 4; ++k) {
    // A texel without fins says nothing: its neighbours' values hold. Beyond the ends of fins these are the same.
    vint inner = f->inner_d.v[k] > 0.0f, outer = f->outer_d.v[k] > 0.0f;
    if (f->inner2) inner |= f->inner2_d.v[k] > 0.0f;
    if (f->outer2) outer |= f->outer2_d.v[k] > 0.0f;
    const vfloat w = v_select((vfloat)(0.0f), r->w[k], (inner | outer) & r->mine);
    lit_w[k] = v_select((vfloat)(0.0f), w, r->lit[k]);
    inner_w[k] = v_select((vfloat)(0.0f), w - lit_w[k], inner);
    other_w[k] = w - lit_w[k] - inner_w[k];
  }
  const float least = 1e-6f;
  const vfloat lit = sum_of(lit_w), other = sum_of(other_w), inner = sum_of(inner_w);
  vfloat unused, here_d;
  Seen here;
  here.nx = here.ny = (vfloat)(0.0f);
  if (f->outer && !layers.faithful) direction_of_fin(&fins->outer, r, &f->outer_d, &here);
  if (v_any(lit > least)) {
    here.part = illuminance(light, layers, r, f, lit_w, lit, 1.0f, true, &unused);
    leave(layers.faithful, lit > least, &here, &seen->lit);
  }
  if (v_any(other > least)) {
    here.part = illuminance(light, layers, r, f, other_w, other, 1.0f, false, &unused);
    leave(layers.faithful, other > least, &here, &seen->done);
  }
  const vint covered = inner > least;
  if (v_any(covered)) {
    if (f->inner && !layers.faithful) direction_of_fin(&fins->inner, r, &f->inner_d, &here);
    here.part = illuminance(light, layers, r, f, inner_w, inner, 0.0f, false, &here_d);
    // The same caster's outline, or that of one beneath it: see caster_depth.
    const vfloat apart = 1.0f / max(here_d, 1e-30f) - 1.0f / max(fabs(seen->at_d), 1e-30f);
    const vfloat depth = 4.0f * shape.radius_px * (here_d - light.d_far) / (light.px_from_q.x * max(here_d, 1e-30f));
    const vint same = (seen->at_d != 0.0f) & (fabs(apart) <= depth);
    leave(layers.faithful, covered & v_not(same), &seen->at_hand, &seen->done);
    const vint taken = covered & v_not(same & (here.part < seen->at_hand.part));
    seen->at_hand.part = v_select(seen->at_hand.part, here.part, taken);
    seen->at_hand.nx = v_select(seen->at_hand.nx, here.nx, taken);
    seen->at_hand.ny = v_select(seen->at_hand.ny, here.ny, taken);
    vfloat short_w[4];
    for (int k = 0; k < 4; ++k) short_w[k] = v_select((vfloat)(0.0f), inner_w[k], f->short_of[k]);
    const vint reaches = sum_of(short_w) * 2.0f <= inner;
    seen->at_d = v_select(seen->at_d, v_select(-here_d, here_d, reaches | (same & (seen->at_d > 0.0f))), covered);
  }
}

HS_INLINE vint caster_bits_at(__global const float* caster_range, vfloat z) {
#if HS_LANES == 16
  int bits[16];
  for (int i = 0; i < 16; ++i) bits[i] = 1 << caster_bit(caster_range, ((const float*)&z)[i]);
  return vload16(0, bits);
#else
  return 1 << caster_bit(caster_range, z);
#endif
}

// 1 where the texel's centre ray meets a caster, before the receiver, that no inner fin of any layer belongs to. Of the casters
// at the receiver's own depth, or the step of it just before, only the one in the shadow map is known not to be the receiver
// itself.
HS_INLINE vint other_caster_at(__global const float* shadow_map, __global const uint* other_casters,
                               __global const float* caster_range, HS_SHARED const TileFins* fins, vint own_bits, vint before,
                               vint dark, vint map_texel, vint tile_texel) {
  map_texel = v_select((vint)(0), map_texel, dark);
  const vint seen_bit = caster_bits_at(caster_range, v_gather(shadow_map, map_texel));
  vint others;
  for (int i = 0; i < HS_LANES; ++i)
    HS_PUT_INT(others, i, (int)other_casters[HS_LANE(map_texel, i)] & ~fins->own_casters[HS_LANE(tile_texel, i)]);
  return (others & (before | (own_bits & seen_bit))) != 0;
}

HS_INLINE vfloat end_layers(const HsView light, __global const float* shadow_map, __global const uint* other_casters,
                            __global const float* caster_range, HS_SHARED const TileFins* fins, int2 tile_px, bool faithful,
                            const TileReceiver* r, Illuminance* seen) {
  const vfloat z = 1.0f / r->d;
  const vint last_bit = caster_bits_at(caster_range, z - 1.0f / caster_range[1]);
  const vint own_bits = last_bit | caster_bits_at(caster_range, z), before = last_bit - 1;
  vfloat sum = (vfloat)(0.0f);
  leave(faithful, r->mine, &seen->at_hand, &seen->done);
  const vfloat in_shadow = v_select((vfloat)(0.0f), seen->done.part, seen->at_d > 0.0f);
  for (int k = 0; k < 4; ++k) {
    const vint dark = r->mine & v_not(r->lit[k]);
    vfloat value = v_select(seen->lit.part, in_shadow, dark);
    if (v_any(dark & (in_shadow > 0.0f))) {
      const vint texel = r->texel + (k >> 1) * HS_TILE + (k & 1);
      const vint map_texel = (texel / HS_TILE + tile_px.y) * (int)light.width_px + texel % HS_TILE + tile_px.x;
      value = v_select(
          value, (vfloat)(0.0f),
          dark & other_caster_at(shadow_map, other_casters, caster_range, fins, own_bits, before, dark, map_texel, texel));
    }
    sum += value * r->w[k];
  }
  return clamp(sum, 0.0f, 1.0f);
}

// Stores what this tile knows of a run.
HS_INLINE void store_mine(const TileRun* run, vfloat value, __global float* plane) {
  plane += run->pixel;
  if (v_all(run->mine)) {
    v_store(value, plane);
  } else {
    for (int i = 0; i < HS_LANES; ++i)
      if (HS_LANE(run->mine, i)) plane[i] = HS_FLOAT_LANE(value, i);
  }
}

// The answer to those of a run that fins reach: no more than what each receiver may have. The others keep what they have.
HS_INLINE void store_result(const TileRun* run, vfloat value, vint reached, __global const float* horizon_limits,
                            __global float* visibility) {
  const vint capped = (run->words & HS_WORD_LIMITED) != 0;
  if (v_any(capped & reached)) value = v_select(value, min(value, load_lanes(horizon_limits, run->pixel, run->valid)), capped);
  store_mine(run, v_select(load_lanes(visibility, run->pixel, run->valid), value, reached), visibility);
}

// Visits the tile's runs of receivers: `slot` in the list.
#define HS_FOR_LISTED(slot) for (uint slot = first_run + (uint)get_local_id(0); slot < last_run; slot += HS_TILE_ITEMS)

// states: HS_STATE_PLANES floats a pixel. Directions are kept as two 16-bit integers.
#define HS_DIRECTION_SCALE 32000.0f
HS_INLINE void store_seen(const TileRun* run, const Seen* seen, __global float* states, size_t pixels) {
  const vint x = v_int(seen->nx * HS_DIRECTION_SCALE), y = v_int(seen->ny * HS_DIRECTION_SCALE);
  store_mine(run, seen->part, states);
  store_mine(run, v_as_float((x & 0xffff) | (y << 16)), states + pixels);
}

HS_INLINE void load_seen(const TileRun* run, __global const float* states, size_t pixels, Seen* seen) {
  const vint packed = v_as_int(load_lanes(states + pixels, run->pixel, run->valid));
  seen->part = load_lanes(states, run->pixel, run->valid);
  seen->nx = v_float(packed << 16 >> 16) * (1.0f / HS_DIRECTION_SCALE);
  seen->ny = v_float(packed >> 16) * (1.0f / HS_DIRECTION_SCALE);
}

HS_INLINE void store_illuminance(const TileRun* run, const Illuminance* seen, __global float* states, size_t pixels) {
  store_seen(run, &seen->lit, states, pixels);
  store_seen(run, &seen->done, states + 2 * pixels, pixels);
  store_seen(run, &seen->at_hand, states + 4 * pixels, pixels);
  store_mine(run, seen->at_d, states + 6 * pixels);
}

HS_INLINE void load_illuminance(const TileRun* run, __global const float* states, size_t pixels, Illuminance* seen) {
  load_seen(run, states, pixels, &seen->lit);
  load_seen(run, states + 2 * pixels, pixels, &seen->done);
  load_seen(run, states + 4 * pixels, pixels, &seen->at_hand);
  seen->at_d = load_lanes(states + 6 * pixels, run->pixel, run->valid);
}

HS_INLINE void begin_illuminance(Illuminance* seen) {
  seen->lit.part = (vfloat)(1.0f);
  seen->lit.nx = seen->lit.ny = (vfloat)(0.0f);
  seen->done = seen->at_hand = seen->lit;
  seen->at_d = (vfloat)(0.0f);
}

// One work-group a tile of the features. other_casters: see raster_casters; states: float[HS_STATE_PLANES * pixels]; both only
// for more than one layer.
__kernel __attribute__((reqd_work_group_size(HS_TILE_ITEMS, 1, 1))) void receive_fins(
    const HsView view, const HsFinShape shape, const HsLayers layers, __global const HsStatus* status,
    __global const ushort4* rects, __global const uint* offsets, __global const uint* refs, const uint capacity,
    __global const HsFeature* features, __global const float* shadow_map, __global const uint* other_casters,
    __global const float* caster_range, __global const uint* receiver_offsets, __global const uint* listed,
    const HsReceiverView camera, __global const int* tile_far, __global const float* depth_or_position,
    __global const uint* receiver_words, __global const float* horizon_limits, __global float* states, __global float* visibility,
    const uint plane) {
  HS_SHARED TileFins fins;
#if HS_LANES == 1
  __local uint all_cells;
#endif
  const size_t pixels = (size_t)camera.width_px * camera.height_px;
  visibility += (size_t)plane * pixels;
  const uint used = used_layers(layers, caster_range);
  const bool single = used == 1;
  FeatureTile tile = feature_tile(view, shape, 0, layers.count, status, offsets, capacity);
  const uint first_run = receiver_offsets[get_group_id(0)], last_run = receiver_offsets[get_group_id(0) + 1];
  const bool any = first_run < last_run;
  float d_receiver[HS_TILE_STORAGE];
  if (any) {
    for (int i = 0; i < HS_TILE_STORAGE; ++i) d_receiver[i] = 0.0f;
    if (!layers.faithful) load_receivers(view, tile, shadow_map, d_receiver);
    if (!single) {
      HS_FOR_TEXELS(x, y, 0, 0, HS_TILE - 1, HS_TILE - 1) v_store((vint)(0), fins.own_casters + y * HS_TILE + x);
    }
  }
  HsView bounded = view;
  if (any && !layers.faithful)
    bounded.d_far = max(view.d_far, 0.999999f / as_float(tile_far[get_group_id(0)]) - 1.5f / shape.radius_px);
  uint reached = 0;  // by fins of any layer so far
  for (uint layer = 0; layer < used; ++layer) {
    bool varied = false;
    uint cells = 0;
    HS_TILE_BARRIER();
#if HS_LANES == 1
    if (get_local_id(0) == 0) all_cells = 0;
    HS_TILE_BARRIER();
#endif
    if (any && (tile.overflow || layer_touches(shape, layer, offsets))) {
      tile = feature_tile(view, shape, layer, layers.count, status, offsets, capacity);
      cells = draw_tile_fins(view, bounded, shape, layers, single, tile, refs, rects, features, shadow_map, d_receiver,
                             caster_range, &fins, &varied);
    }
#if HS_LANES == 1
    if (cells != 0) atomic_or(&all_cells, cells);
    HS_TILE_BARRIER();
    cells = all_cells;
#endif
    if (cells != 0) {
      HS_FOR_LISTED(slot) {
        TileRun run;
        TileReceiver r;
        if (!load_in_cells(view, camera, tile.px, listed[slot], depth_or_position, receiver_words, cells, layers.faithful, &run,
                           &r))
          continue;
        FinTaps taps;
        load_fins(&fins, &r, varied, single, layers.faithful, &taps);
        if (single) {
          if (!v_any(taps.any)) continue;
          vfloat value = one_layer(view, layers, &r, &taps);
          if (layers.faithful) value = falloff_of(value, layers.falloff);
          store_result(&run, value, taps.any, horizon_limits, visibility);
        } else {
          const bool first = !meets_cells(&run, reached);
          if (!first && !v_any(taps.any)) continue;
          Illuminance seen;
          begin_illuminance(&seen);
          if (!first) load_illuminance(&run, states, pixels, &seen);
          add_layer(view, shape, layers, &fins, &r, &taps, &seen);
          store_illuminance(&run, &seen, states, pixels);
        }
      }
    }
    reached |= cells;
  }
  HS_TILE_BARRIER();
  if (!single) {
    HS_FOR_LISTED(slot) {
      TileRun run;
      TileReceiver r;
      if (!load_in_cells(view, camera, tile.px, listed[slot], depth_or_position, receiver_words, reached, layers.faithful, &run,
                         &r))
        continue;
      Illuminance seen;
      load_illuminance(&run, states, pixels, &seen);
      vfloat value = end_layers(view, shadow_map, other_casters, caster_range, &fins, tile.px, layers.faithful, &r, &seen);
      if (layers.faithful) value = falloff_of(value, layers.falloff);
      store_result(&run, value, r.mine, horizon_limits, visibility);
    }
  }
}
