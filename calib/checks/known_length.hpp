// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "core/rig.hpp"

namespace drape::calib {

/// Throws Error(bad_input) when the length that the operator measured on the target contradicts its
/// pitch by more than three standard uncertainties: every measured millimetre would be wrong by the
/// same fraction. Names the pitch that would agree.
void check_known_length(const Target& target);

/// Standard uncertainty of the print's scale (1), 0 when no length was measured.
[[nodiscard]] double scale_uncertainty(const Target& target);

/// Sentence about the print's scale, for people.
[[nodiscard]] std::string print_scale_line(const Target& target);

}  // namespace drape::calib
