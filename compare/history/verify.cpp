// SPDX-License-Identifier: Apache-2.0
#include "compare/history/verify.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <openssl/evp.h>
#include <openssl/pem.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <tuple>

#include "compare/compare.hpp"
#include "compare/meshes/other_mesh.hpp"
#include "compare/store/manifest.hpp"
#include "core/drape_mesh.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using units::mm;

constexpr const char* kUnreadable = "the store cannot be read to its end: ";

/// Checks the chain of manifests, and the size of the file with the last of them.
void check_manifests(SQLite::Database& database, const fs::path* file, Verification& result) {
  std::string previous;
  std::int64_t last = 0;
  for (const Manifest& manifest : manifests_of(database)) {
    const std::string hash = hash_of(database, manifest, last);
    if (manifest.number != ++result.manifests || manifest.previous_sha256 != previous ||
        manifest.sha256 != hash)
      result.findings.push_back(fmt::format("manifest {} was altered", manifest.number));
    previous = manifest.sha256;
    last = manifest.last;
    result.last_manifest = manifest.sha256;
  }
  if (result.manifests == 0) result.findings.emplace_back("the store has no manifest");
  if (first_of<int>(database, "SELECT 1 FROM listed WHERE sequence > ?", {last}))
    result.findings.emplace_back("rows are listed by no manifest");
  if (file == nullptr) return;
  if (std::string size = size_finding(database, *file); !size.empty())
    result.findings.push_back(std::move(size));
}

/// Checks every listed row by its hash, and finds rows that no manifest lists.
void check_rows(SQLite::Database& database, Verification& result) {
  RowReader reader(database);
  for (const ListedTable& table : listed_tables()) {
    for (std::string& altered : reader.alterations(table, result.rows))
      result.findings.push_back(std::move(altered));
    if (table.name != "blob") continue;
    for (const auto& [key] : rows_of<std::string>(database, "SELECT sha256 FROM blob"))
      if (!blob_in(database, key))
        result.findings.push_back("the bytes of blob " + key.substr(0, 12) + " were altered");
  }
  for (const auto& [table, count] : rows_of<std::string, int>(
           database,
           "SELECT \"table\", count(*) FROM pragma_foreign_key_check() GROUP BY \"table\" ORDER BY "
           "\"table\""))
    result.findings.push_back(
        fmt::format("{} rows of {} hang on a row that is not there", count, table));
  if (const std::string integrity = database.execAndGet("PRAGMA integrity_check").getString();
      integrity != "ok")
    result.findings.push_back("SQLite finds damage: " + integrity);
}

struct Absent {};  ///< thrown for content that the store lacks

/// Content of the store by its hash.
class Contents {
 public:
  explicit Contents(const StoreReader& reader) : reader_(reader) {}

  [[nodiscard]] Document document(const std::string& sha256) const {
    return {name(sha256), Syntax::json, bytes(sha256)};
  }
  [[nodiscard]] Sheet sheet(const std::string& sha256) const {
    return read_record<Sheet>(document(sha256));
  }
  /// A simulated sheet, or the mesh of another simulator sampled at the marks of the real one.
  [[nodiscard]] Sheet simulated(const std::string& sha256, const Sheet& real) {
    return put_mesh(sha256) ? read_other_mesh(toml(), real, mesh_).sheet.sheet : sheet(sha256);
  }
  [[nodiscard]] std::optional<OtherSurface> surface(const std::string& sha256) {
    return put_mesh(sha256) ? read_other_surface(toml(), mesh_) : std::nullopt;
  }

 private:
  [[nodiscard]] std::string name(const std::string& sha256) const {
    return fmt::format("{}, blob {}", reader_.file().string(), sha256.substr(0, 12));
  }
  [[nodiscard]] std::string bytes(const std::string& sha256) const {
    if (auto content = reader_.blob(sha256)) return std::move(*content);
    if (reader_.rows<int>("SELECT 1 FROM blob WHERE sha256 = ?", {sha256}).empty()) throw Absent();
    throw bad_input("the blob is not as it was written", {.file = name(sha256)},
                    "restore the store from a backup");
  }
  [[nodiscard]] fs::path toml() const { return folder_.path() / "mesh.toml"; }
  /// Writes the files of another simulator's mesh; false if the content is not one.
  [[nodiscard]] bool put_mesh(const std::string& sha256) {
    constexpr std::size_t kHash = 64;
    const std::string content = bytes(sha256);
    const auto description = description_in(content);
    if (!description) return false;
    write_durable(toml(), bytes(*description));
    mesh_ = folder_.path() / "mesh";
    mesh_ += read_record<DrapeMesh>(toml()).mesh_file.extension();
    write_durable(mesh_, bytes(content.substr(content.size() - kHash)));
    return true;
  }

