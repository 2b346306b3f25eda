// SPDX-License-Identifier: Apache-2.0
#include "compare/store/sheet_folders.hpp"

#include <algorithm>

#include "core/error.hpp"
#include "core/files/json_file.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

constexpr int kSheetVersion = 1;
constexpr int kDeepest = 8;  ///< folders below the given one

struct Found {
  std::vector<fs::path> alone, measured;
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

void add_simulations(const fs::path& folder, std::vector<fs::path>& sheets) {
  if (!fs::is_directory(folder)) return;
  for (const fs::path& one : folders_of(folder))
    if (fs::is_regular_file(one / "sheet.json")) sheets.push_back(one / "sheet.ply");
}

void walk(const fs::path& folder, int depth, Found& found) {  // NOLINT(misc-no-recursion)
  const bool has_sheet = fs::is_regular_file(folder / "sheet.json");
  if (has_sheet && is_measured(folder / "sheet.json")) {
    found.measured.push_back(folder / "sheet.ply");
    for (const char* below : {"simulations", "branches"})
      add_simulations(folder / below, found.measured);
    return;
  }
  if (has_sheet) found.alone.push_back(folder / "sheet.ply");
  if (depth == kDeepest) return;
  for (const fs::path& below : folders_of(folder)) walk(below, depth + 1, found);
}

}  // namespace

std::vector<fs::path> sheets_in(const std::vector<fs::path>& given) {
  Found found;
  for (const fs::path& path : given)
    if (fs::is_directory(path)) walk(path, 0, found);
  std::vector<fs::path> sheets = found.alone;
  for (const fs::path& path : given)
    if (!fs::is_directory(path)) sheets.push_back(path);
  sheets.insert(sheets.end(), found.measured.begin(), found.measured.end());
  if (sheets.empty())
    throw usage_error("there is no sheet to import", "name sheets, or a folder with sheets below");
  return sheets;
}

fs::path calibration_in(const std::vector<fs::path>& given) {
  std::vector<fs::path> found;
  for (const fs::path& path : given)
    if (fs::is_regular_file(path / "calibration.json")) found.push_back(path / "calibration.json");
  return found.size() == 1 ? found.front() : fs::path();
}

}  // namespace drape::compare
