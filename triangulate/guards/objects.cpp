// SPDX-License-Identifier: Apache-2.0
#include "triangulate/guards/objects.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "core/geometry/body.hpp"
#include "core/geometry/closed_mesh.hpp"
#include "core/parallel.hpp"
#include "core/scene.hpp"
#include "core/statistics/sample.hpp"
#include "triangulate/guards/guards.hpp"

namespace drape::triangulate {

using Eigen::Matrix3d, Eigen::Vector3d;
using units::deg;
using units::mm;

namespace {

/// Risk of contradicting a correct object: by chi-square, and by one direction alone.
constexpr double kObjectRisk = 0.005;

/// Additional error of marks on sharp creases, which can reach 0.23 mm (README, limits).
constexpr double kCrease_m = 0.1 * units::mm;

/// Evidence against an object: marks inside it, and cloth too short to pass outside.
struct Against {
  int inside = 0;
  const SheetMark* deepest = nullptr;
  double depth_m = 0;
  const ClothSpan* shortest = nullptr;
  double shortfall_m = 0;
  double chi2 = 0;  ///< sum of squares in units of the marks' standard deviations
};

/// The mark nearest above the top of any object (anywhere, if there is none above a top), if it is
/// higher than resting cloth can be.
struct Untouched {
  std::size_t object = 0;
  double nearest_m = 1;
  double allowed_m = 0;  ///< thickest cloth and three standard deviations of position, size, mark
};

/// 3 x 3 marks that lie level without support in the scene. Cloth that spans a length L without
/// support sags by at least L^2 / (8 H), with H the longest edge of the patch, since its tension is
/// at most the weight of the whole patch; level means a quarter of that. A single mark is weaker
/// evidence: stiff cloth can lift a free edge above its support.
struct Floating {
  MarkId first;
  double z_m = 0;      ///< height of the lowest mark
  double range_m = 0;  ///< lowest to highest mark
  double spare_m = 0;  ///< height above any possible support
};

/// Length of a string around a circle of radius r between two points at distances a and b from its
/// centre, which subtend the angle phi on the string's side; nullopt if it does not touch.
std::optional<double> around_circle(double a, double b, double phi, double r) {
  a = std::max(a, r);
  b = std::max(b, r);
  const double free = std::acos(a > 0 ? r / a : 1) + std::acos(b > 0 ? r / b : 1);
  if (phi <= free) return std::nullopt;
  return std::sqrt(a * a - r * r) + std::sqrt(b * b - r * r) + r * (phi - free);
}

/// Path over one edge of a box centred on the origin. The rounded edge is a cylinder; unrolled, the
/// path is straight. nullopt if the string does not touch the edge, or near its ends, where a path
/// around the corner may be shorter.
std::optional<double> over_edge(const Vector3d& from, const Vector3d& to, const Vector3d& half_m,
                                double radius_m, int axis, const Eigen::Vector2d& out) {
  const int j = (axis + 1) % 3, k = (axis + 2) % 3;
  const Eigen::Vector2d edge =
      out.cwiseProduct(Eigen::Vector2d(half_m[j], half_m[k])) - radius_m * out;
  const auto across = [&](const Vector3d& at) {
    return Eigen::Vector2d(out.cwiseProduct(Eigen::Vector2d(at[j], at[k]) - edge));
  };
  // In the plane across the edge the object fills the negative quadrant, enlarged by the radius.
  const Eigen::Vector2d a = across(from), b = across(to);
  const auto turn = [](const Eigen::Vector2d& u) {
    return std::atan2(u.y() - u.x(), u.x() + u.y());
  };
  const bool outside = a.maxCoeff() >= 0 && b.maxCoeff() >= 0;
  if (!outside || turn(a) * turn(b) >= 0) return std::nullopt;
  const auto flat_m =
      around_circle(a.norm(), b.norm(), std::abs(turn(a)) + std::abs(turn(b)), radius_m);
  if (!flat_m) return std::nullopt;
  const double length_m = std::hypot(*flat_m, to[axis] - from[axis]);
  const double beside_m = half_m[axis] - std::max(std::abs(from[axis]), std::abs(to[axis]));
  const double chord_m = (to - from).norm();
  // Largest distance from the chord of a path of this length.
  const double bulge_m = 0.5 * std::sqrt(std::max(0.0, length_m * length_m - chord_m * chord_m));
  return beside_m >= bulge_m ? std::optional(length_m) : std::nullopt;
}

struct Taut {
  Vector3d from, to;

