// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <string_view>

namespace drape::test {

/// How many trials a randomised test runs: a short slice in every `./check`, the whole number when
/// DRAPE_LONG_TESTS=1 is set. Trials are seeded by their index: the slice is a part of the whole.
[[nodiscard]] inline int trial_count(int slice, int whole) {
  const char* asked = std::getenv("DRAPE_LONG_TESTS");
  return asked != nullptr && std::string_view(asked) == "1" ? whole : slice;
}

}  // namespace drape::test
