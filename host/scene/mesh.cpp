// Meshes: Wavefront OBJ files to polygons, polygons to triangles, triangles to welded geometry about a local origin.
//
// tinyobjloader parses the files, but says nothing about much of what can be wrong with one, so the text is checked first
// (obj_text.hpp), and only what passes is parsed. Material libraries are never opened.
#define TINYOBJLOADER_USE_DOUBLE
#include <fmt/format.h>
#include <tiny_obj_loader.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <sstream>
#include <tuple>

#include "halfshade/halfshade.hpp"
#include "scene/limits.hpp"
#include "scene/obj_text.hpp"
#include "scene/read_file.hpp"
#include "scene/triangulate.hpp"

namespace halfshade {
namespace {

/// Vertices, and corners of triangles, that a mesh may have: offsets and (face << 1 | bit) must fit into 32 bits.
constexpr std::size_t max_elements = std::size_t{1} << 31;

/// What the parser hands over: positions, and faces as runs of corners.
struct Polygons {
  std::vector<glm::dvec3> positions;
  std::vector<std::uint32_t> corners;
  std::vector<std::size_t> face_end;  ///< one a face: where its run in `corners` ends
};

Polygons parse_obj(std::istream& stream, const std::string& file) {
  tinyobj::callback_t callback;
  callback.vertex_cb = [](void* user, double x, double y, double z, double) {
    static_cast<Polygons*>(user)->positions.emplace_back(x, y, z);
  };
  callback.index_cb = [](void* user, tinyobj::index_t* indices, int count) {
    auto& polygons = *static_cast<Polygons*>(user);
    for (const tinyobj::index_t& index : std::span(indices, static_cast<std::size_t>(count))) {
      const std::int64_t v = index.vertex_index;
      const auto vertex_count = static_cast<std::int64_t>(polygons.positions.size());
      polygons.corners.push_back(static_cast<std::uint32_t>(v > 0 ? v - 1 : vertex_count + v));
    }
    polygons.face_end.push_back(polygons.corners.size());
  };
  Polygons polygons;
  std::string warning, error;
  if (!tinyobj::LoadObjWithCallback(stream, callback, &polygons, nullptr, &warning, &error)) {
    throw InputError(fmt::format("{}: expected an OBJ file ({})", file, error.substr(0, error.find('\n'))));
  }
  return polygons;
}

/// For every vertex the first one at the same place, by position relative to `origin` in single precision. Equality is judged
/// after rounding, because two vertices that the pipeline cannot tell apart must not be the two sides of a crack.
/// Vertices that are not `used` are left out: they have place 0 and stand for themselves.
struct Places {
  std::vector<glm::vec3> relative;
  std::vector<std::uint32_t> first_here;
};

/// Where a vertex stands, for messages.
using PlaceOfVertex = std::function<std::string(std::uint32_t vertex)>;

/// The used vertex that is farthest from the middle of all, in the sense of the median: of a mesh that spans too much, the one to
/// blame.
std::uint32_t outermost_vertex(std::span<const glm::dvec3> positions, const std::vector<bool>& used) {
  std::vector<std::uint32_t> vertices;
  for (std::uint32_t i = 0; i < positions.size(); ++i)
    if (used[i]) vertices.push_back(i);
  glm::dvec3 middle(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    const auto median = vertices.begin() + static_cast<std::ptrdiff_t>((vertices.size() - 1) / 2);
    std::ranges::nth_element(vertices, median, {}, [&](std::uint32_t i) { return positions[i][axis]; });
    middle[axis] = positions[*median][axis];
  }
  return *std::ranges::max_element(vertices, {}, [&](std::uint32_t i) {
    const glm::dvec3 d = glm::abs(positions[i] * 0.5 - middle * 0.5);  // halved: the difference need not be finite
    return std::max({d.x, d.y, d.z});
  });
}

Places find_places(std::span<const glm::dvec3> positions, const std::vector<bool>& used, glm::dvec3 origin,
                   const std::string& name, const PlaceOfVertex& place_of) {
  struct Entry {
    glm::vec3 relative;
    std::uint32_t vertex;
  };
  Places places{std::vector<glm::vec3>(positions.size(), glm::vec3(0.0f)), std::vector<std::uint32_t>(positions.size())};
  std::vector<Entry> entries;
  entries.reserve(positions.size());
  for (std::uint32_t i = 0; i < positions.size(); ++i) {
    places.first_here[i] = i;
    if (!used[i]) continue;
    const glm::vec3 relative = glm::vec3(positions[i] - origin) + 0.0f;  // the sum makes -0 a plain 0
    if (!std::isfinite(relative.x) || !std::isfinite(relative.y) || !std::isfinite(relative.z)) {
      const std::uint32_t outermost = outermost_vertex(positions, used);
      const glm::dvec3 p = positions[outermost];
      throw InputError(fmt::format("{}: {}: expected a mesh that fits into single precision (found [{}, {}, {}]); scale it", name,
                                   place_of(outermost), p.x, p.y, p.z));
    }
    places.relative[i] = relative;
    entries.push_back({relative, i});
  }

  const auto key = [](const Entry& e) { return std::tie(e.relative.x, e.relative.y, e.relative.z, e.vertex); };
  std::ranges::sort(entries, {}, key);
  for (std::size_t i = 1; i < entries.size(); ++i) {
    if (entries[i].relative == entries[i - 1].relative) {
      places.first_here[entries[i].vertex] = places.first_here[entries[i - 1].vertex];
    }
  }
  return places;
}

std::string place_of_vertex(std::uint32_t vertex) {
  return fmt::format("vertex {}", vertex);
}

/// As make_mesh; `place_of` is how messages name a vertex.
Mesh make_mesh(std::string name, std::span<const glm::dvec3> positions, std::span<const glm::uvec3> triangles,
               const PlaceOfVertex& place_of) {
  if (positions.size() > max_elements || triangles.size() > max_elements / 3) {
    throw InputError(fmt::format("{}: expected at most {} vertices and {} triangles (found {} and {}); split the mesh", name,
                                 max_elements, max_elements / 3, positions.size(), triangles.size()));
  }
  if (triangles.empty()) throw InputError(fmt::format("{}: expected at least one triangle (found none)", name));

  std::vector<bool> used(positions.size(), false);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (int corner = 0; corner < 3; ++corner) {
      const std::uint32_t index = triangles[t][corner];
      if (index >= positions.size()) {
        throw InputError(
            fmt::format("{}: triangle {}: expected indices below {}, the vertices (found {})", name, t, positions.size(), index));
      }
      used[index] = true;
    }
  }

