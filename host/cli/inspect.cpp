#include "cli/inspect.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>

#include "cli/commands.hpp"

namespace halfshade {
namespace {

std::size_t count_components(const Mesh& mesh, const Topology& topology) {
  // Union-find over vertices: each edge that joins two parts leaves one fewer.
  std::vector<std::uint32_t> parent(mesh.positions.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root_of = [&](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  std::size_t count = parent.size();
  for (const glm::uvec2& edge : topology.edges) {
    const std::uint32_t a = root_of(edge.x), b = root_of(edge.y);
    if (a == b) continue;
    parent[std::max(a, b)] = std::min(a, b);
    --count;
  }
  return count;
}

/// Whether at every edge as many faces run one way as the other.
bool is_evenly_wound(const Topology& topology) {
  for (std::size_t e = 0; e < topology.edges.size(); ++e) {
    int sum = 0;
    for (std::uint32_t i = topology.edge_face_offset[e]; i < topology.edge_face_offset[e + 1]; ++i) {
      sum += (topology.edge_faces[i] & 1) != 0 ? -1 : 1;
    }
    if (sum != 0) return false;
  }
  return true;
}

std::string_view name_of(Orientation orientation) {
  switch (orientation) {
    case Orientation::open:
      return "open";
    case Orientation::outward:
      return "outward";
    case Orientation::inward:
      return "inward";
    case Orientation::mixed:
      return "mixed";
    case Orientation::flat:
      return "flat";
  }
  return "";
}

std::string shown(const glm::dvec3& v) {
  return fmt::format("[{:.6g}, {:.6g}, {:.6g}]", v.x, v.y, v.z);
}

std::string to_text(const std::string& file, const MeshReport& r) {
  const glm::dvec3 size = r.high - r.low;
  std::string text = fmt::format("{}\n", file);
  const auto add = [&](std::string_view label, const std::string& value) { text += fmt::format("  {:<11} {}\n", label, value); };
  add("vertices", fmt::format("{} ({} in the file)", r.vertices, r.source_vertices));
  add("triangles", fmt::format("{} ({} more collapsed in welding, {} of zero area)", r.triangles, r.collapsed_triangles,
                               r.zero_area_triangles));
  add("edges", fmt::format("{} ({} boundary, {} non-manifold, {} inconsistently wound)", r.edges, r.boundary_edges,
                           r.nonmanifold_edges, r.inconsistent_edges));
  add("components", fmt::format("{}", r.components));
  add("closed", r.closed() ? fmt::format("yes, {}", name_of(r.orientation)) : "no");
  add("volume", fmt::format("{:.4g}{}", r.signed_volume, r.closed() ? "" : " (of an open mesh: no more than a hint)"));
  add("bounds", fmt::format("{} to {}, size {:.4g} x {:.4g} x {:.4g}", shown(r.low), shown(r.high), size.x, size.y, size.z));
  return text;
}

nlohmann::ordered_json to_json(const std::string& file, const MeshReport& r) {
  return {{"file", file},
          {"source_vertices", r.source_vertices},
          {"vertices", r.vertices},
          {"triangles", r.triangles},
          {"collapsed_triangles", r.collapsed_triangles},
          {"zero_area_triangles", r.zero_area_triangles},
          {"edges", r.edges},
          {"boundary_edges", r.boundary_edges},
          {"nonmanifold_edges", r.nonmanifold_edges},
          {"inconsistent_edges", r.inconsistent_edges},
          {"components", r.components},
          {"closed", r.closed()},
          {"orientation", name_of(r.orientation)},
          {"signed_volume", r.signed_volume},
          {"bounds", {{r.low.x, r.low.y, r.low.z}, {r.high.x, r.high.y, r.high.z}}}};
}

}  // namespace

MeshReport inspect_mesh(const Mesh& mesh, const Topology& topology) {
  MeshReport report;
  report.source_vertices = mesh.source_vertex_count;
  report.vertices = mesh.positions.size();
  report.triangles = mesh.triangles.size();
  report.collapsed_triangles = mesh.collapsed_count;
  report.edges = topology.edges.size();
  report.boundary_edges = topology.boundary_edge_count;
  report.nonmanifold_edges = topology.nonmanifold_edge_count;
  report.inconsistent_edges = topology.inconsistent_edge_count;
  report.components = count_components(mesh, topology);

  double six_volumes = 0.0;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 a(mesh.positions[t.x]), b(mesh.positions[t.y]), c(mesh.positions[t.z]);
    six_volumes += glm::dot(a, glm::cross(b, c));
    report.zero_area_triangles += glm::cross(b - a, c - a) == glm::dvec3(0.0);
  }
  report.signed_volume = six_volumes / 6.0;

  if (!report.closed()) {
    report.orientation = Orientation::open;
  } else if (!is_evenly_wound(topology)) {
    report.orientation = Orientation::mixed;
  } else if (report.signed_volume == 0.0) {
    report.orientation = Orientation::flat;
  } else {
    report.orientation = report.signed_volume > 0.0 ? Orientation::outward : Orientation::inward;
  }

  glm::vec3 low(std::numeric_limits<float>::infinity()), high(-std::numeric_limits<float>::infinity());
  for (const glm::vec3& p : mesh.positions) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  report.low = mesh.origin + glm::dvec3(low);
  report.high = mesh.origin + glm::dvec3(high);
  return report;
}

void run_inspect(const std::vector<std::filesystem::path>& meshes, bool json) {
  auto reports = nlohmann::ordered_json::array();
  for (const std::filesystem::path& path : meshes) {
    const Mesh mesh = load_obj(path);
    const MeshReport report = inspect_mesh(mesh, build_topology(mesh));
    if (json) {
      reports.push_back(to_json(path.string(), report));
    } else {
      fmt::print("{}", to_text(path.string(), report));
    }
  }
  if (json) fmt::print("{}\n", reports.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

}  // namespace halfshade
