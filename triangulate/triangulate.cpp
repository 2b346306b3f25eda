// SPDX-License-Identifier: Apache-2.0
#include "triangulate/triangulate.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/files/files.hpp"
#include "core/parallel.hpp"
#include "core/statistics/sample.hpp"
#include "triangulate/dots.hpp"
#include "triangulate/guards/guards.hpp"
#include "triangulate/islands.hpp"

namespace drape::triangulate {

using units::deg;
using units::mm;

namespace {

/// Position and printed side of a mark without a point.
struct Facing {
  Eigen::Vector3d at, face;
  double bending = 0;  ///< squared distances (m^2) of marks from its plane, by (steps^2)^2
};

using Near = std::vector<const SheetMark*>;

/// Facing by the four measured marks beside a mark; nullopt if one of them is a gap, since beyond
/// the measured marks a fold may turn the cloth any way.
std::optional<Facing> facing_by_neighbours(MarkId mark, const Near& near) {
  const auto beside = [&](int rows, int cols) -> const SheetMark* {
    const auto found = std::ranges::find(near, MarkId{mark.row + rows, mark.col + cols},
                                         [](const SheetMark* other) { return other->mark; });
    return found == near.end() ? nullptr : *found;
  };
  const SheetMark *up = beside(-1, 0), *down = beside(1, 0), *left = beside(0, -1),
                  *right = beside(0, 1);
  if (!up || !down || !left || !right) return std::nullopt;
  const Eigen::Vector3d along = down->point_in_world - up->point_in_world,
                        across = right->point_in_world - left->point_in_world;
  return Facing{
      (up->point_in_world + down->point_in_world + left->point_in_world + right->point_in_world) /
          4,
      along.cross(across).normalized()};
}

/// Two facings by the ellipse of a dot's only view: its size gives the distance, its shape two
/// normals. First the one whose tangent plane the measured marks near it lie nearer to, as far as
/// bending lifts marks off a plane, by the square of the steps. Empty without either.
std::vector<Facing> facings_by_ellipse(const View& view, MarkId mark, const Near& near,
                                       double radius_m) {
  const Camera& camera = view.camera->camera;
  const auto ray = unproject(camera.model, view.px);
  const auto image = ray ? project(camera.model, *ray) : std::nullopt;
  if (!image || near.empty() || !(view.semi_axes_px.minCoeff() > 0)) return {};
  // Derivative of pixels at a distance of one radius, where a dot spans map (1 - n n') map'.
  const Eigen::Matrix<double, 2, 3>& map = image->d_px_d_point;
  const Eigen::Matrix2d shape = view.shape_px2();
  const Eigen::Matrix2d sphere = map * map.transpose();
  const double squared =
      Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix2d>(sphere, shape).eigenvalues()(0);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> rest(sphere - squared * shape);
  const Eigen::Vector3d across = map.transpose() * sphere.inverse() *
                                 std::sqrt(std::max(0.0, rest.eigenvalues()(1))) *
                                 rest.eigenvectors().col(1);
  const Eigen::Matrix3d world_from_cam = camera.cam_from_world.rotation.transpose();
  std::vector<Facing> facings;
  for (const double side : {1.0, -1.0}) {
    Facing& facing = facings.emplace_back();
    facing.at = centre_in_world(camera) + std::sqrt(squared) * radius_m * (world_from_cam * *ray);
    facing.face = world_from_cam *
                  (side * across - std::sqrt(std::max(0.0, 1 - across.squaredNorm())) * *ray);
    for (const SheetMark* other : near) {
      const MarkId step = other->mark - mark;
      facing.bending += std::pow(facing.face.dot(other->point_in_world - facing.at) /
                                     (step.row * step.row + step.col * step.col),
                                 2);
    }
  }
  if (facings[1].bending < facings[0].bending) std::swap(facings[0], facings[1]);
  return facings;
}

/// A camera that has a mark without a point within its image.
struct Looker {
  std::string camera;
  double angle_deg = 0;  ///< angle from the normal of the printed side; the back from 90 degrees on
};

/// Cameras, except the mark's own, that have it within their image.
std::vector<Looker> lookers_at(const Facing& facing, const MarkViews& mark,
                               const std::vector<const CalibratedCamera*>& cameras) {
  std::vector<Looker> lookers;
  for (const CalibratedCamera* calibrated : cameras) {
    const Camera& camera = calibrated->camera;
    const auto seen = project(camera.model, camera.cam_from_world * facing.at);
    if ((!mark.views.empty() && mark.views.front().camera == calibrated) || !seen ||
        seen->px.minCoeff() < 0 || seen->px.x() > camera.model.width_px - 1 ||
        seen->px.y() > camera.model.height_px - 1)
      continue;
    const Eigen::Vector3d towards = (centre_in_world(camera) - facing.at).normalized();
    lookers.push_back(
        {camera.name, std::acos(std::clamp(facing.face.dot(towards), -1.0, 1.0)) / deg});
  }
  return lookers;
}

/// Cameras that look at a mark; occlusion is not considered. nullopt if it is not known where the
/// mark lies and faces.
std::optional<std::vector<Looker>> lookers_at(const MarkViews& mark,
                                              const std::vector<SheetMark>& placed,
                                              const std::vector<const CalibratedCamera*>& cameras,
                                              const MarkLattice& lattice) {
  constexpr int kNearSteps = 2;
  // F(3, 3) at 5 %: a bending has three numbers.
  constexpr double kClearlyFlatter = 9.28;
  Near near;
  for (const SheetMark& other : placed) {
    const MarkId step = other.mark - mark.mark;
    if (std::max(std::abs(step.row), std::abs(step.col)) <= kNearSteps) near.push_back(&other);
  }
  std::vector<Facing> facings;
  if (!mark.views.empty())
    facings = facings_by_ellipse(mark.views.front(), mark.mark, near, lattice.dot_diameter_m / 2);
  if (facings.empty()) {
    const auto facing = facing_by_neighbours(mark.mark, near);
    if (!facing) return std::nullopt;
    facings.push_back(*facing);
  }
  std::vector<Looker> lookers = lookers_at(facings[0], mark, cameras);
  if (facings.size() < 2 || facings[1].bending > kClearlyFlatter * facings[0].bending)
    return lookers;
  // Of two normals that may be, the one at which fewer cameras look that did not measure it.
  std::vector<Looker> others = lookers_at(facings[1], mark, cameras);
  const auto facing = [](const Looker& looker) { return looker.angle_deg < 90; };
  return std::ranges::count_if(others, facing) < std::ranges::count_if(lookers, facing) ? others
                                                                                        : lookers;
}

/// Reason for a gap with fewer than two views, such as "seen by one camera (cam0); its face is
/// turned away from cam1; not measured by cam2 at 71 degrees".
std::string too_few_views(const MarkViews& mark,
                          const std::optional<std::vector<Looker>>& lookers) {
  const std::string* own = mark.views.empty() ? nullptr : &mark.views.front().camera->camera.name;
  std::vector<std::string> looking, behind;
  for (const Looker& looker : lookers.value_or(std::vector<Looker>{})) {
    if (looker.angle_deg < 90)
      looking.push_back(fmt::format("{} at {:.0f} degrees", looker.camera, looker.angle_deg));
    else
      behind.push_back(looker.camera);
  }
  const std::string from = fmt::format("{}", fmt::join(looking, ", "));
  std::string reason = "measured by no camera";
  if (own != nullptr)
    reason = fmt::format("seen by one camera ({})", *own);
  else if (!looking.empty())
    reason = fmt::format(
        "seen by {}, measured by none: {}",
        looking.size() == 1 ? "one camera" : fmt::format("{} cameras", looking.size()), from);
  else if (lookers && mark.refused.empty())
    reason = "seen by no camera: none looks at its printed face";
  if (own != nullptr && !behind.empty())
    reason += fmt::format("; its face is turned away from {}", fmt::join(behind, ", "));
  if (own != nullptr && !looking.empty()) reason += "; not measured by " + from;
  for (const std::string& refused : mark.refused) reason += "; " + refused;
  return reason;
}

/// A triangulated mark, before neighbours may reject it.
struct Placed {
  Agreed agreed;
  double shape_shift_m = 0;
  std::vector<View> shaped_views;  ///< corrected for the dot's shape; empty without correction
};

using ByMark = std::map<MarkId, const SheetMark*>;

constexpr double kNeighbourSigmas = 4;

/// Largest possible distance of two marks `steps` apart, allowing for their uncertainty.
double limit_m(const SheetMark& a, const SheetMark& b, int steps, double pitch_m,
               double max_stretch) {
  const Eigen::Vector3d along = (a.point_in_world - b.point_in_world).normalized();
  const Eigen::Matrix3d covariance = a.covariance_m2.value_or(Eigen::Matrix3d::Zero()) +
                                     b.covariance_m2.value_or(Eigen::Matrix3d::Zero());
  return steps * pitch_m * max_stretch +
         kNeighbourSigmas * std::sqrt(along.dot(covariance * along));
}

/// Neighbours along warp and weft that are farther away than the cloth permits.
std::vector<MarkId> violations(const SheetMark& mark, const ByMark& all, double pitch_m,
                               double max_stretch) {
  constexpr std::array<std::array<int, 2>, 4> kDirections = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
  std::vector<MarkId> found;
  for (const auto& direction : kDirections) {
    for (const int steps : {1, 2}) {
      const auto other =
          all.find({mark.mark.row + steps * direction[0], mark.mark.col + steps * direction[1]});
      if (other == all.end()) continue;
      const double distance = (mark.point_in_world - other->second->point_in_world).norm();
      if (distance > limit_m(mark, *other->second, steps, pitch_m, max_stretch))
        found.push_back(other->first);
    }
  }
  return found;
}

ByMark by_mark(const std::vector<SheetMark>& marks) {
  ByMark all;
  for (const SheetMark& mark : marks) all[mark.mark] = &mark;
  return all;
}

/// Finds marks at impossible positions, with the reason. Cloth hardly stretches along warp and
/// weft, and a chord is never longer than its arc: two marks one or two pitches apart on the print
/// can be closer in space, but never farther apart (White, Crane, Forsyth 2007). Marks that violate
/// this with at least two others are removed one by one, the worst first.
std::map<MarkId, std::string> too_far_from_neighbours(const std::vector<SheetMark>& marks,
                                                      double pitch_m, double max_stretch) {
  ByMark all = by_mark(marks);
  std::map<MarkId, std::string> bad;
  for (;;) {
    MarkId worst;
    std::vector<MarkId> worst_pairs;
    for (const auto& [id, mark] : all) {
      auto pairs = violations(*mark, all, pitch_m, max_stretch);
      if (pairs.size() > worst_pairs.size()) {
        worst = id;
        worst_pairs = std::move(pairs);
      }
    }
    if (worst_pairs.size() < 2) return bad;
    bad[worst] = fmt::format(
        "views disagree with the cloth: farther from {} neighbours than {:g} times their distance "
        "on the print, first from ({}, {})",
        worst_pairs.size(), max_stretch, worst_pairs.front().row, worst_pairs.front().col);
    all.erase(worst);
  }
}

/// Pairs that are too far apart without either mark being more to blame.
std::vector<std::string> suspicious_pairs(const std::vector<SheetMark>& marks, double pitch_m,
                                          double max_stretch) {
  const ByMark all = by_mark(marks);
  std::vector<std::string> pairs;
  for (const auto& [id, mark] : all) {
    for (const MarkId other : violations(*mark, all, pitch_m, max_stretch)) {
      if (!(id < other)) continue;
      const double distance = (mark->point_in_world - all.at(other)->point_in_world).norm();
      pairs.push_back(
          fmt::format("marks ({}, {}) and ({}, {}) are {:.2f} mm apart, more than {:g} "
                      "times their distance on the print",
                      id.row, id.col, other.row, other.col, distance / units::mm, max_stretch));
    }
  }
  return pairs;
}

double rms_sigma_m(const Eigen::Matrix3d& covariance) {
  return std::sqrt(covariance.trace() / 3);
}

/// Residuals of all marks seen by a pair of cameras. Creases and wrong labels affect a few marks, a
/// camera that moved affects most.
struct PairMisses {
  std::vector<double> sigmas, px;
};

/// Root mean square, over the sheet's marks, of each contribution to their covariances.
ErrorBudget budget_of(const std::vector<MarkViews>& marks, const std::vector<Placed>& placed,
                      const Sheet& sheet, bool has_calibration_covariance) {
  double detection = 0, calibration = 0, target = 0, shape = 0;
  bool states_target = false;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    if (sheet.find(marks[i].mark) == nullptr) continue;
    const Point& point = *placed[i].agreed.point;
    detection += point.detection_covariance_m2.trace();
    calibration += point.calibration_covariance_m2.trace();
    target += point.target_covariance_m2.trace();
    shape += point.shape_covariance_m2.trace();
    const InJointCovariance* joint = marks[i].views.front().joint;
    states_target |= joint != nullptr && joint->target != nullptr;
  }
  const auto rms = [&](double sum_m2) {
    return std::sqrt(sum_m2 / static_cast<double>(sheet.marks.size()));
  };
  ErrorBudget budget{rms(detection), std::nullopt, rms(shape),
                     rms(detection + calibration + shape)};
  if (has_calibration_covariance) budget.calibration_m = rms(calibration);
  if (states_target) budget.target_m = rms(target);
  return budget;
}

/// Fills in medians and counts over the sheet's marks, and the views that were left out.
void note_statistics(const std::vector<MarkViews>& marks, const std::vector<Placed>& placed,
                     const Sheet& sheet, TriangulateReport& report) {
  std::vector<double> reprojection, sigma, calibration, agreement, shift;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    const SheetMark* mark = sheet.find(marks[i].mark);
    if (mark == nullptr) continue;
    const Point& point = *placed[i].agreed.point;
    reprojection.push_back(point.rms_px());
    sigma.push_back(rms_sigma_m(*mark->covariance_m2) / mm);
    calibration.push_back(rms_sigma_m(point.calibration_covariance_m2) / mm);
    agreement.push_back(std::sqrt(point.chi2 / point.degrees_of_freedom));
    shift.push_back(placed[i].shape_shift_m / mm);
    const auto views = placed[i].agreed.used.size();
    if (report.marks_by_views.size() <= views) report.marks_by_views.resize(views + 1);
    ++report.marks_by_views[views];
    if (placed[i].agreed.dropped) {
      report.dropped_views.push_back(fmt::format(
          "mark ({}, {}): {} left out, with it the views miss each other by {:.1f} sigma",
          marks[i].mark.row, marks[i].mark.col,
          marks[i].views[*placed[i].agreed.dropped].camera->camera.name,
          placed[i].agreed.disagreement_sigmas));
    }
  }
  if (shift.empty()) return;
  report.largest_shape_shift_mm = *std::max_element(shift.begin(), shift.end());
  report.median_reprojection_px = median(reprojection);
  report.median_sigma_mm = median(sigma);
  report.median_calibration_sigma_mm = median(calibration);
  report.median_chi_per_dof = median(agreement);
  report.median_shape_shift_mm = median(shift);
}

