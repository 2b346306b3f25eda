// SPDX-License-Identifier: Apache-2.0
#include "triangulate/points.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <random>

#include "core/files/files.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"
#include "tests/support/bench1_truth.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/paths.hpp"

namespace drape::triangulate {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d, Eigen::Vector3d;
using testing::HasSubstr;
using units::mm;

constexpr double kSigma_mm = 0.02;

/// bench1's drape C in the columns of DICe: before, the cloth lay flat; the instrument's frame is
/// turned against the world and the cloth.
class Points : public testing::Test {
 protected:
  void SetUp() override {
    scene_ = read_scene(test::source_root() / "rigs/bench1/scenes/C.toml");
    for (const auto& dot : test::bench1_truth().drapes.at("C"))
      truth_mm_.emplace_back(dot.point_in_world / mm);
  }

  /// Material coordinates (mm) of the marks, in the truth's order.
  [[nodiscard]] static Vector2d material_mm(std::size_t i) {
    return {10.0 + 20.0 * static_cast<double>(i / 11), 10.0 + 20.0 * static_cast<double>(i % 11)};
  }
  [[nodiscard]] Vector3d in_file(const Vector3d& world_mm) const {
    return turn_ * world_mm + shift_mm_;
  }
  [[nodiscard]] Vector3d flat_in_file(const Vector2d& material) const {
    return lay_ * Vector3d(material.x(), material.y(), 0) + Vector3d(-300, 20, 700);
  }

  [[nodiscard]] std::string table(unsigned seed) const {
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, kSigma_mm);
    std::string text =
        "SUBSET_ID,COORDINATE_X,COORDINATE_Y,MODEL_COORDINATES_X,MODEL_COORDINATES_Y,"
        "MODEL_COORDINATES_Z,MODEL_DISPLACEMENT_X,MODEL_DISPLACEMENT_Y,MODEL_DISPLACEMENT_Z,SIGMA,"
        "STATUS_FLAG\n";
    for (std::size_t i = 0; i < truth_mm_.size(); ++i) {
      const Vector3d before = flat_in_file(material_mm(i));
      const Vector3d moved =
          in_file(truth_mm_[i]) - before + Vector3d(noise(random), noise(random), noise(random));
      text += fmt::format("{},0,0,{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},0.01,4\n", i,
                          before.x(), before.y(), before.z(), moved.x(), moved.y(), moved.z());
    }
    return text + "121,0,0,0,0,0,0,0,0,-1,-3\n";
  }

  [[nodiscard]] std::string description() const {
    const auto list = [](const auto& v) {
      return v.size() == 2 ? fmt::format("[{}, {}]", v[0], v[1])
                           : fmt::format("[{}, {}, {}]", v[0], v[1], v[2]);
    };
    std::string text = fmt::format("schema = \"drapebench/points/1\"\nsigma_mm = {}\n", kSigma_mm);
    for (const Vector3d& p : {Vector3d(-150, -150, -6), Vector3d(150, -150, -6),
                              Vector3d(150, 150, -6), Vector3d(-150, 150, 90)})
      text += fmt::format("[[point]]\nin_file = {}\nin_world_mm = {}\nuncertainty_mm = 0.01\n",
                          list(in_file(p)), list(p));
    for (const Vector2d& p : {Vector2d(0, 0), Vector2d(220, 0), Vector2d(220, 220)})
      text += fmt::format("[[point]]\nin_file = {}\nat_material_mm = {}\n", list(flat_in_file(p)),
                          list(p));
    return text;
  }

  [[nodiscard]] Sheet sheet_of(const std::string& table, const std::string& toml,
                               PointsReport* report = nullptr) const {
    write_durable(folder_.path() / "cloud.csv", table);
    write_durable(folder_.path() / "points.toml", toml);
    const auto description = read_record<PointsDescription>(folder_.path() / "points.toml");
    PointsReport own;
    return sheet_of_points(read_cloud(folder_.path() / "cloud.csv", description), description,
                           scene_, report != nullptr ? *report : own);
  }

  Scene scene_;
  std::vector<Vector3d> truth_mm_;
  Eigen::Matrix3d turn_ = rotation_about({2.6, 0.4, -0.3}), lay_ = rotation_about({-0.2, 0.5, 1.3});
  Vector3d shift_mm_{40, -25, 640};
  test::TemporaryFolder folder_;
};

