// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "compare/hems/hem_files.hpp"
#include "compare/report/account.hpp"
#include "compare/report/report.hpp"
#include "core/program/program.hpp"
#include "core/program/progress.hpp"
#include "core/program/words.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;
using Scale = std::function<PictureScale(const Silhouette&, const fs::path&)>;

/// Arguments of `drape drapemeter`.
struct DrapemeterArguments {
  std::vector<fs::path> inputs, compared;
  std::optional<fs::path> out, disc_picture, calibration;
  StandardTest geometry = StandardTest::iso_300;
  std::string camera;
  std::optional<double> disc_m, specimen_m, m_per_px;
  double plane_z_m = 0;
  bool disc_hole = false;
  std::optional<std::array<double, 5>> ruler;  ///< x y x y in px, length in mm
  HemReadOptions read;
  MatchOptions match;
};

/// Scale by intersecting a pixel's ray with a horizontal plane: corrects lens and tilt.
Scale scale_of_camera(const DrapemeterArguments& arguments) {
  const Calibration calibration = read_calibration(*arguments.calibration);
  if (calibration.no_go)
    throw bad_input("the calibration is NO-GO: " + *calibration.no_go,
                    {.file = arguments.calibration->string(), .field = "no_go"}, "calibrate again");
  const Camera camera = calibration.camera(arguments.camera).camera;
  const double z_m = arguments.plane_z_m;
  return [camera, z_m](const Silhouette& silhouette, const fs::path& file) {
    const Where where{.file = file.string(), .camera = camera.name};
    if (silhouette.width_px != camera.model.width_px ||
        silhouette.height_px != camera.model.height_px)
      throw bad_input("the picture has another size than the calibrated camera's", where,
                      "give the picture as the camera made it");
    const auto world = [camera, z_m, where](const Vector2d& p) {
      const auto ray = unproject(camera.model, {p.x(), -p.y()});
      const Vector3d from = centre_in_world(camera);
      const Vector3d along =
          ray ? Vector3d(camera.cam_from_world.rotation.transpose() * *ray) : Vector3d::Zero();
      if (std::abs(along.z()) < 1e-6)
        throw bad_input("a point of the hem does not meet the plane", where, "check --plane-z-mm");
      return Vector2d((from + (z_m - from.z()) / along.z() * along).head<2>());
    };
    return PictureScale{world, std::nullopt,
                        "the calibrated camera " + camera.name + " on a horizontal plane"};
  };
}

Scale scale_of(const DrapemeterArguments& arguments, double disc_m) {
  const int given = arguments.m_per_px.has_value() + arguments.disc_picture.has_value() +
                    arguments.calibration.has_value() + arguments.disc_hole +
                    arguments.ruler.has_value();
  if (given > 1)
    throw usage_error("the scale is given in more than one form",
                      "keep one of --mm-per-px, --ruler, --disc-picture, --disc-hole, "
                      "--calibration");
  if (arguments.calibration) return scale_of_camera(arguments);
  if (arguments.disc_hole) {
    return [disc_m](const Silhouette& silhouette, const fs::path& file) {
      return scale_of_disc(silhouette.hole, silhouette.hole, silhouette.hole, disc_m,
                           file.string());
    };
  }
  if (given == 0) return {};
  PictureScale scale;
  if (arguments.m_per_px) {
    scale = scale_of_pixel(*arguments.m_per_px, std::nullopt);
  } else if (arguments.disc_picture) {
    const Silhouette disc = read_silhouette(*arguments.disc_picture);
    scale = scale_of_disc(disc.quarter, disc.half, disc.three_quarters, disc_m,
                          arguments.disc_picture->string());
  } else {
    const std::array<double, 5>& r = *arguments.ruler;
    scale = scale_of_ruler({r[0], r[1]}, {r[2], r[3]}, r[4] * mm);
  }
  return [scale](const Silhouette&, const fs::path&) { return scale; };
}

