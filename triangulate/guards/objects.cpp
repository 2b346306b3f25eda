// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/geometry/body.hpp"
#include "core/units.hpp"
#include "triangulate/guards/guards.hpp"
#include "triangulate/guards/mesh_gaps.hpp"
#include "triangulate/guards/object_fit.hpp"
#include "triangulate/guards/taut.hpp"

namespace drape::triangulate {
namespace {

using Eigen::Vector3d;
using units::deg;
using units::mm;

/// Wider by this part on each side, a box or cylinder is held by the cloth on all sides alike,
/// which places it in the middle of what the cloth leaves open.
constexpr double kWider = 0.03;

struct Wider {
  Obstacle operator()(Box body) const {
    body.size_m.head<2>() *= 1 + 2 * kWider;
    return body;
  }
  Obstacle operator()(Cylinder body) const {
    body.radius_m *= 1 + 2 * kWider;
    return body;
  }
  template <class Body>
  Obstacle operator()(const Body& body) const {
    return body;
  }
};

/// Marks inside cost much, marks that nearly touch are drawn to the surface, all others nothing;
/// cloth that is too short to pass outside holds the object in its middle.
double cost(const Sheet& sheet, const std::vector<ClothSpan>& spans, const Obstacle& object,
            double reach_m) {
  constexpr double kInside_m = 0.45 * mm;
  double sum = 0;
  for (const SheetMark& mark : sheet.marks) {
    const double gap_m = distance_to(object, mark.point_in_world).value_or(1);
    sum += gap_m < 0 ? std::pow(gap_m / kInside_m, 2) : 1 - std::exp(-std::pow(gap_m / reach_m, 2));
  }
  const Obstacle wider = std::visit(Wider{}, object);
  for (const ClothSpan& span : spans) sum += std::pow(shortfall_m(wider, span) / mm, 2);
  return sum;
}

/// Mean place of the marks that lie on top: within twice the thickest cloth below the highest.
Eigen::Vector2d middle_of_top(const Sheet& sheet) {
  double highest_m = sheet.marks.front().point_in_world.z();
  for (const SheetMark& mark : sheet.marks)
    highest_m = std::max(highest_m, mark.point_in_world.z());
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  int count = 0;
  for (const SheetMark& mark : sheet.marks) {
    if (mark.point_in_world.z() < highest_m - 2 * kThickest_m) continue;
    sum += mark.point_in_world.head<2>();
    ++count;
  }
  return sum / count;
}

/// From where the object is stated, and from below the middle of the highest marks, where the one
/// that fits better ends.
Change fitted(const Sheet& sheet, const std::vector<ClothSpan>& spans, const Obstacle& object,
              const Vector3d& foot_m, const std::vector<int>& free) {
  const auto value = [&](const Change& change, double reach_m) {
    return cost(sheet, spans, changed(object, change), reach_m);
  };
  const auto ended = [&](Change best) {
    for (const double reach_m : {8 * mm, 4 * mm, 2 * mm, 1 * mm})
      best += least([&](const Change& more) { return value(best + more, reach_m); }, free, 0);
    return best;
  };
  Change below = Change::Zero();
  below.head<2>() = (middle_of_top(sheet) - foot_m.head<2>()) / mm;
  const Change first = ended(Change::Zero()), second = ended(below);
  return value(second, 1 * mm) < value(first, 1 * mm) ? second : first;
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
std::string suggestion(const Sheet& sheet, const std::vector<ClothSpan>& spans,
                       const Obstacle& object, const Scene& scene) {
  const auto stated = stated_of(object);
  if (!stated) return "measure it again";
  const bool on_table = std::abs(stated->foot_mm.z() * mm - scene.table_z_m) <
                        kObjectSigmas * scene.table_uncertainty_m();
  std::vector<int> free = {0, 1, on_table ? 4 : 2};
  if (stated->yaw_deg) free.push_back(3);
  const Stated found =
      *stated_of(changed(object, fitted(sheet, spans, object, stated->foot_mm * mm, free)));
  constexpr double kSame_mm = 0.5;
  if ((found.foot_mm - stated->foot_mm).norm() < kSame_mm &&
      std::abs(found.size_mm - stated->size_mm) < kSame_mm &&
      std::abs(found.yaw_deg.value_or(0) - stated->yaw_deg.value_or(0)) < kSame_mm)
    return "measure it again (in mm), or look whether the scene is that of another drape";
  std::string text = fmt::format("the marks speak for x_mm = {:.1f}, y_mm = {:.1f}",
                                 found.foot_mm.x(), found.foot_mm.y());
  if (found.yaw_deg) text += fmt::format(", yaw_deg = {:.1f}", *found.yaw_deg);
  return text +
         (on_table ? fmt::format(", {} about {:.1f}", found.size_key, found.size_mm)
                   : fmt::format(", z_bottom_mm = {:.1f}", found.foot_mm.z())) +
         " (a rough fit to the cloth, to some mm: measure the object again)";
}

std::string text_of(const Against& found) {
  std::string text;
  if (found.inside > 0)
    text = fmt::format("{} mark{} inside it, ({}, {}) by {:.2f} mm", found.inside,
                       found.inside == 1 ? " lies" : "s lie", found.deepest->mark.row,
                       found.deepest->mark.col, found.depth_m / mm);
  const auto add = [&](const std::string& more) { text += (text.empty() ? "" : "; ") + more; };
  if (found.shortest != nullptr) {
    const auto& [from, to, cloth_m, sd_m] = *found.shortest;
    add(
        fmt::format("the cloth between ({}, {}) and ({}, {}), {:.1f} mm, is {:.2f} mm too short to "
                    "pass outside it",
                    from->mark.row, from->mark.col, to->mark.row, to->mark.col, cloth_m / mm,
                    found.shortfall_m / mm));
  }
  return text;
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

std::vector<std::string> contradictions_of_objects(const SeenCloth& seen, const Scene& scene) {
  std::vector<std::string> found;
  const std::string file = scene.file.string();
  const Sheet& sheet = seen.sheet;
  const std::vector<ClothSpan>& spans = seen.spans;
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
    const Obstacle& object = scene.obstacles[i];
    const ObjectUncertainty stated = scene.uncertainty_of(i);
    if (const auto* mesh = std::get_if<MeshObject>(&object)) {
      const std::string why = contradiction_of_mesh(sheet, seen.mesh_gaps_m.at(i), *mesh, stated);
      if (!why.empty()) found.push_back(fmt::format("{}, object {}: {}", file, i + 1, why));
      continue;
    }
    if (!is_contradicted(seen, object, stated)) continue;
    found.push_back(fmt::format(
        "{}, object {}: {}; no object within its uncertainties (place {:.2f} mm, size {:.2f} mm, "
        "chi square below {:.1f}, its top lower by at most {:.2f} mm) would do; {}",
        file, i + 1, text_of(against(seen, object)), stated.place_m() / mm, stated.size_m() / mm,
        chi2_limit(object), most_lowered_m(object, stated) / mm,
        suggestion(sheet, spans, object, scene)));
  }
  if (const auto above = untouched(seen, scene)) {
    found.push_back(fmt::format(
        "{}, object {}: no mark touches it, the nearest lies {:.2f} mm above, and cloth that "
        "rests on it at most {:.2f} mm; {}",
        file, above->object + 1, above->nearest_m / mm, above->allowed_m / mm,
        suggestion(sheet, spans, scene.obstacles[above->object], scene)));
  }
  const double table_sd_m = scene.table_uncertainty_m();
  const SheetMark* lowest = nullptr;
  for (const SheetMark& mark : sheet.marks)
    if (lowest == nullptr || mark.point_in_world.z() < lowest->point_in_world.z()) lowest = &mark;
  if (lowest != nullptr) {
    const double below_m = scene.table_z_m - lowest->point_in_world.z();
    if (below_m > kObjectSigmas * std::hypot(table_sd_m, sigma_m(*lowest))) {
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
