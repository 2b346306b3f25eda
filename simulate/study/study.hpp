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

/// State of a case of a plan. An impossible case was not computed and can never be.
enum class CaseState { done, failed, computing, missing, impossible };

/// Result of a case, from its certificate.
struct StudyOutcome {
  StudyCase the_case;
  CaseState state = CaseState::missing;
  bool kept = false;  ///< true if it was up to date already
  bool at_rest = false;
  std::string status = {};  ///< status of the certificate; for a failed case the reason
  /// Largest net force on a point, in mean weights of a point; absent if the solver diverged.
  std::optional<double> residual = {};
  std::optional<double> energy_j = {};  ///< gravity + elastic + contact + kinetic; absent: diverged
};

/// Part `index` (from 1) of `count`: every `count`-th case.
struct Part {
  int index = 1;
  int count = 1;
};
/// Parses "3/8"; throws Error(usage).
[[nodiscard]] Part part_of(const std::string& text);

/// Computes the missing cases of a part, up to `threads` at a time, and calls `done` with each
/// outcome, one call at a time; returns outcomes in the order of the cases. A case that fails by an
/// Error leaves `failed.txt` in its folder and is retried by the next run. Two runs never compute
/// the same case simultaneously. Throws Error(bad_input) if the same part is already running in
/// this folder.
[[nodiscard]] std::vector<StudyOutcome> run_part(
    const StudyPlan& plan, const Part& part, const std::filesystem::path& out, int threads = 1,
    const std::function<void(const StudyOutcome&)>& done = {});

/// Examines every case without computing anything. A case whose files differ from its record counts
/// as failed and is computed again by the next run.
[[nodiscard]] std::vector<StudyOutcome> plan_status(const StudyPlan& plan);

/// Content of study.csv: one row per case, in the order of the plan, whichever run computed it.
[[nodiscard]] std::string study_csv(const std::vector<StudyOutcome>& outcomes);

/// The scene with a seeded start: displaced, rotated and raised as start number `seed` of
/// variation_of(). Throws Error(bad_input) for a scene that does not start flat at a given
/// centre.
[[nodiscard]] Scene seeded(Scene scene, int seed);

/// Mean distance (m) between two sheets of one patch at the points of a third, with bilinear
/// interpolation within cells. nullopt if a sheet has a gap.
[[nodiscard]] std::optional<double> mean_distance_m(const Sheet& a, const Sheet& b,
                                                    const Sheet& points);

/// Two tables of mean distances at the points of the scene's coarsest sheet, as text: the pairs of
/// the paper's virtual-virtual tables (section 5) with the paper's model, with the published values
/// (`published`; absent for none); and each discretisation against the cloth on its finest mesh.
/// Results not at rest are marked.
[[nodiscard]] std::string study_tables(const std::vector<StudyOutcome>& outcomes,
                                       const std::optional<std::filesystem::path>& published);

}  // namespace drape::simulate

template <>
inline constexpr std::string_view drape::names_of<drape::simulate::CaseState>[] = {
    "done", "failed", "computing", "missing", "impossible"};
