// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/fields/records.hpp"
#include "core/marks.hpp"

namespace drape {

/// AprilTag printed between the dots. It labels them and is not measured itself.
struct PrintedTag {
  int id = 0;
  Eigen::Vector2d centre_m;  ///< in the plane of the print; see Target and Print
};

/// Distance between two target points, measured by the operator on the plate.
struct KnownLength {
  MarkId from, to;
  double length_m = 0;
  double standard_uncertainty_m = 0;
};

/// Measured points of a target plate, in the target frame.
struct MeasuredPlate {
  std::vector<Eigen::Vector3d> points_m, sd_m;  ///< ordered by row, then column
  /// Covariance of common errors: bow along x and y (mm), stretch of x against y, shear, scale.
  Eigen::Matrix<double, 5, 5> common_covariance = Eigen::Matrix<double, 5, 5>::Zero();
};

/// Kinds of a calibration target's points.
enum class TargetKind {
  dot_grid,    ///< centres of printed dots; tags, if any, resolve the plate's orientation
  chessboard,  ///< inner corners of a chessboard
  charuco,     ///< chessboard with a tag in each light square (OpenCV's ChArUco board)
  aprilgrid,   ///< outer corners of a grid of tags (Kalibr's AprilGrid)
};

template <>
inline constexpr std::string_view names_of<TargetKind>[] = {"dot-grid", "chessboard", "charuco",
                                                            "aprilgrid"};

/// Arrangement of a dot grid: `square` has a dot at every node; `staggered` only where row + col is
/// even (OpenCV's asymmetric circle grid; its pitch is the distance between rows).
enum class DotArrangement { square, staggered };

template <>
inline constexpr std::string_view names_of<DotArrangement>[] = {"square", "staggered"};

enum class DotColour { black, white };  ///< white dots stand on a black plate

template <>
inline constexpr std::string_view names_of<DotColour>[] = {"black", "white"};

/// Calibration target (target.toml). Frame: origin at the grid's centre, x along the columns, y
/// along the rows, z out of the printed face. On a chessboard the square between the corners (0, 0)
/// and (1, 1) is dark, which fixes the orientation if rows + cols is odd. A ChArUco board or an
/// AprilGrid is identified by its tags.
struct Target {
  TargetKind kind = TargetKind::dot_grid;
  int rows = 0, cols = 0;     ///< dots or corners; rows along y, cols along x
  double pitch_m = 0;         ///< pitch of the dots or of an AprilGrid's tags, or side of a square
  double dot_diameter_m = 0;  ///< 0 for a chessboard
  DotArrangement arrangement = DotArrangement::square;
  DotColour dot_colour = DotColour::black;
  /// Dots with a hole, which define the plate's position and orientation as on plates for digital
  /// image correlation; either none, or at least three.
  std::vector<MarkId> hollow;
  double hollow_diameter_m = 0;  ///< diameter of their holes
  std::string tag_family;        ///< empty without tags
  double tag_edge_m = 0;         ///< outer edge of the black square
  int tag_border = 1;            ///< modules of the black rim around a tag's bits
  std::vector<PrintedTag> tags;  ///< centre (x, y) in the target frame; its top edge towards +y
  std::vector<KnownLength> known_lengths;
  std::optional<double> print_error_m;  ///< standard uncertainty of a point's position on the print
  std::optional<MeasuredPlate> measured;

  /// The file as it was read.
  Document document = {};
  [[nodiscard]] Eigen::Vector3d point_in_target(MarkId dot) const;  ///< m; nominal if unmeasured
  /// True if the target has this point.
  [[nodiscard]] bool has(MarkId dot) const {
    return dot.row >= 0 && dot.col >= 0 && dot.row < rows && dot.col < cols &&
           (arrangement == DotArrangement::square || (dot.row + dot.col) % 2 == 0);
  }
};

/// Two kinds of dots on the cloth, full and with a light centre, arranged so that every 3 x 3
/// window is unique. They provide the labels where tags cannot be read.
struct DotClasses {
  double light_centre_diameter_m = 0;
  std::vector<std::string> rows;  ///< one string per row; '#': full dot, 'o': dot with light centre

