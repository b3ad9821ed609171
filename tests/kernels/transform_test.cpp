// Vertices into fixed point: values that can be worked out by hand.
#include <limits>

#include "support/view_passes.hpp"

namespace halfshade {
namespace {

using Transform = KernelTest;

constexpr float infinity = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
constexpr cl_int fine = 0, needs_clip = HS_VERTEX_NEEDS_CLIP, invalid = HS_VERTEX_INVALID;

struct Transformed {
  std::vector<cl_float4> vs;
  std::vector<cl_int4> px;
};

Transformed transform(const KernelRunner& runner, const HsView& view, const std::vector<glm::vec3>& positions,
                      const Blocks& blocks, const std::vector<HsTransform>& transforms) {
  const Buffer<cl_float4> vs = runner.filled(positions.size(), cl_float4{});
  const Buffer<cl_int4> px = runner.filled(positions.size(), cl_int4{{-7, -7, -7, -7}});
  runner.launcher.launch_blocks(blocks, kernels::Transform{.view = view,
                                                           .blocks = blocks.blocks,
                                                           .transforms = runner.buffer<HsTransform>(transforms),
                                                           .positions = runner.buffer<cl_float>(positions),
                                                           .vertices_vs = vs,
                                                           .vertices_px = px});
  return {runner.read<cl_float4>(vs, positions.size()), runner.read<cl_int4>(px, positions.size())};
}

Transformed transform(const KernelRunner& runner, const HsView& view, const std::vector<glm::vec3>& positions) {
  return transform(runner, view, positions, blocks_of(runner, static_cast<std::uint32_t>(positions.size())),
                   {identity_transform()});
}

float inverse_z(const cl_int4& px) {
  float d;
  std::memcpy(&d, &px.s[2], sizeof d);
  return d;
}

TEST_F(Transform, SnapsToTheFixedPointGrid) {
  const HsView view = straight_view(*runner_.device, {64, 64}, 32.0f);
  const Transformed out = transform(runner_, view, {{1, 2, 4}, {0, 0, 1}, {-1, -0.5f, 0.5f}});
  EXPECT_EQ(out.px[0].s[0], 8 * 256);    // q = (1/4, 1/2): 8 texels right of the middle,
  EXPECT_EQ(out.px[0].s[1], -16 * 256);  // and 16 above it; rows count downwards
  EXPECT_EQ(inverse_z(out.px[0]), 0.25f);
  EXPECT_EQ(out.px[0].s[3], fine);
  EXPECT_EQ(out.vs[0].s[0], 1.0f);
  EXPECT_EQ(out.vs[0].s[1], 2.0f);
  EXPECT_EQ(out.vs[0].s[2], 4.0f);
  EXPECT_EQ(out.vs[0].s[3], 0.25f);
  EXPECT_EQ(out.px[1].s[0], 0);
  EXPECT_EQ(out.px[1].s[1], 0);
  EXPECT_EQ(out.px[2].s[0], -64 * 256);
  EXPECT_EQ(out.px[2].s[1], 32 * 256);
}

TEST_F(Transform, RoundsToNearestEven) {
  const HsView view = straight_view(*runner_.device, {64, 64}, 1.0f);
  const Transformed out =
      transform(runner_, view, {{0.5f / 256, 1.5f / 256, 1}, {2.5f / 256, 1.25f / 256, 1}, {-0.75f / 256, -1.5f / 256, 1}});
  EXPECT_EQ(out.px[0].s[0], 0);
  EXPECT_EQ(out.px[0].s[1], -2);
  EXPECT_EQ(out.px[1].s[0], 2);
  EXPECT_EQ(out.px[1].s[1], -1);
  EXPECT_EQ(out.px[2].s[0], -1);
  EXPECT_EQ(out.px[2].s[1], 2);
}

TEST_F(Transform, MarksWhatLiesBeforeTheNearPlane) {
  const HsView view = straight_view(*runner_.device, {64, 64}, 32.0f, 0.5f);
  const Transformed out =
      transform(runner_, view, {{0, 0, 0.5f}, {0, 0, std::nextafter(0.5f, 0.0f)}, {0, 0, 0}, {1, 1, -3}, {0, 0, 1e30f}});
  EXPECT_EQ(out.px[0].s[3], fine);
  EXPECT_EQ(out.px[1].s[3], needs_clip);
  EXPECT_EQ(out.px[2].s[3], needs_clip);
  EXPECT_EQ(out.px[3].s[3], needs_clip);
  EXPECT_EQ(out.px[4].s[3], fine);
}

TEST_F(Transform, MarksWhatLiesOutsideTheGuardBand) {
  const HsView view = straight_view(*runner_.device, {64, 64}, 1.0f);
  const float guard = HS_GUARD_PX, beyond = std::nextafter(guard, 1e9f);
  const Transformed out = transform(
      runner_, view, {{guard, 0, 1}, {beyond, 0, 1}, {-guard, guard, 1}, {-beyond, 0, 1}, {0, -beyond, 1}, {0, 1e30f, 1}});
  EXPECT_EQ(out.px[0].s[3], fine);
  EXPECT_EQ(out.px[0].s[0], HS_GUARD_PX * 256);
  EXPECT_EQ(out.px[1].s[3], needs_clip);
  EXPECT_EQ(out.px[2].s[3], fine);
  EXPECT_EQ(out.px[3].s[3], needs_clip);
  EXPECT_EQ(out.px[4].s[3], needs_clip);
  EXPECT_EQ(out.px[5].s[3], needs_clip);
}

TEST_F(Transform, MarksWhatIsNotFinite) {
  const HsView view = straight_view(*runner_.device, {64, 64}, 32.0f);
  const Transformed out = transform(runner_, view, {{nan, 0, 1}, {0, infinity, 1}, {0, 0, -infinity}, {0, 0, 1}});
  EXPECT_EQ(out.px[0].s[3], invalid);
  EXPECT_EQ(out.px[1].s[3], invalid);
  EXPECT_EQ(out.px[2].s[3], invalid);
  EXPECT_EQ(out.px[3].s[3], fine);
}

TEST_F(Transform, MarksWhatTheTransformMakesInfinite) {
  const HsView view = straight_view(*runner_.device, {64, 64}, 32.0f);
  for (int axis = 0; axis < 3; ++axis) {
    glm::dmat4 large(1.0);
    large[axis][axis] = 1e30;
    glm::vec3 p(0, 0, 1);
    p[axis] = 1e20f;
    EXPECT_EQ(transform(runner_, view, {p}, blocks_of(runner_, 1), {transform_rows(large)}).px[0].s[3], invalid)
        << "axis " << axis;
  }
}

TEST_F(Transform, EachBlockIsPlacedByItsMesh) {
  const HsView view = straight_view(*runner_.device, {64, 64}, 1.0f);
  glm::dmat4 moved(1.0);
  moved[3] = {3, 0, 0, 1};
  const std::vector<glm::vec3> positions(300, {1, 0, 1});  // of which 0 .. 2 and 259 .. 298 are launched
  const Transformed out = transform(runner_, view, positions, blocks_of(runner_, {{0, 3, 1, 0}, {259, 40, 0, 0}}),
                                    {identity_transform(), transform_rows(moved)});
  for (int i = 0; i < 300; ++i) EXPECT_EQ(out.px[i].s[0], i < 3 ? 4 * 256 : i >= 259 && i < 299 ? 256 : -7) << "vertex " << i;
}

TEST_F(Transform, TrianglesWithAVertexThatIsNotFiniteAreDroppedAndCounted) {
  Mesh mesh;
  mesh.positions = {{-1, -1, 2}, {1, -1, 2}, {0, 1, 2}, {nan, 0, 2}, {0, infinity, 2}};
  mesh.triangles = {{0, 1, 2}, {0, 1, 3}, {4, 1, 2}, {2, 3, 4}};
  ViewPasses passes(runner_, straight_view(*runner_.device, {16, 16}, 8.0f), mesh);
  EXPECT_EQ(passes.read_status().dropped_triangle_count, 3u);
  Mesh only_good = mesh;
  only_good.positions.resize(3);
  only_good.triangles.resize(1);
  EXPECT_EQ(passes.shadow_map(), ViewPasses(runner_, straight_view(*runner_.device, {16, 16}, 8.0f), only_good).shadow_map());
}

}  // namespace
}  // namespace halfshade
