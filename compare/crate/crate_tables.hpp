// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compare/store/store.hpp"

namespace drape::compare {

/// One of a crate's files of numbers.
struct CrateTable {
  std::string file, description;
  Table table;
};

/// The numbers of one run, or of the whole store, unrounded: columns are called as the store's
/// dictionary of metrics calls them.
[[nodiscard]] std::vector<CrateTable> crate_tables(const StoreReader& store,
                                                   std::optional<int> run);

/// The mean distance that speaks for each drape of a run, with what may be said of it.
struct CrateHeadline {
  std::string scene, mean_mm, statement;
};
[[nodiscard]] std::vector<CrateHeadline> crate_headlines(const StoreReader& store, int run);

}  // namespace drape::compare
