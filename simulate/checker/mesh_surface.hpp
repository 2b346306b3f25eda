// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <map>
#include <utility>
#include <vector>

#include "simulate/checker/mesh_contact.hpp"

/// The surface of a mesh of cloth between its points, and what presses there.
namespace drape::simulate::checker {

/// A quadratic over a triangle: its area, unknowns (corners, sides) and their weights in its second
/// derivatives.
struct Quadratic {
  Real area;
  std::array<int, 6> unknown;
  std::vector<Real> uu, uv, vv;
};

/// Each triangle is four flat facets between its corners and the middles of its sides, where the
/// quadratics beside a side put them in the mean.
class MeshSurface {
 public:
  /// `quadratics` of the triangles, in their order.
  MeshSurface(const MeshRest& rest, const std::vector<Quadratic>& quadratics);

  /// Depths of points, and of places between them: quarters and middles of sides, middles of
  /// facets.
  [[nodiscard]] MeshDepths depths(const Objects& objects) const;
  /// Adds a stated force at a place of a triangle by its corners, as far as contact can do it, to
  /// points and sides. False where there is no such place or it is farther than kTouch_m outside
  /// the object. Of one layer on another the places are on a point of the surface and a facet or on
  /// two edges of facets, without a common point, nearer than the rest's thickness and than a
  /// quarter of what they are apart on the flat piece.
  [[nodiscard]] bool add(const Objects& objects, const ContactForce& stated,
                         std::vector<Point>& on_points, std::vector<Point>& on_sides) const;
  /// Pairs of an edge and a facet that pass through each other and have no point in common.
  [[nodiscard]] int crossings() const;

 private:
  [[nodiscard]] bool add_layers(const ContactForce& stated, Real friction,
                                std::vector<Point>& on_points, std::vector<Point>& on_sides) const;
  /// Weights of points and of sides in a place.
  struct Mixture {
    std::map<int, Real> points, sides;
  };
  [[nodiscard]] Point place_of(const Mixture& of) const;
  [[nodiscard]] bool are_pieces(const std::array<int, 4>& node, int firsts) const;
  [[nodiscard]] Real apart_on_flat_m(const ContactForce& stated) const;

  const MeshRest& rest_;
  std::vector<Mixture> middles_;
  std::vector<std::array<int, 3>> sides_of_;  ///< sides of each triangle, opposite its corners
  std::map<std::array<int, 3>, int> triangle_at_;
  std::vector<Point> nodes_;                ///< points, then middles of sides
  std::vector<std::array<int, 3>> facets_;  ///< nodes, in rising order
  std::vector<std::array<int, 2>> edges_;   ///< sides of facets, in order, each once
};

}  // namespace drape::simulate::checker
