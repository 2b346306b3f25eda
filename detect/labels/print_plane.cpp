// SPDX-License-Identifier: Apache-2.0
#include "detect/labels/labels.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/geometry/vectors.hpp"

namespace drape::detect {

Eigen::Vector2d PrintPlane::point_m(MarkId mark) const {
  return first_m + pitch_m * Eigen::Vector2d(mark.col, mark.row);
}

bool PrintPlane::contains(MarkId mark) const {
  return mark.row >= 0 && mark.row < rows && mark.col >= 0 && mark.col < cols &&
         (!staggered || (mark.row + mark.col) % 2 == 0);
}

std::array<Eigen::Vector2d, 4> PrintPlane::tag_corners_m(int id) const {
  const Eigen::Vector2d centre = tags.at(id);
  const double right = tag_edge_m / 2;
  const double down = row_sign * tag_edge_m / 2;
  return {centre + Eigen::Vector2d(-right, -down), centre + Eigen::Vector2d(right, -down),
          centre + Eigen::Vector2d(right, down), centre + Eigen::Vector2d(-right, down)};
}

std::vector<MarkId> PrintPlane::marks_around(int id) const {
  const Eigen::Vector2d in_pitches = (tags.at(id) - first_m) / pitch_m;
  const int row = static_cast<int>(std::floor(in_pitches.y()));
  const int col = static_cast<int>(std::floor(in_pitches.x()));
  std::vector<MarkId> marks;
  for (const MarkId mark :
       {MarkId{row, col}, MarkId{row, col + 1}, MarkId{row + 1, col}, MarkId{row + 1, col + 1}}) {
    const Eigen::Vector2d away = (point_m(mark) - tags.at(id)) / pitch_m;
    if (contains(mark) && away.cwiseAbs().maxCoeff() <= 0.75) marks.push_back(mark);
  }
  return marks;
}

bool PrintPlane::has_tag_in_cell(MarkId upper_left) const {
  for (const auto& [id, centre] : tags) {
    const Eigen::Vector2d in_cell = (centre - point_m(upper_left)) / pitch_m;
    if (in_cell.minCoeff() > 0 && in_cell.maxCoeff() < 1) return true;
  }
  return false;
}

double PrintPlane::light_centre_fraction() const {
  return classes ? 0.5 * classes->light_centre_diameter_m / dot_radius_m : 0.0;
}

namespace {

/// Copies the values that cloth and target have in common.
template <class Sheet>
PrintPlane common_plane(const Sheet& sheet) {
  return {.rows = sheet.rows,
          .cols = sheet.cols,
          .pitch_m = sheet.pitch_m,
          .dot_radius_m = sheet.dot_diameter_m / 2,
          .tag_family = sheet.tag_family,
          .tag_edge_m = sheet.tag_edge_m};
}

/// Largest stretch of a vector by a matrix.
double largest_stretch(const Eigen::Matrix2d& m) {
  const double half = 0.5 * m.squaredNorm(), det = m.determinant();
  return std::sqrt(half + std::sqrt(std::max(0.0, half * half - det * det)));
}

constexpr double clear_lead = 0.55;  // largest ratio of best to second-best error
constexpr double rival_error = most_step_error / clear_lead;

}  // namespace

PrintPlane plane_of(const Target& target) {
  PrintPlane plane = common_plane(target);
  plane.first_m = target.point_in_target({0, 0}).head<2>();
  plane.row_sign = -1;
  plane.stiff = true;
  plane.white_dots = target.dot_colour == DotColour::white;
  plane.staggered = target.arrangement == DotArrangement::staggered;
  if (!target.hollow.empty()) {
    const std::vector<std::string> full(target.rows, std::string(target.cols, '#'));
    plane.classes = DotClasses{target.hollow_diameter_m, full};
    for (const MarkId mark : target.hollow) plane.classes->rows[mark.row][mark.col] = 'o';
  }
  for (const PrintedTag& tag : target.tags) plane.tags[tag.id] = tag.centre_m;
  return plane;
}

PrintPlane plane_of(const Print& print) {
  PrintPlane plane = common_plane(print);
  plane.first_m = print.margin_m.reverse();
  plane.classes = print.dot_classes;
  for (const PrintedTag& tag : print.tags) plane.tags[tag.id] = tag.centre_m.reverse();
  return plane;
}

std::optional<LocalMap> map_at_centre(const std::array<Eigen::Vector2d, 4>& print_m,
                                      const Eigen::Matrix<double, 2, 4>& corners_px,
                                      const Eigen::Vector2d& centre_m) {
  std::vector<Eigen::Vector2d> from, to;
  for (int k = 0; k < 4; ++k) {
    from.push_back(print_m[k]);
    to.emplace_back(corners_px.col(k));
  }
  const auto map = homography(from, to);
  if (!map) return std::nullopt;
  const LocalMap here{mapped(*map, centre_m), derivative_at(*map, centre_m)};
  if (!here.centre_px.allFinite() || !here.px_per_m.allFinite()) return std::nullopt;
  return here;
}

Eigen::Matrix2d symmetric_root(const Eigen::Matrix2d& square) {
  // Cayley-Hamilton: root = (A + sqrt(det A) I) / sqrt(tr A + 2 sqrt(det A)).
  const double det = std::sqrt(std::max(0.0, square.determinant()));
  const double trace = std::sqrt(std::max(1e-300, square.trace() + 2 * det));
  return (square + det * Eigen::Matrix2d::Identity()) / trace;
}

Eigen::Matrix2d turned_root(const Eigen::Matrix2d& root_px_per_m,
                            const Eigen::Matrix2d& neighbour_px_per_m) {
  // J = root * R * D: D mirrors if the print's frame appears left-handed; |J - J_neighbour| is
  // least where trace(A^T root R) is largest, A = J_neighbour D.
  Eigen::Matrix2d mirror = Eigen::Matrix2d::Identity();
  if (neighbour_px_per_m.determinant() < 0) mirror(1, 1) = -1;
  const Eigen::Matrix2d b = (neighbour_px_per_m * mirror).transpose() * root_px_per_m;
  const double sine = b(0, 1) - b(1, 0), cosine = b(0, 0) + b(1, 1);
  const double length = std::sqrt(sine * sine + cosine * cosine);
  if (length <= 0) return root_px_per_m * mirror;
  Eigen::Matrix2d rotation;
  rotation << cosine, -sine, sine, cosine;
  return root_px_per_m * (rotation / length) * mirror;
}

double step_error(const LocalMap& from, const LocalMap& to, const Eigen::Vector2d& step_m) {
  const Eigen::Vector2d predicted = 0.5 * (from.px_per_m + to.px_per_m) * step_m;
  const Eigen::Vector2d miss = to.centre_px - from.centre_px - predicted;
  // Reach of one step in any direction of the print, plus two pixels for grazing views.
  const Eigen::Matrix2d unit =
      0.5 * step_m.squaredNorm() *
          (from.px_per_m * from.px_per_m.transpose() + to.px_per_m * to.px_per_m.transpose()) +
      4.0 * Eigen::Matrix2d::Identity();
  return std::sqrt(miss.dot(unit.inverse() * miss));
}

DotCells::DotCells(const std::vector<UnlabelledDot>& dots) : dots_(dots), cells_(1) {
  if (dots.empty()) return;
  Eigen::Array2d last_px = first_px_ = dots.front().centre_px;
  for (const UnlabelledDot& dot : dots) {
    first_px_ = first_px_.min(dot.centre_px.array());
    last_px = last_px.max(dot.centre_px.array());
  }
  const Eigen::Array2d extent_px = last_px - first_px_ + 1;
  side_px_ = std::max(1.0, std::sqrt(extent_px.prod() / static_cast<double>(dots.size())));
  size_ = (extent_px / side_px_).cast<int>() + 1;
  cells_.resize(static_cast<std::size_t>(size_.prod()));
  for (std::size_t k = 0; k < dots.size(); ++k) {
    const Eigen::Array2i cell = cell_of(dots[k].centre_px);
    cells_[static_cast<std::size_t>(cell.y()) * size_.x() + cell.x()].push_back(k);
  }
}

Eigen::Array2i DotCells::cell_of(const Eigen::Array2d& px) const {
  return ((px - first_px_) / side_px_).floor().max(0).min((size_ - 1).cast<double>()).cast<int>();
}

std::vector<std::size_t> DotCells::within(const Eigen::Vector2d& px, double reach_px) const {
  std::vector<std::size_t> found;
  const Eigen::Array2i from = cell_of(px.array() - reach_px), to = cell_of(px.array() + reach_px);
  for (int y = from.y(); y <= to.y(); ++y) {
    for (int x = from.x(); x <= to.x(); ++x) {
      for (const std::size_t k : cells_[static_cast<std::size_t>(y) * size_.x() + x]) {
        ++looked_at_;
        if ((dots_[k].centre_px - px).squaredNorm() <= reach_px * reach_px) found.push_back(k);
      }
    }
  }
  std::ranges::sort(found);
  return found;
}

bool BestStep::is_clear() const {
  return error <= most_step_error && error <= clear_lead * second;
}

DotSteps::DotSteps(const std::vector<UnlabelledDot>& dots, double dot_radius_m)
    : dots_(dots), cells_(dots) {
  for (const UnlabelledDot& dot : dots) {
    roots_.emplace_back(symmetric_root(dot.shape_px2) / dot_radius_m);
    sizes_.push_back(largest_stretch(roots_.back()));
    largest_ = std::max(largest_, sizes_.back());
  }
}

BestStep DotSteps::best(const LocalMap& from, const Eigen::Vector2d& step_m,
                        const std::vector<char>& taken) const {
  BestStep best;
  const double step = step_m.norm(), size = largest_stretch(from.px_per_m);
  const Eigen::Vector2d middle_px = from.centre_px + 0.5 * from.px_per_m * step_m;
  // Skips a dot so far from the end of the half step that it can be neither best nor second best:
  // its error is at least that distance minus the other half of the step.
  const auto reach = [&](double other) {
    return 0.5 * step * other +
           rival_error * std::sqrt(0.5 * step * step * (size * size + other * other) + 4);
  };
  for (const std::size_t k : cells_.within(middle_px, reach(largest_))) {
    if (taken[k] != 0 || (dots_[k].centre_px - middle_px).norm() > reach(sizes_[k])) continue;
    const LocalMap to = map_at(k, from);
    const double error = step_error(from, to, step_m);
    if (error < best.error) {
      best.second = best.error;
      best.error = error;
      best.dot = k;
      best.to = to;
    } else if (error < best.second) {
      best.second = error;
    }
  }
  return best;
}

}  // namespace drape::detect
