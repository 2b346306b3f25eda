// SPDX-License-Identifier: Apache-2.0
#include "compare/crate/crate_tables.hpp"

#include <fmt/format.h>

#include "compare/history/filter.hpp"

namespace drape::compare {
namespace {

/// Runs with their drapes; parameter 1 is the number of one run, or empty.
constexpr const char* kDrapes =
    "SELECT r.number AS run, r.date, r.label, r.program_version, d.scene, d.set_name, "
    "d.measurement, d.cause, d.match, d.match_reason, c.mean_mm, d.expanded_uncertainty_mm, CASE "
    "d.budget_complete WHEN 1 THEN 'complete' WHEN 0 THEN 'at least' END AS uncertainty_is, "
    "d.measured_sha256, d.headline_sha256 AS comparison_sha256 FROM run AS r JOIN run_drape AS d "
    "ON d.run = r.number LEFT JOIN comparison AS c ON c.sha256 = d.headline_sha256 WHERE ?1 IS "
    "NULL "
    "OR r.number = ?1 ORDER BY r.number, d.scene, d.measured_sha256";

/// Both sheets of a pair of the run are compared with the same measured sheet.
constexpr const char* kPairs =
    "SELECT p.* FROM simulation_pair AS p WHERE ?1 IS NULL OR 2 = (SELECT count(DISTINCT "
    "c.simulated_sha256) FROM run_comparison AS k JOIN comparison AS c ON c.id = k.comparison_id "
    "WHERE k.run = ?1 AND c.measured_sha256 = p.measured_sha256 AND "
    "c.simulated_sha256 IN (p.first_sha256, p.second_sha256)) ORDER BY p.sha256";

/// Meshes without marks, compared with a measured sheet of the run.
constexpr const char* kSurfaces =
    "SELECT p.* FROM surface_comparison AS p WHERE ?1 IS NULL OR p.measured_sha256 IN (SELECT "
    "measured_sha256 FROM run_drape WHERE run = ?1) ORDER BY p.sha256";

/// All but the certificate itself, which is a file of its own.
constexpr const char* kSimulations =
    "SELECT s.sheet_sha256, s.simulator, s.scene, s.scene_sha256, coalesce(f.name, "
    "s.fabric_stated) AS fabric, s.fabric_sha256, s.start_sha256, s.grid_rows, s.grid_cols, "
    "s.segments, s.model, s.solver, s.status, s.at_rest, s.certificate_sha256, "
    "json_extract(s.certificate_json, '$.\"energy.end_uJ\"') AS energy_end_uJ, "
    "json_extract(s.certificate_json, '$.largest_residual_per_particle_weight') AS "
    "largest_residual_per_particle_weight FROM simulation AS s LEFT JOIN fabric AS f ON f.sha256 = "
    "s.fabric_sha256 WHERE ?1 IS NULL OR s.sheet_sha256 IN (SELECT c.simulated_sha256 FROM "
    "run_comparison AS k JOIN comparison AS c ON c.id = k.comparison_id WHERE k.run = ?1) ORDER BY "
    "s.sheet_sha256";

Table comparisons(const StoreReader& store, std::optional<int> run) {
  ResultFilter filter;
  filter.run = run;
  filter.outdated = true;
  const Selection of = selection_of(store, filter);
  return store.query(
      "SELECT s.run, s.date, s.measurement, s.cause, coalesce(s.state, 'current') AS state, "
      "v.scene, v.grid_size, v.segments, v.fabric, v.simulator, v.model, v.solver, v.status, "
      "v.branch, v.gaps, v.recorded_on, m.* FROM " +
          of.from + " JOIN comparison AS m ON m.id = v.id" + of.where + " ORDER BY m.sha256",
      of.parameters);
}

}  // namespace

std::vector<CrateTable> crate_tables(const StoreReader& store, std::optional<int> run) {
  const Value number = run;
  std::vector<CrateTable> tables = {
      {"comparisons.csv", "distance between measured and simulated sheets, one row each",
       comparisons(store, run)},
      {"drapes.csv", "mean distance, its expanded uncertainty (95 %) and match of each drape",
       store.query(kDrapes, {number})},
      {"surface_comparisons.csv", "distance between measured sheets and surfaces without marks",
       store.query(kSurfaces, {number})},
      {"simulation_pairs.csv", "distance between simulated sheets", store.query(kPairs, {number})},
      {"simulations.csv", "what each simulation is and how it ended",
       store.query(kSimulations, {number})}};
  if (run)
    tables.push_back({"values.csv", "every value behind the run; stand_in: nobody measured it",
                      store.query("SELECT owner, key, value, stand_in FROM run_value WHERE run = "
                                  "? ORDER BY owner, key",
                                  {number})});
  return tables;
}

std::vector<CrateHeadline> crate_headlines(const StoreReader& store, int run) {
  using Text = std::string;
  std::vector<CrateHeadline> headlines;
  for (const auto& [scene, mean_mm, verdict, cause, match, reason, expanded_mm, is] :
       store.rows<Text, Text, Text, Text, Text, Text, Text, Text>(
           "SELECT scene, mean_mm, measurement, cause, match, match_reason, "
           "expanded_uncertainty_mm, uncertainty_is FROM (" +
               Text(kDrapes) + ")",
           {run}))
    if (!mean_mm.empty())
      headlines.push_back(
          {scene, mean_mm,
           fmt::format("measurement {}{}; expanded uncertainty (95 %) {}; match {}: {}", verdict,
                       cause.empty() ? "" : ", " + cause,
                       expanded_mm.empty()
                           ? "not known"
                           : (is == "at least" ? "at least " : "") + expanded_mm + " mm",
                       match, reason)});
  return headlines;
}

}  // namespace drape::compare
