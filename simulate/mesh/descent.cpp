// SPDX-License-Identifier: Apache-2.0
#include "simulate/mesh/descent.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "simulate/mesh/mesh_cloth.hpp"
#include "simulate/sparse/graph_factor.hpp"

namespace drape::simulate {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Weights by point, each point once.
class MeshStiffness::Weights {
 public:
  void add(int point, double weight) {
    const auto at =
        std::find_if(of_.begin(), of_.end(), [&](const auto& w) { return w.first == point; });
    if (at == of_.end())
      of_.emplace_back(point, weight);
    else
      at->second += weight;
  }
  void add(const Weights& other, double factor) {
    for (const auto& [point, weight] : other.of_) add(point, factor * weight);
  }
  [[nodiscard]] double of(int point) const {
    for (const auto& [p, weight] : of_)
      if (p == point) return weight;
    return 0;
  }
  [[nodiscard]] std::vector<std::pair<int, double>>::const_iterator begin() const {
    return of_.begin();
  }
  [[nodiscard]] std::vector<std::pair<int, double>>::const_iterator end() const {
    return of_.end();
  }

 private:
  std::vector<std::pair<int, double>> of_;
};

/// Gradient of a strain by the surrounding points, for products c c^T.
struct MeshStiffness::Gradient {
  std::vector<Eigen::Vector3d> stretch[2], shear;

  void reset(std::size_t count) {
    for (auto* of : {&stretch[0], &stretch[1], &shear}) of->assign(count, Eigen::Vector3d::Zero());
  }
  /// Adds a fraction `part` of a triangle's metric with derivatives u and v, for the point with
  /// shape function derivatives d_u, d_v.
  void add(std::size_t at, const MetricStrain& strain, double part, double d_u, double d_v,
           const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
    const double a = strain.a, b = strain.b, s = strain.sine;
    const Eigen::Vector3d of_a = part * d_u / a * u, of_b = part * d_v / b * v;
    stretch[0][at] += of_a;
    stretch[1][at] += of_b;
    shear[at] += (part / (a * b) * (d_u * v + d_v * u) - s * (of_a / a + of_b / b)) /
                 std::max(strain.cosine(), 1e-3);
  }
};

/// Tangent stiffness along warp and weft and of shear, times an area.
[[nodiscard]] inline Eigen::Vector3d tangents(const MetricStrain& strain, const ClothLaws& laws,
                                              double area) {
  return area * Eigen::Vector3d(laws.tensile[0].tangent(strain.a - 1),
                                laws.tensile[1].tangent(strain.b - 1),
                                std::max(0.0, laws.shear.tangent(std::abs(strain.angle()))));
}

/// The scalar matrix D + L + L^T of the edges, with supports of edges added to D. Solves with (D +
/// L) D^-1 (D + L^T), for right-hand sides of three columns.
class MeshStiffness::SidesMatrix {
 public:
  explicit SidesMatrix(const Eigen::SparseMatrix<double>& matrix)
      : below_(matrix.triangularView<Eigen::StrictlyLower>()),
        diagonal_(matrix.diagonal()),
        inverse_(3 * static_cast<std::size_t>(matrix.rows())),
        work_(static_cast<std::size_t>(matrix.rows())) {}
  /// Resets to the matrix alone, then adds supports (N m).
  void press(const std::vector<std::pair<int, Eigen::Matrix3d>>& on_sides) {
    for (Eigen::Index i = 0; i < diagonal_.size(); ++i)
      set_inverse(static_cast<std::size_t>(i), Eigen::Matrix3d::Identity() / diagonal_[i]);
    std::vector<Eigen::Matrix3d> sum(static_cast<std::size_t>(diagonal_.size()),
                                     Eigen::Matrix3d::Zero());
    for (const auto& [side, stiffness] : on_sides) sum[side] += stiffness;
    for (const auto& [side, stiffness] : on_sides)
      set_inverse(static_cast<std::size_t>(side),
                  (diagonal_[side] * Eigen::Matrix3d::Identity() + sum[side]).inverse());
  }
  void solve(std::vector<Eigen::Vector3d>& b) const {
    for (std::size_t i = 0; i < b.size(); ++i) work_.set(i, b[i]);
    sweep(below_.outerIndexPtr(), below_.innerIndexPtr(), below_.valuePtr(), inverse_.data(),
          static_cast<int>(b.size()), work_.data());
    for (std::size_t i = 0; i < b.size(); ++i) b[i] = work_.at(i);
  }

 private:
  /// Forward and backward substitution; `inverse` has three columns per edge.
  DRAPE_WIDE static void sweep(const int* begin, const int* row, const double* value,
                               const Four* inverse, int count, Four* work);
  void set_inverse(std::size_t side, const Eigen::Matrix3d& of) {
    for (int c = 0; c < 3; ++c) inverse_.set(3 * side + c, of.col(c));
  }

