// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "compare/history/filter.hpp"
#include "compare/history/results.hpp"
#include "core/error.hpp"

namespace drape::compare {

void require_run(const StoreReader& store, int number) {
  if (!store.rows<int>("SELECT 1 FROM run WHERE number = ?", {number}).empty()) return;
  const auto last = store.rows<int>("SELECT max(number) FROM run");
  throw usage_error(
      fmt::format("there is no run {}", number),
      fmt::format("the store has runs 1 to {}: drape-results runs", std::get<0>(last[0])));
}

RunDifference difference_of_runs(const StoreReader& store, int first, int second) {
  require_run(store, first);
  require_run(store, second);
  RunDifference difference;
  difference.values = store.query(
      "WITH a AS (SELECT owner, key, value, stand_in FROM run_value WHERE run = ?1), b AS (SELECT "
      "owner, key, value, stand_in FROM run_value WHERE run = ?2), of_run AS (SELECT number, "
      "'calibration' AS what, substr(calibration_sha256, 1, 12) AS value FROM run UNION ALL SELECT "
      "number, 'recording', substr(recording_sha256, 1, 12) FROM run UNION ALL SELECT number, "
      "'program version', program_version FROM run) SELECT owner, key, a.value AS first, b.value "
      "AS second, max(a.stand_in, coalesce(b.stand_in, 0)) AS stand_in FROM a LEFT JOIN b USING "
      "(owner, key) WHERE a.value IS NOT b.value UNION ALL SELECT owner, key, NULL, b.value, "
      "b.stand_in FROM b LEFT JOIN a USING (owner, key) WHERE a.value IS NULL UNION ALL SELECT "
      "'run', x.what, x.value, y.value, 0 FROM of_run AS x JOIN of_run AS y ON y.what = x.what "
      "WHERE x.number = ?1 AND y.number = ?2 AND x.value IS NOT y.value ORDER BY 1, 2",
      {first, second});
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
          "(?1, ?2) ORDER BY d.scene, d.run",
      {first, second});
  difference.drapes.title = "Their drapes";
  return difference;
}

}  // namespace drape::compare
