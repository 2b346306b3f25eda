// SPDX-License-Identifier: Apache-2.0
#include "compare/history/rescue.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <openssl/evp.h>
#include <openssl/pem.h>

#include <memory>
#include <random>
#include <set>

#include "compare/history/merge.hpp"
#include "compare/history/results.hpp"
#include "compare/history/seal.hpp"
#include "compare/store/inputs.hpp"
#include "compare/store/ledger.hpp"
#include "compare/store/outcome.hpp"
#include "compare/test_sheets.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/trials.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using testing::IsEmpty;

class Damaged : public test::SealedStore {
 protected:
  [[nodiscard]] fs::path damaged() const { return folder_.path() / "damaged.sqlite"; }
  [[nodiscard]] fs::path fresh() const { return folder_.path() / "fresh.sqlite"; }
  [[nodiscard]] std::size_t pages() const { return good_.size() / kPage; }

  /// Table to whose tree the page belongs according to SQLite; empty if none.
  [[nodiscard]] std::string table_of(std::size_t page) const {
    SQLite::Database database(store().string());
    return first_of<std::string>(database, "SELECT name FROM dbstat WHERE pageno = ?", {page + 1})
        .value_or("");
  }

  /// Kinds of ledger entries with rows in this table, or with rows that depend on it.
  [[nodiscard]] std::set<std::string> kinds_of(const std::string& table) const {
    SQLite::Database database(store().string());
    std::set<std::string> tables = {table}, kinds;
    for (std::size_t before = 0; before != tables.size() + kinds.size();) {
      before = tables.size() + kinds.size();
      for (const LedgerKind& kind : ledger_kinds()) {
        for (const UnitTable& unit : kind.tables) {
          bool hangs = tables.count(unit.name) != 0;
          for (const auto& [parent] : rows_of<std::string>(
                   database, "SELECT \"table\" FROM pragma_foreign_key_list(?)", {unit.name}))
            hangs = hangs || tables.count(parent) != 0;
          if (!hangs) continue;
          kinds.insert(kind.table);
          tables.insert(kind.table);
        }
      }
    }
    return kinds;
  }

  static constexpr std::size_t kPage = 4096;
  std::string good_ = read_text(store());
};

TEST_F(Damaged, ASoundStoreIsCarriedWhole) {
  const Rescue rescue = rescue_store(store(), fresh());
  EXPECT_THAT(rescue.lost, IsEmpty());
  EXPECT_THAT(rescue.lost_files, IsEmpty());
  const Verification before = verify_store(store()), after = verify_store(fresh());
  EXPECT_THAT(after.findings, IsEmpty());
  EXPECT_EQ(after.files, before.files);
  EXPECT_EQ(after.comparisons, before.comparisons);
  EXPECT_EQ(export_table(StoreReader(fresh()), "mark_error").rows,
            export_table(StoreReader(store()), "mark_error").rows);
  EXPECT_THROW(static_cast<void>(rescue_store(store(), fresh())), Error) << "never overwritten";
}

TEST_F(Damaged, RescueKeepsAllThatDoesNotHangOnTheDamageAndExportNeverHidesIt) {
  std::mt19937 random(7);
  const std::string dump = dump_sql(StoreReader(store()));
  for (int trial = 0; trial < drape::test::trial_count(8, 1000); ++trial) {
    const std::size_t page = random() % pages();
    std::string bytes = good_;
    const std::size_t from = page * kPage + (trial % 2 == 0 ? 0 : random() % (kPage - 200));
    const std::size_t count = trial % 2 == 0 ? kPage : 1 + random() % 200;
    for (std::size_t i = 0; i < count; ++i) bytes[from + i] = static_cast<char>(random());
    for (const fs::path& file : {damaged(), fresh()})
      for (const char* more : {"", "-wal", "-shm", ".seal.json"}) fs::remove(file.string() + more);
    write_durable(damaged(), bytes);
    const std::string table = table_of(page);
    SCOPED_TRACE("trial " + std::to_string(trial) + ", page of " + table);
    try {
      const Rescue rescue = rescue_store(damaged(), fresh());
      EXPECT_THAT(check_ledger(StoreReader(fresh())).findings, IsEmpty()) << "nothing invented";
      const std::set<std::string> kinds = kinds_of(table);
      for (const std::string& lost : rescue.lost) {
        const std::string kind = lost.substr(0, lost.find(' '));
        EXPECT_TRUE(table == "ledger" || kinds.count(kind) != 0) << lost;
      }
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input) << error.what();
      EXPECT_EQ(table, "ledger") << error.what();
    }
    try {
      const StoreReader reader(damaged());
      const bool hidden = check_ledger(reader).findings.empty() && dump_sql(reader) != dump;
      EXPECT_FALSE(hidden);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input) << error.what();
    }
  }
}

