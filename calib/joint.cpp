// SPDX-License-Identifier: Apache-2.0
#include "calib/joint.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <set>

#include "calib/checks/causes.hpp"
#include "calib/joint/start.hpp"
#include "core/scene.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::calib {

using Eigen::MatrixXd, Eigen::Vector2d, Eigen::Vector3d, Eigen::Vector4d;
using units::deg;

namespace {

/// Stages of known height from which start_joint() removed most views, with their heights; empty if
/// there are none. Without these views a wrong height cannot be detected.
std::string lost_stages(const JointModel& all, const JointModel& kept) {
  const auto views_of = [](const JointModel& model) {
    std::map<std::string, int> views;
    for (const JointFrame& frame : model.frames) ++views[model.placements[frame.placement].set];
    return views;
  };
  const std::map<std::string, int> before = views_of(all), after = views_of(kept);
  std::string lost, stayed;
  for (const Placement& stage : all.placements) {
    const auto had = before.find(stage.set), has = after.find(stage.set);
    if (!stage.known || had == before.end()) continue;
    std::string& list = has != after.end() && 2 * has->second > had->second ? stayed : lost;
    list += fmt::format("{}{} (z_mm = {:g})", list.empty() ? "" : ", ", stage.set,
                        stage.world_from_target.translation_m.z() / units::mm);
  }
  if (lost.empty()) return {};
  return fmt::format(
      "z stage: the heights of {} contradict {}; correct z_mm in rig.toml (mm, not cm or inches), "
      "or take out the stage whose target moved",
      lost, stayed.empty() ? "the free poses" : "those of " + stayed);
}

using TargetPoints = std::vector<TargetPoint>;

/// Views of one set, indexed by camera; null for a camera without
/// one.
using Views = std::vector<const TargetPoints*>;

/// Agreement of the views of one set, assuming that cameras may have been named
/// wrongly.
class SetOfViews {
 public:
  SetOfViews(const JointModel& started, std::string name, Views views)
      : name_(std::move(name)),
        views_(std::move(views)),
        started_(&started),
        placed_(views_.size() * views_.size()) {}

  [[nodiscard]] bool has(std::size_t camera) const { return views_[camera] != nullptr; }

  /// Distance of the worst view from the one that agrees best with all others, relative to the
  /// image size, with the views of cameras `a` and `b` exchanged; infinite from `limit` on. All
  /// views matter: two exchanged cameras on opposite sides see a rotated target, which only a third
  /// camera contradicts.
  double contradiction(std::size_t a, std::size_t b, double limit) {
    const auto taken_by = [&](std::size_t camera) {
      return camera == a ? b : camera == b ? a : camera;
    };
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t source = 0; source < views_.size(); ++source) {
      if (views_[taken_by(source)] == nullptr) continue;
      double worst = 0;
      for (std::size_t c = 0; c < views_.size() && worst < std::min(least, limit); ++c)
        if (c != source && views_[taken_by(c)] != nullptr)
          worst = std::max(worst, distance(source, taken_by(source), c, taken_by(c)));
      if (worst < limit) least = std::min(least, worst);
    }
    return least;
  }

  /// Name of the set.
  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  /// Position of the target according to one camera's view of it, computed once.
  const std::optional<WorldFromTarget>& place_by(std::size_t camera, std::size_t view) {
    auto& place = placed_[camera * views_.size() + view];
    if (!place) {
      place.emplace();
      const Camera& by = started_->cameras[camera].camera;
      if (const auto homography = homography_of(without_lens(by.model, *views_[view])))
        *place = by.cam_from_world.inverse() *
                 planar_pose(*homography, 1, Vector2d::Zero()).cam_from_target;
    }
    return *place;
  }

  /// RMS distance of the second camera's points from the positions predicted by the first one's
  /// view of the target, relative to the size of their image.
  double distance(std::size_t first, std::size_t first_view, std::size_t second,
                  std::size_t second_view) {
    constexpr double kNone = std::numeric_limits<double>::infinity();
    const TargetPoints& points = *views_[second_view];
    const auto& placed = place_by(first, first_view);
    if (!placed || points.empty()) return kNone;
    const Camera& camera = started_->cameras[second].camera;
    Eigen::AlignedBox2d box;
    double sum = 0;
    for (const TargetPoint& point : points) {
      const auto image =
          project(camera.model, camera.cam_from_world * (*placed * point.point_in_target));
      if (!image) return kNone;
      sum += (image->px - point.measured_px).squaredNorm();
      box.extend(point.measured_px);
    }
    return std::sqrt(sum / static_cast<double>(points.size())) / box.diagonal().norm();
  }

  std::string name_;
  Views views_;
  const JointModel* started_;
  std::vector<std::optional<std::optional<WorldFromTarget>>> placed_;
};

/// A set whose views contradict each other, with the size of the contradiction.
struct Contradiction {
  SetOfViews set;
  double as_named;
};

/// Sets whose views, as named, contradict each other: a good calibration has none, and the cost per
/// set is quadratic in the number of cameras.
std::vector<Contradiction> contradictions(const JointModel& all, const JointModel& started) {
  std::vector<Views> by_set(all.placements.size(), Views(all.cameras.size(), nullptr));
  for (const JointFrame& frame : all.frames) by_set[frame.placement][frame.camera] = &frame.points;
  std::vector<Contradiction> found;
  for (std::size_t p = 0; p < by_set.size(); ++p) {
    SetOfViews set(started, all.placements[p].set, std::move(by_set[p]));
    const double as_named = set.contradiction(0, 0, std::numeric_limits<double>::infinity());
    if (as_named >= contradicting_part) found.push_back({std::move(set), as_named});
  }
  return found;
}

