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

/// AprilTag printed between the dots: labels them, is never measured itself.
struct PrintedTag {
  int id = 0;
  Eigen::Vector2d centre_m;  ///< in the plane of the print, see Target and Print
};

/// Distance between two points of the target that the operator measured on the plate itself.
struct KnownLength {
  MarkId from, to;
  double length_m = 0;
  double standard_uncertainty_m = 0;
};

/// A target whose points were measured by calibrated views, in the target frame.
struct MeasuredPlate {
  std::vector<Eigen::Vector3d> points_m, sd_m;  ///< by row, then column
  /// Covariance of bow along x and y (mm), stretch of x against y, shear, scale, of all points.
  Eigen::Matrix<double, 5, 5> common_covariance = Eigen::Matrix<double, 5, 5>::Zero();
};

/// Kinds of a calibration target's points.
enum class TargetKind {
  dot_grid,    ///< centres of printed dots; tags, if any, tell one side from the other
  chessboard,  ///< inner corners of a chessboard
  charuco,     ///< the same with a tag in each light square (OpenCV's ChArUco board)
  aprilgrid,   ///< outer corners of a grid of tags (Kalibr's AprilGrid)
};

template <>
inline constexpr std::string_view names_of<TargetKind>[] = {"dot-grid", "chessboard", "charuco",
                                                            "aprilgrid"};

/// Where a dot grid has its dots: at every place, or, row by row, at every second one, so that row
/// + col is even (OpenCV's asymmetric circle grid; pitch: from row to row).
enum class DotArrangement { square, staggered };

template <>
inline constexpr std::string_view names_of<DotArrangement>[] = {"square", "staggered"};

enum class DotColour { black, white };  ///< white dots stand on a black plate

template <>
inline constexpr std::string_view names_of<DotColour>[] = {"black", "white"};

/// Calibration target (target.toml). Frame: origin at the grid's centre, x along the columns,
/// y along the rows, z out of the printed face. A chessboard's four squares around corner (0, 0)
/// include a dark one between the corners (0, 0) and (1, 1), which tells its sides apart when
/// rows + cols is odd. A ChArUco board or an AprilGrid is identified by its tags.
struct Target {
  TargetKind kind = TargetKind::dot_grid;
  int rows = 0, cols = 0;     ///< dots or corners; rows along y, cols along x
  double pitch_m = 0;         ///< pitch of the dots or an AprilGrid's tags, or the side of a square
  double dot_diameter_m = 0;  ///< 0 for a chessboard
  DotArrangement arrangement = DotArrangement::square;
  DotColour dot_colour = DotColour::black;
  /// Dots with a hole, which tell the plate from itself shifted or turned, as on plates of digital
  /// image correlation; none or three and more.
  std::vector<MarkId> hollow;
  double hollow_diameter_m = 0;  ///< of their holes
  std::string tag_family;        ///< empty without tags
  double tag_edge_m = 0;         ///< outer edge of the black square
  int tag_border = 1;            ///< modules of the black rim around a tag's bits
  std::vector<PrintedTag> tags;  ///< centre (x, y) in the target frame; tag's upper edge towards +y
  std::vector<KnownLength> known_lengths;
  std::optional<double> print_error_m;  ///< standard uncertainty of a point's place on the print
  std::optional<MeasuredPlate> measured;

  /// A dot's centre or a corner in the target frame (metres): as measured, else as drawn, z = 0.
  Document document = {};  ///< the file as it was read
  [[nodiscard]] Eigen::Vector3d point_in_target(MarkId dot) const;
  /// True where the target has a point.
  [[nodiscard]] bool has(MarkId dot) const {
    return dot.row >= 0 && dot.col >= 0 && dot.row < rows && dot.col < cols &&
           (arrangement == DotArrangement::square || (dot.row + dot.col) % 2 == 0);
  }
};

/// Two looks of a cloth's dots, full and with a light centre, arranged so that every window of
/// 3 x 3 dots occurs once: labels where tags cannot be read.
struct DotClasses {
  double light_centre_diameter_m = 0;
  std::vector<std::string> rows;  ///< one text a row, one sign a dot: '#' full, 'o' light centre

  [[nodiscard]] bool is_light(MarkId mark) const { return rows.at(mark.row).at(mark.col) == 'o'; }
};

/// Marks printed on the cloth (print.toml). Material coordinates are (warp, weft) distances in
/// metres from the patch corner beside mark (0, 0); warp grows with row, weft with col.
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
  std::optional<double> square_pixels = {};  ///< promised: standard uncertainty of fy/fx = 1
};

/// A frame set that shows the target lying parallel to its reference pose, raised by z.
struct TargetStage {
  std::string set;
  double z_m = 0;
};

/// One laying of a drape ([[repeat]] in rig.toml): the cloth of a scene laid again on the same
/// object, or, where its set is the scene's, the scene's own laying.
struct DrapeRepeat {
  std::string scene;   ///< name of the scene
  std::string set;     ///< frame set that shows it
  std::string repeat;  ///< its name; the set's where none is given
  std::string face;    ///< side of the cloth that lies up; empty: not stated
};

/// The bench (rig.toml): cameras, target, and which frame sets calibrate it.
struct Rig {
  std::filesystem::path file;  ///< document.file()
  std::string name;
  std::filesystem::path target_file;
  std::filesystem::path print_file;  ///< empty without scenes
  std::filesystem::path recording;   ///< folder of the recording
  std::vector<RigCamera> cameras;
  std::vector<TargetStage> stages;
  std::vector<std::string> free_poses;        ///< frame sets with the target anywhere
  bool estimate_scale_x = false;              ///< Tsai's s_x; fixed at 1 when false
  std::vector<std::filesystem::path> scenes;  ///< in the order of the report; may be empty
  std::vector<int> grids = {11, 21, 31};      ///< particles per side of the paper's model
  double spacing_m = 2.5e-3;                  ///< spacing of the cloth's finest mesh
  std::vector<int> segments;                  ///< line segments per Kawabata curve, e.g. 1 5
  std::vector<DrapeRepeat> repeats;
  /// Mean distance up to which a simulated drape is called a match where nothing was laid again.
  std::optional<double> tolerance_m;

  /// Throws Error(bad_input) when no camera of that name exists.
  Document document = {};  ///< the file as it was read
  [[nodiscard]] const RigCamera& camera(const std::string& camera_name) const;
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

/// Folder of a simulation below its drape's: "simulations/2.5mm-5" of a mesh's finest spacing and
/// the segments of a curve.
[[nodiscard]] std::filesystem::path simulation_folder(double spacing_m, int segments);

[[nodiscard]] Rig read_rig(const std::filesystem::path& file);
[[nodiscard]] Target read_target(const std::filesystem::path& file);
[[nodiscard]] Print read_print(const std::filesystem::path& file);

}  // namespace drape
