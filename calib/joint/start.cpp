// SPDX-License-Identifier: Apache-2.0
#include "calib/joint/start.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/geometry/next_pose.hpp"
#include "core/geometry/rigid_motion.hpp"
#include "core/geometry/vectors.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::calib {

using Eigen::Matrix3d, Eigen::Vector2d;

namespace {

/// Common focal length (px) of views of a plane, for a given principal point, from the
/// orthogonality and equal length of the plane's axes (Zhang 1998). nullopt if no view is tilted
/// enough for its vanishing points to determine a focal length.
std::optional<double> focal_px_of(const std::vector<Matrix3d>& homographies,
                                  const Vector2d& principal_px) {
  double square = 0, product = 0;  // sums of a a and a b for the equations a x = b, x = 1/f^2
  for (const Matrix3d& raw : homographies) {
    Matrix3d h = raw;
    h.row(0) -= principal_px.x() * raw.row(2);
    h.row(1) -= principal_px.y() * raw.row(2);
    h /= std::sqrt(h.block<2, 2>(0, 0).norm());
    h /= h.block<2, 2>(0, 0).norm();
    const Vector2d a1 = h.block<2, 1>(0, 0), a2 = h.block<2, 1>(0, 1);
    const double z1 = h(2, 0), z2 = h(2, 1);
    // a1.a2 / f^2 + z1 z2 = 0 and (|a1|^2 - |a2|^2) / f^2 + z1^2 - z2^2 = 0
    const double a[2] = {a1.dot(a2), a1.squaredNorm() - a2.squaredNorm()};
    const double b[2] = {-z1 * z2, z2 * z2 - z1 * z1};
    for (int i = 0; i < 2; ++i) {
      square += a[i] * a[i];
      product += a[i] * b[i];
    }
  }
  const double inverse = product / square;
  if (!(inverse > 0) || !std::isfinite(inverse)) return std::nullopt;
  return 1 / std::sqrt(inverse);
}

/// Fewer views do not determine a lens with distortion.
constexpr std::size_t kLeastViewsOfALens = 3;

struct Homography {
  std::size_t frame = 0;
  Matrix3d matrix;
};

std::vector<Homography> homographies_of(const JointModel& model, std::size_t camera,
                                        bool lens_known, std::vector<std::string>& dropped) {
  std::vector<Homography> found;
  for (std::size_t f = 0; f < model.frames.size(); ++f) {
    if (model.frames[f].camera != camera) continue;
    const std::vector<TargetPoint>& points = model.frames[f].points;
    const auto homography = homography_of(
        lens_known ? without_lens(model.cameras[camera].camera.model, points) : points);
    if (homography) {
      found.push_back({f, *homography});
    } else {
      dropped.push_back(name_of_view(model, model.frames[f]) +
                        ": not used, the target's points of this view lie on one line");
    }
  }
  return found;
}

/// Common focal length of all views; if a bad view spoils it, the median of single-view results.
std::optional<double> focal_px(const std::vector<Homography>& views, const Vector2d& middle) {
  std::vector<Matrix3d> all;
  std::vector<double> own;
  for (const Homography& view : views) {
    all.push_back(view.matrix);
    if (const auto focal = focal_px_of({view.matrix}, middle)) own.push_back(*focal);
  }
  if (const auto focal = focal_px_of(all, middle)) return focal;
  if (2 * own.size() <= views.size()) return std::nullopt;
  return median(own);
}

/// The camera's own views; the first one defines the world.
JointModel own_views(const JointModel& model, std::size_t camera, const SeenTargets& views,
                     std::vector<std::size_t>& frames) {
  JointModel own;
  own.board = model.board;
  own.cameras = {model.cameras[camera]};
  own.cameras[0].camera.cam_from_world = {};
  for (std::size_t f = 0; f < model.frames.size(); ++f) {
    if (!views[f]) continue;
    const CamFromTarget& pose = views[f]->cam_from_target;
    own.frames.push_back({0, own.placements.size(), model.frames[f].points});
    own.placements.push_back({model.placements[model.frames[f].placement].set,
                              {pose.rotation, pose.translation_m},
                              own.placements.empty()});
    frames.push_back(f);
  }
  return own;
}

bool plausible(const JointCamera& camera, double start_focal_px) {
  const auto& lens = std::get<BrownLens>(camera.camera.model.lens);
  const double ratio = lens.fx_px / start_focal_px;
  return ratio > 0.2 && ratio < 5 && lens.fy_px > 0 && lens.cx_px > 0 && lens.cy_px > 0 &&
         lens.cx_px < camera.camera.model.width_px && lens.cy_px < camera.camera.model.height_px;
}

/// Refines lens and poses, keeping the start if that fails. Drops views that remain outliers.
void refine(JointModel& model, std::size_t index, bool lens_known, SeenTargets& alone,
            std::vector<std::string>& dropped, LensTerms lens) {
  JointFit fit;
  fit.lens = lens;
  fit.board = BoardKind::drawn;
  fit.lens_known = lens_known;
  const double start_focal_px = std::get<BrownLens>(model.cameras[index].camera.model.lens).fx_px;
  for (;;) {
    std::vector<std::size_t> frames;
    JointModel own = own_views(model, index, alone, frames);
    if (!lens_known && frames.size() < kLeastViewsOfALens) return;
    JointSolution solution = fit_joint(own, fit, {});
    if (!solution.converged || !plausible(solution.model.cameras[0], start_focal_px)) return;
    const std::vector<std::size_t> off = frames_off(solution.model, {});
    if (!off.empty() && frames.size() - off.size() >= kLeastViewsOfALens) {
      for (const std::size_t i : off) {
        alone[frames[i]].reset();
        dropped.push_back(name_of_view(model, model.frames[frames[i]]) +
                          ": not used, most of its points lie off the camera's other views");
      }
      continue;
    }
    model.cameras[index].camera.model.lens = solution.model.cameras[0].camera.model.lens;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      alone[frames[i]]->cam_from_target = solution.model.cameras[0].camera.cam_from_world *
                                          solution.model.placements[i].world_from_target;
    }
    return;
  }
}

