// Views in double precision: cameras and lights to the numbers that kernels work with.
#pragma once

#include "halfshade/halfshade.hpp"

// Structs shared with the kernels, written in their types.
#include "shared.h"

namespace halfshade {

/// What a view sees: x right, y up, z forward from where it looks.
struct Frustum {
  /// Unit and orthogonal axes; a directional light's is projective on top of that (see directional_frustum): divide by w.
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

/// The lights that a light is drawn as: itself, or the six faces of a point light, each turned to face one way: +x, -x, +y, -y,
/// +z, -z of the world.
std::vector<Light> faces_of(const Light& light);

/// A light's map, fitted: which meshes it draws, and the view to draw them with.
struct LightView {
  Frustum frustum;
  HsView view{};
  std::vector<std::uint32_t> casters;  ///< meshes whose shadow can fall on a receiver; empty: nothing to do for this light
  std::vector<std::uint32_t> drawn;    ///< meshes to draw into the shadow map: the casters, and casting meshes behind them
  double lm_from_px_scale = 0.0;       ///< light map units a texel
  glm::dvec2 lm_from_px_origin{0.0};   ///< light map coordinates of the top left corner of texel (0, 0)
  double znear = 0.0, zfar = 0.0;      ///< in the frustum's space
  double casters_znear = 0.0;          ///< no caster is nearer; where some pass through the light's plane, a twentieth of zfar
  double horizon = 0.0, unit = 1.0;    ///< of a directional light's frustum
};

/// T · Rz·Ry·Rx · S, then the mesh's local origin.
glm::dmat4 world_from_mesh(const SceneMesh& mesh);

Frustum camera_frustum(const Camera& camera);
/// A light's right, up and axis as rows, from its position; a directional light's from the world's origin.
glm::dmat4 light_axes(const Light& light);
/// Of a spot light.
Frustum light_frustum(const Light& light);
/// A directional light as the disc of a light at the origin of a space that is a projective image of the world:
/// p' = (x, y, unit) / (horizon - z), where x, y and z are along the light's axes. It takes lines and planes to lines and planes,
/// the points at infinity in direction (sx, sy, -1), from which the light comes, to (sx, sy, 0), and keeps what hides what: the
/// cone of directions is a disc of radius tan(angular radius) facing +z. In its light map q = (x, y) / unit, and the depth key
/// 1/z' is (horizon - z) / unit, so that the penumbra's half-width R (1/Lb' - 1/Lr') is tan(angular radius) (Lr - Lb). Everything
/// that casts or receives must lie before z = horizon.
Frustum directional_frustum(const Light& light, double horizon, double unit);

/// The radius of the disc about the light's centre that holds all of it, in the light's own space: R of the penumbra's
/// half-width. 0 for hard shadows.
double disc_radius(const Light& light);

/// The camera's view on its pixel grid of `tile_px` tiles.
HsView camera_view(const Camera& camera, unsigned tile_px);

/// Fits a light map of at most `resolution_px` texels a side, square texels, to what casts in the light's cone and what receives
/// there. A face of a point light has a border for look-ups, as wide as a penumbra if the map is to be `searched` for what casts
/// one, and what casts on it from beyond. Its texel size moves in steps of
/// an eighth of an octave and its corner on the texel grid, so that a small change in the scene mostly leaves every texel where
/// it was, and shadows do not swim.
LightView fit_light_view(const Light& light, const std::vector<PlacedMesh>& meshes, unsigned resolution_px, unsigned tile_px,
                         bool searched = false);

/// Point number `index` of `count` of the light, as a light without extent that faces the same way: of a disc in rings of equal
/// area, turned from one to the next by the golden angle; of a ball so that they fill its disc evenly from wherever it is seen.
/// A spot's cone holds all that can lie in the light's own behind the nearest caster.
Light light_sample(const Light& light, const LightView& fitted, unsigned index, unsigned count);

/// The same for a given point, in units of disc_radius along the light's right and up.
Light light_at_point(const Light& light, const LightView& fitted, const glm::dvec2& point);

/// A view whose map is the light's whole cone, to ask where receivers lie but not for what casts on them.
HsView whole_cone_view(const LightView& fitted);

/// Meshes that may be seen: not wholly outside one plane of the frustum.
std::vector<std::uint32_t> meshes_in_view(const Frustum& frustum, const std::vector<PlacedMesh>& meshes, double znear,
                                          double zfar);

/// Which triangles of a mesh (HS_CULL_) cannot be seen in a view: those that turn away, of a solid that lies wholly beyond
/// `znear`.
cl_uint hidden_faces(const PlacedMesh& mesh, const glm::dmat4& view_from_world, double znear);

/// Rows of the 3x4 matrix to_view * world_from_mesh, composed in double.
HsTransform transform_rows(const glm::dmat4& view_from_mesh);

/// What turns a camera's pixels with their view depths, or positions relative to the world, into the space of a light's map.
HsReceiverView receiver_view(const Camera& camera, const Light& light, const LightView& fitted, bool has_depth);

/// The light relative to the camera's position, as shading reads it.
HsShadeLight shade_light(const Camera& camera, const Light& light);
/// View rays in world axes from the camera's position.
HsReceiverView shade_view(const Camera& camera, bool has_depth);

}  // namespace halfshade
