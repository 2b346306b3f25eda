// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>

#include "compare/compare.hpp"
#include "compare/history/copies.hpp"
#include "compare/history/seal.hpp"
#include "compare/meshes/other_mesh.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using units::mm;

/// user_version, which SQLite keeps big-endian in bytes 60 to 63 of the file.
int version_in_file(const fs::path& store) {
  const std::vector<unsigned char> bytes = read_bytes(store);
  if (bytes.size() < 64) return 0;
  return (bytes[60] << 24) | (bytes[61] << 16) | (bytes[62] << 8) | bytes[63];
}

/// A store of an older version is read through a copy that was brought to this one, which defines
/// new metrics: what was sealed must be the beginning of its chain, and only metrics may follow.
bool grew_by_migration(const StoreReader& reader, const fs::path& store, const Seal& seal) {
  if (version_in_file(store) >= kStoreVersion) return false;
  const std::string sealed = std::to_string(seal.entries);
  const Table head =
      reader.query("SELECT chain_sha256 FROM ledger WHERE sequence = CAST(? AS INTEGER)", {sealed});
  const Table others = reader.query(
      "SELECT 1 FROM ledger WHERE sequence > CAST(? AS INTEGER) AND kind <> 'metric'", {sealed});
  return head.rows.size() == 1 && head.rows[0][0] == seal.head && others.rows.empty();
}

void check_length(const StoreReader& reader, const fs::path& store, const Seal& seal,
                  const LedgerCheck& ledger, Verification& result) {
  if (grew_by_migration(reader, store, seal)) {
    // The bytes below are those of the older file.
  } else if (ledger.entries > seal.entries) {
    result.findings.push_back(fmt::format("the seal is older than the store: {} entries against {}",
                                          seal.entries, ledger.entries));
  } else if (ledger.entries < seal.entries || ledger.head != seal.head) {
    result.findings.push_back(fmt::format(
        "rows are missing: the seal knows {} entries, the store {}", seal.entries, ledger.entries));
  }
}

/// What was committed and, where nothing of it is still in the write-ahead log, the file itself.
bool has_sealed_bytes(const fs::path& store, const Seal& seal, const LedgerCheck& ledger) {
  std::error_code absent;
  const auto log_size = fs::file_size(store.string() + "-wal", absent);
  return ledger.bytes_sha256 == seal.store_sha256 &&
         ((!absent && log_size > 0) || sha256_of_file(store) == seal.store_sha256);
}

void check_files(const fs::path& folder, const Seal& seal, Verification& result) {
  const auto has_copy = [&](const std::string& absent, const std::string& sha256) {
    return std::any_of(seal.files.begin(), seal.files.end(), [&](const auto& other) {
      return other.second == sha256 && other.first != absent &&
             fs::is_regular_file(folder / other.first);
    });
  };
  for (const auto& [name, sha256] : seal.files) {
    const fs::path file = (folder / name).lexically_normal();
    ++result.files;
    if (!fs::is_regular_file(file) && has_copy(name, sha256)) continue;  // imported from there
    if (!fs::is_regular_file(file)) {
      result.findings.push_back(file.string() + " is not there");
    } else if (sha256_of_file(file) != sha256) {
      result.findings.push_back("bytes of " + file.string() + " were changed");
    }
  }
}

/// Sheets and lists of branches of the seal by the hash that the store knows them by.
using SheetFiles = std::map<std::string, fs::path>;

/// What was not recomputed because a sheet of it is not sealed: the first of a kind, and how many.
class NotRecomputed {
 public:
  explicit NotRecomputed(const char* kind) : kind_(kind) {}
  void add(const std::string& key) {
    if (count_++ == 0) first_ = key.substr(0, 12);
  }
  void report(Verification& result) const {
    if (count_ == 0) return;
    result.findings.push_back(fmt::format(
        "{} {}{} not recomputed: no sealed file holds its sheets", kind_, first_,
        count_ == 1 ? std::string(" was") : fmt::format(" and {} more were", count_ - 1)));
  }

 private:
  const char* kind_;
  std::string first_;
  long long count_ = 0;
};

