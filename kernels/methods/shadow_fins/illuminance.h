// What fins make of the light that a receiver sees: in one layer (Cai et al. 2006 §3), and layer after layer (§4).

#pragma once

#include "base/falloff.h"
#include "methods/shadow_fins/tile_runs.h"
#include "silhouettes/layers.h"

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
    const vfloat depth = HS_CASTER_DEPTH * shape.radius_px * (here_d - light.d_far) / (light.px_from_q.x * max(here_d, 1e-30f));
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