/// A rigid motion without compile-time frames, since this file chains many of them.
using Motion = Pose<frame::World, frame::World>;

template <class To, class From>
To as(const From& pose) {
  return {pose.rotation, pose.translation_m};
}

/// Distance between two motions: rotation angle (rad) plus shift relative to the distance.
double apart(const Motion& a, const Motion& b) {
  const double turn = Eigen::AngleAxisd(a.rotation.transpose() * b.rotation).angle();
  const double size = std::max(a.translation_m.norm(), b.translation_m.norm()) + 1e-9;
  return turn + (a.translation_m - b.translation_m).norm() / size;
}

/// The candidate nearest to all others, robust against a minority of wrong ones.
Motion majority(const std::vector<Motion>& candidates) {
  std::size_t best = 0;
  double least = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    double sum = 0;
    for (const Motion& other : candidates) sum += std::min(apart(candidates[i], other), 0.5);
    if (sum < least) {
      least = sum;
      best = i;
    }
  }
  return candidates[best];
}

/// Pose of the target in the camera frame, by frame of the model; nullopt for a dropped frame.
using Poses = std::vector<std::optional<Motion>>;

Where where_of(const JointModel& model, std::size_t frame) {
  return {.camera = model.cameras[model.frames[frame].camera].camera.name,
          .set = model.placements[model.frames[frame].placement].set};
}

/// Visible face of the target: by camera in most of its views, and by frame.
struct Sides {
  std::vector<bool> mostly_behind, behind;

  [[nodiscard]] bool unusual(const JointModel& model, std::size_t frame) const {
    return behind[frame] != mostly_behind[model.frames[frame].camera];
  }
};

