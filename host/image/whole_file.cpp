#include "image/whole_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <mutex>
#include <optional>
#include <string>

#include "halfshade/halfshade.hpp"

namespace halfshade {
namespace {

// The temporary file that is being written, if any. Locked wherever one appears or goes.
std::mutex unfinished_mutex;
const std::filesystem::path* unfinished_path = nullptr;

constexpr std::string_view temporary_suffix = ".part";

std::string reason(int error) {
  return std::strerror(error);
}

/// The temporary file. Whatever way the writing ends, it is gone afterwards: renamed or removed.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::filesystem::path& target) : target_(target) {
    const std::lock_guard lock(unfinished_mutex);
    for (unsigned attempt = 0; descriptor_ < 0; ++attempt) {
      path_ = target.parent_path() / fmt::format(".{}.{}.{}{}", target.filename().string(), getpid(), attempt, temporary_suffix);
      descriptor_ = open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
      if (descriptor_ < 0 && errno != EEXIST) fail(errno);
    }
    flock(descriptor_, LOCK_EX | LOCK_NB);  // for those to whom our process number means nothing: see is_abandoned
    unfinished_path = &path_;
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    if (descriptor_ >= 0) close(descriptor_);
    const std::lock_guard lock(unfinished_mutex);
    if (unfinished_path) unlink(path_.c_str());
    unfinished_path = nullptr;
  }

  void write_all(std::span<const unsigned char> bytes) {
    while (!bytes.empty()) {
      const ssize_t written = write(descriptor_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) fail(errno);
      bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
  }

  /// Some file systems tell of a full disk only when the data is forced out or the file is closed.
  void finish() {
    if (fsync(descriptor_) != 0 && errno != EINVAL) fail(errno);
    const int closed = close(descriptor_);
    descriptor_ = -1;
    if (closed != 0) fail(errno);
    const std::lock_guard lock(unfinished_mutex);
    if (rename(path_.c_str(), target_.c_str()) != 0) fail(errno);
    unfinished_path = nullptr;
  }

 private:
  [[noreturn]] void fail(int error) const {
    constexpr std::array not_allowed = {EACCES, EPERM, EROFS, ENOENT, ENOTDIR, EISDIR, ENAMETOOLONG, ELOOP};
    if (std::find(not_allowed.begin(), not_allowed.end(), error) != not_allowed.end()) {
      throw InputError(fmt::format("{}: cannot be written ({}); choose another output folder", target_.string(), reason(error)));
    }
    throw DeviceError(fmt::format("{}: writing failed ({}); nothing of it was kept: make room or choose another output folder",
                                  target_.string(), reason(error)));
  }

  std::filesystem::path target_, path_;
  int descriptor_ = -1;
};

/// Takes ".<number>" off the end of a name; nothing where there is none.
std::optional<long> take_number(std::string_view& name) {
  const std::size_t dot = name.rfind('.');
  if (dot == name.npos) return {};
  long number = 0;
  const char* const end = name.data() + name.size();
  const auto [number_end, error] = std::from_chars(name.data() + dot + 1, end, number);
  if (error != std::errc() || number_end != end || number < 0) return {};
  name = name.substr(0, dot);
  return number;
}

/// A temporary file's name, taken apart.
struct TemporaryName {
  std::string_view target;
  long process;
};

std::optional<TemporaryName> temporary_name(std::string_view name) {
  if (!name.starts_with('.') || !name.ends_with(temporary_suffix)) return {};
  name.remove_prefix(1);
  name.remove_suffix(temporary_suffix.size());
  if (!take_number(name)) return {};
  const std::optional<long> process = take_number(name);
  if (!process || *process < 1 || name.empty()) return {};
  return TemporaryName{name, *process};
}

/// Whether nobody writes to a temporary file any more. Another machine's or container's process may be unknown here, but holds a
/// lock.
bool is_abandoned(const std::filesystem::path& path, long process) {
  if (kill(static_cast<pid_t>(process), 0) == 0 || errno != ESRCH) return false;
  const int descriptor = open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) return false;
  struct stat status {};
  const bool is_free = fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode) && flock(descriptor, LOCK_EX | LOCK_NB) == 0;
  close(descriptor);
  return is_free;
}

}  // namespace

void write_file_whole(const std::filesystem::path& path, std::span<const unsigned char> bytes) {
  TemporaryFile file(path);
  file.write_all(bytes);
  file.finish();
}

void prepare_output_folder(const std::filesystem::path& folder) {
  const auto fail = [&](const std::string& found) {
    throw InputError(
        fmt::format("{}: expected an output folder that can be written to ({}); choose another with -o", folder.string(), found));
  };
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (std::error_code ignored; std::filesystem::exists(folder, ignored) && !std::filesystem::is_directory(folder, ignored))
    fail("a file is there");
  if (error) fail(error.message());
  if (access(folder.c_str(), W_OK | X_OK) != 0) fail(reason(errno));
}

void stop_writing() noexcept {
  unfinished_mutex.lock();
  if (unfinished_path) unlink(unfinished_path->c_str());
}

void remove_abandoned_files(const std::filesystem::path& folder,
                            const std::function<bool(std::string_view file_name)>& is_wanted) {
  std::error_code error;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    const std::optional<TemporaryName> temporary = temporary_name(name);
    if (temporary && is_wanted(temporary->target) && is_abandoned(entry->path(), temporary->process))
      unlink(entry->path().c_str());
  }
}

}  // namespace halfshade
