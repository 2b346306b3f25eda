// SPDX-License-Identifier: Apache-2.0
#include "core/files/toml_file.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "tests/support/paths.hpp"

namespace drape {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class Toml : public testing::Test {
 protected:
  /// The table of a file with this text below its schema line.
  [[nodiscard]] TomlTable open(const std::string& text) const {
    write_durable(file(), "schema = \"drapebench/thing/1\"\n" + text);
    return TomlTable::open(file(), "thing");
  }
  [[nodiscard]] std::filesystem::path file() const { return folder_.path() / "thing.toml"; }

  test::TemporaryFolder folder_;
};

/// The error that `action` throws; the test fails when it throws none.
template <class Action>
Error error_of(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "no error was thrown";
  return internal_error("none");
}

TEST_F(Toml, GivesTypedValues) {
  const TomlTable table = open(
      "length_mm = 2\nangles_deg = [1, 2.5]\ncount = 3\nname = \"A\"\n"
      "[part]\nwidth_mm = 4.5\n[[hole]]\nrow = 1\n[[hole]]\nrow = 2\n");
  EXPECT_EQ(table.positive("length_mm"), 2.0);
  EXPECT_THAT(table.numbers("angles_deg", 2), ElementsAre(1.0, 2.5));
  EXPECT_EQ(table.positive_integer("count"), 3);
  EXPECT_EQ(table.text("name"), "A");
  EXPECT_EQ(table.table("part").number("width_mm"), 4.5);
  const std::vector<TomlTable> holes = table.tables("hole");
  ASSERT_EQ(holes.size(), 2U);
  EXPECT_EQ(holes[0].integer("row"), 1);
  EXPECT_EQ(holes[1].integer("row"), 2);
  EXPECT_FALSE(table.optional_table("absent").has_value());
  EXPECT_NO_THROW(table.finish());
}

TEST_F(Toml, NamesFileLineAndFieldOfABadValue) {
  const TomlTable table = open("first = 1\n[part]\nwidth_mm = -4\n");
  const Error error =
      error_of([&] { static_cast<void>(table.table("part").positive("width_mm")); });
  EXPECT_EQ(error.kind(), ErrorKind::bad_input);
  EXPECT_EQ(error.where().file, file().string());
  EXPECT_EQ(error.where().line, 4);
  EXPECT_EQ(error.where().field, "part.width_mm");
  EXPECT_FALSE(error.what_to_do().empty());
}

TEST_F(Toml, RefusesWhatIsNotAFiniteNumber) {
  for (const char* value : {"nan", "inf", "\"2\"", "true", "[1]"}) {
    const TomlTable table = open(std::string("length_mm = ") + value + "\n");
    EXPECT_THROW(static_cast<void>(table.number("length_mm")), Error) << value;
  }
}

TEST_F(Toml, RefusesAnArrayOfTheWrongLength) {
  const TomlTable table = open("size_mm = [1, 2, 3]\n");
  EXPECT_THROW(static_cast<void>(table.numbers("size_mm", 2)), Error);
  EXPECT_EQ(table.numbers("size_mm").size(), 3U);
}

TEST_F(Toml, NamesTheRightUnitOfAWrongOne) {
  const TomlTable table = open("pitch_cm = 2\n");
  const Error error = error_of([&] { static_cast<void>(table.positive("pitch_mm")); });
  EXPECT_THAT(error.what(), HasSubstr("pitch_cm"));
  EXPECT_THAT(error.what_to_do(), HasSubstr("pitch_mm"));
  EXPECT_EQ(error.where().line, 2);
}

TEST_F(Toml, RefusesWholeNumbersThatNothingCanBeCountedOnFrom) {
  const TomlTable table = open("most = 1073741824\nmore = 1073741825\nless = -1073741825\n");
  EXPECT_EQ(table.integer("most"), 1 << 30);
  for (const char* key : {"more", "less"})
    EXPECT_THAT(error_of([&] { static_cast<void>(table.integer(key)); }).what(),
                HasSubstr("is not a whole number up to 2^30"))
        << key;
}

TEST_F(Toml, RefusesAKeyThatNobodyAskedFor) {
  const TomlTable table = open("[part]\nwidth_mm = 4\nwitdh_mm = 5\n");
  static_cast<void>(table.table("part").number("width_mm"));
  const Error error = error_of([&] { table.finish(); });
  EXPECT_EQ(error.where().field, "part.witdh_mm");
  EXPECT_EQ(error.where().line, 4);
}

TEST_F(Toml, RefusesAnotherSchemaAndABrokenFile) {
  write_durable(file(), "schema = \"drapebench/other/1\"\n");
  EXPECT_THAT(error_of([&] { TomlTable::open(file(), "thing"); }).what(), HasSubstr("other"));
  write_durable(file(), "schema = \"drapebench/thing/1\"\nwidth_mm = = 3\n");
  EXPECT_EQ(error_of([&] { TomlTable::open(file(), "thing"); }).where().line, 2);
}

TEST_F(Toml, ResolvesFilesFromTheFolderOfTheFile) {
  const TomlTable table = open("curve = \"../curves/a.csv\"\n");
  EXPECT_EQ(table.file_path("curve"), (folder_.path() / "../curves/a.csv").lexically_normal());
}

TEST_F(Toml, ValuesAreListedUnderTheirPaths) {
  const auto values = open("b = true\n[[object]]\nx_mm = 1.5\nat = [1, 2]\n").values();
  EXPECT_THAT(values,
              ElementsAre(std::pair<std::string, std::string>("b", "true"),
                          std::pair<std::string, std::string>("object.1.at", "1, 2"),
                          std::pair<std::string, std::string>("object.1.x_mm", "1.5"),
                          std::pair<std::string, std::string>("schema", "drapebench/thing/1")));
}

}  // namespace
}  // namespace drape
