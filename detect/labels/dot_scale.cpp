// SPDX-License-Identifier: Apache-2.0
#include "detect/labels/dot_scale.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/statistics/sample.hpp"
#include "detect/labels/lattice.hpp"

namespace drape::detect {
namespace {

constexpr double nearest_counted = 0.55;
constexpr double farthest_counted = 1.45;
constexpr int least_neighbours = 2;
constexpr std::size_t least_dots = 9;
constexpr std::array<DotSizes, 3> all_sizes = {{{4, 26}, {1.5, 8}, {16, 100}}};

double semi_major(const Blob& blob) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(blob.shape_px2,
                                                             Eigen::EigenvaluesOnly);
  return std::sqrt(eigen.eigenvalues()(1));
}

/// Blobs of about the same size a pitch away, as this blob's own ellipse has it.
int neighbours_of(const Blob& blob, const std::vector<Blob>& blobs,
                  const std::vector<double>& radii, double radius, const PrintPlane& plane) {
  const Eigen::Matrix2d undo = symmetric_root(blob.shape_px2).inverse();
  const double radii_per_pitch = plane.pitch_m / plane.dot_radius_m;
  int count = 0;
  for (std::size_t k = 0; k < blobs.size(); ++k) {
    const Eigen::Vector2d away = blobs[k].centre_px - blob.centre_px;
    if (away.norm() > farthest_counted * radii_per_pitch * radius) continue;
    if (radii[k] < 0.6 * radius || radii[k] > 1.6 * radius) continue;
    const double pitches = (undo * away).norm() / radii_per_pitch;
    count += pitches > nearest_counted && pitches < farthest_counted;
  }
  return count;
}

}  // namespace

std::vector<UnlabelledDot> dots_of(const std::vector<Blob>& blobs) {
  std::vector<UnlabelledDot> dots;
  dots.reserve(blobs.size());
  for (const Blob& blob : blobs) dots.push_back({blob.centre_px, blob.shape_px2, true});
  return dots;
}

std::optional<double> common_radius_px(const std::vector<Blob>& blobs, const PrintPlane& plane) {
  std::vector<double> radii;
  radii.reserve(blobs.size());
  for (const Blob& blob : blobs) radii.push_back(semi_major(blob));
  std::vector<double> common;
  double area = 0;
  for (std::size_t k = 0; k < blobs.size(); ++k) {
    if (neighbours_of(blobs[k], blobs, radii, radii[k], plane) < least_neighbours) continue;
    common.push_back(radii[k]);
    area += radii[k] * radii[k];
  }
  // The median by area: the many small regions inside tags weigh less than the dots.
  std::sort(common.begin(), common.end());
  double below = 0;
  for (const double radius : common) {
    below += radius * radius;
    if (below >= area / 2) return radius;
  }
  return std::nullopt;
}

DotSizes usual_sizes() {
  return all_sizes.front();
}

std::optional<double> lattice_radius_px(const GreyImage& image, const NoiseModel& noise,
                                        const PrintPlane& plane) {
  std::size_t most = least_dots - 1;
  std::optional<double> best;
  for (const DotSizes& sizes : all_sizes) {
    const std::vector<Blob> blobs =
        find_blobs(image, noise, sizes, plane.classes.has_value()).blobs;
    const auto pieces = grow_pieces(plane, dots_of(blobs), std::vector<char>(blobs.size(), 0));
    if (pieces.empty() || pieces.front().size() <= most) continue;
    most = pieces.front().size();
    std::vector<double> radii;
    for (const auto& [place, dot] : pieces.front()) radii.push_back(semi_major(blobs[dot]));
    best = median(std::move(radii));
  }
  return best;
}

}  // namespace drape::detect
