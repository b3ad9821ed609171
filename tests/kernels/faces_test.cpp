// Which side a face turns to the light, and its normal.
#include <algorithm>
#include <random>

#include "support/kernel_fixture.hpp"

namespace halfshade {
namespace {

using Faces = KernelTest;
using Triangles = std::vector<std::array<cl_uint, 3>>;

std::vector<cl_float4> float4s(const std::vector<glm::vec3>& points) {
  std::vector<cl_float4> out;
  for (const glm::vec3& p : points) out.push_back({{p.x, p.y, p.z, 0}});
  return out;
}

std::vector<cl_uchar> orient(const KernelRunner& runner, const std::vector<glm::vec3>& points, const Triangles& triangles) {
  const Blocks blocks = blocks_of(runner, static_cast<std::uint32_t>(triangles.size()));
  const Buffer<cl_uchar> sides = runner.filled(triangles.size(), cl_uchar{9});
  runner.launcher.launch_blocks(blocks, kernels::OrientFaces{.blocks = blocks.blocks,
                                                             .triangles = runner.buffer<cl_uint>(triangles),
                                                             .vertices_ls = runner.buffer<cl_float4>(float4s(points)),
                                                             .sides = sides});
  return runner.read<cl_uchar>(sides, triangles.size());
}

std::vector<glm::vec4> normals(const KernelRunner& runner, const HsView& view, const std::vector<glm::vec3>& points,
                               const Triangles& triangles, float receives = 1.0f) {
  const Blocks blocks = blocks_of(runner, static_cast<std::uint32_t>(triangles.size()));
  const Buffer<cl_float4> out = runner.filled(triangles.size(), cl_float4{{9, 9, 9, 9}});
  runner.launcher.launch_blocks(
      blocks, kernels::FaceNormals{.view = view,
                                   .blocks = blocks.blocks,
                                   .rects = runner.filled(blocks.slots(), cl_ushort4{{0, 0, 1, 1}}),  // all touch a tile
                                   .triangles = runner.buffer<cl_uint>(triangles),
                                   .vertices_vs = runner.buffer<cl_float4>(float4s(points)),
                                   .materials = runner.filled(1, cl_float4{{1, 1, 1, receives}}),
                                   .normals = out});
  return runner.read<glm::vec4>(out, triangles.size());
}

TEST_F(Faces, SideIsTheSignOfTheNormalTowardsTheLight) {
  // (1,0,0) x (0,1,0) = (0,0,1), away from the light at the origin.
  const std::vector<glm::vec3> points = {{0, 0, 5}, {1, 0, 5}, {0, 1, 5}};
  EXPECT_EQ(orient(runner_, points, {{0, 1, 2}, {0, 2, 1}}), (std::vector<cl_uchar>{0, 1}));
}

TEST_F(Faces, DoesNotDependOnWhereTheCornerListBegins) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> coordinate(-1, 1);
  std::vector<glm::vec3> points;
  Triangles triangles;
  const int count = 3000;
  for (cl_uint i = 0; i < count; ++i) {
    // Every other face is nearly edge-on: its plane passes within rounding of the light, far away.
    glm::vec3 a{coordinate(random), coordinate(random), coordinate(random)},
        b{coordinate(random), coordinate(random), coordinate(random)};
    const float s = coordinate(random), t = coordinate(random);
    glm::vec3 c = i % 2 ? a * s + b * t : glm::vec3{coordinate(random), coordinate(random), coordinate(random)};
    const float far = i % 4 < 2 ? 1.0f : 1000.0f;
    for (const glm::vec3& p : {a, b, c}) points.push_back(p * far);
    triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const std::vector<cl_uchar> sides = orient(runner_, points, triangles);
  EXPECT_GT(std::count(sides.begin(), sides.end(), 0), count / 4);
  EXPECT_GT(std::count(sides.begin(), sides.end(), 1), count / 4);
  Triangles turned = triangles;
  for (int turn = 0; turn < 2; ++turn) {
    for (auto& t : turned) std::rotate(t.begin(), t.begin() + 1, t.end());
    EXPECT_EQ(orient(runner_, points, turned), sides);
  }
}

TEST_F(Faces, ReversedWindingTurnsTheOtherSide) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> coordinate(-1, 1);
  std::vector<glm::vec3> points;
  Triangles forward, reversed;
  for (cl_uint i = 0; i < 1000; ++i) {
    for (int k = 0; k < 3; ++k) points.push_back(glm::vec3{coordinate(random), coordinate(random), coordinate(random) + 2});
    forward.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    reversed.push_back({3 * i + 2, 3 * i + 1, 3 * i});
  }
  const auto a = orient(runner_, points, forward), b = orient(runner_, points, reversed);
  for (int i = 0; i < 1000; ++i) EXPECT_NE(a[i], b[i]) << i;
}

TEST_F(Faces, ExactlyEdgeOnIsOneSideOnly) {
  const std::vector<glm::vec3> points = {{0, 0, 1}, {0, 1, 2}, {0, -1, 3}};  // in the plane x = 0 through the light
  EXPECT_EQ(orient(runner_, points, {{0, 1, 2}, {1, 2, 0}, {2, 1, 0}}), (std::vector<cl_uchar>{1, 1, 1}));
}

TEST_F(Faces, NormalsAreUnitAndTurnedToTheViewer) {
  const HsView view = straight_view(*runner_.device, {16, 16}, 8.0f);
  const std::vector<glm::vec3> points = {{0, 0, 5}, {1, 0, 5}, {0, 1, 5}, {-2, -1, 3}, {2, -1, 3}, {0, -1, 9}};
  const auto out = normals(runner_, view, points, {{0, 1, 2}, {2, 1, 0}, {3, 4, 5}, {4, 3, 5}});
  EXPECT_EQ(out[0], glm::vec4(0, 0, -1, 1));
  EXPECT_EQ(out[1], glm::vec4(0, 0, -1, 1));
  EXPECT_EQ(out[2], glm::vec4(0, 1, 0, 1));  // a floor below the viewer
  EXPECT_EQ(out[3], glm::vec4(0, 1, 0, 1));
}

TEST_F(Faces, NormalsAreInWorldSpace) {
  HsView view = straight_view(*runner_.device, {16, 16}, 8.0f);
  view.world_from_view_x = {{0, 1, 0, 0}};  // view x, y, z are world y, z, x
  view.world_from_view_y = {{0, 0, 1, 0}};
  view.world_from_view_z = {{1, 0, 0, 0}};
  EXPECT_EQ(normals(runner_, view, {{0, 0, 5}, {1, 0, 5}, {0, 1, 5}}, {{0, 1, 2}}, 0.0f)[0], glm::vec4(-1, 0, 0, 0));
}

TEST_F(Faces, TinyAndDegenerateFacesHaveNoWildNormals) {
  const HsView view = straight_view(*runner_.device, {16, 16}, 8.0f);
  const float s = 1e-18f;
  const std::vector<glm::vec3> points = {{0, 0, s}, {s, 0, s}, {0, s, s}, {0, 0, 1}, {1, 1, 2}, {2, 2, 3}};
  const auto out = normals(runner_, view, points, {{0, 1, 2}, {3, 4, 5}, {3, 3, 4}});
  EXPECT_EQ(out[0], glm::vec4(0, 0, -1, 1));
  EXPECT_EQ(out[1], glm::vec4(0, 0, 0, 1));
  EXPECT_EQ(out[2], glm::vec4(0, 0, 0, 1));
}

}  // namespace
}  // namespace halfshade
