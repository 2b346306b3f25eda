// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include "core/files/csv.hpp"
#include "core/files/files.hpp"
#include "core/files/toml_file.hpp"
#include "core/numbers/friction.hpp"
#include "core/units.hpp"
#include "front/check/check.hpp"
#include "front/process.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;
using units::mm;

constexpr double kSigmas = 3;
/// On Earth's surface, poles to equator (WGS 84): 9.780 to 9.832 m/s2.
constexpr double kLeastGravity = 9.76, kMostGravity = 9.85;

double foot_of(const Obstacle& object) {
  if (const auto* ball = std::get_if<Sphere>(&object))
    return ball->centre_in_world.z() - ball->radius_m;
  if (const auto* box = std::get_if<Box>(&object))
    return box->world_from_box.translation_m.z() - 0.5 * box->size_m.z();
  return std::numeric_limits<double>::quiet_NaN();
}

void check_foot(const Scene& scene, std::size_t index, BenchCheck& check) {
  const double foot_m = foot_of(scene.obstacles[index]);
  const double limit_m =
      kSigmas * std::hypot(scene.uncertainty_of(index).place_m(), scene.table_uncertainty_m());
  const double above_m = foot_m - scene.table_z_m;
  if (above_m < -limit_m)
    add(check, scene.file, "object.z_bottom_mm",
        fmt::format("object {} stands {:g} mm below the table (z_bottom_mm = {:g}, table_z_mm = "
                    "{:g})",
                    index + 1, -above_m / mm, foot_m / mm, scene.table_z_m / mm),
        fmt::format("an object on the table has z_bottom_mm = {:g}", scene.table_z_m / mm), index);
  if (above_m > limit_m && !scene.set.empty() && !scene.uncertainty_of(index).on_stand)
    add(check, scene.file, "table_z_mm",
        fmt::format("object {} floats {:g} mm above the table (z_bottom_mm = {:g}, table_z_mm = "
                    "{:g})",
                    index + 1, above_m / mm, foot_m / mm, scene.table_z_m / mm),
        fmt::format("table_z_mm = {:g} if it stands on the table; on a stand write on_stand = true "
                    "in its [[object]]",
                    foot_m / mm));
}

/// KES-FB1 stops at 500 gf/cm, for weak fabrics at 50, FAST-3 at 98.
void judge_tensile(const TomlTable& tensile, BenchCheck& check) {
  constexpr double kLeast_gf_per_cm = 20;
  for (const char* direction : {"warp", "weft"}) {
    if (!tensile.has(direction)) continue;
    const fs::path file = tensile.file_path(direction);
    const Csv curve =
        read_csv(file, {"strain_percent", "loading_force_gf_per_cm", "unloading_force_gf_per_cm"});
    if (curve.lines.empty() || curve.columns[1].back() >= kLeast_gf_per_cm) continue;
    add(check, file, "loading_force_gf_per_cm",
        fmt::format("the curve ends at {:g} gf/cm; tests go to 50 or 500 (KES) or 98 (FAST)",
                    curve.columns[1].back()),
        "is the force in N/cm (1 N/cm is 102 gf/cm), or is the end of the curve missing?");
  }
}

/// A drape that nothing holds, an object that stands there twice, a start from above the room.
void check_support(const Scene& scene, const Print* print, BenchCheck& check) {
  if (!scene.set.empty() && scene.obstacles.empty() && scene.pins.empty() && scene.clamps.empty())
    add(check, scene.file, "object",
        "the scene has neither an [[object]] nor a [[pin]] or a [[clamp]]",
        "describe what the cloth lies on or hangs from");
  std::map<std::string, std::size_t> seen;
  std::size_t index = 0;
  for (const TomlTable& table : TomlTable::open(scene.file, "scene").tables("object")) {
    for (const auto& [key, most, remedy] :
         {std::tuple{"x_mm", kLargestBench_m / mm, "places are in mm from the target's middle"},
          std::tuple{"y_mm", kLargestBench_m / mm, "places are in mm from the target's middle"},
          std::tuple{"yaw_deg", 360.0, "an angle in degrees, -180 to 180"}})
      if (table.has(key) && std::abs(table.number(key)) > most)
        add(check, scene.file, std::string("object.") + key,
            fmt::format("{} = {:g}", key, table.number(key)), remedy, index);
    std::string text;
    for (const auto& [key, value] : table.values()) text += key + "=" + value + "\n";
    const auto [other, fresh] = seen.emplace(text, index);
    if (!fresh)
      add(check, scene.file, "object.kind",
          fmt::format("object {} is object {} once more", index + 1, other->second + 1),
          "remove one of the two", index);
    ++index;
  }
  if (print != nullptr && scene.start.clearance_m > print->patch_m.maxCoeff())
    add(check, scene.file, "start.clearance_mm",
        fmt::format("the cloth starts {:g} mm above its object, more than its own {:g} mm",
                    scene.start.clearance_m / mm, print->patch_m.maxCoeff() / mm),
        "give the height in mm from which the cloth was laid, a few mm");
}

