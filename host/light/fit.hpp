// A light's map, fitted to what casts and receives.
#pragma once

#include <vector>

#include "light/view.hpp"

namespace halfshade {

/// A light's map: which meshes it draws, and the view to draw them with.
struct LightView {
  Frustum frustum;
  HsView view{};
  std::vector<std::uint32_t> casters;  ///< meshes whose shadow can fall on a receiver; empty: nothing to do for this light
  std::vector<std::uint32_t> drawn;    ///< meshes to draw into the shadow map: the casters, and casting meshes behind them
  double lm_from_px_scale = 0.0;       ///< light map units a texel
  glm::dvec2 lm_from_px_origin{0.0};   ///< light map coordinates of the top left corner of texel (0, 0)
  double znear = 0.0, zfar = 0.0;      ///< in the frustum's space
  double casters_znear = 1e300;        ///< no caster is nearer; where some pass through the light's plane, a twentieth of zfar
  double nearest_receiver = 1e300;     ///< no receiver in the cone is nearer; of lights with a place and an extent
  double radius = 0.0;                 ///< disc_radius, in the frustum's space
  double unit = 1.0;                   ///< of the frustum's space, in the scene's: a power of two
  bool is_projective = false;          ///< light space is a projective image of the world: see host/light/directional.cpp
  double horizon = 0.0;                ///< of that image, in the scene's unit

  /// The distance along the light's axis, in the scene's unit, of a z of its frustum's space: from the light, or, of one that has
  /// no place, from the world's origin.
  double distance_of(double z) const { return is_projective ? horizon - unit / z : unit * z; }
};

/// Fits a light map of at most `resolution_px` texels a side, square texels, to what casts in the light's cone and what receives
/// there. `light` is one of faces_of. If `seen_by` sees a small part of the scene alone, and receivers are what it sees, the map
/// is of that. A face of a point light has a border for look-ups, as wide as a penumbra if the map is to be `searched` for what
/// casts one, and what casts on it from beyond. Its texel size moves in steps of an eighth of an octave and its corner on the
/// texel grid, so that a small change in the scene mostly leaves every texel where it was, and shadows do not swim.
LightView fit_light_view(const Light& light, const std::vector<PlacedMesh>& meshes, unsigned resolution_px, unsigned tile_px,
                         bool searched = false, const Camera* seen_by = nullptr);

/// The tangent of half of a cone that has no border.
constexpr double everywhere = 1e15;

/// Sets frustum, horizon and unit of a directional light for what lies from `low` to `high` along its axis.
void place_parallel_light(const Light& light, double low, double high, LightView& fitted);

/// A view whose map is the light's whole cone, to ask where receivers lie but not for what casts on them.
HsView whole_cone_view(const LightView& fitted);

}  // namespace halfshade
