// SPDX-License-Identifier: Apache-2.0
#include "triangulate/dots.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/camera_model.hpp"

namespace drape::triangulate {

using Eigen::Matrix2d, Eigen::Matrix3d, Eigen::MatrixXd, Eigen::Vector2d, Eigen::Vector3d,
    Eigen::VectorXd;

namespace {

/// Shift of a dot's image in one view, caused by the dot's shape.
struct DotShift {
  Eigen::Vector2d px;  ///< image of the centre minus centroid of the image
  Eigen::Matrix<double, 2, 3> px_per_curvature;  ///< derivative by curvature (uu, uv, vv), px m
  Eigen::Matrix2d px_per_tilt;  ///< derivative by rotation about (u, v), px per rad
};

constexpr int kStartDirections = 400;  // start directions over the sphere, about 10 degrees apart
constexpr int kSteps = 12;
constexpr double kShapeSigma = 0.02;  // sigma of a squared semi-axis, relative to the dot's own
constexpr double kSizeSigma = 0.03;   // sigma of the size: dots bleed or shrink alike in all views
constexpr double kLargestMisfit = 0.1;

/// Ellipse in one view, and the linear map from the world to its pixels.
struct Outline {
  Eigen::Matrix<double, 2, 3> px_from_world;  ///< image of a dot of unit radius, scaled to order 1
  Matrix2d shape;  ///< squared semi-axes of the ellipse, in the same scale
};

std::optional<Outline> outline_of(const View& view, const Vector3d& in_world, double radius_m) {
  const Camera& camera = view.camera->camera;
  const auto image = project(camera.model, camera.cam_from_world * in_world);
  if (!image || !(view.semi_axes_px.minCoeff() > 0)) return std::nullopt;
  Outline outline;
  outline.px_from_world = radius_m * image->d_px_d_point * camera.cam_from_world.rotation;
  outline.shape = view.shape_px2();
  const double scale = outline.px_from_world.squaredNorm() / 2;
  outline.px_from_world /= std::sqrt(scale);
  outline.shape /= scale;
  return outline;
}

/// Misfits of the outlines for a normal and a size factor: three per view, and one that keeps the
/// size near the printed one.
VectorXd misfits(const std::vector<Outline>& outlines, const Vector3d& normal, double size) {
  VectorXd all(3 * outlines.size() + 1);
  for (std::size_t i = 0; i < outlines.size(); ++i) {
    const auto& map = outlines[i].px_from_world;
    const Vector2d shortened = map * normal;
    const Matrix2d predicted = size * (map * map.transpose() - shortened * shortened.transpose());
    const Matrix2d off = (predicted - outlines[i].shape) / kShapeSigma;
    all.segment<3>(3 * static_cast<Eigen::Index>(i)) << off(0, 0), off(1, 1),
        std::numbers::sqrt2 * off(0, 1);
  }
  all[all.size() - 1] = (size - 1) / (2 * kSizeSigma);
  return all;
}

struct DotTilt {
  Vector3d normal;
  double size = 1;
  double cost = 0;
  Matrix3d information;  ///< information matrix of two angles and the size
};

Vector3d turned(const Vector3d& normal, const Vector3d& u, const Vector3d& v, double a, double b) {
  return (normal + a * u + b * v).normalized();
}

/// Refines two angles and the size by Gauss-Newton from an initial direction.
DotTilt refined(const std::vector<Outline>& outlines, DotTilt tilt) {
  constexpr double kDelta = 1e-6;
  for (int step = 0; step < kSteps; ++step) {
    const Vector3d u = tilt.normal.unitOrthogonal(), v = tilt.normal.cross(u);
    const auto at = [&](double a, double b, double size) {
      return misfits(outlines, turned(tilt.normal, u, v, a, b), size);
    };
    const VectorXd now = at(0, 0, tilt.size);
    MatrixXd jacobian(now.size(), 3);
    jacobian.col(0) = (at(kDelta, 0, tilt.size) - at(-kDelta, 0, tilt.size)) / (2 * kDelta);
    jacobian.col(1) = (at(0, kDelta, tilt.size) - at(0, -kDelta, tilt.size)) / (2 * kDelta);
    jacobian.col(2) = (at(0, 0, tilt.size + kDelta) - at(0, 0, tilt.size - kDelta)) / (2 * kDelta);
    tilt.information = jacobian.transpose() * jacobian;
    // A frontal view has no first-order information; damping limits such steps.
    const Vector3d d = (tilt.information + Matrix3d(Vector3d(30, 30, 0).asDiagonal()))
                           .ldlt()
                           .solve(-jacobian.transpose() * now);
    tilt.normal =
        turned(tilt.normal, u, v, std::clamp(d[0], -0.3, 0.3), std::clamp(d[1], -0.3, 0.3));
    tilt.size += d[2];
    if (d.norm() < 1e-9) break;
  }
  tilt.cost = misfits(outlines, tilt.normal, tilt.size).squaredNorm();
  return tilt;
}

/// Evenly distributed directions (spherical Fibonacci lattice).
Vector3d direction(int i) {
  const double z = 1 - (2.0 * i + 1) / kStartDirections;
  const double turn = std::numbers::pi * (3 - std::sqrt(5.0)) * i;
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(turn), r * std::sin(turn), z};
}

/// True if every view sees the printed side.
bool faces(const std::vector<Vector3d>& to_cameras, const Vector3d& normal) {
  for (const Vector3d& to_camera : to_cameras)
    if (normal.dot(to_camera) <= 0) return false;
  return true;
}

/// Typical curvature of folds in draped cloth, for use where it is unknown.
constexpr double kUnknownPerM = 40;
constexpr std::size_t kLeastLines = 20;  // determines an RMS to within a sixth
constexpr double kUnknownTiltRad = 0.3;  // assumed tilt (1 sigma) if the ellipses give no normal

/// Offset of one neighbour from the tangent plane. Lengths are measured along the cloth.
struct Arm {
  Vector3d direction;         ///< unit tangent at the mark, towards the neighbour
  double length_m = 0;        ///< arc length along the cloth
  double height_m = 0;        ///< height of the neighbour above the tangent plane
  double slope = 0;           ///< sine of the angle between neighbour's normal and tangent plane's
  Vector3d normal;            ///< unit normal of the neighbour
  double sigma_rad = 0;       ///< standard deviation of that normal
  double sigma_here_rad = 0;  ///< standard deviation of the mark's own normal

