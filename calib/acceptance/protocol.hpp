// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calib/acceptance/acceptance.hpp"

namespace drape::calib {

/// Validity as ISO dates; both empty if the operator states none.
struct AcceptanceDates {
  std::string on, valid_until;
};

/// Dates from `on` to `valid_days` later. Throws Error(usage) for an invalid date or 0 days.
[[nodiscard]] AcceptanceDates dates_of(const std::string& on, int valid_days);

/// Test protocol as one printable HTML page without scripts.
[[nodiscard]] std::string protocol_page(const Acceptance& acceptance, const AcceptanceDates& dates);

}  // namespace drape::calib
