// SPDX-License-Identifier: Apache-2.0
#include "compare/store/sheet_folders.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "compare/metrics/branches.hpp"
#include "compare/metrics/refined.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/program/run_record.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

constexpr int kSheetVersion = 1;
constexpr int kDeepest = 8;  ///< folders below the given one

struct Found {
  std::vector<fs::path> alone, measured, repeats, gone;
};

bool is_measured(const fs::path& sheet_json) {
  return JsonNode::open(sheet_json, "sheet", kSheetVersion).text("kind") == "measured";
}

std::vector<fs::path> folders_of(const fs::path& folder) {
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_directory() && !entry.is_symlink()) folders.push_back(entry.path());
  std::sort(folders.begin(), folders.end());
  return folders;
}

/// The sheet of the folder, or the folder where its run's record is left without it.
void add_sheet(const fs::path& folder, std::vector<fs::path>& sheets, Found& found) {
  if (fs::is_regular_file(folder / "sheet.json")) {
    sheets.push_back(folder / "sheet.ply");
  } else if (fs::is_regular_file(run_record_path(folder / "sheet.ply"))) {
    found.gone.push_back(folder);
  }
}

/// A sheet that a list names must be there.
void add_listed(const JsonNode& entry, const fs::path& list, Found& found) {
  const fs::path sheet = name_inside(list.parent_path(), entry.text("sheet"), entry.where("sheet"));
  const bool there = fs::is_regular_file(fs::path(sheet).replace_extension(".json"));
  there ? found.measured.push_back(sheet) : found.gone.push_back(sheet.parent_path());
}

/// A list whose run ended; its record goes before anything else of it changes.
bool is_whole(const fs::path& list) {
  return fs::is_regular_file(list) && fs::is_regular_file(run_record_path(list));
}

/// What `drape run` compares beside the simulations: of several grids the one that speaks, and of
/// the branches those that the list names, whatever a run before left.
void add_extras(const fs::path& drape, Found& found) {
  if (const fs::path list = drape / "refined" / "refinement.json"; is_whole(list)) {
    const JsonNode root = JsonNode::open(list, "refinement", kRefinementVersion);
    const std::vector<JsonNode> grids = root.items("grids");
    const std::optional<double> used = root.optional_number("used");
    if (used && *used >= 0 && *used < static_cast<double>(grids.size()))
      add_listed(grids[static_cast<std::size_t>(*used)], list, found);
  }
  if (const fs::path list = drape / "ensemble" / "branches.json"; is_whole(list))
    for (const JsonNode& branch :
         JsonNode::open(list, "branches", kBranchesVersion).items("branches"))
      add_listed(branch, list, found);
}

void walk(const fs::path& folder, int depth, Found& found) {  // NOLINT(misc-no-recursion)
  if (fs::is_regular_file(folder / "sheet.json") && is_measured(folder / "sheet.json")) {
    found.measured.push_back(folder / "sheet.ply");
    for (const char* below : {"simulations", "branches"})
      if (fs::is_directory(folder / below))
        for (const fs::path& one : folders_of(folder / below))
          add_sheet(one, found.measured, found);
    add_extras(folder, found);
    if (found.measured.back() != folder / "sheet.ply" && fs::is_directory(folder / "repeats"))
      for (const fs::path& one : folders_of(folder / "repeats"))
        add_sheet(one, found.repeats, found);
    return;
  }
  add_sheet(folder, found.alone, found);
  if (depth == kDeepest) return;
  for (const fs::path& below : folders_of(folder)) walk(below, depth + 1, found);
}

/// Files in their order, and with them what stands alone in folders that follow a file: it may be
/// of the group that the file opened.
Found found_in(const std::vector<fs::path>& given, std::vector<fs::path>& files) {
  Found found;
  for (const fs::path& path : given) {
    if (!fs::is_directory(path)) {
      files.push_back(path);
      continue;
    }
    const auto before = static_cast<std::ptrdiff_t>(found.alone.size());
    walk(path, 0, found);
    if (files.empty()) continue;
    files.insert(files.end(), found.alone.begin() + before, found.alone.end());
    found.alone.erase(found.alone.begin() + before, found.alone.end());
  }
  return found;
}

}  // namespace

std::vector<fs::path> sheets_in(const std::vector<fs::path>& given) {
  std::vector<fs::path> files;
  const Found found = found_in(given, files);
  if (!found.gone.empty())
    throw bad_input(fmt::format("the sheet of a run is gone, of {} in all", found.gone.size()),
                    {.file = found.gone.front().string()},
                    "run it again, or remove the folder to leave it out");
  std::vector<fs::path> sheets = found.alone;
  sheets.insert(sheets.end(), files.begin(), files.end());
  sheets.insert(sheets.end(), found.measured.begin(), found.measured.end());
  if (sheets.empty())
    throw usage_error("there is no sheet to import", "name sheets, or a folder with sheets below");
  return sheets;
}

std::vector<fs::path> repeats_in(const std::vector<fs::path>& given) {
  std::vector<fs::path> files;
  return found_in(given, files).repeats;
}

fs::path calibration_in(const std::vector<fs::path>& given) {
  std::vector<fs::path> found;
  for (const fs::path& path : given)
    if (fs::is_regular_file(path / "calibration.json")) found.push_back(path / "calibration.json");
  return found.size() == 1 ? found.front() : fs::path();
}

}  // namespace drape::compare
