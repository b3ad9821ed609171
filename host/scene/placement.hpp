// Where meshes stand.
#pragma once

#include <optional>
#include <string>

#include "halfshade/halfshade.hpp"
#include "scene/checker.hpp"

namespace halfshade {

/// From a mesh's stored positions, which are relative to Mesh::origin, to the world.
glm::dmat4 world_from_local(const SceneMesh& mesh);

/// Throws InputError for a placement that is not finite or has a scale of 0.
void check(const Checker& at, const Placement& placement);

/// Throws InputError for a matrix that is not finite, affine and invertible.
void check_matrix(const Checker& at, std::string_view member, const glm::dmat4& matrix);

}  // namespace halfshade
