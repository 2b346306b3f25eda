// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <malloc.h>

#include <filesystem>

#include "calib/acceptance/acceptance.hpp"
#include "calib/acceptance/figures.hpp"
#include "calib/calib.hpp"
#include "calib/exchange/exchange.hpp"
#include "calib/joint.hpp"
#include "calib/programs/ending.hpp"
#include "core/acceptance_file.hpp"
#include "core/fields/fields.hpp"
#include "core/fields/records.hpp"
#include "core/files/files.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

enum class Method { tsai, joint };

/// Board model: nominal, bowed or free, or the one chosen on held-out views.
enum class BoardChoice { held_out, drawn, bow, free };

/// Lens terms, or those chosen on held-out views.
enum class LensChoice { held_out, k1, k1k2, k1k2p1p2, k1k2p1p2k3 };

}  // namespace
}  // namespace drape::calib

template <>
inline constexpr std::string_view drape::names_of<drape::calib::Method>[] = {"tsai", "joint"};
template <>
inline constexpr std::string_view drape::names_of<drape::calib::BoardChoice>[] = {
    "held-out", "drawn", "bow", "free"};
template <>
inline constexpr std::string_view drape::names_of<drape::calib::LensChoice>[] = {
    "held-out", "k1", "k1k2", "k1k2p1p2", "k1k2p1p2k3"};

