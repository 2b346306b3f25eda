// SPDX-License-Identifier: Apache-2.0
#include "front/check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <set>
#include <system_error>

#include "core/acceptance_file.hpp"
#include "core/files/json_file.hpp"
#include "core/program/words.hpp"
#include "core/recording.hpp"
#include "front/process.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;
using units::mm;

/// A record as far as it could be read; its valid values are still checked by rules.
template <class Record>
struct Partly {
  Record record;
  bool is_good = false;
};

template <class Record>
Partly<Record> read_as_far(const fs::path& file, BenchCheck& check) {
  ++check.files;
  Partly<Record> read;
  try {
    read.record.document = Document::read(file);
    require_format(read.record.document, format_of<Record>);
    std::vector<Error> faults = faults_of_reading(read.record.document, walk_through(read.record));
    read.is_good = faults.empty();
    check.add(std::move(faults));
  } catch (const Error& error) {
    check.add(error.each());
  }
  return read;
}

/// Calls `read` and collects all errors of its file.
template <class Read>
auto collecting(BenchCheck& check, const Read& read) -> std::optional<decltype(read())> {
  ++check.files;
  try {
    return read();
  } catch (const Error& error) {
    check.add(error.each());
    return std::nullopt;
  }
}

// ---- recording --------------------------------------------------------------------------------

/// Key of a file that refers to a set.
struct Need {
  std::string set;
  Where where;
};

std::vector<Need> needs_of(const Rig& rig, const std::vector<Scene>& scenes) {
  std::vector<Need> needs;
  const auto add = [&](const std::string& set, const Document& file, const std::string& path) {
    needs.push_back({set, file.where(path)});
  };
  for (std::size_t i = 0; i < rig.stages.size(); ++i)
    add(rig.stages[i].set, rig.document, fmt::format("calibration.stage.{}.set", i));
  for (const std::string& pose : rig.free_poses) add(pose, rig.document, "calibration.free_poses");
  for (const Scene& scene : scenes) {
    if (!scene.set.empty()) add(scene.set, scene.document, "set");
    for (const ObjectTags& plate : scene.tags)
      add(plate.set, scene.document, fmt::format("object.{}.tags_set", plate.object - 1));
  }
  // The scene's own laying is required by the scene.
  const auto is_own = [&](const DrapeRepeat& repeat) {
    return std::any_of(scenes.begin(), scenes.end(), [&](const Scene& scene) {
      return scene.name == repeat.scene && scene.set == repeat.set;
    });
  };
  for (std::size_t i = 0; i < rig.repeats.size(); ++i)
    if (!is_own(rig.repeats[i]))
      add(rig.repeats[i].set, rig.document, fmt::format("repeat.{}.set", i));
  return needs;
}

void check_frame(const RecordedFrame& frame, const RigCamera& camera, const Rig& rig,
                 std::map<std::string, bool>& named, BenchCheck& check) {
  if (camera.width_px < 2 || camera.height_px < 2) return;  // reported when it was read
  if (frame.width_px == camera.width_px && frame.height_px == camera.height_px) return;
  if (std::exchange(named[camera.name], true)) return;
  check.add(bad_input(
      fmt::format("the rig says {} x {} px, the pictures are {} x {} px", camera.width_px,
                  camera.height_px, frame.width_px, frame.height_px),
      [&] {
        Where where =
            rig.document.where(fmt::format("camera.{}.width_px", &camera - rig.cameras.data()));
        where.camera = camera.name;
        return where;
      }(),
      fmt::format("width_px = {}, height_px = {}", frame.width_px, frame.height_px)));
}

/// Finds a listed picture that is missing, or whose first bytes are not those of a picture. Its
/// hash is only checked when it is read.
void check_file(const fs::path& folder, const FrameSet& set, const RecordedFrame& frame,
                BenchCheck& check) {
  const fs::path file = folder / frame.file;
  const Where where{.file = file.string(), .camera = frame.camera, .set = set.name};
  std::error_code failed;
  if (!fs::is_regular_file(file, failed)) {
    std::string others;
    if (fs::is_directory(file.parent_path(), failed))
      for (const auto& entry : fs::directory_iterator(file.parent_path(), failed))
        if (entry.is_regular_file(failed) && entry.path().extension() == file.extension())
          others += (others.empty() ? "" : ", ") + entry.path().filename().string();
    check.add(bad_input(
        "a picture of the recording is missing", where,
        others.empty()
            ? std::string("bring it back, or record the set again")
            : fmt::format("bring it back, or give it its name again; there are {}", others)));
    return;
  }
  std::array<char, 132> begin{};
  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    check.add(bad_input("the picture cannot be read: " + std::generic_category().message(errno),
                        where, "make it readable for this user"));
    return;
  }
  stream.read(begin.data(), begin.size());
  const auto count = static_cast<std::size_t>(stream.gcount());
  if (!begins_as_picture({reinterpret_cast<const unsigned char*>(begin.data()), count}))
    check.add(bad_input(count == 0 ? "the picture is empty" : "this is no picture file", where,
                        "bring the recorded picture back, or record the set again"));
}