/// Message about two cameras whose pictures are exchanged in some sets; empty if there are none.
/// `all` holds every view; `started` the cameras as located by the majority of views.
std::string exchanged_views(const JointModel& all, const JointModel& started) {
  std::vector<Contradiction> bad = contradictions(all, started);
  for (std::size_t a = 0; a < started.cameras.size(); ++a) {
    for (std::size_t b = a + 1; b < started.cameras.size(); ++b) {
      std::vector<std::string> sets;
      for (auto& [set, as_named] : bad) {
        if (!set.has(a) || !set.has(b)) continue;
        // Requires a factor of 4, as for an odd camera: the better of two bad explanations is none.
        const double limit = std::min(contradicting_part, as_named / 4);
        if (set.contradiction(a, b, limit) < limit) sets.push_back(set.name());
      }
      if (sets.empty()) continue;
      return fmt::format(
          "{} and {} are exchanged in {} against the other sets: give each camera one name in all "
          "sets, then detect again",
          started.cameras[a].camera.name, started.cameras[b].camera.name, fmt::join(sets, ", "));
    }
  }
  return {};
}

/// Reason why the labels of a target with half-turn symmetry are not confirmed: a picture agrees
/// with another one of its set only with rotated labels, or a camera is connected to the others by
/// a single common view that agrees either way. Empty if they are confirmed.
std::string unconfirmed_labels(const Target& target, const JointModel& all,
                               const JointModel& started) {
  if (!is_ambiguous(target)) return {};
  constexpr const char* kRemedy =
      "use a board of an odd number of rows and columns together, or one with tags";
  const auto turned = [&](TargetPoints points) {
    for (TargetPoint& point : points) {
      point.dot = {target.rows - 1 - point.dot.row, target.cols - 1 - point.dot.col};
      point.point_in_target = target.point_in_target(point.dot);
    }
    return points;
  };
  std::map<std::pair<std::size_t, std::size_t>, int> common;
  for (const JointFrame& a : all.frames)
    for (const JointFrame& b : all.frames) {
      if (a.placement != b.placement || a.camera >= b.camera) continue;
      const auto apart = [&](const TargetPoints& by_b) {
        Views views(started.cameras.size(), nullptr);
        views[a.camera] = &a.points, views[b.camera] = &by_b;
        return SetOfViews(started, {}, views)
            .contradiction(a.camera, a.camera, std::numeric_limits<double>::infinity());
      };
      if (apart(b.points) < contradicting_part) {
        ++common[{a.camera, b.camera}];
      } else if (apart(turned(b.points)) < contradicting_part) {
        return fmt::format(
            "the target looks the same after half a turn, and set {} is labelled otherwise by {} "
            "than by {}, which is rolled against it; {}",
            all.placements[a.placement].set, started.cameras[b.camera].camera.name,
            started.cameras[a.camera].camera.name, kRemedy);
      }
    }
  std::set<std::size_t> joined = {0};
  for (std::size_t before = 0; before < joined.size();) {
    before = joined.size();
    for (const auto& [pair, views] : common)
      if (views >= 2 && joined.contains(pair.first) != joined.contains(pair.second))
        joined.insert({pair.first, pair.second});
  }
  for (std::size_t c = 0; c < started.cameras.size(); ++c)
    if (!joined.contains(c))
      return fmt::format(
          "the place of {} rests on one view in common of a target that looks the same after half "
          "a turn: its labels are not confirmed; add views that both cameras see, or {}",
          started.cameras[c].camera.name, kRemedy);
  return {};
}

constexpr double kLeastTiltDeg = 10;   ///< below this, f and the distance are inseparable
constexpr double kLeastSpreadDeg = 5;  ///< between the normals of free views
constexpr double kSameViewPx = 0.5;

double angle_deg(const Vector3d& a, const Vector3d& b) {
  return std::acos(std::min(std::abs(a.dot(b)), 1.0)) / deg;
}

/// Normals of the target in the camera frame, one per view.
std::vector<Vector3d> normals_of(const JointModel& model, std::size_t camera) {
  std::vector<Vector3d> normals;
  for (const JointFrame& frame : model.frames) {
    if (frame.camera != camera) continue;
    normals.emplace_back(model.cameras[camera].camera.cam_from_world.rotation *
                         model.placements[frame.placement].world_from_target.rotation.col(2));
  }
  return normals;
}

Eigen::AlignedBox2d box_of(const JointModel& model, std::size_t camera) {
  Eigen::AlignedBox2d box;
  for (const JointFrame& frame : model.frames) {
    if (frame.camera != camera) continue;
    for (const TargetPoint& point : frame.points) box.extend(point.measured_px);
  }
  return box;
}

/// Largest angle (deg) between the target's normal and the optical axis over a camera's views.
double largest_tilt_deg(const JointModel& model, std::size_t camera) {
  double tilt = 0;
  for (const Vector3d& normal : normals_of(model, camera))
    tilt = std::max(tilt, angle_deg(normal, Vector3d::UnitZ()));
  return tilt;
}

void check_directions(const JointModel& model, std::size_t camera) {
  const std::vector<Vector3d> normals = normals_of(model, camera);
  const Where where{.camera = model.cameras[camera].camera.name};
  double spread = 0;
  for (const Vector3d& a : normals) {
    for (const Vector3d& b : normals) spread = std::max(spread, angle_deg(a, b));
  }
  const double tilt = largest_tilt_deg(model, camera);
  if (tilt < kLeastTiltDeg) {
    throw bad_input(fmt::format("too little tilt: the target is at most {:.1f} deg off parallel to "
                                "the image, so focal length and distance cannot be separated",
                                tilt),
                    where, "add views with the target tilted by 30 degrees, to both sides");
  }
  int heights = 0;
  for (const JointFrame& frame : model.frames)
    heights += frame.camera == camera && model.placements[frame.placement].known ? 1 : 0;
  if (heights >= 2) return;
  if (normals.size() < 2) {
    throw bad_input("one view of a flat target: the image centre is not observable", where,
                    "add two or more views with other tilts, or a z stage");
  }
  if (spread < kLeastSpreadDeg) {
    throw bad_input(fmt::format("parallel planes: all views have the same tilt within {:.1f} deg, "
                                "which repeats one view's information",
                                spread),
                    where, "add views tilted by 30 degrees about another axis");
  }
}

