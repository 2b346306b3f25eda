// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "compare/metrics/friction_band.hpp"
#include "compare/report/band.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using Eigen::Vector2d;
using units::mm;

constexpr double kSide = 380;   // of a view
constexpr double kMargin = 24;  // round it
constexpr double kHead = 20;    // above it
constexpr const char* kInside = "#1b7f3b";
constexpr const char* kOutside = "#b3261e";

/// One of two views: which world axes go right and up.
struct Side {
  const char* title;
  int right, up;
};
constexpr std::array<Side, 2> kViews = {{{"from above", 0, 1}, {"from the side", 0, 2}}};

/// World millimetres to the picture, the same scale in both directions.
class Frame {
 public:
  Frame(const std::vector<BandMark>& band, const Side& view, double left) : view_(view) {
    Vector2d low(HUGE_VAL, HUGE_VAL), high = -low;
    for (const BandMark& one : band) {
      const Vector2d p = flat(one.mean_in_world);
      const Vector2d reach = Vector2d::Constant(one.radius95_m);
      low = low.cwiseMin(p - reach);
      high = high.cwiseMax(p + reach);
    }
    scale_ = (kSide - 2 * kMargin) / std::max((high - low).maxCoeff(), 1e-9);
    corner_ = low;
    origin_ = {left + kMargin, kHead + kSide - kMargin};
  }
  [[nodiscard]] Vector2d at(const Eigen::Vector3d& p) const {
    const Vector2d q = scale_ * (flat(p) - corner_);
    return {origin_.x() + q.x(), origin_.y() - q.y()};
  }
  [[nodiscard]] double size(double length_m) const { return scale_ * length_m; }

 private:
  [[nodiscard]] Vector2d flat(const Eigen::Vector3d& p) const {
    return {p[view_.right], p[view_.up]};
  }
  Side view_;
  double scale_ = 1;
  Vector2d corner_, origin_;
};

/// What friction leaves open, as a box about each mark.
void draw_friction(Svg& svg, const Frame& frame, const FrictionBand& band) {
  for (std::size_t k = 0; k < band.marks.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    const Vector2d low = frame.at(band.low_in_world.row(row).transpose()),
                   high = frame.at(band.high_in_world.row(row).transpose());
    svg.rectangle(
        low.x(), high.y(), high.x() - low.x(), low.y() - high.y(),
        "fill=\"none\" stroke=\"#b07a00\" stroke-width=\"0.7\"",
        fmt::format("row {}, col {}: left open by friction", band.marks[k].row, band.marks[k].col));
  }
}

void draw(Svg& svg, const Frame& frame, const Ensemble& ensemble, const Sheet& measured) {
  for (const BandMark& one : ensemble.band) {
    svg.circle(frame.at(one.mean_in_world), std::max(0.5, frame.size(one.radius95_m)),
               "fill=\"#4c78a8\" fill-opacity=\"0.18\" stroke=\"#4c78a8\" stroke-width=\"0.7\"",
               fmt::format("row {}, col {}: 95 % within {:.2f} mm", one.mark.row, one.mark.col,
                           one.radius95_m / mm));
  }
  for (const BandMark& one : ensemble.band) {
    const SheetMark* real = measured.find(one.mark);
    if (real == nullptr) continue;
    const double off_m = (real->point_in_world - one.mean_in_world).norm();
    svg.circle(frame.at(real->point_in_world), 2.2,
               fmt::format("fill=\"{}\"", off_m <= one.radius95_m ? kInside : kOutside),
               fmt::format("row {}, col {}: real mark {:.2f} mm from the mean", one.mark.row,
                           one.mark.col, off_m / mm));
  }
}

std::filesystem::path list_of(const DrapeInput& input, const BranchSet& set) {
  const Simulation& first = input.simulations[set.branches.front().as_placed.simulation];
  return first.sheet.file.parent_path() / ".." / "branches.json";
}

}  // namespace

std::optional<Ensemble> ensemble_of(const DrapeInput& input, const BranchSet& set) {
  return read_ensemble(list_of(input, set), set.sha256);
}

std::optional<Figure> band_figure(const std::string& drape, const DrapeInput& input,
                                  const BranchSet& set) {
  const auto ensemble = ensemble_of(input, set);
  if (!ensemble || ensemble->band.empty()) return std::nullopt;
  const std::optional<FrictionBand> friction = read_friction_band(list_of(input, set), set.sha256);
  Svg svg(2 * kSide, kSide + kHead, "Bands of the marks of drape " + drape);
  for (std::size_t k = 0; k < kViews.size(); ++k) {
    const double left = kSide * static_cast<double>(k);
    svg.text({left + kMargin, 14}, kViews[k].title, 12);
    const Frame frame(ensemble->band, kViews[k], left);
    draw(svg, frame, *ensemble, input.measured.sheet);
    if (friction) draw_friction(svg, frame, *friction);
  }
  return Figure{drape + "-band",
                "Where the ensemble's drapes have each mark: 95 % of them within the disc. Dots "
                "are the real marks, green in their band, red outside; boxes are "
                "what friction leaves open of the scene's own drape.",
                svg.finish()};
}

}  // namespace drape::compare