  /// Larger of the curvatures that height and slope imply for a circle.
  [[nodiscard]] double strongest_bend_per_m() const {
    return std::max(std::abs(2 * height_m / length_m), std::abs(slope)) / length_m;
  }
};

/// `printed_m` is the distance to the neighbour on the print.
std::optional<Arm> arm_to(const MarksOnSurface& marks, MarkId neighbour, const MarkOnSurface& from,
                          double printed_m) {
  const auto other = marks.find(neighbour);
  if (!from.normal || other == marks.end() || !other->second.normal) return std::nullopt;
  const Vector3d& normal = from.normal->normal;
  const Vector3d chord = other->second.in_world - from.in_world;
  Arm arm;
  arm.height_m = chord.dot(normal);
  arm.direction = (chord - arm.height_m * normal).normalized();
  // Cloth hardly stretches, so its length equals that on the print.
  arm.length_m = std::max(printed_m, chord.norm());
  arm.normal = other->second.normal->normal;
  arm.sigma_rad = other->second.normal->sigma_rad;
  arm.sigma_here_rad = from.normal->sigma_rad;
  arm.slope = normal.cross(arm.direction).cross(arm.normal).normalized().dot(normal);
  return arm.direction.allFinite() ? std::optional(arm) : std::nullopt;
}

/// Second derivative of the height along the cloth at the mark, and its standard deviation due to
/// the noise of the normals.
struct Bend {
  double per_m = 0;
  double sigma_per_m = 0;
  double strongest_per_m = 0;  ///< largest curvature seen towards a neighbour
};

/// Fits a cubic with zero height and slope at the mark to height and slope at the neighbour.
Bend bend_of(const Arm& arm) {
  const double h = arm.length_m;
  return {6 * arm.height_m / (h * h) - 2 * arm.slope / h,
          std::hypot(4 * arm.sigma_here_rad, 2 * arm.sigma_rad) / h, arm.strongest_bend_per_m()};
}

/// Fits a quintic to heights and slopes of both neighbours (exact up to fifth order).
Bend bend_of(const Arm& ahead, const Arm& behind) {
  const double h = (ahead.length_m + behind.length_m) / 2;
  return {2 * (ahead.height_m + behind.height_m) / (h * h) - (ahead.slope + behind.slope) / (2 * h),
          std::hypot(ahead.sigma_rad, behind.sigma_rad) / (2 * h),
          std::max(ahead.strongest_bend_per_m(), behind.strongest_bend_per_m())};
}

struct Line {
  Vector3d tangent;
  Bend bend;
  Vector3d normal_change_per_m;
};

std::optional<Line> line_through(const std::optional<Arm>& ahead, const std::optional<Arm>& behind,
                                 const Vector3d& normal) {
  if (ahead && behind) {
    const Vector3d tangent = (ahead->direction - behind->direction).normalized();
    return Line{tangent, bend_of(*ahead, *behind),
                (ahead->normal - behind->normal) / (ahead->length_m + behind->length_m)};
  }
  if (ahead) {
    return Line{ahead->direction, bend_of(*ahead), (ahead->normal - normal) / ahead->length_m};
  }
  if (behind) {
    return Line{-behind->direction, bend_of(*behind), (normal - behind->normal) / behind->length_m};
  }
  return std::nullopt;
}

/// Curvature along a lattice line through a mark, from the marks `steps` pitches away on either
/// side.
std::optional<Bend> bend_along(const MarksOnSurface& marks, MarkId mark, MarkId line, int steps,
                               double pitch_m) {
  const MarkOnSurface& from = marks.at(mark);
  const MarkId offset{steps * line.row, steps * line.col};
  const double length_m = steps * pitch_m;
  const auto ahead = arm_to(marks, {mark.row + offset.row, mark.col + offset.col}, from, length_m);
  const auto behind = arm_to(marks, {mark.row - offset.row, mark.col - offset.col}, from, length_m);
  if (!ahead || !behind) return std::nullopt;
  return bend_of(*ahead, *behind);
}

constexpr double kCurvatureStepPerM = 1;  // the shift is nearly linear in curvature and tilt
constexpr double kTiltStepRad = 1e-3;

SurfacePatch bent(SurfacePatch patch, int row, int col, double by_per_m) {
  patch.curvature_per_m(row, col) += by_per_m;
  if (row != col) patch.curvature_per_m(col, row) += by_per_m;
  return patch;
}

SurfacePatch tilted(SurfacePatch patch, const Vector3d& axis, double by_rad) {
  const Eigen::AngleAxisd turn(by_rad, axis);
  patch.axis_u = turn * patch.axis_u;
  patch.axis_v = turn * patch.axis_v;
  return patch;
}

/// Shift for a round dot on this patch: perspective causes eccentricity (Heikkila 2000), and a dot
/// on a curved surface appears to lie beneath it. nullopt if the dot's outline does not project.
std::optional<DotShift> dot_shift(const Camera& camera, const Vector3d& in_world,
                                  const SurfacePatch& patch, double dot_diameter_m) {
  bool complete = true;
  const auto offset = [&](const SurfacePatch& moved) -> Vector2d {
    const Eigen::Matrix3d& rotation = camera.cam_from_world.rotation;
    const auto px = eccentricity_px(
        camera.model, {camera.cam_from_world * in_world, rotation * moved.axis_u,
                       rotation * moved.axis_v, dot_diameter_m / 2, moved.curvature_per_m});
    complete = complete && px.has_value();
    return -px.value_or(Vector2d::Zero());
  };
  const auto by = [](const auto& more, const auto& less, double step) {
    return Vector2d((more - less) / (2 * step));
  };
  DotShift shift;
  shift.px = offset(patch);
  constexpr std::array<std::array<int, 2>, 3> kPlaces = {{{0, 0}, {0, 1}, {1, 1}}};
  for (int i = 0; i < 3; ++i) {
    const auto [row, col] = kPlaces.at(i);
    shift.px_per_curvature.col(i) =
        by(offset(bent(patch, row, col, kCurvatureStepPerM)),
           offset(bent(patch, row, col, -kCurvatureStepPerM)), kCurvatureStepPerM);
  }
  const std::array<Vector3d, 2> axes = {patch.axis_u, patch.axis_v};
  for (int i = 0; i < 2; ++i) {
    shift.px_per_tilt.col(i) = by(offset(tilted(patch, axes.at(i), kTiltStepRad)),
                                  offset(tilted(patch, axes.at(i), -kTiltStepRad)), kTiltStepRad);
  }
  return complete ? std::optional(shift) : std::nullopt;
}

}  // namespace

