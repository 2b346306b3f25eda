// SPDX-License-Identifier: Apache-2.0
#include "simulate/drape/drape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/units.hpp"
#include "simulate/start/history.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;

// See mesh_error_m().
constexpr double kSafety = 1.25, kSafetyUnseen = 3, kOrder = 2, kOrderSpread = 0.2;
constexpr double kLeastShrunk = 2, kMostShrunk = 4, kMostShrunkHeld = 3;
constexpr double kCoarseResidual = 1e-2;  // in mean weights of a point

/// Builds up a drape level by level.
class Levels {
 public:
  Levels(const DrapeCase& drape, const DrapeOptions& options, const StartVariation& variation,
         const DrapeProgress& progress, const DrapeStart& start)
      : case_(drape),
        options_(options),
        variation_(variation),
        progress_(progress),
        start_(start),
        spacings_(level_spacings_m(options)) {
    for (int row = 0; row < drape.print.rows; ++row)
      for (int col = 0; col < drape.print.cols; ++col) marks_.push_back({row, col});
  }

  [[nodiscard]] Drape from_start() {
    Drape drape = fallen(0);
    if (options_.thickness_m > 0 && drape.level->meets_itself(drape.rest))
      drape = fallen(options_.thickness_m);
    while (drape.at_rest() && drape.levels.size() < spacings_.size()) {
      refine(drape);
      // A finer cloth may fold where a coarser one did not.
      if (drape.rest.layers_apart_m == 0 && options_.thickness_m > 0 &&
          drape.level->meets_itself(drape.rest))
        drape = fallen(options_.thickness_m);
    }
    finish(drape);
    return drape;
  }

  [[nodiscard]] Drape from_rest(std::shared_ptr<DrapeLevel> coarse, const ClothMoment& rest) {
    Drape drape;
    RestReport known;
    known.at_rest = true;
    add(drape, std::move(coarse), rest, known);
    std::erase_if(spacings_, [&](double s) { return !(s < drape.level->spacing_m()); });
    spacings_.insert(spacings_.begin(), drape.level->spacing_m());
    while (drape.at_rest() && drape.levels.size() < spacings_.size()) refine(drape);
    finish(drape);
    return drape;
  }

 private:
  /// Makes a mesh; before a finer one, its residual need only be small against its mesh error.
  [[nodiscard]] std::shared_ptr<DrapeLevel> level_of(std::size_t index) const {
    DrapeOptions options = options_;
    if (index + 1 < spacings_.size())
      options.descent.residual = std::max(options.descent.residual, kCoarseResidual);
    return std::make_shared<DrapeLevel>(case_, options, spacings_[index]);
  }

  /// Drapes from the start to rest on the coarsest mesh, after the cloth's earlier history.
  Drape fallen(double layers_apart_m) {
    auto level = level_of(0);
    const ClothMoment start = start_ ? start_(*level) : level->start(variation_);
    const auto drape_with = [&](const ClothMemory& memory) {
      ClothMoment moment = start;
      moment.memory = memory;
      moment.layers_apart_m = layers_apart_m;
      RestReport report = level->fall(moment, variation_);
      return std::pair(std::move(moment), std::move(report));
    };
    Drape drape;
    drape.warnings = warnings_of_clamps(case_.lines);
    if (case_.shape)
      drape.warnings.insert(drape.warnings.end(), case_.shape->warnings.begin(),
                            case_.shape->warnings.end());
    ClothMemory memory = start.memory;
    std::vector<PastEvent> history;
    if (case_.laws.friction) history = history_of(case_.local.scene);
    if (!history.empty()) {
      int number = 0;
      std::optional<std::pair<ClothMoment, RestReport>> failed;
      const auto after = memory_after(history, *case_.laws.friction, memory,
                                      [&](const ClothMemory& so_far) -> std::optional<ClothMemory> {
                                        ++number;
                                        auto once = drape_with(so_far);
                                        if (once.second.at_rest) return once.first.memory;
                                        failed = std::move(once);
                                        return std::nullopt;
                                      });
      if (!after) {
        drape.warnings.push_back(not_at_rest_before(number));
        add(drape, level, failed->first, failed->second);
        return drape;
      }
      memory = *after;
    }
    auto [moment, report] = drape_with(memory);
    shake(*level, shakes_of(history), moment, report);
    add(drape, level, moment, report);
    return drape;
  }

  /// Varies gravity up and down at rest, ending at its normal value.
  void shake(DrapeLevel& level, const PastEvent& shakes, ClothMoment& moment,
             RestReport& report) const {
    std::vector<double> loads;
    for (int k = 0; k < shakes.times; ++k)
      loads.insert(loads.end(), {1 + shakes.part, 1 - shakes.part});
    if (shakes.times > 0) loads.push_back(1);
    const Eigen::Vector3d gravity = case_.local.scene.gravity_m_per_s2;
    for (const double load : loads) {
      if (!report.at_rest) break;
      level.set_gravity(load * gravity);
      const TimeStepsReport motion = report.motion;
      const int steps = report.steps;
      report = level.rest(moment);
      report.motion = motion;
      report.steps += steps;
    }
    level.set_gravity(gravity);
  }