void check_place_in_image(const JointModel& model, std::size_t camera) {
  const CameraModel& image = model.cameras[camera].camera.model;
  const Eigen::AlignedBox2d box = box_of(model, camera);
  const Vector2d middle(image.width_px / 2.0, image.height_px / 2.0);
  if (box.isEmpty()) return;  // no points at all: start_joint names the camera
  const auto on_one_side = [&](int axis) {
    return box.max()[axis] < middle[axis] || box.min()[axis] > middle[axis];
  };
  if (!on_one_side(0) || !on_one_side(1)) return;
  throw bad_input(fmt::format("all views lie in one corner of the image: u {:.0f} to {:.0f}, v "
                              "{:.0f} to {:.0f} of {} x {} px",
                              box.min().x(), box.max().x(), box.min().y(), box.max().y(),
                              image.width_px, image.height_px),
                  {.camera = model.cameras[camera].camera.name},
                  "move the target through the middle and the other corners of the image");
}

/// Mean distance (px) between the common dots of two frames.
double mean_shift_px(const JointFrame& a, const JointFrame& b) {
  double sum = 0;
  int common = 0;
  for (const TargetPoint& p : a.points) {
    const auto same = std::find_if(b.points.begin(), b.points.end(),
                                   [&](const TargetPoint& q) { return q.dot == p.dot; });
    if (same == b.points.end()) continue;
    sum += (p.measured_px - same->measured_px).norm();
    ++common;
  }
  return common > 0 ? sum / common : std::numeric_limits<double>::infinity();
}

void warn_of_duplicates(const JointModel& model, std::vector<std::string>& warnings) {
  for (std::size_t a = 0; a < model.frames.size(); ++a) {
    for (std::size_t b = a + 1; b < model.frames.size(); ++b) {
      const JointFrame &one = model.frames[a], &two = model.frames[b];
      if (one.camera != two.camera || mean_shift_px(one, two) >= kSameViewPx) continue;
      warnings.push_back(fmt::format(
          "duplicate views: {} shows the target in the same place in sets {} and {}; the second "
          "adds no new direction, move the target between sets",
          model.cameras[one.camera].camera.name, model.placements[one.placement].set,
          model.placements[two.placement].set));
    }
  }
}

/// Percentage of the image inside the box around a camera's points.
double covered_percent(const JointModel& model, std::size_t camera) {
  const CameraModel& image = model.cameras[camera].camera.model;
  return 100 * box_of(model, camera).volume() / (image.width_px * image.height_px);
}

/// Throws Error(bad_input), naming the camera and a remedy, if the views of a started model cannot
/// calibrate an unknown lens: a single view, parallel planes, too little tilt. Adds duplicate views
/// to `warnings`.
void check_views(const JointModel& started, bool lens_known, std::vector<std::string>& warnings) {
  for (std::size_t camera = 0; !lens_known && camera < started.cameras.size(); ++camera) {
    check_directions(started, camera);
  }
  warn_of_duplicates(started, warnings);
}

/// Warns of pixels that the fit finds not square, and of a stretched print, each beyond 0.1 % and
/// three standard deviations. Returns the contradiction with square pixels stated in the rig, or
/// "".
std::string judge_squares(const JointModel& model, const Calibration& calibration,
                          JointReport& report) {
  constexpr double kNamed = 1e-3, kSigmas = 3;
  const double stretch = report.print[2];
  if (std::abs(stretch) > kNamed && std::abs(stretch) > kSigmas * report.print_sd[2])
    report.warnings.push_back(fmt::format(
        "the print is {:.2f} +- {:.2f} % longer along its {} than along its {} against the "
        "drawing; the calibration takes that into account",
        100 * std::abs(stretch), 100 * report.print_sd[2], stretch > 0 ? "rows (x)" : "columns (y)",
        stretch > 0 ? "columns (y)" : "rows (x)"));
  std::string contradiction;
  for (std::size_t c = 0; c < model.cameras.size(); ++c) {
    const Eigen::MatrixXd& covariance = calibration.cameras[c].covariance;
    if (covariance.size() == 0) continue;
    const auto& lens = std::get<BrownLens>(model.cameras[c].camera.model.lens);
    const double ratio = lens.fy_px / lens.fx_px;
    const Vector2d by(-ratio / lens.fx_px, 1 / lens.fx_px);
    const double sd = std::sqrt(by.dot(covariance.topLeftCorner<2, 2>() * by));
    if (std::abs(ratio - 1) < kNamed || std::abs(ratio - 1) < kSigmas * sd) continue;
    const double promised = model.cameras[c].square_sd;
    const std::string found = fmt::format(
        "{}: fy/fx is {:.4f} +- {:.4f}: the target's print is stretched, or the pixels are not "
        "square",
        model.cameras[c].camera.name, ratio, sd);
    if (promised > 0 && std::abs(ratio - 1) > kSigmas * std::hypot(sd, promised)) {
      if (contradiction.empty())
        contradiction = fmt::format(
            "{}, which rig.toml promises (square_pixels_percent = {:g}): calibrate with --board "
            "free, or measure the print along x and y and add [[known_length]]",
            found, 100 * promised);
    } else {
      report.warnings.push_back(
          found +
          "; to tell, measure the print along x and y, or turn it by 90 degrees in half of "
          "the views");
    }
  }
  return contradiction;
}

