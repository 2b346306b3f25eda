// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "compare/schema/schema.hpp"

namespace drape::compare {
namespace {

constexpr const char* kIndexes[] = {
    R"sql(CREATE INDEX comparison_by_simulation ON comparison (simulated_sha256))sql",
    // Everything that the views of runs need of a headline except its numbers.
    R"sql(CREATE INDEX comparison_in_short ON comparison (sha256, mean_mm, simulated_sha256))sql",
    // Columns of a simulation that the views show, without its certificate, which is long.
    R"sql(CREATE INDEX simulation_in_short ON simulation (sheet_sha256, simulator, scene,
  fabric_sha256, fabric_stated, grid_rows, grid_cols, spacing_mm, from_measured, segments, model,
  solver, status))sql",
    R"sql(CREATE INDEX pair_by_measured ON simulation_pair (measured_sha256))sql",
    R"sql(CREATE INDEX pair_by_sheets ON simulation_pair (first_sha256, second_sha256))sql",
};

// The last run of the same photographs, by `moments`: v_run_moment or a copy of it.
constexpr const char* kPicturesLast =
    R"sql(SELECT d.pictures_sha256 AS pictures_sha256, o.run AS run, max(o.moment) AS moment
FROM run_drape AS d JOIN {moments} AS o ON o.run = d.run
WHERE d.pictures_sha256 IS NOT NULL GROUP BY d.pictures_sha256)sql";

// The last run of what a run measured: of its photographs, or of its recording.
constexpr const char* kRunLast =
    R"sql(SELECT x.run AS run, x.last_run AS last_run, max(x.moment) AS moment FROM (
  SELECT d.run AS run, p.run AS last_run, p.moment AS moment FROM run_drape AS d
    JOIN {pictures_last} AS p ON p.pictures_sha256 = d.pictures_sha256
  UNION ALL SELECT r.number, y.run, y.moment FROM run AS r JOIN (
    SELECT q.recording_sha256 AS recording_sha256, o.run AS run, max(o.moment) AS moment
    FROM run AS q JOIN {moments} AS o ON o.run = q.number
    WHERE q.recording_sha256 IS NOT NULL GROUP BY q.recording_sha256) AS y
    ON y.recording_sha256 = r.recording_sha256) AS x GROUP BY x.run)sql";

// The last run is looked up in a table of runs, everything else by an index, so that for few
// comparisons only these are judged. SQLite would evaluate a view again at each use.
constexpr const char* kState = R"sql(WITH moments AS MATERIALIZED (SELECT * FROM v_run_moment),
  pictures_last AS MATERIALIZED ({pictures_last}),
  run_last AS MATERIALIZED ({run_last})
SELECT {subject}, d.run AS run, o.date AS date,
  r.label AS label, r.operator AS operator, r.calibration_name AS calibration,
  d.measurement AS measurement, d.cause AS cause, d.match AS match,
  d.match_reason AS match_reason, d.expanded_uncertainty_mm AS expanded_uncertainty_mm,
  CASE WHEN d.run <> p.run
    THEN CASE WHEN EXISTS (SELECT 1 FROM run_drape AS k WHERE k.run = p.run
      AND k.pictures_sha256 = d.pictures_sha256 AND k.scene = d.scene)
      THEN 'superseded' ELSE 'renamed' END
    WHEN d.run <> n.last_run AND NOT EXISTS (SELECT 1 FROM run_drape AS k WHERE k.run = n.last_run
      AND (k.scene = d.scene OR k.pictures_sha256 = d.pictures_sha256)) THEN 'removed'
    WHEN d.run IS NOT NULL THEN 'current' END AS state
FROM {table} AS c
  LEFT JOIN moments AS o ON o.moment = (SELECT max(q.moment) FROM {runs} AS k
    JOIN moments AS q ON q.run = k.run WHERE k.{key}{window})
  LEFT JOIN run_drape AS d ON d.run = o.run AND d.measured_sha256 = c.{measured}
  LEFT JOIN run AS r ON r.number = d.run
  LEFT JOIN pictures_last AS p ON p.pictures_sha256 = d.pictures_sha256
  LEFT JOIN run_last AS n ON n.run = d.run)sql";

