// What can be said about a mesh before it casts a shadow: is it closed, which way does it face, what is wrong with it.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>

#include "halfshade/halfshade.hpp"
#include "scene/topology.hpp"

namespace halfshade {

/// Which way the faces of a mesh are oriented.
enum class Orientation {
  open,     ///< there is no inside: some edge has one face
  outward,  ///< closed, positive volume
  inward,   ///< closed, negative volume
  mixed,    ///< every edge has its faces, but their windings disagree somewhere
  flat,     ///< closed, without volume
};

/// Figures of a mesh.
struct MeshReport {
  std::size_t source_vertices = 0, vertices = 0;  ///< before and after welding
  std::size_t triangles = 0;
  std::size_t collapsed_triangles = 0;  ///< dropped by welding
  std::size_t zero_area_triangles = 0;  ///< three different corners in a line
  std::size_t edges = 0, boundary_edges = 0, nonmanifold_edges = 0, inconsistent_edges = 0;
  std::size_t components = 0;  ///< parts that share no vertex
  Orientation orientation = Orientation::open;
  double signed_volume = 0.0;  ///< of cones from the bounding box's centre; a volume where the mesh is closed
  glm::dvec3 low{0.0}, high{0.0};

  bool closed() const { return boundary_edges == 0; }
};

/// Counts, orientation, volume and bounds of a mesh.
MeshReport inspect_mesh(const Mesh& mesh, const Topology& topology);

}  // namespace halfshade
