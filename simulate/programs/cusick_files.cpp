// SPDX-License-Identifier: Apache-2.0
#include "simulate/programs/cusick_files.hpp"

#include <fmt/format.h>

#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/units.hpp"

namespace drape::simulate {

Ending write_cusick(const std::filesystem::path& out, const std::string& fabric,
                    const std::vector<CusickDrape>& drapes, RunRecord& record) {
  using units::mm;
  Ending ending;
  Json json;
  json["schema"] = "drapebench/cusick/1";
  json["fabric"] = fabric;
  json["starts"] = Json::array();
  std::size_t resting = 0;
  for (std::size_t i = 0; i < drapes.size(); ++i) {
    const RelaxationReport& found = drapes[i].report;
    const std::string name = fmt::format("start-{:02d}.ply", i);
    write_durable(out / name, ply_text(drapes[i]));
    record.output(out / name);
    resting += found.at_rest ? 1 : 0;
    json["starts"].push_back({{"file", name},
                              {"points", drapes[i].mesh.points_m.size()},
                              {"specimen_area_mm2", drapes[i].mesh.area_m2() / (mm * mm)},
                              {"at_rest", found.at_rest},
                              {"steps", found.steps},
                              {"residual_point_weights", found.residual},
                              {"energy_uj", found.energy_j * 1e6}});
    if (found.dissipated_j > 0)
      json["starts"].back()["internal_friction_took_uj"] = found.dissipated_j * 1e6;
    ending.numbers.emplace_back(
        name, fmt::format("{} points, {} steps, residual {:.2g} of a point's weight, {:.1f} uJ",
                          drapes[i].mesh.points_m.size(), found.steps, found.residual,
                          found.energy_j * 1e6));
    if (!found.at_rest) ending.rejected.push_back(name + " is not at rest");
  }
  write_json(out / "cusick.json", json);
  record.output(out / "cusick.json");
  ending.go = resting == drapes.size();
  ending.verdict = fmt::format("{} of {} drapes of {} at rest", resting, drapes.size(), fabric);
  ending.next_command = fmt::format("drape drapemeter {}", out.string());
  return ending;
}

}  // namespace drape::simulate