  Eigen::SparseMatrix<double> below_;
  Eigen::VectorXd diagonal_;
  mutable Fours inverse_, work_;
};

void MeshStiffness::SidesMatrix::sweep(const int* begin, const int* row, const double* value,
                                       const Four* inverse, int count, Four* work) {
  for (int j = 0; j < count; ++j) {
    const Four* of = inverse + 3 * static_cast<std::ptrdiff_t>(j);
    const Four own = work[j], x = own[0] * of[0] + own[1] * of[1] + own[2] * of[2];
    work[j] = x;
    for (int k = begin[j]; k < begin[j + 1]; ++k) work[row[k]] -= value[k] * x;
  }
  for (int j = count; j-- > 0;) {
    Four sum{};
    for (int k = begin[j]; k < begin[j + 1]; ++k) sum += value[k] * work[row[k]];
    const Four* of = inverse + 3 * static_cast<std::ptrdiff_t>(j);
    work[j] -= sum[0] * of[0] + sum[1] * of[1] + sum[2] * of[2];
  }
}

struct MeshStiffness::Parts {
  const MeshCloth& cloth;
  const std::vector<bool>& held;
  std::vector<int> vertex, free_points, free_sides, row_of_side;  ///< -1 if held
  std::vector<Weights> of_side;                        ///< an edge's derivative, from points
  std::vector<std::pair<int, double>> pairs_of_sides;  ///< the same for free edges, by free points
  std::vector<int> pairs_begin = {0};
  /// Points that determine a triangle's bending, their weights, and the blocks of each pair.
  struct Patch {
    std::vector<int> points, places;
    std::vector<Vector3d> weight;  ///< weights in x_uu, x_uv, x_vv
  };
  std::vector<Patch> patches;
  /// A point, its neighbours and the triangles around it.
  struct Ring {
    std::vector<int> points, places, triangles;
  };
  std::vector<Ring> rings;
  std::unique_ptr<GraphMatrix> matrix;
  std::unique_ptr<GraphFactor> factor;
  std::unique_ptr<SidesMatrix> sides;
  mutable std::vector<Vector3d> of_points, of_sides;

  Parts(const MeshCloth& of, const std::vector<bool>& held_unknowns)
      : cloth(of), held(held_unknowns) {
    number();
    place_sides();
    list_pairs();
    place_patches();
    place_rings();
    join();
    weigh_sides();
  }

  [[nodiscard]] bool at_hem(int edge) const {
    const MaterialMesh::Edge& e = cloth.mesh().edges[edge];
    return e.left < 0 || e.right < 0;
  }

  void number() {
    for (int i = 0; i < cloth.unknowns(); ++i) {
      auto& list = i < cloth.points() ? free_points : free_sides;
      auto& rank = i < cloth.points() ? vertex : row_of_side;
      rank.push_back(held[i] ? -1 : static_cast<int>(list.size()));
      if (!held[i]) list.push_back(i);
    }
    of_points.resize(free_points.size());
    of_sides.resize(free_sides.size());
  }

  void place_sides() {
    const MaterialMesh& mesh = cloth.mesh();
    const int points = cloth.points(), edges = static_cast<int>(mesh.edges.size());
    of_side.resize(mesh.edges.size());
    for (int e = 0; e < edges; ++e) {
      if (held[points + e] || at_hem(e)) continue;
      const Vector2d n = cloth.normal_of(e);
      const int beside[2] = {mesh.edges[e].left, mesh.edges[e].right};
      const double areas[2] = {mesh.area_m2(beside[0]), mesh.area_m2(beside[1])};
      for (int s = 0; s < 2; ++s) {
        const MeshCloth::Triangle& t = cloth.triangles()[beside[s]];
        const double weight = areas[s] / (areas[0] + areas[1]);
        for (int k = 0; k < 3; ++k)
          of_side[e].add(t.corner[k], weight * (t.d_u[k] * n.x() + t.d_v[k] * n.y()));
      }
    }
    const ClothLaws& laws = cloth.laws();
    for (int e = 0; e < edges; ++e) {
      if (held[points + e] || !at_hem(e)) continue;
      const MeshCloth::Triangle& t =
          cloth.triangles()[std::max(mesh.edges[e].left, mesh.edges[e].right)];
      const auto own =
          std::find(t.unknown.begin(), t.unknown.end(), points + e) - t.unknown.begin();
      const auto stiffness = [&](std::size_t a, std::size_t b) {
        return laws.bending[0].slope * t.d_uu[a] * t.d_uu[b] +
               laws.bending[1].slope * t.d_vv[a] * t.d_vv[b] +
               laws.twist_n_m * t.d_uv[a] * t.d_uv[b];
      };
      for (std::size_t k = 0; k < 6; ++k) {
        if (static_cast<std::ptrdiff_t>(k) == own) continue;
        const double follows = -stiffness(own, k) / stiffness(own, own);
        if (k < 3)
          of_side[e].add(t.corner[k], follows);
        else
          of_side[e].add(of_side[t.unknown[k] - points], follows);
      }
    }
  }

