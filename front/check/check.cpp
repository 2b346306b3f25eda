// SPDX-License-Identifier: Apache-2.0
#include "front/check/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "core/acceptance_file.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/files/toml_file.hpp"
#include "core/units.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;
using units::mm;

/// What `read` gives, with all its problems noted. An error that a made-up value provoked is none.
template <class Read>
auto collecting(BenchCheck& check, const Read& read) -> std::optional<decltype(read())> {
  ProblemCollector collector(check.problems);
  ++check.files;
  try {
    return read();
  } catch (const Error& error) {
    if (!collector.guessed()) check.problems.push_back(error);
    return std::nullopt;
  }
}

/// The smallest and the largest pixels of area sensors, um: phones 0.5, astronomy 24, and twice
/// that for binned pixels.
constexpr double kLeastPixel_um = 0.5, kMostPixel_um = 48;

void check_cameras_and_stages(const Rig& rig, BenchCheck& check) {
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const RigCamera& camera = rig.cameras[i];
    if (!std::isfinite(camera.pixel_pitch_x_m + camera.pixel_pitch_y_m))
      continue;  // named where it was read
    const auto [least, most] = std::minmax(camera.pixel_pitch_x_m, camera.pixel_pitch_y_m);
    if (least >= kLeastPixel_um * units::um && most <= kMostPixel_um * units::um) continue;
    add(check, rig.file, "camera.pixel_pitch_um",
        fmt::format("pixels of {:g} x {:g} um; sensors have {:g} to {:g}",
                    camera.pixel_pitch_x_m / units::um, camera.pixel_pitch_y_m / units::um,
                    kLeastPixel_um, kMostPixel_um),
        "give the pixel pitch of the data sheet in um, e.g. [3.45, 3.45]", i);
  }
  if (rig.cameras.size() < 2)
    add(check, rig.file, "camera", fmt::format("{} camera in the rig", rig.cameras.size()),
        "a point in space needs two views: add [[camera]] tables");
  const bool joint = !rig.free_poses.empty();
  if (rig.stages.size() < (joint ? 1 : 2)) {
    add(check, rig.file, "calibration.stage",
        joint ? std::string("no target stage: the target's reference pose defines the world")
              : fmt::format("{} target stage(s): Tsai's method needs points at two heights or more",
                            rig.stages.size()),
        "add [[calibration.stage]] tables with set and z_mm");
  }
  std::map<std::string, std::string> used;
  std::map<double, std::string> heights;
  for (std::size_t i = 0; i < rig.stages.size(); ++i) {
    const TargetStage& stage = rig.stages[i];
    if (!std::isfinite(stage.z_m)) continue;  // named where it was read
    if (std::abs(stage.z_m) > kLargestBench_m)
      add(check, rig.file, "calibration.stage.z_mm",
          fmt::format("stage `{}` stands at z_mm = {:g}; no bench is so large", stage.set,
                      stage.z_m / mm),
          "heights are in mm above the first stage", i);
    const auto [other, fresh] = heights.emplace(stage.z_m, stage.set);
    if (!fresh)
      add(check, rig.file, "calibration.stage.z_mm",
          fmt::format("stages `{}` and `{}` are both at z_mm = {:g}", other->second, stage.set,
                      stage.z_m / mm),
          "give each stage the height at which the target stood", i);
  }
  if (!rig.stages.empty() && heights.count(0.0) == 0)
    add(check, rig.file, "calibration.stage.z_mm", "no stage has z_mm = 0",
        "the target's reference pose is the world: its stage has z_mm = 0, the others count from "
        "there");
  const auto use = [&](const std::string& set, const std::string& what, const std::string& field,
                       std::size_t nth) {
    const auto [other, fresh] = used.emplace(set, what);
    if (!fresh)
      add(check, rig.file, field,
          fmt::format("set `{}` is listed as {} and as {}", set, other->second, what),
          "name each set once", nth);
  };
  for (std::size_t i = 0; i < rig.stages.size(); ++i)
    use(rig.stages[i].set, "stage", "calibration.stage.set", i);
  for (const std::string& pose : rig.free_poses)
    use(pose, "free pose", "calibration.free_poses", 0);
}

