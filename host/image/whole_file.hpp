// Files that appear whole or not at all: written under a temporary name in the target folder with every call checked, and renamed
// when all of it has reached the disk.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string_view>

namespace halfshade {

/// The longest file name that can be written: beside it there is the temporary one, ".<name>.<process>.<number>.part".
constexpr std::size_t max_output_name = 255 - 24;

/// Makes an output folder where there is none. Throws InputError where files cannot be made in it: before the work, which must
/// not fail at its end.
void prepare_output_folder(const std::filesystem::path& folder);

/// Writes a file so that it appears whole or not at all. Throws InputError where the folder does not let it be made, DeviceError
/// where writing fails.
void write_file_whole(const std::filesystem::path& path, std::span<const unsigned char> bytes);

/// Removes the temporary file that is being written at this moment, if any, and lets nobody begin or finish another: whoever
/// tries waits for the program's end. From any thread, but not from a signal handler.
void stop_writing() noexcept;

/// Removes what processes that were killed while they wrote certain files have left in a folder: temporary files of those names
/// whose process is gone and which nobody has locked. What cannot be removed stays.
void remove_abandoned_files(const std::filesystem::path& folder,
                            const std::function<bool(std::string_view file_name)>& is_wanted);

}  // namespace halfshade
