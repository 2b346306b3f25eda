// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <string_view>

namespace drape::test {

/// Number of trials of a randomised test: a short slice in every `./check`, the whole number when
/// DRAPE_LONG_TESTS=1 is set. Trials are seeded by their index: the slice is a part of the whole.
[[nodiscard]] inline int trial_count(int slice, int whole) {
  const char* asked = std::getenv("DRAPE_LONG_TESTS");
  return asked != nullptr && std::string_view(asked) == "1" ? whole : slice;
}

/// Index of the first trial: with DRAPE_FIRST_TRIAL=100 those are tried that nobody looked at while
/// the program was written.
[[nodiscard]] inline int first_trial() {
  const char* first = std::getenv("DRAPE_FIRST_TRIAL");
  return first != nullptr ? std::atoi(first) : 0;
}

}  // namespace drape::test
