// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/parallel.hpp"
#include "core/program/run_record.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {

/// Which runs a study makes: every scene with every grid, number of segments and model.
struct StudyOptions {
  std::vector<std::string> scenes;  ///< names of files in the rig's scenes/; empty: all
  std::vector<int> grids{11, 21, 31};
  std::vector<int> segments{1, 5};
  std::vector<ClothModel> models{ClothModel::consistent, ClothModel::paper};
  /// Tried in this order until one comes to rest; `newton` is left out for the model `paper`.
  std::vector<Solver> solvers{Solver::rk4, Solver::newton};
  SimulateOptions simulate;  ///< everything else
  int threads = 1;           ///< runs at a time; never changes a result

  /// Throws Error(usage) for an empty list or an unknown solver.
  void check() const;
};

/// Lists, step limit and thickness, alike on the command line and in a plan.
void fields(Fields& f, StudyOptions& options);

/// One run of a study.
struct StudyCase {
  std::filesystem::path scene_file;
  std::string scene;  ///< stem of the file
  ClothModel model = ClothModel::consistent;
  int grid = 0;
  int segments = 0;
  std::filesystem::path folder = {};       ///< <out>/<scene>/<model>/<grid>-<segments>
  std::filesystem::path fabric_file = {};  ///< empty: the scene's
  int seed = 0;                            ///< seed of the start, see seeded(); 0: the scene's own
  std::string key = {};  ///< key of a plan's case, see plan.hpp; empty: named by its words
};

/// End of a run, as its certificate says.
struct StudyOutcome {
  StudyCase the_case;
  bool at_rest = false;
  bool kept = false;  ///< up to date from before
  std::string solver;
  std::string sentence;
  double residual = 0;  ///< in weights of a particle
  double energy_j = 0;  ///< gravity, elastic and kinetic, against the world origin
};

/// The runs in a fixed order: scene, model, grid, segments. Throws Error when the rig has no such
/// scene.
[[nodiscard]] std::vector<StudyCase> study_cases(const std::filesystem::path& rig,
                                                 const std::filesystem::path& out,
                                                 const StudyOptions& options);

/// Files of a case as read; where it names no fabric, the scene's.
struct CaseInputs {
  Scene scene;
  Fabric fabric;
  Print print;
};
[[nodiscard]] CaseInputs read_inputs(const StudyCase& the_case);

/// The options of a case with the solver that is tried first; gives the scene its seed's start.
/// Throws Error for a case that can never run: of what is known before a solver begins.
[[nodiscard]] SimulateOptions prepare_case(const StudyCase& the_case, const StudyOptions& options,
                                           CaseInputs& inputs);

/// Simulates one case unless it is up to date. `program` is the file that runs, for the record.
[[nodiscard]] StudyOutcome run_case(const StudyCase& the_case, const StudyOptions& options,
                                    const std::filesystem::path& program);

/// End of a run that is up to date, from its certificate.
[[nodiscard]] StudyOutcome outcome_from(const StudyCase& the_case);

/// The scene with the start of a seed: displaced, turned and dropped from higher as start number
/// `seed` of drape-simulate branches; the height of its waves goes into `imperfection_m`. Throws
/// Error(bad_input) for a scene that does not start flat at a given centre.
[[nodiscard]] Scene seeded(Scene scene, int seed, double& imperfection_m);

/// Runs `run(case)` for all cases, up to `threads` at a time, and calls `done` with each outcome,
/// one call at a time. Outcomes stand in the order of the cases.
template <class Run, class Done>
[[nodiscard]] auto run_cases(const std::vector<StudyCase>& cases, int threads, const Run& run,
                             const Done& done) {
  std::vector<decltype(run(cases.front()))> outcomes(cases.size());
  std::mutex one_at_a_time;
  parallel_for(cases.size(), threads, [&](std::size_t i) {
    outcomes[i] = run(cases[i]);
    const std::lock_guard<std::mutex> only(one_at_a_time);
    if (done) done(outcomes[i]);
  });
  return outcomes;
}

/// Simulates what is not up to date; `program` is the file that runs, for the records.
[[nodiscard]] std::vector<StudyOutcome> run_study(
    const std::vector<StudyCase>& cases, const StudyOptions& options,
    const std::filesystem::path& program, const std::function<void(const StudyOutcome&)>& done);

/// Mean distance (m) of two sheets of one patch at the particles of a third, bilinear on the cell
/// between their own: the distance that the results store states of a pair, with the coarsest sheet
/// of its scene. Absent where a sheet has a gap there.
[[nodiscard]] std::optional<double> mean_distance_m(const Sheet& a, const Sheet& b,
                                                    const Sheet& coarsest);

/// The pairs that the paper's virtual-virtual tables compare (section 5), for each scene and
/// model, as text: our mean distance at the particles of the scene's coarsest grid, the number
/// printed there (`published`, absent: none), and which of the two sheets was not at rest.
[[nodiscard]] std::string study_tables(const std::vector<StudyOutcome>& outcomes,
                                       const std::optional<std::filesystem::path>& published);

/// One line per run, CSV.
[[nodiscard]] std::string study_csv(const std::vector<StudyOutcome>& outcomes);

/// Writes sheet.ply, sheet.json, history.csv and certificate.json into `out` and names them in
/// the record.
void write_outputs(const std::filesystem::path& out, const SimulateResult& result,
                   const SimulateOptions& options, RunRecord& record);

}  // namespace drape::simulate
