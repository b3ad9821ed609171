// Everything here is double precision; kernels receive the rounded results, relative to the view's own origin.
#include "light_view.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

#include "light_samples.hpp"

namespace halfshade {

// Host and device must agree about every struct (a test asks the device for its own sizes).
static_assert(sizeof(HsBlock) == 16);
static_assert(sizeof(HsTransform) == 64);
static_assert(sizeof(HsView) == 96 && offsetof(HsView, znear) == 64);
static_assert(sizeof(HsFeature) == 32);
static_assert(sizeof(HsFinShape) == 32);
static_assert(sizeof(HsLayers) == 16);
static_assert(sizeof(HsStatus) == 16);
static_assert(sizeof(HsReceiverView) == 176 && offsetof(HsReceiverView, width_px) == 144);
static_assert(sizeof(HsShadeLight) == 96);
static_assert(sizeof(HsDisc) == 40);

namespace {

/// The tangent of half of a cone that has no border.
constexpr double everywhere = 1e15;

cl_float4 float4_of(const glm::dvec3& v, double w = 0.0) {
  return {{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z), static_cast<float>(w)}};
}

glm::dvec3 row_of(const glm::dmat4& m, int row) {
  return {m[0][row], m[1][row], m[2][row]};
}

glm::dmat4 look_along(const glm::dvec3& position, const glm::dvec3& axis, const glm::dvec3& up) {
  const glm::dvec3 z = glm::normalize(axis);
  const glm::dvec3 x = glm::normalize(glm::cross(z, up));
  const glm::dvec3 y = glm::cross(x, z);
  glm::dmat4 view(1.0);
  for (int i = 0; i < 3; ++i) {
    view[i][0] = x[i];
    view[i][1] = y[i];
    view[i][2] = z[i];
  }
  view[3] = glm::dvec4(-glm::dot(x, position), -glm::dot(y, position), -glm::dot(z, position), 1.0);
  return view;
}

/// A point as a view sees it.
glm::dvec3 in_view(const glm::dmat4& view, const glm::dvec3& p) {
  const glm::dvec4 h = view * glm::dvec4(p, 1.0);
  return glm::dvec3(h) / h.w;
}

glm::dvec3 corner_of(const Bounds& bounds, int i) {
  return {i & 1 ? bounds.high.x : bounds.low.x, i & 2 ? bounds.high.y : bounds.low.y, i & 4 ? bounds.high.z : bounds.low.z};
}

/// Bounds of a placed mesh in a view: of q = (x/z, y/z) where it lies before the view's plane.
struct ViewBounds {
  glm::dvec2 q_low{1e300}, q_high{-1e300};
  double z_low = 1e300, z_high = -1e300;
};

bool overlap(const ViewBounds& bounds, const glm::dvec2& low, const glm::dvec2& high) {
  return bounds.q_high.x >= low.x && bounds.q_low.x <= high.x && bounds.q_high.y >= low.y && bounds.q_low.y <= high.y;
}

ViewBounds bounds_in_view(const Frustum& frustum, const PlacedMesh& mesh) {
  const glm::dmat4 view_from_mesh = frustum.view_from_world * mesh.world_from_mesh;
  ViewBounds bounds;
  for (int i = 0; i < 8; ++i) {
    const glm::dvec3 p = in_view(view_from_mesh, corner_of(mesh.bounds, i));
    bounds.z_low = std::min(bounds.z_low, p.z);
    bounds.z_high = std::max(bounds.z_high, p.z);
    if (p.z > 0.0) {
      bounds.q_low = glm::min(bounds.q_low, glm::dvec2(p) / p.z);
      bounds.q_high = glm::max(bounds.q_high, glm::dvec2(p) / p.z);
    }
  }
  if (bounds.z_low <= 0.0) {  // it reaches behind the plane: its projection is unbounded
    bounds.q_low = glm::dvec2(-1e300);
    bounds.q_high = glm::dvec2(1e300);
  }
  return bounds;
}

HsView base_view(const Frustum& frustum, double px_per_q, const glm::dvec2& top_left_q, glm::uvec2 size_px, unsigned tile_px) {
  HsView view{};
  view.px_from_q = {{static_cast<float>(px_per_q), static_cast<float>(-top_left_q.x * px_per_q), static_cast<float>(-px_per_q),
                     static_cast<float>(top_left_q.y * px_per_q)}};
  view.world_from_view_x = float4_of(row_of(frustum.view_from_world, 0));
  view.world_from_view_y = float4_of(row_of(frustum.view_from_world, 1));
  view.world_from_view_z = float4_of(row_of(frustum.view_from_world, 2));
  view.width_px = size_px.x;
  view.height_px = size_px.y;
  view.tiles_x = (size_px.x + tile_px - 1) / tile_px;
  view.tiles_y = (size_px.y + tile_px - 1) / tile_px;
  view.mid_x_px = size_px.x / 2;
  view.mid_y_px = size_px.y / 2;
  return view;
}

}  // namespace

