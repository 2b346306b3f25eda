// SPDX-License-Identifier: Apache-2.0
#include "simulate/checker/sheet.hpp"

#include <algorithm>
#include <cmath>

#include "simulate/checker/dual.hpp"

namespace drape::simulate::checker {

namespace {

class Builder {
 public:
  Builder(const SheetSpec& spec, const std::vector<Point>& points)
      : spec_(spec),
        points_(points),
        warp_(spec.patch_warp_m / (spec.rows - 1)),
        weft_(spec.patch_weft_m / (spec.cols - 1)) {
    result_.force.assign(points.size(), Point{});
    result_.strain_least = {1e9L, 1e9L};
    result_.strain_most = {-1e9L, -1e9L};
  }

  Mechanics build() {
    if (spec_.laws.friction) {
      const ClothFriction& friction = *spec_.laws.friction;
      for (int d = 0; d < 2; ++d)
        result_.memory_fits &=
            spec_.memory.bending[d].size() == points_.size() * friction.bending[d].elements.size();
      result_.memory_fits &=
          spec_.memory.shear.size() == points_.size() * friction.shear.elements.size();
      if (!result_.memory_fits) return std::move(result_);
    }
    for (int r = 0; r < spec_.rows; ++r) {
      for (int c = 0; c < spec_.cols; ++c) at_particle(r, c);
    }
    for (const HalfTriple& half : spec_.clamped) half_triple(half);
    if (spec_.paper_model) {
      for (int r = 0; r < spec_.rows; ++r) {
        for (int c = 0; c < spec_.cols; ++c) paper_lines(r, c);
      }
    }
    return std::move(result_);
  }

 private:
  [[nodiscard]] int index(int r, int c) const { return r * spec_.cols + c; }
  [[nodiscard]] bool inside(int r, int c) const {
    return r >= 0 && c >= 0 && r < spec_.rows && c < spec_.cols;
  }
  [[nodiscard]] bool has_cell(int r, int c) const { return inside(r, c) && inside(r + 1, c + 1); }
  /// Cloth width across a line at position i of n.
  [[nodiscard]] Real width(int i, int n, Real spacing) const {
    return !spec_.paper_model && (i == 0 || i == n - 1) ? spacing / 2 : spacing;
  }

  template <int N>
  std::vector<Vector<N>> duals(const std::vector<int>& particles) const {
    std::vector<Vector<N>> corners(particles.size());
    for (std::size_t k = 0; k < particles.size(); ++k) {
      for (int axis = 0; axis < 3; ++axis) {
        corners[k][axis].v = points_[particles[k]][axis];
        corners[k][axis].d[3 * k + axis] = 1;
      }
    }
    return corners;
  }

  template <int N>
  void book(Real& energy, const Dual<N>& element, const std::vector<int>& particles) {
    energy += element.v;
    for (std::size_t k = 0; k < particles.size(); ++k) {
      for (int axis = 0; axis < 3; ++axis)
        result_.force[particles[k]][axis] -= element.d[3 * k + axis];
    }
  }

  void at_particle(int r, int c) {
    const Real across_weft = r == 0 || r == spec_.rows - 1 ? warp_ / 2 : warp_;
    const Real across_warp = c == 0 || c == spec_.cols - 1 ? weft_ / 2 : weft_;
    const Real density = spec_.laws.density_kg_per_m2;
    const bool by_number = spec_.paper_model || spec_.paper_mass;
    result_.mass.push_back(by_number ? density * spec_.patch_warp_m * spec_.patch_weft_m /
                                           (spec_.rows * spec_.cols)
                                     : density * across_weft * across_warp);
    if (inside(r + 1, c))
      spring(0, {index(r, c), index(r + 1, c)}, warp_, width(c, spec_.cols, weft_));
    if (inside(r, c + 1))
      spring(1, {index(r, c), index(r, c + 1)}, weft_, width(r, spec_.rows, warp_));
    if (inside(r - 1, c) && inside(r + 1, c))
      triple(0, {index(r - 1, c), index(r, c), index(r + 1, c)}, warp_,
             width(c, spec_.cols, weft_));
    if (inside(r, c - 1) && inside(r, c + 1))
      triple(1, {index(r, c - 1), index(r, c), index(r, c + 1)}, weft_,
             width(r, spec_.rows, warp_));
    if (has_cell(r, c)) cell({index(r, c), index(r, c + 1), index(r + 1, c), index(r + 1, c + 1)});
  }

  void spring(int d, const std::vector<int>& ends, Real rest, Real cloth_width) {
    const auto corners = duals<6>(ends);
    const Vector<6> displacement = combine(corners, {-1, 1});
    Dual<6> strain = (1 / rest) * root(dot(displacement, displacement));
    strain.v -= 1;
    result_.strain_least[d] = std::min(result_.strain_least[d], strain.v);
    result_.strain_most[d] = std::max(result_.strain_most[d], strain.v);
    book(result_.stretch_j, cloth_width * rest * work_under(spec_.laws.tensile[d], strain), ends);
  }

