// SPDX-License-Identifier: Apache-2.0
#include "calib/checks/known_length.hpp"

#include <fmt/format.h>

#include <cmath>

#include "core/error.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using units::mm;

double nominal_m(const Target& target) {
  return (target.point_in_target(target.known_length->to) -
          target.point_in_target(target.known_length->from))
      .norm();
}

}  // namespace

void check_known_length(const Target& target) {
  if (!target.known_length) return;
  const KnownLength& known = *target.known_length;
  const double nominal = nominal_m(target);
  const double sigmas = std::abs(known.length_m - nominal) / known.standard_uncertainty_m;
  if (sigmas <= 3) return;
  throw bad_input(
      fmt::format("wrong target size: from point ({}, {}) to ({}, {}) the pitch of {:g} mm gives "
                  "{:.3f} mm, the operator measured {:.3f} +- {:.3f} mm, {:.1f} standard "
                  "uncertainties apart; all measured lengths would be wrong by {:+.3f} %",
                  known.from.row, known.from.col, known.to.row, known.to.col, target.pitch_m / mm,
                  nominal / mm, known.length_m / mm, known.standard_uncertainty_m / mm, sigmas,
                  100 * (nominal / known.length_m - 1)),
      {.field = "known_length"},
      fmt::format("set pitch_mm = {:.4f} in the target file, or measure again",
                  target.pitch_m * known.length_m / nominal / mm));
}

double scale_uncertainty(const Target& target) {
  if (!target.known_length) return 0;
  return target.known_length->standard_uncertainty_m / target.known_length->length_m;
}

std::string print_scale_line(const Target& target) {
  if (!target.known_length) {
    return "not checked: measure two far points of the target and add [known_length] to its file";
  }
  const KnownLength& known = *target.known_length;
  return fmt::format("agrees with the measured {:.3f} +- {:.3f} mm, known to {:.4f} %",
                     known.length_m / mm, known.standard_uncertainty_m / mm,
                     100 * scale_uncertainty(target));
}

}  // namespace drape::calib