void fields(Fields& f, DrapemeterArguments& a) {
  f(Field{"input",
          "pictures of hems, folders of them, sheets or meshes (PLY, OBJ in mm), or a CSV of radii "
          "(r000, r005 .. in mm)"}
        .called("INPUT"),
    a.inputs);
  f.otherwise(Field{"compare",
                    "virtual hem, or folder or table of hems, to test against the repeats of the "
                    "inputs; can be given several times"}
                  .per_flag(),
              a.compared);
  f.otherwise(
      {"significance", "fraction of real repeats that this test would call outside", 1, 0.001, 0.5},
      a.match.significance);
  f({"out", "folder for hems.csv and hems.json"}, a.out);
  f.otherwise({"geometry",
               "disc 180 mm with specimen 240, 300, 360 mm (ISO 9073-9, BS 5058), or 127 with 254 "
               "mm (JIS L 1096)"},
              a.geometry);
  f({"disc_mm",
     "diameter of another disc; required for sheets of a bench, which may hang over any object", mm,
     above_zero},
    a.disc_m);
  f({"specimen_mm", "diameter of another specimen; a sheet has its own flat area instead", mm,
     above_zero},
    a.specimen_m);
  f.otherwise({"names",
               "positions of fabric, sample, face and repeat in the files' paths, such as "
               "\"{fabric}/{sample}_{face}_{repeat}\"; * matches any text"},
              a.read.names);
  f({"mm_per_px", "scale of the pictures", mm, above_zero}, a.m_per_px);
  f({"ruler", "scale from a ruler: X1 Y1 X2 Y2 of two points in px, and their distance in mm"},
    a.ruler);
  f({"disc_picture",
     "scale from a picture of the bare disc by the same camera (corrects a small tilt)"},
    a.disc_picture);
  f.otherwise({"disc_hole",
               "scale from the disc on top of the cloth, seen as a round hole in each silhouette: "
               "its grey must be nearer to the table's than to the cloth's"},
              a.disc_hole);
  f({"calibration",
     "scale from calibration.json (corrects lens and tilt), with --camera and --plane-z-mm"},
    a.calibration);
  f.otherwise({"camera", "name of the calibrated camera"}, a.camera);
  f.otherwise({"plane_z_mm", "height of the hem in the world", mm}, a.plane_z_m);
  f({"scale_u_percent", "standard uncertainty of the scale, in addition to that of its source",
     units::percent, above_zero},
    a.read.scale_u);
}

/// Checked options with the scale of pictures. Throws Error(usage).
HemReadOptions read_options(const DrapemeterArguments& arguments, int threads) {
  HemReadOptions options = arguments.read;
  options.geometry = geometry_of(arguments.geometry);
  if (arguments.disc_m || arguments.specimen_m)
    options.geometry = {"own", arguments.disc_m.value_or(options.geometry.disc_m),
                        arguments.specimen_m.value_or(options.geometry.specimen_m)};
  options.geometry.check();
  options.disc_stated = arguments.disc_m.has_value();
  options.specimen_stated = arguments.specimen_m.has_value();
  options.scale = scale_of(arguments, options.geometry.disc_m);
  options.threads = threads;
  return options;
}

std::string text_of(const EnsembleBand& band) {
  std::string text = fmt::format("{:.1f} %, U {:.1f} (95 %)", band.mean, band.mean_u);
  if (band.samples > 1) text += fmt::format(" by the means of {} samples", band.samples);
  if (band.next)
    text += fmt::format("; 95 of 100 drapes lie from {:.1f} to {:.1f} %", band.next->first,
                        band.next->second);
  return text + fmt::format("; n {}", band.drapes);
}