  void list_pairs() {
    for (const int side : free_sides) {
      for (const auto& [point, weight] : of_side[side - cloth.points()])
        if (vertex[point] >= 0) pairs_of_sides.emplace_back(vertex[point], weight);
      pairs_begin.push_back(static_cast<int>(pairs_of_sides.size()));
    }
  }

  void place_patches() {
    for (const MeshCloth::Triangle& t : cloth.triangles()) {
      Patch patch;
      Weights uu, uv, vv;
      for (std::size_t k = 0; k < 6; ++k) {
        Weights of;
        if (k < 3)
          of.add(t.corner[k], 1);
        else
          of = of_side[t.unknown[k] - cloth.points()];
        uu.add(of, t.d_uu[k]);
        uv.add(of, t.d_uv[k]);
        vv.add(of, t.d_vv[k]);
      }
      for (const auto& [point, weight] : uu) {
        patch.points.push_back(point);
        patch.weight.emplace_back(weight, uv.of(point), vv.of(point));
      }
      patches.push_back(std::move(patch));
    }
  }

  void place_rings() {
    rings.resize(static_cast<std::size_t>(cloth.points()));
    for (std::size_t t = 0; t < cloth.triangles().size(); ++t) {
      const auto& corners = cloth.triangles()[t].corner;
      for (const int i : corners) {
        rings[i].triangles.push_back(static_cast<int>(t));
        rings[i].points.insert(rings[i].points.end(), corners.begin(), corners.end());
      }
    }
    for (Ring& ring : rings) sort_once(ring.points);
  }

  static void sort_once(std::vector<int>& list) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }

  /// Builds the pattern of the matrix and the positions of all pairs.
  void join() {
    std::vector<std::vector<int>> neighbours(free_points.size());
    const auto join_all = [&](const std::vector<int>& points) {
      for (const int a : points)
        for (const int b : points)
          if (a != b && vertex[a] >= 0 && vertex[b] >= 0)
            neighbours[vertex[a]].push_back(vertex[b]);
    };
    for (const Ring& ring : rings) join_all(ring.points);
    for (const Patch& patch : patches) join_all(patch.points);
    for (auto& list : neighbours) sort_once(list);
    matrix = std::make_unique<GraphMatrix>(std::move(neighbours));
    std::vector<Vector2d> places;
    for (const int i : free_points) places.push_back(cloth.mesh().points_m[i]);
    factor = std::make_unique<GraphFactor>(*matrix, places);
    const auto places_of = [&](const std::vector<int>& points) {
      std::vector<int> of_pairs;
      for (const int a : points)
        for (const int b : points) {
          const int i = vertex[a], j = vertex[b];
          of_pairs.push_back(j >= 0 && i >= j ? matrix->place(i, j) : -1);
        }
      return of_pairs;
    };
    for (Ring& ring : rings) ring.places = places_of(ring.points);
    for (Patch& patch : patches) patch.places = places_of(patch.points);
  }

  void weigh_sides() {
    const ClothLaws& laws = cloth.laws();
    double bend[2];
    for (int d = 0; d < 2; ++d)
      bend[d] = laws.bending[d].slope + (laws.friction ? laws.friction->bending[d].stiffness() : 0);
    std::vector<Eigen::Triplet<double>> entries;
    const auto row = [&](int unknown) {
      return unknown < cloth.points() ? -1 : row_of_side[unknown - cloth.points()];
    };
    const auto add = [&](const auto& unknown, const auto& value) {
      for (std::size_t a = 0; a < unknown.size(); ++a)
        for (std::size_t b = 0; b < unknown.size(); ++b)
          if (row(unknown[a]) >= 0 && row(unknown[b]) >= 0)
            entries.emplace_back(row(unknown[a]), row(unknown[b]), value(a, b));
    };
    for (const MeshCloth::Triangle& t : cloth.triangles())
      add(t.unknown, [&](std::size_t a, std::size_t b) {
        return t.area * (bend[0] * t.d_uu[a] * t.d_uu[b] + bend[1] * t.d_vv[a] * t.d_vv[b] +
                         laws.twist_n_m * t.d_uv[a] * t.d_uv[b]);
      });
    for (const MeshCloth::Seam& seam : cloth.seams())
      add(seam.unknown, [&](std::size_t a, std::size_t b) {
        return seam.stiffness * seam.weight[a] * seam.weight[b];
      });
    const auto size = static_cast<Eigen::Index>(free_sides.size());
    Eigen::SparseMatrix<double> of_sides_alone(size, size);
    of_sides_alone.setFromTriplets(entries.begin(), entries.end());
    sides = std::make_unique<SidesMatrix>(of_sides_alone);
  }