/// Reason why the result must not be used, or "good". `gross` counts rejected points, out of
/// `measured`, that are farther off at the target than the RMS limit.
std::string joint_status(const JointReport& report, bool converged, bool has_covariance,
                         std::size_t gross, std::size_t measured, const CalibOptions& options) {
  if (!converged) return fmt::format("not converged after {} iterations", report.iterations);
  if (std::string too_many = too_many_gross(gross, measured, options); !too_many.empty())
    return too_many;
  for (const JointCameraReport& camera : report.cameras) {
    if (camera.object_rms_mm > options.max_rms_mm) {
      return fmt::format("{}: RMS {:.3f} mm at the target ({:.3f} px), above the limit of {:g} mm",
                         camera.camera, camera.object_rms_mm, camera.rms_px, options.max_rms_mm);
    }
  }
  if (!has_covariance)
    return "ill-conditioned: the parameters cannot be separated; add views with other tilts";
  for (const JointCameraReport& camera : report.cameras) {
    if (100 * camera.centre_sd_px > options.max_centre_sd_percent * camera.focal_px) {
      return fmt::format(
          "{}: ill-conditioned: image centre known to {:.1f} px only (limit {:g} % of the focal "
          "length); add views with other tilts",
          camera.camera, camera.centre_sd_px, options.max_centre_sd_percent);
    }
    if (100 * camera.focal_sd_px > options.max_focal_sd_percent * camera.focal_px) {
      return fmt::format(
          "{}: ill-conditioned: focal length known to {:.1f} % only (limit {:g} %); "
          "add views with more tilt",
          camera.camera, 100 * camera.focal_sd_px / camera.focal_px, options.max_focal_sd_percent);
    }
  }
  return "good";
}

/// TargetPoints of a camera with their world positions, for the measures shared with Tsai's method.
std::vector<Correspondence> correspondences(const JointModel& model, std::size_t camera) {
  std::vector<Correspondence> points;
  for (const JointFrame& frame : model.frames) {
    if (frame.camera != camera) continue;
    const Placement& placement = model.placements[frame.placement];
    for (const TargetPoint& p : frame.points) {
      points.push_back({placement.world_from_target * model.board.bent(p.point_in_target, p.place),
                        p.px(), p.covariance_px2, placement.set, p.dot});
    }
  }
  return points;
}

CalibratedCamera calibrated_camera(const JointModel& model, std::size_t index,
                                   const MatrixXd& joint_covariance) {
  const Camera& camera = model.cameras[index].camera;
  MatrixXd own;
  if (joint_covariance.size() > 0) {
    const auto size = static_cast<Eigen::Index>(parameter_names(camera.model).size());
    const auto at = static_cast<Eigen::Index>(index) * size;
    own = joint_covariance.block(at, at, size, size);
  }
  return calibrated_of(camera, correspondences(model, index), own);
}

JointCameraReport camera_report(const JointModel& model, std::size_t index,
                                const CalibratedCamera& calibrated) {
  JointCameraReport report;
  const auto& lens = std::get<BrownLens>(calibrated.camera.model.lens);
  report.camera = calibrated.camera.name;
  report.points = calibrated.residuals.points;
  report.rms_px = calibrated.residuals.rms_px;
  report.object_rms_mm = calibrated.residuals.object_rms_mm;
  report.focal_px = lens.fx_px;
  report.covered_percent = covered_percent(model, index);
  report.largest_tilt_deg = largest_tilt_deg(model, index);
  for (const JointFrame& frame : model.frames)
    report.views += frame.camera == index && !frame.points.empty() ? 1 : 0;
  const MatrixXd& covariance = calibrated.covariance;
  if (covariance.size() == 0) return report;
  report.focal_sd_px = std::sqrt(std::max(covariance(0, 0), covariance(1, 1)));
  report.centre_sd_px = std::sqrt(std::max(covariance(2, 2), covariance(3, 3)));
  report.position_sd_mm = std::sqrt(centre_covariance_mm2(calibrated).trace());
  const WorldBox box = drape_volume(model);
  report.image_sd_px = projected_sd_px(calibrated, 0.5 * (box.low + box.high)).value_or(0);
  for (const Eigen::Vector3d& corner : grid_of(box, 2)) {
    report.image_sd_worst_px =
        std::max(report.image_sd_worst_px, projected_sd_px(calibrated, corner).value_or(0));
  }
  return report;
}

double largest_eccentricity(const JointModel& model) {
  double largest = 0;
  for (const JointFrame& frame : model.frames) {
    for (const TargetPoint& p : frame.points) largest = std::max(largest, p.eccentricity_px.norm());
  }
  return largest;
}

/// Smallest number of placements that can locate each point of a board, and the number from which
/// the intervals of free points are wide enough. In between, free points are chosen only if they
/// halve the held-out error.
constexpr std::size_t kViewsOfABoard = 6, kViewsOfASureBoard = 8;

/// Percentage of points beyond twice the limit of the robust loss.
double given_up_percent(const JointModel& model) {
  double given_up = 0;
  for (const JointFrame& frame : model.frames)
    given_up += static_cast<double>(std::ranges::count_if(
        frame.points, [](const TargetPoint& point) { return point.weight < 0.5; }));
  return 100 * given_up / static_cast<double>(count_points(model));
}

/// Frees all stages but the first: their heights are checked after the fit.
JointModel with_one_stage(JointModel model) {
  bool world_kept = false;
  for (Placement& placement : model.placements)
    placement.known = placement.known && !std::exchange(world_kept, world_kept || placement.known);
  return model;
}

