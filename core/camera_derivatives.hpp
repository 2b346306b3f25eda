// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "core/camera_model.hpp"

namespace drape {

using Matrix2X = Eigen::Matrix<double, 2, Eigen::Dynamic>;

/// Derivative of the projected pixel with respect to the lens parameters, one column for each, in
/// the order and the file units of parameter_names(). nullopt wherever project() returns nullopt.
[[nodiscard]] std::optional<Matrix2X> d_px_d_lens(const CameraModel& model,
                                                  const Eigen::Vector3d& point_in_camera);

/// J with exp(w + dw) = exp(J dw) exp(w) to first order, for a rotation vector w (rad).
[[nodiscard]] Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& rotation_vector);

/// Derivative of the pixel of a world point (metres) with respect to all parameters of a camera:
/// the lens, the rotation vector (rad) and the translation (mm), as in parameter_names().
[[nodiscard]] std::optional<Matrix2X> d_px_d_parameters(const Camera& camera,
                                                        const Eigen::Vector3d& point_in_world);

}  // namespace drape
