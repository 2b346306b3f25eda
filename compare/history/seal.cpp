// SPDX-License-Identifier: Apache-2.0
#include "compare/history/seal.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <map>
#include <memory>
#include <string>

#include "compare/meshes/other_mesh.hpp"
#include "compare/store/rows.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

constexpr int kSealVersion = 1;
constexpr const char* kDamaged = "the seal of the results store was changed";

std::string quoted(const std::string& text) {
  std::string line = pretty(Json(text));
  line.pop_back();
  return line;
}

/// As pretty() prints it, without a tree of all files.
std::string text_of(const Seal& seal) {
  Json json;
  json["schema"] = fmt::format("drapebench/seal/{}", kSealVersion);
  json["store"] = seal.store;
  json["store_sha256"] = seal.store_sha256;
  json["entries"] = seal.entries;
  json["head"] = seal.head;
  json["files"] = Json::array();
  std::string text = pretty(json);
  const std::string end = "\n}\n";
  text.resize(text.size() - end.size() - 1);  // up to the opening bracket
  for (const auto& [file, sha256] : seal.files) {
    if (text.back() == '}') text += ',';
    text += fmt::format("\n  {{\n   \"file\": {},\n   \"sha256\": {}\n  }}", quoted(file),
                        quoted(sha256));
  }
  text += seal.files.empty() ? "]" : "\n ]";
  const std::string sha256 = sha256_of(std::string_view(text + end));
  return text + fmt::format(",\n \"seal_sha256\": {}", quoted(sha256)) + end;
}

/// Takes each file out of the text as it is read. What is not exactly as text_of() writes it
/// differs from it afterwards.
Seal seal_in(const std::string& text) {
  Seal seal;
  const auto each = [&](int depth, Json::parse_event_t event, Json& value) {
    if (event != Json::parse_event_t::object_end || depth != 2) return true;
    seal.files[value.at("file").get<std::string>()] = value.at("sha256").get<std::string>();
    return false;
  };
  const Json json = Json::parse(text, each);
  seal.store = json.at("store").get<std::string>();
  seal.store_sha256 = json.at("store_sha256").get<std::string>();
  // A number with a fraction stays 0, which is not what was read.
  const Json& entries = json.at("entries");
  if (entries.is_number_integer()) seal.entries = entries.get<long long>();
  seal.head = json.at("head").get<std::string>();
  return seal;
}

/// The chain may have grown since it was sealed, but what was sealed must still be its beginning:
/// else sealing again would hide that rows were removed.
void check_beginning(SQLite::Database& database, const Seal& before, const fs::path& store) {
  if (before.entries == 0 ||
      first_of<std::string>(database, "SELECT chain_sha256 FROM ledger WHERE sequence = ?",
                            {before.entries}) == before.head)
    return;
  throw bad_input("rows of the results store are missing since it was sealed",
                  {.file = store.string()}, "restore the store and its seal from a backup");
}

/// State of the store at one moment, whoever reads it meanwhile.
void hash_store(const fs::path& store, const Seal& before, Seal& seal) {
  SQLite::Database database(store.string(), SQLite::OPEN_READWRITE, kBusyTimeout_ms);
  const SQLite::Transaction one_state(database, SQLite::TransactionBehavior::DEFERRED);
  check_beginning(database, before, store);
  for (const auto& [entries, head] : rows_of<std::int64_t, std::string>(
           database, "SELECT sequence, chain_sha256 FROM ledger ORDER BY sequence DESC LIMIT 1")) {
    seal.entries = entries;
    seal.head = head;
  }
  seal.store_sha256 = bytes_sha256(database);
}

}  // namespace

