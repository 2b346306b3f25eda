// SPDX-License-Identifier: Apache-2.0
#include "compare/schema/schema.hpp"

#include <fmt/format.h>

namespace drape::compare {
namespace {

constexpr const char* kRunTables[] = {
    R"sql(CREATE TABLE acceptance (
  sha256 TEXT NOT NULL PRIMARY KEY CHECK (length(sha256) = 64),  -- of acceptance.json
  rig_name TEXT NOT NULL REFERENCES rig (name),
  calibration_sha256 TEXT NOT NULL,  -- of the calibration.json that was accepted
  date TEXT,  -- ISO date of the test, as the operator states it
  valid_until TEXT,
  positions INTEGER NOT NULL,
  verdict TEXT NOT NULL CHECK (verdict IN ('GO', 'NO-GO')),
  cause TEXT
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE acceptance_figure (
  acceptance_sha256 TEXT NOT NULL REFERENCES acceptance (sha256),
  name TEXT NOT NULL,
  unit TEXT NOT NULL,
  value REAL,  -- NULL: not measured
  expanded_uncertainty REAL,
  maximum_permissible REAL,
  place TEXT NOT NULL,
  verdict TEXT NOT NULL CHECK (verdict IN ('GO', 'NO-GO')),
  PRIMARY KEY (acceptance_sha256, name)
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE run (
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
) STRICT)sql",
    R"sql(CREATE TABLE run_drape (
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
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE run_match (  -- what the match of a drape rests on
  sha256 TEXT NOT NULL PRIMARY KEY CHECK (length(sha256) = 64),  -- of the run's and the sheet's
  run_sha256 TEXT NOT NULL REFERENCES run (sha256),
  measured_sha256 TEXT NOT NULL REFERENCES sheet (sha256),
  rests_on TEXT NOT NULL,  -- empty: nothing could be judged
  significance REAL NOT NULL CHECK (significance > 0 AND significance < 1),
  repeats INTEGER NOT NULL,  -- real drapes that count as repeats, its own among them
  p REAL  -- that one more repeat lies as far out, by all bases together (Cauchy)
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE match_basis (  -- one thing that a match is judged against
  match_sha256 TEXT NOT NULL REFERENCES run_match (sha256),
  basis TEXT NOT NULL,
  verdict TEXT NOT NULL CHECK (verdict IN ('inside', 'outside', 'undecided')),
  value REAL,
  limit_value REAL,
  unit TEXT NOT NULL,  -- of both
  p REAL,
  reason TEXT NOT NULL,
  PRIMARY KEY (match_sha256, basis)
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE real_repeat (  -- a laying of a drape
  match_sha256 TEXT NOT NULL REFERENCES run_match (sha256),
  sheet_sha256 TEXT NOT NULL REFERENCES sheet (sha256),
  set_name TEXT NOT NULL,
  repeat TEXT NOT NULL,
  face TEXT,  -- side of the cloth that lies up
  left_out TEXT,  -- why it is not among the repeats
  from_own_rms_mm REAL,  -- of the marks, from the drape's own; NULL: its own
  PRIMARY KEY (match_sha256, sheet_sha256)
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE run_comparison (
  comparison_id INTEGER NOT NULL REFERENCES comparison (id),
  run INTEGER NOT NULL REFERENCES run (number),
  PRIMARY KEY (comparison_id, run)
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE run_value (
  run INTEGER NOT NULL REFERENCES run (number),
  owner TEXT NOT NULL,
  key TEXT NOT NULL,
  value TEXT NOT NULL,
  stand_in INTEGER NOT NULL CHECK (stand_in IN (0, 1)),
  PRIMARY KEY (run, owner, key)
) STRICT, WITHOUT ROWID)sql",
    R"sql(CREATE TABLE run_repetition (  -- a run stored again after another run of its photographs
  sha256 TEXT NOT NULL PRIMARY KEY CHECK (length(sha256) = 64),  -- of run_sha256, date and count
  run_sha256 TEXT NOT NULL REFERENCES run (sha256),
  date TEXT NOT NULL  -- UTC, ISO 8601: when it was stored again
) STRICT, WITHOUT ROWID)sql",
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

// What the last run says is looked up in a table of runs, all else by an index: of few comparisons
// only these are judged. SQLite would make a view again at each of its places.
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
    // Runs follow each other by their dates, wherever they were stored; within one second in the
    // order in which this store got them.
    R"sql(CREATE VIEW v_run_moment AS
SELECT r.number AS run, r.date AS date,
  r.date || substr('00000000000' || coalesce(l.sequence, 0), -12) || ' ' || r.number AS moment
FROM run AS r LEFT JOIN ledger AS l ON l.kind = 'run' AND l.key = r.sha256
UNION ALL SELECT r.number, a.date,
  a.date || substr('00000000000' || coalesce(l.sequence, 0), -12) || ' ' || r.number
FROM run_repetition AS a JOIN run AS r ON r.sha256 = a.run_sha256
  LEFT JOIN ledger AS l ON l.kind = 'run_repetition' AND l.key = a.sha256)sql",
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
    // From the tables: a view on the right of a LEFT JOIN would be made whole for every row.
    // Runs in their order, each with its drapes, is a third faster than drapes as SQLite picks
    // them.
    R"sql(CREATE VIEW v_run_drape AS
SELECT d.run AS run, r.date AS date, r.label AS label, d.scene AS scene,
  coalesce(f.name, s.fabric_stated) AS fabric, s.grid_rows || 'x' || s.grid_cols AS grid_size,
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

std::vector<std::string> run_table_statements() {
  return {std::begin(kRunTables), std::end(kRunTables)};
}

std::vector<std::string> run_view_statements() {
  std::vector<std::string> statements = {std::begin(kViews), std::end(kViews)};
  statements.push_back("CREATE VIEW v_pictures_last AS\n" + pictures_last("v_run_moment"));
  statements.push_back("CREATE VIEW v_run_last AS\n" + run_last("v_run_moment", "v_pictures_last"));
  statements.push_back("CREATE VIEW v_state AS\n" + state_query() + "\nWHERE d.run IS NOT NULL");
  return statements;
}

std::string state_query(const std::string& window) {
  return state_of("comparison", "c.id AS comparison_id", "run_comparison", "comparison_id = c.id",
                  "measured_sha256", window);
}

std::string sheet_state_query() {
  return state_of("sheet", "c.sha256 AS sheet_sha256", "run_drape", "measured_sha256 = c.sha256",
                  "sha256", "");
}

}  // namespace drape::compare
