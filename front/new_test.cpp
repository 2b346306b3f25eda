// SPDX-License-Identifier: Apache-2.0
#include "front/new.hpp"

#include <gmock/gmock.h>

#include "front/check.hpp"
#include "tests/support/small_bench.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;
using units::mm;

NewRigOptions three_drapes(const fs::path& folder) {
  NewRigOptions options;
  options.folder = folder;
  options.cameras = {"left", "right"};
  options.size_px = "1280x1024";
  options.drapes = {"A=sphere:90", "C=box:128", "D=hung:155"};
  return options;
}

int make(const NewRigOptions& options) {
  CommonOptions common;
  common.quiet = true;
  return make_new_rig(options, common);
}

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

/// Fills in `# name = value` as an operator does: measures the value and removes the `#`.
void fill_in(const fs::path& file) {
  std::string text = read_text(file), filled;
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t end = text.find('\n', begin);
    std::string line = text.substr(begin, end - begin);
    const bool value = line.starts_with("# ") && line.find(" = ") != std::string::npos &&
                       line.find(' ', 2) == line.find(" = ");
    filled += (value ? line.substr(2) : line) + '\n';
    begin = end + 1;
  }
  write_durable(file, filled);
}

TEST(NewRig, IsReadOnceEveryMeasuredValueIsFilledIn) {
  const test::TemporaryFolder place;
  const fs::path folder = place.path() / "my-rig";
  ASSERT_EQ(make(three_drapes(folder)), 0);
  for (const char* file : {"rig.toml", "target.toml", "print.toml", "scenes/A.toml",
                           "scenes/C.toml", "scenes/D.toml", "fabrics/cloth.toml"})
    fill_in(folder / file);
  const Rig rig = read_rig(folder / "rig.toml");
  EXPECT_EQ(rig.name, "my-rig");
  ASSERT_EQ(rig.cameras.size(), 2U);
  EXPECT_EQ(rig.camera("right").height_px, 1024);
  EXPECT_EQ(rig.stages.size(), 4U);
  EXPECT_EQ(rig.free_poses.size(), 15U);
  EXPECT_EQ(read_target(rig.target_file).tags.size(), 6U);
  EXPECT_EQ(read_print(rig.print_file).tags.size(), 50U);
  ASSERT_EQ(rig.scenes.size(), 3U);
  const Scene sphere = read_scene(rig.scenes[0]), box = read_scene(rig.scenes[1]),
              hung = read_scene(rig.scenes[2]);
  EXPECT_DOUBLE_EQ(std::get<Sphere>(sphere.obstacles.at(0)).radius_m, 45 * mm);
  EXPECT_DOUBLE_EQ(std::get<Box>(box.obstacles.at(0)).size_m.z(), 128 * mm);
  EXPECT_EQ(hung.pins.size(), 2U);
  EXPECT_EQ(hung.start.mode, StartMode::measured);
}

TEST(NewRig, NamesStagesAndHeldPointsAsTheyAreTold) {
  const test::TemporaryFolder place;
  const fs::path folder = place.path() / "my-rig";
  NewRigOptions options = three_drapes(folder);
  options.stages = {"stage_z000=0", "high=32.5"};
  options.pins = {"D=0,25.5", "D=0,180", "C=200,0"};
  ASSERT_EQ(make(options), 0);
  for (const char* file : {"rig.toml", "target.toml", "print.toml", "scenes/D.toml"})
    fill_in(folder / file);
  const Rig rig = read_rig(folder / "rig.toml");
  ASSERT_EQ(rig.stages.size(), 2U);
  EXPECT_EQ(rig.stages[1].set, "high");
  EXPECT_DOUBLE_EQ(rig.stages[1].z_m, 32.5 * mm);
  const Scene hung = read_scene(folder / "scenes/D.toml");
  ASSERT_EQ(hung.pins.size(), 2U);
  EXPECT_DOUBLE_EQ(hung.pins[0].at_material_m->y(), 25.5 * mm);
  EXPECT_THAT(read_text(folder / "scenes/C.toml"), HasSubstr("at_material_mm = [200, 0]"));
  NewRigOptions of_none = options;
  of_none.folder = place.path() / "none";
  of_none.pins = {"X=0,10"};
  EXPECT_THAT(message_of([&] { static_cast<void>(make(of_none)); }), HasSubstr("names no drape"));
  options.folder = place.path() / "other";
  for (const auto& [stages, word] :
       {std::pair(std::vector<std::string>{"a=0", "a=30"}, "a set twice"),
        std::pair(std::vector<std::string>{"low=10"}, "lacks 0"),
        std::pair(std::vector<std::string>{"a"}, "is no stage")}) {
    options.stages = stages;
    EXPECT_THAT(message_of([&] { static_cast<void>(make(options)); }), HasSubstr(word));
  }
}

