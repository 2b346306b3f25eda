// SPDX-License-Identifier: Apache-2.0
#include "triangulate/plate/object_pose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "core/error.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape::triangulate {
namespace {

using Eigen::Vector3d;
using units::deg;
using units::mm;

constexpr double kPoseSigmas = 3;

/// The point at `offset_m` in the plate's frame, with its covariance.
struct PointOnPlate {
  Vector3d in_world;
  Eigen::Matrix3d covariance_m2;
};

PointOnPlate point_at(const PlatePose& plate, const Vector3d& offset_m) {
  const Vector3d turned = plate.world_from_plate.rotation * offset_m;
  Eigen::Matrix<double, 3, 6> by_pose;
  by_pose << Eigen::Matrix3d::Identity(), -cross_matrix(turned);
  return {plate.world_from_plate.translation_m + turned,
          by_pose * plate.covariance * by_pose.transpose()};
}

std::vector<ObjectValue> place_values(const PointOnPlate& foot, const Vector3d& stated_m,
                                      double placing_mm, double stated_mm) {
  std::vector<ObjectValue> values;
  const char* keys[] = {"x_mm", "y_mm", "z_bottom_mm"};
  values.reserve(3);
  for (int k = 0; k < 3; ++k)
    values.push_back({keys[k], foot.in_world[k] / mm,
                      std::hypot(std::sqrt(foot.covariance_m2(k, k)) / mm, placing_mm),
                      stated_m[k] / mm, stated_mm});
  return values;
}

/// Requires twice the uncertainty below half of the object: else the plate contradicts nothing.
void check_placing(const PlateOnObject& lies, double width_m) {
  if (lies.placing_mm * mm < 0.25 * width_m) return;
  throw bad_input(fmt::format("a plate laid on within {:g} mm says nothing of an object {:g} mm "
                              "wide",
                              lies.placing_mm, width_m / mm),
                  {.field = "--placing-mm"}, "give one standard deviation in mm");
}

double yaw_of(const Eigen::Matrix3d& turn) {
  return std::atan2(turn(1, 0), turn(0, 0));
}

}  // namespace

void fields(Fields& f, PlateOnObject& p) {
  f.otherwise({"thickness_mm", "thickness of the sheet on a box, mm", 1, 0}, p.thickness_mm);
  f.otherwise({"hole_mm", "diameter of the hole that carries a sphere, mm", 1, 0}, p.hole_mm);
  f.otherwise({"placing_mm", "standard uncertainty of placing the plate, mm", 1, 1e-3},
              p.placing_mm);
}

void fields(Fields& f, ObjectValue& v) {
  f({"key", "key of the scene: x_mm, y_mm, z_bottom_mm or yaw_deg"}, v.key);
  f({"measured", "value measured with the plate, in the key's unit"}, v.measured);
  f({"standard_uncertainty", "standard uncertainty, including that of placing the plate", 1, 0},
    v.uncertainty);
  f({"stated", "value in the scene"}, v.stated);
  f({"stated_standard_uncertainty", "standard uncertainty in the scene", 1, 0},
    v.stated_uncertainty);
  bool contradicts = v.contradicts();
  f({"contradicts", "true if the difference exceeds three of its standard uncertainties"},
    contradicts);
}

void fields(Fields& f, MeasuredObject& o) {
  f({"values", "position and yaw of the object"}, o.values);
  f({"contradictions", "one sentence per NO-GO it is based on and per contradicting value"},
    o.contradictions);
  f({"dots", "number of dots of the plate seen", 1, 4}, o.dots);
  f({"rms_px", "root mean square residual", 1, 0}, o.rms_px);
  f({"chi2_per_dof", "chi-square per degree of freedom, from the dots' covariance", 1, 0},
    o.chi2_per_dof);
}

bool ObjectValue::contradicts() const {
  return std::abs(measured - stated) > kPoseSigmas * std::hypot(uncertainty, stated_uncertainty);
}

