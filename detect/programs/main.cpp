// SPDX-License-Identifier: Apache-2.0

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "core/fields/fields.hpp"
#include "core/files/files.hpp"
#include "core/program/program.hpp"
#include "core/program/progress.hpp"
#include "core/program/run_record.hpp"
#include "core/program/words.hpp"
#include "core/units.hpp"
#include "detect/detect.hpp"
#include "detect/prints/layout.hpp"

namespace drape::detect {

namespace fs = std::filesystem;

namespace {

struct PageArguments {
  fs::path out;
  Paper paper = Paper::automatic;
};

void fields(Fields& f, PageArguments& a) {
  f({"out", "PDF to write, with the same page as SVG beside it"}, a.out);
  f.otherwise({"paper", "auto (a4, else a3), a4, a3, letter, or fit: as large as needed"}, a.paper);
}

struct PrintArguments : PageArguments {
  fs::path description;
};

void fields(Fields& f, PrintArguments& a) {
  f(Field{"file", "print.toml of the patch, or target.toml"}.called("FILE"), a.description);
  fields(f, static_cast<PageArguments&>(a));
}

struct PlateArguments : PageArguments {
  double size_m = 80 * units::mm;
  int first_id = 500;
};

void fields(Fields& f, PlateArguments& a) {
  fields(f, static_cast<PageArguments&>(a));
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

/// Throws Error(bad_input) if `file` exists and is neither exactly the output of the run of
/// `record` nor the text to be written, left by a killed run: it may be a rig's target, or a
/// description that was corrected since.
void require_replaceable_plate(const fs::path& file, const std::string& text,
                               const fs::path& record) {
  if (!fs::exists(file) || read_text(file) == text) return;
  try {
    if (read_run_file(record).wrote(sha256_of_file(file))) return;
  } catch (const Error&) {  // a record that cannot be read is no evidence
  }
  throw bad_input("it is there already, and no plate that this program wrote beside its page",
                  {.file = file.string()}, "give --out another name");
}

/// Throws before any measurement if the overlay folder (empty: none) is not a
/// folder, or lies in the recording, where overlays could overwrite a camera's
/// pictures.
void require_apart(const fs::path& recording, const fs::path& out, const fs::path& overlays) {
  const fs::path folder =
      fs::weakly_canonical(fs::absolute(recording / "recording.json")).parent_path();
  const auto is_inside = [&](const fs::path& place) {
    const fs::path real = fs::weakly_canonical(fs::absolute(place));
    return std::mismatch(folder.begin(), folder.end(), real.begin(), real.end()).first ==
           folder.end();
  };
  for (const auto& [option, place] : {std::pair("--out", out), std::pair("--overlay", overlays)})
    if (!place.empty() && is_inside(place))
      throw usage_error(fmt::format("{} {} lies inside the recording {}", option, place.string(),
                                    recording.string()),
                        "give a place outside: a recording stays as it was taken");
  if (!overlays.empty() && fs::exists(overlays) && !fs::is_directory(overlays))
    throw bad_input("a file stands where a folder is to be made", {.file = overlays.string()},
                    "give --overlay another place");
}

/// Ending of the command; `is_plate`: the target is on an object, not the rig's own.
Ending ending_of(const DetectReport& report, Surface surface, bool is_plate,
                 const std::string& out) {
  Ending ending;
  ending.go = report.good();
  ending.verdict = fmt::format("{} marks measured in {} frames", report.marks, report.frames);
  if (!report.frames_without_marks.empty())
    ending.verdict = fmt::format("no mark in {} of {} frames, the first is {}",
                                 report.frames_without_marks.size(), report.frames,
                                 report.frames_without_marks.front());
  ending.numbers.emplace_back("marks per frame",
                              fmt::format("{:.1f}", report.marks / double(report.frames)));
  if (report.median_sigma_px)
    ending.numbers.emplace_back("median standard deviation",
                                fmt::format("{:.4f} px", *report.median_sigma_px));
  if (report.dot_size_ratio)
    ending.numbers.emplace_back("diameter of the dots",
                                fmt::format("{:.3f} of the stated one", *report.dot_size_ratio));
  if (report.islands > 0)
    ending.numbers.emplace_back("marks in islands, without a label",
                                fmt::format("{}", report.islands));
  ending.numbers.emplace_back("tags recognised", fmt::format("{}", report.tags));
  for (const auto& [reason, count] : report.rejections_by_reason) {
    ending.rejected.push_back(fmt::format("{} x {}", count, reason));
  }
  for (const auto& [camera, count] : report.not_in_rig)
    ending.rejected.push_back(
        fmt::format("{} x picture of {}, a camera that the rig does not name", count, camera));
  ending.warnings = report.poor_views;
  ending.warnings.insert(ending.warnings.end(), report.warnings.begin(), report.warnings.end());
  if (!report.refused.empty()) ending.verdict = report.refused;
  if (!report.other_print.empty()) ending.verdict = report.other_print;
  if (!ending.go && !report.poor_views.empty()) ending.verdict += "; " + report.poor_views.front();
  if (!ending.go) {
    ending.next_command = "look at the frames: run the same command with --overlay DIR";
  } else if (is_plate) {
    ending.next_command = fmt::format(
        "drape object {} --calibration calibration.json --set NAME --scene SCENE.toml --out "
        "object.json",
        shell_word(out));
  } else if (surface == Surface::target) {
    ending.next_command = fmt::format(
        "drape calib {} --rig RIG --method joint --out calibration.json", shell_word(out));
  } else {
    ending.next_command = fmt::format(
        "drape triangulate {} --calibration calibration.json --set NAME --scene SCENE.toml --out "
        "sheet.ply",
        shell_word(out));
  }
  return ending;
}

void write_pictures(const std::vector<Picture>& pictures, const fs::path& folder,
                    RunRecord& record) {
  for (const Picture& picture : pictures) {
    const fs::path file = folder / picture.file_name;
    write_durable(file, as_text(picture.bytes));
    record.output(file);
  }
}

void note_frames(const DetectResult& result, const Recording& recording, RunRecord& record) {
  for (const FrameDetections& frame : result.detections.frames) {
    for (const RecordedFrame& recorded : recording.set(frame.set).frames) {
      if (recorded.camera == frame.camera) {
        record.input(recording.folder / recorded.file, recorded.sha256);
      }
    }
  }
}

struct DetectArguments {
  fs::path recording, rig, target, out, overlay;
  Surface surface = Surface::cloth;
  std::vector<std::string> sets;
};

void fields(Fields& f, DetectArguments& a) {
  f(Field{"recording", "folder with recording.json"}.called("RECORDING"), a.recording);
  f({"rig", "rig folder or its rig.toml"}, a.rig);
  f({"surface", "surface in the pictures"}, a.surface);
  f.otherwise(
      {"target", "a target other than the rig's, e.g. an object's plate (drape print object-tags)"},
      a.target);
  f.if_any(Field{"sets", "frame sets a,b,c (default: all the rig names)"}.plain_name(), a.sets);
  f({"out", "detections.json to write"}, a.out);
  f.otherwise({"overlay", "folder for PNGs with the marks drawn in"}, a.overlay);
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
      const std::string text = object_plate_toml(description);
      require_replaceable_plate(file, text, run_record_path(on_plate.out));
      const PrintedPage printed = page_of(description, file.stem().string(), on_plate.paper);
      remove_durable(file);  // before the record, without which it could not be replaced
      RunRecord record("drape-detect", words, run_record_path(on_plate.out));
      write_durable(file, text);
      record.output(file);
      record.option("size_mm", fmt::format("{}", on_plate.size_m / units::mm));
      return write(printed, file, on_plate.out, common, record);
    }
    const PrintArguments& given = cloth->parsed() ? on_cloth : on_target;
    const auto& [out, paper] = static_cast<const PageArguments&>(given);
    const fs::path& file = given.description;
    RunRecord record("drape-detect", words, run_record_path(out));
    record.input(file);
    const PrintedPage printed = cloth->parsed()
                                    ? page_of(read_print(file), paper)
                                    : page_of(read_target(file), file.stem().string(), paper);
    return write(printed, file, out, common, record);
  });
}

