// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <cstdio>

#include "capture/capture.hpp"
#include "core/error.hpp"

namespace drape::capture {

void CaptureOptions::check() const {
  if (threads < 1) throw usage_error("the number of threads must be 1 or more", "give --threads 1");
  if (!recorded_on) return;
  int year = 0, month = 0, day = 0, length = 0;
  const int found =
      std::sscanf(recorded_on->c_str(), "%4d-%2d-%2d%n", &year, &month, &day, &length);
  const std::chrono::year_month_day date{std::chrono::year(year),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  if (found != 3 || length != 10 || recorded_on->size() != 10 || !date.ok())
    throw usage_error("`" + *recorded_on + "` is no date", "write it as 2026-01-31");
}

}  // namespace drape::capture
