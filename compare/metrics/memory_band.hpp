// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/marks.hpp"

namespace drape::compare {

/// A rest of the ensemble's own drape after another past.
struct MemoryEnd {
  std::string what;
  std::string ending;                       ///< "at rest", or why it counts for nothing
  std::optional<Eigen::MatrixX3d> moves_m;  ///< from the rest, one row a mark; absent: no count
};

/// What internal friction lets the drape of the scene's own start be, as far as other pasts show.
struct MemoryBand {
  std::vector<MarkId> marks;
  std::vector<MemoryEnd> ends;
  std::optional<double> place_of_rest;  ///< 0 lowest, 1 highest

  /// The end that lies lowest and the one that lies highest on average, the rest itself among them.
  [[nodiscard]] Eigen::MatrixX3d lowest_m() const { return extreme_m(-1); }
  [[nodiscard]] Eigen::MatrixX3d highest_m() const { return extreme_m(1); }

 private:
  [[nodiscard]] Eigen::MatrixX3d extreme_m(double sign) const;
};

/// The band in a list (branches.json) with these bytes; nothing when the file is another one by now
/// or has none. Throws Error(bad_input) for a list that cannot be read.
[[nodiscard]] std::optional<MemoryBand> read_memory_band(const std::filesystem::path& list,
                                                         const std::string& sha256);

/// For people, without a full stop.
[[nodiscard]] std::string memory_sentence(const MemoryBand& band);

}  // namespace drape::compare
