#include "passes/receiver_view.hpp"

#include <algorithm>

#include "light/light_model.hpp"
#include "light/samples.hpp"

namespace halfshade {

HsReceiverView receiver_view(const Camera& scene_camera, glm::uvec2 resolution, bool has_depth, double tolerance,
                             const Light& light, const LightView& fitted) {
  Camera camera = scene_camera;
  camera.resolution = resolution;
  const Frustum from = camera_frustum(camera);
  const glm::dmat4 light_from_view = fitted.frustum.view_from_world * glm::inverse(from.view_from_world);
  const double q_per_px = 2.0 * from.tan_half_y / camera.resolution.y;
  const auto direction = [&](double x, double y, double z) {
    const glm::dvec4 h = light_from_view * glm::dvec4(x, y, z, 0.0);
    return float4_of(glm::dvec3(h), h.w);
  };

  HsReceiverView view{};
  view.ray0 = direction(-from.tan_half_x + 0.5 * q_per_px, from.tan_half_y - 0.5 * q_per_px, 1.0);
  view.ray_dx = direction(q_per_px, 0.0, 0.0);
  view.ray_dy = direction(0.0, -q_per_px, 0.0);
  view.origin = float4_of(glm::dvec3(light_from_view[3]), light_from_view[3].w);
  const HsTransform rows = transform_rows(fitted.frustum.view_from_world);
  view.from_world_x = rows.row_x;
  view.from_world_y = rows.row_y;
  view.from_world_z = rows.row_z;
  view.from_world_w = rows.row_w;
  const LightModel& model = model_of(light.type);
  view.axis_ws = float4_of(row_of(light_axes(light), 2), model.is_projective ? 0.0 : 1.0);
  view.unit = static_cast<float>(fitted.unit);
  if (has_depth) {
    // Rasterizers snap vertices to grids of 1/256 pixel.
    view.error_per_distance = static_cast<float>(q_per_px) / 256.0f / view.unit;
  } else if (tolerance <= 0.0) {
    // Positions as renderers store them lie up to 6e-6 of their depth off their surface, and those of coarse pictures a 256th of
    // a pixel. How far from their camera that is nobody knows here, so the light's distance stands for it, or the scene's extent
    // along the light.
    const double stored_error = std::max(1e-5, 1.0 / (128.0 * resolution.y));
    if (model.is_projective)
      view.error = static_cast<float>(stored_error);
    else
      view.error_per_distance = static_cast<float>(stored_error);
  }
  if (tolerance > 0.0) view.error = static_cast<float>(tolerance / fitted.unit);
  view.is_face = model.has_faces();
  view.width_px = camera.resolution.x;
  view.height_px = camera.resolution.y;
  view.has_depth = has_depth;
  view.tan_half_cone = static_cast<float>(fitted.frustum.tan_half_x);
  return view;
}

HsReceiverView shade_view(const Camera& scene_camera, glm::uvec2 resolution, bool has_depth) {
  Camera camera = scene_camera;
  camera.resolution = resolution;
  const Frustum from = camera_frustum(camera);
  const glm::dmat3 world_from_view = glm::transpose(glm::dmat3(from.view_from_world));
  const double q_per_px = 2.0 * from.tan_half_y / camera.resolution.y;
  HsReceiverView view{};
  const double unit = camera_unit(camera);
  const auto direction = [&](double x, double y, double z) { return float4_of(world_from_view * glm::dvec3(x, y, z) / unit); };
  view.ray0 = direction(-from.tan_half_x + 0.5 * q_per_px, from.tan_half_y - 0.5 * q_per_px, 1.0);
  view.ray_dx = direction(q_per_px, 0.0, 0.0);
  view.ray_dy = direction(0.0, -q_per_px, 0.0);
  view.origin = float4_of(-camera.position / unit);
  view.unit = static_cast<float>(unit);
  view.width_px = camera.resolution.x;
  view.height_px = camera.resolution.y;
  view.has_depth = has_depth;
  return view;
}

HsShadeLight shade_light(const Camera& camera, const Light& light) {
  const LightModel& model = model_of(light.type);
  const glm::dvec4 centre = model.centre(light, camera.position);
  const glm::dmat4 light_from_world = light_axes(faces_of(light).front());
  HsShadeLight shade{};
  shade.position_ws = float4_of(glm::dvec3(centre) / (centre.w != 0.0 ? camera_unit(camera) : 1.0), centre.w);
  shade.color = float4_of(glm::dvec3(light.color) * light.intensity * mean_color(light));
  shade.tint_plane = -1;
  shade.from_camera_x = float4_of(row_of(light_from_world, 0));
  shade.from_camera_y = float4_of(row_of(light_from_world, 1));
  shade.from_camera_z = float4_of(row_of(light_from_world, 2));
  shade.tan_half_cone = static_cast<float>(model.tan_half_cone(light));
  return shade;
}

}  // namespace halfshade
