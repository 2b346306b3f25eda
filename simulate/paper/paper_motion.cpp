// SPDX-License-Identifier: Apache-2.0
#include "simulate/paper/paper_motion.hpp"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr double kSmallest = 1e-9;  // strain, sine or curvature (1/m); below it, secant = slope

double secant(const ForceCurve& law, double argument, double divisor) {
  return divisor < kSmallest && divisor > -kSmallest ? law.slope : law.value(argument) / divisor;
}

/// A spring along a cell's diagonal.
struct Diagonal {
  int a = 0, b = 0;
  double stiffness = 0, rest = 0;  ///< N/m, m
  Vector3d edge;                   ///< from a to b (m)
  double length = 0;
};

/// A spring along a grid line.
struct LineSpring {
  int a = 0, b = 0, direction = 0;
  Vector3d edge;
  double length = 0, strain = 0;
  double less = 0;  ///< part of Kdiag that exceeds K'st (N/m per strain and width)
  bool clamped = false;
};

/// Three neighbours on a grid line.
struct Triple {
  int before = 0, middle = 0, after = 0, direction = 0;
  Vector3d bend;         ///< x- - 2 x + x+ (m)
  double curvature = 0;  ///< 1/m
};

struct StrainVisitor {
  CertificateStrains strains = {};

  void operator()(const Diagonal& /*diagonal*/) {}
  void operator()(const LineSpring& spring) {
    Eigen::Vector2d& extremes = spring.direction == 0 ? strains.warp : strains.weft;
    extremes.x() = std::min(extremes.x(), spring.strain);
    extremes.y() = std::max(extremes.y(), spring.strain);
  }
  void operator()(const Triple& triple) {
    strains.curvature_most_per_m = std::max(strains.curvature_most_per_m, triple.curvature);
  }
  void shear(double angle_rad) {
    strains.shear_most_rad = std::max(strains.shear_most_rad, angle_rad);
  }
};

constexpr double kSink_m = 2e-6;    // depth at which a pair carries a particle's weight
constexpr double kMargin_m = 1e-3;  // displacement of a particle after which pairs are listed again
constexpr double kDamped = 0.2;     // relative to critical damping
constexpr int kMostPairs = 12;      // simultaneous contacts of one particle

Nodes nodes_of(const Particles& x) {
  Nodes nodes;
  nodes.reserve(static_cast<std::size_t>(x.cols()));
  for (Eigen::Index i = 0; i < x.cols(); ++i) nodes.emplace_back(x.col(i));
  return nodes;
}

constexpr double kRk4ImaginaryLimit = 2.828;
constexpr double kImpactDepth = 10e-6;  // m; shallower hits do not end the step early
constexpr double kClearMargin = 1e-3;   // m; covers the path of a step and released particles
constexpr double kSurfacing = 2e-3;     // s; time constant for lifting a shallow hit to the surface
constexpr double kLiftGap = 1e-6;       // m; a touching particle farther out has separated
constexpr double kShortestFraction = 0.02;  // for a step that ends early at an impact

}  // namespace

PaperCloth::PaperCloth(const ParticleGrid& grid, ClothLaws laws, double stretch_damping_s)
    : grid_(grid),
      laws_(std::move(laws)),
      spacing_(grid.spacing_m()),
      stretch_damping_s_(stretch_damping_s) {
  particle_kg_ = laws_.density_kg_per_m2 * grid.patch_m.prod() / grid.count();
}

double PaperCloth::area_m2(int particle) const {
  double area = spacing_.prod();
  for (int d = 0; d < 2; ++d)
    if (!has_next(particle, d) || !has_before(particle, d)) area *= 0.5;
  return area;
}

