// SPDX-License-Identifier: Apache-2.0
#include "detect/frame.hpp"

#include <fmt/core.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <vector>

#include "detect/ellipse_fit.hpp"
#include "detect/labels.hpp"
#include "detect/local_map.hpp"

namespace drape {
namespace {

constexpr std::size_t blur_samples = 9;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Unforeshortened radius of a dot in this frame: the direction a tag is not tilted in keeps its
/// length, so the larger singular value of its map is the scale.
std::optional<double> dot_radius_px(const PrintPlane& plane,
                                    const std::vector<TagDetection>& tags) {
  std::vector<double> radii;
  for (const TagDetection& tag : tags) {
    const auto map =
        map_at_centre(plane.tag_corners_m(tag.id), tag.corners_px, plane.tags.at(tag.id));
    if (!map) continue;
    const double scale = Eigen::JacobiSVD<Eigen::Matrix2d>(map->px_per_m).singularValues()(0);
    radii.push_back(scale * plane.dot_radius_m);
  }
  if (radii.empty()) return std::nullopt;
  return median(radii);
}

/// Edge width of this frame from its largest dots, where it can be told from their size.
BlurGuess frame_blur(const GreyImage& image, const Blobs& found, const NoiseModel& noise) {
  std::vector<const Blob*> largest;
  for (const Blob& blob : found.blobs) largest.push_back(&blob);
  std::stable_sort(largest.begin(), largest.end(), [](const Blob* a, const Blob* b) {
    return a->shape_px2.determinant() > b->shape_px2.determinant();
  });
  std::vector<double> widths;
  for (const Blob* blob : largest) {
    const DotFit fit = fit_dot(image, found.map, noise, *blob, BlurGuess{});
    if (fit.converged && fit.masked_edge < 0.1) widths.push_back(fit.blur_px);
    if (widths.size() == blur_samples) break;
  }
  if (widths.size() < blur_samples / 3) return {};
  const double width = median(widths);
  return {width, 0.15 * width};
}

bool inside_tag(const Eigen::Vector2d& px, const TagDetection& tag) {
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector2d a = tag.corners_px.col(k);
    const Eigen::Vector2d b = tag.corners_px.col((k + 1) % 4);
    const Eigen::Vector2d along = b - a, to = px - a;
    if (along.x() * to.y() - along.y() * to.x() < 0) return false;
  }
  return true;
}

std::vector<DotFit> fit_all(const GreyImage& image, const Blobs& found, const NoiseModel& noise) {
  const BlurGuess blur = frame_blur(image, found, noise);
  std::vector<DotFit> fits;
  fits.reserve(found.blobs.size());
  for (const Blob& blob : found.blobs) {
    fits.push_back(fit_dot(image, found.map, noise, blob, blur));
  }
  return fits;
}

struct Axes {
  Eigen::Vector2d semi_px;  // major, minor
  double angle_rad = 0;
};

Axes axes_of(const Eigen::Matrix2d& shape) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(shape);
  const Eigen::Vector2d major = eigen.eigenvectors().col(1);
  Axes axes;
  axes.semi_px = eigen.eigenvalues().cwiseMax(0).cwiseSqrt().reverse();
  axes.angle_rad = std::atan(major.x() == 0 ? 1e300 : major.y() / major.x());
  return axes;
}

double largest_sigma(const Eigen::Matrix2d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, eigen.eigenvalues()(1)));
}

/// Why a fit must not be used; empty when it may.
std::string fault(const DotFit& fit, const Eigen::Matrix2d& covariance, const FrameLimits& limits) {
  if (!fit.converged) return "bad fit: no blurred ellipse fits it";
  const Axes axes = axes_of(fit.shape_px2);
  if (fit.masked_edge > limits.most_masked_edge) {
    return fmt::format(
        "partly covered: {:.0f} % of its outline lies beside a tag, another dark "
        "region or the image border",
        100 * fit.masked_edge);
  }
  if (fit.saturated) return "saturated: grey level 255 around the dot";
  if (axes.semi_px.y() < limits.least_semi_axis_px) {
    return fmt::format("too small: minor semi-axis {:.2f} px", axes.semi_px.y());
  }
  if (fit.chi2_per_dof > limits.most_chi2_per_dof) {
    return fmt::format("bad fit: chi-square per degree of freedom {:.1f}", fit.chi2_per_dof);
  }
  if (fit.one_sided > limits.most_one_sided * std::max(1.0, fit.chi2_per_dof) &&
      fit.one_sided_px > limits.most_one_sided_px) {
    return fmt::format(
        "partly hidden or shadowed: the centre moves by {:.3f} px without one "
        "eighth of the outline",
        fit.one_sided_px);
  }
  const double sigma = largest_sigma(covariance);
  if (sigma > limits.most_sigma_px) {
    return fmt::format("too uncertain: standard deviation {:.2f} px", sigma);
  }
  return {};
}

Detection measured(const DotFit& fit, MarkId mark, const Eigen::Matrix2d& covariance) {
  const Axes axes = axes_of(fit.shape_px2);
  return {mark,           fit.centre_px, covariance,      axes.semi_px,
          axes.angle_rad, fit.contrast,  fit.chi2_per_dof};
}

void sort_out(const std::vector<DotFit>& fits, const std::vector<DotLabel>& labels,
              const Correlation& correlation, const FrameLimits& limits, FrameDetections& frame) {
  for (std::size_t k = 0; k < fits.size(); ++k) {
    const Eigen::Matrix2d covariance = honest_covariance(fits[k], correlation);
    const std::string wrong = fault(fits[k], covariance, limits);
    if (labels[k].mark && labels[k].reason.empty() && wrong.empty()) {
      frame.detections.push_back(measured(fits[k], *labels[k].mark, covariance));
    } else {
      frame.rejections.push_back(
          {labels[k].mark, fits[k].centre_px, wrong.empty() ? labels[k].reason : wrong});
    }
  }
  std::sort(frame.detections.begin(), frame.detections.end(),
            [](const Detection& a, const Detection& b) { return a.mark < b.mark; });
}

}  // namespace

FrameDetections detect_frame(const GreyImage& image, const PrintPlane& plane, TagFinder& finder,
                             const FrameLimits& limits) {
  FrameDetections frame;
  frame.width_px = image.width_px;
  frame.height_px = image.height_px;
  const NoiseModel noise = estimate_noise(image);
  frame.noise_sigma = noise.sigma(128);
  frame.tags = finder.find(image, plane, *frame.noise_sigma);
  const std::optional<double> radius_px = dot_radius_px(plane, frame.tags);
  if (!radius_px) return frame;
  Blobs found = find_blobs(image, noise, *radius_px);
  std::erase_if(found.blobs, [&](const Blob& blob) {
    return std::any_of(frame.tags.begin(), frame.tags.end(),
                       [&](const TagDetection& tag) { return inside_tag(blob.centre_px, tag); });
  });
  const std::vector<DotFit> fits = fit_all(image, found, noise);
  std::vector<UnlabelledDot> dots;
  for (const DotFit& fit : fits) {
    const bool sound = fit.converged && fit.chi2_per_dof <= limits.most_chi2_per_dof &&
                       fit.masked_edge <= limits.most_masked_edge;
    dots.push_back({fit.centre_px, fit.shape_px2, sound});
  }
  const std::vector<DotLabel> labels = label_dots(plane, frame.tags, dots, found.map);
  sort_out(fits, labels, frame_correlation(fits), limits, frame);
  return frame;
}

}  // namespace drape
