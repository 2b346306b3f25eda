// SPDX-License-Identifier: Apache-2.0
#include "detect/ellipses/ellipse_fit.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <iostream>
#include <numbers>

#include "detect/test_pictures.hpp"
#include "tests/support/trials.hpp"

namespace drape::test {

using namespace detect;

namespace {

const DarkMap nothing_else{64, 64, {}, std::vector<std::size_t>(65, 0)};

struct Outcome {
  double rms_px = 0;  // per axis
  double bias_px = 0;
  double nees = 0;  // per axis, 1 if the covariance is right
  int converged = 0;
};

Outcome trials(SyntheticDot dot, int count, double noise_slope = 0) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(31.5, 32.5);
  const NoiseModel noise{dot.noise * dot.noise + dot.rounding(), noise_slope};
  Outcome outcome;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double square = 0;
  for (int k = 0; k < count; ++k) {
    dot.centre_px = {place(random), place(random)};
    const GreyImage image = draw(dot, random);
    const DotFit fit = fit_dot(image, nothing_else, noise, blob_of(dot), {0.67, 0.1});
    if (!fit.converged) continue;
    ++outcome.converged;
    const Eigen::Vector2d error = fit.centre_px - dot.centre_px;
    sum += error;
    square += error.squaredNorm() / 2;
    outcome.nees += error.dot(fit.covariance_px2.inverse() * error) / 2;
  }
  outcome.rms_px = std::sqrt(square / outcome.converged);
  outcome.bias_px = sum.norm() / outcome.converged;
  outcome.nees /= outcome.converged;
  return outcome;
}

/// Cramer-Rao bound of a round dot's centre with a flat background of unknown level: sigma_noise /
/// contrast * sqrt(2 s / (sqrt(pi) r)), where s is the edge's Gaussian sigma including the pixel.
double bound_px(const SyntheticDot& dot) {
  const double s = std::sqrt(dot.lens_blur_px * dot.lens_blur_px + 1.0 / 12);
  const double r = std::sqrt(dot.shape_px2(0, 0));
  const double noise = std::sqrt(dot.noise * dot.noise + dot.rounding());
  return noise / dot.contrast * std::sqrt(2 * s / (std::sqrt(std::numbers::pi) * r));
}

/// A low-noise sensor of 12 bits in dim light: accuracy lost by rounding to 8 bits is gained. (At
/// full contrast the model error of 0.002 px hides it.)
TEST(EllipseFit, ADeepPictureIsAsGoodAsItsNoise) {
  SyntheticDot dot;
  dot.noise = 0.15;
  dot.bright = 40;
  dot.contrast = 8;
  const Outcome plain = trials(dot, 300);
  dot.bits = 12;
  const Outcome deep = trials(dot, 300);
  EXPECT_EQ(deep.converged, 300);
  EXPECT_LT(deep.rms_px, 1.15 * bound_px(dot));
  EXPECT_LT(deep.nees, 1.25);
  std::cout << "8 bits " << plain.rms_px << " px, 12 bits " << deep.rms_px << " px, bound "
            << bound_px(dot) << " px\n";
  EXPECT_LT(deep.rms_px, plain.rms_px);
}

/// Cramer-Rao bound of the centre (RMS per axis) for the whole model, with light slopes and shape
/// as nuisance parameters: inverse of the information in the patch under white noise.
double cramer_rao_px(const SyntheticDot& dot) {
  using Model = BlurredEllipse;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(dot.shape_px2);
  const Eigen::Matrix2d outline = eigen.operatorInverseSqrt();
  Model::Vector p;
  p << dot.bright, 0, 0, dot.contrast / dot.bright, 0, 0, outline(0, 0), outline(0, 1),
      outline(1, 1), std::sqrt(dot.lens_blur_px * dot.lens_blur_px + 1.0 / 12);
  const GreyImage any{64, 64, std::vector<std::uint8_t>(64 * 64), {}};
  Blob blob = blob_of(dot);
  blob.centre_px = {32, 32};
  const Patch patch = cut_patch(any, nothing_else, blob, Model(p), 0);
  const NoiseModel noise{dot.noise * dot.noise + 1.0 / 12, 0};
  const Model::Matrix information = PixelColumns(patch).sum(Model(p), noise).hessian;
  const Model::Matrix covariance = information.inverse();
  return std::sqrt((covariance(Model::cx, Model::cx) + covariance(Model::cy, Model::cy)) / 2);
}

TEST(EllipseFit, TableAgainstTheCramerRaoBound) {
  const int count = trial_count(80, 1000);
  // The RMS of 2 n axis samples scatters by 1 / sqrt(4 n); three times that is allowed.
  const double luck = 1 + 3 / std::sqrt(4.0 * count);
  std::cout << "dot px, minor/major, contrast: bound px, rms px, ratio, NEES/2\n";
  for (const double diameter : {8.0, 12.0, 18.0, 30.0}) {
    for (const double ratio : {1.0, 0.5}) {
      for (const double contrast : {60.0, 120.0}) {
        SyntheticDot dot;
        const double r = diameter / 2;
        dot.shape_px2 = Eigen::Vector2d(r * r, r * r * ratio * ratio).asDiagonal();
        dot.contrast = contrast;
        const Outcome outcome = trials(dot, count);
        const double bound = cramer_rao_px(dot);
        std::cout << diameter << ", " << ratio << ", " << contrast << ": " << bound << ", "
                  << outcome.rms_px << ", " << outcome.rms_px / bound << ", " << outcome.nees
                  << "\n";
        EXPECT_EQ(outcome.converged, count);
        EXPECT_LE(outcome.rms_px, 1.10 * luck * bound) << diameter << " px, ratio " << ratio;
        if (ratio == 1) {
          // The closed form does not include estimating the slope of the light.
          EXPECT_LT(outcome.rms_px, 1.15 * luck * bound_px(dot)) << diameter;
          EXPECT_GT(outcome.rms_px, 0.85 / luck * bound_px(dot)) << diameter;
        }
        EXPECT_GT(outcome.nees, 0.8 / (luck * luck));
        EXPECT_LT(outcome.nees, 1.25 * luck * luck);
      }
    }
  }
}

TEST(EllipseFit, TableUnderLightThatSlopesByOnePercentAPixel) {
  const int count = trial_count(80, 1000);
  const double luck = 1 + 3 / std::sqrt(4.0 * count);
  std::cout << "dot px, minor/major: bound px, rms px, ratio, bias px, NEES/2\n";
  for (const double diameter : {12.0, 18.0, 30.0}) {
    for (const double ratio : {1.0, 0.5}) {
      SyntheticDot dot;
      const double r = diameter / 2;
      dot.shape_px2 = Eigen::Vector2d(r * r, r * r * ratio * ratio).asDiagonal();
      dot.slope_per_px = 0.01;
      const Outcome outcome = trials(dot, count);
      const double bound = cramer_rao_px(dot);
      std::cout << diameter << ", " << ratio << ": " << bound << ", " << outcome.rms_px << ", "
                << outcome.rms_px / bound << ", " << outcome.bias_px << ", " << outcome.nees
                << "\n";
      EXPECT_EQ(outcome.converged, count);
      EXPECT_LE(outcome.rms_px, 1.25 * luck * bound);
      // The mean of n trials scatters by rms / sqrt(n) per axis.
      EXPECT_LE(outcome.bias_px, 0.005 + 3 * outcome.rms_px / std::sqrt(count));
    }
  }
}

TEST(EllipseFit, CovarianceIsHonestOnWeave) {
  const int count = trial_count(100, 1000);
  std::cout
      << "dot px, weave rms: rms px, NEES/2 of white noise, NEES/2 with the residuals' word\n";
  for (const double diameter : {12.0, 18.0}) {
    for (const double texture : {4.0, 8.0}) {
      SyntheticDot dot;
      dot.shape_px2 = diameter * diameter / 4 * Eigen::Matrix2d::Identity();
      dot.texture = texture;
      std::mt19937 random(11);
      std::uniform_real_distribution<double> place(31.5, 32.5);
      const NoiseModel noise{dot.noise * dot.noise + 1.0 / 12, 0};
      std::vector<DotFit> fits;
      std::vector<Eigen::Vector2d> errors;
      for (int k = 0; k < count; ++k) {
        dot.centre_px = {place(random), place(random)};
        const GreyImage image = draw(dot, random);
        fits.push_back(
            fit_dot(image, nothing_else, noise, blob_of(dot), {0.67, 0.1}, 0, k % 10 == 0));
        ASSERT_TRUE(fits.back().converged);
        errors.push_back(fits.back().centre_px - dot.centre_px);
      }
      const Correlation correlation = frame_correlation(fits);
      double square = 0, white = 0, honest = 0;
      for (int k = 0; k < count; ++k) {
        const auto nees = [&](const Eigen::Matrix2d& covariance) {
          return errors[k].dot(covariance.inverse() * errors[k]) / 2 / count;
        };
        square += errors[k].squaredNorm() / 2 / count;
        white += nees(fits[k].covariance_px2);
        honest += nees(honest_covariance(fits[k], correlation));
      }
      std::cout << diameter << ", " << texture << ": " << std::sqrt(square) << ", " << white << ", "
                << honest << "\n";
      const double luck = 1 + 3 / std::sqrt(count);
      EXPECT_GT(honest, 0.7 / luck);
      EXPECT_LT(honest, 1.5 * luck);
    }
  }
}

TEST(EllipseFit, TiltedDotKeepsShapeAndAngle) {
  SyntheticDot dot;
  const double angle = 0.5;
  const Eigen::Rotation2D<double> turn(angle);
  dot.shape_px2 = turn.toRotationMatrix() * Eigen::Vector2d(64, 9).asDiagonal() *
                  turn.toRotationMatrix().transpose();
  dot.noise = 0.5;
  std::mt19937 random(3);
  const DotFit fit = fit_dot(draw(dot, random), nothing_else, {0.3, 0}, blob_of(dot), {0.67, 0.1});
  ASSERT_TRUE(fit.converged);
  // Blur over a strongly curved end (radius 9/8 px here) widens it by about s^2 / (2 R) = 0.2 px.
  EXPECT_LT((fit.shape_px2 - dot.shape_px2).norm() / dot.shape_px2.norm(), 0.06);
  EXPECT_LT((fit.centre_px - dot.centre_px).norm(), 0.01);
  EXPECT_NEAR(fit.contrast, dot.contrast, 2.0);
  EXPECT_NEAR(fit.blur_px, 0.67, 0.05);
}

TEST(EllipseFit, AHiddenPartShowsAsOneSided) {
  SyntheticDot whole;
  SyntheticDot cut = whole;
  cut.hidden_from_u = whole.centre_px.x() + 6;  // 2 of 16 px of the dot are covered
  std::mt19937 random(5);
  const auto fit = [&](const SyntheticDot& dot) {
    return fit_dot(draw(dot, random), nothing_else, {4.1, 0}, blob_of(dot), {0.67, 0.1});
  };
  const DotFit good = fit(whole), bad = fit(cut);
  ASSERT_TRUE(good.converged);
  // 99.9 % quantile of the largest of 8 chi-squares with 2 degrees of freedom.
  EXPECT_LT(good.one_sided, 18);
  ASSERT_TRUE(bad.converged);
  EXPECT_GT(bad.one_sided, 100);
  EXPECT_GT(bad.one_sided_px, 0.05);
}

TEST(EllipseFit, SaturationAndCoverAreSeen) {
  SyntheticDot dot;
  dot.bright = 280;
  dot.contrast = 200;
  std::mt19937 random(5);
  const GreyImage image = draw(dot, random);
  EXPECT_TRUE(fit_dot(image, nothing_else, {4, 0}, blob_of(dot), {}).saturated);
  DarkMap beside{64, 64, std::vector<DarkRun>(64, {36, 64, 2}), {}};
  for (std::size_t y = 0; y <= 64; ++y) beside.row_begins.push_back(y);
  EXPECT_GT(fit_dot(image, beside, {4, 0}, blob_of(dot), {}).masked_edge, 0.3);
}

TEST(EllipseFit, CorrelatedNoiseWidensTheCovariance) {
  DotFit fit;
  fit.edge.influence[0] = 1;
  fit.edge.influence[1] = 2;
  fit.edge.chi2 = 1;
  Correlation white = {}, cloth = {};
  cloth.at[1] = 0.5;
  EXPECT_DOUBLE_EQ(honest_covariance(fit, white)(0, 0), 1);
  EXPECT_DOUBLE_EQ(honest_covariance(fit, cloth)(0, 0), 2);
  fit.edge.chi2 = 3;
  EXPECT_DOUBLE_EQ(honest_covariance(fit, cloth)(0, 0), 6);
}

}  // namespace
}  // namespace drape::test