  void refine(Drape& drape) const {
    auto level = level_of(drape.levels.size());
    ClothMoment moment = level->carried(*drape.level, drape.rest);
    RestReport report = level->rest(moment);
    add(drape, std::move(level), std::move(moment), std::move(report));
  }

  void add(Drape& drape, std::shared_ptr<DrapeLevel> level, ClothMoment moment,
           RestReport report) const {
    std::vector<Vector2d> material;
    for (const MarkId& mark : marks_) material.push_back(case_.print.material_m(mark));
    LevelReport own{level->spacing_m(), level->cloth().points(), std::move(report), {}};
    Eigen::MatrixX3d marks = level->places(moment, material);
    if (!drape.marks_of_level.empty()) {
      double sum = 0;
      int count = 0;
      const auto& coarser = drape.marks_of_level.back();
      for (Eigen::Index i = 0; i < marks.rows(); ++i) {
        const double moved = (marks.row(i) - coarser.row(i)).norm();
        if (std::isnan(moved)) continue;
        sum += moved;
        ++count;
      }
      if (count > 0) own.moved_m = sum / count;
    }
    drape.levels.push_back(std::move(own));
    drape.marks_of_level.push_back(std::move(marks));
    drape.level = std::move(level);
    drape.rest = std::move(moment);
    if (progress_)
      progress_(std::min(
          1.0, static_cast<double>(drape.levels.size()) / static_cast<double>(spacings_.size())));
  }

  /// Drops marks that are not on the cloth, and estimates the error of the last mesh.
  void finish(Drape& drape) const {
    std::vector<Eigen::Index> on;
    for (Eigen::Index i = 0; i < std::ssize(marks_); ++i) {
      if (drape.marks_of_level.back().row(i).hasNaN()) continue;
      on.push_back(i);
      drape.marks.push_back(marks_[i]);
    }
    for (Eigen::MatrixX3d& marks : drape.marks_of_level) marks = marks(on, Eigen::all).eval();
    if (drape.levels.size() < 2) return;
    drape.mesh_error_m = simulate::mesh_error_m(case_, drape.levels, drape.marks_of_level);
  }

  const DrapeCase& case_;
  const DrapeOptions& options_;
  const StartVariation& variation_;
  const DrapeProgress& progress_;
  const DrapeStart& start_;
  std::vector<double> spacings_;
  std::vector<MarkId> marks_;
};

/// Ratio of the moves of a mark from the first to the second of three meshes and from there to the
/// third, where its error is proportional to spacing^order.
double ratio_of_moves(const LevelReport* three, double order) {
  const auto error = [&](int k) { return std::pow(three[k].spacing_m, order); };
  return (error(0) - error(1)) / (error(1) - error(2));
}

}  // namespace

Eigen::VectorXd mesh_error_m(const DrapeCase& drape, const std::vector<LevelReport>& levels,
                             const std::vector<Eigen::MatrixX3d>& marks_of_level) {
  const double last = levels.back().moved_m.value_or(0);
  const bool pinned = !drape.pins_at.empty(), held = pinned || !drape.lines.empty();
  double shrunk = pinned ? kLeastShrunk : kMostShrunk, safety = kSafetyUnseen;
  if (levels.size() > 2 && last > 0) {
    const LevelReport* const three = &*(levels.end() - 3);
    const double seen = three[1].moved_m.value_or(0) / last;
    shrunk = std::clamp(seen, kLeastShrunk, pinned ? kMostShrunkHeld : kMostShrunk);
    if (!held && seen >= ratio_of_moves(three, kOrder - kOrderSpread) &&
        seen <= ratio_of_moves(three, kOrder + kOrderSpread))
      safety = kSafety;
  }
  const Eigen::VectorXd moved =
      (marks_of_level.back() - *(marks_of_level.end() - 2)).rowwise().norm();
  return safety / (shrunk - 1) * moved.cwiseMax(last / 2);
}

Drape drape_cloth(const DrapeCase& drape, const DrapeOptions& options,
                  const StartVariation& variation, const DrapeProgress& progress,
                  const DrapeStart& start) {
  return Levels(drape, options, variation, progress, start).from_start();
}

Drape polished(const DrapeCase& drape, const DrapeOptions& options,
               std::shared_ptr<DrapeLevel> coarse, const ClothMoment& rest) {
  return Levels(drape, options, {}, {}, {}).from_rest(std::move(coarse), rest);
}

}  // namespace drape::simulate