constexpr const char* kViews[] = {
    R"sql(CREATE INDEX run_match_by_drape ON run_match (run_sha256, measured_sha256,
  rests_on, repeats, p))sql",
    R"sql(CREATE INDEX run_drape_by_pictures ON run_drape (pictures_sha256, run))sql",
    R"sql(CREATE INDEX run_drape_by_measured ON run_drape (measured_sha256, run))sql",
    // Runs are ordered by date, wherever they were stored, and within one second by the order in
    // which this store received them.
    R"sql(CREATE VIEW v_run_moment AS
SELECT r.number AS run, r.date AS date,
  r.date || substr('00000000000' || coalesce(l.sequence, 0), -12) || ' ' || r.number AS moment
FROM run AS r LEFT JOIN listed AS l ON l.kind = 'run' AND l.key = r.sha256
UNION ALL SELECT r.number, a.date,
  a.date || substr('00000000000' || coalesce(l.sequence, 0), -12) || ' ' || r.number
FROM run_repetition AS a JOIN run AS r ON r.sha256 = a.run_sha256
  LEFT JOIN listed AS l ON l.kind = 'run_repetition' AND l.key = a.sha256)sql",
    R"sql(CREATE INDEX file_by_manifest ON file (manifest))sql",
    R"sql(CREATE INDEX run_value_by_key ON run_value (key, run))sql",
    R"sql(CREATE VIEW v_outdated AS
SELECT comparison_id, state, run FROM v_state WHERE state <> 'current')sql",
    R"sql(CREATE VIEW v_run AS
SELECT r.number AS run, r.date AS date, r.label AS label, r.operator AS operator,
  r.measurement AS measurement, (SELECT group_concat(x.what, '; ') FROM (SELECT d.scene || ' ' ||
    coalesce(round(c.mean_mm, 3) || ' mm ', '') || d.match || coalesce(' by ' ||
      nullif(m.rests_on, ''), '') AS what FROM run_drape AS d
    LEFT JOIN comparison AS c INDEXED BY comparison_in_short ON c.sha256 = d.headline_sha256
    LEFT JOIN run_match AS m ON m.run_sha256 = r.sha256 AND m.measured_sha256 = d.measured_sha256
    WHERE d.run = r.number
    ORDER BY d.scene) AS x) AS drapes,
  r.rig_name AS rig, r.recording_name AS recording, substr(r.calibration_sha256, 1, 12) AS
    calibration, (SELECT count(*) FROM run_value AS v WHERE v.run = r.number AND v.stand_in = 1)
    AS stand_ins, r.program_version AS version, r.cause AS cause
FROM run AS r)sql",
    // Based on tables, since a view on the right of a LEFT JOIN would be materialised for every
    // row. Runs in their order, each with its drapes, is a third faster than SQLite's choice of
    // order.
    R"sql(CREATE VIEW v_run_drape AS
SELECT d.run AS run, r.date AS date, r.label AS label, d.scene AS scene,
  coalesce(f.name, s.fabric_stated) AS fabric, {discretisation} AS discretisation,
  s.segments AS segments, s.simulator AS simulator, c.mean_mm AS mean_dist_mm,
  d.expanded_uncertainty_mm AS expanded_uncertainty_mm, d.measurement AS measurement,
  d.match AS match, m.rests_on AS match_rests_on, m.repeats AS repeats, m.p AS match_p,
  substr(c.sha256, 1, 12) AS comparison, d.pictures_sha256 AS pictures_sha256
FROM run AS r CROSS JOIN run_drape AS d ON d.run = r.number
  LEFT JOIN run_match AS m ON m.run_sha256 = r.sha256 AND m.measured_sha256 = d.measured_sha256
  LEFT JOIN comparison AS c INDEXED BY comparison_in_short ON c.sha256 = d.headline_sha256
  LEFT JOIN simulation AS s INDEXED BY simulation_in_short
    ON s.sheet_sha256 = c.simulated_sha256
  LEFT JOIN fabric AS f ON f.sha256 = s.fabric_sha256)sql",
};

