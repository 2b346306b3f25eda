// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "compare/store.hpp"

namespace drape::compare {
namespace {

constexpr const char* kTables[] = {
    R"sql(CREATE TABLE metric (
  name TEXT NOT NULL PRIMARY KEY,  -- a column of comparison, simulation_pair or mark_error
  unit TEXT NOT NULL,
  definition TEXT NOT NULL,
  better TEXT NOT NULL CHECK (better IN ('smaller', 'larger', 'neither'))
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE rig (
  name TEXT NOT NULL PRIMARY KEY
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE calibration (
  sha256 TEXT NOT NULL PRIMARY KEY,  -- of calibration.json
  rig_name TEXT NOT NULL REFERENCES rig (name),
  method TEXT  -- NULL: the file was not given at the import
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE calibration_camera (
  calibration_sha256 TEXT NOT NULL REFERENCES calibration (sha256),
  camera TEXT NOT NULL,
  points INTEGER NOT NULL,
  rms_px REAL NOT NULL,
  max_px REAL NOT NULL,
  object_rms_mm REAL NOT NULL,
  PRIMARY KEY (calibration_sha256, camera)
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE fabric (
  sha256 TEXT NOT NULL PRIMARY KEY,  -- of the fabric file and its curves together
  name TEXT NOT NULL
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE sheet (
  sha256 TEXT NOT NULL PRIMARY KEY CHECK (length(sha256) = 64),  -- of sheet.json
  kind TEXT NOT NULL CHECK (kind IN ('measured', 'simulated')),
  rows INTEGER NOT NULL,
  cols INTEGER NOT NULL,
  patch_warp_mm REAL NOT NULL,
  patch_weft_mm REAL NOT NULL,
  marks INTEGER NOT NULL,
  gaps INTEGER NOT NULL,
  rig_name TEXT REFERENCES rig (name),
  set_name TEXT,
  calibration_sha256 TEXT REFERENCES calibration (sha256),
  detections_sha256 TEXT,
  sigma_median_mm REAL,
  sigma_max_mm REAL,
  CHECK ((kind = 'measured') = (rig_name IS NOT NULL))
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE gap (
  sheet_sha256 TEXT NOT NULL REFERENCES sheet (sha256),
  "row" INTEGER NOT NULL,
  "col" INTEGER NOT NULL,
  reason TEXT NOT NULL,
  PRIMARY KEY (sheet_sha256, "row", "col")
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE simulation (
  sheet_sha256 TEXT NOT NULL PRIMARY KEY REFERENCES sheet (sha256),
  scene TEXT NOT NULL,
  scene_sha256 TEXT NOT NULL,
  fabric_sha256 TEXT NOT NULL REFERENCES fabric (sha256),
  start_sha256 TEXT,  -- of the measured sheet that placed the cloth
  grid_rows INTEGER NOT NULL,
  grid_cols INTEGER NOT NULL,
  segments INTEGER NOT NULL,
  model TEXT NOT NULL,
  solver TEXT NOT NULL,
  status TEXT NOT NULL,
  at_rest INTEGER NOT NULL CHECK (at_rest IN (0, 1)),
  certificate_sha256 TEXT,
  certificate_json TEXT  -- names end in their units
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE comparison (
  sha256 TEXT NOT NULL PRIMARY KEY CHECK (length(sha256) = 64),
  measured_sha256 TEXT NOT NULL REFERENCES sheet (sha256),
  simulated_sha256 TEXT NOT NULL REFERENCES simulation (sheet_sha256),
  metrics_version INTEGER NOT NULL,
  marks INTEGER NOT NULL CHECK (marks > 0),
  excluded INTEGER NOT NULL,
  mean_mm REAL NOT NULL,
  sigma_mean_mm REAL,
  median_mm REAL NOT NULL,
  rms_mm REAL NOT NULL,
  p95_mm REAL NOT NULL,
  max_mm REAL NOT NULL,
  worst_row INTEGER NOT NULL,
  worst_col INTEGER NOT NULL,
  mean_percent_of_warp_side REAL NOT NULL,
  mean_percent_of_weft_side REAL NOT NULL,
  UNIQUE (measured_sha256, simulated_sha256, metrics_version)
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE mark_error (
  comparison_sha256 TEXT NOT NULL REFERENCES comparison (sha256),
  "row" INTEGER NOT NULL,
  "col" INTEGER NOT NULL,
  material_warp_mm REAL NOT NULL,
  material_weft_mm REAL NOT NULL,
  real_x_mm REAL NOT NULL,
  real_y_mm REAL NOT NULL,
  real_z_mm REAL NOT NULL,
  virtual_x_mm REAL NOT NULL,
  virtual_y_mm REAL NOT NULL,
  virtual_z_mm REAL NOT NULL,
  distance_mm REAL NOT NULL,
  along_warp_mm REAL NOT NULL,
  along_weft_mm REAL NOT NULL,
  along_normal_mm REAL NOT NULL,
  sigma_mark_mm REAL,
  sigma_distance_mm REAL,
  views INTEGER,
  PRIMARY KEY (comparison_sha256, "row", "col")
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE simulation_pair (
  sha256 TEXT NOT NULL PRIMARY KEY CHECK (length(sha256) = 64),
  measured_sha256 TEXT NOT NULL REFERENCES sheet (sha256),  -- whose lattice gave the points
  first_sha256 TEXT NOT NULL REFERENCES simulation (sheet_sha256),
  second_sha256 TEXT NOT NULL REFERENCES simulation (sheet_sha256),
  label TEXT NOT NULL,
  paper_order INTEGER NOT NULL,
  metrics_version INTEGER NOT NULL,
  points INTEGER NOT NULL CHECK (points > 0),
  gaps_included INTEGER NOT NULL CHECK (gaps_included IN (0, 1)),
  mean_mm REAL NOT NULL,
  median_mm REAL NOT NULL,
  rms_mm REAL NOT NULL,
  p95_mm REAL NOT NULL,
  max_mm REAL NOT NULL
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE INDEX comparison_by_simulation ON comparison (simulated_sha256))sql",
    R"sql(CREATE INDEX pair_by_measured ON simulation_pair (measured_sha256))sql",
};

constexpr const char* kMetrics = R"sql(INSERT INTO metric (name, unit, definition, better) VALUES
('mean_mm', 'mm', 'mean distance between each measured mark and the same material point of the virtual sheet (the paper, section 5); between simulations, of the same material points', 'smaller'),
('sigma_mean_mm', 'mm', 'one standard deviation of mean_mm: sqrt(sum of sigma_distance_mm squared) / marks, for independent marks; without what all marks share (calibration)', 'smaller'),
('median_mm', 'mm', 'median distance', 'smaller'),
('rms_mm', 'mm', 'root of the mean squared distance', 'smaller'),
('p95_mm', 'mm', '95th percentile of the distances, linear between order statistics', 'smaller'),
('max_mm', 'mm', 'largest distance', 'smaller'),
('mean_percent_of_warp_side', '%', 'mean_mm over the side of the patch along the warp', 'smaller'),
('mean_percent_of_weft_side', '%', 'mean_mm over the side of the patch along the weft', 'smaller'),
('distance_mm', 'mm', 'distance of one mark', 'smaller'),
('along_warp_mm', 'mm', 'real minus virtual along the warp tangent of the virtual sheet', 'neither'),
('along_weft_mm', 'mm', 'real minus virtual along the weft tangent of the virtual sheet', 'neither'),
('along_normal_mm', 'mm', 'real minus virtual along the normal of the printed side of the virtual sheet', 'neither'),
('sigma_mark_mm', 'mm', 'one standard deviation of the mark along its worst direction: root of the largest eigenvalue of its covariance', 'smaller'),
('sigma_distance_mm', 'mm', 'one standard deviation of the distance: sqrt(u'' C u), u the unit vector from the real to the virtual point, C the covariance of the mark', 'smaller'),
('sigma_median_mm', 'mm', 'median of sigma_mark_mm over the sheet', 'smaller'),
('sigma_max_mm', 'mm', 'largest sigma_mark_mm of the sheet', 'smaller'))sql";

constexpr const char* kRealView = R"sql(CREATE VIEW v_real_vs_virtual AS
SELECT s.scene AS scene, s.grid_rows || 'x' || s.grid_cols AS grid_size, s.segments AS segments,
  c.mean_mm AS mean_dist_mm, c.sigma_mean_mm AS sigma_mean_mm, c.median_mm AS median_mm,
  c.rms_mm AS rms_mm, c.p95_mm AS p95_mm, c.max_mm AS max_mm,
  c.mean_percent_of_warp_side AS mean_percent_of_warp_side,
  c.mean_percent_of_weft_side AS mean_percent_of_weft_side, c.marks AS marks, m.gaps AS gaps,
  f.name AS fabric, s.model AS model, s.solver AS solver, s.status AS status,
  m.rig_name AS rig, m.set_name AS measured_set, substr(m.sha256, 1, 12) AS measured,
  substr(c.sha256, 1, 12) AS comparison, s.grid_rows AS grid_rows
FROM comparison AS c JOIN simulation AS s ON s.sheet_sha256 = c.simulated_sha256
  JOIN sheet AS m ON m.sha256 = c.measured_sha256 JOIN fabric AS f ON f.sha256 = s.fabric_sha256
ORDER BY s.scene, m.sha256, s.segments DESC, s.grid_rows DESC, s.model, s.solver, c.sha256)sql";

constexpr const char* kVirtualView = R"sql(CREATE VIEW v_virtual_vs_virtual AS
SELECT s.scene AS scene, p.label AS pair, p.mean_mm AS mean_dist_mm, p.max_mm AS max_mm,
  p.points AS points, f.name AS fabric, s.model AS model, s.solver AS solver,
  substr(p.measured_sha256, 1, 12) AS measured, p.paper_order AS paper_order
FROM simulation_pair AS p JOIN simulation AS s ON s.sheet_sha256 = p.first_sha256
  JOIN fabric AS f ON f.sha256 = s.fabric_sha256
ORDER BY s.scene, p.measured_sha256, p.paper_order, s.model, s.solver, p.sha256)sql";

}  // namespace

std::vector<std::string> schema_statements() {
  std::vector<std::string> statements(std::begin(kTables), std::end(kTables));
  statements.emplace_back(kMetrics);
  statements.emplace_back(kRealView);
  statements.emplace_back(kVirtualView);
  // Tables 1 to 12 of the paper: experiments A to F, real against virtual and virtual pairs.
  for (int experiment = 0; experiment < 6; ++experiment) {
    const char scene = static_cast<char>('A' + experiment);
    statements.push_back(fmt::format(
        "CREATE VIEW v_table{} AS SELECT grid_size, segments, mean_dist_mm, marks, measured "
        "FROM v_real_vs_virtual WHERE scene = '{}'",
        2 * experiment + 1, scene));
    statements.push_back(
        fmt::format("CREATE VIEW v_table{} AS SELECT pair, mean_dist_mm, points, measured "
                    "FROM v_virtual_vs_virtual WHERE scene = '{}'",
                    2 * experiment + 2, scene));
  }
  return statements;
}

}  // namespace drape::compare
