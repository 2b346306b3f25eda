// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/fields/records.hpp"
#include "core/marks.hpp"

namespace drape {

/// A labelled dot (of the cloth or the target) with its fitted ellipse.
struct Detection {
  MarkId mark;
  Eigen::Vector2d centre_px;
  Eigen::Matrix2d covariance_px2;
  Eigen::Vector2d semi_axes_px;  ///< major, minor; of a corner: half of its search window
  double axis_angle_rad = 0;     ///< from +u towards the major axis
  double contrast = 0;           ///< grey-level difference between print and cloth
  double chi2_per_dof = 0;       ///< misfit of the ellipse, in units of the frame's noise
};

/// A measured dot without a tag or labelled neighbour, in an isolated piece of the lattice.
/// `dot.mark` counts rows and columns within the piece, up to an unknown shift and quarter turns
/// (never a reflection, since only one side is printed).
struct IslandDot {
  int island = 0;  ///< number of the piece within its frame
  Detection dot;
};

/// A mark candidate that was not used, with its label if known.
struct Rejection {
  std::optional<MarkId> mark;
  std::optional<Eigen::Vector2d> centre_px;
  std::string reason;
};

struct TagDetection {
  int id = 0;
  Eigen::Matrix<double, 2, 4> corners_px;  ///< in the order in which the print lists tag corners
};

enum class Surface { cloth, target };
template <>
inline constexpr std::string_view names_of<Surface>[] = {"cloth", "target"};

/// Kind and material coordinates of the marks on the print; makes the file self-contained.
struct MarkLattice {
  Surface surface = Surface::cloth;
  int rows = 0, cols = 0;
  double pitch_m = 0;
  double dot_diameter_m = 0;
  Eigen::Vector2d patch_m = Eigen::Vector2d::Zero();   ///< (warp, weft); zero for a target
  Eigen::Vector2d margin_m = Eigen::Vector2d::Zero();  ///< material coordinates of mark (0, 0), m
  std::string sha256;                                  ///< SHA-256 of print.toml or target.toml
};

struct FrameDetections {
  std::string set;
  std::string camera;
  int width_px = 0, height_px = 0;
  std::string image_sha256;
  std::optional<std::string> preview_file;  ///< small JPEG beside the detections for the report
  std::optional<double> preview_scale;      ///< preview pixels per image pixel
  std::optional<double> noise_sigma;  ///< standard deviation, grey levels; estimated from the frame
  std::vector<Detection> detections;  ///< ordered by mark, each mark at most once
  std::vector<IslandDot> islands;     ///< ordered by piece, then by position within it
  std::vector<Rejection> rejections;
  std::vector<TagDetection> tags;  ///< ordered by id
};

/// detections.json: detect -> calib, triangulate. Frames ordered by set, then camera.
struct Detections {
  std::string rig;
  MarkLattice lattice;
  std::vector<FrameDetections> frames;
  /// Reason by set why no measurement from it can be trusted; unlisted sets are GO.
  std::map<std::string, std::string> no_go = {};
  Document document = {};  ///< the file as it was read

  /// A sentence about the first of the given sets that is NO-GO; nullopt if none is.
  [[nodiscard]] std::optional<std::string> reason_against(
      const std::vector<std::string>& sets) const;
};

template <>
inline constexpr Format format_of<Detections>{"detections", Syntax::json, 1,
                                              "detections.json: marks found in the pictures"};
void fields(Fields& f, Detections& detections);
[[nodiscard]] Detections read_detections(const std::filesystem::path& file);
void write_detections(const std::filesystem::path& file, const Detections& detections);

}  // namespace drape
