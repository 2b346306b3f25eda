// SPDX-License-Identifier: Apache-2.0
#include "compare/report/report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <functional>
#include <regex>
#include <set>

#include "compare/report/account.hpp"
#include "compare/tables/tables.hpp"
#include "core/drawing/svg.hpp"
#include "core/files/files.hpp"
#include "core/files/inside.hpp"
#include "core/units.hpp"

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
        std::regex_match(name, of_a_report))
      others.push_back(entry.path());
  }
  for (const fs::path& file : others) remove_durable(file);
}

/// Photographs by the names used in the views.
std::map<std::string, std::string> pictures_of(const RunReport& report, const fs::path& folder) {
  std::map<std::string, std::string> pictures;
  for (const ReportedDrape& drape : report.drapes)
    for (const ReportedView& view : drape.views)
      if (const fs::path file = folder / view.picture; !view.picture.empty())
        for (const unsigned char byte :
             read_inside(file.parent_path(), file.filename().string(), {.file = file.string()}))
          pictures[view.picture] += static_cast<char>(byte);
  return pictures;
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
                    const std::map<std::string, std::string>& jpegs) {
  Value pictures = Value::Table{};
  for (const auto& [name, bytes] : jpegs)
    pictures[name] =
        "data:image/jpeg;base64," + base64(std::vector<unsigned char>(bytes.begin(), bytes.end()));
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
  std::vector<bool> ends = {part == VtkPart::simulated};
  if (part == VtkPart::distance) {
    ends = {false, true};
    cells.clear();
    for (std::size_t i = 0; i < marks.size(); ++i)
      cells.push_back({static_cast<double>(i), static_cast<double>(i + marks.size())});
  }
  std::vector<double> points;
  for (const bool simulated : ends)
    for (const ReportedMark* mark : marks)
      for (const double x :
           Eigen::Vector3d((simulated ? *mark->virtual_in_world : *mark->real_in_world) / mm))
        points.push_back(x);
  const auto scalars = [&](const std::string& name,
                           const std::function<double(const ReportedMark&)>& of) {
    std::vector<double> values;
    for (std::size_t end = 0; end < ends.size(); ++end)
      for (const ReportedMark* mark : marks) values.push_back(of(*mark));
    return array_of(name, "Float64", 1, values);
  };
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  const auto length = [](const std::optional<double>& x) { return x ? *x / mm : unknown; };
  const bool lines = part == VtkPart::distance;
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
         scalars("row", [](const auto& mark) { return static_cast<double>(mark.row); }) +
         scalars("col", [](const auto& mark) { return static_cast<double>(mark.col); }) +
         "</PointData>\n<Points>\n" + array_of("Points", "Float64", 3, points) + "</Points>\n" +
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

}  // namespace drape::compare
