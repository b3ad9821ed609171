#include "methods/shadow_fins.hpp"

#include "light/light_model.hpp"

namespace halfshade {

HsLayers ShadowFinsPasses::layers_of(const Settings& settings) const {
  return {1, static_cast<cl_uint>(chosen_falloff(settings)), settings.faithful, 0};
}

HsFinShape ShadowFinsPasses::shape_of(const LightFrame& frame, const LightFace& face) const {
  HsFinShape shape = fin_shape(face.as, face.fitted, device().tile_px);
  shape.two_sided = 1;
  shape.drop_hidden = frame.settings.faithful ? 0 : layers_of(frame.settings).count > 1 ? 1 : 2;
  // Footprints begin anywhere but in the last column and row.
  shape.tile_step -= 1;
  shape.tiles_x = (face.fitted.view.width_px - 2) / shape.tile_step + 1;
  shape.tiles_y = (face.fitted.view.height_px - 2) / shape.tile_step + 1;
  return shape;
}

FeatureTotal ShadowFinsPasses::draw_buffers(const LightFrame& frame, const LightFace& face) {
  const DrawList list = draw_list_of(frame, face.fitted);
  shared_.shadow_map.run(shared_.triangles, frame.resident, list);
  if (disc_radius(face.as) <= 0.0) return {};
  const HsFinShape shape = shape_of(frame, face);
  const HsLayers layers = layers_of(frame.settings);
  const bool layered = layers.count > 1;
  FeaturesPass& features = shared_.features;
  sublayer_counts_.reserve(device(), HS_SUBLAYERS, "sub-layers");
  sublayer_layers_.reserve(device(), HS_SUBLAYERS + 1, "sub-layers");
  caster_range_.reserve(device(), 3, "depths");
  other_casters_.reserve(device(), layered ? pixels_of(list.view) : 1, "casters");

  features.classify(shared_.triangles, frame.resident, list, /*mark_others=*/layered);
  if (layered) merge_sublayers(frame, list, shape, layers);
  features.build(shared_.triangles, frame.resident, list, shape, shared_.shadow_map.map(), layers.count, sublayer_layers_);
  launcher().launch_strided(kernels::FlagFeatureTiles{
      .shape = shape, .status = shared_.triangles.status(), .rects = features.bins().rects, .near = features.tile_near_fins()});
  if (layered) draw_casters(frame, list, shape);
  return {features.bins().offsets, std::size_t{shape.tiles_x} * shape.tiles_y * layers.count};
}

void ShadowFinsPasses::merge_sublayers(const LightFrame& frame, const DrawList& list, const HsFinShape& shape,
                                       const HsLayers& layers) {
  const Buffer<HsStatus>& status = shared_.triangles.status();
  launcher().zero(sublayer_counts_, HS_SUBLAYERS);
  launcher().launch_strided(kernels::CountSublayers{.view = list.view,
                                                    .silhouettes = shared_.features.silhouettes(),
                                                    .edges = frame.resident.edge_ends,
                                                    .vertices_ls = shared_.triangles.vertices_vs(),
                                                    .status = status,
                                                    .counts = sublayer_counts_});
  launcher().launch_once(kernels::MergeSublayers{.view = list.view,
                                                 .shape = shape,
                                                 .layers = layers,
                                                 .status = status,
                                                 .counts = sublayer_counts_,
                                                 .sublayer_layers = sublayer_layers_,
                                                 .caster_range = caster_range_});
}

void ShadowFinsPasses::draw_casters(const LightFrame& frame, const DrawList& list, const HsFinShape& shape) {
  launcher().launch_tiles(tiles_of(list.view), kernels::RasterCasters{.view = list.view,
                                                                      .shape = shape,
                                                                      .triangle_tiles = shared_.triangles.tiles(list),
                                                                      .triangles = shared_.triangles.triangles(frame.resident),
                                                                      .sides = shared_.features.sides(),
                                                                      .shadow_map = shared_.shadow_map.map(),
                                                                      .caster_range = caster_range_,
                                                                      .near = shared_.features.tile_near_fins(),
                                                                      .other_casters = other_casters_});
}

void ShadowFinsPasses::list_receivers(const LightFrame& frame, const LightFace& face, const HsFinShape& shape,
                                      const HsLayers& layers) {
  const cl_uint tiles = shape.tiles_x * shape.tiles_y;
  const std::size_t pixels = frame.gbuffer.pixel_count();
  horizon_limits_.reserve(device(), pixels, "receivers");
  receiver_words_.reserve(device(), pixels, "receivers");
  receivers_.reserve(device(), pixels, "penumbra pixels");
  receiver_bins_.reserve(device(), 1, tiles, 1);
  tile_far_.reserve(device(), tiles, "tile depths");

  launcher().zero(receiver_bins_.counts, tiles);
  launcher().zero(tile_far_, tiles);
  const HsReceiverView receiver = frame.receiver(face);
  launcher().launch_pixels(frame.gbuffer.resolution, kernels::BeginFins{.light = face.fitted.view,
                                                                        .view = receiver,
                                                                        .gbuffer = frame.gbuffer.arguments(),
                                                                        .shadow_map = shared_.shadow_map.map(),
                                                                        .near = shared_.features.tile_near_fins(),
                                                                        .shape = shape,
                                                                        .layers = layers,
                                                                        .caster_range = caster_range_,
                                                                        .receiver_words = receiver_words_,
                                                                        .horizon_limits = horizon_limits_,
                                                                        .tile_counts = receiver_bins_.counts,
                                                                        .tile_far = tile_far_,
                                                                        .visibility = frame.output()});
  receiver_bins_.scan(launcher(), tiles);
  launcher().launch_pixels(
      frame.gbuffer.resolution,
      kernels::ListFinReceivers{
          .view = receiver, .receiver_words = receiver_words_, .tile_cursors = receiver_bins_.counts, .listed = receivers_});
}

void ShadowFinsPasses::receive(const LightFrame& frame, const LightFace& face) {
  if (disc_radius(face.as) <= 0.0) return receive_hard(frame, face);
  const HsFinShape shape = shape_of(frame, face);
  const HsLayers layers = layers_of(frame.settings);
  illuminances_.reserve(device(), layers.count > 1 ? HS_STATE_PLANES * frame.gbuffer.pixel_count() : 1, "illuminance");
  list_receivers(frame, face, shape, layers);
  launcher().launch_tiles(shape.tiles_x * shape.tiles_y,
                          kernels::ReceiveFins{.view = face.fitted.view,
                                               .shape = shape,
                                               .layers = layers,
                                               .feature_tiles = shared_.features.tiles(shared_.triangles),
                                               .shadow_map = shared_.shadow_map.map(),
                                               .other_casters = other_casters_,
                                               .caster_range = caster_range_,
                                               .fin_receivers = {.receiver_offsets = receiver_bins_.offsets,
                                                                 .listed = receivers_,
                                                                 .tile_far = tile_far_,
                                                                 .receiver_words = receiver_words_,
                                                                 .horizon_limits = horizon_limits_},
                                               .camera = frame.receiver(face),
                                               .depth_or_position = frame.gbuffer.depth_or_position,
                                               .states = illuminances_,
                                               .visibility = frame.output()});
}

}  // namespace halfshade
