// The topology of mesh files.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/commands.hpp"
#include "cli/mesh_report.hpp"
#include "halfshade/halfshade.hpp"
#include "scene/topology.hpp"

namespace halfshade {
namespace {

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

/// Prints the report of each mesh file.
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

}  // namespace

void add_inspect(CLI::App& program) {
  CLI::App* command = program.add_subcommand("inspect", "Print the topology of mesh files");
  const auto meshes = std::make_shared<std::vector<std::filesystem::path>>();
  const auto json = std::make_shared<bool>(false);
  command->add_option("MESH", *meshes, "Wavefront OBJ files")->required()->option_text("...");
  command->add_flag("--json", *json, "Print JSON");
  command->footer(
      "Examples:\n"
      "  halfshade inspect data/meshes/torus.obj\n"
      "  halfshade inspect --json data/meshes/*.obj\n");
  command->callback([meshes, json] { run_inspect(*meshes, *json); });
}

}  // namespace halfshade
