// SPDX-License-Identifier: Apache-2.0
#include "simulate/paper/paper_cloth.hpp"

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

}  // namespace drape::simulate
