#include "passes/light_points.hpp"

#include "light/light_model.hpp"

namespace halfshade {

const LightPointBuffer& LightPointBuffers::of(const DeviceImpl& device, const Light& light, unsigned count) {
  const bool is_disc = model_of(light.shape).is_round;
  const Key key{count, light.shape, is_disc ? 0.0 : light.size.x, is_disc ? 0.0 : light.size.y, light.texture};
  if (const auto found = kept_.find(key); found != kept_.end()) return found->second;
  const SampleTable table = sample_table(light_points(light, count));
  LightPointBuffer points;
  points.samples = upload<cl_float>(device, table.samples, "samples");
  points.below = upload<cl_ushort>(device, table.below, "samples");
  points.weights = upload<cl_float>(device, table.weights, "samples");
  points.cell_xy = upload<cl_float>(device, table.cell_xy, "samples");
  points.cells = upload<cl_ushort>(device, table.cells, "samples");
  points.window_xy = upload<cl_float>(device, table.window_xy, "samples");
  points.windows = upload<cl_ushort>(device, table.windows, "samples");
  points.per_turn = table.per_turn;
  points.cells_across = table.cells_across;
  if (kept_.size() > 64) kept_.clear();  // sizes that are animated
  return kept_.emplace(key, std::move(points)).first->second;
}

}  // namespace halfshade