  const StoreReader& reader_;
  TemporaryFolder folder_{"meshes of the store cannot be put out"};
  fs::path mesh_;
};

using Text = std::string;
using Places = std::vector<Eigen::Vector2d>;

Places marks_of(const Sheet& sheet) {
  Places places;
  for (const SheetMark& mark : sheet.marks) places.push_back(mark.material_m);
  return places;
}

/// Recomputes the numbers of the store from its blobs.
class Recomputation {
 public:
  Recomputation(const StoreReader& reader, Verification& result)
      : reader_(reader), contents_(reader), result_(result) {}

  void run() {
    comparisons();
    report_left();
    surfaces();
    report_left();
    pairs();
    report_left();
    branches();
    report_left();
    turns();
  }

 private:
  /// Tests that a row is reproduced with the same bits, else reports `wrong` of it; a row whose
  /// content is not in the store is left. Returns the number of rows computed.
  int judge(const char* kind, const Text& sha256, const Text& wrong,
            const std::function<bool()>& comes_out) {
    const Text name = fmt::format("{} {}", kind, sha256.substr(0, 12));
    try {
      if (!comes_out()) result_.findings.push_back(fmt::format("{} {}", name, wrong));
      return 1;
    } catch (const Absent&) {
      if (left_++ == 0) first_left_ = name;
    } catch (const Error& error) {
      result_.findings.push_back(fmt::format("{} cannot be recomputed: {}", name, error.what()));
    }
    return 0;
  }

  void report_left() {
    if (left_ > 0)
      result_.findings.push_back(
          fmt::format("{}{} not computed again: the store lacks their sheets", first_left_,
                      left_ == 1 ? Text(" was") : fmt::format(" and {} more were", left_ - 1)));
    left_ = 0;
  }

  /// Compares every distance and the mean of each comparison.
  void comparisons() {
    for (const auto& [id, key, measured, simulated, mean_mm] :
         reader_.rows<int, Text, Text, Text, double>(
             "SELECT id, sha256, measured_sha256, simulated_sha256, mean_mm FROM comparison ORDER "
             "BY id"))
      result_.comparisons += judge("comparison", key, "does not come out of its sheets", [&] {
        const Sheet real = contents_.sheet(measured);
        const std::vector<MarkError> marks =
            compare_marks(real, Surface(contents_.simulated(simulated, real), simulated)).marks;
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
      });
  }

  void surfaces() {
    using Length = std::optional<double>;
    for (const auto& [key, measured, mesh, mean_mm, max_mm, there_mm, back_mm] :
         reader_.rows<Text, Text, Text, double, double, Length, Length>(
             "SELECT sha256, measured_sha256, mesh_sha256, to_surface_mean_mm, to_surface_max_mm, "
             "real_to_mesh_mean_mm, mesh_to_real_max_mm FROM surface_comparison ORDER BY sha256"))
      result_.comparisons +=
          judge("surface comparison", key, "does not come out of its files", [&] {
            const Sheet real = contents_.sheet(measured);
            const auto surface = contents_.surface(mesh);
            if (!surface) return false;
            const RealSurface found = compare_to_surface(real, surface->mesh);
            const auto& both = found.both_directions;
            return mean_mm == found.to_surface.mean_m / mm &&
                   max_mm == found.to_surface.max_m / mm &&
                   there_mm == (both ? Length(both->first_to_second.mean_m / mm) : Length()) &&
                   back_mm == (both ? Length(both->second_to_first.hausdorff_m / mm) : Length());
          });
  }

