// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/cusick.hpp"
#include "core/error.hpp"
#include "core/fields/fields.hpp"
#include "core/files/files.hpp"
#include "core/parallel.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/program/shell_word.hpp"
#include "core/units.hpp"
#include "simulate/checker/mesh_rest.hpp"
#include "simulate/fabric/fitted_laws.hpp"
#include "simulate/judge_drape.hpp"
#include "simulate/mesh/cusick.hpp"
#include "simulate/programs/commands.hpp"

namespace drape::simulate {

namespace {

constexpr int kMostStarts = 99;  // file names have two digits

struct CusickArguments : CusickOptions {
  std::filesystem::path fabric, out;
  int starts = 1;
  bool internal_friction = false;
};

void fields(Fields& f, CusickArguments& a) {
  using units::mm;
  f(drape::Field{"fabric", "fabric.toml"}.called("FABRIC"), a.fabric);
  f({"out", "folder for start-NN.ply and cusick.json"}, a.out);
  f.otherwise({"starts", "random starts", 1, 1, kMostStarts}, a.starts);
  f.otherwise({"disc_mm", "diameter of the discs", mm, above_zero}, a.disc_m);
  f.otherwise({"specimen_mm", "diameter of the specimen", mm, above_zero}, a.specimen_m);
  f.otherwise(
      {"spacing_mm", "spacing of the mesh; a third of it at the discs' rim", mm, above_zero},
      a.spacing_m);
  f.otherwise({"warp_deg", "rotation of the mesh relative to the warp", units::deg}, a.warp_rad);
  f.otherwise({"lowering_steps",
               "steps in which the table under the specimen is lowered; 1: released at once; "
               "without --internal-friction",
               1, 1, 1000},
              a.lowering_steps);
  f.otherwise({"lowering_s",
               "time in which the table is lowered, with the cloth in motion; 0: released at once; "
               "with --internal-friction",
               1, 0, 10},
              a.lowering_s);
  f.otherwise(
      {"step_ms", "time step of that motion; internal friction is updated at each", 1e-3, 0.1, 20},
      a.motion.step_s);
  f.otherwise({"laid_coarser",
               "mesh on which the specimen is laid: its spacing in units of --spacing-mm; 1: the "
               "mesh itself, also used if the ring would have fewer than six",
               1, above_zero},
              a.laid_coarser);
  f.otherwise({"internal_friction", "use both branches of the bending and shear loops"},
              a.internal_friction);
  f.otherwise({"shakes", "number of times that gravity is varied up and down before the last rest",
               1, 0, 20},
              a.shakes);
  f.otherwise({"shake_percent", "amplitude of that variation, in percent of gravity",
               units::percent, 0, 100},
              a.shake);
  f.otherwise({"max_steps", "largest number of descent steps at each load", 1, 1},
              a.descent.most_steps);
}

/// A drape with the checker's verdict; without one if it is not at rest.
struct JudgedDrape {
  CusickDrape drape;
  std::optional<MeshJudgement> judgement;

