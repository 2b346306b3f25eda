// SPDX-License-Identifier: Apache-2.0
#include "core/scene.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <set>

#include "core/drape_mesh.hpp"
#include "core/matching.hpp"
#include "core/program/words.hpp"
#include "core/units.hpp"

namespace drape {
namespace {

using Eigen::Vector2d;
using units::mm;

/// Collects the errors of one document.
struct FaultList {
  const Document& document;
  std::vector<Error> faults = {};

  void add(const std::string& path, const std::string& what, const std::string& remedy) {
    faults.push_back(bad_input(what, document.where(path), remedy));
  }
};

/// Smallest horizontal width of an object; zero if the kind of object has none.
double width_of(const Obstacle& object) {
  if (const auto* ball = std::get_if<Sphere>(&object)) return 2 * ball->radius_m;
  if (const auto* box = std::get_if<Box>(&object)) return box->size_m.head<2>().minCoeff();
  return 0;
}

/// Height of an object's lowest point; NaN if the kind of object has none.
double foot_of(const Obstacle& object) {
  if (const auto* ball = std::get_if<Sphere>(&object))
    return ball->centre_in_world.z() - ball->radius_m;
  if (const auto* box = std::get_if<Box>(&object))
    return box->world_from_box.translation_m.z() - 0.5 * box->size_m.z();
  return std::numeric_limits<double>::quiet_NaN();
}

void check_foot(const Scene& scene, std::size_t i, FaultList& list) {
  constexpr double kSigmas = 3;
  const double foot_m = foot_of(scene.obstacles[i]);
  const double limit_m =
      kSigmas * std::hypot(scene.uncertainty_of(i).place_m(), scene.table_uncertainty_m());
  const double above_m = foot_m - scene.table_z_m;
  const std::string places =
      fmt::format("(z_bottom_mm = {:g}, table_z_mm = {:g})", foot_m / mm, scene.table_z_m / mm);
  if (above_m < -limit_m)
    list.add(
        fmt::format("object.{}.z_bottom_mm", i),
        fmt::format("object {} stands {:g} mm below the table {}", i + 1, -above_m / mm, places),
        fmt::format("an object on the table has z_bottom_mm = {:g}", scene.table_z_m / mm));
  if (above_m > limit_m && !scene.set.empty() && !scene.uncertainty_of(i).on_stand)
    list.add(
        "table_z_mm",
        fmt::format("object {} floats {:g} mm above the table {}", i + 1, above_m / mm, places),
        fmt::format("table_z_mm = {:g} if it stands on the table; on a stand write on_stand = "
                    "true in its [[object]]",
                    foot_m / mm));
}

/// Finds a mesh that extends below the table, since most tools export y up.
void check_mesh(const Scene& scene, std::size_t i, FaultList& list) {
  const auto* mesh = std::get_if<MeshObject>(&scene.obstacles[i]);
  std::error_code absent;
  if (mesh == nullptr || !std::filesystem::is_regular_file(mesh->file, absent)) return;
  double foot_m = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& point : read_mesh_file(mesh->file).points)
    foot_m = std::min(foot_m, (mesh->world_from_mesh * (mm * point)).z());
  const double below_m = scene.table_z_m - foot_m;
  if (below_m > 3 * std::hypot(scene.uncertainty_of(i).place_m(), scene.table_uncertainty_m()))
    list.add(
        fmt::format("object.{}.origin_mm", i),
        fmt::format("the mesh of object {} reaches {:g} mm below the table (table_z_mm = {:g})",
                    i + 1, below_m / mm, scene.table_z_m / mm),
        "is the mesh y up? its z must point up; else correct origin_mm");
}

/// Refuses an uncertainty as wide as the object: no check could then contradict any position.
void check_uncertainty(const Scene& scene, std::size_t i, FaultList& list) {
  const double width_m = width_of(scene.obstacles[i]);
  if (!(width_m > 0)) return;
  const ObjectUncertainty stated = scene.uncertainty_of(i);
  for (const auto& [key, u_m] : {std::pair{"place_uncertainty_mm", stated.place_m()},
                                 std::pair{"size_uncertainty_mm", stated.size_m()}})
    if (2 * u_m >= 0.5 * width_m)
      list.add(fmt::format("object.{}.{}", i, key),
               fmt::format("{} = {:g}: twice that is half of object {}, {:g} mm wide", key,
                           u_m / mm, i + 1, width_m / mm),
               "give one standard deviation in mm, e.g. half of the rule's smallest division");
  struct PlateLimit {
    const char* key;
    std::optional<double> value_mm;
    double least_mm, widths;  ///< smallest allowed value; largest one in widths of the object
    const char* remedy;
  };
  for (const ObjectTags& plate : scene.tags) {
    if (static_cast<std::size_t>(plate.object) != i + 1) continue;
    for (const PlateLimit& limit :
         {PlateLimit{"tags_thickness_mm", plate.thickness_mm, 0, 0.5,
                     "give the thickness of the sheet in mm"},
          PlateLimit{"tags_hole_mm", plate.hole_mm, 0, 1,
                     "give the diameter of the stand's hole in mm"},
          PlateLimit{"tags_placing_mm", plate.placing_mm, 1e-3, 0.25,
                     "give the standard uncertainty of laying the plate on, in mm"}}) {
      const double most_mm = limit.widths * width_m / mm;
      if (!limit.value_mm || (*limit.value_mm >= limit.least_mm && *limit.value_mm < most_mm))
        continue;
      list.add(
          fmt::format("object.{}.{}", i, limit.key),
          fmt::format("{} = {:g} is not from {:g} to {:g}, {:g} of the width of object {}",
                      limit.key, *limit.value_mm, limit.least_mm, most_mm, limit.widths, i + 1),
          limit.remedy);
    }
  }
}

void check_clamps(const Scene& scene, const Print& print, FaultList& list) {
  constexpr double kMostStretch = 0.03;  // soon above this, cloth tears or slips out of the clamp
  constexpr double kWritten_m = 1e-6;
  for (std::size_t i = 0; i < scene.clamps.size(); ++i) {
    const Clamp& clamp = scene.clamps[i];
    for (const auto& [key, end] : {std::pair{"from_material_mm", clamp.from_material_m},
                                   std::pair{"to_material_mm", clamp.to_material_m}})
      if (end.minCoeff() < -kWritten_m || (print.patch_m - end).minCoeff() < -kWritten_m)
        list.add(
            fmt::format("clamp.{}.{}", i, key),
            fmt::format("clamp {} ends at ({:g}, {:g}) mm, the patch is {:g} x {:g} mm", i + 1,
                        end.x() / mm, end.y() / mm, print.patch_m.x() / mm, print.patch_m.y() / mm),
            "count along warp and weft from the corner beside mark (0, 0)");
    const double cloth_m = (clamp.to_material_m - clamp.from_material_m).norm();
    const double space_m = (clamp.to_in_world - clamp.from_in_world).norm();
    if (std::abs(space_m / cloth_m - 1) > kMostStretch)
      list.add(fmt::format("clamp.{}.to_mm", i),
               fmt::format("clamp {} is {:g} mm long on the cloth and {:.4g} mm in space", i + 1,
                           cloth_m / mm, space_m / mm),
               "both are the length of the held edge: is a place wrong, or an end exchanged?");
  }
}

/// Refuses two pins that are farther apart in space than the cloth between them can reach: at most
/// the path along the threads, |dwarp| + |dweft|, attained by fully sheared cloth.
void check_pins_apart(const Scene& scene, const Print& print, FaultList& list) {
  constexpr double kMostStretch = 0.03;  // as for a clamped edge
  constexpr double kWritten_m = 1e-3;    // rounding of two positions given in whole millimetres
  for (std::size_t k = 0; k < scene.pins.size(); ++k) {
    for (std::size_t i = 0; i < k; ++i) {
      const Pin &one = scene.pins[i], &other = scene.pins[k];
      if (!one.point_in_world || !other.point_in_world) continue;
      const double threads_m = (other.material_m(print) - one.material_m(print)).cwiseAbs().sum();
      const double apart_m = (*other.point_in_world - *one.point_in_world).norm();
      if (apart_m <= (1 + kMostStretch) * threads_m + kWritten_m) continue;
      list.add(fmt::format("pin.{}.at_mm", k),
               fmt::format("pins {} and {} are {:.4g} mm apart in space, on the cloth {:.4g} mm "
                           "along its threads",
                           i + 1, k + 1, apart_m / mm, threads_m / mm),
               "is a place wrong, or a mark's row or column exchanged?");
    }
  }
}

/// Clearance between a dot and the black square of a tag; negative if they overlap.
double room_m(const Vector2d& dot, double radius_m, const PrintedTag& tag, double edge_m) {
  const Vector2d beyond =
      ((dot - tag.centre_m).cwiseAbs() - Vector2d::Constant(0.5 * edge_m)).cwiseMax(0.0);
  return beyond.norm() - radius_m;
}

/// Refuses a tag that would be printed over a dot: its position or a size must be wrong.
template <class Marks>
void check_tag_places(const Marks& marks, const std::function<Vector2d(MarkId)>& at,
                      const std::function<std::string(std::size_t)>& field, FaultList& list) {
  for (std::size_t k = 0; k < marks.tags.size(); ++k) {
    for (int row = 0; row < marks.rows; ++row) {
      for (int col = 0; col < marks.cols; ++col) {
        if (room_m(at({row, col}), 0.5 * marks.dot_diameter_m, marks.tags[k], marks.tag_edge_m) >=
            0)
          continue;
        list.add(
            field(k),
            fmt::format("tag {}, {:g} mm wide, would be printed over dot ({}, {})",
                        marks.tags[k].id, marks.tag_edge_m / mm, row, col),
            "correct the tag's place, tags.edge_mm, dot_diameter_mm or pitch_mm; all are in mm");
        return;
      }
    }
  }
}

/// Refuses a family that detect does not support, or a tag id that the family does not have.
void check_family(const std::string& family, const std::vector<PrintedTag>& tags,
                  const std::function<std::string(std::size_t)>& field, FaultList& list) {
  if (family.empty()) return;
  std::vector<std::string> known;
  for (const auto& [name, count] : known_tag_families()) {
    known.push_back(name);
    if (name != family) continue;
    for (std::size_t k = 0; k < tags.size(); ++k) {
      if (tags[k].id >= 0 && tags[k].id < count) continue;
      list.add(field(k), fmt::format("the family {} has no tag {}", family, tags[k].id),
               fmt::format("its ids are 0 to {}: give those that are printed there", count - 1));
      return;
    }
    return;
  }
  list.add("tags.family",
           fmt::format("the tag family `{}` is not known{}", family,
                       did_you_mean(in_small_letters(family), known)),
           fmt::format("use one of {}; OpenCV's DICT_APRILTAG_36h11 is tag36h11",
                       fmt::join(known, ", ")));
}

}  // namespace

