// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "compare/folds/folds_json.hpp"
#include "compare/programs/commands.hpp"
#include "compare/records/provenance.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/units.hpp"

namespace drape::compare {

using units::mm;

namespace {

struct FoldsArguments {
  std::vector<std::filesystem::path> sheets, against;
  std::optional<std::filesystem::path> out;
  double least_length_mm = FoldOptions{}.least_length_m / mm;
  double least_curvature_per_m = FoldOptions{}.least_curvature_per_m;
};

int run_folds(const FoldsArguments& arguments, std::vector<std::string> words,
              const CommonOptions& common) {
  StepFiles named{{}, files_of_sheets(arguments.sheets)};
  for (const auto& file : files_of_sheets(arguments.against)) named.inputs.push_back(file);
  if (arguments.out) named.outputs = {*arguments.out};
  RunRecord record("drape-compare", std::move(words),
                   arguments.out ? run_record_path(*arguments.out) : std::filesystem::path(),
                   named);
  const FoldOptions options{arguments.least_curvature_per_m, arguments.least_length_mm * mm};
  Ending ending;
  Json json;
  json["schema"] = "drapebench/folds/1";
  std::vector<std::pair<std::string, Sheet>> read;
  const auto read_group = [&](const std::vector<std::filesystem::path>& files, const char* key) {
    std::vector<SheetShape> shapes;
    json[key] = Json::array();
    for (const auto& file : files) {
      require_as_recorded(std::filesystem::path(file).replace_extension(".json"));
      read.emplace_back(file.string(), read_sheet(file));
      const Sheet& sheet = read.back().second;
      shapes.push_back(shape_of(sheet, options, file.string()));
      const SheetShape& shape = shapes.back();
      json[key].push_back(json_of(file.string(), shape));
      if (const auto why = why_no_go(sheet)) {
        json[key].back()["no_go"] = sheet.no_go.value_or(*why);
        ending.rejected.push_back(fmt::format("{}: {}", file.string(), *why));
      }
      const auto ridges = std::count_if(shape.folds.begin(), shape.folds.end(),
                                        [](const Fold& fold) { return fold.curvature_per_m > 0; });
      ending.numbers.emplace_back(
          file.string(),
          fmt::format("{} ridges, {} valleys, root mean square curvature {:.1f} 1/m", ridges,
                      shape.folds.size() - ridges, std::sqrt(shape.mean_bending_per_m2)));
    }
    return shapes;
  };
  const std::vector<SheetShape> sheets = read_group(arguments.sheets, "sheets");
  const std::vector<SheetShape> against = read_group(arguments.against, "against");
  require_no_copies(read);
  json["descriptors"] = Json::array();
  for (const DescriptorSpread& spread : spreads_of(sheets, against)) {
    json["descriptors"].push_back(json_of(spread));
    ending.numbers.emplace_back(spread.name, text_of(spread));
  }
  ending.go = ending.rejected.empty();
  if (!ending.go) ending.verdict = ending.rejected.front() + "; ";
  ending.verdict += fmt::format("{} sheets", sheets.size());
  if (!against.empty()) ending.verdict += fmt::format(" against {}", against.size());
  if (arguments.out) write_json(*arguments.out, json);
  return finish(ending, common, record);
}

}  // namespace

int folds_command(int argc, char** argv) {
  Command app("Folds and spectra of sheets that no mark can be compared by.",
              "drape-compare folds");
  CommonOptions common;
  FoldsArguments arguments;
  add_common_options(app, common);
  app.add_option("SHEET", arguments.sheets, "whole grids: sheet.ply or sheet.json")->required();
  app.add_option("--against", arguments.against,
                 "sheet of another group, again for each more: means, variations, and how far each "
                 "descriptor tells the groups apart")
      ->one_per_flag();
  app.add_option("--least-length-mm", arguments.least_length_mm, "of a fold")
      ->positive()
      ->capture_default_str();
  app.add_option("--least-curvature-per-m", arguments.least_curvature_per_m, "of a fold")
      ->positive()
      ->capture_default_str();
  app.add_option("--out", arguments.out, "folds.json to write");
  return run_program(app, argc, argv, common,
                     [&] { return run_folds(arguments, arguments_of(argc, argv), common); });
}

}  // namespace drape::compare
