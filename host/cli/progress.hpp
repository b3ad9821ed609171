// How far a command has come, on stderr: one line that changes on a terminal, a line a step where the output is kept.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "halfshade/halfshade.hpp"

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

/// Says once why the first frame takes long: compiling the kernels is part of it, and some drivers take minutes, or never finish,
/// inside a call that cannot be interrupted.
class FirstFrameWatch {
 public:
  /// Notes it in `progress`, which must outlive this, where `arrived` is not called within `patience`.
  FirstFrameWatch(Progress& progress, const DeviceInfo& device, std::chrono::milliseconds patience = std::chrono::minutes(1));
  ~FirstFrameWatch() { arrived(); }

  /// The first frame is there. Further calls do nothing.
  void arrived();

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool has_arrived_ = false;
  std::thread watcher_;
};

}  // namespace halfshade
