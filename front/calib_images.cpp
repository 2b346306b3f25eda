// SPDX-License-Identifier: Apache-2.0
#include "front/calib_images.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <optional>
#include <regex>
#include <set>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/inside.hpp"
#include "core/program/command.hpp"
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
  if (!std::regex_match(text, parts, std::regex("([0-9]{1,3})x([0-9]{1,3})"))) {
    throw usage_error(fmt::format("`{}` is no board", text),
                      "give its inner corners as COLSxROWS, e.g. --board 9x6");
  }
  return {std::stoi(parts[1]), std::stoi(parts[2])};
}

bool is_digit(char c) {
  return std::isdigit(static_cast<unsigned char>(c)) != 0;
}

/// Date and time in a name as written by cameras: "2018-09-17__16-38-56", "20180917_163856789".
const std::regex& time_in_name() {
  static const std::regex kTime(
      "((?:19|20)[0-9]{2})([-_.]?)(0[1-9]|1[0-2])\\2(0[1-9]|[12][0-9]|3[01])[-_. T]*"
      "([01][0-9]|2[0-3])([-_.hH:]?)([0-5][0-9])[-_.mM:]?([0-5][0-9][0-9]{0,6})");
  return kTime;
}

/// Joins each date and time in a name to one number.
std::string with_joined_time(const std::string& name) {
  return std::regex_replace(name, time_in_name(), "$1$3$4$5$7$8");
}

std::string without_time(const std::string& name) {
  return std::regex_replace(name, time_in_name(), "");
}

/// Digits of a number without leading zeros.
std::string digits_of(const std::string& number) {
  return number.substr(std::min(number.find_first_not_of('0'), number.size() - 1));
}

/// Splits a name into text (maybe empty) and numbers in turn; numbers are at odd indices.
std::vector<std::string> parts_of(const std::string& name) {
  std::vector<std::string> parts(1);
  for (const char c : name) {
    if (is_digit(c) != (parts.size() % 2 == 0)) parts.emplace_back();
    parts.back() += c;
  }
  return parts;
}

bool is_separator(char c) {
  return c == '-' || c == '_' || c == '.' || c == ' ';
}

/// Joins the text around the number, with one separator if two would meet.
std::string joined(std::string before, std::string after) {
  while (!before.empty() && is_separator(before.back())) before.pop_back();
  const std::size_t skip =
      std::find_if_not(after.begin(), after.end(), is_separator) - after.begin();
  const std::string separator = skip > 0 && !before.empty() && skip < after.size() ? "_" : "";
  return before + separator + after.substr(skip);
}

PictureName split_at(const std::vector<std::string>& parts, std::size_t number) {
  std::string before, after;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (i < number) before += parts[i];
    if (i > number) after += parts[i];
  }
  return {joined(before, after), parts[number]};
}

}  // namespace

std::vector<PictureName> read_picture_names(const std::vector<std::string>& given) {
  // Times are ignored if the names differ without them.
  std::vector<std::string> names;
  std::transform(given.begin(), given.end(), std::back_inserter(names), without_time);
  if (std::set<std::string>(names.begin(), names.end()).size() < names.size())
    std::transform(given.begin(), given.end(), names.begin(), with_joined_time);
  std::vector<std::vector<std::string>> all;
  std::set<std::size_t> numbers;
  for (const std::string& name : names) {
    all.push_back(parts_of(name));
    numbers.insert(all.back().size() / 2);
  }
  std::size_t view = 0, most = 0;
  for (std::size_t place = 1; numbers.size() == 1 && place < 2 * *numbers.begin(); place += 2) {
    std::set<std::string> values;
    for (const std::vector<std::string>& parts : all) values.insert(digits_of(parts[place]));
    if (values.size() < most) continue;
    most = values.size();
    view = place;
  }
  std::vector<PictureName> result;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::size_t last = all[i].size() / 2 * 2;  // index after the last number
    if (last == 0) {
      result.push_back({"", names[i]});
    } else {
      result.push_back(split_at(all[i], view > 0 ? view : last - 1));
    }
  }
  // Equal numbers become equal texts, sorted like the numbers.
  const auto is_number = [](const std::string& text) {
    return std::all_of(text.begin(), text.end(), is_digit);
  };
  std::size_t widest = 0, narrowest = 0;
  for (const PictureName& name : result) {
    if (!is_number(name.view)) continue;
    widest = std::max(widest, digits_of(name.view).size());
    narrowest = narrowest == 0 ? name.view.size() : std::min(narrowest, name.view.size());
  }
  const std::size_t width = std::max(widest, narrowest);
  for (PictureName& name : result) {
    if (!is_number(name.view)) continue;
    const std::string digits = digits_of(name.view);
    name.view = std::string(width - digits.size(), '0') + digits;
  }
  return result;
}

