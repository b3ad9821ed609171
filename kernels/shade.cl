// Deferred shading: ambient and Lambert, every light's visibility applied. No falloff with distance.

// rgb: float4 a pixel, linear; w = 1 where something is seen. visibility: light_count planes, one behind the other.
// lights are given relative to the camera's position, view rays in world axes from there.
__kernel void shade(const uint light_count, __global const HsShadeLight* lights, const float4 ambient, const HsReceiverView camera,
                    __global const float* depth_or_position, __global const float4* normal, __global const float4* base_color,
                    __global const float* visibility, __global float4* rgb) {
  const uint px = get_global_id(0), py = get_global_id(1);
  if (px < camera.width_px && py < camera.height_px) {
    const size_t pixel = (size_t)py * camera.width_px + px;
    float3 p;
    bool seen;
    if (camera.has_depth) {
      const float z = depth_or_position[pixel];
      seen = z > 0.0f && z < HS_EMPTY_Z;
      p = z * (camera.ray0.xyz + (float)px * camera.ray_dx.xyz + (float)py * camera.ray_dy.xyz);
    } else {
      const float4 position = ((__global const float4*)depth_or_position)[pixel];
      seen = position.w > 0.0f;
      p = position.xyz + camera.origin.xyz;
    }
    float3 sum = (float3)(0.0f);
    if (seen) {
      const float3 n = normal[pixel].xyz;
      sum = ambient.xyz;
      for (uint i = 0; i < light_count; ++i) {
        const HsShadeLight light = lights[i];
        const float3 to_light = light.position_ws.xyz - p;
        const float4 p_from_light = (float4)(-to_light, 0.0f);
        const float3 p_ls = (float3)(dot(light.from_camera_x, p_from_light), dot(light.from_camera_y, p_from_light),
                                     dot(light.from_camera_z, p_from_light));
        const float edge = light.tan_half_cone * p_ls.z;
        if (p_ls.z > 0.0f && fabs(p_ls.x) <= edge && fabs(p_ls.y) <= edge) {
          const float cosine = dot(n, to_light) * rsqrt(fmax(dot(to_light, to_light), 1e-30f));
          const size_t plane = (size_t)camera.width_px * camera.height_px;
          sum += light.color.xyz * (fmax(cosine, 0.0f) * visibility[plane * i + pixel]);
        }
      }
      sum *= base_color[pixel].xyz;
    }
    rgb[pixel] = (float4)(sum, seen ? 1.0f : 0.0f);
  }
}
