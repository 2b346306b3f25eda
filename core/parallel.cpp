// SPDX-License-Identifier: Apache-2.0
#include "core/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace drape {

void parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& task) {
  std::vector<std::exception_ptr> failures(count);
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      try {
        task(i);
      } catch (...) {
        failures[i] = std::current_exception();
      }
    }
  };
  {
    std::vector<std::jthread> workers;
    const std::size_t wanted = std::min(count, static_cast<std::size_t>(std::max(threads, 1)));
    for (std::size_t i = 1; i < wanted; ++i) workers.emplace_back(work);
    work();
  }
  for (const std::exception_ptr& failure : failures)
    if (failure) std::rethrow_exception(failure);
}

void parallel_for(std::size_t count, int threads,
                  const std::function<std::string(std::size_t)>& task, const PartDone& told) {
  std::mutex mutex;
  std::size_t done = 0;
  parallel_for(count, threads, [&](std::size_t i) {
    const std::string what = task(i);
    const std::lock_guard lock(mutex);
    ++done;
    if (told) told(static_cast<double>(done) / static_cast<double>(count), what);
  });
}

}  // namespace drape
