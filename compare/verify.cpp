// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <charconv>

#include "compare/compare.hpp"
#include "compare/other_mesh.hpp"
#include "compare/seal.hpp"
#include "core/error.hpp"
#include "core/files.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using units::mm;

fs::path folder_of(const fs::path& store) {
  return store.has_parent_path() ? store.parent_path() : fs::path(".");
}

void check_bytes(const fs::path& store, const Seal& seal, const LedgerCheck& ledger,
                 Verification& result) {
  std::error_code absent;
  const auto log_size = fs::file_size(store.string() + "-wal", absent);
  if (!absent && log_size > 0)
    result.findings.emplace_back("the store has changes that were not sealed; import once more");
  if (ledger.entries > seal.entries) {
    result.findings.push_back(fmt::format("the seal is older than the store: {} entries against {}",
                                          seal.entries, ledger.entries));
  } else if (ledger.entries < seal.entries || ledger.head != seal.head) {
    result.findings.push_back(fmt::format(
        "rows are missing: the seal knows {} entries, the store {}", seal.entries, ledger.entries));
  }
  if (sha256_of_file(store) != seal.store_sha256)
    result.findings.push_back("bytes of " + store.string() + " were changed");
}

void check_files(const fs::path& folder, const Seal& seal, Verification& result) {
  for (const auto& [name, sha256] : seal.files) {
    const fs::path file = (folder / name).lexically_normal();
    ++result.files;
    if (!fs::is_regular_file(file)) {
      result.findings.push_back(file.string() + " is not there");
    } else if (sha256_of_file(file) != sha256) {
      result.findings.push_back("bytes of " + file.string() + " were changed");
    }
  }
}

/// Sheets of the seal by the hash that the store knows them by.
using SheetFiles = std::map<std::string, fs::path>;

double number(const std::string& text) {
  double value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

/// True when every distance and the mean come out with the same bits.
bool same_numbers(const StoreReader& reader, const std::string& id, const std::string& mean_mm,
                  const std::vector<MarkError>& marks) {
  const Table rows = reader.query(
      "SELECT \"row\", \"col\", distance_mm FROM mark_error WHERE comparison_id = "
      "CAST(? AS INTEGER) ORDER BY \"row\", \"col\"",
      {id});
  if (rows.rows.size() != marks.size()) return false;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    if (number(rows.rows[i][0]) != marks[i].mark.row ||
        number(rows.rows[i][1]) != marks[i].mark.col ||
        number(rows.rows[i][2]) != marks[i].distance_m / mm)
      return false;
  }
  return number(mean_mm) == statistics_of(marks).mean_m / mm;
}

void recompute(const StoreReader& reader, const SheetFiles& sheets, Verification& result) {
  const Table rows = reader.query(
      "SELECT id, sha256, measured_sha256, simulated_sha256, mean_mm FROM comparison ORDER BY id");
  for (const auto& row : rows.rows) {
    const auto measured = sheets.find(row[2]), simulated = sheets.find(row[3]);
    if (measured == sheets.end() || simulated == sheets.end()) continue;
    try {
      const Sheet real = read_sheet(measured->second);
      const Sheet other = simulated->second.extension() == ".toml"
                              ? read_other_mesh(simulated->second, real).sheet.sheet
                              : read_sheet(simulated->second);
      const auto marks = compare_marks(real, Surface(other, simulated->second.string()));
      ++result.comparisons;
      if (!same_numbers(reader, row[0], row[4], marks.marks))
        result.findings.push_back(
            fmt::format("comparison {} does not come out of its sheets", row[1].substr(0, 12)));
    } catch (const Error& error) {
      result.findings.push_back(fmt::format("comparison {} cannot be recomputed: {}",
                                            row[1].substr(0, 12), error.what()));
    }
  }
}

/// The same for meshes without marks.
void recompute_surfaces(const StoreReader& reader, const SheetFiles& sheets, Verification& result) {
  const Table rows = reader.query(
      "SELECT sha256, measured_sha256, mesh_sha256, to_surface_mean_mm, to_surface_max_mm, "
      "coalesce(real_to_mesh_mean_mm, -1), coalesce(mesh_to_real_max_mm, -1) FROM "
      "surface_comparison ORDER BY sha256");
  for (const auto& row : rows.rows) {
    const auto measured = sheets.find(row[1]), mesh = sheets.find(row[2]);
    if (measured == sheets.end() || mesh == sheets.end()) continue;
    try {
      const auto surface = read_other_surface(mesh->second);
      if (!surface) continue;  // its changed bytes are a finding already
      const RealSurface found = compare_to_surface(read_sheet(measured->second), surface->mesh);
      ++result.comparisons;
      const bool same =
          number(row[3]) == found.to_surface.mean_m / mm &&
          number(row[4]) == found.to_surface.max_m / mm &&
          number(row[5]) == (found.both_ways ? found.both_ways->first_to_second.mean_m / mm : -1) &&
          number(row[6]) ==
              (found.both_ways ? found.both_ways->second_to_first.hausdorff_m / mm : -1);
      if (!same)
        result.findings.push_back(fmt::format(
            "surface comparison {} does not come out of its files", row[0].substr(0, 12)));
    } catch (const Error& error) {
      result.findings.push_back(fmt::format("surface comparison {} cannot be recomputed: {}",
                                            row[0].substr(0, 12), error.what()));
    }
  }
}

}  // namespace

Verification verify_store(const fs::path& store, bool with_recomputation) {
  Verification result;
  Seal seal;
  bool sealed = true;
  try {
    seal = read_seal(store);
  } catch (const Error& error) {
    result.findings.emplace_back(error.what_failed());
    sealed = false;
  }
  std::optional<StoreReader> reader;
  try {
    // Bytes first: opening a store may fold its write-ahead log into it.
    if (sealed && sha256_of_file(store) != seal.store_sha256)
      result.findings.push_back("bytes of " + store.string() + " were changed");
    reader.emplace(store);
  } catch (const Error& error) {
    result.findings.emplace_back(error.what_failed());
    return result;
  }
  const LedgerCheck ledger = check_ledger(*reader);
  result.rows = ledger.entries;
  result.findings.insert(result.findings.end(), ledger.findings.begin(), ledger.findings.end());
  if (!sealed) return result;
  if (result.findings.empty()) check_bytes(store, seal, ledger, result);
  check_files(folder_of(store), seal, result);
  if (!with_recomputation) return result;
  SheetFiles sheets;
  for (const auto& [name, sha256] : seal.files) {
    const fs::path file = folder_of(store) / name;
    if (name.ends_with(".json")) sheets[sha256] = file;
    if (const auto other = other_mesh_id(file)) sheets[other->sha256] = file;
  }
  try {
    recompute(*reader, sheets, result);
    recompute_surfaces(*reader, sheets, result);
  } catch (const Error& error) {
    result.findings.emplace_back(error.what_failed());
  }
  return result;
}

}  // namespace drape::compare