  [[nodiscard]] bool is_light(MarkId mark) const { return rows.at(mark.row).at(mark.col) == 'o'; }
};

/// Marks printed on the cloth (print.toml). Material coordinates are (warp, weft) distances in
/// metres from the corner of the patch next to mark (0, 0); warp grows with row, weft with col.
/// Seen from the printed side with row 0 at the top, col 0 is at the left and tags are upright.
struct Print {
  std::filesystem::path file;  ///< document.file()
  int rows = 0, cols = 0;
  double pitch_m = 0;
  double dot_diameter_m = 0;
  Eigen::Vector2d patch_m;   ///< size along (warp, weft)
  Eigen::Vector2d margin_m;  ///< material coordinates of mark (0, 0)
  std::string tag_family;    ///< empty without tags
  double tag_edge_m = 0;
  std::vector<PrintedTag> tags;  ///< centre in material coordinates (warp, weft)
  std::optional<DotClasses> dot_classes;

  Document document = {};  ///< the file as it was read
  [[nodiscard]] Eigen::Vector2d material_m(MarkId mark) const;
};

struct RigCamera {
  std::string name;
  int width_px = 0, height_px = 0;
  double pixel_pitch_x_m = 0, pixel_pitch_y_m = 0;
  std::optional<double> square_pixels = {};  ///< prior: standard uncertainty of fy/fx = 1
};

/// A frame set that shows the target parallel to its reference pose, raised by z.
struct TargetStage {
  std::string set;
  double z_m = 0;
};

/// One laying of a drape ([[repeat]] in rig.toml): the scene's cloth laid again on the same object.
/// It is the scene's own laying if both name the same set.
struct DrapeRepeat {
  std::string scene;   ///< name of the scene
  std::string set;     ///< frame set that shows it
  std::string repeat;  ///< name of the laying; defaults to that of the set
  std::string face;    ///< side of the cloth that faces up; empty if not stated
};

/// The bench (rig.toml): cameras, target, and which frame sets calibrate it.
struct Rig {
  std::filesystem::path file;  ///< document.file()
  std::string name;
  std::filesystem::path target_file;
  std::filesystem::path print_file;  ///< empty if the rig has no scenes
  std::filesystem::path recording;   ///< folder of the recording
  std::vector<RigCamera> cameras;
  std::vector<TargetStage> stages;
  std::vector<std::string> free_poses;  ///< frame sets that show the target in arbitrary poses
  bool estimate_scale_x = false;        ///< estimate Tsai's s_x; fixed at 1 if false
  std::vector<std::filesystem::path> scenes;  ///< in the order of the report; can be empty
  std::vector<int> grids = {11, 21, 31};      ///< particles per side of the paper's model
  double spacing_m = 2.5e-3;                  ///< spacing of the cloth's finest mesh
  std::vector<int> segments;                  ///< line segments per Kawabata curve, e.g. 1 5
  std::vector<DrapeRepeat> repeats;
  /// Largest mean distance at which a simulated drape matches, for a scene that was laid once.
  std::optional<double> tolerance_m;

  /// The file as it was read.
  Document document = {};
  [[nodiscard]] const RigCamera& camera(const std::string& camera_name) const;  ///< throws if none
};

template <>
inline constexpr Format format_of<Rig>{"rig", Syntax::toml, 1, "rig.toml: the bench"};
template <>
inline constexpr Format format_of<Target>{"target", Syntax::toml, 1,
                                          "target.toml: a calibration target"};
template <>
inline constexpr Format format_of<Print>{"print", Syntax::toml, 1, "print.toml: marks on a cloth"};

void fields(Fields& f, Rig& rig);
void fields(Fields& f, MeasuredPlate& plate);
void fields(Fields& f, Target& target);
void fields(Fields& f, Print& print);

/// Folder of a simulation relative to its drape's folder, for example "simulations/2.5mm-5" for a
/// finest mesh spacing of 2.5 mm and 5 segments per curve.
[[nodiscard]] std::filesystem::path simulation_folder(double spacing_m, int segments);

[[nodiscard]] Rig read_rig(const std::filesystem::path& file);
[[nodiscard]] Target read_target(const std::filesystem::path& file);
[[nodiscard]] Print read_print(const std::filesystem::path& file);

}  // namespace drape
