#include "passes/features.hpp"

#include "light/light_model.hpp"

namespace halfshade {
namespace {

/// Rounded up to what a fill of words can write.
std::size_t in_words(std::size_t bytes) {
  return (bytes + 3) / 4 * 4;
}

}  // namespace

HsFinShape fin_shape(const Light& light, const LightView& fitted, unsigned tile_px) {
  HsFinShape shape{};
  shape.radius_px = static_cast<float>(fitted.radius / fitted.lm_from_px_scale);
  if (model_of(light.type).is_sphere) shape.sphere_q_per_px = static_cast<float>(fitted.lm_from_px_scale);
  shape.tile_step = tile_px;
  shape.tiles_x = fitted.view.tiles_x;
  shape.tiles_y = fitted.view.tiles_y;
  return shape;
}

void FeaturesPass::classify(const TrianglesPass& triangles, const ResidentScene& resident, const DrawList& list,
                            bool mark_others) {
  const DeviceImpl& device = launcher_.device();
  sides_.reserve(device, in_words(resident.triangle_count), "face sides");
  multiplicities_.reserve(device, resident.edge_count, "edge multiplicities");
  silhouettes_.reserve(device, resident.edge_count, "silhouette edges");
  if (mark_others)
    launcher_.fill(sides_.as<cl_uint>(), cl_uint{0x01010101 * HS_SIDE_AWAY}, in_words(resident.triangle_count) / 4);
  launcher_.launch_blocks(list.caster_triangles, kernels::OrientFaces{.blocks = list.caster_triangles.blocks,
                                                                      .triangles = resident.triangle_corners,
                                                                      .vertices_ls = triangles.vertices_vs(),
                                                                      .sides = sides_});
  launcher_.launch_blocks(list.caster_edges, kernels::ClassifyEdges{.blocks = list.caster_edges.blocks,
                                                                    .edge_face_offsets = resident.edge_face_offsets,
                                                                    .edge_faces = resident.edge_faces,
                                                                    .sides = sides_,
                                                                    .multiplicities = multiplicities_,
                                                                    .silhouettes = silhouettes_,
                                                                    .status = triangles.status()});
}

void FeaturesPass::build(const TrianglesPass& triangles, const ResidentScene& resident, const DrawList& list,
                         const HsFinShape& shape, const Buffer<cl_float>& shadow_map, cl_uint layers,
                         const Buffer<cl_uint>& sublayer_layers) {
  const DeviceImpl& device = launcher_.device();
  const cl_uint tiles = shape.tiles_x * shape.tiles_y;
  // Each edge can be a silhouette, with its quad and a corner at either end, inside too where fins have two sides (at vertices of
  // more than two silhouette edges): room for all, so that none is ever lost.
  const std::size_t max_features = (shape.two_sided ? 5 : 3) * std::size_t{resident.edge_count};
  features_.reserve(device, max_features, "fins");
  bins_.reserve(device, max_features, std::size_t{tiles} * layers,
                4 * std::size_t{resident.edge_count} + 2048 * std::size_t{tiles});
  tile_near_fins_.reserve(device, in_words(tiles), "tile flags");

  launcher_.zero(bins_.counts, std::size_t{tiles} * layers);
  launcher_.zero(tile_near_fins_, in_words(tiles));
  launcher_.launch_strided(kernels::BuildFeatures{.view = list.view,
                                                  .shape = shape,
                                                  .layer_count = layers,
                                                  .sublayer_layers = sublayer_layers,
                                                  .silhouettes = silhouettes_,
                                                  .topology = resident.topology(),
                                                  .triangles = triangles.triangles(resident),
                                                  .multiplicities = multiplicities_,
                                                  .shadow_map = shadow_map,
                                                  .features = features_,
                                                  .rects = bins_.rects,
                                                  .tile_counts = bins_.counts,
                                                  .status = triangles.status()});
  bins_.scan(launcher_, tiles * layers);
  launcher_.launch_strided(kernels::FillFeatures{.shape = shape,
                                                 .status = triangles.status(),
                                                 .features = features_,
                                                 .rects = bins_.rects,
                                                 .tile_cursors = bins_.counts,
                                                 .refs = bins_.refs,
                                                 .capacity = bins_.capacity});
}

kernels::args::FeatureTiles FeaturesPass::tiles(const TrianglesPass& triangles) const {
  return {.status = triangles.status(),
          .features = features_,
          .feature_rects = bins_.rects,
          .feature_offsets = bins_.offsets,
          .feature_refs = bins_.refs,
          .feature_capacity = bins_.capacity};
}

}  // namespace halfshade
