// SPDX-License-Identifier: Apache-2.0
#include "compare/report/report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "compare/report/account.hpp"
#include "core/drawing/svg.hpp"
#include "core/matching.hpp"

namespace drape::compare {
namespace {

/// A block of JSON that no text in it can end: `<` is escaped.
std::string data_block(const std::string& id, const Value& data) {
  std::string json;
  for (const char c : one_line(data)) json += c == '<' ? std::string("\\u003c") : std::string(1, c);
  return "<script type=\"application/json\" id=\"" + id + "\">" + json + "</script>\n";
}

using units::mm;

std::string array_of(const std::string& name, const char* type, int components,
                     const std::vector<double>& values) {
  return fmt::format(
      "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"ascii\">{}"
      "</DataArray>\n",
      type, name, components, fmt::join(values, " "));
}

/// Polygons or lines as indices of their points.
std::string cells_of(const char* tag, const std::vector<std::vector<double>>& cells) {
  std::vector<double> points, ends;
  for (const auto& cell : cells) {
    points.insert(points.end(), cell.begin(), cell.end());
    ends.push_back(static_cast<double>(points.size()));
  }
  return fmt::format("<{0}>\n{1}{2}</{0}>\n", tag, array_of("connectivity", "Int64", 1, points),
                     array_of("offsets", "Int64", 1, ends));
}

namespace fs = std::filesystem;

/// Removes files of an earlier report with other drapes or tables, by their names, since the folder
/// can contain files of other people.
void remove_others(const fs::path& folder, const std::vector<fs::path>& written) {
  static const std::regex of_a_report(
      "[A-Za-z0-9_-]+-(band|branches|certificates|convergence|direction|drapemeter|fabric|"
      "fabric-values|folds|gaps|hem|histogram|judged-by|budget|repeats|values|map|marks|"
      "model-changes|overlay|real-vs-surface|real-vs-virtual|render|sheet|strain|trust|"
      "virtual-vs-virtual|waves|real|virtual|distance)(-.*)?\\.(csv|svg|vtp)");
  if (!fs::is_directory(folder)) return;
  std::set<std::string> names;
  for (const fs::path& file : written) names.insert(file.filename().string());
  std::vector<fs::path> others;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (entry.is_regular_file() && !entry.is_symlink() && !names.contains(name) &&
        has_form(name, of_a_report))
      others.push_back(entry.path());
  }
  for (const fs::path& file : others) remove_durable(file);
}

/// Photographs by the names used in the views.
std::map<std::string, std::vector<unsigned char>> pictures_of(const RunReport& report,
                                                              const fs::path& folder) {
  std::map<std::string, std::vector<unsigned char>> pictures;
  for (const ReportedDrape& drape : report.drapes)
    for (const ReportedView& view : drape.views)
      if (const fs::path file = folder / view.picture; !view.picture.empty())
        pictures[view.picture] =
            read_inside(file.parent_path(), file.filename().string(), {.file = file.string()});
  return pictures;
}

/// Points of each series, with the band predicted by the values before each.
Value series_of(const Trend& trend, double alarm_sigmas) {
  Value all = Value::List{};
  std::optional<std::string> name;
  for (const std::vector<std::string>& row : trend.table.rows) {
    Value low, high;
    if (!row[5].empty()) {
      const double mean = std::stod(row[5]);
      const double reach =
          alarm_sigmas * std::stod(row[6]) * std::sqrt(1 + 1 / (std::stod(row[1]) - 1));
      low = mean - reach;
      high = mean + reach;
    }
    if (row[0] != std::exchange(name, row[0]))
      all.append(Value::Table{{"name", row[0]}, {"unit", row[4]}, {"points", Value::List{}}});
    all.get_if<Value::List>()->back()["points"].append(Value::Table{{"label", row[2]},
                                                                    {"value", std::stod(row[3])},
                                                                    {"low", low},
                                                                    {"high", high},
                                                                    {"alarm", !row[8].empty()}});
  }
  return all;
}

}  // namespace