  /// Points at which two simulations may have been compared: the marks of the measured
  /// lattice, or the particles of the coarsest grid of their group, which has as many on the
  /// same cloth.
  [[nodiscard]] std::vector<Places> places_of(const std::optional<Text>& measured,
                                              const Text& first, int points) {
    if (measured) {
      const Sheet real = contents_.sheet(*measured);
      const auto lattice = LatticeCoordinates::of(real, *measured);
      if (!lattice) return {marks_of(real)};
      Places all;
      for (int row = 0; row < real.rows; ++row)
        for (int col = 0; col < real.cols; ++col) all.push_back(lattice->at({row, col}));
      return {all};
    }
    std::vector<Places> all;
    for (const auto& [warp_mm, weft_mm] : reader_.rows<double, double>(
             "SELECT patch_warp_mm, patch_weft_mm FROM sheet WHERE sha256 = ?", {first})) {
      const auto [known, is_new] = grids_.try_emplace({warp_mm, weft_mm, points});
      if (is_new)
        for (const auto& [sheet] : reader_.rows<Text>(
                 "SELECT min(sha256) FROM sheet WHERE kind = 'simulated' AND marks = ?3 AND "
                 "patch_warp_mm = ?1 AND patch_weft_mm = ?2 AND sha256 IN (SELECT sheet_sha256 "
                 "FROM simulation WHERE simulator = 'drapebench') AND sha256 IN (SELECT sha256 "
                 "FROM blob) GROUP BY rows, cols",
                 {warp_mm, weft_mm, points}))
          known->second.push_back(marks_of(contents_.sheet(sheet)));
      all = known->second;
    }
    if (all.empty()) throw Absent();
    return all;
  }

  void pairs() {
    for (const auto& [key, measured, first, second, points, mean_mm, max_mm] :
         reader_.rows<Text, std::optional<Text>, Text, Text, int, double, double>(
             "SELECT sha256, measured_sha256, first_sha256, second_sha256, points, mean_mm, max_mm "
             "FROM simulation_pair ORDER BY sha256"))
      result_.comparisons += judge("pair", key, "does not come out of its sheets", [&] {
        const Surface one(contents_.sheet(first), first), other(contents_.sheet(second), second);
        const auto places = places_of(measured, first, points);
        return std::any_of(places.begin(), places.end(), [&](const Places& at) {
          const auto distances = distances_between(one, other, at);
          return !distances.empty() && static_cast<std::size_t>(points) == distances.size() &&
                 mean_mm == statistics_of(distances).mean_m / mm &&
                 max_mm == statistics_of(distances).max_m / mm;
        });
      });
  }

  /// Compares equilibria with their lists.
  void branches() {
    for (const auto& [set, number, energy_uJ, starts, hem_nodes] :
         reader_.rows<Text, int, double, int, int>(
             "SELECT branches_sha256, number, energy_uJ, starts, hem_nodes FROM branch ORDER BY "
             "sheet_sha256"))
      judge("branch list", set, fmt::format("says otherwise of branch {}", number), [&] {
        const auto listed = branch_in(contents_.document(set), number);
        return listed && listed->set_sha256 == set && listed->energy_j / 1e-6 == energy_uJ &&
               listed->starts == starts && listed->hem_nodes == hem_nodes;
      });
  }

  void turns() {
    for (const auto& [measured, simulated, x_mm, y_mm, mean_mm] :
         reader_.rows<Text, Text, double, double, double>(
             "SELECT c.measured_sha256, c.simulated_sha256, t.axis_x_mm, t.axis_y_mm, "
             "t.turned_mean_mm FROM branch_turn AS t JOIN comparison AS c ON c.sha256 = "
             "t.comparison_sha256 ORDER BY c.id"))
      judge("the best turn of", simulated, "does not come out of its sheets", [&] {
        const auto turned =
            best_turn(contents_.sheet(measured), Surface(contents_.sheet(simulated), simulated),
                      {x_mm * mm, y_mm * mm});
        // The axis was converted between units, which can change its last bit.
        return turned && std::abs(turned->mean_m / mm - mean_mm) <= 1e-9;
      });
  }

  const StoreReader& reader_;
  Contents contents_;
  Verification& result_;
  std::map<std::tuple<double, double, int>, std::vector<Places>> grids_;
  long long left_ = 0;  ///< rows of the current kind without their content
  Text first_left_;
};

}  // namespace