  double operator()(const Sphere& body) const {
    const Vector3d a = from - body.centre_in_world, b = to - body.centre_in_world;
    const double phi = std::atan2(a.cross(b).norm(), a.dot(b));
    return around_circle(a.norm(), b.norm(), phi, body.radius_m).value_or((to - from).norm());
  }
  double operator()(const Box& body) const {
    const double chord_m = (to - from).norm();
    const Vector3d half_m = 0.5 * body.size_m;
    const WorldFromObject& pose = body.world_from_box;
    // Points farther away than from each other cannot reach an edge.
    const double reach_m = half_m.norm() + chord_m;
    if ((from - pose.translation_m).squaredNorm() > reach_m * reach_m) return chord_m;
    const Vector3d a = pose.inverse() * from, b = pose.inverse() * to;
    std::optional<double> shortest_m;
    for (int axis = 0; axis < 3; ++axis) {
      for (const double x : {1.0, -1.0}) {
        for (const double y : {1.0, -1.0}) {
          const auto found_m = over_edge(a, b, half_m, body.edge_radius_m, axis, {x, y});
          if (found_m) shortest_m = std::min(*found_m, shortest_m.value_or(*found_m));
        }
      }
    }
    return shortest_m.value_or(chord_m);
  }
  template <class Body>
  double operator()(const Body&) const {
    return (to - from).norm();
  }
};

/// Upper bound of a mark's standard deviation in any direction; 0 if none is stated.
double sigma_m(const SheetMark& mark) {
  return mark.covariance_m2 ? std::sqrt(mark.covariance_m2->trace()) : 0;
}

/// Length by which the cloth of a span is too short to pass outside the object; 0 if it is not. A
/// span that is too long even without an object is no evidence against this one.
double shortfall_m(const Obstacle& object, const ClothSpan& span) {
  const Vector3d &from = span.from->point_in_world, &to = span.to->point_in_world;
  const double chord_m = (to - from).norm();
  return std::max(0.0, taut_path_m(object, from, to) - std::max(span.cloth_m, chord_m));
}

/// Standard uncertainties of the fitted components in units of Change.
Change uncertainty_of(const Obstacle& object, const ObjectUncertainty& stated) {
  const double place_mm = stated.place_m() / mm;
  const double yaw_deg = turn_rad(object, stated).value_or(deg) / deg;
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

/// Minimises `value` by pattern search (Hooke and Jeeves 1961), for few parameters and a rough
/// function without derivatives. Varies only the `free` components; stops early below `enough`.
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

/// 99.5 % quantile of chi square with the object's number of values as degrees of freedom.
double chi2_limit(const Obstacle& object) {
  return chi_square_beyond(kObjectRisk, static_cast<double>(free_of(object).size()));
}

/// 99.5 % quantile of the error by which the top is stated too high: position plus size.
double most_lowered_m(const Obstacle& object, const ObjectUncertainty& stated) {
  // A cylinder keeps its height; a plane and a mesh have no size.
  if (!std::holds_alternative<Box>(object) && !std::holds_alternative<Sphere>(object))
    return std::numeric_limits<double>::infinity();
  return normal_quantile(1 - kObjectRisk) * std::hypot(stated.place_m(), stated.size_m());
}

/// True if no object within the stated uncertainties is consistent. Either the least chi square of
/// any object near the stated one, for the move plus the remaining contradiction, exceeds
/// chi2_limit(), or its top would have to be lowered by more than most_lowered_m(). With correct
/// uncertainties the former does not exceed that of the true object, whose first part has as many
/// degrees of freedom as there are values; each false alarm rate is at most 1 in 200.
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

/// The lowest mark, if it is below a table at this height by more than three standard deviations of
/// table height and mark.
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

/// The lowest such marks; nullopt if pins or clamps pull on the cloth.
std::optional<Floating> floating(const SeenCloth& seen, const Scene& scene) {
  if (!scene.pins.empty() || !scene.clamps.empty()) return std::nullopt;
  const std::vector<SheetMark>& marks = seen.sheet.marks;
  std::vector<double> spare_m;  // gap to the nearest support minus the largest gap of resting cloth
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

/// Largest penetration of a mark into a correctly stated mesh: 99.5 % quantile of chi square for
/// the four values of position and rotation, as for a body of known shape, plus three standard
/// deviations of the mark.
double most_inside_m(const ObjectUncertainty& stated, const SheetMark& mark) {
  return std::sqrt(chi_square_beyond(kObjectRisk, 4)) *
             std::hypot(stated.place_m(), stated.size_m()) +
         kObjectSigmas * std::hypot(sigma_m(mark), kCrease_m);
}

/// Explains why a mesh object cannot have the stated position and size; empty if it can.
std::string contradiction_of_mesh(const Sheet& sheet, const std::vector<double>& gaps,
                                  const MeshObject& object, const ObjectUncertainty& stated) {
  int inside = 0;
  std::size_t deepest = 0;
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    inside += -gaps[i] > most_inside_m(stated, sheet.marks[i]);
    if (gaps[i] < gaps[deepest]) deepest = i;
  }
  if (inside == 0) return {};
  const SheetMark& mark = sheet.marks[deepest];
  return fmt::format(
      "{} mark{} deep inside {}, ({}, {}) by {:.2f} mm, and where place ({:.2f} mm) and size "
      "({:.2f} mm) are as uncertain as stated no mark lies deeper than {:.2f}; compare the file's "
      "unit and size, origin_mm and yaw_deg with the object, or measure it with a plate of tags "
      "(drape object)",
      inside, inside == 1 ? " lies" : "s lie", object.file.string(), mark.mark.row, mark.mark.col,
      -gaps[deepest] / mm, stated.place_m() / mm, stated.size_m() / mm,
      most_inside_m(stated, mark) / mm);
}

/// Relative enlargement of a box or cylinder that lets the cloth touch it all around and so centres
/// it in the space under the cloth.
constexpr double kWider = 0.03;

Obstacle wider_of(Obstacle object) {
  if (auto* box = std::get_if<Box>(&object)) box->size_m.head<2>() *= 1 + 2 * kWider;
  if (auto* body = std::get_if<Cylinder>(&object)) body->radius_m *= 1 + 2 * kWider;
  return object;
}

/// Cost of an object: high for marks inside, 0 for touching marks, rising to 1 for distant ones.
/// Cloth too short to pass outside also counts, which centres the object under it.
double cost(const SeenCloth& seen, const Obstacle& object, double reach_m) {
  constexpr double kInside_m = 0.45 * mm;
  double sum = 0;
  for (const SheetMark& mark : seen.sheet.marks) {
    const double gap_m = distance_to(object, mark.point_in_world).value_or(1);
    sum += gap_m < 0 ? std::pow(gap_m / kInside_m, 2) : 1 - std::exp(-std::pow(gap_m / reach_m, 2));
  }
  const Obstacle wider = wider_of(object);
  for (const ClothSpan& span : seen.spans) sum += std::pow(shortfall_m(wider, span) / mm, 2);
  return sum;
}

/// Mean position of the marks on top: within twice the largest thickness below the highest.
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

/// Values of an object as stated in its scene.
struct Stated {
  Vector3d foot_mm;                     ///< x_mm, y_mm, z_bottom_mm
  Vector3d size_mm = Vector3d::Zero();  ///< for a box; else the diameter comes first
  double yaw_deg = 0;
  bool is_box = false;
};

/// Half of a cylinder's height in space, whatever its axis.
double half_height_m(const Cylinder& body) {
  const Vector3d axis = body.world_from_cylinder.rotation.col(2);
  return 0.5 * body.height_m * std::abs(axis.z()) + body.radius_m * std::hypot(axis.x(), axis.y());
}

std::optional<Stated> stated_of(const Obstacle& object) {
  if (const auto* ball = std::get_if<Sphere>(&object))
    return Stated{(ball->centre_in_world - Vector3d(0, 0, ball->radius_m)) / mm,
                  Vector3d(2 * ball->radius_m / mm, 0, 0)};
  if (const auto* body = std::get_if<Cylinder>(&object))
    return Stated{
        (body->world_from_cylinder.translation_m - Vector3d(0, 0, half_height_m(*body))) / mm,
        Vector3d(2 * body->radius_m / mm, body->height_m / mm, 0)};
  if (const auto* box = std::get_if<Box>(&object)) {
    const Matrix3d& turn = box->world_from_box.rotation;
    return Stated{(box->world_from_box.translation_m - Vector3d(0, 0, 0.5 * box->size_m.z())) / mm,
                  box->size_m / mm, std::atan2(turn(1, 0), turn(0, 0)) / deg, true};
  }
  return std::nullopt;
}

/// The object with these values; a cylinder's axis and the edge radii are kept.
Obstacle typed(Obstacle object, const Stated& values) {
  const Vector3d foot_m = values.foot_mm * mm;
  if (auto* ball = std::get_if<Sphere>(&object)) {
    ball->radius_m = 0.5 * values.size_mm.x() * mm;
    ball->centre_in_world = foot_m + Vector3d(0, 0, ball->radius_m);
  } else if (auto* body = std::get_if<Cylinder>(&object)) {
    body->radius_m = 0.5 * values.size_mm.x() * mm;
    body->height_m = values.size_mm.y() * mm;
    body->world_from_cylinder.translation_m = foot_m + Vector3d(0, 0, half_height_m(*body));
  } else if (auto* box = std::get_if<Box>(&object)) {
    box->size_m = values.size_mm * mm;
    box->world_from_box.translation_m = foot_m + Vector3d(0, 0, 0.5 * box->size_m.z());
    box->world_from_box.rotation =
        Eigen::AngleAxisd(values.yaw_deg * deg, Vector3d::UnitZ()).toRotationMatrix();
  }
  return object;
}

struct Slip {
  const char* what;
  Stated values;
};

std::vector<Slip> slips_of(const Stated& stated, double table_z_mm) {
  std::vector<Slip> slips;
  const auto add = [&](const char* what, auto&& change) {
    Slip slip{what, stated};
    change(slip.values);
    slips.push_back(slip);
  };
  if (stated.is_box) {
    add("with the other sign", [](Stated& v) { v.yaw_deg = -v.yaw_deg; });
    add("from the other axis", [](Stated& v) { v.yaw_deg = 90 - v.yaw_deg; });
    add("sides exchanged", [](Stated& v) { std::swap(v.size_mm.x(), v.size_mm.y()); });
    add("sides exchanged", [](Stated& v) { std::swap(v.size_mm.x(), v.size_mm.z()); });
    add("sides exchanged", [](Stated& v) { std::swap(v.size_mm.y(), v.size_mm.z()); });
    const Eigen::Rotation2Dd turn(stated.yaw_deg * deg);
    for (const double i : {-0.5, 0.5})
      for (const double k : {-0.5, 0.5})
        add("a corner was typed", [&](Stated& v) {
          v.foot_mm.head<2>() += turn * Eigen::Vector2d(i * v.size_mm.x(), k * v.size_mm.y());
        });
  } else {
    add("the radius was typed", [](Stated& v) { v.size_mm.x() *= 2; });
    add("the circumference was typed", [](Stated& v) { v.size_mm.x() /= 3.14159265; });
  }
  add("with the other sign", [](Stated& v) { v.foot_mm.x() = -v.foot_mm.x(); });
  add("with the other sign", [](Stated& v) { v.foot_mm.y() = -v.foot_mm.y(); });
  add("with the other signs", [](Stated& v) { v.foot_mm.head<2>() *= -1; });
  add("exchanged", [](Stated& v) { std::swap(v.foot_mm.x(), v.foot_mm.y()); });
  add("on the table", [&](Stated& v) { v.foot_mm.z() = table_z_mm; });
  for (const auto& [what, factor] :
       {std::pair{"typed in centimetres", 10.0}, std::pair{"ten times too large", 0.1},
        std::pair{"typed in inches", 25.4}}) {
    add(what, [f = factor](Stated& v) { v.foot_mm.head<2>() *= f; });
    add(what, [f = factor](Stated& v) { v.size_mm *= f; });
    add(what, [f = factor](Stated& v) {
      v.foot_mm.head<2>() *= f;
      v.size_mm *= f;
    });
  }
  return slips;
}

/// A value rounded to one decimal, as printed.
double printed(double value) {
  return std::round(10 * value) / 10;
}

std::string text_of(const Stated& from, const Stated& to, const Change& within) {
  std::string text;
  const auto add = [&](const char* key, double old, double now, double range) {
    if (std::abs(old - now) < 1e-6 && range == 0) return;
    text += fmt::format("{}{} = {:.1f}", text.empty() ? "" : ", ", key, now);
    if (range > 0) text += fmt::format(" +- {:.1f}", range);
  };
  add("x_mm", from.foot_mm.x(), to.foot_mm.x(), within[0]);
  add("y_mm", from.foot_mm.y(), to.foot_mm.y(), within[1]);
  add("z_bottom_mm", from.foot_mm.z(), to.foot_mm.z(), within[2]);
  if (!from.is_box) {
    add("diameter_mm", from.size_mm.x(), to.size_mm.x(), within[4]);
  } else {
    add("yaw_deg", from.yaw_deg, to.yaw_deg, within[3]);
    if (!from.size_mm.isApprox(to.size_mm, 1e-9))
      text += fmt::format("{}size_mm = [{:.1f}, {:.1f}, {:.1f}]", text.empty() ? "" : ", ",
                          to.size_mm.x(), to.size_mm.y(), to.size_mm.z());
  }
  return text;
}

/// Searches for objects that pass the tests failed by the stated one.
class Search {
 public:
  Search(const SeenCloth& seen, const Scene& scene, std::size_t object)
      : seen_(seen),
        scene_(scene),
        index_(object),
        limit_(chi2_limit(scene.obstacles[object])),
        is_held_up_(!floating(seen, scene)) {}

  /// True if the object is not contradicted when it may be smaller by twice its size's uncertainty.
  [[nodiscard]] bool fits(const Obstacle& object) const {
    return chi2(object) < limit_ && touches(object);
  }
  [[nodiscard]] bool passes(const Obstacle& object) const {
    return touches(object) && !is_contradicted(seen_, object, scene_.uncertainty_of(index_));
  }
  /// True if the cloth rests on the object and no level cloth is left unsupported.
  [[nodiscard]] bool touches(const Obstacle& object) const {
    Scene other = scene_;
    other.obstacles[index_] = object;
    const auto above = untouched(seen_, other);
    return (!above || above->object != index_) && (!is_held_up_ || !floating(seen_, other));
  }

  /// Best position from a start: attracts marks from decreasing distances, then keeps them out.
  [[nodiscard]] Obstacle fitted(Obstacle object, const std::vector<int>& free) const {
    for (const double reach_m : {8 * mm, 4 * mm, 2 * mm, 1 * mm}) {
      const auto at = [&](const Change& change) {
        return cost(seen_, changed(object, change), reach_m);
      };
      object = changed(object, least(at, free, 0));
    }
    const auto at = [&](const Change& change) { return chi2(changed(object, change)); };
    return changed(object, least(at, free, 0.5 * limit_));
  }

  /// Samples changes of `object` that fit, by hit-and-run: a random direction, then a random point
  /// on the chord; each point found outside shortens the chord.
  [[nodiscard]] std::vector<Change> range_around(const Obstacle& object,
                                                 const std::vector<int>& free) const {
    constexpr int kWalk = 150;
    constexpr double kChord = 20;  // half a chord's length, mm or deg
    std::vector<Change> range = {Change::Zero()};
    SplitMix64 random(1);
    Change at = Change::Zero();
    for (int step = 0; step < kWalk; ++step) {
      Change along = Change::Zero();
      for (const int k : free) along[k] = 2 * random.uniform() - 1;
      along.normalize();
      double low = -kChord, high = kChord;
      for (int k = 0; k < 30; ++k) {
        const double to = low + (high - low) * random.uniform();
        if (fits(changed(object, at + to * along))) {
          at += to * along;
          break;
        }
        (to < 0 ? low : high) = to;
      }
      range.push_back(at);
    }
    return range;
  }

 private:
  [[nodiscard]] double chi2(const Obstacle& object) const {
    Change smaller = Change::Zero();
    smaller[4] = -2 * scene_.uncertainty_of(index_).size_m() / mm;
    return against(seen_, changed(object, smaller)).chi2;
  }

  const SeenCloth& seen_;
  const Scene& scene_;
  std::size_t index_;
  double limit_;
  bool is_held_up_;  ///< true if supported in the stated scene, so any other must support it too
};

/// Set of objects that fit: mean with twice the standard deviation, and total range.
struct Range {
  Stated middle;
  Change within;  ///< k = 2
  Stated centre;
  Change reach;  ///< half the range around its centre

  /// Distance of an object's values from the centre; its rotation modulo the box's symmetry.
  [[nodiscard]] Change apart(const Stated& one) const {
    const bool is_square = std::abs(centre.size_mm.x() - centre.size_mm.y()) < 0.5;
    const Vector3d by_mm = (one.foot_mm - centre.foot_mm).cwiseAbs();
    const double turn =
        centre.is_box ? std::abs(std::remainder(one.yaw_deg - centre.yaw_deg, is_square ? 90 : 180))
                      : 0;
    return (Change() << by_mm, turn, std::abs(one.size_mm.x() - centre.size_mm.x())).finished();
  }
  [[nodiscard]] bool holds(const Stated& one) const {
    constexpr double kSame = 1;  // same object within this, mm or deg
    return (apart(one) - reach).maxCoeff() <= kSame;
  }
  /// True if both are parts of one range that the walks have not fully covered.
  [[nodiscard]] bool meets(const Range& other) const {
    return (apart(other.centre) - reach - other.reach).maxCoeff() <= 0;
  }
  void join(const Range& other) {
    const Change by = apart(other.centre);
    within = within.cwiseMax(other.within + by);
    reach = reach.cwiseMax(other.reach + by);
  }
};

/// Separate ranges in which fits from many starts end.
std::vector<Range> ranges_of(const Search& search, const SeenCloth& seen, const Obstacle& object,
                             const Stated& stated, const std::vector<int>& free,
                             const std::vector<Slip>& slips) {
  std::vector<Range> ranges;
  std::vector<Stated> starts = {stated};
  for (const Slip& slip : slips) starts.push_back(slip.values);
  Stated below = stated;
  below.foot_mm.head<2>() = middle_of_top(seen.sheet) / mm;
  starts.push_back(below);
  if (stated.is_box) {
    for (const double turn : {22.5, 45.0, 67.5, 90.0, 112.5, 135.0, 157.5}) {
      if (turn > 80 && std::abs(stated.size_mm.x() - stated.size_mm.y()) < 0.5) break;
      starts.push_back(below);
      starts.back().yaw_deg = std::remainder(stated.yaw_deg + turn, 180);
    }
  }
  for (const Stated& start : starts) {
    const Obstacle found = search.fitted(typed(object, start), free);
    if (!search.fits(found)) continue;
    const Stated at = *stated_of(found);
    if (std::any_of(ranges.begin(), ranges.end(), [&](const Range& one) { return one.holds(at); }))
      continue;
    const std::vector<Change> changes = search.range_around(found, free);
    Change least_change = changes.front(), most_change = changes.front(), mean = Change::Zero(),
           squares = Change::Zero();
    const auto count = static_cast<double>(changes.size());
    for (const Change& change : changes) {
      least_change = least_change.cwiseMin(change);
      most_change = most_change.cwiseMax(change);
      mean += change / count;
    }
    for (const Change& change : changes) squares += (change - mean).cwiseAbs2() / count;
    Range range{*stated_of(changed(found, mean)), 2 * squares.cwiseSqrt(),
                *stated_of(changed(found, 0.5 * (least_change + most_change))),
                0.5 * (most_change - least_change)};
    const auto same = std::find_if(ranges.begin(), ranges.end(),
                                   [&](const Range& one) { return one.meets(range); });
    if (same == ranges.end())
      ranges.push_back(range);
    else
      same->join(range);
  }
  // If the stated size fits, another size would be a second mistake.
  const auto as_stated = [&](const Range& one) {
    return one.centre.size_mm.isApprox(stated.size_mm, 1e-6);
  };
  if (std::any_of(ranges.begin(), ranges.end(), as_stated))
    std::erase_if(ranges, [&](const Range& one) { return !as_stated(one); });
  return ranges;
}

/// Expected number of typing errors within the range by chance: two are possible for the rotation,
/// eleven for position and size.
double chance_of(const Slip& slip, const Stated& stated, const Range& range) {
  constexpr double kTurns = 2, kPlaces = 11;
  double chance = 1;
  const auto moved = [&](double by, double within) {
    if (std::abs(by) > 1e-9) chance *= std::min(1.0, within / std::abs(by));
  };
  const Vector3d by_mm = slip.values.foot_mm - stated.foot_mm;
  moved(by_mm.x(), range.within[0]);
  moved(by_mm.y(), range.within[1]);
  moved(by_mm.z(), std::max(1.0, range.within[2]));
  moved(slip.values.size_mm.x() - stated.size_mm.x(), std::max(1.0, range.within[4]));
  const bool is_turn = chance == 1;
  moved(std::remainder(slip.values.yaw_deg - stated.yaw_deg, 180), range.within[3]);
  return chance * (is_turn ? kTurns : kPlaces);
}

/// Distance between adjacent marks along the cloth.
double pitch_mm(const Sheet& sheet) {
  for (const SheetMark& mark : sheet.marks)
    if (const SheetMark* next = sheet.find(mark.mark + MarkId{0, 1}))
      return (next->material_m - mark.material_m).norm() / mm;
  return sheet.patch_m.maxCoeff() / mm;
}

constexpr double kResolution = 0.5;  ///< mm or degrees; resolution of an operator's reading

/// A possible error of the operator: returns the object as it would be stated.
struct Mistake {
  const char* text;
  std::function<Obstacle(double)> stated;
};

/// Determines the detection limits of one object of a scene.
struct Guard {
  const SeenCloth& seen;
  const Scene& scene;
  std::size_t object;

  [[nodiscard]] bool names(const Obstacle& stated) const {
    if (is_contradicted(seen, stated, scene.uncertainty_of(object))) return true;
    Scene other = scene;
    other.obstacles[object] = stated;
    return untouched(seen, other).has_value() ||
           (floating(seen, other).has_value() && !floating(seen, scene).has_value());
  }

  /// Smallest error from which on the object is contradicted; nullopt if none is up to
  /// `most`.
  [[nodiscard]] std::optional<double> limit(const Mistake& mistake, double most) const {
    if (!names(mistake.stated(most))) return std::nullopt;
    double below = 0, named = most;
    while (named - below > kResolution) {
      const double middle = 0.5 * (below + named);
      (names(mistake.stated(middle)) ? named : below) = middle;
    }
    return named;
  }

  [[nodiscard]] std::string text(const std::vector<Mistake>& mistakes, double most,
                                 const char* what, const char* unit) const {
    double worst = 0;
    const char* where = mistakes.front().text;
    for (const Mistake& mistake : mistakes) {
      const auto found = limit(mistake, most);
      if (!found)
        return fmt::format("no {} {} up to {:.0f} {} would be seen", what, mistake.text, most,
                           unit);
      if (*found <= worst) continue;
      worst = *found;
      where = mistake.text;
    }
    return fmt::format("an {} below {:.1f} {} ({}) would not be seen", what, worst, unit, where);
  }
};

Mistake along(const Obstacle& object, const char* text, int parameter, double sign) {
  return {text, [=](double error) {
            Change change = Change::Zero();
            change[parameter] = sign * error;
            return changed(object, change);
          }};
}

Mistake wider(const Box& box, const char* text, int axis) {
  return {text, [=](double error_mm) {
            Box other = box;
            other.size_m[axis] += error_mm * mm;
            return Obstacle(other);
          }};
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

std::string suggestion_text(const SeenCloth& seen, const Scene& scene, std::size_t object) {
  const ObjectSuggestion found = suggested_object(seen, scene, object);
  return found.one ? "the marks speak for " + found.one->text : found.why_not;
}

}  // namespace

std::vector<ClothSpan> spans_of(const Sheet& sheet, double most_strain) {
  std::vector<ClothSpan> spans;
  for (const SheetMark& mark : sheet.marks) {
    for (const MarkId next :
         {MarkId{mark.mark.row + 1, mark.mark.col}, MarkId{mark.mark.row, mark.mark.col + 1}}) {
      const SheetMark* to = sheet.find(next);
      if (to == nullptr) continue;
      spans.push_back({&mark, to, (to->material_m - mark.material_m).norm() * (1 + most_strain),
                       std::hypot(sigma_m(mark), sigma_m(*to))});
    }
  }
  return spans;
}

double taut_path_m(const Obstacle& object, const Vector3d& from, const Vector3d& to) {
  return std::visit(Taut{from, to}, object);
}

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

double SeenCloth::gap_m(const Scene& scene, std::size_t object, std::size_t mark) const {
  return std::holds_alternative<MeshObject>(scene.obstacles[object])
             ? mesh_gaps_m.at(object).at(mark)
             : distance_to(scene.obstacles[object], sheet.marks[mark].point_in_world).value();
}

std::vector<double> gaps_to_mesh(const Sheet& sheet, const MeshObject& object, int threads) {
  const ClosedMesh mesh = ClosedMesh::read(object.file);
  const auto mesh_from_world = object.world_from_mesh.inverse();
  std::vector<double> gaps(sheet.marks.size());
  parallel_for(gaps.size(), threads, [&](std::size_t i) {
    gaps[i] = mesh.distance(mesh_from_world * sheet.marks[i].point_in_world).gap_m;
  });
  return gaps;
}

ObjectSuggestion suggested_object(const SeenCloth& seen, const Scene& scene, std::size_t object) {
  const Obstacle& own = scene.obstacles[object];
  const auto stated = stated_of(own);
  if (!stated || seen.sheet.marks.empty()) return {{}, "measure it again"};
  const Search search(seen, scene, object);
  const bool on_table = std::abs(stated->foot_mm.z() * mm - scene.table_z_m) <
                        kObjectSigmas * scene.table_uncertainty_m();
  constexpr int kHeight = 2, kTurn = 3, kSize = 4;
  const auto place = [&](std::initializer_list<int> more) {
    std::vector<int> free = {0, 1};
    free.insert(free.end(), more);
    if (!on_table) free.push_back(kHeight);
    if (stated->is_box) free.push_back(kTurn);
    return free;
  };
  std::vector<Slip> slips;
  for (const Slip& slip : slips_of(*stated, scene.table_z_m / mm)) {
    if (slip.values.size_mm.head(stated->is_box ? 3 : 1).minCoeff() < 5) continue;
    if (!search.passes(typed(own, slip.values))) continue;
    const bool known = std::any_of(slips.begin(), slips.end(), [&](const Slip& other) {
      return Range{{}, {}, other.values, Change::Zero()}.holds(slip.values);
    });
    if (!known) slips.push_back(slip);
  }
  std::vector<Range> ranges = ranges_of(search, seen, own, *stated, place({}), slips);
  if (ranges.empty()) {
    ranges = ranges_of(search, seen, own, *stated, place({kSize}), slips);
    // The stated size of objects on the table may be right if both are at another height.
    if (on_table && !ranges.empty())
      for (const Range& other : ranges_of(search, seen, own, *stated, place({kHeight}), {})) {
        const double by_mm = other.middle.foot_mm.z() - stated->foot_mm.z();
        if (below_table(seen.sheet, scene, scene.table_z_m + by_mm * mm) != nullptr) continue;
        return {{},
                fmt::format("{}, or table_z_mm and z_bottom_mm both by {:+.1f}, would agree alike, "
                            "so none is suggested; measure both again (in mm)",
                            text_of(*stated, ranges.front().middle, ranges.front().within), by_mm)};
      }
  }
  const auto given = [&](const Stated& values, const Change& within, const char* what) {
    std::string text = text_of(*stated, values, within);
    if (*what != 0) text += fmt::format(" ({})", what);
    return ObjectSuggestion{SuggestedObject{typed(own, values), text, within}, ""};
  };
  // Half the distance between marks, as a length and as an angle at the object's rim.
  const double told_mm = 0.5 * pitch_mm(seen.sheet);
  const double told_deg = told_mm / std::max(1.0, 0.5 * stated->size_mm.head<2>().maxCoeff()) / deg;
  const auto is_told = [&](const Range& range) {
    return range.within.head<3>().maxCoeff() <= told_mm && range.within[3] <= told_deg &&
           range.within[4] <= told_mm;
  };
  if (slips.size() == 1) {
    const Slip& slip = slips.front();
    for (const Range& range : ranges)
      if (range.holds(slip.values) && is_told(range) && chance_of(slip, *stated, range) < 0.5) {
        Change within = range.within;
        within.head<3>() += (slip.values.foot_mm - range.middle.foot_mm).cwiseAbs();
        if (stated->is_box)
          within[3] += std::abs(std::remainder(slip.values.yaw_deg - range.middle.yaw_deg, 90));
        return given(slip.values, within, slip.what);
      }
  }
  if (ranges.size() == 1 && !is_told(ranges.front()))
    return {{},
            fmt::format("the cloth leaves a range of {}, too wide to suggest a value; measure it "
                        "again (in mm), or with a plate of tags (drape object)",
                        text_of(*stated, ranges.front().middle, ranges.front().within))};
  if (ranges.size() == 1) {
    Stated values = ranges.front().middle;
    values.foot_mm = values.foot_mm.unaryExpr(&printed);
    values.yaw_deg = printed(values.yaw_deg);
    values.size_mm = values.size_mm.unaryExpr(&printed);
    if (ranges.front().within[4] == 0) values.size_mm = stated->size_mm;
    if (on_table) values.foot_mm.z() = stated->foot_mm.z();
    if (search.passes(typed(own, values)))
      return given(values, ranges.front().within, "a fit to the cloth: measure the object again");
  }
  if (ranges.size() > 1) {
    std::string all;
    for (const Range& range : ranges)
      all += (all.empty() ? "" : "; or ") + text_of(*stated, range.middle, range.within);
    return {{},
            all +
                " would agree alike, so none is suggested; measure it again (in mm), or with a "
                "plate of tags (drape object)"};
  }
  return {{}, "measure it again (in mm), or look whether the scene is that of another drape"};
}

namespace {

/// Kinds of another body of the same height in an object's place that the guard does not name: a
/// ball, an upright cylinder as wide as high, a cube of any turn.
std::vector<const char*> unseen_kinds(const Guard& guard, const Stated& stated) {
  const Obstacle& own = guard.scene.obstacles[guard.object];
  const auto* body = std::get_if<Cylinder>(&own);
  const double half_m =
      body != nullptr ? half_height_m(*body) : 0.5 * stated.size_mm[stated.is_box ? 2 : 0] * mm;
  const Vector3d centre = stated.foot_mm * mm + Vector3d(0, 0, half_m);
  Cylinder round{{}, half_m, 2 * half_m, 0};
  Box cube;
  round.world_from_cylinder.translation_m = cube.world_from_box.translation_m = centre;
  cube.size_m = Vector3d::Constant(2 * half_m);
  std::vector<const char*> kinds;
  if (!std::holds_alternative<Sphere>(own) && !guard.names(Sphere{centre, half_m}))
    kinds.push_back("ball");
  if (body == nullptr && !guard.names(round)) kinds.push_back("cylinder");
  for (int turn_deg = 0; turn_deg < 90 && !stated.is_box; turn_deg += 10)
    if (!guard.names(turned(cube, turn_deg * deg))) {
      kinds.push_back("cube");
      break;
    }
  return kinds;
}

}  // namespace

std::vector<Unseen> detection_limits(const SeenCloth& seen, const Scene& scene) {
  std::vector<Unseen> unseen;
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
    const Obstacle& object = scene.obstacles[i];
    if (std::holds_alternative<MeshObject>(object)) {
      double most_m = 0;
      for (const SheetMark& mark : seen.sheet.marks)
        most_m = std::max(most_m, most_inside_m(scene.uncertainty_of(i), mark));
      unseen.push_back({fmt::format("object {}", i + 1),
                        fmt::format("a mesh: what leaves some mark on it and none deeper inside "
                                    "than {:.1f} mm would not be seen; a plate of tags measures "
                                    "its place and turn (drape object)",
                                    most_m / mm)});
      continue;
    }
    const auto stated = stated_of(object);
    if (!stated) continue;
    const double half_mm =
        0.5 * (stated->is_box ? stated->size_mm.head<2>().minCoeff() : stated->size_mm.x());
    const Guard guard{seen, scene, i};
    const auto one = [&](const char* text, int parameter, double sign) {
      return along(object, text, parameter, sign);
    };
    std::string text = guard.text({one("towards +x", 0, 1), one("towards -x", 0, -1),
                                   one("towards +y", 1, 1), one("towards -y", 1, -1)},
                                  half_mm, "error of its place", "mm") +
                       "; " +
                       guard.text({one("too high", 2, 1), one("too low", 2, -1)}, half_mm,
                                  "error of its top's height", "mm");
    if (!stated->is_box)
      text += "; " + guard.text({one("too large", 4, 1), one("too small", 4, -1)}, half_mm,
                                "error of its diameter", "mm");
    if (const auto* box = std::get_if<Box>(&object))
      text += "; " +
              guard.text({one("towards +yaw", 3, 1), one("towards -yaw", 3, -1)}, 45,
                         "error of its turn", "degrees") +
              "; " +
              guard.text({wider(*box, "too large along x", 0), wider(*box, "too large along y", 1)},
                         half_mm, "error of its width", "mm") +
              "; a width stated too small would not be seen, for cloth need not touch the sides";
    for (const char* other : unseen_kinds(guard, *stated))
      text += fmt::format("; a {} as high in its place would not be seen", other);
    unseen.push_back(
        {fmt::format("object {}", i + 1), text + "; a plate of tags measures it (drape object)"});
  }
  return unseen;
}

std::vector<std::string> contradictions_of_objects(const SeenCloth& seen, const Scene& scene) {
  std::vector<std::string> found;
  const std::string file = scene.file.string();
  const Sheet& sheet = seen.sheet;
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
        chi2_limit(object), most_lowered_m(object, stated) / mm, suggestion_text(seen, scene, i)));
  }
  if (const auto above = untouched(seen, scene)) {
    found.push_back(fmt::format(
        "{}, object {}: no mark touches it, the nearest lies {:.2f} mm above, and cloth that "
        "rests on it at most {:.2f} mm; {}",
        file, above->object + 1, above->nearest_m / mm, above->allowed_m / mm,
        suggestion_text(seen, scene, above->object)));
  }
  if (const SheetMark* lowest = below_table(sheet, scene, scene.table_z_m))
    found.push_back(fmt::format(
        "{}: table_z_mm = {:g}, but mark ({}, {}) lies {:.2f} mm below it; the table is at {:.1f} "
        "or lower",
        file, scene.table_z_m / mm, lowest->mark.row, lowest->mark.col,
        (scene.table_z_m - lowest->point_in_world.z()) / mm, lowest->point_in_world.z() / mm));
  return found;
}

std::vector<std::string> contradictions_of_support(const SeenCloth& seen, const Scene& scene) {
  const auto block = floating(seen, scene);
  if (!block) return {};
  Scene other = scene;
  other.table_z_m = std::round(block->z_m / (0.1 * mm)) * 0.1 * mm;
  const bool is_table =
      below_table(seen.sheet, scene, other.table_z_m) == nullptr && !floating(seen, other);
  const auto [row, col] = block->first;
  return {fmt::format(
      "{}, {}: the marks ({}, {}) to ({}, {}) lie level to {:.2f} mm at z = {:.1f} mm, as cloth "
      "does on a support alone, and table and objects as stated lie {:.1f} mm too low for that; {}",
      scene.file.string(),
      is_table ? fmt::format("table_z_mm = {:g}", scene.table_z_m / mm) : "object", row, col,
      row + 2, col + 2, block->range_m / mm, block->z_m / mm, block->spare_m / mm,
      is_table ? fmt::format("the marks speak for table_z_mm = {:.1f}", other.table_z_m / mm)
               : "measure the heights again, or add the object that is missing")};
}

}  // namespace drape::triangulate
