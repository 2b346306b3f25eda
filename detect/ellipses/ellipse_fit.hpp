// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <vector>

#include "detect/image/image.hpp"

// Compiles functions twice, with 256-bit vectors and without; the choice is made at program start.
// Sums are over whole lanes in a fixed order, so both versions give the same bytes.
#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define DRAPE_WIDE_VECTORS __attribute__((target_clones("avx2", "default")))
#else
#define DRAPE_WIDE_VECTORS
#endif

namespace drape::detect {

constexpr int lanes = 8;
using Lane = float __attribute__((vector_size(lanes * sizeof(float))));

/// Sum of a lane's values in a fixed order.
inline __attribute__((always_inline)) float total(const Lane& sum) {
  return ((sum[0] + sum[4]) + (sum[1] + sum[5])) + ((sum[2] + sum[6]) + (sum[3] + sum[7]));
}

/// Sum of a[i] * b[i] in a fixed order; `count` is a multiple of `lanes`.
inline __attribute__((always_inline)) float lane_sum(const float* a, const float* b, int count) {
  Lane sum = {};
  for (int i = 0; i < count; i += lanes) {
    Lane u, v;
    std::memcpy(&u, a + i, sizeof u);
    std::memcpy(&v, b + i, sizeof v);
    sum += u * v;
  }
  return total(sum);
}

/// Blurred image of a printed ellipse: I = (b + bx x + by y) (1 - k Phi(-d / s)), with d the signed
/// distance from the outline |M (p - c)| = 1, positive outside. Light multiplies the print, so a
/// gradient of the light does not shift the edge. The light is relative to the coordinates' origin.
class BlurredEllipse {
 public:
  static constexpr int size = 10;
  using Vector = Eigen::Matrix<double, size, 1>;
  using Matrix = Eigen::Matrix<double, size, size>;
  enum Parameter { light, light_x, light_y, print, cx, cy, m11, m12, m22, blur };

  explicit BlurredEllipse(const Vector& parameters) : p_(parameters) {}

  /// Distance from the centre in radii of the ellipse.
  [[nodiscard]] double radius(double x, double y) const {
    return (outline() * Eigen::Vector2d(x - p_(cx), y - p_(cy))).norm();
  }

  /// Least radius at which the first-order distance is evaluated; at the centre it is undefined.
  static constexpr double shallowest = 0.3;
  /// Distance from the outline at the least radius.
  [[nodiscard]] double deepest() const {
    return -(1 - shallowest) * shallowest / std::max(shallowest * outline().norm(), 1e-9);
  }

  /// Grey level of the unprinted cloth at a position.
  [[nodiscard]] double light_at(double x, double y) const {
    return p_(light) + p_(light_x) * x + p_(light_y) * y;
  }
  [[nodiscard]] double light_at_centre() const { return light_at(p_(cx), p_(cy)); }
  [[nodiscard]] Eigen::Matrix2d outline() const {
    Eigen::Matrix2d m;
    m << p_(m11), p_(m12), p_(m12), p_(m22);
    return m;
  }
  [[nodiscard]] const Vector& parameters() const { return p_; }

 private:
  Vector p_;
};

/// A pixel of a patch; positions are relative to the patch's origin.
struct PatchPixel {
  int x = 0, y = 0;
  double level = 0;
  double distance = 0;  ///< from the initial outline, positive outside
  int sector = 0;       ///< eighth of the dot that it belongs to
  double trust = 1;     ///< initial weight
};

/// Pixels used to fit a dot: its ellipse and a ring around it.
struct Patch {
  Eigen::Vector2i origin;  ///< image position of the blob's centre, rounded
  int reach_x = 0, reach_y = 0;
  std::vector<PatchPixel> pixels;
  double masked_edge = 0;  ///< unusable fraction of the outline
  bool saturated = false;
};

/// Cuts out the patch of a blob, without pixels near other dark regions or outside the image.
/// `start` is relative to the rounded centre. If dots can have a light centre (its fraction of the
/// radius is not 0), the core is left out of every dot: only the outline locates it.
[[nodiscard]] Patch cut_patch(const GreyImage& image, const DarkMap& map, const Blob& blob,
                              const BlurredEllipse& start, double light_centre_fraction);

/// Before the first fit, excludes ring pixels much darker than the brighter part of the ring:
/// table, or shadowed cloth behind a silhouette. True if there were any.
bool set_dark_ring_aside(Patch& patch);

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

  /// Sums over all pixels. Uses the noise at the model's level; that of the observed level would
  /// favour dark noise.
  [[nodiscard]] Normal sum(const BlurredEllipse& model, const NoiseModel& noise) const;
  /// The same sums per eighth of the dot.
  [[nodiscard]] std::array<Normal, 8> sum_sectors(const BlurredEllipse& model,
                                                  const NoiseModel& noise) const;
  /// Evaluates `count` <= PixelBlock::size pixels starting at `first`.
  void evaluate(int first, int count, const BlurredEllipse& model, const NoiseModel& noise,
                PixelBlock& block) const;