namespace drape::calib {

namespace fs = std::filesystem;

namespace {

std::optional<std::string> if_given(const std::string& text) {
  return text.empty() ? std::nullopt : std::optional(text);
}

AcceptanceFile file_of(const Acceptance& acceptance, const AcceptanceDates& dates) {
  AcceptanceFile file;
  file.rig = acceptance.rig;
  file.calibration_sha256 = acceptance.calibration_sha256;
  file.date = if_given(dates.on);
  file.valid_until = if_given(dates.valid_until);
  file.cause = if_given(acceptance.cause);
  file.positions = acceptance.positions;
  file.go = acceptance.good();
  file.warnings = acceptance.warnings;
  file.lacks = acceptance.lacks;
  for (const AcceptanceFigure& figure : acceptance.figures) {
    const auto if_measured = [&](double value) {
      return figure.not_measured.empty() ? std::optional(value) : std::nullopt;
    };
    file.figures.push_back({.name = figure.name,
                            .unit = figure.unit,
                            .where = figure.where,
                            .value = if_measured(figure.value),
                            .expanded = if_measured(figure.expanded),
                            .limit = if_measured(figure.limit),
                            .limit_stated = figure.limit_stated,
                            .smallest_fault = if_measured(figure.smallest),
                            .smallest_fault_unit = if_given(figure.smallest_unit),
                            .not_measured = if_given(figure.not_measured),
                            .go = figure.good()});
  }
  return file;
}

/// Verdict and figures as text; `page` is the protocol.
Ending ending_of(const Acceptance& acceptance, const std::filesystem::path& page) {
  Ending ending;
  ending.go = acceptance.good();
  for (const AcceptanceFigure& figure : acceptance.figures) {
    const std::string value =
        figure.not_measured.empty()
            ? fmt::format(
                  "{:.4f} +- {:.4f} (95 %) {}, limit {:.4f}{}: {}, {}; named from {:.4f} {}",
                  figure.value, figure.expanded, figure.unit, figure.limit,
                  figure.limit_stated ? " (stated)" : "",
                  figure.good()    ? "GO"
                  : figure.informs ? "warning"
                                   : "NO-GO",
                  figure.where, figure.smallest, figure.smallest_unit)
            : "not measured: " + figure.not_measured;
    ending.numbers.emplace_back(figure.name, value);
    const bool lacks = figure.may_lack && !figure.not_measured.empty();
    if (!figure.good() && !figure.informs && !lacks && ending.verdict.empty())
      ending.verdict = figure.name + " " + value;
  }
  if (!acceptance.cause.empty()) ending.verdict = acceptance.cause;
  if (ending.go)
    ending.verdict =
        acceptance.lacks.empty()
            ? fmt::format("the instrument is accepted from {} positions", acceptance.positions)
            : fmt::format(
                  "the interim check is passed at {} positions; an acceptance (ISO "
                  "10360-13, VDI/VDE 2634) needs also {}",
                  acceptance.positions, fmt::join(acceptance.lacks, ", "));
  ending.warnings = acceptance.warnings;
  ending.numbers.emplace_back("protocol", page.string());
  return ending;
}

struct AcceptanceArguments {
  fs::path detections, calibration, rig, out;
  std::optional<fs::path> target, sphere;
  std::optional<double> sphere_diameter_mm;
  double sphere_uncertainty_mm = 0.01;
  std::vector<std::string> repeats;
  std::string date;
  int valid_days = 365;
  AcceptanceOptions options;
};

void fields(Fields& f, AcceptanceArguments& a) {
  f(Field{"detections", "detections.json of the target"}.called("DETECTIONS"), a.detections);
  f({"calibration", "calibration.json to accept"}, a.calibration);
  f({"rig", "rig folder or its rig.toml"}, a.rig);
  f({"out",
     "acceptance.json to write, beside rig.toml for `drape run` and `drape doctor`; a page for "
     "printing beside it"},
    a.out);
  f.if_any({"target",
            "target file of a plate other than the calibration's: its own [known_length] also "
            "tests the scale"},
           a.target);
  f.if_any(Field{"repeats", "sets of the target at rest, for the noise floor"}.plain_name(),
           a.repeats);
  f.if_any({"sphere", "detections.json of a ball with the print on it, all marks on the ball"},
           a.sphere);
  f.if_any({"sphere_diameter_mm", "diameter of the ball including the print, mm", 1, above_zero},
           a.sphere_diameter_mm);
  f.otherwise({"sphere_uncertainty_mm", "standard uncertainty of the diameter, mm", 1, 0},
              a.sphere_uncertainty_mm);
  f.otherwise({"date", "date of the test, e.g. 2026-01-31"}, a.date);
  f.otherwise(
      {"valid_days", "days after which `drape run` and `drape doctor` ask for another test", 1, 1},
      a.valid_days);
  fields(f, a.options);
}

/// Throws Error(usage) for an option without effect, of a ball without --sphere or of a date
/// without --date, and for a ball of unknown size.
void refuse_idle_options(const Command& app) {
  const auto needs = [&](const std::string& option, const std::string& other) {
    if (app.count(option) > 0 && app.count(other) == 0)
      throw usage_error(option + " says nothing without " + other,
                        "add " + other + ", or leave " + option + " out");
  };
  for (const char* option : {"--sphere-diameter-mm", "--sphere-uncertainty-mm",
                             "--max-sphere-form-mm", "--max-sphere-size-mm"})
    needs(option, "--sphere");
  needs("--sphere", "--sphere-diameter-mm");
  needs("--valid-days", "--date");
}

int accept_command(int argc, char** argv) {
  Command app(
      "Tests and accepts a calibrated rig by its measurements: lengths and flatness of a plate at "
      "seven or "
      "more\n"
      "positions, a known shift of the z stage, a ball with the print on it, the noise of "
      "repeats,\n"
      "each with its expanded uncertainty and limit (after VDI/VDE 2634 and ISO 10360-13); and\n"
      "whether the plate or a camera changed since the calibration. Record sets that the\n"
      "calibration did not use. A limit that is not given follows from the uncertainties of\n"
      "calibration, marks and print: it is what this instrument can prove.\n\n"
      "  drape calib accept detections.json --calibration calibration.json --rig rigs/bench1 \\\n"
      "    --repeats rest_1,rest_2,rest_3 --date 2026-01-31 --out rigs/bench1/acceptance.json",
      "drape-calib accept");
  CommonOptions common;
  AcceptanceArguments arguments;
  add_common_options(app, common);
  app.add_record(arguments);
  return run_program(app, argc, argv, common, [&] {
    refuse_idle_options(app);
    fs::path rig_file = arguments.rig;
    if (fs::is_directory(rig_file)) rig_file /= "rig.toml";
    const AcceptanceDates dates = dates_of(arguments.date, arguments.valid_days);
    const fs::path page = fs::path(arguments.out).replace_extension(".html");
    StepFiles files{{arguments.out, page}, {rig_file, arguments.detections, arguments.calibration}};
    if (arguments.sphere) files.inputs.push_back(*arguments.sphere);
    RunRecord record("drape-calib", arguments_of(argc, argv), run_record_path(arguments.out),
                     files);
    const Rig rig = read_rig(rig_file);
    const fs::path target_file = arguments.target.value_or(rig.target_file);
    record.input(target_file);
    AcceptanceInput input{read_detections(arguments.detections), arguments.repeats, {}};
    input.calibrated = detections_behind(arguments.calibration, arguments.detections);
    input.file = arguments.detections.string();
    if (arguments.sphere)
      input.sphere = SphereInput{read_detections(*arguments.sphere), *arguments.sphere_diameter_mm,
                                 arguments.sphere_uncertainty_mm};
    AcceptanceOptions options = arguments.options;
    options.own_target = !arguments.target.has_value();
    Acceptance acceptance = accept(input, read_calibration(arguments.calibration), rig,
                                   read_target(target_file), options);
    acceptance.calibration_sha256 = sha256_of_file(arguments.calibration);
    write_record(arguments.out, file_of(acceptance, dates));
    write_durable(page, protocol_page(acceptance, dates));
    return finish(ending_of(acceptance, page), common, record);
  });
}

struct ConvertArguments {
  std::vector<fs::path> inputs;
  std::optional<ExchangeFormat> to, from;
  std::string rig = "imported";
  fs::path out;
  ExportOptions options;
  ImportOptions import;
};

void fields(Fields& f, ConvertArguments& a) {
  f(Field{"input",
          "calibration.json, or files of the other tool (COLMAP: cameras.txt, images.txt beside "
          "it)"}
        .called("INPUT"),
    a.inputs);
  f.if_any(Field{"to", "tool whose format to write"}.without("from"), a.to);
  f.if_any({"from", "tool whose format to read"}, a.from);
  f({"out", "folder (--to) or calibration.json (--from) to write"}, a.out);
  f.otherwise(
      {"max_refit_px",
       "refuse if the conversion would change a lens by more than this anywhere in its image, px",
       1, 0},
      a.options.max_refit_px);
  f.if_any(Field{"unit_mm", "length of one unit of the file, mm (default: what the tool states)",
                 units::mm, above_zero}
               .without("to"),
           a.import.unit_m);
  f.otherwise({"rig", "name of the rig for an imported calibration"}, a.rig);
}

Ending export_to(const ConvertArguments& given, RunRecord& record) {
  if (given.inputs.size() != 1)
    throw usage_error("--to takes one calibration.json", "give one file");
  const ExportResult result =
      export_calibration(read_calibration(given.inputs[0]), *given.to, given.options);
  Ending ending;
  for (const ExportedFile& file : result.files) {
    write_durable(given.out / file.name, file.text);
    record.output(given.out / file.name);
  }
  for (std::size_t i = 0; i < result.cameras.size(); ++i) {
    const BrownRefit& refit = result.refits[i];
    ending.numbers.emplace_back(result.cameras[i],
                                refit.points == 0
                                    ? "the same lens"
                                    : fmt::format("lens refitted: RMS {:.6f} px, at most {:.6f} px",
                                                  refit.rms_px, refit.max_px));
  }
  ending.verdict = fmt::format("{} cameras written for {} in {}", result.cameras.size(),
                               name_of(*given.to), given.out.string());
  return ending;
}

Ending import_from(const ConvertArguments& given) {
  const Calibration calibration =
      import_calibration(given.inputs, *given.from, given.rig, given.import);
  write_calibration(given.out, calibration);
  Ending ending;
  ending.verdict =
      fmt::format("{} cameras read from {}", calibration.cameras.size(), name_of(*given.from));
  ending.warnings = calibration.warnings;
  ending.next_command = next_command(given.out);
  return ending;
}

int convert_command(int argc, char** argv) {
  Command app("Writes a calibration for other tools, or reads theirs", "drape-calib convert");
  CommonOptions common;
  ConvertArguments given;
  add_common_options(app, common);
  app.add_record(given);
  return run_program(app, argc, argv, common, [&] {
    if (!given.to == !given.from)
      throw usage_error("neither --to nor --from is given", "give one of them");
    if (!given.to ? app.count("--max-refit-px") > 0 : app.count("--rig") > 0)
      throw usage_error("--max-refit-px is of --to, --rig of --from", "leave the other one out");
    StepFiles files{{}, given.inputs};
    if (!given.to) files.outputs.push_back(given.out);
    RunRecord record("drape-calib", arguments_of(argc, argv),
                     !given.to ? run_record_path(given.out) : given.out / "convert.run.json",
                     files);
    record.option("max_refit_px", fmt::format("{}", given.options.max_refit_px));
    return finish(!given.to ? import_from(given) : export_to(given, record), common, record);
  });
}

struct CalibArguments {
  fs::path detections, rig, out;
  Method method = Method::tsai;
  LensChoice lens = LensChoice::held_out;
  BoardChoice board = BoardChoice::held_out;
  JointOptions options;
  std::optional<fs::path> lens_from, compare, plate;
};

/// Settings that determine a calibration, besides its files.
struct CalibSettings {
  CalibArguments& arguments;
};

void fields(Fields& f, CalibSettings& settings) {
  CalibArguments& a = settings.arguments;
  f.otherwise(
      {"method",
       "tsai: each camera from the z stages; joint: all cameras from stages and free poses"},
      a.method);
  fields(f, a.options.common);
  f.otherwise(
      {"lens",
       "joint: terms of the lens model, or held-out to choose them by views left out of the fit"},
      a.lens);
  f.otherwise({"board",
               "joint: target points as drawn, on a bow, free within the print's error, or "
               "held-out to choose by views left out of the fit"},
              a.board);
  fields(f, a.options);
}

void fields(Fields& f, CalibArguments& a) {
  f(Field{"detections", "detections.json of the target"}.called("DETECTIONS"), a.detections);
  f({"rig", "rig folder or its rig.toml"}, a.rig);
  f({"out", "calibration.json to write"}, a.out);
  CalibSettings settings{a};
  fields(f, settings);
  f.if_any(
      {"lens_from",
       "joint: calibration.json from which to take the lenses of the cameras of the same names"},
      a.lens_from);
  f.if_any({"plate",
            "joint: target file to write, with the target points as measured by the views, for "
            "other calibrations"},
           a.plate);
  f.if_any({"compare", "older calibration.json, to report how far each camera has drifted since"},
           a.compare);
}

/// Throws Error(usage) for an option of the joint method given with another one.
void refuse_joint_options(const Command& app, Method method) {
  if (method == Method::joint) return;
  for (const std::string option :
       {"--lens", "--lens-from", "--board", "--plate", "--free-stages", "--thickness-mm"})
    if (app.count(option) > 0)
      throw usage_error(fmt::format("{} does nothing with --method {}", option, name_of(method)),
                        "add --method joint, or leave " + option + " out");
}

/// Makes the ending NO-GO for a cause that precedes the program's own.
void refuse(Ending& ending, const std::string& cause) {
  if (!ending.go) ending.warnings.push_back("NO-GO also because " + ending.verdict);
  ending.go = false;
  ending.verdict = cause;
  ending.next_command.clear();
}

/// Writes the target's file with measured positions; writes none if the calibration is NO-GO or the
/// board is taken as drawn.
void write_plate(const fs::path& file, const Target& target, const JointResult& result,
                 Ending& ending, RunRecord& record) {
  if (!ending.go || !result.report.plate) {
    ending.warnings.push_back(
        "no measured plate is written: " +
        std::string(!ending.go ? "the calibration is NO-GO"
                               : "the views do not ask for another target than the drawn one; "
                                 "--board free measures it all the same"));
    return;
  }
  Value root = target.document.root();
  root["measured"] = value_of(*result.report.plate);
  write_value(file, root);
  record.output(file);
  ending.numbers.emplace_back("measured plate", file.string());
}

/// Calibrates by either method; returns the calibration and the ending.
std::pair<Calibration, Ending> calibrate(const Detections& detections, const Rig& rig,
                                         const Target& target, Method method,
                                         const JointOptions& options, const fs::path& out,
                                         const std::optional<fs::path>& plate, RunRecord& record) {
  const auto judged = [&](Calibration calibration, Ending ending) {
    if (const auto against = detections.reason_against(calibration.sets)) refuse(ending, *against);
    if (options.known_lenses && options.known_lenses->no_go)
      refuse(ending, "the lenses' calibration is NO-GO: " + *options.known_lenses->no_go);
    if (!ending.go) calibration.no_go = ending.verdict;
    return std::pair{std::move(calibration), ending};
  };
  if (method == Method::tsai) {
    const CalibResult result = calibrate_tsai(detections, rig, target, options.common);
    return judged(result.calibration, ending_of(result, out));
  }
  const JointResult result = calibrate_joint(detections, rig, target, options);
  auto [calibration, ending] = judged(result.calibration, ending_of(result, out));
  if (plate) write_plate(*plate, target, result, ending, record);
  return {std::move(calibration), std::move(ending)};
}

// The commands of drape-calib. Each parses its own command line and returns the exit code.
int calib_command(int argc, char** argv) {
  Command app("Calibrates the cameras of a rig from detections of its target", "drape-calib");
  CommonOptions common;
  CalibArguments given;
  add_common_options(app, common);
  app.add_record(given);
  return run_program(app, argc, argv, common, [&] {
    refuse_joint_options(app, given.method);
    JointOptions& options = given.options;
    if (given.lens != LensChoice::held_out)
      options.lens = static_cast<LensTerms>(static_cast<int>(given.lens) - 1);
    if (given.board != BoardChoice::held_out)
      options.board = static_cast<BoardKind>(static_cast<int>(given.board) - 1);
    if (given.lens_from) options.known_lenses = read_calibration(*given.lens_from);
    fs::path rig_file = given.rig;
    if (fs::is_directory(rig_file)) rig_file /= "rig.toml";
    StepFiles files{{given.out}, {rig_file, given.detections}};
    if (given.plate) require_replaceable(*given.plate);
    for (const auto& file : {given.lens_from, given.compare})
      if (file) files.inputs.push_back(*file);
    RunRecord record("drape-calib", arguments_of(argc, argv), run_record_path(given.out), files);
    const Rig rig = read_rig(rig_file);
    record.input(rig.target_file);
    const Target target = read_target(rig.target_file);
    auto [calibration, ending] = calibrate(read_detections(given.detections), rig, target,
                                           given.method, options, given.out, given.plate, record);
    if (given.compare)
      add_drift(ending, read_calibration(*given.compare), calibration, rig, target);
    write_calibration(given.out, calibration);
    for (const auto& [name, value] : flat(value_of(CalibSettings{given})))
      record.option(name, value);
    return finish(ending, common, record);
  });
}

}  // namespace

}  // namespace drape::calib

int main(int argc, char** argv) {
  using namespace drape::calib;
  // Matrices of 12 MB come and go; their pages, given back each time, cost a third of a calibration
  // of 200 placements.
  ::mallopt(M_MMAP_THRESHOLD, 32 << 20);
  ::mallopt(M_TRIM_THRESHOLD, 256 << 20);
  return drape::run_stage(
      argc, argv, calib_command,
      {{"accept", accept_command, "tests and accepts a calibrated rig"},
       {"convert", convert_command, "writes calibrations for other tools, or reads theirs"}});
}
