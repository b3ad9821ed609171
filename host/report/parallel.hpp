// One loop on several threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace halfshade {

/// The threads that a number asks for: 0 is all cores.
inline unsigned thread_count(unsigned asked) {
  return asked > 0 ? asked : std::max(1u, std::thread::hardware_concurrency());
}

/// Calls worker(begin, end) for chunks of 0..count on `threads` threads, each with a worker of its own from `make_worker()`.
/// `progress`, if given, is called with the fraction done, from the calling thread. What a worker throws is thrown here, after
/// all have ended.
template <class MakeWorker>
void for_each_chunk(std::size_t count, std::size_t chunk, unsigned threads, const MakeWorker& make_worker,
                    const std::function<void(double)>& progress = {}) {
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto work = [&](bool reports) {
    try {
      auto worker = make_worker();
      for (std::size_t begin; (begin = next.fetch_add(chunk)) < count;) {
        if (reports && progress) progress(static_cast<double>(begin) / static_cast<double>(count));
        worker(begin, std::min(begin + chunk, count));
      }
    } catch (...) {
      next = count;
      const std::lock_guard lock(failure_mutex);
      failure = std::current_exception();
    }
  };
  if (progress) progress(0.0);
  std::vector<std::thread> helpers;
  for (unsigned i = 1; i < threads && i * chunk < count; ++i) helpers.emplace_back(work, false);
  work(true);
  for (std::thread& helper : helpers) helper.join();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace halfshade