glm::dmat4 world_from_mesh(const SceneMesh& mesh) {
  glm::dmat4 m = glm::translate(glm::dmat4(1.0), mesh.translation);
  m = glm::rotate(m, glm::radians(mesh.rotation_deg.z), glm::dvec3(0, 0, 1));
  m = glm::rotate(m, glm::radians(mesh.rotation_deg.y), glm::dvec3(0, 1, 0));
  m = glm::rotate(m, glm::radians(mesh.rotation_deg.x), glm::dvec3(1, 0, 0));
  m = glm::scale(m, mesh.scale);
  return glm::translate(m, mesh.mesh->origin);
}

Frustum camera_frustum(const Camera& camera) {
  Frustum frustum;
  frustum.view_from_world = look_along(camera.position, camera.target - camera.position, camera.up);
  frustum.tan_half_y = std::tan(glm::radians(camera.yfov_deg) / 2);
  frustum.tan_half_x = frustum.tan_half_y * camera.resolution.x / camera.resolution.y;
  return frustum;
}

std::vector<Light> faces_of(const Light& light) {
  if (light.type != LightType::point) return {light};
  std::vector<Light> faces(6, light);
  for (int i = 0; i < 6; ++i) {
    glm::dvec3 axis(0.0);
    axis[i / 2] = i % 2 == 0 ? 1.0 : -1.0;
    faces[i].target = light.position + axis;
    faces[i].up.reset();
    faces[i].cone_deg = 90.0;
  }
  return faces;
}

glm::dmat4 light_axes(const Light& light) {
  const bool is_directional = light.type == LightType::directional;
  const glm::dvec3 axis = glm::normalize(is_directional ? light.direction : light.target - light.position);
  // Up is world +Y, or +Z where the axis is within 8 degrees of Y.
  const glm::dvec3 up =
      light.up ? *light.up : (std::abs(axis.y) > std::cos(glm::radians(8.0)) ? glm::dvec3(0, 0, 1) : glm::dvec3(0, 1, 0));
  return look_along(is_directional ? glm::dvec3(0.0) : light.position, axis, up);
}

Frustum light_frustum(const Light& light) {
  const double tan_half = std::tan(glm::radians(light.cone_deg) / 2);
  return {light_axes(light), tan_half, tan_half};
}

Frustum directional_frustum(const Light& light, double horizon, double unit) {
  glm::dmat4 project(0.0);  // columns of (x, y, unit) / (horizon - z), both divided by the unit
  project[0][0] = project[1][1] = 1.0 / unit;
  project[3][2] = 1.0;
  project[2][3] = -1.0 / unit;
  project[3][3] = horizon / unit;
  return {project * light_axes(light), everywhere, everywhere};
}

double disc_radius(const Light& light) {
  if (light.type == LightType::directional) return std::tan(glm::radians(light.angular_radius_deg));
  return light.shape == LightShape::rectangle ? glm::length(light.size) / 2.0 : light.radius;
}