int detect_command(int argc, char** argv) {
  const auto run = [](DetectArguments& given, const std::vector<std::string>& words,
                      const CommonOptions& common) {
    if (fs::is_directory(given.rig)) given.rig /= "rig.toml";
    require_apart(given.recording, given.out, given.overlay);
    RunRecord record("drape-detect", words, run_record_path(given.out), {{given.out}, {given.rig}});
    Rig rig = read_rig(given.rig);
    if (!given.target.empty()) rig.target_file = given.target;
    DetectOptions options;
    options.surface = given.surface;
    options.sets = given.sets.empty() ? default_sets(rig, given.surface) : given.sets;
    record.input_sets(given.recording / "recording.json", options.sets);
    const Recording recording = read_recording(given.recording);
    record.input(given.surface == Surface::target ? rig.target_file : rig.print_file);
    options.threads = thread_count(common);
    if (given.out.stem() != "detections") options.preview_prefix = given.out.stem().string() + "_";
    options.overlays = !given.overlay.empty();
    Progress progress("detect", common.quiet);
    const DetectResult result = drape::detect::detect(
        recording, rig, options,
        [&](double fraction, const std::string& what) { progress.update(fraction, what); });
    const fs::path folder = given.out.parent_path();
    write_pictures(result.previews, folder, record);
    write_pictures(result.overlays, given.overlay, record);
    write_detections(given.out, result.detections);
    note_frames(result, recording, record);
    record.option("surface", std::string(name_of(given.surface)));
    record.option("sets", fmt::format("{}", fmt::join(options.sets, ",")));
    return finish(
        ending_of(result.report, given.surface, !given.target.empty(), given.out.string()), common,
        record);
  };
  return run_command<DetectArguments>(argc, argv, "drape-detect",
                                      "Finds, labels and measures the printed marks of a recording",
                                      run);
}

}  // namespace drape::detect

int main(int argc, char** argv) {
  using namespace drape::detect;
  return drape::run_stage(argc, argv, detect_command,
                          {{"print", print_command, "marks and targets as exactly scaled pages"}});
}
