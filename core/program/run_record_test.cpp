// SPDX-License-Identifier: Apache-2.0
#include "core/program/run_record.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/support/paths.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

/// A step of the running program that read `in.txt` and wrote `out.json`.
class RunRecords : public testing::Test {
 protected:
  RunRecords() {
    write_durable(in_, "input");
    write_durable(out_, "output");
    write(0);
  }

  void write(int exit_code) const {
    RunRecord record("drape-thing", arguments_, run_record_path(out_));
    record.input(in_);
    record.output(out_);
    record.write(exit_code, {.verdict = "done"});
  }
  [[nodiscard]] bool up_to_date(const std::vector<std::string>& arguments) const {
    return is_up_to_date(run_record_path(out_), fs::canonical("/proc/self/exe"), arguments);
  }

  test::TemporaryFolder folder_;
  fs::path in_ = folder_.path() / "in.txt", out_ = folder_.path() / "out.json";
  std::vector<std::string> arguments_ = {"in.txt", "--grid", "11"};
};

TEST_F(RunRecords, LieBesideTheOutput) {
  EXPECT_EQ(run_record_path("a/sheet.ply"), fs::path("a/sheet.run.json"));
}

TEST_F(RunRecords, ProveAStepUpToDate) {
  EXPECT_TRUE(up_to_date(arguments_));
  EXPECT_EQ(read_run_file(run_record_path(out_)).exit_code, 0);
}

TEST_F(RunRecords, ForgetOptionsThatChangeNoResult) {
  EXPECT_TRUE(up_to_date({"in.txt", "--threads", "7", "--grid", "11", "--json", "--quiet"}));
  EXPECT_FALSE(up_to_date({"in.txt", "--grid", "21"}));
}

TEST_F(RunRecords, SeeEveryChangedFile) {
  write_durable(in_, "other input");
  EXPECT_FALSE(up_to_date(arguments_));
  write_durable(in_, "input");
  EXPECT_TRUE(up_to_date(arguments_));
  write_durable(out_, "other output");
  EXPECT_FALSE(up_to_date(arguments_));
  fs::remove(out_);
  EXPECT_FALSE(up_to_date(arguments_));
}

TEST_F(RunRecords, ANoGoIsAResultAndAFailureIsNot) {
  write(1);
  EXPECT_TRUE(up_to_date(arguments_));
  EXPECT_EQ(read_run_file(run_record_path(out_)).exit_code, 1);
  write(5);
  EXPECT_FALSE(up_to_date(arguments_));
}

TEST_F(RunRecords, GoFirstAndComeBackLast) {
  const RunRecord begun("drape-thing", arguments_, run_record_path(out_));
  EXPECT_FALSE(fs::exists(run_record_path(out_)));
  EXPECT_FALSE(fs::exists(ending_path(run_record_path(out_))));
  EXPECT_THROW(RunRecord("drape-thing", arguments_, run_record_path(out_)), Error);
}

TEST_F(RunRecords, RefuseAnOutputThatIsAnInputAndTouchNothing) {
  const std::string record = read_text(run_record_path(out_));
  const auto refused = [&](const StepFiles& files) {
    try {
      const RunRecord begun("drape-other", {}, run_record_path(out_), files);
    } catch (const Error& error) {
      return error.kind() == ErrorKind::usage;
    }
    return false;
  };
  fs::create_symlink(out_, folder_.path() / "link.json");
  EXPECT_TRUE(refused({{out_}, {in_, out_}}));
  EXPECT_TRUE(refused({{out_}, {folder_.path() / "." / "out.json"}}));
  EXPECT_TRUE(refused({{out_}, {folder_.path() / "link.json"}}));
  EXPECT_EQ(read_text(run_record_path(out_)), record);
  EXPECT_TRUE(fs::exists(ending_path(run_record_path(out_))));
  EXPECT_FALSE(refused({{out_}, {in_}}));
  RunRecord begun("drape-other", {}, run_record_path(out_), {{out_}, {in_}});
  EXPECT_THROW(begun.input(out_), Error);
}