  /// Adds k c c^T for the three strains.
  void add_strains(const Gradient& c, const Vector3d& k, const std::vector<int>& places,
                   std::size_t stride) {
    const std::size_t count = c.shear.size();
    for (std::size_t p = 0; p < count; ++p) {
      const Vector3d a = k[0] * c.stretch[0][p], b = k[1] * c.stretch[1][p], s = k[2] * c.shear[p];
      for (std::size_t q = 0; q < count; ++q) {
        const int place = places[p * stride + q];
        if (place < 0) continue;
        Matrix3d& block = matrix->block(place);
        for (int col = 0; col < 3; ++col)
          block.col(col) +=
              c.stretch[0][q][col] * a + c.stretch[1][q][col] * b + c.shear[q][col] * s;
      }
    }
  }

  void form(const MeshCloth::State& state) {
    matrix->set_zero();
    const ClothLaws& laws = cloth.laws();
    const auto& triangles = cloth.triangles();
    std::vector<Vector3d> u, v;
    for (const MeshCloth::Triangle& t : triangles) {
      u.push_back(combined(t.d_u, t.unknown, state));
      v.push_back(combined(t.d_v, t.unknown, state));
    }
    std::vector<Vector3d> metric = cloth.metrics(state), stress(metric.size());
    const double at_points = 1 - cloth.in_triangles();
    Gradient gradient;
    for (std::size_t i = 0; i < rings.size(); ++i) {
      const MetricStrain strain(metric[i]);
      stress[i] = at_points * stress_of(strain, strain.angle(), laws);
      Vector3d k = tangents(strain, laws, at_points * cloth.area_m2()[i]);
      if (laws.friction) {
        const FrictionStack& stack = laws.friction->shear;
        const double* slip = cloth.memory().shear.data() + stack.elements.size() * i;
        stress[i] += strain.of_angle(stack.force(strain.angle(), slip));
        k[2] += cloth.area_m2()[i] * std::max(0.0, stack.tangent(strain.angle(), slip));
      }
      const Ring& ring = rings[i];
      gradient.reset(ring.points.size());
      for (const int t : ring.triangles)
        for (int c = 0; c < 3; ++c) {
          const auto at =
              std::lower_bound(ring.points.begin(), ring.points.end(), triangles[t].corner[c]);
          gradient.add(static_cast<std::size_t>(at - ring.points.begin()), strain,
                       triangles[t].area / (3 * cloth.area_m2()[i]), triangles[t].d_u[c],
                       triangles[t].d_v[c], u[t], v[t]);
        }
      add_strains(gradient, k, ring.places, ring.points.size());
    }
    const auto bend = cloth.bending_stiffness(state);
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      const MeshCloth::Triangle& t = triangles[i];
      const Patch& patch = patches[i];
      const std::size_t count = patch.points.size();
      const Vector3d own = metric_of(u[i], v[i]);
      const MetricStrain strain(own);
      gradient.reset(3);
      for (int c = 0; c < 3; ++c) gradient.add(c, strain, 1, t.d_u[c], t.d_v[c], u[i], v[i]);
      // The corners come first in a patch's points.
      add_strains(gradient, tangents(strain, laws, cloth.in_triangles() * t.area), patch.places,
                  count);
      const Vector3d pull =
          t.area * (cloth.in_triangles() * stress_of(strain, strain.angle(), laws) +
                    (stress[t.corner[0]] + stress[t.corner[1]] + stress[t.corner[2]]) / 3);
      Eigen::Matrix2d tension;
      tension << 2 * pull[0], pull[1], pull[1], 2 * pull[2];
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> parts;
      parts.computeDirect(tension);
      tension = parts.eigenvectors() * parts.eigenvalues().cwiseMax(0).asDiagonal() *
                parts.eigenvectors().transpose();
      for (std::size_t p = 0; p < count; ++p)
        for (std::size_t q = 0; q < count; ++q) {
          const int place = patch.places[p * count + q];
          if (place < 0) continue;
          const Vector3d &a = patch.weight[p], &b = patch.weight[q];
          double k = t.area * (bend[i][0] * a[0] * b[0] + laws.twist_n_m * a[1] * b[1] +
                               bend[i][1] * a[2] * b[2]);
          if (p < 3 && q < 3)
            k += Vector2d(t.d_u[p], t.d_v[p]).dot(tension * Vector2d(t.d_u[q], t.d_v[q]));
          matrix->block(place).diagonal().array() += k;
        }
    }
  }
};

MeshStiffness::MeshStiffness(const MeshCloth& cloth, const std::vector<bool>& held)
    : parts_(std::make_unique<Parts>(cloth, held)) {}