TEST_F(Points, TheTruthInDicesColumnsIsMetWithinTheStatedUncertainty) {
  double chi2 = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    PointsReport report;
    const Sheet sheet = sheet_of(table(seed), description(), &report);
    ASSERT_EQ(sheet.marks.size(), 121U);
    EXPECT_EQ(report.direct, 121);
    for (std::size_t i = 0; i < sheet.marks.size(); ++i) {
      const Vector3d off = sheet.marks[i].point_in_world - truth_mm_[i] * mm;
      chi2 += off.dot(sheet.marks[i].covariance_m2->inverse() * off);
    }
    EXPECT_NEAR(sheet.error_budget->detection_m / mm, kSigma_mm * std::sqrt(3.0), 1e-9);
  }
  // 3,630 degrees of freedom: four standard deviations of chi2/dof are 0.094. The stated covariance
  // holds that of the fit too, whose points have no error here: at most a third of 0.02 mm squared.
  EXPECT_GT(chi2 / 3630, 0.75);
  EXPECT_LT(chi2 / 3630, 1.094);
}

TEST_F(Points, CorrelatedErrorsAreCommonToAllMarks) {
  const auto with = [&](double length_mm) {
    std::string text = description();
    text.insert(text.find("sigma_mm"), fmt::format("correlation_mm = {}\n", length_mm));
    return *sheet_of(table(1), text).error_budget;
  };
  const double total_m = std::sqrt(3.0) * kSigma_mm * mm;
  EXPECT_NEAR(with(1e9).calibration_m.value() / total_m, 1, 0.1) << "one error for all";
  EXPECT_LT(with(5).calibration_m.value() / total_m, 0.35);
  EXPECT_LT(with(30).calibration_m.value(), with(100).calibration_m.value());
}

TEST_F(Points, MarksBetweenThePointsLieOnTheSurfaceThroughThem) {
  // A cylinder of 60 mm radius along the weft, sampled each 3 mm, off the marks.
  std::string text = "X_mm,Y_mm,Z_mm,warp_mm,weft_mm\n";
  const auto place = [](double warp, double weft) {
    return Vector3d(60 * std::sin(warp / 60), weft, 60 * std::cos(warp / 60));
  };
  for (double warp = 1; warp < 220; warp += 3)
    for (double weft = 1.5; weft < 150; weft += 3) {
      const Vector3d p = place(warp, weft);
      text += fmt::format("{},{},{},{},{}\n", p.x(), p.y(), p.z(), warp, weft);
    }
  PointsReport report;
  const Sheet sheet = sheet_of(text + "nan,nan,nan,1,1\n",
                               "schema = \"drapebench/points/1\"\nsigma_mm = 0.1\n", &report);
  EXPECT_EQ(report.direct, 0);
  EXPECT_EQ(report.fitted, 77);  // seven of eleven columns lie below 150 mm
  EXPECT_EQ(sheet.gaps.size(), 44U);
  for (const SheetMark& mark : sheet.marks) {
    const Vector3d truth = place(mark.material_m.x() / mm, mark.material_m.y() / mm);
    EXPECT_LT((mark.point_in_world / mm - truth).norm(), 0.005);
  }
}

