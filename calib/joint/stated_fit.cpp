// SPDX-License-Identifier: Apache-2.0
#include "calib/joint/stated_fit.hpp"

#include <algorithm>
#include <cmath>

namespace drape::calib {
namespace {

using Eigen::MatrixXd;

StatedFit with_uncertainty(JointSolution solution, const JointFit& fit) {
  StatedFit out;
  out.scatter = scatter_of_views(solution.model, fit, std::max(1.0, chi2_per_dof(solution, fit)));
  out.covariance = joint_covariance(solution.model, fit, out.scatter.covariance);
  out.solution = std::move(solution);
  return out;
}

}  // namespace

double chi2_per_dof(const JointSolution& solution, const JointFit& fit) {
  std::size_t points = 0;
  for (const JointFrame& frame : solution.model.frames) points += frame.points.size();
  return solution.chi2 / (2.0 * static_cast<double>(points) - free_parameters(solution.model, fit));
}

StatedFit with_lens_choice(const JointSolution& solution, const JointFit& fit,
                           const JointCleaning& cleaning, const std::vector<HeldOut>& table) {
  constexpr double kRare = 0.005;
  StatedFit chosen = with_uncertainty(solution, fit);
  if (table.empty() || chosen.covariance.cameras.size() == 0) return chosen;
  const std::vector<double> probability = lens_probabilities(table);
  MatrixXd sum = MatrixXd::Zero(chosen.covariance.cameras.rows(), chosen.covariance.cameras.cols());
  Eigen::Vector2d bow = Eigen::Vector2d::Zero();
  double weights = 0;
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (probability[i] < kRare) continue;
    StatedFit other = chosen;
    if (table[i].lens != fit.lens) {
      JointFit with_other = fit;
      with_other.lens = table[i].lens;
      JointModel start = solution.model;
      clear_unused(start, with_other.lens);
      other = with_uncertainty(fit_joint(start, with_other, cleaning), with_other);
    }
    if (other.covariance.cameras.size() == 0) continue;
    const Eigen::VectorXd apart = file_difference(other.solution.model, solution.model);
    const Eigen::Vector2d bow_apart =
        other.solution.model.bow.edge_rise_mm - solution.model.bow.edge_rise_mm;
    sum += probability[i] * (other.covariance.cameras + apart * apart.transpose());
    bow += probability[i] * (other.covariance.bow_sd_mm.cwiseAbs2() + bow_apart.cwiseAbs2());
    weights += probability[i];
  }
  if (!(weights > 0)) return chosen;
  chosen.covariance.cameras = sum / weights;
  chosen.covariance.bow_sd_mm = (bow / weights).cwiseSqrt();
  return chosen;
}

}  // namespace drape::calib