void add_numbers(const std::vector<HemRecord>& hems, Ending& ending) {
  if (hems.size() == 1) {
    for (const HemNumber& number : hems.front().numbers)
      ending.numbers.emplace_back(
          number.name, fmt::format("{:.2f}", number.value) +
                           (number.u ? fmt::format(", U {:.2f} (k = 2)", *number.u) : ""));
    return;
  }
  for (const auto& [fabric, found] : variances_of(hems)) {
    std::map<std::string, std::vector<const HemRecord*>> faces;
    for (const HemRecord& hem : hems)
      if (hem.fabric == fabric) faces[hem.face].push_back(&hem);
    std::string text = fmt::format("n {}", found.drapes);
    for (const auto& [face, mean] : found.face_means)
      text += fmt::format(", face {} {:.1f} %", face.empty() ? "-" : face, mean);
    if (found.repeat_sd) text += fmt::format(", repeat sd {:.2f}", *found.repeat_sd);
    if (found.sample_sd) text += fmt::format(", sample sd {:.2f}", *found.sample_sd);
    ending.numbers.emplace_back("drape coefficient " + fabric, text);
    for (const auto& [face, of_face] : faces)
      if (const auto band = band_of(of_face))
        ending.numbers.emplace_back(fmt::format("mean{} {}{}", band->next ? " and band" : "",
                                                fabric, face.empty() ? "" : " face " + face),
                                    text_of(*band));
  }
}

void add_matches(const std::vector<HemMatch>& matches, Ending& ending) {
  for (const HemMatch& match : matches) {
    std::string text = fmt::format("{}, p {}, {} repeats", name_of(match.verdict),
                                   match.p ? fmt::format("{:.3f}", *match.p) : "-", match.repeats);
    if (match.drape_coefficient.detectable)
      text += fmt::format("; {:.1f} points would be found", *match.drape_coefficient.detectable);
    if (!match.reason.empty()) text += "; " + match.reason;
    ending.numbers.emplace_back(
        fmt::format("{} against {} {}", match.virtual_file, match.fabric, match.face), text);
  }
}

/// Ending with a hem's numbers or each fabric's variance components, matches and refused files.
Ending ending_of(const HemSet& real, const HemSet& compared, const std::vector<HemMatch>& matches) {
  Ending ending;
  std::vector<std::string> causes;
  for (const HemSet* set : {&real, &compared}) {
    for (const std::string& reason : set->refused) ending.rejected.push_back(reason);
    causes.insert(causes.end(), set->refused.begin(), set->refused.end());
    for (const HemRecord& hem : set->hems) {
      for (const std::string& warning : hem.warnings)
        ending.rejected.push_back(hem.file + ": " + warning);
      if (!hem.go) causes.push_back(ending.rejected.back());
    }
  }
  ending.go = causes.empty();
  if (!ending.go) ending.verdict = causes.front() + "; ";
  ending.verdict += fmt::format("{} hems measured, {} files refused", real.hems.size(),
                                real.refused.size() + compared.refused.size());
  add_numbers(real.hems, ending);
  add_matches(matches, ending);
  return ending;
}

/// Outputs, and the inputs given by name; those in folders are found later.
StepFiles named_files(const DrapemeterArguments& arguments) {
  StepFiles files;
  if (arguments.out) files.outputs = {*arguments.out / "hems.csv", *arguments.out / "hems.json"};
  for (const auto* list : {&arguments.inputs, &arguments.compared})
    for (const auto& file : *list)
      if (!fs::is_directory(file)) files.inputs.push_back(file);
  return files;
}

/// Command with hems.csv as --compare for simulations, which are to be tested, else as input.
std::string next_command(const HemSet& set, const DrapemeterGeometry& geometry,
                         const std::string& csv) {
  const auto all = [&](const auto& is) {
    return !set.hems.empty() && std::all_of(set.hems.begin(), set.hems.end(), is);
  };
  const bool simulated = all([](const auto& hem) { return hem.kind == HemKind::simulated; });
  std::string text = fmt::format("drape drapemeter {} --disc-mm {:.10g}", simulated ? "REAL" : csv,
                                 geometry.disc_m / units::mm);
  if (!all([](const auto& hem) { return hem.own_specimen; }))
    text += fmt::format(" --specimen-mm {:.10g}", geometry.specimen_m / units::mm);
  return text + " --compare " + (simulated ? csv : "SHEET");
}