/// Calls visitor.shear() with each cell's angle and visitor() with each spring and triple.
template <class Visitor>
void PaperCloth::visit(const Particles& x, Visitor& visitor) const {
  const int n = grid_.count(), stride[2] = {grid_.cols, 1};
  const double rest = spacing_.norm();
  // In a cell that is not square this stiffness gives the same modulus G; 1 in a square.
  const double oblong = rest * rest / (2 * spacing_.prod());
  std::vector<double> k_diag(n, 0.0);
  for (int i = 0; i < n; ++i) {
    if (!has_next(i, 0) || !has_next(i, 1)) continue;
    const int corner[4] = {i, i + 1, i + grid_.cols, i + grid_.cols + 1};
    const Vector3d d = x.col(corner[3]) - x.col(corner[0]), e = x.col(corner[2]) - x.col(corner[1]);
    const Vector3d warp = d + e, weft = d - e;  // twice the midlines of the cell
    const double sine = std::min(
        1.0, std::abs(warp.dot(weft)) / std::sqrt(warp.squaredNorm() * weft.squaredNorm()));
    const double angle = std::asin(sine);
    visitor.shear(angle);
    k_diag[i] = secant(laws_.shear, angle, sine);
    visitor(Diagonal{corner[0], corner[3], k_diag[i] * oblong, rest, d, d.norm()});
    visitor(Diagonal{corner[1], corner[2], k_diag[i] * oblong, rest, e, e.norm()});
  }
  for (int direction = 0; direction < 2; ++direction) {
    const int s = stride[direction], side = stride[1 - direction];
    const double l = spacing_[direction], slant = std::pow(l / spacing_[1 - direction], 2);
    for (int i = 0; i < n; ++i) {
      if (!has_next(i, direction)) continue;
      const bool cell_before = has_before(i, 1 - direction),
                 cell_after = has_next(i, 1 - direction);
      const double beside = (cell_before ? k_diag[i - side] : 0.0) + (cell_after ? k_diag[i] : 0.0);
      LineSpring spring{i, i + s, direction, x.col(i + s) - x.col(i)};
      spring.length = spring.edge.norm();
      spring.strain = spring.length / l - 1;
      const double k_st = secant(laws_.tensile[direction], spring.strain, spring.strain);
      spring.less = beside / (cell_before + cell_after) * slant;
      spring.clamped = spring.less > k_st;
      spring.less = std::min(spring.less, k_st);
      visitor(spring);
      if (!has_before(i, direction)) continue;
      Triple triple{i - s, i, i + s, direction, spring.edge - (x.col(i) - x.col(i - s))};
      triple.curvature = triple.bend.norm() / (l * l);
      visitor(triple);
    }
  }
}

CertificateStrains PaperCloth::add_forces(const Particles& x, const Particles* velocity,
                                          Particles& force) const {
  struct Visitor : StrainVisitor {
    const PaperCloth& cloth;
    const Particles* velocity;
    Particles& force;

    void pull(int a, int b, const Vector3d& on_a) const {
      force.col(a) += on_a;
      force.col(b) -= on_a;
    }
    void operator()(const Diagonal& d) {
      pull(d.a, d.b, d.stiffness * (1 - d.rest / d.length) * d.edge);
    }
    void operator()(const LineSpring& s) {
      StrainVisitor::operator()(s);
      const ForceCurve& law = cloth.laws_.tensile[s.direction];
      double per_width = law.value(s.strain) - s.less * s.strain;
      if (velocity != nullptr)
        per_width += cloth.stretch_damping_s_ * law.slope / cloth.spacing_[s.direction] *
                     s.edge.dot(velocity->col(s.b) - velocity->col(s.a)) / s.length;
      pull(s.a, s.b, per_width * cloth.spacing_[1 - s.direction] / s.length * s.edge);
    }
    void operator()(const Triple& t) {
      StrainVisitor::operator()(t);
      const double l = cloth.spacing_[t.direction], width = cloth.spacing_[1 - t.direction];
      const Vector3d bent = width / (l * l * l) *
                            secant(cloth.laws_.bending[t.direction], t.curvature, t.curvature) *
                            t.bend;
      pull(t.middle, t.before, bent);
      pull(t.middle, t.after, bent);
    }
  };
  Visitor visitor{{}, *this, velocity, force};
  visit(x, visitor);
  return visitor.strains;
}

InternalEnergies PaperCloth::energies(const Particles& x) const {
  struct Visitor {
    const PaperCloth& cloth;
    InternalEnergies sum = {};

    void shear(double /*angle_rad*/) {}
    void operator()(const Diagonal& d) {
      sum.shear_j += 0.5 * d.stiffness * std::pow(d.length - d.rest, 2);
    }
    void operator()(const LineSpring& s) {
      sum.stretch_j += cloth.spacing_.prod() * (cloth.laws_.tensile[s.direction].energy(s.strain) -
                                                0.5 * s.less * s.strain * s.strain);
    }
    void operator()(const Triple& t) {
      sum.bending_j += cloth.spacing_.prod() * cloth.laws_.bending[t.direction].energy(t.curvature);
    }
  };
  Visitor visitor{*this};
  visit(x, visitor);
  return visitor.sum;
}

