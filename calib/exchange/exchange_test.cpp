// SPDX-License-Identifier: Apache-2.0
#include "calib/exchange/exchange.hpp"

#include <gmock/gmock.h>
#include <sys/wait.h>

#include <Eigen/Geometry>
#include <cstdio>
#include <cstdlib>
#include <sstream>

#ifdef DRAPE_HAS_OPENCV_CALIB3D
#include <opencv2/calib3d.hpp>
#endif

#include "calib/test_exchange.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"
#include "tests/support/paths.hpp"

namespace drape::calib {
namespace {

namespace fs = std::filesystem;
using test::bench1_calibration;
using test::points_of_a_drape;
using testing::AllOf;
using testing::HasSubstr;

double largest_difference_px(const Camera& a, const Camera& b) {
  double worst = 0;
  for (const Eigen::Vector3d& point : points_of_a_drape()) {
    worst = std::max(worst, (project(a.model, a.cam_from_world * point)->px -
                             project(b.model, b.cam_from_world * point)->px)
                                .norm());
  }
  return worst;
}

std::vector<fs::path> written(const ExportResult& result, const fs::path& folder) {
  std::vector<fs::path> files;
  for (const ExportedFile& file : result.files) {
    files.push_back(folder / file.name);
    write_durable(files.back(), file.text);
  }
  return files;
}

TEST(Exchange, ABrownLensGoesOutAndComesBackUnchanged) {
  const test::TemporaryFolder folder;
  const Calibration out = bench1_calibration(false);
  for (const ExchangeFormat format : {ExchangeFormat::opencv, ExchangeFormat::mrcal}) {
    const ExportResult exported = export_calibration(out, format, {});
    const Calibration in = import_calibration(written(exported, folder.path()), format, "bench1");
    ASSERT_EQ(in.cameras.size(), 3U);
    EXPECT_EQ(in.method, "imported");
    EXPECT_FALSE(in.warnings.empty());
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(in.cameras[i].camera.name, out.cameras[i].camera.name);
      EXPECT_EQ(in.cameras[i].camera.model.width_px, 1600);
      EXPECT_EQ(exported.refits[i].max_px, 0);
      // Numbers are written with all digits; a rotation vector loses the last few.
      EXPECT_LT(largest_difference_px(in.cameras[i].camera, out.cameras[i].camera), 1e-9);
    }
    // An imported calibration must be valid like any other.
    write_calibration(folder.path() / "calibration.json", in);
    EXPECT_EQ(read_calibration(folder.path() / "calibration.json").cameras.size(), 3U);
  }
}

TEST(Exchange, TsaisLensIsRefittedOverTheImageAndSaysHowWell) {
  const test::TemporaryFolder folder;
  const Calibration out = bench1_calibration(true);
  const ExportResult exported = export_calibration(out, ExchangeFormat::opencv, {});
  const Calibration in =
      import_calibration(written(exported, folder.path()), ExchangeFormat::opencv, "bench1");
  for (int i = 0; i < 3; ++i) {
    EXPECT_GT(exported.refits[i].points, 1000);
    EXPECT_GT(exported.refits[i].max_px, 0);
    EXPECT_LE(exported.refits[i].max_px, 0.01);
    EXPECT_LE(largest_difference_px(in.cameras[i].camera, out.cameras[i].camera),
              exported.refits[i].max_px);
    std::printf("%s: Tsai as Brown, RMS %.2e px, at most %.2e px\n",
                out.cameras[i].camera.name.c_str(), exported.refits[i].rms_px,
                exported.refits[i].max_px);
  }
}

TEST(Exchange, ALensThatAFormatCannotHoldIsRefused) {
  Calibration strong = bench1_calibration(false);
  std::get<BrownLens>(strong.cameras[1].camera.model.lens).k3 = 8;
  try {
    static_cast<void>(export_calibration(strong, ExchangeFormat::kalibr, {}));
    FAIL() << "radtan has no k3";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(),
                AllOf(HasSubstr("cam1"), HasSubstr("px"), HasSubstr("--max-refit-px")));
  }
  ExportOptions loose;
  loose.max_refit_px = 100;
  EXPECT_GT(export_calibration(strong, ExchangeFormat::kalibr, loose).refits[1].max_px, 0.01);
}