/// Finds recorded cameras that the rig does not list, whose pictures are unused.
void advise_on_cameras(const Recording& recording, const Rig& rig, BenchCheck& check) {
  std::set<std::string> others;
  for (const FrameSet& set : recording.sets)
    for (const RecordedFrame& frame : set.frames) others.insert(frame.camera);
  for (const RigCamera& camera : rig.cameras) others.erase(camera.name);
  if (others.empty()) return;
  check.advice.push_back(
      fmt::format("{}: no [[camera]] is called {}; the recording's pictures of it are not used",
                  rig.file.string(), fmt::join(others, ", ")));
}

/// Finds the same picture under two names: a copied camera or set.
void check_twice(const Recording& recording, const std::vector<Need>& needs, BenchCheck& check) {
  std::map<std::string, std::pair<std::string, std::string>> seen;
  for (const FrameSet& set : recording.sets) {
    const bool needed = std::any_of(needs.begin(), needs.end(),
                                    [&](const Need& need) { return need.set == set.name; });
    if (!needed) continue;
    for (const RecordedFrame& frame : set.frames) {
      const auto [other, fresh] = seen.emplace(frame.sha256, std::pair{set.name, frame.camera});
      if (fresh) continue;
      check.add(bad_input(
          fmt::format("this picture is also the one of camera `{}` in set `{}`, byte for byte",
                      other->second.second, other->second.first),
          {.file = (recording.folder / frame.file).string(),
           .camera = frame.camera,
           .set = set.name},
          "no two pictures of cameras are equal: one of the two was copied; record or import it "
          "again"));
    }
  }
}

/// Checks sets and cameras that the rig and its scenes need, image sizes, and missing or duplicate
/// pictures.
void check_recording(const Recording& recording, const Rig& rig, const std::vector<Scene>& scenes,
                     BenchCheck& check) {
  std::vector<std::string> names;
  for (const FrameSet& set : recording.sets) names.push_back(set.name);
  const std::string list = (recording.folder / "recording.json").string();
  const std::vector<Need> needs = needs_of(rig, scenes);
  std::map<std::string, bool> sizes_named, cameras_named;
  for (const Need& need : needs) {
    const auto set = std::ranges::find(recording.sets, need.set, &FrameSet::name);
    if (set == recording.sets.end()) {
      check.add(bad_input(
          fmt::format("the recording has no set `{}`{}", need.set, did_you_mean(need.set, names)),
          need.where, fmt::format("{} has {}", list, fmt::join(names, ", "))));
      continue;
    }
    if (set->no_go)
      check.add(bad_input(fmt::format("the set is NO-GO: {}", *set->no_go),
                          {.file = list, .set = need.set},
                          "record the set again, and name the new one"));
    for (const RigCamera& camera : rig.cameras) {
      const auto frame = std::ranges::find(set->frames, camera.name, &RecordedFrame::camera);
      if (frame != set->frames.end()) {
        check_frame(*frame, camera, rig, sizes_named, check);
        check_file(recording.folder, *set, *frame, check);
      } else if (!std::exchange(cameras_named[camera.name], true)) {
        std::vector<std::string> cameras;
        for (const RecordedFrame& one : set->frames) cameras.push_back(one.camera);
        check.add(bad_input(
            fmt::format("a camera of the rig is missing in the recording{}",
                        did_you_mean(camera.name, cameras)),
            {.file = list, .camera = camera.name, .set = need.set},
            "record the set with all cameras, or correct or remove the camera in rig.toml"));
      }
    }
  }
  advise_on_cameras(recording, rig, check);
  check_twice(recording, needs, check);
}

// ---- fabric -----------------------------------------------------------------------------------

/// A curve named in the fabric file.
struct Curve {
  std::string kind, direction, field;
  fs::path file;
};

