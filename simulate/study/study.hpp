// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/fields/records.hpp"
#include "core/parallel.hpp"
#include "core/sheet.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {

/// A study's plan (plan.toml). Its lists are combined to cases. The paper's model runs on every
/// grid, beside the cloth on the meshes; without grids the cloth runs on the meshes only.
struct PlanFile {
  std::vector<std::filesystem::path> scenes, fabrics;  ///< empty `fabrics`: each scene's own
  ClothModel model = ClothModel::triangles;
  std::vector<int> grids = {11, 21, 31};
  std::vector<double> spacings_m = {DrapeOptions{}.spacing_m};
  std::vector<int> segments = {1, 5};
  std::vector<int> seeds = {0};
  SimulateOptions simulate;  ///< everything else
  Document document = {};
};

/// Lists given on the command line of a rig's study, which replace those of the plan unless empty.
struct PlanChoice {
  std::vector<std::string> scenes;  ///< stems of the scene files
  std::vector<int> grids, segments;
  std::vector<double> spacings_m;
};
void fields(Fields& f, PlanChoice& choice);

/// One drape of a study.
struct StudyCase {
  std::filesystem::path scene_file, fabric_file;
  std::string scene;  ///< stem of the scene file
  SimulateOptions options;
  int seed = 0;  ///< seed of the start, see seeded(); 0 for the scene's own
  /// SHA-256 of everything that the drape depends on: bytes of files, options, program.
  std::string key;
  std::filesystem::path folder;

  /// Discretisation: "21x21" or "2.5 mm".
  [[nodiscard]] std::string discretisation() const;
  /// Name of the case, e.g. "A: paper, 21x21, 5 segments"; with fabric and seed if they vary.
  [[nodiscard]] std::string name() const;
};

/// The cases of a plan in order: by scene, fabric, model, grid or spacing, segments, seed.
struct StudyPlan {
  std::vector<StudyCase> cases;
  std::filesystem::path folder;  ///< folder of the plan or rig
  bool by_name = false;          ///< folders are named by scene and options, one drape each: tables
};

/// Reads a plan: the file, a folder's plan.toml or, without one, every scene in its scenes/. Cases
/// of a folder are in <out>/<scene>/<model>/<grid or spacing>-<segments>. Those of a plan, or with
/// several fabrics or seeds, are in <out>/<2 digits>/<key>, so that parts, repeated runs and other
/// plans in one folder reuse results. `program` is the executable. Throws Error for unreadable
/// files, keys of older plans (with their replacement), and more than 10^6 cases.
[[nodiscard]] StudyPlan read_plan(const std::filesystem::path& rig_or_plan,
                                  const PlanChoice& choice, const std::filesystem::path& out,
                                  const std::filesystem::path& program);

}  // namespace drape::simulate

template <>
inline constexpr drape::Format drape::format_of<drape::simulate::PlanFile>{
    "plan", Syntax::toml, 1, "plan.toml: cases of a study"};

namespace drape::simulate {
void fields(Fields& f, PlanFile& plan);

/// State of a case of a plan. An impossible case was not computed and never can be.
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

/// Computes the missing cases of a part, up to `threads` at a time, and calls `done` with the name
/// of each; returns outcomes in the order of the cases. A case that fails by an
/// Error leaves `failed.txt` in its folder and is retried by the next run. Two runs never compute
/// the same case simultaneously. Throws Error(bad_input) if the same part is already running in
/// this folder.
[[nodiscard]] std::vector<StudyOutcome> run_part(const StudyPlan& plan, const Part& part,
                                                 const std::filesystem::path& out, int threads = 1,
                                                 const PartDone& done = {});

/// Examines every case without computing any. A case whose files differ from its record counts as
/// failed; the next run computes it again.
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

/// Two tables of mean distances at the points of the scene's coarsest sheet, as text. The first has
/// the pairs of the paper's virtual-virtual tables (section 5) with the paper's model and the
/// published values (`published`; absent for none). The second compares each discretisation with
/// the cloth on its finest mesh. Results not at rest are marked.
[[nodiscard]] std::string study_tables(const std::vector<StudyOutcome>& outcomes,
                                       const std::optional<std::filesystem::path>& published);

}  // namespace drape::simulate

template <>
inline constexpr std::string_view drape::names_of<drape::simulate::CaseState>[] = {
    "done", "failed", "computing", "missing", "impossible"};
