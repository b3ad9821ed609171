// Visibility: G-buffer pixel -> light map -> lookups -> fraction of the light seen.

#pragma once

#include "base/lanes.h"

// The same for the colours of textured lights, float4 a pixel: in xyz, relative to the whole light, how much of each channel is
// seen, where w = 1; where w = 0 it is as much of each, the visibility.
#define HS_ARGS_TINTS __global float4 *tints, const uint tint_plane

// Where results go: float a pixel, one plane behind the other, and which of them is meant.
#define HS_ARGS_VISIBILITY __global float *visibility, const uint plane

// The planes of the G-buffer that look-ups need: float view depth or float4 world position a pixel (HsReceiverView tells
// which), and float4 normals.
#define HS_ARGS_GBUFFER __global const float *depth_or_position, __global const float4 *normal

// What HS_LANES pixels are to a light.
typedef struct {
  vint decided;       // visibility needs no look-up and is `visibility`
  vint elsewhere;     // of these, those that another face of the light outputs for
  vfloat visibility;  // of decided pixels
  vfloat u, v;        // light map position in texels, texel centres at integers
  vfloat z;           // light-space depth
  // The receiver's plane in the light map: 1/z at texel (x, y) is plane_d + plane_dx (x - u) + plane_dy (y - v).
  vfloat plane_d, plane_dx, plane_dy;
  vfloat error_d;  // what 1/z may be wrong by because of the G-buffer
} Receiver;

// How far receivers are from the light, given their places in light space; not of a directional light.
HS_INLINE vfloat distance_from_light(vfloat x, vfloat y, vfloat z) {
  return sqrt(x * x + y * y + z * z);
}

// Normals along the light's right, up and axis.
HS_INLINE void turn_to_light(const HsReceiverView view, vfloat nx_ws, vfloat ny_ws, vfloat nz_ws, vfloat* nx, vfloat* ny,
                             vfloat* nz) {
  *nx = along_axis(view.from_world_x.xyz, nx_ws, ny_ws, nz_ws) * view.unit;
  *ny = along_axis(view.from_world_y.xyz, nx_ws, ny_ws, nz_ws) * view.unit;
  *nz = along_axis(view.axis_ws.xyz, nx_ws, ny_ws, nz_ws);
}

// Pixels (px, py) with depth z_vs, and positions in the world, to light space before the division by w.
HS_INLINE void light_space_of_depth(const HsReceiverView view, vfloat px, vfloat py, vfloat z_vs, vfloat* x, vfloat* y, vfloat* z,
                                    vfloat* w) {
  *x = z_vs * (view.ray0.x + px * view.ray_dx.x + py * view.ray_dy.x) + view.origin.x;
  *y = z_vs * (view.ray0.y + px * view.ray_dx.y + py * view.ray_dy.y) + view.origin.y;
  *z = z_vs * (view.ray0.z + px * view.ray_dx.z + py * view.ray_dy.z) + view.origin.z;
  *w = z_vs * (view.ray0.w + px * view.ray_dx.w + py * view.ray_dy.w) + view.origin.w;
}
HS_INLINE void light_space_of_position(const HsReceiverView view, vfloat x_ws, vfloat y_ws, vfloat z_ws, vfloat* x, vfloat* y,
                                       vfloat* z, vfloat* w) {
  *x = along_axis(view.from_world_x.xyz, x_ws, y_ws, z_ws) + view.from_world_x.w;
  *y = along_axis(view.from_world_y.xyz, x_ws, y_ws, z_ws) + view.from_world_y.w;
  *z = along_axis(view.from_world_z.xyz, x_ws, y_ws, z_ws) + view.from_world_z.w;
  *w = along_axis(view.from_world_w.xyz, x_ws, y_ws, z_ws) + view.from_world_w.w;
}

// Where HS_LANES pixels lie in the light.
typedef struct {
  vint seen;          // there is something
  vfloat x, y, z, w;  // in light space, times w
  vfloat error;       // what the G-buffer may have them wrong by, in light space
  vfloat qx, qy, d;   // light map coordinates, 1/z
  vfloat u, v;        // position in the light map's texels, texel centres at integers
} PixelPlace;

