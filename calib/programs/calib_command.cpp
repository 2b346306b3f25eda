// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>

#include "calib/calib.hpp"
#include "calib/joint.hpp"
#include "calib/programs/commands.hpp"
#include "calib/programs/ending.hpp"
#include "core/error.hpp"
#include "core/fields/records.hpp"
#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"

namespace drape::calib {

namespace fs = std::filesystem;

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
namespace {

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

}  // namespace

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

}  // namespace drape::calib
