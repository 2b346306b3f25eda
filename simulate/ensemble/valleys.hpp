// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "simulate/cloth/cloth.hpp"
#include "simulate/equilibrium/run.hpp"

namespace drape::simulate {

/// Options of the search for valleys beside those of an ensemble.
struct ValleySearch {
  int kicks = 384;     ///< at most, on the coarsest and on the finest grid
  int together = 16;   ///< tries from the same rests, so that threads change nothing
  int kept = 24;       ///< lowest rests that are kicked, and in the end settled on the next grid
  int finished = 6;    ///< lowest rests of the finest grid that are kicked and returned
  int particles = 13;  ///< most per side of the coarsest grid
  /// Kicks in a row that give none of the lowest, after which a grid is done with.
  [[nodiscard]] int in_vain() const { return kicks / 3; }
};

/// The lowest rests that are found of a sheet that touches nothing but itself. On two pins it falls
/// from folded_starts(). Else its rests apart from its own surface are sought, beginning with
/// `rests` (of `grid`) and the scene's start: they are kicked on a coarse grid, see kicked() (basin
/// hopping, Wales and Doye 1997), settled on `grid`, through a grid between where it is far
/// finer, and kicked there. Seeded; the same at any number of threads.
[[nodiscard]] std::vector<StaticDrape> seek_valleys(const StaticCase& the_case,
                                                    const GridSpec& grid,
                                                    const StaticOptions& options,
                                                    const std::vector<const Field*>& rests,
                                                    const ValleySearch& how = {});

/// The vertical plane through all pins, if there is one: mirrored in it, a sheet that touches
/// nothing is as good a rest. Of the two, the one is reported whose parts far from the pins lie
/// towards the middle of the start, else towards x or y; so it is the same one on every grid.
class MirrorPlane {
 public:
  [[nodiscard]] static std::optional<MirrorPlane> of(const StaticCase& the_case);
  [[nodiscard]] bool is_reported(const GridSpec& grid, const Field& position) const;
  void mirror(Field& position) const;

 private:
  Eigen::Vector3d point_ = Eigen::Vector3d::Zero(), normal_ = Eigen::Vector3d::UnitX();
  Eigen::Vector2d pinned_m_ = Eigen::Vector2d::Zero();  ///< material middle of the pins
};

/// Starts of a sheet on two pins that is folded along the line through them, as a cloth over a
/// line: what lies on one side of it, on the other or on both hangs down, straight or with half a
/// wave between the pins. None where the pins give no line that parts the sheet.
[[nodiscard]] std::vector<StartChange> folded_starts(const StaticCase& the_case);

/// A start that differs from `rests`, of which there is at least one; `index` is that of a seeded
/// sequence. In turns: a round part of a rest moves across its own plane or is mirrored in it; or
/// what lies beyond a line across the sheet is taken from another rest, with a smooth border (cut
/// and splice, Deaven and Ho 1995): folds of one part hardly depend on those of another, so that
/// the lower ones of two rests come together.
[[nodiscard]] Field kicked(const GridSpec& grid, std::uint64_t index,
                           const std::vector<const Field*>& rests);

}  // namespace drape::simulate
