// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "core/geometry/closed_mesh.hpp"
#include "core/run_report.hpp"
#include "core/sheet.hpp"
#include "core/statistics/sample.hpp"

namespace drape::compare {

/// A point of a sheet with its local frame; world frame, metres.
struct SurfacePoint {
  Eigen::Vector3d point_in_world;
  Eigen::Vector3d along_warp;  ///< unit tangent in the direction of increasing rows
  Eigen::Vector3d along_weft;  ///< unit tangent in the direction of increasing columns
  Eigen::Vector3d normal;      ///< unit normal on the printed side: warp cross weft
};

/// A sheet as a surface over material coordinates: bilinear on each cell of the particle grid. The
/// warp coordinate must depend on the row only and the weft coordinate on the column only.
class Surface {
 public:
  /// `file` names the sheet in errors. Throws Error(bad_input) if the points do not form a grid or
  /// there are fewer than 2x2.
  Surface(const Sheet& sheet, const std::string& file);

  /// nullopt outside the grid (1 nm tolerance), in a cell with a missing corner, or if the cell is
  /// degenerate and has no normal.
  [[nodiscard]] std::optional<SurfacePoint> at(const Eigen::Vector2d& material_m) const;

 private:
  [[nodiscard]] const std::optional<Eigen::Vector3d>& point(std::size_t row, std::size_t col) const;

  std::array<std::vector<double>, 2> lines_m_;  ///< material coordinate of each row, each column
  std::vector<std::optional<Eigen::Vector3d>> points_;
};

/// Material coordinates of every mark of a lattice, including gaps, derived from the marks that
/// have a position: the coordinates are linear in row and column. nullopt if fewer than two rows or
/// columns are measured. Throws Error(bad_input) if the marks are not on such a lattice.
struct LatticeCoordinates {
  Eigen::Vector2d origin_m = Eigen::Vector2d::Zero(), pitch_m = Eigen::Vector2d::Zero();

  [[nodiscard]] static std::optional<LatticeCoordinates> of(const Sheet& sheet,
                                                            const std::string& file);
  [[nodiscard]] Eigen::Vector2d at(MarkId mark) const {
    return origin_m + pitch_m.cwiseProduct(Eigen::Vector2d(mark.row, mark.col));
  }
};

/// Material coordinates of the sheet's marks, and those of all marks of its lattice, also the gaps;
/// the same without a lattice.
[[nodiscard]] std::vector<Eigen::Vector2d> places_of(const Sheet& sheet);
[[nodiscard]] std::vector<Eigen::Vector2d> lattice_places_of(const Sheet& sheet,
                                                             const std::string& file);

/// A surface of triangles in the world frame, metres.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<std::size_t, 3>> triangles;
};

[[nodiscard]] double area_m2(const TriangleMesh& mesh);

/// Divides each cell of the sheet's grid that has four corners into two triangles.
[[nodiscard]] TriangleMesh mesh_of(const Sheet& sheet);

/// Finds the nearest point of a surface with a tree of boxes.
struct NearestSurface : TriangleTree {
  /// Throws Error(bad_input) if there is no triangle.
  explicit NearestSurface(const TriangleMesh& mesh);

  [[nodiscard]] double distance_m(const Eigen::Vector3d& point) const {
    return std::sqrt(nearest(point).squared);
  }
};

/// Distances from one surface to another in one direction.
struct OneDirection {
  double mean_m = 0;       ///< area-weighted
  double rms_m = 0;        ///< area-weighted
  double hausdorff_m = 0;  ///< maximum over the samples
};

/// Distance of two surfaces without point correspondence. It never exceeds the distance of
/// corresponding points: sliding of the cloth along itself does not count.
struct SurfaceDistance {
  OneDirection first_to_second, second_to_first;
  [[nodiscard]] double mean_m() const {  ///< mean of both directions
    return 0.5 * (first_to_second.mean_m + second_to_first.mean_m);
  }
  [[nodiscard]] double hausdorff_m() const {  ///< maximum of both directions
    return std::max(first_to_second.hausdorff_m, second_to_first.hausdorff_m);
  }
};

/// Samples all vertices, and the centroids of each triangle divided into n^2 equal ones with sides
/// of at most `spacing_m`. Means weight the centroids by area; the Hausdorff distance also uses the
/// vertices and is too small by at most `spacing_m`.
[[nodiscard]] SurfaceDistance surface_distance(const TriangleMesh& first,
                                               const TriangleMesh& second, double spacing_m);

/// Distance of one measured mark from its position on a virtual sheet.
struct MarkError {
  MarkId mark;
  Eigen::Vector2d material_m;        ///< (warp, weft)
  Eigen::Vector3d real_in_world;     ///< metres
  Eigen::Vector3d virtual_in_world;  ///< metres
  double distance_m = 0;
  /// real - virtual along the virtual sheet's warp tangent, weft tangent and normal. The tangents
  /// are not orthogonal in sheared cloth, so the squares do not add up.
  Eigen::Vector3d warp_weft_normal_m;
  std::optional<double> sigma_mark_m;  ///< standard deviation of the mark in its worst direction
  std::optional<double> sigma_distance_m;  ///< standard deviation of distance; distance_sigma_m()
  std::optional<double> sigma_normal_m;    ///< standard deviation of the component along the normal
  std::optional<int> views;
};

