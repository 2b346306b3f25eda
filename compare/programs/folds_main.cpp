// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "compare/folds/folds.hpp"
#include "core/files/json_file.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/units.hpp"

using namespace drape;
using namespace drape::compare;
using units::mm;

namespace {

struct Arguments {
  std::vector<std::filesystem::path> sheets;
  std::optional<std::filesystem::path> out;
  double least_length_mm = FoldOptions{}.least_length_m / mm;
  double least_curvature_per_m = FoldOptions{}.least_curvature_per_m;
};

Json json_of(const std::string& file, const SheetShape& shape) {
  Json json;
  json["sheet"] = file;
  json["mean_bending_per_m2"] = shape.mean_bending_per_m2;
  json["bands"] = Json::array();
  for (const WaveBand& band : shape.bands)
    json["bands"].push_back({{"from_mm", band.from_m / mm},
                             {"to_mm", band.to_m / mm},
                             {"height_mm2", band.height_m2 / (mm * mm)},
                             {"curvature_per_m2", band.curvature_per_m2}});
  json["folds"] = Json::array();
  for (const Fold& fold : shape.folds)
    json["folds"].push_back({{"material_mm", to_json_vector(fold.middle_material_m / mm)},
                             {"xyz_mm", to_json_vector(fold.middle_in_world / mm)},
                             {"length_mm", fold.length_m / mm},
                             {"direction_deg", fold.direction_rad / units::deg},
                             {"curvature_per_m", fold.curvature_per_m}});
  return json;
}

int run(const Arguments& arguments, std::vector<std::string> words, const CommonOptions& common) {
  RunRecord record("drape-folds", std::move(words),
                   arguments.out ? run_record_path(*arguments.out) : std::filesystem::path());
  const FoldOptions options{arguments.least_curvature_per_m, arguments.least_length_mm * mm};
  Ending ending;
  Json json;
  json["schema"] = "drapebench/folds/1";
  json["sheets"] = Json::array();
  for (const auto& file : arguments.sheets) {
    record.input(file);
    const SheetShape shape = shape_of(read_sheet(file), options, file.string());
    json["sheets"].push_back(json_of(file.string(), shape));
    const auto ridges = std::count_if(shape.folds.begin(), shape.folds.end(),
                                      [](const Fold& fold) { return fold.curvature_per_m > 0; });
    ending.numbers.emplace_back(
        file.string(),
        fmt::format("{} ridges, {} valleys, root mean square curvature {:.1f} 1/m", ridges,
                    shape.folds.size() - ridges, std::sqrt(shape.mean_bending_per_m2)));
  }
  ending.verdict = fmt::format("{} sheets", arguments.sheets.size());
  if (arguments.out) {
    write_json(*arguments.out, json);
    record.output(*arguments.out);
  }
  return finish(ending, common, record);
}

}  // namespace

int main(int argc, char** argv) {
  Command app("Folds and spectra of sheets that no mark can be compared by.", "drape-folds");
  CommonOptions common;
  Arguments arguments;
  add_common_options(app, common);
  app.add_option("SHEET", arguments.sheets, "whole grids: sheet.ply or sheet.json")->required();
  app.add_option("--least-length-mm", arguments.least_length_mm, "of a fold")
      ->positive()
      ->capture_default_str();
  app.add_option("--least-curvature-per-m", arguments.least_curvature_per_m, "of a fold")
      ->positive()
      ->capture_default_str();
  app.add_option("--out", arguments.out, "folds.json to write");
  return run_program(app, argc, argv, common,
                     [&] { return run(arguments, arguments_of(argc, argv), common); });
}
