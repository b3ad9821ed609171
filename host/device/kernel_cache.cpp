#include "device/kernel_cache.hpp"

#include <elf.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <optional>
#include <string>

#include "halfshade/halfshade.hpp"

namespace halfshade {
namespace {

namespace fs = std::filesystem;

/// PoCL ends the process where it cannot write what it compiles: the largest kernels take about a megabyte.
constexpr std::uint64_t least_free_bytes = 4 << 20;

const char* set_variable(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr && *value != '\0' ? value : nullptr;
}

/// Why PoCL should not keep its kernels there; empty where it can. Makes the folder, closed to others.
std::string misfit_of(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder, error)) {
    if (folder.has_parent_path()) fs::create_directories(folder.parent_path(), error);
    if (::mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST)
      return fmt::format("it cannot be made: {}", std::generic_category().message(errno));
  }
  struct stat status {};
  if (::stat(folder.c_str(), &status) != 0) return std::generic_category().message(errno);
  if (!S_ISDIR(status.st_mode)) return "it is not a folder";
  if (status.st_uid != ::geteuid() && status.st_uid != 0) return "it belongs to another user, who could put code there";
  if ((status.st_mode & 022) != 0 && ::chmod(folder.c_str(), 0700) != 0)
    return "others can write to it, and could put code there";
  if (::access(folder.c_str(), R_OK | W_OK | X_OK) != 0) return "it cannot be written to";
  return {};
}

/// The folder of the user's cache; none without a home.
std::optional<fs::path> home_folder() {
  if (const char* cache = set_variable("XDG_CACHE_HOME")) return fs::path(cache) / "halfshade" / "pocl";
  if (const char* home = set_variable("HOME")) return fs::path(home) / ".cache" / "halfshade" / "pocl";
  return std::nullopt;
}

/// The first folder that can be used: the user's cache, one of a known name in the temporary folder, a new one there.
fs::path choose_folder() {
  std::string refused;
  const auto suits = [&](const fs::path& folder) {
    const std::string misfit = misfit_of(folder);
    if (!misfit.empty()) refused += fmt::format("{}{}: {}", refused.empty() ? "" : "; ", folder.string(), misfit);
    return misfit.empty();
  };
  if (const std::optional<fs::path> folder = home_folder(); folder && suits(*folder)) return *folder;
  std::error_code error;
  const fs::path temporary = fs::temp_directory_path(error);
  if (const fs::path folder = temporary / fmt::format("halfshade-pocl-{}", ::geteuid());
      !fs::is_symlink(folder, error) && suits(folder))
    return folder;
  std::string name = (temporary / "halfshade-pocl-XXXXXX").string();
  if (::mkdtemp(name.data()) != nullptr) return name;
  throw DeviceError(fmt::format("no folder for compiled kernels: {}; name one with POCL_CACHE_DIR", refused));
}

/// `count` bytes from `at`, if there are as many.
template <class T>
bool read_at(std::ifstream& file, std::uint64_t at, T& value) {
  return file.seekg(static_cast<std::streamoff>(at)) && file.read(reinterpret_cast<char*>(&value), sizeof value);
}

/// Whether LLVM bitcode is whole: blocks that say how many words they have, one behind the other to the end.
bool is_whole_bitcode(std::ifstream& file, std::uint64_t size) {
  std::uint32_t word = 0;
  if (!read_at(file, 0, word) || word != 0xdec0'4342) return false;  // "BC" C0DE
  std::uint64_t at = 4;
  while (at + 8 <= size && read_at(file, at + 4, word)) at += 8 + std::uint64_t{4} * word;
  return at == size && size > 4;
}

/// Whether a shared object is whole: it has room for the table of its sections, which is last in it.
bool is_whole_object(std::ifstream& file, std::uint64_t size) {
  Elf64_Ehdr header;
  if (!read_at(file, 0, header) || std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0) return false;
  if (header.e_ident[EI_CLASS] != ELFCLASS64) return true;
  return header.e_shoff != 0 && header.e_shoff + std::uint64_t{header.e_shentsize} * header.e_shnum <= size;
}

bool is_damaged(const fs::path& path) {
  const bool is_bitcode = path.extension() == ".bc", is_object = path.extension() == ".so";
  if (!is_bitcode && !is_object) return false;
  std::error_code error;
  const std::uint64_t size = fs::file_size(path, error);
  std::ifstream file(path, std::ios::binary);
  if (error || !file) return false;  // gone, or not ours to read: PoCL will say
  return is_bitcode ? !is_whole_bitcode(file, size) : !is_whole_object(file, size);
}

}  // namespace

void remove_damaged_entries(const fs::path& folder) {
  // An entry is a program: folder/XX/<hash>/program.bc, and its kernels below.
  std::error_code error;
  for (fs::directory_iterator group(folder, error), end; !error && group != end; group.increment(error)) {
    std::error_code inner;
    if (!group->is_directory(inner) || group->path().filename().string().size() != 2) continue;
    for (fs::directory_iterator entry(group->path(), inner); !inner && entry != end; entry.increment(inner)) {
      bool damaged = false;
      std::error_code ignored;
      for (fs::recursive_directory_iterator file(entry->path(), ignored), last; !ignored && file != last && !damaged;
           file.increment(ignored))
        damaged = file->is_regular_file(ignored) && is_damaged(file->path());
      if (damaged) fs::remove_all(entry->path(), ignored);
    }
  }
}

void prepare_kernel_cache() {
  fs::path folder;
  if (const char* chosen = set_variable("POCL_CACHE_DIR")) {
    folder = chosen;
    if (const std::string misfit = misfit_of(folder); !misfit.empty())
      throw InputError(fmt::format("POCL_CACHE_DIR={}: expected a folder for compiled kernels ({}); name another, or unset it",
                                   chosen, misfit));
  } else {
    folder = choose_folder();
    ::setenv("POCL_CACHE_DIR", folder.c_str(), 1);
  }
  struct statvfs disk {};
  if (::statvfs(folder.c_str(), &disk) == 0 && std::uint64_t{disk.f_bavail} * disk.f_frsize < least_free_bytes)
    throw DeviceError(
        fmt::format("{}: the disk is full ({} KiB are free), there is no room for compiled kernels; make some, or name another "
                    "folder with POCL_CACHE_DIR",
                    folder.string(), std::uint64_t{disk.f_bavail} * disk.f_frsize >> 10));
  remove_damaged_entries(folder);
}

}  // namespace halfshade