/// Uncertainty of a statistic. Its two parts have different meanings and are not combined:
/// `sigma_m` is due to the measurement of the marks, `bootstrap` to the choice of marks on the
/// cloth.
struct Trust {
  /// Standard deviation due to the marks' covariances, first order, independent marks. Absent if a
  /// mark has no covariance.
  std::optional<double> sigma_m;
  /// 95 % percentile interval over resampled marks (Efron 1979), m. Absent for fewer than 2 marks.
  std::optional<Interval> bootstrap;
};

/// Statistics of distances, in metres; the 95th percentile is interpolated between order
/// statistics, and without a rigid alignment shape and place are absent.
struct DistanceStatistics : ReportedDistance {
  MarkId worst_mark;                  ///< mark of the maximum (the first one)
  Trust mean, median, rms, p95, max;  ///< mean.sigma_m equals sigma_mean_m
};

/// Mean of the signed distances along the virtual sheet's normal; positive if the real cloth is on
/// the printed side of the virtual one.
struct NormalStatistics {
  double mean_m = 0;
  double rms_m = 0;
  Trust mean;
};

/// A mark that could not be compared, with the reason.
using Excluded = Gap;

struct MarkComparison {
  std::vector<MarkError> marks;    ///< ordered by mark
  std::vector<Excluded> excluded;  ///< measured, but without a position on the virtual sheet
};

/// Standard deviation of |virtual - real| from the covariance C of the real mark: sqrt(u' C u),
/// with u the unit vector between both (first order). If they coincide u is undefined and the worst
/// direction is used.
[[nodiscard]] double distance_sigma_m(const Eigen::Vector3d& difference_m,
                                      const Eigen::Matrix3d& covariance_m2);

/// Standard deviation in the worst direction: root of the largest eigenvalue.
[[nodiscard]] double worst_sigma_m(const Eigen::Matrix3d& covariance_m2);
/// The same for a measured mark; nullopt without a covariance.
[[nodiscard]] inline std::optional<double> worst_sigma_m(const SheetMark& mark) {
  return mark.covariance_m2 ? std::optional(worst_sigma_m(*mark.covariance_m2)) : std::nullopt;
}

/// Distances between the measured marks and the virtual sheet at the marks' material coordinates.
[[nodiscard]] MarkComparison compare_marks(const Sheet& measured, const Surface& virtual_sheet);

/// Distances between two virtual sheets at material coordinates; points missing from one of them
/// are left out, as the size of the result shows.
[[nodiscard]] std::vector<double> distances_between(const Surface& first, const Surface& second,
                                                    const std::vector<Eigen::Vector2d>& material_m);

/// Throws Error(internal) if there are no distances.
[[nodiscard]] DistanceStatistics statistics_of(const std::vector<MarkError>& marks);
[[nodiscard]] NormalStatistics normal_statistics_of(const std::vector<MarkError>& marks);
[[nodiscard]] DistanceStatistics statistics_of(const std::vector<double>& distances_m);
/// The same with bootstrap intervals and, if there is a sigma for each distance, their uncertainty.
[[nodiscard]] DistanceStatistics statistics_of(const std::vector<double>& distances_m,
                                               const std::vector<double>& sigmas_m);

/// Number of resamples per interval, so that its ends are the 50th value from below and above.
inline constexpr int kResamples = 2000;

/// Sets the bootstrap intervals of mean, median, RMS, 95th percentile and maximum. The seed is
/// fixed, so equal distances give equal intervals. Marks are drawn as if independent; those of a
/// cloth are correlated, so the true interval is somewhat wider.
void add_bootstrap(const std::vector<double>& distances_m, DistanceStatistics& statistics);

/// Sets the standard deviation of each statistic to first order, from independent sigmas in the
/// order of the distances; the gradient of an order statistic is the weight of each sorted value.
void add_sigmas(const std::vector<double>& distances_m, const std::vector<double>& sigmas_m,
                DistanceStatistics& statistics);

/// Remaining distances after moving the real marks onto the virtual ones as a rigid body. Reported
/// in addition to the distances, never instead: the position of the cloth is part of the
/// comparison.
struct RigidAlignment {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< virtual_from_real, about the origin
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();  ///< in world; p_virtual = rotation p + shift
  double turn_rad = 0;                                ///< angle of the rotation
  double centroid_shift_m = 0;                        ///< displacement of the real centroid
  DistanceStatistics after;
};

/// Least-squares alignment without scale (Kabsch 1976; Umeyama 1991). nullopt for fewer than three
/// marks or collinear ones, which leave the rotation undetermined.
[[nodiscard]] std::optional<RigidAlignment> align(const std::vector<MarkError>& marks);

/// Relative change from the flat print: length of the straight line between two adjacent marks
/// along the warp or weft, which a fold shortens without any strain of the threads, or area of the
/// cell between four marks, as two triangles.
struct Strain {
  std::string kind;  ///< "warp", "weft" or "area"
  MarkId from, to;   ///< ends of the line, or corners of the cell of lowest and highest row and col
  double real = 0, simulated = 0;  ///< ratios: 0.01 means one per cent more
};

/// Root mean square of real minus simulated strain.
struct StrainSummary {
  std::optional<double> warp, weft, area;  ///< ratios; absent if there is no such line or cell
};

struct StrainMaps {
  std::vector<Strain> strains;  ///< lines, then cells
  StrainSummary difference;
};

/// Strains of the measured marks' lattice, and of the virtual sheet at the same material points.
/// Covers lines and cells whose marks all exist on both.
[[nodiscard]] StrainMaps strain_maps(const Sheet& measured, const Surface& virtual_sheet);

}  // namespace drape::compare
