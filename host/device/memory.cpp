#include "device/memory.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <optional>

namespace halfshade {
namespace {

namespace fs = std::filesystem;

std::atomic<std::uint64_t> held_bytes{0};

/// The number after a word in a file of such lines; of a file that is one number, that number for an empty word.
std::optional<std::uint64_t> number_in(const fs::path& file, std::string_view word) {
  std::ifstream stream(file);
  std::uint64_t number = 0;
  if (word.empty()) {
    if (stream >> number) return number;
    return {};
  }
  for (std::string name; stream >> name;)
    if (name == word) {
      if (stream >> number) return number;
      return {};
    }
  return {};
}

void lower(MemoryAvailable& available, std::uint64_t bytes, std::string_view limit) {
  if (bytes < available.bytes) available = {bytes, std::string(limit)};
}

/// `used_index`: which number of /proc/self/statm counts against the limit, in pages.
void lower_to_limit(MemoryAvailable& available, __rlimit_resource_t resource, int used_index, std::string_view name) {
  rlimit limit{};
  if (getrlimit(resource, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return;
  std::ifstream stream("/proc/self/statm");
  std::uint64_t pages = 0;
  for (int i = 0; i <= used_index && stream; ++i) stream >> pages;
  const std::uint64_t used = pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  lower(available, limit.rlim_cur > used ? limit.rlim_cur - used : 0, name);
}

/// The group's own limit and those of the groups that it is in. What the group holds of files can be dropped.
void lower_to_control_group(MemoryAvailable& available) {
  const fs::path root = "/sys/fs/cgroup";
  std::ifstream stream("/proc/self/cgroup");
  for (std::string line; std::getline(stream, line);) {
    if (!line.starts_with("0::/")) continue;  // version 2, with one hierarchy
    for (fs::path group = root / line.substr(4);; group = group.parent_path()) {
      const auto max = number_in(group / "memory.max", ""), used = number_in(group / "memory.current", "");
      if (max && used) {
        const std::uint64_t files = number_in(group / "memory.stat", "file").value_or(0);
        const std::uint64_t needed = *used > files ? *used - files : 0;
        lower(available, *max > needed ? *max - needed : 0, "the control group's memory.max");
      }
      if (group == root || !group.has_relative_path() || group == group.parent_path()) return;
    }
  }
}

}  // namespace

MemoryAvailable memory_available() {
  MemoryAvailable available{UINT64_MAX, ""};
  if (const auto kib = number_in("/proc/meminfo", "MemAvailable:")) lower(available, *kib * 1024, "the machine's free memory");
  lower_to_limit(available, RLIMIT_AS, 0, "ulimit -v");
  lower_to_limit(available, RLIMIT_DATA, 5, "ulimit -d");
  lower_to_control_group(available);
  return available;
}

std::uint64_t buffer_bytes_held() {
  return held_bytes;
}

void count_buffer(cl_mem buffer, std::uint64_t bytes) {
  const auto release = [](cl_mem, void* counted) { held_bytes -= reinterpret_cast<std::uintptr_t>(counted); };
  if (clSetMemObjectDestructorCallback(buffer, release, reinterpret_cast<void*>(static_cast<std::uintptr_t>(bytes))) ==
      CL_SUCCESS)
    held_bytes += bytes;
}

}  // namespace halfshade
