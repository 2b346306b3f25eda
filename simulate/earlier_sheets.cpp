// SPDX-License-Identifier: Apache-2.0
#include "simulate/earlier_sheets.hpp"

#include <algorithm>
#include <regex>
#include <string>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;

bool is_refined(const fs::path& sheet) {
  try {
    return JsonNode::open(sheet, "sheet", 1).at("source").has("refined_from_sha256");
  } catch (const Error&) {
    return false;  // Not a sheet, so not one of ours.
  }
}

}  // namespace

std::vector<fs::path> earlier_branches(const fs::path& out) {
  static const std::regex of_a_branch("branch-[0-9]+/sheet\\.ply");
  const fs::path list = out / "branches.json";
  std::vector<fs::path> folders;
  if (!fs::exists(list)) return folders;
  for (const JsonNode& branch : JsonNode::open(list, "branches", 1).items("branches")) {
    const std::string sheet = branch.text("sheet");
    if (std::regex_match(sheet, of_a_branch)) folders.push_back((out / sheet).parent_path());
  }
  return folders;
}

std::vector<fs::path> earlier_grids(const fs::path& out) {
  static const std::regex of_a_grid("[0-9]+x[0-9]+");
  std::vector<fs::path> folders;
  std::error_code absent;
  for (const auto& entry : fs::directory_iterator(out, absent))
    if (std::regex_match(entry.path().filename().string(), of_a_grid) &&
        is_refined(entry.path() / "sheet.json"))
      folders.push_back(entry.path());
  std::sort(folders.begin(), folders.end());
  return folders;
}

std::vector<fs::path> sheet_files(const fs::path& folder) {
  return {folder / "sheet.json",  folder / "sheet.ply",  folder / "certificate.json",
          folder / "history.csv", folder / "memory.csv", folder / "contact_forces.csv"};
}

void remove_sheets(const std::vector<fs::path>& folders) {
  for (const fs::path& folder : folders) {
    if (!fs::is_directory(fs::symlink_status(folder))) continue;
    for (const fs::path& file : sheet_files(folder))
      if (fs::is_regular_file(fs::symlink_status(file))) remove_durable(file);
    std::error_code not_empty;
    fs::remove(folder, not_empty);
  }
}

}  // namespace drape::simulate
