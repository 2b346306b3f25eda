// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace drape::test {

struct DrawnObject {
  bool is_box = false;
  double x_mm = 0, y_mm = 0, z_bottom_mm = 0, yaw_deg = 0;
  double width_mm = 0, depth_mm = 0,
         height_mm = 0;  ///< full edges; the first is a sphere's diameter
  double edge_radius_mm = 0;
  double hole_mm = 0;  ///< in the stand of a sphere
};

/// A bench and the values that its operator states.
struct BenchValues {
  std::vector<DrawnObject> objects;  ///< one drape each, called D0, D1, ...
  double table_z_mm = 0, pitch_mm = 0, target_pitch_mm = 20;
  std::vector<double> stages_mm;
};

/// A random bench from a seed: kind, size, position and rotation of the object, number, positions
/// and lenses of the cameras, size of their pictures, print, fabric, friction, light, blur and
/// noise. The operator's statements differ from it by their stated uncertainties.
class DrawnBench {
 public:
  /// `plates`: a sphere on a stand and a box, both with a plate of object tags.
  DrawnBench(std::uint64_t seed, bool plates);

  /// Writes the true files to folder/true, simulates drapes there and renders its pictures; writes
  /// the operator's files and the recording to folder/rig. Throws if a program fails.
  void make(const std::filesystem::path& folder) const;

  [[nodiscard]] const BenchValues& truth() const { return true_; }
  [[nodiscard]] const BenchValues& stated() const { return stated_; }
  [[nodiscard]] std::string describe() const;

 private:
  void draw_object(bool is_box);
  void draw_cameras();
  void draw_cloth();
  void draw_statement();
  void write_rig(const std::filesystem::path& folder, const BenchValues& values,
                 bool is_true) const;
  [[nodiscard]] std::string scene_text(const BenchValues& values, std::size_t drape,
                                       bool is_true) const;
  [[nodiscard]] double any(double from, double to);  ///< next random number, uniform
  [[nodiscard]] double error(double uncertainty);    ///< next, normal, within twice the uncertainty

  std::uint64_t seed_, next_ = 0;
  bool plates_;
  BenchValues true_, stated_;
  double place_u_mm_ = 0.5, size_u_mm_ = 0.5;
  bool states_uncertainties_ = true;
  // Print and cloth.
  int marks_ = 11;
  double dot_part_ = 0.2, tag_part_ = 0.6;
  double density_ = 0, bending_warp_ = 0, bending_weft_ = 0, shear_ = 0, emt_ = 0, friction_ = 0;
  double cloth_x_mm_ = 0, cloth_y_mm_ = 0, cloth_yaw_deg_ = 0;
  // Cameras.
  int width_px_ = 1600, height_px_ = 1200;
  std::string cameras_;  ///< cameras-plan
  int camera_count_ = 3;
  std::string light_;  ///< options of drape-synth
};

}  // namespace drape::test
