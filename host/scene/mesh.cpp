// Meshes: Wavefront OBJ text to checked polygons, polygons to triangles, triangles to welded geometry about a local origin.
//
// tinyobjloader parses the file, but says nothing about much of what can be wrong with one: indices out of range, `nan` (read as
// 0), `1,5` (read as 1), a bare `v` (skipped, which shifts every later index). So the text is checked first, line by line, and
// only what passes is parsed. Material libraries are never opened.
#define TINYOBJLOADER_USE_DOUBLE
#include <fmt/format.h>
#include <tiny_obj_loader.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <sstream>
#include <tuple>

#include "halfshade/halfshade.hpp"
#include "scene/read_file.hpp"

namespace halfshade {
namespace {

/// Vertices, and corners of triangles, that a mesh may have: offsets and (face << 1 | bit) must fit into 32 bits.
constexpr std::size_t max_elements = std::size_t{1} << 31;

/// Cutting the corners off one by one takes time that grows with their square, or worse.
constexpr std::size_t max_concave_corners = 4096;

bool is_blank(char c) {
  return c == ' ' || c == '\t';
}

/// Takes the next word off the front of `rest`; empty at the end.
std::string_view next_word(std::string_view& rest) {
  std::size_t begin = 0;
  while (begin < rest.size() && is_blank(rest[begin])) ++begin;
  std::size_t end = begin;
  while (end < rest.size() && !is_blank(rest[end])) ++end;
  const std::string_view word = rest.substr(begin, end - begin);
  rest.remove_prefix(end);
  return word;
}

/// `word` as a message can show it: on one line and not too long.
std::string shown(std::string_view word) {
  if (word.empty()) return "the end of the line";
  std::string text(word.substr(0, 40));
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < 0x20 || c > 0x7e; }, '?');
  return fmt::format("\"{}{}\"", text, word.size() > 40 ? "..." : "");
}

bool is_finite_number(std::string_view word) {
  if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
  const char* const word_end = word.data() + word.size();
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word_end, value);
  if (error == std::errc::result_out_of_range) {
    // Too large, or too small to tell from 0, which is fine.
    long double wide = 1.0L;
    return std::from_chars(word.data(), word_end, wide).ptr == word_end && std::abs(wide) < 1.0L;
  }
  return error == std::errc{} && end == word_end && std::isfinite(value);
}

/// The vertex index that begins a face's corner: `7`, `7/1`, `7//3` or `7/1/3`. 0, which OBJ does not use, where there is none.
std::int64_t vertex_index_of(std::string_view corner) {
  std::int64_t index = 0;
  const char* const corner_end = corner.data() + corner.size();
  const auto [end, error] = std::from_chars(corner.data(), corner_end, index);
  if (error != std::errc{} || (end != corner_end && *end != '/')) return 0;
  const bool rest_is_indices =
      std::all_of(end, corner_end, [](char c) { return c == '/' || c == '-' || (c >= '0' && c <= '9'); });
  return rest_is_indices ? index : 0;
}