std::vector<std::pair<std::string, int>> known_tag_families() {
  std::vector<std::pair<std::string, int>> known = {{"tag36h11", 587},
                                                    {"tag36h10", 2320},
                                                    {"tag25h9", 35},
                                                    {"tag16h5", 30},
                                                    {"tagStandard41h12", 2115}};
  // OpenCV's dictionaries, in the order of its enumeration.
  for (const int side : {4, 5, 6, 7})
    for (const int count : {50, 100, 250, 1000})
      known.emplace_back(fmt::format("DICT_{0}X{0}_{1}", side, count), count);
  known.emplace_back("DICT_ARUCO_ORIGINAL", 1024);
  return known;
}

std::vector<Error> faults_of(const Scene& scene) {
  FaultList list{scene.document};
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
    check_uncertainty(scene, i, list);
    check_mesh(scene, i, list);
  }
  if (!scene.set.empty() && scene.obstacles.empty() && scene.pins.empty() && scene.clamps.empty())
    list.add("object", "the scene has neither an [[object]] nor a [[pin]] or a [[clamp]]",
             "describe what the cloth lies on or hangs from");
  for (Error& fault : faults_of_stand_ins(scene.document)) list.faults.push_back(std::move(fault));
  const Value* objects = scene.document.root().find("object");
  std::map<std::string, std::size_t> seen;
  for (std::size_t i = 0; objects != nullptr && i < scene.obstacles.size(); ++i) {
    const Value& object = (*objects->get_if<Value::List>())[i];
    std::string text;
    for (const auto& [key, value] : flat(object)) text += key + "=" + value + "\n";
    const auto [other, fresh] = seen.emplace(text, i);
    if (!fresh)
      list.add(fmt::format("object.{}.kind", i),
               fmt::format("object {} is object {} once more", i + 1, other->second + 1),
               "remove one of the two");
    // A box under a measured drape needs its measured rotation; it must not default to 0.
    if (!scene.set.empty() && std::holds_alternative<Box>(scene.obstacles[i]) &&
        object.find("yaw_deg") == nullptr)
      list.add(fmt::format("object.{}.kind", i), "`yaw_deg` of a box is missing",
               "add `yaw_deg = ...`: from the world's x axis to the box's edge, towards y");
  }
  return std::move(list.faults);
}

