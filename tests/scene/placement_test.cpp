// Where meshes stand: matrices, and what makes them.
#include "scene/placement.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/scenes.hpp"
#include "support/temp_folder.hpp"

namespace halfshade {
namespace {

TEST(Placement, RotatesAboutFixedXThenYThenZ) {
  const glm::dmat4 m = matrix_of({.translation = {10, 20, 30}, .rotation_deg = {90, 90, 0}, .scale = {1, 2, 3}});
  // (0,1,0) is scaled to (0,2,0), rotated about x to (0,0,2), about y to (2,0,0).
  EXPECT_LE(glm::distance(glm::dvec3(m * glm::dvec4(0, 1, 0, 1)), glm::dvec3(12, 20, 30)), 1e-12);
  EXPECT_EQ(matrix_of({}), glm::dmat4(1.0));
}

TEST(Placement, OfAMeshIsOfItsOwnSpace) {
  // The library stores positions about an origin of its own; the matrix does not know.
  const std::vector<glm::dvec3> corners = {{100, 0, 0}, {101, 0, 0}, {100, 1, 0}};
  SceneMesh mesh;
  mesh.mesh = std::make_shared<Mesh>(make_mesh("corner", corners, std::vector<glm::uvec3>{{0, 1, 2}}));
  mesh.world_from_mesh = matrix_of({.translation = {0, 0, 7}, .scale = {2, 2, 2}});
  ASSERT_NE(mesh.mesh->origin, glm::dvec3(0.0));
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_EQ(glm::dvec3(world_from_local(mesh) * glm::dvec4(mesh.mesh->positions[i], 1.0)),
              2.0 * corners[i] + glm::dvec3(0, 0, 7));
}

/// Expects the box's matrix to be refused.
void refuse(const glm::dmat4& matrix, std::initializer_list<std::string_view> parts) {
  Scene scene = box_over_floor();
  scene.meshes[1].world_from_mesh = matrix;
  expect_error<InputError>([&] { validate(scene, "here"); }, {"here: meshes[1].world_from_mesh: expected "});
  expect_error<InputError>([&] { validate(scene, "here"); }, parts);
}

TEST(Placement, AMatrixThatIsNotAffineOrFlattensIsRefused) {
  for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    glm::dmat4 matrix(1.0);
    matrix[2][1] = bad;
    refuse(matrix, {"finite"});
  }
  glm::dmat4 projective(1.0);
  projective[0][3] = 0.25;
  refuse(projective, {"affine", "[0.25, 0, 0, 1]"});
  glm::dmat4 half(1.0);
  half[3][3] = 0.5;
  refuse(half, {"affine"});
  refuse(matrix_of({.rotation_deg = {20, 30, 40}, .scale = {1, 0, 1}}), {"inverted", "flatten"});
  glm::dmat4 twice(1.0);  // two axes in one direction
  twice[0] = {0.1, 0.2, 0.3, 0};
  twice[1] = {0.2, 0.4, 0.6, 0};
  refuse(twice, {"inverted"});
  refuse(glm::dmat4(0.0), {"affine"});
}

TEST(Placement, AnyUnitMirrorAndShearIsAPlace) {
  Scene scene = box_over_floor();
  const auto accept = [&](const glm::dmat4& matrix) {
    scene.meshes[1].world_from_mesh = matrix;
    EXPECT_NO_THROW(validate(scene, "here"));
  };
  accept(matrix_of({.rotation_deg = {1, 2, 3}, .scale = glm::dvec3(1e-200)}));
  accept(matrix_of({.rotation_deg = {1, 2, 3}, .scale = glm::dvec3(1e200)}));
  accept(matrix_of({.rotation_deg = {1, 2, 3}, .scale = {1e-9, 1, -1e9}}));
  glm::dmat4 sheared(1.0);
  sheared[1].x = 1000.0;
  accept(sheared);
}

// ---- animated ---------------------------------------------------------------------------------------------------------------

TEST(Placement, OfAMeshThatATrackMovesIsMadeAnewAtEachFrame) {
  Scene scene = box_over_floor();
  const Placement box{.translation = {0, 1.2, 0}, .rotation_deg = {20, 30, 10}, .scale = {1, 2, 3}};
  scene.animation.placements["box"] = box;
  scene.animation.tracks = {{"box.rotation_deg", {{1, {0, 0, 0}}, {3, {20, 40, 60}}}}};
  validate(scene, "here");
  Placement turned = box;
  turned.rotation_deg = {10, 20, 30};
  EXPECT_EQ(scene_at_frame(scene, 2).meshes[1].world_from_mesh, matrix_of(turned));
  EXPECT_EQ(scene_at_frame(scene_at_frame(scene, 1), 2).meshes[1].world_from_mesh, matrix_of(turned));
  EXPECT_EQ(scene_at_frame(scene, 2).meshes[0].world_from_mesh, scene.meshes[0].world_from_mesh) << "the floor stays";
}

TEST(Placement, ATrackOfAMeshWithoutOneIsRefused) {
  Scene scene = box_over_floor();
  scene.animation.tracks = {{"box.translation", {{1, {0, 0, 0}}}}};
  expect_error<InputError>([&] { validate(scene, "here"); },
                           {"here: animation.tracks[0].target: ", "\"box.translation\"", "Animation::placements"});
  scene.animation.placements["box"] = {.scale = {1, 0, 1}};
  expect_error<InputError>([&] { validate(scene, "here"); }, {"here: animation.placements[\"box\"].scale: ", "other than 0"});
}

TEST(Placement, FilesGiveThoseThatTheirTracksMove) {
  const TempFolder folder;
  folder.write("box.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const auto path = folder.write("scene.json", R"({
    "meshes": [{"name": "a", "path": "box.obj", "translation": [1, 2, 3], "rotation_deg": [4, 5, 6], "scale": [7, 8, 9]},
               {"name": "b", "path": "box.obj", "translation": [1, 2, 3]}],
    "camera": {"position": [0, 6, 9], "target": [0, 1, 0]},
    "animation": {"tracks": [{"target": "a.translation", "keys": [[1, [0, 0, 0]]]}]}})");
  const Scene scene = load_scene(path);
  ASSERT_EQ(scene.animation.placements.size(), 1u);
  EXPECT_EQ(scene.animation.placements.at("a").scale, glm::dvec3(7, 8, 9));
  EXPECT_EQ(scene_at_frame(scene, 1).meshes[0].world_from_mesh, matrix_of({.rotation_deg = {4, 5, 6}, .scale = {7, 8, 9}}));
}

}  // namespace
}  // namespace halfshade
