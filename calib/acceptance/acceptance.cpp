// SPDX-License-Identifier: Apache-2.0
#include "calib/acceptance/acceptance.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <tuple>

#include "calib/acceptance/figures.hpp"
#include "calib/checks/inputs.hpp"
#include "calib/joint/fit.hpp"
#include "calib/tsai/tsai.hpp"
#include "core/drawing/svg.hpp"
#include "core/program/run_record.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::calib {

using Eigen::Index, Eigen::MatrixXd, Eigen::Vector2d, Eigen::Vector3d;
using units::mm;

namespace {

std::string verdict_of(const AcceptanceFigure& figure) {
  if (figure.good()) return "GO";
  return figure.informs ? "warning" : "NO-GO";
}

std::string row_of(const AcceptanceFigure& figure) {
  if (!figure.not_measured.empty())
    return fmt::format("<tr><td>{}</td><td colspan=\"6\">{}: {}</td></tr>\n", xml(figure.name),
                       figure.may_lack ? "not measured" : "NO-GO, not measured",
                       xml(figure.not_measured));
  return fmt::format(
      "<tr><td>{}</td><td>{:.4f} {}</td><td>{:.4f}</td><td>{:.4f}{}</td><td>{:.4f} {}</td>"
      "<td>{}</td><td>{}</td></tr>\n",
      xml(figure.name), figure.value, figure.unit, figure.expanded, figure.limit,
      figure.limit_stated ? " (stated)" : "", figure.smallest, figure.smallest_unit,
      xml(figure.where), verdict_of(figure));
}

/// Covariance of the parameters of all cameras in order; empty if none is stated.
MatrixXd calibration_covariance(const Calibration& calibration) {
  Index size = 0, stated = 0;
  for (const CalibratedCamera& camera : calibration.cameras) {
    size += static_cast<Index>(parameter_names(camera.camera.model).size());
    stated += camera.covariance.rows();
  }
  if (calibration.joint_covariance.rows() == size) return calibration.joint_covariance;
  if (stated != size) return {};
  MatrixXd all = MatrixXd::Zero(size, size);
  Index at = 0;
  for (const CalibratedCamera& camera : calibration.cameras) {
    const Index own = camera.covariance.rows();
    all.block(at, at, own, own) = camera.covariance;
    at += own;
  }
  return all;
}

/// Removes the print's scale from the covariance: the plate that calibrated the rig measures itself
/// in units of its own size, right or wrong.
MatrixXd without_print_scale(MatrixXd covariance, const Calibration& calibration, double scale) {
  if (covariance.size() == 0 || !(scale > 0)) return covariance;
  Eigen::VectorXd growth = Eigen::VectorXd::Zero(covariance.rows());
  Index at = 0;
  for (const CalibratedCamera& camera : calibration.cameras) {
    at += static_cast<Index>(parameter_names(camera.camera.model).size());
    growth.segment<3>(at - 3) = camera.camera.cam_from_world.translation_m / mm;
  }
  return covariance - scale * scale * growth * growth.transpose();
}

/// Reason if an input of this test is NO-GO.
std::optional<std::string> reason_against(const AcceptanceInput& input,
                                          const Calibration& calibration) {
  if (calibration.no_go) return "the calibration is NO-GO: " + *calibration.no_go;
  if (auto reason = input.target.reason_against(sets_of(input.target))) return reason;
  return input.sphere ? input.sphere->marks.reason_against(sets_of(input.sphere->marks))
                      : std::nullopt;
}

std::vector<std::string> names_that_calibrated(const Detections& tested,
                                               const Calibration& calibration) {
  std::vector<std::string> names = sets_of(tested);
  std::erase_if(names, [&](const std::string& set) {
    return std::ranges::find(calibration.sets, set) == calibration.sets.end();
  });
  return names;
}

/// Throws Error(usage) if a set of --repeats is missing from the detections or named twice.
void check_repeats(const AcceptanceInput& input) {
  const std::vector<std::string> there = sets_of(input.target);
  for (auto set = input.repeats.begin(); set != input.repeats.end(); ++set) {
    if (std::find(there.begin(), there.end(), *set) == there.end())
      throw usage_error(fmt::format("--repeats names {}, which is not among the detections", *set),
                        fmt::format("give sets of {}", fmt::join(there, ", ")));
    if (std::find(input.repeats.begin(), set, *set) != set)
      throw usage_error(fmt::format("--repeats names {} twice", *set), "name each set once");
  }
}

/// Residual, in stated standard deviations, beyond which a point is an outlier; cameras that moved
/// slightly are detected elsewhere.
constexpr double kGross = 10;
constexpr std::size_t kSetsTried = 3;

/// Median distance of the image points from the common solution of all cameras, in stated standard
/// deviations; infinite if most rays do not meet.
double disagreement(const Detections& detections, const Calibration& calibration) {
  std::vector<double> distances;
  for (const std::string& set : sets_of(detections)) {
    const auto points = measured_points(detections, calibration, set);
    std::map<MarkId, int> views;
    for (const FrameDetections& frame : detections.frames)
      if (frame.set == set)
        for (const Detection& d : frame.detections) ++views[d.mark];
    for (const FrameDetections& frame : detections.frames) {
      const CalibratedCamera* own = calibration.find(frame.camera);
      if (frame.set != set || own == nullptr) continue;
      for (const Detection& d : frame.detections) {
        if (views[d.mark] < 2) continue;
        const auto point = points.find(d.mark);
        double distance = std::numeric_limits<double>::infinity();
        if (point != points.end()) {
          const auto image = project(own->camera.model,
                                     own->camera.cam_from_world * (point->second.in_world_mm * mm));
          if (image) distance = (whitener(d.covariance_px2) * (d.centre_px - image->px)).norm();
        }
        distances.push_back(distance);
      }
    }
  }
  if (distances.empty()) return std::numeric_limits<double>::infinity();
  return median(std::move(distances));
}

/// A simple mistake, with a function that undoes it for a frame.
struct Mistake {
  std::string sentence;
  std::function<void(FrameDetections&)> undo;
};

void mirror(FrameDetections& frame, const CameraModel& model, bool columns, bool rows) {
  for (Detection& d : frame.detections) {
    if (columns) d.centre_px.x() = model.width_px - 1 - d.centre_px.x();
    if (rows) d.centre_px.y() = model.height_px - 1 - d.centre_px.y();
    if (columns != rows) d.covariance_px2(0, 1) = d.covariance_px2(1, 0) = -d.covariance_px2(0, 1);
  }
}

std::vector<Mistake> mistakes(const Calibration& calibration, const MarkLattice& lattice) {
  std::vector<Mistake> list;
  std::vector<std::string> names;
  for (const CalibratedCamera& camera : calibration.cameras) {
    const std::string& second = camera.camera.name;
    for (const std::string& first : names)
      list.push_back({fmt::format("{} and {} are exchanged: give each camera the name that it had "
                                  "when it was calibrated",
                                  first, second),
                      [first, second](FrameDetections& frame) {
                        if (frame.camera == first || frame.camera == second)
                          frame.camera = frame.camera == first ? second : first;
                      }});
    names.push_back(second);
  }
  names.emplace_back();  // all cameras
  for (const std::string& name : names) {
    const CameraModel model =
        (name.empty() ? calibration.cameras.front() : calibration.camera(name)).camera.model;
    const auto add = [&](const std::string& sentence, auto change) {
      list.push_back({sentence, [name, change](FrameDetections& frame) {
                        if (name.empty() || frame.camera == name) change(frame);
                      }});
    };
    const std::string whose = "the images of " + (name.empty() ? "all cameras" : name) + " are ";
    for (const auto& [columns, rows, what] :
         {std::tuple(true, false,
                     "mirrored left to right: take the mirror out of the camera's settings or of "
                     "its optics"),
          {false, true,
           "mirrored top to bottom: take the mirror out of the camera's settings or of its optics"},
          {true, true, "turned by 180 degrees: turn the camera back, or its setting"}})
      add(whose + what, [model, columns = columns, rows = rows](FrameDetections& frame) {
        mirror(frame, model, columns, rows);
      });
    if (name.empty()) continue;
    for (const auto& [row, col, what] : {std::tuple(true, true, "turned by 180 degrees"),
                                         {false, true, "mirrored"},
                                         {true, false, "mirrored"}})
      add(fmt::format("the labels of the plate's points are {} in {}: use a plate whose points "
                      "have names, or show its whole print",
                      what, name),
          [lattice, row = row, col = col](FrameDetections& frame) {
            for (Detection& d : frame.detections) {
              if (row) d.mark.row = lattice.rows - 1 - d.mark.row;
              if (col) d.mark.col = lattice.cols - 1 - d.mark.col;
            }
          });
  }
  return list;
}

/// True if the cameras see the unprinted face in most positions.
bool seen_from_behind(const Calibration& calibration, const std::vector<Position>& positions) {
  std::size_t behind = 0;
  for (const Position& position : positions) {
    double towards = 0;
    for (const CalibratedCamera& camera : calibration.cameras)
      towards += (centre_in_world(camera.camera) - position.pose.translation_m)
                     .normalized()
                     .dot(position.pose.rotation.col(2));
    behind += towards < 0;
  }
  return 2 * behind > positions.size();
}

/// Message about exchanged or mirrored cameras, or a plate with wrong labels; empty if the cameras
/// agree or none of these explains their disagreement.
std::string exchanged_or_mirrored(const Detections& detections, const Calibration& calibration,
                                  const Plate& plate, const std::vector<Position>& positions) {
  Detections some = detections;
  std::vector<std::string> sets = sets_of(detections);
  sets.resize(std::min(sets.size(), kSetsTried));
  std::erase_if(some.frames, [&](const FrameDetections& frame) {
    return std::find(sets.begin(), sets.end(), frame.set) == sets.end();
  });
  const double found = disagreement(some, calibration);
  if (found < kGross) {
    if (!seen_from_behind(calibration, positions)) return {};
    return "the plate is mirrored: its points lie as if they were seen from behind; the print or "
           "the images of all cameras are mirrored, or rows and columns are exchanged in its file";
  }
  std::string best;
  double least = kGross;
  MarkLattice lattice = detections.lattice;
  lattice.rows = plate.target.rows;
  lattice.cols = plate.target.cols;
  for (const Mistake& mistake : mistakes(calibration, lattice)) {
    Detections without = some;
    for (FrameDetections& frame : without.frames) mistake.undo(frame);
    const double left = disagreement(without, calibration);
    if (left >= least) continue;
    // Mirrored images from all cameras agree, but in a mirrored world.
    if (seen_from_behind(calibration, positions_of(without, calibration, plate))) continue;
    least = left;
    best = mistake.sentence;
  }
  return best;
}

constexpr double kLeastOutOfPlane_deg = 20;
constexpr double kLeastOfVolume = 2.0 / 3;

/// Largest angle between a measured length and the plane that best fits all of them.
double out_of_plane_deg(const std::vector<Position>& positions, const Target& target) {
  std::vector<Vector3d> directions;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Position& position : positions)
    for (const auto& [from, to] : lengths_of(target)) {
      directions.push_back(
          position.pose.rotation *
          (target.point_in_target(to) - target.point_in_target(from)).normalized());
      scatter += directions.back() * directions.back().transpose();
    }
  const Vector3d normal =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(0);
  double most = 0;
  for (const Vector3d& direction : directions)
    most = std::max(most, std::abs(direction.dot(normal)));
  return std::asin(std::min(1.0, most)) / units::deg;
}

