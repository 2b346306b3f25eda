// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compare/store/inputs.hpp"
#include "compare/store/outcome.hpp"
#include "compare/store/store.hpp"

namespace drape::compare {

/// One value behind a run, as in its file.
struct RunValue {
  std::string owner;  ///< "scene A", "fabric A", "calibration", "simulations"
  std::string key;    ///< "friction", "object.1.x_mm"
  std::string value;
  bool stand_in = false;  ///< true if the file states that it was not measured
};

/// True if an entry of `stand_ins` refers to the value with this key in its file. The hysteresis of
/// a curve is not the curve, and the bending stiffness at 45 degrees is not the bending curves.
[[nodiscard]] bool stands_in_for(const std::string& what, const std::string& key);

/// Values of the scenes and fabrics of a session, of its calibration and simulations, sorted.
/// Hysteresis that is a stand-in has its own row, since it has no key in the file.
[[nodiscard]] std::vector<RunValue> values_of(const Session& session, const Outcome& outcome);

/// Adds the run as one row with its drapes, comparisons and values, in one transaction. A run with
/// the same content (except the date) and no further warning is the same run; it only adds the
/// date at which it became current for its photographs again, if another run was stored in
/// between.
struct StoredRun {
  int number = 0;
  std::string date;
};
StoredRun add_run(Store& store, const Session& session, const Outcome& outcome,
                  const RunLabel& label, const std::string& date);

/// Key of the row that records when a run was stored again, after `before` others.
[[nodiscard]] std::string repetition_key(const std::string& run_sha256, const std::string& date,
                                         int before);

/// The only clock time in the store: now, or SOURCE_DATE_EPOCH if set in the environment. Throws
/// Error(usage) if that is not a valid time.
[[nodiscard]] std::string date_of_run();

}  // namespace drape::compare
