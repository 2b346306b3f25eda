// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "core/calibration.hpp"
#include "core/units.hpp"
#include "tests/support/bench1_truth.hpp"

namespace drape::test {

using namespace calib;

inline CalibratedCamera calibrated_camera(const Camera& camera) {
  CalibratedCamera result;
  result.camera = camera;
  result.worked_point.point_in_world = {30 * units::mm, -45 * units::mm, 20 * units::mm};
  result.worked_point.px =
      project(camera.model, camera.cam_from_world * result.worked_point.point_in_world)->px;
  return result;
}

/// bench1's three cameras, with all terms of Brown's lens model, or with Tsai's.
inline Calibration bench1_calibration(bool tsai) {
  Calibration calibration;
  calibration.method = "tsai";
  calibration.rig = "bench1";
  for (Camera camera : bench1_truth().cameras) {
    // Nine digits in the file do not give an exact rotation.
    Eigen::Matrix3d& rotation = camera.cam_from_world.rotation;
    rotation = Eigen::Quaterniond(rotation).normalized().toRotationMatrix();
    auto& lens = std::get<BrownLens>(camera.model.lens);
    lens.p1 = 4e-4;
    lens.p2 = -3e-4;
    lens.k3 = 0.01;
    if (tsai)
      camera.model.lens =
          TsaiLens{10.7 * units::mm, 900, lens.cx_px, lens.cy_px, 1.0008, 3.45e-6, 3.45e-6};
    calibration.cameras.push_back(calibrated_camera(camera));
  }
  return calibration;
}

/// DICe's own calibration of its simulated plates (sim_dot_cal_gold.xml).
inline const std::string dice_text = R"(<ParameterList>
  <Parameter name="xml_file_format" type="string" value="DICe_xml_camera_system_file" />
  <Parameter name="system_type_3D" type="string" value="OPENCV" />
  <Parameter name="extrinsics_relative_camera_to_camera" type="bool" value="true" />
  <ParameterList name="CAMERA 0">
    <Parameter name="CX" type="double" value="872.1577" />
    <Parameter name="CY" type="double" value="579.955" />
    <Parameter name="FX" type="double" value="6673.3159" />
    <Parameter name="FY" type="double" value="6669.3027" />
    <Parameter name="K1" type="double" value="0.021682" />
    <Parameter name="LENS_DISTORTION_MODEL" type="string" value="OPENCV_LENS_DISTORTION" />
    <Parameter name="IMAGE_HEIGHT_WIDTH" type="string" value="{ 1200, 1920 }" />
  </ParameterList>
  <ParameterList name="CAMERA 1">
    <Parameter name="CX" type="double" value="917.973" />
    <Parameter name="CY" type="double" value="531.635" />
    <Parameter name="FX" type="double" value="6607.61" />
    <Parameter name="FY" type="double" value="6602.85" />
    <Parameter name="TX" type="double" value="122.2488" />
    <Parameter name="TY" type="double" value="1.84888" />
    <Parameter name="TZ" type="double" value="17.62463" />
    <Parameter name="ALPHA" type="double" value="0.13068954" />
    <Parameter name="BETA" type="double" value="-19.0676936" />
    <Parameter name="GAMMA" type="double" value="0.281404038" />
    <Parameter name="IMAGE_HEIGHT_WIDTH" type="string" value="{ 1200, 1920 }" />
  </ParameterList>
</ParameterList>
)";

/// Points throughout the volume in which a drape hangs, visible in every image.
inline std::vector<Eigen::Vector3d> points_of_a_drape() {
  std::vector<Eigen::Vector3d> all;
  for (const double x : {-90.0, 0.0, 90.0}) {
    for (const double y : {-80.0, 10.0, 80.0}) {
      for (const double z : {0.0, 90.0})
        all.emplace_back(x * units::mm, y * units::mm, z * units::mm);
    }
  }
  return all;
}

}  // namespace drape::test