/// Dimensions along x, y and z of the box around all points of all positions.
Vector3d extent_mm(const std::vector<Position>& positions) {
  Eigen::AlignedBox3d box;
  for (const Position& position : positions)
    for (const auto& [mark, point] : position.points) box.extend(point.in_world_mm);
  return box.isEmpty() ? Vector3d::Zero() : Vector3d(box.sizes());
}

/// Reasons why a check within its limits is not a full acceptance; empty if it is one.
std::vector<std::string> lacks_of(const AcceptanceInput& input, const Calibration& calibration,
                                  const Plate& plate, const std::vector<Position>& positions,
                                  const AcceptanceOptions& options) {
  std::vector<std::string> lacks;
  if (options.own_target)
    lacks.emplace_back("another plate than the one that calibrated (--target)");
  if (plate.target.known_lengths.empty())
    lacks.emplace_back("a calibrated length of the plate with its uncertainty ([known_length])");
  if (!options.max_length_error_mm) lacks.emplace_back("a stated limit (--max-length-error-mm)");
  if (!input.calibrated.detections) {
    lacks.emplace_back("the calibrating detections, whose volume the positions have to span");
    return lacks;
  }
  Detections calibrating = *input.calibrated.detections;
  std::erase_if(calibrating.frames, [&](const FrameDetections& frame) {
    return !calibration.sets.empty() && std::find(calibration.sets.begin(), calibration.sets.end(),
                                                  frame.set) == calibration.sets.end();
  });
  const Vector3d all = extent_mm(positions_of(calibrating, calibration, plate)),
                 own = extent_mm(positions);
  for (const int axis : {0, 1, 2})
    if (own[axis] < kLeastOfVolume * all[axis])
      lacks.push_back(
          fmt::format("positions over two thirds of the volume along {} ({:.0f} of {:.0f} mm)",
                      "xyz"[axis], own[axis], all[axis]));
  return lacks;
}

}  // namespace