std::string script_hash(const std::string& script) {
  const std::string hex = sha256_of(std::string_view(script));
  std::vector<unsigned char> bytes;
  for (std::size_t i = 0; i < hex.size(); i += 2)
    bytes.push_back(static_cast<unsigned char>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  return "sha256-" + base64(bytes);
}

std::string page_of(const std::string& title, const std::string& kind, const Value& data,
                    const std::map<std::string, std::vector<unsigned char>>& jpegs) {
  Value pictures = Value::Table{};
  for (const auto& [name, bytes] : jpegs)
    pictures[name] = "data:image/jpeg;base64," + base64(bytes);
  const std::string script = page_script();
  return fmt::format(
             "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
             "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
             "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
             "'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'; script-src "
             "'{}'\">\n<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n<div id=\"page\">"
             "<p>This page draws its numbers by a script of its own, which is off. The same "
             "numbers are in report.json and in the .csv files beside it.</p></div>\n",
             script_hash(script), xml(title), page_style()) +
         data_block(kind, data) + data_block("pictures", pictures) + "<script>" + script +
         "</script>\n</body>\n</html>\n";
}

std::string vtp_of(const ReportedDrape& drape, VtkPart part) {
  std::vector<const ReportedMark*> marks;
  std::map<std::pair<int, int>, std::size_t> index;
  for (const ReportedMark& mark : drape.marks) {
    if (!mark.distance_m || !mark.real_in_world || !mark.virtual_in_world) continue;
    index[{mark.row, mark.col}] = marks.size();
    marks.push_back(&mark);
  }
  std::vector<std::vector<double>> cells;
  for (const auto& [id, first] : index) {
    const auto [row, col] = id;
    std::vector<double> cell;
    for (const auto& corner :
         {std::pair{row, col}, {row + 1, col}, {row + 1, col + 1}, {row, col + 1}})
      if (const auto at = index.find(corner); at != index.end())
        cell.push_back(static_cast<double>(at->second));
    if (cell.size() == 4) cells.push_back(std::move(cell));
  }
  const bool lines = part == VtkPart::distance;
  if (lines) {
    cells.clear();
    for (std::size_t i = 0; i < marks.size(); ++i)
      cells.push_back({static_cast<double>(i), static_cast<double>(i + marks.size())});
  }
  std::vector<double> points;
  const auto add_points = [&](auto member) {
    for (const ReportedMark* mark : marks)
      for (const double x : Eigen::Vector3d(*(mark->*member) / mm)) points.push_back(x);
  };
  if (part != VtkPart::simulated) add_points(&ReportedMark::real_in_world);
  if (part != VtkPart::measured) add_points(&ReportedMark::virtual_in_world);
  const auto scalars = [&](const std::string& name, const auto& of) {
    std::vector<double> values;
    for (int end = 0; end < (lines ? 2 : 1); ++end)
      for (const ReportedMark* mark : marks) values.push_back(of(*mark));
    return array_of(name, "Float64", 1, values);
  };
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  const auto length = [](const std::optional<double>& x) { return x ? *x / mm : unknown; };
  return fmt::format(
             "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" "
             "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>\n<Piece "
             "NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"{}\" NumberOfStrips=\"0\" "
             "NumberOfPolys=\"{}\">\n<PointData Scalars=\"distance_mm\">\n",
             points.size() / 3, lines ? cells.size() : 0, lines ? 0 : cells.size()) +
         scalars("distance_mm", [&](const auto& mark) { return length(mark.distance_m); }) +
         scalars("sigma_distance_mm",
                 [&](const auto& mark) { return length(mark.sigma_distance_m); }) +
         scalars("sigma_mm", [&](const auto& mark) { return length(mark.sigma_m); }) +
         scalars("row", [](const auto& mark) { return mark.row; }) +
         scalars("col", [](const auto& mark) { return mark.col; }) + "</PointData>\n<Points>\n" +
         array_of("Points", "Float64", 3, points) + "</Points>\n" +
         cells_of(lines ? "Lines" : "Polys", cells) + "</Piece>\n</PolyData>\n</VTKFile>\n";
}

std::vector<fs::path> write_report(const fs::path& file, const RunReport& report) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  const fs::path beside = folder / file.stem();
  std::vector<fs::path> written;
  const auto write = [&](const std::string& name, const std::string& text) {
    written.push_back(beside / name);
    write_inside(beside, name, text, {.file = written.back().string()});
  };
  for (const ReportedDrape& drape : report.drapes) {
    for (const ReportedTable& one : drape.tables)
      write(fmt::format("{}-{}.csv", drape.name, one.name), csv_of(one.table));
    if (drape.distance)
      for (const VtkPart part : {VtkPart::measured, VtkPart::simulated, VtkPart::distance})
        write(fmt::format("{}-{}.vtp", drape.name, drape::name_of(part)), vtp_of(drape, part));
  }
  remove_others(beside, written);
  written.push_back(fs::path(file).replace_extension(".json"));
  write_record(written.back(), report);
  write_durable(file, page_of(std::string("Real and virtual drapes: measurement ") +
                                  (report.go ? "GO" : "NO-GO"),
                              "report", value_of(report), pictures_of(report, folder)));
  written.push_back(file);
  return written;
}

