// Deferred shading: ambient and Lambert, every light's visibility applied. No falloff with distance.

// rgb: float4 a pixel, linear; w = 1 where something is seen. visibility: light_count planes, one behind the other.
// The base colour is a plane, or comes from the faces' meshes where base_color is null.
// tints: float4 a pixel, plane by plane; see visibility_exact.cl.
// Lights are given relative to the camera's position, view rays in world axes from there.
__kernel void shade(const uint light_count, __constant const HsShadeLight* lights, const float4 ambient,
                    const HsReceiverView camera, __global const float* depth_or_position, __global const float4* normal,
                    __global const float4* base_color, __global const uint* faces, __global const uint* face_meshes,
                    __global const float4* materials, __global const float* visibility, __global const float4* tints,
                    __global float4* rgb) {
  HS_FOR_PIXELS(px, py, valid, camera.width_px, camera.height_px) {
    const size_t first = (size_t)py * camera.width_px + px, below = first + camera.width_px;
    prefetch(depth_or_position + below);
    prefetch_lanes4(normal, below);
    vfloat x, y, z, nx, ny, nz, unused;
    vint seen;
    if (camera.has_depth) {
      const vfloat z_vs = load_lanes(depth_or_position, first, valid);
      const vfloat pixel_x = v_float(px + v_iota);
      const float4 row = camera.ray0 + (float)py * camera.ray_dy;
      seen = (z_vs > 0.0f) & (z_vs < HS_EMPTY_Z);
      x = z_vs * (row.x + pixel_x * camera.ray_dx.x);
      y = z_vs * (row.y + pixel_x * camera.ray_dx.y);
      z = z_vs * (row.z + pixel_x * camera.ray_dx.z);
    } else {
      vfloat w;
      load_lanes4((__global const float4*)depth_or_position, first, valid, &x, &y, &z, &w);
      seen = w > 0.0f;
      x += camera.origin.x;
      y += camera.origin.y;
      z += camera.origin.z;
    }
    load_lanes4(normal, first, valid, &nx, &ny, &nz, &unused);
    vfloat red = (vfloat)(ambient.x), green = (vfloat)(ambient.y), blue = (vfloat)(ambient.z);
    for (uint i = 0; i < light_count; ++i) {
      __constant const HsShadeLight* light = lights + i;
      prefetch(visibility + (size_t)camera.width_px * camera.height_px * i + below);
      const float4 from = light->position_ws;
      const vfloat lx = from.x - from.w * x, ly = from.y - from.w * y, lz = from.z - from.w * z;
      const vfloat x_ls = -(light->from_camera_x.x * lx + light->from_camera_x.y * ly + light->from_camera_x.z * lz);
      const vfloat y_ls = -(light->from_camera_y.x * lx + light->from_camera_y.y * ly + light->from_camera_y.z * lz);
      const vfloat z_ls = -(light->from_camera_z.x * lx + light->from_camera_z.y * ly + light->from_camera_z.z * lz);
      const vfloat edge = light->tan_half_cone * z_ls;
      const vint no_cone = (vint)(light->tan_half_cone == 0.0f ? -1 : 0);
      const vint in_cone = no_cone | ((z_ls > 0.0f) & (fabs(x_ls) <= edge) & (fabs(y_ls) <= edge));
      const vfloat cosine = (nx * lx + ny * ly + nz * lz) / sqrt(max(lx * lx + ly * ly + lz * lz, 1e-30f));
      const vfloat seen_fraction = load_lanes(visibility, (size_t)camera.width_px * camera.height_px * i + first, valid);
      vfloat seen_red = seen_fraction, seen_green = seen_fraction, seen_blue = seen_fraction;
      if (light->tint_plane >= 0) {
        vfloat r, g, b, own;
        load_lanes4(tints, (size_t)camera.width_px * camera.height_px * light->tint_plane + first, valid, &r, &g, &b, &own);
        seen_red = v_select(seen_red, r, own > 0.0f);
        seen_green = v_select(seen_green, g, own > 0.0f);
        seen_blue = v_select(seen_blue, b, own > 0.0f);
      }
      const vfloat received = v_select((vfloat)(0.0f), max(cosine, 0.0f), in_cone);
      red += light->color.x * (received * seen_red);
      green += light->color.y * (received * seen_green);
      blue += light->color.z * (received * seen_blue);
    }
    vfloat base_red, base_green, base_blue;
    if (base_color) {
      load_lanes4(base_color, first, valid, &base_red, &base_green, &base_blue, &unused);
    } else {
      // Neighbours mostly share a face.
      float4 base[HS_LANES];
      prefetch((__global const float*)(faces + below));
      uint last = faces[first];
      float4 color = last == 0xffffffffu ? (float4)(0.0f) : materials[face_meshes[last]];
      for (int i = 0; i < HS_LANES; ++i) {
        const uint face = faces[first + min(i, valid - 1)];
        if (face != last) color = face == 0xffffffffu ? (float4)(0.0f) : materials[face_meshes[face]];
        last = face;
        base[i] = color;
      }
      const float* channels = (const float*)base;
      base_red = strided_lanes(channels);
      base_green = strided_lanes(channels + 1);
      base_blue = strided_lanes(channels + 2);
    }
    const vfloat zero = (vfloat)(0.0f);
    store_lanes4(v_select(zero, red * base_red, seen), v_select(zero, green * base_green, seen),
                 v_select(zero, blue * base_blue, seen), v_select(zero, (vfloat)(1.0f), seen), rgb, first, valid);
  }
}
