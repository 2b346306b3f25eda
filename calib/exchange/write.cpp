// SPDX-License-Identifier: Apache-2.0
// Writes cameras as files of other tools.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <pugixml.hpp>
#include <sstream>

#include "calib/exchange/formats.hpp"
#include "core/error.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

std::string chain_row(const CamFromWorld& pose, int row) {
  const Eigen::RowVector3d r = pose.rotation.row(row);
  return fmt::format("  - [{}, {}, {}, {}]\n", r[0], r[1], r[2], pose.translation_m[row]);
}

/// Writes elements in one line, row by row.
template <class Matrix>
std::string in_line(const Matrix& matrix, std::string_view between_rows = ", ") {
  std::string text;
  for (Eigen::Index row = 0; row < matrix.rows(); ++row)
    for (Eigen::Index col = 0; col < matrix.cols(); ++col)
      text += fmt::format("{}{}",
                          row + col == 0 ? ""
                          : col == 0     ? between_rows
                                         : ", ",
                          matrix(row, col));
  return text;
}

Eigen::Matrix3d matrix_of_lens(const BrownLens& lens) {
  Eigen::Matrix3d k;
  k << lens.fx_px, 0, lens.cx_px, 0, lens.fy_px, lens.cy_px, 0, 0, 1;
  return k;
}

template <class Eigen_>
cv::Mat matrix_of(const Eigen_& values) {
  cv::Mat matrix(static_cast<int>(values.rows()), static_cast<int>(values.cols()), CV_64F);
  for (int row = 0; row < matrix.rows; ++row) {
    for (int col = 0; col < matrix.cols; ++col) matrix.at<double>(row, col) = values(row, col);
  }
  return matrix;
}

}  // namespace

