// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "calib/exchange/exchange.hpp"
#include "core/camera_derivatives.hpp"
#include "core/error.hpp"
#include "core/geometry/dense.hpp"

namespace drape::calib {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kColumns = 41, kRows = 31;  // grid of compared pixels, corners included
constexpr int kSteps = 30;

struct Ray {
  Vector3d direction;
  Vector2d px;
};

std::vector<Ray> rays_of(const CameraModel& model) {
  std::vector<Ray> rays;
  for (int row = 0; row < kRows; ++row) {
    for (int col = 0; col < kColumns; ++col) {
      const Vector2d px((model.width_px - 1) * col / (kColumns - 1.0),
                        (model.height_px - 1) * row / (kRows - 1.0));
      if (const auto ray = unproject(model, px)) rays.push_back({*ray, px});
    }
  }
  return rays;
}

BrownLens start_of(const CameraModel& model) {
  if (const auto* brown = std::get_if<BrownLens>(&model.lens)) return *brown;
  const auto& tsai = std::get<TsaiLens>(model.lens);
  BrownLens lens;
  lens.fx_px = tsai.scale_x * tsai.focal_m / tsai.pixel_pitch_x_m;
  lens.fy_px = tsai.focal_m / tsai.pixel_pitch_y_m;
  lens.cx_px = tsai.cx_px;
  lens.cy_px = tsai.cy_px;
  return lens;
}

/// Terms of the lens in the order of parameter_names().
std::vector<double*> terms_of(BrownLens& lens, BrownTerms terms) {
  std::vector<double*> all = {&lens.fx_px, &lens.fy_px, &lens.cx_px, &lens.cy_px, &lens.k1,
                              &lens.k2,    &lens.p1,    &lens.p2,    &lens.k3};
  if (terms == BrownTerms::k1_k2_p1_p2) all.pop_back();
  return all;
}

/// One Gauss-Newton step; returns its size in pixels. The models are close, so it needs no damping.
double improve(const std::vector<Ray>& rays, const CameraModel& shape, BrownTerms terms,
               BrownLens& lens) {
  const auto parameters = terms_of(lens, terms);
  const auto count = static_cast<Eigen::Index>(parameters.size());
  const CameraModel model{lens, shape.width_px, shape.height_px};
  MatrixXd jacobian = MatrixXd::Zero(2 * rays.size(), count);
  VectorXd residuals = VectorXd::Zero(2 * rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto image = project(model, rays[i].direction);
    const auto by_lens = d_px_d_lens(model, rays[i].direction);
    if (!image || !by_lens) continue;
    const auto row = 2 * static_cast<Eigen::Index>(i);
    residuals.segment<2>(row) = rays[i].px - image->px;
    jacobian.middleRows<2>(row) = by_lens->leftCols(count);
  }
  // Scales terms of very different size; a term that the image does not determine stays unchanged.
  const VectorXd scale = jacobian.colwise().norm().cwiseMax(1e-300).cwiseInverse();
  const MatrixXd scaled = jacobian * scale.asDiagonal();
  const VectorXd step = least_squares(scaled, residuals);
  for (Eigen::Index i = 0; i < count; ++i) *parameters[i] += scale[i] * step[i];
  return (scaled * step).lpNorm<Eigen::Infinity>();
}

BrownRefit compared(const std::vector<Ray>& rays, const CameraModel& shape, const BrownLens& lens) {
  BrownRefit refit;
  refit.lens = lens;
  const CameraModel model{lens, shape.width_px, shape.height_px};
  double sum = 0;
  for (const Ray& ray : rays) {
    const auto image = project(model, ray.direction);
    const double distance = image ? (image->px - ray.px).norm() : HUGE_VAL;
    sum += distance * distance;
    refit.max_px = std::max(refit.max_px, distance);
  }
  refit.points = static_cast<int>(rays.size());
  refit.rms_px = std::sqrt(sum / static_cast<double>(rays.size()));
  return refit;
}

}  // namespace

BrownRefit refit_as_brown(const CameraModel& model, BrownTerms terms) {
  const auto* brown = std::get_if<BrownLens>(&model.lens);
  if (brown != nullptr && (terms == BrownTerms::k1_k2_p1_p2_k3 || brown->k3 == 0)) {
    return {*brown, 0, 0, 0};
  }
  const auto rays = rays_of(model);
  if (2 * rays.size() < static_cast<std::size_t>(kColumns) * kRows) {
    throw bad_input("the lens model has no rays for more than half of the image", {},
                    "calibrate again with the target over the whole image");
  }
  BrownLens lens = start_of(model);
  if (terms == BrownTerms::k1_k2_p1_p2) lens.k3 = 0;
  for (int i = 0; i < kSteps && improve(rays, model, terms, lens) > 1e-10; ++i) {
  }
  return compared(rays, model, lens);
}

}  // namespace drape::calib
