// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "detect/dots/noise.hpp"
#include "detect/ellipses/blurred_ellipse.hpp"
#include "detect/ellipses/lanes.hpp"
#include "detect/ellipses/patch.hpp"

namespace drape::detect {

/// Normal equations of weighted least squares.
struct Normal {
  BlurredEllipse::Matrix hessian = BlurredEllipse::Matrix::Zero();  ///< full symmetric matrix
  BlurredEllipse::Vector gradient = BlurredEllipse::Vector::Zero();
  double chi2 = 0;
};

/// Model values at up to `size` pixels: level, derivatives by the parameters, noise.
struct PixelBlock {
  static constexpr int size = 256;
  alignas(32) float gradient[BlurredEllipse::size][size];
  alignas(32) float residual[size];
  alignas(32) float weight[size];     ///< trust over the variance at the model's level
  alignas(32) float precision[size];  ///< 1 over that variance
  alignas(32) float edge[size];       ///< 1 near the edge, else 0
  alignas(32) float distance[size];   ///< from the outline, positive outside
};

/// Influence of a block's first `count` pixels, in units of their noise, on two parameters: a
/// weighted sum of derivatives, with `rows` the covariances of these two with all parameters.
struct Influence {
  alignas(32) float per_sigma[PixelBlock::size];  ///< 1 / noise
  alignas(32) float u[PixelBlock::size];
  alignas(32) float v[PixelBlock::size];
};
void influence_of(const PixelBlock& block, int count,
                  const Eigen::Matrix<float, 2, BlurredEllipse::size>& rows, Influence& influence);

/// Result of a search for outliers.
struct Strangers {
  double lost_edge = 0;  ///< lost fraction of the outline's weight
  bool changed = false;  ///< true if some pixel's trust has changed
};

/// A patch stored as one column of floats per quantity, for vector units. Sorted by eighth of the
/// dot; each eighth starts at a multiple of `lanes` and is padded with pixels of zero weight. Lanes
/// are summed in a fixed order, so that results agree on every processor.
class PixelColumns {
 public:
  PixelColumns() = default;
  explicit PixelColumns(const Patch& patch);

  /// Sums over all pixels. Noise is that of the model's level; that of the observed level would
  /// favour dark noise.
  [[nodiscard]] Normal sum(const BlurredEllipse& model, const NoiseModel& noise) const;
  /// The same sums per eighth of the dot.
  [[nodiscard]] std::array<Normal, 8> sum_sectors(const BlurredEllipse& model,
                                                  const NoiseModel& noise) const;
  /// Evaluates `count` <= PixelBlock::size pixels starting at `first`.
  void evaluate(int first, int count, const BlurredEllipse& model, const NoiseModel& noise,
                PixelBlock& block) const;

  /// After a fit, reduces the weight of pixels outside the outline that belong to other objects:
  /// Tukey's biweight for gross misfits only, since weights that follow small misfits of the
  /// outline would shift the centre.
  Strangers distrust_strangers(const BlurredEllipse& fitted, const NoiseModel& noise);

  [[nodiscard]] double total_trust() const;
  [[nodiscard]] int size() const { return static_cast<int>(x_.size()); }
  [[nodiscard]] int x(int index) const { return static_cast<int>(x_[index]); }
  [[nodiscard]] int y(int index) const { return static_cast<int>(y_[index]); }
  [[nodiscard]] float trust(int index) const { return trust_[index]; }

 private:
  [[nodiscard]] Normal sum(int first, int last, const BlurredEllipse& model,
                           const NoiseModel& noise) const;

  /// Visits the pixels except the padding, with their index and the model values there.
  template <class Visit>
  void each(const BlurredEllipse& model, const NoiseModel& noise, const Visit& visit) const;

  std::vector<float> x_, y_, level_, trust_;
  std::array<int, 9> begin_ = {};
  std::array<int, 8> count_ = {};
};

}  // namespace drape::detect