Poses poses_of_camera_views(JointModel& model, const StartOptions& options, Sides& sides,
                            std::vector<std::string>& dropped) {
  Poses poses(model.frames.size());
  sides.mostly_behind.assign(model.cameras.size(), false);
  sides.behind.assign(model.frames.size(), false);
  for (std::size_t c = 0; c < model.cameras.size(); ++c) {
    const SeenTargets alone = solve_alone(model, c, options.lens_known, dropped, options.lens);
    int back = 0, front = 0;
    for (std::size_t f = 0; f < poses.size(); ++f) {
      if (!alone[f]) continue;
      const CamFromTarget& pose = alone[f]->cam_from_target;
      poses[f] = as<Motion>(pose);
      sides.behind[f] = alone[f]->from_behind;
      ++(sides.behind[f] ? back : front);
    }
    sides.mostly_behind[c] = back > front;
  }
  return poses;
}

[[noreturn]] void refuse_mirrored(const JointModel& model, std::size_t camera) {
  for (std::size_t f = 0; f < model.frames.size(); ++f) {
    if (model.frames[f].camera != camera) continue;
    throw bad_input("the target's points are mirrored: their x, y, z are left-handed",
                    where_of(model, f),
                    "check that the image is not mirrored and that rows and columns of the "
                    "target file run along +y and +x, z out of the printed face");
  }
  throw bad_input("no view of the target", {}, "record the target");
}

std::optional<std::size_t> frame_at(const JointModel& model, const Poses& poses, std::size_t camera,
                                    std::size_t placement) {
  for (std::size_t f = 0; f < model.frames.size(); ++f) {
    if (model.frames[f].camera == camera && model.frames[f].placement == placement && poses[f])
      return f;
  }
  return std::nullopt;
}

/// Largest distance of two consistent estimates of one motion (see apart()).
constexpr double kAgree = 0.1;

/// Fraction of the candidates that agree with the best one.
double agreement(const Motion& best, const std::vector<Motion>& candidates) {
  const auto close = std::count_if(candidates.begin(), candidates.end(),
                                   [&](const Motion& m) { return apart(best, m) < kAgree; });
  return static_cast<double>(close) / static_cast<double>(candidates.size());
}

/// Removes views of a camera's less frequent side unless another camera confirms them, since their
/// labels are mirrored; views of a two-sided target are confirmed.
void drop_mirrored(const JointModel& model, const std::vector<Motion>& cameras, const Sides& sides,
                   Poses& poses, std::vector<std::string>& dropped) {
  std::vector<std::size_t> mirrored;
  for (std::size_t f = 0; f < poses.size(); ++f) {
    if (!poses[f] || !sides.unusual(model, f)) continue;
    const JointFrame& frame = model.frames[f];
    bool confirmed = false;
    for (std::size_t other = 0; other < cameras.size(); ++other) {
      const auto its =
          other == frame.camera ? std::nullopt : frame_at(model, poses, other, frame.placement);
      if (!its) continue;
      const Motion seen = *poses[f] * poses[*its]->inverse();
      const Motion found = cameras[frame.camera] * cameras[other].inverse();
      confirmed = confirmed || apart(seen, found) < kAgree;
    }
    if (!confirmed) mirrored.push_back(f);
  }
  for (const std::size_t f : mirrored) {
    poses[f].reset();
    dropped.push_back(name_of_view(model, model.frames[f]) +
                      ": not used, its labels are mirrored against the camera's other views");
  }
}

/// Adds notes about views from behind: a camera that sees through the target, or both of its sides.
void note_sides(const JointModel& model, const Sides& sides, const Poses& poses,
                std::vector<std::string>& notes) {
  for (std::size_t c = 0; c < model.cameras.size(); ++c) {
    int back = 0, all = 0;
    for (std::size_t f = 0; f < poses.size(); ++f) {
      if (!poses[f] || model.frames[f].camera != c) continue;
      ++all;
      back += sides.behind[f];
    }
    const std::string& name = model.cameras[c].camera.name;
    if (back > 0 && back == all) {
      notes.push_back(fmt::format("{}: sees the target from behind in all its views", name));
    } else if (back > 0) {
      notes.push_back(
          fmt::format("{}: sees the target's back in {} of its {} views", name, back, all));
    }
  }
}