std::string pictures_last(const std::string& moments) {
  return fmt::format(fmt::runtime(kPicturesLast), fmt::arg("moments", moments));
}

std::string run_last(const std::string& moments, const std::string& pictures) {
  return fmt::format(fmt::runtime(kRunLast), fmt::arg("moments", moments),
                     fmt::arg("pictures_last", pictures));
}

std::string state_of(const std::string& table, const std::string& subject, const std::string& runs,
                     const std::string& key, const std::string& measured,
                     const std::string& window) {
  return fmt::format(fmt::runtime(kState), fmt::arg("subject", subject), fmt::arg("table", table),
                     fmt::arg("runs", runs), fmt::arg("key", key), fmt::arg("window", window),
                     fmt::arg("measured", measured),
                     fmt::arg("pictures_last", pictures_last("moments")),
                     fmt::arg("run_last", run_last("moments", "pictures_last")));
}

/// Only the newest definition of the metrics for each pair of sheets. It is not sorted, so that
/// SQLite can merge it into the query that uses it.
constexpr const char* kComparisonView = R"sql(CREATE VIEW v_comparison AS
SELECT s.scene AS scene, {discretisation} AS discretisation, s.segments AS segments,
  c.mean_mm AS mean_dist_mm, c.sigma_mean_mm AS sigma_mean_mm, c.mean_low_mm AS mean_low_mm,
  c.mean_high_mm AS mean_high_mm, c.median_mm AS median_mm,
  c.rms_mm AS rms_mm, c.p95_mm AS p95_mm, c.max_mm AS max_mm,
  c.mean_normal_mm AS mean_normal_mm, c.aligned_mean_mm AS aligned_mean_mm,
  c.mean_percent_of_warp_side AS mean_percent_of_warp_side,
  c.mean_percent_of_weft_side AS mean_percent_of_weft_side, c.marks AS marks, m.gaps AS gaps,
  coalesce(f.name, s.fabric_stated) AS fabric, s.simulator AS simulator, s.model AS model,
  s.solver AS solver, s.status AS status,
  m.rig_name AS rig, m.set_name AS measured_set, r.recorded_on AS recorded_on,
  substr(m.sha256, 1, 12) AS measured, m.calibration_sha256 AS calibration_sha256,
  b.number AS branch, substr(c.sha256, 1, 12) AS comparison, s.grid_rows AS grid_rows,
  s.spacing_mm AS spacing_mm, CASE s.from_measured WHEN 1 THEN 'measured shape' ELSE 'scene' END
    AS begins, c.id AS id, substr(c.simulated_sha256, 1, 12) AS simulated
FROM comparison AS c
  JOIN simulation AS s INDEXED BY simulation_in_short ON s.sheet_sha256 = c.simulated_sha256
  JOIN sheet AS m ON m.sha256 = c.measured_sha256
  LEFT JOIN fabric AS f ON f.sha256 = s.fabric_sha256
  LEFT JOIN recording AS r ON r.sha256 = m.recording_sha256
  LEFT JOIN branch AS b ON b.sheet_sha256 = c.simulated_sha256
WHERE NOT EXISTS (SELECT 1 FROM comparison AS n WHERE n.measured_sha256 = c.measured_sha256
  AND n.simulated_sha256 = c.simulated_sha256 AND n.metrics_version > c.metrics_version))sql";

/// `state` is the query from schema.hpp.
constexpr const char* kRealView = R"sql(CREATE VIEW v_real_vs_virtual AS
SELECT v.*, s.run AS run, s.measurement AS measurement, s.cause AS cause, s.match AS match,
  s.state AS state
FROM v_comparison AS v JOIN ({state}) AS s ON s.comparison_id = v.id
ORDER BY scene, measured, {finest_first}, branch, comparison)sql";

