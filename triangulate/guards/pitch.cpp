// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "core/fields/document.hpp"
#include "core/files/csv.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"
#include "triangulate/guards/guards.hpp"

namespace drape::triangulate {
namespace {

using units::mm;

constexpr double kSigmas = 4;
constexpr std::size_t kLeastPlaces = 8;  ///< places needed along one direction
/// Largest turn of the cloth between neighbours: keeps the next term of the arc, angle^4 / 1920,
/// below 1e-5.
constexpr double kMostTurn_rad = 0.35;
constexpr double kStandInFactor = 10;
constexpr double kGravity_m_per_s2 = 9.80665;

/// Two neighbours with one more mark on each side: chord over pitch, and the curvature of the cloth
/// in between from the turns of the polygon at its ends.
struct Place {
  double chord = 0, sd = 0;
  double mean_turn2 = 0, turn_change2 = 0;  ///< squared mean and difference of the turns, rad^2
  double most_turn_rad = 0;

  /// Arc over chord minus one: half the variance of the tangent's angle between the neighbours, for
  /// curvature that varies linearly from end to end.
  [[nodiscard]] double bend() const { return mean_turn2 / 24 + turn_change2 / 1440; }
};

using Four = std::array<const SheetMark*, 4>;

Eigen::Vector3d turn_between(const Eigen::Vector3d& first, const Eigen::Vector3d& second) {
  const Eigen::Vector3d axis = first.cross(second);
  return axis.normalized() * std::atan2(axis.norm(), first.dot(second));
}

Place place_of(const Four& marks, double pitch_m) {
  const auto chord = [&](std::size_t i) {
    return Eigen::Vector3d(marks.at(i + 1)->point_in_world - marks.at(i)->point_in_world);
  };
  const Eigen::Vector3d before = turn_between(chord(0), chord(1)),
                        after = turn_between(chord(1), chord(2));
  const Eigen::Vector3d along = chord(1).normalized();
  const Eigen::Matrix3d covariance = marks[1]->covariance_m2.value_or(Eigen::Matrix3d::Zero()) +
                                     marks[2]->covariance_m2.value_or(Eigen::Matrix3d::Zero());
  return {chord(1).norm() / pitch_m, std::sqrt(along.dot(covariance * along)) / pitch_m,
          (0.5 * (before + after)).squaredNorm(), (after - before).squaredNorm(),
          std::max(before.norm(), after.norm())};
}

std::vector<Place> places_along(const std::map<MarkId, const SheetMark*>& all, MarkId step,
                                double pitch_m) {
  std::vector<Place> places;
  for (const auto& [id, mark] : all) {
    Four four{};
    bool whole = true;
    for (int k = 0; k < 4; ++k) {
      const auto at = all.find({id.row + k * step.row, id.col + k * step.col});
      whole = whole && at != all.end();
      if (whole) four.at(static_cast<std::size_t>(k)) = at->second;
    }
    if (whole) places.push_back(place_of(four, pitch_m));
  }
  return places;
}

/// Factor by which bend() may be too small: its value on the crest of a wave as short as the turns
/// indicate. A wave of phase x per pitch changes its turns by 2 tan(x/2) of their mean (RMS).
double hidden_factor(const std::vector<Place>& places) {
  double mean2 = 0, change2 = 0;
  for (const Place& place : places) {
    mean2 += place.mean_turn2;
    change2 += place.turn_change2;
  }
  const double x = std::max(1e-3, 2 * std::atan2(std::sqrt(change2), 2 * std::sqrt(mean2)));
  const double seen = std::sin(x / 2) / (x / 2) * std::sin(x);
  return 12 * (0.5 - std::sin(x) / (2 * x)) / (seen * seen);
}

/// Length of cloth over pitch, with its standard uncertainty.
struct Length {
  double ratio = 0, sd = 0;
  std::size_t places = 0;
};

/// Standard uncertainty of a median. Adjacent places share a mark, whose error lengthens one and
/// shortens the other.
double median_sd(const std::vector<Place>& places, double scale_sd) {
  double variance = 0;
  for (const Place& place : places) variance += place.sd * place.sd;
  return std::hypot(std::sqrt(std::numbers::pi / 2 * variance) / static_cast<double>(places.size()),
                    scale_sd);
}

std::optional<Length> length_of(const std::vector<Place>& places, double factor, double part,
                                double scale_sd) {
  if (places.size() < kLeastPlaces) return std::nullopt;
  std::vector<double> ratios;
  ratios.reserve(places.size());
  for (const Place& place : places) ratios.push_back(place.chord * (1 + factor * place.bend()));
  return Length{quantile(ratios, part), median_sd(places, scale_sd), places.size()};
}

/// Bounds of cloth length over pitch: the median, since cloth is never longer than its print, and
/// the 0.9 quantile where hidden curvature is within the noise, as crumpled cloth looks shorter.
struct Lengths {
  std::optional<Length> middle, tautest;
};

Lengths lengths_along(const std::vector<SheetMark>& marks, MarkId step, double pitch_m,
                      double scale_sd) {
  std::map<MarkId, const SheetMark*> all;
  for (const SheetMark& mark : marks) all[mark.mark] = &mark;
  std::vector<Place> places = places_along(all, step, pitch_m);
  const double factor = hidden_factor(places);
  std::erase_if(places, [](const Place& place) { return place.most_turn_rad > kMostTurn_rad; });
  Lengths lengths;
  lengths.middle = length_of(places, 1, 0.5, scale_sd);
  std::erase_if(places, [&](const Place& place) { return (factor - 1) * place.bend() > place.sd; });
  lengths.tautest = length_of(places, factor, 0.9, scale_sd);
  return lengths;
}

constexpr std::array<std::pair<const char*, MarkId>, 2> kDirections = {
    {{"warp", {1, 0}}, {"weft", {0, 1}}}};

/// Initial slope of a tensile curve (N/m) from a file with strain in percent and load in gf/cm.
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
  std::vector<std::string> found;
  for (const auto& [name, step] : kDirections) {
    const auto [middle, tautest] = lengths_along(marks, step, pitch_m, scale_sd);
    const bool longer = middle && middle->ratio > 1 + most_strain + kSigmas * middle->sd;
    const bool shorter = tautest && tautest->ratio < 1 - kSigmas * tautest->sd;
    if (!longer && !shorter) continue;
    const Length& length = longer ? *middle : *tautest;
    found.push_back(fmt::format(
        "{}: pitch_mm = {:g} is not what the marks show: along the {} neighbours lie {:.4f} +- "
        "{:.4f} of it apart ({} places, bends allowed for), and woven cloth under its own weight "
        "stretches by {:.2g} % at most; the marks speak for {:.2f} mm (or the calibration "
        "target's pitch_mm is wrong by as much, or a lens was focused again after the calibration)",
        print_file, pitch_m / mm, name, length.ratio, length.sd, length.places, 100 * most_strain,
        length.ratio * pitch_m / mm));
  }
  return found;
}

UnseenScale unseen_scale(const std::vector<SheetMark>& marks, double pitch_m, double most_strain,
                         double scale_sd) {
  UnseenScale unseen;
  for (const auto& [name, step] : kDirections) {
    const auto [middle, tautest] = lengths_along(marks, step, pitch_m, scale_sd);
    if (middle) {
      const double least = (middle->ratio - kSigmas * middle->sd) / (1 + most_strain) - 1;
      unseen.least = std::max(least, unseen.least.value_or(least));
    }
    if (tautest) {
      const double most = tautest->ratio + kSigmas * tautest->sd - 1;
      unseen.most = std::min(most, unseen.most.value_or(most));
    }
  }
  return unseen;
}

std::string scale_text(const UnseenScale& unseen) {
  const auto text = [](const std::optional<double>& limit) {
    return limit ? fmt::format("{:+.2f} %", 100 * *limit) : std::string("any amount");
  };
  return fmt::format(
      "if the print's pitch_mm is true, all lengths may be wrong by {} to {} (the target's "
      "pitch_mm, a lens focused again after the calibration); the stated uncertainty does not hold "
      "such a mistake",
      text(unseen.least), text(unseen.most));
}

double most_strain_of(const Scene& scene, const Eigen::Vector2d& patch_m) {
  constexpr const char* kDensity = "areal_density_g_per_m2";
  const Document fabric = Document::read(scene.fabric_file);
  const Value* density = fabric.root().find(kDensity);
  if (density == nullptr || !density->is_number() || !(density->number() > 0))
    throw bad_input(fmt::format("`{}` is missing, or not a number above 0", kDensity),
                    fabric.where(kDensity), "give the mass per area");
  const Value* tensile = fabric.root().find("tensile");
  const Value* stand_ins = fabric.root().find("stand_ins");
  const bool is_stand_in =
      stand_ins != nullptr && one_line(*stand_ins).find("tensile") != std::string::npos;
  double strain = 0;
  int side = 0;
  for (const char* key : {"warp", "weft"}) {
    const Value* name = tensile == nullptr ? nullptr : tensile->find(key);
    const auto* curve = name == nullptr ? nullptr : name->get_if<std::string>();
    if (curve == nullptr) return kStandInFactor * 1e-3;
    const double slope = first_slope(fabric.beside(*curve));
    const double weight = density->number() * units::g_per_m2 * kGravity_m_per_s2;
    if (slope > 0) strain = std::max(strain, weight * patch_m[side] / slope);
    ++side;
  }
  return (is_stand_in ? kStandInFactor : 1) * strain;
}

}  // namespace drape::triangulate
