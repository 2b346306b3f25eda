// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "core/files/json_file.hpp"
#include "simulate/ensemble/branches.hpp"

namespace drape::simulate {

/// Where one mark of the print lies in 95 % of an ensemble's members.
struct MarkBand {
  MarkId mark;
  Eigen::Vector3d mean_in_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d low_m = Eigen::Vector3d::Zero();   ///< per axis, 2.5 % of the members below
  Eigen::Vector3d high_m = Eigen::Vector3d::Zero();  ///< per axis, 2.5 % above
  double radius95_m = 0;  ///< 95 % of the members lie within, about the mean
};

/// Fewer members say nothing of 95 %.
inline constexpr std::size_t kLeastMembers = 20;

/// A sheet's grid, and its particles as a field; a gap is not a number.
[[nodiscard]] GridSpec grid_of(const Sheet& sheet);
[[nodiscard]] Field field_of(const Sheet& sheet);

[[nodiscard]] std::size_t members_at_rest(const Branches& branches);

/// Means of all members at rest; empty with fewer than kLeastMembers.
[[nodiscard]] std::vector<MarkBand> band_of(const Branches& branches, const GridSpec& grid,
                                            const Print& print);

/// Which branch a real drape is on.
struct Assignment {
  std::size_t nearest = 0;     ///< index into Branches::found
  double distance_m = 0;       ///< mean over the marks, to that branch's nearest member
  double reach_m = 0;          ///< up to which a drape is on that branch
  std::size_t marks = 0;       ///< compared
  double inside_fraction = 0;  ///< share of the marks within radius95_m of the band's mean
  [[nodiscard]] bool is_on() const { return distance_m <= reach_m; }
};

/// A drape is on its nearest branch when it is no farther from one of its members than members are
/// linked by (Branches::linked_m). Nothing without branches or marks.
[[nodiscard]] std::optional<Assignment> assign(const Sheet& measured, const Branches& branches,
                                               const GridSpec& grid,
                                               const std::vector<MarkBand>& band);

/// Mean distance over the marks of `measured` from `sheet`; nothing when it cannot be said.
[[nodiscard]] std::optional<double> distance_at_marks_m(const Sheet& measured, const Sheet& sheet);

/// Rest of the same scene when it starts at the measured shape: the distance that is left
/// is the model's and the fabric's, without the luck of folds.
struct FromMeasured {
  std::string sentence;              ///< "at rest", or why not
  std::optional<double> distance_m;  ///< mean over the marks; absent: it did not rest
};
[[nodiscard]] FromMeasured start_from_measured(const Scene& scene, const Fabric& fabric,
                                               const Print& print, const Sheet& measured,
                                               const SimulateOptions& options);

/// Adds `band` and `measured` to what branches_json() wrote.
void add_band(const std::vector<MarkBand>& band, std::size_t members, Json& json);
void add_measured(const std::optional<Assignment>& assignment, const FromMeasured& from_measured,
                  Json& json);

}  // namespace drape::simulate
