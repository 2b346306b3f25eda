// SPDX-License-Identifier: Apache-2.0
#include "compare/schema/schema.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <regex>
#include <sstream>

#include "core/error.hpp"

namespace drape::compare {
namespace {

/// Every table. A comment that begins with "smaller:", "larger:" or "neither:" makes its column a
/// metric: it states which value is better, and the definition. The name of a metric ends in its
/// unit. "since 9:" and "smaller, since 9:" mark a column of a later store version.
constexpr const char* kTables = R"sql(CREATE TABLE metric (
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
  rms_px REAL NOT NULL,  -- smaller: RMS distance of the target's points from where the calibrated camera sees them
  max_px REAL NOT NULL,  -- smaller: largest of these
  object_rms_mm REAL NOT NULL,  -- smaller: RMS distance of the target's points from their rays
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
  sigma_median_mm REAL,  -- smaller: median of sigma_mark_mm over the sheet
  sigma_max_mm REAL,  -- smaller: largest sigma_mark_mm of the sheet
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
  grid_rows INTEGER,  -- of a grid of particles, or of another simulator's points; NULL: a mesh
  grid_cols INTEGER,
  segments INTEGER,  -- NULL: another simulator
  model TEXT NOT NULL,
  solver TEXT,  -- NULL: the one that each model has today
  status TEXT NOT NULL,
  at_rest INTEGER CHECK (at_rest IN (0, 1)),  -- NULL: not stated
  certificate_sha256 TEXT,
  certificate_json TEXT,  -- names end in their units
  spacing_mm REAL,  -- since 9: spacing of the finest mesh; NULL: a grid
  from_measured INTEGER CHECK (from_measured IN (0, 1)),  -- since 9: began in the measured shape
  CHECK ((grid_rows IS NULL) = (grid_cols IS NULL) AND (grid_rows IS NULL) <> (spacing_mm IS NULL))
) STRICT, WITHOUT ROWID;

CREATE TABLE refinement (  -- of a sheet that a coarser one at rest was carried over to
  sheet_sha256 TEXT NOT NULL PRIMARY KEY REFERENCES simulation (sheet_sha256),
  rest_sha256 TEXT NOT NULL  -- of that sheet, which need not be stored
) STRICT, WITHOUT ROWID;

CREATE TABLE drapemeter (
  sheet_sha256 TEXT NOT NULL PRIMARY KEY REFERENCES sheet (sha256),
  centre_x_mm REAL NOT NULL,
  centre_y_mm REAL NOT NULL,
  covered_area_mm2 REAL NOT NULL,  -- neither: area of the shadow of the cloth on the table, light from straight above
  flat_area_mm2 REAL NOT NULL,  -- neither: area of the patch before draping
  drape_coefficient_percent REAL,  -- neither: (shadow - flat top of the object) / (flat cloth - flat top) (Cusick 1968)
  mean_radius_mm REAL NOT NULL,  -- neither: mean over 720 directions of the radius of the shadow about the object
  folds INTEGER NOT NULL,  -- neither: crests of that radius that stand out by 2 % of its mean
  fold_depth_mm REAL NOT NULL  -- neither: mean crest minus mean valley of that radius
) STRICT, WITHOUT ROWID;

CREATE TABLE hem_harmonic (
  sheet_sha256 TEXT NOT NULL REFERENCES drapemeter (sheet_sha256),
  "order" INTEGER NOT NULL,
  amplitude_mm REAL NOT NULL,  -- neither: amplitude of one harmonic of that radius over the angle
  phase_deg REAL NOT NULL,  -- neither: angle of the first crest of the harmonic times its order
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
  mean_mm REAL NOT NULL,  -- smaller: mean distance between each measured mark and the same material point of the virtual sheet (the paper, section 5); between simulations, of the same material points
  sigma_mean_mm REAL,  -- smaller: one standard deviation of mean_mm: sqrt(sum of sigma_distance_mm squared) / marks, for independent marks; without what is common to all marks (calibration)
  median_mm REAL NOT NULL,  -- smaller: median distance
  rms_mm REAL NOT NULL,  -- smaller: root of the mean squared distance
  p95_mm REAL NOT NULL,  -- smaller: 95th percentile of the distances, linear between order statistics
  max_mm REAL NOT NULL,  -- smaller: largest distance
  worst_row INTEGER NOT NULL,
  worst_col INTEGER NOT NULL,
  mean_percent_of_warp_side REAL NOT NULL,  -- smaller: mean_mm over the side of the patch along the warp
  mean_percent_of_weft_side REAL NOT NULL,  -- smaller: mean_mm over the side of the patch along the weft
  -- from here on NULL in rows of metrics version 1, which did not have them
  mean_low_mm REAL,  -- neither: lower end of the 95 % bootstrap interval of mean_mm over the marks (2,000 resamples, fixed start)
  mean_high_mm REAL,  -- neither: upper end of it
  sigma_of_median_mm REAL,  -- smaller: one standard deviation of median_mm from the covariances of the marks, first order
  median_low_mm REAL,  -- neither: lower end of the 95 % bootstrap interval of median_mm
  median_high_mm REAL,  -- neither: upper end of it
  sigma_of_rms_mm REAL,  -- smaller: one standard deviation of rms_mm: sqrt(sum of (distance sigma_distance) squared) / (marks rms), first order
  rms_low_mm REAL,  -- neither: lower end of the 95 % bootstrap interval of rms_mm
  rms_high_mm REAL,  -- neither: upper end of it
  sigma_of_p95_mm REAL,  -- smaller: one standard deviation of p95_mm from the covariances of the marks, first order
  p95_low_mm REAL,  -- neither: lower end of the 95 % bootstrap interval of p95_mm
  p95_high_mm REAL,  -- neither: upper end of it
  sigma_of_max_mm REAL,  -- smaller: sigma_distance_mm of the mark with the largest distance
  max_low_mm REAL,  -- neither: lower end of the 95 % bootstrap interval of max_mm
  max_high_mm REAL,  -- neither: upper end of it: never above max_mm
  mean_normal_mm REAL,  -- neither: mean of along_normal_mm: positive when the real cloth lies on the printed side of the virtual one
  sigma_mean_normal_mm REAL,  -- smaller: one standard deviation of mean_normal_mm for independent marks
  mean_normal_low_mm REAL,  -- neither: lower end of the 95 % bootstrap interval of mean_normal_mm
  mean_normal_high_mm REAL,  -- neither: upper end of it
  rms_normal_mm REAL,  -- smaller: root of the mean square of along_normal_mm
  to_surface_mean_mm REAL,  -- smaller: mean distance of the measured marks to the nearest point of the virtual sheet, whichever material point that is
  to_surface_max_mm REAL,  -- smaller: largest of these
  aligned_mean_mm REAL,  -- smaller: mean distance that would be left if the real marks were moved as one rigid body onto the virtual ones (Kabsch 1976); never part of mean_mm
  aligned_rms_mm REAL,  -- smaller: root mean square that would be left
  aligned_max_mm REAL,  -- smaller: largest distance that would be left
  aligned_shift_mm REAL,  -- smaller: how far that move takes the centroid of the real marks
  aligned_turn_deg REAL,  -- smaller: angle of that move
  strain_warp_rms_percent REAL,  -- smaller: RMS over neighbouring marks along the warp of the real minus the virtual length of the straight line between them, over its length on the print
  strain_weft_rms_percent REAL,  -- smaller: the same along the weft
  strain_area_rms_percent REAL,  -- smaller: the same for the area between four marks
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
  distance_mm REAL NOT NULL,  -- smaller: distance of one mark
  along_warp_mm REAL NOT NULL,  -- neither: real minus virtual along the warp tangent of the virtual sheet
  along_weft_mm REAL NOT NULL,  -- neither: real minus virtual along the weft tangent of the virtual sheet
  along_normal_mm REAL NOT NULL,  -- neither: real minus virtual along the normal of the printed side of the virtual sheet
  sigma_mark_mm REAL,  -- smaller: one standard deviation of the mark along its worst direction: root of the largest eigenvalue of its covariance
  sigma_distance_mm REAL,  -- smaller: one standard deviation of the distance: sqrt(u' C u), u the unit vector from the real to the virtual point, C the covariance of the mark
  views INTEGER,
  PRIMARY KEY (comparison_id, "row", "col")
) STRICT, WITHOUT ROWID;

CREATE TABLE simulation_pair (
  sha256 TEXT NOT NULL PRIMARY KEY CHECK (length(sha256) = 64),
  measured_sha256 TEXT REFERENCES sheet (sha256),  -- NULL: no real cloth, points of the coarsest grid
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
  surface_mean_mm REAL,  -- smaller: mean distance from either virtual surface to the nearest point of the other, over the area, in both directions
  hausdorff_mm REAL  -- smaller: largest distance from either virtual surface to the nearest point of the other, sampled every 5 mm or closer
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
  sigma_of_to_surface_mean_mm REAL,  -- smaller: one standard deviation of to_surface_mean_mm: of each distance sqrt(u' C u), u the unit vector from the mark to the nearest point; marks independent
  to_surface_mean_low_mm REAL,  -- neither: lower end of the 95 % bootstrap interval of to_surface_mean_mm
  to_surface_mean_high_mm REAL,  -- neither: upper end of it
  to_surface_rms_mm REAL NOT NULL,  -- smaller: root mean square of the distances of the measured marks to the nearest point of the surface
  to_surface_p95_mm REAL NOT NULL,  -- smaller: 95th percentile of these
  to_surface_max_mm REAL NOT NULL,
  real_to_mesh_mean_mm REAL,  -- smaller: mean distance from the surface between the measured marks (cells with four of them, two triangles each) to the nearest point of the mesh, over the area
  real_to_mesh_max_mm REAL,  -- smaller: largest of these: the Hausdorff distance in one direction, sampled every 5 mm or closer
  mesh_to_real_mean_mm REAL,  -- smaller: the other direction; it contains the hem and the gaps, where no mark was measured
  mesh_to_real_max_mm REAL,  -- smaller: the Hausdorff distance in the other direction
  UNIQUE (measured_sha256, mesh_sha256, metrics_version)
) STRICT, WITHOUT ROWID;

CREATE TABLE branch (  -- an equilibrium of a drape that has several
  sheet_sha256 TEXT NOT NULL PRIMARY KEY REFERENCES simulation (sheet_sha256),
  branches_sha256 TEXT NOT NULL,  -- of branches.json, which lists all that were found together
  number INTEGER NOT NULL,  -- by energy; 1 has the least
  found INTEGER NOT NULL,  -- how many there are in that list
  energy_uJ REAL NOT NULL,  -- neither: gravity, elastic and contact energy of an equilibrium as drape-branches states it; only differences within one list mean anything
  residual_per_particle_weight REAL NOT NULL,  -- smaller: largest net force on a particle of an equilibrium, in weights of a particle
  stable INTEGER NOT NULL CHECK (stable IN (0, 1)),
  starts INTEGER NOT NULL,
  hem_nodes INTEGER NOT NULL,  -- neither: folds of the border as drape-branches counts them: crests that stand out by 3 mm
  scene_round INTEGER NOT NULL CHECK (scene_round IN (0, 1))
) STRICT, WITHOUT ROWID;

CREATE TABLE branch_turn (  -- on a round object a shape turned is the same shape
  comparison_sha256 TEXT NOT NULL PRIMARY KEY REFERENCES comparison (sha256),
  axis_x_mm REAL NOT NULL,
  axis_y_mm REAL NOT NULL,
  turned_mean_mm REAL NOT NULL,  -- smaller: mean_mm after the turn of the virtual sheet about the vertical through the middle of a round object that makes it smallest
  turn_deg REAL NOT NULL,  -- neither: that turn, from x to y
  half_turn INTEGER NOT NULL CHECK (half_turn IN (0, 1))  -- the sheet in its own plane as well
) STRICT, WITHOUT ROWID;

CREATE TABLE acceptance (
  sha256 TEXT NOT NULL PRIMARY KEY CHECK (length(sha256) = 64),  -- of acceptance.json
  rig_name TEXT NOT NULL REFERENCES rig (name),
  calibration_sha256 TEXT NOT NULL,  -- of the calibration.json that was accepted
  date TEXT,  -- ISO date of the test, as the operator states it
  valid_until TEXT,
  positions INTEGER NOT NULL,
  verdict TEXT NOT NULL CHECK (verdict IN ('GO', 'NO-GO')),
  cause TEXT
) STRICT, WITHOUT ROWID;

CREATE TABLE acceptance_figure (
  acceptance_sha256 TEXT NOT NULL REFERENCES acceptance (sha256),
  name TEXT NOT NULL,
  unit TEXT NOT NULL,
  value REAL,  -- NULL: not measured
  expanded_uncertainty REAL,
  maximum_permissible REAL,
  place TEXT NOT NULL,
  verdict TEXT NOT NULL CHECK (verdict IN ('GO', 'NO-GO')),
  PRIMARY KEY (acceptance_sha256, name)
) STRICT, WITHOUT ROWID;

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
  match TEXT NOT NULL CHECK (match IN ('inside', 'outside', 'undecided', 'none')),
  match_reason TEXT NOT NULL,
  headline_sha256 TEXT REFERENCES comparison (sha256),  -- the simulation chosen beforehand
  expanded_uncertainty_mm REAL,  -- U (95 %) of its mean distance; at least, where a part is missing
  budget_complete INTEGER CHECK (budget_complete IN (0, 1)),
  match_limit_mm REAL,  -- since 10: scatter of the repeats, else the tolerance; NULL: no limit
  PRIMARY KEY (run, measured_sha256)
) STRICT, WITHOUT ROWID;

CREATE TABLE run_match (  -- what the match of a drape rests on
  sha256 TEXT NOT NULL PRIMARY KEY CHECK (length(sha256) = 64),  -- of the run's and the sheet's
  run_sha256 TEXT NOT NULL REFERENCES run (sha256),
  measured_sha256 TEXT NOT NULL REFERENCES sheet (sha256),
  rests_on TEXT NOT NULL,  -- empty: nothing could be judged
  significance REAL NOT NULL CHECK (significance > 0 AND significance < 1),
  repeats INTEGER NOT NULL,  -- real drapes that count as repeats, its own among them
  p REAL  -- that one more repeat lies as far out, by all bases together (Cauchy)
) STRICT, WITHOUT ROWID;

CREATE TABLE match_basis (  -- one thing that a match is judged against
  match_sha256 TEXT NOT NULL REFERENCES run_match (sha256),
  basis TEXT NOT NULL,
  verdict TEXT NOT NULL CHECK (verdict IN ('inside', 'outside', 'undecided')),
  value REAL,
  limit_value REAL,
  unit TEXT NOT NULL,  -- of both
  p REAL,
  reason TEXT NOT NULL,
  PRIMARY KEY (match_sha256, basis)
) STRICT, WITHOUT ROWID;

CREATE TABLE real_repeat (  -- a laying of a drape
  match_sha256 TEXT NOT NULL REFERENCES run_match (sha256),
  sheet_sha256 TEXT NOT NULL REFERENCES sheet (sha256),
  set_name TEXT NOT NULL,
  repeat TEXT NOT NULL,
  face TEXT,  -- side of the cloth that lies up
  left_out TEXT,  -- why it is not among the repeats
  from_own_rms_mm REAL,  -- of the marks, from the drape's own; NULL: its own
  PRIMARY KEY (match_sha256, sheet_sha256)
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

CREATE TABLE run_repetition (  -- a run stored again after another run of its photographs
  sha256 TEXT NOT NULL PRIMARY KEY CHECK (length(sha256) = 64),  -- of run_sha256, date and count
  run_sha256 TEXT NOT NULL REFERENCES run (sha256),
  date TEXT NOT NULL  -- UTC, ISO 8601: when it was stored again
) STRICT, WITHOUT ROWID;

CREATE TABLE blob (  -- content of a sheet, a list, a mesh, a calibration or a record beside them
  sha256 TEXT NOT NULL PRIMARY KEY CHECK (length(sha256) = 64),
  size INTEGER NOT NULL,
  packed BLOB NOT NULL  -- by zlib
) STRICT;

CREATE TABLE file (  -- where content lay when it was stored
  sha256 TEXT NOT NULL,
  path TEXT NOT NULL,  -- from the store's folder
  manifest INTEGER NOT NULL,  -- number of the one that lists it
  PRIMARY KEY (sha256, path)
) STRICT, WITHOUT ROWID;

CREATE TABLE listed (  -- rows of one table with one key, as a manifest lists them
  sequence INTEGER PRIMARY KEY,
  kind TEXT NOT NULL,  -- table
  key TEXT NOT NULL,
  number INTEGER,  -- that this store gave the row
  sha256 TEXT NOT NULL,  -- of the rows
  UNIQUE (kind, key)
) STRICT;

CREATE TABLE manifest (  -- of one addition to the store
  number INTEGER PRIMARY KEY,
  previous_sha256 TEXT NOT NULL,  -- of the manifest before; empty: the first
  last INTEGER NOT NULL,  -- sequence of the last row that it lists
  file_size INTEGER NOT NULL,  -- bytes of the store with it
  sha256 TEXT NOT NULL
) STRICT)sql";

/// Unit of a metric, from the end of its name.
std::string unit_of(const std::string& name) {
  if (name.find("percent") != std::string::npos) return "%";
  for (const char* unit : {"mm2", "mm", "px", "deg", "uJ"})
    if (name.ends_with(std::string("_") + unit)) return unit;
  return "1";
}

Relation relation_of(const std::string& statement) {
  static const std::regex column(R"re(\s*"?(\w+)"? (?:TEXT|INTEGER|REAL|BLOB)\b)re"),
      metric(R"re(-- (smaller|larger|neither)?(?:, )?(?:since (\d+))?: )re");
  constexpr auto kFromStart = std::regex_constants::match_continuous;
  Relation relation;
  relation.statement = statement;
  relation.name = statement.substr(13, statement.find(' ', 13) - 13);
  std::istringstream lines(statement);
  std::smatch part;
  for (std::string line; std::getline(lines, line);) {
    if (!std::regex_search(line, part, column, kFromStart)) continue;
    RelationColumn& one = relation.columns.emplace_back(RelationColumn{.name = part[1]});
    const std::string comment = line.substr(std::min(line.find("-- "), line.size()));
    if (!std::regex_search(comment, part, metric, kFromStart)) continue;
    one.unit = unit_of(one.name);
    one.better = part[1];
    one.definition = part.suffix();
    if (part[2].matched) one.since = std::stoi(part[2]);
  }
  return relation;
}

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

// Indexes and views in the order of their creation. `state`, `sheet_state` and the others are the
// queries and expressions from schema.hpp.
constexpr const char* kStatements[] = {
    R"sql(CREATE INDEX comparison_by_simulation ON comparison (simulated_sha256))sql",
    // Everything that the views of runs need of a headline except its numbers.
    R"sql(CREATE INDEX comparison_in_short ON comparison (sha256, mean_mm, simulated_sha256))sql",
    // Columns of a simulation that the views show, without its certificate, which is long.
    R"sql(CREATE INDEX simulation_in_short ON simulation (sheet_sha256, simulator, scene,
  fabric_sha256, fabric_stated, grid_rows, grid_cols, spacing_mm, from_measured, segments, model,
  solver, status))sql",
    R"sql(CREATE INDEX pair_by_measured ON simulation_pair (measured_sha256))sql",
    R"sql(CREATE INDEX pair_by_sheets ON simulation_pair (first_sha256, second_sha256))sql",
    // Only the newest definition of the metrics for each pair of sheets. It is not sorted, so that
    // SQLite can merge it into the query that uses it.
    R"sql(CREATE VIEW v_comparison AS
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
  AND n.simulated_sha256 = c.simulated_sha256 AND n.metrics_version > c.metrics_version))sql",
    // `state` is the query from schema.hpp.
    R"sql(CREATE VIEW v_real_vs_virtual AS
