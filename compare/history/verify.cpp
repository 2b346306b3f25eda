// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "compare/compare.hpp"
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
  if (version_in_file(store) >= store_version()) return false;
  const auto head = reader.rows<std::string>("SELECT chain_sha256 FROM ledger WHERE sequence = ?",
                                             {seal.entries});
  return head == decltype(head){{seal.head}} &&
         reader
             .rows<int>("SELECT 1 FROM ledger WHERE sequence > ? AND kind <> 'metric'",
                        {seal.entries})
             .empty();
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

/// Compares what was committed and, with an empty write-ahead log, the file itself.
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

using Text = std::string;
using Places = std::vector<Eigen::Vector2d>;

Places marks_of(const Sheet& sheet) {
  Places places;
  for (const SheetMark& mark : sheet.marks) places.push_back(mark.material_m);
  return places;
}

/// Computes what the store holds again from the sealed files.
class Recomputation {
 public:
  Recomputation(const StoreReader& reader, const SheetFiles& sheets, Verification& result)
      : reader_(reader), sheets_(sheets), result_(result) {}

  void run() {
    comparisons();
    surfaces();
    pairs();
    branches();
  }

 private:
  [[nodiscard]] const fs::path* file(const Text& sha256) const {
    const auto found = sheets_.find(sha256);
    return found == sheets_.end() ? nullptr : &found->second;
  }

  /// Tests that a row comes out with the same bits; nothing where no sealed file holds its sheets.
  void judge(const char* kind, const Text& sha256, const char* sources,
             const std::function<std::optional<bool>()>& comes_out) {
    const Text name = fmt::format("{} {}", kind, sha256.substr(0, 12));
    try {
      const auto same = comes_out();
      if (!same && left_++ == 0) first_left_ = name;
      result_.comparisons += same.has_value();
      if (same == false)
        result_.findings.push_back(fmt::format("{} does not come out of its {}", name, sources));
    } catch (const Error& error) {
      result_.findings.push_back(fmt::format("{} cannot be recomputed: {}", name, error.what()));
    }
  }

  void report_left() {
    if (left_ > 0)
      result_.findings.push_back(
          fmt::format("{}{} not recomputed: no sealed file holds its sheets", first_left_,
                      left_ == 1 ? Text(" was") : fmt::format(" and {} more were", left_ - 1)));
    left_ = 0;
  }

  /// Every distance and the mean.
  [[nodiscard]] bool same_marks(int id, double mean_mm, const std::vector<MarkError>& marks) const {
    const auto rows = reader_.rows<int, int, double>(
        "SELECT \"row\", \"col\", distance_mm FROM mark_error WHERE comparison_id = ? ORDER BY "
        "\"row\", \"col\"",
        {id});
    return std::equal(rows.begin(), rows.end(), marks.begin(), marks.end(),
                      [](const auto& row, const MarkError& mark) {
                        return row ==
                               std::tuple(mark.mark.row, mark.mark.col, mark.distance_m / mm);
                      }) &&
           mean_mm == statistics_of(marks).mean_m / mm;
  }

  void comparisons() {
    for (const auto& [id, key, measured, simulated, mean_mm] :
         reader_.rows<int, Text, Text, Text, double>(
             "SELECT id, sha256, measured_sha256, simulated_sha256, mean_mm FROM comparison ORDER "
             "BY id"))
      judge("comparison", key, "sheets", [&]() -> std::optional<bool> {
        const fs::path *one = file(measured), *two = file(simulated);
        if (one == nullptr || two == nullptr) return std::nullopt;
        const Sheet real = read_sheet(*one);
        const Sheet other = two->extension() == ".toml" ? read_other_mesh(*two, real).sheet.sheet
                                                        : read_sheet(*two);
        return same_marks(id, mean_mm, compare_marks(real, Surface(other, two->string())).marks);
      });
    report_left();
  }

  void surfaces() {
    using Length = std::optional<double>;
    for (const auto& [key, measured, mesh, mean_mm, max_mm, there_mm, back_mm] :
         reader_.rows<Text, Text, Text, double, double, Length, Length>(
             "SELECT sha256, measured_sha256, mesh_sha256, to_surface_mean_mm, to_surface_max_mm, "
             "real_to_mesh_mean_mm, mesh_to_real_max_mm FROM surface_comparison ORDER BY sha256"))
      judge("surface comparison", key, "files", [&]() -> std::optional<bool> {
        const fs::path *one = file(measured), *two = file(mesh);
        if (one == nullptr || two == nullptr) return std::nullopt;
        const auto surface = read_other_surface(*two);
        if (!surface) return false;
        const RealSurface found = compare_to_surface(read_sheet(*one), surface->mesh);
        const auto& both = found.both_directions;
        return mean_mm == found.to_surface.mean_m / mm && max_mm == found.to_surface.max_m / mm &&
               there_mm == (both ? Length(both->first_to_second.mean_m / mm) : Length()) &&
               back_mm == (both ? Length(both->second_to_first.hausdorff_m / mm) : Length());
      });
    report_left();
  }

