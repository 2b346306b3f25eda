// SPDX-License-Identifier: Apache-2.0
#include "calib/exchange/exchange.hpp"

#include <gmock/gmock.h>
#include <sys/wait.h>

#include <Eigen/Geometry>
#include <cstdio>
#include <cstdlib>
#include <functional>
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
using test::dice_text;
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

TEST(Exchange, EveryFormatComesBackUnchanged) {
  const test::TemporaryFolder folder;
  Calibration out = bench1_calibration(false);
  for (CalibratedCamera& camera : out.cameras) {
    std::get<BrownLens>(camera.camera.model.lens).k3 = 0;  // radtan has none
    camera = test::calibrated_camera(camera.camera);
  }
  for (const ExchangeFormat format :
       {ExchangeFormat::ros, ExchangeFormat::dice, ExchangeFormat::kalibr, ExchangeFormat::colmap,
        ExchangeFormat::matlab}) {
    SCOPED_TRACE(std::string(name_of(format)));
    Calibration given = out;
    if (format == ExchangeFormat::matlab) given.cameras.pop_back();
    auto files = written(export_calibration(given, format, {}), folder.path() / name_of(format));
    if (format == ExchangeFormat::colmap) files.resize(1);
    ImportOptions options;
    if (format == ExchangeFormat::colmap) options.unit_m = 1;
    const Calibration in = import_calibration(files, format, "bench1", options);
    ASSERT_EQ(in.cameras.size(), given.cameras.size());
    // Kalibr and MATLAB know the cameras' places to each other alone.
    const CamFromWorld& first = in.cameras[0].camera.cam_from_world;
    const bool lost = format == ExchangeFormat::kalibr || format == ExchangeFormat::matlab;
    EXPECT_EQ(in.warnings.size(), lost ? 2U : 1U);
    for (std::size_t i = 0; i < in.cameras.size(); ++i) {
      Camera camera = in.cameras[i].camera;
      if (format != ExchangeFormat::matlab) {
        EXPECT_EQ(camera.name, given.cameras[i].camera.name);
      }
      if (lost) {
        EXPECT_TRUE(first.translation_m.isZero());
        const CamFromWorld& world = given.cameras[0].camera.cam_from_world;
        camera.cam_from_world.translation_m += camera.cam_from_world.rotation * world.translation_m;
        camera.cam_from_world.rotation = camera.cam_from_world.rotation * world.rotation;
      }
      EXPECT_LT(largest_difference_px(camera, given.cameras[i].camera), 1e-8);
    }
  }
}

/// Reads one file's text; empty, or why it is refused.
std::string refusal(const std::string& name, const std::string& text, ExchangeFormat format,
                    const ImportOptions& options = {}) {
  const test::TemporaryFolder folder;
  write_durable(folder.path() / name, text);
  try {
    static_cast<void>(import_cameras(folder.path() / name, format, options));
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    EXPECT_EQ(error.where().file, (folder.path() / name).string()) << error.what();
    EXPECT_FALSE(error.what_to_do().empty());
    return error.what();
  }
  return "";
}

