// SPDX-License-Identifier: Apache-2.0
#include "front/calib_images.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>
#include <optional>

#include "core/files/files.hpp"
#include "core/files/picture_layout.hpp"
#include "core/matching.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/recording.hpp"
#include "core/rig.hpp"
#include "core/units.hpp"
#include "front/process.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

/// Content of a folder of pictures: one view by all cameras, or all views of one camera.
enum class FoldersOf { views, cameras };

}  // namespace

template <>
inline constexpr std::string_view names_of<FoldersOf>[] = {"views", "cameras"};

namespace {

struct CalibImagesOptions {
  fs::path folder;                  ///< folder of the images
  std::string board;                ///< inner corners as COLSxROWS, e.g. "9x6"
  std::optional<double> square_mm;  ///< side of a square
  fs::path target;                  ///< target.toml of any kind, instead of `board` and `square_mm`
  std::optional<FoldersOf> folders;  ///< absent if inferred from the number of folders
  double thickness_mm = 0;           ///< distance between the sides of a two-sided target
  fs::path out;
  fs::path lens_from;  ///< calibration.json with known lenses; can be empty
};

void fields(Fields& f, CalibImagesOptions& options) {
  f(Field{"folder", "folder of the pictures"}.called("FOLDER"), options.folder);
  f.otherwise({"board", "for a chessboard: inner corners as COLSxROWS, e.g. 9x6"}, options.board);
  f({"square_mm", "for a chessboard: measured side of a square", 1, above_zero}, options.square_mm);
  f.otherwise({"target", "target.toml of another target, instead of --board and --square-mm"},
              options.target);
  f({"folders",
     "content of each subfolder of FOLDER (default: views if each has fewer pictures than there "
     "are folders)"},
    options.folders);
  f.otherwise(
      {"thickness_mm", "distance between the front and the back of a two-sided target", 1, 0, 1000},
      options.thickness_mm);
  f({"out", "output folder"}, options.out);
  f.otherwise({"lens_from",
               "calibration.json from which to take the lenses of the cameras of the same names"},
              options.lens_from);
}

struct Board {
  int cols = 0, rows = 0;
};

Board board_of(const std::string& text) {
  std::smatch parts;
  if (!has_form(text, parts, std::regex("([0-9]{1,3})x([0-9]{1,3})"))) {
    throw usage_error(fmt::format("`{}` is no board", text),
                      "give its inner corners as COLSxROWS, e.g. --board 9x6");
  }
  return {std::stoi(parts[1]), std::stoi(parts[2])};
}

/// The layout of the pictures. Throws for a folder without pictures, before anything is written.
PictureLayout layout_of(const CalibImagesOptions& options) {
  if (!fs::is_directory(options.folder)) {
    throw bad_input("the folder of images is missing", {.file = options.folder.string()},
                    "name a folder of images such as left01.jpg, right01.jpg");
  }
  const PictureLayout found = layout_found(options.folder);
  const PictureLayout layout = !options.folders || found == PictureLayout::names ? found
                               : *options.folders == FoldersOf::cameras ? PictureLayout::cameras
                                                                        : PictureLayout::sets;
  if (layout != PictureLayout::sets && placed_pictures(options.folder, layout).empty()) {
    throw bad_input("no image is named like left01.jpg", {.file = options.folder.string()},
                    "name images <camera><number>.png|jpg|tif, <view>/<camera>.png|jpg|tif or "
                    "<camera>/<number>.png|jpg|tif");
  }
  return layout;
}

/// Marks the output folder as ours, so that a second run may replace its files; never touches
/// folders made by others.
void claim(const fs::path& out) {
  const fs::path mark = out / "calib-images.txt";
  if (fs::exists(out) && !fs::is_empty(out) && !fs::exists(mark)) {
    throw bad_input("the output folder holds other files", {.file = out.string()},
                    "give a new folder with --out");
  }
  write_durable(mark, "This folder was made by `drape calib images`, which replaces its files.\n");
}

/// Throws if an input file is, or lies in, a result of an earlier run, which would be removed.
void require_apart(const fs::path& given, const fs::path& out) {
  for (const char* own : {"recording", "calibration.json"}) {
    std::error_code absent;
    for (fs::path at = fs::weakly_canonical(given); at.has_relative_path(); at = at.parent_path())
      if (fs::equivalent(at, out / own, absent))
        throw usage_error(given.string() + " would be replaced: an earlier run wrote it",
                          "give another folder with --out");
  }
}

/// Removes results of an earlier run, which may describe other pictures.
void remove_earlier(const fs::path& out) {
  for (const char* file : {"calibration.json", "detections.json", "rig.toml", "target.toml"}) {
    remove_durable(run_record_path(out / file));
    remove_durable(ending_path(run_record_path(out / file)));
    remove_durable(out / file);
  }
  fs::remove_all(out / "recording");
}

/// Adds a stage's data and verdict to the ending, prefixed by the stage's name.
void take_over(const std::string& stage, const fs::path& output, Ending& ending) {
  const auto kept = kept_ending(run_record_path(output));
  if (!kept) return;  // another lab's stage may not keep one
  for (const std::string& line : kept->rejected) ending.rejected.push_back(stage + ": " + line);
  for (const std::string& line : kept->warnings) ending.warnings.push_back(stage + ": " + line);
  if (!kept->go) ending.verdict = kept->verdict;
}

std::string rig_text(const Recording& recording) {
  Rig rig;
  rig.name = "pictures";
  rig.target_file = "target.toml";
  rig.recording = "recording";
  std::map<std::string, RigCamera> cameras;
  for (const FrameSet& set : recording.sets) {
    rig.free_poses.push_back(set.name);
    for (const RecordedFrame& one : set.frames)
      cameras[one.camera] = {one.camera, one.width_px, one.height_px, units::um, units::um};
  }
  for (const auto& [name, camera] : cameras) rig.cameras.push_back(camera);
  return "# The pixel pitches are nominal: they only scale a focal length in mm.\n" + text_of(rig);
}

std::string target_text(const Board& board, double square_mm) {
  return fmt::format(
      "schema = \"drapebench/target/1\"\nkind = \"chessboard\"\n"
      "# Inner corners, where four squares meet.\nrows = {}\ncols = {}\npitch_mm = {}\n",
      board.rows, board.cols, square_mm);
}

/// Runs one stage and prints its output. Returns its exit code.
int run_stage(const std::string& stage, std::vector<std::string> arguments,
              const CommonOptions& common) {
  if (common.quiet) arguments.emplace_back("--quiet");
  const StepResult result = result_of_stage(stage, std::move(arguments));
  std::fputs(result.errors.c_str(), stderr);
  if (!common.json && !common.quiet) print_text(fmt::format("{}\n{}\n", stage, result.output));
  return result.exit_code;
}

int calibrate_images(const CalibImagesOptions& options, const CommonOptions& common) {
  if (options.target.empty() == (options.board.empty() || !options.square_mm)) {
    throw usage_error("the target is not stated, or twice",
                      "give --board and --square-mm of a chessboard, or --target FILE");
  }
  const std::string target = options.target.empty()
                                 ? target_text(board_of(options.board), *options.square_mm)
                                 : read_text(options.target);
  const fs::path recording = options.out / "recording", rig = options.out / "rig.toml";
  const fs::path detections = options.out / "detections.json";
  const fs::path calibration = options.out / "calibration.json";
  require_apart(options.folder, options.out);
  require_apart(options.lens_from, options.out);
  const PictureLayout layout = layout_of(options);
  claim(options.out);
  remove_earlier(options.out);
  write_durable(options.out / "target.toml", target);
  if (const int code =
          run_stage("capture",
                    {"import", options.folder.string(), "--layout", std::string(name_of(layout)),
                     "--out", recording.string(), "--allow-missing"},
                    common);
      code > 1) {
    return code;
  }
  write_durable(rig, rig_text(read_recording(recording)));
  // All views are free poses: one without a board is dropped, and calib repeats a NO-GO.
  if (const int code = run_stage("detect",
                                 {recording.string(), "--rig", rig.string(), "--surface", "target",
                                  "--out", detections.string()},
                                 common);
      code > 1) {
    return code;
  }
  std::vector<std::string> arguments = {detections.string(), "--rig", rig.string(),
                                        "--method",          "joint", "--out",
                                        calibration.string()};
  if (!options.lens_from.empty())
    arguments.insert(arguments.end(), {"--lens-from", options.lens_from.string()});
  if (options.thickness_mm > 0)
    arguments.insert(arguments.end(), {"--thickness-mm", fmt::format("{}", options.thickness_mm)});
  const int code = run_stage("calib", std::move(arguments), common);
  if (code > 1) return code;
  Ending ending;
  ending.go = code == 0;
  take_over("capture", recording / "recording.json", ending);
  take_over("detect", detections, ending);
  ending.verdict.clear();
  take_over("calib", calibration, ending);
  if (ending.go) ending.verdict = "the cameras are calibrated";
  ending.numbers = {{"calibration", calibration.string()}, {"rig", rig.string()}};
  ending.next_command = "drape calib convert --help";
  return finish(ending, common);
}

}  // namespace

int calib_images_command(int argc, char** argv) {
  return run_command<CalibImagesOptions>(
      argc, argv, "drape calib images",
      "Calibrates cameras from a plain folder of chessboard pictures: left01.jpg, right01.jpg, "
      "...,\n<view>/<camera>.png or <camera>/<number>.png. All cameras together; one alone is fine "
      "too.\n\n"
      "  drape calib images pictures --board 9x6 --square-mm 30 --out out/pictures",
      calibrate_images);
}

}  // namespace drape