int run_drapemeter(const DrapemeterArguments& arguments, std::vector<std::string> words,
                   const CommonOptions& common) {
  const StepFiles named = named_files(arguments);
  RunRecord record("drape-compare", std::move(words),
                   arguments.out ? run_record_path(*arguments.out / "hems.json") : fs::path(),
                   named);
  const HemReadOptions options = read_options(arguments, thread_count(common));
  HemSet real = read_hems(arguments.inputs, options);
  HemReadOptions virtual_options = options;
  virtual_options.names.clear();
  HemSet compared;
  if (!arguments.compared.empty()) {
    compared = read_hems(arguments.compared, virtual_options);
    refuse_other_kinds(real, compared);
    refuse_copies_of(real, compared);
  }
  const std::vector<HemMatch> matches = match_hems(real.hems, compared.hems, arguments.match);
  for (const auto& inputs : {real.inputs, compared.inputs})
    for (const auto& file : inputs)
      if (std::find(named.inputs.begin(), named.inputs.end(), file) == named.inputs.end())
        record.input(file);
  Ending ending = ending_of(real, compared, matches);
  if (arguments.out) {
    const auto &csv = named.outputs[0], &json = named.outputs[1];
    write_durable(csv, hems_csv(options.geometry, real.hems));
    write_record(json, HemsFile{options.geometry, real.hems, real.refused,
                                arguments.match.significance, matches});
    ending.next_command = next_command(real, options.geometry, shell_word(csv.string()));
  }
  return finish(ending, common, record);
}

int drapemeter_command(int argc, char** argv) {
  return run_command<DrapemeterArguments>(
      argc, argv, "drape-compare drapemeter",
      "Drape coefficient, nodes and Fourier orders of hems, from pictures or sheets.",
      run_drapemeter);
}

struct RepeatsArguments {
  std::vector<fs::path> repeats, compared;
  std::optional<fs::path> out;
  double significance = 0.05;
};

void fields(Fields& f, RepeatsArguments& a) {
  f(Field{"sheet",
          "measured sheets, repeats of one drape (stated in each, or used to position a sheet of "
          "--compare)"}
        .called("SHEET"),
    a.repeats);
  f.otherwise(
      Field{"compare", "simulated sheet of the same drape; can be given several times"}.per_flag(),
      a.compared);
  f.otherwise({"significance", "probability that a real repeat counts as outside", 1, 0.001, 0.5},
              a.significance);
  f({"out", "repeats.json to write"}, a.out);
}

/// Both files of each sheet, whichever is given.
std::vector<fs::path> files_of_sheets(const std::vector<fs::path>& sheets) {
  std::vector<fs::path> files;
  for (const fs::path& sheet : sheets)
    for (const char* ending : {".ply", ".json"})
      files.push_back(fs::path(sheet).replace_extension(ending));
  return files;
}

std::vector<SheetFile> sheets_of(const std::vector<fs::path>& files) {
  std::vector<SheetFile> sheets;
  for (const auto& file : files) sheets.push_back(read_sheet_file(file));
  return sheets;
}

int run_repeats(const RepeatsArguments& arguments, std::vector<std::string> words,
                const CommonOptions& common) {
  StepFiles files{{}, files_of_sheets(arguments.repeats)};
  for (const auto& file : files_of_sheets(arguments.compared)) files.inputs.push_back(file);
  if (arguments.out) files.outputs = {*arguments.out};
  RunRecord record("drape-compare", std::move(words),
                   arguments.out ? run_record_path(*arguments.out) : fs::path(), files);
  const std::vector<SheetFile> repeats = sheets_of(arguments.repeats);
  const std::vector<SheetFile> compared = sheets_of(arguments.compared);
  require_one_drape(repeats, compared);
  const MarkRepeats found = mark_repeats(repeats, compared, arguments.significance);
  Ending ending;
  for (const auto* sheets : {&repeats, &compared})
    for (const std::string& reason : no_go_of(*sheets)) ending.rejected.push_back(reason);
  for (std::string& reason : moved_objects(repeats, compared))
    ending.rejected.push_back(std::move(reason));
  ending.go = ending.rejected.empty();
  ending.verdict =
      fmt::format("{} repeats with {} marks in common", arguments.repeats.size(), found.marks);
  for (const auto& match : found.matches)
    ending.numbers.emplace_back(match.name,
                                std::string(name_of(match.verdict)) +
                                    (match.p ? fmt::format(", p {:.3f}", *match.p) : "") +
                                    (match.reason.empty() ? "" : "; " + match.reason));
  if (arguments.out)
    write_record(*arguments.out, RepeatsFile{arguments.significance, repeats, found});
  return finish(ending, common, record);
}

