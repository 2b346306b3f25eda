// SPDX-License-Identifier: Apache-2.0
#include "triangulate/triangulate.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.hpp"
#include "core/fields/records.hpp"
#include "core/parallel.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"
#include "triangulate/agreement.hpp"
#include "triangulate/dot_shape.hpp"
#include "triangulate/guards/guards.hpp"
#include "triangulate/islands.hpp"
#include "triangulate/lattice_views.hpp"
#include "triangulate/neighbours.hpp"
#include "triangulate/sheet_report.hpp"

namespace drape::triangulate {
namespace {

using units::deg;

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

void place_all(const std::vector<MarkViews>& marks, const AgreementLimits& limits, int threads,
               std::vector<Placed>& placed) {
  parallel_for(marks.size(), threads, [&](std::size_t i) {
    if (marks[i].views.size() >= 2) placed[i].agreed = solve_with_agreement(marks[i].views, limits);
  });
}

Eigen::Vector3d towards_cameras(const MarkViews& mark, const Eigen::Vector3d& in_world) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const View& view : mark.views)
    sum += (centre_in_world(view.camera->camera) - in_world).normalized();
  return sum.normalized();
}

/// Solves again with dot shapes predicted from the measured surface around each mark; the agreement
/// of the views is only tested after that.
CurvatureTrust correct_shape(const std::vector<MarkViews>& marks, const AgreementLimits& limits,
                             const MarkLattice& lattice, int threads, std::vector<Placed>& placed) {
  MarksOnSurface surface = surface_of(marks, placed, lattice.dot_diameter_m, threads);
  const MarksOnSurface first = surface;
  const CurvatureTrust trust = curvature_trust(surface, lattice.pitch_m);
  for (int round = 0; round < kShapeRounds; ++round) {
    parallel_for(marks.size(), threads, [&](std::size_t i) {
      const auto here = surface.find(marks[i].mark);
      if (here == surface.end()) return;
      const Eigen::Vector3d& at = here->second.in_world;
      const SurfacePatch patch =
          surface_patch(surface, marks[i].mark, lattice.pitch_m, towards_cameras(marks[i], at));
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
  return trust;
}

SheetMark sheet_mark(const MarkViews& mark, const Placed& placed, const MarkLattice& lattice) {
  const Point& point = *placed.agreed.point;
  SheetMark result;
  result.mark = mark.mark;
  result.material_m =
      lattice.margin_m + lattice.pitch_m * Eigen::Vector2d(mark.mark.row, mark.mark.col);
  result.point_in_world = point.in_world;
  result.covariance_m2 = point.covariance_m2();
  result.views = static_cast<int>(placed.agreed.used.size());
  result.reprojection_px = point.rms_px();
  return result;
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
               ? too_few_views(marks[i], lookers_at(marks[i].mark, sheet.marks, cameras))
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
  place_all(marks, limits, options.threads, placed);
  if (options.correct_dot_shape) {
    result.report.hidden_bend_per_m =
        correct_shape(marks, limits, lattice, options.threads, placed).least_per_m;
  }
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
  note_calibration(calibration, detections.rig, report);
  std::vector<std::string> contradictions = options.contradictions;
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

}  // namespace drape::triangulate
