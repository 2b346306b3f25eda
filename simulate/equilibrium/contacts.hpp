// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "simulate/contact/deepest.hpp"
#include "simulate/contact/line_contacts.hpp"
#include "simulate/dynamics/motion.hpp"
#include "simulate/objects/contact_forces.hpp"
#include "simulate/sparse/factor.hpp"

namespace drape::simulate {

/// Weights of a cell's four particles (rows) in the corners of one of its four triangles: the two
/// particles of an edge and the cell's middle.
inline constexpr int kQuarters = 4;  ///< triangles of a cell
using QuarterWeights = Eigen::Matrix<double, 4, 3>;
[[nodiscard]] inline QuarterWeights quarter_weights(int quarter) {
  static constexpr std::array<int, 4> round{0, 1, 3, 2};
  QuarterWeights weights = QuarterWeights::Zero();
  weights(round[quarter], 0) = 1;
  weights(round[(quarter + 1) % 4], 1) = 1;
  weights.col(2).setConstant(0.25);
  return weights;
}

/// Contact, friction and pins of a sheet without time, as a potential: within one step of the
/// solver everything here is the gradient of energy_j(), so a step can be judged by its energy.
/// - Particles press by an augmented Lagrangian (Hestenes 1969): a stiff one-sided spring whose
///   resting force is moved until the particle lies on the surface.
/// - Without friction so do the four triangles of each cell where they are deepest, see
///   DeepestPlace: places that slide with the sheet, so that their energy is a function of it.
/// - With friction points between particles press elastically, the law of LineContacts: they stay
///   where they are found, for a load that passed from one place to the next would lose its hold.
/// - Friction is a tangential spring to an anchor; beyond its limit the force stays and the anchor
///   follows (elastic-plastic form of Coulomb's law). The limit is that of the pressing force at
///   the start of the step (Li et al. 2020) and moves only when that force has left a band, so
///   that friction cannot take turns with pressing for ever; follow_pressing() makes it that of
///   the end.
class StaticContacts {
 public:
  StaticContacts(const Cloth& cloth, const Surroundings& surroundings, double friction,
                 double gravity_m_per_s2, bool between_particles);

  /// A particle that a pin holds.
  struct Pinned {
    int particle = 0;
    Eigen::Vector3d place;
  };

  /// Pins: the held material points and their places. Where the point is a particle, that one is
  /// pinned() and takes no part in the system; a point within a cell is held by a spring whose
  /// resting force is moved until it holds exactly. Beside pinned particles it travels with them,
  /// or the cell between two pins would be torn.
  void hold(const std::vector<Hold>& holds, const std::vector<Eigen::Vector3d>& in_world);
  [[nodiscard]] const std::vector<Pinned>& pinned() const { return pinned_; }
  /// Moves pins towards their places, each by at most `most_m`; false: all are there.
  bool carry_pins(Field& position, double most_m);
  /// Takes over the points between particles of a sheet that Motion brought to rest, with their
  /// friction springs; from then on refresh() leaves them, for they are a part of that rest.
  void take_springs(const LineContacts& moved, const Field& position);
  /// After begin(): takes particles within `reach_m` of a surface as pressed and held by what
  /// balances `force`.
  void rest_on(const Field& position, const Field& force, double reach_m);

  /// From here on refresh() leaves the points between particles where they are.
  void keep_points() { seeks_points_ = false; }
  /// Finds the points between particles again; those that keep on touching keep their spring.
  void refresh(const Field& position);
  enum class Limits { follow, keep };
  /// Starts a step: which particles are within `watch_m`, friction's limits and anchors. Limits are
  /// kept where pressing forces have just been moved by update_multipliers(): until the particles
  /// follow, those forces are not yet what presses.
  void begin(const Field& position, double watch_m, Limits limits = Limits::follow);

