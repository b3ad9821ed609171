// Finding, opening and adopting OpenCL devices.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <mutex>

#include "device/device_impl.hpp"
#include "device/kernel_cache.hpp"
#include "device/memory.hpp"

namespace halfshade {
namespace {

constexpr cl_int no_platform = -1001;  // the loader's CL_PLATFORM_NOT_FOUND_KHR

struct FoundDevice {
  DeviceInfo info;
  cl::Device device;
};

/// Shape of the tile kernels (kernels/base/lanes.h). Not every CPU device takes the wide one: Mesa's llvmpipe, which compiles a
/// work-item's code for scalars and then runs several as one vector, needs minutes for it, and has a native width of 1.
bool has_wide_kernels(const cl::Device& device, bool is_cpu) {
  const char* variable = std::getenv("HALFSHADE_KERNEL_SHAPE");
  const std::string_view shape = variable ? variable : "";
  if (shape.empty()) return is_cpu && device.getInfo<CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT>() > 1;
  if (shape != "wide" && shape != "narrow")
    throw InputError(
        fmt::format("HALFSHADE_KERNEL_SHAPE: expected 'wide' or 'narrow' (found '{}'); unset it for the device's own", shape));
  return shape == "wide";
}

DeviceInfo describe(const cl::Device& device) {
  DeviceInfo info{};
  info.platform_name = cl::Platform(device.getInfo<CL_DEVICE_PLATFORM>()).getInfo<CL_PLATFORM_NAME>();
  info.name = device.getInfo<CL_DEVICE_NAME>();
  info.version = device.getInfo<CL_DEVICE_VERSION>();
  info.driver = device.getInfo<CL_DRIVER_VERSION>();
  info.compute_units = device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>();
  info.memory_bytes = device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>();
  info.largest_buffer_bytes = device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>();
  info.is_cpu = (device.getInfo<CL_DEVICE_TYPE>() & CL_DEVICE_TYPE_CPU) != 0;
  info.has_wide_kernels = has_wide_kernels(device, info.is_cpu);
  return info;
}

std::vector<FoundDevice> find_devices() {
  static std::once_flag prepared;  // again where it has thrown
  std::call_once(prepared, prepare_kernel_cache);
  std::vector<FoundDevice> found;
  std::vector<cl::Platform> platforms;
  try {
    cl::Platform::get(&platforms);
  } catch (const cl::Error& error) {
    if (error.err() == no_platform) return found;
    throw;
  }
  for (std::size_t p = 0; p < platforms.size(); ++p) {
    std::vector<cl::Device> devices;
    try {
      platforms[p].getDevices(CL_DEVICE_TYPE_ALL, &devices);
    } catch (const cl::Error& error) {
      if (error.err() == CL_DEVICE_NOT_FOUND) continue;
      throw;
    }
    for (std::size_t d = 0; d < devices.size(); ++d) {
      FoundDevice device{describe(devices[d]), devices[d]};
      device.info.index = found.size();
      device.info.platform = p;
      device.info.device = d;
      found.push_back(std::move(device));
    }
  }
  return found;
}

bool contains_ignoring_case(std::string_view text, std::string_view part) {
  const auto same = [](char a, char b) {
    return std::tolower(static_cast<unsigned char>(a)) == std::tolower(static_cast<unsigned char>(b));
  };
  return std::search(text.begin(), text.end(), part.begin(), part.end(), same) != text.end();
}

bool matches(const DeviceInfo& info, std::string_view selector) {
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(selector.data(), selector.data() + selector.size(), number);
  if (error == std::errc() && end == selector.data() + selector.size()) return info.index == number;
  if (fmt::format("{}:{}", info.platform, info.device) == selector) return true;
  return contains_ignoring_case(info.name, selector) || contains_ignoring_case(info.platform_name, selector);
}

/// Says how much memory buffers may take. A CPU device's is also where kernels are compiled, and frames read back.
void find_memory(DeviceImpl& impl) {
  impl.memory_bytes = impl.device_info.memory_bytes;
  impl.memory_limit = "the device's memory";
  if (!impl.device_info.is_cpu) return;
  const MemoryAvailable available = memory_available();
  constexpr std::uint64_t enough_for_others = std::uint64_t{256} << 20;
  const std::uint64_t bytes = buffer_bytes_held() + available.bytes - std::min(available.bytes / 4, enough_for_others);
  if (bytes >= impl.memory_bytes) return;
  impl.memory_bytes = bytes;
  impl.memory_limit = available.limit;
}

/// Fills in what follows from device, context and queue.
std::shared_ptr<DeviceImpl> finish(std::shared_ptr<DeviceImpl> impl) {
  find_memory(*impl);
  impl->profiles = (impl->cl_queue.getInfo<CL_QUEUE_PROPERTIES>() & CL_QUEUE_PROFILING_ENABLE) != 0;
  impl->lanes = impl->device_info.has_wide_kernels ? 16 : 1;
  impl->tile_px = impl->device_info.has_wide_kernels ? 32 : 16;
  return impl;
}

}  // namespace

std::string error_name(cl_int code) {
  static constexpr std::pair<cl_int, const char*> names[] = {
      {CL_DEVICE_NOT_AVAILABLE, "CL_DEVICE_NOT_AVAILABLE"},
      {CL_COMPILER_NOT_AVAILABLE, "CL_COMPILER_NOT_AVAILABLE"},
      {CL_MEM_OBJECT_ALLOCATION_FAILURE, "CL_MEM_OBJECT_ALLOCATION_FAILURE"},
      {CL_OUT_OF_RESOURCES, "CL_OUT_OF_RESOURCES"},
      {CL_OUT_OF_HOST_MEMORY, "CL_OUT_OF_HOST_MEMORY"},
      {CL_BUILD_PROGRAM_FAILURE, "CL_BUILD_PROGRAM_FAILURE"},
      {CL_INVALID_VALUE, "CL_INVALID_VALUE"},
      {CL_INVALID_CONTEXT, "CL_INVALID_CONTEXT"},
      {CL_INVALID_COMMAND_QUEUE, "CL_INVALID_COMMAND_QUEUE"},
      {CL_INVALID_MEM_OBJECT, "CL_INVALID_MEM_OBJECT"},
      {CL_INVALID_KERNEL_NAME, "CL_INVALID_KERNEL_NAME"},
      {CL_INVALID_KERNEL_ARGS, "CL_INVALID_KERNEL_ARGS"},
      {CL_INVALID_ARG_SIZE, "CL_INVALID_ARG_SIZE"},
      {CL_INVALID_WORK_GROUP_SIZE, "CL_INVALID_WORK_GROUP_SIZE"},
      {CL_INVALID_EVENT_WAIT_LIST, "CL_INVALID_EVENT_WAIT_LIST"},
      {CL_INVALID_BUFFER_SIZE, "CL_INVALID_BUFFER_SIZE"},
  };
  for (const auto& [known, name] : names)
    if (known == code) return fmt::format("{} ({})", name, code);
  return fmt::format("OpenCL error {}", code);
}

std::vector<DeviceInfo> list_devices() {
  std::vector<DeviceInfo> infos;
  for (FoundDevice& found : guarded("list_devices", find_devices)) infos.push_back(std::move(found.info));
  return infos;
}

void set_cpu_threads(unsigned count) {
  if (count == 0)
    ::unsetenv("POCL_MAX_PTHREAD_COUNT");
  else
    ::setenv("POCL_MAX_PTHREAD_COUNT", std::to_string(count).c_str(), 1);
}

std::shared_ptr<Device> Device::open(std::string_view selector) {
  const std::vector<FoundDevice> found = guarded("Device::open", find_devices);
  if (found.empty())
    throw InputError(
        "no OpenCL device found; install one for the CPU with: apt-get install pocl-opencl-icd (a GPU's comes with its driver)");
  std::string source = "--device";
  if (selector.empty()) {
    if (const char* variable = std::getenv("HALFSHADE_DEVICE"); variable && *variable) {
      selector = variable;
      source = "HALFSHADE_DEVICE";
    }
  }
  auto chosen = found.end();
  if (selector.empty()) {
    chosen = std::find_if(found.begin(), found.end(), [](const FoundDevice& f) { return !f.info.is_cpu; });
    if (chosen == found.end())
      chosen = std::find_if(found.begin(), found.end(), [](const FoundDevice& f) { return f.info.has_wide_kernels; });
    if (chosen == found.end()) chosen = found.begin();
  } else {
    chosen = std::find_if(found.begin(), found.end(), [&](const FoundDevice& f) { return matches(f.info, selector); });
  }
  if (chosen == found.end()) {
    std::string known;
    for (const FoundDevice& f : found) known += fmt::format("{}{} '{}'", known.empty() ? "" : ", ", f.info.index, f.info.name);
    throw InputError(
        fmt::format("{}: no device matches '{}'; there are: {} (an index, P:D, or part of a name)", source, selector, known));
  }
  return guarded(chosen->info.name + ": cannot open the device", [&] {
    auto impl = std::make_shared<DeviceImpl>();
    impl->device_info = chosen->info;
    impl->cl_device = chosen->device;
    impl->cl_context_ = cl::Context(chosen->device);
    impl->cl_queue = cl::CommandQueue(impl->cl_context_, chosen->device, CL_QUEUE_PROFILING_ENABLE);
    impl->owns_queue = true;
    return finish(std::move(impl));
  });
}

std::shared_ptr<Device> Device::adopt(cl_context context, cl_command_queue queue) {
  if (!context || !queue) throw InputError("Device::adopt: expected a context and a queue, got a null handle");
  return guarded("Device::adopt", [&] {
    auto impl = std::make_shared<DeviceImpl>();
    impl->cl_context_ = cl::Context(context, /*retainObject=*/true);
    impl->cl_queue = cl::CommandQueue(queue, /*retainObject=*/true);
    if (impl->cl_queue.getInfo<CL_QUEUE_CONTEXT>()() != context)
      throw InputError("Device::adopt: the queue belongs to another context; pass the context it was made in");
    if (impl->cl_queue.getInfo<CL_QUEUE_PROPERTIES>() & CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE)
      throw InputError("Device::adopt: expected an in-order queue; make one without CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE");
    impl->cl_device = impl->cl_queue.getInfo<CL_QUEUE_DEVICE>();
    impl->device_info = describe(impl->cl_device);
    return finish(std::move(impl));
  });
}

}  // namespace halfshade