HsView camera_view(const Camera& camera, unsigned tile_px) {
  const Frustum frustum = camera_frustum(camera);
  const double px_per_q = camera.resolution.y / (2.0 * frustum.tan_half_y);
  HsView view = base_view(frustum, px_per_q, {-frustum.tan_half_x, frustum.tan_half_y}, camera.resolution, tile_px);
  view.znear = static_cast<float>(camera.znear);
  view.d_far = static_cast<float>(1.0 / camera.zfar);
  return view;
}

std::vector<std::uint32_t> meshes_in_view(const Frustum& frustum, const std::vector<PlacedMesh>& meshes, double znear,
                                          double zfar) {
  std::vector<std::uint32_t> seen;
  for (std::uint32_t i = 0; i < meshes.size(); ++i) {
    const ViewBounds bounds = bounds_in_view(frustum, meshes[i]);
    if (bounds.z_high >= znear && bounds.z_low <= zfar &&
        overlap(bounds, {-frustum.tan_half_x, -frustum.tan_half_y}, {frustum.tan_half_x, frustum.tan_half_y}))
      seen.push_back(i);
  }
  return seen;
}

/// True for a flat mesh (a floor, a wall) that has all of the light on one side and no receiver on the other: it casts on
/// nothing, however much of the light's cone it fills.
bool casts_on_nothing(const Light& light, const std::vector<PlacedMesh>& meshes, const std::vector<std::uint32_t>& lit,
                      std::uint32_t flat) {
  const PlacedMesh& mesh = meshes[flat];
  const glm::dvec3 extent = mesh.bounds.high - mesh.bounds.low;
  const int axis = extent.x <= 0.0 ? 0 : extent.y <= 0.0 ? 1 : extent.z <= 0.0 ? 2 : -1;
  if (axis < 0) return false;
  const glm::dmat4 light_from_world = light_axes(light), light_from_mesh = light_from_world * mesh.world_from_mesh;
  const glm::dvec3 along0 = light_from_mesh[(axis + 1) % 3], along1 = light_from_mesh[(axis + 2) % 3];
  const glm::dvec3 anchor = light_from_mesh * glm::dvec4(mesh.bounds.low, 1.0);
  glm::dvec3 normal = glm::cross(along0, along1);
  const glm::dvec3 from_light = light.type == LightType::directional ? glm::dvec3(0.0, 0.0, 1.0) : anchor;
  if (glm::dot(normal, from_light) > 0.0) normal = -normal;  // towards the light
  if (-glm::dot(normal, from_light) <= disc_radius(light) * glm::length(glm::dvec2(normal))) return false;
  const double size = glm::length(glm::dvec3(light_from_mesh * glm::dvec4(mesh.bounds.high, 1.0)) - anchor);
  const double slack = 1e-3 * glm::length(normal) * size;  // things that stand on it may sink in by rounding
  for (const std::uint32_t other : lit) {
    if (other == flat || !meshes[other].receives_shadow) continue;
    const glm::dmat4 light_from_other = light_from_world * meshes[other].world_from_mesh;
    for (int i = 0; i < 8; ++i)
      if (glm::dot(normal, glm::dvec3(light_from_other * glm::dvec4(corner_of(meshes[other].bounds, i), 1.0)) - anchor) < -slack)
        return false;
  }
  return true;
}