std::vector<Curve> curves_of(const Document& fabric) {
  std::vector<Curve> curves;
  for (const char* kind : {"tensile", "shear", "bending"}) {
    const Value* table = fabric.root().find(kind);
    for (const char* direction : {"warp", "weft"}) {
      const auto* text = table == nullptr ? nullptr : table->find_as<std::string>(direction);
      if (text != nullptr)
        curves.push_back(
            {kind, direction, fmt::format("{}.{}", kind, direction), fabric.beside(*text)});
    }
  }
  return curves;
}

/// True if the fabric file marks curves of this kind as not measured.
bool is_stand_in(const Document& fabric, const std::string& kind) {
  const Value* names = fabric.root().find("stand_ins");
  return names != nullptr && one_line(*names).find(kind + " curves") != std::string::npos;
}

/// Finds curves of another direction or another fabric, and one file used for both directions.
void check_curve_names(const Document& fabric, BenchCheck& check) {
  std::map<fs::path, int> folders;
  std::map<std::pair<std::string, fs::path>, std::string> used;
  std::vector<Curve> curves;
  for (const Curve& curve : curves_of(fabric)) {
    if (is_stand_in(fabric, curve.kind)) continue;
    const std::string other = curve.direction == "warp" ? "weft" : "warp";
    const std::string name = curve.file.filename().string();
    if (name.find(other) != std::string::npos && name.find(curve.direction) == std::string::npos)
      check.add(fabric, curve.field,
                fmt::format("{} names {}, a curve along the {}", curve.field, name, other),
                "are warp and weft exchanged?");
    if (const auto [first, fresh] = used.emplace(std::pair{curve.kind, curve.file}, curve.field);
        !fresh)
      check.add(fabric, curve.field, fmt::format("{} is also {}", name, first->second),
                fmt::format("name the curve along the {}, or list \"{} curves\" in stand_ins",
                            curve.direction, curve.kind));
    ++folders[curve.file.parent_path()];
    curves.push_back(curve);
  }
  if (folders.size() < 2 || curves.size() < 3) return;
  const auto usual = std::ranges::max_element(
      folders, [](const auto& a, const auto& b) { return a.second < b.second; });
  if (2 * usual->second <= static_cast<int>(curves.size())) return;
  for (const Curve& curve : curves)
    if (curve.file.parent_path() != usual->first)
      check.add(
          fabric, curve.field,
          fmt::format("{} is not in {}, where most curves of this fabric are", curve.file.string(),
                      usual->first.string()),
          "is it the curve of another fabric? Copy it to the others, or list it in stand_ins");
}

/// Finds a missing curve file, or one that holds only its header.
void check_curve(const Document& fabric, const Curve& curve, BenchCheck& check) {
  if (!fs::is_regular_file(curve.file))
    return check.add(fabric, curve.field, fmt::format("there is no curve {}", curve.file.string()),
                     "correct the name, or put the file there");
  const Where where{.file = curve.file.string(), .field = curve.field};
  const std::string text = read_text(curve.file);
  const bool unix_ends = text.find('\n') != std::string::npos;
  if (text.find('\0') != std::string::npos || (!unix_ends && text.find('\r') != std::string::npos))
    check.add(bad_input(unix_ends ? "the curve is text of two bytes a letter (UTF-16)"
                                  : "the lines end as on an old Macintosh",
                        where, "save it as UTF-8 (CSV) with the line ends of Unix or Windows"));
  else if (std::count(text.begin(), text.end(), '\n') < 3)
    check.add(bad_input("the curve has no points", where,
                        "fill in what the test measured, below the names of the columns"));
}

/// Checks the largest load: KES-FB1 stops at 500 gf/cm, at 50 for weak fabrics, FAST-3 at 98.
void judge_tensile(const fs::path& file, BenchCheck& check) {
  constexpr double kLeast_gf_per_cm = 20;
  const Csv curve =
      read_csv(file, {"strain_percent", "loading_force_gf_per_cm", "unloading_force_gf_per_cm"});
  if (curve.lines.empty() || curve.columns[1].back() >= kLeast_gf_per_cm) return;
  check.add(bad_input(
      fmt::format("the curve ends at {:g} gf/cm; tests go to 50 or 500 (KES) or 98 (FAST)",
                  curve.columns[1].back()),
      {.file = file.string(), .field = "loading_force_gf_per_cm"},
      "is the force in N/cm (1 N/cm is 102 gf/cm), or is the end of the curve missing?"));
}

