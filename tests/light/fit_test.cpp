// What a light's map covers.
#include <gtest/gtest.h>

#include "light/fit.hpp"
#include "light/light_model.hpp"
#include "scene/placement.hpp"
#include "support/scenes.hpp"

namespace halfshade {
namespace {

constexpr unsigned tile_px = 32;

std::vector<PlacedMesh> placed_meshes(const Scene& scene) {
  std::vector<PlacedMesh> out;
  for (const SceneMesh& mesh : scene.meshes) {
    PlacedMesh item;
    item.world_from_local = world_from_local(mesh);
    item.bounds = {glm::dvec3(1e300), glm::dvec3(-1e300)};
    for (const glm::vec3& p : mesh.mesh->positions) {
      item.bounds.low = glm::min(item.bounds.low, glm::dvec3(p));
      item.bounds.high = glm::max(item.bounds.high, glm::dvec3(p));
    }
    item.casts_shadow = mesh.casts_shadow;
    item.receives_shadow = mesh.receives_shadow;
    out.push_back(item);
  }
  return out;
}

LightView fit(const Scene& scene, unsigned resolution_px = 256) {
  return fit_light_view(scene.lights[0], placed_meshes(scene), resolution_px, tile_px);
}

void expect_near(const glm::dvec3& a, const glm::dvec3& b, double tolerance = 1e-12) {
  EXPECT_LE(glm::distance(a, b), tolerance) << a.x << " " << a.y << " " << a.z;
}

TEST(LightView, RotationIsAboutFixedXThenYThenZ) {
  SceneMesh mesh = placed("box", box_mesh(), {10, 20, 30}, {1, 2, 3}, {90, 90, 0});
  // (0,1,0) is scaled to (0,2,0), turned about x to (0,0,2), about y to (2,0,0).
  expect_near(glm::dvec3(world_from_local(mesh) * glm::dvec4(0, 1, 0, 1)), {12, 20, 30});
}

TEST(LightView, LightSpaceIsRightUpForward) {
  Light light;
  light.position = {1, 2, 3};
  light.target = {1, 2, -5};
  const Frustum frustum = light_frustum(light);
  expect_near(glm::dvec3(frustum.view_from_world * glm::dvec4(1, 2, -4, 1)), {0, 0, 7});
  expect_near(glm::dvec3(frustum.view_from_world * glm::dvec4(4, 2, 3, 1)), {3, 0, 0});
  expect_near(glm::dvec3(frustum.view_from_world * glm::dvec4(1, 7, 3, 1)), {0, 5, 0});
}

TEST(LightView, UpIsZForLightsThatLookAlongY) {
  Light light;
  light.position = {0, 5, 0};
  light.target = {0, 0, 0};
  const Frustum down = light_frustum(light);
  expect_near(glm::dvec3(down.view_from_world * glm::dvec4(0, 0, 1, 0)), {0, 1, 0}, 1e-9);
  light.up = glm::dvec3(1, 0, 0);
  expect_near(glm::dvec3(light_frustum(light).view_from_world * glm::dvec4(1, 0, 0, 0)), {0, 1, 0}, 1e-9);
}

TEST(LightView, TheMapCoversTheCastersAndTheirPenumbrae) {
  const Scene scene = box_over_floor();
  const LightView fitted = fit(scene);
  ASSERT_EQ(fitted.casters, std::vector<std::uint32_t>{1}) << "the floor is flat and has nothing behind it";
  EXPECT_LE(fitted.view.width_px, 256u);
  EXPECT_LE(fitted.view.height_px, 256u);
  const glm::dmat4 light_from_box = fitted.frustum.view_from_world * world_from_local(scene.meshes[1]);
  for (const glm::vec3& p : scene.meshes[1].mesh->positions) {
    const glm::dvec3 p_ls = light_from_box * glm::dvec4(p, 1);
    EXPECT_GE(p_ls.z, fitted.znear);
    EXPECT_LE(p_ls.z, fitted.zfar);
    const double x = (p_ls.x / p_ls.z - fitted.lm_from_px_origin.x) / fitted.lm_from_px_scale;
    const double y = (fitted.lm_from_px_origin.y - p_ls.y / p_ls.z) / fitted.lm_from_px_scale;
    const double penumbra = fitted.radius * (1 / p_ls.z - 1 / fitted.zfar) / fitted.lm_from_px_scale;
    EXPECT_GE(x - penumbra, 0);
    EXPECT_GE(y - penumbra, 0);
    EXPECT_LE(x + penumbra, fitted.view.width_px);
    EXPECT_LE(y + penumbra, fitted.view.height_px);
    EXPECT_NEAR(p_ls.x / p_ls.z * fitted.view.px_from_q.s[0] + fitted.view.px_from_q.s[1], x, 1e-3);
    EXPECT_NEAR(p_ls.y / p_ls.z * fitted.view.px_from_q.s[2] + fitted.view.px_from_q.s[3], y, 1e-3);
  }
}

TEST(LightView, AFloorThatReachesBehindTheLightIsNotTheNearestCaster) {
  Scene scene = box_over_floor();
  scene.meshes[0].world_from_mesh = matrix_of({.scale = glm::dvec3(1000)});
  const LightView fitted = fit(scene);
  const glm::dmat4 light_from_box = fitted.frustum.view_from_world * world_from_local(scene.meshes[1]);
  double nearest = 1e300;
  for (const glm::vec3& p : scene.meshes[1].mesh->positions) nearest = std::min(nearest, (light_from_box * glm::dvec4(p, 1)).z);
  // What the map shows of the floor is nearer than the box's corners can be, but not as near as the light's plane.
  EXPECT_LE(fitted.znear, nearest);
  EXPECT_GE(fitted.znear, 0.5 * nearest);
  EXPECT_LE(fitted.casters_znear, nearest);
  EXPECT_GE(fitted.casters_znear, 0.98 * nearest);
}

TEST(LightView, WithoutCastersOrReceiversInReachThereIsNothingToDo) {
  Scene scene = box_over_floor();
  scene.meshes[1].casts_shadow = false;
  EXPECT_TRUE(fit(scene).casters.empty());
  scene = box_over_floor();
  scene.meshes[0].receives_shadow = scene.meshes[1].receives_shadow = false;
  EXPECT_TRUE(fit(scene).casters.empty());
  scene = box_over_floor();
  scene.lights[0].target = {2, 20, 1.5};  // looks up
  EXPECT_TRUE(fit(scene).casters.empty());
  scene.meshes.clear();
  EXPECT_TRUE(fit(scene).casters.empty());
}

TEST(LightView, AFloorWithSomethingBelowCasts) {
  Scene scene = box_over_floor();
  scene.meshes.push_back(placed("below", box_mesh(), {0, -2, 0}, glm::dvec3(1)));
  const std::vector<std::uint32_t> casters = fit(scene).casters;
  EXPECT_NE(std::find(casters.begin(), casters.end(), 0u), casters.end());
}

TEST(LightView, SmallMovesLeaveTheTexelGridWhereItIs) {
  Scene scene = box_over_floor();
  const LightView before = fit(scene);
  int kept = 0;
  for (int i = 0; i < 40; ++i) {
    move_by(scene.meshes[1], {0.002, 0, 0});
    const LightView after = fit(scene);
    if (after.lm_from_px_scale != before.lm_from_px_scale) continue;
    ++kept;
    // The corner is a whole number of texels.
    EXPECT_NEAR(std::remainder(after.lm_from_px_origin.x, after.lm_from_px_scale), 0.0, 1e-12);
    EXPECT_NEAR(std::remainder(after.lm_from_px_origin.y, after.lm_from_px_scale), 0.0, 1e-12);
  }
  EXPECT_GT(kept, 20);
}

TEST(LightView, AMapHasAtLeastTwoTexelsASide) {
  const LightView fitted = fit(box_over_floor(), 1);
  EXPECT_EQ(fitted.view.width_px, 2u);
  EXPECT_EQ(fitted.view.height_px, 2u);
}

TEST(LightView, FarFromTheOriginTheViewIsTheSame) {
  Scene scene = box_over_floor();
  const LightView here = fit(scene);
  const glm::dvec3 away(1e6, -2e6, 3e6);
  for (SceneMesh& mesh : scene.meshes) move_by(mesh, away);
  scene.lights[0].position += away;
  scene.lights[0].target += away;
  const LightView there = fit(scene);
  EXPECT_EQ(there.view.width_px, here.view.width_px);
  EXPECT_EQ(there.view.height_px, here.view.height_px);
  EXPECT_NEAR(there.znear, here.znear, 1e-6);
  EXPECT_NEAR(there.zfar, here.zfar, 1e-6);
}

}  // namespace
}  // namespace halfshade