TEST_F(Points, WhatContradictsOrIsMissingIsRefusedByName) {
  const auto refusal = [&](const std::string& toml, const std::string& text) {
    return std::string(test::error_of([&] { return sheet_of(text, toml); }).what());
  };
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = description();
    return text.replace(text.find(from), from.size(), to);
  };
  EXPECT_THAT(refusal(with("sigma_mm = 0.02", ""), table(1)),
              HasSubstr("how far a point may be off"));
  EXPECT_THAT(refusal(with("in_world_mm = [-150", "in_world_mm = [-140"), table(1)),
              HasSubstr("contradict each other"));
  EXPECT_THAT(refusal(with("sigma_mm", "unit_mm = 100.0\nsigma_mm"), table(1)),
              HasSubstr("contradict each other"));
  EXPECT_THAT(
      refusal(with("at_material_mm = [0, 0]", "in_world_mm = [0, 0, 0]\nat_material_mm = [0, 0]"),
              table(1)),
      HasSubstr("not both"));
  EXPECT_THAT(refusal(description(), "a,b\n1,2\n"), HasSubstr("neither DICe's nor pyALDIC-3D's"));
  EXPECT_THAT(refusal("schema = \"drapebench/points/1\"\nsigma_mm = 0.1\n[columns]\nx = \"a\"\ny = "
                      "\"b\"\nz = \"c\"\n",
                      "a,b\n1,2\n"),
              HasSubstr("`c` is missing"));
  EXPECT_THAT(refusal("schema = \"drapebench/points/1\"\nsigma_mm = 0.1\n",
                      "X_mm,Y_mm,Z_mm\n1,2,3\n4,5,6\n7,8,9\n1,1,1\n"),
              HasSubstr("no point of the cloth is named"));
  const std::string four = "1,2,3,4\n4,5,6,7\n7,8,9,1\n1,1,1,1\n";
  EXPECT_THAT(refusal(description(), "X_mm,Y_mm,Z_mm,warp_mm\n" + four),
              HasSubstr("never one without the other"));
  EXPECT_THAT(refusal(description(), "X_mm,Y_mm,Z_mm,Z_mm\n" + four),
              HasSubstr("two columns are named `Z_mm`"));
}

/// As VTK 9 writes a grid of four points: whole in ASCII, and each array in base64 with its length.
TEST_F(Points, VtuIsReadInEveryEncoding) {
  const auto read = [&](const std::string& attributes, const std::string& points,
                        const std::string& warp, const std::string& format) {
    const auto array = [&](const char* name, int parts, const std::string& data) {
      return fmt::format(
          "<DataArray type=\"Float64\" Name=\"{}\" NumberOfComponents=\"{}\" "
          "format=\"{}\">{}</DataArray>",
          name, parts, format, data);
    };
    write_durable(
        folder_.path() / "cloud.vtu",
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
        "byte_order=\"LittleEndian\" " +
            attributes +
            "><UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"0\"><PointData>" +
            array("warp_mm", 1, warp) + array("weft_mm", 1, warp) + "</PointData><Points>" +
            array("Points", 3, points) + "</Points></Piece></UnstructuredGrid></VTKFile>\n");
    return read_cloud(folder_.path() / "cloud.vtu", {});
  };
  const Cloud ascii =
      read("header_type=\"UInt32\"", "0 0 0 1 0 0 0 1 0 1 1 0.5", "1 2 3 4", "ascii");
  EXPECT_EQ(ascii.points.size(), 4U);
  EXPECT_NEAR(ascii.points[3].z(), 0.5 * mm, 1e-12);
  EXPECT_NEAR(ascii.material_m[2].x(), 3 * mm, 1e-12);
  // Python: base64.b64encode(struct.pack("<I12d", 96, ...)), ("<I4d", 32, 1, 2, 3, 4).
  const Cloud binary = read(
      "header_type=\"UInt32\"",
      "YAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAPA/"
      "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA8D8AAAAAAAAAAAAAAAAAAPA/AAAAAAAA8D8AAAAAAADgPw==",
      "IAAAAAAAAAAAAPA/AAAAAAAAAEAAAAAAAAAIQAAAAAAAABBA", "binary");
  EXPECT_EQ(binary.points[3], ascii.points[3]);
  EXPECT_EQ(binary.material_m[3], ascii.material_m[3]);
  // zlib.compress of the same behind its header of one block: 1, 96, 96, size.
  const Cloud packed = read("header_type=\"UInt32\" compressor=\"vtkZLibDataCompressor\"",
                            "AQAAAGAAAABgAAAAFwAAAA==eJxjYMAHPtjjlcaQh/Fh9AN7AJjjBdw=",
                            "AQAAACAAAAAgAAAAFwAAAA==eJxjYACBD/YMEOAAoTigtIADACXXAgg=", "binary");
  EXPECT_EQ(packed.points[3], ascii.points[3]);
  for (const auto& [points, format] : {std::pair{"1 2 3", "ascii"},
                                       {"1 2 3 4 5 6 7 8 9 10 11 x", "ascii"},
                                       {"YAAAAAAA", "binary"}})
    EXPECT_THROW((void)read("header_type=\"UInt32\"", points, "1 2 3 4", format), Error) << points;
}

}  // namespace
}  // namespace drape::triangulate
