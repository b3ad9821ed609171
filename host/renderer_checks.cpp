#include "renderer_checks.hpp"

#include <fmt/format.h>

#include <cmath>

#include "methods/option.hpp"

namespace halfshade {

void RequestChecks::light(std::size_t light, const Scene& scene) const {
  if (light >= scene.lights.size())
    throw InputError(fmt::format("{}: light {}: the scene has {}", caller_, light, scene.lights.size()));
}

void RequestChecks::visibility(const VisibilityRequest& request, const Scene& scene, std::size_t tint_planes) const {
  check_settings(request.settings, caller_);
  gbuffer(request.gbuffer);
  light(request.light, scene);
  check_light(request.settings, scene.lights[request.light], caller_);
  const std::size_t pixels = std::size_t{request.gbuffer.resolution.x} * request.gbuffer.resolution.y;
  constexpr std::size_t max_planes = std::size_t{1} << 20;
  if (request.plane >= max_planes)
    throw InputError(fmt::format("{}: plane {}: expected a number below {}", caller_, request.plane, max_planes));
  buffer(request.visibility, (request.plane + 1) * pixels, sizeof(cl_float), "visibility");
  if (request.tints) buffer(request.tints, tint_planes * pixels, sizeof(cl_float4), "tints");
}

void RequestChecks::shade(const ShadeRequest& request, const Scene& scene, std::size_t tint_planes) const {
  gbuffer(request.gbuffer);
  const std::size_t pixels = std::size_t{request.gbuffer.resolution.x} * request.gbuffer.resolution.y;
  if (request.gbuffer.base_color)
    buffer(request.gbuffer.base_color, pixels, sizeof(cl_float4), "base colour");
  else
    buffer(request.gbuffer.face, pixels, sizeof(cl_uint), "base colour or face");
  buffer(request.visibility, std::max<std::size_t>(1, scene.lights.size()) * pixels, sizeof(cl_float), "visibility");
  buffer(request.rgb, pixels, sizeof(cl_float4), "rgb");
  if (request.tints) buffer(request.tints, tint_planes * pixels, sizeof(cl_float4), "tints");
}

void RequestChecks::gbuffer(const GBuffer& gbuffer) const {
  const glm::uvec2 size = gbuffer.resolution;
  if (size.x < 1 || size.y < 1 || size.x > HS_MAX_RESOLUTION || size.y > HS_MAX_RESOLUTION)
    throw InputError(
        fmt::format("{}: the G-buffer is {}x{}: expected 1 to {} pixels a side", caller_, size.x, size.y, HS_MAX_RESOLUTION));
  if (!(gbuffer.tolerance >= 0.0 && std::isfinite(gbuffer.tolerance)))
    throw InputError(
        fmt::format("{}: G-buffer tolerance {}: expected a finite length of at least 0", caller_, gbuffer.tolerance));
  const std::size_t pixels = std::size_t{size.x} * size.y;
  if (gbuffer.depth)
    buffer(gbuffer.depth, pixels, sizeof(cl_float), "depth");
  else
    buffer(gbuffer.position, pixels, sizeof(cl_float4), "depth or position");
  buffer(gbuffer.normal, pixels, sizeof(cl_float4), "normal");
}

void RequestChecks::buffer(cl_mem memory, std::size_t count, std::size_t element_bytes, std::string_view what) const {
  if (!memory) throw InputError(fmt::format("{}: no {} buffer", caller_, what));
  std::size_t have = 0;
  cl_mem_object_type type = 0;
  cl_context context = nullptr;
  const auto ask = [&](cl_mem_info name, auto& value) {
    const cl_int code = clGetMemObjectInfo(memory, name, sizeof value, &value, nullptr);
    if (code == CL_INVALID_MEM_OBJECT) throw InputError(fmt::format("{}: {} is not an OpenCL buffer", caller_, what));
    if (code != CL_SUCCESS) throw DeviceError(fmt::format("{}: clGetMemObjectInfo: {}", caller_, error_name(code)));
  };
  ask(CL_MEM_TYPE, type);
  ask(CL_MEM_SIZE, have);
  ask(CL_MEM_CONTEXT, context);
  if (type != CL_MEM_OBJECT_BUFFER) throw InputError(fmt::format("{}: {} is an OpenCL image: expected a buffer", caller_, what));
  if (context != device_.cl_context_())
    throw InputError(
        fmt::format("{}: the {} buffer is of another OpenCL context: expected the one the device was made with", caller_, what));
  if (have / element_bytes < count)
    throw InputError(fmt::format("{}: the {} buffer holds {} bytes, expected {}", caller_, what, have, count * element_bytes));
}

std::vector<glm::vec4> positions_of(const Camera& camera, const std::vector<float>& depth) {
  const Frustum frustum = camera_frustum(camera);
  const glm::dmat3 world_from_view = glm::transpose(glm::dmat3(frustum.view_from_world));
  const glm::dvec2 px_to_q = 2.0 * glm::dvec2(frustum.tan_half_x, -frustum.tan_half_y) / glm::dvec2(camera.resolution);
  std::vector<glm::vec4> positions(depth.size());
  for (std::size_t i = 0; i < depth.size(); ++i) {
    const double z = depth[i];
    const glm::dvec2 px(i % camera.resolution.x + 0.5, i / camera.resolution.x + 0.5);
    const glm::dvec2 q = glm::dvec2(-frustum.tan_half_x, frustum.tan_half_y) + px * px_to_q;
    if (z > 0.0) positions[i] = glm::vec4(camera.position + world_from_view * glm::dvec3(q * z, z), 1.0f);
  }
  return positions;
}

LightBuffers light_buffers_of(const LightView& fitted, std::vector<LightBuffers::Plane> planes) {
  LightBuffers buffers;
  buffers.resolution = {fitted.view.width_px, fitted.view.height_px};
  const double scale =
      fitted.is_projective ? fitted.unit : 1.0;  // of light map coordinates, which are ratios but for parallel light
  buffers.lm_from_px_origin = fitted.lm_from_px_origin * scale;
  buffers.lm_from_px_scale = fitted.lm_from_px_scale * scale;
  buffers.znear = fitted.distance_of(fitted.znear);
  buffers.zfar = fitted.distance_of(fitted.zfar);
  buffers.planes = std::move(planes);
  for (LightBuffers::Plane& plane : buffers.planes)
    if (plane.name.ends_with(".Z"))
      for (float& z : plane.values) z = static_cast<float>(fitted.distance_of(z >= HS_EMPTY_Z ? fitted.zfar : z));
  return buffers;
}

}  // namespace halfshade
