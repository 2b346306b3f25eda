// SPDX-License-Identifier: Apache-2.0

#include <fmt/format.h>

#include <gmock/gmock.h>

#include <bit>

#include "compare/history/results.hpp"
#include "compare/test_sheets.hpp"
#include "core/drape_mesh.hpp"
#include "tests/support/bench1_truth.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using units::mm;

Eigen::Vector3d wave(const Eigen::Vector2d& m) {
  return test::flat(m) + Eigen::Vector3d(0, 0, 0.2 * m.x() * m.x() + 0.1 * m.y());
}

constexpr int kCount = 23;  ///< 10 mm apart, so the marks are vertices

/// Vertices of a grid with shape `wave`, index = outer * 23 + inner, inner along the weft, in mm.
std::vector<Eigen::Vector3d> grid_points() {
  std::vector<Eigen::Vector3d> points;
  for (int outer = 0; outer < kCount; ++outer)
    for (int inner = 0; inner < kCount; ++inner)
      points.emplace_back(wave({0.22 - outer * 0.01, inner * 0.01}) / mm);
  return points;
}

std::string head(const std::string& format, bool uv) {
  return fmt::format(
      "ply\nformat {} 1.0\ncomment by a test\nelement vertex {}\nproperty float x\nproperty float "
      "y\nproperty float z\n{}element face 0\nproperty list uchar int vertex_indices\nend_header\n",
      format, kCount * kCount, uv ? "property float s\nproperty float t\n" : "");
}

void append_float(std::string& text, double value, bool swap) {
  auto bytes = std::bit_cast<std::array<char, 4>>(static_cast<float>(value));
  if (swap) std::reverse(bytes.begin(), bytes.end());
  text.append(bytes.data(), 4);
}

std::string grid_ply(const std::string& format) {
  std::string text = head(format, false);
  for (const Eigen::Vector3d& p : grid_points()) {
    if (format == "ascii") {
      text += fmt::format("{} {} {}\n", static_cast<float>(p.x()), static_cast<float>(p.y()),
                          static_cast<float>(p.z()));
      continue;
    }
    for (int k = 0; k < 3; ++k) append_float(text, p[k], format == "binary_big_endian");
  }
  return text;
}

constexpr const char* kGridToml =
    "schema = \"drapebench/mesh/1\"\nname = \"Other 1.0\"\nmesh = \"{}\"\nunit_mm = 1.0\nscene = "
    "\"A\"\n[grid]\ninner = \"weft\"\ninner_count = 23\nwarp_from_mm = 220.0\nwarp_to_mm = "
    "0.0\nweft_from_mm = 0.0\nweft_to_mm = 220.0\n";

Simulation read(const fs::path& folder, const std::string& name, const std::string& content,
                const std::string& toml) {
  write_durable(folder / name, content);
  write_durable(folder / "other.toml", fmt::format(fmt::runtime(toml), name));
  return read_other_mesh(folder / "other.toml", test::measured_sheet());
}

double mean_to_wave(const Simulation& simulation) {
  const auto marks =
      compare_marks(test::measured_sheet(wave), Surface(simulation.sheet.sheet, "other"));
  EXPECT_EQ(marks.marks.size(), 121U);
  return statistics_of(marks.marks).max_m;
}

TEST(OtherMesh, EveryPlyFormatGivesTheSameSheet) {
  const drape::test::TemporaryFolder folder;
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    const Simulation other = read(folder.path(), "grid.ply", grid_ply(format), kGridToml);
    EXPECT_LT(mean_to_wave(other), 1e-5 * mm + 1e-8) << format << ": floats of 110 mm";
    EXPECT_EQ(other.label(), "Other 1.0, 23x23");
    EXPECT_FALSE(other.segments());
  }
}

/// The same as OBJ in metres, y up, with texture coordinates and quads.
std::string textured_obj() {
  std::string text = "# by a test\n";
  const auto points = grid_points();
  for (const Eigen::Vector3d& p : points)
    text += fmt::format("v {} {} {}\n", p.x() * mm, p.z() * mm, -p.y() * mm);
  for (int outer = 0; outer < kCount; ++outer)
    for (int inner = 0; inner < kCount; ++inner)
      text += fmt::format("vt {} {}\n", inner / 22.0, outer / 22.0);
  for (int outer = 0; outer + 1 < kCount; ++outer) {
    for (int inner = 0; inner + 1 < kCount; ++inner) {
      const int a = outer * kCount + inner + 1, b = a + 1, c = b + kCount, d = a + kCount;
      text += fmt::format("f {0}/{0} {1}/{1} {2}/{2} {3}/{3}\n", a, b, c, d);
    }
  }
  return text;
}