  [[nodiscard]] bool go() const { return judgement && judgement->accepted(); }
};

std::string file_of_start(std::size_t start) {
  return fmt::format("start-{:02d}.ply", start);
}

/// Throws Error(usage) if an option has no effect, or a file of the fabric would be
/// overwritten.
void check(const CusickArguments& arguments) {
  const CusickArguments usual;
  const bool stepwise = arguments.lowering_steps != usual.lowering_steps;
  const bool in_time =
      arguments.lowering_s != usual.lowering_s || arguments.motion.step_s != usual.motion.step_s;
  if (arguments.internal_friction ? stepwise : in_time)
    throw usage_error(
        "--lowering-steps is for cloth without internal friction, --lowering-s and --step-ms are "
        "for cloth with it",
        "leave out what does not fit, or --internal-friction");
  StepFiles replaced{{arguments.out / "cusick.json"}, read_fabric(arguments.fabric).files()};
  for (std::size_t i = 0; i < kMostStarts; ++i)
    replaced.outputs.push_back(arguments.out / file_of_start(i));
  const RunRecord kept_nowhere("drape-simulate", {}, {}, replaced);
}

/// Drapes a specimen and lets the checker judge it if it is at rest.
JudgedDrape judged_drape(const ClothLaws& laws, const CusickOptions& options) {
  JudgedDrape judged{cusick_drape(laws, options), std::nullopt};
  const CusickDrape& drape = judged.drape;
  if (!drape.report.at_rest) return judged;
  MeshRest rest;
  rest.shape = shape_of(drape.mesh, drape.state);
  rest.laws = laws;
  rest.memory = drape.memory;
  rest.disc_radius_m = options.disc_m / 2;
  rest.gravity_m_per_s2 = options.descent.gravity_m_per_s2;
  rest.residual_tolerance = options.descent.residual;
  judged.judgement = judge_mesh(rest);
  return judged;
}

/// Removes drapes of an earlier run, which would otherwise be taken for those of the new list.
void remove_drapes(const std::filesystem::path& folder) {
  for (std::size_t i = 0; i < kMostStarts; ++i) {
    const auto file = folder / file_of_start(i);
    if (std::filesystem::is_regular_file(std::filesystem::symlink_status(file)))
      std::filesystem::remove(file);
  }
}

/// Entry of a drape in the list.
CusickStart entry_of(const JudgedDrape& judged, const std::string& name) {
  const DescentReport& found = judged.drape.report;
  CusickStart start{.file = name,
                    .points = static_cast<int>(judged.drape.mesh.points_m.size()),
                    .specimen_area_m2 = judged.drape.mesh.area_m2(),
                    .at_rest = judged.go(),
                    .steps = found.steps,
                    .hurried_loads = judged.drape.hurried_loads};
  if (std::isfinite(found.residual)) start.residual = found.residual;
  if (std::isfinite(found.energy_j)) start.energy_j = found.energy_j;
  if (found.dissipated_j > 0) start.dissipated_j = found.dissipated_j;
  if (!judged.judgement) return start;
  start.refusals = judged.judgement->refusals;
  start.checked_residual = judged.judgement->residual;
  start.deepest_m = judged.judgement->deepest_m;
  return start;
}

/// Writes start-NN.ply and cusick.json to `out` after removing drapes of an earlier run, adds them
/// to the record, and reports how many drapes the checker accepts.
Ending write_cusick(const CusickArguments& arguments, const std::string& fabric,
                    const std::vector<JudgedDrape>& drapes, RunRecord& record) {
  using units::mm;
  const std::filesystem::path out = arguments.out;
  remove_drapes(out);
  Ending ending;
  CusickFile list{fabric, arguments.disc_m, arguments.specimen_m, {}};
  std::size_t resting = 0;
  for (std::size_t i = 0; i < drapes.size(); ++i) {
    const CusickStart start = entry_of(drapes[i], file_of_start(i));
    const DescentReport& found = drapes[i].drape.report;
    list.starts.push_back(start);
    resting += start.at_rest ? 1 : 0;
    for (const std::string& refusal : start.refusals)
      ending.rejected.push_back(
          fmt::format("{} is refused by the checker: {}", start.file, refusal));
    ending.numbers.emplace_back(
        start.file,
        fmt::format("{} points, {} steps, residual {:.2g} of a point's weight, {:.1f} uJ",
                    start.points, start.steps, found.residual, found.energy_j * 1e6));
    if (!found.at_rest) ending.rejected.push_back(start.file + " is not at rest");
    if (start.hurried_loads > 0)
      ending.warnings.push_back(fmt::format(
          "{} went on from {} loads before it was near rest, so its folds may be others; raise "
          "--max-steps",
          start.file, start.hurried_loads));
  }
  // Writes the list first, so that an interrupted run leaves no drapes beside another run's list.
  write_record(out / "cusick.json", list);
  for (std::size_t i = 0; i < drapes.size(); ++i) {
    write_durable(out / file_of_start(i), ply_text(drapes[i].drape));
    record.output(out / file_of_start(i));
  }
  record.output(out / "cusick.json");
  ending.go = resting == drapes.size();
  ending.verdict = fmt::format("{} of {} drapes of {} at rest and accepted by the checker", resting,
                               drapes.size(), fabric);
  ending.next_command =
      fmt::format("drape drapemeter {} --disc-mm {:g} --specimen-mm {:g}", shell_word(out.string()),
                  arguments.disc_m / mm, arguments.specimen_m / mm);
  return ending;
}

int run_cusick(const CusickArguments& arguments, std::vector<std::string> words,
               const CommonOptions& common) {
  check(arguments);
  const auto list = arguments.out / "cusick.json";
  RunRecord record("drape-simulate", std::move(words), run_record_path(list));
  const Fabric fabric = read_fabric(arguments.fabric);
  for (const auto& file : fabric.files()) record.input(file);
  const FittedLaws fitted = fit_laws(fabric, 5, {}, arguments.internal_friction);
  std::vector<JudgedDrape> drapes(static_cast<std::size_t>(arguments.starts));
  parallel_for(drapes.size(), thread_count(common), [&](std::size_t i) {
    CusickOptions options = arguments;
    options.start = static_cast<unsigned>(i + 1);
    drapes[i] = judged_drape(fitted.laws, options);
  });
  Ending ending = write_cusick(arguments, fabric.name, drapes, record);
  ending.warnings.insert(ending.warnings.begin(), fitted.warnings.begin(), fitted.warnings.end());
  return finish(ending, common, record);
}

}  // namespace

int cusick_command(int argc, char** argv) {
  return run_command<CusickArguments>(
      argc, argv, "drape-simulate cusick",
      "Drapes a round specimen of a fabric, held between two discs, from many starts.", run_cusick);
}

}  // namespace drape::simulate
