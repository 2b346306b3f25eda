PRAGMA application_id = 1148346736;
PRAGMA user_version = 5;
PRAGMA foreign_keys = OFF;
BEGIN;
CREATE TABLE metric (
  name TEXT NOT NULL PRIMARY KEY,  -- a column of comparison, simulation_pair or mark_error
  unit TEXT NOT NULL,
  definition TEXT NOT NULL,
  better TEXT NOT NULL CHECK (better IN ('smaller', 'larger', 'neither'))
) STRICT, WITHOUT ROWID;
CREATE TABLE rig (
  name TEXT NOT NULL PRIMARY KEY
) STRICT, WITHOUT ROWID;
CREATE TABLE calibration (
  sha256 TEXT NOT NULL PRIMARY KEY,  -- of calibration.json
  rig_name TEXT NOT NULL REFERENCES rig (name)
) STRICT, WITHOUT ROWID;
CREATE TABLE calibration_file (  -- absent: the file was not given at an import
  calibration_sha256 TEXT NOT NULL PRIMARY KEY REFERENCES calibration (sha256),
  method TEXT NOT NULL
) STRICT, WITHOUT ROWID;
CREATE TABLE recording (
  sha256 TEXT NOT NULL PRIMARY KEY,  -- of recording.json
  recorded_on TEXT  -- ISO date, as the recording states it
) STRICT, WITHOUT ROWID;
CREATE TABLE calibration_camera (
  calibration_sha256 TEXT NOT NULL REFERENCES calibration (sha256),
  camera TEXT NOT NULL,
  points INTEGER NOT NULL,
  rms_px REAL NOT NULL,
  max_px REAL NOT NULL,
  object_rms_mm REAL NOT NULL,
  PRIMARY KEY (calibration_sha256, camera)
) STRICT, WITHOUT ROWID;
CREATE TABLE fabric (
  sha256 TEXT NOT NULL PRIMARY KEY,  -- of the fabric file and its curves together
  name TEXT NOT NULL
) STRICT, WITHOUT ROWID;
CREATE TABLE sheet (
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
  recording_sha256 TEXT REFERENCES recording (sha256),
  sigma_median_mm REAL,
  sigma_max_mm REAL,
  CHECK ((kind = 'measured') = (rig_name IS NOT NULL))
) STRICT, WITHOUT ROWID;
CREATE TABLE gap (
  sheet_sha256 TEXT NOT NULL REFERENCES sheet (sha256),
  "row" INTEGER NOT NULL,
  "col" INTEGER NOT NULL,
  reason TEXT NOT NULL,
  PRIMARY KEY (sheet_sha256, "row", "col")
) STRICT, WITHOUT ROWID;
CREATE TABLE simulation (
  sheet_sha256 TEXT NOT NULL PRIMARY KEY REFERENCES sheet (sha256),
  simulator TEXT NOT NULL,  -- drapebench, or the other program that made it
  scene TEXT NOT NULL,
  scene_sha256 TEXT,
  fabric_sha256 TEXT REFERENCES fabric (sha256),
  fabric_stated TEXT,  -- a name without a fabric file
  start_sha256 TEXT,  -- of the measured sheet that placed the cloth
  grid_rows INTEGER NOT NULL,
  grid_cols INTEGER NOT NULL,
  segments INTEGER,  -- NULL: another simulator
  model TEXT NOT NULL,
  solver TEXT NOT NULL,
  status TEXT NOT NULL,
  at_rest INTEGER CHECK (at_rest IN (0, 1)),  -- NULL: not stated
  certificate_sha256 TEXT,
  certificate_json TEXT  -- names end in their units
) STRICT, WITHOUT ROWID;
CREATE TABLE drapemeter (
  sheet_sha256 TEXT NOT NULL PRIMARY KEY REFERENCES sheet (sha256),
  centre_x_mm REAL NOT NULL,
  centre_y_mm REAL NOT NULL,
  covered_area_mm2 REAL NOT NULL,
  flat_area_mm2 REAL NOT NULL,
  drape_coefficient_percent REAL,  -- NULL: no flat support under the cloth
  mean_radius_mm REAL NOT NULL,
  folds INTEGER NOT NULL,
  fold_depth_mm REAL NOT NULL
) STRICT, WITHOUT ROWID;
CREATE TABLE hem_harmonic (
  sheet_sha256 TEXT NOT NULL REFERENCES drapemeter (sheet_sha256),
  "order" INTEGER NOT NULL,
  amplitude_mm REAL NOT NULL,
  phase_deg REAL NOT NULL,
  PRIMARY KEY (sheet_sha256, "order")
) STRICT, WITHOUT ROWID;
CREATE TABLE comparison (
  id INTEGER PRIMARY KEY,  -- short name for mark_error, in the order of the imports
  sha256 TEXT NOT NULL UNIQUE CHECK (length(sha256) = 64),
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
  -- from here on NULL in rows of metrics version 1, which did not have them
  mean_low_mm REAL, mean_high_mm REAL,
  sigma_of_median_mm REAL, median_low_mm REAL, median_high_mm REAL,
  sigma_of_rms_mm REAL, rms_low_mm REAL, rms_high_mm REAL,
  sigma_of_p95_mm REAL, p95_low_mm REAL, p95_high_mm REAL,
  sigma_of_max_mm REAL, max_low_mm REAL, max_high_mm REAL,
  mean_normal_mm REAL, sigma_mean_normal_mm REAL,
  mean_normal_low_mm REAL, mean_normal_high_mm REAL, rms_normal_mm REAL,
  to_surface_mean_mm REAL, to_surface_max_mm REAL,
  aligned_mean_mm REAL, aligned_rms_mm REAL, aligned_max_mm REAL,
  aligned_shift_mm REAL, aligned_turn_deg REAL,
  strain_warp_rms_percent REAL, strain_weft_rms_percent REAL, strain_area_rms_percent REAL,
  UNIQUE (measured_sha256, simulated_sha256, metrics_version)
) STRICT;
CREATE TABLE mark_error (
  comparison_id INTEGER NOT NULL REFERENCES comparison (id),
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
  PRIMARY KEY (comparison_id, "row", "col")
) STRICT, WITHOUT ROWID;
CREATE TABLE simulation_pair (
  sha256 TEXT NOT NULL PRIMARY KEY CHECK (length(sha256) = 64),
  measured_sha256 TEXT REFERENCES sheet (sha256),  -- whose lattice gave the points; NULL: no real
                                                   -- cloth, points of the coarsest grid
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
  max_mm REAL NOT NULL,
  mean_low_mm REAL,
  mean_high_mm REAL,
  surface_mean_mm REAL,
  hausdorff_mm REAL
) STRICT, WITHOUT ROWID;
CREATE TABLE surface_comparison (  -- a mesh without material coordinates: no mark corresponds
  sha256 TEXT NOT NULL PRIMARY KEY CHECK (length(sha256) = 64),
  measured_sha256 TEXT NOT NULL REFERENCES sheet (sha256),
  mesh_sha256 TEXT NOT NULL,  -- of its description and the mesh together
  simulator TEXT NOT NULL,
  scene TEXT NOT NULL,
  fabric_stated TEXT,
  metrics_version INTEGER NOT NULL,
  points INTEGER NOT NULL,
  triangles INTEGER NOT NULL CHECK (triangles > 0),
  marks INTEGER NOT NULL CHECK (marks > 0),
  to_surface_mean_mm REAL NOT NULL,
  sigma_of_to_surface_mean_mm REAL,
  to_surface_mean_low_mm REAL,
  to_surface_mean_high_mm REAL,
  to_surface_rms_mm REAL NOT NULL,
  to_surface_p95_mm REAL NOT NULL,
  to_surface_max_mm REAL NOT NULL,
  real_to_mesh_mean_mm REAL,  -- NULL in these four: no four neighbouring marks were measured
  real_to_mesh_max_mm REAL,
  mesh_to_real_mean_mm REAL,
  mesh_to_real_max_mm REAL,
  UNIQUE (measured_sha256, mesh_sha256, metrics_version)
) STRICT, WITHOUT ROWID;
CREATE TABLE branch (  -- an equilibrium of a drape that has several
  sheet_sha256 TEXT NOT NULL PRIMARY KEY REFERENCES simulation (sheet_sha256),
  branches_sha256 TEXT NOT NULL,  -- of branches.json, which lists all that were found together
  number INTEGER NOT NULL,  -- by energy; 1 has the least
  found INTEGER NOT NULL,  -- how many there are in that list
  energy_uJ REAL NOT NULL,
  residual_per_particle_weight REAL NOT NULL,
  stable INTEGER NOT NULL CHECK (stable IN (0, 1)),
  starts INTEGER NOT NULL,
  hem_nodes INTEGER NOT NULL,
  scene_round INTEGER NOT NULL CHECK (scene_round IN (0, 1))
) STRICT, WITHOUT ROWID;
CREATE TABLE branch_turn (  -- on a round object a shape turned is the same shape
  comparison_sha256 TEXT NOT NULL PRIMARY KEY REFERENCES comparison (sha256),
  axis_x_mm REAL NOT NULL,
  axis_y_mm REAL NOT NULL,
  turned_mean_mm REAL NOT NULL,
  turn_deg REAL NOT NULL,
  half_turn INTEGER NOT NULL CHECK (half_turn IN (0, 1))  -- the sheet in its own plane as well
) STRICT, WITHOUT ROWID;
CREATE TABLE ledger (
  sequence INTEGER PRIMARY KEY,
  kind TEXT NOT NULL,  -- table of the row
  key TEXT NOT NULL,   -- its first column that names it
  content_sha256 TEXT NOT NULL,  -- of the row and of the rows that hang on it
  chain_sha256 TEXT NOT NULL,    -- of the entry before and this one
  UNIQUE (kind, key)
) STRICT;
CREATE TABLE run (
  number INTEGER PRIMARY KEY,
  sha256 TEXT NOT NULL UNIQUE CHECK (length(sha256) = 64),  -- of all but number and date
  date TEXT NOT NULL,  -- UTC, ISO 8601: when it was stored
  label TEXT,
  operator TEXT,
  program_version TEXT NOT NULL,
  rig_name TEXT REFERENCES rig (name),
  recording_sha256 TEXT REFERENCES recording (sha256),
  recording_name TEXT,  -- folder, as the detections name it
  calibration_sha256 TEXT REFERENCES calibration (sha256),
  calibration_name TEXT,
  measurement TEXT NOT NULL CHECK (measurement IN ('GO', 'NO-GO')),
  cause TEXT,
  CHECK ((measurement = 'GO') = (cause IS NULL))
) STRICT;
CREATE TABLE run_drape (
  run INTEGER NOT NULL REFERENCES run (number),
  measured_sha256 TEXT NOT NULL REFERENCES sheet (sha256),
  scene TEXT NOT NULL,
  set_name TEXT NOT NULL,
  pictures_sha256 TEXT,  -- of the hashes of the photographs: what was measured
  measurement TEXT NOT NULL CHECK (measurement IN ('GO', 'NO-GO')),
  cause TEXT,
  match TEXT NOT NULL CHECK (match IN ('inside', 'outside', 'undecided')),
  match_reason TEXT NOT NULL,
  headline_sha256 TEXT REFERENCES comparison (sha256),  -- the simulation chosen beforehand
  expanded_uncertainty_mm REAL,  -- U (95 %) of its mean distance; at least, where a part is missing
  budget_complete INTEGER CHECK (budget_complete IN (0, 1)),
  PRIMARY KEY (run, measured_sha256)
) STRICT, WITHOUT ROWID;
CREATE TABLE run_comparison (
  comparison_id INTEGER NOT NULL REFERENCES comparison (id),
  run INTEGER NOT NULL REFERENCES run (number),
  PRIMARY KEY (comparison_id, run)
) STRICT, WITHOUT ROWID;
CREATE TABLE run_value (
  run INTEGER NOT NULL REFERENCES run (number),
  owner TEXT NOT NULL,
  key TEXT NOT NULL,
  value TEXT NOT NULL,
  stand_in INTEGER NOT NULL CHECK (stand_in IN (0, 1)),
  PRIMARY KEY (run, owner, key)
) STRICT, WITHOUT ROWID;
CREATE INDEX comparison_by_simulation ON comparison (simulated_sha256);
CREATE INDEX simulation_in_short ON simulation (sheet_sha256, simulator, scene,
  fabric_sha256, fabric_stated, grid_rows, grid_cols, segments, model, solver, status);
CREATE INDEX pair_by_measured ON simulation_pair (measured_sha256);
CREATE INDEX pair_by_sheets ON simulation_pair (first_sha256, second_sha256);
CREATE INDEX run_drape_by_pictures ON run_drape (pictures_sha256, run);
CREATE INDEX run_value_by_key ON run_value (key, run);
CREATE TRIGGER metric_no_UPDATE BEFORE UPDATE ON metric BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of metric are never changed'); END;
CREATE TRIGGER metric_no_DELETE BEFORE DELETE ON metric BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of metric are never changed'); END;
CREATE TRIGGER rig_no_UPDATE BEFORE UPDATE ON rig BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of rig are never changed'); END;
CREATE TRIGGER rig_no_DELETE BEFORE DELETE ON rig BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of rig are never changed'); END;
CREATE TRIGGER calibration_no_UPDATE BEFORE UPDATE ON calibration BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of calibration are never changed'); END;
CREATE TRIGGER calibration_no_DELETE BEFORE DELETE ON calibration BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of calibration are never changed'); END;
CREATE TRIGGER calibration_file_no_UPDATE BEFORE UPDATE ON calibration_file BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of calibration_file are never changed'); END;
CREATE TRIGGER calibration_file_no_DELETE BEFORE DELETE ON calibration_file BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of calibration_file are never changed'); END;
CREATE TRIGGER calibration_camera_no_UPDATE BEFORE UPDATE ON calibration_camera BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of calibration_camera are never changed'); END;
CREATE TRIGGER calibration_camera_no_DELETE BEFORE DELETE ON calibration_camera BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of calibration_camera are never changed'); END;
CREATE TRIGGER recording_no_UPDATE BEFORE UPDATE ON recording BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of recording are never changed'); END;
CREATE TRIGGER recording_no_DELETE BEFORE DELETE ON recording BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of recording are never changed'); END;
CREATE TRIGGER fabric_no_UPDATE BEFORE UPDATE ON fabric BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of fabric are never changed'); END;
CREATE TRIGGER fabric_no_DELETE BEFORE DELETE ON fabric BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of fabric are never changed'); END;
CREATE TRIGGER sheet_no_UPDATE BEFORE UPDATE ON sheet BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of sheet are never changed'); END;
CREATE TRIGGER sheet_no_DELETE BEFORE DELETE ON sheet BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of sheet are never changed'); END;
CREATE TRIGGER gap_no_UPDATE BEFORE UPDATE ON gap BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of gap are never changed'); END;
CREATE TRIGGER gap_no_DELETE BEFORE DELETE ON gap BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of gap are never changed'); END;
CREATE TRIGGER simulation_no_UPDATE BEFORE UPDATE ON simulation BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of simulation are never changed'); END;
CREATE TRIGGER simulation_no_DELETE BEFORE DELETE ON simulation BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of simulation are never changed'); END;
CREATE TRIGGER drapemeter_no_UPDATE BEFORE UPDATE ON drapemeter BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of drapemeter are never changed'); END;
CREATE TRIGGER drapemeter_no_DELETE BEFORE DELETE ON drapemeter BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of drapemeter are never changed'); END;
CREATE TRIGGER hem_harmonic_no_UPDATE BEFORE UPDATE ON hem_harmonic BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of hem_harmonic are never changed'); END;
CREATE TRIGGER hem_harmonic_no_DELETE BEFORE DELETE ON hem_harmonic BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of hem_harmonic are never changed'); END;
CREATE TRIGGER comparison_no_UPDATE BEFORE UPDATE ON comparison BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of comparison are never changed'); END;
CREATE TRIGGER comparison_no_DELETE BEFORE DELETE ON comparison BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of comparison are never changed'); END;
CREATE TRIGGER mark_error_no_UPDATE BEFORE UPDATE ON mark_error BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of mark_error are never changed'); END;
CREATE TRIGGER mark_error_no_DELETE BEFORE DELETE ON mark_error BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of mark_error are never changed'); END;
CREATE TRIGGER simulation_pair_no_UPDATE BEFORE UPDATE ON simulation_pair BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of simulation_pair are never changed'); END;
CREATE TRIGGER simulation_pair_no_DELETE BEFORE DELETE ON simulation_pair BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of simulation_pair are never changed'); END;
CREATE TRIGGER surface_comparison_no_UPDATE BEFORE UPDATE ON surface_comparison BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of surface_comparison are never changed'); END;
CREATE TRIGGER surface_comparison_no_DELETE BEFORE DELETE ON surface_comparison BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of surface_comparison are never changed'); END;
CREATE TRIGGER branch_no_UPDATE BEFORE UPDATE ON branch BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of branch are never changed'); END;
CREATE TRIGGER branch_no_DELETE BEFORE DELETE ON branch BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of branch are never changed'); END;
CREATE TRIGGER branch_turn_no_UPDATE BEFORE UPDATE ON branch_turn BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of branch_turn are never changed'); END;
CREATE TRIGGER branch_turn_no_DELETE BEFORE DELETE ON branch_turn BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of branch_turn are never changed'); END;
CREATE TRIGGER run_no_UPDATE BEFORE UPDATE ON run BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of run are never changed'); END;
CREATE TRIGGER run_no_DELETE BEFORE DELETE ON run BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of run are never changed'); END;
CREATE TRIGGER run_drape_no_UPDATE BEFORE UPDATE ON run_drape BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of run_drape are never changed'); END;
CREATE TRIGGER run_drape_no_DELETE BEFORE DELETE ON run_drape BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of run_drape are never changed'); END;
CREATE TRIGGER run_comparison_no_UPDATE BEFORE UPDATE ON run_comparison BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of run_comparison are never changed'); END;
CREATE TRIGGER run_comparison_no_DELETE BEFORE DELETE ON run_comparison BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of run_comparison are never changed'); END;
CREATE TRIGGER run_value_no_UPDATE BEFORE UPDATE ON run_value BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of run_value are never changed'); END;
CREATE TRIGGER run_value_no_DELETE BEFORE DELETE ON run_value BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of run_value are never changed'); END;
CREATE TRIGGER ledger_no_UPDATE BEFORE UPDATE ON ledger BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of ledger are never changed'); END;
CREATE TRIGGER ledger_no_DELETE BEFORE DELETE ON ledger BEGIN SELECT RAISE(ABORT, 'the store only grows: rows of ledger are never changed'); END;
CREATE VIEW v_comparison AS
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
  b.number AS branch, substr(c.sha256, 1, 12) AS comparison, s.grid_rows AS grid_rows, c.id AS id