MeshStiffness::~MeshStiffness() = default;

bool MeshStiffness::factorise(const MeshCloth::State& state, const std::vector<Support>& supports) {
  Parts& my = *parts_;
  my.form(state);
  std::vector<std::pair<int, Matrix3d>> on_sides;
  for (const Support& support : supports) {
    if (support.point >= my.cloth.points()) {
      const int row = my.row_of_side[support.point - my.cloth.points()];
      if (row >= 0) on_sides.emplace_back(row, support.stiffness);
      continue;
    }
    const int i = my.vertex[support.point], j = my.vertex[support.other];
    if (i < 0 || j < 0) continue;
    // Only the lower triangle is stored.
    Matrix3d& block = my.matrix->block(my.matrix->place(std::max(i, j), std::min(i, j)));
    if (i >= j)
      block += support.stiffness;
    else
      block += support.stiffness.transpose();
  }
  my.sides->press(on_sides);
  formed_at_ = state;
  return my.factor->factorise(*my.matrix);
}

bool MeshStiffness::serves(const MeshCloth::State& state, double near_m) const {
  for (int i = 0; i < parts_->cloth.points(); ++i)
    if (formed_at_.empty() || (state[i] - formed_at_[i]).squaredNorm() > near_m * near_m)
      return false;
  return true;
}

void MeshStiffness::solve(MeshCloth::State& b) const {
  const Parts& my = *parts_;
  for (std::size_t k = 0; k < my.free_points.size(); ++k) my.of_points[k] = b[my.free_points[k]];
  for (std::size_t k = 0; k < my.free_sides.size(); ++k) {
    const Vector3d& own = my.of_sides[k] = b[my.free_sides[k]];
    for (int f = my.pairs_begin[k]; f < my.pairs_begin[k + 1]; ++f)
      my.of_points[my.pairs_of_sides[f].first] += my.pairs_of_sides[f].second * own;
  }
  my.factor->solve(my.of_points);
  my.sides->solve(my.of_sides);
  std::fill(b.begin(), b.end(), Vector3d::Zero());
  for (std::size_t k = 0; k < my.free_points.size(); ++k) b[my.free_points[k]] = my.of_points[k];
  for (std::size_t k = 0; k < my.free_sides.size(); ++k) {
    Vector3d& own = b[my.free_sides[k]] = my.of_sides[k];
    for (int f = my.pairs_begin[k]; f < my.pairs_begin[k + 1]; ++f)
      own += my.pairs_of_sides[f].second * my.of_points[my.pairs_of_sides[f].first];
  }
}

ConjugateGradients conjugate_gradients(
    const MeshStiffness& factor,
    const std::function<void(const MeshCloth::State& direction, MeshCloth::State& product)>&
        multiply,
    const std::function<bool(double norm, const MeshCloth::State& residual)>& solved, int most,
    MeshCloth::State& b, MeshCloth::State& x) {
  constexpr double kFlat = 1e-6;  // curvature in the factor's metric that counts as zero
  const auto flat = [](MeshCloth::State& of) {
    return Eigen::Map<Eigen::VectorXd>(of.front().data(), 3 * static_cast<Eigen::Index>(of.size()));
  };
  MeshCloth::State way = b, product(b.size());
  factor.solve(way);
  MeshCloth::State direction = way;
  x.assign(b.size(), Vector3d::Zero());
  double size = flat(b).dot(flat(way));
  const double first = size;
  ConjugateGradients found;
  for (;; ++found.products) {
    found.solved = !(size > 0) || solved(std::sqrt(size / first), b);
    if (found.solved || found.products >= most) return found;
    multiply(direction, product);
    const double curvature = flat(direction).dot(flat(product));
    found.positive = curvature > kFlat * size;
    if (!found.positive) {
      if (found.products == 0) x = direction;
      return found;
    }
    flat(x) += size / curvature * flat(direction);
    flat(b) -= size / curvature * flat(product);
    way = b;
    factor.solve(way);
    const double next = flat(b).dot(flat(way));
    flat(direction) = flat(way) + next / size * flat(direction);
    size = next;
  }
}