  /// The edge from a clamp, seen across it, and the edge forward of the same length: the change
  /// from the one to the other bends half a spacing of cloth.
  void half_triple(const HalfTriple& half) {
    const bool along_warp = half.d == 0;
    const Real rest = along_warp ? warp_ : weft_;
    const Real cloth_width = along_warp ? width(half.held % spec_.cols, spec_.cols, weft_)
                                        : width(half.held / spec_.cols, spec_.rows, warp_);
    const std::vector<int> ends = {half.held, half.next};
    const Vector<6> edge = combine(duals<6>(ends), {-1, 1});
    Dual<6> ahead, beside;
    for (int axis = 0; axis < 3; ++axis) {
      ahead = ahead + half.forward[axis] * edge[axis];
      beside = beside + half.normal[axis] * edge[axis];
    }
    const Dual<6> back = root(ahead * ahead + beside * beside) - ahead;
    const Dual<6> curvature = (2 / (rest * rest)) * root(back * back + beside * beside);
    result_.curvature_most_per_m = std::max(result_.curvature_most_per_m, curvature.v);
    book(result_.bending_j,
         cloth_width * rest / 2 * work_under(spec_.laws.bending[half.d], curvature), ends);
  }

  void triple(int d, const std::vector<int>& three, Real rest, Real cloth_width) {
    for (const HalfTriple& half : spec_.clamped)
      if (half.d == d && half.held == three[1]) return;
    const auto corners = duals<9>(three);
    const Vector<9> bend = combine(corners, {1, -2, 1});
    const Dual<9> curvature = (1 / (rest * rest)) * root(dot(bend, bend));
    result_.curvature_most_per_m = std::max(result_.curvature_most_per_m, curvature.v);
    book(result_.bending_j, cloth_width * rest * work_under(spec_.laws.bending[d], curvature),
         three);
    if (spec_.laws.friction) bent_friction(d, three, rest, cloth_width);
  }

  /// Springs of friction elements, each from its own slip: what they store and pull with.
  template <int N>
  Dual<N> slipped(const FrictionStack& stack, const std::vector<double>& memory, int place,
                  const Dual<N>& x) {
    return drape::simulate::checker::slipped(stack, memory, place, x, result_.friction_over_limit);
  }

  /// Friction follows the curvature along the sheet's normal, which the lines through the middle
  /// particle give; at a border the line across ends there.
  void bent_friction(int d, const std::vector<int>& three, Real rest, Real cloth_width) {
    const int middle = three[1];
    const int line = d == 0 ? middle % spec_.cols : middle / spec_.cols;
    const int last = d == 0 ? spec_.cols - 1 : spec_.rows - 1;
    const int step = d == 0 ? 1 : spec_.cols;
    const std::vector<int> five = {three[0], middle, three[2], line > 0 ? middle - step : middle,
                                   line < last ? middle + step : middle};
    const auto corners = duals<15>(five);
    const Vector<15> bend = combine(corners, {1, -2, 1, 0, 0});
    const Vector<15> along = combine(corners, {-1, 0, 1, 0, 0});
    const Vector<15> across = combine(corners, {0, 0, 0, -1, 1});
    Vector<15> normal;
    for (int axis = 0; axis < 3; ++axis) {
      const int y = (axis + 1) % 3, z = (axis + 2) % 3;
      normal[axis] = along[y] * across[z] - along[z] * across[y];
    }
    const Dual<15> size = root(dot(normal, normal));
    const Dual<15> inverse = chain(size, 1 / size.v, -1 / (size.v * size.v));
    const Dual<15> curvature = (1 / (rest * rest)) * (dot(bend, normal) * inverse);
    book(result_.bending_j,
         cloth_width * rest *
             slipped(spec_.laws.friction->bending[d], spec_.memory.bending[d], middle, curvature),
         five);
  }

  [[nodiscard]] Dual<12> sine_of(const std::vector<Vector<12>>& corners) const {
    const Vector<12> along_warp = combine(corners, {-1, -1, 1, 1});
    const Vector<12> along_weft = combine(corners, {-1, 1, -1, 1});
    const Dual<12> size = root(dot(along_warp, along_warp) * dot(along_weft, along_weft));
    const Dual<12> inverse = chain(size, 1 / size.v, -1 / (size.v * size.v));
    return dot(along_warp, along_weft) * inverse;
  }