void check_tags(const Rig& rig, const Target& target, const Print& print, BenchCheck& check) {
  if (target.tag_family.empty() || target.tag_family != print.tag_family) return;
  std::set<int> ids;
  for (const PrintedTag& tag : print.tags) ids.insert(tag.id);
  for (const PrintedTag& tag : target.tags) {
    if (ids.count(tag.id) == 0) continue;
    add(check, rig.target_file, "tags.tag.id",
        fmt::format("tag {} of {} is printed on target and cloth", tag.id, target.tag_family),
        fmt::format("give the target other ids than {} uses", print.file.string()));
    return;
  }
}

/// Targets of the objects' plates of tags, each once.
void check_plates(const Rig& rig, const std::vector<Scene>& scenes, BenchCheck& check) {
  std::set<fs::path> seen = {rig.target_file.lexically_normal()};
  for (const Scene& scene : scenes)
    for (const ObjectTags& plate : scene.tags) {
      if (!seen.insert(plate.target.lexically_normal()).second) continue;
      if (const auto target = collecting(check, [&] { return read_target(plate.target); }))
        check_target(plate.target, *target, check);
    }
}

void check_print_size(const Print& print, BenchCheck& check) {
  const Eigen::Vector2d marks = print.pitch_m * Eigen::Vector2d(print.rows - 1, print.cols - 1);
  const Eigen::Vector2d other = print.patch_m - marks - print.margin_m;
  for (const int side : {0, 1}) {
    const double equal_mm = 0.5 * (print.patch_m[side] - marks[side]) / mm;
    if (std::min(other[side], print.margin_m[side]) < 0.5 * print.dot_diameter_m && equal_mm > 0) {
      add(check, print.file, "margin_mm",
          fmt::format("the outermost dots lie across the edge of the patch, with {:g} mm on one "
                      "side along the {} and {:g} mm on the other",
                      print.margin_m[side] / mm, side == 0 ? "warp" : "weft", other[side] / mm),
          fmt::format("with equal margins margin_mm is {:g}", equal_mm));
      continue;
    }
    if (!(std::abs(other[side] - print.margin_m[side]) > 0.5 * mm)) continue;
    if (2 * marks[side] < print.patch_m[side]) {
      add(check, print.file, "patch_mm",
          fmt::format("along the {} the marks cover {:g} of the patch's {:g} mm",
                      side == 0 ? "warp" : "weft", marks[side] / mm, print.patch_m[side] / mm),
          fmt::format("is it {:g}? Marks on less than half of a patch do not measure its drape",
                      (marks[side] + 2 * print.margin_m[side]) / mm));
      continue;
    }
    check.warnings.push_back(fmt::format(
        "{}: along the {} the marks leave {:g} mm on one side of the patch and {:g} mm on the "
        "other; with equal margins pitch_mm would be {:g}; a print that came out at another size "
        "has every number in mm scaled alike",
        print.file.string(), side == 0 ? "warp" : "weft", print.margin_m[side] / mm,
        other[side] / mm,
        (print.patch_m[side] - 2 * print.margin_m[side]) / mm /
            (side == 0 ? print.rows - 1 : print.cols - 1)));
  }
}

void check_folder_name(const Scene& scene, BenchCheck& check) {
  if (is_name_of_a_run(scene.name))
    add(check, scene.file, "name",
        fmt::format("`{}` is a name of a run's own files, beside which the drape's folder stands",
                    scene.name),
        "give the drape another name");
}

void check_scenes_together(const Rig& rig, const std::vector<Scene>& scenes, BenchCheck& check) {
  std::map<std::string, const Scene*> names, sets;
  for (const Scene& scene : scenes) {
    if (!names.emplace(scene.name, &scene).second)
      add(check, scene.file, "name", fmt::format("two scenes are called `{}`", scene.name),
          "give each scene its own name");
    check_folder_name(scene, check);
    if (scene.set.empty()) {
      if (rig.file.empty()) continue;
      add(check, scene.file, "set", "the scene names no frame set",
          "add `set = \"...\"`: the set of the recording that shows this drape");
      continue;
    }
    const auto [other, fresh] = sets.emplace(scene.set, &scene);
    if (!fresh)
      add(check, scene.file, "set",
          fmt::format("set `{}` is also the one of {}", scene.set, other->second->file.string()),
          "each drape has a set of its own");
    for (const TargetStage& stage : rig.stages)
      if (stage.set == scene.set)
        add(check, scene.file, "set", fmt::format("set `{}` shows the target", scene.set),
            "name the set that shows this drape");
    for (const std::string& pose : rig.free_poses)
      if (pose == scene.set)
        add(check, scene.file, "set", fmt::format("set `{}` shows the target", scene.set),
            "name the set that shows this drape");
  }
}

