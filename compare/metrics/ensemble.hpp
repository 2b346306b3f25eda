// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/marks.hpp"

namespace drape::compare {

/// Where one mark lies in 95 % of an ensemble's drapes.
struct BandMark {
  MarkId mark;
  Eigen::Vector3d mean_in_world = Eigen::Vector3d::Zero();
  double radius95_m = 0;  ///< about the mean
};

/// What drape-simulate branches says of an ensemble as a whole and of the real drape in it.
struct Ensemble {
  int members = 0;                        ///< starts that came to rest
  std::vector<BandMark> band;             ///< empty: too few members
  std::optional<int> nearest;             ///< branch nearest to the real drape
  std::optional<int> on;                  ///< absent: the real drape is on none
  std::optional<double> distance_m;       ///< mean over the marks, to the nearest member
  std::optional<double> reach_m;          ///< up to which a drape is on a branch
  std::optional<double> inside_fraction;  ///< of the marks, in their bands
  std::string started_there;              ///< how a start from the real shape ends
  std::optional<double> started_there_m;  ///< mean distance that it leaves

  [[nodiscard]] double median_radius95_m() const;
  [[nodiscard]] double largest_radius95_m() const;
};

/// The ensemble of a list (branches.json) with these bytes; nothing when the file is another one by
/// now, or has no ensemble. Throws Error(bad_input) for a list that cannot be read.
[[nodiscard]] std::optional<Ensemble> read_ensemble(const std::filesystem::path& list,
                                                    const std::string& sha256);

/// For people: how many drapes, how far apart, and where the real one is among them.
[[nodiscard]] std::string ensemble_sentence(const Ensemble& ensemble);

}  // namespace drape::compare
