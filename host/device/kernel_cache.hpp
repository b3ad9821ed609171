// Where PoCL keeps compiled kernels: a folder that is ours alone, without what an earlier run has left unfinished.
#pragma once

#include <filesystem>

namespace halfshade {

/// Chooses the folder, unless POCL_CACHE_DIR does, and sees to it that PoCL can use it. Must come before the first OpenCL call.
/// Throws InputError for a POCL_CACHE_DIR that cannot be used, DeviceError where there is no place for a folder.
void prepare_kernel_cache();

/// Removes the entries with a file that has been cut short or emptied, as by a full disk or a machine that lost power: PoCL ends
/// the process over one. They are compiled again when they are needed.
void remove_damaged_entries(const std::filesystem::path& folder);

}  // namespace halfshade