std::optional<DotNormal> normal_from_ellipses(const std::vector<View>& views,
                                              const Vector3d& in_world, double dot_diameter_m) {
  if (views.size() < 2) return std::nullopt;
  std::vector<Outline> outlines;
  std::vector<Vector3d> to_cameras;
  for (const View& view : views) {
    const auto outline = outline_of(view, in_world, dot_diameter_m / 2);
    if (!outline) return std::nullopt;
    outlines.push_back(*outline);
    to_cameras.emplace_back((centre_in_world(view.camera->camera) - in_world).normalized());
  }
  std::optional<DotTilt> best;
  for (int i = 0; i < kStartDirections; ++i) {
    DotTilt start{direction(i), 1, 0, Matrix3d::Zero()};
    if (!faces(to_cameras, start.normal)) continue;
    start.cost = misfits(outlines, start.normal, 1).squaredNorm();
    if (!best || start.cost < best->cost) best = start;
  }
  if (!best) return std::nullopt;
  const DotTilt tilt = refined(outlines, *best);
  const double misfit =
      kShapeSigma * std::sqrt(tilt.cost / static_cast<double>(3 * views.size() + 1));
  if (!(misfit < kLargestMisfit) || !faces(to_cameras, tilt.normal)) return std::nullopt;
  const Matrix3d covariance = tilt.information.inverse();
  const double sigma = std::sqrt(covariance.diagonal().head<2>().maxCoeff());
  if (!std::isfinite(sigma)) return std::nullopt;
  return DotNormal{tilt.normal, sigma, misfit};
}

