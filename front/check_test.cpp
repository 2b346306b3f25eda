// SPDX-License-Identifier: Apache-2.0
#include "front/check.hpp"

#include <gmock/gmock.h>

#include <tuple>

#include "core/files/json_file.hpp"
#include "core/program/words.hpp"
#include "tests/support/small_bench.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;
using test::SmallBench;
using testing::HasSubstr;
using testing::MatchesRegex;

/// Problems that `drape check` reports after one text in a file of bench1 is replaced.
Json problems_of(const std::string& file, const std::string& from, const std::string& to) {
  const SmallBench bench({"C"});
  bench.replace(file, from, to);
  return parse_json(test::run_line(test::program("drape").string() + " check --json " +
                                   bench.rig().string() + " 2> /dev/null")
                        .text)
      .value("problems", Json::array());
}

/// The only problem of such a bench, with its location.
std::string problem_of(const std::string& file, const std::string& from, const std::string& to) {
  const Json problems = problems_of(file, from, to);
  EXPECT_EQ(problems.size(), 1U) << problems.dump();
  if (problems.empty()) return "none";
  return problems[0]["what_failed"].get<std::string>() + "\n" +
         problems[0]["where"].get<std::string>();
}

TEST(Check, NamesTheLineOfTheTableThatIsWrong) {
  for (const auto& [from, to, where] :
       {std::tuple{"\"stage_z060\"", "\"stage_z066\"", ":35, field `calibration.stage.3.set`"},
        std::tuple{"\"stage_z060\"", "\"stage_z030\"", ":35, field `calibration.stage.3.set`"},
        std::tuple{"z_mm = 60.0", "z_mm = 30.0", ":36, field `calibration.stage.3.z_mm`"},
        std::tuple{"z_mm = 60.0", "z_mm = 60000.0", ":36, field `calibration.stage.3.z_mm`"},
        std::tuple{"\"pose_03\"", "\"pose_33\"", ":20, field `calibration.free_poses`"}})
    EXPECT_THAT(problem_of("rig.toml", from, to), HasSubstr(where));
}

TEST(Check, AFilesNameReachesTheTerminalWithoutControlCharacters) {
  const SmallBench bench({"C"});
  const std::string folder = bench.rig().string() + "/a\x1b[31m\xe2\x80\xae";
  fs::create_directory(folder);
  const std::string check = test::program("drape").string() + " check " + bench.rig().string() +
                            " --recording " + shell_word(folder);
  const test::Outcome named = test::run_line(check);
  EXPECT_EQ(named.exit_code, 3);
  EXPECT_THAT(named.text, HasSubstr("/a?[31m?/recording.json"));
  EXPECT_EQ(test::run_line(check + " 2> /dev/full").exit_code, 3) << "the message is lost";
  EXPECT_THAT(problem_of("rig.toml", "scenes/C.toml", "scenes/\\nGO: all.toml"),
              HasSubstr("scenes/?GO: all.toml"));
  EXPECT_THAT(problem_of("rig.toml", "\"bench1\"", "\"\\nGO: all\""), HasSubstr("`?GO: all`"));
}

TEST(Check, TwoTagsOfOneIdAreNamed) {
  const std::string problem = problem_of("target.toml", "id = 403", "id = 401");
  EXPECT_THAT(problem, HasSubstr("two tags have the id 401"));
  EXPECT_THAT(problem, HasSubstr("field `tags.tag.4.id`"));
  EXPECT_THAT(problem, HasSubstr("target.toml:28")) << "the second one's line";
}