/// Pose of each camera relative to camera 0, chained over placements that two cameras see; pairs
/// with most common placements first.
std::vector<Motion> relative_cameras(const JointModel& model, const Poses& poses,
                                     const std::vector<bool>& behind) {
  std::vector<std::optional<Motion>> found(model.cameras.size());
  const auto front = std::find(behind.begin(), behind.end(), false);
  if (front == behind.end()) refuse_mirrored(model, 0);
  found[static_cast<std::size_t>(front - behind.begin())] = Motion{};
  for (;;) {
    std::vector<Motion> most;
    std::size_t next = 0;
    for (std::size_t c = 0; c < found.size(); ++c) {
      if (found[c]) continue;
      std::vector<Motion> candidates;
      for (std::size_t p = 0; p < model.placements.size(); ++p) {
        const auto mine = frame_at(model, poses, c, p);
        for (std::size_t other = 0; mine && other < found.size(); ++other) {
          const auto its = found[other] ? frame_at(model, poses, other, p) : std::nullopt;
          if (its) candidates.push_back(*poses[*mine] * poses[*its]->inverse() * *found[other]);
        }
      }
      if (candidates.size() > most.size()) {
        most = std::move(candidates);
        next = c;
      }
    }
    if (most.empty()) break;
    const Motion best = majority(most);
    if (behind[next]) {
      // Mirrored pictures give each view a different pose; a transparent target gives a common one.
      if (most.size() < 3 || agreement(best, most) <= 0.5) refuse_mirrored(model, next);
    }
    found[next] = best;
  }
  std::vector<Motion> result;
  for (std::size_t c = 0; c < found.size(); ++c) {
    if (!found[c]) {
      if (behind[c]) refuse_mirrored(model, c);
      throw bad_input("this camera has no view of the target in common with the others",
                      {.camera = model.cameras[c].camera.name},
                      "record the target where this camera and another one see it together");
    }
    result.push_back(*found[c]);
  }
  return result;
}

/// Pose of each visible placement relative to camera 0.
Poses placements_before_camera0(const JointModel& model, const Poses& poses,
                                const std::vector<Motion>& cameras) {
  std::vector<std::vector<Motion>> candidates(model.placements.size());
  for (std::size_t f = 0; f < model.frames.size(); ++f) {
    const JointFrame& frame = model.frames[f];
    if (poses[f])
      candidates[frame.placement].push_back(cameras[frame.camera].inverse() * *poses[f]);
  }
  Poses result(candidates.size());
  for (std::size_t p = 0; p < candidates.size(); ++p) {
    if (!candidates[p].empty()) result[p] = majority(candidates[p]);
  }
  return result;
}

double rms_px(const JointModel& model, const JointFrame& frame) {
  double sum = 0;
  for (const TargetPoint& point : frame.points) {
    const auto px = pixel_of(model, frame, point);
    if (!px) return std::numeric_limits<double>::infinity();
    sum += (*px - point.measured_px).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(frame.points.size()));
}

/// Transforms cameras and free placements to the world of the known placements.
void place_in_world(JointModel& model, const std::vector<Motion>& cameras, const Poses& targets) {
  std::vector<Motion> worlds;  // camera0 from world
  for (std::size_t p = 0; p < targets.size(); ++p) {
    if (model.placements[p].known && targets[p])
      worlds.push_back(*targets[p] * as<Motion>(model.placements[p].world_from_target).inverse());
  }
  if (worlds.empty()) {
    throw bad_input("no view of the target in its reference pose", {},
                    "record and detect the sets of [[calibration.stage]]");
  }
  const Motion world = majority(worlds);
  for (std::size_t c = 0; c < cameras.size(); ++c)
    model.cameras[c].camera.cam_from_world = as<CamFromWorld>(cameras[c] * world);
  for (std::size_t p = 0; p < targets.size(); ++p) {
    if (model.placements[p].known || !targets[p]) continue;
    model.placements[p].world_from_target = as<WorldFromTarget>(world.inverse() * *targets[p]);
  }
}

