// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <fstream>
#include <opencv2/core.hpp>
#include <sstream>

#include "calib/exchange/exchange.hpp"
#include "calib/test_exchange.hpp"
#include "core/files/files.hpp"
#include "core/files/picture_layout.hpp"
#include "tests/fuzz/kinds.hpp"
#include "triangulate/points.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;
using calib::ExchangeFormat;

std::function<fs::path(const fs::path&)> made(const std::string& name, const std::string& text) {
  return [=](const fs::path& folder) {
    write_durable(folder / name, text);
    return folder / name;
  };
}

std::function<void(const fs::path&)> imported(ExchangeFormat format) {
  return [=](const fs::path& file) {
    const bool is_colmap = format == ExchangeFormat::colmap;
    static_cast<void>(
        calib::import_cameras(is_colmap ? file.parent_path() / "cameras.txt" : file, format,
                              {.unit_m = is_colmap ? std::optional(1.0) : std::nullopt}));
  };
}

/// Writes all files of an export of bench1's cameras and returns the one at `index`.
Kind exported(const std::string& name, ExchangeFormat format, std::size_t index = 0,
              const std::string& free = "$^") {
  return {name,
          [=](const fs::path& folder) {
            Calibration calibration = bench1_calibration(false);
            calibration.cameras.resize(2);  // MATLAB's count
            const auto files =
                calib::export_calibration(calibration, format, {.max_refit_px = 100}).files;
            for (const auto& file : files) write_durable(folder / file.name, file.text);
            return folder / files.at(index).name;
          },
          imported(format), true, free};
}

/// As OpenCV's calibration sample writes it, as XML or JSON.
Kind stored(const std::string& name, const std::string& ending) {
  return {name,
          [=](const fs::path& folder) {
            fs::path file = folder / ("cam0" + ending);
            cv::FileStorage storage(file.string(), cv::FileStorage::WRITE);
            storage << "image_width" << 1600 << "image_height" << 1200;
            storage << "camera_matrix"
                    << cv::Mat(cv::Matx33d(3100, 0, 801.5, 0, 3101, 602.25, 0, 0, 1));
            storage << "distortion_coefficients"
                    << cv::Mat(cv::Matx<double, 5, 1>(-0.1, 0.02, 1e-4, 0, 0.5));
            storage << "rvec" << cv::Mat(cv::Vec3d(2.1, 0.1, -0.2));
            storage << "tvec" << cv::Mat(cv::Vec3d(0.02, -0.01, 0.9));
            return file;
          },
          imported(ExchangeFormat::opencv)};
}

constexpr const char* kMrcal =
    "# mrcal\n{ 'lensmodel': 'LENSMODEL_OPENCV4', # k1 k2 p1 p2\n 'intrinsics': ( 900.,\n 9.01e2,\n"
    " 320,\n 240,\n -.1,\n 0.02,\n 0,\n 1e-4,),\n 'rt_cam_ref': [0, 0, 0.1,\n 0, 0, 1,],\n"
    " 'icam_intrinsics': None,\n 'imagersize': [ 640, 480,] }\n";
constexpr const char* kMatlab =
    "{\"CameraParameters1\":{\n\"RadialDistortion\":[-0.1,0.02],\n\"TangentialDistortion\":[0,0],\n"
    "\"ImageSize\":[480,640],\n\"WorldUnits\":\"millimeters\",\n"
    "\"IntrinsicMatrix\":[[900,0,0],[0,901,0],[321,241,1]]},\n\"CameraParameters2\":{\n"
    "\"RadialDistortion\":[-0.1,0.02],\n\"TangentialDistortion\":[0,0],\n\"ImageSize\":[480,640],\n"
    "\"WorldUnits\":\"millimeters\",\n\"K\":[[900,0,321],[0,901,241],[0,0,1]]},\n"
    "\"RotationOfCamera2\":[[0.995004,0.0998334,0],\n[-0.0998334,0.995004,0],\n[0,0,1]],\n"
    "\"TranslationOfCamera2\":[-120,0,3]}\n";

/// A cell that is empty or no number is a point that the instrument lost.
constexpr const char* kFailed = "dropped|not finite";

Kind cloud(const std::string& name, const std::string& file, const std::string& text,
           const std::string& free) {
  return {name, made(file, text),
          [](const fs::path& f) { static_cast<void>(triangulate::read_cloud(f, {})); }, true, free};
}

std::string table_of_points(const std::string& head, const char* row) {
  std::string text = head + "\n";
  for (int i = 0; i < 9; ++i)
    text += fmt::format(fmt::runtime(row), 10.5 * (i % 3), 11.5 * (i / 3), 640.25 + i, i) + "\n";
  return text;
}

/// A grid of four points as VTK writes it.
std::string vtu(const std::string& points, const std::string& warp, const std::string& attributes,
                const std::string& format) {
  const auto array = [&](const char* name, int parts, const std::string& data) {
    return fmt::format(
        "<DataArray type=\"Float64\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"{}\">\n{}\n"
        "</DataArray>\n",
        name, parts, format, data);
  };
  return "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
         "header_type=\"UInt32\"" +
         attributes +
         "><UnstructuredGrid>\n<Piece NumberOfPoints=\"4\" NumberOfCells=\"0\"><PointData>\n" +
         array("warp_mm", 1, warp) + array("weft_mm", 1, warp) + "</PointData><Points>\n" +
         array("Points", 3, points) + "</Points></Piece></UnstructuredGrid></VTKFile>\n";
}

