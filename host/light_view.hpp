// Views in double precision: cameras and lights to the numbers that kernels work with.
#pragma once

#include "halfshade/halfshade.hpp"

// Structs shared with the kernels, written in their types.
#include "shared.h"

namespace halfshade {

/// A direction to look in: x right, y up, z forward, all unit and orthogonal, and where from.
struct Frustum {
  glm::dmat4 view_from_world{1.0};
  double tan_half_x = 0.0, tan_half_y = 0.0;
};

/// An axis-aligned box.
struct Bounds {
  glm::dvec3 low, high;
};

/// What a view needs of a mesh: where it is, and what it does.
struct PlacedMesh {
  glm::dmat4 world_from_mesh{1.0};  ///< takes the mesh's stored positions (relative to Mesh::origin) to the world
  Bounds bounds;                    ///< of the stored positions
  int orientation = 0;              ///< solid_orientation of the mesh
  bool casts_shadow = true, receives_shadow = true;
};

/// A light's map, fitted: which meshes it draws, and the view to draw them with.
struct LightView {
  Frustum frustum;
  HsView view{};
  std::vector<std::uint32_t> casters;  ///< meshes whose shadow can fall on a receiver; empty: nothing to do for this light
  std::vector<std::uint32_t> drawn;    ///< meshes to draw into the shadow map: the casters, and casting meshes behind them
  double lm_from_px_scale = 0.0;       ///< light map units a texel
  glm::dvec2 lm_from_px_origin{0.0};   ///< light map coordinates of the top left corner of texel (0, 0)
  double znear = 0.0, zfar = 0.0;
  double casters_znear = 0.0;  ///< no caster is nearer
};

/// T · Rz·Ry·Rx · S, then the mesh's local origin.
glm::dmat4 world_from_mesh(const SceneMesh& mesh);

Frustum camera_frustum(const Camera& camera);
Frustum light_frustum(const Light& light);

/// The camera's view on its pixel grid of `tile_px` tiles.
HsView camera_view(const Camera& camera, unsigned tile_px);

/// Fits a light map of at most `resolution_px` texels a side, square texels, to what casts in the light's cone and what receives
/// there. Its texel size moves in steps of an eighth of an octave and its corner on the texel grid, so that a small change in the
/// scene mostly leaves every texel where it was, and shadows do not swim.
LightView fit_light_view(const Light& light, const std::vector<PlacedMesh>& meshes, unsigned resolution_px, unsigned tile_px);

/// Point number `index` of `count` of the light's disc, as a light without extent that faces the same way: in rings of equal
/// area, turned from one to the next by the golden angle. Its cone holds all that can lie in the light's own behind the nearest
/// caster.
Light light_sample(const Light& light, const LightView& fitted, unsigned index, unsigned count);

/// A view whose map is the light's whole cone, to ask where receivers lie but not for what casts on them.
HsView whole_cone_view(const Light& light);

/// Meshes that may be seen: not wholly outside one plane of the frustum.
std::vector<std::uint32_t> meshes_in_view(const Frustum& frustum, const std::vector<PlacedMesh>& meshes, double znear,
                                          double zfar);

/// Which triangles of a mesh (HS_CULL_) cannot be seen in a view: those that turn away, of a solid that lies wholly beyond
/// `znear`.
cl_uint hidden_faces(const PlacedMesh& mesh, const glm::dmat4& view_from_world, double znear);

/// Rows of the 3x4 matrix to_view * world_from_mesh, composed in double.
HsTransform transform_rows(const glm::dmat4& view_from_mesh);

/// What turns a camera's pixels with their view depths, or positions relative to the world, into light space.
HsReceiverView receiver_view(const Camera& camera, const Light& light, bool has_depth);

/// The light relative to the camera's position, as shading reads it.
HsShadeLight shade_light(const Camera& camera, const Light& light);
/// View rays in world axes from the camera's position.
HsReceiverView shade_view(const Camera& camera, bool has_depth);

}  // namespace halfshade