TEST(OtherMesh, TexturedObjInMetresWithYUp) {
  const drape::test::TemporaryFolder folder;
  const Simulation other =
      read(folder.path(), "cloth.obj", textured_obj(),
           "schema = \"drapebench/mesh/1\"\nname = \"CLO\"\nmesh = \"{}\"\nunit_mm = 1000.0\nup = "
           "\"y\"\nscene = \"A\"\nfabric = \"cotton\"\n[uv]\nwarp = \"v\"\nwarp_from_mm = 220.0\n"
           "warp_to_mm = 0.0\nweft_from_mm = 0.0\nweft_to_mm = 220.0\n");
  EXPECT_LT(mean_to_wave(other), 1e-9) << "the marks are vertices";
  EXPECT_EQ(other.source().fabric, "cotton");
}

std::string refusal(const fs::path& folder, const std::string& name, const std::string& content,
                    const std::string& toml = kGridToml) {
  try {
    static_cast<void>(read(folder, name, content, toml));
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    return error.what();
  }
  return "nothing was refused";
}

TEST(OtherMesh, DamagedFilesAreOneClearError) {
  const drape::test::TemporaryFolder folder;
  const std::string whole = grid_ply("binary_little_endian");
  EXPECT_THAT(refusal(folder.path(), "a.ply", whole.substr(0, whole.size() - 5)),
              HasSubstr("ends before its data"));
  EXPECT_THAT(refusal(folder.path(), "a.ply", "solid\n"), HasSubstr("not a PLY"));
  EXPECT_THAT(refusal(folder.path(), "a.stl", "x"), HasSubstr(".ply or .obj"));
  EXPECT_THAT(refusal(folder.path(), "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"),
              HasSubstr("a.obj:4"));
  EXPECT_THAT(refusal(folder.path(), "a.obj", "v 0 nan 0\n"), HasSubstr("a.obj:1"));
  std::string ascii = grid_ply("ascii");
  ascii.replace(ascii.find("end_header\n") + 11, 1, "x");
  EXPECT_THAT(refusal(folder.path(), "a.ply", ascii), HasSubstr("is not a number"));
}

TEST(OtherMesh, WrongDescriptionsNameTheirField) {
  const drape::test::TemporaryFolder folder;
  const auto with = [](std::string toml, const std::string& from, const std::string& to) {
    return toml.replace(toml.find(from), from.size(), to);
  };
  const std::string mesh = grid_ply("ascii");
  EXPECT_THAT(refusal(folder.path(), "a.ply", mesh, with(kGridToml, "= 23", "= 24")),
              HasSubstr("inner_count"));
  EXPECT_THAT(refusal(folder.path(), "a.ply", mesh, with(kGridToml, "\"weft\"", "\"up\"")),
              HasSubstr("inner"));
  EXPECT_THAT(refusal(folder.path(), "a.ply", mesh,
                      std::string(kGridToml, std::string(kGridToml).find("[grid]"))),
              HasSubstr("[grid] or [uv]"));
  EXPECT_THAT(refusal(folder.path(), "a.ply", mesh, with(kGridToml, "unit_mm", "unit_cm")),
              HasSubstr("unit_"));
}

TEST(OtherMesh, AMeshOfAnotherSizeThanItsClothIsAMistakeOfUnit) {
  const drape::test::TemporaryFolder folder;
  const auto with = [](std::string toml, const std::string& from, const std::string& to) {
    return toml.replace(toml.find(from), from.size(), to);
  };
  const std::string mesh = grid_ply("ascii");
  // A mesh in mm declared as cm, inches or metres, and one in cm or inches declared as mm.
  for (const char* unit : {"10", "25.4", "1000", "0.1", "0.03937", "0.001"})
    EXPECT_THAT(refusal(folder.path(), "a.ply", mesh,
                        with(kGridToml, "unit_mm = 1.0", fmt::format("unit_mm = {}", unit))),
                testing::AllOf(HasSubstr("unit_mm"), HasSubstr("times as far apart")))
        << unit;
  // One of the two directions is in cm.
  EXPECT_THAT(
      refusal(folder.path(), "a.ply", mesh, with(kGridToml, "weft_to_mm = 220", "weft_to_mm = 22")),
      HasSubstr("along the weft lie 10 times"));
  const std::string textured =
      "schema = \"drapebench/mesh/1\"\nname = \"CLO\"\nmesh = \"{}\"\nunit_mm = 100.0\nup = "
      "\"y\"\nscene = \"A\"\n[uv]\nwarp = \"v\"\nwarp_from_mm = 220.0\nwarp_to_mm = 0.0\n"
      "weft_from_mm = 0.0\nweft_to_mm = 220.0\n";
  EXPECT_THAT(refusal(folder.path(), "a.obj", textured_obj(), textured),
              HasSubstr("along the warp lie 0.1 times"));
}

