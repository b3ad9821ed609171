#include "light/fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "light/light_model.hpp"
#include "light/region.hpp"

namespace halfshade {
namespace {

/// A rectangle of the light map.
struct Area {
  glm::dvec2 low{1e300}, high{-1e300};
  bool is_empty() const { return low.x >= high.x || low.y >= high.y; }
  double extent() const { return std::max(high.x - low.x, high.y - low.y); }
};

Area common(const Area& a, const Area& b) {
  return {glm::max(a.low, b.low), glm::min(a.high, b.high)};
}

void include(Area& area, const Area& other) {
  area.low = glm::min(area.low, other.low);
  area.high = glm::max(area.high, other.high);
}

/// Space along a light's right, up and axis, in the scene's unit: from the light, or, where it shines in parallel, from the
/// world's origin. Places in the map are q = (x, y) / z there, or (x, y).
class LightAxes {
 public:
  explicit LightAxes(const Light& light)
      : axes_from_world(light_axes(light)),
        parallel(model_of(light.type).is_projective),
        sphere(model_of(light.type).is_sphere),
        radius(disc_radius(light)) {}

  const glm::dmat4 axes_from_world;
  const bool parallel, sphere;
  const double radius;

  std::array<glm::dvec3, 8> box_of(const PlacedMesh& mesh) const {
    const glm::dmat4 axes_from_mesh = axes_from_world * mesh.world_from_local;
    std::array<glm::dvec3, 8> box;
    for (int i = 0; i < 8; ++i) box[i] = in_view(axes_from_mesh, corner_of(mesh.bounds, i));
    return box;
  }

  /// Bounds of points; what lies at the light itself or behind it has no place in the map.
  ViewBounds bounds_of(std::span<const glm::dvec3> points) const {
    ViewBounds bounds;
    for (const glm::dvec3& p : points) {
      bounds.z_low = std::min(bounds.z_low, p.z);
      bounds.z_high = std::max(bounds.z_high, p.z);
    }
    for (const glm::dvec3& p : points) {
      if (!parallel && p.z <= 1e-12 * bounds.z_high) continue;
      const glm::dvec2 q = parallel ? glm::dvec2(p) : glm::dvec2(p) / p.z;
      bounds.q_low = glm::min(bounds.q_low, q);
      bounds.q_high = glm::max(bounds.q_high, q);
    }
    return bounds;
  }

  /// All that lies in a rectangle of the map.
  std::vector<HalfSpace> before(const Area& area) const {
    std::vector<HalfSpace> region;
    if (!parallel) region.push_back({{0, 0, 1}, 0});
    for (int i = 0; i < 2; ++i)
      for (const double side : {1.0, -1.0}) {
        const double limit = side > 0.0 ? area.low[i] : area.high[i];
        glm::dvec3 normal(0.0);
        normal[i] = side;
        if (!parallel) normal.z = -side * limit;
        region.push_back({normal, parallel ? -side * limit : 0.0});
      }
    return region;
  }

  /// All that a camera sees.
  std::vector<HalfSpace> seen_by(const Camera& camera) const {
    const Frustum frustum = camera_frustum(camera);
    const glm::dmat4 axes_from_view = axes_from_world * glm::inverse(frustum.view_from_world);
    const auto half_space = [&](const glm::dvec3& normal, const glm::dvec3& point) {
      const glm::dvec3 turned = glm::dmat3(axes_from_view) * normal;
      return HalfSpace{turned, -glm::dot(turned, glm::dvec3(axes_from_view * glm::dvec4(point, 1.0)))};
    };
    const glm::dvec3 eye(0.0);
    return {half_space({1, 0, frustum.tan_half_x}, eye), half_space({-1, 0, frustum.tan_half_x}, eye),
            half_space({0, 1, frustum.tan_half_y}, eye), half_space({0, -1, frustum.tan_half_y}, eye),
            half_space({0, 0, 1}, {0, 0, camera.znear}), half_space({0, 0, -1}, {0, 0, camera.zfar})};
  }

