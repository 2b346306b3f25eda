// SPDX-License-Identifier: Apache-2.0
// Ten damaged inputs: each gives one clear error that names the location, and the right exit code.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "core/files/files.hpp"
#include "tests/support/small_bench.hpp"

namespace {

namespace fs = std::filesystem;
using drape::test::Outcome;
using drape::test::SmallBench;
using testing::HasSubstr;

struct Spoiled {
  std::string name;
  std::function<void(const SmallBench&)> spoil;
  std::vector<std::string> said;  ///< parts that the error must name
  std::string more = {};          ///< further arguments of `drape run`
};

/// Lets GoogleTest list the case by its name instead of its bytes.
void PrintTo(const Spoiled& spoiled, std::ostream* out) {
  *out << spoiled.name;
}

/// Replaces a linked folder of images by a copy that can be changed.
fs::path own_images(const SmallBench& bench, const std::string& set) {
  fs::path link = bench.rig() / "recording" / set;
  const fs::path original = fs::read_symlink(link);
  fs::remove(link);
  fs::copy(original, link, fs::copy_options::recursive);
  return link;
}

void truncate_image(const SmallBench& bench) {
  const fs::path image = own_images(bench, "drape_C") / "cam1.png";
  fs::permissions(image, fs::perms::owner_write, fs::perm_options::add);
  fs::resize_file(image, fs::file_size(image) / 2);
}

void put_nan_into_curve(const SmallBench& bench) {
  const std::string file = "fabrics/A/bending_warp.csv";
  std::string text = drape::read_text(bench.rig() / file);
  const auto comma = text.rfind(',');
  drape::write_durable(bench.rig() / file, text.substr(0, comma) + ",nan\n");
}

std::vector<Spoiled> spoiled_inputs() {
  return {
      {"missing_camera",
       [](const SmallBench& b) { b.replace("rig.toml", "name = \"cam2\"", "name = \"cam7\""); },
       {"recording.json", "camera `cam7`", "set `stage_z000`"}},
      {"truncated_png",
       truncate_image,
       {"cam1.png", "camera `cam1`", "set `drape_C`", "truncated"}},
      {"wrong_print",
       [](const SmallBench& b) {
         b.replace("print.toml", "patch_mm = [220.0, 220.0]", "patch_mm = [120.0, 220.0]");
       },
       {"print.toml:", "patch_mm"}},
      {"unknown_key",
       [](const SmallBench& b) {
         b.replace("rig.toml", "name = \"bench1\"", "name = \"bench1\"\ncolour = 3");
       },
       {"rig.toml:", "unknown key `colour`"}},
      {"nan_in_curve", put_nan_into_curve, {"bending_warp.csv:", "nan"}},
      {"negative_density",
       [](const SmallBench& b) {
         b.replace("fabrics/A.toml", "areal_density_g_per_m2 = 138",
                   "areal_density_g_per_m2 = -138");
       },
       {"A.toml:", "areal_density_g_per_m2"}},
      {"wrong_unit_suffix",
       [](const SmallBench& b) {
         b.replace("scenes/C.toml", "table_z_mm = -6.0", "table_z_cm = -0.6");
       },
       {"C.toml:", "table_z_mm", "table_z_cm"}},
      {"empty_recording",
       [](const SmallBench& b) {
         drape::write_durable(
             b.rig() / "recording/recording.json",
             R"({"schema": "drapebench/recording/1", "source": "import", "sets": []})");
       },
       {"recording.json", "/sets", "empty"}},
      {"newer_schema",
       [](const SmallBench& b) {
         b.replace("recording/recording.json", "drapebench/recording/1", "drapebench/recording/2");
       },
       {"recording.json", "/schema", "newer"}},
      {"unwritable_store",
       [](const SmallBench& b) { fs::create_directory(b.folder() / "taken.sqlite"); },
       {"taken.sqlite"},
       "--store taken.sqlite"},
  };
}

class SpoiledInput : public testing::TestWithParam<Spoiled> {};

TEST_P(SpoiledInput, GivesOneErrorThatNamesThePlace) {
  const SmallBench bench({"C"});
  GetParam().spoil(bench);
  const Outcome outcome = bench.run("out", GetParam().more);
  EXPECT_EQ(outcome.exit_code, 3) << outcome.text;
  for (const std::string& part : GetParam().said) EXPECT_THAT(outcome.text, HasSubstr(part));
  std::size_t errors = 0;
  for (auto at = outcome.text.find("error:"); at != std::string::npos;
       at = outcome.text.find("error:", at + 1)) {
    ++errors;
  }
  EXPECT_EQ(errors, 1U) << outcome.text;
  EXPECT_THAT(outcome.text, HasSubstr("to do:"));
}

INSTANTIATE_TEST_SUITE_P(Ten, SpoiledInput, testing::ValuesIn(spoiled_inputs()),
                         [](const auto& spoiled) { return spoiled.param.name; });

}  // namespace
