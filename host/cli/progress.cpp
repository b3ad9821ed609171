#include "cli/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <system_error>
#include <utility>

namespace halfshade {
namespace {

constexpr const char* erased_line = "\r\x1b[K";

}  // namespace

void print_message(const std::string& text) {
  std::fputs(text.c_str(), stderr);
  std::fflush(stderr);
  std::clearerr(stderr);
}

Progress::Progress(bool quiet) : quiet_(quiet), on_terminal_(isatty(STDERR_FILENO) != 0) {}

void Progress::now(const std::string& text) {
  if (quiet_ || !on_terminal_) return;
  print_message(erased_line + text);
}

void Progress::done(const std::string& text) {
  if (!quiet_ && !on_terminal_) print_message(text + '\n');
}

void Progress::note(const std::string& text) {
  clear();
  if (!quiet_) print_message(text + '\n');
}

void Progress::clear() {
  if (!quiet_ && on_terminal_) print_message(erased_line);
}

FirstFrameWatch::FirstFrameWatch(Progress& progress, const DeviceInfo& device, std::chrono::milliseconds patience) {
  std::string text =
      fmt::format("{}: no frame after {:.0f} s; the first one includes compiling the {} kernels for this device", device.name,
                  std::chrono::duration<double>(patience).count(), device.has_wide_kernels ? "wide" : "narrow");
  if (device.has_wide_kernels) text += ". HALFSHADE_KERNEL_SHAPE=narrow chooses smaller ones";
  const auto watch = [this, &progress, patience, text = std::move(text)] {
    std::unique_lock lock(mutex_);
    if (!changed_.wait_for(lock, patience, [this] { return has_arrived_; })) progress.note(text);
  };
  try {
    watcher_ = std::thread(watch);
  } catch (const std::system_error&) {  // no more threads: the note is lost, and the work goes on
  }
}

void FirstFrameWatch::arrived() {
  {
    const std::lock_guard lock(mutex_);
    has_arrived_ = true;
  }
  changed_.notify_all();
  if (watcher_.joinable()) watcher_.join();
}

}  // namespace halfshade
