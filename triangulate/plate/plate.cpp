// SPDX-License-Identifier: Apache-2.0
#include "triangulate/plate/plate.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <sstream>

#include "core/camera_model.hpp"
#include "core/files/files.hpp"
#include "core/geometry/rigid_motion.hpp"
#include "core/geometry/vectors.hpp"

namespace drape::triangulate {

namespace fs = std::filesystem;
using Eigen::Matrix3d, Eigen::MatrixXd, Eigen::Vector2d, Eigen::Vector3d;
using units::deg;
using units::mm;

namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr Eigen::Index kLeastDots = 4;
constexpr int kPoseSteps = 50;
constexpr double kStill = 1e-12;  // converged, m and rad

Vector3d in_plate(const MarkLattice& lattice, MarkId mark) {
  return lattice.pitch_m *
         Vector3d(mark.col - 0.5 * (lattice.cols - 1), mark.row - 0.5 * (lattice.rows - 1), 0);
}

WorldFromObject start_of(const std::vector<MarkViews>& marks, const MarkLattice& lattice) {
  constexpr double kLeastAngle = 2 * units::deg;
  Eigen::Matrix3Xd from(3, marks.size()), to(3, marks.size());
  Eigen::Index count = 0;
  for (const MarkViews& mark : marks) {
    const auto at = midpoint(mark.views, kLeastAngle);
    if (!at) continue;
    from.col(count) = in_plate(lattice, mark.mark);
    to.col(count++) = *at;
  }
  const auto pose =
      pose_from_points<frame::World, frame::Object>(from.leftCols(count), to.leftCols(count));
  if (count < kLeastDots || !pose)
    throw bad_input(fmt::format("{} dots of the plate are seen by two cameras, {} are needed",
                                count, kLeastDots),
                    {}, "show the plate to two cameras at once");
  return *pose;
}

/// Normal equations over all views; derivative of the right-hand side by the cameras' parameters.
struct Normal {
  Matrix6 matrix = Matrix6::Zero();
  Vector6 right = Vector6::Zero();
  MatrixXd by_cameras;  ///< 6 x number of parameters
  double chi2 = 0, squares_px2 = 0;
  int views = 0;
};

/// Columns of each camera's parameters in the joint covariance.
struct CameraColumns {
  MatrixXd covariance = MatrixXd(0, 0);
  std::map<const CalibratedCamera*, std::vector<Eigen::Index>> places;
};

CameraColumns columns_of(const std::vector<MarkViews>& marks) {
  CameraColumns all;
  for (const MarkViews& mark : marks) {
    for (const View& view : mark.views) {
      if (all.places.count(view.camera) != 0) continue;
      std::vector<Eigen::Index>& places = all.places[view.camera];
      if (view.joint != nullptr) {
        places = view.joint->places;
        all.covariance = *view.joint->covariance;
        continue;
      }
      const MatrixXd& own = view.camera->covariance;
      const Eigen::Index at = all.covariance.rows();
      MatrixXd larger = MatrixXd::Zero(at + own.rows(), at + own.rows());
      larger.topLeftCorner(at, at) = all.covariance;
      larger.bottomRightCorner(own.rows(), own.rows()) = own;
      all.covariance = larger;
      for (Eigen::Index k = 0; k < own.rows(); ++k) places.push_back(at + k);
    }
  }
  return all;
}

Normal normal_of(const std::vector<MarkViews>& marks, const MarkLattice& lattice,
                 const WorldFromObject& pose, const CameraColumns& cameras) {
  Normal normal;
  normal.by_cameras = MatrixXd::Zero(6, cameras.covariance.rows());
  for (const MarkViews& mark : marks) {
    const Vector3d from_origin = pose.rotation * in_plate(lattice, mark.mark);
    const Vector3d at = pose.translation_m + from_origin;
    for (const View& view : mark.views) {
      const Camera& camera = view.camera->camera;
      const Matrix3d& turn = camera.cam_from_world.rotation;
      const Vector3d in_camera = camera.cam_from_world * at;
      const auto image = project(camera.model, in_camera);
      const auto seen =
          dot_centroid_px(camera.model, {in_camera, turn * pose.rotation.col(0),
                                         turn * pose.rotation.col(1), lattice.dot_diameter_m / 2});
      if (!image || !seen) continue;
      Eigen::Matrix<double, 2, 6> jacobian;
      jacobian.leftCols<3>() = image->d_px_d_point * turn;
      jacobian.rightCols<3>() = -jacobian.leftCols<3>() * cross_matrix(from_origin);
      const Eigen::Matrix2d weight = view.covariance_px2.inverse();
      const Vector2d residual = view.px - *seen;
      normal.matrix += jacobian.transpose() * weight * jacobian;
      normal.right += jacobian.transpose() * weight * residual;
      normal.chi2 += residual.dot(weight * residual);
      normal.squares_px2 += residual.squaredNorm();
      ++normal.views;
      const auto by_parameters = d_px_d_parameters(camera, at);
      const std::vector<Eigen::Index>& places = cameras.places.at(view.camera);
      if (!by_parameters) continue;
      for (std::size_t k = 0; k < places.size(); ++k) {
        if (places[k] < 0 || static_cast<Eigen::Index>(k) >= by_parameters->cols()) continue;
        normal.by_cameras.col(places[k]) +=
            jacobian.transpose() * weight * by_parameters->col(static_cast<Eigen::Index>(k));
      }
    }
  }
  return normal;
}

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

/// Requires twice the uncertainty below half of the object; else the plate contradicts nothing.
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

constexpr std::string_view kMadeBy = "# Made by `drape object` from ";

/// Key of a line: "x_mm" of "x_mm = -3.0  # centre"; empty if there is none.
std::string key_of(const std::string& line) {
  const std::size_t equals = line.find('=');
  const std::size_t begin = line.find_first_not_of(" \t");
  if (equals == std::string::npos || begin == equals || line[begin] == '#') return {};
  const std::size_t end = line.find_last_not_of(" \t", equals - 1);
  return line.substr(begin, end + 1 - begin);
}

std::string table_of(const std::string& line) {
  const std::size_t begin = line.find_first_not_of(" \t");
  return begin != std::string::npos && line[begin] == '[' ? line.substr(begin) : std::string();
}

/// Rewrites `key = "text"`, a file relative to `scene`, as relative to `folder`.
std::string file_line(const std::string& key, const std::string& line, const fs::path& scene,
                      const fs::path& folder) {
  const std::size_t begin = line.find_first_of("\"'"), end = line.find_last_of("\"'");
  if (begin == std::string::npos || end <= begin + 1)
    throw bad_input("the name of a file is not in quotes on one line",
                    {.file = scene.string(), .field = key}, "write it on a line of its own");
  const fs::path file =
      (scene.parent_path() / line.substr(begin + 1, end - begin - 1)).lexically_normal();
  return fmt::format("{} = {}", key, one_line(Value(fs::proximate(file, folder).generic_string())));
}

}  // namespace