/// Marks known to be less accurate than the rest: a nearby crease or hem leaves the curvature at
/// the dot uncertain, or its views do not quite meet.
std::vector<Doubt> doubts_of(const std::vector<MarkViews>& marks, const std::vector<Placed>& placed,
                             const Sheet& sheet, const TriangulateOptions& options) {
  std::vector<Doubt> doubts;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    const SheetMark* mark = sheet.find(marks[i].mark);
    if (mark == nullptr) continue;
    Doubt doubt{mark->mark, std::nullopt, std::nullopt};
    const double sigma_mm = std::sqrt(mark->covariance_m2->trace()) / mm;
    const double sigmas = placed[i].agreed.point->disagreement_sigmas();
    if (sigma_mm > options.doubt_mm) doubt.sigma_mm = sigma_mm;
    if (sigmas > options.doubt_sigmas) doubt.sigmas = sigmas;
    if (doubt.sigma_mm || doubt.sigmas) doubts.push_back(doubt);
  }
  return doubts;
}

/// Number of marks lost by each camera, and why: views that could not be used, of marks that became
/// gaps for lack of a second view ("cam1 cost 12 marks: saturated; lower its exposure").
std::vector<std::string> costs_of_views(const std::vector<MarkViews>& marks, const Sheet& sheet) {
  constexpr int kLeast = 3;  // fewer are individual dots, not a poor view
  constexpr std::string_view kWord = " rejected it: ";
  std::map<std::pair<std::string, std::string>, int> counts;
  for (const MarkViews& mark : marks) {
    if (mark.views.size() >= 2 || sheet.find(mark.mark) != nullptr) continue;
    for (const std::string& refused : mark.refused) {
      const std::size_t at = refused.find(kWord);
      if (at == std::string::npos) continue;
      const std::string reason = refused.substr(at + kWord.size());
      ++counts[{refused.substr(0, at), reason.substr(0, reason.find_first_of(":;,("))}];
    }
  }
  std::vector<std::string> lines;
  for (const auto& [what, count] : counts) {
    if (count < kLeast) continue;
    const bool bright = what.second.find("saturated") != std::string::npos;
    lines.push_back(fmt::format("{} cost {} marks: {}{}", what.first, count, what.second,
                                bright ? "; lower its exposure or the light" : ""));
  }
  return lines;
}

