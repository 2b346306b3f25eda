// SPDX-License-Identifier: Apache-2.0

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <openssl/evp.h>
#include <openssl/pem.h>

#include <random>

#include "compare/history/results.hpp"
#include "compare/test_sheets.hpp"
#include "tests/support/trials.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using testing::IsEmpty;

class Damaged : public test::StoredExample {
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

  /// Tables whose rows, or rows that they hang on, stand in this table.
  [[nodiscard]] std::set<std::string> tables_on(const std::string& table) const {
    SQLite::Database database(store().string());
    std::set<std::string> tables = {table};
    for (std::size_t before = 0; before != tables.size();) {
      before = tables.size();
      for (const ListedTable& one : listed_tables())
        for (const auto& [parent] : rows_of<std::string>(
                 database, "SELECT \"table\" FROM pragma_foreign_key_list(?)", {one.name}))
          if (tables.contains(parent)) tables.insert(one.name);
    }
    return tables;
  }

  static constexpr std::size_t kPage = 4096;
  std::string good_ = read_text(store());
};

TEST_F(Damaged, ASoundStoreIsCarriedWhole) {
  const Rescue rescue = rescue_store(store(), fresh());
  EXPECT_THAT(rescue.lost, IsEmpty());
  const Verification before = verify_store(store()), after = verify_store(fresh());
  EXPECT_THAT(after.findings, IsEmpty());
  EXPECT_EQ(after.rows, before.rows);
  EXPECT_EQ(after.comparisons, before.comparisons);
  EXPECT_EQ(export_table(StoreReader(fresh()), "mark_error").rows,
            export_table(StoreReader(store()), "mark_error").rows);
  const std::string whole = sha256_of_file(fresh());
  EXPECT_THAT(rescue_store(store(), fresh()).lost, IsEmpty());
  EXPECT_EQ(sha256_of_file(fresh()), whole) << "a killed rescue can be run again";
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
      for (const char* more : {"", "-wal", "-shm"}) fs::remove(file.string() + more);
    write_durable(damaged(), bytes);
    const std::string table = table_of(page);
    SCOPED_TRACE("trial " + std::to_string(trial) + ", page of " + table);
    try {
      const Rescue rescue = rescue_store(damaged(), fresh());
      EXPECT_THAT(altered_rows(StoreReader(fresh())), IsEmpty()) << "nothing invented";
      const std::set<std::string> tables = tables_on(table);
      for (const std::string& lost : rescue.lost)
        EXPECT_TRUE(table == "listed" || tables.contains(lost.substr(0, lost.find(' ')))) << lost;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input) << error.what();
      EXPECT_EQ(table, "listed") << error.what();
    }
    try {
      const StoreReader reader(damaged());
      const bool hidden = altered_rows(reader).empty() && dump_sql(reader) != dump;
      EXPECT_FALSE(hidden);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input) << error.what();
    }
  }
}

TEST_F(Damaged, RescueOfAnyBytesEndsWithWhatCouldBeSaved) {
  for (const std::size_t size : {0U, 1U, 15U, 16U, 99U, 100U, 4095U, 4096U, 5000U, 40000U}) {
    SCOPED_TRACE(size);
    for (const char* more : {"", "-wal", "-shm"}) fs::remove(fresh().string() + more);
    write_durable(damaged(), good_.substr(0, size));
    try {
      EXPECT_FALSE(rescue_store(damaged(), fresh()).lost.empty());
      EXPECT_THAT(altered_rows(StoreReader(fresh())), IsEmpty());
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input) << error.what();
      EXPECT_FALSE(fs::exists(fresh())) << "nothing is left where nothing was saved";
    }
  }
}

TEST_F(Damaged, RescueLeavesOutWhatWasAlteredAndTakesTheRest) {
  {
    SQLite::Database database(store().string(), SQLite::OPEN_READWRITE);
    database.exec(
        "DROP TRIGGER comparison_no_UPDATE; UPDATE comparison SET mean_mm = mean_mm * 0.1 "
        "WHERE id = 2; DROP VIEW v_run; CREATE VIEW v_run AS SELECT 1 AS run");
  }
  const Rescue rescue = rescue_store(store(), fresh());
  EXPECT_THAT(rescue.lost, testing::Contains(testing::StartsWith("comparison ")));
  EXPECT_THAT(altered_rows(StoreReader(fresh())), IsEmpty());
  EXPECT_EQ(test::one(StoreReader(fresh()), "SELECT count(*) FROM comparison"), "3");
}

TEST_F(Damaged, AManifestThatSomebodyElseMadeIsNotTheSignedOne) {
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
  const auto last = [&] { return verify_store(store(), false).last_manifest; };
  EXPECT_THROW(static_cast<void>(is_signed(store(), last(), open)), Error) << "not signed yet";
  EXPECT_THROW(sign_store(store(), open), Error) << "no private key";
  sign_store(store(), secret);
  EXPECT_TRUE(is_signed(store(), last(), open));
  import({.label = "another run"});
  EXPECT_THAT(verify_store(store()).findings, IsEmpty()) << "whole in itself";
  EXPECT_FALSE(is_signed(store(), last(), open));
  sign_store(store(), secret);
  {
    SQLite::Database database(store().string(), SQLite::OPEN_READWRITE);
    database.exec(
        "DROP TRIGGER comparison_no_UPDATE; UPDATE comparison SET mean_mm = mean_mm * 0.1");
  }
  EXPECT_THROW(sign_store(store(), secret), Error) << "what was altered is not signed";
}

/// An alteration with every hash computed again: whole in itself, and found where it is signed.
TEST_F(Damaged, AStoreWhoseHashesWereAllComputedAgainIsFoundByItsSignatureAlone) {
  const std::string before = verify_store(store(), false).last_manifest;
  const Rescue forged = [&] {
    SQLite::Database(store().string(), SQLite::OPEN_READWRITE)
        .exec(
            "DROP TRIGGER recording_no_UPDATE; DROP TRIGGER run_no_UPDATE; UPDATE run SET label = "
            "'forged'");
    return rescue_store(store(), fresh());
  }();
  EXPECT_THAT(forged.lost, testing::Contains(testing::StartsWith("run ")));
  EXPECT_THAT(verify_store(fresh(), false).findings, IsEmpty());
  EXPECT_NE(verify_store(fresh(), false).last_manifest, before);
}

}  // namespace
}  // namespace drape::compare