HS_INLINE PixelPlace place_pixels(const HsView light, const HsReceiverView view, int px, int py, int valid,
                                  __global const float* depth_or_position) {
  const size_t first = (size_t)py * view.width_px + px;
  PixelPlace p;
  if (view.has_depth) {
    const vfloat z_vs = load_lanes(depth_or_position, first, valid);
    p.seen = (z_vs > 0.0f) & (z_vs < HS_EMPTY_Z);
    light_space_of_depth(view, v_float(px + v_iota), (vfloat)((float)py), z_vs, &p.x, &p.y, &p.z, &p.w);
    p.error = z_vs * view.error_per_distance + view.error;
  } else {
    vfloat px_ws, py_ws, pz_ws, is_seen;
    load_lanes4((__global const float4*)depth_or_position, first, valid, &px_ws, &py_ws, &pz_ws, &is_seen);
    p.seen = is_seen > 0.0f;
    light_space_of_position(view, px_ws, py_ws, pz_ws, &p.x, &p.y, &p.z, &p.w);
    p.error = distance_from_light(p.x, p.y, p.z) * view.error_per_distance + view.error;
  }
  // Receivers that a directional light's view does not reach, which can only be a caller's own, count as at its end.
  p.w = max(p.w, 1e-20f);
  const vfloat inverse_z = 1.0f / max(p.z, 1e-20f);
  p.d = p.w * inverse_z;
  p.qx = p.x * inverse_z;
  p.qy = p.y * inverse_z;
  p.u = p.qx * light.px_from_q.x + (light.px_from_q.y - 0.5f);
  p.v = p.qy * light.px_from_q.z + (light.px_from_q.w - 0.5f);
  return p;
}

// Where the receivers at pixels (px .., py) stand in the light.
//   nothing there, behind the light plane or outside the cone, or not receiving: visibility 1, or another face's concern
//   turned away from the light: visibility 0
//   outside the light map, which covers all that casts: visibility 1
HS_INLINE Receiver locate(const HsView light, const HsReceiverView view, int px, int py, int valid,
                          __global const float* depth_or_position, __global const float4* normal) {
  const PixelPlace p = place_pixels(light, view, px, py, valid, depth_or_position);
  vfloat nx_ws, ny_ws, nz_ws, receives;
  load_lanes4(normal, (size_t)py * view.width_px + px, valid, &nx_ws, &ny_ws, &nz_ws, &receives);
  vfloat nx, ny, nz;
  turn_to_light(view, nx_ws, ny_ws, nz_ws, &nx, &ny, &nz);

  Receiver r;
  r.z = p.z / p.w;
  r.u = p.u;
  r.v = p.v;
  // n . (light - p), where z of a directional light is 1.
  const vfloat facing = -(view.axis_ws.w * (nx * p.x + ny * p.y) + nz * p.z);
  const vint in_reach = p.seen & (receives > 0.0f);
  const vint in_cone = in_reach & (p.z > 0.0f) & (fabs(p.qx) <= view.tan_half_cone) & (fabs(p.qy) <= view.tan_half_cone);
  r.elsewhere = view.is_face ? in_reach & v_not(in_cone) : (vint)(0);
  const vint in_map =
      (r.u >= -0.5f) & (r.u <= (float)light.width_px - 0.5f) & (r.v >= -0.5f) & (r.v <= (float)light.height_px - 0.5f);
  const vint away = in_cone & (facing <= 0.0f);
  r.decided = v_not(in_cone & in_map) | away;
  r.visibility = v_select((vfloat)(1.0f), (vfloat)(0.0f), away);

  // n . p = n . (q, 1) z is constant on the plane, so 1/z = n . (q, 1) / (n . p): linear in the light map, and of the same slope
  // in a directional light's.
  const vfloat inverse = -1.0f / max(facing, 1e-30f);
  r.plane_d = p.d;
  r.error_d = p.error * (view.axis_ws.w != 0.0f ? p.d * p.d : (vfloat)(1.0f));
  r.plane_dx = nx * inverse * (1.0f / light.px_from_q.x);
  r.plane_dy = ny * inverse * (1.0f / light.px_from_q.z);
  return r;
}

// The automatic bias: a receiver is compared at the texel's centre with the depth of its own plane there, which is what the
// map holds where the receiver lies in it. What remains is rounding (relative 2^-18, and the grids of 1/256 that the vertices of
// the G-buffer and of the map are snapped to), and curvature within a texel, for which a quarter texel of the plane's slope is
// allowed. Near the terminator the plane's slope is unbounded and its 1/z may pass 0: it stays within a factor of two of the
// receiver's own.
HS_INLINE vfloat plane_d_at(const Receiver* r, vfloat du, vfloat dv) {
  const vfloat slack = 0.25f * (fabs(r->plane_dx) + fabs(r->plane_dy)) + r->plane_d * 4e-6f + r->error_d;
  return clamp(r->plane_d + r->plane_dx * du + r->plane_dy * dv + slack, r->plane_d * 0.5f, r->plane_d * 2.0f);
}

// By the map: a surface whose 1/z in a texel is at most the receiver's plane there plus the first is the receiver's own or beyond
// it; one whose 1/z is more than the second stands before it whatever the surface does within two texels.
#define HS_SAME_SURFACE(d, slope) ((slope) * (1.0f / 64.0f) + (d)*4e-6f)
#define HS_CLEARLY_BEFORE(d, slope) ((d)*1.01f + 2.0f * (slope))