/// Outer rows and columns of the print of which no camera shows a mark, beside an inner one at
/// least half of which is measured. If straight on from the inner marks at least half of them would
/// lie within a picture, the cloth has no such edge: a contradiction of the print. (Of the 400
/// edges of 100 drawn drapes under bench1's cameras none is out of sight beside a measured one.)
/// Else it may be outside the pictures: a warning.
void note_unseen_edges(const std::vector<MarkViews>& marks, const Sheet& sheet,
                       const std::vector<const CalibratedCamera*>& cameras,
                       std::vector<std::string>& contradictions,
                       std::vector<std::string>& warnings) {
  const auto look = [&](const char* name, int MarkId::*part, int outer, int inner, int others) {
    int beside = 0, within = 0;
    for (const MarkViews& one : marks) {
      if (one.mark.*part != outer) continue;
      if (!one.views.empty() || !one.refused.empty()) return;
      MarkId near = one.mark, next = one.mark;
      near.*part = inner;
      next.*part = 2 * inner - outer;
      const SheetMark *measured = sheet.find(near), *before = sheet.find(next);
      beside += measured != nullptr;
      if (measured == nullptr || before == nullptr) continue;
      const Facing straight_on{2 * measured->point_in_world - before->point_in_world,
                               Eigen::Vector3d::Zero()};
      within += !lookers_at(straight_on, one, cameras).empty();
    }
    if (2 * beside < others) return;
    (2 * within < others ? warnings : contradictions)
        .push_back(fmt::format(
            "no camera shows a mark of {} {}, {} of which would lie within the pictures, and {} of "
            "{} marks of {} {} are measured: if the cloth has no {} {}, correct `{}s` of its print",
            name, outer, within, beside, others, name, inner, name, outer, name));
  };
  for (const bool last : {false, true}) {
    const int row = last ? sheet.rows - 1 : 0, col = last ? sheet.cols - 1 : 0, in = last ? -1 : 1;
    if (sheet.rows > 2) look("row", &MarkId::row, row, row + in, sheet.cols);
    if (sheet.cols > 2) look("col", &MarkId::col, col, col + in, sheet.rows);
  }
}