TEST(Exchange, ANoGoCalibrationIsNotWrittenForOthers) {
  Calibration bad = bench1_calibration(false);
  bad.no_go = "cam1 misses by 3 px";
  try {
    (void)export_calibration(bad, ExchangeFormat::opencv, {});
    FAIL() << "written";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("NO-GO: cam1 misses by 3 px"));
  }
}

/// Projection as documented by COLMAP and Kalibr: Brown's terms, pixel centres as given.
Eigen::Vector2d by_the_document(const std::vector<double>& p, const Eigen::Vector3d& in_camera) {
  const double x = in_camera.x() / in_camera.z(), y = in_camera.y() / in_camera.z();
  const double r2 = x * x + y * y, k3 = p.size() > 8 ? p[8] : 0;
  const double radial = 1 + r2 * (p[4] + r2 * (p[5] + r2 * k3));
  return {p[0] * (x * radial + 2 * p[6] * x * y + p[7] * (r2 + 2 * x * x)) + p[2],
          p[1] * (y * radial + 2 * p[7] * x * y + p[6] * (r2 + 2 * y * y)) + p[3]};
}

TEST(Exchange, ColmapsFilesProjectTheWorkedPoint) {
  const Calibration out = bench1_calibration(false);
  const ExportResult exported = export_calibration(out, ExchangeFormat::colmap, {});
  ASSERT_EQ(exported.files.size(), 3U);
  std::istringstream lenses(exported.files[0].text), images(exported.files[1].text);
  std::string line;
  std::getline(lenses, line);
  std::getline(images, line);
  for (int i = 0; i < 3; ++i) {
    int id = 0, width = 0, height = 0;
    std::string model, name;
    std::vector<double> p(12);
    lenses >> id >> model >> width >> height;
    EXPECT_EQ(model, "FULL_OPENCV");
    EXPECT_EQ(width, 1600);
    for (double& value : p) lenses >> value;
    std::vector<double> pose(7);
    images >> id;
    for (double& value : pose) images >> value;
    images >> id >> name;
    EXPECT_EQ(id, i + 1);
    EXPECT_EQ(name, out.cameras[i].camera.name + ".png");
    const Eigen::Quaterniond q(pose[0], pose[1], pose[2], pose[3]);
    const WorkedPoint& worked = out.cameras[i].worked_point;
    const Eigen::Vector3d in_camera =
        q * worked.point_in_world + Eigen::Vector3d(pose[4], pose[5], pose[6]);
    EXPECT_EQ(p[9] + p[10] + p[11], 0);
    EXPECT_LT((by_the_document(p, in_camera) - worked.px - Eigen::Vector2d(0.5, 0.5)).norm(), 1e-9);
  }
}

/// The numbers in brackets after a key.
std::vector<double> after(const std::string& text, const std::string& key, std::size_t from) {
  std::size_t at = text.find('[', text.find(key, from));
  std::vector<double> values;
  for (; text[at] == '[' || text[at] == ','; at = text.find_first_of(",]", at + 1))
    values.push_back(std::atof(text.c_str() + at + 1));
  return values;
}

