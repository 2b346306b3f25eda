// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <opencv2/core.hpp>
#include <string_view>

#include "calib/exchange/formats.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/geometry/vectors.hpp"

namespace drape::calib {
namespace {

namespace fs = std::filesystem;

[[nodiscard]] Error refused(const fs::path& file, const std::string& field, const std::string& what,
                            const std::string& what_to_do) {
  return bad_input(what, {.file = file.string(), .field = field}, what_to_do);
}

template <class Eigen_>
cv::Mat matrix_of(const Eigen_& values) {
  cv::Mat matrix(static_cast<int>(values.rows()), static_cast<int>(values.cols()), CV_64F);
  for (int row = 0; row < matrix.rows; ++row) {
    for (int col = 0; col < matrix.cols; ++col) matrix.at<double>(row, col) = values(row, col);
  }
  return matrix;
}

/// A cv::FileStorage file (YAML, XML or JSON) written by a calibration tool.
class Storage {
 public:
  explicit Storage(const fs::path& file) : file_(file) {
    std::string text = read_text(file);
    // ROS omits the header line that cv::FileStorage requires.
    const std::string ending = file.extension().string();
    if ((ending == ".yaml" || ending == ".yml") && !text.starts_with("%YAML"))
      text.insert(0, text.starts_with("---") ? "%YAML:1.0\n" : "%YAML:1.0\n---\n");
    try {
      storage_.open(text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
    } catch (const cv::Exception&) {
      storage_.release();
    }
    if (!storage_.isOpened())
      throw refused(file, "", "OpenCV cannot read the file", "give a file of cv::FileStorage");
  }

  /// Names of all values of the file.
  [[nodiscard]] std::vector<std::string> keys() const { return storage_.root().keys(); }

  [[nodiscard]] cv::FileNode any_of(std::initializer_list<const char*> keys) const {
    for (const char* key : keys) {
      if (!storage_[key].empty()) return storage_[key];
    }
    return {};
  }

  /// Elements of a matrix, row by row; empty if no key exists.
  [[nodiscard]] std::vector<double> numbers(std::initializer_list<const char*> keys) const {
    const cv::FileNode node = any_of(keys);
    if (node.empty()) return {};
    cv::Mat matrix;
    try {
      // ROS files store a plain map with `data` instead of OpenCV's typed matrix.
      if (node.isMap() && node["dt"].empty()) {
        std::vector<double> values;
        node["data"] >> values;
        return values;
      }
      node >> matrix;
      matrix.convertTo(matrix, CV_64F);
    } catch (const cv::Exception&) {
      throw refused(file_, *keys.begin(), "this is not a matrix", "export the camera again");
    }
    return {matrix.begin<double>(), matrix.end<double>()};
  }

  [[nodiscard]] int integer(std::initializer_list<const char*> keys) const {
    const cv::FileNode node = any_of(keys);
    if (!node.isInt())
      throw refused(file_, *keys.begin(), "the image size is missing",
                    "add image_width and image_height (px)");
    return static_cast<int>(node);
  }

 private:
  fs::path file_;
  cv::FileStorage storage_;
};

/// Throws Error(bad_input) for a value that gives the numbers another meaning (lens, picture).
void check_meaning(const Storage& storage, const fs::path& file) {
  constexpr const char* kRemedy = "calibrate with OpenCV's pinhole model, at full resolution";
  for (const std::string& key : storage.keys()) {
    const cv::FileNode node = storage.any_of({key.c_str()});
    if (key == "distortion_model" || key == "camera_model") {
      constexpr std::string_view kKnown[] = {"plumb_bob", "radtan", "rational_polynomial", "brown",
                                             "pinhole"};
      const std::string model = node.isString() ? static_cast<std::string>(node) : "";
      if (std::find(std::begin(kKnown), std::end(kKnown), model) == std::end(kKnown))
        throw refused(file, key, fmt::format("the lens is `{}`, not Brown's", model), kRemedy);
    } else if (key.find("model") != std::string::npos || key.find("fisheye") != std::string::npos ||
               key == "xi" || key == "skew") {
      if (node.isInt() || node.isReal() ? static_cast<double>(node) != 0 : !node.empty())
        throw refused(file, key, fmt::format("`{}` makes another lens of the numbers", key),
                      kRemedy);
    }
    if ((key == "binning_x" || key == "binning_y") && static_cast<double>(node) > 1)
      throw refused(file, key, "the pictures are binned", kRemedy);
  }
}

BrownLens lens_of(const Storage& storage, const fs::path& file) {
  check_meaning(storage, file);
  const auto k = storage.numbers({"camera_matrix", "Camera_Matrix", "cameraMatrix", "K"});
  if (k.size() != 9)
    throw refused(file, "camera_matrix", "the camera matrix is missing or not 3 x 3",
                  "give the file that OpenCV's calibration wrote");
  if (std::abs(k[6]) > 1e-9 * k[0] || std::abs(k[7]) > 1e-9 * k[0])
    throw refused(file, "camera_matrix", "its last row is not (0, 0, 1)",
                  "is it MATLAB's transpose? write rows as columns");
  if (std::abs(k[8] - 1) > 1e-9)
    throw refused(file, "camera_matrix", fmt::format("its last element is {:g}, not 1", k[8]),
                  "give the matrix in px, as OpenCV's calibration wrote it");
  if (std::abs(k[1]) > 1e-9 * k[0] || std::abs(k[3]) > 1e-9 * k[0])
    throw refused(file, "camera_matrix", "the pixels are skewed", "calibrate without skew");
  auto d =
      storage.numbers({"distortion_coefficients", "Distortion_Coefficients", "distCoeffs", "D"});
  for (std::size_t i = 5; i < d.size(); ++i) {
    if (d[i] != 0)
      throw refused(file, "distortion_coefficients", "more than Brown's five terms are used",
                    "calibrate with k1 k2 p1 p2 k3 only");
  }
  d.resize(5, 0);
  return {k[0], k[4], k[2], k[5], d[0], d[1], d[2], d[3], d[4]};
}

CamFromWorld pose_of(const Storage& storage, const fs::path& file) {
  const auto matrix = storage.numbers({"cam_from_world_rotation"});
  const auto vector = storage.numbers({"rvec"});
  const auto t = storage.numbers({"cam_from_world_translation_m", "tvec"});
  if ((matrix.size() != 9 && vector.size() != 3) || t.size() != 3)
    throw refused(file, "cam_from_world_rotation", "the file has no pose",
                  "add cam_from_world_rotation and cam_from_world_translation_m, or rvec and tvec "
                  "in metres");
  CamFromWorld pose;
  pose.translation_m = {t[0], t[1], t[2]};
  if (matrix.size() == 9) {
    pose.rotation = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(matrix.data());
  } else {
    pose.rotation = rotation_about({vector[0], vector[1], vector[2]});
  }
  return pose;
}

}  // namespace

std::vector<ExportedFile> opencv_files(const std::vector<BrownCamera>& cameras) {
  std::vector<ExportedFile> files;
  for (const BrownCamera& camera : cameras) {
    const BrownLens& lens = camera.lens;
    Eigen::Matrix3d k;
    k << lens.fx_px, 0, lens.cx_px, 0, lens.fy_px, lens.cy_px, 0, 0, 1;
    Eigen::Matrix<double, 1, 5> distortion;
    distortion << lens.k1, lens.k2, lens.p1, lens.p2, lens.k3;
    cv::FileStorage storage(
        ".yaml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY | cv::FileStorage::FORMAT_YAML);
    storage << "image_width" << camera.width_px << "image_height" << camera.height_px;
    storage << "camera_name" << camera.name;
    storage << "camera_matrix" << matrix_of(k);
    storage << "distortion_model"
            << "plumb_bob";
    storage << "distortion_coefficients" << matrix_of(distortion);
    storage << "cam_from_world_rotation" << matrix_of(camera.cam_from_world.rotation);
    storage << "cam_from_world_translation_m" << matrix_of(camera.cam_from_world.translation_m);
    files.push_back({camera.name + ".yaml", storage.releaseAndGetString()});
  }
  return files;
}

Camera camera_of_opencv(const fs::path& file) {
  const Storage storage(file);
  Camera camera;
  camera.model.lens = lens_of(storage, file);
  camera.model.width_px = storage.integer({"image_width", "image_Width"});
  camera.model.height_px = storage.integer({"image_height", "image_Height"});
  camera.cam_from_world = pose_of(storage, file);
  return camera;
}

}  // namespace drape::calib