/// Adds one line about the calibration, whose own ending and file contain the rest, and one if it
/// belongs to another rig than the detections' `rig`.
void note_calibration(const Calibration& calibration, const std::string& rig,
                      TriangulateReport& report) {
  if (calibration.rig != rig)
    report.warnings.push_back(
        fmt::format("the calibration is of rig {}, the marks are of rig {}", calibration.rig, rig));
  const std::vector<std::string>& warnings = calibration.warnings;
  if (warnings.empty()) return;
  std::string text = "calibration: " + warnings.front();
  if (warnings.size() > 1)
    text += fmt::format(" (the first of {} warnings in its file)", warnings.size());
  report.warnings.push_back(text);
}

/// Distance between the rays of each pair of cameras over their common marks, in stated standard
/// deviations, including those of the calibration. A camera that moved since its calibration is off
/// in every mark. Pairs with fewer than `least_marks` common marks are left out.
std::vector<PairAgreement> pair_agreements(const std::vector<MarkViews>& marks,
                                           const std::vector<Placed>& placed, double min_angle_rad,
                                           int least_marks) {
  std::map<std::pair<std::string, std::string>, PairMisses> pairs;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    const std::vector<View>& views =
        placed[i].shaped_views.empty() ? marks[i].views : placed[i].shaped_views;
    for (std::size_t a = 0; a < views.size(); ++a) {
      for (std::size_t b = a + 1; b < views.size(); ++b) {
        const Point point = solve_point({views[a], views[b]}, min_angle_rad);
        if (point.status != PointStatus::good) continue;
        PairMisses& pair = pairs[{views[a].camera->camera.name, views[b].camera->camera.name}];
        pair.sigmas.push_back(point.disagreement_sigmas());
        pair.px.push_back(point.rms_px());
      }
    }
  }
  std::vector<PairAgreement> result;
  for (auto& [cameras, misses] : pairs) {
    if (static_cast<int>(misses.sigmas.size()) < least_marks) continue;
    result.push_back({cameras.first, cameras.second, static_cast<int>(misses.sigmas.size()),
                      median(misses.sigmas), median(misses.px)});
  }
  return result;
}

