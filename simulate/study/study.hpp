// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/sheet.hpp"
#include "simulate/study/plan.hpp"

namespace drape::simulate {

/// State of a case of a plan. One that is impossible was not computed and never can be.
enum class CaseState { done, failed, computing, missing, impossible };

/// End of a case, as its certificate says.
struct StudyOutcome {
  StudyCase the_case;
  CaseState state = CaseState::missing;
  bool kept = false;  ///< up to date from before
  bool at_rest = false;
  std::string status = {};  ///< the certificate's; of a case that failed: why
  /// Largest force left, in mean weights of a point; absent: diverged.
  std::optional<double> residual = {};
  std::optional<double> energy_j = {};  ///< gravity, elastic, contact and kinetic; absent: diverged
};

/// Part `index` (from 1) of `count`: every count-th case.
struct Part {
  int index = 1;
  int count = 1;
};
/// "3/8"; throws Error(usage).
[[nodiscard]] Part part_of(const std::string& text);

/// Computes what is missing of a part, up to `threads` cases at a time, and calls `done` with each
/// outcome, one call at a time; outcomes stand in the order of the cases. A case that fails by an
/// Error leaves `failed.txt` in its folder and is tried again by the next run. Two runs never
/// compute one case at the same time. Throws Error(bad_input) when the same part is being run on
/// this folder already.
[[nodiscard]] std::vector<StudyOutcome> run_part(
    const StudyPlan& plan, const Part& part, const std::filesystem::path& out, int threads = 1,
    const std::function<void(const StudyOutcome&)>& done = {});

/// Looks at every case without computing anything. One whose files are not those of its record has
/// failed: the next run computes it again.
[[nodiscard]] std::vector<StudyOutcome> plan_status(const StudyPlan& plan);

/// study.csv: one row per case, in the order of the plan, whoever computed it.
[[nodiscard]] std::string study_csv(const std::vector<StudyOutcome>& outcomes);

/// The scene with the start of a seed: displaced, turned and dropped from higher as start number
/// `seed` of variation_of(). Throws Error(bad_input) for a scene that does not start flat at a
/// given centre.
[[nodiscard]] Scene seeded(Scene scene, int seed);

/// Mean distance (m) of two sheets of one patch at the points of a third, each bilinear on the cell
/// between its own. Absent where a sheet has a gap.
[[nodiscard]] std::optional<double> mean_distance_m(const Sheet& a, const Sheet& b,
                                                    const Sheet& points);

/// Two tables of mean distances at the points of the scene's coarsest sheet, as text: the pairs of
/// the paper's virtual-virtual tables (section 5) by the paper's model, with the number printed
/// there (`published`, absent: none); and each discretisation from the cloth on its finest mesh.
/// Each marks what was not at rest.
[[nodiscard]] std::string study_tables(const std::vector<StudyOutcome>& outcomes,
                                       const std::optional<std::filesystem::path>& published);

}  // namespace drape::simulate

template <>
inline constexpr std::string_view drape::names_of<drape::simulate::CaseState>[] = {
    "done", "failed", "computing", "missing", "impossible"};
