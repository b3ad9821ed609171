// Shadow fins: Cai et al. 2006 §3.4, and their layers: §4.2.

// A fin's weight for this receiver, from the one for the reference plane (Eq. 5): s_r = 1/2 + (B_0/B_r) (s_0 - 1/2), and with
// Eq. 3 B_0/B_r = w(Lb, L0) / w(Lb, Lr). A receiver before the fin sees nothing of it; at contact w vanishes, and with it the
// weight.
HS_INLINE vfloat refined_weight(const HsView light, const Receiver* r, vfloat s, vfloat d) {
  const vfloat beyond = d - r->plane_d;
  const vfloat refined = 0.5f + (d - light.d_far) / fmax(beyond, 1e-30f) * (s - 0.5f);
  return v_select((vfloat)(0.0f), clamp(refined, 0.0f, 0.5f), beyond > 0.0f);
}

// What the fins at a texel say of a receiver.
typedef struct {
  vfloat lit;           // hard shadow: 0 or 1
  vfloat inner, outer;  // refined weights
  vfloat inner_d;       // 1/Lb of the inner fin; 0 for none
  vint any;             // there is a fin
} FinTexel;

HS_INLINE FinTexel fin_texel(const HsView light, __global const float4* fins, const Receiver* r, vfloat lit, vint near,
                             vint texel) {
  __global const float* values = (__global const float*)fins;
  const vint i = v_select((vint)(0), texel * 4, near);
  vfloat inner_s, inner_d, outer_s, outer_d;
  v_gather_pair(values, i, &inner_s, &inner_d);
  v_gather_pair(values, i + 2, &outer_s, &outer_d);
  FinTexel t;
  t.lit = lit;
  t.inner_d = v_select((vfloat)(0.0f), inner_d, near);
  outer_d = v_select((vfloat)(0.0f), outer_d, near);
  // Weight 1/2 marks the fin of the other side, which reaches over the silhouette.
  t.inner = v_select(refined_weight(light, r, inner_s, t.inner_d), (vfloat)(0.0f), (lit > 0.0f) & (inner_s >= 0.5f));
  t.outer = v_select(refined_weight(light, r, outer_s, outer_d), (vfloat)(0.0f), (lit == 0.0f) & (outer_s >= 0.5f));
  t.any = (t.inner_d > 0.0f) | (outer_d > 0.0f);
  return t;
}

// Illuminance, before the falloff: hard shadow plus inner less outer weight.
HS_INLINE vfloat illuminance(vfloat hard, const FinTexel* t) {
  return clamp(hard + t->inner - t->outer, 0.0f, 1.0f);
}

// One layer of fins.
HS_INLINE vfloat visibility_fins(const HsView light, __global const float* shadow_map, __global const float4* fins,
                                 __global const uchar* tile_near_fins, uint falloff, const Receiver* r) {
  const Footprint f = footprint(light, r);
  Taps v = lit_taps(light, shadow_map, r, &f);
  const vint near = near_fins(light, &f, r, tile_near_fins);
  if (v_any(near)) {
    const int width_px = (int)light.width_px;
    const vint first = f.y * width_px + f.x;
    const FinTexel t00 = fin_texel(light, fins, r, v.v00, near, first), t10 = fin_texel(light, fins, r, v.v10, near, first + 1);
    const FinTexel t01 = fin_texel(light, fins, r, v.v01, near, first + width_px);
    const FinTexel t11 = fin_texel(light, fins, r, v.v11, near, first + width_px + 1);
    v.v00 = illuminance(v.v00, &t00);
    v.v10 = illuminance(v.v10, &t10);
    v.v01 = illuminance(v.v01, &t01);
    v.v11 = illuminance(v.v11, &t11);
  }
  return falloff_of(bilinear(&f, &v), falloff);
}

__kernel void receive_fins(const HsView light, const HsReceiverView view, __global const float* depth_or_position,
                           __global const float4* normal, __global const float* shadow_map, __global const float4* fins,
                           __global const uchar* tile_near_fins, const uint falloff, __global float* visibility,
                           const uint plane){
    HS_FOR_RECEIVERS(visibility_fins(light, shadow_map, fins, tile_near_fins, falloff, &r))}