/// Throws InputError for the first line of OBJ text that would not be read as it is meant. What the pipeline has no use for
/// (normals, texture coordinates, groups, materials, a fourth number of a vertex) is not looked at.
void check_obj_text(std::string_view text, const std::string& file) {
  if (text.empty()) throw InputError(fmt::format("{}: expected an OBJ file (found an empty file)", file));
  if (text.find('\0') != std::string_view::npos) {
    throw InputError(fmt::format("{}: expected an OBJ file, which is text (found binary data); convert it to OBJ", file));
  }

  std::size_t line_number = 0;
  std::int64_t vertex_count = 0;
  std::size_t face_count = 0;
  // Faces may come before their vertices, so the greatest index can only be judged at the end.
  std::int64_t greatest_index = 0;
  std::size_t greatest_index_line = 0;
  const auto fail = [&](std::string_view expected, std::string_view found) {
    throw InputError(fmt::format("{}: line {}: expected {} (found {})", file, line_number, expected, found));
  };

  for (std::size_t begin = 0; begin < text.size();) {
    std::size_t end = begin;
    while (end < text.size() && text[end] != '\n' && text[end] != '\r') ++end;
    std::string_view line = text.substr(begin, end - begin);
    begin = end + (text.substr(end, 2) == "\r\n" ? 2 : 1);
    ++line_number;

    const std::string_view keyword = next_word(line);
    if (keyword == "v") {
      for (int i = 0; i < 3; ++i) {
        const std::string_view word = next_word(line);
        if (!is_finite_number(word)) fail("three finite numbers after v", shown(word));
      }
      ++vertex_count;
    } else if (keyword == "f") {
      std::size_t corner_count = 0;
      for (std::string_view word; !(word = next_word(line)).empty(); ++corner_count) {
        if (word == "\\") fail("a face on one line", "a continued line; join the lines");
        const std::int64_t index = vertex_index_of(word);
        if (index == 0) fail("vertex indices after f, counted from 1 (or from -1 backwards)", shown(word));
        if (index < -vertex_count) {
          fail(fmt::format("a relative index no lower than -{}, the vertices so far", vertex_count), shown(word));
        }
        if (index > greatest_index) std::tie(greatest_index, greatest_index_line) = std::tuple(index, line_number);
      }
      if (corner_count < 3) fail("at least three vertices after f", fmt::format("{}", corner_count));
      ++face_count;
    }
  }

  if (greatest_index > vertex_count) {
    line_number = greatest_index_line;
    fail(fmt::format("a vertex index no higher than {}, the vertices in the file", vertex_count),
         fmt::format("{}", greatest_index));
  }
  if (face_count == 0) {
    throw InputError(fmt::format("{}: expected faces (found {} vertices and no f line); is it an OBJ file?", file, vertex_count));
  }
}

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

/// Cuts polygons into triangles. A polygon of n corners always gives n - 2 triangles that keep its sides and its winding,
/// whatever its shape, so that neighbours stay joined. (tinyobjloader's own triangulation depends on where the origin is.)
class Triangulator {
 public:
  /// Appends the triangles of one polygon. Throws InputError where it is too large to cut.
  void cut(std::span<const std::uint32_t> corners, std::span<const glm::dvec3> positions, std::vector<glm::uvec3>& triangles,
           const std::string& file) {
    const std::size_t count = corners.size();
    if (count > 3) flatten(corners, positions);
    if (count == 3 || is_strictly_convex()) {
      for (std::size_t i = 2; i < count; ++i) triangles.emplace_back(corners[0], corners[i - 1], corners[i]);
      return;
    }
    if (count > max_concave_corners) {
      throw InputError(fmt::format("{}: expected concave faces of at most {} vertices (found {}); triangulate the mesh", file,
                                   max_concave_corners, count));
    }
    cut_ears(corners, triangles);
  }

