#include "methods/method.hpp"

#include "passes/receiver_view.hpp"

namespace halfshade {

HsReceiverView LightFrame::receiver(const Light& as, const LightView& fitted) const {
  return receiver_view(scene.camera, gbuffer.resolution, gbuffer.has_depth, receiver_tolerance, as, fitted);
}

void MethodPasses::draw_light(const LightFrame& frame, const KeepCounts& keep) {
  for (const LightFace& face : frame.faces) {
    if (face.fitted.casters.empty()) {
      launcher().launch_pixels(frame.gbuffer.resolution, kernels::ReceiveAll{.light = face.fitted.view,
                                                                             .view = frame.receiver(face),
                                                                             .gbuffer = frame.gbuffer.arguments(),
                                                                             .visibility = frame.output()});
      keep(face, face.fitted, {});
    } else {
      keep(face, face.fitted, draw_face(frame, face));
    }
  }
}

FeatureTotal MethodPasses::draw_face(const LightFrame& frame, const LightFace& face) {
  const FeatureTotal total = draw_buffers(frame, face);
  receive(frame, face);
  return total;
}

FeatureTotal MethodPasses::draw_buffers(const LightFrame& frame, const LightFace& face) {
  shared_.shadow_map.run(shared_.triangles, frame.resident, draw_list_of(frame, face.fitted));
  return {};
}

void MethodPasses::receive(const LightFrame& frame, const LightFace& face) {
  receive_hard(frame, face);
}

std::vector<LightBuffers::Plane> MethodPasses::read_buffers(const LightFrame&, const LightFace&) {
  return {};
}

void MethodPasses::receive_hard(const LightFrame& frame, const LightFace& face) {
  launcher().launch_pixels(frame.gbuffer.resolution, kernels::ReceiveHard{.light = face.fitted.view,
                                                                          .view = frame.receiver(face),
                                                                          .gbuffer = frame.gbuffer.arguments(),
                                                                          .shadow_map = shared_.shadow_map.map(),
                                                                          .visibility = frame.output()});
}

DrawList MethodPasses::draw_list_of(const LightFrame& frame, const LightView& fitted) const {
  return draw_list(device(), frame.resident, frame.placed, fitted.view, fitted.frustum.view_from_world, fitted.drawn,
                   fitted.casters);
}

FeatureTotal FinMethodPasses::draw_features(const LightFrame& frame, const DrawList& list, const HsFinShape& shape) {
  FeaturesPass& features = shared_.features;
  features.classify(shared_.triangles, frame.resident, list, /*mark_others=*/false);
  features.build(shared_.triangles, frame.resident, list, shape, shared_.shadow_map.map(), 1, {});
  return {features.bins().offsets, std::size_t{shape.tiles_x} * shape.tiles_y};
}

std::vector<float> FinMethodPasses::read_fin_plane(const HsView& view, const Buffer<cl_float>& plane, float where_none) {
  const std::vector<cl_uint> offsets = read<cl_uint>(launcher().queue(), shared_.features.bins().offsets, tiles_of(view) + 1);
  std::vector<float> values = read<float>(launcher().queue(), plane, pixels_of(view));
  const unsigned tile_px = device().tile_px;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t tile = i / view.width_px / tile_px * view.tiles_x + i % view.width_px / tile_px;
    if (offsets[tile] == offsets[tile + 1]) values[i] = where_none;
  }
  return values;
}

}  // namespace halfshade
