#include "passes/triangles.hpp"

namespace halfshade {

void TrianglesPass::run(const ResidentScene& resident, const DrawList& list, Coverage coverage) {
  const DeviceImpl& device = launcher_.device();
  const cl_uint tiles = tiles_of(list.view);
  vertices_vs_.reserve(device, resident.vertex_count, "vertices");
  vertices_px_.reserve(device, resident.vertex_count, "vertices");
  status_.reserve(device, 1, "counters");
  bins_.reserve(device, list.triangles.slots(), tiles, std::size_t{list.triangles.slots()} * 4 + std::size_t{tiles} * 256);

  launcher_.zero(status_, 1);
  launcher_.zero(bins_.counts, tiles);
  launcher_.launch_blocks(list.vertices, kernels::Transform{.view = list.view,
                                                            .blocks = list.vertices.blocks,
                                                            .transforms = list.transforms,
                                                            .positions = resident.positions,
                                                            .vertices_vs = vertices_vs_,
                                                            .vertices_px = vertices_px_});
  const auto bound = [&]<class Kernel>(std::type_identity<Kernel>) {
    launcher_.launch_blocks(list.triangles, Kernel{.view = list.view,
                                                   .blocks = list.triangles.blocks,
                                                   .triangles = triangles(resident),
                                                   .rects = bins_.rects,
                                                   .tile_counts = bins_.counts,
                                                   .status = status_});
  };
  switch (coverage) {
    case Coverage::texel_centres:
      bound(std::type_identity<kernels::BoundTriangles>{});
      break;
    case Coverage::conservative:
      bound(std::type_identity<kernels::BoundTrianglesWide>{});
      break;
  }
  bins_.scan(launcher_, tiles);
  launcher_.launch_blocks(list.triangles, kernels::FillTriangles{.view = list.view,
                                                                 .blocks = list.triangles.blocks,
                                                                 .rects = bins_.rects,
                                                                 .tile_cursors = bins_.counts,
                                                                 .refs = bins_.refs,
                                                                 .capacity = bins_.capacity});
}

kernels::args::TriangleTiles TrianglesPass::tiles(const DrawList& list) const {
  return {.triangle_blocks = list.triangles.blocks,
          .triangle_slot_count = list.triangles.slots(),
          .triangle_rects = bins_.rects,
          .triangle_offsets = bins_.offsets,
          .triangle_refs = bins_.refs,
          .triangle_capacity = bins_.capacity};
}

kernels::args::Triangles TrianglesPass::triangles(const ResidentScene& resident) const {
  return {.triangles = resident.triangle_corners, .vertices_vs = vertices_vs_, .vertices_px = vertices_px_};
}

}  // namespace halfshade
