#include "cli/progress.hpp"

#include <unistd.h>

#include <cstdio>

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

}  // namespace halfshade
