// SPDX-License-Identifier: Apache-2.0
#include "compare/schema/schema.hpp"

#include <fmt/format.h>

namespace drape::compare {
namespace {

/// Only the newest definition of the metrics for each pair of sheets. It is not sorted, so that
/// SQLite can fold it into the query that uses it.
constexpr const char* kComparisonView = R"sql(CREATE VIEW v_comparison AS
SELECT s.scene AS scene, s.grid_rows || 'x' || s.grid_cols AS grid_size, s.segments AS segments,
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
  b.number AS branch, substr(c.sha256, 1, 12) AS comparison, s.grid_rows AS grid_rows, c.id AS id,
  substr(c.simulated_sha256, 1, 12) AS simulated
FROM comparison AS c
  JOIN simulation AS s INDEXED BY simulation_in_short ON s.sheet_sha256 = c.simulated_sha256
  JOIN sheet AS m ON m.sha256 = c.measured_sha256
  LEFT JOIN fabric AS f ON f.sha256 = s.fabric_sha256
  LEFT JOIN recording AS r ON r.sha256 = m.recording_sha256
  LEFT JOIN branch AS b ON b.sheet_sha256 = c.simulated_sha256
WHERE NOT EXISTS (SELECT 1 FROM comparison AS n WHERE n.measured_sha256 = c.measured_sha256
  AND n.simulated_sha256 = c.simulated_sha256 AND n.metrics_version > c.metrics_version))sql";

/// `state` is the query of schema.hpp.
constexpr const char* kRealView = R"sql(CREATE VIEW v_real_vs_virtual AS
SELECT v.*, s.run AS run, s.measurement AS measurement, s.cause AS cause, s.match AS match,
  s.state AS state
FROM v_comparison AS v JOIN ({state}) AS s ON s.comparison_id = v.id ORDER BY scene, measured, simulator <> 'drapebench', segments DESC,
  grid_rows DESC, model, solver, branch, comparison)sql";

/// The equilibria of each list with their distance to each measured sheet. `match_mm` says which
/// one the real shape took; `least_energy` and `nearest` mark one row of each list.
constexpr const char* kBranchView = R"sql(CREATE VIEW v_branches AS
SELECT c.scene AS scene, c.grid_size AS grid_size, c.segments AS segments, b.number AS branch,
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

std::vector<std::string> view_statements() {
  std::vector<std::string> statements = {kComparisonView};
  for (const char* view : {kRealView, kVirtualView, kSurfaceView, kBranchView})
    statements.push_back(fmt::format(fmt::runtime(view), fmt::arg("state", state_query()),
                                     fmt::arg("sheet_state", sheet_state_query())));
  return statements;
}

}  // namespace drape::compare
