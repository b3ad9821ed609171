// How wide fins are, and what their outlines bound: for all that make, bin or draw them.

#pragma once

#include "base/tiles.h"

// How far from the feature's edge, in texels, it can matter to the farthest receiver: the penumbra's half-width w(Lb, L0) there,
// which is where Chan & Durand's alpha' (Eq. 1) reaches 1, the radius of Wyman & Hansen's cone (§3), and the width of Cai's
// fins (Eq. 3).
HS_INLINE float reach_px(const HsFinShape shape, float d, float d_far) {
  const float beyond = max(d - d_far, 0.0f);
  return shape.width_px > 0.0f ? shape.width_px * beyond / d : shape.radius_px * beyond;
}

HS_INLINE uint feature_layer(const HsFeature f) {
  return (f.kind_and_layer & ((1u << HS_FEATURE_NARROW_SHIFT) - 1u)) >> HS_FEATURE_KIND_BITS;
}

// How wide the caster of a feature is there, in texels; INFINITY where that is as far as its penumbrae reach.
HS_INLINE float feature_width_px(const HsFeature f) {
  const uint narrow = f.kind_and_layer >> HS_FEATURE_NARROW_SHIFT;
  return narrow == 0 ? INFINITY : (float)narrow * (1.0f / HS_NARROW_STEPS);
}

// How far before its silhouette the lit side of a caster may lie: nothing known, so several times as far as the penumbra is wide
// there, which holds for a sphere no larger than that, and for gently sloping surfaces. By trial.
#define HS_CASTER_DEPTH 7.0f
HS_INLINE float caster_depth(const HsView view, const HsFinShape shape, float d) {
  return HS_CASTER_DEPTH * reach_px(shape, d, view.d_far) / (view.px_from_q.x * d);
}

// The same of several silhouettes, times d; of fins whose width follows from the radius.
HS_INLINE vfloat caster_depth_times(const HsView view, const HsFinShape shape, vfloat d) {
  return HS_CASTER_DEPTH * shape.radius_px / view.px_from_q.x * (d - view.d_far);
}

// Where the light is a sphere, a receiver sees the disc that faces it, so that distances in the penumbra are angles, not lengths
// in the map. Here q is a point's place in the map, y down; 0 for discs, for which all of this comes to nothing.
HS_INLINE float2 sphere_q(const HsView view, const HsFinShape shape, float2 px) {
  return (px - view.px_from_q.yw) * shape.sphere_q_per_px;
}

// How far along an edge with this unit normal, for each step across it, the points lead that are nearest to q by angle: towards
// normal + (q . normal) q.
HS_INLINE float sphere_skew(float2 q, float2 normal, float2 along) {
  const float s = dot(q, normal);
  return s * dot(q, along) / (1.0f + s * s);
}

// As reach_px, for a point of a sphere light's silhouette at q: see sphere_distance in feature_tiles.h. Its angle is one for
// which |q - p| < R d sqrt(1 + p^2) - R d_far (1 + q . p) / sqrt(1 + p^2), with p the receiver's place, within the face.
HS_INLINE float sphere_reach_px(const HsFinShape shape, float2 q, float d, float d_far) {
  const float radius = (shape.width_px > 0.0f ? shape.width_px / d : shape.radius_px) * shape.sphere_q_per_px;
  const float from_axis = sqrt(dot(q, q)) + 2.0f * radius * d, stretch = min(sqrt(1.0f + from_axis * from_axis), 3.0f);
  return radius * (stretch * d - d_far * max(1.0f - 1.5f * stretch * radius * d, 0.0f)) / shape.sphere_q_per_px;
}

HS_INLINE float reach_at(const HsFinShape shape, float2 q, float d, float d_far) {
  return shape.sphere_q_per_px > 0.0f ? sphere_reach_px(shape, q, d, d_far) : reach_px(shape, d, d_far);
}

