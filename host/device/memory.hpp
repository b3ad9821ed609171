// How much memory there is. CPU devices hand out buffers without looking, and end the process where a kernel meets the end of
// memory.
#pragma once

#include <CL/cl.h>

#include <cstdint>
#include <string>

namespace halfshade {

/// Memory that this process can still take, and what sets the limit, for messages.
struct MemoryAvailable {
  std::uint64_t bytes;
  std::string limit;
};

/// The least of what the machine has free and what limits of the process (ulimit) and of its control group leave.
MemoryAvailable memory_available();

/// Bytes of the buffers of this process that are still held.
std::uint64_t buffer_bytes_held();

/// Counts a buffer as held until OpenCL has released its memory.
void count_buffer(cl_mem buffer, std::uint64_t bytes);

}  // namespace halfshade
