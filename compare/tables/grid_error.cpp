// SPDX-License-Identifier: Apache-2.0
#include "compare/tables/grid_error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "core/statistics/convergence.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixX3d;
using units::mm;

constexpr double kModelOrder = 2;

}  // namespace

const RealVirtual& headline_of(const Report& report) {
  return report.real_virtual[*report.headline];
}

const RealVirtual* fall_of(const DrapeInput& input, const Report& report) {
  const RealVirtual& headline = headline_of(report);
  const auto& refined = input.simulations[headline.simulation].refined;
  if (!refined) return &headline;
  for (const RealVirtual& row : report.real_virtual)
    if (input.simulations[row.simulation].sheet.sha256 == refined->rest_sha256) return &row;
  return nullptr;
}

const RealVirtual* neighbour_of(const DrapeInput& input, const Report& report, bool other_grid,
                                int below) {
  const RealVirtual* fall = fall_of(input, report);
  if (fall == nullptr) return nullptr;
  const Simulation& chosen = input.simulations[fall->simulation];
  const RealVirtual* best = nullptr;
  for (const RealVirtual& row : report.real_virtual) {
    const Simulation& other = input.simulations[row.simulation];
    if (other.other_simulator || other.branch || other.refined || other.setup() != chosen.setup() ||
        other.sheet.sheet.rows >= below)
      continue;
    const bool same_grid = other.sheet.sheet.rows == chosen.sheet.sheet.rows;
    const bool same_segments = other.source().segments == chosen.source().segments;
    if (other_grid ? same_grid || !same_segments : !same_grid || same_segments) continue;
    const auto& known = best == nullptr ? row : *best;
    const bool finer =
        other.sheet.sheet.rows >= input.simulations[known.simulation].sheet.sheet.rows;
    if (finer) best = &row;
  }
  return best;
}

std::optional<MatrixX3d> places_on(const RealVirtual& other, const RealVirtual& headline) {
  MatrixX3d places(headline.marks.marks.size(), 3);
  std::map<MarkId, Eigen::Vector3d> known;
  for (const MarkError& mark : other.marks.marks) known[mark.mark] = mark.virtual_in_world;
  for (std::size_t k = 0; k < headline.marks.marks.size(); ++k) {
    const auto found = known.find(headline.marks.marks[k].mark);
    if (found == known.end()) return std::nullopt;
    places.row(static_cast<Index>(k)) = found->second;
  }
  return places;
}

std::optional<GridError> grid_error_of(const DrapeInput& input, const Report& report) {
  if (!report.headline) return std::nullopt;
  const RealVirtual& headline = headline_of(report);
  const Simulation& own = input.simulations[headline.simulation];
  if (own.refined) {
    if (!own.refined->left_m) return std::nullopt;
    GridError error;
    error.order = own.refined->order;
    error.left_m = own.refined->left_m;
    error.refined = own.refined->sentence;
    return error;
  }
  const RealVirtual* other = neighbour_of(input, report, true);
  const auto places = other != nullptr ? places_on(*other, headline) : std::nullopt;
  if (!places) return std::nullopt;
  const Simulation& coarse = input.simulations[other->simulation];
  GridError error;
  error.coarser = coarse.run_label();
  error.apart_m = (*places - *places_on(headline, headline)).rowwise().norm().mean();
  if (input.placed) error.reach_m = input.placed->reach_m;
  const RealVirtual* last =
      neighbour_of(input, report, true, input.simulations[other->simulation].sheet.sheet.rows);
  const auto last_places = last != nullptr ? places_on(*last, headline) : std::nullopt;
  if (!last_places) return error;
  const MatrixX3d fine_m = *places - *places_on(headline, headline);
  const MatrixX3d rough_m = *last_places - *places;
  error.coarsest = input.simulations[last->simulation].run_label();
  error.below_m = rough_m.rowwise().norm().mean();
  if (!error.reach_m || std::max(error.apart_m, error.below_m) > *error.reach_m) return error;
  const auto spacing_of = [&](const RealVirtual& row) {
    return 1.0 / (input.simulations[row.simulation].sheet.sheet.rows - 1);
  };
  const std::array<double, 3> spacing{spacing_of(headline), spacing_of(*other), spacing_of(*last)};
  error.order = order_of(spacing, (fine_m.array() * rough_m.array()).sum() / fine_m.squaredNorm());
  if (!error.order) return error;
  const double order = std::min(*error.order, kModelOrder);
  error.left_m = error.apart_m / (std::pow(spacing[1] / spacing[0], order) - 1);
  return error;
}

std::string grid_sentence(const GridError& error) {
  if (!error.refined.empty()) return error.refined;
  const std::string text =
      fmt::format("the marks lie {:.3f} mm from those of {}", error.apart_m / mm, error.coarser);
  if (error.left_m)
    return fmt::format(
        "{:.3f} mm may be left to a grid without end: {}, on one branch, and with {} the error "
        "falls by order {:.1f}{}",
        *error.left_m / mm, text, error.coarsest, *error.order,
        *error.order > kModelOrder ? ", of which the model's 2 is relied on" : "");
  if (!error.reach_m) return text + "; without an ensemble nothing says whether on one branch";
  if (error.apart_m > *error.reach_m)
    return text + fmt::format(
                      ", farther than members of one branch ({:.3f} mm): other folds, which "
                      "no extrapolation bounds",
                      *error.reach_m / mm);
  if (error.coarsest.empty())
    return text + ", on one branch; two grids do not show how the error falls";
  if (error.below_m > *error.reach_m)
    return text + fmt::format(
                      ", on one branch; {} has other folds, {:.3f} mm away, so that nothing shows "
                      "how the error falls",
                      error.coarsest, error.below_m / mm);
  return text + fmt::format(
                    ", on one branch; with {}, {:.3f} mm away, the error does not fall by an order "
                    "of {:g} to {:g}, so that nothing is extrapolated",
                    error.coarsest, error.below_m / mm, kLeastOrder, kMostOrder);
}

}  // namespace drape::compare