void give_advice(const Rig& rig, const std::vector<Scene>& scenes, BenchCheck& check) {
  if (rig.grids.size() == 1)
    check.advice.emplace_back(
        "one grid only: what the grid costs in mm stays unknown; give two in rig.toml, e.g. grids "
        "= [21, 31]");
  for (const Scene& scene : scenes) {
    bool stated = true;
    for (const ObjectUncertainty& one : scene.uncertainties)
      stated = stated && one.stated_place_m && one.stated_size_m;
    if (!stated)
      check.advice.push_back(fmt::format(
          "{}: state how well each object's place and size are known (place_uncertainty_mm, "
          "size_uncertainty_mm, one standard deviation); half a division of a steel rule, 0.5 mm, "
          "is assumed",
          scene.file.string()));
  }
}

/// Scenes with their fabrics and prints; `rig` has no file where a folder of scenes is all there
/// is.
std::vector<Scene> check_scenes(const std::vector<fs::path>& files, const Rig& rig,
                                const std::optional<Print>& print, BenchCheck& check) {
  std::vector<Scene> scenes;
  std::set<fs::path> fabrics, prints = {rig.print_file};
  for (const fs::path& file : files) {
    const std::size_t before = check.problems.size();
    const auto scene = collecting(check, [&] { return read_scene(file); });
    if (!scene) continue;
    if (check.problems.size() == before) check_meshes(*scene, check);
    scenes.push_back(*scene);
    check_scene(*scene, rig, print ? &*print : nullptr, check);
    check_stand_ins(file, "scene", check);
    for (const auto& [key, named] :
         {std::pair{"fabric", scene->fabric_file}, std::pair{"print", scene->print_file}})
      if (fs::is_directory(named))
        add(check, scene->file, key, fmt::format("`{}` is empty, or a folder", key),
            "give the name of a file");
    if (!fs::is_directory(scene->fabric_file) && fabrics.insert(scene->fabric_file).second)
      check_fabric(scene->fabric_file, rig.segments, check);
    if (!fs::is_directory(scene->print_file) && prints.insert(scene->print_file).second)
      static_cast<void>(collecting(check, [&] { return read_print(scene->print_file); }));
  }
  return scenes;
}

/// What a line of TOML begins: a table, or the value of a key; nothing where the name is empty.
struct TomlLine {
  bool is_table = false;
  std::string name;
};

TomlLine read_line(const std::string& line) {
  const std::size_t begin = line.find_first_not_of(" \t[");
  if (begin == std::string::npos) return {};
  const std::size_t end = std::min(line.find_first_of(" \t]=,", begin), line.size());
  const std::size_t sign = line.find_first_not_of(" \t", end);
  const bool is_table = line.find('[') < begin;
  if (sign == std::string::npos || line[sign] != (is_table ? ']' : '=')) return {};
  return {is_table, line.substr(begin, end - begin)};
}

/// A virtual bench, without rig.toml and cameras: what `drape study` reads.
std::optional<std::vector<fs::path>> virtual_scenes(const fs::path& rig) {
  if (fs::exists(rig / "rig.toml") || !fs::is_directory(rig / "scenes")) return std::nullopt;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(rig / "scenes"))
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

bool is_name_of_a_run(const std::string& drape) {
  static const std::set<std::string> kFiles = {"rig", "results", "report", "calibration",
                                               "target-detections"};
  const std::size_t dot = drape.find('.');
  return drape == "report" || drape == "console" ||
         (dot != std::string::npos && kFiles.contains(drape.substr(0, dot)));
}

void add(BenchCheck& check, const fs::path& file, const std::string& field, const std::string& what,
         const std::string& what_to_do, std::size_t nth) {
  check.problems.push_back(bad_input(what, place_of(file, field, nth), what_to_do));
}

