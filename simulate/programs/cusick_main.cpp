// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/parallel.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/units.hpp"
#include "simulate/mesh/relaxation.hpp"
#include "simulate/simulate.hpp"

using namespace drape;
using namespace drape::simulate;
using units::mm;

namespace {

struct Arguments {
  std::filesystem::path fabric, out;
  double disc_mm = 180, specimen_mm = 300, spacing_mm = 7.5, warp_deg = 0;
  int starts = 1, most_steps = RelaxationOptions{}.most_steps;
};

int run(const Arguments& arguments, std::vector<std::string> words, const CommonOptions& common) {
  const auto list = arguments.out / "cusick.json";
  RunRecord record("drape-cusick", std::move(words), run_record_path(list));
  const Fabric fabric = read_fabric(arguments.fabric);
  for (const auto& file : fabric.files()) record.input(file);
  SimulateReport report;
  const ClothLaws laws = make_laws(fabric, 5, report);
  std::vector<CusickDrape> drapes(static_cast<std::size_t>(arguments.starts));
  parallel_for(drapes.size(), thread_count(common), [&](std::size_t i) {
    CusickOptions options;
    options.disc_m = arguments.disc_mm * mm;
    options.specimen_m = arguments.specimen_mm * mm;
    options.spacing_m = arguments.spacing_mm * mm;
    options.warp_rad = arguments.warp_deg * units::deg;
    options.start = static_cast<unsigned>(i + 1);
    options.relaxation.most_steps = arguments.most_steps;
    drapes[i] = cusick_drape(laws, options);
  });
  Ending ending;
  Json json;
  json["schema"] = "drapebench/cusick/1";
  json["fabric"] = fabric.name;
  json["starts"] = Json::array();
  int resting = 0;
  for (std::size_t i = 0; i < drapes.size(); ++i) {
    const RelaxationReport& found = drapes[i].report;
    const std::string name = fmt::format("start-{:02d}.ply", i);
    write_durable(arguments.out / name, ply_text(drapes[i]));
    record.output(arguments.out / name);
    resting += found.at_rest;
    json["starts"].push_back({{"file", name},
                              {"points", drapes[i].mesh.points_m.size()},
                              {"specimen_area_mm2", drapes[i].mesh.area_m2() / (mm * mm)},
                              {"at_rest", found.at_rest},
                              {"steps", found.steps},
                              {"residual_point_weights", found.residual},
                              {"energy_uj", found.energy_j * 1e6}});
    ending.numbers.emplace_back(
        name, fmt::format("{} points, {} steps, residual {:.2g} of a point's weight, {:.1f} uJ",
                          drapes[i].mesh.points_m.size(), found.steps, found.residual,
                          found.energy_j * 1e6));
    if (!found.at_rest) ending.rejected.push_back(name + " is not at rest");
  }
  write_json(list, json);
  record.output(list);
  ending.go = resting == arguments.starts;
  ending.verdict =
      fmt::format("{} of {} drapes of {} at rest", resting, arguments.starts, fabric.name);
  ending.next_command = fmt::format("drape drapemeter {}", arguments.out.string());
  return finish(ending, common, record);
}

}  // namespace

int main(int argc, char** argv) {
  Command app("Drapes a round specimen of a fabric, held between two discs, from many starts.",
              "drape-cusick");
  CommonOptions common;
  Arguments a;
  add_common_options(app, common);
  app.add_option("FABRIC", a.fabric, "fabric.toml")->required();
  app.add_option("--out", a.out, "folder for start-NN.ply and cusick.json")->required();
  app.add_option("--starts", a.starts, "random starts")->range(1, 99)->capture_default_str();
  app.add_option("--disc-mm", a.disc_mm, "diameter")->positive()->capture_default_str();
  app.add_option("--specimen-mm", a.specimen_mm, "diameter")->positive()->capture_default_str();
  app.add_option("--spacing-mm", a.spacing_mm, "of the mesh")->positive()->capture_default_str();
  app.add_option("--warp-deg", a.warp_deg, "the mesh turned against the warp")
      ->capture_default_str();
  app.add_option("--max-steps", a.most_steps, "of relaxation")->positive()->capture_default_str();
  return run_program(app, argc, argv, common,
                     [&] { return run(a, arguments_of(argc, argv), common); });
}
