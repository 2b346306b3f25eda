// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tests/support/small_bench.hpp"

namespace drape::test {

struct Mistake {
  std::string name;
  std::string scene;
  std::function<void(const SmallBench&)> make;
  int exit_code;
  std::vector<std::string> named;  ///< parts of the message: file, key, value
};

/// Replaces one text in a file of the rig by another.
[[nodiscard]] std::function<void(const SmallBench&)> typed(const std::string& file,
                                                           const std::string& right,
                                                           const std::string& wrong);

/// Mistakes of an operator at a bench, as changes to bench1: one word or number mistyped, others,
/// and both lists together.
[[nodiscard]] std::vector<Mistake> typed_mistakes();
[[nodiscard]] std::vector<Mistake> other_mistakes();
[[nodiscard]] std::vector<Mistake> operator_mistakes();

}  // namespace drape::test