constexpr int kShapeRounds = 3;

MarksOnSurface surface_of(const std::vector<MarkViews>& marks, const std::vector<Placed>& placed,
                          double dot_diameter_m, int threads) {
  std::vector<std::optional<DotNormal>> normals(marks.size());
  parallel_for(marks.size(), threads, [&](std::size_t i) {
    if (placed[i].agreed.point)
      normals[i] =
          normal_from_ellipses(marks[i].views, placed[i].agreed.point->in_world, dot_diameter_m);
  });
  MarksOnSurface surface;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    if (placed[i].agreed.point)
      surface[marks[i].mark] = {placed[i].agreed.point->in_world, normals[i]};
  }
  return surface;
}

/// Solves again with dot shapes predicted from the measured surface around each mark; the agreement
/// of the views is only tested after that.
void correct_shape(const std::vector<MarkViews>& marks, const AgreementLimits& limits,
                   const MarkLattice& lattice, int threads, std::vector<Placed>& placed) {
  MarksOnSurface surface = surface_of(marks, placed, lattice.dot_diameter_m, threads);
  const MarksOnSurface first = surface;
  const CurvatureTrust trust = curvature_trust(surface, lattice.pitch_m);
  for (int round = 0; round < kShapeRounds; ++round) {
    parallel_for(marks.size(), threads, [&](std::size_t i) {
      const auto here = surface.find(marks[i].mark);
      if (here == surface.end()) return;
      const Eigen::Vector3d& at = here->second.in_world;
      Eigen::Vector3d towards = Eigen::Vector3d::Zero();
      for (const View& view : marks[i].views)
        towards += (centre_in_world(view.camera->camera) - at).normalized();
      const SurfacePatch patch =
          surface_patch(surface, marks[i].mark, lattice.pitch_m, towards.normalized());
      placed[i].shaped_views =
          without_dot_shape(marks[i].views, at, patch, trust, lattice.dot_diameter_m);
      placed[i].agreed = solve_with_agreement(placed[i].shaped_views, limits);
    });
    for (std::size_t i = 0; i < marks.size(); ++i) {
      const auto& point = placed[i].agreed.point;
      if (!point) continue;
      surface.at(marks[i].mark).in_world = point->in_world;
      placed[i].shape_shift_m = (point->in_world - first.at(marks[i].mark).in_world).norm();
    }
  }
}

