// SPDX-License-Identifier: Apache-2.0
#include "compare/history/verify.hpp"

#include <SQLiteCpp/Savepoint.h>
#include <fmt/format.h>
#include <openssl/evp.h>
#include <openssl/pem.h>

#include "compare/store/outcome.hpp"
#include "core/drape_mesh.hpp"

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

using Text = std::string;
using Places = std::vector<Eigen::Vector2d>;

/// Recomputes the numbers of the store from its blobs.
class Recomputation {
 public:
  Recomputation(const StoreReader& reader, Verification& result)
      : reader_(reader), result_(result) {}

  void run() {
    for (void (Recomputation::*const kind)() :
         {&Recomputation::comparisons, &Recomputation::surfaces, &Recomputation::pairs,
          &Recomputation::branches, &Recomputation::turns}) {
      (this->*kind)();
      if (left_ > 0)
        result_.findings.push_back(
            fmt::format("{}{} not computed again: the store lacks their sheets", first_left_,
                        left_ == 1 ? Text(" was") : fmt::format(" and {} more were", left_ - 1)));
      left_ = 0;
    }
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
  [[nodiscard]] Document document(const std::string& sha256) const {
    return {name(sha256), Syntax::json, bytes(sha256)};
  }
  [[nodiscard]] Sheet sheet(const std::string& sha256) const {
    return read_record<Sheet>(document(sha256));
  }
  [[nodiscard]] fs::path toml() const { return folder_.path() / "mesh.toml"; }
  /// Writes the description and the mesh of another simulator; returns the mesh's path, empty if
  /// the content is not one.
  [[nodiscard]] fs::path put_mesh(const std::string& sha256) const {
    constexpr std::size_t kHash = 64;
    const std::string content = bytes(sha256);
    const auto description = description_in(content);
    if (!description) return {};
    write_durable(toml(), bytes(*description));
    fs::path mesh = folder_.path() / "mesh";
    mesh += read_record<DrapeMesh>(toml()).mesh_file.extension();
    write_durable(mesh, bytes(content.substr(content.size() - kHash)));
    return mesh;
  }

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

  /// Compares every distance and the mean of each comparison.
  void comparisons() {
    for (const auto& [id, key, measured, simulated, mean_mm] :
         reader_.rows<int, Text, Text, Text, double>(
             "SELECT id, sha256, measured_sha256, simulated_sha256, mean_mm FROM comparison ORDER "
             "BY id"))
      result_.comparisons += judge("comparison", key, "does not come out of its sheets", [&] {
        // A simulated sheet, or the mesh of another simulator sampled at the marks of the real one.
        const Sheet real = sheet(measured);
        const fs::path mesh = put_mesh(simulated);
        const Surface cloth(
            mesh.empty() ? sheet(simulated) : read_other_mesh(toml(), real, mesh).sheet.sheet,
            simulated);
        const std::vector<MarkError> marks = compare_marks(real, cloth).marks;
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
            const Sheet real = sheet(measured);
            const fs::path file = put_mesh(mesh);
            const auto surface = file.empty() ? std::nullopt : read_other_surface(toml(), file);
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
    if (measured) return {lattice_places_of(sheet(*measured), *measured)};
    std::vector<Places> all;
    for (const auto& [warp_mm, weft_mm] : reader_.rows<double, double>(
             "SELECT patch_warp_mm, patch_weft_mm FROM sheet WHERE sha256 = ?", {first})) {
      const auto [known, is_new] = grids_.try_emplace({warp_mm, weft_mm, points});
      if (is_new)
        for (const auto& [simulated] : reader_.rows<Text>(
                 "SELECT min(sha256) FROM sheet WHERE kind = 'simulated' AND marks = ?3 AND "
                 "patch_warp_mm = ?1 AND patch_weft_mm = ?2 AND sha256 IN (SELECT sheet_sha256 "
                 "FROM simulation WHERE simulator = 'drapebench') AND sha256 IN (SELECT sha256 "
                 "FROM blob) GROUP BY rows, cols",
                 {warp_mm, weft_mm, points}))
          known->second.push_back(compare::places_of(sheet(simulated)));
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
        const Surface one(sheet(first), first), other(sheet(second), second);
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
        const auto listed = branch_in(document(set), number);
        return listed && listed->set_sha256 == set && listed->energy_j / 1e-6 == energy_uJ &&
               static_cast<int>(listed->starts.size()) == starts && listed->hem_nodes == hem_nodes;
      });
  }

  void turns() {
    for (const auto& [measured, simulated, x_mm, y_mm, mean_mm] :
         reader_.rows<Text, Text, double, double, double>(
             "SELECT c.measured_sha256, c.simulated_sha256, t.axis_x_mm, t.axis_y_mm, "
             "t.turned_mean_mm FROM branch_turn AS t JOIN comparison AS c ON c.sha256 = "
             "t.comparison_sha256 ORDER BY c.id"))
      judge("the best turn of", simulated, "does not come out of its sheets", [&] {
        const auto turned = best_turn(sheet(measured), Surface(sheet(simulated), simulated),
                                      {x_mm * mm, y_mm * mm});
        // The axis was converted between units, which can change its last bit.
        return turned && std::abs(turned->mean_m / mm - mean_mm) <= 1e-9;
      });
  }

  const StoreReader& reader_;
  Verification& result_;
  TemporaryFolder folder_{"meshes of the store cannot be put out"};
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

namespace {

/// Writes what `rows` adds into `target`; a store created for this is removed if it fails.
void write_into(const fs::path& target, const std::function<void(Writer&)>& rows) {
  const bool there = fs::exists(target);
  try {
    Store store(target);
    store.write(rows);
    store.close();
  } catch (...) {
    std::error_code ignored;
    for (const char* end : {"", "-wal", "-shm"})
      if (!there) fs::remove(target.string() + end, ignored);
    throw;
  }
}

/// Copies the paths of another store's content, relative to the folder of `target`.
void copy_places(const std::vector<Cells>& files, const fs::path& source, const fs::path& target,
                 Writer& writer) {
  for (const auto& [sha256, path] : typed<std::string, std::string>(files))
    writer.insert_file(
        sha256, fs::proximate((folder_of(source) / path).lexically_normal(), folder_of(target))
                    .generic_string());
}

struct Source {
  explicit Source(const fs::path& file) : reader(file), rows(reader.database()) {}
  StoreReader reader;
  RowReader rows;
};

constexpr std::size_t kDateOfRun = 1;  ///< index among the columns of ListedTable

/// A run that two stores received at two times was stored at both.
void repeat_run(Writer& writer, const std::string& key, const Cell& date) {
  if (first_of<int>(writer.database(),
                    "SELECT 1 FROM run WHERE sha256 = ?1 AND date = ?2 UNION ALL SELECT 1 FROM "
                    "run_repetition WHERE run_sha256 = ?1 AND date = ?2",
                    {key, date}))
    return;
  const std::string& moment = std::get<std::string>(date);
  writer.insert("run_repetition", repetition_key(key, moment, 0), key, moment);
}

[[nodiscard]] Error contradiction(const ListedTable& table, const std::string& key,
                                  const Source& source) {
  return bad_input(
      fmt::format("two stores contradict each other on {} {}", table.name, key.substr(0, 12)),
      {.file = source.reader.file().string()},
      "see what each has by `drape results show`; leave the wrong one out, and import its right "
      "sheets into a new store");
}

/// Fills missing values of `ours`; true if there were any. A sheet can have been given to one
/// store without the files beside it, which is not a contradiction.
bool combine(const ListedTable& table, const std::string& key, std::vector<Cells>& ours,
             const std::vector<Cells>& theirs, const Source& source) {
  if (theirs.empty()) return false;
  if (ours.size() != theirs.size()) throw contradiction(table, key, source);
  bool filled = false;
  for (std::size_t row = 0; row < ours.size(); ++row)
    for (std::size_t i = 0; i < ours[row].size(); ++i) {
      Cell& own = ours[row][i];
      const Cell& other = theirs[row][i];
      if (own == other || other.is_null()) continue;
      // The same run can have been stored on two days.
      if (table.name == "run" && i == kDateOfRun) continue;
      if (!own.is_null()) throw contradiction(table, key, source);
      own = other;
      filled = true;
    }
  return filled;
}

}  // namespace

MergeCounts merge_stores(const fs::path& target, const std::vector<fs::path>& stores) {
  std::map<std::string, std::unique_ptr<Source>> by_manifest;
  for (const fs::path& store : stores) {
    if (fs::exists(target) && fs::exists(store) && fs::equivalent(store, target))
      throw usage_error("a store cannot be merged into itself", "name another with --store");
    auto source = std::make_unique<Source>(store);
    if (const auto altered = altered_rows(source->reader); !altered.empty())
      throw not_as_written(store, altered.front());
    by_manifest.try_emplace(last_manifest(source->reader.database()).sha256, std::move(source));
  }
  MergeCounts counts;
  write_into(target, [&](Writer& writer) {
    RowReader own(writer.database());
    for (auto at = by_manifest.begin(); at != by_manifest.end(); ++at)
      for (const auto& [kind, key] : rows_of<std::string, std::string>(
               at->second->reader.database(),
               "SELECT kind, key FROM listed WHERE kind <> 'metric' ORDER BY sequence")) {
        Source& source = *at->second;
        if (kind == "blob") {
          const bool there = writer.has("blob", key);
          if (!there) writer.insert_blob(key, *source.reader.blob(key));
          ++(there ? counts.present : counts.added);
          continue;
        }
        const ListedTable& table = listed_table(kind);
        const auto rows_in = [&, &of = key](RowReader& reader) {
          return reader.read(table, of, RowReader::Take::rows);
        };
        const ListedRows theirs = rows_in(source.rows);
        if (kind == "file") {
          copy_places(theirs.rows, source.reader.file(), target, writer);
          continue;
        }
        ListedRows ours = rows_in(own);
        const bool is_new = ours.count == 0;
        ++(is_new ? counts.added : counts.present);
        if (ours.sha256 == theirs.sha256) continue;
        if (is_new) ours.rows = theirs.rows;
        if (combine(table, key, ours.rows, theirs.rows, source))
          counts.known_better.insert(fmt::format("{} {}", kind, key));
        for (auto later = std::next(at); later != by_manifest.end(); ++later)
          combine(table, key, ours.rows, rows_in(later->second->rows).rows, *later->second);
        for (const Cells& row : ours.rows)
          if (is_new && !writer.insert_row(table, row)) throw contradiction(table, key, source);
        if (!is_new && kind == "run") repeat_run(writer, key, theirs.rows.front()[kDateOfRun]);
      }
  });
  return counts;
}

namespace {

constexpr int kLongestHole = 10000;     ///< number of entries that may be missing before the last
constexpr int kLeastEntry_bytes = 128;  ///< two hashes, which bounds the entries in a file

/// A copy of a damaged store, since opening it can move its write-ahead log into it.
class DamagedCopy {
 public:
  explicit DamagedCopy(const fs::path& store) {
    for (const char* end : {"", "-wal"})
      if (fs::is_regular_file(store.string() + end))
        fs::copy_file(store.string() + end, file().string() + end);
  }
  [[nodiscard]] fs::path file() const { return folder_.path() / "store"; }

  /// Gives the copy the header and the schema of an empty store. Both are made by the same
  /// statements, so each table has its root on the same page, unless the store was once migrated
  /// from an older version; the hashes of the rows show whether what is read this way was written.
  void take_schema() {
    const fs::path empty = folder_.path() / "empty";
    Store(empty).close();
    SQLite::Database database(empty.string(), SQLite::OPEN_READWRITE);
    const auto size = static_cast<std::size_t>(database.execAndGet("PRAGMA page_size").getInt());
    const std::string good = read_text(empty);
    std::string bytes = read_text(file());
    if (bytes.size() < size) return;
    for (const auto& [page] :
         rows_of<int>(database, "SELECT pageno FROM dbstat WHERE name = 'sqlite_schema'")) {
      const std::size_t at = size * (static_cast<std::size_t>(page) - 1);
      if (at + size <= bytes.size()) bytes.replace(at, size, good, at, size);
    }
    constexpr std::size_t kPageCount = 28, kFreePages = 32;  // big-endian; SQLite's format, 1.3
    const std::size_t count = bytes.size() / size;
    for (std::size_t i = 0; i < 4; ++i)
      bytes[kPageCount + i] = static_cast<char>(count >> (24 - 8 * i));
    std::fill_n(bytes.begin() + kFreePages, 8, '\0');
    write_durable(file(), bytes);
  }

 private:
  TemporaryFolder folder_{"a copy of the store cannot be made"};
};

/// Table, key and hash of rows that a manifest lists.
using Entry = std::tuple<std::string, std::string, std::string>;

/// A damaged store read in one particular way.
class Damaged {
 public:
  explicit Damaged(const fs::path& file) : database_(file.string(), SQLite::OPEN_READWRITE) {}

  [[nodiscard]] SQLite::Database& database() { return database_; }

  [[nodiscard]] std::optional<Entry> entry(std::int64_t sequence) {
    const auto found = tried([&] {
      return rows_of<std::string, std::string, std::string>(
          database_, "SELECT kind, key, sha256 FROM listed WHERE sequence = ?", {sequence});
    });
    return found.empty() ? std::nullopt : std::optional(found.front());
  }

  /// Copies everything that still has its hash.
  bool carry(const Entry& entry, const fs::path& source, const fs::path& target, Writer& writer) {
    const auto& [kind, key, sha256] = entry;
    if (kind == "blob") {
      auto content = tried([&, &of = key] { return blob_in(database_, of); });
      if (!content) content = tried([&, &of = key] { return blob_in(database_, of, false); });
      if (content) writer.insert_blob(key, *content);
      return content.has_value();
    }
    const auto table = std::find_if(listed_tables().begin(), listed_tables().end(),
                                    [&of = kind](const auto& one) { return one.name == of; });
    if (table == listed_tables().end()) return false;
    if (RowReader(writer.database()).read(*table, key).sha256 == sha256) return true;
    for (RowReader* reader : {&by_index_, &by_table_})
      if (tried([&, &of = key, &written = sha256] {
            const ListedRows found = reader->read(*table, of, RowReader::Take::rows);
            if (found.sha256 != written) return false;
            SQLite::Savepoint unit(writer.database(), "unit");
            if (table->name == "file") copy_places(found.rows, source, target, writer);
            for (const Cells& row : found.rows)
              if (table->name != "file" && !writer.insert_row(*table, row)) return false;
            unit.release();
            return true;
          }))
        return true;
    return false;
  }

 private:
  /// The result; an empty one if a page is damaged.
  template <class Work>
  static auto tried(const Work& work) -> decltype(work()) {
    try {
      return work();
    } catch (const SQLite::Exception&) {
      return {};
    }
  }

  SQLite::Database database_;
  RowReader by_index_{database_}, by_table_{database_, false};
};

/// Ways to read a damaged store: as it is, if its tables are those of this program, and with a new
/// schema. An older version is migrated to this one.
std::vector<std::unique_ptr<Damaged>> ways_to_read(const DamagedCopy& copy, DamagedCopy& mended,
                                                   const fs::path& damaged,
                                                   std::vector<std::string>& lost) {
  std::vector<std::unique_ptr<Damaged>> ways;
  try {
    auto way = std::make_unique<Damaged>(copy.file());
    const int version = version_of(way->database(), damaged);
    if (version > 0 && version < store_version()) migrate(way->database(), version, damaged, &lost);
    const std::vector<std::string> findings = schema_findings(way->database());
    if (std::none_of(findings.begin(), findings.end(),
                     [](const std::string& one) { return one.starts_with("table "); }))
      ways.push_back(std::move(way));
  } catch (const SQLite::Exception&) {  // the next way may not need that page
  } catch (const Error&) {
  }
  mended.take_schema();
  ways.push_back(std::make_unique<Damaged>(mended.file()));
  return ways;
}

}  // namespace

Rescue rescue_store(const fs::path& named, const fs::path& fresh) {
  const fs::path damaged = real_store(named);
  if (!fs::is_regular_file(damaged))
    throw bad_input("there is no results store", {.file = damaged.string()},
                    "name the damaged one");
  if (fs::exists(fresh) && fs::equivalent(fresh, damaged))
    throw usage_error("a store cannot be rescued into itself", "name a new one with --store");
  const DamagedCopy copy(damaged);
  DamagedCopy mended(damaged);
  const auto most_entries = static_cast<std::int64_t>(
      (fs::file_size(copy.file()) + (fs::exists(copy.file().string() + "-wal")
                                         ? fs::file_size(copy.file().string() + "-wal")
                                         : 0)) /
      kLeastEntry_bytes);
  Rescue result;
  const auto ways = ways_to_read(copy, mended, damaged, result.lost);
  write_into(fresh, [&](Writer& writer) {
    std::int64_t last = 0;
    const auto end = [&] { return std::min<std::int64_t>(last + kLongestHole, most_entries); };
    for (std::int64_t sequence = 1; sequence <= end(); ++sequence) {
      std::optional<Entry> entry;
      for (const auto& way : ways)
        if (!entry) entry = way->entry(sequence);
      if (!entry) continue;
      for (++last; last < sequence; ++last)
        result.lost.push_back(fmt::format("listed row {}", last));
      if (std::any_of(ways.begin(), ways.end(),
                      [&](const auto& way) { return way->carry(*entry, damaged, fresh, writer); }))
        ++result.kept;
      else
        result.lost.push_back(std::get<0>(*entry) + " " + std::get<1>(*entry));
    }
    if (result.kept == 0)
      throw bad_input("nothing of the store can be read", {.file = damaged.string()},
                      "import the sheets again: drape results import FOLDER --store NEW");
  });
  return result;
}

}  // namespace drape::compare
