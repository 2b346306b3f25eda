// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "compare/history/results.hpp"
#include "compare/schema/schema.hpp"
#include "core/program/words.hpp"

namespace drape::compare {
namespace {

constexpr const char* kResiduals = R"sql(
SELECT 'calibration residual ' || k.rig_name || ' ' || c.camera, 'px',
  substr(c.calibration_sha256, 1, 12), c.rms_px, (SELECT max(CASE WHEN d.cause LIKE
    'the calibration is NO-GO:%' THEN 'NO-GO' ELSE 'GO' END)
    FROM run AS q JOIN run_drape AS d ON d.run = q.number WHERE q.calibration_sha256 = k.sha256)
FROM calibration_camera AS c JOIN calibration AS k ON k.sha256 = c.calibration_sha256
  JOIN listed AS l ON l.kind = 'calibration_file' AND l.key = c.calibration_sha256
ORDER BY k.rig_name, c.camera,
  (SELECT min(r.date) FROM run AS r WHERE r.calibration_sha256 = k.sha256), l.sequence)sql";
constexpr const char* kAcceptances = R"sql(
SELECT 'acceptance ' || a.rig_name || ' ' || f.name, f.unit,
  coalesce(a.date, substr(a.sha256, 1, 12)), f.value, f.verdict
FROM acceptance_figure AS f JOIN acceptance AS a ON a.sha256 = f.acceptance_sha256
  JOIN listed AS l ON l.kind = 'acceptance' AND l.key = a.sha256
WHERE f.value IS NOT NULL ORDER BY f.unit, a.rig_name, f.name, a.date, l.sequence)sql";
/// The braces are replaced by state_query().
constexpr const char* kDistances = R"sql(
SELECT 'mean distance ' || v.rig || ' ' || v.scene || ' ' || coalesce(v.fabric, '') || ' ' ||
  v.discretisation || coalesce(' ' || v.segments || ' seg ', ' ') || v.simulator || ' ' ||
  v.model || coalesce(' ' || v.solver, '') ||
  CASE v.begins WHEN 'scene' THEN '' ELSE ' from the ' || v.begins END ||
  coalesce(', friction ' || f.value, '') AS name, 'mm', v.comparison, v.mean_dist_mm, s.measurement
FROM v_comparison AS v JOIN ({}) AS s ON s.comparison_id = v.id
  LEFT JOIN run_value AS f ON f.run = s.run AND f.owner = 'scene ' || v.scene AND f.key = 'friction'
WHERE v.branch IS NULL AND coalesce(s.measurement, 'GO') = 'GO'
  AND (?1 = '' OR v.scene = ?1 OR v.scene || '/' || v.fabric = ?1)
ORDER BY name, (SELECT min(q.date) FROM run_comparison AS k JOIN v_run_moment AS q ON q.run = k.run
  WHERE k.comparison_id = v.id), v.id)sql";

/// Name of the series, unit, label, value, and verdict: GO, NO-GO, or empty if in no run.
using SeriesValue = std::tuple<std::string, std::string, std::string, double, std::string>;

/// Values by series, in each in the order of the first runs.
std::vector<SeriesValue> all_values(const StoreReader& store, const std::string& specimen) {
  std::vector<SeriesValue> list;
  const auto add = [&](const std::string& sql, const Cells& parameters = {}) {
    for (auto& value :
         store.rows<std::string, std::string, std::string, double, std::string>(sql, parameters))
      list.push_back(std::move(value));
  };
  if (specimen.empty()) add(kResiduals);
  if (specimen.empty()) add(kAcceptances);
  add(fmt::format(fmt::runtime(kDistances), state_query()), {specimen});
  return list;
}

}  // namespace