/// Fits the richest lens and board from the poorer fit `first`, which may have led astray: a flat
/// board may move the image centre far off, a short lens give up the rim of a wide picture. If so,
/// `started` is started again, each camera with all terms of its lens.
JointSolution richest_fit(const JointModel& started, const JointModel& first, const JointFit& rich,
                          const JointCleaning& cleaning, const CalibOptions& limits) {
  JointSolution richest = fit_joint(with_one_stage(first), rich, cleaning);
  if (richest.converged && given_up_percent(richest.model) <= limits.max_outliers_percent)
    return richest;
  JointModel other = started;
  try {
    start_joint(other, {rich.lens_known, 0, rich.lens});
  } catch (const Error&) {
    return richest;  // the cameras' own views do not determine so many terms
  }
  if (other.frames.size() < started.frames.size()) return richest;
  JointSolution again = fit_joint(with_one_stage(other), rich, cleaning);
  const bool better =
      again.converged &&
      (!richest.converged || given_up_percent(again.model) < given_up_percent(richest.model));
  return better ? again : richest;
}

/// Selects board and lens by held-out error, without the views and points that are outliers of the
/// richest fit, and puts the tables into the report. Returns the start of the fit.
JointModel chosen(const JointModel& started, const JointModel& first, JointFit& fit,
                  const JointCleaning& cleaning, const JointOptions& options, JointReport& report) {
  const bool any_lens = !options.lens && !options.known_lenses;
  const bool any_board = !options.board && !first.board.measured &&
                         !first.board.point_sd_mm.empty() &&
                         first.placements.size() >= kViewsOfABoard;
  if (!any_lens && !any_board) return first;
  JointFit rich = fit;
  if (any_lens) rich.lens = LensTerms::k1_k2_p1_p2_k3;
  if (any_board) rich.board = BoardKind::free;
  const JointSolution richest = richest_fit(started, first, rich, cleaning, options.common);
  JointModel clean = richest.converged ? richest.model : with_one_stage(first);
  std::vector<std::size_t> off = frames_off(clean, cleaning);
  for (; !off.empty() && 3 * off.size() <= clean.frames.size(); off.pop_back())
    clean.frames.erase(clean.frames.begin() + static_cast<std::ptrdiff_t>(off.back()));
  static_cast<void>(reject_outliers(clean, cleaning));
  std::vector<HeldOut> best;  // best lens for each board
  std::vector<std::vector<HeldOut>> tables;
  for (const BoardKind board : {any_board ? BoardKind::bow : fit.board, BoardKind::free}) {
    JointFit candidate = rich;
    candidate.board = board;
    std::vector<HeldOut> table;
    for (const LensTerms lens : all_lens_terms) {
      candidate.lens = any_lens ? lens : fit.lens;
      table.push_back(held_out_error(clean, candidate, options.held_out_groups));
      if (!any_lens) break;
    }
    best.push_back(table[choose(table)]);
    tables.push_back(std::move(table));
    if (!any_board) break;
  }
  if (best.front().points == 0) {
    report.warnings.emplace_back(
        "one placement of the target only: the lens could not be chosen by held-out error");
    return first;
  }
  std::size_t taken = choose(best);
  if (first.placements.size() < kViewsOfASureBoard && taken > 0 &&
      best[taken].rms_px > best.front().rms_px / 2)
    taken = 0;
  fit.board = best[taken].board;
  fit.lens = best[taken].lens;
  if (any_board) report.boards = best;
  if (any_lens) report.held_out = tables[taken];
  JointModel start = first;
  const bool astray = given_up_percent(first) > options.common.max_outliers_percent;
  if ((fit.board == BoardKind::free || astray) && richest.converged) {
    start = richest.model;
    for (std::size_t p = 0; p < first.placements.size(); ++p)
      if (first.placements[p].known) start.placements[p] = first.placements[p];
  }
  clear_unused(start, fit);
  return start;
}

/// Describes the target pose that most reduces the calibration's contribution to a point's error.
std::string next_view(const Calibration& calibration, const JointModel& model,
                      const JointReport& report) {
  constexpr int kPlacesPerSide = 2;
  if (!report.volume_sd_mm) return {};
  std::map<MarkId, Eigen::Vector3d> points;
  std::vector<double> variances(model.cameras.size(), 0), counts = variances;
  for (const JointFrame& frame : model.frames)
    for (const TargetPoint& point : frame.points) {
      points.emplace(point.dot, point.point_in_target);
      variances[frame.camera] += point.covariance_px2.trace() / 2;
      ++counts[frame.camera];
    }
  std::vector<Eigen::Vector3d> in_target;
  for (const auto& [dot, point] : points) in_target.push_back(point);
  std::vector<double> sigma_px;
  for (std::size_t c = 0; c < variances.size(); ++c)
    sigma_px.push_back(std::sqrt(variances[c] / std::max(counts[c], 1.0)));
  const PosePlanner planner(calibration, in_target, drape_volume(model), sigma_px);
  const auto next = planner.next(kPlacesPerSide);
  if (!next) return "no further pose of the target would help within the cameras' view";
  return fmt::format(
      "target {} (seen whole by {} of {} cameras): calibration's part of a measured point {:.4f} "
      "-> {:.4f} mm",
      next->words, next->cameras.size(), model.cameras.size(), *report.volume_sd_mm,
      *report.volume_sd_mm * next->calibration_m / planner.now().calibration_m);
}

/// A fit with the covariance that may be stated for it, in file units.
struct StatedFit {
  JointSolution solution;
  JointCovariance covariance;
  ViewScatter scatter;
};

/// Weighted sum of squares per degree of freedom.
double chi2_per_dof(const JointSolution& solution, const JointFit& fit) {
  return solution.chi2 / (2.0 * static_cast<double>(count_points(solution.model)) -
                          free_parameters(solution.model, fit));
}

