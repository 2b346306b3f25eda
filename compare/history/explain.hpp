// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compare/store/store.hpp"

namespace drape::compare {

/// Which of the numbers that have the same name is meant.
struct WhyOptions {
  std::optional<MarkId> mark = {};  ///< of a comparison: a column of mark_error
  std::string camera = {};          ///< of a calibration
};

/// Where one number comes from: its value and definition, the rows it was computed from, and every
/// file behind it down to photographs and curves, through the run records beside each output. The
/// store's seal tells where the sheets lie. `key` is the start of the key of a comparison, of a
/// pair of simulations, of a sheet (drapemeter and uncertainty) or of a calibration (residuals),
/// `metric` one of its columns. Throws Error(usage) for a key or metric that does not exist.
struct Explanation {
  Table number;
  Table chain;
  bool complete = true;  ///< every file of the chain is there, unchanged and traced
};
[[nodiscard]] Explanation explain(const StoreReader& store, const std::string& key,
                                  const std::string& metric, const WhyOptions& options = {});

/// Series of values in the order of the dates of their first runs (acceptances: as their operators
/// state them), with what the ones before them predict.
struct TrendOptions {
  std::string specimen = {};  ///< "SCENE" or "SCENE/FABRIC": the reference drape; empty: all
  int least_before = 5;       ///< values needed before one can be judged
  double alarm_sigmas = 3;
};
struct Trend {
  Table table;     ///< series, value, mean and standard deviation of those before, alarm
  int alarms = 0;  ///< of the newest value of each series
};
/// Calibration residual of each camera (RMS, px) and mean distance (mm) of each rig, scene, fabric,
/// grid and number of segments. A value is judged against the values before it: more than
/// alarm_sigmas times s sqrt(1 + 1/n) off their mean, s their standard deviation, is an alarm.
[[nodiscard]] Trend trend_of(const StoreReader& store, const TrendOptions& options);

/// Two comparisons side by side: each metric with both values and their difference, and the marks
/// that both have. Throws Error(usage) for a key that does not exist.
struct Difference {
  Table metrics, marks;
};
[[nodiscard]] Difference difference_of(const StoreReader& store, const std::string& first,
                                       const std::string& second);

/// The paper's twelve tables, or those of one experiment: the published numbers of `published_csv`
/// beside every result of the same scene, grid and segments in the store, one column per measured
/// sheet and one for simulations without a real cloth (more where models or solvers differ). The
/// last column names the columns whose simulations are not at rest. Throws Error(usage) for an
/// experiment that the paper has not.
[[nodiscard]] std::vector<Table> published_tables(const StoreReader& store,
                                                  const std::string& published_csv,
                                                  const std::string& experiment = {});

}  // namespace drape::compare