TEST_F(Damaged, RescueNamesFilesThatAreNotAsTheyWereSealedAndAnAbsentList) {
  const fs::path sheet = fs::path(sheets_[1]).replace_extension(".ply");
  write_durable(sheet, "other bytes");
  EXPECT_THAT(rescue_store(store(), fresh()).lost_files,
              testing::ElementsAre(testing::HasSubstr("sheet.ply")));
  EXPECT_FALSE(verify_store(fresh()).findings.empty()) << "they are not sealed as they are now";
  fs::remove(seal_path(store()));
  EXPECT_THAT(rescue_store(store(), damaged()).lost_files,
              testing::ElementsAre(testing::HasSubstr("no seal")));
}

TEST_F(Damaged, ACopyThatWasChangedIsNotSealedAsItIsNow) {
  const std::vector<fs::path> copies = keep_copies(store(), read_session(sheets_, {}));
  seal_store(StoreLock(store(), StoreLock::Kind::alone), store(), copies);
  write_durable(copies.front(), "other bytes");
  EXPECT_THAT(rescue_store(store(), fresh()).lost_files,
              testing::ElementsAre(testing::HasSubstr(copies.front().filename().string())));
  (void)merge_stores(damaged(), {store()});
  for (const fs::path& made : {fresh(), damaged()})
    EXPECT_THAT(verify_store(made, false).findings,
                testing::ElementsAre(
                    testing::HasSubstr(copies.front().filename().string() + " were changed")));
}

TEST_F(Damaged, ASealThatSomebodyElseMadeIsNotTheSignedOne) {
  const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> key(
      EVP_PKEY_Q_keygen(nullptr, nullptr, "ED25519"), &EVP_PKEY_free);
  const auto pem = [&](auto write, const fs::path& file) {
    const std::unique_ptr<BIO, decltype(&BIO_free)> memory(BIO_new(BIO_s_mem()), &BIO_free);
    write(memory.get());
    char* text = nullptr;
    const long size = BIO_get_mem_data(memory.get(), &text);
    write_durable(file, {text, static_cast<std::size_t>(size)});
    return file;
  };
  const fs::path secret = pem(
      [&](BIO* out) {
        PEM_write_bio_PrivateKey(out, key.get(), nullptr, nullptr, 0, nullptr, nullptr);
      },
      folder_.path() / "key.pem");
  const fs::path open =
      pem([&](BIO* out) { PEM_write_bio_PUBKEY(out, key.get()); }, folder_.path() / "open.pem");
  EXPECT_THROW(static_cast<void>(is_signed(store(), open)), Error) << "not signed yet";
  EXPECT_THROW(sign_seal(store(), open), Error) << "no private key";
  sign_seal(store(), secret);
  EXPECT_TRUE(is_signed(store(), open));
  import({.label = "another run"});
  EXPECT_THAT(verify_store(store()).findings, IsEmpty()) << "whole in itself";
  EXPECT_FALSE(is_signed(store(), open));
}

}  // namespace
}  // namespace drape::compare
