#include <fmt/format.h>

#include "cli/commands.hpp"
#include "halfshade/halfshade.hpp"

namespace halfshade {

void add_devices(CLI::App& program) {
  CLI::App* command = program.add_subcommand("devices", "List the OpenCL devices of this machine");
  command->footer(
      "The index, P:D or part of the name is what --device and HALFSHADE_DEVICE take.\n\n"
      "Example:\n  halfshade devices\n");
  command->callback([] {
    const std::vector<DeviceInfo> devices = list_devices();
    if (devices.empty()) Device::open("");  // says what to install
    fmt::print("{:>5}  {:<5} {:<4} {:>5} {:>9} {:>11}  {}\n", "index", "P:D", "kind", "units", "memory", "one buffer", "name");
    for (const DeviceInfo& info : devices) {
      constexpr double mib = 1024.0 * 1024.0;
      fmt::print("{:>5}  {:<5} {:<4} {:>5} {:>5.0f} MiB {:>7.0f} MiB  {} ({}, {})\n", info.index,
                 fmt::format("{}:{}", info.platform, info.device), info.is_cpu ? "CPU" : "GPU", info.compute_units,
                 info.memory_bytes / mib, info.largest_buffer_bytes / mib, info.name, info.platform_name, info.version);
    }
  });
}

}  // namespace halfshade