/// Checks names and files of a fabric's curves, and its values by `drape fabric`, the reader used
/// in simulation, for each of these numbers of segments.
void check_fabric(const fs::path& file, const std::vector<int>& segments, BenchCheck& check) {
  const std::size_t before = check.problems.size();
  ++check.files;
  try {
    const Document fabric = Document::read(file);
    for (const Curve& curve : curves_of(fabric)) check_curve(fabric, curve, check);
    check_curve_names(fabric, check);
    if (check.problems.size() > before) return;
    for (const Curve& curve : curves_of(fabric))
      if (curve.kind == "tensile") judge_tensile(curve.file, check);
  } catch (const Error& error) {
    check.add(error.each());
  }
  if (check.problems.size() > before) return;
  for (const int count : segments) {
    const StepResult result =
        result_of_stage("fabric", {file.string(), "--segments", std::to_string(count), "--json"});
    if (const auto error = error_in(result)) {
      check.add(*error);
      return;
    }
    // Only warnings with a location; the others list unmeasured values.
    const Ending ending = ending_in(result.output).value_or(Ending{});
    for (const std::string& warning : ending.warnings)
      if (count == segments.front() && warning.starts_with(file.string() + ", "))
        check.warnings.push_back(warning);
  }
}

// ---- rig and scenes ---------------------------------------------------------------------------

void check_cameras_and_stages(const Rig& rig, bool is_good, BenchCheck& check) {
  const Document& file = rig.document;
  if (rig.cameras.size() < 2)
    check.add(file, "camera", fmt::format("{} camera in the rig", rig.cameras.size()),
              "a point in space needs two views: add [[camera]] tables");
  const bool joint = !rig.free_poses.empty();
  if (rig.stages.size() < (joint ? 1 : 2))
    check.add(
        file, "calibration.stage",
        joint ? std::string("no target stage: the target's reference pose defines the world")
              : fmt::format("{} target stage(s): Tsai's method needs points at two heights or more",
                            rig.stages.size()),
        "add [[calibration.stage]] tables with set and z_mm");
  std::map<double, std::string> heights;
  for (std::size_t i = 0; is_good && i < rig.stages.size(); ++i) {
    const TargetStage& stage = rig.stages[i];
    const auto [other, fresh] = heights.emplace(stage.z_m, stage.set);
    if (!fresh)
      check.add(file, fmt::format("calibration.stage.{}.z_mm", i),
                fmt::format("stages `{}` and `{}` are both at z_mm = {:g}", other->second,
                            stage.set, stage.z_m / mm),
                "give each stage the height at which the target stood");
  }
  if (is_good && !rig.stages.empty() && heights.count(0.0) == 0)
    check.add(file, "calibration.stage.0.z_mm", "no stage has z_mm = 0",
              "the target's reference pose is the world: its stage has z_mm = 0, the others count "
              "from there");
}

/// Finds sets that show two things.
void check_sets(const Rig& rig, const std::vector<Scene>& scenes, BenchCheck& check) {
  std::map<std::string, std::pair<std::string, const Document*>> shown;
  const auto use = [&](const std::string& set, const std::string& what, const Document& file,
                       const std::string& path) {
    const auto [found, is_new] = shown.try_emplace(set, what, &file);
    if (is_new) return;
    const auto& [other, other_file] = found->second;
    check.add(
        file, path,
        fmt::format("set `{}` shows {} ({}) and {}", set, other, other_file->file().string(), what),
        "each stage, free pose, drape and repeat has a set of its own");
  };
  for (std::size_t i = 0; i < rig.stages.size(); ++i)
    use(rig.stages[i].set, "the target (stage)", rig.document,
        fmt::format("calibration.stage.{}.set", i));
  for (const std::string& pose : rig.free_poses)
    use(pose, "the target (free pose)", rig.document, "calibration.free_poses");
  for (const Scene& scene : scenes)
    if (!scene.set.empty()) use(scene.set, "drape " + scene.name, scene.document, "set");
  for (std::size_t i = 0; i < rig.repeats.size(); ++i) {
    const std::string &set = rig.repeats[i].set, own = "drape " + rig.repeats[i].scene;
    const auto found = shown.find(set);
    if (found != shown.end() && found->second.first == own)
      found->second.first = "a repeat of " + own;  // the rig may name the own laying once
    else
      use(set, "a repeat of " + own, rig.document, fmt::format("repeat.{}.set", i));
  }
}

