// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compare/store/inputs.hpp"
#include "compare/store/outcome.hpp"
#include "compare/store/store.hpp"

namespace drape::compare {

/// One value behind a run, as its file has it.
struct RunValue {
  std::string owner;  ///< "scene A", "fabric A", "calibration", "simulations"
  std::string key;    ///< "friction", "object.1.x_mm"
  std::string value;
  bool stand_in = false;  ///< the file says that nobody measured it
};

/// Does an entry of `stand_ins` speak of the value at this key of its file? The hysteresis of a
/// curve is not the curve, and the bending stiffness at 45 degrees is not the bending curves.
[[nodiscard]] bool stands_in_for(const std::string& what, const std::string& key);

/// Every value of the scenes and fabrics of a session, of its calibration and simulations, ordered.
/// Hysteresis that is a stand-in has a row of its own, for it has no key in the file.
[[nodiscard]] std::vector<RunValue> values_of(const Session& session, const Outcome& outcome);

/// Adds the run as one row with its drapes, comparisons and values, in one transaction: it is there
/// or not. A run with the same content (all but the date) and no further warning is the same
/// run; it adds nothing but the date at which it is the last word on its photographs again, where
/// another run was since.
struct StoredRun {
  int number = 0;
  std::string date;
};
StoredRun add_run(Store& store, const Session& session, const Outcome& outcome,
                  const RunLabel& label, const std::string& date);

/// Key of the row that says when a run was stored again, after `before` others.
[[nodiscard]] std::string repetition_key(const std::string& run_sha256, const std::string& date,
                                         int before);

/// The one clock time of the store: now, or SOURCE_DATE_EPOCH where the environment has it. Throws
/// Error(usage) where that is no such time.
[[nodiscard]] std::string date_of_run();

}  // namespace drape::compare