// Whether all of a piece of a sphere light's silhouette lies at an angle to the face's receivers at which it cannot hide
// anything. It is as long as `length`, and begins at 1/d and q.
HS_INLINE bool sphere_misses_face(const HsFinShape shape, float2 q, float d, float length) {
  if (shape.sphere_q_per_px == 0.0f || shape.width_px > 0.0f) return false;
  const float slant = sqrt(1.0f + dot(q, q)), nearest = slant / d - length, radius = shape.radius_px * shape.sphere_q_per_px;
  if (nearest <= radius || nearest <= length) return false;
  const float face = 1.0f;  // 54.7 degrees, to the face's corners, and its border
  return acos(1.0f / slant) > face + asin(radius / nearest) + asin(length / nearest);
}

// The box about an edge's quad, and about the one on its inner side where fins have two.
HS_INLINE void bound_quad(const HsFinShape shape, float3 a, float3 b, float2 qa, float2 qb, float2 outward, float d_far,
                          float2* low, float2* high) {
  const float2 along = (float2)(-outward.y, outward.x);
  const float2 a_reach = (outward + along * sphere_skew(qa, outward, along)) * reach_at(shape, qa, a.z, d_far),
               b_reach = (outward + along * sphere_skew(qb, outward, along)) * reach_at(shape, qb, b.z, d_far);
  const float inner = shape.two_sided ? 1.0f : 0.0f;
  const float2 a_out = a.xy + a_reach, b_out = b.xy + b_reach, a_in = a.xy - a_reach * inner, b_in = b.xy - b_reach * inner;
  *low = min(min(a_in, b_in), min(a_out, b_out));
  *high = max(max(a_in, b_in), max(a_out, b_out));
}

// The box about a corner's sector (the wedge of HsFeature, out to `reach`): its apex, its two sides, and the axes inside it.
HS_INLINE void bound_sector(float2 apex, float2 h0, float2 h1, float reach, float2* low, float2* high) {
  const float2 side0 = (float2)(-h0.y, h0.x) * (h0.x * h1.y - h0.y * h1.x >= 0.0f ? 1.0f : -1.0f);
  const float2 side1 = (float2)(-h1.y, h1.x) * (h1.x * h0.y - h1.y * h0.x >= 0.0f ? 1.0f : -1.0f);
  const float2 most = (float2)(h0.x >= 0.0f && h1.x >= 0.0f, h0.y >= 0.0f && h1.y >= 0.0f);
  const float2 least = (float2)(h0.x <= 0.0f && h1.x <= 0.0f, h0.y <= 0.0f && h1.y <= 0.0f);
  *low = apex + reach * min(min(side0, side1), -least);
  *high = apex + reach * max(max(side0, side1), most);
  *low = min(*low, apex);
  *high = max(*high, apex);
}

// The texels that a box may reach, inclusive: centres lie at +0.5; a texel of slack absorbs the rounding of coordinates far
// outside the map.
HS_INLINE int4 texels_of_points(const HsView view, float2 low, float2 high) {
  const float2 limit = (float2)(view.width_px + 2, view.height_px + 2);
  return (int4)(convert_int2_rtn(clamp(low - 1.0f, (float2)(-2.0f), limit)),
                convert_int2_rtn(clamp(high + 1.0f, (float2)(-2.0f), limit)));
}

HS_INLINE ushort4 rect_of_points(const HsView view, float2 low, float2 high) {
  const int4 box = texels_of_points(view, low, high);
  return rect_of_texels(view, box.x, box.y, box.z, box.w);
}

// The tiles of HsFinShape that hold texels of a box.
HS_INLINE ushort4 rect_of_feature(const HsView view, const HsFinShape shape, float2 low, float2 high) {
  const int4 box = texels_of_points(view, low, high);
  const int2 first = max(box.xy, 0), last = min(box.zw, (int2)((int)view.width_px, (int)view.height_px) - 1);
  if (first.x > last.x || first.y > last.y) return (ushort4)(0);
  const int step = (int)shape.tile_step;
  const int2 overlap = HS_TILE - step, tiles = (int2)((int)shape.tiles_x, (int)shape.tiles_y);
  return convert_ushort4((int4)(max(first - overlap, 0) / step, min(last / step + 1, tiles)));
}
