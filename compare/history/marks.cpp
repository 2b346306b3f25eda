// SPDX-License-Identifier: Apache-2.0
#include "compare/history/results.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/geometry/rigid_motion.hpp"
#include "core/statistics/distributions.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using units::mm;

constexpr double kMovedRisk = 0.05;  ///< probability of a false alarm, over all marks of a sheet
constexpr double kWritten_m = 1e-6 * mm;  ///< resolution of positions in sheet.json

/// Fraction of the marks' covariance due to the calibration; 1 if unknown.
double calibration_share(const Sheet& sheet) {
  if (!sheet.error_budget || !sheet.error_budget->calibration_m) return 1;
  return std::pow(*sheet.error_budget->calibration_m / sheet.error_budget->total_m, 2);
}

/// The matrix with positive eigenvalues: for a difference of covariances, neither of which
/// dominates.
Matrix3d positive(const Matrix3d& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(symmetric);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseAbs().asDiagonal() *
         eigen.eigenvectors().transpose();
}

double largest_sd_m(const Matrix3d& covariance_m2) {
  return std::sqrt(Eigen::SelfAdjointEigenSolver<Matrix3d>(covariance_m2).eigenvalues().maxCoeff());
}

}  // namespace

bool MarkMove::moved(std::size_t marks) const {
  return chi2 > chi_square_beyond(kMovedRisk / static_cast<double>(marks), 3);
}

SheetMoves moves_between(const Sheet& first, const Sheet& second, const SharedNoise& shared) {
  std::vector<std::pair<const SheetMark*, const SheetMark*>> both;
  for (const SheetMark& mark : first.marks)
    if (const SheetMark* other = second.find(mark.mark)) both.emplace_back(&mark, other);
  const auto count = static_cast<Eigen::Index>(both.size());
  Eigen::Matrix3Xd from(3, count), to(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    from.col(i) = both[static_cast<std::size_t>(i)].first->point_in_world;
    to.col(i) = both[static_cast<std::size_t>(i)].second->point_in_world;
  }
  const auto rigid = rigid_motion(from, to);
  if (!rigid)
    throw bad_input("fewer than three marks are in both sheets, or they lie in one line", {},
                    "compare runs that measured the same set");
  const double own_share = shared.detections ? calibration_share(first) : 1,
               other_share = shared.detections ? calibration_share(second) : 1;
  SheetMoves moves{*rigid, {}};
  for (const auto& [own, other] : both) {
    const Matrix3d own_m2 = own_share * own->covariance_m2.value_or(Matrix3d::Zero()),
                   other_m2 = other_share * other->covariance_m2.value_or(Matrix3d::Zero());
    MarkMove move{own->mark, other->point_in_world - *rigid * own->point_in_world,
                  shared.detections && shared.calibrating ? positive(other_m2 - own_m2)
                                                          : Matrix3d(own_m2 + other_m2),
                  0};
    move.covariance_m2 += kWritten_m * kWritten_m * Matrix3d::Identity();
    move.chi2 = move.by_m.dot(move.covariance_m2.ldlt().solve(move.by_m));
    moves.marks.push_back(move);
  }
  return moves;
}

Answer moved_marks(const StoreReader& store, int first, int second) {
  require_run(store, first);
  require_run(store, second);
  store.require_as_written({.runs = {first, second}});
  const auto pairs = store.rows<std::string, std::string, std::string, std::string, int, int, int>(
      "SELECT a.scene, a.set_name, a.measured_sha256, b.measured_sha256, m.detections_sha256 = "
      "n.detections_sha256 OR coalesce(a.pictures_sha256 = b.pictures_sha256, 0), "
      "m.calibration_sha256 = n.calibration_sha256, coalesce(p.recording_sha256 = "
      "q.recording_sha256, 0) FROM run_drape AS a JOIN run_drape AS b ON b.run = ?2 AND "
      "b.scene = a.scene AND b.set_name = a.set_name JOIN sheet AS m ON m.sha256 = "
      "a.measured_sha256 JOIN sheet AS n ON n.sha256 = b.measured_sha256 JOIN run AS p ON "
      "p.number = a.run JOIN run AS q ON q.number = b.run WHERE a.run = ?1 ORDER BY a.scene, "
      "a.set_name",
      {first, second});
  if (pairs.empty())
    throw usage_error(fmt::format("runs {} and {} measured no set in common", first, second),
                      "see the runs with: drape results runs");
  Table sets({"scene", "set", "marks", "moved", "rigid_shift_mm", "rigid_turn_deg", "rms_mm",
              "largest_mm", "shared"},
             {2, 3, 4, 5, 6, 7});
  Table listed({"scene", "set", "row", "col", "x_mm", "y_mm", "z_mm", "moved_mm", "u_mm",
                "chi_square", "moved"},
               {2, 3, 4, 5, 6, 7, 8, 9});
  const auto sheet_of = [&](const std::string& sha256, const std::string& set) {
    if (const auto content = store.blob(sha256))
      return read_record<Sheet>(
          Document(store.file().string() + ", blob " + sha256, Syntax::json, *content));
    throw bad_input(fmt::format("the store lacks the measured sheet of set {}", set),
                    {.file = store.file().string(), .field = sha256},
                    "compare runs whose sheets it has: drape results verify names those that it "
                    "lacks");
  };
  std::size_t moved_all = 0, marks_all = 0;
  for (const auto& [scene, set, own, other, same_pictures, same_calibration, same_recording] :
       pairs) {
    const SharedNoise shared{same_pictures != 0, same_calibration != 0 || same_recording != 0};
    const SheetMoves moves = moves_between(sheet_of(own, set), sheet_of(other, set), shared);
    double squares = 0, largest_m = 0;
    std::size_t moved = 0;
    for (const MarkMove& mark : moves.marks) {
      const bool is_moved = mark.moved(moves.marks.size());
      moved += is_moved;
      squares += mark.by_m.squaredNorm();
      largest_m = std::max(largest_m, mark.by_m.norm());
      listed.add(
          {scene, set, std::to_string(mark.mark.row), std::to_string(mark.mark.col),
           fmt::format("{:.4f}", mark.by_m.x() / mm), fmt::format("{:.4f}", mark.by_m.y() / mm),
           fmt::format("{:.4f}", mark.by_m.z() / mm), fmt::format("{:.4f}", mark.by_m.norm() / mm),
           fmt::format("{:.4f}", 2 * largest_sd_m(mark.covariance_m2) / mm),
           fmt::format("{:.1f}", mark.chi2), is_moved ? "moved" : ""});
    }
    const double turn = Eigen::AngleAxisd(moves.rigid.rotation).angle();
    sets.add(
        {scene, set, std::to_string(moves.marks.size()), std::to_string(moved),
         fmt::format("{:.4f}", moves.rigid.translation_m.norm() / mm),
         fmt::format("{:.5f}", turn / units::deg),
         fmt::format("{:.4f}", std::sqrt(squares / static_cast<double>(moves.marks.size())) / mm),
         fmt::format("{:.4f}", largest_m / mm),
         !shared.detections      ? "nothing: other pictures"
         : same_calibration != 0 ? "pictures and calibration"
         : shared.calibrating    ? "pictures, calibrating pictures too"
                                 : "pictures"});
    moved_all += moved;
    marks_all += moves.marks.size();
  }
  return {fmt::format("{} of {} marks moved between runs {} and {} beyond what their calibrations' "
                      "uncertainty explains (rigid part taken out; 5 % risk a set)",
                      moved_all, marks_all, first, second),
          {std::move(sets), std::move(listed)},
          moved_all == 0};
}

}  // namespace drape::compare
