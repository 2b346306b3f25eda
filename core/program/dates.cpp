// SPDX-License-Identifier: Apache-2.0
#include "core/program/dates.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cstdio>
#include <ctime>

namespace drape {

using namespace std::chrono;

std::string utc_text(system_clock::time_point time) {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(system_clock::to_time_t(time)));
}

std::string date_text(sys_days day) {
  return utc_text(day).substr(0, 10);
}

std::string today() {
  return utc_text().substr(0, 10);
}

std::optional<sys_days> date_in(const std::string& text) {
  int year_number = 0, end = 0;
  unsigned month_number = 0, day_number = 0;
  const int read =
      std::sscanf(text.c_str(), "%4d-%2u-%2u%n", &year_number, &month_number, &day_number, &end);
  const year_month_day date{year(year_number), month(month_number), day(day_number)};
  if (read != 3 || text.size() != 10 || end != 10 || !date.ok()) return std::nullopt;
  return sys_days(date);
}

std::optional<sys_seconds> utc_time_in(const std::string& text) {
  std::tm utc{};
  const char* end = ::strptime(text.c_str(), "%Y-%m-%dT%H:%M:%SZ", &utc);
  if (end == nullptr || *end != 0) return std::nullopt;
  return sys_seconds(seconds(::timegm(&utc)));
}

}  // namespace drape