HistoryPage history_page(const StoreReader& store, const TrendOptions& options) {
  const Trend trend = trend_of(store, options);
  store.require_as_written(std::vector<std::string>{"drapemeter", "simulation_pair", "branch"});
  Table list = store.query(
      R"sql(SELECT scene, fabric, simulator, discretisation, segments,
  round(mean_dist_mm, 3) AS "mean (mm)", round(sigma_mean_mm, 4) AS "± (mm)",
  round(mean_low_mm, 2) AS "95 % from (mm)", round(mean_high_mm, 2) AS "to (mm)",
  round(max_mm, 2) AS "largest (mm)", marks, gaps, status, recorded_on AS recorded, comparison,
  coalesce(measurement, 'not stated') AS measurement, cause, coalesce(state, 'current') AS state
FROM v_real_vs_virtual ORDER BY id DESC)sql");
  Table drapemeters = store.query(
      R"sql(SELECT coalesce(s.scene, m.set_name) AS drape, coalesce(s.simulator, 'measured') AS sheet, )sql" +
      std::string(kDiscretisation) +
      R"sql( AS discretisation, s.segments, round(d.covered_area_mm2) AS "covered (mm²)",
  round(d.drape_coefficient_percent, 1) AS "drape coefficient (%)", d.folds,
  round(d.fold_depth_mm, 1) AS "fold depth (mm)", substr(m.sha256, 1, 12) AS "key of the sheet"
FROM drapemeter AS d JOIN sheet AS m ON m.sha256 = d.sheet_sha256
  LEFT JOIN simulation AS s ON s.sheet_sha256 = d.sheet_sha256
ORDER BY drape, sheet, s.segments, s.spacing_mm, s.grid_rows, d.sheet_sha256)sql");
  Table pairs = store.query(
      R"sql(SELECT scene, pair, round(mean_dist_mm, 2) AS "mean (mm)", round(max_mm, 2) AS "largest (mm)",
  round(hausdorff_mm, 2) AS "Hausdorff (mm)", points, fabric, model, solver,
  CASE both_at_rest WHEN 1 THEN 'yes' WHEN 0 THEN 'no' END AS "both at rest",
  coalesce(measured, 'no real cloth') AS "marks of", comparison AS pair, measurement,
  state FROM v_virtual_vs_virtual)sql");
  const std::size_t columns = list.names.size();
  const auto no_go = std::ranges::count_if(list.rows, [&](const auto& row) {
    return row[columns - 3] == "NO-GO" && row[columns - 1] == "current";
  });
  std::string verdict = trend.alarms == 0
                            ? "no newest value is beyond the alarm"
                            : fmt::format("{} newest values are beyond the alarm", trend.alarms);
  if (no_go > 0) verdict += fmt::format("; {} current comparisons are NO-GO", no_go);
  const bool go = trend.alarms == 0 && no_go == 0;
  list.title = "Real against virtual; the newest import stands first";
  pairs.title = "Virtual against virtual";
  drapemeters.title = "Drapemeter";
  Value page;
  page["go"] = go;
  page["sentence"] = fmt::format("{} comparisons; {}", list.rows.size(), verdict);
  page["note"] = fmt::format(
      "Blue bands: where {:g} standard deviations of the values before each one end (mean ± {:g} s "
      "sqrt(1 + 1/n), from {} values on).",
      options.alarm_sigmas, options.alarm_sigmas, options.least_before);
  page["series"] = series_of(trend, options.alarm_sigmas);
  for (Table* table : {&list, &pairs, &drapemeters})
    page["tables"].append(value_of(ReportedTable{"history", "", *table}));
  return {page_of("History of the bench", "history", page), go};
}

}  // namespace drape::compare
