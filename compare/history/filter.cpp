// SPDX-License-Identifier: Apache-2.0
#include "compare/history/results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <regex>

#include "compare/schema/schema.hpp"
#include "core/error.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

/// True for "2026", "2026-03" or "2026-03-01": the beginning of a date as stored.
bool is_date(const std::string& text) {
  static const std::regex form("([0-9]{4})(-([0-9]{2})(-([0-9]{2}))?)?");
  std::smatch part;
  if (!std::regex_match(text, part, form)) return false;
  const auto number = [&](std::size_t i) {
    return part[i].matched ? static_cast<unsigned>(std::stoi(part[i])) : 1U;
  };
  return std::chrono::year_month_day(std::chrono::year(static_cast<int>(number(1))),
                                     std::chrono::month(number(3)), std::chrono::day(number(5)))
      .ok();
}

void check_date(const char* option, const std::string& date) {
  if (date.empty() || is_date(date)) return;
  throw usage_error(fmt::format("{} {} is not an ISO date", option, date),
                    "give year-month-day, e.g. 2026-03-01");
}

/// Throws if no row of the query `names` has `value` as `name`; reads all only for the error.
void check_known(const StoreReader& store, const std::string& option, const std::string& value,
                 const char* names) {
  if (value.empty() ||
      !store.rows<int>(fmt::format("SELECT 1 FROM ({}) WHERE name = ? LIMIT 1", names), {value})
           .empty())
    return;
  std::string known;
  for (const auto& [name] :
       store.rows<std::string>(fmt::format("SELECT DISTINCT name FROM ({}) ORDER BY 1", names)))
    if (!name.empty()) known += (known.empty() ? "" : ", ") + name;
  throw usage_error(fmt::format("nothing in the store has {} `{}`", option, value),
                    "there is: " + (known.empty() ? "none" : known));
}

constexpr const char* kScenes =
    "SELECT scene AS name FROM simulation UNION ALL SELECT scene FROM run_drape UNION ALL SELECT "
    "scene FROM surface_comparison";
constexpr const char* kFabrics =
    "SELECT coalesce(f.name, s.fabric_stated) AS name FROM simulation AS s LEFT JOIN fabric AS f "
    "ON f.sha256 = s.fabric_sha256 UNION ALL SELECT fabric_stated FROM surface_comparison";
constexpr const char* kSegments = "SELECT CAST(segments AS TEXT) AS name FROM simulation";
constexpr const char* kRigs = "SELECT name FROM rig";
constexpr const char* kModels = "SELECT model AS name FROM simulation";
constexpr const char* kSimulators =
    "SELECT simulator AS name FROM simulation UNION ALL SELECT simulator FROM surface_comparison";
constexpr const char* kSpecimens =
    "SELECT scene AS name FROM v_comparison UNION ALL SELECT scene || '/' || fabric FROM "
    "v_comparison";

/// Condition with a parameter for each of since and until; either can be the beginning of a date.
std::string between_dates(const std::string& column, const ResultFilter& filter,
                          Cells& parameters) {
  std::string condition;
  if (!filter.since.empty()) {
    condition += fmt::format(" AND {} >= ?", column);
    parameters.push_back(filter.since);
  }
  if (!filter.until.empty()) {
    // A day, month or year is the beginning of its times: includes the last one.
    condition += fmt::format(" AND substr({}, 1, {}) <= ?", column, filter.until.size());
    parameters.push_back(filter.until);
  }
  return condition;
}

/// Condition on v_run_moment AS q.
std::string window_of(const ResultFilter& filter, Cells& parameters) {
  std::string window = between_dates("q.date", filter, parameters);
  if (filter.run) window += fmt::format(" AND q.run = {}", *filter.run);
  return window;
}

}  // namespace

std::string in_order() {
  return fmt::format(" ORDER BY scene, measured, {}, branch, comparison", kFinestFirst);
}

std::string discretisation_of(const ResultFilter& filter) {
  if (filter.spacing_m) return fmt::format("{:g} mm", *filter.spacing_m / units::mm);
  const std::string& grid = filter.grid;
  return grid.empty() || grid.find('x') != std::string::npos ? grid : grid + "x" + grid;
}

