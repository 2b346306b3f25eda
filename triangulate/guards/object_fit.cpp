// SPDX-License-Identifier: Apache-2.0
#include "triangulate/guards/object_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry/body.hpp"
#include "core/scene_values.hpp"
#include "core/statistics/distributions.hpp"

namespace drape::triangulate {
namespace {

using Eigen::Vector3d;
using units::deg;
using units::mm;

/// Standard uncertainties of the fitted components in units of Change. Yaw comes from two ends of
/// an edge.
Change uncertainty_of(const Obstacle& object, const ObjectUncertainty& stated) {
  const double place_mm = stated.place_m() / mm;
  const auto* box = std::get_if<Box>(&object);
  const double yaw_deg =
      box != nullptr ? std::sqrt(2.0) * stated.place_m() / box->size_m.x() / deg : 1;
  return (Change() << place_mm, place_mm, place_mm, yaw_deg, stated.size_m() / mm).finished();
}

std::vector<int> free_of(const Obstacle& object) {
  if (std::holds_alternative<Box>(object)) return {0, 1, 2, 3, 4};
  if (std::holds_alternative<Plane>(object)) return {0, 1, 2};
  return {0, 1, 2, 4};
}

/// True above the central part of an object, where resting cloth touches: over its flat top, or
/// where a sphere or horizontal cylinder has a slope below 30 degrees.
struct OverTop {
  Vector3d point_in_world;

  bool operator()(const Sphere& body) const {
    return (point_in_world - body.centre_in_world).head<2>().norm() < 0.5 * body.radius_m;
  }
  bool operator()(const Box& body) const {
    const Vector3d at = body.world_from_box.inverse() * point_in_world;
    return (at.cwiseAbs() - 0.5 * body.size_m).head<2>().maxCoeff() < 0;
  }
  bool operator()(const Cylinder& body) const {
    const Vector3d axis = body.world_from_cylinder.rotation.col(2);
    const Vector3d from_m = point_in_world - body.world_from_cylinder.translation_m;
    if (std::abs(axis.z()) > std::cos(5 * deg)) return from_m.head<2>().norm() < body.radius_m;
    const Vector3d across = Vector3d::UnitZ().cross(axis).normalized();
    return std::abs(axis.z()) < std::sin(5 * deg) &&
           std::abs(from_m.dot(across)) < 0.5 * body.radius_m &&
           std::abs(from_m.dot(axis)) < 0.5 * body.height_m;
  }
  bool operator()(const Plane&) const { return true; }
  bool operator()(const MeshObject&) const { return true; }
};

}  // namespace

Obstacle changed(const Obstacle& object, const Change& change) {
  Obstacle other = moved(object, change.head<3>() * mm);
  if (auto* body = std::get_if<Cylinder>(&other))
    body->radius_m += 0.5 * change[4] * mm;  // its height stays
  else
    other = grown(other, change[4] * mm);
  if (auto* box = std::get_if<Box>(&other))
    box->world_from_box.rotation =
        Eigen::AngleAxisd(change[3] * deg, Vector3d::UnitZ()) * box->world_from_box.rotation;
  return other;
}

Change least(const std::function<double(const Change&)>& value, const std::vector<int>& free,
             double enough) {
  constexpr double kFirst = 2, kLast = 0.01;  // initial and final step, mm or deg
  Change best = Change::Zero();
  double lowest = value(best);
  const auto explored = [&](Change at, double step) {
    double low = value(at);
    for (const int k : free) {
      for (const double sign : {1.0, -1.0}) {
        Change next = at;
        next[k] += sign * step;
        const double found = value(next);
        if (found >= low) continue;
        low = found;
        at = next;
        break;
      }
    }
    return std::pair(at, low);
  };
  for (double step = kFirst; step > kLast && lowest >= enough;) {
    const auto [next, low] = explored(best, step);
    if (low >= lowest) {
      step /= 2;
      continue;
    }
    const auto [beyond, further] = explored(2 * next - best, step);
    best = further < low ? beyond : next;
    lowest = std::min(further, low);
  }
  return best;
}

Against against(const SeenCloth& seen, const Obstacle& object) {
  Against found;
  for (const SheetMark& mark : seen.sheet.marks) {
    const double depth_m = -distance_to(object, mark.point_in_world).value_or(0);
    if (depth_m <= 0) continue;
    const double sd_m = std::hypot(sigma_m(mark), kCrease_m);
    found.chi2 += std::pow(depth_m / sd_m, 2);
    found.inside += depth_m > kObjectSigmas * sd_m;
    if (depth_m <= found.depth_m) continue;
    found.depth_m = depth_m;
    found.deepest = &mark;
  }
  for (const ClothSpan& span : seen.spans) {
    const double short_m = shortfall_m(object, span);
    found.chi2 += std::pow(short_m / std::hypot(span.sigma_m, kCrease_m), 2);
    if (short_m <= found.shortfall_m) continue;
    found.shortfall_m = short_m;
    found.shortest = &span;
  }
  return found;
}

double chi2_limit(const Obstacle& object) {
  return chi_square_beyond(kObjectRisk, static_cast<double>(free_of(object).size()));
}

double most_lowered_m(const Obstacle& object, const ObjectUncertainty& stated) {
  // A cylinder keeps its height; a plane and a mesh have no size.
  if (!std::holds_alternative<Box>(object) && !std::holds_alternative<Sphere>(object))
    return std::numeric_limits<double>::infinity();
  return normal_quantile(1 - kObjectRisk) * std::hypot(stated.place_m(), stated.size_m());
}

bool is_contradicted(const SeenCloth& seen, const Obstacle& object,
                     const ObjectUncertainty& stated) {
  const double limit = chi2_limit(object);
  if (against(seen, object).chi2 < limit) return false;
  const Change sd = uncertainty_of(object, stated);
  const double most_mm = most_lowered_m(object, stated) / mm;
  double lowest = std::numeric_limits<double>::infinity();
  const auto value = [&](const Change& change) {
    if (change[2] + change[4] < -most_mm) return std::numeric_limits<double>::infinity();
    const double moved = change.cwiseQuotient(sd).squaredNorm();
    if (moved >= lowest) return moved;
    const double found = moved + against(seen, changed(object, change)).chi2;
    lowest = std::min(lowest, found);
    return found;
  };
  static_cast<void>(least(value, free_of(object), limit));
  return lowest >= limit;
}

const SheetMark* below_table(const Sheet& sheet, const Scene& scene, double table_z_m) {
  const auto lowest = std::min_element(sheet.marks.begin(), sheet.marks.end(),
                                       [](const SheetMark& one, const SheetMark& other) {
                                         return one.point_in_world.z() < other.point_in_world.z();
                                       });
  if (lowest == sheet.marks.end()) return nullptr;
  const double below_m = table_z_m - lowest->point_in_world.z();
  return below_m > kObjectSigmas * std::hypot(scene.table_uncertainty_m(), sigma_m(*lowest))
             ? &*lowest
             : nullptr;
}

double SeenCloth::gap_m(const Scene& scene, std::size_t object, std::size_t mark) const {
  return std::holds_alternative<MeshObject>(scene.obstacles[object])
             ? mesh_gaps_m.at(object).at(mark)
             : distance_to(scene.obstacles[object], sheet.marks[mark].point_in_world).value();
}

std::optional<Untouched> untouched(const SeenCloth& seen, const Scene& scene) {
  const Sheet& sheet = seen.sheet;
  if (scene.obstacles.empty() || !scene.pins.empty() || !scene.clamps.empty() ||
      sheet.marks.empty())
    return std::nullopt;
  Untouched found;
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
    const ObjectUncertainty stated = scene.uncertainty_of(i);
    const double stated_m = std::hypot(stated.place_m(), stated.size_m());
    const auto is_over = [&](const SheetMark& mark) {
      return std::visit(OverTop{mark.point_in_world}, scene.obstacles[i]);
    };
    const bool any_over = std::any_of(sheet.marks.begin(), sheet.marks.end(), is_over);
    for (std::size_t k = 0; k < sheet.marks.size(); ++k) {
      const SheetMark& mark = sheet.marks[k];
      const double gap_m = seen.gap_m(scene, i, k);
      if (gap_m >= found.nearest_m || (any_over && !is_over(mark))) continue;
      found = {i, gap_m, kThickest_m + kObjectSigmas * std::hypot(stated_m, sigma_m(mark))};
    }
  }
  return found.nearest_m > found.allowed_m ? std::optional(found) : std::nullopt;
}