/// Views with wrong labels, which are off by a large part of the target's image.
std::vector<std::size_t> contradicting_views(const JointModel& model, const Poses& poses,
                                             std::vector<std::string>& dropped) {
  std::vector<std::size_t> found;
  for (std::size_t f = 0; f < model.frames.size(); ++f) {
    if (!poses[f]) continue;
    const JointFrame& frame = model.frames[f];
    Eigen::AlignedBox2d box;
    for (const TargetPoint& p : frame.points) box.extend(p.measured_px);
    const double off = rms_px(model, frame), size = box.diagonal().norm();
    if (off < contradicting_part * size) continue;
    found.push_back(f);
    dropped.push_back(fmt::format(
        "{}: not used, it contradicts the other views by {} of the target's size (turned corner "
        "order, a wrong height, or a camera or target that moved)",
        name_of_view(model, model.frames[f]),
        std::isfinite(off) ? fmt::format("{:.0f} %", 100 * off / size) : "more than 100 %"));
  }
  return found;
}

/// Throws if a camera contradicts the others in most views: the remaining views do not suffice.
void refuse_majority(const JointModel& model, const Poses& poses) {
  std::vector<int> all(model.cameras.size(), 0), kept(model.cameras.size(), 0);
  for (std::size_t f = 0; f < model.frames.size(); ++f) {
    ++all[model.frames[f].camera];
    kept[model.frames[f].camera] += poses[f] ? 1 : 0;
  }
  for (std::size_t c = 0; c < all.size(); ++c) {
    if (2 * kept[c] >= all[c]) continue;
    throw bad_input(fmt::format("{} of {} views contradict the other views (turned corner order, a "
                                "wrong height, or a camera that moved)",
                                all[c] - kept[c], all[c]),
                    {.camera = model.cameras[c].camera.name},
                    "look at its views; detect them again or take their sets out of the rig file");
  }
}

/// Makes the first visible placement the world if there is no stage.
void hold_the_world(JointModel& model, const Poses& poses) {
  if (!model.world_by_first_view) return;
  bool held = false;
  for (std::size_t p = 0; p < model.placements.size(); ++p) {
    bool seen = false;
    for (std::size_t f = 0; f < model.frames.size(); ++f)
      seen = seen || (model.frames[f].placement == p && poses[f]);
    model.placements[p].known = seen && !held;
    held = held || seen;
    if (model.placements[p].known) model.placements[p].world_from_target = {};
  }
}

constexpr std::size_t kLeastDots = 4;  ///< least number of dots for a frame's pose

/// Default standard deviation of a printed point, in pitches.
constexpr double kPointError = 0.01;

Board board_of(const Target& target) {
  Board board;
  const Eigen::Vector3d corner =
      target.point_in_target({target.rows - 1, target.cols - 1}).cwiseAbs();
  board.half_m = corner.head<2>();
  const std::vector<Eigen::Vector3d> points = points_of(target);
  for (const Eigen::Vector3d& point : points)
    board.mean += point.head<2>().cwiseQuotient(board.half_m).cwiseAbs2();
  board.mean /= target.rows * target.cols;
  board.drawn = points;
  if (target.measured) {
    for (const Eigen::Vector3d& sd_m : target.measured->sd_m)
      board.point_sd_mm.push_back(sd_m / units::mm);
    board.measured = board.error_stated = true;
    const auto& covariance = target.measured->common_covariance;
    std::vector<int> stated;
    for (int i = 0; i < board_parameters; ++i)
      if (covariance(i, i) > 0) stated.push_back(i);
    const Eigen::MatrixXd inverse =
        inverse_of_information(Eigen::MatrixXd(covariance(stated, stated)));
    if (inverse.size() > 0) board.information(stated, stated) = inverse;
    return board;
  }
  board.error_stated = target.print_error_m.has_value();
  const double sd_mm = target.print_error_m.value_or(kPointError * target.pitch_m) / units::mm;
  board.point_sd_mm.assign(points.size(), Eigen::Vector3d::Constant(sd_mm));
  board.information(2, 2) = board.information(3, 3) = 1 / (print_sd * print_sd);
  return board;
}