namespace {

std::vector<fs::path> folders_in(const fs::path& folder) {
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_directory()) folders.push_back(entry.path());
  return folders;
}

/// Pictures in a folder, sorted by name; a link keeps its own name, not that of its target.
std::vector<fs::path> pictures_in(const fs::path& folder) {
  static const std::regex kPicture(".*\\.(png|jpg|jpeg|tif|tiff)", std::regex::icase);
  std::vector<fs::path> pictures;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.front() == '.' || !std::regex_match(name, kPicture)) continue;
    require_target(entry.path());
    if (entry.is_regular_file()) pictures.push_back(fs::absolute(entry.path()));
  }
  std::sort(pictures.begin(), pictures.end());
  return pictures;
}

std::vector<PictureName> picture_names_of(const std::vector<fs::path>& pictures) {
  std::vector<std::string> stems;
  for (const fs::path& picture : pictures) stems.push_back(picture.stem().string());
  return read_picture_names(stems);
}

/// Pictures by view, then camera.
using Views = std::map<std::string, std::map<std::string, fs::path>>;

void add_picture(Views& views, const std::string& view, const std::string& camera,
                 const fs::path& picture) {
  if (views["view_" + view].emplace(camera, picture).second) return;
  throw bad_input("two images of one camera and view", {.file = picture.string()},
                  "keep one of them");
}

/// Adds the pictures of a folder. Without a camera's name their own names give camera and view,
/// such as left01.jpg, and a picture without a number is not part of a series; else the view alone.
void add_pictures(Views& views, const fs::path& folder, const std::string& camera) {
  const std::vector<fs::path> pictures = pictures_in(folder);
  const std::vector<PictureName> names = picture_names_of(pictures);
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const std::string stem = pictures[i].stem().string();
    if (camera.empty() && stem.find_first_of("0123456789") == std::string::npos) continue;
    const std::string of_name = names[i].camera.empty() ? "camera" : names[i].camera;
    add_picture(views, names[i].view, camera.empty() ? of_name : camera, pictures[i]);
  }
}

/// True if the folders are cameras: there are more views than cameras.
bool are_cameras(const std::vector<fs::path>& folders) {
  return std::any_of(folders.begin(), folders.end(), [&](const fs::path& folder) {
    return pictures_in(folder).size() > folders.size();
  });
}

/// Pictures of a folder in another layout than that of `drape import`; nullopt for that one.
std::optional<Views> views_of(const CalibImagesOptions& options) {
  if (!fs::is_directory(options.folder)) {
    throw bad_input("the folder of images is missing", {.file = options.folder.string()},
                    "name a folder of images such as left01.jpg, right01.jpg");
  }
  const std::vector<fs::path> folders = folders_in(options.folder);
  const bool nested = !folders.empty() && pictures_in(options.folder).empty();
  const bool cameras =
      options.folders ? *options.folders == FoldersOf::cameras : nested && are_cameras(folders);
  if (nested && !cameras) return std::nullopt;
  Views views;
  if (!nested) add_pictures(views, options.folder, {});
  for (const fs::path& folder : nested ? folders : std::vector<fs::path>())
    add_pictures(views, folder, folder.filename().string());
  if (views.empty()) {
    throw bad_input("no image is named like left01.jpg", {.file = options.folder.string()},
                    "name images <camera><number>.png|jpg|tif, <view>/<camera>.png|jpg|tif or "
                    "<camera>/<number>.png|jpg|tif");
  }
  return views;
}

/// Links the pictures in the layout of `drape import`.
fs::path link_views(const Views& views, const fs::path& out) {
  fs::path staged = out / "images";
  for (const auto& [view, of_view] : views) {
    fs::create_directories(staged / view);
    for (const auto& [camera, file] : of_view) {
      fs::create_symlink(file, staged / view / (camera + file.extension().string()));
    }
  }
  return staged;
}

/// Marks the output folder as our own, so that a second run may replace its files; never touches a
/// folder that others have made.
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
  for (const char* own : {"recording", "images", "calibration.json"}) {
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
  for (const char* folder : {"recording", "images"}) fs::remove_all(out / folder);
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
  if (!common.json && !common.quiet) fmt::print("{}\n{}\n", stage, result.output);
  std::fflush(stdout);
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
  const std::optional<Views> views = views_of(options);
  claim(options.out);
  remove_earlier(options.out);
  write_durable(options.out / "target.toml", target);
  const std::string images = (views ? link_views(*views, options.out) : options.folder).string();
  if (const int code = run_stage(
          "capture", {"import", images, "--out", recording.string(), "--allow-missing"}, common);
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