TEST(Exchange, KalibrsChainProjectsTheWorkedPointThroughEveryCamera) {
  Calibration out = bench1_calibration(false);
  for (CalibratedCamera& camera : out.cameras) {
    std::get<BrownLens>(camera.camera.model.lens).k3 = 0;
    camera = test::calibrated_camera(camera.camera);
  }
  const std::string text = export_calibration(out, ExchangeFormat::kalibr, {}).files.at(0).text;
  const Eigen::Vector3d world = out.cameras[0].worked_point.point_in_world;
  Eigen::Vector3d in_camera = out.cameras[0].camera.cam_from_world * world;
  for (int i = 0; i < 3; ++i) {
    const std::size_t from = text.find("cam" + std::to_string(i) + ":");
    ASSERT_NE(from, std::string::npos);
    if (i > 0) {
      const std::size_t chain = text.find("T_cn_cnm1:", from);
      std::size_t row_at = chain;
      Eigen::Vector3d next;
      for (int row = 0; row < 3; ++row) {
        row_at = text.find("  - [", row_at + 1);
        const auto r = after(text, "  - ", row_at);
        ASSERT_EQ(r.size(), 4U);
        next[row] = r[0] * in_camera.x() + r[1] * in_camera.y() + r[2] * in_camera.z() + r[3];
      }
      in_camera = next;
    }
    std::vector<double> p = after(text, "intrinsics:", from);
    for (const double k : after(text, "distortion_coeffs:", from)) p.push_back(k);
    ASSERT_EQ(p.size(), 8U);
    EXPECT_LT((by_the_document(p, in_camera) - out.cameras[i].worked_point.px).norm(), 1e-9);
  }
}

TEST(Exchange, OpenCVProjectsTheWorkedPointsAlike) {
#ifdef DRAPE_HAS_OPENCV_CALIB3D
  const test::TemporaryFolder folder;
  const Calibration out = bench1_calibration(false);
  const auto files = written(export_calibration(out, ExchangeFormat::opencv, {}), folder.path());
  for (int i = 0; i < 3; ++i) {
    const cv::FileStorage file(files[i].string(), cv::FileStorage::READ);
    cv::Mat k, d, rotation, translation, turn, px;
    file["camera_matrix"] >> k;
    file["distortion_coefficients"] >> d;
    file["cam_from_world_rotation"] >> rotation;
    file["cam_from_world_translation_m"] >> translation;
    cv::Rodrigues(rotation, turn);
    const Eigen::Vector3d& p = out.cameras[i].worked_point.point_in_world;
    cv::projectPoints(std::vector<cv::Point3d>{{p.x(), p.y(), p.z()}}, turn, translation, k, d, px);
    const Eigen::Vector2d theirs(px.at<double>(0), px.at<double>(1));
    EXPECT_LT((theirs - out.cameras[i].worked_point.px).norm(), 1e-9);
  }
#else
  GTEST_SKIP() << "OpenCV's calib3d is not installed (libopencv-calib3d-dev)";
#endif
}