 private:
  /// Projects the corners along the axis that the polygon faces most, so that it runs counter-clockwise in `flat_`.
  void flatten(std::span<const std::uint32_t> corners, std::span<const glm::dvec3> positions) {
    // Newell's normal, about the first corner for the sake of meshes far from the origin.
    const glm::dvec3 first = positions[corners[0]];
    glm::dvec3 normal(0.0);
    for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
      normal += glm::cross(positions[corners[i]] - first, positions[corners[i + 1]] - first);
    }
    const glm::dvec3 size = glm::abs(normal);
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    int u = (axis + 1) % 3, v = (axis + 2) % 3;
    if (normal[axis] < 0.0) std::swap(u, v);
    flat_.clear();
    for (const std::uint32_t corner : corners) {
      const glm::dvec3 p = positions[corner] - first;
      flat_.emplace_back(p[u], p[v]);
    }
  }

  /// Twice the signed area: positive where c lies left of a -> b.
  static double turn(glm::dvec2 a, glm::dvec2 b, glm::dvec2 c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }

  bool is_strictly_convex() const {
    const std::size_t count = flat_.size();
    for (std::size_t i = 0; i < count; ++i) {
      if (!(turn(flat_[i], flat_[(i + 1) % count], flat_[(i + 2) % count]) > 0.0)) return false;
    }
    return true;
  }

  /// Whether a, b, c can be cut off: a left turn with no other corner in it.
  bool is_ear(glm::dvec2 a, glm::dvec2 b, glm::dvec2 c) const {
    if (!(turn(a, b, c) > 0.0)) return false;
    return std::ranges::none_of(remaining_, [&](std::uint32_t i) {
      const glm::dvec2 p = flat_[i];
      if (p == a || p == b || p == c) return false;
      return turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
    });
  }

  void cut_ears(std::span<const std::uint32_t> corners, std::vector<glm::uvec3>& triangles) {
    remaining_.resize(corners.size());
    for (std::uint32_t i = 0; i < corners.size(); ++i) remaining_[i] = i;
    std::size_t at = 0, misses = 0;
    while (remaining_.size() >= 3) {
      const std::size_t count = remaining_.size();
      const std::uint32_t a = remaining_[(at + count - 1) % count], b = remaining_[at], c = remaining_[(at + 1) % count];
      // Where nothing is an ear the polygon crosses itself or has no area: any corner will do.
      if (count == 3 || misses == count || is_ear(flat_[a], flat_[b], flat_[c])) {
        triangles.emplace_back(corners[a], corners[b], corners[c]);
        remaining_.erase(remaining_.begin() + static_cast<std::ptrdiff_t>(at));
        misses = 0;
      } else {
        ++at;
        ++misses;
      }
      if (at >= remaining_.size()) at = 0;
    }
  }

  std::vector<glm::dvec2> flat_;
  std::vector<std::uint32_t> remaining_;
};

/// For every vertex the first one at the same place, by position relative to `origin` in single precision. Equality is judged
/// after rounding, because two vertices that the pipeline cannot tell apart must not be the two sides of a crack.
/// Vertices that are not `used` are left out: they have place 0 and stand for themselves.
struct Places {
  std::vector<glm::vec3> relative;
  std::vector<std::uint32_t> first_here;
};

Places find_places(std::span<const glm::dvec3> positions, const std::vector<bool>& used, glm::dvec3 origin,
                   const std::string& name) {
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
      throw InputError(
          fmt::format("{}: vertex {}: expected a mesh that fits into single precision (found [{}, {}, {}]); scale it", name, i,
                      positions[i].x, positions[i].y, positions[i].z));
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

}  // namespace

Mesh make_mesh(std::string name, std::span<const glm::dvec3> positions, std::span<const glm::uvec3> triangles) {
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
  const Places places = find_places(positions, used, mesh.origin, name);

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

Mesh load_obj(const std::filesystem::path& path) {
  const std::string file = path.string();
  std::string text = read_file(path, "an OBJ file");
  if (text.starts_with("\xef\xbb\xbf")) text.replace(0, 3, "   ");  // a byte order mark would hide the first line's keyword
  std::istringstream stream(std::move(text));
  check_obj_text(stream.view(), file);
  Polygons polygons = parse_obj(stream, file);
  stream = {};  // the text is the largest thing in memory

  std::vector<glm::uvec3> triangles;
  triangles.reserve(polygons.corners.size() - 2 * polygons.face_end.size());
  Triangulator triangulator;
  std::size_t begin = 0;
  for (const std::size_t end : polygons.face_end) {
    triangulator.cut(std::span(polygons.corners).subspan(begin, end - begin), polygons.positions, triangles, file);
    begin = end;
  }
  return make_mesh(file, polygons.positions, triangles);
}

}  // namespace halfshade
