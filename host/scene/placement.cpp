#include "scene/placement.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

namespace halfshade {
namespace {

/// Three directions that span less volume than this of a cube's are taken for a plane's or a line's: rounding leaves about 1e-16.
constexpr double min_volume = 1e-12;

/// The volume that a matrix's axes span, as a part of what they would if they were orthogonal; 0 where an axis is 0. Whatever
/// their lengths: a scene may be in any unit.
double relative_volume(const glm::dmat3& axes) {
  glm::dmat3 unit;
  for (int i = 0; i < 3; ++i) {
    const double largest = std::max({std::abs(axes[i].x), std::abs(axes[i].y), std::abs(axes[i].z)});
    if (largest == 0.0) return 0.0;
    unit[i] = glm::normalize(axes[i] / largest);
  }
  return std::abs(glm::determinant(unit));
}

std::string shown_rows(const glm::dmat4& m, int count) {
  std::string text;
  for (int row = 0; row < count; ++row)
    text += fmt::format("{}[{}, {}, {}, {}]", row > 0 ? ", " : "", m[0][row], m[1][row], m[2][row], m[3][row]);
  return text;
}

}  // namespace

glm::dmat4 matrix_of(const Placement& placement) {
  glm::dmat4 m = glm::translate(glm::dmat4(1.0), placement.translation);
  m = glm::rotate(m, glm::radians(placement.rotation_deg.z), glm::dvec3(0, 0, 1));
  m = glm::rotate(m, glm::radians(placement.rotation_deg.y), glm::dvec3(0, 1, 0));
  m = glm::rotate(m, glm::radians(placement.rotation_deg.x), glm::dvec3(1, 0, 0));
  return glm::scale(m, placement.scale);
}

glm::dmat4 world_from_local(const SceneMesh& mesh) {
  return glm::translate(mesh.world_from_mesh, mesh.mesh->origin);
}

void check(const Checker& at, const Placement& placement) {
  at.finite("translation", placement.translation);
  at.finite("rotation_deg", placement.rotation_deg);
  at.scale("scale", placement.scale);
}

void check_matrix(const Checker& at, std::string_view member, const glm::dmat4& m) {
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 4; ++row)
      if (!std::isfinite(m[column][row])) at.fail(member, "a matrix of finite numbers", "rows " + shown_rows(m, 4));
  for (int column = 0; column < 4; ++column)
    if (m[column][3] != (column == 3 ? 1.0 : 0.0))
      at.fail(member, "an affine matrix, whose last row is [0, 0, 0, 1]", "rows " + shown_rows(m, 4));
  if (!(relative_volume(glm::dmat3(m)) > min_volume))
    at.fail(member, "a matrix that can be inverted: it must not flatten the mesh", "rows " + shown_rows(m, 3));
}

}  // namespace halfshade