std::vector<Error> faults_of_places(const Scene& scene) {
  FaultList list{scene.document};
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i) check_foot(scene, i, list);
  return std::move(list.faults);
}

std::vector<Error> faults_of(const Scene& scene, const Print& print) {
  FaultList list{scene.document};
  for (std::size_t i = 0; i < scene.pins.size(); ++i) {
    const Pin& pin = scene.pins[i];
    const MarkId mark = pin.mark;
    if (pin.at_material_m) {
      const Vector2d at = *pin.at_material_m;
      if (at.minCoeff() >= 0 && (print.patch_m - at).minCoeff() >= 0) continue;
      list.add(
          fmt::format("pin.{}.at_material_mm", i),
          fmt::format("pin {} is at ({:g}, {:g}) mm, the patch is {:g} x {:g} mm", i + 1,
                      at.x() / mm, at.y() / mm, print.patch_m.x() / mm, print.patch_m.y() / mm),
          "count along warp and weft from the corner beside mark (0, 0)");
    } else if (mark.row < 0 || mark.row >= print.rows || mark.col < 0 || mark.col >= print.cols) {
      list.add(fmt::format("pin.{}.row", i),
               fmt::format("pin {} holds mark ({}, {}), the print has {} x {} marks", i + 1,
                           mark.row, mark.col, print.rows, print.cols),
               "rows and columns count from 0");
    }
  }
  check_pins_apart(scene, print, list);
  check_clamps(scene, print, list);
  if (scene.start.clearance_m > print.patch_m.maxCoeff())
    list.add("start.clearance_mm",
             fmt::format("the cloth starts {:g} mm above its object, more than its own {:g} mm",
                         scene.start.clearance_m / mm, print.patch_m.maxCoeff() / mm),
             "give the height in mm from which the cloth was laid, a few mm");
  return std::move(list.faults);
}

