// SPDX-License-Identifier: Apache-2.0
#include "simulate/programs/piece_files.hpp"

#include <fmt/format.h>

#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/program/shell_word.hpp"
#include "core/units.hpp"
#include "simulate/programs/mesh_rest_of.hpp"
#include "simulate/programs/run_inputs.hpp"

namespace drape::simulate {

using units::mm;

MeshJudgement judge_piece(const PieceDrape& piece, const Scene& scene, const ClothLaws& laws,
                          double residual_tolerance) {
  MeshRest rest = mesh_rest_of(piece.mesh, piece.state, laws, piece.memory);
  rest.scene = &scene;
  rest.pinned = piece.pinned;
  rest.pinned_in_world = piece.pinned_in_world;
  rest.gravity_m_per_s2 = scene.gravity_m_per_s2;
  rest.contact_forces = piece.contact_forces;
  rest.layers_apart_m = piece.layers_apart_m;
  rest.residual_tolerance = residual_tolerance;
  return judge_mesh(rest);
}

Ending write_piece(const std::filesystem::path& out, const PieceNames& names,
                   const PieceDrape& piece, const std::optional<MeshJudgement>& judgement,
                   RunRecord& record) {
  Ending ending;
  const DescentReport& found = piece.report;
  write_durable(out / "piece.ply", ply_text(piece, names.patch_m));
  write_durable(
      out / "piece.toml",
      fmt::format("schema = \"drapebench/mesh/1\"\nname = \"drapebench, piece of {} "
                  "points\"\nmesh = \"piece.ply\"\nunit_mm = 1.0\nup = \"z\"\nscene = "
                  "{}\nfabric = {}\n[uv]\nwarp = \"u\"\nwarp_from_mm = 0.0\nwarp_to_mm = "
                  "{:.9g}\nweft_from_mm = 0.0\nweft_to_mm = {:.9g}\n",
                  piece.mesh.points_m.size(), Json(names.scene).dump(), Json(names.fabric).dump(),
                  names.patch_m.x() / mm, names.patch_m.y() / mm));
  Json json;
  json["schema"] = "drapebench/piece/1";
  json["scene"] = names.scene;
  json["fabric"] = names.fabric;
  json["mesh"] = "piece.ply";
  json["points"] = piece.mesh.points_m.size();
  json["triangles"] = piece.mesh.triangles.size();
  json["area_mm2"] = piece.mesh.area_m2() / (mm * mm);
  json["at_rest"] = judgement && judgement->accepted();
  if (names.no_go) json["no_go"] = *names.no_go;
  json["moved_s"] = piece.motion.time_s;
  const int hurried = piece.motion.hurried + (piece.motion.quiet ? 0 : 1);
  if (hurried > 0) json["hurried_increments"] = hurried;
  if (piece.layers_apart_m > 0) json["layers_apart_mm"] = piece.layers_apart_m / mm;
  const int steps = piece.motion.steps + found.steps;
  json["steps"] = steps;
  json["residual_point_weights"] = found.residual;
  json["energy_uj"] = found.energy_j * 1e6;
  if (judgement) {
    json["refusals"] = judgement->refusals;
    json["checked_residual_point_weights"] = judgement->residual;
    json["deepest_mm"] = judgement->deepest_m / mm;
    for (const std::string& refusal : judgement->refusals)
      ending.rejected.push_back("the checker refuses it: " + refusal);
  }
  if (found.dissipated_j > 0) json["internal_friction_took_uj"] = found.dissipated_j * 1e6;
  write_json(out / "piece.json", json);
  for (const char* name : {"piece.ply", "piece.toml", "piece.json"}) record.output(out / name);
  ending.go = judgement && judgement->accepted();
  ending.numbers.emplace_back(
      "piece", fmt::format("{:.0f} mm2 of cloth, {} points, residual {:.2g} of a point's weight, "
                           "{:.1f} uJ",
                           piece.mesh.area_m2() / (mm * mm), piece.mesh.points_m.size(),
                           found.residual, found.energy_j * 1e6));
  ending.verdict =
      !found.at_rest
          ? fmt::format("not at rest after {} steps: residual {:.2g} of a point's weight", steps,
                        found.residual)
      : ending.go ? fmt::format("at rest after {} steps, and accepted by the checker", steps)
                  : "still, but the checker refuses it";
  ending = resting_on(names.no_go, std::move(ending));
  ending.next_command =
      fmt::format("drape compare MEASURED.ply {}", shell_word((out / "piece.toml").string()));
  return ending;
}

}  // namespace drape::simulate