std::vector<std::string> altered_rows(const StoreReader& reader) {
  Verification result;
  try {
    check_manifests(reader.database(), nullptr, result);
    check_rows(reader.database(), result);
  } catch (const SQLite::Exception& exception) {
    result.findings.push_back(kUnreadable + std::string(exception.what()));
  }
  return result.findings;
}

Verification verify_store(const fs::path& named, bool with_recomputation) {
  const fs::path store = real_store(named);
  Verification result;
  std::optional<StoreReader> reader;
  try {
    reader.emplace(store, StoreReader::Schema::any);
    const SQLite::Transaction one_state(reader->database(), SQLite::TransactionBehavior::DEFERRED);
    result.findings = schema_findings(reader->database());
    // A view in place of a table need not end.
    for (const std::string& finding : result.findings)
      if (finding.starts_with("table ")) return result;
    const fs::path opened = reader->opened();
    check_manifests(reader->database(), reader->is_of_older_version() ? nullptr : &opened, result);
    check_rows(reader->database(), result);
    if (with_recomputation) Recomputation(*reader, result).run();
  } catch (const SQLite::Exception& exception) {
    result.findings.push_back(kUnreadable + std::string(exception.what()));
  } catch (const Error& error) {
    result.findings.emplace_back(error.what_failed());
  }
  return result;
}

fs::path signature_path(const fs::path& store) {
  return real_store(store).string() + ".sig";
}

namespace {

using Key = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;
using Context = std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)>;

enum class Half { secret, open };

/// Reads a key without a passphrase, since a program cannot be asked for one.
Key read_key(const fs::path& file, Half half) {
  const std::string text = read_text(file);
  const std::unique_ptr<BIO, decltype(&BIO_free)> memory(
      BIO_new_mem_buf(text.data(), static_cast<int>(text.size())), &BIO_free);
  char none[] = "";
  Key key(half == Half::secret ? PEM_read_bio_PrivateKey(memory.get(), nullptr, nullptr, none)
                               : PEM_read_bio_PUBKEY(memory.get(), nullptr, nullptr, none),
          &EVP_PKEY_free);
  if (key && EVP_PKEY_get_base_id(key.get()) == EVP_PKEY_ED25519) return key;
  throw bad_input(
      half == Half::secret ? "this is no Ed25519 private key without passphrase"
                           : "this is no Ed25519 public key",
      {.file = file.string()},
      half == Half::secret
          ? "make one: openssl genpkey -algorithm ed25519 -out key.pem"
          : "make it from the private one: openssl pkey -in key.pem -pubout -out pub.pem");
}

/// The text to be signed.
std::string signed_text(const std::string& manifest_sha256) {
  return "drapebench/signed-manifest/1\n" + manifest_sha256 + "\n";
}

const unsigned char* bytes_of(const std::string& text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}

}  // namespace

void sign_store(const fs::path& store, const fs::path& private_key) {
  const Key key = read_key(private_key, Half::secret);
  const Verification found = verify_store(store, false);
  if (!found.findings.empty()) throw not_as_written(store, found.findings.front());
  const std::string text = signed_text(found.last_manifest);
  const Context context(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  std::string signature(64, '\0');  // RFC 8032
  std::size_t size = signature.size();
  if (EVP_DigestSignInit(context.get(), nullptr, nullptr, nullptr, key.get()) != 1 ||
      EVP_DigestSign(context.get(), reinterpret_cast<unsigned char*>(signature.data()), &size,
                     bytes_of(text), text.size()) != 1)
    throw internal_error("the manifest cannot be signed");
  write_durable(signature_path(store), signature);
}

bool is_signed(const fs::path& store, const std::string& manifest_sha256,
               const fs::path& public_key) {
  const Key key = read_key(public_key, Half::open);
  const std::string text = signed_text(manifest_sha256),
                    signature = read_text(signature_path(store));
  const Context context(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  return EVP_DigestVerifyInit(context.get(), nullptr, nullptr, nullptr, key.get()) == 1 &&
         EVP_DigestVerify(context.get(), bytes_of(signature), signature.size(), bytes_of(text),
                          text.size()) == 1;
}

}  // namespace drape::compare
