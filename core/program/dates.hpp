// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace drape {

/// Formats a time as "2026-01-31T12:00:00Z".
[[nodiscard]] std::string utc_text(
    std::chrono::system_clock::time_point time = std::chrono::system_clock::now());

/// Formats a day as "2026-01-31".
[[nodiscard]] std::string date_text(std::chrono::sys_days day);
[[nodiscard]] std::string today();  ///< current day, UTC

/// The day written as "2026-01-31"; nullopt for any other text.
[[nodiscard]] std::optional<std::chrono::sys_days> date_in(const std::string& text);

/// The time written by utc_text(); nullopt for any other text.
[[nodiscard]] std::optional<std::chrono::sys_seconds> utc_time_in(const std::string& text);

}  // namespace drape