std::vector<ExportedFile> opencv_files(const std::vector<BrownCamera>& cameras) {
  std::vector<ExportedFile> files;
  for (const BrownCamera& camera : cameras) {
    const BrownLens& lens = camera.lens;
    Eigen::Matrix<double, 1, 5> distortion;
    distortion << lens.k1, lens.k2, lens.p1, lens.p2, lens.k3;
    cv::FileStorage storage(
        ".yaml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY | cv::FileStorage::FORMAT_YAML);
    storage << "image_width" << camera.width_px << "image_height" << camera.height_px;
    storage << "camera_name" << camera.name;
    storage << "camera_matrix" << matrix_of(matrix_of_lens(lens));
    storage << "distortion_model"
            << "plumb_bob";
    storage << "distortion_coefficients" << matrix_of(distortion);
    storage << "cam_from_world_rotation" << matrix_of(camera.cam_from_world.rotation);
    storage << "cam_from_world_translation_m" << matrix_of(camera.cam_from_world.translation_m);
    files.push_back({camera.name + ".yaml", storage.releaseAndGetString()});
  }
  return files;
}

std::vector<ExportedFile> ros_files(const std::vector<BrownCamera>& cameras) {
  std::vector<ExportedFile> files;
  for (const BrownCamera& camera : cameras) {
    const BrownLens& lens = camera.lens;
    const auto matrix = [](const char* name, const auto& value) {
      return fmt::format("{}:\n  rows: {}\n  cols: {}\n  data: [{}]\n", name, value.rows(),
                         value.cols(), in_line(value));
    };
    Eigen::Matrix<double, 1, 5> terms;
    terms << lens.k1, lens.k2, lens.p1, lens.p2, lens.k3;
    Eigen::Matrix<double, 3, 4> projection = Eigen::Matrix<double, 3, 4>::Zero();
    projection.leftCols<3>() = matrix_of_lens(lens);
    files.push_back(
        {camera.name + ".yaml",
         fmt::format("image_width: {}\nimage_height: {}\ncamera_name: {}\n", camera.width_px,
                     camera.height_px, camera.name) +
             matrix("camera_matrix", matrix_of_lens(lens)) + "distortion_model: plumb_bob\n" +
             matrix("distortion_coefficients", terms) +
             matrix("rectification_matrix", Eigen::Matrix3d(Eigen::Matrix3d::Identity())) +
             matrix("projection_matrix", projection) +
             matrix("cam_from_world_rotation", camera.cam_from_world.rotation) +
             matrix("cam_from_world_translation_m", camera.cam_from_world.translation_m)});
  }
  return files;
}

std::vector<ExportedFile> dice_files(const std::vector<BrownCamera>& cameras) {
  pugi::xml_document document;
  pugi::xml_node root = document.append_child("ParameterList");
  const auto add = [](pugi::xml_node list, const char* name, const char* type,
                      const std::string& value) {
    pugi::xml_node parameter = list.append_child("Parameter");
    parameter.append_attribute("name") = name;
    parameter.append_attribute("type") = type;
    parameter.append_attribute("value") = value.c_str();
  };
  add(root, "xml_file_format", "string", "DICe_xml_camera_system_file");
  add(root, "system_type_3D", "string", "GENERIC_SYSTEM");
  add(root, "extrinsics_relative_camera_to_camera", "bool", "false");
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const BrownCamera& camera = cameras[i];
    const BrownLens& lens = camera.lens;
    const CamFromWorld& pose = camera.cam_from_world;
    pugi::xml_node list = root.append_child("ParameterList");
    list.append_attribute("name") = fmt::format("CAMERA {}", i).c_str();
    add(list, "CAMERA_ID", "string", camera.name);
    for (const auto& [name, value] : {std::pair{"CX", lens.cx_px},
                                      {"CY", lens.cy_px},
                                      {"FX", lens.fx_px},
                                      {"FY", lens.fy_px},
                                      {"K1", lens.k1},
                                      {"K2", lens.k2},
                                      {"K3", lens.k3},
                                      {"P1", lens.p1},
                                      {"P2", lens.p2},
                                      {"TX", pose.translation_m.x() / units::mm},
                                      {"TY", pose.translation_m.y() / units::mm},
                                      {"TZ", pose.translation_m.z() / units::mm}})
      add(list, name, "double", fmt::format("{}", value));
    add(list, "LENS_DISTORTION_MODEL", "string", "OPENCV_LENS_DISTORTION");
    add(list, "IMAGE_HEIGHT_WIDTH", "string",
        fmt::format("{{ {}, {} }}", camera.height_px, camera.width_px));
    pugi::xml_node rows = list.append_child("ParameterList");
    rows.append_attribute("name") = "rotation_3x3_matrix";
    for (int row = 0; row < 3; ++row)
      add(rows, fmt::format("ROW {}", row).c_str(), "string",
          fmt::format("{{ {} }}", in_line(Eigen::RowVector3d(pose.rotation.row(row)))));
  }
  std::ostringstream text;
  document.save(text, "  ");
  return {{"cal.xml", text.str()}};
}

std::vector<ExportedFile> matlab_files(const std::vector<BrownCamera>& cameras) {
  if (cameras.size() != 2)
    throw usage_error(
        fmt::format("stereoParameters has two cameras, the calibration {}", cameras.size()),
        "write for another tool");
  std::string text = "% written by drapebench: fields of a struct for stereoParameters()\n";
  for (int i = 0; i < 2; ++i) {
    const BrownCamera& camera = cameras[static_cast<std::size_t>(i)];
    BrownLens lens = camera.lens;
    lens.cx_px += 1, lens.cy_px += 1;  // the corner pixel's centre is (1, 1)
    const std::string name = fmt::format("stereoParams.CameraParameters{}.", i + 1);
    text += fmt::format(
        "{0}IntrinsicMatrix = [{1}];\n{0}RadialDistortion = [{2}, {3}, {4}];\n"
        "{0}TangentialDistortion = [{5}, {6}];\n{0}ImageSize = [{7}, {8}];\n"
        "{0}WorldUnits = 'millimeters';\n",
        name, in_line(Eigen::Matrix3d(matrix_of_lens(lens).transpose()), "; "), lens.k1, lens.k2,
        lens.k3, lens.p1, lens.p2, camera.height_px, camera.width_px);
  }
  const CamFromWorld &first = cameras[0].cam_from_world, &second = cameras[1].cam_from_world;
  const Eigen::Matrix3d rotation = second.rotation * first.rotation.transpose();
  const Eigen::Vector3d translation_mm =
      (second.translation_m - rotation * first.translation_m) / units::mm;
  text += fmt::format(
      "stereoParams.RotationOfCamera2 = [{}];\nstereoParams.TranslationOfCamera2 = [{}];\n",
      in_line(Eigen::Matrix3d(rotation.transpose()), "; "),
      in_line(Eigen::RowVector3d(translation_mm.transpose())));
  return {{"stereoParams.m", text}};
}

