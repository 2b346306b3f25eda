// SPDX-License-Identifier: Apache-2.0
#include "calib/acceptance/acceptance.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "calib/acceptance/measured_point.hpp"
#include "calib/checks/known_length.hpp"
#include "calib/tsai/correspondence.hpp"
#include "core/error.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::Vector3d;
using units::mm;

using Points = std::map<MarkId, MeasuredPoint>;

constexpr double kCoverage = 2;  ///< k of every U

struct Position {
  std::string set;
  Points points;
};

/// Covariance of the cameras' parameters, camera after camera; empty when none is stated.
MatrixXd calibration_covariance(const Calibration& calibration) {
  if (calibration.joint_covariance.size() > 0) return calibration.joint_covariance;
  Eigen::Index size = 0;
  for (const CalibratedCamera& camera : calibration.cameras) size += camera.covariance.rows();
  MatrixXd all = MatrixXd::Zero(size, size);
  Eigen::Index at = 0;
  for (const CalibratedCamera& camera : calibration.cameras) {
    const Eigen::Index own = camera.covariance.rows();
    all.block(at, at, own, own) = camera.covariance;
    at += own;
  }
  return all;
}

/// A number linear in some points: its variance by noise and calibration.
class Sum {
 public:
  explicit Sum(const MatrixXd& calibration) : calibration_(calibration) {}
  void add(const MeasuredPoint& point, const Vector3d& weight) {
    variance_ += weight.dot(point.noise_mm2 * weight);
    const RowVectorXd by = weight.transpose() * point.by_calibration_mm;
    by_calibration_ = by_calibration_.size() == 0 ? by : RowVectorXd(by_calibration_ + by);
  }
  [[nodiscard]] double variance_mm2() const {
    if (calibration_.rows() != by_calibration_.size()) return variance_;
    return variance_ + (by_calibration_ * calibration_ * by_calibration_.transpose()).value();
  }

 private:
  const MatrixXd& calibration_;
  double variance_ = 0;
  RowVectorXd by_calibration_;
};

/// Keeps the candidate that is nearest to its limit, uncertainty included.
void keep_worst(AcceptanceFigure& figure, double value, double sd, const std::string& where) {
  const double expanded = kCoverage * sd;
  if (!figure.where.empty() && value + expanded <= figure.value + figure.expanded) return;
  figure.value = value;
  figure.expanded = expanded;
  figure.where = where;
}

/// The two diagonals, the two longest edges and a half diagonal of the target.
std::vector<std::pair<MarkId, MarkId>> lengths_of(const Target& target) {
  const int row = target.rows - 1, col = target.cols - 1;
  return {{{0, 0}, {row, col}},
          {{0, col}, {row, 0}},
          {{0, 0}, {0, col}},
          {{0, 0}, {row, 0}},
          {{0, 0}, {row / 2, col / 2}}};
}

AcceptanceFigure length_error(const std::vector<Position>& positions, const Target& target,
                              const MatrixXd& calibration, const AcceptanceOptions& options) {
  AcceptanceFigure figure{"length error", "", "mm", 0, 0, options.max_length_error_mm, ""};
  int measured = 0;
  for (const Position& position : positions) {
    int here = 0;
    for (const auto& [from, to] : lengths_of(target)) {
      const auto a = position.points.find(from), b = position.points.find(to);
      if (a == position.points.end() || b == position.points.end()) continue;
      const Vector3d along = b->second.in_world_mm - a->second.in_world_mm;
      Sum sum(calibration);
      sum.add(a->second, -along.normalized());
      sum.add(b->second, along.normalized());
      const double true_mm =
          (target.point_in_target(to) - target.point_in_target(from)).norm() / mm;
      const double sd =
          std::sqrt(sum.variance_mm2() + std::pow(scale_uncertainty(target) * true_mm, 2));
      keep_worst(figure, std::abs(along.norm() - true_mm), sd,
                 fmt::format("set {}, ({}, {}) to ({}, {}), {:.2f} mm", position.set, from.row,
                             from.col, to.row, to.col, true_mm));
      ++here;
    }
    measured += here == 5;
  }
  if (measured < options.least_positions) {
    figure.not_measured = fmt::format(
        "{} positions show all five lengths to two cameras, {} are needed: record the whole target "
        "in more places of the drape volume",
        measured, options.least_positions);
  }
  return figure;
}

