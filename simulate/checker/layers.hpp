// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "simulate/checker/sheet.hpp"
#include "simulate/objects/contact_forces.hpp"

/// The checker's own view of a sheet that lies on itself, in long double.
namespace drape::simulate::checker {

constexpr double kThickestCloth_m = 0.01;

/// Pairs of an edge of one cell and a triangle of another, which have no particle in common, that
/// pass through each other.
[[nodiscard]] int crossings_of(const std::vector<Point>& points, int rows, int cols);

/// Distance (m) at which two pieces of the sheet may press on each other.
struct LayerReach {
  Real layers_m = 0;
  Real neighbours_m = 0;  ///< where a grid step joins them
};

/// Particles near triangles and edges near edges of another layer as supports that push them apart:
/// positive weights on one layer, negative ones on the other.
[[nodiscard]] std::vector<Support> layer_supports_of(const std::vector<Point>& points, int rows,
                                                     int cols, const LayerReach& reach);

/// Rest of a force (N) of one layer on another at most `near_m` away, when it is cut to
/// what contact can do: pressing along the line between the two places, with what friction adds
/// across. The places are mixtures of the first `firsts` corners and of the others, whose weights
/// are negative. Nothing where they are not nearest to each other, or too far apart.
[[nodiscard]] std::optional<Point> layer_force(const std::array<Point, 4>& corner,
                                               const std::array<double, 4>& weight, int firsts,
                                               Real friction, Real near_m,
                                               const Eigen::Vector3d& force_in_world);

/// True if the weights are those of a place on either piece, the first one of `firsts` corners.
[[nodiscard]] bool are_layer_weights(const std::array<double, 4>& weight, int firsts);

/// Adds the stated force (N) of one layer of the sheet on another to `sum`, and its opposite to
/// that one, as far as contact can do it: pressing along the line between the two places, with what
/// friction adds across. False where the places are not two points of a particle and a triangle or
/// of two edges, without a common particle and not in one cell, that are nearest to each other and
/// within reach.
bool add_stated_layers(const std::vector<Point>& points, int cols, Real friction,
                       const LayerReach& reach, const ContactForce& stated,
                       std::vector<Point>& sum);

}  // namespace drape::simulate::checker
