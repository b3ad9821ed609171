// Deferred shading: ambient and Lambert, every light's visibility applied. No falloff with distance.

#include "base/receiver.h"

// Base colours: a plane, or, where that is null, of the meshes of the faces that are seen.
#define HS_ARGS_SURFACE                                                                            \
  __global const float4 *base_color, __global const uint *faces, __global const uint *face_meshes, \
      __global const float4 *materials

// Pixels as lights see them: position relative to the camera in world axes and the camera's unit, and normal.
typedef struct {
  vint seen;  // there is something
  vfloat x, y, z, nx, ny, nz;
} ShadePoint;

HS_INLINE void load_point(const HsReceiverView camera, HS_ARGS_GBUFFER, int px, int py, int valid, ShadePoint* p) {
  const size_t first = (size_t)py * camera.width_px + px;
  vfloat unused;
  if (camera.has_depth) {
    const vfloat z_vs = load_lanes(depth_or_position, first, valid);
    const vfloat pixel_x = v_float(px + v_iota);
    const float4 row = camera.ray0 + (float)py * camera.ray_dy;
    p->seen = (z_vs > 0.0f) & (z_vs < HS_EMPTY_Z);
    p->x = z_vs * (row.x + pixel_x * camera.ray_dx.x);
    p->y = z_vs * (row.y + pixel_x * camera.ray_dx.y);
    p->z = z_vs * (row.z + pixel_x * camera.ray_dx.z);
  } else {
    vfloat w;
    load_lanes4((__global const float4*)depth_or_position, first, valid, &p->x, &p->y, &p->z, &w);
    p->seen = w > 0.0f;
    const float per_unit = 1.0f / camera.unit;
    p->x = p->x * per_unit + camera.origin.x;
    p->y = p->y * per_unit + camera.origin.y;
    p->z = p->z * per_unit + camera.origin.z;
  }
  load_lanes4(normal, first, valid, &p->nx, &p->ny, &p->nz, &unused);
}

// Linear light of HS_LANES pixels.
typedef struct {
  vfloat red, green, blue;
} Rgb;

// The part of a light that reaches an unshadowed surface: Lambert's cosine, within the cone.
HS_INLINE vfloat received_from(__constant const HsShadeLight* light, const ShadePoint* p) {
  const float4 from = light->position_ws;
  const vfloat lx = from.x - from.w * p->x, ly = from.y - from.w * p->y, lz = from.z - from.w * p->z;
  const vfloat x_ls = -(light->from_camera_x.x * lx + light->from_camera_x.y * ly + light->from_camera_x.z * lz);
  const vfloat y_ls = -(light->from_camera_y.x * lx + light->from_camera_y.y * ly + light->from_camera_y.z * lz);
  const vfloat z_ls = -(light->from_camera_z.x * lx + light->from_camera_z.y * ly + light->from_camera_z.z * lz);
  const vfloat edge = light->tan_half_cone * z_ls;
  const vint no_cone = (vint)(light->tan_half_cone == 0.0f ? -1 : 0);
  const vint in_cone = no_cone | ((z_ls > 0.0f) & (fabs(x_ls) <= edge) & (fabs(y_ls) <= edge));
  const vfloat cosine = (p->nx * lx + p->ny * ly + p->nz * lz) / sqrt(max(lx * lx + ly * ly + lz * lz, 1e-30f));
  return v_select((vfloat)(0.0f), max(cosine, 0.0f), in_cone);
}

// Base colours of pixels from `first` on; `below` is the pixel under the first.
HS_INLINE void load_base_color(HS_ARGS_SURFACE, size_t first, size_t below, int valid, Rgb* base) {
  if (base_color) {
    vfloat unused;
    load_lanes4(base_color, first, valid, &base->red, &base->green, &base->blue, &unused);
    return;
  }
  // Neighbours mostly share a face.
  float4 colors[HS_LANES];
  prefetch((__global const float*)(faces + below));
  uint last = faces[first];
  float4 color = last == 0xffffffffu ? (float4)(0.0f) : materials[face_meshes[last]];
  for (int i = 0; i < HS_LANES; ++i) {
    const uint face = faces[first + min(i, valid - 1)];
    if (face != last) color = face == 0xffffffffu ? (float4)(0.0f) : materials[face_meshes[face]];
    last = face;
    colors[i] = color;
  }
  const float* channels = (const float*)colors;
  base->red = strided_lanes(channels);
  base->green = strided_lanes(channels + 1);
  base->blue = strided_lanes(channels + 2);
}

// rgb: float4 a pixel, linear; w = 1 where something is seen. visibility: light_count planes, one behind the other.
// The base colour is a plane, or comes from the faces' meshes where base_color is null.
// tints: float4 a pixel, plane by plane; see methods/exact.
// Lights are given relative to the camera's position, view rays in world axes from there.
__kernel void shade(const uint light_count, __constant const HsShadeLight* lights, const float4 ambient,
                    const HsReceiverView camera, HS_ARGS_GBUFFER, HS_ARGS_SURFACE, __global const float* visibility,
                    __global const float4* tints, __global float4* rgb) {
  HS_FOR_PIXELS(px, py, valid, camera.width_px, camera.height_px) {
    const size_t first = (size_t)py * camera.width_px + px, below = first + camera.width_px;
    prefetch(depth_or_position + below);
    prefetch_lanes4(normal, below);
    ShadePoint p;
    load_point(camera, depth_or_position, normal, px, py, valid, &p);
    Rgb sum = {(vfloat)(ambient.x), (vfloat)(ambient.y), (vfloat)(ambient.z)};
    for (uint i = 0; i < light_count; ++i) {
      __constant const HsShadeLight* light = lights + i;
      prefetch(visibility + (size_t)camera.width_px * camera.height_px * i + below);
      const vfloat received = received_from(light, &p);
      const vfloat seen_fraction = load_lanes(visibility, (size_t)camera.width_px * camera.height_px * i + first, valid);
      Rgb seen = {seen_fraction, seen_fraction, seen_fraction};
      if (light->tint_plane >= 0) {
        vfloat r, g, b, own;
        load_lanes4(tints, (size_t)camera.width_px * camera.height_px * light->tint_plane + first, valid, &r, &g, &b, &own);
        seen.red = v_select(seen.red, r, own > 0.0f);
        seen.green = v_select(seen.green, g, own > 0.0f);
        seen.blue = v_select(seen.blue, b, own > 0.0f);
      }
      sum.red += light->color.x * (received * seen.red);
      sum.green += light->color.y * (received * seen.green);
      sum.blue += light->color.z * (received * seen.blue);
    }
    Rgb base;
    load_base_color(base_color, faces, face_meshes, materials, first, below, valid, &base);
    const vfloat zero = (vfloat)(0.0f);
    store_lanes4(v_select(zero, sum.red * base.red, p.seen), v_select(zero, sum.green * base.green, p.seen),
                 v_select(zero, sum.blue * base.blue, p.seen), v_select(zero, (vfloat)(1.0f), p.seen), rgb, first, valid);
  }
}