// ---------------------------------------------------------------------------------------------------------------- layers
// Cai's combination of a layer with those before it (§4.2): lit here, the previous illuminance; in penumbra here, the lesser of
// the two; in umbra here, this layer's. A layer whose caster does not cover the pixel has illuminance 1 less its outer weight, so
// that all three are the lesser of the two. What is left is to know where a layer's caster covers the pixel:
//   - where its inner fin lies on the hard shadow, which can be of a caster before it: then the lesser of the two is right again;
//   - where an inner fin of another layer belongs to the same caster, the outline runs through both layers: the greater of the
//   two;
//   - where a caster has no inner fin at all: umbra, see raster_casters.
// The illuminance buffer, float4 a pixel, keeps for the texels that the light sees and for those in hard shadow apart: x: lit; y:
// in shadow, of the casters done with; z: of the caster at hand; w: 1/Lb where that was last met.

// The light's tiles that the receivers of a strip are near fins in: x0, y0 inclusive, x1, y1 exclusive; all 0 for none.
#if HS_LANES == 16
HS_INLINE int v_least(int16 v) {
  const int8 a = min(v.lo, v.hi);
  const int4 b = min(a.lo, a.hi);
  const int2 c = min(b.lo, b.hi);
  return min(c.x, c.y);
}
#else
#define v_least(v) (v)
#endif

HS_INLINE ushort4 joined(ushort4 rect, ushort4 other) {
  if (other.x >= other.z) return rect;
  if (rect.x >= rect.z) return other;
  return (ushort4)(min(rect.x, other.x), min(rect.y, other.y), max(rect.z, other.z), max(rect.w, other.w));
}

// A receiver near fins, as the layers see it again and again: x, y: light map position in texels; z: 1/Lr; w: the lit texels of
// its footprint, a bit each, or -1 where no fin is near.
HS_INLINE void store_receiver(const Receiver* r, const Taps* lit, vint near, __global float4* layer_receivers, size_t first,
                              int valid) {
  const vfloat bits = lit->v00 + 2.0f * lit->v10 + 4.0f * lit->v01 + 8.0f * lit->v11;
  store_lanes4(r->u, r->v, r->plane_d, v_select((vfloat)(-1.0f), bits, near), layer_receivers, first, valid);
}

HS_INLINE Receiver load_receiver(__global const float4* layer_receivers, size_t first, int valid, vint* lit) {
  Receiver r;
  vfloat bits;
  load_lanes4(layer_receivers, first, valid, &r.u, &r.v, &r.plane_d, &bits);
  *lit = v_int(bits);
  r.decided = bits < 0.0f;
  return r;
}

// Hard shadows; where fins are near, the illuminance buffer begins lit.
HS_INLINE vfloat begin_layers(const HsView light, __global const float* shadow_map, __global const uchar* near_any, uint falloff,
                              const Receiver* r, __global float4* layer_receivers, __global float4* illuminances, size_t first,
                              int valid, ushort4* rect) {
  const Footprint f = footprint(light, r);
  const Taps lit = lit_taps(light, shadow_map, r, &f);
  const vint near = near_fins(light, &f, r, near_any) & !r->decided;
  if (v_any(near)) {
    const vint tx = f.x / HS_TILE, ty = f.y / HS_TILE, none = (vint)(USHRT_MAX);
    *rect =
        joined(*rect, convert_ushort4((int4)(v_least(v_select(none, tx, near)), v_least(v_select(none, ty, near)),
                                             1 - v_least(v_select(none, -tx, near)), 1 - v_least(v_select(none, -ty, near)))));
    const vfloat one = (vfloat)(1.0f);
    store_lanes4(one, one, one, (vfloat)(0.0f), illuminances, first, valid);
  }
  store_receiver(r, &lit, near, layer_receivers, first, valid);
  return falloff_of(bilinear(&f, &lit), falloff);
}

// Index of the first pixel that HS_FOR_PIXELS is at.
#define HS_PIXEL ((size_t)py * view.width_px + px)