double number(const std::string& text) {
  double value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

int whole_number(const std::string& text) {
  int value = 0;
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
  NotRecomputed left("comparison");
  for (const auto& row : rows.rows) {
    const auto measured = sheets.find(row[2]), simulated = sheets.find(row[3]);
    if (measured == sheets.end() || simulated == sheets.end()) {
      left.add(row[1]);
      continue;
    }
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
  left.report(result);
}

/// Where two simulations may have been compared: at the marks of the measured lattice, or at the
/// particles of the coarsest grid of their group, which is one with as many on the same cloth.
std::vector<std::vector<Eigen::Vector2d>> places_of(const StoreReader& reader,
                                                    const SheetFiles& sheets,
                                                    const std::vector<std::string>& pair) {
  std::vector<std::vector<Eigen::Vector2d>> all;
  const auto add_marks = [&](const Sheet& sheet) {
    all.emplace_back();
    for (const SheetMark& mark : sheet.marks) all.back().push_back(mark.material_m);
  };
  const std::string &measured = pair[1], &first = pair[2], &second = pair[3], &points = pair[4];
  if (const auto file = sheets.find(measured); file != sheets.end()) {
    const Sheet real = read_sheet(file->second);
    const auto lattice = LatticeCoordinates::of(real, file->second.string());
    if (!lattice) {
      add_marks(real);
      return all;
    }
    all.emplace_back();
    for (int row = 0; row < real.rows; ++row)
      for (int col = 0; col < real.cols; ++col) all.back().push_back(lattice->at({row, col}));
    return all;
  }
  if (!measured.empty()) return all;
  const Table grids = reader.query(
      "SELECT g.sha256, g.rows, g.cols FROM sheet AS g JOIN sheet AS f ON f.sha256 = ?1 WHERE "
      "g.kind = 'simulated' AND g.marks = CAST(?3 AS INTEGER) AND g.patch_warp_mm = "
      "f.patch_warp_mm AND g.patch_weft_mm = f.patch_weft_mm ORDER BY g.sha256 NOT IN (?1, ?2), "
      "g.sha256",
      {first, second, points});
  std::set<std::pair<std::string, std::string>> known;
  for (const auto& grid : grids.rows) {
    const auto file = sheets.find(grid[0]);
    if (file == sheets.end() || file->second.extension() != ".json") continue;
    if (known.emplace(grid[1], grid[2]).second) add_marks(read_sheet(file->second));
  }
  return all;
}

/// The same for pairs of simulations.
void recompute_pairs(const StoreReader& reader, const SheetFiles& sheets, Verification& result) {
  const Table rows = reader.query(
      "SELECT sha256, coalesce(measured_sha256, ''), first_sha256, second_sha256, points, mean_mm, "
      "max_mm FROM simulation_pair ORDER BY sha256");
  NotRecomputed left("pair");
  for (const auto& row : rows.rows) {
    const auto first = sheets.find(row[2]), second = sheets.find(row[3]);
    try {
      if (first == sheets.end() || second == sheets.end()) {
        left.add(row[0]);
        continue;
      }
      const auto places = places_of(reader, sheets, row);
      if (places.empty()) {
        left.add(row[0]);
        continue;
      }
      const Surface one(read_sheet(first->second), first->second.string());
      const Surface other(read_sheet(second->second), second->second.string());
      ++result.comparisons;
      const bool same = std::any_of(places.begin(), places.end(), [&](const auto& at) {
        const auto distances = distances_between(one, other, at);
        return !distances.empty() && number(row[4]) == static_cast<double>(distances.size()) &&
               number(row[5]) == statistics_of(distances).mean_m / mm &&
               number(row[6]) == statistics_of(distances).max_m / mm;
      });
      if (!same)
        result.findings.push_back(
            fmt::format("pair {} does not come out of its sheets", row[0].substr(0, 12)));
    } catch (const Error& error) {
      result.findings.push_back(
          fmt::format("pair {} cannot be recomputed: {}", row[0].substr(0, 12), error.what()));
    }
  }
  left.report(result);
}

/// The same for meshes without marks.
void recompute_surfaces(const StoreReader& reader, const SheetFiles& sheets, Verification& result) {
  const Table rows = reader.query(
      "SELECT sha256, measured_sha256, mesh_sha256, to_surface_mean_mm, to_surface_max_mm, "
      "coalesce(real_to_mesh_mean_mm, -1), coalesce(mesh_to_real_max_mm, -1) FROM "
      "surface_comparison ORDER BY sha256");
  NotRecomputed left("surface comparison");
  for (const auto& row : rows.rows) {
    const auto measured = sheets.find(row[1]), mesh = sheets.find(row[2]);
    if (measured == sheets.end() || mesh == sheets.end()) {
      left.add(row[0]);
      continue;
    }
    try {
      const auto surface = read_other_surface(mesh->second);
      if (!surface) continue;  // its changed bytes are a finding already
      const RealSurface found = compare_to_surface(read_sheet(measured->second), surface->mesh);
      ++result.comparisons;
      const bool same =
          number(row[3]) == found.to_surface.mean_m / mm &&
          number(row[4]) == found.to_surface.max_m / mm &&
          number(row[5]) ==
              (found.both_directions ? found.both_directions->first_to_second.mean_m / mm : -1) &&
          number(row[6]) == (found.both_directions
                                 ? found.both_directions->second_to_first.hausdorff_m / mm
                                 : -1);
      if (!same)
        result.findings.push_back(fmt::format(
            "surface comparison {} does not come out of its files", row[0].substr(0, 12)));
    } catch (const Error& error) {
      result.findings.push_back(fmt::format("surface comparison {} cannot be recomputed: {}",
                                            row[0].substr(0, 12), error.what()));
    }
  }
  left.report(result);
}

/// The same for equilibria: what their list says of them, and their best turns.
void recompute_branches(const StoreReader& reader, const SheetFiles& sheets, Verification& result) {
  const Table facts = reader.query(
      "SELECT sheet_sha256, branches_sha256, number, energy_uJ, starts, hem_nodes FROM branch "
      "ORDER BY sheet_sha256");
  NotRecomputed left("branch list");
  for (const auto& row : facts.rows) {
    const auto list = sheets.find(row[1]);  // lists are sealed as sheets are, by their hash
    if (list == sheets.end()) {
      left.add(row[1]);
      continue;
    }
    const auto listed = branch_in(list->second, whole_number(row[2]));
    const bool same = listed && listed->set_sha256 == row[1] &&
                      listed->energy_j / 1e-6 == number(row[3]) &&
                      listed->starts == number(row[4]) && listed->hem_nodes == number(row[5]);
    if (!same)
      result.findings.push_back(
          fmt::format("branch {} is not what its list {} says", row[2], list->second.string()));
  }
  left.report(result);
  const Table turns = reader.query(
      "SELECT c.measured_sha256, c.simulated_sha256, t.axis_x_mm, t.axis_y_mm, t.turned_mean_mm "
      "FROM branch_turn AS t JOIN comparison AS c ON c.sha256 = t.comparison_sha256 ORDER BY c.id");
  for (const auto& row : turns.rows) {
    const auto measured = sheets.find(row[0]), simulated = sheets.find(row[1]);
    if (measured == sheets.end() || simulated == sheets.end()) continue;  // said already
    const auto turned =
        best_turn(read_sheet(measured->second),
                  Surface(read_sheet(simulated->second), simulated->second.string()),
                  {number(row[2]) * mm, number(row[3]) * mm});
    // The axis went through a change of units, which may cost its last bit.
    if (!turned || std::abs(turned->mean_m / mm - number(row[4])) > 1e-9)
      result.findings.push_back(fmt::format("the best turn of {} does not come out of its sheets",
                                            simulated->second.string()));
  }
}

}  // namespace

Verification verify_store(const fs::path& named, bool with_recomputation) {
  const fs::path store = real_store(named);
  Verification result;
  const StoreLock lock(store, StoreLock::Kind::with_others);
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
    reader.emplace(store);
  } catch (const Error& error) {
    result.findings.emplace_back(error.what_failed());
    return result;
  }
  const LedgerCheck ledger = check_ledger(*reader);
  result.rows = ledger.entries;
  result.findings.insert(result.findings.end(), ledger.findings.begin(), ledger.findings.end());
  if (!sealed) return result;
  if (result.findings.empty()) check_length(*reader, store, seal, ledger, result);
  if (!has_sealed_bytes(store, seal, ledger))
    result.findings.push_back("bytes of " + store.string() + " were changed");
  check_files(folder_of(store), seal, result);
  if (!with_recomputation) return result;
  SheetFiles sheets;
  for (const auto& [name, sha256] : seal.files) {
    const fs::path file = folder_of(store) / name;
    if (name.ends_with(".json") && (is_copy(name) || sheets.count(sha256) == 0))
      sheets[sha256] = file;
    if (const auto other = other_mesh_id(file)) sheets[other->sha256] = file;
  }
  try {
    recompute(*reader, sheets, result);
    recompute_surfaces(*reader, sheets, result);
    recompute_pairs(*reader, sheets, result);
    recompute_branches(*reader, sheets, result);
  } catch (const Error& error) {
    result.findings.emplace_back(error.what_failed());
  }
  return result;
}

}  // namespace drape::compare
