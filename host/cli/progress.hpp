// How far a command has come, on stderr: one line that changes on a terminal, a line a step where the output is kept.
#pragma once

#include <string>

namespace halfshade {

/// Writes to stderr, as far as that is possible: no work fails because nobody can be told of it.
void print_message(const std::string& text);

/// The progress of a command; the line is gone when this is.
class Progress {
 public:
  /// Writes nothing at all if `quiet`.
  explicit Progress(bool quiet = false);
  ~Progress() { clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// What is being done. On terminals only.
  void now(const std::string& text);
  /// What has been done. Not on terminals, where the next `now` follows.
  void done(const std::string& text);
  /// What the user should know; it stays.
  void note(const std::string& text);
  /// Makes way for other output.
  void clear();

 private:
  bool quiet_, on_terminal_;
};

}  // namespace halfshade
