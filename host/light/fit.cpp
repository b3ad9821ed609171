#include "light/fit.hpp"

#include <algorithm>
#include <cmath>

#include "light/light_model.hpp"

namespace halfshade {
namespace {

/// A rectangle of the light map, in q = (x/z, y/z).
struct Area {
  glm::dvec2 low, high;
  bool is_empty() const { return low.x >= high.x || low.y >= high.y; }
};

/// True for a flat mesh (a floor, a wall) that has all of the light on one side and no receiver on the other: it casts on
/// nothing, however much of the light's cone it fills. `lit`: the meshes in the light's cone.
bool casts_on_nothing(const Light& light, const std::vector<PlacedMesh>& meshes, const std::vector<std::uint32_t>& lit,
                      std::uint32_t flat) {
  const PlacedMesh& mesh = meshes[flat];
  const glm::dvec3 extent = mesh.bounds.high - mesh.bounds.low;
  const int axis = extent.x <= 0.0 ? 0 : extent.y <= 0.0 ? 1 : extent.z <= 0.0 ? 2 : -1;
  if (axis < 0) return false;
  const glm::dmat4 light_from_world = light_axes(light), light_from_mesh = light_from_world * mesh.world_from_local;
  const glm::dvec3 along0 = light_from_mesh[(axis + 1) % 3], along1 = light_from_mesh[(axis + 2) % 3];
  const glm::dvec3 anchor = light_from_mesh * glm::dvec4(mesh.bounds.low, 1.0);
  glm::dvec3 normal = glm::cross(along0, along1);
  const glm::dvec3 from_light = model_of(light.type).is_projective ? glm::dvec3(0.0, 0.0, 1.0) : anchor;
  if (glm::dot(normal, from_light) > 0.0) normal = -normal;  // towards the light
  if (-glm::dot(normal, from_light) <= disc_radius(light) * glm::length(glm::dvec2(normal))) return false;
  const double size = glm::length(glm::dvec3(light_from_mesh * glm::dvec4(mesh.bounds.high, 1.0)) - anchor);
  const double slack = 1e-3 * glm::length(normal) * size;  // things that stand on it may sink in by rounding
  for (const std::uint32_t other : lit) {
    if (other == flat || !meshes[other].receives_shadow) continue;
    const glm::dmat4 light_from_other = light_from_world * meshes[other].world_from_local;
    for (int i = 0; i < 8; ++i)
      if (glm::dot(normal, glm::dvec3(light_from_other * glm::dvec4(corner_of(meshes[other].bounds, i), 1.0)) - anchor) < -slack)
        return false;
  }
  return true;
}

/// Bounds of all receivers in the light's cone; z_high is at least 0.
ViewBounds bounds_of_receivers(const Frustum& frustum, const std::vector<PlacedMesh>& meshes,
                               const std::vector<std::uint32_t>& lit) {
  ViewBounds receiving;
  receiving.z_high = 0.0;
  for (const std::uint32_t i : lit) {
    if (!meshes[i].receives_shadow) continue;
    const ViewBounds bounds = bounds_in_view(frustum, meshes[i]);
    receiving.z_high = std::max(receiving.z_high, bounds.z_high);
    receiving.include(bounds);
  }
  return receiving;
}

/// Extends the bounds of a caster by the penumbra that it casts on what is as far as `farthest`.
void widen_by_penumbra(ViewBounds& bounds, const Light& light, double farthest) {
  if (bounds.z_low <= 0.0) return;  // unbounded
  const glm::dvec2 outermost = glm::max(glm::abs(bounds.q_low), glm::abs(bounds.q_high));
  const double stretch = model_of(light.type).is_sphere ? std::sqrt(1.0 + glm::dot(outermost, outermost)) : 1.0;
  const double widest = disc_radius(light) * stretch * (1.0 / bounds.z_low - 1.0 / farthest);
  bounds.q_low -= widest;
  bounds.q_high += widest;
}

/// Sets the casters of `fitted` and casters_znear: what lies nearer than some receiver, with its penumbra in the light's cone.
/// Returns the bounds of q of casters and penumbrae.
ViewBounds find_casters(const Light& light, const std::vector<PlacedMesh>& meshes, const std::vector<std::uint32_t>& lit,
                        double farthest, LightView& fitted) {
  const double cone = fitted.frustum.tan_half_x;
  ViewBounds casting;
  fitted.casters_znear = 1e300;
  for (std::uint32_t i = 0; i < meshes.size(); ++i) {
    ViewBounds bounds = bounds_in_view(fitted.frustum, meshes[i]);
    if (!meshes[i].casts_shadow || bounds.z_high <= 0.0 || bounds.z_low >= farthest) continue;
    widen_by_penumbra(bounds, light, farthest);
    if (!overlap(bounds, glm::dvec2(-cone), glm::dvec2(cone)) || casts_on_nothing(light, meshes, lit, i)) continue;
    casting.include(bounds);
    fitted.casters_znear = std::min(fitted.casters_znear, bounds.z_low * 0.999);
    fitted.casters.push_back(i);
  }
  return casting;
}

/// Half the width of all that look-ups may read: the cone, and of a face a border. Receivers at a face's border read a texel
/// beyond it, a search as far as penumbrae may reach.
double half_width_with_border(const Light& light, const LightView& fitted, double farthest, unsigned resolution_px,
                              bool searched) {
  if (!model_of(light.type).has_faces()) return fitted.frustum.tan_half_x;
  double beyond = 8.0 / std::max(8u, resolution_px);
  if (searched)
    beyond += std::clamp(std::sqrt(3.0) * disc_radius(light) / std::max(fitted.casters_znear, 0.05 * farthest), 0.0, 1.0);
  return fitted.frustum.tan_half_x + beyond;
}

/// Sets what is drawn into the map, and znear and zfar: about casters, and what else lies in the area.
void find_drawn(const std::vector<PlacedMesh>& meshes, const Area& area, double farthest, LightView& fitted) {
  double z_low = 1e300, z_high = farthest;
  for (std::uint32_t i = 0; i < meshes.size(); ++i) {
    const ViewBounds bounds = bounds_in_view(fitted.frustum, meshes[i]);
    const bool casts = std::ranges::binary_search(fitted.casters, i);
    if (!casts && !(bounds.z_high > 0.0 && overlap(bounds, area.low, area.high))) continue;
    z_high = std::max(z_high, bounds.z_high);
    if (!meshes[i].casts_shadow) continue;
    fitted.drawn.push_back(i);
    z_low = std::min(z_low, bounds.z_low);
  }
  fitted.zfar = z_high * 1.001;
  fitted.znear = std::max(z_low * 0.999, fitted.zfar * 1e-4);
  // Where a caster passes through the light's plane its depth says nothing: a search as wide as 1/z asks for would step over all.
  fitted.casters_znear = std::max(fitted.casters_znear, fitted.casters_znear > 0.0 ? fitted.znear : 0.05 * fitted.zfar);
}

/// Lays the texel grid over the area: sets the view and what places the map.
void place_texels(const Area& area, unsigned resolution_px, unsigned tile_px, LightView& fitted) {
  // The step between texel sizes, and the texel that snapping the corner can cost, are paid for by rounding up.
  // A map has at least two texels a side: look-ups read pairs.
  const double usable_px = std::max(1.0, static_cast<double>(resolution_px) - 2.0);
  const glm::dvec2 extent = area.high - area.low;
  const double texel = std::exp2(std::ceil(std::log2(std::max(extent.x, extent.y) / usable_px) * 8.0) / 8.0);
  const glm::dvec2 corner{std::floor(area.low.x / texel) * texel, std::ceil(area.high.y / texel) * texel};
  const glm::uvec2 size_px =
      glm::clamp(glm::uvec2(std::ceil((area.high.x - corner.x) / texel), std::ceil((corner.y - area.low.y) / texel)),
                 glm::uvec2(2), glm::uvec2(std::max(2u, resolution_px)));
  if (fitted.is_projective) {
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
  fitted.view.znear = static_cast<float>(fitted.znear);
  fitted.view.d_far = static_cast<float>(1.0 / fitted.zfar);
}

}  // namespace

LightView fit_light_view(const Light& light, const std::vector<PlacedMesh>& meshes, unsigned resolution_px, unsigned tile_px,
                         bool searched) {
  LightView fitted;
  model_of(light.type).place(light, meshes, fitted);

  // A shadow falls where the light cone, the casters widened by their penumbrae, and the receivers overlap.
  const std::vector<std::uint32_t> lit = meshes_in_view(fitted.frustum, meshes, 0.0, 1e300);
  const ViewBounds receiving = bounds_of_receivers(fitted.frustum, meshes, lit);
  const double farthest = receiving.z_high;
  const ViewBounds casting = find_casters(light, meshes, lit, farthest, fitted);
  const glm::dvec2 border(half_width_with_border(light, fitted, farthest, resolution_px, searched));
  const Area area{glm::max(glm::max(casting.q_low, receiving.q_low), -border),
                  glm::min(glm::min(casting.q_high, receiving.q_high), border)};
  if (fitted.casters.empty() || area.is_empty()) {
    fitted.casters.clear();
    return fitted;
  }
  find_drawn(meshes, area, farthest, fitted);
  place_texels(area, resolution_px, tile_px, fitted);
  return fitted;
}

HsView whole_cone_view(const LightView& fitted) {
  const Frustum& frustum = fitted.frustum;
  return base_view(frustum, 1.0 / frustum.tan_half_x, {-frustum.tan_half_x, frustum.tan_half_x}, {2, 2}, 2);
}

}  // namespace halfshade