TEST(NewRig, WhatNobodyMeasuredIsNamedByTheFirstReader) {
  const test::TemporaryFolder place;
  const fs::path folder = place.path() / "my-rig";
  ASSERT_EQ(make(three_drapes(folder)), 0);
  EXPECT_THAT(message_of([&] { static_cast<void>(read_rig(folder / "rig.toml")); }),
              HasSubstr("pixel_pitch_um"));
  EXPECT_THAT(message_of([&] { static_cast<void>(read_target(folder / "target.toml")); }),
              HasSubstr("pitch_mm"));
  EXPECT_THAT(message_of([&] { static_cast<void>(read_scene(folder / "scenes" / "A.toml")); }),
              HasSubstr("table_z_mm"));
}

TEST(NewRig, TheCheckNamesWhatIsMissingAndInventsNoMore) {
  const test::TemporaryFolder place;
  ASSERT_EQ(make(three_drapes(place.path() / "my-rig")), 0);
  const BenchCheck check = check_bench(place.path() / "my-rig", {});
  EXPECT_GT(check.problems.size(), 5U);
  for (const Error& problem : check.problems) {
    EXPECT_THAT(problem.what(), Not(HasSubstr("nan")));
    EXPECT_THAT(problem.what(), Not(HasSubstr("would be printed over")));
  }
}

TEST(NewRig, EveryNameThatAFileCanHoldIsWrittenAsItIs) {
  const test::TemporaryFolder place;
  const fs::path folder = place.path() / "my \"rig\"";
  NewRigOptions options = three_drapes(folder);
  options.drapes = {"Stoff 1 wei\u00df=hung:155"};
  options.cameras = {"left \"a\"", "right"};
  ASSERT_EQ(make(options), 0);
  for (const char* file : {"rig.toml", "scenes/Stoff 1 wei\u00df.toml"}) fill_in(folder / file);
  const Rig rig = read_rig(folder / "rig.toml");
  EXPECT_EQ(rig.name, "my \"rig\"");
  EXPECT_EQ(rig.cameras[0].name, "left \"a\"");
  EXPECT_EQ(read_scene(rig.scenes.at(0)).name, "Stoff 1 wei\u00df");
  EXPECT_EQ(read_scene(rig.scenes.at(0)).set, "drape_Stoff 1 wei\u00df");
}

TEST(NewRig, TheNextCommandNamesWhatIsToBeFilledIn) {
  const test::TemporaryFolder place;
  const std::string drape = test::program("drape").string();
  const test::Outcome made = test::run_line("cd " + place.path().string() + " && " + drape +
                                            " new my-rig --cameras a,b --drape A=sphere:90");
  const std::size_t next = made.text.find("next: drape ");
  ASSERT_NE(next, std::string::npos) << made.text;
  const test::Outcome checked =
      test::run_line("cd " + place.path().string() + " && " + drape + made.text.substr(next + 11));
  EXPECT_THAT(checked.text, HasSubstr("values to correct"));
  EXPECT_THAT(checked.text, HasSubstr("target.toml"));
}

TEST(NewRig, AFolderThatExistsIsNotTouched) {
  const test::TemporaryFolder place;
  write_durable(place.path() / "old" / "rig.toml", "mine\n");
  EXPECT_THAT(message_of([&] { make(three_drapes(place.path() / "old")); }), HasSubstr("exists"));
  EXPECT_EQ(read_text(place.path() / "old" / "rig.toml"), "mine\n");
  EXPECT_FALSE(fs::exists(place.path() / "old" / "target.toml"));
}

TEST(NewRig, WhatCannotBeUnderstoodIsAUsageErrorAndWritesNothing) {
  const test::TemporaryFolder place;
  const fs::path folder = place.path() / "new";
  for (const auto& [spoil, named] :
       std::vector<std::pair<std::function<void(NewRigOptions&)>, std::string>>{
           {[](auto& o) { o.drapes = {"A=cone:90"}; }, "A=cone:90"},
           {[](auto& o) { o.drapes = {"A=sphere:0"}; }, "A=sphere:0"},
           {[](auto& o) { o.drapes = {"A=sphere:" + std::string(60000, '1')}; }, "A=sphere:111"},
           {[](auto& o) { o.drapes.push_back("A=box:80"); }, "two drapes"},
           {[](auto& o) { o.drapes = {"report=sphere:90"}; }, "`report` cannot name a drape"},
           {[](auto& o) { o.drapes = {"console=box:80"}; }, "`console` cannot name a drape"},
           {[](auto& o) { o.drapes = {"rig.toml=box:80"}; }, "`rig.toml` cannot name a drape"},
           {[](auto& o) {
              o.cameras = {"a", "a"};
            },
            "two cameras"},
           {[](auto& o) {
              o.cameras = {"a/b", "c"};
            },
            "a/b"},
           {[](auto& o) { o.cameras = {"a"}; }, "two or more"},
           {[](auto& o) {
              o.stage_z_mm = {0, 0, 30};
            },
            "a height twice"},
           {[](auto& o) {
              o.stage_z_mm = {30, 60};
            },
            "lacks 0"},
           {[](auto& o) { o.size_px = "1600"; }, "1600"}}) {
    NewRigOptions options = three_drapes(folder);
    spoil(options);
    EXPECT_THAT(message_of([&] { make(options); }), HasSubstr(named));
    EXPECT_FALSE(fs::exists(folder)) << named;
  }
}

}  // namespace
}  // namespace drape