Print print_of(const Scene& scene) {
  Print print = read_print(scene.print_file);
  throw_if_any(faults_of(scene, print));
  return print;
}

std::vector<Error> faults_of(const Target& target) {
  FaultList list{target.document};
  const bool dots = target.kind == TargetKind::dot_grid;
  const auto tag = [dots](const char* key) {
    return [dots, key](std::size_t k) {
      return dots ? fmt::format("tags.tag.{}.{}", k, key) : std::string("tags.first_id");
    };
  };
  check_family(target.tag_family, target.tags, tag("id"), list);
  if (!dots) return std::move(list.faults);
  std::set<int> ids;
  for (std::size_t k = 0; k < target.tags.size(); ++k)
    if (!ids.insert(target.tags[k].id).second)
      list.add(tag("id")(k), fmt::format("two tags have the id {}", target.tags[k].id),
               "give each tag the id that is printed there");
  check_tag_places(
      target, [&](MarkId dot) { return Vector2d(target.point_in_target(dot).head<2>()); },
      tag("centre_mm"), list);
  return std::move(list.faults);
}

std::vector<Error> faults_of(const Print& print) {
  FaultList list{print.document};
  check_family(
      print.tag_family, print.tags, [](std::size_t) { return "tags.first_id"; }, list);
  check_tag_places(
      print, [&](MarkId dot) { return print.material_m(dot); },
      [](std::size_t) { return "tags.edge_mm"; }, list);
  const Vector2d marks = print.pitch_m * Vector2d(print.rows - 1, print.cols - 1);
  const Vector2d other = print.patch_m - marks - print.margin_m;
  for (const int side : {0, 1}) {
    const char* along = side == 0 ? "warp" : "weft";
    const double equal_mm = 0.5 * (print.patch_m[side] - marks[side]) / mm;
    if (std::min(other[side], print.margin_m[side]) < 0.5 * print.dot_diameter_m && equal_mm > 0)
      list.add("margin_mm",
               fmt::format("the outermost dots lie across the edge of the patch, with {:g} mm on "
                           "one side along the {} and {:g} mm on the other",
                           print.margin_m[side] / mm, along, other[side] / mm),
               fmt::format("with equal margins margin_mm is {:g}", equal_mm));
    else if (std::abs(other[side] - print.margin_m[side]) > 0.5 * mm &&
             2 * marks[side] < print.patch_m[side])
      list.add(
          "patch_mm",
          fmt::format("along the {} the marks cover {:g} of the patch's {:g} mm", along,
                      marks[side] / mm, print.patch_m[side] / mm),
          fmt::format("is it {:g}? Marks on less than half of a patch do not measure its drape",
                      (marks[side] + 2 * print.margin_m[side]) / mm));
  }
  return std::move(list.faults);
}