  glm::dvec3 low(std::numeric_limits<double>::infinity()), high(-std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const glm::dvec3 p = positions[i];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
      throw InputError(fmt::format("{}: vertex {}: expected finite numbers (found [{}, {}, {}])", name, i, p.x, p.y, p.z));
    }
    if (!used[i]) continue;
    low = glm::min(low, p);
    high = glm::max(high, p);
  }

  Mesh mesh;
  mesh.origin = low * 0.5 + high * 0.5;  // halved first: the sum of two finite numbers need not be finite
  mesh.source_vertex_count = positions.size();
  const Places places = find_places(positions, used, mesh.origin, name, place_of);

  used.assign(positions.size(), false);
  mesh.triangles.reserve(triangles.size());
  for (const glm::uvec3& t : triangles) {
    const glm::uvec3 welded(places.first_here[t.x], places.first_here[t.y], places.first_here[t.z]);
    if (welded.x == welded.y || welded.y == welded.z || welded.z == welded.x) {
      ++mesh.collapsed_count;
      continue;
    }
    for (int corner = 0; corner < 3; ++corner) used[welded[corner]] = true;
    mesh.triangles.push_back(welded);
  }
  if (mesh.triangles.empty()) {
    throw InputError(fmt::format("{}: expected a triangle with three different corners (found {}, each with two at one place)",
                                 name, triangles.size()));
  }

  std::vector<std::uint32_t> new_index(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (!used[i]) continue;
    new_index[i] = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.push_back(places.relative[i]);
  }
  for (glm::uvec3& t : mesh.triangles) t = {new_index[t.x], new_index[t.y], new_index[t.z]};
  mesh.name = std::move(name);
  return mesh;
}

}  // namespace

Mesh make_mesh(std::string name, std::span<const glm::dvec3> positions, std::span<const glm::uvec3> triangles) {
  return make_mesh(std::move(name), positions, triangles, place_of_vertex);
}

Mesh load_obj(const std::filesystem::path& path) {
  const std::string file = path.string();
  const auto text_of_file = [&] { return read_file(path, "an OBJ file", limits::obj_bytes); };
  std::string text = text_of_file();
  check_obj_text(text, file);
  std::istringstream stream(std::move(text));
  Polygons polygons = parse_obj(stream, file);
  stream = {};  // the text is the largest thing in memory

  std::vector<glm::uvec3> triangles;
  triangles.reserve(polygons.corners.size() - 2 * polygons.face_end.size());
  Triangulator triangulator;
  std::size_t begin = 0;
  for (std::size_t face = 0; face < polygons.face_end.size(); ++face) {
    const std::size_t end = polygons.face_end[face];
    if (!triangulator.cut(std::span(polygons.corners).subspan(begin, end - begin), polygons.positions, triangles))
      throw InputError(
          fmt::format("{}: face {}: expected a shape that can be cut into triangles in reasonable time (found one of "
                      "{} vertices that crosses itself many times); triangulate the mesh",
                      file, face + 1, end - begin));
    begin = end;
  }
  return make_mesh(file, polygons.positions, triangles, [&](std::uint32_t vertex) {
    const std::optional<std::size_t> line = line_of_vertex(text_of_file(), vertex);
    return line ? fmt::format("line {}", *line) : place_of_vertex(vertex);
  });
}

}  // namespace halfshade