/// The text with its first `from` replaced.
std::string with(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(Exchange, PythonsLiteralsOfMrcalAreRead) {
  const std::string model =
      "# mrcal\n{ 'lensmodel': 'LENSMODEL_' \"OPENCV4\", # k1 k2 p1 p2\n 'intrinsics': ( 900., "
      "+9.01e2, 320, 2_40, -.1, 0.02, 0, 1e-4,),\n 'rt_cam_ref': [0, 0, 0.1, 0, 0, 1,],\n"
      "'valid_intrinsics_region': [[ 1, 2 ], [3, 4]],\n 'optimization_inputs': b'a\\'b{',\n"
      "'icam_intrinsics': None, 'imagersize': [ 640, 480,] }\n";
  const auto read = [&](const std::string& from, const std::string& to) {
    return refusal("left.cameramodel", with(model, from, to), ExchangeFormat::mrcal);
  };
  EXPECT_EQ(read("{", "{"), "");
  EXPECT_EQ(read("rt_cam_ref", "extrinsics"), "");
  EXPECT_EQ(read("'LENSMODEL_' \"OPENCV4\"", "r'''LENSMODEL_OPENCV4'''"), "");
  EXPECT_THAT(read("OPENCV4", "OPENCV8"), HasSubstr("LENSMODEL_OPENCV8"));
  EXPECT_THAT(read("OPENCV4", "CAHVOR"), HasSubstr("LENSMODEL_CAHVOR"));
  EXPECT_THAT(read("1e-4", "nan"), HasSubstr("finite number"));
  EXPECT_THAT(read("-.1, ", ""), HasSubstr("7 numbers where 8 belong"));
  EXPECT_THAT(read("rt_cam_ref", "rt_ref_cam"), HasSubstr("rt_ref_cam"));
  EXPECT_THAT(read("'icam_intrinsics': None", "'extrinsics': [0,0,0,0,0,0]"),
              HasSubstr("two poses"));
  EXPECT_THAT(read("0, 0, 1,]", "0, 1,]"), HasSubstr("six numbers"));
  EXPECT_THAT(read("640", "0"), HasSubstr("imagersize"));
  EXPECT_THAT(read("640, ", "640 "), HasSubstr("comma"));
  EXPECT_THAT(read("640", "640px"), HasSubstr("`640px` is no value"));
  EXPECT_THAT(refusal("a.cameramodel", "no model", ExchangeFormat::mrcal), HasSubstr("literal"));
  EXPECT_THAT(refusal("a.cameramodel", std::string(1000, '['), ExchangeFormat::mrcal),
              HasSubstr("nested too deeply"));
}

const std::string kRos =
    "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_name: right\ncamera_matrix:\n"
    "   rows: 3\n   cols: 3\n"
    "   data: [ 900., 0., 320., 0., 901., 240., 0., 0., 1. ]\ndistortion_coefficients:\n   rows: "
    "1\n"
    "   cols: 5\n   data: [ -0.1, 0.02, 0., 0., 0. ]\nrvec: { data: [ 0., 0., 0.1 ] }\n"
    "tvec: { data: [ 0., 0., 1. ] }\n";

TEST(Exchange, FilesOfOpenCVAndRosAreReadOrRefusedByName) {
  const auto read = [&](const std::string& from, const std::string& to) {
    return refusal("right.yaml", with(kRos, from, to), ExchangeFormat::opencv);
  };
  const std::string lens = "distortion_coefficients:";
  EXPECT_EQ(read("%YAML:1.0\n---\n", ""), "");
  EXPECT_EQ(read(lens, "distortion_model: plumb_bob\n" + lens), "");
  EXPECT_EQ(read(lens, "fisheye_model: 0\nflags: 0\nroi:\n  x_offset: 0\n" + lens), "");
  // The lens is the cause, whatever else looks wrong.
  for (const char* other : {"equidistant", "fisheye", "fov", "thin_prism"})
    EXPECT_THAT(read(lens, std::string("distortion_model: ") + other + "\n" + lens),
                HasSubstr(std::string("`") + other + "`"));
  EXPECT_THAT(read(lens, "fisheye_model: 1\n" + lens), HasSubstr("fisheye_model"));
  EXPECT_THAT(read(lens, "xi: 0.8\n" + lens), HasSubstr("xi"));
  EXPECT_THAT(read(lens, "camera_model: omni\n" + lens), HasSubstr("omni"));
  EXPECT_THAT(read(lens, "lens_type: sphere\n" + lens), HasSubstr("unknown key `lens_type`"));
  EXPECT_THAT(read(lens, "binning_x: 2\n" + lens), HasSubstr("binned"));
  EXPECT_THAT(read(lens, "image_width: 320\n" + lens), HasSubstr("`image_width` is given twice"));
  EXPECT_THAT(read("640", "4294967936"), HasSubstr("image_width"));  // 2^32 + 640
  EXPECT_EQ(read(lens, "calibration_time: \"20231122101112\"\n" + lens), "");
  EXPECT_THAT(read("901.", "0.9"), HasSubstr("fx is 900 px and fy 0.9 px"));
  EXPECT_THAT(read("320.", "3200."), HasSubstr("image centre (3200, 240) lies far outside"));
  EXPECT_THAT(read(lens, "roi:\n  x_offset: 8\n" + lens), HasSubstr("cut out"));
  EXPECT_THAT(read("0., 0., 0. ]\nrvec", "0., 0., 0., 0.01, 0., 0. ]\nrvec"),
              HasSubstr("rows times columns"));
  EXPECT_THAT(refusal("right.yaml",
                      with(with(kRos, "cols: 5", "cols: 8"), "0., 0., 0. ]\nrvec",
                           "0., 0., 0., 0.01, 0., 0. ]\nrvec"),
                      ExchangeFormat::opencv),
              HasSubstr("five terms"));
  EXPECT_THAT(read("320., 0., 901., 240., 0., 0., 1.", "0., 0., 901., 0., 320., 240., 1."),
              HasSubstr("MATLAB's transpose"));
  EXPECT_THAT(read("0., 0., 1. ]\ndist", "0., 0., 0. ]\ndist"), HasSubstr("last element"));
  EXPECT_THAT(read("900., 0.,", "900., 2.,"), HasSubstr("skewed"));
  EXPECT_THAT(read("901.", ".Nan"), HasSubstr("finite number"));
  EXPECT_THAT(read("901.", "-901."), HasSubstr("focal length"));
  EXPECT_THAT(read("rvec: { data: [ 0., 0., 0.1 ] }\n", ""), HasSubstr("no pose"));
  const std::string pose = "cam_from_world_rotation: { data: [ ",
                    rvec = "rvec: { data: [ 0., 0., 0.1";
  EXPECT_EQ(read(rvec, pose + "0.995004, -0.0998334, 0, 0.0998334, 0.995004, 0, 0, 0, 1"), "")
      << "rounded to six digits";
  EXPECT_THAT(read(rvec, pose + "0.995, -0.11, 0, 0.0998, 0.995, 0, 0, 0, 1"),
              HasSubstr("not a rotation"));
  EXPECT_THAT(read(rvec, pose + "1, 0, 0, 0, 1, 0, 0, 0, -1"), HasSubstr("not a rotation"));
  EXPECT_THAT(read(rvec, pose + "1, 0, 0, 0, 1, 0, 0, 0, 1 ] }\n" + rvec), HasSubstr("two poses"));
  EXPECT_THAT(refusal("right.yaml", "not yaml: [", ExchangeFormat::opencv), HasSubstr("not YAML"));
  // A number that would wrap, of another base, or of no bench; a key given twice.
  EXPECT_THAT(read("image_width: 640", "image_width: 0x10"), HasSubstr("whole number"));
  EXPECT_THAT(read("image_width: 640", "image_width: 640.5"), HasSubstr("whole number"));
  EXPECT_THAT(read("901.", "901000."), HasSubstr("focal length"));
  EXPECT_THAT(read("-0.1, 0.02", "1e99, 0.02"), HasSubstr("number up to"));
  EXPECT_THAT(read("-0.1, 0.02", "1e6, 0.02"), HasSubstr("distortion"));
  EXPECT_THAT(read("tvec: { data: [ 0., 0., 1.", "tvec: { data: [ 0., 0., 1000."),
              HasSubstr("farther away than 100 m"));
  EXPECT_THAT(read("0., 0., 0.1 ]", "0., 0., 10. ]"), HasSubstr("more than a whole turn"));
}

TEST(Exchange, ACalibrationsNamesAndCentresMustBeThoseOfItsCameras) {
  const test::TemporaryFolder folder;
  Calibration calibration = bench1_calibration(false);
  CalibratedCamera& camera = calibration.cameras[0];
  camera.covariance_parameters = parameter_names(camera.camera.model);
  const auto size = static_cast<Eigen::Index>(camera.covariance_parameters.size());
  camera.covariance = Eigen::MatrixXd::Identity(size, size);
  calibration.joint_covariance_parameters = {"cam0/fx_px", "cam1/k1"};
  calibration.joint_covariance = Eigen::Matrix2d::Identity();
  const auto refusal_of = [&](const std::function<void(Calibration&)>& change) -> std::string {
    Calibration changed = calibration;
    change(changed);
    write_calibration(folder.path() / "calibration.json", changed);
    try {
      static_cast<void>(read_calibration(folder.path() / "calibration.json"));
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal_of([](Calibration&) {}), "");
  EXPECT_THAT(
      refusal_of([](Calibration& c) { std::ranges::reverse(c.cameras[0].covariance_parameters); }),
      HasSubstr("in their order"));
  EXPECT_THAT(refusal_of([](Calibration& c) { c.joint_covariance_parameters[1] = "cam7/k1"; }),
              HasSubstr("none of a camera"));
  EXPECT_THAT(refusal_of([](Calibration& c) { c.joint_covariance_parameters[1] = "cam0/fx_px"; }),
              HasSubstr("twice"));
  EXPECT_THAT(refusal_of([](Calibration& c) { c.cameras[1].camera.name = "cam0"; }),
              HasSubstr("two cameras have one name"));
  std::string text = text_of(calibration);
  text.insert(text.find("[", text.find("centre_in_world_mm")) + 1, "1");
  write_durable(folder.path() / "calibration.json", text);
  EXPECT_THROW((void)read_calibration(folder.path() / "calibration.json"), Error);
}

TEST(Exchange, ChainsOfKalibrAreReadOrRefusedByName) {
  const std::string chain =
      "cam0:\n  cam_overlaps: [1]\n  camera_model: pinhole\n  distortion_coeffs: [-0.2, 0.1, 0, "
      "1e-4]\n  distortion_model: radtan\n  intrinsics: [461, 460, 363, 248]\n"
      "  resolution: [752, 480]\n  rostopic: /left/image_raw\ncam1:\n  T_cn_cnm1:\n"
      "  - [1.0, 0.0, 0.0, -0.11]\n  - [0.0, 1.0, 0.0, 0.0]\n  - [0.0, 0.0, 1.0, 0.0]\n"
      "  - [0.0, 0.0, 0.0, 1.0]\n  cam_overlaps: [0]\n  camera_model: pinhole\n"
      "  distortion_coeffs: []\n  distortion_model: none\n  intrinsics: [461, 460, 363, 248]\n"
      "  resolution: [752, 480]\n  rostopic: /right/image_raw\n";
  const auto read = [&](const std::string& from, const std::string& to) {
    return refusal("camchain.yaml", with(chain, from, to), ExchangeFormat::kalibr);
  };
  EXPECT_EQ(read("cam0", "cam0"), "");
  for (const char* other : {"equidistant", "equi", "fov"})
    EXPECT_THAT(read("radtan", other), HasSubstr(std::string("`") + other + "`"));
  for (const char* other : {"omni", "ds", "eucm"})
    EXPECT_THAT(read("pinhole", other), HasSubstr(std::string("`") + other + "`"));
  EXPECT_THAT(read("0.0, 1.0]\n  cam_over", "0.5, 1.0]\n  cam_over"), HasSubstr("last row"));
  EXPECT_THAT(read("[1.0, 0.0, 0.0, -0.11]", "[1.0, 0.1, 0.0, -0.11]"),
              HasSubstr("not a rotation"));
  EXPECT_THAT(read("cam1", "cam2"), HasSubstr("in order"));
  EXPECT_THAT(read("rostopic", "line_delay: 1.0e-5\n  rostopic"), HasSubstr("line_delay"));
  EXPECT_THAT(read("rostopic", "shutter: rolling\n  rostopic"), HasSubstr("unknown key"));
  EXPECT_THAT(read("461, 460", "461"), HasSubstr("fx, fy, cx, cy"));
  EXPECT_THAT(read("-0.2, ", ""), HasSubstr("k1, k2, p1, p2"));
  EXPECT_THAT(read("distortion_coeffs: []", "distortion_coeffs: [0.1, 0, 0, 0]"),
              HasSubstr("coefficients of no distortion model"));
}

TEST(Exchange, CalibrationsOfDiceAreReadOrRefusedByName) {
  const test::TemporaryFolder folder;
  write_durable(folder.path() / "cal.xml", dice_text);
  const auto cameras = import_cameras(folder.path() / "cal.xml", ExchangeFormat::dice);
  ASSERT_EQ(cameras.size(), 2U);
  EXPECT_EQ(cameras[1].camera.model.width_px, 1920);
  const CamFromWorld& pose = cameras[1].camera.cam_from_world;
  EXPECT_NEAR(pose.translation_m.norm(), 0.12353, 1e-5);
  EXPECT_NEAR(pose.rotation(2, 0), std::sin(19.0676936 * units::deg), 1e-9);  // -sin(beta)
  const auto read = [&](const std::string& from, const std::string& to) {
    return refusal("cal.xml", with(dice_text, from, to), ExchangeFormat::dice);
  };
  for (const char* other : {"VIC3D_LENS_DISTORTION", "K1R1_K2R2_K3R3", "K1R3_K2R5_K3R7"})
    EXPECT_THAT(read("OPENCV_LENS_DISTORTION", other), HasSubstr(other));
  EXPECT_THAT(read("LENS_DISTORTION_MODEL", "LENS"), HasSubstr("no lens is named"));
  EXPECT_THAT(read("\"K1\"", "\"K4\""), HasSubstr("K4"));
  EXPECT_THAT(read("\"K1\"", "\"FS\""), HasSubstr("FS"));
  EXPECT_THAT(read("\"K1\"", "\"K7\""), HasSubstr("unknown key"));
  EXPECT_THAT(read("0.021682", "0.02x"), HasSubstr("no double"));
  EXPECT_THAT(read("{ 1200, 1920 }", "1920 px"), HasSubstr("is not 2 numbers"));
  EXPECT_THAT(read("DICe_xml_camera_system_file", "DICe"), HasSubstr("no camera system"));
  EXPECT_THAT(read("<ParameterList>", "<Lists>"), HasSubstr("no ParameterList"));
  EXPECT_THAT(read(R"(<Parameter name="TZ")",
                   R"(<ParameterList name="rotation_3x3_matrix"/><Parameter name="TZ")"),
              HasSubstr("ROW 0"));
}

TEST(Exchange, StereoParamsOfMatlabAreReadOrRefusedByName) {
  const std::string camera =
      R"({"RadialDistortion":[-0.1,0.02],"TangentialDistortion":[0,0],"ImageSize":[480,640],)"
      R"("WorldUnits":"millimeters","EstimateSkew":false,"IntrinsicMatrix":)"
      R"([[900,0,0],[0,901,0],[321,241,1]]})";
  const std::string stereo =
      "{\"CameraParameters1\":" + camera + ",\"CameraParameters2\":" + camera +
      R"(,"RotationOfCamera2":[[0.995004,0.0998334,0],[-0.0998334,0.995004,0],)"
      R"([0,0,1]],"TranslationOfCamera2":[-120,0,3]})";
  const test::TemporaryFolder folder;
  write_durable(folder.path() / "stereo.json", stereo);
  const auto cameras = import_cameras(folder.path() / "stereo.json", ExchangeFormat::matlab);
  // Rows are vectors there: the rotation is the transpose; the first pixel's centre is (1, 1).
  EXPECT_NEAR(cameras.at(1).camera.cam_from_world.rotation(1, 0), 0.0998334, 1e-6);
  EXPECT_NEAR(cameras.at(1).camera.cam_from_world.translation_m.x(), -0.12, 1e-12);
  EXPECT_EQ(std::get<BrownLens>(cameras.at(0).camera.model.lens).cx_px, 320);
  const auto read = [&](const std::string& from, const std::string& to) {
    return refusal("stereo.json", with(stereo, from, to), ExchangeFormat::matlab);
  };
  EXPECT_EQ(read(R"("IntrinsicMatrix":[[900,0,0],[0,901,0],[321,241,1]])",
                 R"("K":[[900,0,321],[0,901,241],[0,0,1]])"),
            "");
  EXPECT_THAT(read("[[900,0,0],[0,901,0],[321,241,1]]", "[[900,0,321],[0,901,241],[0,0,1]]"),
              HasSubstr("transpose"));
  EXPECT_THAT(read("[0,901,0]", "[5,901,0]"), HasSubstr("skewed"));
  EXPECT_THAT(read("millimeters", "feet"), HasSubstr("--unit-mm"));
  EXPECT_THAT(read("RadialDistortion", "FisheyeDistortion"), HasSubstr("FisheyeDistortion"));
  EXPECT_THAT(read("[0.995004,0.0998334,0]", "[0.9,0.0998334,0]"), HasSubstr("not a rotation"));
  EXPECT_THAT(refusal("stereo.txt", "stereoParams = \n\n  stereoParameters with properties:\n",
                      ExchangeFormat::matlab),
              HasSubstr("a display holds no values"));
}

TEST(Exchange, ModelsOfColmapAreReadOrRefusedByName) {
  const test::TemporaryFolder folder;
  const auto read = [&](const std::string& lens, const std::string& pose) -> std::string {
    write_durable(folder.path() / "cameras.txt", "# comment\n1 " + lens + "\n");
    write_durable(folder.path() / "images.txt", "1 " + pose + " 1 left.jpg\n1 2 -1\n");
    try {
      const auto cameras =
          import_cameras(folder.path() / "cameras.txt", ExchangeFormat::colmap, {.unit_m = 1});
      return cameras.at(0).camera.name;
    } catch (const Error& error) {
      return error.what();
    }
  };
  const std::string pose = "1 0 0 0 0 0 1";
  for (const char* lens :
       {"SIMPLE_PINHOLE 640 480 900 320 240", "PINHOLE 640 480 900 901 320 240",
        "SIMPLE_RADIAL 640 480 900 320 240 -0.1", "RADIAL 640 480 900 320 240 -0.1 0.02",
        "OPENCV 640 480 900 901 320 240 -0.1 0.02 0 0",
        "FULL_OPENCV 640 480 900 901 320 240 -0.1 0.02 0 0 0 0 0 0"})
    EXPECT_EQ(read(lens, pose), "left") << lens;
  for (const char* lens : {"OPENCV_FISHEYE", "SIMPLE_RADIAL_FISHEYE", "FOV", "THIN_PRISM_FISHEYE"})
    EXPECT_THAT(read(std::string(lens) + " 640 480 900 901 320 240 0 0 0 0", pose),
                HasSubstr(lens));
  EXPECT_THAT(read("FULL_OPENCV 640 480 900 901 320 240 -0.1 0.02 0 0 0 0.1 0 0", pose),
              HasSubstr("five terms"));
  EXPECT_THAT(read("PINHOLE 640 480 900 320 240", pose), HasSubstr("has 4 numbers, not 3"));
  EXPECT_THAT(read("PINHOLE 640 480 900 nan 320 240", pose), HasSubstr("cameras.txt"));
  EXPECT_THAT(read("PINHOLE 640 480 900 901 320 240", "1 0.1 0 0 0 0 1"), HasSubstr("quaternion"));
  EXPECT_THAT(read("PINHOLE 640 480 900 901 320 240", "0 0 0 0 0 0 1"), HasSubstr("quaternion"));
  EXPECT_THROW((void)import_cameras(folder.path() / "cameras.txt", ExchangeFormat::colmap), Error);
}

}  // namespace
}  // namespace drape::calib