/// A box's turn is a measured value where a real drape is compared; nothing says that it is 0.
void check_yaw(const Scene& scene, BenchCheck& check) {
  if (scene.set.empty()) return;
  std::size_t index = 0;
  for (const TomlTable& table : TomlTable::open(scene.file, "scene").tables("object")) {
    if (table.text("kind") == "box" && !table.has("yaw_deg"))
      add(check, scene.file, "object.kind", "`yaw_deg` of a box is missing",
          "add `yaw_deg = ...`: from the world's x axis to the box's edge, towards y", index);
    ++index;
  }
}

}  // namespace

void check_scene(const Scene& scene, const Rig& rig, const Print* print, BenchCheck& check) {
  if (!rig.print_file.empty() && scene.print_file != rig.print_file)
    add(check, scene.file, "print",
        fmt::format("the scene's print is {}, the marks are found with {}",
                    scene.print_file.string(), rig.print_file.string()),
        "name the same file in rig.toml and in the scene");
  if (scene.friction > kMostFriction)
    add(check, scene.file, "friction",
        fmt::format("a friction coefficient of {:g}; cloth on solids has {:g} to {:g}",
                    scene.friction, kLeastFriction, kMostFriction),
        fmt::format("is it {:.3g} (degrees), {:.3g} (per cent) or {:.3g}? Measure it on a tilting "
                    "plane: the tangent of the angle at which it slides",
                    std::tan(scene.friction * units::deg), scene.friction / 100,
                    scene.friction / 10));
  if (scene.friction < kLeastFriction && !scene.set.empty())
    check.warnings.push_back(fmt::format(
        "{}, friction: a friction coefficient of {:g}; cloth on solids has {:g} to {:g}",
        scene.file.string(), scene.friction, kLeastFriction, kMostFriction));
  const double gravity = scene.gravity_m_per_s2.norm();
  if (!(gravity >= kLeastGravity && gravity <= kMostGravity))
    add(check, scene.file, "gravity_m_per_s2",
        fmt::format("gravity of {:g} m/s2 is not the Earth's", gravity),
        "leave it out, or give [0, 0, -9.80665]");
  else if (scene.gravity_m_per_s2.z() > -0.9 * gravity)
    add(check, scene.file, "gravity_m_per_s2", "gravity does not point down (-z)",
        "leave it out, or give [0, 0, -9.80665]");
  if (scene.friction_uncertainty && *scene.friction_uncertainty >= scene.friction)
    add(check, scene.file, "friction_uncertainty",
        fmt::format("friction = {:g} with an uncertainty of {:g}: nothing would be known of it",
                    scene.friction, *scene.friction_uncertainty),
        "give one standard deviation, or leave it out and list friction in stand_ins");
  check_pins(scene, print, check);
  check_clamps(scene, print, check);
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
    check_foot(scene, i, check);
    check_uncertainty(scene, i, check);
  }
  check_support(scene, print, check);
  check_yaw(scene, check);
}

