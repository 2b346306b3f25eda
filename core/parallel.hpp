// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>

namespace drape {

/// Calls task(0) .. task(count - 1), once each, on up to `threads` threads. Tasks must write only
/// to their own slot, so that the result does not depend on the thread count. The exception of the
/// lowest index is rethrown after all threads have ended.
void parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& task);

}  // namespace drape