void check_tags(const Target& target, const Print& print, BenchCheck& check) {
  if (target.tag_family.empty() || target.tag_family != print.tag_family) return;
  std::set<int> ids;
  for (const PrintedTag& tag : print.tags) ids.insert(tag.id);
  for (std::size_t k = 0; k < target.tags.size(); ++k) {
    if (ids.count(target.tags[k].id) == 0) continue;
    return check.add(target.document, fmt::format("tags.tag.{}.id", k),
                     fmt::format("tag {} of {} is printed on target and cloth", target.tags[k].id,
                                 target.tag_family),
                     fmt::format("give the target other ids than {} uses", print.file.string()));
  }
}

/// Checks the targets on the objects' plates of tags, each once.
void check_plates(const Rig& rig, const std::vector<Scene>& scenes, BenchCheck& check) {
  std::set<fs::path> seen = {rig.target_file.lexically_normal()};
  for (const Scene& scene : scenes)
    for (const ObjectTags& plate : scene.tags)
      if (seen.insert(plate.target.lexically_normal()).second)
        if (const auto target = collecting(check, [&] { return read_target(plate.target); }))
          check.add(faults_of(*target));
}

void check_scenes_together(const Rig& rig, const std::vector<Scene>& scenes, BenchCheck& check) {
  std::set<std::string> names;
  for (const Scene& scene : scenes) {
    const Document& file = scene.document;
    if (!names.insert(scene.name).second)
      check.add(file, "name", fmt::format("two scenes are called `{}`", scene.name),
                "give each scene its own name");
    if (is_name_of_a_run(scene.name))
      check.add(
          file, "name",
          fmt::format("`{}` is a name of a run's own files, beside which the drape's folder stands",
                      scene.name),
          "give the drape another name");
    if (scene.set.empty() && !rig.file.empty())
      check.add(file, "set", "the scene names no frame set",
                "add `set = \"...\"`: the set of the recording that shows this drape");
  }
  check_sets(rig, scenes, check);
}

/// Checks that repeats name existing scenes, and that no name occurs twice.
void check_repeats(const Rig& rig, const std::vector<Scene>& scenes, BenchCheck& check) {
  std::vector<std::string> known;
  for (const Scene& scene : scenes) known.push_back(scene.name);
  std::map<std::pair<std::string, std::string>, std::string> names;
  for (std::size_t i = 0; i < rig.repeats.size(); ++i) {
    const DrapeRepeat& one = rig.repeats[i];
    const auto refuse = [&](const char* key, const std::string& what, const char* remedy) {
      check.add(rig.document, fmt::format("repeat.{}.{}", i, key), what, remedy);
    };
    if (std::find(known.begin(), known.end(), one.scene) == known.end()) {
      refuse("scene",
             fmt::format("set `{}` repeats scene `{}`, which the rig does not name{}", one.set,
                         one.scene, did_you_mean(one.scene, known)),
             "give the `name` of one of its scenes");
      continue;
    }
    const auto [other, first] = names.emplace(std::pair{one.scene, one.repeat}, one.set);
    if (!first)
      refuse("repeat",
             fmt::format("sets `{}` and `{}` are both repeat `{}` of scene {}", other->second,
                         one.set, one.repeat, one.scene),
             "give each laying its own name");
  }
}

/// Checks mesh objects by `drape simulate`, the reader used in simulation.
void check_meshes(const Scene& scene, BenchCheck& check) {
  const auto meshes = std::count_if(
      scene.obstacles.begin(), scene.obstacles.end(),
      [](const Obstacle& obstacle) { return std::holds_alternative<MeshObject>(obstacle); });
  if (meshes == 0) return;
  check.files += static_cast<int>(meshes);
  if (const auto error =
          error_in(result_of_stage("simulate", {scene.file.string(), "--check-objects", "--json"})))
    check.add(*error);
}

void give_advice(const std::vector<Scene>& scenes, BenchCheck& check) {
  for (const Scene& scene : scenes) {
    const bool stated =
        std::all_of(scene.uncertainties.begin(), scene.uncertainties.end(),
                    [](const auto& one) { return one.stated_place_m && one.stated_size_m; });
    if (!stated)
      check.advice.push_back(fmt::format(
          "{}: state how well each object's place and size are known (place_uncertainty_mm, "
          "size_uncertainty_mm, one standard deviation); half a division of a steel rule, 0.5 mm, "
          "is assumed",
          scene.file.string()));
  }
}