Where place_of(const fs::path& file, const std::string& field, std::size_t nth) {
  Where where{.file = file.string(), .field = field};
  const std::string parent =
      field.substr(0, field.find('.') == std::string::npos ? 0 : field.rfind('.'));
  std::istringstream lines(read_text(file));
  std::string section;
  std::size_t parents = 0, tables = 0;  // so far: of the parent's name, of the field's own
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const TomlLine begun = read_line(line);
    if (begun.name.empty()) continue;
    if (begun.is_table) section = begun.name;
    if (begun.is_table && section == parent) ++parents;
    if (field != (begun.is_table || section.empty() ? begun.name : section + "." + begun.name))
      continue;
    if (nth != (begun.is_table ? tables++ : std::max<std::size_t>(parents, 1) - 1)) continue;
    where.line = number;
    return where;
  }
  if (!parent.empty()) where.line = place_of(file, parent, nth).line;
  return where;
}

BenchCheck check_bench(const fs::path& rig_path, const fs::path& recording_path) {
  BenchCheck check;
  if (const auto files = virtual_scenes(rig_path)) {
    check.purpose = "`drape study`";
    Rig none;
    none.segments = {1, 5};  // those of `drape study`
    check_scenes_together(none, check_scenes(*files, none, std::nullopt, check), check);
    return check;
  }
  const auto rig = collecting(check, [&] { return read_rig(rig_path); });
  if (!rig) return check;
  check_cameras_and_stages(*rig, check);
  const auto target = collecting(check, [&] { return read_target(rig->target_file); });
  const auto print = collecting(check, [&] { return read_print(rig->print_file); });
  if (target && print) check_tags(*rig, *target, *print, check);
  if (target) check_target(rig->target_file, *target, check);
  if (print) {
    check_print_size(*print, check);
    check_print(*print, check);
  }
  if (rig->scenes.empty())
    add(check, rig->file, "scenes", "the rig names no scene",
        "add the scene files, e.g. scenes = [\"scenes/A.toml\"]");
  const std::vector<Scene> scenes = check_scenes(rig->scenes, *rig, print, check);
  check_scenes_together(*rig, scenes, check);
  check_plates(*rig, scenes, check);
  static_cast<void>(collecting(check, [&] {
    check_repeats(*rig, scenes, check);
    return true;
  }));
  --check.files;  // the rig was counted
  if (const fs::path file = rig->file.parent_path() / "acceptance.json"; fs::is_regular_file(file))
    static_cast<void>(collecting(check, [&] {
      static_cast<void>(read_record<AcceptanceFile>(file));
      return true;
    }));
  const auto recording = collecting(check, [&] {
    return read_recording(recording_path.empty() ? rig->recording : recording_path);
  });
  if (recording) check_recording(*recording, *rig, scenes, check);
  give_advice(*rig, scenes, check);
  return check;
}

int report_check(const BenchCheck& check, const std::string& program, const CommonOptions& common) {
  if (check.problems.empty()) {
    Ending ending;
    ending.verdict =
        fmt::format("{} files of the bench hold what {} needs", check.files, check.purpose);
    ending.warnings = check.warnings;
    ending.advice = check.advice;
    return finish(ending, common);
  }
  if (common.json) {
    Json json;
    json["problems"] = Json::array();
    for (const Error& problem : check.problems)
      json["problems"].push_back({{"what_failed", problem.what_failed()},
                                  {"where", problem.where().describe()},
                                  {"what_to_do", problem.what_to_do()}});
    json["warnings"] = check.warnings;
    json["exit_code"] = static_cast<int>(ErrorKind::bad_input);
    fmt::print("{}", pretty(json));
  }
  for (const Error& problem : check.problems)
    fmt::print(stderr, "{}: {}: {}\n", program, coloured("error", "31", stderr), problem.what());
  if (!common.quiet && !common.json) {
    for (const std::string& warning : check.warnings) fmt::print("  warning: {}\n", warning);
    if (check.problems.size() > 1)
      fmt::print("{} values to correct, in {}\n", check.problems.size(), [&] {
        std::set<std::string> files;
        for (const Error& problem : check.problems) files.insert(problem.where().file);
        return files.size() == 1 ? "one file" : fmt::format("{} files", files.size());
      }());
  }
  return static_cast<int>(ErrorKind::bad_input);
}

}  // namespace drape