SheetMark sheet_mark(const MarkViews& mark, const Placed& placed, const MarkLattice& lattice) {
  const Point& point = *placed.agreed.point;
  return {mark.mark,
          lattice.margin_m + lattice.pitch_m * Eigen::Vector2d(mark.mark.row, mark.mark.col),
          point.in_world,
          point.covariance_m2(),
          static_cast<int>(placed.agreed.used.size()),
          point.rms_px()};
}

/// Returns every mark that has a point, including those that neighbours rule out.
std::vector<SheetMark> fill_sheet(const std::vector<MarkViews>& marks,
                                  const std::vector<Placed>& placed, const MarkLattice& lattice,
                                  const TriangulateOptions& options,
                                  const std::vector<const CalibratedCamera*>& cameras,
                                  Sheet& sheet) {
  std::vector<SheetMark> candidates;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    if (placed[i].agreed.point) candidates.push_back(sheet_mark(marks[i], placed[i], lattice));
  }
  const auto bad = too_far_from_neighbours(candidates, lattice.pitch_m, options.max_stretch);
  for (const SheetMark& mark : candidates) {
    if (!bad.contains(mark.mark)) sheet.marks.push_back(mark);
  }
  for (std::size_t i = 0; i < marks.size(); ++i) {
    const auto stretched = bad.find(marks[i].mark);
    if (stretched != bad.end()) {
      sheet.gaps.push_back({marks[i].mark, stretched->second});
    } else if (!placed[i].agreed.point) {
      sheet.gaps.push_back(
          {marks[i].mark,
           marks[i].views.size() < 2
               ? too_few_views(marks[i], lookers_at(marks[i], sheet.marks, cameras, lattice))
               : placed[i].agreed.gap_reason});
    }
  }
  return candidates;
}