FROM comparison AS c
  JOIN simulation AS s INDEXED BY simulation_in_short ON s.sheet_sha256 = c.simulated_sha256
  JOIN sheet AS m ON m.sha256 = c.measured_sha256
  LEFT JOIN fabric AS f ON f.sha256 = s.fabric_sha256
  LEFT JOIN recording AS r ON r.sha256 = m.recording_sha256
  LEFT JOIN branch AS b ON b.sheet_sha256 = c.simulated_sha256
WHERE NOT EXISTS (SELECT 1 FROM comparison AS n WHERE n.measured_sha256 = c.measured_sha256
  AND n.simulated_sha256 = c.simulated_sha256 AND n.metrics_version > c.metrics_version);
CREATE VIEW v_real_vs_virtual AS
SELECT * FROM v_comparison ORDER BY scene, measured, simulator <> 'drapebench', segments DESC,
  grid_rows DESC, model, solver, branch, comparison;
CREATE VIEW v_virtual_vs_virtual AS
SELECT s.scene AS scene, p.label AS pair, p.mean_mm AS mean_dist_mm, p.max_mm AS max_mm,
  p.surface_mean_mm AS surface_mean_mm, p.hausdorff_mm AS hausdorff_mm,
  p.points AS points, f.name AS fabric, s.model AS model, s.solver AS solver,
  min(s.at_rest, t.at_rest) AS both_at_rest,
  substr(p.measured_sha256, 1, 12) AS measured, p.paper_order AS paper_order,
  substr(p.sha256, 1, 12) AS comparison
FROM simulation_pair AS p JOIN simulation AS s ON s.sheet_sha256 = p.first_sha256
  JOIN simulation AS t ON t.sheet_sha256 = p.second_sha256
  LEFT JOIN fabric AS f ON f.sha256 = s.fabric_sha256
WHERE NOT EXISTS (SELECT 1 FROM simulation_pair AS n WHERE n.first_sha256 = p.first_sha256
  AND n.second_sha256 = p.second_sha256 AND n.measured_sha256 IS p.measured_sha256
  AND n.metrics_version > p.metrics_version)
ORDER BY s.scene, p.measured_sha256, p.paper_order, s.model, s.solver, p.sha256;
CREATE VIEW v_real_vs_surface AS
SELECT p.scene AS scene, p.simulator AS simulator, p.to_surface_mean_mm AS to_surface_mean_mm,
  p.sigma_of_to_surface_mean_mm AS sigma_of_to_surface_mean_mm,
  p.to_surface_p95_mm AS to_surface_p95_mm, p.to_surface_max_mm AS to_surface_max_mm,
  p.real_to_mesh_mean_mm AS real_to_mesh_mean_mm, p.real_to_mesh_max_mm AS real_to_mesh_max_mm,
  p.mesh_to_real_mean_mm AS mesh_to_real_mean_mm, p.mesh_to_real_max_mm AS mesh_to_real_max_mm,
  p.marks AS marks, p.triangles AS triangles, p.fabric_stated AS fabric, m.rig_name AS rig,
  m.set_name AS measured_set, substr(m.sha256, 1, 12) AS measured,
  substr(p.sha256, 1, 12) AS comparison
FROM surface_comparison AS p JOIN sheet AS m ON m.sha256 = p.measured_sha256
WHERE NOT EXISTS (SELECT 1 FROM surface_comparison AS n WHERE n.measured_sha256 = p.measured_sha256
  AND n.mesh_sha256 = p.mesh_sha256 AND n.metrics_version > p.metrics_version)
ORDER BY p.scene, m.sha256, p.simulator, p.sha256;
CREATE VIEW v_branches AS
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
  c.comparison AS comparison
FROM branch AS b CROSS JOIN comparison AS k ON k.simulated_sha256 = b.sheet_sha256
  JOIN v_comparison AS c ON c.id = k.id
  LEFT JOIN branch_turn AS t ON t.comparison_sha256 = k.sha256
WINDOW one AS (PARTITION BY c.measured, b.branches_sha256)
ORDER BY scene, c.measured, branches, branch;
CREATE VIEW v_outdated AS
SELECT comparison_id, state, run FROM v_state WHERE state <> 'current';
CREATE VIEW v_run AS
SELECT r.number AS run, r.date AS date, r.label AS label, r.operator AS operator,
  r.measurement AS measurement, (SELECT group_concat(x.what, '; ') FROM (SELECT d.scene || ' ' ||
    coalesce(round(c.mean_mm, 3) || ' mm ', '') || d.match AS what FROM run_drape AS d
    LEFT JOIN comparison AS c ON c.sha256 = d.headline_sha256 WHERE d.run = r.number
    ORDER BY d.scene) AS x) AS drapes,
  r.rig_name AS rig, r.recording_name AS recording, substr(r.calibration_sha256, 1, 12) AS
    calibration, (SELECT count(*) FROM run_value AS v WHERE v.run = r.number AND v.stand_in = 1)
    AS stand_ins, r.program_version AS version, r.cause AS cause
FROM run AS r;
CREATE VIEW v_run_drape AS
SELECT d.run AS run, r.date AS date, r.label AS label, d.scene AS scene,
  coalesce(f.name, s.fabric_stated) AS fabric, s.grid_rows || 'x' || s.grid_cols AS grid_size,
  s.segments AS segments, s.simulator AS simulator, c.mean_mm AS mean_dist_mm,
  d.expanded_uncertainty_mm AS expanded_uncertainty_mm, d.measurement AS measurement,
  d.match AS match, substr(c.sha256, 1, 12) AS comparison, d.pictures_sha256 AS pictures_sha256
FROM run_drape AS d JOIN run AS r ON r.number = d.run
  LEFT JOIN comparison AS c ON c.sha256 = d.headline_sha256
  LEFT JOIN simulation AS s INDEXED BY simulation_in_short
    ON s.sheet_sha256 = c.simulated_sha256
  LEFT JOIN fabric AS f ON f.sha256 = s.fabric_sha256;
CREATE VIEW v_state AS
SELECT c.id AS comparison_id, d.run AS run, r.date AS date,
  r.label AS label, r.operator AS operator, r.calibration_name AS calibration,
  d.measurement AS measurement, d.cause AS cause, d.match AS match,
  d.match_reason AS match_reason, d.expanded_uncertainty_mm AS expanded_uncertainty_mm,
  CASE WHEN d.run < (SELECT max(k.run) FROM run_drape AS k
      WHERE k.pictures_sha256 = d.pictures_sha256)
    THEN CASE WHEN EXISTS (SELECT 1 FROM run_drape AS k WHERE k.run = (SELECT max(l.run)
        FROM run_drape AS l WHERE l.pictures_sha256 = d.pictures_sha256)
      AND k.pictures_sha256 = d.pictures_sha256 AND k.scene = d.scene)
      THEN 'superseded' ELSE 'renamed' END
    WHEN n.run > d.run AND NOT EXISTS (SELECT 1 FROM run_drape AS k WHERE k.run = n.run
      AND (k.scene = d.scene OR k.pictures_sha256 = d.pictures_sha256)) THEN 'removed'
    WHEN d.run IS NOT NULL THEN 'current' END AS state
FROM comparison AS c
  LEFT JOIN run_drape AS d ON d.measured_sha256 = c.measured_sha256 AND d.run =
    (SELECT max(k.run) FROM run_comparison AS k WHERE k.comparison_id = c.id)
  LEFT JOIN run AS r ON r.number = d.run
  LEFT JOIN (SELECT rig_name, recording_name, max(number) AS run FROM run
    GROUP BY rig_name, recording_name) AS n
    ON n.rig_name IS r.rig_name AND n.recording_name IS r.recording_name
