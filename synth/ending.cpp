// SPDX-License-Identifier: Apache-2.0
#include "synth/ending.hpp"

#include <fmt/format.h>

#include "core/program/shell_word.hpp"
#include "core/units.hpp"

namespace drape::synth {

using units::mm;

Ending ending_of(const SynthReport& report, const Rig& rig, const std::filesystem::path& out) {
  Ending ending;
  ending.verdict =
      fmt::format("{} pictures of {} cameras written", report.pictures, rig.cameras.size());
  ending.numbers = {
      {"marks with known truth", fmt::format("{}", report.marks)},
      {"of them seen whole", fmt::format("{} times by a camera", report.whole_views)}};
  for (const std::string& set : report.not_over_objects)
    ending.warnings.push_back(
        fmt::format("{}: folds that rest on none of its scene's objects or pins, so drape run "
                    "calls them NO-GO; "
                    "--sheet {}=SHEET.json takes a drape, as drape simulate makes it",
                    set, shell_word(set)));
  ending.next_command =
      fmt::format("drape run {} --recording {} --out DIR",
                  shell_word(rig.file.parent_path().string()), shell_word(out.string()));
  return ending;
}

Ending ending_of(const Prediction& prediction, const PredictOptions& options) {
  Ending ending;
  ending.go = prediction.go;
  ending.verdict = fmt::format(
      "{:.1f} % of the marks that two cameras see, on slopes up to 45 degrees, reach {:g} mm in "
      "space; {:.0f} % is asked",
      100 * prediction.reached_fraction, options.asked_sigma_m / mm, 100 * options.asked_fraction);
  for (const PredictedSlope& slope : prediction.slopes) {
    const std::string name = fmt::format("slope {:g} degrees", slope.slope_deg);
    const double seen = 100.0 * slope.seen_by_two / slope.marks;
    if (slope.seen_by_two == 0) {
      ending.numbers.emplace_back(name, "seen by no two cameras");
      continue;
    }
    ending.numbers.emplace_back(
        name, fmt::format("seen by two cameras {:.0f} %; in space {:.4f} mm (median), {:.4f} mm "
                          "(95 % below), height {:.4f} mm; centre {:.4f} px",
                          seen, slope.median_m / mm, slope.p95_m / mm, slope.median_height_m / mm,
                          slope.median_px));
  }
  ending.rejected.push_back(fmt::format(
      "not in these figures: the calibration's part and dots on bends; {:.0f} % of the marks on "
      "slopes up to 45 degrees are seen by fewer than two cameras",
      100 * (1 - prediction.seen_fraction)));
  ending.next_command = prediction.go ? "the same cameras with --out RECORDING give pictures to try"
                                      : "bring the cameras nearer, apart, or take longer lenses";
  return ending;
}

}  // namespace drape::synth