fs::path folder_of(const fs::path& store) {
  const fs::path file = real_store(store);
  return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

fs::path seal_path(const fs::path& store) {
  return real_store(store).string() + ".seal.json";
}

Seal read_seal(const fs::path& store) {
  const fs::path file = seal_path(store);
  if (!fs::is_regular_file(file)) {
    throw bad_input("the results store has no seal", {.file = file.string()},
                    "drape-compare and drape-results import write it; a store that only older "
                    "programs wrote has none");
  }
  const std::string text = read_text(file);
  const Where where{.file = file.string()};
  const char* what_to_do =
      "restore the store and its seal from a backup; without one, find what changed, remove the "
      "seal and import again";
  Seal seal;
  try {
    seal = seal_in(text);
  } catch (const Json::exception&) {
    throw bad_input(kDamaged, where, what_to_do);
  }
  if (text_of(seal) != text) throw bad_input(kDamaged, where, what_to_do);
  if (const std::string name = real_store(store).filename().string(); seal.store != name)
    throw bad_input(
        fmt::format("the store was called `{}` when it was sealed, not `{}`", seal.store, name),
        where, "give store, seal and folder of copies their old name again");
  return seal;
}

void require_store_of_seal(const fs::path& store) {
  if (store.empty() || fs::is_regular_file(store) || !fs::is_regular_file(seal_path(store))) return;
  throw bad_input("the results store of this seal is gone", {.file = seal_path(store).string()},
                  "restore the store from a backup, or remove its seal to begin another");
}

std::map<std::string, fs::path> sealed_places(const fs::path& store, RecordBook& book,
                                              const std::set<std::string>& contents) {
  enum Rank { kOwn, kCopy, kChanged };
  std::map<std::string, std::pair<Rank, fs::path>> best;
  for (const auto& [name, sealed] : read_seal(store).files) {
    const fs::path file = (folder_of(store) / name).lexically_normal();
    std::string content = sealed;
    Rank rank = kOwn;
    if (contents.contains(content)) {
      rank = book.sha256(file) != content ? kChanged : is_copy(name) ? kCopy : kOwn;
    } else if (const auto mesh = other_mesh_id(file); mesh && contents.contains(mesh->sha256)) {
      content = mesh->sha256;
    } else {
      continue;
    }
    const auto [found, is_new] = best.try_emplace(content, rank, file);
    if (!is_new && rank < found->second.first) found->second = {rank, file};
  }
  std::map<std::string, fs::path> places;
  for (const auto& [content, place] : best) places[content] = place.second;
  return places;
}

Sealing::Sealing(const StoreLock& /*held*/, fs::path store) : store_(real_store(std::move(store))) {
  if (fs::is_regular_file(seal_path(store_))) before_ = read_seal(store_);
  files_ = before_.files;
}

void Sealing::add(const std::vector<fs::path>& starts) {
  RecordBook book;
  const fs::path folder = folder_of(store_);
  for (const auto& [file, stated] : files_behind(book, starts)) {
    if (fs::exists(store_) && fs::exists(file) && fs::equivalent(file, store_)) continue;
    const auto sha256 = book.sha256(file);
    if (!sha256) continue;
    std::string& sealed = files_[fs::proximate(file, folder).generic_string()];
    // A file altered since a step read or made it is not sealed as it is now.
    if (stated.empty() || stated.contains(*sha256))
      sealed = *sha256;
    else if (!stated.contains(sealed))
      sealed = *stated.begin();
  }
}

std::vector<fs::path> Sealing::take_over(const fs::path& other, bool absent_too) {
  std::vector<fs::path> not_whole;
  const fs::path folder = folder_of(store_);
  for (const auto& [name, sha256] : read_seal(other).files) {
    const fs::path copy = copy_of_same_name(store_, other, name);
    const fs::path file = copy.empty() ? folder_of(other) / name : copy;
    const bool present = fs::is_regular_file(file);
    const bool whole = present && sha256_of_file(file) == sha256;
    if (!whole) not_whole.push_back(file.lexically_normal());
    if (!present && !absent_too) continue;
    const std::string key = fs::proximate(file, folder).generic_string();
    if (before_.files.count(key) != 0) continue;
    if (whole || !copy.empty()) {  // a copy never changes
      files_[key] = sha256;
    } else {
      files_.emplace(key, sha256);
    }
  }
  return not_whole;
}

void Sealing::write(const fs::path& own_record) const {
  Seal seal;
  seal.store = store_.filename().string();
  seal.files = files_;
  if (!own_record.empty())
    seal.files.erase(fs::proximate(own_record, folder_of(store_)).generic_string());
  try {
    hash_store(store_, before_, seal);
  } catch (const SQLite::Exception& exception) {
    throw store_error(store_, exception);
  }
  write_durable(seal_path(store_), text_of(seal));
}

void seal_store(const StoreLock& held, const fs::path& store, const std::vector<fs::path>& starts,
                const fs::path& own_record) {
  Sealing sealing(held, store);
  sealing.add(starts);
  sealing.write(own_record);
}

namespace {

constexpr const char* kFolder = ".files/";

fs::path folder_of_copies(const fs::path& store) {
  return real_store(store).string() + kFolder;
}

/// Copies that become durable together: written under temporary names, flushed, renamed, flushed
/// again. Two flushes of the whole file system in place of two for each of some thousand files.
class Copies {
 public:
  explicit Copies(fs::path folder) : folder_(std::move(folder)) {}

  /// `name` is a path of plain names inside the folder.
  void add(const std::string& name, const std::string& bytes) {
    const fs::path to = name_inside(folder_, name, {.file = folder_.string()});
    all_.push_back(to);
    // A file that another lab's store brought under this name is not believed to be this sheet.
    if (fs::is_regular_file(to) && read_text(to) == bytes) return;
    const fs::path place = to.parent_path(),
                   partial = place / ("." + to.filename().string() + ".partial");
    std::error_code error;
    fs::create_directories(place, error);
    if (error) fail(to, error.message());
    if (fs::weakly_canonical(place) !=
        fs::weakly_canonical(folder_ / ".") / fs::path(name).parent_path())
      throw bad_input("a link leads out of the folder of copies", {.file = place.string()},
                      "remove the link");
    require_replaceable(to);
    require_replaceable(partial);
    partial_[to] = partial;
    std::ofstream file(partial, std::ios::binary | std::ios::trunc);
    file << bytes << std::flush;
    if (!file) fail(to, std::strerror(errno));
  }

  std::vector<fs::path> finish() {
    if (partial_.empty()) return std::move(all_);
    flush();
    std::error_code error;
    for (const auto& [to, partial] : partial_) {
      fs::rename(partial, to, error);
      if (error) fail(to, error.message());
    }
    flush();
    return std::move(all_);
  }

 private:
  void flush() const {
    const int fd = ::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    const int reason = fd >= 0 && ::syncfs(fd) == 0 ? 0 : errno;
    if (fd >= 0) ::close(fd);
    if (reason != 0) fail(folder_, std::strerror(reason));
  }

  [[noreturn]] void fail(const fs::path& file, const std::string& reason) const {
    std::error_code ignored;
    for (const auto& [to, partial] : partial_) fs::remove(partial, ignored);  // frees a full disk
    throw bad_input("cannot write: " + reason, {.file = file.string()},
                    "check the path, its permissions and the free space, then run again");
  }

  fs::path folder_;
  std::vector<fs::path> all_;
  std::map<fs::path, fs::path> partial_;  ///< temporary name of each copy that is not there yet
};

/// Both files of a sheet under the hash of its .json, which says which sheet it is.
void copy_sheet(const SheetFile& sheet, Copies& copies) {
  for (const char* extension : {".ply", ".json"})
    copies.add(sheet.sha256.substr(0, 2) + '/' + sheet.sha256 + extension,
               read_text(fs::path(sheet.file).replace_extension(extension)));
}

/// The list that says which equilibrium a sheet is, under its own hash.
void copy_list(const Simulation& simulation, Copies& copies) {
  const std::string& sha256 = simulation.branch->set_sha256;
  copies.add(sha256.substr(0, 2) + '/' + sha256 + ".json",
             read_text(simulation.sheet.file.parent_path() / ".." / "branches.json"));
}

}  // namespace

std::vector<fs::path> keep_copies(const fs::path& store, const Session& session) {
  Copies copies(folder_of_copies(store));
  const auto add = [&](const Simulation& simulation) {
    if (!simulation.other_simulator) copy_sheet(simulation.sheet, copies);
    if (simulation.branch) copy_list(simulation, copies);
  };
  for (const DrapeFiles& drape : session.drapes) {
    copy_sheet(drape.input.measured, copies);
    for (const SheetFile& repeat : drape.input.repeats) copy_sheet(repeat, copies);
    for (const Simulation& simulation : drape.input.simulations) add(simulation);
  }
  for (const auto& group : session.virtual_only)
    for (const Simulation& simulation : group) add(simulation);
  return copies.finish();
}

std::vector<fs::path> take_copies(const fs::path& store, const fs::path& other) {
  const fs::path from = folder_of_copies(other);
  Copies copies(folder_of_copies(store));
  std::vector<fs::path> present;
  if (!fs::is_directory(from)) return present;
  for (const auto& entry : fs::recursive_directory_iterator(from)) {
    const std::string name = entry.path().lexically_relative(from).string();
    // Files that a killed program left begin with a dot.
    if (!entry.is_regular_file() || entry.path().filename().string().starts_with('.')) continue;
    // A copy that is there is kept, whatever comes from elsewhere.
    if (const fs::path there = folder_of_copies(store) / name; fs::is_regular_file(there)) {
      present.push_back(there);
      continue;
    }
    const std::vector<unsigned char> bytes = read_inside(from, name, {.file = from.string()});
    copies.add(name, {bytes.begin(), bytes.end()});
  }
  std::vector<fs::path> all = copies.finish();
  all.insert(all.end(), present.begin(), present.end());
  return all;
}

fs::path copy_of_same_name(const fs::path& store, const fs::path& other, const std::string& path) {
  const std::string beside = real_store(other).filename().string() + kFolder;
  return path.starts_with(beside) ? folder_of_copies(store) / path.substr(beside.size())
                                  : fs::path();
}

bool is_copy(const std::string& path) {
  return path.find(kFolder) != std::string::npos;
}

namespace {

using Key = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;
using Context = std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)>;

fs::path signature_path(const fs::path& store) {
  return seal_path(store).replace_extension(".sig");
}

enum class Half { secret, open };

/// Without a passphrase: a program cannot be asked for one.
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

std::string seal_text(const fs::path& store) {
  static_cast<void>(read_seal(store));  // says what is wrong with it
  return read_text(seal_path(store));
}

const unsigned char* bytes_of(const std::string& text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}

}  // namespace

void sign_seal(const fs::path& store, const fs::path& private_key) {
  const Key key = read_key(private_key, Half::secret);
  const std::string text = seal_text(store);
  const Context context(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  std::string signature(64, '\0');  // RFC 8032
  std::size_t size = signature.size();
  if (EVP_DigestSignInit(context.get(), nullptr, nullptr, nullptr, key.get()) != 1 ||
      EVP_DigestSign(context.get(), reinterpret_cast<unsigned char*>(signature.data()), &size,
                     bytes_of(text), text.size()) != 1)
    throw internal_error("the seal cannot be signed");
  write_durable(signature_path(store), signature);
}

bool is_signed(const fs::path& store, const fs::path& public_key) {
  const Key key = read_key(public_key, Half::open);
  const std::string text = seal_text(store), signature = read_text(signature_path(store));
  const Context context(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  return EVP_DigestVerifyInit(context.get(), nullptr, nullptr, nullptr, key.get()) == 1 &&
         EVP_DigestVerify(context.get(), bytes_of(signature), signature.size(), bytes_of(text),
                          text.size()) == 1;
}

}  // namespace drape::compare
