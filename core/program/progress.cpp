// SPDX-License-Identifier: Apache-2.0
#include "core/program/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "core/files/files.hpp"

namespace drape {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kBetweenUpdates{100};

int front_door_descriptor() {
  const char* text = std::getenv("DRAPE_PROGRESS_FD");
  return text == nullptr ? -1 : std::atoi(text);
}

}  // namespace

std::string progress_line(const std::string& step, double fraction, const std::string& what,
                          double elapsed_s) {
  constexpr int kWidth = 20;
  const double clamped = std::clamp(fraction, 0.0, 1.0);
  const int filled = static_cast<int>(clamped * kWidth);
  std::string left = fmt::format(", {:.0f} s", elapsed_s);
  if (clamped > 0.01 && clamped < 1)
    left += fmt::format(", {:.0f} s left", elapsed_s * (1 - clamped) / clamped);
  return fmt::format(
      "[{}{}] {:3.0f} %  {}: {}{}", std::string(static_cast<std::size_t>(filled), '#'),
      std::string(static_cast<std::size_t>(kWidth - filled), '.'), 100 * clamped, step, what, left);
}

Progress::Progress(std::string step, bool quiet)
    : step_(std::move(step)),
      descriptor_(front_door_descriptor()),
      terminal_(descriptor_ < 0 && !quiet && ::isatty(STDERR_FILENO) == 1),
      started_(Clock::now()) {}

Progress::~Progress() {
  if (line_open_) std::fputs("\r\033[K", stderr);
}

void Progress::update(double fraction, const std::string& what) {
  if (descriptor_ < 0 && !terminal_) return;
  const Clock::time_point now = Clock::now();
  if (shown_ != Clock::time_point{} && now - shown_ < kBetweenUpdates && fraction < 1) return;
  shown_ = now;
  if (descriptor_ >= 0) {
    const std::string line = fmt::format("{:.4f} {}\n", fraction, what);
    // The step must go on if the front door has exited.
    [[maybe_unused]] const ssize_t ignored = ::write(descriptor_, line.data(), line.size());
    return;
  }
  const double elapsed_s = std::chrono::duration<double>(now - started_).count();
  std::fputs("\r\033[K", stderr);
  std::fputs(printable(progress_line(step_, fraction, what, elapsed_s)).c_str(), stderr);
  std::fflush(stderr);
  line_open_ = true;
}

}  // namespace drape