/// Checks scenes with their fabrics and prints; `rig` has no file if there is only a folder of
/// scenes.
std::vector<Scene> check_scenes(const std::vector<fs::path>& files, const Rig& rig,
                                const std::optional<Print>& print, BenchCheck& check) {
  std::vector<Scene> scenes;
  std::set<fs::path> fabrics, prints = {rig.print_file};
  for (const fs::path& file : files) {
    const auto [scene, is_good] = read_as_far<Scene>(file, check);
    if (scene.file.empty()) continue;
    scenes.push_back(scene);
    if (is_good) check_meshes(scene, check);
    if (is_good && !rig.print_file.empty() && scene.print_file != rig.print_file)
      check.add(scene.document, "print",
                fmt::format("the scene's print is {}, the marks are found with {}",
                            scene.print_file.string(), rig.print_file.string()),
                "name the same file in rig.toml and in the scene");
    if (is_good) check.add(faults_of_places(scene));
    if (is_good) check.add(faults_of(scene));
    if (is_good && print) check.add(faults_of(scene, *print));
    for (const std::string& warning : warnings_of(scene)) check.warnings.push_back(warning);
    for (const auto& [key, named] :
         {std::pair{"fabric", scene.fabric_file}, std::pair{"print", scene.print_file}})
      if (is_good && fs::is_directory(named))
        check.add(scene.document, key, fmt::format("`{}` is empty, or a folder", key),
                  "give the name of a file");
    const auto is_file = [](const fs::path& named) {
      return !named.empty() && !fs::is_directory(named);
    };
    if (is_file(scene.fabric_file) && fabrics.insert(scene.fabric_file).second)
      check_fabric(scene.fabric_file, rig.segments, check);
    if (is_file(scene.print_file) && prints.insert(scene.print_file).second)
      static_cast<void>(read_as_far<Print>(scene.print_file, check));
  }
  return scenes;
}

/// Scenes of a virtual bench, without rig.toml and cameras, as read by `drape study`.
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

BenchCheck check_bench(const fs::path& rig_path, const fs::path& recording_path, bool calibrates) {
  BenchCheck check;
  if (const auto files = virtual_scenes(rig_path)) {
    check.purpose = "`drape study`";
    Rig none;
    none.segments = {1, 5};  // as in `drape study`
    check_scenes_together(none, check_scenes(*files, none, std::nullopt, check), check);
    return check;
  }
  const auto [rig, is_rig_good] =
      read_as_far<Rig>(fs::is_directory(rig_path) ? rig_path / "rig.toml" : rig_path, check);
  if (rig.file.empty()) return check;
  check_cameras_and_stages(rig, is_rig_good, check);
  std::optional<Target> target;
  std::optional<Print> print;
  if (!rig.target_file.empty())
    if (auto read = read_as_far<Target>(rig.target_file, check); read.is_good)
      target = std::move(read.record);
  if (!rig.print_file.empty())
    if (auto read = read_as_far<Print>(rig.print_file, check); read.is_good)
      print = std::move(read.record);
  if (target && print) check_tags(*target, *print, check);
  if (target) check.add(faults_of(*target));
  if (print) {
    check.add(faults_of(*print));
    for (const std::string& warning : warnings_of(*print)) check.warnings.push_back(warning);
  }
  if (is_rig_good && rig.scenes.empty() && !calibrates)
    check.add(rig.document, "scenes", "the rig names no scene",
              "add the scene files, e.g. scenes = [\"scenes/A.toml\"]");
  const std::vector<Scene> scenes = check_scenes(rig.scenes, rig, print, check);
  check_scenes_together(rig, scenes, check);
  check_plates(rig, scenes, check);
  check_repeats(rig, scenes, check);
  if (const fs::path file = rig.file.parent_path() / "acceptance.json"; fs::is_regular_file(file))
    static_cast<void>(collecting(check, [&] { return read_record<AcceptanceFile>(file); }));
  if (const fs::path folder = recording_path.empty() ? rig.recording : recording_path;
      !folder.empty())
    if (const auto recording = collecting(check, [&] { return read_recording(folder); }))
      check_recording(*recording, rig, scenes, check);
  give_advice(scenes, check);
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
    print_text(pretty(json));
  }
  for (const Error& problem : check.problems) print_error(problem, program);
  if (!common.quiet && !common.json) {
    for (const std::string& warning : check.warnings)
      print_text(printable(fmt::format("  warning: {}\n", warning)));
    std::set<std::string> files;
    for (const Error& problem : check.problems) files.insert(problem.where().file);
    if (check.problems.size() > 1)
      print_text(
          fmt::format("{} values to correct, in {}\n", check.problems.size(),
                      files.size() == 1 ? "one file" : fmt::format("{} files", files.size())));
  }
  return static_cast<int>(ErrorKind::bad_input);
}

}  // namespace drape
