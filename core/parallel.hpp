// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <string>

namespace drape {

/// Calls task(0) .. task(count - 1), once each, on up to `threads` threads. Tasks must write only
/// to their own slot, so that the result does not depend on the thread count. The exception of the
/// lowest index is rethrown after all threads have ended.
void parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& task);

/// Receives the fraction done (0..1) and what was finished last; calls do not overlap.
using PartDone = std::function<void(double fraction, const std::string& what)>;

/// The same for tasks that return what they did; `told`, unless empty, hears of each.
void parallel_for(std::size_t count, int threads,
                  const std::function<std::string(std::size_t)>& task, const PartDone& told);

}  // namespace drape
