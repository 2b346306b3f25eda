// SPDX-License-Identifier: Apache-2.0
// Files that drape fabric writes beside an imported fabric, and words that it refuses.
#include <gtest/gtest.h>

#include <cstdlib>

#include "core/files/files.hpp"
#include "core/program/run_record.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;

int run(const std::vector<std::string>& words) {
  std::string line = test::program("drape-simulate").string();
  for (const std::string& word : words) line += " " + word;
  return WEXITSTATUS(std::system((line + " > /dev/null 2>&1").c_str()));
}

TEST(ImportRecord, AnImportedFabricHasARecordThatNamesItsSheetAndFiles) {
  const test::TemporaryFolder folder;
  const fs::path sheet = folder.path() / "sheet.csv", out = folder.path() / "wool";
  write_durable(sheet,
                "property,unit,warp,weft\nW,g/m2,200,\nC,mm,17,16\nE5,%,0.4,0.6\nE20,%,1.1,1.7\n");
  const std::vector<std::string> words = {"fabric", "import", sheet.string(), "--format",
                                          "fast",   "--out",  out.string()};
  ASSERT_EQ(run(words), 0);
  const fs::path record = out / "fabric.run.json";
  EXPECT_TRUE(is_up_to_date(record, test::program("drape-simulate"), words));
  for (const fs::path& file : {sheet, out / "fabric.toml", out / "tensile_warp.csv"}) {
    const std::string text = read_text(file);
    write_durable(file, text + "\n");
    EXPECT_FALSE(is_up_to_date(record, test::program("drape-simulate"), words)) << file;
    write_durable(file, text);
  }
  EXPECT_EQ(run({"fabric", "show", "matsudaira-B", "--out", (folder.path() / "shown").string()}),
            0);
  EXPECT_TRUE(fs::exists(folder.path() / "shown/fabric.run.json"));
}

TEST(ImportRecord, AUnitThatNothingReadsIsRefused) {
  const test::TemporaryFolder folder;
  const fs::path sheet = folder.path() / "sheet.csv", out = folder.path() / "wool";
  write_durable(sheet, "property,unit,warp,weft\nW,g/m2,200,\nC,mm,17,16\n");
  EXPECT_EQ(run({"fabric", "import", sheet.string(), "--format", "fast", "--bend-unit", "dyn.cm",
                 "--out", out.string()}),
            2);
  EXPECT_FALSE(fs::exists(out));
}

}  // namespace
}  // namespace drape::simulate