CurvatureTrust curvature_trust(const MarksOnSurface& marks, double pitch_m) {
  struct Bend {
    double strongest_per_m, change_per_m;
  };
  std::vector<Bend> changes;
  for (const auto& [mark, surface] : marks) {
    for (const MarkId line : {MarkId{1, 0}, MarkId{0, 1}}) {
      const auto near = bend_along(marks, mark, line, 1, pitch_m);
      const auto far = bend_along(marks, mark, line, 2, pitch_m);
      if (near && far) changes.push_back({far->strongest_per_m, near->per_m - far->per_m});
    }
  }
  CurvatureTrust trust;
  const std::size_t half = changes.size() / 2;
  if (half < kLeastLines) return trust;
  std::sort(changes.begin(), changes.end(),
            [](const Bend& a, const Bend& b) { return a.strongest_per_m < b.strongest_per_m; });
  double sum = 0;
  for (std::size_t i = 0; i < half; ++i) sum += changes[i].change_per_m * changes[i].change_per_m;
  trust.least_per_m = std::sqrt(sum / static_cast<double>(half));
  return trust;
}

Vector3d SurfacePatch::curvature_variance(const CurvatureTrust& trust) const {
  const double least = trust.least_per_m * trust.least_per_m;
  return noise_per_m.cwiseAbs2() + least * Vector3d(1, 0.5, 1) +
         trust.fraction * trust.fraction * strongest_per_m.cwiseAbs2();
}

SurfacePatch surface_patch(const MarksOnSurface& marks, MarkId mark, double pitch_m,
                           const Vector3d& to_cameras) {
  const MarkOnSurface& centre = marks.at(mark);
  const Vector3d normal = centre.normal ? centre.normal->normal : to_cameras;
  const auto arm = [&](int row, int col) {
    return arm_to(marks, {mark.row + row, mark.col + col}, centre, pitch_m);
  };
  auto warp = line_through(arm(1, 0), arm(-1, 0), normal);
  auto weft = line_through(arm(0, 1), arm(0, -1), normal);
  const auto unknown = [&](const Vector3d& tangent) {
    return Line{tangent, {0, kUnknownPerM, 0}, Vector3d::Zero()};
  };
  if (!warp) warp = unknown(weft ? Vector3d(weft->tangent.cross(normal)) : normal.unitOrthogonal());
  if (!weft) weft = unknown(normal.cross(warp->tangent));
  SurfacePatch patch;
  patch.axis_u = warp->tangent;
  patch.axis_v = normal.cross(patch.axis_u);
  // Second fundamental form along warp, weft and mixed, rotated to the axes (u, v).
  const double mixed = -(warp->normal_change_per_m.dot(weft->tangent) +
                         weft->normal_change_per_m.dot(warp->tangent)) /
                       2;
  Matrix2d along;
  along << warp->bend.per_m, mixed, mixed, weft->bend.per_m;
  Matrix2d tangents;  // columns: warp and weft in (u, v)
  tangents << 1, weft->tangent.dot(patch.axis_u), 0, weft->tangent.dot(patch.axis_v);
  const Matrix2d inverse = tangents.inverse();
  patch.curvature_per_m = -(inverse.transpose() * along * inverse);
  const auto three = [](double of_warp, double of_weft) {
    return Vector3d(of_warp, std::sqrt(of_warp * of_weft / 2), of_weft);
  };
  patch.noise_per_m = three(warp->bend.sigma_per_m, weft->bend.sigma_per_m);
  patch.strongest_per_m = three(warp->bend.strongest_per_m, weft->bend.strongest_per_m);
  patch.normal_sigma_rad = centre.normal ? centre.normal->sigma_rad : kUnknownTiltRad;
  if (!patch.curvature_per_m.allFinite()) patch.curvature_per_m.setZero();
  return patch;
}

std::vector<View> without_dot_shape(const std::vector<View>& views, const Vector3d& in_world,
                                    const SurfacePatch& patch, const CurvatureTrust& trust,
                                    double dot_diameter_m) {
  const Vector3d curvature_sigma = patch.curvature_variance(trust).cwiseSqrt();
  std::vector<View> corrected = views;
  for (View& view : corrected) {
    view.shape_px.setZero(2, 5);
    const auto shift = dot_shift(view.camera->camera, in_world, patch, dot_diameter_m);
    if (!shift) continue;
    view.px += shift->px;
    view.shape_px << shift->px_per_curvature * curvature_sigma.asDiagonal(),
        shift->px_per_tilt * patch.normal_sigma_rad;
  }
  return corrected;
}

}  // namespace drape::triangulate
