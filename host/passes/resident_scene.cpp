#include "passes/resident_scene.hpp"

#include <algorithm>
#include <map>

#include "scene/topology.hpp"

namespace halfshade {
namespace {

Bounds bounds_of(const Mesh& mesh) {
  Bounds bounds{glm::dvec3(1e300), glm::dvec3(-1e300)};
  for (const glm::vec3& p : mesh.positions) {
    bounds.low = glm::min(bounds.low, glm::dvec3(p));
    bounds.high = glm::max(bounds.high, glm::dvec3(p));
  }
  return bounds;
}

/// +1 if the mesh, taken for the surface of a body, is wound outwards, -1 if inwards; 0 where it does not tell: two faces at an
/// edge disagree, or it is flat. Reversing its winding reverses the sign.
int winding_of(const Mesh& mesh, const Topology& topology) {
  if (topology.inconsistent_edge_count > 0) return 0;
  const Bounds bounds = bounds_of(mesh);
  const glm::dvec3 middle = 0.5 * (bounds.low + bounds.high);
  double volume = 0.0, total = 0.0;
  for (const glm::uvec3& t : mesh.triangles) {
    const auto from_middle = [&](std::uint32_t v) { return glm::dvec3(mesh.positions[v]) - middle; };
    const double part = glm::dot(from_middle(t.x), glm::cross(from_middle(t.y), from_middle(t.z)));
    volume += part;
    total += std::abs(part);
  }
  return std::abs(volume) <= 1e-6 * total ? 0 : volume > 0.0 ? 1 : -1;
}

/// A mesh as it is uploaded.
struct PreparedMesh {
  explicit PreparedMesh(const Mesh& source)
      : mesh(in_spatial_order(source)),
        topology(build_topology(mesh)),
        orientation(solid_orientation(mesh, topology)),
        winding(winding_of(mesh, topology)) {}
  Mesh mesh;
  Topology topology;
  int orientation, winding;
};

/// The elements of all meshes so far, with scene-wide indices.
struct Elements {
  std::vector<glm::vec3> positions;
  std::vector<glm::uvec3> triangles;
  std::vector<glm::uvec2> edges;
  std::vector<std::uint32_t> face_meshes, edge_face_offsets{0}, edge_faces, vertex_edge_offsets{0}, vertex_edges;

  bool has_capacity_for(const PreparedMesh& part) const {
    const std::size_t limit = std::size_t{1} << 30;  // faces are stored shifted by one bit
    return positions.size() + part.mesh.positions.size() <= limit && triangles.size() + part.mesh.triangles.size() <= limit &&
           edges.size() + part.topology.edges.size() <= limit;
  }

