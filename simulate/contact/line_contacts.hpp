// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "simulate/cloth/cloth.hpp"
#include "simulate/objects/surroundings.hpp"

namespace drape::simulate {

/// Contact of the cloth between its particles: each grid line piece touches an object at its
/// deepest point (Shapes::smooth: at a place that slides there) and each cell at nine inner points,
/// so that an edge of a box cannot cut through a coarse grid. The force is elastic, far softer than
/// the springs: on a surface that is smooth the whole sheet would sink in by at most
/// `sheet_sink_m`, for a corner bears the same part of it on any grid; on meshes, boxes and
/// cylinders of sharp edges, whose normals turn within the depth, one particle's weight by
/// `sink_m`. Friction is an
/// elastic-plastic tangential spring of the latter stiffness.
class LineContacts {
 public:
  static constexpr double sink_m = 2e-6;
  static constexpr double sheet_sink_m = 0.25e-3;

  /// A watched place of the sheet: a mixture of up to four particles.
  struct Point {
    int element = 0;  ///< a line piece or a place in a cell, below elements()
    int shape = 0;
    std::array<int, 4> particle{};
    std::array<double, 4> weight{};
  };

  /// `smooth` leaves meshes and boxes of sharp edges to PairContacts.
  enum class Shapes { all, smooth };

  LineContacts(const Cloth& cloth, const Surroundings& surroundings, double friction,
               double gravity_m_per_s2, Shapes shapes = Shapes::all);

  /// Finds the deepest points again.
  void refresh(const Field& position);
  /// The same where it may have changed: `path_m` is each particle's path length so far, and an
  /// element is looked at again when one of its particles has come far enough to matter.
  void refresh(const Field& position, const std::vector<double>& path_m);
  /// Lets the next refresh() look at every element.
  void look_everywhere();
  /// Leaves out of add_forces() and advance() what stays outside as long as no particle moves by
  /// more than `margin_m`; `farthest_path_m` is the sum of the fastest particles' path lengths.
  void choose(const Field& position, double farthest_path_m, double margin_m);
  /// Lets the places on lines that press slide towards where they are deepest now; returns the
  /// elastic energy that this brings in.
  double follow(const Field& position);
  /// The same until they hardly move.
  double settle(const Field& position);
  /// Leaves nothing out.
  void choose_all();
  /// Adds forces (N). `velocity` absent: the static force, without contact damping.
  void add_forces(const Field& position, const Field* velocity, Field& force) const;
  /// Moves the friction springs by a step of the motion.
  void advance(const Field& position, const Field& velocity, double step_s);

  [[nodiscard]] int count() const { return static_cast<int>(points_.size()); }
  [[nodiscard]] const std::vector<Point>& points() const { return points_; }
  [[nodiscard]] int elements() const { return elements_; }
  [[nodiscard]] double stiffness_n_per_m(int shape) const { return pressing_[shape].stiffness; }
  [[nodiscard]] double shear_stiffness_n_per_m() const { return shear_stiffness_; }
  /// Elastic tangential displacement of a watched place from where friction holds it.
  [[nodiscard]] Eigen::Vector3d friction_spring_m(int element) const {
    if (friction_spring_.empty()) return Eigen::Vector3d::Zero();
    return friction_spring_[element];
  }
  [[nodiscard]] double energy_j(const Field& position) const;
  [[nodiscard]] double frequency_squared_per_s2() const { return frequency2_; }

 private:
  struct Push {
    double gap = 0;
    double normal_n = 0;
    Eigen::Vector3d normal;
  };
  [[nodiscard]] Push push(const Point& point, const Field& position, const Field* velocity) const;
  /// These append the points found and return by how much the particles of the element may move
  /// before there can be others.
  [[nodiscard]] bool leaves_to_particles(int shape, std::span<Eigen::Vector3d> corners) const;
  double try_line(const Field& position, int element, int a, int b);
  double try_cell(const Field& position, int corner);
  [[nodiscard]] double deepest_fraction(int shape, const Eigen::Vector3d& p,
                                        const Eigen::Vector3d& q) const;
  [[nodiscard]] double followed_fraction(int shape, const Eigen::Vector3d& p,
                                         const Eigen::Vector3d& q) const;
  void keep_places(const Field& position, std::size_t begin, std::size_t end, std::size_t now);
  void forget_spring(int element);
  void forget_gone(std::size_t begin, std::size_t end, std::size_t now);

  const Cloth* cloth_;
  const Surroundings* surroundings_;
  struct Spring {
    double stiffness = 0, damping = 0;
  };
  double friction_, shear_stiffness_, frequency2_, reach_m_;
  std::vector<Spring> pressing_;  ///< per shape
  bool follows_;
  std::vector<bool> watched_;  ///< per shape
  std::vector<Point> points_;
  int elements_ = 0;
  /// Elastic tangential displacement (m) per element; there from the first advance() on.
  std::vector<Eigen::Vector3d> friction_spring_;
  std::vector<Point> before_;  ///< points of the last refresh
  std::vector<double> until_;  ///< per line and cell: path length at which to search again
  std::vector<int> chosen_;    ///< indices into points_
  std::vector<double> clear_;  ///< per point: path length up to which it stays outside
};

}  // namespace drape::simulate