Trend trend_of(const StoreReader& store, const TrendOptions& options) {
  if (options.least_before < 2 || !(options.alarm_sigmas > 0))
    throw usage_error("a trend needs at least 2 values before and an alarm above 0 sigma", "");
  check_specimen(store, options.specimen);
  store.require_as_written(std::vector<std::string>{
      "calibration", "calibration_camera", "acceptance", "acceptance_figure", "comparison", "sheet",
      "simulation", "fabric", "run", "run_drape", "run_value"});
  Trend trend;
  trend.table = Table({"series", "n", "run", "value", "unit", "mean_before", "s_before", "sigmas",
                       "alarm", "measurement"},
                      {1, 3, 5, 6, 7});
  double sum = 0, squares = 0;
  int good = 0, number = 0;
  std::string before;
  bool last_alarms = false;
  for (const auto& [name, unit, label, value, verdict] : all_values(store, options.specimen)) {
    if (name != before) {
      trend.alarms += last_alarms;
      sum = squares = 0;
      good = number = 0;
      before = name;
    }
    std::vector<std::string> cells = {
        name,   std::to_string(++number), label, fmt::format("{:.4f}", value), unit, "", "", "", "",
        verdict};
    const auto n = static_cast<double>(good);
    last_alarms = false;
    if (good >= options.least_before) {
      const double mean = sum / n;
      const double s = std::sqrt(std::max(0.0, (squares - n * mean * mean) / (n - 1)));
      const double spread = s * std::sqrt(1 + 1 / n);
      const double off = value - mean;
      last_alarms = std::abs(off) > options.alarm_sigmas * spread;
      cells[5] = fmt::format("{:.4f}", mean);
      cells[6] = fmt::format("{:.4f}", s);
      cells[7] = spread > 0 ? fmt::format("{:+.1f}", off / spread) : off == 0 ? "0" : "";
      cells[8] = last_alarms ? "ALARM" : "";
    }
    trend.table.add(std::move(cells));
    // A NO-GO value says nothing about usual ones.
    if (verdict == "NO-GO") continue;
    ++good;
    sum += value;
    squares += value * value;
  }
  trend.alarms += last_alarms;
  return trend;
}

namespace {

using Values = std::map<std::string, std::string>;

/// Numbers the rows of each scene by the values they share apart from those of the trend's keys,
/// and names the differences from the first of them. The last column comes with the fabric's name.
void set_series_apart(const StoreReader& store, const Cells& keys, const std::string& key,
                      Table& table) {
  std::string marks;
  for (std::size_t i = 0; i < keys.size(); ++i) marks += "?, ";
  Cells parameters = keys;
  parameters.emplace_back(key);
  std::map<std::pair<std::string, std::string>, Values> values;  // by run and scene
  for (auto& [run, scene, name, value] :
       store.rows<std::string, std::string, std::string, std::string>(
           fmt::format(R"sql(
SELECT d.run, d.scene, x.owner || ' ' || x.key, x.value FROM v_run_drape AS d
  JOIN run_value AS x ON x.run = d.run AND x.owner IN ('scene ' || d.scene, 'calibration'{})
WHERE x.key NOT IN ({}?))sql",
                       key == "fabric" ? "" : ", 'fabric ' || d.fabric", marks),
           parameters))
    values[{run, scene}][name] = std::move(value);
  const auto at = [&](const char* name) { return *table.column(name); };
  const std::size_t scene = at("scene"), run = at("run"), series = at("series"),
                    mesh = at("discretisation"), segments = at("segments"),
                    otherwise = at("otherwise");
  std::map<std::string, std::vector<Values>> known;
  for (auto& row : table.rows) {
    Values all = values[{row[run], row[scene]}];
    all["discretisation"] = row[mesh];
    all["segments"] = row[segments];
    if (key != "fabric") all["fabric"] = row[otherwise];
    std::vector<Values>& of_scene = known[row[scene]];
    const auto same = std::find(of_scene.begin(), of_scene.end(), all);
    row[series] = std::to_string(same - of_scene.begin() + 1);
    if (same == of_scene.end()) of_scene.push_back(all);
    constexpr int kNamed = 3;
    int differ = 0;
    row[otherwise].clear();
    for (const auto& [name, value] : all) {
      const auto first = of_scene.front().find(name);
      const std::string old = first == of_scene.front().end() ? "absent" : first->second;
      if (old == value || ++differ > kNamed) continue;
      row[otherwise] += fmt::format("{}{} {} -> {}", differ == 1 ? "" : ", ", name, old, value);
    }
    if (differ > kNamed) row[otherwise] += fmt::format(" and {} more", differ - kNamed);
  }
  std::stable_sort(table.rows.begin(), table.rows.end(), [&](const auto& one, const auto& other) {
    return std::pair(one[scene], std::stoi(one[series])) <
           std::pair(other[scene], std::stoi(other[series]));
  });
}

}  // namespace

