// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "compare/history/results.hpp"

namespace drape::compare {

/// The whole store on one page that fetches nothing: how the calibration residual and
/// the distances of each drape went over the imports, with alarms, and every comparison. The same
/// store gives the same bytes. NO-GO on an alarm, and where a current comparison is NO-GO.
struct HistoryPage {
  std::string html;
  bool go = true;
};
[[nodiscard]] HistoryPage history_page(const StoreReader& store, const TrendOptions& options);

}  // namespace drape::compare