std::vector<Placement> placements_of(const Rig& rig) {
  std::vector<Placement> placements;
  for (const TargetStage& stage : rig.stages) {
    Placement placement{stage.set, {}, true};
    placement.world_from_target.translation_m.z() = stage.z_m;
    placements.push_back(placement);
  }
  for (const std::string& set : rig.free_poses) placements.push_back({set, {}, false});
  return placements;
}

}  // namespace

std::optional<Matrix3d> homography_of(const std::vector<TargetPoint>& points) {
  std::vector<Vector2d> from, to;
  for (const TargetPoint& p : points) {
    from.emplace_back(p.point_in_target.head<2>());
    to.emplace_back(p.measured_px);
  }
  return homography(from, to);
}

SeenTarget planar_pose(const Matrix3d& homography, double focal_px, const Vector2d& principal_px) {
  Matrix3d inverse_k;
  inverse_k << 1 / focal_px, 0, -principal_px.x() / focal_px, 0, 1 / focal_px,
      -principal_px.y() / focal_px, 0, 0, 1;
  Matrix3d a = inverse_k * homography;
  a *= 2 / (a.col(0).norm() + a.col(1).norm());
  Matrix3d axes;
  axes << a.col(0), a.col(1), a.col(0).cross(a.col(1));
  SeenTarget pose;
  pose.cam_from_target = {nearest_rotation(axes), a.col(2)};
  pose.from_behind = pose.cam_from_target.rotation.col(2).dot(a.col(2)) > 0;
  return pose;
}

std::vector<TargetPoint> without_lens(const CameraModel& camera, std::vector<TargetPoint> points) {
  std::vector<TargetPoint> straight;
  for (TargetPoint& point : points) {
    const auto ray = unproject(camera, point.measured_px);
    if (!ray || !(ray->z() > 0)) continue;
    point.measured_px = ray->head<2>() / ray->z();
    straight.push_back(point);
  }
  return straight;
}

SeenTargets solve_alone(JointModel& model, std::size_t index, bool lens_known,
                        std::vector<std::string>& dropped, LensTerms lens) {
  Camera& camera = model.cameras[index].camera;
  const std::vector<Homography> homographies = homographies_of(model, index, lens_known, dropped);
  if (homographies.empty()) {
    throw bad_input("no view of the target by this camera", {.camera = camera.name},
                    "record the target where this camera sees it, then run `drape detect "
                    "--surface target`; a chessboard's rows and cols count inner corners, one less "
                    "than squares");
  }
  double focal = 1;
  Vector2d middle = Vector2d::Zero();
  if (!lens_known) {
    middle = {(camera.model.width_px - 1) / 2.0, (camera.model.height_px - 1) / 2.0};
    const auto found = focal_px(homographies, middle);
    if (!found) {
      throw bad_input(
          "the focal length cannot be separated from the distance: the target lies parallel "
          "to the image in all views",
          {.camera = camera.name},
          "add views with the target tilted by 30 degrees or more, to both sides");
    }
    focal = *found;
    camera.model.lens = BrownLens{focal, focal, middle.x(), middle.y(), 0, 0, 0, 0, 0};
  }
  SeenTargets alone(model.frames.size());
  for (const Homography& view : homographies) {
    alone[view.frame] = planar_pose(view.matrix, focal, middle);
  }
  refine(model, index, lens_known, alone, dropped, lens);
  return alone;
}

void drop_unseen_placements(JointModel& model) {
  std::vector<Placement> seen;
  std::vector<std::size_t> where(model.placements.size());
  for (std::size_t p = 0; p < model.placements.size(); ++p) {
    where[p] = seen.size();
    if (std::any_of(model.frames.begin(), model.frames.end(),
                    [&](const JointFrame& frame) { return frame.placement == p; }))
      seen.push_back(model.placements[p]);
  }
  for (JointFrame& frame : model.frames) frame.placement = where[frame.placement];
  model.placements = std::move(seen);
  const bool held = std::any_of(model.placements.begin(), model.placements.end(),
                                [](const Placement& placement) { return placement.known; });
  if (held || !model.world_by_first_view || model.placements.empty()) return;
  const WorldFromTarget first = model.placements.front().world_from_target;
  const Pose<frame::World, frame::World> to_old{first.rotation, first.translation_m};
  for (Placement& placement : model.placements)
    placement.world_from_target = to_old.inverse() * placement.world_from_target;
  for (JointCamera& camera : model.cameras)
    camera.camera.cam_from_world = camera.camera.cam_from_world * to_old;
  model.placements.front().known = true;
  model.placements.front().world_from_target = {};
}