AcceptanceFigure flatness(const std::vector<Position>& positions, const MatrixXd& calibration,
                          const AcceptanceOptions& options) {
  AcceptanceFigure figure{"flatness of the plate", "", "mm", 0, 0, options.max_flatness_mm, ""};
  for (const Position& position : positions) {
    if (position.points.size() < 12) continue;
    Vector3d middle = Vector3d::Zero();
    for (const auto& [mark, point] : position.points) middle += point.in_world_mm;
    middle /= static_cast<double>(position.points.size());
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const auto& [mark, point] : position.points)
      spread += (point.in_world_mm - middle) * (point.in_world_mm - middle).transpose();
    const Vector3d normal =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(0);
    const auto height = [&](const auto& entry) {
      return normal.dot(entry.second.in_world_mm - middle);
    };
    const auto [low, high] =
        std::minmax_element(position.points.begin(), position.points.end(),
                            [&](const auto& a, const auto& b) { return height(a) < height(b); });
    Sum sum(calibration);
    sum.add(low->second, -normal);
    sum.add(high->second, normal);
    keep_worst(figure, height(*high) - height(*low), std::sqrt(sum.variance_mm2()),
               "set " + position.set);
  }
  if (figure.where.empty()) figure.not_measured = "no position with 12 points in space";
  return figure;
}

/// Distance of a stage from the first one along the plate's normal, against rig.toml.
AcceptanceFigure shift_error(const std::vector<Position>& positions, const Rig& rig,
                             const MatrixXd& calibration, const AcceptanceOptions& options) {
  AcceptanceFigure figure{"known shift", "", "mm", 0, 0, options.max_shift_error_mm, ""};
  const auto position_of = [&](const std::string& set) {
    return std::find_if(positions.begin(), positions.end(),
                        [&](const Position& position) { return position.set == set; });
  };
  const auto first = rig.stages.empty() ? positions.end() : position_of(rig.stages.front().set);
  for (const TargetStage& stage : rig.stages) {
    const auto here = position_of(stage.set);
    if (here == positions.end() || first == positions.end() || here == first) continue;
    Vector3d shift = Vector3d::Zero();
    int common = 0;
    for (const auto& [mark, point] : here->points) {
      const auto before = first->points.find(mark);
      if (before == first->points.end()) continue;
      shift += point.in_world_mm - before->second.in_world_mm;
      ++common;
    }
    if (common == 0) continue;
    shift /= common;
    Sum sum(calibration);
    for (const auto& [mark, point] : here->points) {
      const auto before = first->points.find(mark);
      if (before == first->points.end()) continue;
      sum.add(point, shift.normalized() / common);
      sum.add(before->second, -shift.normalized() / common);
    }
    const double true_mm = std::abs(stage.z_m - rig.stages.front().z_m) / mm;
    keep_worst(figure, std::abs(shift.norm() - true_mm),
               std::sqrt(sum.variance_mm2() + 2 * std::pow(options.shift_uncertainty_mm, 2)),
               fmt::format("set {}, {:.3f} mm", stage.set, true_mm));
  }
  if (figure.where.empty())
    figure.not_measured = "no two z stages among the sets: record the target at two known heights";
  return figure;
}

/// Scatter of the target at rest over what the detections' covariances state.
AcceptanceFigure noise_floor(const Detections& detections, const std::vector<std::string>& repeats,
                             const AcceptanceOptions& options) {
  AcceptanceFigure figure{"noise of repeats",      "", "of the stated", 0, 0,
                          options.max_noise_ratio, ""};
  std::map<std::pair<std::string, MarkId>, std::vector<const Detection*>> seen;
  for (const FrameDetections& frame : detections.frames) {
    if (std::find(repeats.begin(), repeats.end(), frame.set) == repeats.end()) continue;
    for (const Detection& d : frame.detections) seen[{frame.camera, d.mark}].push_back(&d);
  }
  double squares = 0;
  int freedom = 0;
  for (const auto& [place, found] : seen) {
    if (found.size() < 2) continue;
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const Detection* d : found) mean += d->centre_px / static_cast<double>(found.size());
    for (const Detection* d : found)
      squares += (d->centre_px - mean).squaredNorm() / d->covariance_px2.trace() * 2;
    freedom += 2 * (static_cast<int>(found.size()) - 1);
  }
  if (freedom < 20) {
    figure.not_measured =
        "give two or more sets of the target at rest with --repeats to measure the noise floor";
    return figure;
  }
  const double ratio = std::sqrt(squares / freedom);
  keep_worst(figure, ratio, ratio / std::sqrt(2.0 * freedom),
             fmt::format("{} sets, {} degrees of freedom", repeats.size(), freedom));
  return figure;
}

