// Structs that host and kernels share: sizes and offsets as the device has them.
#include <cstddef>

#include "device/embedded_kernels.hpp"
#include "support/kernel_fixture.hpp"

namespace halfshade {
namespace {

using Shared = KernelTest;

// Each member once; the same list is read by the host compiler and, as text, by the device's.
// clang-format off
#define HS_SHARED_MEMBERS(S, M) \
  S(HsBlock) M(HsBlock, first) M(HsBlock, count) M(HsBlock, mesh) M(HsBlock, cull) \
  S(HsTransform) M(HsTransform, row_x) M(HsTransform, row_y) M(HsTransform, row_z) M(HsTransform, row_w) \
  S(HsView) M(HsView, px_from_q) M(HsView, world_from_view_x) M(HsView, world_from_view_y) M(HsView, world_from_view_z) \
  M(HsView, znear) M(HsView, d_far) M(HsView, width_px) M(HsView, height_px) M(HsView, tiles_x) M(HsView, tiles_y) \
  M(HsView, mid_x_px) M(HsView, mid_y_px) \
  S(HsFeature) M(HsFeature, ax) M(HsFeature, ay) M(HsFeature, ad) M(HsFeature, bx) M(HsFeature, by) M(HsFeature, bd) \
  M(HsFeature, c) M(HsFeature, kind_and_layer) \
  S(HsFinShape) M(HsFinShape, radius_px) M(HsFinShape, width_px) M(HsFinShape, two_sided) M(HsFinShape, drop_hidden) \
      M(HsFinShape, tile_step) M(HsFinShape, tiles_x) M(HsFinShape, tiles_y) M(HsFinShape, sphere_q_per_px) \
  S(HsLayers) M(HsLayers, count) M(HsLayers, falloff) M(HsLayers, faithful) M(HsLayers, automatic) \
  S(HsStatus) M(HsStatus, silhouette_count) M(HsStatus, feature_count) M(HsStatus, dropped_triangle_count) M(HsStatus, negative_count) \
  S(HsReceiverView) M(HsReceiverView, ray0) M(HsReceiverView, ray_dx) M(HsReceiverView, ray_dy) M(HsReceiverView, origin) \
  M(HsReceiverView, from_world_x) M(HsReceiverView, from_world_y) M(HsReceiverView, from_world_z) M(HsReceiverView, width_px) \
  M(HsReceiverView, height_px) M(HsReceiverView, has_depth) M(HsReceiverView, tan_half_cone) \
  M(HsReceiverView, from_world_w) M(HsReceiverView, axis_ws) M(HsReceiverView, is_face) \
  M(HsReceiverView, error_per_distance) M(HsReceiverView, unit) M(HsReceiverView, error) \
  S(HsShadeLight) M(HsShadeLight, position_ws) M(HsShadeLight, color) M(HsShadeLight, from_camera_x) \
  M(HsShadeLight, from_camera_y) M(HsShadeLight, from_camera_z) M(HsShadeLight, tan_half_cone) M(HsShadeLight, tint_plane) \
  M(HsShadeLight, padding0) M(HsShadeLight, padding1) \
  S(HsDisc) M(HsDisc, radius) M(HsDisc, radius_px) M(HsDisc, reach2) M(HsDisc, near_q) M(HsDisc, table_per_turn) \
  M(HsDisc, sample_count) M(HsDisc, rotated) M(HsDisc, sphere) M(HsDisc, tinted) \
  M(HsDisc, cells_across)
// clang-format on

TEST_F(Shared, StructsHaveTheSameLayoutOnTheDevice) {
  std::vector<std::string> names;
  std::vector<cl_uint> host;
  std::string source = "__kernel void layouts(__global uint* out) {\n";
#define HS_SIZE(type)                                                            \
  source += "  out[" + std::to_string(host.size()) + "] = sizeof(" #type ");\n"; \
  names.push_back("sizeof " #type);                                              \
  host.push_back(sizeof(type));
#define HS_OFFSET(type, member)                                                       \
  source += "  { __private " #type " s; out[" + std::to_string(host.size()) +         \
            "] = (uint)((__private char*)&s." #member " - (__private char*)&s); }\n"; \
  names.push_back(#type "." #member);                                                 \
  host.push_back(offsetof(type, member));
  HS_SHARED_MEMBERS(HS_SIZE, HS_OFFSET)
  source += "}\n";
  const Buffer<cl_uint> out = runner_.filled(host.size(), ~cl_uint{0});
  runner_.run(runner_.kernel_with("base/shared.h", source, "layouts"), cl::NDRange(1), cl::NDRange(1), out);
  const std::vector<cl_uint> device = runner_.read<cl_uint>(out, host.size());
  for (std::size_t i = 0; i < host.size(); ++i) EXPECT_EQ(device[i], host[i]) << names[i];
}

TEST_F(Shared, EveryStructIsCompared) {
  // A struct that is added to shared.h must be added here.
  std::string_view text;
  for (const EmbeddedKernel& kernel : embedded_kernels())
    if (kernel.file == "base/shared.h") text = kernel.text;
  std::size_t structs = 0, compared = 0;
  for (std::size_t at = text.find("\n} Hs"); at != text.npos; at = text.find("\n} Hs", at + 1)) ++structs;
#define HS_COUNT(type) ++compared;
#define HS_NOTHING(type, member)
  HS_SHARED_MEMBERS(HS_COUNT, HS_NOTHING)
  EXPECT_EQ(structs, compared);
}

TEST_F(Shared, AValueWrittenByTheHostIsReadByTheDevice) {
  const cl::Kernel kernel = runner_.kernel_with("base/shared.h", R"(
    __kernel void read(const HsView view, __global const HsFeature* features, __global float* out) {
      out[0] = view.px_from_q.w; out[1] = view.d_far; out[2] = (float)view.mid_y_px; out[3] = features[1].c; out[4] = (float)features[1].kind_and_layer;
    })",
                                                "read");
  HsView view{};
  view.px_from_q.s[3] = 1.5f;
  view.d_far = 2.5f;
  view.mid_y_px = 7;
  const std::vector<HsFeature> features = {{}, {0, 0, 0, 0, 0, 0, 4.5f, HS_FEATURE_CORNER}};
  const Buffer<cl_float> out = runner_.filled(5, 0.0f);
  runner_.run(kernel, cl::NDRange(1), cl::NDRange(1), view, runner_.buffer<HsFeature>(features), out);
  EXPECT_EQ(runner_.read<float>(out, 5), (std::vector<float>{1.5f, 2.5f, 7.0f, 4.5f, 1.0f}));
}

}  // namespace
}  // namespace halfshade
