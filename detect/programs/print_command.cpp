// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>

#include "core/fields/fields.hpp"
#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/units.hpp"
#include "detect/prints/layout.hpp"

namespace drape::detect {

namespace fs = std::filesystem;

namespace {

struct PrintArguments {
  fs::path description, out;
  Paper paper = Paper::automatic;
};

void fields(Fields& f, PrintArguments& a) {
  f(Field{"file", "print.toml of the patch, or target.toml"}.called("FILE"), a.description);
  f({"out", "PDF to write, with the same page as SVG beside it"}, a.out);
  f.otherwise({"paper", "auto (a4, else a3), a4, a3, letter, or fit: as large as needed"}, a.paper);
}

struct PlateArguments {
  fs::path out;
  Paper paper = Paper::automatic;
  double size_m = 80 * units::mm;
  int first_id = 500;
};

void fields(Fields& f, PlateArguments& a) {
  f({"out", "PDF to write, with the same page as SVG beside it"}, a.out);
  f.otherwise({"paper", "auto (a4, else a3), a4, a3, letter, or fit: as large as needed"}, a.paper);
  f.otherwise({"size_mm", "edge length of the sheet, equal to that of the box's top", units::mm,
               above_zero},
              a.size_m);
  f.otherwise(
      {"first_id", "id of the first of its four tags; must differ from those of cloth and target"},
      a.first_id);
}

int write(const PrintedPage& printed, const fs::path& description, const fs::path& out,
          const CommonOptions& common, RunRecord& record) {
  const fs::path pdf = fs::path(out).replace_extension(".pdf");
  const fs::path svg = fs::path(out).replace_extension(".svg");
  write_durable(pdf, pdf_of(printed.page));
  write_durable(svg, svg_of(printed.page));
  for (const fs::path& file : {pdf, svg}) record.output(file);
  record.option("paper", printed.paper);
  Ending ending;
  ending.verdict = fmt::format("{} and its SVG written, {}", pdf.string(), printed.paper);
  ending.numbers = {{"check lengths", printed.check_text}};
  ending.next_command = printing_advice(description);
  return finish(ending, common, record);
}

}  // namespace

int print_command(int argc, char** argv) {
  Command app("Writes the marks of a cloth or a calibration target as an exactly scaled page",
              "drape-detect print");
  CommonOptions common;
  PrintArguments on_cloth, on_target;
  PlateArguments on_plate;
  add_common_options(app, common);
  app.require_subcommand(1, 1);
  app.fallthrough();
  Command* cloth = app.add_subcommand("cloth", "the marks of a patch");
  Command* target = app.add_subcommand("target", "a calibration target");
  Command* plate = app.add_subcommand(
      "object-tags", "a sheet for a box's top or a sphere's stand, and its target.toml beside");
  cloth->add_record(on_cloth);
  target->add_record(on_target);
  plate->add_record(on_plate);
  return run_program(app, argc, argv, common, [&] {
    const std::vector<std::string> words = arguments_of(argc, argv);
    if (plate->parsed()) {
      // Checked first, so that a refusal also keeps the record of an earlier plate.
      const fs::path file = fs::path(on_plate.out).replace_extension(".toml");
      const Target description = object_plate(on_plate.size_m, on_plate.first_id);
      require_replaceable_plate(file, run_record_path(on_plate.out));
      const PrintedPage printed = page_of(description, file.stem().string(), on_plate.paper);
      RunRecord record("drape-detect", words, run_record_path(on_plate.out));
      write_durable(file, object_plate_toml(description));
      record.output(file);
      record.option("size_mm", fmt::format("{}", on_plate.size_m / units::mm));
      return write(printed, file, on_plate.out, common, record);
    }
    const auto& [file, out, paper] = cloth->parsed() ? on_cloth : on_target;
    RunRecord record("drape-detect", words, run_record_path(out));
    record.input(file);
    const PrintedPage printed = cloth->parsed()
                                    ? page_of(read_print(file), paper)
                                    : page_of(read_target(file), file.stem().string(), paper);
    return write(printed, file, out, common, record);
  });
}

}  // namespace drape::detect