AcceptanceDates dates_of(const std::string& on, int valid_days) {
  if (valid_days < 1) throw usage_error("--valid-days is below 1", "give a number of days");
  if (on.empty()) return {};
  const auto date = date_in(on);
  if (!date) throw usage_error("--date `" + on + "` is no date", "write it as 2026-01-31");
  return {on, date_text(*date + std::chrono::days(valid_days))};
}

std::string protocol_page(const Acceptance& acceptance, const AcceptanceDates& dates) {
  std::string page = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Acceptance of "
      "{0}</title>\n<style>body{{font:11pt sans-serif;margin:2cm}}table{{border-collapse:collapse}}"
      "td,th{{border:1px solid #888;padding:4px 8px;text-align:left}}</style></head><body>\n"
      "<h1>{5} of {0}: {1}</h1>\n<p>{2}, {3} positions of the target, calibration {4}</p>\n",
      xml(acceptance.rig), acceptance.good() ? "GO" : "NO-GO",
      xml(dates.on.empty() ? "no date" : dates.on + ", valid until " + dates.valid_until),
      acceptance.positions, xml(acceptance.calibration_sha256),
      acceptance.lacks.empty() ? "Acceptance" : "Interim check");
  for (const std::string& part : acceptance.lacks)
    page += "<p>An acceptance needs also " + xml(part) + "</p>\n";
  if (!acceptance.cause.empty()) page += "<p>" + xml(acceptance.cause) + "</p>\n";
  for (const std::string& warning : acceptance.warnings)
    page += "<p>Warning: " + xml(warning) + "</p>\n";
  page +=
      "<table><tr><th>figure</th><th>value</th><th>U (95 %)</th><th>limit</th><th>smallest fault "
      "named</th><th>where</th><th>verdict</th></tr>\n";
  for (const AcceptanceFigure& figure : acceptance.figures) page += row_of(figure);
  return page +
         "</table>\n<p>Conformity is proven when value and U together stay within the limit (ISO "
         "14253-1). A limit that is not stated is what this instrument can prove: it follows from "
         "the uncertainties of calibration, marks and print.</p>\n<p>Date, signature: "
         "____________________</p>\n</body></html>\n";
}

