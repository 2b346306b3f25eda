// SPDX-License-Identifier: Apache-2.0
#include "compare/crate/crate_files.hpp"

#include <fmt/format.h>

#include "compare/history/results.hpp"
#include "compare/history/seal.hpp"
#include "compare/meshes/other_mesh.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/toml_file.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using Stated = std::map<fs::path, std::set<std::string>>;

/// The name that a scene states; empty where the file is none.
std::string scene_in(const fs::path& file) {
  if (read_text(file).find("\"drapebench/scene/") == std::string::npos) return {};
  try {
    return TomlTable::open(file, "scene").text("name");
  } catch (const Error&) {
    return {};  // nothing was simulated with it
  }
}

/// Sheets and meshes of the run, or of the store.
std::set<std::string> sheets_of(const StoreReader& store, std::optional<int> run) {
  std::set<std::string> all;
  for (const auto& [sha256] : store.rows<std::string>(
           "WITH of_run AS (SELECT c.measured_sha256, c.simulated_sha256 FROM run_comparison AS r "
           "JOIN "
           "comparison AS c ON c.id = r.comparison_id WHERE r.run = ?1), drapes AS "
           "(SELECT measured_sha256 FROM run_drape WHERE run = ?1) SELECT sha256 FROM "
           "sheet WHERE ?1 IS NULL OR sha256 IN (SELECT simulated_sha256 FROM of_run UNION SELECT "
           "measured_sha256 FROM of_run UNION SELECT measured_sha256 FROM drapes) UNION SELECT "
           "q.sheet_sha256 FROM real_repeat AS q JOIN run_match AS m ON m.sha256 = q.match_sha256 "
           "JOIN "
           "run AS n ON n.sha256 = m.run_sha256 WHERE n.number = ?1 UNION SELECT "
           "mesh_sha256 FROM surface_comparison WHERE ?1 IS NULL OR measured_sha256 IN (SELECT "
           "measured_sha256 FROM drapes)",
           {run}))
    all.insert(sha256);
  return all;
}

/// What U rests on beside the sheets: files of a drape's sensitivities, where they were sealed.
void add_sensitivities(const std::map<fs::path, std::string>& sealed,
                       std::vector<fs::path>& starts) {
  const std::vector<fs::path> sheets = starts;
  for (const fs::path& sheet : sheets) {
    const fs::path file = sheet.parent_path() / "sensitivity" / "sensitivity.json";
    if (sealed.contains(file)) starts.push_back(file);
  }
}

/// A measured sheet's record of today can name a scene that was edited since it was simulated.
void expect_scenes(const StoreReader& store, const std::set<std::string>& sheets, RecordBook& book,
                   Stated& files, std::vector<std::string>& findings) {
  std::map<std::string, std::set<std::string>> used;
  for (const auto& [sheet, scene, sha256] : store.rows<std::string, std::string, std::string>(
           "SELECT sheet_sha256, scene, scene_sha256 FROM simulation WHERE scene_sha256 IS NOT "
           "NULL"))
    if (sheets.contains(sheet)) used[scene].insert(sha256);
  std::set<std::string> present;
  for (auto& [file, stated] : files) {
    const auto sha256 = book.sha256(file);
    if (!sha256 || file.extension() != ".toml") continue;
    present.insert(*sha256);
    const auto known = used.find(scene_in(file));
    if (known != used.end() && !known->second.contains(*sha256))
      stated.insert(*known->second.begin());
  }
  for (const auto& [scene, hashes] : used)
    for (const std::string& sha256 : hashes)
      if (!present.contains(sha256))
        findings.push_back(
            fmt::format("{}scene {} as it was simulated ({})", kGone, scene, sha256.substr(0, 12)));
}

}  // namespace

Stated crate_files(const StoreReader& store, std::optional<int> run, RecordBook& book,
                   std::vector<std::string>& findings) {
  if (run) require_run(store, *run);
  const std::set<std::string> sheets = sheets_of(store, run);
  const auto places = sealed_places(store.file(), book, sheets);
  std::vector<fs::path> starts;
  Stated meshes;
  for (const std::string& sha256 : sheets) {
    const auto place = places.find(sha256);
    if (place == places.end()) {
      findings.push_back(kGone + ("sheet " + sha256.substr(0, 12)));
      continue;
    }
    const fs::path file = fs::absolute(place->second).lexically_normal();
    if (const auto mesh = other_mesh_id(file); mesh && mesh->sha256 == sha256) {
      meshes[fs::absolute(mesh->mesh).lexically_normal()].insert(mesh->mesh_sha256);
    } else if (const auto now = book.sha256(file); now != sha256) {
      findings.push_back((now ? kNotAsRecorded : kGone) + file.string());
      continue;
    }
    starts.push_back(file);
  }
  const fs::path folder = fs::absolute(folder_of(store.file()));
  std::map<fs::path, std::string> sealed;
  for (const auto& [name, sha256] : read_seal(store.file()).files)
    sealed[(folder / name).lexically_normal()] = sha256;
  add_sensitivities(sealed, starts);
  Stated files = files_behind(book, starts);
  files.merge(meshes);
  for (const auto& [file, sha256] : sealed)
    if (const auto known = files.find(file); known != files.end()) known->second.insert(sha256);
  expect_scenes(store, sheets, book, files, findings);
  return files;
}

}  // namespace drape::compare
