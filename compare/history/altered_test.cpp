// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>

#include "compare/history/seal.hpp"
#include "compare/store/inputs.hpp"
#include "compare/store/outcome.hpp"
#include "compare/test_sheets.hpp"
#include "core/error.hpp"
#include "tests/support/paths.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::HasSubstr;

/// A sealed store with a recorded example behind it.
class Altered : public testing::Test {
 protected:
  Altered() { import(); }

  void import() {
    const Session session = read_session(sheets_, {});
    Outcome outcome;
    compare_session(session, {}, outcome);
    static_cast<void>(import_session(store(), session, outcome));
    seal_store(StoreLock(store(), StoreLock::Kind::alone), store(), files_of(session));
  }
  [[nodiscard]] fs::path store() const { return folder_.path() / "results.sqlite"; }
  [[nodiscard]] std::vector<std::string> findings() const {
    return verify_store(store(), false).findings;
  }

  drape::test::TemporaryFolder folder_;
  std::vector<fs::path> sheets_ = test::write_recorded_example(folder_.path());
};

TEST_F(Altered, WhatWasAlteredSinceItWasReadIsNotSealedAsWhole) {
  for (const char* name : {"scene.toml", "points.json"}) {
    const auto at = std::find_if(fs::recursive_directory_iterator(folder_.path()), {},
                                 [&](const auto& one) { return one.path().filename() == name; });
    ASSERT_NE(at, fs::recursive_directory_iterator()) << name;
    std::ofstream(at->path(), std::ios::app) << " ";
    import();
    EXPECT_THAT(findings(), Contains(HasSubstr(name)));
  }
}

TEST_F(Altered, AMeasuredSheetThatItsRunDidNotWriteIsRefused) {
  const fs::path json = fs::path(sheets_.front()).replace_extension(".json");
  std::ofstream(json, std::ios::app) << " ";
  try {
    import();
    FAIL() << "an altered sheet was compared";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("not the one that its run wrote"));
    EXPECT_THAT(error.what(), HasSubstr(json.filename().string()));
  }
}

TEST_F(Altered, ASealWithoutItsStoreIsNoPlaceForAnother) {
  require_store_of_seal(store());
  fs::remove(store());
  EXPECT_THROW(require_store_of_seal(store()), Error);
  fs::remove(seal_path(store()));
  require_store_of_seal(store());
}

}  // namespace
}  // namespace drape::compare