std::vector<Error> faults_of_stand_ins(const Document& document,
                                       std::vector<std::string> also_known) {
  FaultList list{document};
  const Value* stand_ins = document.root().find("stand_ins");
  const auto* texts = stand_ins == nullptr ? nullptr : stand_ins->get_if<Value::List>();
  if (texts == nullptr) return {};
  std::set<std::string> known(also_known.begin(), also_known.end());
  for (const auto& [key, value] : flat(document.root())) {
    known.insert(key.substr(0, key.find('.')));
    known.insert(key.substr(key.rfind('.') + 1));
  }
  for (std::size_t i = 0; i < texts->size(); ++i) {
    const auto* text = (*texts)[i].get_if<std::string>();
    if (text == nullptr) continue;
    const bool speaks = std::any_of(known.begin(), known.end(), [&](const std::string& value) {
      return value == "all" ? *text == value : text->find(value) != std::string::npos;
    });
    if (!speaks)
      list.add(
          fmt::format("stand_ins.{}", i),
          fmt::format("no value of this file is called as the stand-in `{}`, so nothing counts "
                      "as not measured{}",
                      *text, did_you_mean(*text, {known.begin(), known.end()})),
          also_known.empty()
              ? "write the key of the value, e.g. \"friction\""
              : "write e.g. \"shear curves\", \"bending curves\", \"areal density\"");
  }
  return std::move(list.faults);
}

std::vector<std::string> warnings_of(const Scene& scene) {
  if (scene.friction >= kLeastFriction || scene.set.empty()) return {};
  return {
      fmt::format("{}, friction: a friction coefficient of {:g}; cloth on solids has {:g} to "
                  "{:g}",
                  scene.file.string(), scene.friction, kLeastFriction, kMostFriction)};
}

std::vector<std::string> warnings_of(const Print& print) {
  std::vector<std::string> warnings;
  const Vector2d marks = print.pitch_m * Vector2d(print.rows - 1, print.cols - 1);
  const Vector2d other = print.patch_m - marks - print.margin_m;
  for (const int side : {0, 1})
    if (std::abs(other[side] - print.margin_m[side]) > 0.5 * mm &&
        std::min(other[side], print.margin_m[side]) >= 0.5 * print.dot_diameter_m &&
        2 * marks[side] >= print.patch_m[side])
      warnings.push_back(fmt::format(
          "{}: along the {} the marks leave {:g} mm on one side of the patch and {:g} mm on the "
          "other; with equal margins pitch_mm would be {:g}; a print that came out at another size "
          "has every number in mm scaled alike",
          print.file.string(), side == 0 ? "warp" : "weft", print.margin_m[side] / mm,
          other[side] / mm,
          (print.patch_m[side] - 2 * print.margin_m[side]) / mm /
              (side == 0 ? print.rows - 1 : print.cols - 1)));
  return warnings;
}

bool is_ambiguous(const Target& target) {
  if (target.kind == TargetKind::chessboard) return (target.rows + target.cols) % 2 == 0;
  return target.kind == TargetKind::dot_grid && target.tags.empty() && target.hollow.empty();
}

}  // namespace drape