  /// The penumbra of what is as near as `near`, on what is as far as `far`: its half-width in the map. Towards the border of a
  /// sphere light's face it is wider.
  double penumbra(double near, double far, const Area& at) const {
    if (parallel) return radius * (far - near);
    const glm::dvec2 outermost = glm::max(glm::abs(at.low), glm::abs(at.high));
    const double stretch = sphere ? std::sqrt(1.0 + glm::dot(outermost, outermost)) : 1.0;
    return radius * stretch * (1.0 / near - 1.0 / far);
  }
};

Area area_of(const ViewBounds& bounds) {
  return {bounds.q_low, bounds.q_high};
}

/// A mesh's part in what is to be shadowed, or what shadows.
struct Part {
  std::uint32_t mesh;
  ViewBounds bounds;
};

/// What a light's map has to hold, in the space of LightAxes.
struct Extent {
  std::vector<Part> receivers;           ///< what of the meshes lies where shadows are asked for
  std::vector<Part> casters;             ///< meshes whose shadows may fall there
  Area area;                             ///< of the map; empty: nothing casts
  double nearest = 0.0, farthest = 0.0;  ///< z of receivers
};

std::vector<Part> receivers_in(const LightAxes& axes, const std::vector<PlacedMesh>& meshes,
                               const std::vector<HalfSpace>& region) {
  std::vector<Part> receivers;
  for (std::uint32_t i = 0; i < meshes.size(); ++i) {
    if (!meshes[i].receives_shadow) continue;
    const std::vector<glm::dvec3> corners = box_within(axes.box_of(meshes[i]), region);
    if (!corners.empty()) receivers.push_back({i, axes.bounds_of(corners)});
  }
  return receivers;
}

/// How far, along a direction, a mesh's points may be from where they should be, by the rounding of its file's coordinates.
double rounding_along(const glm::dvec3& direction, const glm::dmat4& from_mesh, const PlacedMesh& mesh) {
  double sum = 0.0;
  for (int i = 0; i < 3; ++i)
    sum += std::abs(glm::dot(direction, glm::dvec3(from_mesh[i]))) *
           std::max(std::abs(mesh.bounds.low[i]), std::abs(mesh.bounds.high[i]));
  return sum * 0x1p-22 + std::abs(glm::dot(direction, glm::dvec3(from_mesh[3]))) * 0x1p-48;
}

/// For a flat mesh (a floor, a wall) that has all of the light on one side: where the receivers lie that reach to the other. Most
/// floors cast on nothing, however much of the light's cone they fill. None for other meshes, which may cast on everything.
std::optional<Area> casts_upon(const LightAxes& axes, const std::vector<PlacedMesh>& meshes, const std::vector<Part>& receivers,
                               std::uint32_t flat) {
  const PlacedMesh& mesh = meshes[flat];
  const glm::dvec3 extent = mesh.bounds.high - mesh.bounds.low;
  const int axis = extent.x <= 0.0 ? 0 : extent.y <= 0.0 ? 1 : extent.z <= 0.0 ? 2 : -1;
  if (axis < 0) return {};
  const glm::dmat4 axes_from_mesh = axes.axes_from_world * mesh.world_from_local;
  const glm::dvec3 anchor = axes_from_mesh * glm::dvec4(mesh.bounds.low, 1.0);
  glm::dvec3 normal = glm::cross(glm::dvec3(axes_from_mesh[(axis + 1) % 3]), glm::dvec3(axes_from_mesh[(axis + 2) % 3]));
  const glm::dvec3 from_light = axes.parallel ? glm::dvec3(0.0, 0.0, 1.0) : anchor;
  if (glm::dot(normal, from_light) > 0.0) normal = -normal;  // towards the light
  const double reach = axes.sphere ? glm::length(normal) : glm::length(glm::dvec2(normal));
  if (-glm::dot(normal, from_light) <= axes.radius * reach) return {};
  Area upon;
  for (const Part& receiver : receivers) {
    if (receiver.mesh == flat) continue;
    const PlacedMesh& other = meshes[receiver.mesh];
    // Things that stand on it may sink in by rounding.
    const double slack = rounding_along(normal, axes_from_mesh, mesh) +
                         rounding_along(normal, axes.axes_from_world * other.world_from_local, other);
    const std::array<glm::dvec3, 8> box = axes.box_of(other);
    if (std::ranges::any_of(box, [&](const glm::dvec3& p) { return glm::dot(normal, p - anchor) < -slack; }))
      include(upon, area_of(receiver.bounds));
  }
  return upon;
}

/// Where the shadow of a mesh may fall, with its penumbra; empty if nowhere.
Area shadow_area(const LightAxes& axes, const std::vector<PlacedMesh>& meshes, const Extent& extent, const Area& border,
                 std::uint32_t caster, const ViewBounds& bounds) {
  // The disc of a sphere light that faces a receiver reaches behind the face's plane.
  if (!axes.parallel && bounds.z_high <= (axes.sphere ? -1.5 * axes.radius : 0.0)) return {};
  if (bounds.z_low >= extent.farthest) return {};
  Area area = border;
  if (axes.parallel || bounds.z_low > 0.0) {  // else it reaches behind the light's plane: its projection is unbounded
    area = area_of(bounds);
    const double widest = axes.penumbra(bounds.z_low, extent.farthest, area);
    area.low -= widest;
    area.high += widest;
  }
  if (common(area, border).is_empty()) return {};
  if (const std::optional<Area> upon = casts_upon(axes, meshes, extent.receivers, caster)) area = common(area, *upon);
  return area;
}

void find_casters(const LightAxes& axes, const std::vector<PlacedMesh>& meshes, const Area& border, Extent& extent) {
  Area receiving, casting;
  for (const Part& part : extent.receivers) include(receiving, area_of(part.bounds));
  extent.casters.clear();
  for (std::uint32_t i = 0; i < meshes.size(); ++i) {
    if (!meshes[i].casts_shadow) continue;
    const ViewBounds bounds = axes.bounds_of(axes.box_of(meshes[i]));
    const Area area = common(shadow_area(axes, meshes, extent, border, i, bounds), receiving);
    if (area.is_empty()) continue;
    include(casting, area);
    extent.casters.push_back({i, bounds});
  }
  extent.area = common(common(casting, receiving), border);
}

void bound_depths(Extent& extent) {
  extent.nearest = 1e300;
  extent.farthest = -1e300;
  for (const Part& part : extent.receivers) {
    extent.nearest = std::min(extent.nearest, part.bounds.z_low);
    extent.farthest = std::max(extent.farthest, part.bounds.z_high);
  }
}

/// What the map has to hold for receivers in `asked`. A shadow falls where the light's cone, the casters widened by their
/// penumbrae, and the receivers overlap; there receivers may be less far than elsewhere, and penumbrae narrower.
Extent extent_of(const LightAxes& axes, const std::vector<PlacedMesh>& meshes, const std::vector<HalfSpace>& asked,
                 const Area& border) {
  Extent extent;
  extent.receivers = receivers_in(axes, meshes, asked);
  for (int pass = 0; pass < 4 && !extent.receivers.empty(); ++pass) {
    bound_depths(extent);
    find_casters(axes, meshes, border, extent);
    if (extent.area.is_empty()) break;
    std::vector<HalfSpace> within = asked;
    const std::vector<HalfSpace> before = axes.before(extent.area);
    within.insert(within.end(), before.begin(), before.end());
    Extent narrower;
    narrower.receivers = receivers_in(axes, meshes, within);
    if (narrower.receivers.empty()) break;
    bound_depths(narrower);
    const double depth = axes.parallel ? extent.farthest - extent.nearest : extent.farthest;
    const double less = axes.parallel ? narrower.farthest - narrower.nearest : narrower.farthest;
    extent.receivers = std::move(narrower.receivers);
    extent.nearest = narrower.nearest;
    extent.farthest = narrower.farthest;
    if (less > 0.8 * depth) break;
  }
  return extent;
}

/// All that lies before a light's plane in its cone, or all there is.
std::vector<HalfSpace> cone_of(const LightAxes& axes, const Area& border) {
  return axes.parallel ? std::vector<HalfSpace>() : axes.before(border);
}

/// The extent of what a camera sees. Look-ups reach beyond: a few texels, or, where the map is searched for what casts a
/// penumbra, as far as these reach.
Extent seen_extent(const LightAxes& axes, const std::vector<PlacedMesh>& meshes, const Camera& camera, const Area& border,
                   unsigned resolution_px, bool searched) {
  std::vector<HalfSpace> asked = cone_of(axes, border);
  const std::vector<HalfSpace> seen = axes.seen_by(camera);
  asked.insert(asked.end(), seen.begin(), seen.end());
  Extent extent = extent_of(axes, meshes, asked, border);
  if (extent.area.is_empty()) return extent;
  double beyond = 8.0 / std::max(8u, resolution_px) * extent.area.extent();
  if (searched)
    for (const Part& caster : extent.casters) {
      const double z = axes.parallel ? caster.bounds.z_low : std::max(caster.bounds.z_low, 0.05 * extent.farthest);
      beyond = std::max(beyond, axes.penumbra(std::min(z, extent.farthest), extent.farthest, extent.area));
    }
  extent.area = common({extent.area.low - beyond, extent.area.high + beyond}, border);
  return extent;
}

/// Half the width of all that look-ups may read: the cone, and of a face a border. Receivers at a face's border read a texel
/// beyond it, a search as far as penumbrae may reach.
double beyond_face(const LightAxes& axes, const Extent& extent, unsigned resolution_px, bool searched) {
  double beyond = 8.0 / std::max(8u, resolution_px);
  if (!searched) return beyond;
  double nearest = extent.farthest;
  for (const Part& caster : extent.casters) nearest = std::min(nearest, caster.bounds.z_low * 0.999);
  return beyond + std::clamp(std::sqrt(3.0) * axes.radius / std::max(nearest, 0.05 * extent.farthest), 0.0, 1.0);
}

/// The least z of receivers in the cone, triangle by triangle where boxes come near the light: a light in a room is within the
/// room's box.
double nearest_receiver(const LightAxes& axes, const std::vector<PlacedMesh>& meshes, const Extent& extent, const Area& border) {
  double nearest = extent.farthest;
  const double flush = 0x1p-20 * extent.farthest;  // with the light: it receives nothing
  const std::vector<HalfSpace> cone = cone_of(axes, border);
  for (const Part& part : receivers_in(axes, meshes, cone)) {
    const PlacedMesh& mesh = meshes[part.mesh];
    if (part.bounds.z_low >= nearest) continue;
    if (mesh.mesh == nullptr || part.bounds.z_low > 0.05 * extent.farthest) {
      nearest = part.bounds.z_low;
      continue;
    }
    const glm::dmat4 axes_from_mesh = axes.axes_from_world * mesh.world_from_local;
    const auto corner = [&](std::uint32_t i) { return in_view(axes_from_mesh, mesh.mesh->positions[i]); };
    for (const glm::uvec3& t : mesh.mesh->triangles)
      for (const glm::dvec3& p : triangle_within({corner(t.x), corner(t.y), corner(t.z)}, cone))
        nearest = std::min(nearest, p.z < flush ? nearest : p.z);
  }
  return nearest;
}

/// Gives light space a unit between the light's radius and the farthest receiver's distance: products of many coordinates neither
/// overflow nor vanish, however large the scene is. A power of two, so that no digit depends on it.
void choose_unit(const LightAxes& axes, double farthest, LightView& fitted) {
  const double radius = std::clamp(axes.radius / farthest, 1e-6, 1e6);
  fitted.unit = std::exp2(std::round(std::log2(farthest) + std::log2(radius) / 2));
  fitted.frustum.view_from_world = glm::scale(glm::dmat4(1.0), glm::dvec3(1.0 / fitted.unit)) * fitted.frustum.view_from_world;
}

/// Sets light space: its frustum, unit and horizon, and the light's radius in it.
void set_space(const Light& light, const LightAxes& axes, const Extent& extent, LightView& fitted) {
  if (axes.parallel) {
    // Casters may stand far before what they cast on: near the light, as it were.
    double low = extent.nearest, high = extent.farthest, first = extent.nearest;
    for (const Part& caster : extent.casters) {
      first = std::min(first, caster.bounds.z_low);
      high = std::max(high, caster.bounds.z_high);
    }
    place_parallel_light(light, std::min(low, high - 1e-3 * (high - first)), high, fitted);
    fitted.radius = axes.radius;
  } else {
    if (extent.farthest > 0.0) choose_unit(axes, extent.farthest, fitted);
    fitted.radius = axes.radius / fitted.unit;
  }
}

/// The least z of what the map shows of a mesh; of one that lies wholly before the light's plane, of all of it.
double nearest_drawn(const LightAxes& axes, const PlacedMesh& mesh, const ViewBounds& bounds, const Area& area) {
  if (axes.parallel || bounds.z_low > 0.0) return bounds.z_low;
  const std::vector<glm::dvec3> shown = box_within(axes.box_of(mesh), axes.before(area));
  return shown.empty() ? 1e300 : axes.bounds_of(shown).z_low;
}

/// Sets what is drawn into the map, znear and zfar: about casters, and what else lies in the area.
void find_drawn(const LightAxes& axes, const std::vector<PlacedMesh>& meshes, const Extent& extent, LightView& fitted) {
  double nearest = extent.farthest;
  for (std::uint32_t i = 0; i < meshes.size(); ++i) {
    if (!meshes[i].casts_shadow) continue;
    const ViewBounds bounds = axes.bounds_of(axes.box_of(meshes[i]));
    if (!std::ranges::binary_search(fitted.casters, i)) {
      const bool is_bounded = axes.parallel || bounds.z_low > 0.0;
      if (axes.parallel ? bounds.z_high >= fitted.horizon : bounds.z_high <= 0.0) continue;
      if (is_bounded && common(area_of(bounds), extent.area).is_empty()) continue;
    } else {
      fitted.casters_znear = std::min(fitted.casters_znear, bounds.z_low);
    }
    fitted.drawn.push_back(i);
    nearest = std::min(nearest, nearest_drawn(axes, meshes[i], bounds, extent.area));
  }
  const auto z_of = [&](double z) { return axes.parallel ? fitted.unit / (fitted.horizon - z) : z / fitted.unit; };
  fitted.zfar = z_of(extent.farthest) * 1.001;
  fitted.znear = std::clamp(z_of(nearest) * 0.999, fitted.zfar * 1e-9, fitted.zfar);
  // Where a caster passes through the light's plane its depth says nothing: a search as wide as 1/z asks for would step over all.
  fitted.casters_znear = z_of(fitted.casters_znear) * 0.999;
  fitted.casters_znear = std::max(fitted.casters_znear, (fitted.casters_znear > 0.0 ? 1e-4 : 0.05) * fitted.zfar);
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
                         bool searched, const Camera* seen_by) {
  LightView fitted;
  const LightAxes axes(light);
  fitted.is_projective = axes.parallel;
  fitted.frustum = axes.parallel ? Frustum{axes.axes_from_world, everywhere, everywhere} : light_frustum(light);
  const auto border_of = [&](double beyond) {
    return Area{glm::dvec2(-fitted.frustum.tan_half_x - beyond), glm::dvec2(fitted.frustum.tan_half_x + beyond)};
  };
  Area border = border_of(0.0);
  Extent extent = extent_of(axes, meshes, cone_of(axes, border), border);
  if (model_of(light.type).has_faces()) {
    border = border_of(beyond_face(axes, extent, resolution_px, searched));
    extent = extent_of(axes, meshes, cone_of(axes, border), border);
  }
  // What is seen may be a small part of a large scene. Else the map stays where it is, whatever the camera does.
  if (seen_by && !extent.area.is_empty()) {
    Extent seen = seen_extent(axes, meshes, *seen_by, border, resolution_px, searched);
    if (!seen.area.is_empty() && seen.area.extent() < extent.area.extent() / 4) extent = std::move(seen);
  }

  set_space(light, axes, extent, fitted);
  if (extent.area.is_empty()) return fitted;
  for (const Part& caster : extent.casters) fitted.casters.push_back(caster.mesh);
  if (axes.radius > 0.0 && !axes.parallel) fitted.nearest_receiver = nearest_receiver(axes, meshes, extent, border) / fitted.unit;
  find_drawn(axes, meshes, extent, fitted);
  const double per_unit = axes.parallel ? 1.0 / fitted.unit : 1.0;
  place_texels({extent.area.low * per_unit, extent.area.high * per_unit}, resolution_px, tile_px, fitted);
  return fitted;
}

HsView whole_cone_view(const LightView& fitted) {
  const Frustum& frustum = fitted.frustum;
  return base_view(frustum, 1.0 / frustum.tan_half_x, {-frustum.tan_half_x, frustum.tan_half_x}, {2, 2}, 2);
}

}  // namespace halfshade
