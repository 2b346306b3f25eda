// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "simulate/study/study.hpp"

namespace drape::simulate {

/// A study too large for one machine (plan.toml, schema drapebench/plan/1): every scene with every
/// fabric, grid, number of segments, model and seed. Each case lies in a folder that is named by
/// the SHA-256 of everything its result depends on (files' bytes, options, program), so that parts,
/// repeated runs and other plans on one folder find what was computed before.
struct StudyPlan {
  StudyOptions options;
  std::vector<StudyCase> cases;  ///< in the order of the plan; folder: <out>/<2 digits>/<key>
};

/// Throws Error for a plan or a file of it that cannot be read. `program` as for run_case().
[[nodiscard]] StudyPlan read_plan(const std::filesystem::path& file,
                                  const std::filesystem::path& out,
                                  const std::filesystem::path& program);

/// Part `index` (from 1) of `count`: every count-th case.
struct Part {
  int index = 1;
  int count = 1;
};
/// "3/8"; throws Error(usage).
[[nodiscard]] Part part_of(const std::string& text);

/// State of a case of a plan. One that is impossible was not computed and never can be.
enum class CaseState { done, failed, computing, missing, impossible };
struct PlannedOutcome {
  StudyOutcome outcome;
  CaseState state = CaseState::missing;
};

/// Computes what is missing of a part. A case that fails by an Error leaves `failed.txt` in its
/// folder and is tried again by the next run. Two runs never compute one case at the same time.
/// Throws Error(bad_input) when the same part is being run on this folder already.
[[nodiscard]] std::vector<PlannedOutcome> run_part(
    const StudyPlan& plan, const Part& part, const std::filesystem::path& out,
    const std::filesystem::path& program, const std::function<void(const PlannedOutcome&)>& done);

/// Looks at every case without computing anything. One whose files are not those of its record has
/// failed: the next run computes it again.
[[nodiscard]] std::vector<PlannedOutcome> plan_status(const StudyPlan& plan);

/// One row per case, in the order of the plan, whoever computed it.
[[nodiscard]] std::string plan_csv(const std::vector<PlannedOutcome>& outcomes);

}  // namespace drape::simulate
