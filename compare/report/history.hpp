// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "compare/history/results.hpp"

namespace drape::compare {

/// The whole store on one self-contained page: calibration residuals and distances of each drape
/// over the imports, with alarms, and every comparison. Equal stores give equal bytes. NO-GO for an
/// alarm or if a current comparison is NO-GO.
struct HistoryPage {
  std::string html;
  bool go = true;
};
[[nodiscard]] HistoryPage history_page(const StoreReader& store, const TrendOptions& options);

}  // namespace drape::compare