// 1 where the receiver is lit according to the texel (x, y), which holds z_map: z <= z_map, as 1 <= z_map / z without a division.
HS_INLINE vfloat is_lit(const Receiver* r, vfloat x, vfloat y, vfloat z_map) {
  return v_select((vfloat)(0.0f), (vfloat)(1.0f), z_map * plane_d_at(r, x - r->u, y - r->v) >= 1.0f);
}

HS_INLINE vfloat lit_at(const HsView light, __global const float* shadow_map, const Receiver* r, vint x, vint y) {
  return is_lit(r, v_float(x), v_float(y), v_gather(shadow_map, y * (int)light.width_px + x));
}

HS_INLINE vint column(const HsView light, vint x) {
  return clamp(x, (vint)(0), (vint)((int)light.width_px - 1));
}
HS_INLINE vint row(const HsView light, vint y) {
  return clamp(y, (vint)(0), (vint)((int)light.height_px - 1));
}

// hard: Williams 1978. The nearest texel decides.
HS_INLINE vfloat visibility_hard(const HsView light, const Receiver* r, __global const float* shadow_map) {
  return lit_at(light, shadow_map, r, column(light, v_int(rint(r->u))), row(light, v_int(rint(r->v))));
}

// The four nearest texels, those of column x and x + 1 in rows y and y + 1 (shifted inwards at the map's borders), and the
// bilinear weights of the second column and row. A light map is at least two texels wide and high.
typedef struct {
  vint x, y;
  vfloat s, t;
} Footprint;

HS_INLINE Footprint footprint_at(const HsView light, vfloat u, vfloat v) {
  const vfloat x = min(max(floor(u), 0.0f), (float)light.width_px - 2.0f);
  const vfloat y = min(max(floor(v), 0.0f), (float)light.height_px - 2.0f);
  const Footprint f = {column(light, v_int(x)), row(light, v_int(y)), min(max(u - x, 0.0f), 1.0f), min(max(v - y, 0.0f), 1.0f)};
  return f;
}
HS_INLINE Footprint footprint(const HsView light, const Receiver* r) {
  return footprint_at(light, r->u, r->v);
}

// Values at the footprint's texels.
typedef struct {
  vfloat v00, v10, v01, v11;
} Taps;

HS_INLINE Taps taps(__global const float* plane, vint first, int width_px) {
  Taps t;
  v_gather_pair(plane, first, &t.v00, &t.v10);
  v_gather_pair(plane, first + width_px, &t.v01, &t.v11);
  return t;
}

HS_INLINE vfloat bilinear(const Footprint* f, const Taps* v) {
  return lerp(lerp(v->v00, v->v10, f->s), lerp(v->v01, v->v11, f->s), f->t);
}

// The comparisons at the footprint's texels: 1 lit, 0 not.
HS_INLINE Taps lit_taps(const HsView light, __global const float* shadow_map, const Receiver* r, const Footprint* f) {
  const Taps z = taps(shadow_map, f->y * (int)light.width_px + f->x, (int)light.width_px);
  const vfloat x = v_float(f->x), y = v_float(f->y);
  const Taps lit = {is_lit(r, x, y, z.v00), is_lit(r, x + 1.0f, y, z.v10), is_lit(r, x, y + 1.0f, z.v01),
                    is_lit(r, x + 1.0f, y + 1.0f, z.v11)};
  return lit;
}

// Stores what this light, or face of it, makes of `valid` pixels from `first` on.
HS_INLINE void store_visibility(const Receiver* r, vfloat result, __global float* visibility, size_t first, int valid) {
  if (v_any(r->elsewhere)) result = v_select(result, load_lanes(visibility, first, valid), r->elsewhere);
  store_lanes(result, visibility, first, valid);
}

// Outputs this work-item's pixels: `body` turns an undecided Receiver r into a visibility.
#define HS_FOR_RECEIVERS(body)                                                                                   \
  HS_FOR_PIXELS(px, py, valid, view.width_px, view.height_px) {                                                  \
    prefetch(depth_or_position + (size_t)(py + 1) * view.width_px + px);                                         \
    prefetch_lanes4(normal, (size_t)(py + 1) * view.width_px + px);                                              \
    const Receiver r = locate(light, view, px, py, valid, depth_or_position, normal);                            \
    vfloat result = r.visibility;                                                                                \
    if (v_any(v_not(r.decided))) result = v_select(body, r.visibility, r.decided);                               \
    store_visibility(&r, result, visibility, ((size_t)plane * view.height_px + py) * view.width_px + px, valid); \
  }

// depth_or_position, normal: planes of the GBuffer; visibility: float a pixel, written whole.