void fields(Fields& f, AcceptanceOptions& o) {
  f.if_any({"max_length_error_mm", "limit; a change of plate or cameras within it is a warning", 1,
            above_zero},
           o.max_length_error_mm);
  f.if_any({"max_flatness_mm", "limit", 1, above_zero}, o.max_flatness_mm);
  f.if_any({"max_shift_error_mm", "limit", 1, above_zero}, o.max_shift_error_mm);
  f.if_any({"max_sphere_form_mm", "limit", 1, above_zero}, o.max_sphere_form_mm);
  f.if_any({"max_sphere_size_mm", "limit for the diameter", 1, above_zero}, o.max_sphere_size_mm);
  f.otherwise({"max_noise_ratio", "limit, as a multiple of the stated noise", 1, above_zero},
              o.max_noise_ratio);
  f.otherwise({"shift_uncertainty_mm", "standard uncertainty of a height in rig.toml", 1, 0},
              o.shift_uncertainty_mm);
  f.otherwise({"least_positions",
               "least number of target positions with all five lengths; sets at the same position "
               "count once",
               1, 1},
              o.least_positions);
  f.otherwise(
      {"bow_mm",
       "height of the plate's edges above its middle along x and y, as `drape calib` found it"},
      o.bow_mm);
  f.otherwise({"bow_sd_mm", "standard uncertainty of that bow along x and y", 1, 0}, o.bow_sd_mm);
}

bool Acceptance::good() const {
  return cause.empty() && std::ranges::all_of(figures, [](const AcceptanceFigure& figure) {
           return figure.good() || figure.informs ||
                  (figure.may_lack && !figure.not_measured.empty());
         });
}