std::vector<ObjectValue> object_values(const PlatePose& plate, const PlateOnObject& lies,
                                       const Obstacle& object, const ObjectUncertainty& stated) {
  const double place_mm = stated.place_m() / mm;
  if (const auto* ball = std::get_if<Sphere>(&object)) {
    check_placing(lies, 2 * ball->radius_m);
    const double hole_m = 0.5 * lies.hole_mm * mm;
    if (!(hole_m > 0 && hole_m < ball->radius_m))
      throw bad_input(fmt::format("a sphere of {:g} mm does not rest in a hole of {:g} mm",
                                  2 * ball->radius_m / mm, lies.hole_mm),
                      {.field = "--hole-mm"}, "give the diameter of the hole in the stand");
    const double above_m = std::sqrt(ball->radius_m * ball->radius_m - hole_m * hole_m);
    PointOnPlate foot = point_at(plate, Vector3d(0, 0, above_m));
    foot.in_world.z() -= ball->radius_m;
    return place_values(foot, ball->centre_in_world - Vector3d(0, 0, ball->radius_m),
                        lies.placing_mm, place_mm);
  }
  const auto* box = std::get_if<Box>(&object);
  if (box == nullptr)
    throw bad_input("a plate gives the place of a box or a sphere only", {},
                    "measure other objects by hand");
  check_placing(lies, box->size_m.head<2>().minCoeff());
  const double height_m = box->size_m.z();
  const PointOnPlate foot = point_at(plate, Vector3d(0, 0, -lies.thickness_mm * mm - height_m));
  const Vector3d down(0, 0, 0.5 * height_m);
  std::vector<ObjectValue> values =
      place_values(foot, box->world_from_box.translation_m - down, lies.placing_mm, place_mm);
  values.back().uncertainty = std::hypot(values.back().uncertainty, stated.size_m() / mm);
  // A square top looks the same after a quarter turn, any other after half a turn.
  const bool square = std::abs(box->size_m.x() - box->size_m.y()) < 1e-6;
  const double alike = (square ? 0.5 : 1) * std::numbers::pi;
  const double stated_rad = yaw_of(box->world_from_box.rotation);
  const double found_rad = yaw_of(plate.world_from_plate.rotation);
  const double yaw_rad = found_rad - alike * std::round((found_rad - stated_rad) / alike);
  // Placing and measuring have errors at both ends of an edge.
  const double ends = std::sqrt(2.0) / box->size_m.x();
  values.push_back(
      {"yaw_deg", yaw_rad / deg,
       std::hypot(std::sqrt(plate.covariance(5, 5)), ends * lies.placing_mm * mm) / deg,
       stated_rad / deg, ends * stated.place_m() / deg});
  return values;
}

double place_uncertainty_mm(const std::vector<ObjectValue>& values) {
  return std::max(values.at(0).uncertainty, values.at(1).uncertainty);
}

std::optional<std::string> why_not_edge_on_edge(const MarkLattice& lattice,
                                                const PlateOnObject& lies, const Obstacle& object,
                                                const ObjectUncertainty& stated) {
  const auto* box = std::get_if<Box>(&object);
  if (box == nullptr) return std::nullopt;
  const Vector3d sheet_m(lattice.cols * lattice.pitch_m, lattice.rows * lattice.pitch_m, 0);
  const double sd_m = std::hypot(std::sqrt(2.0) * lies.placing_mm * mm, stated.size_m());
  if (((sheet_m - box->size_m).head<2>().array().abs() <= kPoseSigmas * sd_m).all())
    return std::nullopt;
  return fmt::format(
      "a plate of {:g} x {:g} mm does not lie edge on edge on a top of {:g} x {:g} mm; print one "
      "of "
      "its size or correct size_mm",
      sheet_m.x() / mm, sheet_m.y() / mm, box->size_m.x() / mm, box->size_m.y() / mm);
}

Tilt tilt_of(const PlatePose& plate) {
  const Vector3d normal = plate.world_from_plate.rotation.col(2);
  return {std::atan2(normal.head<2>().norm(), normal.z()),
          std::sqrt(plate.covariance.block<2, 2>(3, 3).trace())};
}

}  // namespace drape::triangulate