LightView fit_light_view(const Light& light, const std::vector<PlacedMesh>& meshes, unsigned resolution_px, unsigned tile_px,
                         bool searched) {
  LightView fitted;
  if (light.type == LightType::directional) {
    // As deep again behind the scene as it is deep, so that 1/z' changes no more than twofold over it. Its unit is a power of
    // two: the texel grid stays where it is as things move.
    double low = 1e300, high = -1e300;
    const glm::dmat4 light_from_world = light_axes(light);
    for (const PlacedMesh& mesh : meshes)
      for (int i = 0; i < 8; ++i) {
        const double z = in_view(light_from_world * mesh.world_from_mesh, corner_of(mesh.bounds, i)).z;
        low = std::min(low, z);
        high = std::max(high, z);
      }
    const double depth = meshes.empty() ? 1.0 : std::max(high - low, 1e-6 * std::max({std::abs(high), std::abs(low), 1e-30}));
    fitted.horizon = meshes.empty() ? 1.0 : high + depth;
    fitted.unit = std::exp2(std::ceil(std::log2(2.0 * depth)));
    fitted.frustum = directional_frustum(light, fitted.horizon, fitted.unit);
  } else {
    fitted.frustum = light_frustum(light);
  }
  const double cone = fitted.frustum.tan_half_x, radius = disc_radius(light);
  const bool is_face = light.type == LightType::point;

  // A shadow falls where the light cone, the casters widened by their penumbrae, and the receivers overlap.
  const std::vector<std::uint32_t> lit = meshes_in_view(fitted.frustum, meshes, 0.0, 1e300);
  double farthest = 0.0;
  ViewBounds casting, receiving;
  fitted.casters_znear = 1e300;
  for (const std::uint32_t i : lit) {
    if (!meshes[i].receives_shadow) continue;
    const ViewBounds bounds = bounds_in_view(fitted.frustum, meshes[i]);
    farthest = std::max(farthest, bounds.z_high);
    receiving.q_low = glm::min(receiving.q_low, bounds.q_low);
    receiving.q_high = glm::max(receiving.q_high, bounds.q_high);
  }
  for (std::uint32_t i = 0; i < meshes.size(); ++i) {
    ViewBounds bounds = bounds_in_view(fitted.frustum, meshes[i]);
    if (!meshes[i].casts_shadow || bounds.z_high <= 0.0 || bounds.z_low >= farthest) continue;
    if (bounds.z_low > 0.0) {
      const glm::dvec2 outermost = glm::max(glm::abs(bounds.q_low), glm::abs(bounds.q_high));
      const double stretch = is_face ? std::sqrt(1.0 + glm::dot(outermost, outermost)) : 1.0;
      const double widest = radius * stretch * (1.0 / bounds.z_low - 1.0 / farthest);
      bounds.q_low -= widest;
      bounds.q_high += widest;
    }
    if (!overlap(bounds, glm::dvec2(-cone), glm::dvec2(cone)) || casts_on_nothing(light, meshes, lit, i)) continue;
    casting.q_low = glm::min(casting.q_low, bounds.q_low);
    casting.q_high = glm::max(casting.q_high, bounds.q_high);
    fitted.casters_znear = std::min(fitted.casters_znear, bounds.z_low * 0.999);
    fitted.casters.push_back(i);
  }
  // Look-ups of receivers at a face's border read a texel beyond it, a search as far as penumbrae may reach.
  double beyond = is_face ? 8.0 / std::max(8u, resolution_px) : 0.0;
  if (is_face && searched)
    beyond += std::clamp(std::sqrt(3.0) * radius / std::max(fitted.casters_znear, 0.05 * farthest), 0.0, 1.0);
  const glm::dvec2 border(cone + beyond);
  const glm::dvec2 low = glm::max(glm::max(casting.q_low, receiving.q_low), -border);
  const glm::dvec2 high = glm::min(glm::min(casting.q_high, receiving.q_high), border);
  if (fitted.casters.empty() || low.x >= high.x || low.y >= high.y) {
    fitted.casters.clear();
    return fitted;
  }
  double z_low = 1e300, z_high = farthest;
  for (std::uint32_t i = 0; i < meshes.size(); ++i) {
    const ViewBounds bounds = bounds_in_view(fitted.frustum, meshes[i]);
    const bool casts = std::ranges::binary_search(fitted.casters, i);
    if (!casts && !(bounds.z_high > 0.0 && overlap(bounds, low, high))) continue;
    z_high = std::max(z_high, bounds.z_high);
    if (!meshes[i].casts_shadow) continue;
    fitted.drawn.push_back(i);
    z_low = std::min(z_low, bounds.z_low);
  }

  // The step between texel sizes, and the texel that snapping the corner can cost, are paid for by rounding up.
  // A map has at least two texels a side: look-ups read pairs.
  const double usable_px = std::max(1.0, static_cast<double>(resolution_px) - 2.0);
  const glm::dvec2 extent = high - low;
  const double texel = std::exp2(std::ceil(std::log2(std::max(extent.x, extent.y) / usable_px) * 8.0) / 8.0);
  const glm::dvec2 corner{std::floor(low.x / texel) * texel, std::ceil(high.y / texel) * texel};
  const glm::uvec2 size_px = glm::clamp(glm::uvec2(std::ceil((high.x - corner.x) / texel), std::ceil((corner.y - low.y) / texel)),
                                        glm::uvec2(2), glm::uvec2(std::max(2u, resolution_px)));

  if (light.type == LightType::directional) {
    // Relative to the corner, however far from the world's origin that is.
    glm::dmat4 to_corner(1.0);
    to_corner[2][0] = -corner.x;
    to_corner[2][1] = -corner.y;
    fitted.frustum.view_from_world = to_corner * fitted.frustum.view_from_world;
    fitted.view = base_view(fitted.frustum, 1.0 / texel, glm::dvec2(0.0), size_px, tile_px);
  } else {
    fitted.view = base_view(fitted.frustum, 1.0 / texel, corner, size_px, tile_px);
  }
  fitted.lm_from_px_scale = texel;
  fitted.lm_from_px_origin = corner;
  fitted.zfar = z_high * 1.001;
  fitted.znear = std::max(z_low * 0.999, fitted.zfar * 1e-4);
  // Where a caster passes through the light's plane its depth says nothing: a search as wide as 1/z asks for would step over all.
  fitted.casters_znear = std::max(fitted.casters_znear, fitted.casters_znear > 0.0 ? fitted.znear : 0.05 * fitted.zfar);
  fitted.view.znear = static_cast<float>(fitted.znear);
  fitted.view.d_far = static_cast<float>(1.0 / fitted.zfar);
  return fitted;
}