Misses misses_of(const std::vector<MarkViews>& marks, const std::vector<Placed>& placed) {
  std::vector<double> all;
  for (std::size_t i = 0; i < marks.size(); ++i)
    if (marks[i].views.size() >= 2) all.push_back(placed[i].agreed.disagreement_sigmas);
  if (all.empty()) return {};
  return {median(all), all.size()};
}

/// Reasons why the sheet is not a valid measurement, first cause first.
std::vector<std::string> reasons_against(const Calibration& calibration,
                                         const std::optional<std::string>& against_detection,
                                         const Sheet& sheet, const TriangulateOptions& options,
                                         const std::vector<std::string>& contradictions,
                                         const std::vector<std::string>& costs) {
  std::vector<std::string> reasons;
  if (calibration.no_go) reasons.push_back("the calibration is NO-GO: " + *calibration.no_go);
  if (against_detection) reasons.push_back(*against_detection);
  for (const std::string& text : contradictions)
    if (std::find(reasons.begin(), reasons.end(), text) == reasons.end()) reasons.push_back(text);
  const int measured = static_cast<int>(sheet.marks.size());
  if (measured < options.min_marks)
    reasons.push_back(fmt::format("{} marks measured, at least {} are needed{}", measured,
                                  options.min_marks, costs.empty() ? "" : "; " + costs.front()));
  return reasons;
}

std::vector<std::string> cameras_of(const Detections& detections, const std::string& set) {
  std::vector<std::string> names;
  for (const FrameDetections& frame : detections.frames) {
    if (frame.set == set) names.push_back(frame.camera);
  }
  return names;
}

/// Adds labels of islands that other views determine, and reports the outcomes.
Detections with_islands(const Detections& detections, const Calibration& calibration,
                        const std::string& set, const TriangulateOptions& options,
                        TriangulateReport& report) {
  const bool any = std::any_of(
      detections.frames.begin(), detections.frames.end(),
      [&](const FrameDetections& frame) { return frame.set == set && !frame.islands.empty(); });
  if (!any || !options.merge_islands || detections.lattice.surface != Surface::cloth)
    return detections;
  IslandOptions limits;
  limits.most_stretch = options.max_stretch;
  limits.min_angle_rad = options.min_angle_deg * deg;
  MergedIslands merged = merge_islands(detections, calibration, set, limits);
  for (const IslandFate& fate : merged.fates) {
    ++report.islands;
    report.merged_islands += fate.merged ? 1 : 0;
    report.merged_dots += fate.merged ? fate.dots : 0;
    report.island_fates.push_back(fmt::format("{}: island {} of {} dots {}", fate.camera,
                                              fate.island, fate.dots, fate.reason));
  }
  return std::move(merged.detections);
}

/// Reports two cameras whose rays miss each other over all marks: a fault of the calibration.
void note_moved_camera(TriangulateReport& report) {
  if (!report.has_calibration_covariance) return;
  for (const PairAgreement& pair : report.pairs) {
    if (pair.good()) continue;
    report.no_go.push_back(fmt::format(
        "{} and {} miss each other by {:.1f} stated standard deviations ({:.2f} px) over {} "
        "marks, limit {:g}: a camera moved since the calibration; calibrate again",
        pair.first, pair.second, pair.median_sigmas, pair.median_px, pair.marks,
        PairAgreement::max_sigmas));
    return;
  }
}

}  // namespace

void fields(Fields& f, TriangulateOptions& o) {
  f.otherwise({"min_marks", "NO-GO if fewer marks are measured", 1, 1}, o.min_marks);
  f.otherwise({"max_sigmas",
               "views of a mark disagree if they differ by more than this many standard deviations",
               1, above_zero},
              o.max_sigmas);
  f.otherwise(
      {"max_stretch",
       "largest distance of adjacent marks along warp and weft, relative to the print's", 1, 1},
      o.max_stretch);
  f.otherwise({"min_angle_deg", "smallest angle between the rays of a mark", 1, above_zero},
              o.min_angle_deg);
  f.otherwise({"floor_px", "error of a dot's centre beyond its detection's own, px", 1, 0},
              o.floor_px);
  f.otherwise(
      {"doubt_mm", "report marks as doubtful if their standard deviation in space exceeds this, mm",
       1, above_zero},
      o.doubt_mm);
  f.otherwise({"doubt_sigmas",
               "also report marks whose views differ by more than this many standard deviations", 1,
               above_zero},
              o.doubt_sigmas);
  bool no_dot_shape = !o.correct_dot_shape, no_islands = !o.merge_islands;
  f.otherwise({"no_dot_shape", "treat the centroid of a dot's image as the image of its centre"},
              no_dot_shape);
  f.otherwise({"no_islands", "do not label separate pieces of the lattice"}, no_islands);
  o.correct_dot_shape = !no_dot_shape;
  o.merge_islands = !no_islands;
}