  /// Places at which two simulations may have been compared: at the marks of the measured lattice,
  /// or at the particles of the coarsest grid of their group, which is one with as many on the same
  /// cloth.
  [[nodiscard]] std::vector<Places> places_of(const std::optional<Text>& measured,
                                              const Text& first, const Text& second,
                                              int points) const {
    std::vector<Places> all;
    if (measured) {
      const fs::path* real_file = file(*measured);
      if (real_file == nullptr) return all;
      const Sheet real = read_sheet(*real_file);
      const auto lattice = LatticeCoordinates::of(real, real_file->string());
      if (!lattice) return {marks_of(real)};
      all.emplace_back();
      for (int row = 0; row < real.rows; ++row)
        for (int col = 0; col < real.cols; ++col) all.back().push_back(lattice->at({row, col}));
      return all;
    }
    std::set<std::pair<int, int>> known;
    for (const auto& [sheet, rows, cols] : reader_.rows<Text, int, int>(
             "SELECT g.sha256, g.rows, g.cols FROM sheet AS g JOIN sheet AS f ON f.sha256 = ?1 "
             "WHERE g.kind = 'simulated' AND g.marks = ?3 AND g.patch_warp_mm = f.patch_warp_mm "
             "AND g.patch_weft_mm = f.patch_weft_mm ORDER BY g.sha256 NOT IN (?1, ?2), g.sha256",
             {first, second, points}))
      if (const fs::path* grid = file(sheet);
          grid != nullptr && grid->extension() == ".json" && known.emplace(rows, cols).second)
        all.push_back(marks_of(read_sheet(*grid)));
    return all;
  }

  void pairs() {
    for (const auto& [key, measured, first, second, points, mean_mm, max_mm] :
         reader_.rows<Text, std::optional<Text>, Text, Text, int, double, double>(
             "SELECT sha256, measured_sha256, first_sha256, second_sha256, points, mean_mm, max_mm "
             "FROM simulation_pair ORDER BY sha256"))
      judge("pair", key, "sheets", [&]() -> std::optional<bool> {
        const fs::path *a = file(first), *b = file(second);
        if (a == nullptr || b == nullptr) return std::nullopt;
        const auto places = places_of(measured, first, second, points);
        if (places.empty()) return std::nullopt;
        const Surface one(read_sheet(*a), a->string()), other(read_sheet(*b), b->string());
        return std::any_of(places.begin(), places.end(), [&](const Places& at) {
          const auto distances = distances_between(one, other, at);
          return !distances.empty() && static_cast<std::size_t>(points) == distances.size() &&
                 mean_mm == statistics_of(distances).mean_m / mm &&
                 max_mm == statistics_of(distances).max_m / mm;
        });
      });
    report_left();
  }

  /// Compares equilibria with their lists, and their best turns.
  void branches() {
    for (const auto& [set, number, energy_uJ, starts, hem_nodes] :
         reader_.rows<Text, int, double, int, int>(
             "SELECT branches_sha256, number, energy_uJ, starts, hem_nodes FROM branch ORDER BY "
             "sheet_sha256")) {
      const fs::path* list = file(set);  // lists are sealed as sheets are, by their hash
      if (list == nullptr) {
        if (left_++ == 0) first_left_ = "branch list " + set.substr(0, 12);
        continue;
      }
      const auto listed = branch_in(*list, number);
      if (!listed || listed->set_sha256 != set || listed->energy_j / 1e-6 != energy_uJ ||
          listed->starts != starts || listed->hem_nodes != hem_nodes)
        result_.findings.push_back(
            fmt::format("branch {} is not what its list {} says", number, list->string()));
    }
    report_left();
    for (const auto& [measured, simulated, x_mm, y_mm, mean_mm] :
         reader_.rows<Text, Text, double, double, double>(
             "SELECT c.measured_sha256, c.simulated_sha256, t.axis_x_mm, t.axis_y_mm, "
             "t.turned_mean_mm FROM branch_turn AS t JOIN comparison AS c ON c.sha256 = "
             "t.comparison_sha256 ORDER BY c.id")) {
      const fs::path *one = file(measured), *two = file(simulated);
      if (one == nullptr || two == nullptr) continue;  // said already
      const auto turned = best_turn(read_sheet(*one), Surface(read_sheet(*two), two->string()),
                                    {x_mm * mm, y_mm * mm});
      // The axis went through a change of units, which may cost its last bit.
      if (!turned || std::abs(turned->mean_m / mm - mean_mm) > 1e-9)
        result_.findings.push_back(
            fmt::format("the best turn of {} does not come out of its sheets", two->string()));
    }
  }

  const StoreReader& reader_;
  const SheetFiles& sheets_;
  Verification& result_;
  long long left_ = 0;  ///< rows of the kind at hand without a sealed file
  Text first_left_;
};

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
    Recomputation(*reader, sheets, result).run();
  } catch (const Error& error) {
    result.findings.emplace_back(error.what_failed());
  }
  return result;
}

}  // namespace drape::compare
