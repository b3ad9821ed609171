// Views in double precision: cameras and lights to the numbers that kernels work with. Kernels receive the rounded results,
// relative to the view's own origin.
#pragma once

#include <CL/cl_platform.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "halfshade/halfshade.hpp"

// Structs shared with the kernels, written in their types.
#include "base/shared.h"

namespace halfshade {

// ---- what is viewed ---------------------------------------------------------------------------------------------------------

/// An axis-aligned box.
struct Bounds {
  glm::dvec3 low, high;
};

/// Corner 0 to 7 of a box.
glm::dvec3 corner_of(const Bounds& bounds, int i);

/// What a view needs of a mesh: where it is, and what it does.
struct PlacedMesh {
  const Mesh* mesh = nullptr;
  glm::dmat4 world_from_local{1.0};  ///< see world_from_local in scene/placement.hpp
  Bounds bounds;                     ///< of the stored positions
  int orientation = 0;               ///< solid_orientation of the mesh
  bool casts_shadow = true, receives_shadow = true;
};

// ---- where it is viewed from ------------------------------------------------------------------------------------------------

/// What a view sees: x right, y up, z forward from where it looks.
struct Frustum {
  /// Unit and orthogonal axes; a directional light's is projective on top of that (host/light/directional.cpp): divide by w.
  glm::dmat4 view_from_world{1.0};
  double tan_half_x = 0.0, tan_half_y = 0.0;
};

/// The view from `position` along `axis` (of any length) with `up` above, up being any direction that is not along the axis.
glm::dmat4 look_along(const glm::dvec3& position, const glm::dvec3& axis, const glm::dvec3& up);

/// The same for a light: up is by default world +Y, or +Z where the axis is within 8 degrees of Y.
glm::dmat4 look_along(const glm::dvec3& position, const glm::dvec3& axis, const std::optional<glm::dvec3>& up);

/// What keeps something from being drawn: which member of it (as a scene file names it), and what is expected of that.
struct Misfit {
  std::string_view member;
  std::string expected;
};

/// What keeps an axis and a direction up from making a view. The axis is of finite length, not 0, and `axis_name` in words.
std::optional<Misfit> misfit_of_axes(const glm::dvec3& axis, const glm::dvec3& up, std::string_view axis_name);

/// What keeps something from looking from `position` to `target`, with `up` above it if that is given.
std::optional<Misfit> misfit_of_look(const glm::dvec3& position, const glm::dvec3& target, const std::optional<glm::dvec3>& up);

Frustum camera_frustum(const Camera& camera);

/// The unit that kernels see the camera's space in, in the scene's: a power of two between its near and far planes, so that no
/// product of coordinates overflows or vanishes, however large the scene is.
double camera_unit(const Camera& camera);

/// view_from_world in that unit.
glm::dmat4 camera_view_from_world(const Camera& camera);

/// The camera's view, in its unit, on its pixel grid of `tile_px` tiles.
HsView camera_view(const Camera& camera, unsigned tile_px);

/// A view on a grid of `size_px`, `px_per_q` pixels a unit of q = (x/z, y/z), from its top left corner. znear and d_far are left
/// 0.
HsView base_view(const Frustum& frustum, double px_per_q, const glm::dvec2& top_left_q, glm::uvec2 size_px, unsigned tile_px);

// ---- what is seen -----------------------------------------------------------------------------------------------------------

/// A point in view space.
glm::dvec3 in_view(const glm::dmat4& view_from_any, const glm::dvec3& p);

/// Bounds of a placed mesh in a view: of q = (x/z, y/z) where it lies before the view's plane.
struct ViewBounds {
  glm::dvec2 q_low{1e300}, q_high{-1e300};
  double z_low = 1e300, z_high = -1e300;

  /// Extends the bounds of q.
  void include(const ViewBounds& other) {
    q_low = glm::min(q_low, other.q_low);
    q_high = glm::max(q_high, other.q_high);
  }
};

ViewBounds bounds_in_view(const Frustum& frustum, const PlacedMesh& mesh);

/// Whether bounds reach into a rectangle of q.
bool overlap(const ViewBounds& bounds, const glm::dvec2& low, const glm::dvec2& high);

/// Meshes that may be seen: not wholly outside one plane of the frustum.
std::vector<std::uint32_t> meshes_in_view(const Frustum& frustum, const std::vector<PlacedMesh>& meshes, double znear,
                                          double zfar);

/// Which triangles of a mesh (HS_CULL_) cannot be seen in a view: those that face away, of a solid that lies wholly beyond
/// `znear`.
cl_uint hidden_faces(const PlacedMesh& mesh, const glm::dmat4& view_from_world, double znear);

// ---- as kernels read it -----------------------------------------------------------------------------------------------------

glm::dvec3 row_of(const glm::dmat4& m, int row);
cl_float4 float4_of(const glm::dvec3& v, double w = 0.0);

/// Rows of a 4x4 matrix, composed in double.
HsTransform transform_rows(const glm::dmat4& view_from_mesh);

}  // namespace halfshade