/// A mesh of two large triangles in the plane z = 0, without material coordinates.
fs::path plane_without_marks(const fs::path& folder, const std::string& more = "") {
  write_durable(folder / "plane.obj",
                "v -500 -500 0\nv 500 -500 0\nv 500 500 0\nv -500 500 0\nf 1 2 3 4\n");
  write_durable(folder / "plane.toml",
                "schema = \"drapebench/mesh/1\"\nname = \"Plane\"\nmesh = \"plane.obj\"\n"
                "unit_mm = 1.0\nscene = \"A\"\ncorrespondence = \"none\"\n" +
                    more);
  return folder / "plane.toml";
}

TEST(OtherSurface, DistancesToAPlaneAreTheHeightsOfTheMarks) {
  const drape::test::TemporaryFolder folder;
  const auto plane = read_other_surface(plane_without_marks(folder.path()));
  ASSERT_TRUE(plane);
  const Sheet measured = test::measured_sheet(wave);
  const RealSurface row = compare_to_surface(measured, plane->mesh);
  double sum = 0, largest = 0;
  for (const SheetMark& mark : measured.marks) {
    sum += std::abs(mark.point_in_world.z());
    largest = std::max(largest, std::abs(mark.point_in_world.z()));
  }
  EXPECT_NEAR(row.to_surface.mean_m, sum / 121, 1e-12);
  EXPECT_NEAR(row.to_surface.max_m, largest, 1e-12);
  // Covariances of (0.03 mm)^2 in every direction.
  EXPECT_NEAR(*row.to_surface.mean.sigma_m, 0.03 * mm / 11, 1e-12);
  ASSERT_TRUE(row.both_directions);
  EXPECT_NEAR(row.both_directions->first_to_second.hausdorff_m, largest, 1e-12);
  EXPECT_GT(row.both_directions->second_to_first.hausdorff_m, 0.4)
      << "the plane goes on where no mark is";
}

TEST(OtherSurface, ClothThatSlidAlongItselfHasNoDistanceToItsSurface) {
  const drape::test::TemporaryFolder folder;
  const auto plane = read_other_surface(plane_without_marks(folder.path()));
  ASSERT_TRUE(plane);
  const test::Shape slid = [](const Eigen::Vector2d& m) -> Eigen::Vector3d {
    return test::flat(m) + Eigen::Vector3d(0.01, 0.02, 0);
  };
  EXPECT_LT(compare_to_surface(test::measured_sheet(slid), plane->mesh).to_surface.max_m, 1e-15);
}

TEST(OtherSurface, IsAskedForInSoManyWords) {
  const drape::test::TemporaryFolder folder;
  EXPECT_THROW((void)read_other_surface(plane_without_marks(folder.path(), "[grid]\n")), Error);
  const fs::path file = plane_without_marks(folder.path());
  std::string toml = read_text(file);
  toml.erase(toml.find("correspondence"));
  write_durable(file, toml);
  EXPECT_FALSE(read_other_surface(file));
  try {
    (void)read_other_mesh(file, test::measured_sheet());
    FAIL() << "neither [grid] nor [uv] nor a word about it";
  } catch (const Error& error) {
    EXPECT_THAT(std::string(error.what()), HasSubstr("correspondence"));
  }
}

TEST(OtherSurface, OfTooLittleClothIsAMistakeOfUnit) {
  const drape::test::TemporaryFolder folder;
  const auto plane = read_other_surface(plane_without_marks(folder.path()));
  ASSERT_TRUE(plane);
  DrapeInput input = test::drape_of(test::measured_sheet(), {test::simulated_sheet(11, 5)});
  input.surfaces.push_back(*plane);
  EXPECT_EQ(compare_drape(input, {}).real_surface.size(), 1U);
  for (Eigen::Vector3d& point : input.surfaces[0].mesh.points) point *= 0.1;
  try {
    (void)compare_drape(input, {});
    FAIL() << "a plane of 100 mm is no cloth of 220 mm";
  } catch (const Error& error) {
    EXPECT_THAT(std::string(error.what()), HasSubstr("unit_mm"));
  }
}

