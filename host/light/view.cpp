#include "light/view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/gtc/matrix_transform.hpp>

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

/// The least sine of the angle between an axis and its up direction.
constexpr double min_up_sine = 1e-6;

bool is_finite(const glm::dvec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace

glm::dvec3 corner_of(const Bounds& bounds, int i) {
  return {i & 1 ? bounds.high.x : bounds.low.x, i & 2 ? bounds.high.y : bounds.low.y, i & 4 ? bounds.high.z : bounds.low.z};
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

glm::dmat4 look_along(const glm::dvec3& position, const glm::dvec3& any_axis, const std::optional<glm::dvec3>& up) {
  const glm::dvec3 axis = glm::normalize(any_axis);
  const bool is_along_y = std::abs(axis.y) > std::cos(glm::radians(8.0));
  return look_along(position, axis, up ? *up : is_along_y ? glm::dvec3(0, 0, 1) : glm::dvec3(0, 1, 0));
}

std::optional<Misfit> misfit_of_axes(const glm::dvec3& axis, const glm::dvec3& up, std::string_view axis_name) {
  if (!is_finite(up)) return Misfit{"up", "finite numbers"};
  const double length = glm::length(axis), up_length = glm::length(up);
  if (std::isfinite(up_length) && up_length > 0.0 && glm::length(glm::cross(axis / length, up / up_length)) > min_up_sine)
    return {};
  return Misfit{"up", fmt::format("a direction that is not along {}", axis_name)};
}

std::optional<Misfit> misfit_of_look(const glm::dvec3& position, const glm::dvec3& target, const std::optional<glm::dvec3>& up) {
  if (!is_finite(position)) return Misfit{"position", "finite numbers"};
  if (!is_finite(target)) return Misfit{"target", "finite numbers"};
  const glm::dvec3 axis = target - position;
  const double length = glm::length(axis);
  if (!std::isfinite(length) || length <= 0.0) return Misfit{"target", "a place away from position, and not out of reach"};
  return up ? misfit_of_axes(axis, *up, "the line from position to target") : std::nullopt;
}

Frustum camera_frustum(const Camera& camera) {
  Frustum frustum;
  frustum.view_from_world = look_along(camera.position, camera.target - camera.position, camera.up);
  frustum.tan_half_y = std::tan(glm::radians(camera.yfov_deg) / 2);
  frustum.tan_half_x = frustum.tan_half_y * camera.resolution.x / camera.resolution.y;
  return frustum;
}

double camera_unit(const Camera& camera) {
  return std::exp2(std::round((std::log2(camera.znear) + std::log2(camera.zfar)) / 2));
}

glm::dmat4 camera_view_from_world(const Camera& camera) {
  return glm::scale(glm::dmat4(1.0), glm::dvec3(1.0 / camera_unit(camera))) * camera_frustum(camera).view_from_world;
}

HsView camera_view(const Camera& camera, unsigned tile_px) {
  const Frustum frustum = camera_frustum(camera);
  const double px_per_q = camera.resolution.y / (2.0 * frustum.tan_half_y);
  HsView view = base_view(frustum, px_per_q, {-frustum.tan_half_x, frustum.tan_half_y}, camera.resolution, tile_px);
  view.znear = static_cast<float>(camera.znear / camera_unit(camera));
  view.d_far = static_cast<float>(camera_unit(camera) / camera.zfar);
  return view;
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

glm::dvec3 in_view(const glm::dmat4& view_from_any, const glm::dvec3& p) {
  const glm::dvec4 h = view_from_any * glm::dvec4(p, 1.0);
  return glm::dvec3(h) / h.w;
}

ViewBounds bounds_in_view(const Frustum& frustum, const PlacedMesh& mesh) {
  const glm::dmat4 view_from_local = frustum.view_from_world * mesh.world_from_local;
  ViewBounds bounds;
  for (int i = 0; i < 8; ++i) {
    const glm::dvec3 p = in_view(view_from_local, corner_of(mesh.bounds, i));
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

bool overlap(const ViewBounds& bounds, const glm::dvec2& low, const glm::dvec2& high) {
  return bounds.q_high.x >= low.x && bounds.q_low.x <= high.x && bounds.q_high.y >= low.y && bounds.q_low.y <= high.y;
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

cl_uint hidden_faces(const PlacedMesh& mesh, const glm::dmat4& view_from_world, double znear) {
  const glm::dmat4 view_from_local = view_from_world * mesh.world_from_local;
  for (int i = 0; i < 8; ++i)
    if (in_view(view_from_local, corner_of(mesh.bounds, i)).z <= znear * 1.001) return HS_CULL_NONE;
  // Views are left-handed and pixel rows count downwards, so that an outward face has negative area in pixels where the mesh is
  // not mirrored: counter-clockwise as ever, with y down.
  const double handedness = mesh.orientation * glm::determinant(glm::dmat3(mesh.world_from_local));
  return handedness > 0.0 ? HS_CULL_POSITIVE : handedness < 0.0 ? HS_CULL_NEGATIVE : HS_CULL_NONE;
}

glm::dvec3 row_of(const glm::dmat4& m, int row) {
  return {m[0][row], m[1][row], m[2][row]};
}

cl_float4 float4_of(const glm::dvec3& v, double w) {
  return {{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z), static_cast<float>(w)}};
}

HsTransform transform_rows(const glm::dmat4& m) {
  return {float4_of(row_of(m, 0), m[3][0]), float4_of(row_of(m, 1), m[3][1]), float4_of(row_of(m, 2), m[3][2]),
          float4_of(row_of(m, 3), m[3][3])};
}

}  // namespace halfshade