/// Points with named columns; their description is the file.
constexpr const char* kDescription =
    "schema = \"drapebench/points/1\"\ninstrument = \"other\"\nunit_mm = 25.4\nsigma_mm = 0.02\n"
    "[columns]\nx = \"X\"\ny = \"Y\"\nz = \"Z\"\nwarp = \"s\"\nweft = \"t\"\n[[point]]\n"
    "name = \"corner\"\nin_file = [1.0, 2.0, 3.0]\nin_world_mm = [4.0, 5.0, 6.0]\n"
    "uncertainty_mm = 0.1\n[[point]]\nin_file = [100.0, 2.0, 3.0]\nin_world_mm = [103.0, 5.0, "
    "6.0]\n"
    "[[point]]\nin_file = [1.0, 102.0, 3.0]\nin_world_mm = [4.0, 105.0, 6.0]\n";

/// Makes the listed files, empty, in a folder and reads the folder as pictures of cameras.
void read_layout(const fs::path& list) {
  const fs::path folder = list.parent_path() / "pictures";
  fs::remove_all(folder);
  std::istringstream names(read_text(list));
  fs::create_directories(folder);
  for (std::string name; std::getline(names, name);) {
    const fs::path file = (folder / fs::path("/" + name).relative_path()).lexically_normal();
    const bool is_inside = !name.empty() && name.size() < 200 &&
                           name.find('\0') == std::string::npos &&
                           file.string().starts_with(folder.string() + "/");
    if (!is_inside) continue;
    std::error_code ignored;
    fs::create_directories(file.parent_path(), ignored);
    std::ofstream(file) << "";
  }
  const PictureLayout layout = layout_found(folder);
  if (layout != PictureLayout::sets) static_cast<void>(placed_pictures(folder, layout));
}

}  // namespace

std::vector<Kind> foreign_kinds() {
  return {
      exported("opencv_yaml", ExchangeFormat::opencv, 0, "camera_name"),
      stored("opencv_xml", ".xml"),
      stored("opencv_json", ".json"),
      exported("ros", ExchangeFormat::ros, 0,
               "camera_name|data: .1, 0|0, 1, 0]|rectification|projection|(rows|cols): [34]"),
      exported("kalibr", ExchangeFormat::kalibr, 0, "rostopic"),
      exported("colmap_cameras", ExchangeFormat::colmap),
      exported("colmap_images", ExchangeFormat::colmap, 1),
      exported("mrcal", ExchangeFormat::mrcal),
      exported("dice", ExchangeFormat::dice, 0, "system_type|CAMERA_ID|xml version"),
      exported("matlab", ExchangeFormat::matlab),
      {"mrcal_python", made("left.cameramodel", kMrcal), imported(ExchangeFormat::mrcal)},
      {"dice_angles", made("cal.xml", dice_text), imported(ExchangeFormat::dice), true,
       "system_type"},
      {"matlab_json", made("stereo.json", kMatlab), imported(ExchangeFormat::matlab)},
      cloud("dice_points", "cloud.csv",
            table_of_points("MODEL_COORDINATES_X,MODEL_COORDINATES_Y,MODEL_COORDINATES_Z,MODEL_"
                            "DISPLACEMENT_X,MODEL_DISPLACEMENT_Y,MODEL_DISPLACEMENT_Z,SIGMA",
                            "{},{},{},0.5,0.25,{},0.01"),
            kFailed),
      cloud("aldic_points", "cloud.csv",
            table_of_points("X_mm,Y_mm,Z_mm,warp_mm,weft_mm", "{0},{1},{2},{0},{1}"), kFailed),
      cloud("vtu_ascii", "cloud.vtu", vtu("0 0 0 1 0 0 0 1 0 1 1 0.5", "1 2 3 4", "", "ascii"),
            "not finite|VTKFile|NumberOfCells"),
      cloud("vtu_base64", "cloud.vtu",
            vtu("YAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAPA/"
                "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA8D8AAAAAAAAAAAAAAAAAAPA/"
                "AAAAAAAA8D8AAAAAAADgPw==",
                "IAAAAAAAAAAAAPA/AAAAAAAAAEAAAAAAAAAIQAAAAAAAABBA", "", "binary"),
            "."),
      cloud("vtu_zlib", "cloud.vtu",
            vtu("AQAAAGAAAABgAAAAFwAAAA==eJxjYMAHPtjjlcaQh/Fh9AN7AJjjBdw=",
                "AQAAACAAAAAgAAAAFwAAAA==eJxjYACBD/YMEOAAoTigtIADACXXAgg=",
                " compressor=\"vtkZLibDataCompressor\"", "binary"),
            "."),
      {"points",
       [](const fs::path& folder) {
         write_durable(folder / "cloud.csv", table_of_points("X,Y,Z,s,t", "{0},{1},{2},{0},{1}"));
         return made("points.toml", kDescription)(folder);
       },
       [](const fs::path& f) {
         static_cast<void>(triangulate::read_cloud(f.parent_path() / "cloud.csv",
                                                   read_record<triangulate::PointsDescription>(f)));
       },
       true, "instrument|name|point"},
      {"layout_names",
       made("names.txt", "cam0_01.png\ncam0_02.png\ncam1_01.png\ncam1_02.png\ncam1_03.tiff\n"),
       read_layout, false, "encoding"},
      {"layout_cameras",
       made("names.txt",
            "left/img_001.png\nleft/img_002.png\nleft/img_003.png\nright/"
            "img_001.png\nright/img_002.png\nright/img_003.jpg\n"),
       read_layout, false, "encoding"},
  };
}

}  // namespace drape::test
