// SPDX-License-Identifier: Apache-2.0
// triangulate writes table and objects into the measured sheet, compare reads them from the
// simulated scene: for one scene both must be equal, otherwise no drape would be GO.
#include <gtest/gtest.h>

#include "compare/drape_input.hpp"
#include "core/files/files.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "tests/support/paths.hpp"
#include "triangulate/triangulate.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;

TEST(Surroundings, AreTheSameForTheMarksAndForTheSimulationOfOneScene) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "scene.toml", mesh = folder.path() / "tent.obj";
  write_durable(mesh, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  write_durable(file,
                "schema = \"drapebench/scene/1\"\nname = \"A\"\nset = \"drape_A\"\n"
                "fabric = \"a.toml\"\nprint = \"p.toml\"\ntable_z_mm = -6.0\nfriction = 0.4\n"
                "[start]\nmode = \"measured\"\n[[object]]\nkind = \"box\"\n"
                "size_mm = [128.0, 64.0, 32.0]\nx_mm = -3.0\ny_mm = 5.0\nz_bottom_mm = -6.0\n"
                "yaw_deg = 14.0\nedge_radius_mm = 1.0\nplace_uncertainty_mm = 0.5\n[[object]]\n"
                "kind = \"mesh\"\nfile = \"tent.obj\"\norigin_mm = [0.0, 0.0, 0.0]\n");
  const fs::path sheet = folder.path() / "sheet.ply";
  Sheet measured;
  measured.rows = measured.cols = 2;
  measured.patch_m = {0.1, 0.1};
  measured.source = MeasuredSource{"bench",
                                   "drape_A",
                                   {"cam0"},
                                   sha256_of(std::string_view("c")),
                                   sha256_of(std::string_view("d"))};
  measured.marks.push_back({{0, 0}, {0.01, 0.01}, {0, 0, 0}, {}, {}, {}});
  triangulate::note_scene(std::get<MeasuredSource>(measured.source), read_scene(file), {});
  write_sheet(sheet, measured);
  const auto asked = compare::read_sheet_file(sheet).asked;
  const auto simulated = compare::read_simulated_scene(
      file, {{file, sha256_of_file(file)}, {mesh, sha256_of_file(mesh)}});
  ASSERT_TRUE(asked && simulated);
  EXPECT_EQ(asked->surroundings.at("object.2.file"), sha256_of_file(mesh));
  EXPECT_GE(asked->surroundings.size(), 8U);
  EXPECT_EQ(asked->surroundings, simulated->surroundings);
}

}  // namespace
}  // namespace drape::test
