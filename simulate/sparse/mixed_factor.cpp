// SPDX-License-Identifier: Apache-2.0
#include "simulate/sparse/mixed_factor.hpp"

namespace drape::simulate {

MixedFactor::MixedFactor(const GridSpec& grid, int threads) : grid_(grid), threads_(threads) {
  quick_.emplace(grid, threads);
}

bool MixedFactor::factorise(const GridMatrix& matrix, const std::vector<double>& shift,
                            Doubt doubt) {
  if (quick_) {
    if (quick_->factorise(matrix, shift)) return true;
    if (doubt == Doubt::believe) return false;
    use_double();
  }
  return exact_->factorise(matrix, shift);
}

void MixedFactor::solve(Eigen::VectorXd& b) const {
  if (quick_) {
    quick_->solve(b);
  } else {
    exact_->solve(b);
  }
}

void MixedFactor::use_double() {
  if (exact_) return;
  quick_.reset();
  exact_.emplace(grid_, threads_);
}

}  // namespace drape::simulate