// layer_receivers, illuminances: float4 a pixel. strip_rects: ushort4 a work-item.
__kernel void receive_layers_begin(const HsView light, const HsReceiverView view, __global const float* depth_or_position,
                                   __global const float4* normal, __global const float* shadow_map,
                                   __global const uchar* near_any, const uint falloff, __global float4* layer_receivers,
                                   __global float4* illuminances, __global ushort4* strip_rects, __global float* visibility,
                                   const uint plane) {
  ushort4 rect = (ushort4)(0);
  HS_FOR_PIXELS(px, py, valid, view.width_px, view.height_px) {
    const Receiver r = locate(light, view, px, py, valid, depth_or_position, normal);
    vfloat result = r.visibility;
    if (v_all(r.decided))
      store_lanes4(result, result, result, (vfloat)(-1.0f), layer_receivers, HS_PIXEL, valid);
    else
      result =
          v_select(begin_layers(light, shadow_map, near_any, falloff, &r, layer_receivers, illuminances, HS_PIXEL, valid, &rect),
                   r.visibility, r.decided);
    store_visibility(&r, result, visibility, (size_t)plane * view.height_px * view.width_px + HS_PIXEL, valid);
  }
  strip_rects[get_global_id(1) * get_global_size(0) + get_global_id(0)] = rect;
}

HS_INLINE bool any_near(ushort4 rect, __global const uchar* near, uint tiles_x) {
  bool any = false;
  for (uint y = rect.y; y < rect.w; ++y)
    for (uint x = rect.x; x < rect.z; ++x) any |= near[y * tiles_x + x] != 0;
  return any;
}

// Adds a texel with bilinear weight `weight` to the means over those texels that the light sees, and those in hard shadow.
HS_INLINE void add_texel(const FinTexel* t, vfloat weight, vfloat* lit, vfloat* lit_weight, vfloat* other, vfloat* other_weight,
                         vfloat* inner, vfloat* inner_d, vfloat* inner_weight) {
  // A texel without fins says nothing: its neighbours' values hold. Beyond the ends of fins these are the same.
  weight = v_select((vfloat)(0.0f), weight, t->any);
  const vfloat sees = weight * t->lit, dark = weight - sees;
  const vfloat covers = v_select((vfloat)(0.0f), dark, t->inner_d > 0.0f), passes = dark - covers;
  *lit += sees * illuminance((vfloat)(1.0f), t);
  *lit_weight += sees;
  *other += passes * illuminance((vfloat)(1.0f), t);
  *other_weight += passes;
  *inner += covers * illuminance((vfloat)(0.0f), t);
  *inner_d += covers * t->inner_d;
  *inner_weight += covers;
}

HS_INLINE void add_layer(const HsView light, const HsFinShape shape, __global const float4* fins,
                         __global const uchar* near_layer, const Receiver* r, vint lit_bits, __global float4* illuminances,
                         size_t first, int valid) {
  const Footprint f = footprint(light, r);
  const vint near = near_fins(light, &f, r, near_layer) & !r->decided;
  if (!v_any(near)) return;
  vfloat lit = (vfloat)(0.0f), lit_weight = lit, other = lit, other_weight = lit, inner = lit, inner_d = lit, inner_weight = lit;
  for (int k = 0; k < 4; ++k) {
    const vint texel = (f.y + (k >> 1)) * (int)light.width_px + f.x + (k & 1);
    const vfloat is_lit = v_select((vfloat)(0.0f), (vfloat)(1.0f), (lit_bits & (1 << k)) != 0);
    const FinTexel t = fin_texel(light, fins, r, is_lit, near, texel);
    if (v_any(t.any))
      add_texel(&t, (k & 1 ? f.s : 1.0f - f.s) * (k & 2 ? f.t : 1.0f - f.t), &lit, &lit_weight, &other, &other_weight, &inner,
                &inner_d, &inner_weight);
  }
  const float least = 1e-6f;
  if (!v_any(lit_weight + other_weight + inner_weight > least)) return;
  vfloat seen, done, at_hand, d;
  load_lanes4(illuminances, first, valid, &seen, &done, &at_hand, &d);
  seen = fmin(seen, v_select((vfloat)(1.0f), lit / fmax(lit_weight, least), lit_weight > least));
  done = fmin(done, v_select((vfloat)(1.0f), other / fmax(other_weight, least), other_weight > least));

  const vint covered = near & (inner_weight > least);
  const vfloat here = inner / fmax(inner_weight, least), here_d = inner_d / fmax(inner_weight, least);
  // The same caster's outline, or that of one beneath it: see caster_depth.
  const vfloat apart = 1.0f / fmax(here_d, 1e-30f) - 1.0f / fmax(d, 1e-30f);
  const vfloat depth = 4.0f * shape.radius_px * (here_d - light.d_far) / (light.px_from_q.x * fmax(here_d, 1e-30f));
  const vint same = (d > 0.0f) & (fabs(apart) <= depth);
  done = v_select(done, fmin(done, at_hand), covered & !same);
  at_hand = v_select(at_hand, v_select(here, fmax(here, at_hand), same), covered);
  d = v_select(d, here_d, covered);
  store_lanes4(seen, done, at_hand, d, illuminances, first, valid);
}