TriangulateResult triangulate(const Detections& all_detections, const Calibration& calibration,
                              const std::string& set, const TriangulateOptions& options) {
  check_record(options);
  if (all_detections.lattice.surface != Surface::cloth)
    throw bad_input("the detections are of the calibration target, not of a cloth", {.set = set},
                    "give the file that `drape detect --surface cloth` wrote");
  TriangulateResult result;
  const Detections detections =
      with_islands(all_detections, calibration, set, options, result.report);
  const MarkLattice& lattice = detections.lattice;
  const JointPlaces places = joint_places(calibration);
  const auto marks = collect_views(detections, calibration, places, set, options.floor_px);
  const AgreementLimits limits{options.max_sigmas, options.min_angle_deg * deg};
  std::vector<Placed> placed(marks.size());
  parallel_for(marks.size(), options.threads, [&](std::size_t i) {
    if (marks[i].views.size() >= 2) placed[i].agreed = solve_with_agreement(marks[i].views, limits);
  });
  if (options.correct_dot_shape) correct_shape(marks, limits, lattice, options.threads, placed);
  result.sheet.rows = lattice.rows;
  result.sheet.cols = lattice.cols;
  result.sheet.patch_m = lattice.patch_m;
  result.sheet.source = MeasuredSource{detections.rig, set, cameras_of(detections, set), {}, {}};
  std::vector<const CalibratedCamera*> cameras;
  for (const std::string& name : cameras_of(detections, set))
    cameras.push_back(&calibration.camera(name));
  const std::vector<SheetMark> all =
      fill_sheet(marks, placed, lattice, options, cameras, result.sheet);
  TriangulateReport& report = result.report;
  report.measured = static_cast<int>(result.sheet.marks.size());
  report.gaps = static_cast<int>(result.sheet.gaps.size());
  report.has_calibration_covariance = !places.empty();
  for (const CalibratedCamera& camera : calibration.cameras)
    report.has_calibration_covariance |= camera.covariance.size() > 0;
  note_statistics(marks, placed, result.sheet, report);
  report.pairs = pair_agreements(marks, placed, limits.min_angle_rad, options.min_marks);
  if (!result.sheet.marks.empty()) {
    result.sheet.error_budget =
        budget_of(marks, placed, result.sheet, report.has_calibration_covariance);
  }
  report.doubts = doubts_of(marks, placed, result.sheet, options);
  report.warnings = suspicious_pairs(result.sheet.marks, lattice.pitch_m, options.max_stretch);
  const std::vector<std::string> costs = costs_of_views(marks, result.sheet);
  report.warnings.insert(report.warnings.end(), costs.begin(), costs.end());
  std::vector<std::string> contradictions = options.contradictions;
  note_unseen_edges(marks, result.sheet, cameras, contradictions, report.warnings);
  note_calibration(calibration, detections.rig, report);
  const std::vector<std::string> of_marks = contradictions_of(
      detections, calibration, set, options, misses_of(marks, placed), all, result.sheet);
  contradictions.insert(contradictions.end(), of_marks.begin(), of_marks.end());
  report.no_go = reasons_against(calibration, detections.reason_against({set}), result.sheet,
                                 options, contradictions, costs);
  note_moved_camera(report);
  if (report.no_go.empty()) report.unseen = unseen_errors_of(detections, options, result.sheet);
  if (!report.no_go.empty()) result.sheet.no_go = report.no_go.front();
  return result;
}

void note_scene(MeasuredSource& source, const Scene& scene, const RepeatId& repeat) {
  source.asked_scene = {scene.name, scene.document.sha256(),
                        surroundings_of(scene, sha256_of_file)};
  if (!repeat.name.empty()) source.repeat = repeat;
}

}  // namespace drape::triangulate
