// SPDX-License-Identifier: Apache-2.0
#include "simulate/cloth/cloth.hpp"

#include <algorithm>
#include <numeric>

#include "simulate/cloth/clamp.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

}  // namespace

Cloth::Cloth(const GridSpec& grid, ClothLaws laws, MassRule mass_rule, ClothModel model)
    : grid_(grid), laws_(std::move(laws)), model_(model) {
  const bool paper = model == ClothModel::paper;
  if (paper) {
    mass_rule = MassRule::paper;
    laws_.twist_n_m = 0;
  }
  const int n = grid.count();
  const double hu = grid.warp_spacing_m();
  const double hv = grid.weft_spacing_m();
  for (Line& line : lines_) {
    line.width.assign(n, 0.0);
    line.triple_width.assign(n, 0.0);
  }
  lines_[0].stride = grid.cols;
  lines_[0].spacing = hu;
  lines_[1].stride = 1;
  lines_[1].spacing = hv;
  cell_.assign(n, 0.0);
  area_.assign(n, 0.0);
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.cols; ++c) {
      const int i = grid.index(r, c);
      const bool last_row = r + 1 == grid.rows;
      const bool last_col = c + 1 == grid.cols;
      const double across_warp = c == 0 || last_col ? 0.5 * hv : hv;
      const double across_weft = r == 0 || last_row ? 0.5 * hu : hu;
      area_[i] = across_warp * across_weft;
      const double warp_width = paper ? hv : across_warp;
      const double weft_width = paper ? hu : across_weft;
      if (!last_row) lines_[0].width[i] = warp_width;
      if (!last_col) lines_[1].width[i] = weft_width;
      if (!last_row && r > 0) lines_[0].triple_width[i] = warp_width;
      if (!last_col && c > 0) lines_[1].triple_width[i] = weft_width;
      if (!last_row && !last_col) cell_[i] = 1.0;
    }
  }
  if (grid.round) cut_round();
  const double total = laws_.density_kg_per_m2 * grid.patch_m.prod();
  for (const double area : area_) {
    mass_.push_back(mass_rule == MassRule::area ? laws_.density_kg_per_m2 * area : total / n);
    if (mass_.back() > 0)
      heaviest_ratio_ = std::max(heaviest_ratio_, laws_.density_kg_per_m2 * area / mass_.back());
  }
  for (int d = 0; d < 2; ++d) {
    const int side = lines_[1 - d].stride;
    const double slant = std::pow(lines_[d].spacing / lines_[1 - d].spacing, 2);
    lines_[d].k_diag_part.assign(n, 0.0);
    for (int i = 0; i < n; ++i) {
      const double beside = cell_[i] + (i >= side ? cell_[i - side] : 0.0);
      if (lines_[d].width[i] > 0) lines_[d].k_diag_part[i] = slant / beside;
    }
  }
  prepare_work();
  if (!laws_.friction) return;
  for (int d = 0; d < 2; ++d)
    memory_.bending[d].assign(laws_.friction->bending[d].elements.size() * n, 0.0);
  memory_.shear.assign(laws_.friction->shear.elements.size() * n, 0.0);
}

/// Takes away what is no cloth: each cell holds a quarter of itself to each corner and half of
/// itself to each of its springs.
void Cloth::cut_round() {
  const double hu = lines_[0].spacing, hv = lines_[1].spacing;
  for (int r = 0; r < grid_.rows; ++r) {
    for (int c = 0; c < grid_.cols; ++c) {
      const int i = grid_.index(r, c);
      cell_[i] = grid_.has_cell(r, c) ? 1.0 : 0.0;
      area_[i] = 0.25 * grid_.cells_at(r, c) * hu * hv;
      lines_[0].width[i] = 0.5 * hv * (grid_.has_cell(r, c - 1) + grid_.has_cell(r, c));
      lines_[1].width[i] = 0.5 * hu * (grid_.has_cell(r - 1, c) + grid_.has_cell(r, c));
    }
  }
  for (Line& line : lines_) {
    for (int i = line.stride; i < grid_.count(); ++i)
      line.triple_width[i] = std::min(line.width[i - line.stride], line.width[i]);
  }
}

double Cloth::total_mass_kg() const {
  return std::accumulate(mass_.begin(), mass_.end(), 0.0);
}