int repeats_command(int argc, char** argv) {
  return run_command<RepeatsArguments>(argc, argv, "drape-compare repeats",
                                       "Tests whether a virtual sheet is inside the repeats of the "
                                       "real one, by marks, hem and spectrum.",
                                       run_repeats);
}

/// Arguments of `drape compare`.
struct CompareArguments {
  std::vector<fs::path> sheets;
  fs::path calibration, store, report, acceptance;
  std::vector<fs::path> sensitivities, repeats;
  std::vector<std::string> warnings, not_compared;
  RunLabel label;
  Options options;
};

void fields(Fields& f, CompareArguments& a) {
  f(Field{"sheet",
          "sheet.ply or .json; each measured one starts a group with the simulated ones after it "
          "(those before any are compared with each other); .toml: mesh of another simulator"}
        .called("SHEET"),
    a.sheets);
  f.otherwise({"calibration", "calibration.json: draws the virtual cloth into the photographs"},
              a.calibration);
  f.otherwise({"acceptance",
               "acceptance.json of the rig, kept in the store: NO-GO if it is NO-GO for this "
               "calibration, a warning if it is out of date"},
              a.acceptance);
  f.otherwise(Field{"warning", "warning of an earlier stage, kept in report and store"}.per_flag(),
              a.warnings);
  f.otherwise(
      Field{"no_go", "further reason why the bench is NO-GO, kept in report and store"}.per_flag(),
      a.not_compared);
  f.otherwise({"store", "results store to add to (created if absent)"}, a.store);
  f.otherwise({"report", "report.html to write, with its pictures beside it"}, a.report);
  f.otherwise({"label", "name of the run in the store"}, a.label.label);
  f.otherwise({"operator", "name of the operator"}, a.label.operator_name);
  f.otherwise(Field{"repeat",
                    "measured sheet of another laying of a drape: the match is based on them if "
                    "there are three or more"}
                  .per_flag(),
              a.repeats);
  f.otherwise({"significance", "fraction of real repeats that count as outside the others", 1,
               above_zero, 1},
              a.options.significance);
  f({"tolerance_mm",
     "limit of the mean distance for the match if the drape was laid fewer than three times; "
     "default: none, and no match",
     units::mm, above_zero},
    a.options.tolerance_m);
  f.otherwise(
      Field{"sensitivity", "sensitivity.json that must lie beside a simulated sheet"}.per_flag(),
      a.sensitivities);
  f.otherwise({"min_marks", "NO-GO below this number of compared marks", 1, 1},
              a.options.min_marks);
  f.otherwise({"max_sigma_percent",
               "NO-GO if the median uncertainty of a mark exceeds this percentage of the limit",
               units::percent, above_zero},
              a.options.max_sigma_ratio);
  f.otherwise({"accept_unsettled", "warn instead of NO-GO if a simulation is not at rest"},
              a.options.accept_unsettled);
}

/// Ending to keep in the run record.
Ending ending_of(const RunReport& report, const Outcome& outcome) {
  Ending ending;
  ending.go = report.go;
  ending.verdict = report.sentence;
  for (const ReportedDrape& drape : report.drapes) {
    const DistanceFigures shown = figures_of(drape);
    if (!shown.mean.empty())
      ending.numbers.emplace_back(
          drape.label, fmt::format("{} mm apart, U {} mm, {}", shown.mean, shown.expanded,
                                   drape::name_of(drape.match.match)));
  }
  if (outcome.stored)
    ending.numbers.emplace_back(
        "store",
        fmt::format("{}: run {}, {} comparisons added, {} were there already", outcome.store,
                    outcome.run, outcome.stored->added, outcome.stored->present));
  if (!outcome.report.empty()) ending.numbers.emplace_back("report", outcome.report);
  ending.rejected = outcome.not_compared;
  ending.warnings = outcome.warnings;
  for (std::size_t i = 1; i < report.reasons.size(); ++i)
    ending.warnings.push_back("NO-GO also because " + report.reasons[i]);
  if (!outcome.store.empty())
    ending.next_command = fmt::format("drape results {} --store {}",
                                      report.run ? fmt::format("show {}", *report.run) : "tables",
                                      shell_word(outcome.store));
  return ending;
}

