// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/units.hpp"
#include "triangulate/guards/guards.hpp"
#include "triangulate/guards/object_distance.hpp"

namespace drape::triangulate {
namespace {

using Eigen::Vector3d;
using units::deg;
using units::mm;

constexpr double kSigmas = 3;
/// Cloth rests on an object within its own thickness; woven cloth is thinner than this (KES-FB-3
/// at 0.5 gf/cm2, 0.3 to 0.6 mm in the four fabrics of Codim-IPC).
constexpr double kThickest_m = 1 * mm;

/// Standard deviation of a mark along its worst direction.
double sigma_m(const SheetMark& mark) {
  return mark.covariance_m2 ? std::sqrt(mark.covariance_m2->trace()) : 0;
}

/// What may be fitted of an object: shift along x, y, z, turn, and growth of its size.
using Change = Eigen::Matrix<double, 5, 1>;  // mm, mm, mm, deg, mm

struct Changed {
  Change change;

  Obstacle operator()(Sphere body) const {
    body.radius_m += 0.5 * change[4] * mm;
    body.centre_in_world += change.head<3>() * mm + Vector3d(0, 0, 0.5 * change[4] * mm);
    return body;
  }
  Obstacle operator()(Box body) const {
    body.size_m += Vector3d::Constant(change[4] * mm);
    body.world_from_box.translation_m +=
        change.head<3>() * mm + Vector3d(0, 0, 0.5 * change[4] * mm);
    body.world_from_box.rotation =
        Eigen::AngleAxisd(change[3] * deg, Vector3d::UnitZ()) * body.world_from_box.rotation;
    return body;
  }
  Obstacle operator()(Cylinder body) const {
    body.radius_m += 0.5 * change[4] * mm;
    body.world_from_cylinder.translation_m += change.head<3>() * mm;
    return body;
  }
  Obstacle operator()(Plane body) const {
    body.point_in_world += change.head<3>() * mm;
    return body;
  }
  Obstacle operator()(const MeshObject& body) const { return body; }
};

/// Marks inside cost much, marks that nearly touch are drawn to the surface, all others nothing.
double cost(const Sheet& sheet, const Obstacle& object, double reach_m) {
  constexpr double kInside_m = 0.1 * mm;
  double sum = 0;
  for (const SheetMark& mark : sheet.marks) {
    const double gap = distance_to(object, mark.point_in_world).value_or(1);
    sum +=
        gap < 0 ? std::pow(gap / kInside_m, 2) * 0.05 : 1 - std::exp(-std::pow(gap / reach_m, 2));
  }
  return sum;
}

/// Coordinate search with shrinking steps: five parameters, a rough surface, no derivative.
Change fitted(const Sheet& sheet, const Obstacle& object, const std::vector<int>& free) {
  Change best = Change::Zero();
  for (const double reach_m : {8 * mm, 4 * mm, 2 * mm, 1 * mm}) {
    const auto value = [&](const Change& change) {
      return cost(sheet, std::visit(Changed{change}, object), reach_m);
    };
    double least = value(best);
    for (double step = 4; step > 0.01;) {
      bool better = false;
      for (const int k : free) {
        for (const double sign : {1.0, -1.0}) {
          Change next = best;
          next[k] += sign * step;
          const double found = value(next);
          if (found >= least) continue;
          least = found;
          best = next;
          better = true;
        }
      }
      if (!better) step /= 2;
    }
  }
  return best;
}

/// Depth of the deepest mark in the object, over what its own sigma allows.
struct Deepest {
  MarkId mark;
  double depth_m = -1, sigma_m = 0;
  int inside = 0;
};

Deepest deepest_of(const Sheet& sheet, const Obstacle& object, double stated_m) {
  Deepest deepest;
  for (const SheetMark& mark : sheet.marks) {
    const auto gap = distance_to(object, mark.point_in_world);
    if (!gap) continue;
    const double limit_m = kSigmas * std::hypot(stated_m, sigma_m(mark));
    deepest.inside += -*gap > limit_m;
    if (-*gap > limit_m && -*gap > deepest.depth_m)
      deepest = {mark.mark, -*gap, sigma_m(mark), deepest.inside};
  }
  return deepest;
}

struct Stated {
  Vector3d foot_mm;  ///< x_mm, y_mm, z_bottom_mm
  double size_mm = 0;
  const char* size_key = "";
  std::optional<double> yaw_deg;
};

std::optional<Stated> stated_of(const Obstacle& object) {
  if (const auto* ball = std::get_if<Sphere>(&object)) {
    const Vector3d foot = (ball->centre_in_world - Vector3d(0, 0, ball->radius_m)) / mm;
    return Stated{foot, 2 * ball->radius_m / mm, "diameter_mm", {}};
  }
  if (const auto* box = std::get_if<Box>(&object)) {
    const Eigen::Matrix3d& turn = box->world_from_box.rotation;
    const Vector3d foot =
        (box->world_from_box.translation_m - Vector3d(0, 0, 0.5 * box->size_m.z())) / mm;
    return Stated{foot, box->size_m.z() / mm, "size_mm", std::atan2(turn(1, 0), turn(0, 0)) / deg};
  }
  return std::nullopt;
}

/// The object for which no mark lies inside and those on top touch. What stands on the table keeps
/// its foot there, so its height is its size.
std::string suggestion(const Sheet& sheet, const Obstacle& object, const Scene& scene) {
  const auto stated = stated_of(object);
  if (!stated) return "measure it again";
  const bool on_table =
      std::abs(stated->foot_mm.z() * mm - scene.table_z_m) < kSigmas * scene.table_uncertainty_m();
  std::vector<int> free = {0, 1, on_table ? 4 : 2};
  if (stated->yaw_deg) free.push_back(3);
  const Stated found = *stated_of(std::visit(Changed{fitted(sheet, object, free)}, object));
  std::string text = fmt::format("the marks speak for x_mm = {:.1f}, y_mm = {:.1f}",
                                 found.foot_mm.x(), found.foot_mm.y());
  if (found.yaw_deg) text += fmt::format(", yaw_deg = {:.1f}", *found.yaw_deg);
  return text +
         (on_table ? fmt::format(", {} about {:.1f}", found.size_key, found.size_mm)
                   : fmt::format(", z_bottom_mm = {:.1f}", found.foot_mm.z())) +
         " (a fit to the cloth: measure the object again)";
}

}  // namespace

std::vector<std::string> contradictions_of_pins(const Sheet& sheet, const Scene& scene) {
  std::vector<std::string> found;
  for (const Pin& pin : scene.pins) {
    if (pin.point_in_world || pin.at_material_m || sheet.find(pin.mark) != nullptr) continue;
    std::string why = "the print has no such mark";
    for (const Gap& gap : sheet.gaps)
      if (gap.mark == pin.mark) why = gap.reason;
    found.push_back(fmt::format(
        "{}: pin holds mark ({}, {}), which was not measured ({}); give its place as at_mm, or pin "
        "a material point between measured marks with at_material_mm",
        scene.file.string(), pin.mark.row, pin.mark.col, why));
  }
  return found;
}

std::vector<std::string> contradictions_of_objects(const Sheet& sheet, const Scene& scene) {
  std::vector<std::string> found;
  const std::string file = scene.file.string();
  double nearest_m = 1, allowed_m = 0;
  std::size_t nearest = 0;
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
    const Obstacle& object = scene.obstacles[i];
    const double stated_m =
        std::hypot(scene.uncertainty_of(i).place_m(), scene.uncertainty_of(i).size_m());
    for (const SheetMark& mark : sheet.marks) {
      const double gap = distance_to(object, mark.point_in_world).value_or(0);
      if (gap >= nearest_m) continue;
      nearest_m = gap;
      nearest = i;
      allowed_m = kThickest_m + kSigmas * std::hypot(stated_m, sigma_m(mark));
    }
    const Deepest deepest = deepest_of(sheet, object, stated_m);
    if (deepest.inside == 0) continue;
    found.push_back(fmt::format(
        "{}, object {}: {} mark{} inside it, ({}, {}) by {:.2f} mm, more than {:g} times what "
        "place and size ({:.2f} mm) and the mark ({:.3f} mm) leave open; {}",
        file, i + 1, deepest.inside, deepest.inside == 1 ? " lies" : "s lie", deepest.mark.row,
        deepest.mark.col, deepest.depth_m / mm, kSigmas, stated_m / mm, deepest.sigma_m / mm,
        suggestion(sheet, object, scene)));
  }
  if (!scene.obstacles.empty() && scene.pins.empty() && !sheet.marks.empty() &&
      nearest_m > allowed_m) {
    found.push_back(fmt::format(
        "{}, object {}: no mark touches it, the nearest lies {:.2f} mm above, and cloth that "
        "rests on it at most {:.2f} mm; {}",
        file, nearest + 1, nearest_m / mm, allowed_m / mm,
        suggestion(sheet, scene.obstacles[nearest], scene)));
  }
  const double table_sd_m = scene.table_uncertainty_m();
  const SheetMark* lowest = nullptr;
  for (const SheetMark& mark : sheet.marks)
    if (lowest == nullptr || mark.point_in_world.z() < lowest->point_in_world.z()) lowest = &mark;
  if (lowest != nullptr) {
    const double below_m = scene.table_z_m - lowest->point_in_world.z();
    if (below_m > kSigmas * std::hypot(table_sd_m, sigma_m(*lowest))) {
      found.push_back(
          fmt::format("{}: table_z_mm = {:g}, but mark ({}, {}) lies {:.2f} mm below it; the table "
                      "is at {:.1f} "
                      "or lower",
                      file, scene.table_z_m / mm, lowest->mark.row, lowest->mark.col, below_m / mm,
                      lowest->point_in_world.z() / mm));
    }
  }
  return found;
}

}  // namespace drape::triangulate