SELECT v.*, s.run AS run, s.measurement AS measurement, s.cause AS cause, s.match AS match,
  s.state AS state
FROM v_comparison AS v JOIN ({state}) AS s ON s.comparison_id = v.id
{in_order})sql",
    // A pair at the marks of a real cloth is current while both its sheets are compared with it.
    R"sql(CREATE VIEW v_virtual_vs_virtual AS
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
ORDER BY s.scene, p.measured_sha256, p.paper_order, s.model, s.solver, p.sha256)sql",
    R"sql(CREATE VIEW v_real_vs_surface AS
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
ORDER BY p.scene, m.sha256, p.simulator, p.sha256)sql",
    // The equilibria of each list with their distance from each measured sheet. `match_mm` shows
    // which one the real shape took; `least_energy` and `nearest` mark one row of each list.
    R"sql(CREATE VIEW v_branches AS
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
ORDER BY c.scene, c.measured, branches, b.number)sql",
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

}  // namespace

const std::vector<Relation>& relations() {
  static const std::vector<Relation> all = [] {
    std::vector<Relation> list;
    const std::string text = kTables;
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t end = std::min(text.find(";\n\n", at), text.size());
      list.push_back(relation_of(text.substr(at, end - at)));
      at = end + 3;
    }
    return list;
  }();
  return all;
}

const Relation& relation(const std::string& name) {
  const auto& all = relations();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const Relation& r) { return r.name == name; });
  if (found == all.end()) throw internal_error("the store has no table `" + name + "`");
  return *found;
}

std::string state_query(const std::string& window) {
  return state_of("comparison", "c.id AS comparison_id", "run_comparison", "comparison_id = c.id",
                  "measured_sha256", window);
}

std::string sheet_state_query() {
  return state_of("sheet", "c.sha256 AS sheet_sha256", "run_drape", "measured_sha256 = c.sha256",
                  "sha256", "");
}

std::vector<std::string> surrounding_statements() {
  std::vector<std::string> statements;
  for (const char* statement : kStatements)
    statements.push_back(fmt::format(fmt::runtime(statement), fmt::arg("state", state_query()),
                                     fmt::arg("sheet_state", sheet_state_query()),
                                     fmt::arg("discretisation", kDiscretisation),
                                     fmt::arg("in_order", kInOrder)));
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