CertificateStrains PaperCloth::strains(const Particles& x) const {
  StrainVisitor visitor;
  visit(x, visitor);
  return visitor.strains;
}

int PaperCloth::clamped_springs(const Particles& x) const {
  struct Visitor {
    int count = 0;

    void shear(double /*angle_rad*/) {}
    void operator()(const Diagonal& /*diagonal*/) {}
    void operator()(const LineSpring& spring) { count += spring.clamped; }
    void operator()(const Triple& /*triple*/) {}
  };
  Visitor visitor;
  visit(x, visitor);
  return visitor.count;
}

double PaperCloth::stiffness_bound_per_s2(const CertificateStrains& s) const {
  const double hu = spacing_.x(), hv = spacing_.y();
  const double warp = 4 * laws_.tensile[0].steepest_up_to(s.warp.y()) / (hu * hu);
  const double weft = 4 * laws_.tensile[1].steepest_up_to(s.weft.y()) / (hv * hv);
  // Warp and weft springs pull in different directions; their coupling grows with shear.
  const double stretch = std::max(warp, weft) + std::sqrt(warp * weft) * std::sin(s.shear_most_rad);
  // The change of Kdiag with the angle also acts along the diagonals.
  const double steeper = 2 / std::max(0.1, std::cos(s.shear_most_rad));
  const double shear =
      steeper * 4 * laws_.shear.steepest_up_to(s.shear_most_rad) * (1 / (hu * hu) + 1 / (hv * hv));
  const double bending =
      16 * (laws_.bending[0].steepest_up_to(s.curvature_most_per_m) / std::pow(hu, 4) +
            laws_.bending[1].steepest_up_to(s.curvature_most_per_m) / std::pow(hv, 4));
  return spacing_.prod() * (stretch + shear + bending) / particle_kg_;
}

PaperLayers::PaperLayers(const ParticleGrid& grid, double particle_kg, double gravity_m_per_s2,
                         double thickness_m)
    : thickness_(thickness_m),
      n_per_m_(particle_kg * gravity_m_per_s2 / kSink_m),
      damping_n_s_per_m_(2 * kDamped * std::sqrt(n_per_m_ * particle_kg)),
      per_kg_(1 / particle_kg) {
  std::vector<std::array<int, 3>> facets;
  for (int i = 0; i + grid.cols + 1 < grid.count(); ++i) {
    if (i % grid.cols + 1 == grid.cols) continue;
    facets.push_back({i, i + 1, i + grid.cols});
    facets.push_back({i + 1, i + grid.cols + 1, i + grid.cols});
  }
  facets_ = layer_facets(facets);
  std::vector<Vector3d> centres;
  for (const std::array<int, 3>& node : facets) {
    Vector3d& centre = centres.emplace_back(Vector3d::Zero());
    for (const int k : node) centre.head<2>() += grid.material_m(k) / 3;
  }
  tree_ = BoxTree(centres);
}

void PaperLayers::follow(const Particles& x) {
  if (thickness_ <= 0) return;
  if (listed_.size() > 0 &&
      (x - listed_).colwise().squaredNorm().maxCoeff() < kMargin_m * kMargin_m)
    return;
  listed_ = x;
  const Nodes nodes = nodes_of(x);
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const LayerFacet& facet : facets_) {
    Eigen::AlignedBox3d box;
    for (const int i : facet.node) box.extend(nodes[i]);
    const double reach = thickness_ / 2 + kMargin_m;
    boxes.emplace_back(box.min().array() - reach, box.max().array() + reach);
  }
  tree_.refit(boxes);
  pairs_.clear();
  tree_.query_pairs([&](int one, int other) {
    visit_pairs(facets_[one], facets_[other], [&](const LayerPair& pair) {
      if (!share_a_node(pair) && !are_apart(pair, nodes, thickness_ + 2 * kMargin_m))
        pairs_.push_back(pair);
    });
  });
}