  void cell(const std::vector<int>& four) {
    const auto corners = duals<12>(four);
    const Dual<12> sine = sine_of(corners);
    const Real s = std::clamp<Real>(sine.v, -1, 1);
    result_.shear_most_rad = std::max(result_.shear_most_rad, std::abs(std::asin(s)));
    if (spec_.paper_model) {
      diagonals(four, k_diag(sine.v));
      return;
    }
    // The floor of the simulator's model: a cell folded flat upon itself has no shear angle.
    const Real cosine = std::sqrt(std::max<Real>(1e-6L, 1 - s * s));
    const Real sign = s < 0 ? -1 : 1;
    const Dual<12> angle = chain(sine, sign * std::asin(s), sign / cosine);
    book(result_.shear_j, warp_ * weft_ * work_under(spec_.laws.shear, angle), four);
    const Dual<12> signed_angle = chain(sine, std::asin(s), 1 / cosine);
    if (spec_.laws.friction)
      book(result_.shear_j,
           warp_ * weft_ *
               slipped(spec_.laws.friction->shear, spec_.memory.shear, four[0], signed_angle),
           four);
    const Vector<12> twist = combine(corners, {1, -1, -1, 1});
    book(result_.twist_j, (Real(spec_.laws.twist_n_m) / (2 * warp_ * weft_)) * dot(twist, twist),
         four);
  }

  /// Paper section 4.1: f_sh(a) / sin a.
  [[nodiscard]] Real k_diag(Real sine) const {
    const Real s = std::abs(sine);
    return s < 1e-9L ? Real(spec_.laws.shear.slope)
                     : law_value(spec_.laws.shear, std::asin(std::min<Real>(1, s))) / s;
  }

  /// A straight pull of stiffness k between two particles that are `rest` apart without it.
  Real pull(int a, int b, Real k, Real rest) {
    Point displacement{};
    Real length = 0;
    for (int axis = 0; axis < 3; ++axis) {
      displacement[axis] = points_[b][axis] - points_[a][axis];
      length += displacement[axis] * displacement[axis];
    }
    length = std::sqrt(length);
    for (int axis = 0; axis < 3; ++axis) {
      const Real f = k * (length - rest) * displacement[axis] / length;
      result_.force[a][axis] += f;
      result_.force[b][axis] -= f;
    }
    return k * (length - rest) * (length - rest) / 2;
  }

  void diagonals(const std::vector<int>& four, Real k) {
    const Real rest = std::sqrt(warp_ * warp_ + weft_ * weft_);
    const Real oblong = rest * rest / (2 * warp_ * weft_);
    result_.shear_j += pull(four[0], four[3], k * oblong, rest);
    result_.shear_j += pull(four[1], four[2], k * oblong, rest);
  }

  /// K'_st = K_st - K_diag, not below 0: what the diagonals take off the grid lines.
  void paper_lines(int r, int c) {
    if (inside(r + 1, c))
      take_off(0, index(r, c), index(r + 1, c), cells_at({{{r, c - 1}, {r, c}}}));
    if (inside(r, c + 1))
      take_off(1, index(r, c), index(r, c + 1), cells_at({{{r - 1, c}, {r, c}}}));
  }

  [[nodiscard]] Real cells_at(const std::array<std::array<int, 2>, 2>& cells) const {
    Real sum = 0;
    int count = 0;
    for (const auto& [r, c] : cells) {
      if (!has_cell(r, c)) continue;
      sum += k_diag(
          sine_of(duals<12>({index(r, c), index(r, c + 1), index(r + 1, c), index(r + 1, c + 1)}))
              .v);
      ++count;
    }
    return sum / count;
  }

  void take_off(int d, int a, int b, Real mean_k_diag) {
    const Real rest = d == 0 ? warp_ : weft_;
    const Real across = d == 0 ? weft_ : warp_;
    Real length = 0;
    for (int axis = 0; axis < 3; ++axis)
      length += (points_[b][axis] - points_[a][axis]) * (points_[b][axis] - points_[a][axis]);
    const Real strain = std::sqrt(length) / rest - 1;
    const Real k_st = std::abs(strain) < 1e-9L ? Real(spec_.laws.tensile[d].slope)
                                               : law_value(spec_.laws.tensile[d], strain) / strain;
    const Real fraction = mean_k_diag * rest * rest / (across * across);
    result_.stretch_j += pull(a, b, -std::min(fraction, k_st) * across / rest, rest);
  }

  const SheetSpec& spec_;
  const std::vector<Point>& points_;
  Real warp_, weft_;
  Mechanics result_;
};

constexpr Real kOnLine_m = 2e-6L;  // m, in the material: what files round to

Point vector_in(const Eigen::Vector3d& p) {
  return {p.x(), p.y(), p.z()};
}

Point unit_of(const Point& v) {
  const Real length = std::sqrt(dot(v, v));
  return {v[0] / length, v[1] / length, v[2] / length};
}

Point times(const Point& v, Real factor) {
  return {factor * v[0], factor * v[1], factor * v[2]};
}

/// The material line of a clamp: particles are on it where their distance across it is nothing and
/// their part of its length is in 0 .. 1.
struct MaterialLine {
  explicit MaterialLine(const Clamp& clamp)
      : warp(clamp.from_material_m.x()),
        weft(clamp.from_material_m.y()),
        along_warp(Real(clamp.to_material_m.x()) - warp),
        along_weft(Real(clamp.to_material_m.y()) - weft),
        length(std::sqrt(along_warp * along_warp + along_weft * along_weft)) {}

