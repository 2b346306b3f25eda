// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <string_view>

namespace drape::test {

/// Number of trials of a randomised test: a few in every `./check`, all with DRAPE_LONG_TESTS=1.
/// Trials are seeded by their index, so the few are the first ones of the whole.
[[nodiscard]] inline int trial_count(int slice, int whole) {
  const char* asked = std::getenv("DRAPE_LONG_TESTS");
  return asked != nullptr && std::string_view(asked) == "1" ? whole : slice;
}

/// Index of the first trial: DRAPE_FIRST_TRIAL=100 selects trials that nobody looked at during
/// development.
[[nodiscard]] inline int first_trial() {
  const char* first = std::getenv("DRAPE_FIRST_TRIAL");
  return first != nullptr ? std::atoi(first) : 0;
}

}  // namespace drape::test