__kernel void receive_layer(const HsView light, const HsReceiverView view, __global const float4* layer_receivers,
                            __global const float4* fins, __global const uchar* near_layers, const HsFinShape shape,
                            const HsLayer layer, __global float4* illuminances, __global const ushort4* strip_rects) {
  __global const uchar* near_layer = near_layers + layer.index * (light.tiles_x * light.tiles_y);
  const ushort4 rect = strip_rects[get_global_id(1) * get_global_size(0) + get_global_id(0)];
  if (any_near(rect, near_layer, light.tiles_x)) {
    HS_FOR_PIXELS(px, py, valid, view.width_px, view.height_px) {
      vint lit;
      const Receiver r = load_receiver(layer_receivers, HS_PIXEL, valid, &lit);
      if (!v_all(r.decided)) add_layer(light, shape, fins, near_layer, &r, lit, illuminances, HS_PIXEL, valid);
    }
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
                               __global const float* caster_range, vint own_bits, vint before, vint dark, vint texel) {
  texel = v_select((vint)(0), texel, dark);
  const vint seen_bit = caster_bits_at(caster_range, v_gather(shadow_map, texel));
#if HS_LANES == 16
  int casters[16];
  for (int i = 0; i < 16; ++i) casters[i] = (int)other_casters[((const int*)&texel)[i]];
  const vint others = vload16(0, casters);
#else
  const vint others = (int)other_casters[texel];
#endif
  return (others & (before | (own_bits & seen_bit))) != 0;
}

HS_INLINE vfloat end_layers(const HsView light, __global const float* shadow_map, __global const uint* other_casters,
                            __global const float* caster_range, uint falloff, __global const float4* illuminances, size_t first,
                            int valid, const Receiver* r, vint lit_bits) {
  const Footprint f = footprint(light, r);
  const vfloat z = 1.0f / r->plane_d;
  const vint last_bit = caster_bits_at(caster_range, z - 1.0f / caster_range[1]);
  const vint own_bits = last_bit | caster_bits_at(caster_range, z), before = last_bit - 1;
  vfloat seen, done, at_hand, d, sum = (vfloat)(0.0f);
  load_lanes4(illuminances, first, valid, &seen, &done, &at_hand, &d);
  const vfloat in_shadow = v_select((vfloat)(0.0f), fmin(done, at_hand), d > 0.0f);
  for (int k = 0; k < 4; ++k) {
    const vint dark = !r->decided & ((lit_bits & (1 << k)) == 0);
    vfloat value = v_select(seen, in_shadow, dark);
    if (v_any(dark & (in_shadow > 0.0f))) {
      const vint texel = (f.y + (k >> 1)) * (int)light.width_px + f.x + (k & 1);
      value = v_select(value, (vfloat)(0.0f),
                       dark & other_caster_at(shadow_map, other_casters, caster_range, own_bits, before, dark, texel));
    }
    sum += value * (k & 1 ? f.s : 1.0f - f.s) * (k & 2 ? f.t : 1.0f - f.t);
  }
  return falloff_of(clamp(sum, 0.0f, 1.0f), falloff);
}

__kernel void receive_layers_end(const HsView light, const HsReceiverView view, __global const float4* layer_receivers,
                                 __global const float* shadow_map, __global const uint* other_casters,
                                 __global const float* caster_range, const uint falloff, __global const float4* illuminances,
                                 __global const ushort4* strip_rects, __global float* visibility, const uint plane) {
  const ushort4 rect = strip_rects[get_global_id(1) * get_global_size(0) + get_global_id(0)];
  if (rect.x < rect.z) {
    __global float* out = visibility + (size_t)plane * view.height_px * view.width_px;
    HS_FOR_PIXELS(px, py, valid, view.width_px, view.height_px) {
      vint lit;
      const Receiver r = load_receiver(layer_receivers, HS_PIXEL, valid, &lit);
      if (!v_all(r.decided))
        store_lanes(
            v_select(end_layers(light, shadow_map, other_casters, caster_range, falloff, illuminances, HS_PIXEL, valid, &r, lit),
                     load_lanes(out, HS_PIXEL, valid), r.decided),
            out, HS_PIXEL, valid);
    }
  }
}
