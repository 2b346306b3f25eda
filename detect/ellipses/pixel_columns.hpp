// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "detect/dots/noise.hpp"
#include "detect/ellipses/blurred_ellipse.hpp"
#include "detect/ellipses/lanes.hpp"
#include "detect/ellipses/patch.hpp"

namespace drape::detect {

/// Normal equations of the weighted least squares.
struct Normal {
  BlurredEllipse::Matrix hessian = BlurredEllipse::Matrix::Zero();  ///< both triangles
  BlurredEllipse::Vector gradient = BlurredEllipse::Vector::Zero();
  double chi2 = 0;
};

/// The model at up to `size` pixels: level, derivative by each parameter, and noise.
struct PixelBlock {
  static constexpr int size = 256;
  alignas(32) float gradient[BlurredEllipse::size][size];
  alignas(32) float residual[size];
  alignas(32) float weight[size];     ///< trust over the variance of the model's level
  alignas(32) float precision[size];  ///< 1 over that variance
  alignas(32) float edge[size];       ///< 1 near the edge, else 0
  alignas(32) float distance[size];   ///< from the outline, positive outside
};

/// The first `count` pixels of a block in units of their noise, with a weighted sum of their
/// derivatives: what each does to two parameters of which `rows` are the covariances with all.
struct Influence {
  alignas(32) float per_sigma[PixelBlock::size];  ///< 1 / noise
  alignas(32) float u[PixelBlock::size];
  alignas(32) float v[PixelBlock::size];
};
void influence_of(const PixelBlock& block, int count,
                  const Eigen::Matrix<float, 2, BlurredEllipse::size>& rows, Influence& influence);

/// Changes by a look for strangers.
struct Strangers {
  double lost_edge = 0;  ///< fraction of the outline's weight that is lost
  bool changed = false;  ///< some pixel's trust is another than before
};

/// A patch as one column of floats per quantity, so that vector units take several pixels at once.
/// Sorted by eighth of the dot; each eighth begins at a multiple of `lanes`, filled up with pixels
/// of no weight. Lanes are summed in a fixed order: the result is the same on every processor.
class PixelColumns {
 public:
  PixelColumns() = default;
  explicit PixelColumns(const Patch& patch);

  /// Sums over all pixels, with the noise of the model's level, not of the observed one, which
  /// would favour dark noise.
  [[nodiscard]] Normal sum(const BlurredEllipse& model, const NoiseModel& noise) const;
  /// The same, eighth by eighth.
  [[nodiscard]] std::array<Normal, 8> sum_sectors(const BlurredEllipse& model,
                                                  const NoiseModel& noise) const;
  /// Evaluates `count` <= PixelBlock::size pixels from `first` on.
  void evaluate(int first, int count, const BlurredEllipse& model, const NoiseModel& noise,
                PixelBlock& block) const;

  /// After a fit: pixels outside the outline that belong to something else lose their say. Tukey's
  /// biweight, but only for gross misfits, since weights that follow the outline's small misfits
  /// would move the centre.
  Strangers distrust_strangers(const BlurredEllipse& fitted, const NoiseModel& noise);

  [[nodiscard]] double total_trust() const;
  [[nodiscard]] int size() const { return static_cast<int>(x_.size()); }
  [[nodiscard]] int x(int index) const { return static_cast<int>(x_[index]); }
  [[nodiscard]] int y(int index) const { return static_cast<int>(y_[index]); }
  [[nodiscard]] float trust(int index) const { return trust_[index]; }

 private:
  [[nodiscard]] Normal sum(int first, int last, const BlurredEllipse& model,
                           const NoiseModel& noise) const;

  /// Visits the pixels, but not those that fill up, with their index and the model there.
  template <class Visit>
  void each(const BlurredEllipse& model, const NoiseModel& noise, const Visit& visit) const;

  std::vector<float> x_, y_, level_, trust_;
  std::array<int, 9> begin_ = {};
  std::array<int, 8> count_ = {};
};

}  // namespace drape::detect
