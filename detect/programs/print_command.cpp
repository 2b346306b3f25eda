// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>

#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/units.hpp"
#include "detect/prints/layout.hpp"
#include "detect/prints/object_tags.hpp"

namespace drape::detect {

namespace fs = std::filesystem;

namespace {

struct PrintArguments {
  fs::path description, out;
  PrintOptions options;
  double plate_size_mm = 80;
  int first_id = 500;
  std::string plate_toml;
};

void add_paper(Command& app, PrintArguments& given) {
  app.add_option("--out", given.out, "PDF to write, with the same page as SVG beside it")
      ->required();
  app.add_option("--paper", given.options.paper,
                 "auto (a4, else a3), a4, a3, letter, or fit: as large as needed");
}

void add_options(Command& app, PrintArguments& given, const char* description) {
  app.add_option("FILE", given.description, description)->required();
  add_paper(app, given);
}

/// Before anything is touched: the record of an earlier plate, too, outlives a refusal.
PrintedPage make_plate(PrintArguments& given) {
  given.description = fs::path(given.out).replace_extension(".toml");
  const Target plate = object_plate(given.plate_size_mm * units::mm, given.first_id);
  given.plate_toml = object_plate_toml(plate);
  require_replaceable_plate(given.description, run_record_path(given.out));
  return page_of(plate, given.description.stem().string(), given.options);
}

int write(const PrintedPage& printed, const PrintArguments& given, const CommonOptions& common,
          RunRecord& record) {
  const fs::path pdf = fs::path(given.out).replace_extension(".pdf");
  const fs::path svg = fs::path(given.out).replace_extension(".svg");
  if (!given.plate_toml.empty()) {
    write_durable(given.description, given.plate_toml);
    record.output(given.description);
    record.option("size_mm", fmt::format("{}", given.plate_size_mm));
  }
  write_durable(pdf, pdf_of(printed.page));
  write_durable(svg, svg_of(printed.page));
  for (const fs::path& file : {pdf, svg}) record.output(file);
  record.option("paper", printed.paper);
  Ending ending;
  ending.verdict = fmt::format("{} and its SVG written, {}", pdf.string(), printed.paper);
  ending.numbers = {{"check lengths", printed.check_text}};
  ending.next_command = printing_advice(given.description);
  return finish(ending, common, record);
}

}  // namespace

int print_command(int argc, char** argv) {
  Command app("Writes the marks of a cloth or a calibration target as an exactly scaled page",
              "drape-detect print");
  CommonOptions common;
  PrintArguments given;
  add_common_options(app, common);
  app.require_subcommand(1, 1);
  app.fallthrough();
  Command* cloth = app.add_subcommand("cloth", "the marks of a patch");
  Command* target = app.add_subcommand("target", "a calibration target");
  Command* plate = app.add_subcommand(
      "object-tags", "a sheet for a box's top or a sphere's stand, and its target.toml beside");
  add_options(*cloth, given, "print.toml of the patch");
  add_options(*target, given, "target.toml");
  add_paper(*plate, given);
  plate->add_option("--size-mm", given.plate_size_mm, "edge of the sheet: that of the box's top");
  plate->add_option("--first-id", given.first_id, "of its four tags; other than cloth and target");
  return run_program(app, argc, argv, common, [&] {
    PrintedPage printed;
    if (plate->parsed()) printed = make_plate(given);
    RunRecord record("drape-detect", arguments_of(argc, argv), run_record_path(given.out));
    if (!plate->parsed()) record.input(given.description);
    if (cloth->parsed()) printed = page_of(read_print(given.description), given.options);
    if (target->parsed())
      printed =
          page_of(read_target(given.description), given.description.stem().string(), given.options);
    return write(printed, given, common, record);
  });
}

}  // namespace drape::detect
