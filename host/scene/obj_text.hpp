// The text of Wavefront OBJ files, made fit for the parser.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

namespace halfshade {

/// Throws InputError, with `file` and line, for OBJ text that would not be read as it is meant: what the parser gets wrong
/// without a word (indices out of range, `3/1/1/1`, `nan`, `1,5`, a bare `v`) and what is beyond limits.hpp. What the pipeline
/// has no use for (normals, texture coordinates, groups, materials, a fourth number of a vertex) is not looked at. What the
/// parser would stumble over is blanked: a byte order mark, backslashes that continue a line with the line ends after them, and
/// comments after vertices and faces.
void check_obj_text(std::string& text, const std::string& file);

/// The line, counted from 1, of a vertex, counted from 0, in text that has not been blanked yet.
std::optional<std::size_t> line_of_vertex(const std::string& text, std::size_t vertex);

}  // namespace halfshade