WHERE d.run IS NOT NULL;
CREATE VIEW v_table1 AS SELECT grid_size, segments, mean_dist_mm, marks, measured FROM v_real_vs_virtual WHERE scene = 'A' AND branch IS NULL AND id NOT IN (SELECT comparison_id FROM v_outdated);
CREATE VIEW v_table2 AS SELECT pair, mean_dist_mm, points, measured FROM v_virtual_vs_virtual WHERE scene = 'A';
CREATE VIEW v_table3 AS SELECT grid_size, segments, mean_dist_mm, marks, measured FROM v_real_vs_virtual WHERE scene = 'B' AND branch IS NULL AND id NOT IN (SELECT comparison_id FROM v_outdated);
CREATE VIEW v_table4 AS SELECT pair, mean_dist_mm, points, measured FROM v_virtual_vs_virtual WHERE scene = 'B';
CREATE VIEW v_table5 AS SELECT grid_size, segments, mean_dist_mm, marks, measured FROM v_real_vs_virtual WHERE scene = 'C' AND branch IS NULL AND id NOT IN (SELECT comparison_id FROM v_outdated);
CREATE VIEW v_table6 AS SELECT pair, mean_dist_mm, points, measured FROM v_virtual_vs_virtual WHERE scene = 'C';
CREATE VIEW v_table7 AS SELECT grid_size, segments, mean_dist_mm, marks, measured FROM v_real_vs_virtual WHERE scene = 'D' AND branch IS NULL AND id NOT IN (SELECT comparison_id FROM v_outdated);
CREATE VIEW v_table8 AS SELECT pair, mean_dist_mm, points, measured FROM v_virtual_vs_virtual WHERE scene = 'D';
CREATE VIEW v_table9 AS SELECT grid_size, segments, mean_dist_mm, marks, measured FROM v_real_vs_virtual WHERE scene = 'E' AND branch IS NULL AND id NOT IN (SELECT comparison_id FROM v_outdated);
CREATE VIEW v_table10 AS SELECT pair, mean_dist_mm, points, measured FROM v_virtual_vs_virtual WHERE scene = 'E';
CREATE VIEW v_table11 AS SELECT grid_size, segments, mean_dist_mm, marks, measured FROM v_real_vs_virtual WHERE scene = 'F' AND branch IS NULL AND id NOT IN (SELECT comparison_id FROM v_outdated);
CREATE VIEW v_table12 AS SELECT pair, mean_dist_mm, points, measured FROM v_virtual_vs_virtual WHERE scene = 'F';
INSERT INTO "metric" VALUES ('aligned_max_mm', 'mm', 'largest distance that would be left', 'smaller');
INSERT INTO "metric" VALUES ('aligned_mean_mm', 'mm', 'mean distance that would be left if the real marks were moved as one rigid body onto the virtual ones (Kabsch 1976); never part of mean_mm', 'smaller');
INSERT INTO "metric" VALUES ('aligned_rms_mm', 'mm', 'root mean square that would be left', 'smaller');
INSERT INTO "metric" VALUES ('aligned_shift_mm', 'mm', 'how far that move takes the centroid of the real marks', 'smaller');
INSERT INTO "metric" VALUES ('aligned_turn_deg', 'deg', 'angle of that move', 'smaller');
INSERT INTO "metric" VALUES ('along_normal_mm', 'mm', 'real minus virtual along the normal of the printed side of the virtual sheet', 'neither');
INSERT INTO "metric" VALUES ('along_warp_mm', 'mm', 'real minus virtual along the warp tangent of the virtual sheet', 'neither');
INSERT INTO "metric" VALUES ('along_weft_mm', 'mm', 'real minus virtual along the weft tangent of the virtual sheet', 'neither');
INSERT INTO "metric" VALUES ('amplitude_mm', 'mm', 'amplitude of one harmonic of that radius over the angle', 'neither');
INSERT INTO "metric" VALUES ('covered_area_mm2', 'mm2', 'area of the shadow of the cloth on the table, light from straight above', 'neither');
INSERT INTO "metric" VALUES ('distance_mm', 'mm', 'distance of one mark', 'smaller');
INSERT INTO "metric" VALUES ('drape_coefficient_percent', '%', '(shadow - flat top of the object) / (flat cloth - flat top) (Cusick 1968)', 'neither');
INSERT INTO "metric" VALUES ('energy_uJ', 'uJ', 'gravity, elastic and contact energy of an equilibrium as drape-branches states it; only differences within one list mean anything', 'neither');
INSERT INTO "metric" VALUES ('flat_area_mm2', 'mm2', 'area of the patch before draping', 'neither');
INSERT INTO "metric" VALUES ('fold_depth_mm', 'mm', 'mean crest minus mean valley of that radius', 'neither');
INSERT INTO "metric" VALUES ('folds', '1', 'crests of that radius that stand out by 2 % of its mean', 'neither');
INSERT INTO "metric" VALUES ('hausdorff_mm', 'mm', 'largest distance from either virtual surface to the nearest point of the other, sampled every 5 mm or closer', 'smaller');
INSERT INTO "metric" VALUES ('hem_nodes', '1', 'folds of the border as drape-branches counts them: crests that stand out by 3 mm', 'neither');
INSERT INTO "metric" VALUES ('max_high_mm', 'mm', 'upper end of it: never above max_mm', 'neither');
INSERT INTO "metric" VALUES ('max_low_mm', 'mm', 'lower end of the 95 % bootstrap interval of max_mm', 'neither');
INSERT INTO "metric" VALUES ('max_mm', 'mm', 'largest distance', 'smaller');
INSERT INTO "metric" VALUES ('max_px', 'px', 'largest of these', 'smaller');
INSERT INTO "metric" VALUES ('mean_high_mm', 'mm', 'upper end of it', 'neither');
INSERT INTO "metric" VALUES ('mean_low_mm', 'mm', 'lower end of the 95 % bootstrap interval of mean_mm over the marks (2,000 resamples, fixed start)', 'neither');
INSERT INTO "metric" VALUES ('mean_mm', 'mm', 'mean distance between each measured mark and the same material point of the virtual sheet (the paper, section 5); between simulations, of the same material points', 'smaller');
INSERT INTO "metric" VALUES ('mean_normal_high_mm', 'mm', 'upper end of it', 'neither');
INSERT INTO "metric" VALUES ('mean_normal_low_mm', 'mm', 'lower end of the 95 % bootstrap interval of mean_normal_mm', 'neither');
INSERT INTO "metric" VALUES ('mean_normal_mm', 'mm', 'mean of along_normal_mm: positive when the real cloth lies on the printed side of the virtual one', 'neither');
INSERT INTO "metric" VALUES ('mean_percent_of_warp_side', '%', 'mean_mm over the side of the patch along the warp', 'smaller');
INSERT INTO "metric" VALUES ('mean_percent_of_weft_side', '%', 'mean_mm over the side of the patch along the weft', 'smaller');
INSERT INTO "metric" VALUES ('mean_radius_mm', 'mm', 'mean over 720 directions of the radius of the shadow about the object', 'neither');
INSERT INTO "metric" VALUES ('median_high_mm', 'mm', 'upper end of it', 'neither');
INSERT INTO "metric" VALUES ('median_low_mm', 'mm', 'lower end of the 95 % bootstrap interval of median_mm', 'neither');
INSERT INTO "metric" VALUES ('median_mm', 'mm', 'median distance', 'smaller');
INSERT INTO "metric" VALUES ('mesh_to_real_max_mm', 'mm', 'the Hausdorff distance the other way', 'smaller');
INSERT INTO "metric" VALUES ('mesh_to_real_mean_mm', 'mm', 'the other way; it contains the hem and the gaps, where no mark was measured', 'smaller');
INSERT INTO "metric" VALUES ('object_rms_mm', 'mm', 'RMS distance of the target''s points from their rays', 'smaller');
INSERT INTO "metric" VALUES ('p95_high_mm', 'mm', 'upper end of it', 'neither');
INSERT INTO "metric" VALUES ('p95_low_mm', 'mm', 'lower end of the 95 % bootstrap interval of p95_mm', 'neither');
INSERT INTO "metric" VALUES ('p95_mm', 'mm', '95th percentile of the distances, linear between order statistics', 'smaller');
INSERT INTO "metric" VALUES ('phase_deg', 'deg', 'angle of the first crest of the harmonic times its order', 'neither');
INSERT INTO "metric" VALUES ('real_to_mesh_max_mm', 'mm', 'largest of these: the Hausdorff distance one way, sampled every 5 mm or closer', 'smaller');
INSERT INTO "metric" VALUES ('real_to_mesh_mean_mm', 'mm', 'mean distance from the surface between the measured marks (cells with four of them, two triangles each) to the nearest point of the mesh, over the area', 'smaller');
INSERT INTO "metric" VALUES ('residual_per_particle_weight', '1', 'largest net force on a particle of an equilibrium, in weights of a particle', 'smaller');
INSERT INTO "metric" VALUES ('rms_high_mm', 'mm', 'upper end of it', 'neither');
INSERT INTO "metric" VALUES ('rms_low_mm', 'mm', 'lower end of the 95 % bootstrap interval of rms_mm', 'neither');
INSERT INTO "metric" VALUES ('rms_mm', 'mm', 'root of the mean squared distance', 'smaller');
INSERT INTO "metric" VALUES ('rms_normal_mm', 'mm', 'root of the mean square of along_normal_mm', 'smaller');
INSERT INTO "metric" VALUES ('rms_px', 'px', 'RMS distance of the target''s points from where the calibrated camera sees them', 'smaller');
INSERT INTO "metric" VALUES ('sigma_distance_mm', 'mm', 'one standard deviation of the distance: sqrt(u'' C u), u the unit vector from the real to the virtual point, C the covariance of the mark', 'smaller');
INSERT INTO "metric" VALUES ('sigma_mark_mm', 'mm', 'one standard deviation of the mark along its worst direction: root of the largest eigenvalue of its covariance', 'smaller');
INSERT INTO "metric" VALUES ('sigma_max_mm', 'mm', 'largest sigma_mark_mm of the sheet', 'smaller');
INSERT INTO "metric" VALUES ('sigma_mean_mm', 'mm', 'one standard deviation of mean_mm: sqrt(sum of sigma_distance_mm squared) / marks, for independent marks; without what all marks share (calibration)', 'smaller');
INSERT INTO "metric" VALUES ('sigma_mean_normal_mm', 'mm', 'one standard deviation of mean_normal_mm for independent marks', 'smaller');
INSERT INTO "metric" VALUES ('sigma_median_mm', 'mm', 'median of sigma_mark_mm over the sheet', 'smaller');
INSERT INTO "metric" VALUES ('sigma_of_max_mm', 'mm', 'sigma_distance_mm of the mark with the largest distance', 'smaller');
INSERT INTO "metric" VALUES ('sigma_of_median_mm', 'mm', 'one standard deviation of median_mm from the covariances of the marks, first order', 'smaller');
INSERT INTO "metric" VALUES ('sigma_of_p95_mm', 'mm', 'one standard deviation of p95_mm from the covariances of the marks, first order', 'smaller');
INSERT INTO "metric" VALUES ('sigma_of_rms_mm', 'mm', 'one standard deviation of rms_mm: sqrt(sum of (distance sigma_distance) squared) / (marks rms), first order', 'smaller');
INSERT INTO "metric" VALUES ('sigma_of_to_surface_mean_mm', 'mm', 'one standard deviation of to_surface_mean_mm: of each distance sqrt(u'' C u), u the unit vector from the mark to the nearest point; marks independent', 'smaller');
INSERT INTO "metric" VALUES ('strain_area_rms_percent', '%', 'the same for the area between four marks', 'smaller');
INSERT INTO "metric" VALUES ('strain_warp_rms_percent', '%', 'RMS over neighbouring marks along the warp of the real minus the virtual length of the straight line between them, over its length on the print', 'smaller');
INSERT INTO "metric" VALUES ('strain_weft_rms_percent', '%', 'the same along the weft', 'smaller');
INSERT INTO "metric" VALUES ('surface_mean_mm', 'mm', 'mean distance from either virtual surface to the nearest point of the other, over the area, both ways', 'smaller');
INSERT INTO "metric" VALUES ('to_surface_max_mm', 'mm', 'largest of these', 'smaller');
INSERT INTO "metric" VALUES ('to_surface_mean_high_mm', 'mm', 'upper end of it', 'neither');
INSERT INTO "metric" VALUES ('to_surface_mean_low_mm', 'mm', 'lower end of the 95 % bootstrap interval of to_surface_mean_mm', 'neither');
INSERT INTO "metric" VALUES ('to_surface_mean_mm', 'mm', 'mean distance of the measured marks to the nearest point of the virtual sheet, whichever material point that is', 'smaller');
INSERT INTO "metric" VALUES ('to_surface_p95_mm', 'mm', '95th percentile of these', 'smaller');
INSERT INTO "metric" VALUES ('to_surface_rms_mm', 'mm', 'root mean square of the distances of the measured marks to the nearest point of the surface', 'smaller');
INSERT INTO "metric" VALUES ('turn_deg', 'deg', 'that turn, from x to y', 'neither');
INSERT INTO "metric" VALUES ('turned_mean_mm', 'mm', 'mean_mm after the turn of the virtual sheet about the vertical through the middle of a round object that makes it smallest', 'smaller');
INSERT INTO "rig" VALUES ('bench1');
INSERT INTO "calibration" VALUES ('5699325e9f926c3e3b10b4093cd4b6656c935b345b3273f2bbfac0a10624f078', 'bench1');
INSERT INTO "calibration_file" VALUES ('5699325e9f926c3e3b10b4093cd4b6656c935b345b3273f2bbfac0a10624f078', 'joint');
INSERT INTO "recording" VALUES ('187dd45b255972b0aa0cec994347c2ec8fa5764b59b7c3db4bf3635188ccbb92', NULL);
INSERT INTO "calibration_camera" VALUES ('5699325e9f926c3e3b10b4093cd4b6656c935b345b3273f2bbfac0a10624f078', 'cam0', 2052, 8.74522464947438508964e-03, 3.0784616154221889489e-02, 2.07411714235426281396e-03);
INSERT INTO "calibration_camera" VALUES ('5699325e9f926c3e3b10b4093cd4b6656c935b345b3273f2bbfac0a10624f078', 'cam1', 2052, 8.88662864678204864055e-03, 3.39913503728976884588e-02, 2.12278509967802307689e-03);
INSERT INTO "calibration_camera" VALUES ('5699325e9f926c3e3b10b4093cd4b6656c935b345b3273f2bbfac0a10624f078', 'cam2', 2052, 8.78249750294065635591e-03, 3.44543127100549045893e-02, 2.16556009962308665742e-03);
INSERT INTO "fabric" VALUES ('e8f59ff50ff4daeebfb474c33556bfb81b0e50214cc222c98572d1dc3e7b5d95', 'A');
INSERT INTO "sheet" VALUES ('8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 'measured', 11, 11, 220.0, 220.0, 101, 20, 'bench1', 'drape_C', '5699325e9f926c3e3b10b4093cd4b6656c935b345b3273f2bbfac0a10624f078', '6e583fda9334121f9f2d3897187a345d550498d146e5ed8afa2948e62134a736', '187dd45b255972b0aa0cec994347c2ec8fa5764b59b7c3db4bf3635188ccbb92', 1.63477253575103897986e-02, 7.45506029792731145233e-02);
INSERT INTO "sheet" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 'simulated', 11, 11, 220.0, 220.0, 121, 0, NULL, NULL, NULL, NULL, NULL, NULL, NULL);
INSERT INTO "gap" VALUES ('8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 0, 1, 'seen by one camera (cam2)');
INSERT INTO "gap" VALUES ('8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 0, 2, 'seen by one camera (cam2)');
INSERT INTO "gap" VALUES ('8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 0, 3, 'seen by one camera (cam2)');
INSERT INTO "gap" VALUES ('8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 0, 4, 'seen by one camera (cam2)');
INSERT INTO "gap" VALUES ('8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 0, 5, 'seen by one camera (cam2)');
INSERT INTO "gap" VALUES ('8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 0, 6, 'seen by one camera (cam2)');
INSERT INTO "gap" VALUES ('8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 1, 0, 'seen by one camera (cam0); cam2 rejected it: bad fit: no blurred ellipse fits it');
INSERT INTO "gap" VALUES ('8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 1, 2, 'seen by one camera (cam2)');
INSERT INTO "gap" VALUES ('8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 1, 3, 'seen by one camera (cam2)');
INSERT INTO "gap" VALUES ('8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 1, 4, 'seen by one camera (cam2)');
INSERT INTO "gap" VALUES ('8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 1, 5, 'seen by one camera (cam2)');
INSERT INTO "gap" VALUES ('8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 1, 6, 'seen by one camera (cam2)');
INSERT INTO "gap" VALUES ('8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 1, 7, 'seen by one camera (cam2)');
INSERT INTO "gap" VALUES ('8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 2, 0, 'seen by one camera (cam0)');
INSERT INTO "gap" VALUES ('8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 2, 1, 'seen by one camera (cam0)');
INSERT INTO "gap" VALUES ('8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 3, 0, 'seen by one camera (cam0)');
INSERT INTO "gap" VALUES ('8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 3, 1, 'seen by one camera (cam0)');
INSERT INTO "gap" VALUES ('8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 4, 0, 'seen by one camera (cam0)');
INSERT INTO "gap" VALUES ('8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 5, 0, 'seen by one camera (cam0); cam1 rejected it: too small: minor semi-axis 1.16 px');
INSERT INTO "gap" VALUES ('8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 8, 0, 'seen by one camera (cam0)');
INSERT INTO "simulation" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 'drapebench', 'C', '4261079125bd3f910e073c440d844ed31067afcedc7ebafd99424b565822e8ce', 'e8f59ff50ff4daeebfb474c33556bfb81b0e50214cc222c98572d1dc3e7b5d95', NULL, '8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 11, 11, 1, 'consistent', 'fall', 'at rest', 1, '84389659dd91355584b6e2dd725a0bab75008b5b616b0229c7aea9d1680d5da3', '{"at_rest":"yes","status":"at rest","largest_residual_per_particle_weight":"1.13677e-10","rms_residual_per_particle_weight":"4.67007e-11","residual_tolerance":"1e-06","independent_check.accepted":"yes","independent_check.largest_residual_per_particle_weight":"2.24888e-10","independent_check.places_that_may_press":"53","independent_check.refused":"none","kinetic_energy_uJ":"0","simulated_time_s":"2.9498","steps":"40","steps_cut_at_an_impact":"0","kinetic_stops":"0","step_us":"0; 0","strain.warp_percent":"-0.0018371; 0.00471154","strain.weft_percent":"-0.00479457; 0.00977816","strain.largest_shear_deg":"0.266814","strain.largest_curvature_per_cm":"0.629405","distance.least_particle_to_object_mm":"-1.10439e-10","distance.least_particle_to_table_mm":"74.5434","distance.deepest_between_particles_mm":"0.577476","distance.least_to_itself_mm":"not stated","distance.triangles_through_itself":"0","distance.deepest_edge_of_an_object_pressing_mm":"0","distance.edge_of_an_object_through_the_sheet_mm":"0","distance.particles_touching":"13","distance.contact_forces_stated":"53","distance.contacts_between_particles":"116","distance.pressing_pairs_of_features":"0","distance.largest_pin_error_mm":"0","energy.start_uJ":"7407.6","energy.end_uJ":"7404.74","energy.lost_to_damping_and_air_uJ":"0","energy.lost_to_kinetic_stops_uJ":"0","energy.brought_in_by_contact_search_uJ":"0","energy.lost_to_impact_friction_and_springs_uJ":"2.86563","start.centre_mm":"-1.59203; 3.95404; 125","start.yaw_deg":"13.948","start.placed_by_marks":"55","start.placement_rms_mm":"0.0699683","twist_stiffness_uNm":"15.4","curves.tensile warp.segments_used":"1","curves.tensile warp.fit_rms_error_gf_per_cm":"0.304562","curves.tensile warp.fit_largest_error_gf_per_cm":"0.665389","curves.tensile warp.half_hysteresis_gf_per_cm":"49.1925","curves.tensile warp.first_slope_n_per_m":"4476.07","curves.tensile warp.fit_range_percent":"0.5","curves.bending warp.segments_used":"1","curves.bending warp.fit_rms_error_gf_cm_per_cm":"8.26934e-08","curves.bending warp.fit_largest_error_gf_cm_per_cm":"2.10098e-07","curves.bending warp.half_hysteresis_gf_cm_per_cm":"0.015","curves.bending warp.first_slope_gf_cm2_per_cm":"0.0785181","curves.bending warp.fit_range_per_cm":"1.5","curves.tensile weft.segments_used":"1","curves.tensile weft.fit_rms_error_gf_per_cm":"0.0685278","curves.tensile weft.fit_largest_error_gf_per_cm":"0.163397","curves.tensile weft.half_hysteresis_gf_per_cm":"49.1925","curves.tensile weft.first_slope_n_per_m":"2139.66","curves.tensile weft.fit_range_percent":"0.5","curves.bending weft.segments_used":"1","curves.bending weft.fit_rms_error_gf_cm_per_cm":"8.26934e-08","curves.bending weft.fit_largest_error_gf_cm_per_cm":"2.10098e-07","curves.bending weft.half_hysteresis_gf_cm_per_cm":"0.015","curves.bending weft.first_slope_gf_cm2_per_cm":"0.0785181","curves.bending weft.fit_range_per_cm":"1.5","curves.shear (mean of warp and weft).segments_used":"1","curves.shear (mean of warp and weft).fit_rms_error_gf_per_cm":"6.62828e-07","curves.shear (mean of warp and weft).fit_largest_error_gf_per_cm":"2.17695e-06","curves.shear (mean of warp and weft).half_hysteresis_gf_per_cm":"0.679739","curves.shear (mean of warp and weft).first_slope_gf_per_cm_deg":"0.6","curves.shear (mean of warp and weft).fit_range_deg":"5","options.rows":"11","options.cols":"11","options.round_specimen":"no","options.segments":"1","options.model":"consistent","options.solver":"fall","options.mass":"area","options.damping_per_s":"4","options.air_drag_kg_per_m3":"0.6","options.spring_damping_ratio":"0.1","options.natural_time_s":"0.4","options.kinetic_damping":"yes","options.imperfection_um":"1","options.step_share":"0.9","options.max_steps":"400000","options.contact_between_particles":"yes","options.penetration_tolerance_mm":"2.2","options.cloth_thickness_mm":"0","warnings":"between its particles the sheet reaches 0.58 mm into an object"}');
INSERT INTO "drapemeter" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', -3.0, 5.0, 3.19609235622061460166e+04, 48400.0, 4.86535593522180889172e+01, 9.94318155374375720577e+01, 4, 4.53389028743701345564e+01);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 1, 1.75325025064501804905e+00, -3.66676984938050196669e+01);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 2, 4.5702794109358430008e-02, -1.23963284323356546677e+02);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 3, 8.13270035005115077275e-01, 9.23295599514848532897e+01);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 4, 2.32298944445356063685e+01, -1.24208109394492453251e+02);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 5, 8.11138233593947433064e-01, -1.59959489647267616872e+02);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 6, 2.44397490328279315408e-01, 8.80389859464306709889e+01);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 7, 2.35732263137137354469e-01, -2.88061837072827593431e+01);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 8, 4.32852885875996751252e+00, 1.11576530722760750794e+02);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 9, 2.33236631921419551582e-01, 7.75495037100355659714e+01);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 10, 1.19204608153532981562e-01, -4.39135877836150427793e+01);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 11, 2.15551156322063147685e-01, 2.12835937632299874175e+01);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 12, 1.8171501986802, 1.67382704592051538843e+02);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 13, 2.14182793212999322829e-01, 1.31566622941791052877e+02);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 14, 4.03030490381588932247e-02, 5.67310540140394223848e+01);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 15, 2.37196986434880935368e-01, -9.93605638019496240076e+01);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 16, 1.80345674450380943909e+00, 4.31528498787161751693e+01);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 17, 2.35516518657857221175e-01, 8.25540385460036496567e+00);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 18, 4.33836741345337562059e-02, -9.58111483607316642956e+01);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 19, 3.69354125361413751504e-02, -5.49331695308515506343e+01);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 20, 1.44764404522650880213e-01, 9.87255136492311180518e+01);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 21, 3.40757592861002725492e-02, 7.39080217195351423225e+01);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 22, 5.73843134812435373692e-02, -2.39188302664596612605e+01);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 23, 2.52036118913383289097e-01, -1.66820137096685471075e+02);
INSERT INTO "hem_harmonic" VALUES ('c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 24, 1.28015942258610437853e+00, -2.53745381213114029606e+01);
INSERT INTO "comparison" VALUES (1, '382ff100672b26ac8b9df0101c34964576d22979e34af91e35e20d4384b4822f', '8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 'c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 2, 101, 0, 4.25476227349820756984e+00, 2.4975480921901427149e-03, 2.75068124780113665295e+00, 6.8772850388442732239e+00, 1.6993993448504049581e+01, 2.49350668193971571886e+01, 10, 10, 1.93398285159009475364e+00, 1.93398285159009475364e+00, 3.27009943218634324679e+00, 5.38591463702339101615e+00, 4.40495722268183162451e-02, 9.41119384574678363719e-01, 3.39819798349593593655e+00, 3.1541044686353146044e-03, 5.25308950090432347224e+00, 8.45245211007642183176e+00, 3.63499797694900386724e-02, 1.07459488699112348797e+01, 2.30024280049671894224e+01, 2.85007366760392268079e-02, 1.98122920231646588717e+01, 2.49350668193971571886e+01, 2.73325740077517265191e+00, 2.48177227050474114716e-03, 1.62888048762972870164e+00, 3.86857415981571550744e+00, 6.31018412908041703701e+00, 3.72303436988115432626e+00, 2.3186932726475177446e+01, 4.5174015862342375982e+00, 6.71346903891231239214e+00, 2.48507451111781065824e+01, 1.37612276445654102552e+00, 6.00244813265401799817e-01, 4.87025526682513909548e+00, 5.90178756769511903002e+00, 7.47188964744177219756e+00);
INSERT INTO "mark_error" VALUES (1, 0, 0, 10.0, 10.0, -1.1606444903242839928e+02, 7.31738136233521601053e+01, 9.59595604455583099916e+01, -1.04330814745176766674e+02, 6.65998451472560191186e+01, 8.14119943226812239379e+01, 1.98122920231646588717e+01, 5.36305581510118489774e+00, 4.97697804667077, 1.84127012879596243521e+01, 7.03452402068885790376e-02, 5.90631787137693292644e-02, 2);
INSERT INTO "mark_error" VALUES (1, 0, 7, 10.0, 1.50000000000000028414e+02, 1.53198614877035588222e+01, 1.01273664463485474135e+02, 9.88260816689700476427e+01, 1.72232374664289338288e+01, 9.19018312327454793813e+01, 9.32448946646724721211e+01, 1.10726576122506088491e+01, -1.19400150796430781774e+00, 2.76353617845885768389e+00, 1.06553849766604340492e+01, 2.74715765703805181452e-02, 2.33869022230817832919e-02, 2);
INSERT INTO "mark_error" VALUES (1, 0, 8, 10.0, 170.0, 3.22549137967596877274e+01, 1.10200657121493549083e+02, 1.04524321639375500575e+02, 2.98821388771392548733e+01, 1.04827153467317472749e+02, 1.00032354703606884526e+02, 7.39475282160681, 2.11730642792232026661e-01, 7.00600693292755138941e+00, 2.35654009123781493784e+00, 1.40150182445681979054e-02, 1.03039563525390859971e-02, 2);
INSERT INTO "mark_error" VALUES (1, 0, 9, 10.0, 190.0, 5.04101291407180482915e+01, 1.17628143747220804016e+02, 1.07183722804345450186e+02, 4.44496374896876602625e+01, 1.08714364647983970254e+02, 9.39999109589115136066e+01, 1.6993993448504049581e+01, 4.66216888988115574221e+00, -3.4012050709922223568e+00, 1.59849857846865344161e+01, 3.90524468713519534723e-02, 3.63499797694900386724e-02, 3);
INSERT INTO "mark_error" VALUES (1, 0, 10, 10.0, 2.10000000000000028419e+02, 6.7863684554022142949e+01, 1.20568537272040174454e+02, 98.4986224688555, 5.98981014428814901879e+01, 1.0738870091764546544e+02, 8.14119875311451153283e+01, 2.30024280049671894224e+01, 6.08099930017160250628e+00, -6.29207100387072, 2.12741811097416224632e+01, 3.13075275246570763898e-02, 2.71301431484937162486e-02, 2);
INSERT INTO "mark_error" VALUES (1, 1, 1, 30.0, 30.0, -9.55861938070963503867e+01, 6.04604292812229360265e+01, 1.10702712871066168533e+02, -9.21740545614757849062e+01, 5.8814517792091955072e+01, 1.05654888688975958645e+02, 6.31127941346698, 1.38506217763321481939e+00, 1.00436840435817531513e+00, 6.07604476395107, 6.93253061073525744806e-02, 6.19618948203311953326e-02, 2);
INSERT INTO "mark_error" VALUES (1, 1, 8, 30.0, 170.0, 3.70603788718457636272e+01, 9.41425015763116164197e+01, 1.15416249431615298699e+02, 3.65726539252789208936e+01, 9.16143387419812142962e+01, 1.12767597743793800189e+02, 3.69389208069115104748e+00, 1.32485649019260326442e-01, 2.15844162259639871237e+00, 2.99353170257126777187e+00, 5.26388033898154694689e-02, 4.54412651835063366445e-02, 2);
INSERT INTO "mark_error" VALUES (1, 1, 9, 30.0, 190.0, 5.50117834618325787223e+01, 98.7359885268218, 1.11074297582364479809e+02, 5.27965260472007784624e+01, 9.48200267165387629137e+01, 1.0565477478223758112e+02, 7.04367444547032128809e+00, 9.37117370839334329346e-01, -1.23041252755797492213e+00, 6.87256926249996, 4.40561459260274540516e-02, 3.68530237267311808202e-02, 2);
INSERT INTO "mark_error" VALUES (1, 1, 10, 30.0, 2.10000000000000028419e+02, 68.2457957638311, 1.00815562347152265943e+02, 9.62800309025802363276e+01, 6.86949394674822855222e+01, 9.42304968288646307462e+01, 9.35887765702341738443e+01, 7.12794976329391172242e+00, -3.24041609846041778197e+00, -2.41265102180941637399e+00, 5.8713660652232260162e+00, 3.1413712092386553154e-02, 7.16512884040307156119e-03, 2);
INSERT INTO "mark_error" VALUES (1, 2, 2, 50.0, 50.0, -7.42472292601139116641e+01, 4.76842807528837582271e+01, 1.22249183789892114761e+02, -7.41706192869133502671e+01, 4.76663744398258444352e+01, 1.22035003899465095851e+02, 2.28172630927658021127e-01, -0.0178897861788263, -4.97905111061861874177e-02, 2.21970905547249020006e-01, 8.19981734856279134704e-03, 7.4587672810747561794e-03, 3);
INSERT INTO "mark_error" VALUES (1, 2, 3, 50.0, 6.99999999999999857882e+01, -5.48746033337086913661e+01, 5.24985608218408259526e+01, 1.23098546106050378058e+02, -5.48485934044175706949e+01, 5.24938811320677061172e+01, 1.23438400734759483161e+02, 3.40880601638024416377e-01, -1.23943680150409071133e-02, -1.71568029262044383087e-02, -3.40223153033154146474e-01, 1.25568316187085748936e-02, 1.25068599689833834937e-02, 3);
INSERT INTO "mark_error" VALUES (1, 2, 4, 50.0, 90.0, -3.5463103627426008301e+01, 5.73041338216550428814e+01, 1.23251277852394437674e+02, -3.54578619344755736615e+01, 5.73382152743573811912e+01, 1.23065434978670353418e+02, 1.89014799625094237489e-01, 2.13397757294873750832e-02, -1.38315900772083728853e-02, 1.87295728954871759652e-01, 1.29860591787771591926e-02, 1.2243027926836572844e-02, 3);
INSERT INTO "mark_error" VALUES (1, 2, 5, 50.0, 110.0, -1.60501733247409958948e+01, 6.21150526260409492369e+01, 1.23354210600187514041e+02, -1.60468397049288391542e+01, 6.21539256942253217621e+01, 1.23007576313503406593e+02, 3.48823102956379971217e-01, 1.5021111548829025814e-02, -1.16122487084786979449e-02, 3.48306232181190222885e-01, 1.26787951229064676378e-02, 1.21716218296127939163e-02, 3);
INSERT INTO "mark_error" VALUES (1, 2, 6, 50.0, 130.0, 3.3575993337555836149e+00, 66.9497228941399, 1.23468698038259930174e+02, 3.36170330389201499343e+00, 6.6979615183056509407e+01, 1.2306541901359467772e+02, 4.04406185959759578718e-01, 5.35485715767321842489e-03, -1.00290354501717977886e-02, 4.04246390409051747916e-01, 1.31247027899598807387e-02, 1.27636805382439280642e-02, 3);
INSERT INTO "mark_error" VALUES (1, 2, 7, 50.0, 1.50000000000000028414e+02, 22.757355847389, 71.8007999362744, 1.2350396505573736761e+02, 2.2765702398637330361e+01, 71.7704956175479, 1.2343847489598175571e+02, 7.26428088391050524874e-02, -3.11244591825231148307e-02, 4.92264869779273739162e-04, 6.56354817941722790131e-02, 1.47340317127428368365e-02, 1.38105003673834967475e-02, 3);
INSERT INTO "mark_error" VALUES (1, 2, 8, 50.0, 170.0, 4.21386473449628837792e+01, 7.66418969434931796058e+01, 1.22638268326122783951e+02, 4.21011046672488902214e+01, 7.65441104647037775512e+01, 1.22035010243548654781e+02, 6.12284216908286937908e-01, -3.56200434033429810809e-02, 0.00359632123997229, 6.11237515133385533872e-01, 6.0243555768451861887e-02, 5.98930754330967082821e-02, 2);
INSERT INTO "mark_error" VALUES (1, 2, 9, 50.0, 190.0, 5.36089646175260625682e+01, 7.92800542431815387107e+01, 1.07263994760092813858e+02, 5.78633712098357690925e+01, 7.88174908367235218511e+01, 1.12476218466133772724e+02, 6.74397629885349658707e+00, 5.96593062494426340514e-01, 3.64642783021608130056e-01, -6.70730958337741522967e+00, 4.45335463305844211912e-02, 4.34277683896694619014e-02, 2);
INSERT INTO "mark_error" VALUES (1, 2, 10, 50.0, 2.10000000000000028419e+02, 6.52911121744077149742e+01, 8.17037760615806689639e+01, 9.11868718875144708153e+01, 7.24586985081735264219e+01, 7.93188548544877249915e+01, 9.94365646006136927326e+01, 1.11856860708939294109e+01, 3.56118248458243735754e+00, 1.17104357509240780688e-01, -10.603015057073, 3.46601767337946647939e-02, 3.28586143596025850865e-02, 2);
INSERT INTO "mark_error" VALUES (1, 3, 2, 6.99999999999999857882e+01, 50.0, -69.431604566321, 2.83222522016827937818e+01, 123.213680763291, -6.94072855868049884984e+01, 2.83134277800040301542e+01, 1.23274766102014879723e+02, 6.63377855349138317864e-02, -1.31520715963246732221e-02, -2.2415882013787257615e-02, -6.10340928936031271168e-02, 1.06634463254621017491e-02, 9.83996583634757712721e-03, 3);
INSERT INTO "mark_error" VALUES (1, 3, 3, 6.99999999999999857882e+01, 6.99999999999999857882e+01, -5.0046818552571110672e+01, 3.31215068342617726662e+01, 1.22392210592171252865e+02, -5.0006918929741765111e+01, 3.31043707819987886864e+01, 1.23265817816281796125e+02, 8.74685775697305434306e-01, 2.7335386033639802461e-02, 1.96408530066029089755e-02, -8.74037671155596274097e-01, 0.00964095175468253, 9.63841844431909816615e-03, 3);
INSERT INTO "mark_error" VALUES (1, 3, 4, 6.99999999999999857882e+01, 90.0, -3.06403364501077213333e+01, 3.79331318924517759674e+01, 1.22698760202681370404e+02, -3.06440448118202652945e+01, 3.79525610747211459292e+01, 1.22137443765321904718e+02, 5.61664835929916672618e-01, 1.54633769653514212272e-02, -4.942612208836994446e-03, 5.61430167206599217699e-01, 1.07090760665996039685e-02, 1.06843248933065713274e-02, 3);
INSERT INTO "mark_error" VALUES (1, 3, 5, 6.99999999999999857882e+01, 110.0, -1.12298925632191490817e+01, 4.27554671731186317637e+01, 1.22994385039501580086e+02, -1.12336652904262646046e+01, 4.27745663846410764099e+01, 1.21999999960863121368e+02, 9.94575637128805367659e-01, 1.94454514931791284937e-02, 5.88928708799934304968e-03, 9.94368091566756096e-01, 1.05303301931831197468e-02, 1.05113792550277536375e-02, 3);
INSERT INTO "mark_error" VALUES (1, 3, 6, 6.99999999999999857882e+01, 130.0, 8.1784054296852453092e+00, 4.75757969862274876504e+01, 1.23021516972784468175e+02, 8.1772539019852779063e+00, 4.75943946384863281195e+01, 1.22137384842176174967e+02, 0.884328458809029, 1.15783138986656972124e-02, 2.70894235161992175467e-03, 8.84248507667929728448e-01, 1.01415911320511566151e-02, 1.01345757438511385045e-02, 3);
INSERT INTO "mark_error" VALUES (1, 3, 7, 6.99999999999999857882e+01, 1.50000000000000028414e+02, 2.75856034986098492818e+01, 5.24106603075710779631e+01, 1.23089704980582837379e+02, 2.75584233796749273888e+01, 5.23688336316163471906e+01, 1.23266041348872619205e+02, 1.8325595343225564715e-01, -2.31106321611065576582e-02, 2.53936529233816342399e-02, -1.80009447747045664423e-01, 1.09347529527568185919e-02, 1.07023673268323606111e-02, 3);
INSERT INTO "mark_error" VALUES (1, 3, 8, 6.99999999999999857882e+01, 170.0, 4.69416432946441517523e+01, 5.72189740560753534737e+01, 1.22817003703417498177e+02, 4.69459546651813255371e+01, 5.72114173537519690162e+01, 1.23274868958545894773e+02, 4.57947904809816508375e-01, 8.23409712142143205421e-04, 4.49592061177748591321e-03, -4.57925095833776607534e-01, 1.34424681850345388578e-02, 1.28348150832938157073e-02, 3);
INSERT INTO "mark_error" VALUES (1, 3, 9, 6.99999999999999857882e+01, 190.0, 5.84590886786604855282e+01, 5.99641887937230464453e+01, 1.07384688280104242605e+02, 5.76222870815085599352e+01, 5.98245483609347346049e+01, 1.10116563190958288492e+02, 2.86057282585483152459e+00, 7.43408380610227209617e-02, 2.85402535614748398273e+00, -1.81568473089408155551e-01, 5.01878523255703326566e-02, 4.7618580142356571605e-02, 2);
INSERT INTO "mark_error" VALUES (1, 3, 10, 6.99999999999999857882e+01, 2.10000000000000028419e+02, 67.5129336896745, 6.20303834039076846824e+01, 8.96871489578697804728e+01, 6.73212193666515332788e+01, 6.17782651355207192969e+01, 9.29794974104432156956e+01, 3.30754838756280422629e+00, 6.21933361644104523713e-02, 2.79956144868240563994e+00, -1.7603098942922863479e+00, 3.63467714162719127135e-02, 3.25749405565054633848e-02, 2);
INSERT INTO "mark_error" VALUES (1, 4, 1, 90.0, 30.0, -7.96218662163436334804e+01, 5.06775986286352431164e+00, 1.11756171881958024985e+02, -74.2850159243582, 6.5073669599824341958e+00, 1.09750794703434081608e+02, 5.88013411932794927139e+00, 9.20054254510873636974e-02, 3.60273031965095413831e-01, 5.86836193887928825319e+00, 1.87222893956771677115e-02, 1.57490872843722949647e-02, 2);
INSERT INTO "mark_error" VALUES (1, 4, 2, 90.0, 50.0, -6.45838883203515763415e+01, 8.92251986205023328579e+00, 1.23468556073052312168e+02, -6.46249097219776729144e+01, 8.90662134186413467773e+00, 1.22907236825763888532e+02, 5.63040687439129383662e-01, -0.00724847190493468, 1.8184667643615322341e-02, 5.6270019254800851538e-01, 1.03795221249489699744e-02, 0.00980983682517989, 3);
INSERT INTO "mark_error" VALUES (1, 4, 3, 90.0, 6.99999999999999857882e+01, -4.52174693918499599493e+01, 1.37209687016156181018e+01, 1.23013313501696543996e+02, -4.5231258480392170897e+01, 1.37230128732105267626e+01, 1.22149593518655564139e+02, 8.63832464488714757422e-01, -1.15399680011011055921e-03, 5.71094121056695946253e-03, 8.63812815655655708013e-01, 8.30773853298677304735e-03, 8.20338914625380437317e-03, 3);
INSERT INTO "mark_error" VALUES (1, 4, 4, 90.0, 90.0, -2.58128804097519086728e+01, 1.85343993152301287352e+01, 1.22290408815305411854e+02, -2.58222985142933438842e+01, 1.85433723501488749718e+01, 1.21999999960830905363e+02, 2.90700049545912497794e-01, 1.09783909797783272438e-02, 6.97737306388975745546e-03, 2.90408854474498490105e-01, 7.21950672339202910443e-03, 7.20599056513731867773e-03, 3);
INSERT INTO "mark_error" VALUES (1, 4, 5, 90.0, 110.0, -6.40388737857031209443e+00, 2.33501397811375888124e+01, 1.22419888824703306797e+02, -6.4128433296597684432e+00, 2.33642995616788837773e+01, 1.21999999960829072162e+02, 4.20222996099077650278e-01, 1.59010326594349847562e-02, 5.27902631414664796211e-03, 4.19888863874262885378e-01, 6.24169230683977414864e-03, 6.19676729874554452215e-03, 3);
INSERT INTO "mark_error" VALUES (1, 4, 6, 90.0, 130.0, 1.29991501828948319285e+01, 2.81719277560424821152e+01, 1.22585874773671051226e+02, 1.29967560736514062822e+01, 28.1846482127385, 1.2199999996086759779e+02, 5.86017779640773395222e-01, 1.29224471268578715299e-02, -7.42446156139688539718e-04, 5.85874812803474420697e-01, 6.36780963776349337446e-03, 6.31294699002601586435e-03, 3);
INSERT INTO "mark_error" VALUES (1, 4, 7, 90.0, 1.50000000000000028414e+02, 3.24066078494002525185e+01, 33.0006126993143, 1.23116110644973318242e+02, 3.2405651594070739919e+01, 3.3005262328598746536e+01, 1.22149667304726321508e+02, 9.66454998116573538169e-01, -2.48924398630446424077e-03, 0.00784342206779112, 9.66419963961608452507e-01, 0.00824031785278334, 8.16683049019873222307e-03, 3);
INSERT INTO "mark_error" VALUES (1, 4, 8, 90.0, 170.0, 5.174739131112599466e+01, 3.78072938871843788888e+01, 1.22848926662889823546e+02, 5.17991670869807876434e+01, 3.78222086302031357263e+01, 1.22907272383004652739e+02, 7.9419163810754686561e-02, 2.18253697351186151318e-03, -0.0564305403422994, -5.58418700060268613505e-02, 1.18798617463186494819e-02, 1.12684033461106294926e-02, 3);
INSERT INTO "mark_error" VALUES (1, 4, 9, 90.0, 190.0, 6.42507504263123223591e+01, 4.08424204892537900946e+01, 1.08127373608543877027e+02, 61.4588149339461, 4.02213130498176667498e+01, 1.0975066767048140548e+02, 3.28873256078671749591e+00, 6.45138646861969922152e-02, 2.36570120138850326085e+00, 2.28369358475696238031e+00, 3.5612743705839888797e-02, 3.38952205413490109675e-02, 2);
INSERT INTO "mark_error" VALUES (1, 4, 10, 90.0, 2.10000000000000028419e+02, 7.36105870074856767377e+01, 4.30201926214521179758e+01, 9.05923708281655137852e+01, 6.88007589583495473553e+01, 4.20265540149246064061e+01, 9.13118113512193474434e+01, 4.96380481171960408204e+00, 0.0562310444733938, 2.81272899594077907536e+00, 4.08961695119465939995e+00, 1.32119198778258076232e-02, 7.71597859480600573728e-03, 2);
INSERT INTO "mark_error" VALUES (1, 5, 1, 110.0, 30.0, -7.49900182500299763424e+01, -1.43888191789041197665e+01, 1.12114977173041253878e+02, -6.94089925247055674608e+01, -1.28892808830347327386e+01, 1.09720465448128251745e+02, 6.25540963073222, 1.30131900736635858217e-01, 0.68610371684295, 6.21631685305801, 1.06343263768728154422e-02, 8.58065993357702561095e-03, 3);
INSERT INTO "mark_error" VALUES (1, 5, 2, 110.0, 50.0, -5.97575943993833291756e+01, -1.04822052984027269673e+01, 1.23671025096884449115e+02, -5.98006870875302638541e+01, -1.05029117759015147017e+01, 1.22846158934436985529e+02, 8.26250521290574302391e-01, -0.00719841244577808, 3.12405478753476463851e-03, 8.26213266759797559934e-01, 1.055213471683407421e-02, 9.97397755181529850621e-03, 3);
INSERT INTO "mark_error" VALUES (1, 5, 3, 110.0, 6.99999999999999857882e+01, -4.03884143990180390906e+01, -5.68316722692486209211e+00, 1.23323608521383462741e+02, -4.04123698598361542639e+01, -5.68755053126929421836e+00, 1.21999999960868990458e+02, 1.32383257964410949725e+00, 1.1415294139059527223e-02, 2.43056882913370055077e-02, 1.32356022791041172403e+00, 0.00815855778406549, 8.0551790963230215925e-03, 3);
INSERT INTO "mark_error" VALUES (1, 5, 4, 110.0, 90.0, -20.9907383655976, -0.876999600193144, 122.512744431835, -2.10021792912332294633e+01, -8.66753413523713822641e-01, 1.21999999960829370588e+02, 5.12974435686137320011e-01, 1.27020808843820616484e-02, 8.63383122042402605111e-03, 5.12744471005639579352e-01, 5.95585001238939371059e-03, 5.88111904574280339869e-03, 3);
INSERT INTO "mark_error" VALUES (1, 5, 5, 110.0, 110.0, -1.58402627435118459331e+00, 3.9394936581220978411e+00, 1.22281025870401947484e+02, -1.59202278733464619442e+00, 3.95404244024589157646e+00, 121.999999960774, 2.81515848867141538214e-01, 1.60472935889724790947e-02, 4.25387538245563471411e-03, 2.81025909627874159735e-01, 6.11162878740024485824e-03, 6.0671353046869470893e-03, 3);
INSERT INTO "mark_error" VALUES (1, 5, 6, 110.0, 130.0, 1.78219878421591566559e+01, 8.76625385129730538835e+00, 1.22646333353189973536e+02, 1.78181359871265279082e+01, 8.77483654726531, 1.21999999960831587489e+02, 6.46401851432036211875e-01, 9.25803346881659376677e-03, 1.66949723716547327942e-03, 6.46333392358355074414e-01, 5.68448303807200447379e-03, 5.59833649995711366692e-03, 3);
INSERT INTO "mark_error" VALUES (1, 5, 7, 110.0, 1.50000000000000028414e+02, 3.72247506811914092845e+01, 1.3589028332813530397e+01, 1.23194840083053207995e+02, 3.72283241056700262569e+01, 1.35956397881513719734e+01, 1.21999999960886214007e+02, 1.19486375718917980925e+00, 1.45057933320269401289e-02, -5.061696562636818289e-03, 1.19476498693234933767e+00, 8.28671538554171666079e-03, 8.22275005789666404987e-03, 3);
INSERT INTO "mark_error" VALUES (1, 5, 8, 110.0, 170.0, 5.65695233898269123073e+01, 1.83930719811930210028e+01, 1.22849971206710335987e+02, 5.66166416878616303182e+01, 1.84110000976322858434e+01, 1.22846146914653090223e+02, 5.05586449431515358443e-02, 0.00604506644978133, -4.97781344763255778618e-02, 6.44743551401972918302e-03, 1.19432687136451810838e-02, 6.30892594113970171104e-03, 3);
INSERT INTO "mark_error" VALUES (1, 5, 9, 110.0, 190.0, 6.98358143794717705059e+01, 2.16532136067825717882e+01, 1.08721019708683982681e+02, 6.62244814845595897168e+01, 2.07972567039722839861e+01, 1.09720309626547361856e+02, 3.84356186853896719668e+00, 4.87935408238353920951e-02, 1.99558845122010808381e+00, 3.28452171325922348543e+00, 3.36542607933466783598e-02, 3.1710354957589219349e-02, 2);
INSERT INTO "mark_error" VALUES (1, 5, 10, 110.0, 2.10000000000000028419e+02, 7.99198386582491622238e+01, 2.40583741521101579508e+01, 91.6212717700652, 7.30289929182295622939e+01, 2.24872754069625457873e+01, 9.10308165302363221389e+01, 7.09230171876465931291e+00, 3.58657215813675489535e-01, 2.27195936816314825179e+00, 6.70887260112703831538e+00, 1.49346580772210472259e-02, 7.99466135157300347713e-03, 2);
INSERT INTO "mark_error" VALUES (1, 6, 0, 130.0, 10.0, -8.20207437805888872617e+01, -36.9061378781076, 9.65246015540468818051e+01, -7.19859223797625702445e+01, -3.41187330859732327334e+01, 9.13122354737728301153e+01, 1.16462880857587798284e+01, 6.75184178730707906801e-01, 7.97836419875767449694e-02, 1.16264294319350280915e+01, 1.39114231706469679283e-02, 1.25518735917582498901e-02, 3);
INSERT INTO "mark_error" VALUES (1, 6, 1, 130.0, 30.0, -7.01337763539372218693e+01, -3.37983798466754805636e+01, 1.12304806159209107367e+02, -6.46433504289333882297e+01, -3.23133434181542682499e+01, 1.09750828452917190245e+02, 6.23481452460498708489e+00, 1.37877983591664754481e-01, 8.41215434803594397372e-01, 6.17627808615029927352e+00, 1.90379914741993158666e-02, 1.67569548270401422196e-02, 2);
INSERT INTO "mark_error" VALUES (1, 6, 2, 130.0, 50.0, -5.49468227926005638997e+01, -2.98971139009140394202e+01, 1.23847485993029778224e+02, -5.49832372241976798923e+01, -2.99141273168680754679e+01, 1.22907225269149819265e+02, 9.41119384574678363719e-01, -4.87036383057225154974e-03, -3.17748501755753644595e-03, 9.41101412708891249536e-01, 1.02352635507562527567e-02, 9.75470481337640214769e-03, 3);
INSERT INTO "mark_error" VALUES (1, 6, 3, 130.0, 6.99999999999999857882e+01, -3.55785785496106470309e+01, -2.50947002956755689235e+01, 1.23335132407577035e+02, -3.55897286719764238682e+01, -2.50971830081070557127e+01, 1.2214948496094112329e+02, 1.18570247398074846145e+00, 0.00914089011128029, 1.57253862666703581561e-03, 1.18566619618844382166e+00, 8.47276903728725813702e-03, 8.33581083253822491263e-03, 3);
INSERT INTO "mark_error" VALUES (1, 6, 4, 130.0, 90.0, -16.1765238880313, -2.0284838775919574517e+01, 1.22678115574746044553e+02, -1.61808298199842859332e+01, -2.02765742135621209732e+01, 1.21999999960856186475e+02, 6.78179644225753164299e-01, 9.05885611117814189274e-03, 2.18700213917859872386e-03, 6.78115613889853086071e-01, 0.00627631857470613, 6.23263621819866806689e-03, 3);
INSERT INTO "mark_error" VALUES (1, 6, 5, 130.0, 110.0, 3.23711732076131886159e+00, -1.54668017866043268067e+01, 1.22495659589612358785e+02, 3.22876834701707071673e+00, -1.54562222144618477415e+01, 1.21999999960831743809e+02, 4.95842818151319364439e-01, 1.22800722356178580729e-02, 5.55250507653495383592e-03, 4.95659628780572403261e-01, 6.08048153654846580684e-03, 6.03925945397886052706e-03, 3);
INSERT INTO "mark_error" VALUES (1, 6, 6, 130.0, 130.0, 2.26469678705114496608e+01, -10.6461990454937, 1.22739852903615627606e+02, 2.26382221263830807345e+01, -1.06352966221865496976e+01, 1.21999999960876763798e+02, 7.39984951031894766515e-01, 1.26888505427149578252e-02, 5.85975003226387250454e-03, 7.39852942738816521384e-01, 6.0335162803328993078e-03, 0.00597250491546864, 3);
INSERT INTO "mark_error" VALUES (1, 6, 7, 130.0, 1.50000000000000028414e+02, 4.20538395813312035906e+01, -5.82486324642726405187e+00, 1.23098705418088883334e+02, 4.20471777110759177293e+01, -5.81493012380040319442e+00, 1.2214981803350710265e+02, 9.48962757993624728136e-01, 1.83532097558420509431e-02, 1.19692214298090359586e-02, 9.48709755991302250421e-01, 8.40648502268401612291e-03, 8.33495298890298517979e-03, 3);
INSERT INTO "mark_error" VALUES (1, 6, 8, 130.0, 170.0, 6.14001696454724239532e+01, -1.01034802305943260947e+00, 1.22824731567372737118e+02, 6.14408383911301356769e+01, -0.998538559900456, 1.22907289232654051149e+02, 9.27856583216211255882e-02, 1.39870990341331739512e-03, -4.60095704949115905102e-02, -8.05623925431952075948e-02, 1.13892323570438814411e-02, 1.12756324842801809033e-02, 3);
INSERT INTO "mark_error" VALUES (1, 6, 9, 130.0, 190.0, 7.47691250209268076787e+01, 2.2765669959458580962e+00, 1.08884199355750496348e+02, 7.11004843449350687478e+01, 1.40060386919736568067e+00, 1.09750623090143037071e+02, 3.87000334579736593454e+00, 4.35639209998153614789e-02, 1.89774752493495135752e+00, 3.37245783770224383246e+00, 3.14406951223831568342e-02, 2.90750394485068119898e-02, 2);
INSERT INTO "mark_error" VALUES (1, 6, 10, 130.0, 2.10000000000000028419e+02, 8.50978986285094833857e+01, 4.75376230057739, 9.19413212960459560497e+01, 78.4338396620221, 3.24022115736880067515e+00, 9.13117416924810925121e+01, 6.86271514622536571437e+00, 3.53308357262397398912e-01, 2.45176118107474305674e+00, 6.39997645807272697027e+00, 1.42210147331170329298e-02, 0.00831253156996906, 2);
INSERT INTO "mark_error" VALUES (1, 7, 0, 1.50000000000000028414e+02, 10.0, -7.92026701527480128097e+01, -5.65192637374680586495e+01, 9.87100510085813453997e+01, -7.05063462312243132128e+01, -5.38704319796314905471e+01, 9.29800372489680597692e+01, 1.07459488699112348797e+01, 2.64454744185990664462e+00, -6.87519125773580097593e-01, 1.0392626941246474459e+01, 2.11134831249774231054e-02, 1.82639505343712947593e-02, 3);
INSERT INTO "mark_error" VALUES (1, 7, 1, 1.50000000000000028414e+02, 30.0, -6.4824227438826213187e+01, -5.30752249150751822517e+01, 1.12099696731049249366e+02, -60.8068427164832, -5.1916583071096226833e+01, 1.10116764451248897675e+02, 4.62751027618611665559e+00, 4.27333653636609189785e-01, 3.61114032372709614637e-01, 4.59365409334800123275e+00, 0.051825006253906, 5.03628385263298963825e-02, 2);
INSERT INTO "mark_error" VALUES (1, 7, 2, 1.50000000000000028414e+02, 50.0, -5.01644949838936042834e+01, -4.93162826493830124246e+01, 1.2396226562847830621e+02, -5.01300738006097361659e+01, -4.93033523751067548346e+01, 1.23274777878073507511e+02, 6.88470345627307911406e-01, 1.79883808915853420085e-02, -2.62717779583351816741e-02, 6.87733582428154299748e-01, 2.28537759566422860046e-02, 2.28357569358608979148e-02, 3);
INSERT INTO "mark_error" VALUES (1, 7, 3, 1.50000000000000028414e+02, 6.99999999999999857882e+01, -3.07692817661302164822e+01, -44.5041889182915, 1.23391152068481090963e+02, -3.07425277233365328304e+01, -4.44607718264606219813e+01, 1.23265714878160565599e+02, 1.35407944317773781817e-01, 4.3223654330489809372e-02, -4.40541576895366188137e-02, 1.20519485452936267466e-01, 1.28583609583034063489e-02, 1.17354100878406981955e-02, 3);
INSERT INTO "mark_error" VALUES (1, 7, 4, 1.50000000000000028414e+02, 90.0, -1.13575947050633931925e+01, -3.96775430373127306893e+01, 1.23424994763122171544e+02, -1.13613309051184359073e+01, -3.96863209180614191495e+01, 1.2213746293020278699e+02, 1.28756717539786236237e+00, 2.21417389463955151251e-03, -3.10771833728262650634e-03, 1.28756152146906588384e+00, 1.07639516039386637369e-02, 1.07440151509449223488e-02, 3);
INSERT INTO "mark_error" VALUES (1, 7, 5, 1.50000000000000028414e+02, 110.0, 8.05214627620971867827e+00, -3.48625890406112617361e+01, 1.23287498476052817867e+02, 8.04958963632379109753e+00, -3.48664904379112883248e+01, 1.21999999960885361358e+02, 1.28750696458962243795e+00, -3.17010729370012858674e-03, 1.22622933231843807971e-02, 1.28744466863424356084e+00, 1.07867339650476630474e-02, 1.07528435595189795354e-02, 3);
INSERT INTO "mark_error" VALUES (1, 7, 6, 1.50000000000000028414e+02, 130.0, 2.74649784051744099149e+01, -3.0052549571663949024e+01, 1.23040460076713301876e+02, 2.74599674295973663609e+01, -3.00444865963121046084e+01, 1.22137334636139229361e+02, 9.03175333398719137889e-01, 1.59237184984680445187e-02, 9.12040332643984825999e-03, 0.902988900811323, 1.13768277049640428172e-02, 1.13414071407615078823e-02, 3);
INSERT INTO "mark_error" VALUES (1, 7, 7, 1.50000000000000028414e+02, 1.50000000000000028414e+02, 4.6875890475422146153e+01, -2.52292581505065669498e+01, 1.23038228228963518516e+02, 4.68228080329295224268e+01, -2.51962887013027945224e+01, 1.23266133989814392175e+02, 2.36317088063481173243e-01, 3.06710163587384926353e-02, 2.92700038138838311563e-02, -2.32481619559724184131e-01, 2.08285242404925574621e-02, 2.01598351865439236185e-02, 3);
INSERT INTO "mark_error" VALUES (1, 7, 8, 1.50000000000000028414e+02, 170.0, 6.62385649143706558552e+01, -2.04192159817285556755e+01, 1.22759632094948344159e+02, 6.62231629210055530157e+01, -2.04053549119653858672e+01, 1.23274838182719506109e+02, 0.515622597963916, 0.0067872414366023, 1.93447897475670441136e-02, -0.515214842658844, 1.23919853452463622073e-02, 1.1599597762996691555e-02, 3);
INSERT INTO "mark_error" VALUES (1, 7, 9, 1.50000000000000028414e+02, 190.0, 7.95734492322411313125e+01, -1.71372470254912663274e+01, 1.08959949300907055658e+02, 7.68814547034265842722e+01, -1.77197063246120904982e+01, 1.10116462472589859088e+02, 2.98724222228054125949e+00, 2.12615976947088641813e-01, 2.06278047232754113693e+00, 2.14964376961827774437e+00, 4.20921887076155729068e-02, 3.93379893670170940889e-02, 2);
INSERT INTO "mark_error" VALUES (1, 7, 10, 1.50000000000000028414e+02, 2.10000000000000028419e+02, 9.11023925173609541196e+01, -1.42783485547937161186e+01, 9.29147199495861571012e+01, 8.63673139565301113424e+01, -1.49086046872985349413e+01, 9.29793065139430865463e+01, 4.77727570840276349883e+00, 1.37816386277789360015e+00, 2.8239097649484, 3.5976948331846503315e+00, 1.97095454897942105876e-02, 1.22741989924963958852e-02, 2);
INSERT INTO "mark_error" VALUES (1, 8, 1, 170.0, 30.0, -6.36104126170029502427e+01, -7.22466359139678928604e+01, 1.16300153842976115468e+02, -6.10478429691483341894e+01, -70.9095162345339, 1.12476580524531939882e+02, 4.79315816124960303312e+00, 2.05567836672212322923e+00, 5.75973049141786153093e-01, 4.28871496146997266407e+00, 0.0535726423608855, 5.3075144116014959239e-02, 2);
INSERT INTO "mark_error" VALUES (1, 8, 2, 170.0, 50.0, -4.53761621957693748194e+01, -68.672881433843, 1.22680839772849466836e+02, -4.52852921229514464567e+01, -6.86360669654653747766e+01, 1.2203500223877888686e+02, 6.53237166448929595929e-01, -3.97524751648660537584e-02, -3.66430364897779442534e-02, 6.50986535518631392882e-01, 5.32898627754327738892e-02, 5.19368086740161910563e-02, 3);
INSERT INTO "mark_error" VALUES (1, 8, 3, 170.0, 6.99999999999999857882e+01, -2.59612598815804460636e+01, -6.38452627955862652689e+01, 1.2288186647798501383e+02, -2.59498730199009663976e+01, -6.38624576280517715094e+01, 1.23438334459585945528e+02, 5.56850013405259858245e-01, -1.69089706753009494377e-02, 0.00442014198969483, -5.56575737714315121884e-01, 1.6259946751867714737e-02, 1.58343979699211052925e-02, 3);
INSERT INTO "mark_error" VALUES (1, 8, 4, 170.0, 90.0, -6.5570057116072346659e+00, -59.0100174066229, 1.22954447413801588591e+02, -6.54586476517117166196e+00, -5.90715669985898870217e+01, 1.2306543099344693815e+02, 1.27396341822247682884e-01, -6.854670395415908557e-02, 4.3605668168577946947e-03, -1.07295719694894722828e-01, 1.61688960292038705346e-02, 1.58605497167541645286e-02, 3);
INSERT INTO "mark_error" VALUES (1, 8, 5, 170.0, 110.0, 1.28476140254317794386e+01, -5.41780000906292897883e+01, 1.22970462894838277639e+02, 1.2862677799512187704e+01, -54.2458704787196, 1.23007591094243522893e+02, 7.88150370180193265978e-02, -7.17004115570963329595e-02, 1.61470485133261031952e-03, -3.26825970156861544957e-02, 1.66786467894619282181e-02, 1.25995710271450574169e-02, 3);
INSERT INTO "mark_error" VALUES (1, 8, 6, 170.0, 130.0, 3.22552797486360134362e+01, -4.93553225365915437805e+01, 1.22917090349730671048e+02, 3.2273697428918666219e+01, -4.94301546512060809837e+01, 1.23065442307247664645e+02, 1.67174638099813033242e-01, -8.52663100631901177406e-02, -2.85911151568479522232e-04, -1.43794819368817272664e-01, 1.63477253575103897986e-02, 1.61300116563990944551e-02, 3);
INSERT INTO "mark_error" VALUES (1, 8, 7, 170.0, 1.50000000000000028414e+02, 5.16730647526190622897e+01, -44.572190885809, 1.22877783238077824994e+02, 5.16644140249871739465e+01, -44.5858095934588, 1.23438562778846048215e+02, 5.61011584221597581212e-01, -8.57205563299691386536e-03, 2.43075680435526675403e-04, -5.60946037151055065805e-01, 2.20095509436143942083e-02, 2.12242785710425492518e-02, 3);
INSERT INTO "mark_error" VALUES (1, 8, 8, 170.0, 170.0, 7.10971557236334632517e+01, -3.98343725333088798379e+01, 1.22484369017673913051e+02, 7.09864251463211388699e+01, -3.9758316815285411395e+01, 1.22035011895743693342e+02, 4.69006989314009747893e-01, 6.28676521370137436628e-02, 4.68700719803219756354e-02, 4.62431807719816623247e-01, 7.45506029792731145233e-02, 7.31025671114487324286e-02, 3);
INSERT INTO "mark_error" VALUES (1, 8, 9, 170.0, 190.0, 8.57015232977957879239e+01, -3.59685773426400743355e+01, 1.10238641593414669732e+02, 8.59806360008951600128e+01, -3.43929590102965718765e+01, 1.12475999476444670226e+02, 2.75068124780113665295e+00, 8.47644492929058523955e-01, 8.47022391307703625962e-01, -2.47876647118540605063e+00, 4.50919939935701882816e-02, 4.40495722268183162451e-02, 2);
INSERT INTO "mark_error" VALUES (1, 8, 10, 170.0, 2.10000000000000028419e+02, 99.5078772386623, -3.20597079704123402157e+01, 9.63077615088005245524e+01, 9.91144072989094837566e+01, -2.8007555803230310687e+01, 9.94360907178495523339e+01, 5.13431586676125828461e+00, 1.50229282148813458874e+00, 9.24427176442916276322e-01, -4.82176847177245448961e+00, 1.51923808112740497955e-02, 1.36077841131230659749e-02, 2);
INSERT INTO "mark_error" VALUES (1, 9, 0, 190.0, 10.0, -7.85640656252963083278e+01, -9.47768259059167377227e+01, 1.08216735702287792264e+02, -71.879768808079, -8.63222727081795255816e+01, 9.35892933406797737899e+01, 1.81692422449642698722e+01, -5.32938238858767121541e+00, 4.42272769765272411035e+00, 1.67987889480514951401e+01, 3.82095729161922373351e-02, 3.76248311868358081833e-02, 2);
INSERT INTO "mark_error" VALUES (1, 9, 1, 190.0, 30.0, -5.94924696768125613752e+01, -9.01683406857535629796e+01, 1.11232708906678354307e+02, -5.59810676367086585986e+01, -8.69118784688428718237e+01, 1.05654898612770779212e+02, 7.35162962425570487567e+00, -2.01604508405232696333e+00, 2.66352704699437781155e-01, 7.06513362005753, 3.95000821141882549336e-02, 2.93208899751731533189e-02, 2);
INSERT INTO "mark_error" VALUES (1, 9, 2, 190.0, 50.0, -4.21367640572396524607e+01, -8.09937233408762580211e+01, 1.07851376192679893506e+02, -3.97569507423569348239e+01, -8.37062465959863715152e+01, 1.12767465232884802619e+02, 6.09829691589619216074e+00, 6.17092371186467425481e-01, 2.1831389830918021544e-01, -6.06280557331729941239e+00, 3.6516688346264487841e-02, 3.54712733275731675886e-02, 2);
INSERT INTO "mark_error" VALUES (1, 9, 3, 190.0, 6.99999999999999857882e+01, -2.31103550431346427274e+01, -7.51701753043448519511e+01, 1.07152456260585552175e+02, -2.32742478255932354618e+01, -7.44636342540826774456e+01, 1.10321237219429647781e+02, 3.2507282053380635034e+00, 3.22079957223355, 1.2254775799775151357e-02, -4.40080574922272871329e-01, 2.97145898395986748918e-02, 1.74561399288274271546e-02, 2);
INSERT INTO "mark_error" VALUES (1, 9, 4, 190.0, 90.0, -3.71598687125039894851e+00, -7.0294933185671553133e+01, 1.07162544626114382135e+02, -4.17194116420885485752e+00, -6.8630979903422854706e+01, 1.09944506620669613995e+02, 3.27352216762360592738e+00, 3.14963605961577863823e+00, 4.04894304465139853732e-02, 8.91211513402613064727e-01, 1.96669143934429212217e-02, 1.31339619651431212254e-02, 2);
INSERT INTO "mark_error" VALUES (1, 9, 5, 190.0, 110.0, 1.58278611697387603385e+01, -6.61011145110093849535e+01, 1.07596570783556231274e+02, 1.52229682668529697764e+01, -6.37492022090352108412e+01, 1.0991228416171344406e+02, 3.35557973380388663287e+00, 2.88841913515234471887e+00, 2.40344099214125292429e-02, 1.70770943890692494804e+00, 1.87034701375262610301e-02, 1.41085544701811879675e-02, 2);
INSERT INTO "mark_error" VALUES (1, 9, 6, 190.0, 130.0, 3.53032584253842927077e+01, -6.15625313014171666754e+01, 1.07835560489313166956e+02, 3.46481619838779906226e+01, -5.89893601009303907272e+01, 1.09944561575507009369e+02, 3.39090650951269489965e+00, 2.75922584221179478802e+00, 2.04707979008345725135e-02, 1.97089475613736531123e+00, 1.80779645874814820505e-02, 1.42050343259977097931e-02, 2);
INSERT INTO "mark_error" VALUES (1, 9, 7, 190.0, 1.50000000000000028414e+02, 5.47211813734866510134e+01, -5.67738892155431642541e+01, 1.07905131165657067529e+02, 5.42596590230849642457e+01, -5.52069032147270561967e+01, 110.321373691943, 2.91662063911414071171e+00, 2.83638100146706850779e+00, 1.15172984514565548974e-01, 6.68238781553390670531e-01, 4.25788235044411364493e-02, 1.19758733700681043593e-02, 2);
INSERT INTO "mark_error" VALUES (1, 9, 8, 190.0, 170.0, 7.40674120368864095107e+01, -5.57487464269778953962e+01, 1.1145457925646906006e+02, 7.31512145901148613802e+01, -5.56640499680440115071e+01, 1.12767785833444307281e+02, 1.6034658603904448082e+00, 9.73863660246258255881e-01, 7.04615787256110293057e-01, -1.06854078398792484705e+00, 6.24893899335890179447e-02, 0.0488692664133844, 2);
INSERT INTO "mark_error" VALUES (1, 9, 9, 190.0, 190.0, 9.31524802950910526568e+01, -5.40362990865845489469e+01, 1.12017778730884501217e+02, 8.89895453427877924923e+01, -5.09067924399106601623e+01, 1.05654760070985147995e+02, 8.22264225993758834931e+00, -8.64375753132591517768e-01, -1.75973733664606712956e+00, 7.98639283993077597756e+00, 5.19739907068756043506e-02, 4.93049429603655137155e-02, 3);
INSERT INTO "mark_error" VALUES (1, 9, 10, 190.0, 2.10000000000000028419e+02, 1.08889065706751935641e+02, -4.91069244241953910528e+01, 1.00821736608388604853e+02, 1.02764590357311107031e+02, -4.29476524463668596354e+01, 9.35884542942240216234e+01, 1.13033712952896632226e+01, 5.80279648149311544358e-01, -3.02944909587304778142e+00, 1.0874229445034039543e+01, 3.20935597703631766974e-02, 1.80920427552398802029e-02, 2);
INSERT INTO "mark_error" VALUES (1, 10, 0, 2.10000000000000028419e+02, 10.0, -7.33982655465096769367e+01, -1.11622828739175034224e+02, 9.91447875592721317161e+01, -6.30830257694508205173e+01, -99.480063396864, 8.14119835026988454291e+01, 23.8391120121004, -8.21627407541225096565e+00, 4.83568449046364268184e+00, 2.18509007969519259968e+01, 2.91557645482481628262e-02, 2.36660467986068746848e-02, 2);
INSERT INTO "mark_error" VALUES (1, 10, 1, 2.10000000000000028419e+02, 30.0, -55.2968782655759, -1.03539037643134719242e+02, 9.69937280390142291235e+01, -4.76343548399603520246e+01, -1.0080597673379658374e+02, 9.39996292658389620555e+01, 8.66882429431978529521e+00, -3.34278672554792066762e+00, -4.24341486459147887444e+00, 6.77810049346805598702e+00, 2.20869904500629182786e-02, 5.17285091035427427308e-03, 2);
INSERT INTO "mark_error" VALUES (1, 10, 2, 2.10000000000000028419e+02, 50.0, -3.85125845828503869938e+01, -93.5476184853287, 9.27116040201505171598e+01, -3.30666276230655711279e+01, -9.69190071056310102886e+01, 1.0003201154779922888e+02, 9.72692524941918179592e+00, 5.1347304822407446867e-01, 2.24004288421671660103e+00, -9.45153593801994595935e+00, 1.75992343512991894494e-02, 0.0170248356960295, 2);
INSERT INTO "mark_error" VALUES (1, 10, 3, 2.10000000000000028419e+02, 6.99999999999999857882e+01, -2.05533865873097738581e+01, -8.52435136641138768709e+01, 9.00881339110242720415e+01, -2.04073893816094020792e+01, -8.39937963670751344159e+01, 93.2448158760701, 3.39819798349593593655e+00, 3.21769052084650164502e+00, -3.54096193626023236777e-01, -1.03321686703830217801e+00, 2.10516362794100561628e-02, 1.0807540696203717101e-02, 2);
INSERT INTO "mark_error" VALUES (1, 10, 4, 2.10000000000000028419e+02, 90.0, -1.20195983186679367094e+00, -8.02561885654693156749e+01, 9.00190599424193464966e+01, -2.34220520096666406928e+00, -7.59203148424058582577e+01, 91.4950439592683, 4.72000945572140384598e+00, 3.30763226311005542612e+00, -5.94368235782978607262e-02, 3.36663810783053518704e+00, 1.63113512580626840442e-02, 7.94772028836379824945e-03, 2);
INSERT INTO "mark_error" VALUES (1, 10, 5, 2.10000000000000028419e+02, 110.0, 1.83650879236396704641e+01, -7.61465017045433256726e+01, 90.5116069566053, 1.68964361792399166972e+01, -70.486992905968, 9.12016212090579614368e+01, 5.88753746961052559782e+00, 2.95664369369421065059e+00, 2.36902969302370286497e-01, 5.08567212688873127035e+00, 1.29640535041091603529e-02, 9.06180129895647543114e-03, 2);
INSERT INTO "mark_error" VALUES (1, 10, 6, 2.10000000000000028419e+02, 130.0, 3.80030147069597390441e+01, -7.24552519044678291484e+01, 9.13404882020902419981e+01, 3.6441565792971125858e+01, -6.62876856896322266257e+01, 91.495091001311, 6.36403156426056160199e+00, 2.95423884011140724936e+00, 2.28768778979192816125e-01, 5.63206085954904445145e+00, 1.97405213337000021156e-02, 1.36263613830294606082e-02, 2);
INSERT INTO "mark_error" VALUES (1, 10, 7, 2.10000000000000028419e+02, 1.50000000000000028414e+02, 57.7342746964062, -7.03467755695216538907e+01, 9.36039183135702899073e+01, 5.61848425669740265692e+01, -6.49710430246465904264e+01, 9.32450406997549237093e+01, 5.60607112507889837615e+00, 3.03286987720256417944e+00, 1.30541744653587232782e+00, 4.53002484882737732618e+00, 2.44983430971179375057e-02, 1.55039597075395402941e-02, 2);
INSERT INTO "mark_error" VALUES (1, 10, 8, 2.10000000000000028419e+02, 170.0, 7.67301047411103667164e+01, -71.5844529555175, 9.95389057288199694505e+01, 7.34198756437533148764e+01, -7.04719487277210134825e+01, 1.00032771030705447401e+02, 3.52692291810593161471e+00, 1.12400879323706592849e+00, 2.98208476675655331789e+00, -1.51104041599345562119e+00, 2.93163772984816398126e-02, 8.03380699448178435539e-03, 2);
INSERT INTO "mark_error" VALUES (1, 10, 9, 2.10000000000000028419e+02, 190.0, 95.8577807822086, -7.23727452308087180208e+01, 1.04723177444874266934e+02, 8.81131456029569335407e+01, -6.70920459850896833131e+01, 9.40002135978699726592e+01, 1.42424405298951839426e+01, -2.89282299339842596808e+00, -3.16921624584796, 1.35812712362598677631e+01, 3.02974021448716712701e-02, 2.57644109845774765821e-02, 3);
INSERT INTO "mark_error" VALUES (1, 10, 10, 2.10000000000000028419e+02, 2.10000000000000028419e+02, 1.14617006328927189433e+02, -68.130725304102, 1.0015284930291377918e+02, 1.01146127687575258845e+02, -5.86928516888807294549e+01, 81.4119974668611, 2.49350668193971571886e+01, -5.97991136081294882842e+00, -7.86192828118516562341e+00, 2.28964415001340775295e+01, 3.03526581683558685509e-02, 2.85007366760392268079e-02, 3);
INSERT INTO "ledger" VALUES (1, 'metric', 'aligned_max_mm', '914f457f4f64e70e10c2c6114fe7647443b5455b21d60ad1b3ba2feb138a1ecd', '03d9a11850e4f297f5949d656932e6842e1f1d8ff2c82f5f5f506157eac0930a');
INSERT INTO "ledger" VALUES (2, 'metric', 'aligned_mean_mm', '6745e7463d1aa2af5df36988a138eb227b107b84e25f963cfce9d5956ba4c3c4', 'fe972902da89e32885ab4eecd4bc9faeb31f51f12db539503a9b78b73fa0dccb');
INSERT INTO "ledger" VALUES (3, 'metric', 'aligned_rms_mm', '8b61c79cad507c271631f282feed3711da56504d2585fe9f0aefcc8bf6aca4bd', 'dbb10acf073c44b8cc5313aa2ae5846d0b66dbd53881e6b6668b7f3db8e518fd');
INSERT INTO "ledger" VALUES (4, 'metric', 'aligned_shift_mm', '4172758937301e71248617819f23095cf48d5bcb236dc769edc25e83e75cbaf9', '50b03c416fcd376e61bc5caf1e62c82d03bab1dedeb960039eab8673496d73e6');
INSERT INTO "ledger" VALUES (5, 'metric', 'aligned_turn_deg', 'fbf593097896a669eaa4390e484d0c1f4d3dd52115d778806128c3dbf2c95d9a', 'eb203565281adfc76d966f775fecb42f9740a33554491096b5b19130880f889a');
INSERT INTO "ledger" VALUES (6, 'metric', 'along_normal_mm', 'a1b83106f1607e3f4cdff893a5a86045022f0557cb811e867535880101e8729c', 'eb0966e6a98e66425d8d0def7aaf25a9a57f81f1fd2a17f17512d155f34305eb');
INSERT INTO "ledger" VALUES (7, 'metric', 'along_warp_mm', '27c1b5fe13801e217d7278b9e1cbdec730fc99e22eb7fe3af99ecc65038b243d', '711bff198156a1de54ca13ed6bbfd3b0008eee5f9e6d9682ba6a9e8501114f16');
INSERT INTO "ledger" VALUES (8, 'metric', 'along_weft_mm', 'f11db44c7bc639eff11f9d76b76aefd468ffd7cd6b6c30ba4c99dbe6fa787d69', '4389175fecfaa1eeae38c2436f9d3d4f43079d2c20d1a3c8ba8101f020ebc683');
INSERT INTO "ledger" VALUES (9, 'metric', 'amplitude_mm', '5fe248a4bd2e601a6c05bf74424cba120a53644173d5c15dad464d6b0cdc50f2', '54e613fd0941e3c84d3bd74a91539a1e29fcecd305a38818ae2d7766462e2799');
INSERT INTO "ledger" VALUES (10, 'metric', 'covered_area_mm2', '9c0b373a8bddd690a834299ce41c1c3e9593863dbb66512248241c95768d53aa', 'a8316f2dd732944e02e527af7c1c555a685a344924af97374a6f3280aeabb7cd');
INSERT INTO "ledger" VALUES (11, 'metric', 'distance_mm', '0628bdfb488685fa59866438747d11788e9ba108fd9553d9972ee80cdb875877', '05c74b0f74b8ead9d58bfe7bd10390118bfeb6142be525c6a7b20cc0ede5d13b');
INSERT INTO "ledger" VALUES (12, 'metric', 'drape_coefficient_percent', '839c09c6d46c5795f262c1dbb674e5f522fe350c07913efd63cf2e7930977f15', 'f7e3aa8459886f1027dbc67c9df41d7e106868e161ae47487d6de295fa133467');
INSERT INTO "ledger" VALUES (13, 'metric', 'energy_uJ', '8277de9462b218ca60cdefc8c31b08bca9937c65324530c82eb03ec900b437cb', 'f3a686ea3a804af15d59a73260647e4057aad41f91e112da9263a1dddfa22f81');
INSERT INTO "ledger" VALUES (14, 'metric', 'flat_area_mm2', '6c885d9ace39ca118d7a8923af58e5e46e7ee213562840843c06ef2ca98f449b', 'a8fa61e3bcd5b87adcb01d9dd097c964f16ee4397c39524af8d0e859ecab89da');
INSERT INTO "ledger" VALUES (15, 'metric', 'fold_depth_mm', '9625152dc5346690c1ad22b65625710d052d9df1670746929ad4c2ee619ae184', '049dc4b16e16f3afaf6817ef1c958e87a2c3dfbab341f1f093a5057e86c2a287');
INSERT INTO "ledger" VALUES (16, 'metric', 'folds', '6339e1ea08b7660a96bde42d5e0fdf4d76ac6f2cf3c9253e2752d2e5c6184f24', '753376c41c87e7cd3dc6387f7f63ea2d79d00c5b8b3168e3c7b1bc7d5a0d1058');
INSERT INTO "ledger" VALUES (17, 'metric', 'hausdorff_mm', '6ad453111dd8dfe13501324b7470dd5b1cb2cf20486c5649e81caffd97872021', '10c20b41894e0cdffe17f04657069eddf593145035cae438726e8b6a53f137f6');
INSERT INTO "ledger" VALUES (18, 'metric', 'hem_nodes', '6193bb998c348e2715d4506a11ece7bc6960cee97cb3aa28bff86f152a5edabc', 'a913e47fe62b183fb65e7ac49d28b5d573b27506ac959ed0322e738fce3e4718');
INSERT INTO "ledger" VALUES (19, 'metric', 'max_high_mm', 'ba3a633a457f7d2d6ca41cc887dfa77304a0a95177df194b936cd21adc95dc34', 'b67fcf9f7f343c47c1f4c42de06d075f858eaea5f4034d87de3d067ca56a622a');
INSERT INTO "ledger" VALUES (20, 'metric', 'max_low_mm', '6bc74e0722ba05e2e55a0ac6a6acce8473f16153f7c653eb0d0033507f1eab80', '032361942f15337d26145041d21ddb3300a69bfe6e71ebc420f4d5c2cb40d7ee');
INSERT INTO "ledger" VALUES (21, 'metric', 'max_mm', 'f495f426862c7a942e5a4659c8de15cd1dcf1831df66e4d79c6dc3e96faa552a', 'b4b3846cb3d4f789125b9ae25030eecc7a407dcc3c3d3a13ce57a4055c7efd38');
INSERT INTO "ledger" VALUES (22, 'metric', 'max_px', '435aaea65a5137c4fbe9d2c81e8a820beb942defd34b64c8663a66536169bf3d', '9b06bcbe94b1f6d8fb3f348139dab5a7081da7ae4b3524007cf22140b22f91fa');
INSERT INTO "ledger" VALUES (23, 'metric', 'mean_high_mm', '97e996b1fadca1552044c0d2984e1614ac87880b233e039825335eb7d10c5d6b', '6ef3b3c986c81d674ba399dcbf3f090d1131877dda624ab1dcc2bc3a196eeed3');
INSERT INTO "ledger" VALUES (24, 'metric', 'mean_low_mm', '7c9172ddca8d325a30e229e4b2c7a911ddda5ec5a3d2d737aa5e2203c450fedc', 'ecb5d8164b7af565ff994090cdf84f9096dd6d18aedc883699ea77684ff0bd12');
INSERT INTO "ledger" VALUES (25, 'metric', 'mean_mm', 'f55fa6f50fc6c82d16785c0854e15f325189d319963c5a037a3e1ab282e9bb15', 'b0569aa68bb4a784870524f1da4e98df10dcdb640298f999aae9a8c1cfe89b49');
INSERT INTO "ledger" VALUES (26, 'metric', 'mean_normal_high_mm', '6e1ad01e005da120c8f4f54f51a3424eb68e3f13807ad051558852f9dbd24914', '8b55b8e491b7da3a6a2730f9a61ecf52a3b372c3bb4201645c673069f10d99d6');
INSERT INTO "ledger" VALUES (27, 'metric', 'mean_normal_low_mm', '401e682f498a77236cf7f7264636fcfe0ad65dc39fc8b730a0a07dd78a9fc731', '974bf51a3a9b605cde143a659535468ca4d7dce43291fcc164307340be21fbf1');
INSERT INTO "ledger" VALUES (28, 'metric', 'mean_normal_mm', '7d0425038f6c43a00d5ce2f9e02a410f1be9bc54dc05f87c6be287ff404aeb1a', 'e23e5aca92468b6fc7abda8e2c10bd10af3b86c254d265f1ba9c3caa087a84d4');
INSERT INTO "ledger" VALUES (29, 'metric', 'mean_percent_of_warp_side', '7452bbeabb19c121e70c151aebcfd7266937e50253b79891bca3c757b1e548cc', '2e2dac026a1d09becbf7ee07da4d5f9ffec6074d406eb1f41af1ce0b31a7b32e');
INSERT INTO "ledger" VALUES (30, 'metric', 'mean_percent_of_weft_side', '4612ab83951b36d07819675048b09d8ec58fe196549042c102ebd9dd3b091748', '28bc8c1619b6f1573fe0ab94e45855759e2e980c4e69c809f0ff56143c64ba58');
INSERT INTO "ledger" VALUES (31, 'metric', 'mean_radius_mm', '303571d1b09276b7a2610e8e491edb7c16da4e6e5b4b34220a4ce49acae17595', 'c4ca40c212f499beb00035ef632752dab2faed295850a0bf5f67d2a453144046');
INSERT INTO "ledger" VALUES (32, 'metric', 'median_high_mm', '9c60f85deea43f40bba3cc5003380be224528ec4e03dd2f4b180944a5388f419', 'b2ffa0e1a4fdf8c258638c059f0f9aef9df07da42958c71c775cbc940740560d');
INSERT INTO "ledger" VALUES (33, 'metric', 'median_low_mm', '4cbf092730142634b04691ae1cf4b5b4f976a83441ca542640c0e2937a9a12ac', '0dc1b03725f024e5467f14f08c2b543908e1b5ae24154a3bba7eaaaa46c723f0');
INSERT INTO "ledger" VALUES (34, 'metric', 'median_mm', '0add60be62c1dfeeb94b3ed46cc0d4befb9261b09ecf3efbab446b991024d806', '7b5053508e628201f7f8e0fe9f621b718f712df52e0ae0f678abfd1d30bbdacc');
INSERT INTO "ledger" VALUES (35, 'metric', 'mesh_to_real_max_mm', '578b728844a842525c35a38a6f518b497ef2aa6ebd0502cc21e61f7c5aff7bad', 'b5e3ba0e3a7bbe96a3b5a569a7d738f610ac708e91685c703b03b5d31533a288');
INSERT INTO "ledger" VALUES (36, 'metric', 'mesh_to_real_mean_mm', '9caee18118541353e8a89a374bb6fd7fe33a9d610b1ca38e3dbc0796bf36d6fc', '53375f882f07c86586319905927e4224c8cd737df87e0b29ea5e3584eb7fd61a');
INSERT INTO "ledger" VALUES (37, 'metric', 'object_rms_mm', '160ff27696d3290504fad5b6a6ce3c85159679f307f44e82fbc3f4bac016d30c', '4006e41d0bbaeb230480cc6db269e396d02182629a2a6638772aef95b1ba9a81');
INSERT INTO "ledger" VALUES (38, 'metric', 'p95_high_mm', '81366fe354f404407217095b7f94b8dbd129cdc0d3b9a63042c146f118d781a3', '5846a3cdfba326c4dc629d7a6636bef857f63bf18006aa64bc1c6e747d17fd10');
INSERT INTO "ledger" VALUES (39, 'metric', 'p95_low_mm', 'a4965fd9e8dd5cf938b099a771effbd51c801973dbbbcd93c77d15ad62291209', '24e29ffcedf65566d527fe3b0bf32755e5832e26f3bebc2b2d444aa187f03994');
INSERT INTO "ledger" VALUES (40, 'metric', 'p95_mm', '38f5bcbb390565f43fd42c98384d5016bbf5b717b62331e1792229d1c1a3d886', '253b72ce96c7b62118e3a0982f18b75862785b99e61425310b181e9496b668b3');
INSERT INTO "ledger" VALUES (41, 'metric', 'phase_deg', 'd4444eac2d776fa093d469a30e18b8f9988b7e07972ceeacdd1c1673f8dcb7f5', '437cbc7ca56fc01910945dc6491ed4b139830e8ad29192c1131b9af92414f1e6');
INSERT INTO "ledger" VALUES (42, 'metric', 'real_to_mesh_max_mm', 'fd3c85c4fbe4c86fea2bbc3bcc027484ea09a243d05380a5b6724b5db2873ce9', '74a871af65733c10d341ffbdcbeddef8385231fd01e4412504c68e40a6210095');
INSERT INTO "ledger" VALUES (43, 'metric', 'real_to_mesh_mean_mm', '1f70a536f6436adf8376cd2910ffc09f3bb7906dc361967ac908eb14b551f178', 'c7bb5f846218743ab20aa6a5b200cc47e69abcb321a864f1fc4472526fb04752');
INSERT INTO "ledger" VALUES (44, 'metric', 'residual_per_particle_weight', 'bc56e8c5dab697e8fbb437668a4e3c399bc11984c6726eef1b4156fcb74ba102', '3c689f19c1e8edbebad242cae25c0b0e19dcf6ba092d3c68306d48fd608724c6');
INSERT INTO "ledger" VALUES (45, 'metric', 'rms_high_mm', 'a91d517d01bfc9b78e20c1b1d4d89f4ae90cf5ccaa43074125e31b06085f29e7', '0cf482f86ec1a37d016008030972fab4010e138cc72cedbbb79e1416f66e843e');
INSERT INTO "ledger" VALUES (46, 'metric', 'rms_low_mm', '56f42fe6764e8ec340298aad6bfbed4ccd3f7ba01bb5e4037c0e36bcf84dd220', 'fce448b8bb673930694ba2fe284332d9ee6f2aeb347bb3f4d39ba468c09b1f73');
INSERT INTO "ledger" VALUES (47, 'metric', 'rms_mm', '77d5eaf8553a71d4fdf72378924a8c371ebe3bfde23f349938ca0f7ec73b7558', '1ef50c2c895bcccd75594af20ed7188a8a5517e82276f3941bd85b7153b748ca');
INSERT INTO "ledger" VALUES (48, 'metric', 'rms_normal_mm', '1cc8e361f0928f8bbc3861ac94d5acc6c46b8e5da89745c321ac4b7637061e36', 'b0b7a140ca9c700795466b05a3ffc03375c531aeb40e973b8c29508756ef4db0');
INSERT INTO "ledger" VALUES (49, 'metric', 'rms_px', '8e331f04e15be2830edb7712dddd22ab6988c22b84f8f37d3577c0d40dbe551f', 'd87f1edc80a1cdfe5f5d9d31830b537bc44bdb7c1f5935e3cc2e47bdde31b03e');
INSERT INTO "ledger" VALUES (50, 'metric', 'sigma_distance_mm', '3cd760ac759f8fdc1e52d47f16ddda502c7f5a0d296d1557dda93354a8ed3d53', 'e80680410eeb8ed02ae5668d057a090fad789c97c5e4bb9082cf99278f9e8a44');
INSERT INTO "ledger" VALUES (51, 'metric', 'sigma_mark_mm', 'ee778d3e0b266310970daec49647b21059cb39c5dc61c2e27c767fe667981adb', '644194f388b4eaddc9a5b1b67a47f2a3f70ae9469399b1b2842a5e6dcad3f7bb');
INSERT INTO "ledger" VALUES (52, 'metric', 'sigma_max_mm', '6d0a62d64b0e9f55ff098ebf0f53e5097fa570b888ef5fc087f69688c5aede88', '5affd072ca856e5a82257e2dba02f5fb7a657387b0195c8c2d2abb8ce6c46366');
INSERT INTO "ledger" VALUES (53, 'metric', 'sigma_mean_mm', '4d8f9be743575c97e643cb9e60c29200a27a0c8ed417a466213d856f0b524c37', '723b330ed1b9c3423fde1476a59ec02d26200f5603bab19b697ec07011245fc0');
INSERT INTO "ledger" VALUES (54, 'metric', 'sigma_mean_normal_mm', 'd1e5a920a5aa095d187c19b9e92cc82cf37b3de6b5d26d5f8985d6404efbf3c4', '931afef4cf5e34da6279bf1aa1b71a733fa64ee259ab14807e3c02cef1bc1f17');
INSERT INTO "ledger" VALUES (55, 'metric', 'sigma_median_mm', 'e1122452b3e91fb4f4b21daa994be4423cb1ec4a834dfb3799360b32fb8554fd', 'c5d172463aeff6634800c12c83925ec0b6afb944bfa80e953746d96119acf592');
INSERT INTO "ledger" VALUES (56, 'metric', 'sigma_of_max_mm', '42d08c9b05bad3821c574bd6fd2a830ef7d34c690f6fa8b20e2f63d18796e8a0', '62ccf5cb087ab6112f9074ba59f2686be5e10fe10dbde424c26e3401ec42647a');
INSERT INTO "ledger" VALUES (57, 'metric', 'sigma_of_median_mm', 'e6d3346a0bf0a6fe9b3ca36d8a11ee25da97ed6cdad3e79cbc8b221372fbf89e', '025dd9e55793c581d629f54cdd6163935d5191852f1a45a00ea78029ac87125d');
INSERT INTO "ledger" VALUES (58, 'metric', 'sigma_of_p95_mm', '44c1811b55e3f6dca9713a15dc999022c33739636ffe7da6249f8f459543f850', 'bd29479a92d0d8a0f89f68fe073e785ca83206d76441278457330983ebf15b72');
INSERT INTO "ledger" VALUES (59, 'metric', 'sigma_of_rms_mm', '24986baa7c5e336f7072466ac3a73d0a80565e167792a9c17a0edd5c44be30d5', '0e4088bb79bcc0c4b7b53b0b7e055c08d67eb745759f12a881ae13321df24564');
INSERT INTO "ledger" VALUES (60, 'metric', 'sigma_of_to_surface_mean_mm', '09c6500e924833d93061f115da1513b4aec6049da10ca3ebcb8ce439507f93a8', '25c3a55cc2dafb7f176cc97d8355f614a57534b61f92e3e80c526814874aee22');
INSERT INTO "ledger" VALUES (61, 'metric', 'strain_area_rms_percent', '355c6c2ff945c24df2f7ec60df34e16bae97c9412ab142c3316481f543395156', '73b7ec968a35d1d1d0b55c0754a3ecf765417218f6a9bf7f93b6a9fb3f9fe617');
INSERT INTO "ledger" VALUES (62, 'metric', 'strain_warp_rms_percent', 'ca9e6a4b305f755830f327ff3cd3ac4a1d631e620cae360b1c04720ac7fa43b4', '598211fd9b574a4390524d4d33f87ff3285858e239dfe028d475892037fd66a3');
INSERT INTO "ledger" VALUES (63, 'metric', 'strain_weft_rms_percent', 'bc702ae86d9cef0c15e8662f7ba29db19d8b0e3ef78b2035e55d816d20e4976f', '04c5d69b2b13b9379bdd05a819627d21a496475f6a2d5793a97b9599edf4965f');
INSERT INTO "ledger" VALUES (64, 'metric', 'surface_mean_mm', '1052076494a4305faadf325d8b9332738a61008c1e55bb66f5c64ce163432c97', '348d04bb814f5e85aaacd855f95d42ab75ea04f969c266f2fa6de0b27f3b8d3d');
INSERT INTO "ledger" VALUES (65, 'metric', 'to_surface_max_mm', '6a19a44617efbddcbd67f0d852a6a38c71f19cf50fc5cc0584712792f27dd028', '67d6602d68c10b031a29abe6d8f694aee225c2ab8efccd7b2b728f2643c10aaf');
INSERT INTO "ledger" VALUES (66, 'metric', 'to_surface_mean_high_mm', 'e82897c484cfdc38297cff0bae5cf53825354f520d73ffe563d8a27819cf778a', '0364daa2dac0abcc60acb48cdc1db2fab182906cedcddfc226a2e5f041d36e42');
INSERT INTO "ledger" VALUES (67, 'metric', 'to_surface_mean_low_mm', 'd3c81869ab6209bf484a97bfa471308a58addfae3ba11bb01a693d56c177edd0', '04b3e3a14e072caaabfc60c25f62aa1468740dda92e9612aed559ea73379c1f9');
INSERT INTO "ledger" VALUES (68, 'metric', 'to_surface_mean_mm', 'e656061b5a23aa6acb5a58f1ee59fc6487a7f8a521c7e2e3229a673c7145cab8', '357d23683dff4c8b742d2ba6c752494c93eec9d681fc18691081c1f1244b52f1');
INSERT INTO "ledger" VALUES (69, 'metric', 'to_surface_p95_mm', '3b835257d72b8f08733a98af6931592de8d5f948237a0a07d761b8920d3465e8', '7de04377037f3542cdf729a0b473def7601dfcfc0a126508c1e6d056ea829b29');
INSERT INTO "ledger" VALUES (70, 'metric', 'to_surface_rms_mm', '282ab217a2e0af55110a0a2f3a71beb898a32bba80dff5e34c67aecab7f67c6e', 'af1983747cf596a9b44c6d7d29e8564385f155e32d2c25959ca8da26326182ee');
INSERT INTO "ledger" VALUES (71, 'metric', 'turn_deg', '69d3fd2b25eab95c33ae9761867ecf27986004d47ade85483f6054381f3a79db', 'a21295719858bf4df0ca67acd49c74f2605c5e80674c9c60dc4ae7591d102f22');
INSERT INTO "ledger" VALUES (72, 'metric', 'turned_mean_mm', '2b50584258f43154ba122a660469fc9180a340ef9770c46191df2c2a876b78ac', '672063d37bc0053a3001711164f7266c08dec94817f4df4b2c0fdc898d4ae436');
INSERT INTO "ledger" VALUES (73, 'rig', 'bench1', '563a0ca507c572dc128c903f2d3f4e6b823091a7c6a5e9b426e5b488c750bcb7', '2eeefff24b5369e16c7ee281ecac69de8ac2bcf24332478a763736592b71898a');
INSERT INTO "ledger" VALUES (74, 'calibration', '5699325e9f926c3e3b10b4093cd4b6656c935b345b3273f2bbfac0a10624f078', '5fed676dd2fc6d9a75d1b5618d51f40e687435099123c2e6376d867c9a32f21c', '84a117236a71b46d5907eab1221f115054260828237d15d052c73216f61a669e');
INSERT INTO "ledger" VALUES (75, 'calibration_file', '5699325e9f926c3e3b10b4093cd4b6656c935b345b3273f2bbfac0a10624f078', '23bbfa38d8553092226258464b7fe98c4ad1bfd0ece09a73ce0d65a4d69ea689', '3cabb152cea2925eaeab62a906def180fa20a288fe454145703da67ca86bc869');
INSERT INTO "ledger" VALUES (76, 'recording', '187dd45b255972b0aa0cec994347c2ec8fa5764b59b7c3db4bf3635188ccbb92', 'f937567698e0baaefa982c7eb19541625b56547f0d8c964bce07e653f532db0f', 'f232d0db9f69e06c34d039b35bec8e82f4fdc1637b2c277078238501fd4f0c8f');
INSERT INTO "ledger" VALUES (77, 'sheet', '8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', '0c1392bafbdc566323253ef0da9c7358ea45f804559f28783b1e287f9be3b1c5', 'e88349b190c71c754cad7f6a9ce22a7b4604b113088f683ca8c0d576232dbcfb');
INSERT INTO "ledger" VALUES (78, 'fabric', 'e8f59ff50ff4daeebfb474c33556bfb81b0e50214cc222c98572d1dc3e7b5d95', '2e9eadab2598f395b2904883fcca458c18b859f9e6122e8304baefa69fa70fb9', 'b02d9f9a631f1af256bd814f2aeebcb789755cd1cc29fa589bae4ab369641ac6');
INSERT INTO "ledger" VALUES (79, 'sheet', 'c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', '72545385d11ce7ee5c03bc83d54cdcee012f6a2cacd1256f292905ffd17b998a', 'ca043bb2060fd925549ba97c80d22190fadfce5f2ed9f96ab4217df665e5bf5d');
INSERT INTO "ledger" VALUES (80, 'simulation', 'c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', 'b4ff7947fbefbc395c5d9b4cba4b18d01b91c1b2d36a080ede4b9eab1c530289', '0c16e183388da86785ebffc7e7e7bf8f50ddb64d331974a832e856a0499eced0');
INSERT INTO "ledger" VALUES (81, 'drapemeter', 'c8117563c0b51d678170de8b3b19aa47baba801a78513849e57a8589f7d75c68', '27816cc6dc384024230aeb58b3b69c6d5f8b26f43a40b78642638145b6037862', '9ba56f0f5c578e8aaacf6a9a6095f1b04ef77d3710eafe078b4f3c01081beb75');
INSERT INTO "ledger" VALUES (82, 'comparison', '382ff100672b26ac8b9df0101c34964576d22979e34af91e35e20d4384b4822f', '4aaa9652b4c2129506dcc5ed64368f3f811aa564aa51bb5cb35843908b803b68', '4adfd29eb9842de08b87840fe951a64a4de72ffd851ccb50f690fc89701862c6');
INSERT INTO "ledger" VALUES (83, 'run', '285270bee4d6ef4d431e33a6e0772e8bb21f68210850820063ee661972a6f3ac', '9ed9583b934a3b3f10c0aa3e711e7cbdd7b8f1fc6338f238f39a207d06955907', 'ab0b94eb68c706bad2366f954e7ab752a43d76ecae12d793ea9881544c9147db');
INSERT INTO "run" VALUES (1, '285270bee4d6ef4d431e33a6e0772e8bb21f68210850820063ee661972a6f3ac', '2026-03-01T00:00:00Z', 'version 5', NULL, '0.2.0', 'bench1', '187dd45b255972b0aa0cec994347c2ec8fa5764b59b7c3db4bf3635188ccbb92', 'recording', '5699325e9f926c3e3b10b4093cd4b6656c935b345b3273f2bbfac0a10624f078', 'bench1, joint, 19 sets', 'GO', NULL);
INSERT INTO "run_drape" VALUES (1, '8bf28ce93e497dffec3df210fc7e5b718a7cf4d23c5b880de2fdd3bc90330666', 'C', 'drape_C', 'f843a7d05799e81b27d6e0832da9c36607940cc14a12b7bfeb79dc212328e126', 'GO', NULL, 'undecided', '4.255 mm is above U = 0.005 mm, but the budget lacks grid: simulate two', '382ff100672b26ac8b9df0101c34964576d22979e34af91e35e20d4384b4822f', 4.86514015585540193775e-03, 0);
INSERT INTO "run_comparison" VALUES (1, 1);
INSERT INTO "run_value" VALUES (1, 'calibration', 'cameras', '3', 0);
INSERT INTO "run_value" VALUES (1, 'calibration', 'method', 'joint', 0);
INSERT INTO "run_value" VALUES (1, 'calibration', 'sets', '19', 0);
INSERT INTO "run_value" VALUES (1, 'fabric A', 'areal_density_g_per_m2', '138', 0);
INSERT INTO "run_value" VALUES (1, 'fabric A', 'bending.bias_stiffness_gf_cm2_per_cm', '0.0785181', 1);
INSERT INTO "run_value" VALUES (1, 'fabric A', 'bending.warp', 'A/bending_warp.csv 973608956895', 1);
INSERT INTO "run_value" VALUES (1, 'fabric A', 'bending.weft', 'A/bending_weft.csv 973608956895', 1);
INSERT INTO "run_value" VALUES (1, 'fabric A', 'name', 'A', 0);
INSERT INTO "run_value" VALUES (1, 'fabric A', 'shear.warp', 'A/shear_warp.csv 3220c24c4b1f', 1);
INSERT INTO "run_value" VALUES (1, 'fabric A', 'shear.weft', 'A/shear_weft.csv 3220c24c4b1f', 1);
INSERT INTO "run_value" VALUES (1, 'fabric A', 'stand_ins', 'tensile curves, shear curves, bending hysteresis', 0);
INSERT INTO "run_value" VALUES (1, 'fabric A', 'tensile.warp', 'A/tensile_warp.csv ba79d5b6ca86', 1);
INSERT INTO "run_value" VALUES (1, 'fabric A', 'tensile.weft', 'A/tensile_weft.csv fe8169d4adc3', 1);
INSERT INTO "run_value" VALUES (1, 'scene C', 'fabric', '../fabrics/A.toml', 0);
INSERT INTO "run_value" VALUES (1, 'scene C', 'friction', '0.4', 1);
INSERT INTO "run_value" VALUES (1, 'scene C', 'name', 'C', 0);
INSERT INTO "run_value" VALUES (1, 'scene C', 'object.1.edge_radius_mm', '1.5', 0);
INSERT INTO "run_value" VALUES (1, 'scene C', 'object.1.kind', 'box', 0);
INSERT INTO "run_value" VALUES (1, 'scene C', 'object.1.size_mm', '128, 128, 128', 0);
INSERT INTO "run_value" VALUES (1, 'scene C', 'object.1.x_mm', '-3', 0);
INSERT INTO "run_value" VALUES (1, 'scene C', 'object.1.y_mm', '5', 0);
INSERT INTO "run_value" VALUES (1, 'scene C', 'object.1.yaw_deg', '14', 0);
INSERT INTO "run_value" VALUES (1, 'scene C', 'object.1.z_bottom_mm', '-6', 0);
INSERT INTO "run_value" VALUES (1, 'scene C', 'print', '../print.toml', 0);
INSERT INTO "run_value" VALUES (1, 'scene C', 'set', 'drape_C', 0);
INSERT INTO "run_value" VALUES (1, 'scene C', 'stand_ins', 'friction', 0);
INSERT INTO "run_value" VALUES (1, 'scene C', 'start.clearance_mm', '3', 0);
INSERT INTO "run_value" VALUES (1, 'scene C', 'start.mode', 'flat-from-measured', 0);
INSERT INTO "run_value" VALUES (1, 'scene C', 'table_z_mm', '-6', 0);
INSERT INTO "run_value" VALUES (1, 'simulations', 'C', '11x11, 1 segment', 0);
COMMIT;
