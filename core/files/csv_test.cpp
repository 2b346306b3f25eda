// SPDX-License-Identifier: Apache-2.0
#include "core/files/files.hpp"

#include <fmt/ranges.h>
#include <gmock/gmock.h>

#include "core/error.hpp"
#include "tests/support/paths.hpp"

namespace drape {
namespace {

using testing::ElementsAre;

const std::vector<std::string> kHeaders = {"strain", "force_gf_per_cm"};

class CsvFile : public testing::Test {
 protected:
  [[nodiscard]] Csv read(const std::string& text) const {
    write_durable(file(), text);
    return read_csv(file(), kHeaders);
  }
  /// Location given in the refusal of this text.
  [[nodiscard]] Where refusal(const std::string& text) const {
    try {
      static_cast<void>(read(text));
    } catch (const Error& error) {
      return error.where();
    }
    ADD_FAILURE() << "accepted: " << text;
    return {};
  }
  [[nodiscard]] std::filesystem::path file() const { return folder_.path() / "curve.csv"; }

  test::TemporaryFolder folder_;
};

TEST_F(CsvFile, ReadsColumnsAndRemembersLines) {
  const Csv csv = read("# loading\nstrain,force_gf_per_cm\n0, 0\n\n0.5,1e-3\r\n");
  EXPECT_THAT(csv.columns.at(0), ElementsAre(0.0, 0.5));
  EXPECT_THAT(csv.columns.at(1), ElementsAre(0.0, 1e-3));
  EXPECT_THAT(csv.lines, ElementsAre(3, 5));
}

TEST_F(CsvFile, RefusesAnotherUnitInTheHead) {
  EXPECT_EQ(refusal("strain,force_n_per_m\n0,0\n").line, 1);
}

TEST_F(CsvFile, NamesLineAndColumnOfACellThatIsNoNumber) {
  for (const char* cell : {"nan", "inf", "1,5", "", "2 mm", "0x10"}) {
    const Where where = refusal(std::string("strain,force_gf_per_cm\n0,0\n1,") + cell + "\n");
    EXPECT_EQ(where.line, 3) << cell;
  }
  EXPECT_EQ(refusal("strain,force_gf_per_cm\n0,nan\n").field, "force_gf_per_cm");
}

/// A spreadsheet's "CSV UTF-8" starts with a byte order mark, which is not part of the text.
TEST_F(CsvFile, ReadsWhatASpreadsheetWritesAndNamesWhatIsNoCsv) {
  const std::string table = "strain,force_gf_per_cm\n0,0\n1,2\n", mark = "\xef\xbb\xbf";
  EXPECT_THAT(read(mark + table).columns.at(1), ElementsAre(0.0, 2.0));
  EXPECT_THAT(read(mark + "# loading\n" + table).lines, ElementsAre(3, 4));
  const auto said_of = [&](const std::string& text) -> std::string {
    try {
      static_cast<void>(read(text));
    } catch (const Error& error) {
      return error.what();
    }
    return "accepted";
  };
  using testing::HasSubstr;
  EXPECT_THAT(said_of("strain;force_gf_per_cm\n0;0\n"), HasSubstr("semicolons"));
  EXPECT_THAT(said_of("strain\tforce_gf_per_cm\n0\t0\n"), HasSubstr("tabs"));
  std::string wide = "\xff\xfe";
  for (const char letter : table) wide += {letter, '\0'};
  EXPECT_THAT(said_of(wide), HasSubstr("UTF-16"));
}

TEST_F(CsvFile, RefusesAFileWithoutHead) {
  EXPECT_EQ(refusal("# nothing here\n").file, file().string());
}

TEST_F(CsvFile, WrittenNumbersComeBackExactly) {
  const std::vector<double> values = {0.1, -1.0 / 3.0, 6.02214076e23, 5e-324};
  std::string text = fmt::format("{}\n", fmt::join(kHeaders, ","));
  for (const double value : values) text += fmt::format("{},{}\n", value, value);
  const Csv csv = read(text);
  EXPECT_EQ(csv.columns.at(0), values);
  EXPECT_EQ(csv.columns.at(1), values);
}

}  // namespace
}  // namespace drape
