// SPDX-License-Identifier: Apache-2.0
#include "simulate/validation/validation.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace drape::simulate {

Checks validate() {
  Checks checks;
  check_cantilevers(checks);
  check_loops(checks);
  check_buckling(checks);
  check_patches(checks);
  check_refinement(checks);
  check_motion(checks);
  check_door(checks);
  std::stable_sort(checks.begin(), checks.end(),
                   [](const Check& a, const Check& b) { return a.test < b.test; });
  return checks;
}

std::string validation_table(const Checks& checks) {
  std::string text = fmt::format("{:>4}  {:<62} {:>9} {:>13} {:>13} {:>9} {:>9}  {}\n", "test",
                                 "what", "particles", "exact", "got", "error", "goal", "verdict");
  int missed = 0;
  for (const Check& check : checks) {
    missed += !check.passes();
    text += fmt::format("{:>4}  {:<62} {:>9} {:>13.8g} {:>13.8g} {:>9.2g} {:>9}  {}\n", check.test,
                        check.what, check.grid, check.exact, check.found, check.error,
                        fmt::format("{} {:g}", check.at_least ? ">=" : "<=", check.goal),
                        check.passes() ? "pass" : "MISS");
  }
  return text + fmt::format("{} checks, {} missed\n", checks.size(), missed);
}

}  // namespace drape::simulate
