// SPDX-License-Identifier: Apache-2.0
// Whatever a file contains, a reader returns a value or throws one drape::Error, nothing else.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/resource.h>

#include <algorithm>
#include <ctime>
#include <fstream>
#include <ostream>
#include <regex>
#include <set>

#include "core/files/files.hpp"
#include "tests/fuzz/kinds.hpp"
#include "tests/fuzz/mutations.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/trials.hpp"

namespace drape::test {

void PrintTo(const Kind& kind, std::ostream* out) {
  *out << kind.name;
}

namespace {

namespace fs = std::filesystem;

class Reader : public testing::TestWithParam<Kind> {};

/// Writes a new file, which no file system flushes at once as it does one that is cut to nothing.
void write(const fs::path& file, const std::string& text) {
  fs::remove(file);
  std::ofstream(file, std::ios::binary) << text;
}

double cpu_s() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

constexpr double kMostCpu_s = 5;
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr long kMost_kB = 4'000'000;  ///< sanitizers keep freed memory
#else
constexpr long kMost_kB = 500'000;
#endif

TEST_P(Reader, GivesAValueOrOneErrorWhateverTheFileHolds) {
  const Kind& kind = GetParam();
  const TemporaryFolder folder;
  const fs::path file = kind.make(folder.path());
  const std::string good = read_text(file);
  ASSERT_NO_THROW(kind.read(file)) << "the good file is read";
  const int trials = trial_count(200, 2000);
  int refusals = 0;
  std::set<std::string> believed;
  for (int trial = 0; trial < trials; ++trial) {
    // Half of the texts have one fault that is known, the others up to three of any sort.
    const auto seed = static_cast<std::uint32_t>(first_trial() + trial) / 2;
    Fault fault = one_fault(good, seed);
    if (trial % 2 == 1) fault = {spoiled(good, seed), "several", "", false};
    write(file, fault.text);
    bool refused = false;
    const double start_s = cpu_s();
    ASSERT_EQ(broken_promise(kind, file, refused), "") << "trial " << trial << "\n"
                                                       << fault.text.substr(0, 10000);
    EXPECT_LT(cpu_s() - start_s, kMostCpu_s) << "trial " << trial << ", " << fault.kind;
    refusals += refused;
    const std::string what = fmt::format("{}: {}", fault.kind, fault.line);
    if (!refused && fault.can_tell && !std::regex_search(what, std::regex(kind.free)))
      believed.insert(what);
  }
  rusage used{};
  ::getrusage(RUSAGE_SELF, &used);
  EXPECT_LT(used.ru_maxrss, kMost_kB);
  EXPECT_THAT(believed, testing::IsEmpty());
  if (kind.refuses) {
    EXPECT_GT(refusals, trials / 20) << "a reader that looks at nothing refuses nothing";
  }
}

/// Findings of fuzzers: tests/fuzz/corpus/<kind>/<any name>.
TEST_P(Reader, KeepsItsPromiseOnWhatFuzzersFound) {
  const Kind& kind = GetParam();
  const fs::path corpus = source_root() / "tests/fuzz/corpus" / kind.name;
  if (!fs::is_directory(corpus)) return;
  const TemporaryFolder folder;
  const fs::path file = kind.make(folder.path());
  for (const auto& entry : fs::directory_iterator(corpus)) {
    write_durable(file, read_text(entry.path()));
    bool refused = false;
    EXPECT_EQ(broken_promise(kind, file, refused), "") << entry.path();
  }
}

INSTANTIATE_TEST_SUITE_P(EveryKind, Reader, testing::ValuesIn(all_kinds()),
                         [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace drape::test