/// A run would pass it on only after all stages are done.
TEST(Check, AnAcceptanceThatCompareWouldRefuseIsNamedBefore) {
  const auto checked = [](const std::string& text) {
    const SmallBench bench({"C"});
    write_durable(bench.rig() / "acceptance.json", text);
    return test::run_line(test::program("drape").string() + " check " + bench.rig().string());
  };
  const std::string sha256(64, '0');
  const std::string good = R"({"schema": "drapebench/acceptance/1", "rig": "bench1", )"
                           R"("calibration_sha256": ")" +
                           sha256 +
                           R"(", "date": null, "valid_until": null, "positions": 0, "go": true, )"
                           R"("cause": null, "warnings": [], "figures": []})";
  EXPECT_EQ(checked(good).exit_code, 0) << checked(good).text;
  EXPECT_EQ(checked("{}").exit_code, 3);
  EXPECT_THAT(checked("{}").text, HasSubstr("acceptance.json"));
  std::string cut = good;
  cut.replace(cut.find(sha256), 64, "none");
  EXPECT_THAT(checked(cut).text, HasSubstr("calibration_sha256"));
}

TEST(Check, NamesANumberThatIsGivenTwice) {
  EXPECT_THAT(problem_of("rig.toml", "grids = [11, 21, 31]", "grids = [11, 21, 11]"),
              MatchesRegex("`grids` holds a number twice\n.*rig.toml:[0-9]+, field `grids`"));
  EXPECT_THAT(problem_of("rig.toml", "segments = [1]", "segments = [1, 1]"),
              MatchesRegex("`segments` holds a number twice\n.*rig.toml:[0-9]+, field `segments`"));
}

TEST(Check, OneRuleHoldsForTheNamesOfDrapes) {
  const auto name_is = [](const std::string& name) { return "name = \"" + name + "\""; };
  for (const std::string& name : {std::string("A,B"), std::string("-x"), std::string("a\\u0007b"),
                                  std::string(230, 'x'), std::string("a/b")})
    EXPECT_THAT(problem_of("scenes/C.toml", name_is("C"), name_is(name)),
                MatchesRegex("`.*` cannot be a name\n.*C.toml:[0-9]+, field `name`"));
  EXPECT_TRUE(problems_of("scenes/C.toml", name_is("C"), name_is("Stoff 1 wei\u00df")).empty());
}

TEST(Check, TakesAPictureForWhatItHolds) {
  const SmallBench bench({"C"});
  const std::filesystem::path set = bench.rig() / "recording/drape_C", picture = set / "cam1.png";
  const std::filesystem::path original = std::filesystem::canonical(set);
  ASSERT_TRUE(std::filesystem::remove(set)) << "a link to bench1's, which stays as it is";
  std::filesystem::copy(original, set);
  const auto problems = [&](const std::string& bytes) {
    write_durable(picture, bytes);
    return parse_json(test::run_line(test::program("drape").string() + " check --json " +
                                     bench.rig().string() + " 2> /dev/null")
                          .text)
        .value("problems", Json::array())
        .dump();
  };
  EXPECT_EQ(problems("\xff\xd8\xff\xe0 a JPEG's beginning"), "[]");
  EXPECT_THAT(problems("no picture"), HasSubstr("this is no picture file"));
  EXPECT_THAT(problems(""), HasSubstr("the picture is empty"));
}

TEST(Check, TakesARecordingWithACameraMoreThanTheRig) {
  const std::string rig = read_text(test::source_root() / "rigs/bench1/rig.toml");
  EXPECT_TRUE(problems_of("rig.toml", rig.substr(rig.rfind("[[camera]]")), "").empty());
}

TEST(Run, NeverReplacesARigThatItDidNotMake) {
  const SmallBench bench({"C"});
  const std::string rig = read_text(bench.rig() / "rig.toml");
  const test::Outcome outcome = bench.run("rig");
  EXPECT_EQ(outcome.exit_code, 3) << outcome.text;
  EXPECT_THAT(outcome.text, HasSubstr("rig.toml that no run made"));
  EXPECT_EQ(read_text(bench.rig() / "rig.toml"), rig);
  EXPECT_FALSE(fs::exists(bench.rig() / ".lock"));
}

}  // namespace
}  // namespace drape
