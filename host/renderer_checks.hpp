// What a caller can get wrong, said before anything is enqueued.
#pragma once

#include "device/device_impl.hpp"
#include "light/fit.hpp"

namespace halfshade {

/// Checks the requests of one call, whose name begins the messages. All throw InputError.
class RequestChecks {
 public:
  RequestChecks(const DeviceImpl& device, std::string_view caller) : device_(device), caller_(caller) {}

  void visibility(const VisibilityRequest& request, const Scene& scene, std::size_t tint_planes) const;
  void shade(const ShadeRequest& request, const Scene& scene, std::size_t tint_planes) const;
  void light(std::size_t light, const Scene& scene) const;

 private:
  void gbuffer(const GBuffer& gbuffer) const;
  /// A buffer of the device's context that holds `count` elements of so many bytes.
  void buffer(cl_mem memory, std::size_t count, std::size_t element_bytes, std::string_view what) const;

  const DeviceImpl& device_;
  std::string_view caller_;
};

/// World positions of a camera's pixels with these view depths; w = 1 where something is seen.
std::vector<glm::vec4> positions_of(const Camera& camera, const std::vector<float>& depth);

/// The planes of a light map with depths from the light, or along a directional one, far where the map is empty.
LightBuffers light_buffers_of(const LightView& fitted, std::vector<LightBuffers::Plane> planes);

}  // namespace halfshade