std::vector<ExportedFile> mrcal_files(const std::vector<BrownCamera>& cameras) {
  std::vector<ExportedFile> files;
  for (const BrownCamera& camera : cameras) {
    const BrownLens& lens = camera.lens;
    const Eigen::Vector3d r = rotation_vector(camera.cam_from_world.rotation);
    const Eigen::Vector3d& t = camera.cam_from_world.translation_m;
    files.push_back({camera.name + ".cameramodel",
                     fmt::format("# written by drapebench; pose: camera from world, rad and m\n{{\n"
                                 "    'lensmodel':  'LENSMODEL_OPENCV5',\n"
                                 "    'intrinsics': [ {}, {}, {}, {}, {}, {}, {}, {}, {} ],\n"
                                 "    'extrinsics': [ {}, {}, {}, {}, {}, {} ],\n"
                                 "    'imagersize': [ {}, {} ]\n}}\n",
                                 lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px, lens.k1, lens.k2,
                                 lens.p1, lens.p2, lens.k3, r.x(), r.y(), r.z(), t.x(), t.y(),
                                 t.z(), camera.width_px, camera.height_px)});
  }
  return files;
}

std::vector<ExportedFile> kalibr_files(const std::vector<BrownCamera>& cameras) {
  std::string text;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const BrownCamera& camera = cameras[i];
    const BrownLens& lens = camera.lens;
    text += fmt::format("cam{}:\n", i);
    if (i > 0) {
      // Pose of camera i relative to camera i - 1.
      const CamFromWorld& before = cameras[i - 1].cam_from_world;
      CamFromWorld step;
      step.rotation = camera.cam_from_world.rotation * before.rotation.transpose();
      step.translation_m =
          camera.cam_from_world.translation_m - step.rotation * before.translation_m;
      text += "  T_cn_cnm1:\n" + chain_row(step, 0) + chain_row(step, 1) + chain_row(step, 2) +
              "  - [0.0, 0.0, 0.0, 1.0]\n";
    }
    text += fmt::format(
        "  camera_model: pinhole\n  distortion_coeffs: [{}, {}, {}, {}]\n"
        "  distortion_model: radtan\n  intrinsics: [{}, {}, {}, {}]\n"
        "  resolution: [{}, {}]\n  rostopic: /{}/image_raw\n",
        lens.k1, lens.k2, lens.p1, lens.p2, lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px,
        camera.width_px, camera.height_px, camera.name);
  }
  return {{"camchain.yaml", text}};
}

std::vector<ExportedFile> colmap_files(const std::vector<BrownCamera>& cameras) {
  constexpr double kHalfPixel = 0.5;  // COLMAP's corner pixel has its centre at (0.5, 0.5)
  std::string lenses =
      "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS; written by drapebench, lengths in m\n";
  std::string images =
      "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then POINTS2D (none); lengths in m\n";
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const BrownCamera& camera = cameras[i];
    const BrownLens& lens = camera.lens;
    const bool full = lens.k3 != 0;
    lenses +=
        fmt::format("{} {} {} {} {} {} {} {} {} {} {} {}{}\n", i + 1,
                    full ? "FULL_OPENCV" : "OPENCV", camera.width_px, camera.height_px, lens.fx_px,
                    lens.fy_px, lens.cx_px + kHalfPixel, lens.cy_px + kHalfPixel, lens.k1, lens.k2,
                    lens.p1, lens.p2, full ? fmt::format(" {} 0 0 0", lens.k3) : "");
    const Eigen::Quaterniond q(camera.cam_from_world.rotation);
    const Eigen::Vector3d& t = camera.cam_from_world.translation_m;
    images += fmt::format("{} {} {} {} {} {} {} {} {} {}.png\n\n", i + 1, q.w(), q.x(), q.y(),
                          q.z(), t.x(), t.y(), t.z(), i + 1, camera.name);
  }
  return {{"cameras.txt", lenses}, {"images.txt", images}, {"points3D.txt", "# no points\n"}};
}

}  // namespace drape::calib
