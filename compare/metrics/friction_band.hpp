// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/marks.hpp"

namespace drape::compare {

/// One push of a drape at rest, which grew and went again.
struct FrictionPush {
  Eigen::Vector3d push_per_weight = Eigen::Vector3d::Zero();
  std::string ending;                       ///< "at rest", or why it counts for nothing
  std::optional<Eigen::MatrixX3d> moves_m;  ///< that it left, one row a mark; absent: no count
};

/// What friction lets the drape of the scene's own start be, as far as pushes show: its rest and
/// what they left.
struct FrictionBand {
  double friction = 0;
  std::vector<FrictionPush> pushes;
  std::vector<MarkId> marks;
  Eigen::MatrixX3d low_in_world, high_in_world;  ///< per mark, over all rests

  [[nodiscard]] int counted() const;
  /// Farthest that a push left each mark from its rest.
  [[nodiscard]] std::vector<double> reach_m() const;
};

/// The band in a list (branches.json) with these bytes; nothing when the file is another one by now
/// or has none. Throws Error(bad_input) for a list that cannot be read.
[[nodiscard]] std::optional<FrictionBand> read_friction_band(const std::filesystem::path& list,
                                                             const std::string& sha256);

/// For people, without a full stop.
[[nodiscard]] std::string friction_sentence(const FrictionBand& band);

}  // namespace drape::compare