/// The equilibria of each list with their distance from each measured sheet. `match_mm` shows which
/// one the real shape took; `least_energy` and `nearest` mark one row of each list.
constexpr const char* kBranchView = R"sql(CREATE VIEW v_branches AS
SELECT c.scene AS scene, c.discretisation AS discretisation, c.segments AS segments,
  b.number AS branch,
  b.found AS found, b.energy_uJ AS energy_uJ,
  b.energy_uJ - min(b.energy_uJ) OVER one AS above_least_uJ, b.starts AS starts,
  b.hem_nodes AS hem_nodes, b.stable AS stable, c.mean_dist_mm AS mean_dist_mm,
  c.sigma_mean_mm AS sigma_mean_mm, t.turned_mean_mm AS turned_mean_mm, t.turn_deg AS turn_deg,
  coalesce(t.turned_mean_mm, c.mean_dist_mm) AS match_mm,
  row_number() OVER (one ORDER BY b.number) = 1 AS least_energy,
  row_number() OVER (one ORDER BY coalesce(t.turned_mean_mm, c.mean_dist_mm), b.number) = 1
    AS nearest,
  c.fabric AS fabric, c.measured AS measured, substr(b.branches_sha256, 1, 12) AS branches,
  c.comparison AS comparison, s.measurement AS measurement, s.state AS state
FROM branch AS b CROSS JOIN comparison AS k ON k.simulated_sha256 = b.sheet_sha256
  JOIN v_comparison AS c ON c.id = k.id
  JOIN ({state}) AS s ON s.comparison_id = k.id
  LEFT JOIN branch_turn AS t ON t.comparison_sha256 = k.sha256
WINDOW one AS (PARTITION BY c.measured, b.branches_sha256)
ORDER BY c.scene, c.measured, branches, b.number)sql";

constexpr const char* kSurfaceView = R"sql(CREATE VIEW v_real_vs_surface AS
SELECT p.scene AS scene, p.simulator AS simulator, p.to_surface_mean_mm AS to_surface_mean_mm,
  p.sigma_of_to_surface_mean_mm AS sigma_of_to_surface_mean_mm,
  p.to_surface_p95_mm AS to_surface_p95_mm, p.to_surface_max_mm AS to_surface_max_mm,
  p.real_to_mesh_mean_mm AS real_to_mesh_mean_mm, p.real_to_mesh_max_mm AS real_to_mesh_max_mm,
  p.mesh_to_real_mean_mm AS mesh_to_real_mean_mm, p.mesh_to_real_max_mm AS mesh_to_real_max_mm,
  p.marks AS marks, p.triangles AS triangles, p.fabric_stated AS fabric, m.rig_name AS rig,
  m.set_name AS measured_set, substr(m.sha256, 1, 12) AS measured,
  substr(p.sha256, 1, 12) AS comparison, s.measurement AS measurement, s.state AS state
FROM surface_comparison AS p JOIN sheet AS m ON m.sha256 = p.measured_sha256
  JOIN ({sheet_state}) AS s ON s.sheet_sha256 = p.measured_sha256
WHERE NOT EXISTS (SELECT 1 FROM surface_comparison AS n WHERE n.measured_sha256 = p.measured_sha256
  AND n.mesh_sha256 = p.mesh_sha256 AND n.metrics_version > p.metrics_version)
ORDER BY p.scene, m.sha256, p.simulator, p.sha256)sql";

/// A pair at the marks of a real cloth is current while both its sheets are compared with it.
constexpr const char* kVirtualView = R"sql(CREATE VIEW v_virtual_vs_virtual AS
SELECT s.scene AS scene, p.label AS pair, p.mean_mm AS mean_dist_mm, p.max_mm AS max_mm,
  p.surface_mean_mm AS surface_mean_mm, p.hausdorff_mm AS hausdorff_mm,
  p.points AS points, f.name AS fabric, s.model AS model, s.solver AS solver,
  min(s.at_rest, t.at_rest) AS both_at_rest,
  substr(p.measured_sha256, 1, 12) AS measured, p.paper_order AS paper_order,
  substr(p.sha256, 1, 12) AS comparison, substr(p.first_sha256, 1, 12) AS first,
  substr(p.second_sha256, 1, 12) AS second,
  (SELECT z.measurement FROM ({sheet_state}) AS z WHERE z.sheet_sha256 = p.measured_sha256)
    AS measurement,
  coalesce((SELECT z.state FROM comparison AS k JOIN ({state}) AS z ON z.comparison_id = k.id
    WHERE k.measured_sha256 = p.measured_sha256
    AND k.simulated_sha256 IN (p.first_sha256, p.second_sha256) AND z.state <> 'current'
    AND NOT EXISTS (SELECT 1 FROM comparison AS n WHERE n.measured_sha256 = k.measured_sha256
      AND n.simulated_sha256 = k.simulated_sha256 AND n.metrics_version > k.metrics_version)
    LIMIT 1), CASE WHEN p.measured_sha256 IS NOT NULL THEN 'current' END) AS state