InternalEnergies Cloth::energies(const Field& x) const {
  InternalEnergies sum;
  const int n = count();
  for (int d = 0; d < 2; ++d) {
    const Line& line = lines_[d];
    for (int i = 0; i + line.stride < n; ++i) {
      if (line.width[i] == 0) continue;
      const double strain = (at(x, i + line.stride) - at(x, i)).norm() / line.spacing - 1;
      sum.stretch_j += line.width[i] * line.spacing * laws_.tensile[d].energy(strain);
    }
    for (int i = line.stride; i + line.stride < n; ++i) {
      if (line.triple_width[i] == 0) continue;
      const Vector3d bend = at(x, i - line.stride) - 2 * at(x, i) + at(x, i + line.stride);
      const double curvature = bend.norm() / (line.spacing * line.spacing);
      sum.bending_j += line.triple_width[i] * line.spacing * laws_.bending[d].energy(curvature);
    }
  }
  for (const ClampedPlace& place : clamped_) {
    const ClampedBend bend(*this, place, x);
    sum.bending_j += bend.scale_m2 * laws_.bending[place.direction].energy(bend.curvature_per_m);
  }
  if (model_ == ClothModel::paper) {
    add_paper_energies(x, sum);
    return sum;
  }
  const double area = lines_[0].spacing * lines_[1].spacing;
  for (int i = 0; i + grid_.cols + 1 < n; ++i) {
    if (cell_[i] == 0) continue;
    sum.shear_j += area * laws_.shear.energy(std::abs(std::asin(shear_sine(x, i))));
    const Vector3d twist =
        at(x, i) - at(x, i + 1) - at(x, i + grid_.cols) + at(x, i + grid_.cols + 1);
    sum.twist_j += 0.5 * laws_.twist_n_m * twist.squaredNorm() / area;
  }
  if (laws_.friction) add_friction_energies(x, sum);
  return sum;
}

double Cloth::shear_sine(const Field& x, int i) const {
  const Vector3d x00 = at(x, i), x01 = at(x, i + 1);
  const Vector3d x10 = at(x, i + grid_.cols), x11 = at(x, i + grid_.cols + 1);
  const Vector3d warp = x10 - x00 + x11 - x01;
  const Vector3d weft = x01 - x00 + x11 - x10;
  return std::clamp(warp.dot(weft) / std::sqrt(warp.squaredNorm() * weft.squaredNorm()), -1.0, 1.0);
}

Cloth::Strains Cloth::strains(const Field& x) const {
  Strains found;
  double* least[2] = {&found.warp_least, &found.weft_least};
  double* most[2] = {&found.warp_most, &found.weft_most};
  const int n = count();
  for (int d = 0; d < 2; ++d) {
    const Line& line = lines_[d];
    for (int i = 0; i + line.stride < n; ++i) {
      if (line.width[i] == 0) continue;
      const double strain = (at(x, i + line.stride) - at(x, i)).norm() / line.spacing - 1;
      *least[d] = std::min(*least[d], strain);
      *most[d] = std::max(*most[d], strain);
    }
    for (int i = line.stride; i + line.stride < n; ++i) {
      if (line.triple_width[i] == 0) continue;
      const Vector3d bend = at(x, i - line.stride) - 2 * at(x, i) + at(x, i + line.stride);
      found.curvature_most_per_m =
          std::max(found.curvature_most_per_m, bend.norm() / (line.spacing * line.spacing));
    }
  }
  for (const ClampedPlace& place : clamped_)
    found.curvature_most_per_m =
        std::max(found.curvature_most_per_m, ClampedBend(*this, place, x).curvature_per_m);
  for (int i = 0; i + grid_.cols + 1 < n; ++i) {
    if (cell_[i] == 0) continue;
    found.shear_most_rad = std::max(found.shear_most_rad, std::abs(std::asin(shear_sine(x, i))));
  }
  return found;
}

double Cloth::stiffness_bound_per_s2(const Strains& s) const {
  const double hu = lines_[0].spacing;
  const double hv = lines_[1].spacing;
  const double warp = 4 * laws_.tensile[0].steepest_up_to(s.warp_most) / (hu * hu);
  const double weft = 4 * laws_.tensile[1].steepest_up_to(s.weft_most) / (hv * hv);
  // Warp and weft springs pull in different directions; their coupling grows with the shear.
  const double stretch = std::max(warp, weft) + std::sqrt(warp * weft) * std::sin(s.shear_most_rad);
  // Diagonals: Kdiag = f / sin a, and its change with the angle pulls along them as well.
  const double steeper =
      model_ == ClothModel::paper ? 2 / std::max(0.1, std::cos(s.shear_most_rad)) : 1.0;
  double shear =
      steeper * 4 * laws_.shear.steepest_up_to(s.shear_most_rad) * (1 / (hu * hu) + 1 / (hv * hv));
  // A half triple's second derivative is at most 8 w B / l^3, where the sheet leaves backwards.
  const double bends = clamped_.empty() ? 16 : 16 + 8;
  double bending =
      bends * (laws_.bending[0].steepest_up_to(s.curvature_most_per_m) / std::pow(hu, 4) +
               laws_.bending[1].steepest_up_to(s.curvature_most_per_m) / std::pow(hv, 4)) +
      16 * laws_.twist_n_m / (hu * hu * hv * hv);
  if (laws_.friction) {
    shear += 4 * laws_.friction->shear.stiffness() * (1 / (hu * hu) + 1 / (hv * hv));
    bending += 16 * (laws_.friction->bending[0].stiffness() / std::pow(hu, 4) +
                     laws_.friction->bending[1].stiffness() / std::pow(hv, 4));
  }
  return heaviest_ratio_ * (stretch + shear + bending) / laws_.density_kg_per_m2;
}

}  // namespace drape::simulate
