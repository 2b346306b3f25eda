// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "simulate/contact/deepest.hpp"
#include "simulate/contact/line_contacts.hpp"
#include "simulate/dynamics/motion.hpp"
#include "simulate/sparse/factor.hpp"

namespace drape::simulate {

/// Contact, friction and pins of a sheet without time, as a potential: within one step of the
/// solver everything here is the gradient of energy_j(), so a step can be judged by its energy.
/// - Particles press by an augmented Lagrangian (Hestenes 1969): a stiff one-sided spring whose
///   resting force is moved until the particle lies on the surface.
/// - So do grid line pieces and cells where they are deepest, see DeepestPlace. That place is
///   sought again at every position, so that their energy is a function of the sheet alone.
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
  /// resting force is moved until it holds exactly.
  void hold(const std::vector<Hold>& holds, const std::vector<Eigen::Vector3d>& in_world);
  [[nodiscard]] const std::vector<Pinned>& pinned() const { return pinned_; }
  /// Moves pinned particles towards their places, each by at most `most_m`; false: all are there.
  bool carry_pins(Field& position, double most_m) const;
  /// Takes over the points between particles of a sheet that Motion brought to rest, with their
  /// friction springs; from then on they stay where they are, for they are a part of that rest.
  void take_springs(const LineContacts& moved, const Field& position);
  /// After begin(): takes particles within `reach_m` of a surface as pressed and held by what
  /// balances `force`.
  void lean_on(const Field& position, const Field& force, double reach_m);

  enum class Limits { follow, keep };
  /// Starts a step: which particles are within `watch_m`, friction's limits and anchors. Limits are
  /// kept where pressing forces have just been moved by update_multipliers(): until the particles
  /// follow, those forces are not yet what presses.
  void begin(const Field& position, double watch_m, Limits limits = Limits::follow);

  /// Contact, friction and pins within the step (J).
  [[nodiscard]] double energy_j(const Field& position) const;
  /// Minus the gradient of energy_j() (N).
  void add_forces(const Field& position, Field& force) const;
  /// Second derivatives of the step's quadratic model at its start, with what review() changed.
  void add_hessian(const Field& position, bool convex, GridMatrix& hessian);
  /// Changes what add_hessian() added to what review() made of it since.
  void change_hessian(const Field& position, bool convex, GridMatrix& hessian);
  /// What review() adds to the model's gradient: pulls of particles that will land, friction that
  /// will yield.
  void add_changes(Eigen::VectorXd& gradient) const;
  /// What the model's second derivative along the step has that the energy of that step has not.
  [[nodiscard]] double excess_curve(const Eigen::VectorXd& step) const;
  /// What friction that slides changes along `way` because pressing forces, and so its limits, do;
  /// added to the product of the model's matrix with it. No potential has this part: it is not
  /// symmetric (Alart and Curnier 1991).
  void add_following(const Eigen::VectorXd& way, Eigen::VectorXd& product) const;
  /// What is lacking in the model's gradient where limits are not those of the pressing forces.
  void add_lag(Eigen::VectorXd& gradient) const;
  /// Sets the limits of what slides, until the next begin(), to those at the end of `way`, and
  /// adds to the gradient what that changes at its start.
  void follow_pressing(const Field& position, const Eigen::VectorXd& way,
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
  /// Makes pressing particles ten times stiffer, once: so their gaps close in fewer updates.
  void stiffen();

  [[nodiscard]] double pin_error_m(const Field& position) const;
  [[nodiscard]] double gap_error_m(const Field& position) const;  ///< of pressed particles
  [[nodiscard]] double stored_j(const Field& position) const;     ///< pressing between particles
  [[nodiscard]] int touching(const Field& position) const;
  [[nodiscard]] int sliding() const;
  [[nodiscard]] int between() const;

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
    std::array<int, 4> particle{};
    std::array<double, 4> weight{};
    double stiffness = 0;  ///< N/m
    bool rigid = false;    ///< a particle, not a point between particles
    bool slides = false;   ///< a piece of the sheet that presses where it is deepest
    DeepestPlace deepest;  ///< of such a piece, where the quadratic model is taken
    double multiplier = 0;
    bool anchored = false, slips = false;
    double limit = 0;   ///< of friction in this step (N)
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
    std::array<double, 4> weight{};
    Eigen::Vector3d normal;
    double gap = 0;
  };

  [[nodiscard]] Contact fresh_particle(int particle, int shape) const;
  void watch_piece(const Field& position, int element, const std::array<int, 4>& particle,
                   int corners, std::vector<Contact>& found) const;
  void watch_pieces(const Field& position);
  [[nodiscard]] SheetPiece piece_of(const Contact& contact, const Field& position) const;
  [[nodiscard]] DeepestPlace deepest_of(const Contact& contact, const Field& position) const;
  [[nodiscard]] double gap_of(const Contact& contact, const Field& position) const;
  [[nodiscard]] Pressing pressing_at(const Contact& contact, const Field& position) const;
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
  [[nodiscard]] double limit_after(const Contact& contact, const Eigen::Vector3d& way) const;
  [[nodiscard]] double friction_j(const Contact& contact, double size) const;
  [[nodiscard]] bool review_yield(Contact& contact, const Eigen::Vector3d& start,
                                  const Eigen::Vector3d& end) const;
  [[nodiscard]] Eigen::Matrix3d model_block(const Contact& contact, const Field& position,
                                            bool convex) const;

  const Cloth* cloth_;
  const Surroundings* surroundings_;
  double friction_;
  bool seeks_pieces_;  ///< between particles
  std::vector<LineContacts::Point> kept_points_;
  bool yields_ = false, stiffened_ = false;
  double particle_stiffness_ = 0, shear_stiffness_ = 0;  ///< N/m; the latter of pieces, too
  std::vector<Contact> contacts_, before_;
  std::vector<int> index_;  ///< into contacts_, by site; -1 where there is none
  std::vector<Pinned> pinned_;
  std::vector<char> is_pinned_;  ///< by particle
  std::vector<Hold> holds_;      ///< points within cells
  std::vector<Eigen::Vector3d> hold_in_world_, hold_force_;
  double hold_stiffness_ = 0;
};

}  // namespace drape::simulate