TEST(Exchange, MrcalProjectsTheWorkedPointsAlike) {
  if (std::system("/usr/bin/python3 -c 'import mrcal' >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "mrcal is not installed (python3-mrcal)";
  const test::TemporaryFolder folder;
  const Calibration out = bench1_calibration(false);
  const auto files = written(export_calibration(out, ExchangeFormat::mrcal, {}), folder.path());
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d& p = out.cameras[i].worked_point.point_in_world;
    std::ostringstream line;
    line.precision(17);
    line << "/usr/bin/python3 -c \"import mrcal,numpy; m=mrcal.cameramodel('" << files[i].string()
         << "'); q=mrcal.project(mrcal.transform_point_rt(m.extrinsics_rt_fromref(),numpy.array(("
         << p.x() << "," << p.y() << "," << p.z()
         << "))),*m.intrinsics()); print('%.12f %.12f' % (q[0],q[1]))\"";
    FILE* pipe = ::popen(line.str().c_str(), "r");
    ASSERT_NE(pipe, nullptr);
    double u = 0, v = 0;
    EXPECT_EQ(std::fscanf(pipe, "%lf %lf", &u, &v), 2);
    EXPECT_EQ(::pclose(pipe), 0);
    EXPECT_LT((Eigen::Vector2d(u, v) - out.cameras[i].worked_point.px).norm(), 1e-9);
  }
}

std::string refusal(const std::string& name, const std::string& text, ExchangeFormat format) {
  const test::TemporaryFolder folder;
  write_durable(folder.path() / name, text);
  try {
    static_cast<void>(import_camera(folder.path() / name, format));
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    return error.what();
  }
  return "";
}

TEST(Exchange, ForeignFilesAreReadOrRefusedByName) {
  // As mrcal writes it: recent name of the pose, more entries than needed, nested ones among them.
  const std::string model =
      "{ 'lensmodel': 'LENSMODEL_OPENCV4', # k1 k2 p1 p2\n 'intrinsics': [ 900., 901., 320, 240, "
      "-0.1, 0.02, 0, 1e-4,],\n 'rt_cam_ref': [0, 0, 0.1, 0, 0, 1,],\n"
      "'valid_intrinsics_region': [[ 1, 2 ], [3, 4]],\n 'imagersize': [ 640, 480,] }\n";
  EXPECT_EQ(refusal("left.cameramodel", model, ExchangeFormat::mrcal), "");
  const auto spoiled = [&](const std::string& from, const std::string& to) {
    std::string text = model;
    return refusal("left.cameramodel", text.replace(text.find(from), from.size(), to),
                   ExchangeFormat::mrcal);
  };
  EXPECT_THAT(spoiled("LENSMODEL_OPENCV4", "LENSMODEL_OPENCV8"), HasSubstr("LENSMODEL_OPENCV8"));
  EXPECT_THAT(spoiled("1e-4", "nan"), HasSubstr("not finite"));
  EXPECT_THAT(spoiled("-0.1, ", ""), HasSubstr("7 numbers where 8 belong"));
  EXPECT_THAT(spoiled("rt_cam_ref", "rt_ref_cam"), HasSubstr("lacks this entry"));
  EXPECT_THAT(spoiled("640", "0"), HasSubstr("no size"));
  EXPECT_THAT(refusal("a.cameramodel", "no model", ExchangeFormat::mrcal), HasSubstr("mrcal"));

  const std::string ros =
      "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix:\n   rows: 3\n   cols: "
      "3\n"
      "   data: [ 900., 0., 320., 0., 901., 240., 0., 0., 1. ]\ndistortion_coefficients:\n   rows: "
      "1\n"
      "   cols: 5\n   data: [ -0.1, 0.02, 0., 0., 0. ]\nrvec: { data: [ 0., 0., 0.1 ] }\n"
      "tvec: { data: [ 0., 0., 1. ] }\n";
  EXPECT_EQ(refusal("right.yaml", ros, ExchangeFormat::opencv), "");
  EXPECT_THAT(refusal("right.yaml", ros.substr(0, ros.find("rvec")), ExchangeFormat::opencv),
              HasSubstr("no pose"));
  EXPECT_THAT(refusal("right.yaml", "not yaml: [", ExchangeFormat::opencv),
              HasSubstr("OpenCV cannot read"));
  EXPECT_EQ(refusal("right.yaml", ros.substr(ros.find("image")), ExchangeFormat::opencv), "");
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = ros;
    return refusal("right.yaml", text.replace(text.find(from), from.size(), to),
                   ExchangeFormat::opencv);
  };
  const std::string lens = "distortion_coefficients:";
  EXPECT_THAT(changed(lens, "distortion_model: equidistant\n" + lens), HasSubstr("equidistant"));
  EXPECT_EQ(changed(lens, "distortion_model: plumb_bob\n" + lens), "");
  EXPECT_THAT(changed(lens, "fisheye_model: 1\n" + lens), HasSubstr("fisheye_model"));
  EXPECT_EQ(changed(lens, "fisheye_model: 0\n" + lens), "");
  EXPECT_THAT(changed("320., 0., 901., 240., 0., 0., 1.", "0., 0., 901., 0., 320., 240., 1."),
              HasSubstr("MATLAB's transpose"));
  EXPECT_THAT(changed("0., 0., 1. ]\ndist", "0., 0., 0. ]\ndist"), HasSubstr("last element"));
}

}  // namespace
}  // namespace drape::calib