FROM simulation_pair AS p JOIN simulation AS s ON s.sheet_sha256 = p.first_sha256
  JOIN simulation AS t ON t.sheet_sha256 = p.second_sha256
  LEFT JOIN fabric AS f ON f.sha256 = s.fabric_sha256
WHERE NOT EXISTS (SELECT 1 FROM simulation_pair AS n WHERE n.first_sha256 = p.first_sha256
  AND n.second_sha256 = p.second_sha256 AND n.measured_sha256 IS p.measured_sha256
  AND n.metrics_version > p.metrics_version)
ORDER BY s.scene, p.measured_sha256, p.paper_order, s.model, s.solver, p.sha256)sql";

}  // namespace

std::string state_query(const std::string& window) {
  return state_of("comparison", "c.id AS comparison_id", "run_comparison", "comparison_id = c.id",
                  "measured_sha256", window);
}

std::string sheet_state_query() {
  return state_of("sheet", "c.sha256 AS sheet_sha256", "run_drape", "measured_sha256 = c.sha256",
                  "sha256", "");
}

std::vector<std::string> surrounding_statements() {
  std::vector<std::string> statements(std::begin(kIndexes), std::end(kIndexes));
  const auto add = [&](const char* statement) {
    statements.push_back(fmt::format(fmt::runtime(statement), fmt::arg("state", state_query()),
                                     fmt::arg("sheet_state", sheet_state_query()),
                                     fmt::arg("discretisation", kDiscretisation),
                                     fmt::arg("finest_first", kFinestFirst)));
  };
  for (const char* view : {kComparisonView, kRealView, kVirtualView, kSurfaceView, kBranchView})
    add(view);
  for (const char* statement : kViews) add(statement);
  statements.push_back("CREATE VIEW v_pictures_last AS\n" + pictures_last("v_run_moment"));
  statements.push_back("CREATE VIEW v_run_last AS\n" + run_last("v_run_moment", "v_pictures_last"));
  statements.push_back("CREATE VIEW v_state AS\n" + state_query() + "\nWHERE d.run IS NOT NULL");
  // Tables 1 to 12 of the paper: experiments A to F, real against virtual and virtual pairs, on
  // grids of particles.
  for (int experiment = 0; experiment < 6; ++experiment)
    for (const bool pairs : {false, true})
      statements.push_back(fmt::format(
          "CREATE VIEW v_table{} AS SELECT {}, measured, measurement FROM {} WHERE scene = '{}' "
          "AND "
          "{}coalesce(state, 'current') = 'current'",
          2 * experiment + (pairs ? 2 : 1),
          pairs ? "pair, mean_dist_mm, points"
                : "discretisation, segments, mean_dist_mm, marks, model",
          pairs ? "v_virtual_vs_virtual" : "v_real_vs_virtual", static_cast<char>('A' + experiment),
          pairs ? "" : "branch IS NULL AND grid_rows IS NOT NULL AND "));
  for (const Relation& table : relations())
    for (const char* change : {"UPDATE", "DELETE"})
      statements.push_back(
          fmt::format("CREATE TRIGGER {0}_no_{1} BEFORE {1} ON {0} BEGIN SELECT RAISE(ABORT, 'the "
                      "store only grows: rows of {0} are never changed'); END",
                      table.name, change));
  return statements;
}

}  // namespace drape::compare
