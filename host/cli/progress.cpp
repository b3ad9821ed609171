#include "cli/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

namespace halfshade {
namespace {

constexpr const char* erased_line = "\r\x1b[K";

}  // namespace

Progress::Progress(bool quiet) : quiet_(quiet), on_terminal_(isatty(STDERR_FILENO) != 0) {}

void Progress::now(const std::string& text) {
  if (quiet_ || !on_terminal_) return;
  fmt::print(stderr, "{}{}", erased_line, text);
  std::fflush(stderr);
}

void Progress::done(const std::string& text) {
  if (!quiet_ && !on_terminal_) fmt::print(stderr, "{}\n", text);
}

void Progress::note(const std::string& text) {
  clear();
  if (!quiet_) fmt::print(stderr, "{}\n", text);
}

void Progress::clear() {
  if (!quiet_ && on_terminal_) fmt::print(stderr, "{}", erased_line);
}

}  // namespace halfshade