/// Prints the ending as text, or report.json with the keys of the ending; returns the exit code.
int print_ending(const RunReport& report, const Ending& ending, const std::string& page,
                 const CommonOptions& common) {
  if (common.json) {
    Value all = value_of(report);
    const Value end = value_of(ending);
    for (const auto& [key, value] : *end.get_if<Value::Table>())
      if (all.find(key) == nullptr) all[key] = value;
    print_text(pretty(all));
  } else if (!common.quiet) {
    print_text(printable(ending_text(report, first_line(report), page)));
    if (!ending.next_command.empty())
      print_text("next    " + printable(ending.next_command) + "\n");
  }
  return ending.go ? 0 : 1;
}

/// Records a sensitivity file even if it was left out, since it would be used once made again.
void record_sensitivity(const fs::path& file, const Session& session, RunRecord& record) {
  for (const auto& [read, sha256] : session.read)
    if (read == file) return;
  record.input(file);
  for (const DrapeFiles& drape : session.drapes)
    for (const Simulation& one : drape.input.simulations)
      if (equivalent(absolute(file).parent_path(), absolute(one.sheet.file).parent_path())) return;
  throw bad_input("the simulation of this sensitivity.json is not given", {.file = file.string()},
                  "give the sheet.ply that it lies beside, or leave it out");
}

int run_compare(CompareArguments& arguments, const std::vector<std::string>& command,
                const CommonOptions& common) {
  const auto& primary = arguments.report.empty() ? arguments.store : arguments.report;
  RunRecord record("drape-compare", command,
                   primary.empty() ? fs::path() : run_record_path(primary));
  Progress progress("compare", common.quiet || common.json);
  progress.update(0, "reading sheets");
  const Session session = read_session(arguments.sheets, arguments.calibration, arguments.repeats);
  for (const auto& [file, sha256] : session.read) record.input(file, sha256);
  for (const auto& file : arguments.sensitivities) record_sensitivity(file, session, record);
  Outcome outcome;
  outcome.warnings = arguments.warnings;
  outcome.not_compared = arguments.not_compared;
  outcome.warnings.insert(outcome.warnings.end(), session.warnings.begin(), session.warnings.end());
  outcome.arguments = command;
  outcome.store = arguments.store.string();
  outcome.report = arguments.report.string();
  // Completes a store whose creation was interrupted, which a reader would refuse.
  if (fs::is_regular_file(arguments.store)) Store(arguments.store).close();
  const auto acceptance = look_at_acceptance(arguments.acceptance, session, outcome, record);
  compare_session(session, arguments.options, outcome);
  progress.update(0.3, "storing");
  if (!arguments.store.empty()) {
    if (acceptance) store_acceptance(arguments.store, *acceptance);
    outcome.stored = import_session(arguments.store, session, outcome, arguments.label);
    record.output(arguments.store);
  }
  progress.update(0.6, "writing the report");
  const fs::path folder = arguments.report.parent_path();
  const RunReport account = account_of(session, outcome, folder.empty() ? "." : folder);
  if (!arguments.report.empty()) {
    for (const auto& file : write_report(arguments.report, account)) record.output(file);
  }
  progress.update(1, "done");
  const Ending ending = ending_of(account, outcome);
  record.write(outcome.go() ? 0 : 1, ending);
  return print_ending(account, ending, outcome.report, common);
}

int compare_command(int argc, char** argv) {
  return run_command<CompareArguments>(
      argc, argv, "drape-compare",
      "Measures the distance between real and virtual drapes, stores and reports it.", run_compare);
}

}  // namespace
}  // namespace drape::compare

int main(int argc, char** argv) {
  using namespace drape::compare;
  return drape::run_stage(
      argc, argv, compare_command,
      {{"repeats", repeats_command, "is a virtual sheet inside the repeats of the real one?"},
       {"drapemeter", drapemeter_command, "drape coefficient, nodes and Fourier orders of hems"}});
}