TEST(OtherSurface, StandsInItsOwnTableAndIsRecomputedAndExplained) {
  const drape::test::TemporaryFolder folder;
  std::vector<fs::path> sheets = test::write_recorded_example(folder.path());
  sheets.push_back(plane_without_marks(folder.path()));
  const fs::path file = folder.path() / "results.sqlite";
  const Session session = read_session(sheets, {});
  Outcome outcome;
  compare_session(session, {}, outcome);
  EXPECT_EQ(import_session(file, session, outcome).added, 4 + 4 + 1);
  EXPECT_EQ(import_session(file, session, outcome).added, 0);
  const StoreReader reader(file);
  EXPECT_EQ(reader.query("SELECT * FROM v_comparison WHERE simulator = 'Plane'").rows.size(), 0U)
      << "never among the distances of marks";
  const Table rows = reader.query("SELECT comparison, marks, triangles FROM v_real_vs_surface");
  ASSERT_EQ(rows.rows.size(), 1U);
  EXPECT_EQ(rows.rows[0][2], "2");
  const auto titles = [&](const std::string& simulator) {
    std::string text;
    for (const Table& table : paper_tables(reader, {.simulator = simulator})) text += table.title;
    return text;
  };
  EXPECT_THAT(titles("Plane"), testing::StartsWith("Real vs surface"));
  EXPECT_THAT(titles("drapebench"), testing::Not(HasSubstr("Real vs surface")));
  EXPECT_THAT(titles(""), HasSubstr("Real vs surface"));
  const Answer why = explain(reader, rows.rows[0][0], "to_surface_mean_mm");
  EXPECT_TRUE(why.good);
  EXPECT_EQ(why.tables[1].rows.back()[2], "another simulator's mesh");
  EXPECT_FALSE(show_result(reader, rows.rows[0][0]).tables[0].rows.empty());
  const Verification verified = verify_store(file);
  EXPECT_TRUE(verified.findings.empty()) << verified.findings.front();
  EXPECT_EQ(verified.comparisons, 4 + 4 + 1);
}

/// The true dots as a measured sheet, as from a perfect bench.
Sheet true_sheet(const std::string& scene) {
  Sheet sheet = test::measured_sheet();
  const auto& dots = drape::test::bench1_truth().drapes.at(scene);
  for (std::size_t i = 0; i < sheet.marks.size(); ++i)
    sheet.marks[i].point_in_world = dots[i].point_in_world;
  return sheet;
}

TEST(OtherMesh, BlendersMeshesAreTheTruthOfBench1) {
  const std::filesystem::path data = drape::test::test_data("bench1");
  const drape::test::TemporaryFolder folder;
  for (const std::string scene : {"A", "C", "E"}) {
    const std::string toml = fmt::format(
        "schema = \"drapebench/mesh/1\"\nname = \"Blender 3.4\"\nmesh = \"{}\"\nunit_mm = "
        "1.0\nscene = \"{}\"\n[grid]\ninner = \"weft\"\ninner_count = 111\nwarp_from_mm = "
        "220.0\nwarp_to_mm = 0.0\nweft_from_mm = 0.0\nweft_to_mm = 220.0\n",
        (data / ("mesh_" + scene + ".ply")).string(), scene);
    write_durable(folder.path() / "other.toml", toml);
    const Simulation other = read_other_mesh(folder.path() / "other.toml", true_sheet(scene));
    const auto marks = compare_marks(true_sheet(scene), Surface(other.sheet.sheet, "mesh")).marks;
    ASSERT_EQ(marks.size(), 121U);
    // The mesh is stored in floats and the truth in millimetres with a few decimals.
    EXPECT_LT(statistics_of(marks).max_m, 0.001 * mm) << scene;
    EXPECT_EQ(other.sheet.sheet.no_go, std::nullopt) << scene;
    const auto described = [&](const std::string& from, const std::string& to) {
      std::string text = toml;
      write_durable(folder.path() / "wrong.toml", text.replace(text.find(from), from.size(), to));
      return read_other_mesh(folder.path() / "wrong.toml", true_sheet(scene))
          .sheet.sheet.no_go.value_or("");
    };
    EXPECT_THAT(described("[grid]", "up = \"y\"\n[grid]"), HasSubstr("with up = \"z\""));
    EXPECT_THAT(described("\"weft\"", "\"warp\""), HasSubstr("warp and weft exchanged"));
    EXPECT_THAT(described("warp_from_mm = 220.0\nwarp_to_mm = 0.0",
                          "warp_from_mm = 0.0\nwarp_to_mm = 220.0"),
                HasSubstr("with warp_from and warp_to exchanged"));
  }
}

}  // namespace
}  // namespace drape::compare
