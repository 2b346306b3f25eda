// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "core/files/csv.hpp"
#include "core/files/toml_file.hpp"
#include "core/units.hpp"
#include "triangulate/guards/guards.hpp"

namespace drape::triangulate {
namespace {

using units::mm;

constexpr double kSigmas = 4;
constexpr std::size_t kLeastPlaces = 8;  ///< places along one direction; fewer say nothing
/// Three marks that turn by more are left out: the next term of the arc, angle^4 / 1920, stays
/// below 1e-5.
constexpr double kMostTurn_rad = 0.35;
constexpr double kStandInFactor = 10;
constexpr double kGravity_m_per_s2 = 9.80665;

/// Arc over pitch of three marks in a line, and its standard deviation from their covariances.
struct Place {
  double ratio = 0, sd = 0;
};

std::optional<Place> place_of(const SheetMark& a, const SheetMark& b, const SheetMark& c,
                              double pitch_m) {
  const Eigen::Vector3d first = b.point_in_world - a.point_in_world;
  const Eigen::Vector3d second = c.point_in_world - b.point_in_world;
  const double lengths = first.norm() + second.norm();
  const double turn = std::atan2(first.cross(second).norm(), first.dot(second));
  if (turn > kMostTurn_rad) return std::nullopt;
  const Eigen::Vector3d along = (c.point_in_world - a.point_in_world).normalized();
  const Eigen::Matrix3d covariance = a.covariance_m2.value_or(Eigen::Matrix3d::Zero()) +
                                     c.covariance_m2.value_or(Eigen::Matrix3d::Zero());
  return Place{lengths / (2 * pitch_m) * (1 + turn * turn / 24),
               std::sqrt(along.dot(covariance * along)) / (2 * pitch_m)};
}

double quantile(const std::vector<Place>& sorted, double part) {
  return sorted[static_cast<std::size_t>(part * static_cast<double>(sorted.size() - 1))].ratio;
}

std::vector<Place> places_along(const std::map<MarkId, const SheetMark*>& all, MarkId step,
                                double pitch_m) {
  std::vector<Place> places;
  for (const auto& [id, mark] : all) {
    const auto before = all.find({id.row - step.row, id.col - step.col});
    const auto after = all.find({id.row + step.row, id.col + step.col});
    if (before == all.end() || after == all.end()) continue;
    if (const auto place = place_of(*before->second, *mark, *after->second, pitch_m))
      places.push_back(*place);
  }
  std::sort(places.begin(), places.end(),
            [](const Place& a, const Place& b) { return a.ratio < b.ratio; });
  return places;
}

/// First slope of a tensile curve (N/m); the abscissa is in percent, the load in gf/cm.
double first_slope(const std::filesystem::path& file) {
  const Csv curve =
      read_csv(file, {"strain_percent", "loading_force_gf_per_cm", "unloading_force_gf_per_cm"});
  for (std::size_t i = 0; i < curve.lines.size(); ++i) {
    const double strain = curve.columns[0][i] * units::percent;
    const double load = curve.columns[1][i] * units::gf_per_cm;
    if (strain > 0 && load > 0) return load / strain;
  }
  return 0;
}

}  // namespace

std::vector<std::string> contradictions_of_pitch(const std::vector<SheetMark>& marks,
                                                 double pitch_m, double most_strain,
                                                 double scale_sd, const std::string& print_file) {
  std::map<MarkId, const SheetMark*> all;
  for (const SheetMark& mark : marks) all[mark.mark] = &mark;
  std::vector<std::string> found;
  for (const auto& [name, step] :
       {std::pair{"warp", MarkId{1, 0}}, std::pair{"weft", MarkId{0, 1}}}) {
    const std::vector<Place> places = places_along(all, step, pitch_m);
    if (places.size() < kLeastPlaces) continue;
    double variance = 0;
    for (const Place& place : places) variance += place.sd * place.sd;
    const auto n = static_cast<double>(places.size());
    // Neighbouring places have marks in common, so that a third of them are independent.
    const double sd = std::hypot(std::sqrt(std::numbers::pi / 2 * 3 * variance / n / n), scale_sd);
    const double middle = quantile(places, 0.5), tautest = quantile(places, 0.9);
    // Cloth cannot be longer than its print; shorter it can look where it is crumpled, not where it
    // is taut.
    const bool longer = middle > 1 + most_strain + kSigmas * sd;
    const bool shorter = tautest < 1 - kSigmas * sd;
    if (!longer && !shorter) continue;
    const double factor = longer ? middle : tautest;
    found.push_back(fmt::format(
        "{}: pitch_mm = {:g} is not what the marks show: along the {} neighbours lie {:.4f} +- "
        "{:.4f} of it apart ({} places, bends allowed for), and woven cloth under its own weight "
        "stretches by {:.2g} % at most; the marks speak for {:.2f} mm (or the calibration "
        "target's pitch_mm is wrong by as much)",
        print_file, pitch_m / mm, name, factor, sd, places.size(), 100 * most_strain,
        factor * pitch_m / mm));
  }
  return found;
}

double most_strain_of(const Scene& scene, const Eigen::Vector2d& patch_m) {
  const TomlTable root = TomlTable::open(scene.fabric_file, "fabric");
  const double density = root.positive("areal_density_g_per_m2") * units::g_per_m2;
  const auto tensile = root.optional_table("tensile");
  if (!tensile || !tensile->has("warp") || !tensile->has("weft")) return kStandInFactor * 1e-3;
  double factor = 1;
  if (root.has("stand_ins")) {
    for (const std::string& what : root.texts("stand_ins"))
      if (what.find("tensile") != std::string::npos) factor = kStandInFactor;
  }
  double strain = 0;
  int side = 0;
  for (const char* key : {"warp", "weft"}) {
    const double slope = first_slope(tensile->file_path(key));
    if (slope > 0) strain = std::max(strain, density * kGravity_m_per_s2 * patch_m[side] / slope);
    ++side;
  }
  return factor * strain;
}

}  // namespace drape::triangulate
