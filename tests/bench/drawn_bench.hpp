// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace drape::test {

enum class BenchKind {
  ruler,      ///< an object, its place and size stated with a ruler; cloth and friction as they are
  plates,     ///< a sphere on a stand and a box, both with a plate of object tags
  all_values  ///< an object or four pins; every value that the budget lists is stated with an error
};

struct DrawnObject {
  bool is_box = false;
  double x_mm = 0, y_mm = 0, z_bottom_mm = 0, yaw_deg = 0;
  double width_mm = 0, depth_mm = 0,
         height_mm = 0;  ///< full edges; the first is a sphere's diameter
  double edge_radius_mm = 0;
  double hole_mm = 0;  ///< in the stand of a sphere
};

struct DrawnPin {
  int row = 0, col = 0;
  std::array<double, 3> at_mm = {};
};

/// Cloth by its KES numbers. Absent twist stiffness follows from the bending.
struct DrawnFabric {
  double density = 0, bending_warp = 0, bending_weft = 0, shear = 0, emt_warp = 0, emt_weft = 0;
  std::optional<double> bias_bending;

  [[nodiscard]] std::string text() const;  ///< fabric.toml
};

/// A bench and the values that its operator states.
struct BenchValues {
  std::vector<DrawnObject> objects;  ///< one drape each, called D0, D1, ...
  double table_z_mm = 0, pitch_mm = 0, target_pitch_mm = 20;
  std::vector<double> stages_mm;
  std::vector<DrawnPin> pins;  ///< in place of an object
  double friction = 0;
  std::array<double, 2> level_deg = {};  ///< turn of gravity about x and y
  DrawnFabric fabric;
};

/// A random bench from a seed: kind, size, position and rotation of the object, number, positions
/// and lenses of the cameras, size of their pictures, print, fabric, friction, light, blur and
/// noise. The operator's statements differ from it by their stated uncertainties.
class DrawnBench {
 public:
  DrawnBench(std::uint64_t seed, BenchKind kind);

  /// Writes the true files to folder/true, simulates drapes there and renders its pictures; writes
  /// the operator's files and the recording to folder/rig. Throws if a program fails.
  /// BenchKind::all_values: folder/true/model holds the model's drape with the true values on a
  /// mesh of 2.5 mm with 20 segments per curve. The real cloth is this drape in a third of the
  /// benches, in the others that of a cloth 2 to 8 times as stiff.
  void make(const std::filesystem::path& folder) const;

  [[nodiscard]] const BenchValues& truth() const { return true_; }
  [[nodiscard]] const BenchValues& stated() const { return stated_; }
  [[nodiscard]] std::string describe() const;

 private:
  void draw_object(bool is_box);
  void draw_pins();
  void draw_cameras();
  void draw_cloth();
  void draw_statement();
  void draw_unknown_values();
  void write_rig(const std::filesystem::path& folder, const BenchValues& values,
                 bool is_true) const;
  [[nodiscard]] std::string scene_text(const BenchValues& values, std::size_t drape,
                                       bool is_true) const;
  [[nodiscard]] double any(double from, double to);  ///< next random number, uniform
  /// Next, normal; within twice the uncertainty but for BenchKind::all_values.
  [[nodiscard]] double error(double uncertainty);
  [[nodiscard]] std::size_t drapes() const {
    return std::max<std::size_t>(1, true_.objects.size());
  }
  [[nodiscard]] std::filesystem::path simulated(const std::filesystem::path& scene,
                                                const std::filesystem::path& out,
                                                const std::string& more) const;

  std::uint64_t seed_, next_ = 0;
  BenchKind kind_;
  BenchValues true_, stated_;
  double place_u_mm_ = 0.5, size_u_mm_ = 0.5;
  bool states_uncertainties_ = true;
  // Print and cloth.
  int marks_ = 11;
  double dot_part_ = 0.2, tag_part_ = 0.6;
  bool friction_measured_ = false;
  double stiffer_ = 1;  ///< the real cloth's stiffness in that of the model
  double cloth_x_mm_ = 0, cloth_y_mm_ = 0, cloth_yaw_deg_ = 0;
  // Cameras.
  int width_px_ = 1600, height_px_ = 1200;
  std::string cameras_;  ///< cameras-plan
  int camera_count_ = 3;
  std::string light_;  ///< options of drape-synth
};

}  // namespace drape::test
