// The meshes of a scene on the device, and what of them a view draws.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "device/launcher.hpp"
#include "kernels.hpp"
#include "light/fit.hpp"
#include "light/view.hpp"

namespace halfshade {

/// Elements first .. first + count of a mesh.
struct ElementRange {
  std::uint32_t first, count;
};

/// The meshes of a scene as they lie on the device, one behind the other.
struct ResidentScene {
  std::vector<std::shared_ptr<const Mesh>> meshes;       ///< what was uploaded, to see whether it still holds
  std::vector<ElementRange> vertices, triangles, edges;  ///< of each mesh
  std::uint32_t vertex_count = 0, triangle_count = 0, edge_count = 0;
  /// The greatest number of potential silhouettes: one an edge, one more for every two faces beyond two.
  std::uint32_t edge_record_count = 0;
  std::vector<Bounds> bounds;
  std::vector<int> orientations;        ///< of each mesh: solid_orientation
  std::vector<int> windings;            ///< of each mesh: +1 outwards, -1 inwards, 0 unknown, be it closed or not
  Buffer<cl_float> positions;           ///< [3 * vertex_count]
  Buffer<cl_uint> triangle_corners;     ///< [3 * triangle_count], scene-wide vertices
  Buffer<cl_uint> face_meshes;          ///< [triangle_count]
  Buffer<cl_uint2> edge_ends;           ///< [edge_count], scene-wide vertices
  Buffer<cl_uint> edge_face_offsets;    ///< [edge_count + 1]
  Buffer<cl_uint> edge_faces;           ///< [edge_face_offsets[edge_count]], (scene-wide face << 1) | against
  Buffer<cl_uint> vertex_edge_offsets;  ///< [vertex_count + 1]
  Buffer<cl_uint> vertex_edges;         ///< [2 * edge_count]

  /// Uploads meshes. Throws InputError where there are too many elements, DeviceError where there is too little memory.
  static ResidentScene upload(const DeviceImpl& device, const Scene& scene);
  /// Whether `scene` has the same meshes in the same order.
  bool holds(const Scene& scene) const;

  kernels::args::Topology topology() const {
    return {.edges = edge_ends,
            .edge_face_offsets = edge_face_offsets,
            .edge_faces = edge_faces,
            .vertex_edge_offsets = vertex_edge_offsets,
            .vertex_edges = vertex_edges};
  }
};

/// What a view draws: the camera's, or a light's.
struct DrawList {
  HsView view{};
  Buffer<HsTransform> transforms;         ///< a mesh of the scene
  Blocks vertices, triangles;             ///< of all it draws
  Blocks caster_triangles, caster_edges;  ///< of those whose silhouettes count
};

/// `drawn`: the meshes to rasterize; `casters`: of these, those whose silhouettes count.
DrawList draw_list(const DeviceImpl& device, const ResidentScene& resident, const std::vector<PlacedMesh>& placed,
                   const HsView& view, const glm::dmat4& view_from_world, const std::vector<std::uint32_t>& drawn,
                   const std::vector<std::uint32_t>& casters = {});

}  // namespace halfshade
