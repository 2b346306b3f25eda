// SPDX-License-Identifier: Apache-2.0
// Checks an export with COLMAP itself: it projects points with the cameras it read and drops each
// observation that is more than a millionth of a pixel from this project's projection.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <sstream>

#include "calib/exchange/exchange.hpp"
#include "calib/test_exchange.hpp"
#include "core/files/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::calib {
namespace {

namespace fs = std::filesystem;

/// images.txt with the points' pixels in its empty lines; COLMAP's pixel centres are at 0.5. The
/// last point's pixel in the last image is moved by `shift_px`.
std::string with_observations(const std::string& images, const Calibration& calibration,
                              double shift_px) {
  const auto points = test::points_of_a_drape();
  std::istringstream lines(images);
  std::string text, line;
  std::size_t image = 0;
  while (std::getline(lines, line)) {
    if (line.empty()) continue;
    text += line + "\n";
    if (line.starts_with('#')) continue;
    const Camera& camera = calibration.cameras.at(image++).camera;
    for (std::size_t i = 0; i < points.size(); ++i) {
      Eigen::Vector2d px = project(camera.model, camera.cam_from_world * points[i])->px;
      if (image == calibration.cameras.size() && i + 1 == points.size()) px.x() += shift_px;
      text += fmt::format("{:.17g} {:.17g} {} ", px.x() + 0.5, px.y() + 0.5, i + 1);
    }
    text += "\n";
  }
  return text;
}

std::string points_file() {
  std::string text;
  int id = 0;
  for (const Eigen::Vector3d& point : test::points_of_a_drape()) {
    text += fmt::format("{} {:.17g} {:.17g} {:.17g} 0 0 0 0 1 {} 2 {} 3 {}\n", id + 1, point.x(),
                        point.y(), point.z(), id, id, id);
    ++id;
  }
  return text;
}

/// Output of COLMAP after dropping all observations that are off by more than 1e-6 px.
std::string filtered(double shift_px) {
  const test::TemporaryFolder folder;
  const Calibration calibration = test::bench1_calibration(false);
  fs::create_directories(folder.path() / "out");
  for (const ExportedFile& file :
       export_calibration(calibration, ExchangeFormat::colmap, {}).files) {
    write_durable(folder.path() / "in" / file.name,
                  file.name == "images.txt" ? with_observations(file.text, calibration, shift_px)
                  : file.name == "points3D.txt" ? points_file()
                                                : file.text);
  }
  const test::Outcome outcome =
      test::run_line(fmt::format("colmap point_filtering --input_path {0}/in --output_path {0}/out "
                                 "--max_reproj_error 1e-6 --min_tri_angle 1",
                                 folder.path().string()));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.text;
  return outcome.text;
}

TEST(Exchange, ColmapProjectsAlikeToAMillionthOfAPixel) {
  if (std::system("colmap help >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "COLMAP is missing: install the Debian package colmap";
  EXPECT_NE(filtered(0).find("Filtered observations: 0"), std::string::npos) << filtered(0);
  EXPECT_NE(filtered(1e-5).find("Filtered observations: 1"), std::string::npos) << filtered(1e-5);
}

}  // namespace
}  // namespace drape::calib