Table trend_by(const StoreReader& store, const std::string& key, const std::string& specimen) {
  store.require_as_written(std::vector<std::string>{"run", "run_drape", "run_match", "run_value",
                                                    "comparison", "simulation", "fabric"});
  check_specimen(store, specimen);
  std::string value = "d." + key, chosen;
  Cells keys;
  if (key != "fabric" && key != "label" && key != "scene") {
    std::string list;
    for (const auto& [found] : store.rows<std::string>(
             // Goes from key to key by the index: DISTINCT would read every value of every run.
             "WITH RECURSIVE each(key) AS (SELECT min(key) FROM run_value UNION ALL SELECT (SELECT "
             "min(v.key) FROM run_value AS v WHERE v.key > each.key) FROM each WHERE each.key IS "
             "NOT NULL) SELECT key FROM each WHERE key = ?1 OR key LIKE '%.' || ?1",
             {key})) {
      keys.push_back(found);
      list += fmt::format("{}?{}", list.empty() ? "" : ", ", keys.size());
    }
    if (keys.empty()) {
      std::vector<std::string> names = {"fabric", "label"};
      for (const auto& [known] :
           store.rows<std::string>("SELECT DISTINCT key FROM run_value ORDER BY key"))
        names.push_back(known);
      throw usage_error(fmt::format("no run has a value `{}`{}", key, did_you_mean(key, names)),
                        "see the keys with: drape-results sql \"SELECT DISTINCT owner, key FROM "
                        "run_value\"");
    }
    value =
        "(SELECT group_concat(v.value, ', ') FROM chosen AS v WHERE v.run = d.run AND v.owner IN "
        "('scene ' || d.scene, 'fabric ' || d.fabric, 'calibration'))";
    chosen = fmt::format(
        "WITH chosen AS MATERIALIZED (SELECT run, owner, value FROM run_value WHERE key IN ({}) "
        "ORDER BY run, owner, key) ",
        list);
  }
  std::string of_specimen;
  if (!specimen.empty()) {
    keys.push_back(specimen);
    of_specimen =
        fmt::format(" WHERE d.scene = ?{0} OR d.scene || '/' || d.fabric = ?{0}", keys.size());
  }
  Table table = store.query(fmt::format(R"sql({}
SELECT d.scene, {} AS by_value, '' AS series, d.run, substr(d.date, 1, 10) AS date,
  d.discretisation, d.segments, round(d.mean_dist_mm, 3) AS mean_dist_mm,
  round(d.expanded_uncertainty_mm, 3) AS expanded_uncertainty_mm, {}, d.measurement, d.match,
  d.match_rests_on, coalesce(d.fabric, '') AS otherwise
FROM v_run_drape AS d{} ORDER BY d.scene, by_value, d.date, d.run)sql",
                                        chosen, value, kUncertaintyIs, of_specimen),
                            keys);
  if (!specimen.empty()) keys.pop_back();
  set_series_apart(store, keys, key, table);
  table.names[1] = key;
  return table;
}

}  // namespace drape::compare