PlatePose plate_pose(const std::vector<MarkViews>& marks, const MarkLattice& lattice) {
  PlatePose result;
  WorldFromObject& pose = result.world_from_plate;
  pose = start_of(marks, lattice);
  const CameraColumns cameras = columns_of(marks);
  Normal normal;
  double step_size = 1;
  for (int step = 0; step < kPoseSteps && step_size > kStill; ++step) {
    normal = normal_of(marks, lattice, pose, cameras);
    const Vector6 by = normal.matrix.ldlt().solve(normal.right);
    pose.translation_m += by.head<3>();
    pose.rotation = rotation_about(by.tail<3>()) * pose.rotation;
    step_size = by.norm();
  }
  if (!(step_size < 1e-9))
    throw bad_input("the pose of the plate does not converge", {},
                    "look at the detections: is the plate the one that is described?");
  const Matrix6 inverse = normal.matrix.inverse();
  const Eigen::Matrix<double, 6, Eigen::Dynamic> by_cameras = inverse * normal.by_cameras;
  for (const MarkViews& mark : marks) result.dots += mark.views.empty() ? 0 : 1;
  result.views = normal.views;
  result.rms_px = std::sqrt(normal.squares_px2 / normal.views);
  result.chi2_per_dof = normal.chi2 / (2 * normal.views - 6);
  // A plate is flat with many dots, so their actual scatter is estimated, not assumed (Birge 1932).
  result.covariance =
      result.chi2_per_dof * inverse + by_cameras * cameras.covariance * by_cameras.transpose();
  return result;
}

PlatePose plate_pose(const Detections& detections, const Calibration& calibration,
                     const std::string& set, double floor_px) {
  if (detections.lattice.surface != Surface::target)
    throw bad_input("the detections show a cloth, not a plate", {.set = set},
                    "detect the set with --surface target and the plate's description");
  const JointPlaces places = joint_places(calibration);
  return plate_pose(collect_views(detections, calibration, places, set, floor_px),
                    detections.lattice);
}

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
       stated_rad / deg, turn_rad(object, stated).value_or(0) / deg});
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

std::string measured_scene(const fs::path& scene, std::size_t object,
                           const std::vector<ObjectValue>& values, const fs::path& folder) {
  std::map<std::string, std::string> wanted;
  for (const ObjectValue& value : values) wanted[value.key] = fmt::format("{:.6f}", value.measured);
  wanted["place_uncertainty_mm"] = fmt::format("{:.6f}", place_uncertainty_mm(values));
  std::string text = fmt::format("{}{}: object {} stands where its plate of tags shows it.\n",
                                 kMadeBy, scene.filename().string(), object);
  std::size_t number = 0;
  bool here = false;
  std::istringstream lines(read_text(scene));
  for (std::string line; std::getline(lines, line);) {
    if (const std::string table = table_of(line); !table.empty()) {
      const bool starts = table.starts_with("[[object]]");
      number += starts;
      here = starts && number == object;
      text += line + "\n";
      if (here)
        for (const auto& [key, value] : wanted) text += fmt::format("{} = {}\n", key, value);
      continue;
    }
    const std::string key = key_of(line);
    if (here && (key.starts_with("tags_") || wanted.count(key) != 0)) continue;
    if (key == "fabric" || key == "print" || key == "file" || key == "tags_target") {
      text += file_line(key, line, scene, folder) + "\n";
      continue;
    }
    text += line + "\n";
  }
  return text;
}

void require_own_scene(const fs::path& file) {
  if (!fs::exists(file) || read_text(file).starts_with(kMadeBy)) return;
  throw usage_error(file.string() + " is there and was not made by drape object",
                    "give --scene-out another name");
}

}  // namespace drape::triangulate
