// SPDX-License-Identifier: Apache-2.0
// Whatever a file contains, a reader returns a value or throws one drape::Error, nothing else.
#include <gtest/gtest.h>

#include <algorithm>
#include <ostream>

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

TEST_P(Reader, GivesAValueOrOneErrorWhateverTheFileHolds) {
  const Kind& kind = GetParam();
  const TemporaryFolder folder;
  const fs::path file = kind.make(folder.path());
  const std::string good = read_text(file);
  ASSERT_NO_THROW(kind.read(file)) << "the good file is read";
  const int trials = trial_count(100, 2000);
  int refusals = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const std::string text = spoiled(good, static_cast<std::uint32_t>(trial));
    write_durable(file, text);
    bool refused = false;
    ASSERT_EQ(broken_promise(kind, file, refused), "") << "trial " << trial << "\n" << text;
    refusals += refused;
  }
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