  [[nodiscard]] Real across(Real u, Real v) const {
    return std::abs((u - warp) * along_weft - (v - weft) * along_warp) / length;
  }
  [[nodiscard]] Real part(Real u, Real v) const {
    return ((u - warp) * along_warp + (v - weft) * along_weft) / (length * length);
  }
  [[nodiscard]] bool has(Real u, Real v) const {
    const Real beyond = kOnLine_m / length;
    return across(u, v) < kOnLine_m && part(u, v) > -beyond && part(u, v) < 1 + beyond;
  }

  Real warp, weft, along_warp, along_weft, length;
};

class Holder {
 public:
  Holder(const Sheet& sheet, const std::vector<Point>& points)
      : sheet_(sheet), points_(points), clamped_(points.size(), false) {}

  void hold(const Clamp& clamp, Clamps& sum) {
    const MaterialLine line(clamp);
    const Point from = vector_in(clamp.from_in_world), to = vector_in(clamp.to_in_world);
    const bool has_length = line.length > 0 && dot(minus(to, from), minus(to, from)) > 0;
    const bool on_thread =
        std::min(std::abs(line.along_warp), std::abs(line.along_weft)) < kOnLine_m;
    if (!has_length || !on_thread) {
      sum.refusals.emplace_back("a clamp runs along no thread or has no length");
      return;
    }
    const Point along = unit_of(minus(to, from));
    const Point out = vector_in(clamp.direction_in_world);
    const Point across = minus(out, times(along, dot(out, along)));
    if (!(dot(across, across) > 0)) {
      sum.refusals.emplace_back("a clamp is left along itself");
      return;
    }
    const Point forward = unit_of(across);
    const Point normal = cross(along, forward);
    const int d = std::abs(line.along_warp) < std::abs(line.along_weft) ? 0 : 1;
    int found = 0;
    for (int r = 0; r < sheet_.rows; ++r) {
      for (int c = 0; c < sheet_.cols; ++c) {
        const Real u = Real(sheet_.patch_m.x()) * r / (sheet_.rows - 1);
        const Real v = Real(sheet_.patch_m.y()) * c / (sheet_.cols - 1);
        if (!line.has(u, v)) continue;
        ++found;
        const int i = r * sheet_.cols + c;
        const Point place = minus(from, times(minus(from, to), line.part(u, v)));
        const Point off = minus(points_[i], place);
        sum.farthest_m = std::max(sum.farthest_m, std::sqrt(dot(off, off)));
        if (!clamped_[i]) sum.supports.push_back({{i, i, i, i}, {1, 0, 0, 0}, {}, true});
        clamped_[i] = true;
        const int row = d == 0 ? r : c, last = (d == 0 ? sheet_.rows : sheet_.cols) - 1;
        const int step = d == 0 ? sheet_.cols : 1;
        if (row < last) bend(i, i + step, d, forward, normal, sum);
        if (row > 0) bend(i, i - step, d, row == last ? forward : times(forward, -1), normal, sum);
      }
    }
    if (found < 2)
      sum.refusals.emplace_back("a clamp lies beside the rows of particles of this grid");
  }

 private:
  static void bend(int held, int next, int d, const Point& forward, const Point& normal,
                   Clamps& sum) {
    const bool there =
        std::any_of(sum.halves.begin(), sum.halves.end(),
                    [&](const HalfTriple& half) { return half.held == held && half.next == next; });
    if (!there) sum.halves.push_back({held, next, d, forward, normal});
  }

  const Sheet& sheet_;
  const std::vector<Point>& points_;
  std::vector<bool> clamped_;
};

}  // namespace

Mechanics mechanics_of(const SheetSpec& spec, const std::vector<Point>& points) {
  return Builder(spec, points).build();
}

Clamps clamps_of(const Scene& scene, const Sheet& sheet, const std::vector<Point>& points) {
  Clamps sum;
  Holder holder(sheet, points);
  for (const Clamp& clamp : scene.clamps) holder.hold(clamp, sum);
  for (const HalfTriple& half : sum.halves) {
    const Point edge = minus(points[half.next], points[half.held]);
    sum.turned_rad = std::max(
        sum.turned_rad, std::atan2(std::abs(dot(edge, half.normal)), dot(edge, half.forward)));
  }
  return sum;
}

}  // namespace drape::simulate::checker