cl_uint hidden_faces(const PlacedMesh& mesh, const glm::dmat4& view_from_world, double znear) {
  const glm::dmat4 view_from_mesh = view_from_world * mesh.world_from_mesh;
  for (int i = 0; i < 8; ++i)
    if (in_view(view_from_mesh, corner_of(mesh.bounds, i)).z <= znear * 1.001) return HS_CULL_NONE;
  // Views are left-handed and pixel rows count downwards, so that an outward face has negative area in pixels where the mesh is
  // not mirrored: counter-clockwise as ever, with y down.
  const double handedness = mesh.orientation * glm::determinant(glm::dmat3(mesh.world_from_mesh));
  return handedness > 0.0 ? HS_CULL_POSITIVE : handedness < 0.0 ? HS_CULL_NEGATIVE : HS_CULL_NONE;
}

/// The radius within which a part of the samples of a unit ball lies, for a density of 1 / sqrt(1 - r^2).
static double sphere_sample_radius(double part) {
  double low = 0.0, high = 1.0;
  for (int i = 0; i < 50; ++i) {
    const double r = (low + high) / 2.0;
    (2.0 / std::numbers::pi * (std::asin(r) - r * std::sqrt(1.0 - r * r)) < part ? low : high) = r;
  }
  return (low + high) / 2.0;
}

Light light_sample(const Light& light, const LightView& fitted, unsigned index, unsigned count) {
  const double golden_angle = std::numbers::pi * (3.0 - std::sqrt(5.0)), angle = golden_angle * index;
  if (light.type != LightType::point)
    return light_at_point(light, fitted, std::sqrt((index + 0.5) / count) * glm::dvec2(std::cos(angle), std::sin(angle)));
  // Of density 1 / sqrt(R^2 - r^2), whose sum along any line through the ball is the same.
  const double height = 1.0 - (2.0 * index + 1.0) / count, width = std::sqrt(1.0 - height * height);
  Light point = light;
  point.position += light.radius * sphere_sample_radius(std::fmod((index + 0.5) * std::numbers::sqrt2, 1.0)) *
                    glm::dvec3(width * std::cos(angle), height, width * std::sin(angle));
  point.radius = 0.0;
  return point;
}