void Selection::add(const std::string& column, const Cell& value) {
  if (value == Cell("")) return;
  where += fmt::format(" AND {} = ?", column);
  parameters.push_back(value);
}

std::string runs_of(const ResultFilter& filter, Cells& parameters) {
  return "SELECT q.run FROM v_run_moment AS q WHERE 1" + window_of(filter, parameters);
}

void check_filter(const StoreReader& store, const ResultFilter& filter) {
  check_date("--since", filter.since);
  check_date("--until", filter.until);
  check_known(store, "scene", filter.scene, kScenes);
  check_known(store, "fabric", filter.fabric, kFabrics);
  check_known(store, filter.spacing_m ? "mesh" : "grid", discretisation_of(filter),
              fmt::format("SELECT {} AS name FROM simulation AS s", kDiscretisation).c_str());
  check_known(store, "segments", filter.segments ? std::to_string(*filter.segments) : "",
              kSegments);
  check_known(store, "rig", filter.rig, kRigs);
  check_known(store, "model", filter.model, kModels);
  check_known(store, "simulator", filter.simulator, kSimulators);
  if (filter.run) require_run(store, *filter.run);
  if (filter.calibration.empty()) return;
  std::string names;
  for (const auto& [sha256, name] : store.rows<std::string, std::string>(
           "SELECT sha256, '' FROM calibration UNION SELECT calibration_sha256, calibration_name "
           "FROM run WHERE calibration_sha256 IS NOT NULL ORDER BY 1")) {
    if (sha256.starts_with(filter.calibration) ||
        name.find(filter.calibration) != std::string::npos)
      return;
    names += (names.empty() ? "" : "; ") + sha256.substr(0, 12) +
             (name.empty() ? "" : " (" + name + ")");
  }
  throw usage_error(fmt::format("nothing in the store has calibration `{}`", filter.calibration),
                    "there is: " + (names.empty() ? "none" : names));
}

void check_specimen(const StoreReader& store, const std::string& specimen) {
  check_known(store, "the specimen SCENE or SCENE/FABRIC", specimen, kSpecimens);
}

Selection selection_of(const StoreReader& store, const ResultFilter& filter) {
  check_filter(store, filter);
  Selection selection;
  Cells& parameters = selection.parameters;
  const std::string window = window_of(filter, parameters);
  selection.from = fmt::format("v_comparison AS v JOIN ({}) AS s ON s.comparison_id = v.id",
                               state_query(window));
  selection.add("scene", filter.scene);
  selection.add("fabric", filter.fabric);
  selection.add("discretisation", discretisation_of(filter));
  if (filter.segments) selection.add("segments", *filter.segments);
  selection.add("rig", filter.rig);
  selection.add("model", filter.model);
  selection.add("simulator", filter.simulator);
  if (!window.empty()) {
    selection.where += " AND v.id IN (SELECT comparison_id FROM run_comparison WHERE run IN (";
    selection.where += runs_of(filter, parameters) + ")";
    if (!filter.run) {
      selection.where +=
          " UNION ALL SELECT c.id FROM comparison AS c JOIN sheet AS m ON m.sha256 "
          "= c.measured_sha256 JOIN recording AS r ON r.sha256 = "
          "m.recording_sha256 WHERE NOT EXISTS (SELECT 1 FROM run_comparison WHERE "
          "comparison_id = c.id)" +
          between_dates("r.recorded_on", filter, parameters);
    }
    selection.where += ")";
  }
  if (!filter.calibration.empty()) {
    // The second part is redundant, but finds these few rows first.
    selection.where +=
        " AND (substr(v.calibration_sha256, 1, length(?)) = ? OR instr(s.calibration, "
        "?) > 0) AND v.id IN (SELECT id FROM comparison WHERE measured_sha256 IN (SELECT sha256 "
        "FROM sheet WHERE substr(calibration_sha256, 1, length(?)) = ?) UNION SELECT "
        "comparison_id FROM run_comparison WHERE run IN (SELECT number FROM run WHERE "
        "instr(calibration_name, ?) > 0))";
    parameters.insert(parameters.end(), 6, Cell(filter.calibration));
  }
  if (!filter.outdated && !filter.run)
    selection.where += " AND coalesce(s.state, 'current') = 'current'";
  return selection;
}

}  // namespace drape::compare