StatedFit with_uncertainty(JointSolution solution, const JointFit& fit) {
  StatedFit out;
  // With enough views for free points, residuals show the points' noise better than a stated value.
  const double noise = chi2_per_dof(solution, fit);
  out.scatter = scatter_of_views(solution.model, fit,
                                 fit.board == BoardKind::free ? noise : std::max(1.0, noise));
  out.covariance = joint_covariance(solution.model, fit, out.scatter.covariance);
  out.solution = std::move(solution);
  return out;
}

/// Covariance from the scatter of the views and the uncertain selection of lens and board: averages
/// the covariances and differences of the other fits, weighted by the probability that other views
/// would select them (Buckland, Burnham and Augustin 1997).
StatedFit with_choices(const JointSolution& solution, const JointFit& fit,
                       const JointCleaning& cleaning, const JointReport& report) {
  constexpr double kRare = 0.005;
  StatedFit chosen = with_uncertainty(solution, fit);
  if (chosen.covariance.cameras.size() == 0) return chosen;
  const MatrixXd own = chosen.covariance.cameras, own_target = chosen.covariance.target;
  const Eigen::VectorXd own_board = chosen.covariance.board_sd.cwiseAbs2();
  Eigen::VectorXd board = own_board;
  MatrixXd of_others = MatrixXd::Zero(own.rows(), own.cols());  // the target's part
  double own_share = 1;
  for (const std::vector<HeldOut>* table : {&report.held_out, &report.boards}) {
    if (table->empty()) continue;
    const std::vector<double> shares = probabilities(*table);
    for (std::size_t i = 0; i < table->size(); ++i) {
      JointFit other_fit = fit;
      other_fit.lens = (*table)[i].lens;
      other_fit.board = (*table)[i].board;
      if (shares[i] < kRare || (other_fit.lens == fit.lens && other_fit.board == fit.board))
        continue;
      JointModel start = solution.model;
      clear_unused(start, other_fit);
      const StatedFit other = with_uncertainty(fit_joint(start, other_fit, cleaning), other_fit);
      if (other.covariance.cameras.size() == 0) continue;
      const Eigen::VectorXd apart = file_difference(other.solution.model, solution.model);
      chosen.covariance.cameras +=
          shares[i] * (other.covariance.cameras - own + apart * apart.transpose());
      own_share -= shares[i];
      of_others += shares[i] * other.covariance.target;
      if (other_fit.board != fit.board) of_others += shares[i] * apart * apart.transpose();
      const Eigen::VectorXd board_apart =
          other.solution.model.board.parameters() - solution.model.board.parameters();
      board +=
          shares[i] * (other.covariance.board_sd.cwiseAbs2() - own_board + board_apart.cwiseAbs2());
    }
  }
  // The probabilities of two tables may exceed 1 together; the part is then 0, not negative.
  chosen.covariance.target = std::max(0.0, own_share) * own_target + of_others;
  chosen.covariance.board_sd = board.cwiseMax(0).cwiseSqrt();
  return chosen;
}

/// Adds covariances that include the choice of lens and board.
void add_uncertainty(const JointSolution& solution, const JointFit& fit,
                     const JointCleaning& cleaning, const JointOptions& options,
                     JointResult& result) {
  const JointModel& model = solution.model;
  JointReport& report = result.report;
  Calibration& calibration = result.calibration;
  report.chi2_per_dof = chi2_per_dof(solution, fit);
  const StatedFit own = with_choices(solution, fit, cleaning, report);
  report.view_inflation = own.scatter.inflation;
  report.print = model.board.parameters();
  report.print_sd = own.covariance.board_sd;
  const std::set<int> seen = model.board.shift_mm.empty() ? std::set<int>() : points_in_view(model);
  for (const int i : seen)
    report.print_rms_mm += model.board.shift_mm[static_cast<std::size_t>(i)].squaredNorm() /
                           static_cast<double>(seen.size());
  report.print_rms_mm = std::sqrt(report.print_rms_mm);
  calibration.joint_covariance_parameters = own.covariance.names;
  calibration.joint_covariance = own.covariance.cameras;
  if (options.known_lenses)
    add_known_lenses(calibration.joint_covariance, model, fit, *options.known_lenses);
  calibration.target_covariance = own.covariance.target;
  for (MatrixXd* covariance : {&calibration.joint_covariance, &calibration.target_covariance})
    add_scale_uncertainty(*covariance, model, options.scale_uncertainty);
}

/// Sets used for calibration.
std::vector<std::string> sets_of(const Rig& rig) {
  std::vector<std::string> sets = rig.free_poses;
  for (const TargetStage& stage : rig.stages) sets.push_back(stage.set);
  return sets;
}

/// Keeps the first stage as the world and makes the other stages free.
Rig with_free_stages(Rig rig) {
  if (rig.stages.size() < 2) return rig;
  std::vector<std::string> free;
  for (auto stage = rig.stages.begin() + 1; stage != rig.stages.end(); ++stage)
    free.push_back(stage->set);
  rig.free_poses.insert(rig.free_poses.begin(), free.begin(), free.end());
  rig.stages.resize(1);
  return rig;
}

/// Determines the scale of the print from the measured lengths.
void take_lengths(JointModel& model, const Target& target) {
  if (!(model.board.information(4, 4) > 0))
    model.board.information(4, 4) = 1 / (print_sd * print_sd);
  for (const KnownLength& known : target.known_lengths)
    model.lengths.push_back({place_of(target, known.from), place_of(target, known.to),
                             target.point_in_target(known.from), target.point_in_target(known.to),
                             known.length_m / units::mm, known.standard_uncertainty_m / units::mm});
}

