// SPDX-License-Identifier: Apache-2.0
#include "compare/history/seal.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include "compare/history/copies.hpp"
#include "compare/meshes/other_mesh.hpp"
#include "compare/store/sqlite_error.hpp"
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
  // What is no whole number stays 0, which is not what was read.
  const Json& entries = json.at("entries");
  if (entries.is_number_integer()) seal.entries = entries.get<long long>();
  seal.head = json.at("head").get<std::string>();
  return seal;
}

/// The chain may have grown since it was sealed, but what was sealed must still be its beginning:
/// else sealing again would hide that rows were removed.
void check_beginning(SQLite::Database& database, const Seal& before, const fs::path& store) {
  if (before.entries == 0) return;
  SQLite::Statement entry(database, "SELECT chain_sha256 FROM ledger WHERE sequence = ?");
  entry.bind(1, static_cast<int64_t>(before.entries));
  if (entry.executeStep() && entry.getColumn(0).getString() == before.head) return;
  throw bad_input("rows of the results store are missing since it was sealed",
                  {.file = store.string()}, "restore the store and its seal from a backup");
}

/// State of the store at one moment, whoever reads it meanwhile.
void hash_store(const fs::path& store, const Seal& before, Seal& seal) {
  SQLite::Database database(store.string(), SQLite::OPEN_READWRITE, kBusyTimeout_ms);
  const SQLite::Transaction one_state(database, SQLite::TransactionBehavior::DEFERRED);
  check_beginning(database, before, store);
  SQLite::Statement last(
      database, "SELECT sequence, chain_sha256 FROM ledger ORDER BY sequence DESC LIMIT 1");
  if (last.executeStep()) {
    seal.entries = last.getColumn(0).getInt64();
    seal.head = last.getColumn(1).getString();
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
    // What was altered since a step read or made it is not sealed as it is now.
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

}  // namespace drape::compare