namespace {

/// Whether the fabric file says that nobody measured curves of this kind.
bool is_stand_in(const TomlTable& root, const std::string& kind) {
  if (!root.has("stand_ins")) return false;
  const std::vector<std::string> names = root.texts("stand_ins");
  return std::any_of(names.begin(), names.end(), [&](const std::string& name) {
    return name.find(kind + " curves") != std::string::npos;
  });
}

/// A measured curve under a name of another direction, one file for both, or one of another fabric.
void check_curve_names(const TomlTable& root, BenchCheck& check) {
  std::map<fs::path, int> folders;
  struct Curve {
    std::string field;
    fs::path file;
  };
  std::vector<Curve> curves;
  for (const char* kind : {"tensile", "shear", "bending"}) {
    const auto table = root.optional_table(kind);
    if (!table || is_stand_in(root, kind)) continue;
    std::map<fs::path, std::string> used;
    for (const char* direction : {"warp", "weft"}) {
      if (!table->has(direction)) continue;
      const fs::path file = table->file_path(direction);
      const std::string field = fmt::format("{}.{}", kind, direction);
      const std::string other = std::string(direction) == "warp" ? "weft" : "warp";
      const std::string name = file.filename().string();
      if (name.find(other) != std::string::npos && name.find(direction) == std::string::npos)
        add(check, root.file(), field,
            fmt::format("{} names {}, a curve along the {}", field, name, other),
            "are warp and weft exchanged?");
      if (const auto [first, fresh] = used.emplace(file, field); !fresh)
        add(check, root.file(), field, fmt::format("{} is also {}", name, first->second),
            fmt::format("name the curve along the {}, or list \"{} curves\" in stand_ins",
                        direction, kind));
      ++folders[file.parent_path()];
      curves.push_back({field, file});
    }
  }
  if (folders.size() < 2 || curves.size() < 3) return;
  const auto usual =
      std::max_element(folders.begin(), folders.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  if (2 * usual->second <= static_cast<int>(curves.size())) return;
  for (const Curve& curve : curves) {
    if (curve.file.parent_path() == usual->first) continue;
    add(check, root.file(), curve.field,
        fmt::format("{} is not in {}, where most curves of this fabric are", curve.file.string(),
                    usual->first.string()),
        "is it the curve of another fabric? Copy it to the others, or list it in stand_ins");
  }
}

/// Curve files that are not there, or that hold nothing but their head.
void check_curves(const TomlTable& root, BenchCheck& check) {
  for (const char* kind : {"tensile", "shear", "bending"}) {
    const auto table = root.optional_table(kind);
    if (!table) continue;
    for (const char* direction : {"warp", "weft"}) {
      if (!table->has(direction)) continue;
      const fs::path curve = table->file_path(direction);
      const std::string field = fmt::format("{}.{}", kind, direction);
      if (!fs::is_regular_file(curve)) {
        check.problems.push_back(bad_input(fmt::format("there is no curve {}", curve.string()),
                                           {.file = root.file().string(), .field = field},
                                           "correct the name, or put the file there"));
        continue;
      }
      const std::string text = read_text(curve);
      const bool unix_ends = text.find('\n') != std::string::npos;
      if (text.find('\0') != std::string::npos ||
          (!unix_ends && text.find('\r') != std::string::npos)) {
        check.problems.push_back(
            bad_input(unix_ends ? "the curve is text of two bytes a letter (UTF-16)"
                                : "the lines end as on an old Macintosh",
                      {.file = curve.string(), .field = field},
                      "save it as UTF-8 (CSV) with the line ends of Unix or Windows"));
        continue;
      }
      if (std::count(text.begin(), text.end(), '\n') < 3)
        check.problems.push_back(
            bad_input("the curve has no points", {.file = curve.string(), .field = field},
                      "fill in what the test measured, below the names of the columns"));
    }
  }
}

}  // namespace

void check_fabric(const fs::path& file, const std::vector<int>& segments, BenchCheck& check) {
  const std::size_t before = check.problems.size();
  ++check.files;
  try {
    ProblemCollector collector(check.problems);
    const TomlTable root = TomlTable::open(file, "fabric");
    check_stand_ins(file, "fabric", check);
    const std::size_t so_far = check.problems.size();
    check_curves(root, check);
    check_curve_names(root, check);
    if (check.problems.size() > so_far) return;
    if (const auto tensile = root.optional_table("tensile")) judge_tensile(*tensile, check);
  } catch (const Error& error) {
    check.problems.push_back(error);
  }
  if (check.problems.size() > before) return;
  for (const int count : segments) {
    const StepResult result =
        result_of_stage("fabric", {file.string(), "--segments", std::to_string(count), "--json"});
    if (const auto error = error_in(result)) {
      check.problems.push_back(*error);
      return;
    }
    // Those that name a place: the others list what nobody measured.
    for (const std::string& warning : warnings_in(result))
      if (count == segments.front() && warning.starts_with(file.string() + ", "))
        check.warnings.push_back(warning);
  }
}

}  // namespace drape