  /// After a fit, reduces the weight of pixels outside the outline that belong to other objects.
  /// Tukey's biweight acts on gross misfits only, since weights that follow small misfits of the
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

/// Texture of the cloth in the bright ring around a dot: sums of products of residuals, in units of
/// noise, over pixel pairs by distance.
struct RingResiduals {
  static constexpr std::array<int, 10> distances = {0, 1, 2, 4, 5, 8, 9, 10, 13, 18};  ///< px^2
  static constexpr int count = static_cast<int>(distances.size());
  using Sums = Eigen::Matrix<double, count, 1>;
  Sums product = Sums::Zero();
  double pixels = 0;
  /// Expected products (rows) per unit of texture correlation (columns); below 1, since the fit
  /// absorbs part of the texture.
  Eigen::Matrix<double, count, count> seen = Eigen::Matrix<double, count, count>::Zero();
};

/// Residuals near the outline, where the centre is sensitive, summed over pixel pairs by squared
/// distance in px^2 (0: each pixel with itself).
struct EdgeResiduals {
  static constexpr int classes = 19;  ///< pairs up to 3 pixels apart in both directions
  double chi2 = 0;  ///< weighted by a pixel's influence on the centre; 1 for pure noise
  std::array<double, classes> product = {};  ///< products of residuals, in units of noise
  std::array<double, classes> pairs = {};
  std::array<double, classes> influence = {};  ///< products of the centre's sensitivities
  double light = 1;                            ///< variance of texture here over that in the ring
  std::optional<RingResiduals> ring;           ///< only if requested for the fit
};

/// Correlation of the noise in a frame, pooled over its fits: cloth texture and lens blur correlate
/// neighbouring pixels.
struct Correlation {
  /// Correlation of residuals near outlines, by squared distance.
  std::array<double, EdgeResiduals::classes> at = {};
  /// Texture in addition to the frame's white noise, in units of its variance, from the rings.
  RingResiduals::Sums texture = RingResiduals::Sums::Zero();
};
/// Prior of the edge width (px, Gaussian sigma of lens, motion and pixel together).
struct BlurGuess {
  double mean_px = 0.7;
  double sigma_px = 0.3;
};

/// Fit of a dot as a blurred ellipse under light that multiplies the print: I = (b + bx x + by y)
/// (1 - k Phi(-d / s)), d the signed distance from the ellipse.
struct DotFit {
  bool converged = false;
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d shape_px2 = Eigen::Matrix2d::Identity();
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Identity();  ///< for the frame's white noise
  double contrast = 0;                                           ///< k b, grey levels
  double blur_px = 0;                                            ///< s
  double chi2_per_dof = 0;
  double misfit = 0;        ///< rms residual over contrast
  double masked_edge = 0;   ///< fraction of the outline hidden by masks or outside the image
  double one_sided = 0;     ///< largest chi-square of the centre's shift without one eighth
  double one_sided_px = 0;  ///< the shift itself
  bool saturated = false;
  std::optional<double> centre_fraction;  ///< brightness of the core: 0 like print, 1 like cloth
  EdgeResiduals edge;
};

/// Fits one blob by damped Gauss-Newton steps, without pixels near other dark regions.
/// `light_centre_fraction`: radius of the light centre that some dots of the print have, in radii
/// of the dot; 0 if none has. `with_ring`: also evaluate the cloth's texture in the ring around the
/// dot; a few dots per frame suffice.
[[nodiscard]] DotFit fit_dot(const GreyImage& image, const DarkMap& map, const NoiseModel& noise,
                             const Blob& start, const BlurGuess& blur,
                             double light_centre_fraction = 0, bool with_ring = false);

/// Edge width found by the fit of one blob without a prior; nullopt if no ellipse fits or its
/// outline is partly hidden.
[[nodiscard]] std::optional<double> blur_of_dot(const GreyImage& image, const DarkMap& map,
                                                const NoiseModel& noise, const Blob& start,
                                                double light_centre_fraction);

/// Correlation of the noise in the frame of these fits.
[[nodiscard]] Correlation frame_correlation(const std::vector<DotFit>& fits);

/// Covariance of the centre: that of the fit for white noise, times the sandwich estimator of least
/// squares with the correlation of the outline's residuals or of the ring's texture, whichever is
/// larger. The residuals include misfits but lack the texture absorbed by the fit.
[[nodiscard]] Eigen::Matrix2d honest_covariance(const DotFit& fit, const Correlation& correlation);

}  // namespace drape::detect