/// Removes views that are outliers as a whole, and fits again. Does nothing unless they are a
/// minority: the verdict must instead name a camera or stage that moved.
void drop_views(JointSolution& solution, const JointFit& fit, const JointCleaning& cleaning,
                std::vector<std::string>& rejected) {
  JointModel& model = solution.model;
  std::vector<std::size_t> off = frames_off(model, cleaning);
  // A wrong stage is reported by the check of the stages.
  const auto known = std::count_if(model.placements.begin(), model.placements.end(),
                                   [](const Placement& placement) { return placement.known; });
  std::erase_if(off, [&](std::size_t f) {
    return known > 1 && model.placements[model.frames[f].placement].known;
  });
  std::vector<int> views(model.cameras.size(), 0), gone(model.cameras.size(), 0);
  for (const JointFrame& frame : model.frames) ++views[frame.camera];
  for (const std::size_t f : off) ++gone[model.frames[f].camera];
  for (std::size_t c = 0; c < views.size(); ++c)
    if (3 * gone[c] > views[c]) return;
  std::vector<JointFrame> kept;
  for (std::size_t f = 0; f < model.frames.size(); ++f) {
    const JointFrame& frame = model.frames[f];
    if (std::find(off.begin(), off.end(), f) == off.end()) {
      kept.push_back(frame);
      continue;
    }
    rejected.push_back(name_of_view(model, frame) +
                       ": the whole view, most of its points lie off the other views' result (a "
                       "target or camera that moved, a turned corner order, blur)");
  }
  if (off.empty()) return;
  model.frames = std::move(kept);
  drop_unseen_placements(model);
  solution = fit_joint(model, fit, cleaning);
}

/// Throws if a camera's points all lie off their predicted positions: it is not calibrated, even if
/// the others agree.
void require_points(const JointModel& model, const JointModel& all_points, const JointFit& fit,
                    const JointCleaning& cleaning) {
  std::vector<std::size_t> points(model.cameras.size(), 0);
  for (const JointFrame& frame : model.frames)
    for (const TargetPoint& point : frame.points)
      points[frame.camera] += pixel_of(model, frame, point).has_value();
  const auto none = std::find(points.begin(), points.end(), 0U);
  if (none == points.end()) return;
  const auto stages = check_stages(all_points, fit, cleaning);
  throw bad_input(
      "no point that it sees agrees with the other views" +
          (stages && !stages->contradiction.empty() ? ": " + stages->contradiction : ""),
      {.camera = model.cameras[static_cast<std::size_t>(none - points.begin())].camera.name},
      "correct z_mm or pitch_mm, or record the target again without a move");
}

/// Warns of views whose residuals are above twice the median of all views.
void warn_of_views(const JointModel& model, std::vector<std::string>& warnings) {
  std::vector<std::pair<double, std::string>> views;
  std::vector<double> all;
  for (const JointFrame& frame : model.frames) {
    if (frame.points.empty()) continue;
    double sum = 0;
    for (const TargetPoint& point : frame.points)
      sum += std::pow(distance_px(model, frame, point), 2);
    all.push_back(std::sqrt(sum / static_cast<double>(frame.points.size())));
    views.emplace_back(all.back(), name_of_view(model, frame));
  }
  for (const auto& [rms_px, name] : views)
    if (rms_px > 2 * median(all))
      warnings.push_back(
          fmt::format("{}: RMS {:.3f} px, above twice the median of all views; look at its image "
                      "(blur, glare, a moved target) or take the set out",
                      name, rms_px));
}

}  // namespace

void check_places(const JointModel& views) {
  for (std::size_t camera = 0; camera < views.cameras.size(); ++camera)
    check_place_in_image(views, camera);
}

void fields(Fields& f, JointOptions& o) {
  f.otherwise({"free_stages", "joint: treat all stages except the first as free poses"},
              o.free_stages);
  f.otherwise(
      {"thickness_mm", "joint: distance between the front and the back of a two-sided target", 1, 0,
       999, "give the thickness of the board in mm"},
      o.thickness_mm);
}

