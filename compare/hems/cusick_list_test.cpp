// SPDX-License-Identifier: Apache-2.0
// Virtual drapes and the list next to them.
#include <gmock/gmock.h>

#include "compare/hems/hem_files.hpp"
#include "core/files/json_file.hpp"
#include "core/program/run_record.hpp"
#include "tests/support/paths.hpp"

namespace drape::compare {
namespace {

/// Writes a flat square with corners 120 mm from its centre, one of them at `corner`.
void write_square(const std::filesystem::path& file, const std::string& corner = "120") {
  write_durable(file,
                "ply\nformat ascii 1.0\nelement vertex 5\nproperty double x\nproperty double y\n"
                "property double z\nelement face 4\nproperty list uchar int vertex_indices\n"
                "end_header\n0 0 0\n" +
                    corner +
                    " 0 0\n0 120 0\n-120 0 0\n0 -120 0\n3 0 1 2\n3 0 2 3\n3 0 3 4\n3 0 4 1\n");
}

TEST(Shadow, AVirtualDrapeThatIsNotAtRestIsNoGo) {
  const test::TemporaryFolder folder;
  write_square(folder.path() / "start-00.ply");
  write_square(folder.path() / "start-01.ply", "119");
  Json list;
  list["schema"] = "drapebench/cusick/1";
  list["fabric"] = "wool";
  list["starts"] = {{{"file", "start-00.ply"}, {"at_rest", true}, {"specimen_area_mm2", 70000}},
                    {{"file", "start-01.ply"}, {"at_rest", false}, {"specimen_area_mm2", 70000}}};
  write_json(folder.path() / "cusick.json", list);
  const HemSet set = read_hems({folder.path()}, {});
  ASSERT_EQ(set.hems.size(), 2U) << (set.refused.empty() ? "" : set.refused.front());
  EXPECT_TRUE(set.hems[0].go);
  EXPECT_FALSE(set.hems[1].go);
  const double disc = std::numbers::pi * 8100;
  EXPECT_NEAR(set.hems[0].drape_coefficient(), 100 * (28800 - disc) / (70000 - disc), 1e-3);
}

TEST(Shadow, AMeshThatTheListBesideItDoesNotNameIsRefused) {
  const test::TemporaryFolder folder;
  write_square(folder.path() / "start-00.ply");
  write_square(folder.path() / "start-01.ply", "119");
  Json list;
  list["schema"] = "drapebench/cusick/1";
  list["fabric"] = "wool";
  list["starts"] = {{{"file", "start-00.ply"}, {"at_rest", true}, {"specimen_area_mm2", 70000}}};
  write_json(folder.path() / "cusick.json", list);
  const HemSet set = read_hems({folder.path()}, {});
  EXPECT_EQ(set.hems.size(), 1U);
  ASSERT_EQ(set.refused.size(), 1U);
  EXPECT_THAT(set.refused[0], testing::HasSubstr("start-01.ply"));
  EXPECT_THAT(set.refused[0], testing::HasSubstr("does not name it"));
}

TEST(Shadow, ADrapeThatIsNotTheOneOfItsRunIsRefused) {
  const test::TemporaryFolder folder;
  const auto mesh = folder.path() / "start-00.ply", file = folder.path() / "cusick.json";
  write_square(mesh);
  Json list;
  list["schema"] = "drapebench/cusick/1";
  list["fabric"] = "wool";
  list["starts"] = {{{"file", "start-00.ply"}, {"at_rest", true}, {"specimen_area_mm2", 70000}}};
  write_json(file, list);
  RunRecord record("drape-simulate", {}, run_record_path(file));
  for (const auto& output : {mesh, file}) record.output(output);
  record.write(0);
  EXPECT_EQ(read_hems({folder.path()}, {}).hems.size(), 1U);
  write_square(mesh, "119");
  const HemSet set = read_hems({folder.path()}, {});
  EXPECT_TRUE(set.hems.empty());
  ASSERT_EQ(set.refused.size(), 1U);
  EXPECT_THAT(set.refused[0], testing::HasSubstr("not the one that its run wrote"));
}

TEST(Shadow, ADrapeOverAnotherDiscIsRefusedWithTheOptionsThatFit) {
  const test::TemporaryFolder folder;
  write_square(folder.path() / "start-00.ply");
  Json list;
  list["schema"] = "drapebench/cusick/1";
  list["fabric"] = "wool";
  list["disc_mm"] = 127;
  list["specimen_mm"] = 254;
  list["starts"] = {{{"file", "start-00.ply"}, {"at_rest", true}, {"specimen_area_mm2", 50670}}};
  write_json(folder.path() / "cusick.json", list);
  const HemSet usual = read_hems({folder.path()}, {});
  EXPECT_TRUE(usual.hems.empty());
  ASSERT_EQ(usual.refused.size(), 1U);
  EXPECT_THAT(usual.refused[0], testing::HasSubstr("--disc-mm 127 --specimen-mm 254"));
  HemReadOptions options;
  options.geometry.disc_m = 0.127;
  options.geometry.specimen_m = 0.254;
  const HemSet fitting = read_hems({folder.path()}, options);
  ASSERT_EQ(fitting.hems.size(), 1U) << (fitting.refused.empty() ? "" : fitting.refused.front());
}

}  // namespace
}  // namespace drape::compare
