// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "detect/blurred_ellipse.hpp"
#include "detect/noise.hpp"
#include "detect/patch.hpp"

// Compiled twice, for processors with 256-bit vectors and for all others; which is taken turns out
// when the program starts. Sums are of whole lanes in one order, so that both give the same bytes.
#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define DRAPE_WIDE_VECTORS __attribute__((target_clones("avx2", "default")))
#else
#define DRAPE_WIDE_VECTORS
#endif

namespace drape {

/// Normal equations of the weighted least squares.
struct Normal {
  BlurredEllipse::Matrix hessian = BlurredEllipse::Matrix::Zero();  ///< both triangles
  BlurredEllipse::Vector gradient = BlurredEllipse::Vector::Zero();
  double chi2 = 0;

  Normal& operator+=(const Normal& other);
};

/// Sum of a[i] * b[i], always in the same order; `count` is a multiple of 8.
[[nodiscard]] float lane_dot(const float* a, const float* b, int count);

/// The model at up to `size` pixels: level, derivative by each parameter, and noise.
struct PixelBlock {
  static constexpr int size = 256;
  alignas(32) float gradient[BlurredEllipse::size][size];
  alignas(32) float residual[size];
  alignas(32) float weight[size];  ///< trust over the variance of the model's level
  alignas(32) float edge[size];    ///< 1 near the edge, else 0
};

/// A patch as one column of floats per quantity, so that vector units take several pixels at once.
/// Sorted by eighth of the dot; each eighth begins at a multiple of `lanes`, filled up with pixels
/// of no weight. Lanes are summed in a fixed order: the result is the same on every processor.
class PixelColumns {
 public:
  static constexpr int lanes = 8;
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

  [[nodiscard]] int size() const { return static_cast<int>(x_.size()); }
  [[nodiscard]] int x(int index) const { return static_cast<int>(x_[index]); }
  [[nodiscard]] int y(int index) const { return static_cast<int>(y_[index]); }
  [[nodiscard]] float trust(int index) const { return trust_[index]; }

 private:
  [[nodiscard]] Normal sum(int first, int last, const BlurredEllipse& model,
                           const NoiseModel& noise) const;

  std::vector<float> x_, y_, level_, trust_;
  std::array<int, 9> begin_ = {};
};

}  // namespace drape