namespace {

using State = MeshCloth::State;

constexpr double kSink_m = 0.5e-3;  // depth of cloth in the table under its own weight
// relative to the wall's radius; the checker accepts it as touching the wall
constexpr double kOnWall = 1e-5;
constexpr double kWallWeights = 100;  // mean point weights that press it in by this depth
// Least decrease of a step, relative to the slope (Nocedal and Wright).
constexpr double kArmijo = 1e-4;
constexpr double kRounding = 1e-14;  // largest increase due to rounding, relative to the energy
constexpr double kShorter = 0.5, kShortest = 0.1;  // new length of a rejected step, relative to it
constexpr int kTries = 20;
// Norm of the residual of a linear solution, relative to the right-hand side; its largest force,
// relative to the residual required of the descent.
constexpr double kSolved = 0.3, kOfResidual = 0.25;
constexpr double kPassingPart = 0.25;  // see DescentOptions::passing
constexpr int kProducts = 60;          // limit per step
// Products of a step, and displacement in mean edges, below which the next step keeps the matrix.
constexpr int kFewProducts = 20;
constexpr double kKeepsMatrix = 0.05;

Eigen::Map<Eigen::VectorXd> flat(State& state) {
  return {state.front().data(), 3 * static_cast<Eigen::Index>(state.size())};
}

/// Energy and forces of the cloth with its supports.
class Potential {
 public:
  Potential(const MeshCloth& cloth, const std::vector<bool>& held, const Drapemeter& bodies,
            const DescentOptions& options, Pushes* pushes)
      : cloth_(cloth),
        held_(held),
        bodies_(bodies),
        gravity_(options.gravity_m_per_s2),
        inertia_(options.inertia),
        pushes_(pushes),
        side_m_(cloth.mesh().mean_side_m()) {
    const double mass = std::accumulate(cloth.mass_kg().begin(), cloth.mass_kg().end(), 0.0);
    weight_n_ = gravity_.norm() * mass / cloth.points();
    wall_n_per_m_ = kWallWeights * weight_n_ / (kOnWall * std::max(bodies.wall_radius_m, 1e-9));
  }

  /// Largest force: on a point in mean point weights, on an edge in that unit times the mean edge.
  [[nodiscard]] double largest(const State& force) const {
    double points2 = 0, sides2 = 0;
    for (int i = 0; i < cloth_.unknowns(); ++i) {
      double& most2 = i < cloth_.points() ? points2 : sides2;
      most2 = std::max(most2, force[i].squaredNorm());
    }
    return std::max(std::sqrt(points2), std::sqrt(sides2) / side_m_) / weight_n_;
  }
  [[nodiscard]] double mean_side_m() const { return side_m_; }

  /// Internal plus gravity energy.
  [[nodiscard]] double own_energy_j(const State& state) const {
    double sum = cloth_.energies(state).sum_j();
    for (int i = 0; i < cloth_.points(); ++i) sum -= cloth_.mass_kg()[i] * gravity_.dot(state[i]);
    return sum;
  }
  struct Balance {
    double energy_j = 0;         ///< including wall, table, other pushes and inertia
    double point = 0, side = 0;  ///< residuals in the units of the options
    double reported = 0;         ///< on points, minus support forces, as in the checker
  };
  /// Sets `force` to the negative gradient of the energy, zero for held unknowns.
  Balance balance(const State& state, State& force) const {
    Balance found;
    std::fill(force.begin(), force.end(), Vector3d::Zero());
    found.energy_j = cloth_.add_forces(state, force).sum_j();
    for (int i = 0; i < cloth_.points(); ++i) {
      const Vector3d weight = cloth_.mass_kg()[i] * gravity_;
      found.energy_j -= weight.dot(state[i]);
      force[i] += weight;
    }
    if (pushes_ != nullptr) {
      found.energy_j += pushes_->energy_j(state);
      pushes_->add_forces(state, force);
    }
    visit_inertia([&](int i, double stiffness) {
      const Vector3d away = state[i] - inertia_->towards[i];
      found.energy_j += stiffness / 2 * away.squaredNorm();
      force[i] -= stiffness * away;
    });
    std::vector<int> supported;
    visit_supports(state, [&](int i, const Vector3d& normal, double depth, double stiffness) {
      const Vector3d along = force[i] - std::min(0.0, force[i].dot(normal)) * normal;
      found.reported = std::max(found.reported, along.norm() / weight_n_);
      found.energy_j += stiffness / 2 * depth * depth;
      supported.push_back(i);
      force[i] += stiffness * depth * normal;
    });
    auto next = supported.begin();
    for (int i = 0; i < cloth_.unknowns(); ++i) {
      if (held_[i]) force[i].setZero();
      if (i >= cloth_.points()) {
        found.side = std::max(found.side, force[i].norm() / (weight_n_ * side_m_));
        continue;
      }
      const double size = force[i].norm() / weight_n_;
      found.point = std::max(found.point, size);
      while (next != supported.end() && *next < i) ++next;
      if (next == supported.end() || *next != i) found.reported = std::max(found.reported, size);
    }
    return found;
  }
  /// Sets `product` to the second derivative of the energy times a direction, zero for held
  /// unknowns. Contacts keep their state.
  void set_products(const State& state, const ClothTangent& tangent, const State& direction,
                    State& product) const {
    std::fill(product.begin(), product.end(), Vector3d::Zero());
    tangent.add_products(direction, product);
    if (pushes_ != nullptr) pushes_->add_products(state, direction, product);
    visit_inertia([&](int i, double stiffness) { product[i] += stiffness * direction[i]; });
    visit_supports(state, [&](int i, const Vector3d& normal, double, double stiffness) {
      product[i] += stiffness * normal.dot(direction[i]) * normal;
    });
    for (int i = 0; i < cloth_.unknowns(); ++i)
      if (held_[i]) product[i].setZero();
  }
  [[nodiscard]] std::vector<Support> supports(const State& state) const {
    std::vector<Support> found;
    visit_supports(state, [&](int i, const Vector3d& normal, double, double stiffness) {
      found.push_back({i, i, stiffness * normal * normal.transpose()});
    });
    visit_inertia([&](int i, double stiffness) {
      found.push_back({i, i, stiffness * Matrix3d::Identity()});
    });
    if (pushes_ == nullptr) return found;
    const auto others = pushes_->supports(state);
    found.insert(found.end(), others.begin(), others.end());
    return found;
  }