double PaperLayers::add_forces(const Particles& x, const Particles* velocity,
                               Particles& force) const {
  if (pairs_.empty()) return 0;
  const Nodes nodes = nodes_of(x);
  double sum_j = 0;
  for (const LayerPair& pair : pairs_) {
    if (are_apart(pair, nodes, thickness_)) continue;
    const NearestPoints nearest = nearest_points(pair, nodes);
    const double distance = nearest.apart.norm(), in = thickness_ - distance;
    if (!(in > 0) || !(distance > 0)) continue;
    const double part = part_of(pair, nodes);
    const Vector3d normal = nearest.apart / distance;
    double push = part * n_per_m_ * in;
    sum_j += 0.5 * push * in;
    if (velocity != nullptr) {
      double approach = 0;
      for (int k = 0; k < 4; ++k)
        approach -= nearest.weight[k] * normal.dot(velocity->col(pair.node[k]));
      push = std::max(0.0, push + part * damping_n_s_per_m_ * approach);
    }
    for (int k = 0; k < 4; ++k) force.col(pair.node[k]) += nearest.weight[k] * push * normal;
  }
  return sum_j;
}

double PaperLayers::energy_j(const Particles& x) const {
  Particles ignored = Particles::Zero(3, x.cols());
  return add_forces(x, nullptr, ignored);
}

double PaperLayers::stiffness_bound_per_s2() const {
  return thickness_ > 0 ? kMostPairs * n_per_m_ * per_kg_ : 0.0;
}

PaperMotion::PaperMotion(const PaperCloth& cloth, const Surroundings& around,
                         const PaperForces& forces)
    : cloth_(cloth),
      around_(around),
      forces_(forces),
      layers_(cloth.grid(), cloth.particle_kg(), forces.gravity_m_per_s2.norm(),
              forces.thickness_m) {
  const int n = cloth.grid().count();
  position = velocity = Particles::Zero(3, n);
  a_.fill(Particles::Zero(3, n));
  area_per_mass_.resize(n);
  for (int i = 0; i < n; ++i) area_per_mass_[i] = cloth.area_m2(i) / cloth.particle_kg();
  touch_.resize(n);
  clear_until_.assign(n, 0.0);
}

void PaperMotion::hold(const Eigen::MatrixXd& weights) {
  holds_ = weights;
  hold_response_ = weights.completeOrthogonalDecomposition().pseudoInverse();
  hold_rate_ = Eigen::Matrix3Xd::Zero(3, weights.rows());
}

void PaperMotion::move_holds(const Eigen::Matrix3Xd& rate_m_per_s) {
  hold_rate_ = rate_m_per_s;
  project_holds(velocity, &hold_rate_);
}

/// Removes from the values the motion of held points that differs from `rate`; all particles have
/// equal mass.
void PaperMotion::project_holds(Particles& values, const Eigen::Matrix3Xd* rate) const {
  if (holds_.rows() == 0) return;
  Eigen::Matrix3Xd wrong = values * holds_.transpose();
  if (rate != nullptr) wrong -= *rate;
  values -= wrong * hold_response_.transpose();
}

int PaperMotion::push_out() {
  int moved = 0;
  for (Eigen::Index i = 0; i < position.cols(); ++i) {
    const Vector3d before = position.col(i);
    for (int shape = 0; shape < around_.count(); ++shape) {
      const Vector3d p = position.col(i);
      const double gap = around_.gap_m(shape, p);
      if (gap < 0) position.col(i) -= gap * around_.normal(shape, p);
    }
    moved += position.col(i) != before;
  }
  return moved;
}

CertificateStrains PaperMotion::accelerate(const Particles& x, const Particles& v,
                                           Particles& a) const {
  a.setZero();
  const CertificateStrains strains = cloth_.add_forces(x, &v, a);
  layers_.add_forces(x, &v, a);
  a = (a / cloth_.particle_kg()).colwise() + forces_.gravity_m_per_s2;
  for (Eigen::Index i = 0; i < a.cols(); ++i)
    a.col(i) -=
        (forces_.damping_per_s + forces_.air_drag_kg_per_m3 * area_per_mass_[i] * v.col(i).norm()) *
        v.col(i);
  return strains;
}