  void append(const PreparedMesh& part, std::uint32_t mesh_index) {
    const Topology& topology = part.topology;
    const auto vertex0 = static_cast<std::uint32_t>(positions.size()), triangle0 = static_cast<std::uint32_t>(triangles.size()),
               edge0 = static_cast<std::uint32_t>(edges.size()), face_ref0 = static_cast<std::uint32_t>(edge_faces.size()),
               edge_ref0 = static_cast<std::uint32_t>(vertex_edges.size());
    positions.insert(positions.end(), part.mesh.positions.begin(), part.mesh.positions.end());
    for (const glm::uvec3& t : part.mesh.triangles) triangles.push_back(t + vertex0);
    face_meshes.insert(face_meshes.end(), part.mesh.triangles.size(), mesh_index);
    for (const glm::uvec2& e : topology.edges) edges.push_back(e + vertex0);
    for (std::size_t i = 1; i < topology.edge_face_offset.size(); ++i)
      edge_face_offsets.push_back(topology.edge_face_offset[i] + face_ref0);
    for (const std::uint32_t f : topology.edge_faces) edge_faces.push_back(f + (triangle0 << 1));
    for (std::size_t i = 1; i < topology.vertex_edge_offset.size(); ++i)
      vertex_edge_offsets.push_back(topology.vertex_edge_offset[i] + edge_ref0);
    for (const std::uint32_t e : topology.vertex_edges) vertex_edges.push_back(e + edge0);
  }
};

std::uint32_t edge_records_of(const Topology& topology) {
  std::uint32_t count = 0;
  for (std::size_t i = 1; i < topology.edge_face_offset.size(); ++i)
    count += std::max(1u, (topology.edge_face_offset[i] - topology.edge_face_offset[i - 1] + 1) / 2);
  return count;
}

/// `cull`: HS_CULL_ a mesh of the scene, or empty.
Blocks blocks_of(const DeviceImpl& device, const std::vector<ElementRange>& ranges, const std::vector<std::uint32_t>& meshes,
                 const std::vector<cl_uint>& cull = {}) {
  std::vector<HsBlock> blocks;
  for (const std::uint32_t m : meshes)
    for (std::uint32_t i = 0; i < ranges[m].count; i += HS_BLOCK_SIZE)
      blocks.push_back({ranges[m].first + i, std::min<std::uint32_t>(HS_BLOCK_SIZE, ranges[m].count - i), m,
                        cull.empty() ? HS_CULL_NONE : cull[m]});
  return {upload<HsBlock>(device, blocks, "block list"), static_cast<std::uint32_t>(blocks.size())};
}

}  // namespace

ResidentScene ResidentScene::upload(const DeviceImpl& device, const Scene& scene) {
  using halfshade::upload;
  ResidentScene resident;
  Elements elements;
  std::map<const Mesh*, PreparedMesh> prepared;  // a mesh may stand in the scene more than once
  for (std::uint32_t m = 0; m < scene.meshes.size(); ++m) {
    const std::shared_ptr<const Mesh>& source = scene.meshes[m].mesh;
    const PreparedMesh& part = prepared.try_emplace(source.get(), *source).first->second;
    if (!elements.has_capacity_for(part))
      throw InputError(fmt::format("scene '{}': mesh '{}' brings it past 2^30 vertices, triangles or edges; split the scene",
                                   scene.name, scene.meshes[m].name));
    const auto range = [](std::size_t first, std::size_t count) {
      return ElementRange{static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(count)};
    };
    resident.meshes.push_back(source);
    resident.vertices.push_back(range(elements.positions.size(), part.mesh.positions.size()));
    resident.triangles.push_back(range(elements.triangles.size(), part.mesh.triangles.size()));
    resident.edges.push_back(range(elements.edges.size(), part.topology.edges.size()));
    resident.bounds.push_back(bounds_of(part.mesh));
    resident.orientations.push_back(part.orientation);
    resident.windings.push_back(part.winding);
    resident.edge_record_count += edge_records_of(part.topology);
    elements.append(part, m);
  }
  resident.vertex_count = static_cast<std::uint32_t>(elements.positions.size());
  resident.triangle_count = static_cast<std::uint32_t>(elements.triangles.size());
  resident.edge_count = static_cast<std::uint32_t>(elements.edges.size());
  resident.positions = upload<cl_float>(device, elements.positions, "vertex positions");
  resident.triangle_corners = upload<cl_uint>(device, elements.triangles, "triangles");
  resident.face_meshes = upload<cl_uint>(device, elements.face_meshes, "triangles");
  resident.edge_ends = upload<cl_uint2>(device, elements.edges, "edges");
  resident.edge_face_offsets = upload<cl_uint>(device, elements.edge_face_offsets, "edges");
  resident.edge_faces = upload<cl_uint>(device, elements.edge_faces, "edges");
  resident.vertex_edge_offsets = upload<cl_uint>(device, elements.vertex_edge_offsets, "vertex edges");
  resident.vertex_edges = upload<cl_uint>(device, elements.vertex_edges, "vertex edges");
  return resident;
}

bool ResidentScene::holds(const Scene& scene) const {
  return std::ranges::equal(scene.meshes, meshes, [](const SceneMesh& a, const auto& b) { return a.mesh == b; });
}

DrawList draw_list(const DeviceImpl& device, const ResidentScene& resident, const std::vector<PlacedMesh>& placed,
                   const HsView& view, const glm::dmat4& view_from_world, const std::vector<std::uint32_t>& drawn,
                   const std::vector<std::uint32_t>& casters) {
  DrawList list;
  list.view = view;
  std::vector<HsTransform> transforms;
  std::vector<cl_uint> cull, away;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const PlacedMesh& mesh = placed[i];
    transforms.push_back(transform_rows(view_from_world * mesh.world_from_local));
    cull.push_back(hidden_faces(mesh, view_from_world, view.znear));
    const double handedness = resident.windings[i] * glm::determinant(glm::dmat3(mesh.world_from_local));
    away.push_back(handedness > 0.0 ? HS_CULL_POSITIVE : handedness < 0.0 ? HS_CULL_NEGATIVE : HS_CULL_NONE);
  }
  list.transforms = upload<HsTransform>(device, transforms, "transforms");
  list.vertices = blocks_of(device, resident.vertices, drawn);
  list.triangles = blocks_of(device, resident.triangles, drawn, cull);
  list.caster_triangles = blocks_of(device, resident.triangles, casters, away);
  list.caster_edges = blocks_of(device, resident.edges, casters);
  return list;
}

}  // namespace halfshade