  /// Contact, friction and pins within the step (J).
  [[nodiscard]] double energy_j(const Field& position) const;
  /// Minus the gradient of energy_j() (N).
  void add_forces(const Field& position, Field& force) const;
  /// Pressing and rubbing forces, place by place; without pins.
  [[nodiscard]] std::vector<ContactForce> forces(const Field& position) const;
  /// Second derivatives of the step's quadratic model at its start, with what review() changed.
  void add_hessian(const Field& position, bool convex, GridMatrix& hessian);
  /// Changes what add_hessian() added to what review() made of it since.
  void change_hessian(const Field& position, bool convex, GridMatrix& hessian);
  /// Forces that review() adds to the model's gradient: pulls of particles that will land, friction
  /// that will yield.
  void add_changes(Eigen::VectorXd& gradient) const;
  /// Curvature that the model's second derivative along the step has that the energy of that step
  /// has not.
  [[nodiscard]] double excess_curve(const Eigen::VectorXd& step) const;
  /// Change of sliding friction along `displacement` because pressing forces, and so its
  /// limits, do; added to the product of the model's matrix with it. No potential has this part: it
  /// is not symmetric (Alart and Curnier 1991).
  void add_following(const Eigen::VectorXd& displacement, Eigen::VectorXd& product) const;
  /// Force missing in the model's gradient where limits are not those of the pressing forces.
  void add_lag(Eigen::VectorXd& gradient) const;
  /// Sets the limits of what slides, until the next begin(), to those at the end of `displacement`,
  /// and adds to the gradient what that changes at its start.
  void follow_pressing(const Field& position, const Eigen::VectorXd& displacement,
                       Eigen::VectorXd& gradient);
  /// Looks where the step leads: what would land, what slid and would slide back and, after
  /// let_yield(), what held and would slide is changed in the model. Returns how many.
  int review(const Field& from, const Field& to, double deep_m);
  /// Friction that holds may yield within a step. Else it slides from the next step on.
  void let_yield() { yields_ = true; }
  /// Takes the quadratic model at another place of the same step, until restore().
  void relinearise(const Field& position);
  void restore() { contacts_.swap(before_); }
  /// Lifts particles that a straight path put into a surface or through a body.
  void retract(const Field& from, Field& to) const;

  /// Moves the resting forces of particles and pins to where they hold exactly.
  void update_multipliers(const Field& position);
  /// Makes pressing particles and triangles ten times stiffer, once: so their gaps close in fewer
  /// updates.
  void stiffen();

  [[nodiscard]] double pin_error_m(const Field& position) const;
  [[nodiscard]] double gap_error_m(const Field& position) const;  ///< error of pressed particles
  [[nodiscard]] double stored_j(const Field& position) const;     ///< pressing between particles
  [[nodiscard]] int touching(const Field& position) const;
  [[nodiscard]] int sliding() const;
  [[nodiscard]] int between() const;
  /// True if triangles of cells press where they are deepest.
  [[nodiscard]] bool has_pieces() const { return seeks_pieces_; }

 private:
  enum class Change : char { none, lands, holds, yields };

  /// Friction beyond its limit, linear about the place where the step leads.
  struct Yield {
    Eigen::Vector3d spring = Eigen::Vector3d::Zero();  ///< at the start of the step
    Eigen::Vector3d pull = Eigen::Vector3d::Zero();    ///< less than held there (N)
    Eigen::Matrix3d block = Eigen::Matrix3d::Zero();   ///< second derivative
  };