/// Releases particles pulled off their surface, and lets others slide if friction cannot hold them.
void PaperMotion::settle_touches(const Particles& a) {
  for (std::size_t i = 0; i < touch_.size(); ++i) {
    Touch& touch = touch_[i];
    if (touch.shape < 0) continue;
    const Vector3d pull = a.col(static_cast<Eigen::Index>(i));
    const double outward = pull.dot(touch.normal);
    if (outward > 0) {
      touch.shape = -1;
      continue;
    }
    touch.press_m_per_s2 = -outward;
    const Vector3d along = pull - outward * touch.normal;
    if (touch.stuck && along.norm() > -forces_.friction * outward) {
      touch.stuck = false;
      touch.slide = along.normalized();
    }
  }
}

void PaperMotion::constrain(Particles& a) const {
  for (std::size_t i = 0; i < touch_.size(); ++i) {
    const Touch& touch = touch_[i];
    if (touch.shape < 0) continue;
    auto pull = a.col(static_cast<Eigen::Index>(i));
    const double outward = pull.dot(touch.normal);
    if (touch.stuck) {
      pull.setZero();
    } else if (outward < 0) {
      pull += -outward * touch.normal + forces_.friction * outward * touch.slide;
    }
  }
}

/// Starts from start_x_, start_v_ and the constrained acceleration there, a_[0].
void PaperMotion::runge_kutta(double dt) {
  Particles x = start_x_ + 0.5 * dt * start_v_, v = start_v_ + 0.5 * dt * a_[0];
  for (int stage = 1; stage < 4; ++stage) {
    (void)accelerate(x, v, a_[stage]);
    constrain(a_[stage]);
    project_holds(a_[stage]);
    if (stage == 3) break;
    const double reach = stage == 1 ? 0.5 * dt : dt;
    x = start_x_ + reach * v;
    v = start_v_ + reach * a_[stage];
  }
  position = start_x_ + dt * start_v_ + dt * dt / 6 * (a_[0] + a_[1] + a_[2]);
  velocity = start_v_ + dt / 6 * (a_[0] + 2 * a_[1] + 2 * a_[2] + a_[3]);
}

/// Fraction of the step at which the first particle reaches a surface; 1 if none gets deeper than a
/// shallow hit. Distances change by at most the path of the fastest particle, so a distant particle
/// is tested again only after that path.
double PaperMotion::first_impact() {
  double fraction = 1;
  for (std::size_t i = 0; i < touch_.size(); ++i) {
    if (touch_[i].shape >= 0 || clear_until_[i] > path_m_ + kClearMargin) continue;
    const auto column = static_cast<Eigen::Index>(i);
    double least = 1e9;
    for (int shape = 0; shape < around_.count(); ++shape) {
      const double gap = around_.gap_m(shape, position.col(column));
      least = std::min(least, gap);
      if (gap >= -kImpactDepth) continue;
      const double before = std::max(0.0, around_.gap_m(shape, start_x_.col(column)));
      fraction = std::min(fraction, before / (before - gap));
    }
    clear_until_[i] = path_m_ + std::max(0.0, least);
  }
  return std::max(fraction, kShortestFraction);
}

/// Sets the normal velocity of particles that have reached a surface to zero.
void PaperMotion::land() {
  for (std::size_t i = 0; i < touch_.size(); ++i) {
    if (touch_[i].shape >= 0 || clear_until_[i] > path_m_) continue;
    const auto column = static_cast<Eigen::Index>(i);
    const Vector3d p = position.col(column);
    for (int shape = 0; shape < around_.count(); ++shape) {
      const double gap = around_.gap_m(shape, p);
      if (gap > 0) continue;
      const Vector3d normal = around_.normal(shape, p);
      const double into = velocity.col(column).dot(normal);
      if (into >= 0) continue;
      velocity.col(column) -= into * normal;
      const double speed = velocity.col(column).norm();
      touch_[i] = {shape, speed == 0, 0, gap, normal, Vector3d::Zero()};
      if (speed > 0) touch_[i].slide = velocity.col(column) / speed;
      break;
    }
  }
}

