// SPDX-License-Identifier: Apache-2.0
#include "compare/schema/schema.hpp"

#include <fmt/format.h>

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
  rig_name TEXT NOT NULL REFERENCES rig (name)
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE calibration_file (  -- absent: the file was not given at an import
  calibration_sha256 TEXT NOT NULL PRIMARY KEY REFERENCES calibration (sha256),
  method TEXT NOT NULL
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE recording (
  sha256 TEXT NOT NULL PRIMARY KEY,  -- of recording.json
  recorded_on TEXT  -- ISO date, as the recording states it
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
  recording_sha256 TEXT REFERENCES recording (sha256),
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
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE refinement (  -- of a sheet that a coarser one at rest was carried over to
  sheet_sha256 TEXT NOT NULL PRIMARY KEY REFERENCES simulation (sheet_sha256),
  rest_sha256 TEXT NOT NULL  -- of that sheet, which need not be stored
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE drapemeter (
  sheet_sha256 TEXT NOT NULL PRIMARY KEY REFERENCES sheet (sha256),
  centre_x_mm REAL NOT NULL,
  centre_y_mm REAL NOT NULL,
  covered_area_mm2 REAL NOT NULL,
  flat_area_mm2 REAL NOT NULL,
  drape_coefficient_percent REAL,  -- NULL: no flat support under the cloth
  mean_radius_mm REAL NOT NULL,
  folds INTEGER NOT NULL,
  fold_depth_mm REAL NOT NULL
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE hem_harmonic (
  sheet_sha256 TEXT NOT NULL REFERENCES drapemeter (sheet_sha256),
  "order" INTEGER NOT NULL,
  amplitude_mm REAL NOT NULL,
  phase_deg REAL NOT NULL,
  PRIMARY KEY (sheet_sha256, "order")
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE comparison (
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
) STRICT)sql",
    R"sql(CREATE TABLE mark_error (
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
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE simulation_pair (
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
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE surface_comparison (  -- a mesh without material coordinates: no mark corresponds
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
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE branch (  -- an equilibrium of a drape that has several
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
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE branch_turn (  -- on a round object a shape turned is the same shape
  comparison_sha256 TEXT NOT NULL PRIMARY KEY REFERENCES comparison (sha256),
  axis_x_mm REAL NOT NULL,
  axis_y_mm REAL NOT NULL,
  turned_mean_mm REAL NOT NULL,
  turn_deg REAL NOT NULL,
  half_turn INTEGER NOT NULL CHECK (half_turn IN (0, 1))  -- the sheet in its own plane as well
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE ledger (
  sequence INTEGER PRIMARY KEY,
  kind TEXT NOT NULL,  -- table of the row
  key TEXT NOT NULL,   -- its first column that names it
  content_sha256 TEXT NOT NULL,  -- of the row and of the rows that hang on it
  chain_sha256 TEXT NOT NULL,    -- of the entry before and this one
  UNIQUE (kind, key)
) STRICT)sql",
};

constexpr const char* kIndexes[] = {
    R"sql(CREATE INDEX comparison_by_simulation ON comparison (simulated_sha256))sql",
    // All that the views of runs ask of a headline, without the numbers beside it.
    R"sql(CREATE INDEX comparison_in_short ON comparison (sha256, mean_mm, simulated_sha256))sql",
    // All that the views ask of a simulation: its certificate makes the table's own tree deep.
    R"sql(CREATE INDEX simulation_in_short ON simulation (sheet_sha256, simulator, scene,
  fabric_sha256, fabric_stated, grid_rows, grid_cols, segments, model, solver, status))sql",
    R"sql(CREATE INDEX pair_by_measured ON simulation_pair (measured_sha256))sql",
    R"sql(CREATE INDEX pair_by_sheets ON simulation_pair (first_sha256, second_sha256))sql",
};

constexpr const char* kAppendOnly[] = {"metric",
                                       "rig",
                                       "calibration",
                                       "calibration_file",
                                       "calibration_camera",
                                       "recording",
                                       "fabric",
                                       "sheet",
                                       "gap",
                                       "simulation",
                                       "refinement",
                                       "drapemeter",
                                       "hem_harmonic",
                                       "comparison",
                                       "mark_error",
                                       "simulation_pair",
                                       "surface_comparison",
                                       "branch",
                                       "branch_turn",
                                       "acceptance",
                                       "acceptance_figure",
                                       "run",
                                       "run_drape",
                                       "run_repetition",
                                       "run_comparison",
                                       "run_value",
                                       "run_match",
                                       "match_basis",
                                       "real_repeat",
                                       "ledger"};

constexpr const char* kMetrics =
    R"sql(INSERT OR IGNORE INTO metric (name, unit, definition, better) VALUES
('mean_mm', 'mm', 'mean distance between each measured mark and the same material point of the virtual sheet (the paper, section 5); between simulations, of the same material points', 'smaller'),
('sigma_mean_mm', 'mm', 'one standard deviation of mean_mm: sqrt(sum of sigma_distance_mm squared) / marks, for independent marks; without what is common to all marks (calibration)', 'smaller'),
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
('sigma_max_mm', 'mm', 'largest sigma_mark_mm of the sheet', 'smaller'),
('mean_low_mm', 'mm', 'lower end of the 95 % bootstrap interval of mean_mm over the marks (2,000 resamples, fixed start)', 'neither'),
('mean_high_mm', 'mm', 'upper end of it', 'neither'),
('sigma_of_median_mm', 'mm', 'one standard deviation of median_mm from the covariances of the marks, first order', 'smaller'),
('median_low_mm', 'mm', 'lower end of the 95 % bootstrap interval of median_mm', 'neither'),
('median_high_mm', 'mm', 'upper end of it', 'neither'),
('sigma_of_rms_mm', 'mm', 'one standard deviation of rms_mm: sqrt(sum of (distance sigma_distance) squared) / (marks rms), first order', 'smaller'),
('rms_low_mm', 'mm', 'lower end of the 95 % bootstrap interval of rms_mm', 'neither'),
('rms_high_mm', 'mm', 'upper end of it', 'neither'),
('sigma_of_p95_mm', 'mm', 'one standard deviation of p95_mm from the covariances of the marks, first order', 'smaller'),
('p95_low_mm', 'mm', 'lower end of the 95 % bootstrap interval of p95_mm', 'neither'),
('p95_high_mm', 'mm', 'upper end of it', 'neither'),
('sigma_of_max_mm', 'mm', 'sigma_distance_mm of the mark with the largest distance', 'smaller'),
('max_low_mm', 'mm', 'lower end of the 95 % bootstrap interval of max_mm', 'neither'),
('max_high_mm', 'mm', 'upper end of it: never above max_mm', 'neither'),
('mean_normal_mm', 'mm', 'mean of along_normal_mm: positive when the real cloth lies on the printed side of the virtual one', 'neither'),
('sigma_mean_normal_mm', 'mm', 'one standard deviation of mean_normal_mm for independent marks', 'smaller'),
('mean_normal_low_mm', 'mm', 'lower end of the 95 % bootstrap interval of mean_normal_mm', 'neither'),
('mean_normal_high_mm', 'mm', 'upper end of it', 'neither'),
('rms_normal_mm', 'mm', 'root of the mean square of along_normal_mm', 'smaller'),
('to_surface_mean_mm', 'mm', 'mean distance of the measured marks to the nearest point of the virtual sheet, whichever material point that is', 'smaller'),
('to_surface_max_mm', 'mm', 'largest of these', 'smaller'),
('aligned_mean_mm', 'mm', 'mean distance that would be left if the real marks were moved as one rigid body onto the virtual ones (Kabsch 1976); never part of mean_mm', 'smaller'),
('aligned_rms_mm', 'mm', 'root mean square that would be left', 'smaller'),
('aligned_max_mm', 'mm', 'largest distance that would be left', 'smaller'),
('aligned_shift_mm', 'mm', 'how far that move takes the centroid of the real marks', 'smaller'),
('aligned_turn_deg', 'deg', 'angle of that move', 'smaller'),
('strain_warp_rms_percent', '%', 'RMS over neighbouring marks along the warp of the real minus the virtual length of the straight line between them, over its length on the print', 'smaller'),
('strain_weft_rms_percent', '%', 'the same along the weft', 'smaller'),
('strain_area_rms_percent', '%', 'the same for the area between four marks', 'smaller'),
('sigma_of_to_surface_mean_mm', 'mm', 'one standard deviation of to_surface_mean_mm: of each distance sqrt(u'' C u), u the unit vector from the mark to the nearest point; marks independent', 'smaller'),
('to_surface_mean_low_mm', 'mm', 'lower end of the 95 % bootstrap interval of to_surface_mean_mm', 'neither'),
('to_surface_mean_high_mm', 'mm', 'upper end of it', 'neither'),
('to_surface_rms_mm', 'mm', 'root mean square of the distances of the measured marks to the nearest point of the surface', 'smaller'),
('to_surface_p95_mm', 'mm', '95th percentile of these', 'smaller'),
('real_to_mesh_mean_mm', 'mm', 'mean distance from the surface between the measured marks (cells with four of them, two triangles each) to the nearest point of the mesh, over the area', 'smaller'),
('real_to_mesh_max_mm', 'mm', 'largest of these: the Hausdorff distance in one direction, sampled every 5 mm or closer', 'smaller'),
('mesh_to_real_mean_mm', 'mm', 'the other direction; it contains the hem and the gaps, where no mark was measured', 'smaller'),
('mesh_to_real_max_mm', 'mm', 'the Hausdorff distance in the other direction', 'smaller'),
('surface_mean_mm', 'mm', 'mean distance from either virtual surface to the nearest point of the other, over the area, in both directions', 'smaller'),
('rms_px', 'px', 'RMS distance of the target''s points from where the calibrated camera sees them', 'smaller'),
('max_px', 'px', 'largest of these', 'smaller'),
('object_rms_mm', 'mm', 'RMS distance of the target''s points from their rays', 'smaller'),
('energy_uJ', 'uJ', 'gravity, elastic and contact energy of an equilibrium as drape-branches states it; only differences within one list mean anything', 'neither'),
('residual_per_particle_weight', '1', 'largest net force on a particle of an equilibrium, in weights of a particle', 'smaller'),
('hem_nodes', '1', 'folds of the border as drape-branches counts them: crests that stand out by 3 mm', 'neither'),
('turned_mean_mm', 'mm', 'mean_mm after the turn of the virtual sheet about the vertical through the middle of a round object that makes it smallest', 'smaller'),
('turn_deg', 'deg', 'that turn, from x to y', 'neither'),
('hausdorff_mm', 'mm', 'largest distance from either virtual surface to the nearest point of the other, sampled every 5 mm or closer', 'smaller'),
('covered_area_mm2', 'mm2', 'area of the shadow of the cloth on the table, light from straight above', 'neither'),
('flat_area_mm2', 'mm2', 'area of the patch before draping', 'neither'),
('drape_coefficient_percent', '%', '(shadow - flat top of the object) / (flat cloth - flat top) (Cusick 1968)', 'neither'),
('mean_radius_mm', 'mm', 'mean over 720 directions of the radius of the shadow about the object', 'neither'),
('folds', '1', 'crests of that radius that stand out by 2 % of its mean', 'neither'),
('fold_depth_mm', 'mm', 'mean crest minus mean valley of that radius', 'neither'),
('amplitude_mm', 'mm', 'amplitude of one harmonic of that radius over the angle', 'neither'),
('phase_deg', 'deg', 'angle of the first crest of the harmonic times its order', 'neither'))sql";

}  // namespace

std::vector<std::string> table_statements() {
  std::vector<std::string> statements = {std::begin(kTables), std::end(kTables)};
  for (std::string& statement : run_table_statements()) statements.push_back(std::move(statement));
  return statements;
}

std::vector<std::string> surrounding_statements() {
  std::vector<std::string> statements = {kMetrics};
  for (std::string& statement : view_statements()) statements.push_back(std::move(statement));
  statements.insert(statements.end(), std::begin(kIndexes), std::end(kIndexes));
  for (std::string& statement : run_view_statements()) statements.push_back(std::move(statement));
  // Tables 1 to 12 of the paper: experiments A to F, real against virtual and virtual pairs.
  for (int experiment = 0; experiment < 6; ++experiment) {
    const char scene = static_cast<char>('A' + experiment);
    statements.push_back(fmt::format(
        "CREATE VIEW v_table{} AS SELECT grid_size, segments, mean_dist_mm, marks, measured, "
        "measurement FROM v_real_vs_virtual WHERE scene = '{}' AND branch IS NULL AND "
        "coalesce(state, 'current') = 'current'",
        2 * experiment + 1, scene));
    statements.push_back(
        fmt::format("CREATE VIEW v_table{} AS SELECT pair, mean_dist_mm, points, measured, "
                    "measurement FROM v_virtual_vs_virtual WHERE scene = '{}' AND "
                    "coalesce(state, 'current') = 'current'",
                    2 * experiment + 2, scene));
  }
  for (const char* table : kAppendOnly) {
    for (const char* change : {"UPDATE", "DELETE"}) {
      statements.push_back(
          fmt::format("CREATE TRIGGER {0}_no_{1} BEFORE {1} ON {0} BEGIN SELECT RAISE(ABORT, 'the "
                      "store only grows: rows of {0} are never changed'); END",
                      table, change));
    }
  }
  return statements;
}

}  // namespace drape::compare