Acceptance accept(const AcceptanceInput& input, const Calibration& calibration, const Rig& rig,
                  const Target& target, const AcceptanceOptions& options) {
  check_record(options);
  check_lattice(input.target, rig, target);
  check_repeats(input);
  for (const FrameDetections& frame : input.target.frames)
    for (const Detection& d : frame.detections) check_detection(d, frame);
  const PictureSource tested{input.target, input.file, {}};
  if (input.calibrated.detections)
    refuse_pictures_of({*input.calibrated.detections, input.calibrated.file, calibration.sets},
                       tested);
  else
    refuse_pictures_twice(tested);
  const Plate plate(target, options.bow_mm);
  std::vector<Position> positions = positions_of(input.target, calibration, plate);
  Acceptance acceptance;
  acceptance.rig = rig.name;
  acceptance.cause = exchanged_or_mirrored(input.target, calibration, plate, positions);
  if (positions.empty() && acceptance.cause.empty()) {
    throw bad_input("no set shows the target to two calibrated cameras", {},
                    "record the target where two cameras see it");
  }
  const Detections centres = without_eccentricity(input.target, calibration, plate, positions);
  if (target.dot_diameter_m > 0) positions = positions_of(centres, calibration, plate);
  std::vector<const Position*> all;
  all.reserve(positions.size());
  for (const Position& position : positions) all.push_back(&position);
  acceptance.positions = count_places(all, plate);
  acceptance.lacks = lacks_of(input, calibration, plate, positions, options);
  const double tilt_deg = out_of_plane_deg(positions, target);
  if (acceptance.cause.empty() && tilt_deg < kLeastOutOfPlane_deg)
    acceptance.cause = fmt::format(
        "the positions test no volume: all lengths lie within {:.1f} degrees of one plane; record "
        "the plate tilted by {:g} degrees or more, to two sides{}",
        tilt_deg, kLeastOutOfPlane_deg,
        acceptance.lacks.empty()
            ? ""
            : fmt::format("; an acceptance needs also {}", fmt::join(acceptance.lacks, ", ")));
  const double print = scale_uncertainty(target);
  MatrixXd covariance = calibration_covariance(calibration);
  if (options.own_target) covariance = without_print_scale(covariance, calibration, print);
  const Draws draws(covariance, options.draws);
  // Five figures, growth and bow of the plate, and a motion for each camera.
  FigureContext context{
      .draws = &draws,
      .false_no_go = options.false_no_go / (7 + static_cast<double>(calibration.cameras.size())),
      .scale_uncertainty = options.own_target ? 0 : print};
  const Changes changes =
      changes_since(centres, calibration, plate, positions, draws.root(),
                    {context.scale_uncertainty, options.bow_sd_mm}, context.false_no_go);
  context.noise_variance = changes.noise_variance;
  acceptance.figures = {length_error(positions, plate, context, options),
                        flatness(positions, plate, context, options),
                        shift_error(positions, rig, context, options)};
  FigureContext beside = context;
  beside.scale_uncertainty = options.own_target ? print : 0;
  for (AcceptanceFigure& figure : sphere_figures(input, calibration, beside, options))
    acceptance.figures.push_back(std::move(figure));
  acceptance.figures.push_back(noise_floor(centres, input.repeats, options));
  const bool permitted = options.max_length_error_mm.has_value();
  for (AcceptanceFigure figure : changes.figures) {
    figure.informs = permitted;
    if (permitted && !figure.good()) acceptance.warnings.push_back(figure.cause);
    acceptance.figures.push_back(std::move(figure));
  }
  if (acceptance.cause.empty() && !permitted) acceptance.cause = changes.cause;
  if (!input.calibrated.detections) {
    const std::string missing = input.calibrated.missing.empty()
                                    ? "the detections behind it are not given"
                                    : input.calibrated.missing;
    const std::vector<std::string> same = names_that_calibrated(input.target, calibration);
    if (same.empty())
      acceptance.warnings.push_back("whether a set here calibrated is not known: " + missing);
    else
      acceptance.cause = fmt::format(
          "sets of these names calibrated ({}), and that they are other pictures cannot be shown: "
          "{}; put the file back, or record other sets under names of their own",
          fmt::join(same, ", "), missing);
  }
  if (const auto against = reason_against(input, calibration)) acceptance.cause = *against;
  return acceptance;
}

}  // namespace drape::calib