JointResult calibrate_joint(const JointModel& model, double dot_diameter_m,
                            const JointOptions& options) {
  JointResult result;
  JointReport& report = result.report;
  check_views(model, options.known_lenses.has_value(), report.warnings);
  JointFit fit;
  fit.lens = options.lens.value_or(LensTerms::k1_k2);
  fit.lens_known = options.known_lenses.has_value();
  if (fit.lens_known) fit.lens = LensTerms::k1_k2_p1_p2_k3;
  fit.board = options.board.value_or(model.board.measured ? BoardKind::free : BoardKind::bow);
  fit.max_iterations = options.common.max_iterations;
  JointCleaning cleaning;
  cleaning.dot_diameter_m = options.common.correct_eccentricity ? dot_diameter_m : 0;
  cleaning.outlier_sigmas = options.common.outlier_sigmas;
  JointSolution solution = fit_joint(model, fit, cleaning);
  solution =
      fit_joint(chosen(model, solution.model, fit, cleaning, options, report), fit, cleaning);
  report.lens = fit.lens;
  report.board = fit.board;
  const Causes causes = causes_of(solution.model, fit);
  report.alone_px = causes.alone_px;
  report.warnings.insert(report.warnings.end(), causes.warnings.begin(), causes.warnings.end());
  drop_views(solution, fit, cleaning, report.rejected);
  const std::size_t measured = count_points(solution.model);
  const JointModel all_points = solution.model;
  const double gross_m = options.common.max_rms_mm * units::mm;
  const std::size_t far = points_farther(solution.model, gross_m);
  const std::vector<std::string> outliers = reject_outliers(solution.model, cleaning);
  const std::size_t gross = far - points_farther(solution.model, gross_m);
  report.rejected.insert(report.rejected.end(), outliers.begin(), outliers.end());
  if (!outliers.empty()) solution = fit_joint(solution.model, fit, cleaning);
  require_points(solution.model, all_points, fit, cleaning);
  report.stages = check_stages(all_points, fit, cleaning);
  if (report.stages) {
    report.warnings.insert(report.warnings.end(), report.stages->findings.begin(),
                           report.stages->findings.end());
  }
  report.iterations = solution.iterations;
  report.points = static_cast<int>(count_points(solution.model));
  report.max_eccentricity_px = largest_eccentricity(solution.model);
  add_uncertainty(solution, fit, cleaning, options, result);
  Calibration& calibration = result.calibration;
  calibration.method = "joint";
  for (const Placement& placement : solution.model.placements)
    calibration.sets.push_back(placement.set);
  double sum = 0;
  for (std::size_t c = 0; c < solution.model.cameras.size(); ++c) {
    calibration.cameras.push_back(
        calibrated_camera(solution.model, c, calibration.joint_covariance));
    report.cameras.push_back(camera_report(solution.model, c, calibration.cameras.back()));
    sum += std::pow(report.cameras.back().rms_px, 2) * report.cameras.back().points;
  }
  report.rms_px = std::sqrt(sum / report.points);
  const bool has_covariance = calibration.joint_covariance.size() > 0;
  if (has_covariance) {
    report.volume_sd_mm = volume_sd_mm(calibration, grid_of(drape_volume(solution.model), 3));
    report.next_view = next_view(calibration, solution.model, report);
  }
  if (fit.board == BoardKind::free && has_covariance)
    report.plate = measured_plate(solution.model, fit, report.view_inflation, report.print);
  if (report.plate) report.print_sd = report.plate->common_covariance.diagonal().cwiseSqrt();
  const std::string not_square = judge_squares(solution.model, calibration, report);
  report.status =
      joint_status(report, solution.converged, has_covariance, gross, measured, options.common);
  const bool contradicted = report.stages && !report.stages->contradiction.empty();
  if (!causes.fatal.empty() && !(contradicted && report.stages->other_unit())) {
    report.status = causes.fatal;
  } else if (contradicted) {
    report.status = report.good() ? report.stages->contradiction
                                  : report.stages->contradiction + "; " + report.status;
  } else if (!not_square.empty()) {
    report.status = report.good() ? not_square : not_square + "; " + report.status;
  } else if (!report.good() && !causes.warnings.empty()) {
    report.status += "; a likely cause: " + causes.warnings.front();
  }
  warn_of_views(solution.model, report.warnings);
  if (!report.good()) calibration.warnings.push_back(report.status);
  calibration.warnings.insert(calibration.warnings.end(), report.warnings.begin(),
                              report.warnings.end());
  for (const std::string& rejected : report.rejected)
    calibration.warnings.push_back("rejected " + rejected);
  return result;
}

JointResult calibrate_joint(const Detections& detections, const Rig& rig, const Target& target,
                            const JointOptions& options) {
  check_record(options.common);
  check_record(options);
  // Without stages the print's scale comes from the lengths, else from the heights.
  const bool scaled = options.board.value_or(BoardKind::free) == BoardKind::free &&
                      rig.stages.empty() && !target.known_lengths.empty();
  check_known_lengths(target, scaled ? print_sd : 0);
  refuse_sets_twice(rig);
  refuse_pictures_twice({detections, "", sets_of(rig)});
  std::vector<std::string> notes;
  JointModel model =
      joint_frames(detections, options.free_stages ? with_free_stages(rig) : rig, target, notes);
  if (options.known_lenses) {
    use_lenses(model, *options.known_lenses);
  } else {
    check_places(model);
  }
  const JointModel all = model;
  const std::vector<std::string> dropped =
      start_joint(model, {options.known_lenses.has_value(), options.thickness_mm * units::mm});
  const std::string unconfirmed = unconfirmed_labels(target, all, model);
  notes.insert(notes.end(), dropped.begin(), dropped.end());
  JointOptions with_scale = options;
  if (scaled)
    take_lengths(model, target);
  else
    with_scale.scale_uncertainty = scale_uncertainty(target);
  JointResult result = calibrate_joint(model, target.dot_diameter_m, with_scale);
  if (target.known_lengths.empty() && !result.report.stages) {
    const std::string unchecked =
        "nothing checks the scale: two heights of a z stage, or [known_length] in the target's "
        "file, would show a wrong pitch_mm";
    result.report.warnings.push_back(unchecked);
    result.calibration.warnings.push_back(unchecked);
  }
  std::string exchanged = exchanged_views(all, model);
  // Exchanged cameras on opposite sides look like one with rotated labels.
  if (!exchanged.empty() && !unconfirmed.empty()) exchanged += "; or " + unconfirmed;
  if (!exchanged.empty()) {
    result.report.status =
        result.report.good() ? exchanged : exchanged + "; " + result.report.status;
    result.calibration.warnings.insert(result.calibration.warnings.begin(), exchanged);
  } else if (!unconfirmed.empty()) {
    result.report.status = unconfirmed;
    result.calibration.warnings.insert(result.calibration.warnings.begin(), unconfirmed);
  } else if (const std::string lost = lost_stages(all, model); !lost.empty()) {
    result.report.status = result.report.good() ? lost : result.report.status + "; " + lost;
    result.calibration.warnings.insert(result.calibration.warnings.begin(), lost);
  }
  result.report.print_scale = print_scale_line(target);
  result.calibration.rig = rig.name;
  result.report.rejected.insert(result.report.rejected.end(), notes.begin(), notes.end());
  for (const std::string& note : notes) result.calibration.warnings.push_back(note);
  return result;
}

}  // namespace drape::calib