JointModel joint_frames(const Detections& detections, const Rig& rig, const Target& target,
                        std::vector<std::string>& notes) {
  check_lattice(detections, rig, target);
  JointModel model;
  model.board = board_of(target);
  model.placements = placements_of(rig);
  for (const RigCamera& rig_camera : rig.cameras) {
    JointCamera camera;
    camera.square_sd = rig_camera.square_pixels.value_or(0);
    camera.camera.name = rig_camera.name;
    camera.camera.model = {BrownLens{}, rig_camera.width_px, rig_camera.height_px};
    model.cameras.push_back(camera);
  }
  for (std::size_t p = 0; p < model.placements.size(); ++p) {
    for (std::size_t c = 0; c < model.cameras.size(); ++c) {
      const std::string& set = model.placements[p].set;
      const std::string& name = rig.cameras[c].name;
      const FrameDetections* frame = find_frame(detections, set, name);
      const std::size_t dots = frame == nullptr ? 0 : frame->detections.size();
      if (dots < kLeastDots) {
        notes.push_back(fmt::format("set {}, {}: {} dots, not used (a view needs {})", set, name,
                                    dots, kLeastDots));
        continue;
      }
      check_frame(*frame, rig.cameras[c]);
      JointFrame used{c, p, {}};
      for (const Detection& d : frame->detections) {
        check_detection(d, *frame);
        used.points.push_back(
            {d.mark, target.point_in_target(d.mark), d.centre_px, d.covariance_px2});
        used.points.back().place = place_of(target, d.mark);
      }
      model.frames.push_back(std::move(used));
    }
  }
  model.world_by_first_view = rig.stages.empty();
  drop_unseen_placements(model);
  return model;
}

std::vector<std::string> start_joint(JointModel& model, const StartOptions& options) {
  std::vector<std::string> dropped;
  Sides sides;
  Poses poses = poses_of_camera_views(model, options, sides, dropped);
  drop_mirrored(model, relative_cameras(model, poses, sides.mostly_behind), sides, poses, dropped);
  for (;;) {
    hold_the_world(model, poses);
    const std::vector<Motion> cameras = relative_cameras(model, poses, sides.mostly_behind);
    place_in_world(model, cameras, placements_before_camera0(model, poses, cameras));
    const std::vector<std::size_t> contradicting = contradicting_views(model, poses, dropped);
    for (const std::size_t f : contradicting) poses[f].reset();
    if (contradicting.empty()) break;
  }
  refuse_majority(model, poses);
  note_sides(model, sides, poses, dropped);
  const auto front = static_cast<int>(model.board.point_sd_mm.size());
  bool two_sided = false;
  std::vector<JointFrame> kept;
  for (std::size_t f = 0; f < model.frames.size(); ++f) {
    if (!poses[f]) continue;
    if (sides.behind[f] && options.thickness_m > 0) {
      for (TargetPoint& point : model.frames[f].points) {
        point.point_in_target.z() -= options.thickness_m;
        if (point.place >= 0) point.place += front;  // on the other print
      }
      two_sided = true;
    }
    kept.push_back(std::move(model.frames[f]));
  }
  model.frames = std::move(kept);
  if (two_sided && front > 0) {
    model.board.point_sd_mm.resize(2 * model.board.drawn.size(), model.board.point_sd_mm.front());
    std::vector<Eigen::Vector3d> back = model.board.drawn;
    for (Eigen::Vector3d& point : back) point.z() -= options.thickness_m;
    model.board.drawn.insert(model.board.drawn.end(), back.begin(), back.end());
  }
  drop_unseen_placements(model);
  return dropped;
}

}  // namespace drape::calib