void check_positive(const char* option, double value) {
  if (!(value > 0))
    throw usage_error(fmt::format("{} is {}", option, value), "give a number above zero");
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '<') {
      out += "&lt;";
    } else if (c == '>') {
      out += "&gt;";
    } else if (c == '&') {
      out += "&amp;";
    } else {
      out += c;
    }
  }
  return out;
}

}  // namespace

void AcceptanceOptions::check() const {
  check_positive("--max-length-error-mm", max_length_error_mm);
  check_positive("--max-flatness-mm", max_flatness_mm);
  check_positive("--max-shift-error-mm", max_shift_error_mm);
  check_positive("--max-noise-ratio", max_noise_ratio);
  check_positive("--least-positions", least_positions);
  if (!(shift_uncertainty_mm >= 0))
    throw usage_error("--shift-uncertainty-mm is negative", "give zero or more");
}

bool Acceptance::good() const {
  return std::all_of(figures.begin(), figures.end(), [](const AcceptanceFigure& figure) {
    return figure.good() || (figure.name == "known shift" && !figure.not_measured.empty());
  });
}

Acceptance accept(const Detections& detections, const Calibration& calibration, const Rig& rig,
                  const Target& target, const std::vector<std::string>& repeats,
                  const AcceptanceOptions& options) {
  options.check();
  check_lattice(detections, rig, target);
  std::vector<std::string> sets;
  for (const FrameDetections& frame : detections.frames) {
    if (std::find(sets.begin(), sets.end(), frame.set) == sets.end()) sets.push_back(frame.set);
  }
  std::vector<Position> positions;
  for (const std::string& set : sets) {
    Points points = measured_points(detections, calibration, set);
    if (!points.empty()) positions.push_back({set, std::move(points)});
  }
  if (positions.empty()) {
    throw bad_input("no set shows the target to two calibrated cameras", {},
                    "record the target where two cameras see it");
  }
  const MatrixXd covariance = calibration_covariance(calibration);
  Acceptance acceptance;
  acceptance.rig = rig.name;
  acceptance.positions = static_cast<int>(positions.size());
  acceptance.figures = {length_error(positions, target, covariance, options),
                        flatness(positions, covariance, options),
                        shift_error(positions, rig, covariance, options),
                        noise_floor(detections, repeats, options)};
  return acceptance;
}

std::string protocol_page(const Acceptance& acceptance, const std::string& date) {
  std::string page = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Acceptance of "
      "{0}</title>\n<style>body{{font:11pt sans-serif;margin:2cm}}table{{border-collapse:collapse}}"
      "td,th{{border:1px solid #888;padding:4px 8px;text-align:left}}</style></head><body>\n"
      "<h1>Acceptance of {0}: {1}</h1>\n<p>{2}, {3} positions of the target, calibration {4}</p>\n"
      "<table><tr><th>figure</th><th>value</th><th>U (k = 2)</th><th>limit</th><th>where</th>"
      "<th>verdict</th></tr>\n",
      escaped(acceptance.rig), acceptance.good() ? "GO" : "NO-GO", escaped(date),
      acceptance.positions, escaped(acceptance.calibration_sha256));
  for (const AcceptanceFigure& figure : acceptance.figures) {
    page +=
        figure.not_measured.empty()
            ? fmt::format(
                  "<tr><td>{}</td><td>{:.4f} {}</td><td>{:.4f}</td><td>{:g}</td>"
                  "<td>{}</td><td>{}</td></tr>\n",
                  figure.name, figure.value, figure.unit, figure.expanded, figure.limit,
                  escaped(figure.where), figure.good() ? "GO" : "NO-GO")
            : fmt::format("<tr><td>{}</td><td colspan=\"4\">{}</td><td>not measured</td></tr>\n",
                          figure.name, escaped(figure.not_measured));
  }
  return page +
         "</table>\n<p>Conformity is proven when value and U together stay within the limit "
         "(ISO 14253-1).</p>\n<p>Date, signature: ____________________</p>\n</body></html>\n";
}

}  // namespace drape::calib