  /// One place that may touch one surface.
  struct Contact {
    int site = 0;
    int shape = 0;
    int corners = 1;
    int quarter = 0;  ///< quarter of a cell: the triangle between one of its edges and its middle
    std::array<int, 4> particle{};
    std::array<double, 4> weight{};
    double stiffness = 0;  ///< N/m
    bool rigid = false;    ///< a particle, not a point between particles
    bool slides = false;   ///< a piece of the sheet that presses where it is deepest
    DeepestPlace deepest;  ///< deepest place of such a piece, where the quadratic model is taken
    double multiplier = 0;
    bool anchored = false, slips = false;
    double limit = 0;   ///< largest friction in this step (N)
    double taken = 0;   ///< that limit as a part of what the pressing force allows
    double slip_m = 0;  ///< distance slid in the last step
    Eigen::Vector3d slide = Eigen::Vector3d::Zero();  ///< unit vector of the spring
    Eigen::Vector3d anchor = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< at the start of the step
    double gap = 0;                                     ///< there; of a piece its depth
    Change change = Change::none;
    bool reviewed = false;  ///< review() changed it after `block` was added
    Yield yield;
    Eigen::Matrix3d block = Eigen::Matrix3d::Zero();  ///< its part of the Hessian
  };

  /// Where a contact is, and how far from its shape.
  struct Pressing {
    std::array<int, 4> particle{};
    std::array<double, 4> weight{};
    Eigen::Vector3d normal;
    double gap = 0;
  };

  [[nodiscard]] Contact fresh_particle(int particle, int shape) const;
  void watch_cell(const Field& position, int corner);
  [[nodiscard]] bool is_held_at(int shape, const Contact& piece, const Field& position) const;
  [[nodiscard]] SheetTriangle piece_of(const Contact& contact, const Field& position) const;
  [[nodiscard]] static std::array<double, 4> weights_of(const Contact& contact,
                                                        const DeepestPlace& deepest);
  [[nodiscard]] DeepestPlace deepest_of(const Contact& contact, const Field& position) const;
  [[nodiscard]] double gap_of(const Contact& contact, const Field& position) const;
  [[nodiscard]] Pressing pressing_at(const Contact& contact, const Field& position) const;
  [[nodiscard]] Eigen::Vector3d force_of(const Contact& contact, const Pressing& here,
                                         const Field& position) const;
  void add_piece_hessian(const Contact& contact, const Field& position, bool convex,
                         GridMatrix& hessian) const;
  void watch(const Field& position, double watch_m);
  void settle(Contact& contact, const Field& position, Limits limits) const;
  [[nodiscard]] std::optional<Eigen::Vector3d> caught(int shape, const Eigen::Vector3d& start,
                                                      const Eigen::Vector3d& end,
                                                      double deep_m) const;
  [[nodiscard]] double pressing_n(const Contact& contact, double gap) const;
  [[nodiscard]] Eigen::Vector3d spring(const Contact& contact, const Eigen::Vector3d& p) const;
  [[nodiscard]] bool follows(const Contact& contact) const;
  [[nodiscard]] double limit_after(const Contact& contact,
                                   const Eigen::Vector3d& displacement) const;
  [[nodiscard]] double friction_j(const Contact& contact, double size) const;
  [[nodiscard]] bool review_yield(Contact& contact, const Eigen::Vector3d& start,
                                  const Eigen::Vector3d& end) const;
  [[nodiscard]] Eigen::Matrix3d model_block(const Contact& contact, const Field& position,
                                            bool convex) const;

  const Cloth* cloth_;
  const Surroundings* surroundings_;
  double friction_;
  bool seeks_pieces_, seeks_points_;  ///< between particles
  LineContacts lines_;
  bool yields_ = false, stiffened_ = false;
  double particle_stiffness_ = 0, shear_stiffness_ = 0;  ///< N/m; the latter of pieces, too
  std::vector<Contact> contacts_, before_;
  std::vector<int> index_;  ///< into contacts_, by site; -1 where there is none
  std::vector<Pinned> pinned_;
  std::vector<char> is_pinned_;  ///< by particle
  std::vector<Hold> holds_;      ///< points within cells
  std::vector<Eigen::Vector3d> hold_in_world_, hold_force_;
  std::vector<Eigen::Vector3d> hold_place_;  ///< where they are held until they get there
  bool sets_out_ = false;                    ///< from where the sheet has them
  double hold_stiffness_ = 0;
};

}  // namespace drape::simulate
