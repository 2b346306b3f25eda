// SPDX-License-Identifier: Apache-2.0
#include "simulate/programs/cusick_files.hpp"

#include <fmt/format.h>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/program/shell_word.hpp"
#include "core/units.hpp"
#include "simulate/programs/mesh_rest_of.hpp"

namespace drape::simulate {

namespace {

std::string file_of_start(std::size_t start) {
  return fmt::format("start-{:02d}.ply", start);
}

}  // namespace

void check(const CusickArguments& arguments) {
  const CusickArguments usual;
  const bool stepwise = arguments.lowering_steps != usual.lowering_steps;
  const bool in_time =
      arguments.lowering_s != usual.lowering_s || arguments.step_ms != usual.step_ms;
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

CusickOptions options_of(const CusickArguments& arguments, unsigned start) {
  using units::mm;
  CusickOptions options;
  options.disc_m = arguments.disc_mm * mm;
  options.specimen_m = arguments.specimen_mm * mm;
  options.spacing_m = arguments.spacing_mm * mm;
  options.warp_rad = arguments.warp_deg * units::deg;
  options.start = start;
  options.lowering_steps = arguments.lowering_steps;
  options.lowering_s = arguments.lowering_s;
  options.motion.step_s = arguments.step_ms * ms;
  options.laid_coarser = arguments.laid_coarser;
  options.shakes = arguments.shakes;
  options.shake = arguments.shake_percent * units::percent;
  options.descent.most_steps = arguments.most_steps;
  return options;
}

JudgedDrape judged_drape(const ClothLaws& laws, const CusickOptions& options) {
  JudgedDrape judged{cusick_drape(laws, options), std::nullopt};
  const CusickDrape& drape = judged.drape;
  if (!drape.report.at_rest) return judged;
  MeshRest rest = mesh_rest_of(drape.mesh, drape.state, laws, drape.memory);
  rest.disc_radius_m = options.disc_m / 2;
  rest.gravity_m_per_s2 = options.descent.gravity_m_per_s2;
  rest.residual_tolerance = options.descent.residual;
  judged.judgement = judge_mesh(rest);
  return judged;
}

namespace {

/// Drapes that the new list does not name would be taken for those of its fabric.
void remove_drapes(const std::filesystem::path& folder) {
  for (std::size_t i = 0; i < kMostStarts; ++i) {
    const auto file = folder / file_of_start(i);
    if (std::filesystem::is_regular_file(std::filesystem::symlink_status(file)))
      std::filesystem::remove(file);
  }
}

}  // namespace

Ending write_cusick(const CusickArguments& arguments, const std::string& fabric,
                    const std::vector<JudgedDrape>& drapes, RunRecord& record) {
  using units::mm;
  const std::filesystem::path out = arguments.out;
  remove_drapes(out);
  Ending ending;
  Json json;
  json["schema"] = "drapebench/cusick/1";
  json["fabric"] = fabric;
  json["disc_mm"] = arguments.disc_mm;
  json["specimen_mm"] = arguments.specimen_mm;
  json["starts"] = Json::array();
  std::size_t resting = 0;
  for (std::size_t i = 0; i < drapes.size(); ++i) {
    const CusickDrape& drape = drapes[i].drape;
    const DescentReport& found = drape.report;
    const std::string name = file_of_start(i);
    resting += drapes[i].go() ? 1 : 0;
    json["starts"].push_back({{"file", name},
                              {"points", drape.mesh.points_m.size()},
                              {"specimen_area_mm2", drape.mesh.area_m2() / (mm * mm)},
                              {"at_rest", drapes[i].go()},
                              {"steps", found.steps},
                              {"residual_point_weights", found.residual},
                              {"energy_uj", found.energy_j * 1e6}});
    if (const auto& judgement = drapes[i].judgement) {
      Json& start = json["starts"].back();
      start["refusals"] = judgement->refusals;
      start["checked_residual_point_weights"] = judgement->residual;
      start["deepest_mm"] = judgement->deepest_m / mm;
      for (const std::string& refusal : judgement->refusals)
        ending.rejected.push_back(fmt::format("{} is refused by the checker: {}", name, refusal));
    }
    if (found.dissipated_j > 0)
      json["starts"].back()["internal_friction_took_uj"] = found.dissipated_j * 1e6;
    ending.numbers.emplace_back(
        name,
        fmt::format("{} points, {} steps, residual {:.2g} of a point's weight, {:.1f} uJ",
                    drape.mesh.points_m.size(), found.steps, found.residual, found.energy_j * 1e6));
    if (!found.at_rest) ending.rejected.push_back(name + " is not at rest");
    if (drape.hurried_loads > 0) {
      json["starts"].back()["hurried_loads"] = drape.hurried_loads;
      ending.warnings.push_back(fmt::format(
          "{} went on from {} loads before it was near rest, so its folds may be others; raise "
          "--max-steps",
          name, drape.hurried_loads));
    }
  }
  // The list first: whenever a run may end, no drape lies beside a list that speaks of another.
  write_json(out / "cusick.json", json);
  for (std::size_t i = 0; i < drapes.size(); ++i) {
    write_durable(out / file_of_start(i), ply_text(drapes[i].drape));
    record.output(out / file_of_start(i));
  }
  record.output(out / "cusick.json");
  ending.go = resting == drapes.size();
  ending.verdict = fmt::format("{} of {} drapes of {} at rest and accepted by the checker", resting,
                               drapes.size(), fabric);
  ending.next_command =
      fmt::format("drape drapemeter {} --disc-mm {} --specimen-mm {}", shell_word(out.string()),
                  arguments.disc_mm, arguments.specimen_mm);
  return ending;
}

}  // namespace drape::simulate
