// SPDX-License-Identifier: Apache-2.0
#include "compare/report/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <regex>
#include <set>

#include "compare/report/account.hpp"
#include "compare/report/page.hpp"
#include "compare/report/vtk.hpp"
#include "compare/tables/tables.hpp"
#include "core/files/files.hpp"
#include "core/files/inside.hpp"

namespace drape::compare {
namespace {

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