std::optional<Floating> floating(const SeenCloth& seen, const Scene& scene) {
  if (!scene.pins.empty() || !scene.clamps.empty()) return std::nullopt;
  const std::vector<SheetMark>& marks = seen.sheet.marks;
  std::vector<double> spare_m;  // gap to the nearest support minus what resting cloth may have
  spare_m.reserve(marks.size());
  for (std::size_t k = 0; k < marks.size(); ++k) {
    const double sd_m = sigma_m(marks[k]);
    double spare = marks[k].point_in_world.z() - scene.table_z_m - kThickest_m -
                   kObjectSigmas * std::hypot(scene.table_uncertainty_m(), sd_m);
    for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
      const ObjectUncertainty stated = scene.uncertainty_of(i);
      spare = std::min(
          spare, seen.gap_m(scene, i, k) - kThickest_m -
                     kObjectSigmas * Vector3d(stated.place_m(), stated.size_m(), sd_m).norm());
    }
    spare_m.push_back(spare);
  }
  std::optional<Floating> found;
  for (const SheetMark& mark : marks) {
    double low_m = mark.point_in_world.z(), high_m = low_m, spare = 1, side_m = 0;
    bool whole = true;
    for (int i = 0; i < 9 && whole; ++i) {
      const SheetMark* part = seen.sheet.find(mark.mark + MarkId{i / 3, i % 3});
      whole = part != nullptr;
      if (!whole) break;
      low_m = std::min(low_m, part->point_in_world.z());
      high_m = std::max(high_m, part->point_in_world.z());
      spare = std::min(spare, spare_m[static_cast<std::size_t>(part - marks.data())]);
      side_m = std::max(side_m, part->material_m.x() - mark.material_m.x());
    }
    const double sag_m = side_m * side_m / (8 * seen.sheet.patch_m.maxCoeff());
    if (!whole || spare <= 0 || high_m - low_m > 0.25 * sag_m) continue;
    if (!found || low_m < found->z_m) found = {mark.mark, low_m, high_m - low_m, spare};
  }
  return found;
}

}  // namespace drape::triangulate