 private:
  /// Calls visit(point, normal, depth, N/m) for each point inside the table or wall.
  template <class Visit>
  void visit_supports(const State& state, Visit visit) const {
    for (int i = 0; i < cloth_.points(); ++i) {
      if (held_[i]) continue;
      const Vector3d& p = state[i];
      if (p.z() < bodies_.table_z_m)
        visit(i, Vector3d::UnitZ(), bodies_.table_z_m - p.z(),
              bodies_.table_n_per_m3 > 0 ? cloth_.area_m2()[i] * bodies_.table_n_per_m3
                                         : cloth_.mass_kg()[i] * gravity_.norm() / kSink_m);
      const double r = p.head<2>().norm();
      if (p.z() < 0 && r < bodies_.wall_radius_m && r > 0)
        visit(i, Vector3d(p.x() / r, p.y() / r, 0), bodies_.wall_radius_m - r, wall_n_per_m_);
    }
  }

  /// Calls visit(point, N/m) for each free point of a cloth in motion.
  template <class Visit>
  void visit_inertia(Visit visit) const {
    if (inertia_ == nullptr) return;
    for (int i = 0; i < cloth_.points(); ++i)
      if (!held_[i]) visit(i, inertia_->per_s2 * cloth_.mass_kg()[i]);
  }

  const MeshCloth& cloth_;
  const std::vector<bool>& held_;
  const Drapemeter& bodies_;
  Vector3d gravity_;
  const Inertia* inertia_;
  Pushes* pushes_;
  double side_m_, weight_n_ = 0, wall_n_per_m_ = 0;
};

/// Moves a state back along the straight path to it if layers would pass through each other.
void go_clear(const State& from, State& to, Pushes& pushes, bool led) {
  const double part = pushes.clear_part(from, to, led);
  if (part >= 1) return;
  for (std::size_t i = 0; i < to.size(); ++i) to[i] = from[i] + part * (to[i] - from[i]);
}

}  // namespace

DescentReport descend(MeshCloth& cloth, State& state, const std::vector<bool>& held,
                      MeshStiffness& stiffness, const Drapemeter& bodies,
                      const DescentOptions& options, Pushes* pushes) {
  const Potential potential(cloth, held, bodies, options, pushes);
  State force(state.size()), next(state.size()), next_force(state.size()), left, step;
  DescentReport report;
  Potential::Balance now = potential.balance(state, force);
  const double residual = std::max(
      options.residual, std::min(options.passing, kPassingPart * std::max(now.point, now.side)));
  // A matrix formed with another inertia is a poor preconditioner.
  if (options.inertia != nullptr) stiffness.outdate();
  while (std::isfinite(now.energy_j)) {
    report.at_rest = std::max(now.point, now.side) <= residual;
    if (report.at_rest || report.steps >= options.most_steps) break;
    if (!stiffness.serves(state, kKeepsMatrix * potential.mean_side_m()) &&
        !stiffness.factorise(state, potential.supports(state)))
      break;
    const ClothTangent tangent(cloth, state);
    left = force;
    const ConjugateGradients found = conjugate_gradients(
        stiffness,
        [&](const State& direction, State& product) {
          potential.set_products(state, tangent, direction, product);
        },
        [&](double norm, const State& of) {
          return norm <= kSolved || potential.largest(of) <= kOfResidual * residual;
        },
        kProducts, left, step);
    if (!found.positive || found.products > kFewProducts) stiffness.outdate();
    const double slope = flat(force).dot(flat(step));
    if (!(slope > 0)) break;
    double far = 0;
    for (int i = 0; i < cloth.points(); ++i) far = std::max(far, step[i].norm());
    double part = std::min(1.0, options.farthest_step * potential.mean_side_m() / far);
    if (pushes != nullptr) {
      flat(next) = flat(state) + part * flat(step);
      part *= pushes->clear_part(state, next, false);
    }
    Potential::Balance then;
    bool down = false;
    for (int tries = 0; tries < kTries && !down; ++tries) {
      flat(next) = flat(state) + part * flat(step);
      then = potential.balance(next, next_force);
      const double gain = now.energy_j - then.energy_j;
      down = gain >= kArmijo * part * slope - kRounding * std::abs(now.energy_j);
      if (down) break;
      // Minimum of the parabola through both energies and the initial slope.
      const double least = slope * part * part / (2 * (slope * part - gain));
      part = std::isfinite(least) ? std::clamp(least, kShortest * part, kShorter * part)
                                  : kShortest * part;
    }
    if (!down && stiffness.serves(state, 0)) break;
    if (!down) {
      stiffness.outdate();
      continue;
    }
    std::swap(state, next);
    std::swap(force, next_force);
    now = then;
    ++report.steps;
  }
  if (options.inertia != nullptr) stiffness.outdate();
  cloth.settle(state);
  if (pushes != nullptr) pushes->settle(state);
  report.residual = now.reported;
  report.dissipated_j = cloth.dissipated_j();
  report.energy_j = potential.own_energy_j(state);
  return report;
}

