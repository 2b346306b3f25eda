// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "compare/hems/mark_repeats.hpp"
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
  std::vector<std::filesystem::path> repeats, compared;
  std::optional<std::filesystem::path> out;
  double significance = 0.05;
};

std::vector<NamedSheet> sheets_of(const std::vector<std::filesystem::path>& files,
                                  RunRecord& record) {
  std::vector<NamedSheet> sheets;
  for (const auto& file : files) {
    record.input(file);
    sheets.push_back({file.string(), read_sheet(file)});
  }
  return sheets;
}

Json json_of(const MarkRepeats& found, const Arguments& arguments) {
  Json json;
  json["schema"] = "drapebench/repeats/1";
  json["significance"] = arguments.significance;
  json["marks"] = found.marks;
  json["repeats"] = Json::array();
  for (std::size_t i = 0; i < arguments.repeats.size(); ++i) {
    Json row = Json::array();
    for (const double d : found.real_to_real_m[i]) row.push_back(d / mm);
    json["repeats"].push_back({{"sheet", arguments.repeats[i].string()}, {"rms_mm", row}});
  }
  json["matches"] = Json::array();
  for (const auto& match : found.matches) {
    Json row = Json::array();
    for (const double d : match.distances_m) row.push_back(d / mm);
    json["matches"].push_back({{"sheet", match.name},
                               {"marks", match.marks},
                               {"rms_mm", row},
                               {"verdict", match.verdict},
                               {"reason", match.reason.empty() ? Json() : Json(match.reason)},
                               {"p", match.judgement.p ? Json(*match.judgement.p) : Json()}});
  }
  return json;
}

int run(const Arguments& arguments, std::vector<std::string> words, const CommonOptions& common) {
  RunRecord record("drape-repeats", std::move(words),
                   arguments.out ? run_record_path(*arguments.out) : std::filesystem::path());
  const MarkRepeats found =
      mark_repeats(sheets_of(arguments.repeats, record), sheets_of(arguments.compared, record),
                   arguments.significance);
  Ending ending;
  ending.verdict =
      fmt::format("{} repeats with {} marks in common", arguments.repeats.size(), found.marks);
  for (const auto& match : found.matches)
    ending.numbers.emplace_back(
        match.name, match.verdict +
                        (match.judgement.p ? fmt::format(", p {:.3f}", *match.judgement.p) : "") +
                        (match.reason.empty() ? "" : "; " + match.reason));
  if (arguments.out) {
    write_json(*arguments.out, json_of(found, arguments));
    record.output(*arguments.out);
  }
  return finish(ending, common, record);
}

}  // namespace

int main(int argc, char** argv) {
  Command app("Is a virtual sheet inside the repeats of the real one, mark by mark?",
              "drape-repeats");
  CommonOptions common;
  Arguments arguments;
  add_common_options(app, common);
  app.add_option("SHEET", arguments.repeats, "measured sheets, repeats of one drape")->required();
  app.add_option("--compare", arguments.compared, "virtual sheets of the same drape");
  app.add_option("--significance", arguments.significance, "part of repeats called outside")
      ->range(0.001, 0.5)
      ->capture_default_str();
  app.add_option("--out", arguments.out, "repeats.json to write");
  return run_program(app, argc, argv, common,
                     [&] { return run(arguments, arguments_of(argc, argv), common); });
}
