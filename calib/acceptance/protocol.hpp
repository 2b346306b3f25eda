// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calib/acceptance/acceptance.hpp"

namespace drape::calib {

/// ISO dates; both empty where the operator states none.
struct AcceptanceDates {
  std::string on, valid_until;
};

/// `on` and as many days later. Throws Error(usage) for what is no date, or days below 1.
[[nodiscard]] AcceptanceDates dates_of(const std::string& on, int valid_days);

/// The protocol as one HTML page without scripts, for printing.
[[nodiscard]] std::string protocol_page(const Acceptance& acceptance, const AcceptanceDates& dates);

}  // namespace drape::calib
