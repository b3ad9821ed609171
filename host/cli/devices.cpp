// The OpenCL devices of this machine.
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/commands.hpp"
#include "halfshade/halfshade.hpp"

namespace halfshade {
namespace {

using Json = nlohmann::ordered_json;

std::string kind_of(const DeviceInfo& info) {
  return info.is_cpu ? "CPU" : "GPU";
}

std::string shape_of(const DeviceInfo& info) {
  return info.has_wide_kernels ? "wide" : "narrow";
}

void print_json(const std::vector<DeviceInfo>& devices) {
  Json all = Json::array();
  for (const DeviceInfo& info : devices) {
    all.push_back({{"index", info.index},
                   {"selector", fmt::format("{}:{}", info.platform, info.device)},
                   {"kind", kind_of(info)},
                   {"kernel_shape", shape_of(info)},
                   {"name", info.name},
                   {"platform", info.platform_name},
                   {"version", info.version},
                   {"driver", info.driver},
                   {"compute_units", info.compute_units},
                   {"memory_bytes", info.memory_bytes},
                   {"largest_buffer_bytes", info.largest_buffer_bytes}});
  }
  fmt::print("{}\n", all.dump(2, ' ', false, Json::error_handler_t::replace));
}

void print_table(const std::vector<DeviceInfo>& devices) {
  fmt::print("{:>5}  {:<5} {:<4} {:<7} {:>5} {:>9} {:>11}  {}\n", "index", "P:D", "kind", "kernels", "units", "memory",
             "one buffer", "name");
  for (const DeviceInfo& info : devices) {
    constexpr double mib = 1024.0 * 1024.0;
    fmt::print("{:>5}  {:<5} {:<4} {:<7} {:>5} {:>5.0f} MiB {:>7.0f} MiB  {} ({}, {})\n", info.index,
               fmt::format("{}:{}", info.platform, info.device), kind_of(info), shape_of(info), info.compute_units,
               info.memory_bytes / mib, info.largest_buffer_bytes / mib, info.name, info.platform_name, info.version);
  }
}

void run_devices(bool json) {
  const std::vector<DeviceInfo> devices = list_devices();
  if (devices.empty()) Device::open("");  // says what to install
  if (json)
    print_json(devices);
  else
    print_table(devices);
}

}  // namespace

void add_devices(CLI::App& program) {
  CLI::App* command = program.add_subcommand("devices", "List the OpenCL devices of this machine");
  const auto json = std::make_shared<bool>(false);
  command->add_flag("--json", *json, "Print JSON");
  command->footer(
      "The index, P:D or part of the name is what --device and HALFSHADE_DEVICE take. 'kernels' is their shape,\n"
      "which HALFSHADE_KERNEL_SHAPE=wide|narrow overrules.\n\n"
      "Examples:\n  halfshade devices\n  halfshade devices --json\n");
  command->callback([json] { run_devices(*json); });
}

}  // namespace halfshade
