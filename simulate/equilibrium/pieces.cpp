// SPDX-License-Identifier: Apache-2.0
// Triangles of cells that press where they are deepest.
#include <algorithm>

#include "simulate/equilibrium/contacts.hpp"
#include "simulate/equilibrium/mixture.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr double kWatchPiece = 0.2e-3;  // m; a piece farther from a surface stays off it in a step

}  // namespace

/// The triangle of a cell, its corners the two particles of an edge and the cell's middle.
SheetTriangle StaticContacts::piece_of(const Contact& contact, const Field& position) const {
  SheetTriangle triangle;
  const QuarterWeights weights = quarter_weights(contact.quarter);
  for (int c = 0; c < 3; ++c) {
    triangle[c].setZero();
    for (int k = 0; k < 4; ++k) {
      if (weights(k, c) != 0) triangle[c] += weights(k, c) * at(position, contact.particle[k]);
    }
  }
  return triangle;
}

DeepestPlace StaticContacts::deepest_of(const Contact& contact, const Field& position) const {
  return deepest_place(*surroundings_, contact.shape, piece_of(contact, position));
}

double StaticContacts::gap_of(const Contact& contact, const Field& position) const {
  if (contact.slides) return deepest_of(contact, position).depth_m;
  return surroundings_->gap_m(contact.shape, mix(position, contact));
}

StaticContacts::Pressing StaticContacts::pressing_at(const Contact& contact,
                                                     const Field& position) const {
  if (contact.slides) {
    const DeepestPlace deepest = deepest_of(contact, position);
    return {contact.particle, weights_of(contact, deepest), deepest.normal, deepest.depth_m};
  }
  const Vector3d p = mix(position, contact);
  return {contact.particle, contact.weight, surroundings_->normal(contact.shape, p),
          surroundings_->gap_m(contact.shape, p)};
}

/// Whether a pin puts the piece on the surface. Then only the pin says how deep it is: a piece that
/// turns about a place on a surface enters it by the square of the angle, and such a contact has no
/// finite force; two pins on a round body even hold the piece between them inside it.
bool StaticContacts::is_held_at(int shape, const Contact& piece, const Field& position) const {
  const auto is_near = [&](const Vector3d& p) {
    return surroundings_->gap_m(shape, p) < kWatchPiece;
  };
  for (int k = 0; k < piece.corners; ++k) {
    const int i = piece.particle[k];
    if (is_pinned_[i] != 0 && is_near(at(position, i))) return true;
  }
  return std::any_of(holds_.begin(), holds_.end(), [&](const Hold& hold) {
    for (int k = 0; k < 4; ++k) {
      const auto end = piece.particle.end();
      if (hold.weight[k] != 0 && std::find(piece.particle.begin(), end, hold.particle[k]) == end)
        return false;
    }
    return is_near(mix(position, hold));
  });
}

std::array<double, 4> StaticContacts::weights_of(const Contact& contact,
                                                 const DeepestPlace& deepest) {
  const Eigen::Vector4d weight = quarter_weights(contact.quarter) * deepest.weights;
  return {weight[0], weight[1], weight[2], weight[3]};
}

/// Lists the triangles of a cell that are near a surface and may be deeper than their corners.
void StaticContacts::watch_cell(const Field& position, int corner) {
  const int cols = cloth_->grid().cols;
  Contact contact;
  contact.corners = 4;
  contact.particle = {corner, corner + 1, corner + cols, corner + cols + 1};
  contact.slides = true;
  contact.stiffness = particle_stiffness_;
  Vector3d middle = Vector3d::Zero();
  for (const int i : contact.particle) middle += 0.25 * at(position, i);
  double reach = 0;
  for (const int i : contact.particle) reach = std::max(reach, (at(position, i) - middle).norm());
  for (int shape = 0; shape < surroundings_->count(); ++shape) {
    if (surroundings_->is_flat(shape)) continue;
    if (surroundings_->gap_m(shape, middle) - reach > kWatchPiece) continue;
    if (is_held_at(shape, contact, position)) continue;
    for (contact.quarter = 0; contact.quarter < kQuarters; ++contact.quarter) {
      const SheetTriangle triangle = piece_of(contact, position);
      if (is_seen_flat(*surroundings_, shape, triangle)) continue;
      contact.site =
          (cloth_->count() + kQuarters * corner + contact.quarter) * surroundings_->count() + shape;
      contact.deepest = deepest_place(*surroundings_, shape, triangle);
      if (contact.deepest.depth_m > kWatchPiece) continue;
      contact.shape = shape;
      contact.weight = weights_of(contact, contact.deepest);
      contacts_.push_back(contact);
    }
  }
}

}  // namespace drape::simulate
