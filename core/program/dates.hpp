// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace drape {

/// "2026-01-31T12:00:00Z"
[[nodiscard]] std::string utc_text(
    std::chrono::system_clock::time_point time = std::chrono::system_clock::now());

/// "2026-01-31"
[[nodiscard]] std::string date_text(std::chrono::sys_days day);
[[nodiscard]] std::string today();  ///< UTC

/// The day that such a text names; nothing for any other text.
[[nodiscard]] std::optional<std::chrono::sys_days> date_in(const std::string& text);

/// The time that utc_text() wrote; nothing for any other text.
[[nodiscard]] std::optional<std::chrono::sys_seconds> utc_time_in(const std::string& text);

}  // namespace drape
