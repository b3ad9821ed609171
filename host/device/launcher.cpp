#include "device/launcher.hpp"

namespace halfshade {

void Launcher::time(bool on) {
  if (on) timed_.clear();
  timing_ = on && device_->profiles;
}

cl::Kernel& Launcher::kernel_of(const kernels::KernelName& name) {
  auto found = kernels_.find(name.name);
  if (found == kernels_.end())
    found = kernels_.emplace(name.name, cl::Kernel(device_->program(name.file), std::string(name.name).c_str())).first;
  return found->second;
}

void Launcher::enqueue(const cl::Kernel& kernel, std::string_view name, const cl::NDRange& global, const cl::NDRange& local) {
  cl::Event event;
  queue().enqueueNDRangeKernel(kernel, cl::NullRange, global, local, nullptr, timing_ ? &event : nullptr);
  if (timing_) timed_.emplace_back(fmt::format("{}/{}", label_, name), std::move(event));
}

void Launcher::fail(std::string_view name, const cl::Error& error, const cl::NDRange& global, const cl::NDRange& local) {
  const auto side = [](const cl::NDRange& range, unsigned i) { return range.dimensions() > i ? range.get()[i] : 1; };
  throw DeviceError(fmt::format("kernel {}: {}: {}; global size {}x{}, local size {}x{}", name, error.what(),
                                error_name(error.err()), side(global, 0), side(global, 1), side(local, 0), side(local, 1)));
}

}  // namespace halfshade