Light light_at_point(const Light& light, const LightView& fitted, const glm::dvec2& at) {
  const double radius = disc_radius(light);
  const glm::dmat4 light_from_world = light_axes(light);
  const glm::dvec3 up = row_of(light_from_world, 1);
  const glm::dvec3 offset = radius * (row_of(light_from_world, 0) * at.x + up * at.y);
  Light point = light;
  // A point s of the sun's disc is where direction -(s, -1) leads.
  point.direction = row_of(light_from_world, 2) - offset;
  point.angular_radius_deg = 0.0;
  point.position += offset;
  point.target += offset;
  point.up = up;
  point.radius = 0.0;
  point.shape = LightShape::disc;
  point.texture.reset();
  point.cone_deg = 2.0 * glm::degrees(std::atan(fitted.frustum.tan_half_x + radius / fitted.znear));
  return point;
}

HsView whole_cone_view(const LightView& fitted) {
  const Frustum& frustum = fitted.frustum;
  return base_view(frustum, 1.0 / frustum.tan_half_x, {-frustum.tan_half_x, frustum.tan_half_x}, {2, 2}, 2);
}

HsTransform transform_rows(const glm::dmat4& m) {
  return {float4_of(row_of(m, 0), m[3][0]), float4_of(row_of(m, 1), m[3][1]), float4_of(row_of(m, 2), m[3][2]),
          float4_of(row_of(m, 3), m[3][3])};
}

HsReceiverView receiver_view(const Camera& camera, const Light& light, const LightView& fitted, bool has_depth) {
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
  const bool is_directional = light.type == LightType::directional;
  view.axis_ws = float4_of(row_of(light_axes(light), 2) / fitted.unit, is_directional ? 0.0 : 1.0);
  view.unit = static_cast<float>(fitted.unit);
  view.size_per_px = static_cast<float>(q_per_px);
  view.is_face = light.type == LightType::point;
  view.width_px = camera.resolution.x;
  view.height_px = camera.resolution.y;
  view.has_depth = has_depth;
  view.tan_half_cone = static_cast<float>(fitted.frustum.tan_half_x);
  return view;
}

HsReceiverView shade_view(const Camera& camera, bool has_depth) {
  const Frustum from = camera_frustum(camera);
  const glm::dmat3 world_from_view = glm::transpose(glm::dmat3(from.view_from_world));
  const double q_per_px = 2.0 * from.tan_half_y / camera.resolution.y;
  HsReceiverView view{};
  view.ray0 = float4_of(world_from_view * glm::dvec3(-from.tan_half_x + 0.5 * q_per_px, from.tan_half_y - 0.5 * q_per_px, 1.0));
  view.ray_dx = float4_of(world_from_view * glm::dvec3(q_per_px, 0.0, 0.0));
  view.ray_dy = float4_of(world_from_view * glm::dvec3(0.0, -q_per_px, 0.0));
  view.origin = float4_of(-camera.position);
  view.width_px = camera.resolution.x;
  view.height_px = camera.resolution.y;
  view.has_depth = has_depth;
  return view;
}

HsShadeLight shade_light(const Camera& camera, const Light& light) {
  const bool is_directional = light.type == LightType::directional;
  const glm::dmat4 light_from_world = light_axes(faces_of(light).front());
  HsShadeLight shade{};
  shade.position_ws =
      is_directional ? float4_of(-row_of(light_from_world, 2), 0.0) : float4_of(light.position - camera.position, 1.0);
  shade.color = float4_of(glm::dvec3(light.color) * light.intensity * mean_color(light));
  shade.tint_plane = -1;
  shade.from_camera_x = float4_of(row_of(light_from_world, 0));
  shade.from_camera_y = float4_of(row_of(light_from_world, 1));
  shade.from_camera_z = float4_of(row_of(light_from_world, 2));
  shade.tan_half_cone = light.type == LightType::spot ? static_cast<float>(std::tan(glm::radians(light.cone_deg) / 2)) : 0.0f;
  return shade;
}

}  // namespace halfshade