void PaperMotion::follow_surfaces(double step_s) {
  const double keep = std::exp(-step_s / kSurfacing);
  for (std::size_t i = 0; i < touch_.size(); ++i) {
    Touch& touch = touch_[i];
    if (touch.shape < 0) continue;
    const auto column = static_cast<Eigen::Index>(i);
    Vector3d p = position.col(column), v = velocity.col(column);
    const double gap = around_.gap_m(touch.shape, p);
    touch.normal = around_.normal(touch.shape, p);
    if (gap - touch.gap > kLiftGap && v.dot(touch.normal) > 0) {
      touch.shape = -1;
      continue;
    }
    touch.gap *= keep;
    p -= (gap - touch.gap) * touch.normal;
    v -= v.dot(touch.normal) * touch.normal;
    for (int shape = 0; shape < around_.count(); ++shape) {
      if (shape == touch.shape) continue;
      const double other = around_.gap_m(shape, p);
      if (other >= 0) continue;
      touch.shape = shape;
      touch.normal = around_.normal(shape, p);
      touch.gap = other;
      v -= v.dot(touch.normal) * touch.normal;
      break;
    }
    const double speed = v.norm();
    // Friction with a fixed direction during a step makes slow particles oscillate with growing
    // amplitude. A particle that friction stops within half a step, or has reversed, sticks.
    touch.stuck = touch.stuck || speed <= 0.5 * forces_.friction * touch.press_m_per_s2 * step_s ||
                  (forces_.friction > 0 && v.dot(touch.slide) <= 0);
    if (touch.stuck) v.setZero();
    touch.slide = touch.stuck ? Vector3d(Vector3d::Zero()) : Vector3d(v / speed);
    position.col(column) = p;
    velocity.col(column) = v;
  }
}

double PaperMotion::step(double fraction, double longest_s) {
  layers_.follow(position);
  start_x_ = position;
  start_v_ = velocity;
  const CertificateStrains strains = accelerate(start_x_, start_v_, a_[0]);
  double step_s = std::min(longest_s, fraction * kRk4ImaginaryLimit /
                                          std::sqrt(cloth_.stiffness_bound_per_s2(strains) +
                                                    layers_.stiffness_bound_per_s2()));
  settle_touches(a_[0]);
  constrain(a_[0]);
  project_holds(a_[0]);
  runge_kutta(step_s);
  const double impact = first_impact();
  if (impact < 1) {
    ++backtracked_;
    step_s *= impact;
    runge_kutta(step_s);
    (void)first_impact();
  }
  follow_surfaces(step_s);
  land();
  project_holds(velocity, &hold_rate_);
  double fastest = 0;
  for (Eigen::Index i = 0; i < velocity.cols(); ++i) {
    const double speed = velocity.col(i).norm();
    fastest = std::max(fastest, speed);
    viscous_j_ += cloth_.particle_kg() * step_s * speed * speed *
                  (forces_.damping_per_s + forces_.air_drag_kg_per_m3 * area_per_mass_[i] * speed);
  }
  path_m_ += fastest * step_s;
  return step_s;
}

void PaperMotion::stop() {
  velocity.setZero();
  for (Touch& touch : touch_) {
    touch.stuck = true;
    touch.slide.setZero();
  }
}

double PaperMotion::kinetic_j() const {
  return 0.5 * cloth_.particle_kg() * velocity.squaredNorm();
}

double PaperMotion::gravity_j() const {
  return -cloth_.particle_kg() * forces_.gravity_m_per_s2.dot(position.rowwise().sum());
}

double PaperMotion::residual() const {
  Particles net = Particles::Zero(3, position.cols());
  (void)cloth_.add_forces(position, nullptr, net);
  layers_.add_forces(position, nullptr, net);
  net = (net / cloth_.particle_kg()).colwise() + forces_.gravity_m_per_s2;
  for (std::size_t i = 0; i < touch_.size(); ++i) {
    if (touch_[i].shape < 0) continue;
    auto pull = net.col(static_cast<Eigen::Index>(i));
    const double outward = pull.dot(touch_[i].normal);
    if (outward >= 0) continue;
    pull -= outward * touch_[i].normal;
    const double size = pull.norm(), held = -forces_.friction * outward;
    pull *= size <= held ? 0.0 : 1 - held / size;
  }
  project_holds(net);
  return std::sqrt(net.colwise().squaredNorm().maxCoeff()) / forces_.gravity_m_per_s2.norm();
}

int PaperMotion::contacts() const {
  return static_cast<int>(std::count_if(touch_.begin(), touch_.end(),
                                        [](const Touch& touch) { return touch.shape >= 0; }));
}

}  // namespace drape::simulate