TimeStepsReport move_in_time(MeshCloth& cloth, State& state, const std::vector<bool>& held,
                             MeshStiffness& stiffness, Drapemeter bodies,
                             const std::function<double(double)>& table_z_m, double least_s,
                             DescentOptions descent, const TimeStepsOptions& options,
                             Pushes* pushes, const Carry& carry) {
  const double longest_s = std::max(options.step_s, options.longest_step_s);
  const double farthest_m = options.farthest * cloth.mesh().mean_side_m();
  double dt = options.step_s, last_dt = dt;
  const auto points = static_cast<std::size_t>(cloth.points());
  const double weight_n = descent.gravity_m_per_s2.norm() *
                          std::accumulate(cloth.mass_kg().begin(), cloth.mass_kg().end(), 0.0);
  // Velocity and displacements of the last step, and velocity of the one before it.
  State velocity(points, Vector3d::Zero()), velocity_before = velocity, before = state;
  Inertia inertia{State(points), 0};
  descent.inertia = &inertia;
  descent.residual = std::max(descent.residual, options.residual);
  TimeStepsReport report;
  double quiet_s = 0;
  while (report.time_s < least_s + options.longest_s) {
    // Coefficients of the differences: velocity = (state - known) / h.
    const double w = report.increments++ > 0 ? dt / last_dt : 0;
    report.time_s += dt;
    const double h = dt * (1 + w) / (1 + 2 * w);
    const double mass_per_s2 = 1 / (h * h), drag_per_s2 = options.drag_per_s / h;
    const auto known = [&](const State& now, const State& last, std::size_t i) -> Vector3d {
      return now[i] + w * w / (1 + 2 * w) * (now[i] - last[i]);
    };
    State from(points);
    inertia.per_s2 = mass_per_s2 + drag_per_s2;
    for (std::size_t i = 0; i < points; ++i) {
      from[i] = known(state, before, i);
      inertia.towards[i] =
          from[i] + mass_per_s2 / inertia.per_s2 * h * known(velocity, velocity_before, i);
    }
    const State last = state;
    for (std::size_t i = 0; i < state.size(); ++i)
      if (!held[i])
        state[i] += i < points ? (dt * velocity[i]).eval() : (w * (state[i] - before[i])).eval();
    if (pushes != nullptr) go_clear(last, state, *pushes, false);
    if (carry) {
      const State free = state;
      carry(report.time_s, state);
      if (pushes != nullptr) go_clear(free, state, *pushes, true);
    }
    bodies.table_z_m = table_z_m(report.time_s);
    const DescentReport found = descend(cloth, state, held, stiffness, bodies, descent, pushes);
    report.steps += found.steps;
    report.hurried += found.at_rest ? 0 : 1;
    before = last;
    velocity_before = velocity;
    double kinetic_j = 0, fastest = 0;
    for (std::size_t i = 0; i < points; ++i) {
      velocity[i] = (state[i] - from[i]) / h;
      fastest = std::max(fastest, velocity[i].norm());
      kinetic_j += cloth.mass_kg()[i] / 2 * velocity[i].squaredNorm();
    }
    if (!std::isfinite(kinetic_j)) break;
    quiet_s = kinetic_j <= weight_n * options.quiet_m ? quiet_s + dt : 0;
    report.quiet = quiet_s >= options.quiet_s && report.time_s >= least_s;
    if (report.quiet) break;
    last_dt = dt;
    // At most doubled, for which the differences are stable.
    if (2 * dt <= longest_s && 2 * dt * fastest <= farthest_m) dt *= 2;
    while (dt > options.step_s && dt * fastest > farthest_m) dt /= 2;
  }
  return report;
}

}  // namespace drape::simulate
