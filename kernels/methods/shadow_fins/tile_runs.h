// Runs of a tile's receivers, and what its fins are at their footprints.

#pragma once

#include "methods/shadow_fins/receivers.h"
#include "methods/shadow_fins/tile_fins.h"

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
