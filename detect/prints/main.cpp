// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>

#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/units.hpp"
#include "detect/prints/layout.hpp"

namespace fs = std::filesystem;
using namespace drape;
using namespace drape::detect;

namespace {

struct Arguments {
  fs::path description, out;
  PrintOptions options;
};

void add_options(Command& app, Arguments& given, const char* description) {
  app.add_option("FILE", given.description, description)->required();
  app.add_option("--out", given.out, "PDF to write, with the same page as SVG beside it")
      ->required();
  app.add_option("--paper", given.options.paper,
                 "auto (a4, else a3), a4, a3, letter, or fit: as large as needed");
}

int write(const PrintedPage& printed, const Arguments& given, const CommonOptions& common,
          RunRecord& record) {
  const fs::path pdf = fs::path(given.out).replace_extension(".pdf");
  const fs::path svg = fs::path(given.out).replace_extension(".svg");
  write_durable(pdf, pdf_of(printed.page));
  write_durable(svg, svg_of(printed.page));
  record.input(given.description);
  record.output(pdf);
  record.output(svg);
  record.option("paper", printed.paper);
  Ending ending;
  ending.verdict = fmt::format("{} and its SVG written, {}", pdf.string(), printed.paper);
  ending.numbers = {{"check length", fmt::format("{:.2f} mm, {}", printed.check_m / units::mm,
                                                 printed.check_text)}};
  ending.next_command =
      "print at 100 %, measure the check length on paper or cloth, and correct pitch_mm when it "
      "differs";
  const int code = finish(ending, common);
  record.write(run_record_path(pdf), code);
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  Command app("Writes the marks of a cloth or a calibration target as an exactly scaled page",
              "drape-print");
  CommonOptions common;
  Arguments given;
  add_common_options(app, common);
  app.require_subcommand(1, 1);
  app.fallthrough();
  Command* cloth = app.add_subcommand("cloth", "the marks of a patch");
  Command* target = app.add_subcommand("target", "a calibration target");
  add_options(*cloth, given, "print.toml of the patch");
  add_options(*target, given, "target.toml");
  return run_program(app, argc, argv, common, [&] {
    RunRecord record("drape-print", arguments_of(argc, argv));
    const PrintedPage printed = cloth->parsed()
                                    ? page_of(read_print(given.description), given.options)
                                    : page_of(read_target(given.description),
                                              given.description.stem().string(), given.options);
    return write(printed, given, common, record);
  });
}
