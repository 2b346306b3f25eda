// SPDX-License-Identifier: Apache-2.0
#include "console/server/events.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace drape::console {

void Events::send(const std::string& name, const std::string& data) {
  {
    const std::lock_guard lock(mutex_);
    kept_.push_back(fmt::format("event: {}\ndata: {}\n\n", name, data));
    if (kept_.size() > kKept) kept_.pop_front();
    ++newest_;
  }
  wake_.notify_all();
}

std::string Events::wait(std::uint64_t& last, std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  wake_.wait_for(lock, patience, [&] { return closed_ || newest_ > last; });
  if (closed_) return {};
  const std::uint64_t new_ones = std::min<std::uint64_t>(newest_ - last, kept_.size());
  std::string text;
  for (auto it = kept_.end() - static_cast<std::ptrdiff_t>(new_ones); it != kept_.end(); ++it)
    text += *it;
  last = newest_;
  return text;
}

std::uint64_t Events::newest() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

void Events::close() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  wake_.notify_all();
}

bool Events::closed() const {
  const std::lock_guard lock(mutex_);
  return closed_;
}

}  // namespace drape::console
