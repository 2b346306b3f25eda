// SPDX-License-Identifier: Apache-2.0
// Readers beside writers: processes import into one store while others verify and list it, half of
// them as a user who may write nothing. What was acknowledged before a reader began is there, and
// no reader sees a finding or an error.
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>

#include "compare/test_sheets.hpp"
#include "tests/support/trials.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

constexpr int kEach = 8;          ///< importers, and readers
constexpr uid_t kNobody = 65534;  ///< user without rights
constexpr std::size_t kMostText = 400;

/// Memory that the processes of a round share.
struct Round {
  std::array<std::atomic<bool>, kEach> acknowledged;
  std::atomic<int> reads;
  std::array<std::array<char, kMostText>, 2 * kEach> wrong;
};

std::string set_of(int importer) {
  return fmt::format("drape_{}", importer);
}

/// One sheet with its simulations, of a set of its own.
std::vector<fs::path> example(const fs::path& folder, int importer) {
  std::vector<fs::path> sheets = test::write_example(folder / set_of(importer));
  const fs::path json = folder / set_of(importer) / "sheet.json";
  std::string text = read_text(json);
  const std::size_t at = text.find("drape_A");
  write_durable(json, text.replace(at, 7, set_of(importer)));
  return sheets;
}

std::string import(const fs::path& store, const std::vector<fs::path>& sheets) {
  const Session session = read_session(sheets, {});
  Outcome outcome;
  compare_session(session, {}, outcome);
  const int added = import_session(store, session, outcome).added;
  return added > 0 ? "" : "nothing was added";
}

std::string read_once(const fs::path& store, const Round& round) {
  std::array<bool, kEach> expected;
  for (std::size_t i = 0; i < kEach; ++i) expected[i] = round.acknowledged[i];
  const Verification verified = verify_store(store, false);
  if (!verified.findings.empty()) return verified.findings.front();
  const StoreReader reader(store);
  for (int i = 0; i < kEach; ++i) {
    const Table rows = reader.query("SELECT 1 FROM sheet WHERE set_name = ?", {set_of(i)});
    if (expected[static_cast<std::size_t>(i)] && rows.rows.empty()) return set_of(i) + " is missed";
  }
  return {};
}

std::string read_until_all_is_there(const fs::path& store, Round& round) {
  const auto imported = [&] {
    return std::all_of(round.acknowledged.begin(), round.acknowledged.end(),
                       [](const auto& one) { return one.load(); });
  };
  for (bool last = false; !last;) {
    last = imported();
    if (std::none_of(round.acknowledged.begin(), round.acknowledged.end(),
                     [](const auto& one) { return one.load(); })) {  // no store yet
      ::usleep(1000);
      continue;
    }
    if (std::string wrong = read_once(store, round); !wrong.empty()) return wrong;
    ++round.reads;
  }
  return {};
}

/// Runs `work` in a process of its own; what it says is wrong goes to `said`.
pid_t in_process(std::array<char, kMostText>& said, const std::function<std::string()>& work) {
  const pid_t pid = ::fork();
  if (pid != 0) return pid;
  std::string wrong;
  try {
    wrong = work();
  } catch (const std::exception& error) {
    wrong = error.what();
  }
  wrong.copy(said.data(), kMostText - 1);
  ::_exit(0);
}

TEST(ReadersBesideWriters, SeeNoFalseAlarmAndMissNothing) {
  const drape::test::TemporaryFolder folder;
  ASSERT_EQ(::chmod(folder.path().c_str(), 0755), 0);
  std::vector<std::vector<fs::path>> sheets;
  sheets.reserve(kEach);
  for (int i = 0; i < kEach; ++i) sheets.push_back(example(folder.path(), i));
  void* memory =
      ::mmap(nullptr, sizeof(Round), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(memory, MAP_FAILED);
  auto& round = *static_cast<Round*>(memory);
  const int rounds = drape::test::trial_count(1, 1000);
  for (int r = 0; r < rounds; ++r) {
    SCOPED_TRACE(fmt::format("round {}", r));
    const fs::path store = folder.path() / fmt::format("store-{}", r) / "results.sqlite";
    fs::create_directory(store.parent_path());
    for (auto& one : round.acknowledged) one = false;
    std::vector<pid_t> processes;
    for (std::size_t i = 0; i < kEach; ++i) {
      processes.push_back(in_process(round.wrong[kEach + i], [&] {
        if (i % 2 == 0 && ::geteuid() == 0 && ::setuid(kNobody) != 0) return std::string("setuid");
        return read_until_all_is_there(store, round);
      }));
      processes.push_back(in_process(round.wrong[i], [&] {
        std::string wrong = import(store, sheets[i]);
        round.acknowledged[i] = true;
        return wrong;
      }));
    }
    for (const pid_t pid : processes) {
      int status = -1;
      ASSERT_EQ(::waitpid(pid, &status, 0), pid);
      EXPECT_EQ(status, 0);
    }
    for (const auto& wrong : round.wrong) ASSERT_STREQ(wrong.data(), "");
    EXPECT_TRUE(verify_store(store).findings.empty());
    fs::remove_all(store.parent_path());
  }
  EXPECT_GE(round.reads, rounds * kEach);
  fmt::print("{} rounds, {} reads\n", rounds, round.reads.load());
  ::munmap(memory, sizeof(Round));
}

}  // namespace
}  // namespace drape::compare