TEST_F(RunRecords, ACommentChangesNoValue) {
  const fs::path scene = folder_.path() / "scene.toml";
  write_durable(scene, "name = \"A\"\nfriction = 0.40\n");
  {
    RunRecord record("drape-thing", arguments_, run_record_path(out_));
    record.input(scene);
    record.input(scene, sha256_of_file(scene));
    record.output(out_);
    record.write(0);
  }
  write_durable(scene, "# as measured\nfriction = 0.4\nname = \"A\"\n");
  EXPECT_TRUE(up_to_date(arguments_));
  write_durable(scene, "name = \"A\"\nfriction = 0.41\n");
  EXPECT_FALSE(up_to_date(arguments_));
}

TEST_F(RunRecords, APictureOfAnotherSetChangesNothingThatWasRead) {
  const fs::path recording = folder_.path() / "recording.json";
  const auto list = [](const char* first, const char* second) {
    return fmt::format(R"({{"rig": "r", "sets": [{{"name": "a", "frames": ["{}"]}},
                        {{"name": "b", "frames": ["{}"]}}]}})",
                       first, second);
  };
  write_durable(recording, list("1", "2"));
  {
    RunRecord record("drape-thing", arguments_, run_record_path(out_));
    record.input_sets(recording, {"a"});
    record.output(out_);
    record.write(0);
  }
  write_durable(recording, list("1", "3"));
  EXPECT_TRUE(up_to_date(arguments_));
  write_durable(recording, list("4", "2"));
  EXPECT_FALSE(up_to_date(arguments_));
}

/// Otherwise the failure would appear only after everything is computed.
TEST_F(RunRecords, RefuseAnOutputThatCannotBeWrittenBeforeAnythingIsDone) {
  const fs::path link = folder_.path() / "link.json";
  fs::create_symlink(in_, link);
  for (const fs::path& place : {folder_.path(), link})
    EXPECT_THROW(RunRecord("drape-thing", {}, run_record_path(out_), {{place}, {in_}}), Error);
  EXPECT_TRUE(up_to_date(arguments_)) << "the record of before was removed";
}

TEST_F(RunRecords, SeeAChangedEnding) {
  Ending ending = kept_ending(run_record_path(out_)).value();
  EXPECT_EQ(printed(ending), "GO: done\n");
  ending.go = false;
  write_record(ending_path(run_record_path(out_)), ending);
  EXPECT_FALSE(up_to_date(arguments_));
}

TEST_F(RunRecords, SeeALinkThatWasPointedElsewhere) {
  const fs::path link = folder_.path() / "link";
  for (const char* name : {"first", "second"})
    write_durable(folder_.path() / name / "list.txt", name);
  fs::create_directory_symlink("first", link);
  {
    RunRecord record("drape-thing", arguments_, run_record_path(out_));
    record.input(link / "list.txt");
    record.output(out_);
    record.write(0);
  }
  EXPECT_TRUE(up_to_date(arguments_));
  fs::remove(link);
  fs::create_directory_symlink("second", link);
  EXPECT_FALSE(up_to_date(arguments_));
}

TEST_F(RunRecords, KnowAPathInEverySpelling) {
  const fs::path here = fs::current_path();
  fs::current_path(folder_.path());
  arguments_ = {"./in.txt", "--grid", "11"};
  write(0);
  EXPECT_TRUE(up_to_date({in_.string(), "--grid", "11"}));
  EXPECT_FALSE(up_to_date({out_.string(), "--grid", "11"}));
  fs::current_path(here);
}

TEST_F(RunRecords, ADamagedRecordProvesNothing) {
  const std::string text = read_text(run_record_path(out_));
  write_durable(run_record_path(out_), text.substr(0, text.size() / 2));
  EXPECT_FALSE(up_to_date(arguments_));
}

TEST_F(RunRecords, ARecordOfVersion1IsReadAndProvesNothing) {
  const fs::path record = run_record_path(out_);
  std::string text = read_text(record);
  text.replace(text.find("run/2"), 5, "run/1");
  write_durable(record, text);
  EXPECT_EQ(read_run_file(record).program, "drape-thing");
  EXPECT_FALSE(up_to_date(arguments_));
}

TEST_F(RunRecords, AMovedFolderStaysUpToDate) {
  const test::TemporaryFolder elsewhere;
  fs::copy(folder_.path(), elsewhere.path() / "copy");
  EXPECT_TRUE(is_up_to_date(elsewhere.path() / "copy" / "out.run.json",
                            fs::canonical("/proc/self/exe"), arguments_));
}

}  // namespace
}  // namespace drape
