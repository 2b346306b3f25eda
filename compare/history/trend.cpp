// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>

#include "compare/history/results.hpp"
#include "compare/schema/schema.hpp"
#include "compare/store/runs.hpp"
#include "core/error.hpp"

namespace drape::compare {
namespace {

struct SeriesValue {
  std::string label;
  double value = 0;
  std::string verdict;  ///< GO, NO-GO, or empty if in no run
};
/// In the order of the first runs.
struct Series {
  std::string name, unit;
  std::vector<SeriesValue> values;
};

constexpr const char* kResiduals =
    "SELECT 'calibration residual ' || k.rig_name || ' ' || c.camera, 'px', "
    "substr(c.calibration_sha256, 1, 12), c.rms_px, (SELECT max(CASE WHEN d.cause LIKE 'the "
    "calibration is NO-GO:%' THEN 'NO-GO' ELSE 'GO' END) FROM run AS q JOIN run_drape AS d ON "
    "d.run = q.number WHERE q.calibration_sha256 = k.sha256) FROM calibration_camera AS c JOIN "
    "calibration AS k ON k.sha256 = c.calibration_sha256 JOIN listed AS l ON l.kind = "
    "'calibration_file' AND l.key = c.calibration_sha256 ORDER BY k.rig_name, c.camera, (SELECT "
    "min(r.date) FROM run AS r WHERE r.calibration_sha256 = k.sha256), l.sequence";
constexpr const char* kAcceptances =
    "SELECT 'acceptance ' || a.rig_name || ' ' || f.name, f.unit, coalesce(a.date, "
    "substr(a.sha256, 1, 12)), f.value, f.verdict FROM acceptance_figure AS f JOIN acceptance AS "
    "a ON a.sha256 = f.acceptance_sha256 JOIN listed AS l ON l.kind = 'acceptance' AND l.key = "
    "a.sha256 WHERE f.value IS NOT NULL ORDER BY f.unit, a.rig_name, f.name, a.date, l.sequence";
/// The query is state_query() between these parts.
constexpr const char *
    kDistances =
       "SELECT 'mean distance ' || v.rig || ' ' || v.scene || ' ' || coalesce(v.fabric, '') || ' ' "
       "|| "
       "v.discretisation || coalesce(' ' || v.segments || ' seg ', ' ') || v.simulator || ' ' || "
       "v.model || coalesce(' ' || v.solver, '') || CASE v.begins WHEN 'scene' THEN '' ELSE ' from "
       "the ' || v.begins END || coalesce(', friction ' || f.value, '') AS name, 'mm', "
       "v.comparison, "
       "v.mean_dist_mm, s.measurement FROM v_comparison AS v JOIN (",
   *kOfSpecimen =
       ") AS s ON s.comparison_id = v.id LEFT JOIN run_value AS f ON f.run = s.run AND f.owner = "
       "'scene ' || v.scene AND f.key = 'friction' WHERE v.branch IS NULL AND "
       "coalesce(s.measurement, "
       "'GO') = 'GO' AND (?1 = '' OR v.scene = ?1 OR v.scene || '/' || v.fabric = ?1) ORDER BY "
       "name, "
       "(SELECT min(q.date) FROM run_comparison AS k JOIN v_run_moment AS q ON q.run = k.run WHERE "
       "k.comparison_id = v.id), v.id";

std::vector<Series> all_series(const StoreReader& store, const std::string& specimen) {
  std::vector<Series> list;
  const auto add = [&](const std::string& sql, const Cells& parameters) {
    for (const auto& [name, unit, label, value, verdict] :
         store.rows<std::string, std::string, std::string, double, std::string>(sql, parameters)) {
      if (list.empty() || list.back().name != name) list.push_back({name, unit, {}});
      list.back().values.push_back({label, value, verdict});
    }
  };
  if (specimen.empty()) {
    add(kResiduals, {});
    add(kAcceptances, {});
  }
  add(kDistances + state_query() + kOfSpecimen, {specimen});
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
  for (const Series& series : all_series(store, options.specimen)) {
    double sum = 0, squares = 0;
    int good = 0;
    std::size_t number = 0;
    for (const auto& [label, value, verdict] : series.values) {
      std::vector<std::string> cells(trend.table.names.size());
      cells[0] = series.name;
      cells[1] = std::to_string(++number);
      cells[2] = label;
      cells[3] = fmt::format("{:.4f}", value);
      cells[4] = series.unit;
      cells[9] = verdict;
      const auto n = static_cast<double>(good);
      if (good >= options.least_before) {
        const double mean = sum / n;
        const double s = std::sqrt(std::max(0.0, (squares - n * mean * mean) / (n - 1)));
        const double spread = s * std::sqrt(1 + 1 / n);
        const double off = value - mean;
        const bool alarm = std::abs(off) > options.alarm_sigmas * spread;
        cells[5] = fmt::format("{:.4f}", mean);
        cells[6] = fmt::format("{:.4f}", s);
        cells[7] = spread > 0 ? fmt::format("{:+.1f}", off / spread) : off == 0 ? "0" : "";
        cells[8] = alarm ? "ALARM" : "";
        trend.alarms += alarm && number == series.values.size();
      }
      trend.table.add(std::move(cells));
      // A NO-GO value says nothing about usual ones.
      if (verdict == "NO-GO") continue;
      ++good;
      sum += value;
      squares += value * value;
    }
  }
  return trend;
}

}  // namespace drape::compare
