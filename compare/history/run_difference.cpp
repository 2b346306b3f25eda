// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "compare/history/filter.hpp"
#include "compare/history/results.hpp"
#include "core/error.hpp"

namespace drape::compare {
void require_run(const StoreReader& store, int number) {
  const std::string text = std::to_string(number);
  if (!store.query("SELECT 1 FROM run WHERE number = CAST(? AS INTEGER)", {text}).rows.empty())
    return;
  const Table last = store.query("SELECT coalesce(max(number), 0) FROM run");
  throw usage_error(fmt::format("there is no run {}", number),
                    fmt::format("the store has runs 1 to {}: drape-results runs", last.rows[0][0]));
}

RunDifference difference_of_runs(const StoreReader& store, int first, int second) {
  require_run(store, first);
  require_run(store, second);
  const std::vector<std::string> both = {std::to_string(first), std::to_string(second)};
  RunDifference difference;
  difference.values = store.query(
      "WITH a AS (SELECT owner, key, value, stand_in FROM run_value WHERE run = CAST(?1 AS "
      "INTEGER)), b AS (SELECT owner, key, value, stand_in FROM run_value WHERE run = CAST(?2 AS "
      "INTEGER)) SELECT owner, key, a.value AS first, b.value AS second, max(a.stand_in, "
      "coalesce(b.stand_in, 0)) AS stand_in FROM a LEFT JOIN b USING (owner, key) WHERE a.value IS "
      "NOT b.value UNION ALL SELECT owner, key, NULL, b.value, b.stand_in FROM b LEFT JOIN a USING "
      "(owner, key) WHERE a.value IS NULL UNION ALL SELECT 'run', 'calibration', "
      "substr(x.calibration_sha256, 1, 12), substr(y.calibration_sha256, 1, 12), 0 FROM run AS x, "
      "run AS y WHERE x.number = CAST(?1 AS INTEGER) AND y.number = CAST(?2 AS INTEGER) AND "
      "x.calibration_sha256 IS NOT y.calibration_sha256 UNION ALL SELECT 'run', 'recording', "
      "substr(x.recording_sha256, 1, 12), substr(y.recording_sha256, 1, 12), 0 FROM run AS x, run "
      "AS y WHERE x.number = CAST(?1 AS INTEGER) AND y.number = CAST(?2 AS INTEGER) AND "
      "x.recording_sha256 IS NOT y.recording_sha256 UNION ALL SELECT 'run', 'program version', "
      "x.program_version, y.program_version, 0 FROM run AS x, run AS y WHERE x.number = CAST(?1 AS "
      "INTEGER) AND y.number = CAST(?2 AS INTEGER) AND x.program_version <> y.program_version "
      "ORDER BY 1, 2",
      both);
  difference.values.title = fmt::format("What differs between run {} and run {}", first, second);
  for (const auto& row : difference.values.rows) {
    difference.sentence +=
        fmt::format("{}{} {} {} -> {}", difference.sentence.empty() ? "" : "; ", row[0], row[1],
                    row[2].empty() ? "(absent)" : row[2], row[3].empty() ? "(absent)" : row[3]);
  }
  if (difference.sentence.empty()) difference.sentence = "no value differs";
  difference.drapes = store.query(
      "SELECT d.run, d.scene, d.grid_size, d.segments, round(d.mean_dist_mm, 3) AS mean_dist_mm, "
      "round(d.expanded_uncertainty_mm, 3) AS expanded_uncertainty_mm, " +
          std::string(kUncertaintyIs) +
          ", d.measurement, d.match, d.match_rests_on FROM v_run_drape AS d WHERE d.run IN "
          "(CAST(?1 AS INTEGER), CAST(?2 AS INTEGER)) ORDER BY d.scene, d.run",
      both);
  difference.drapes.title = "Their drapes";
  return difference;
}

}  // namespace drape::compare
