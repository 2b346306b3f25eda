// SPDX-License-Identifier: Apache-2.0
#include "triangulate/guards/guards.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/files/files.hpp"
#include "core/scene.hpp"
#include "core/statistics/sample.hpp"
#include "triangulate/guards/held.hpp"

namespace drape::triangulate {

using units::mm;

namespace {

constexpr double kSigmas = 4;
constexpr std::size_t kLeastPlaces = 8;  ///< least number of spans along one direction
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

/// Standard uncertainty of a median. Adjacent spans share a mark; its error lengthens one and
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

/// Largest strain along warp or weft of the scene's fabric if the whole patch hangs from one edge,
/// from the first points of its tensile curves. Curves marked as stand-ins may be wrong by a factor
/// of 10. Throws Error(bad_input) for an unreadable fabric.
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
    const auto* curve = tensile == nullptr ? nullptr : tensile->find_as<std::string>(key);
    if (curve == nullptr) return kStandInFactor * 1e-3;
    const double slope = first_slope(fabric.beside(*curve));
    const double weight = density->number() * units::g_per_m2 * kGravity_m_per_s2;
    if (slope > 0) strain = std::max(strain, weight * patch_m[side] / slope);
    ++side;
  }
  return (is_stand_in ? kStandInFactor : 1) * strain;
}

/// Limit of the median misfit in standard deviations. Errors common to all marks (a camera's pose)
/// exceed it once in 400 cases if the covariances are right.
constexpr double kMissSigmas = 3;
constexpr std::size_t kLeastMarks = 8;
/// Largest number of cameras for which every permutation is tried; with more, only pairs.
constexpr std::size_t kEveryOrder = 4;

Misses misses_with(const Detections& detections, const Calibration& calibration,
                   const std::string& set, const TriangulateOptions& options) {
  const JointPlaces places = joint_places(calibration);
  std::vector<double> all;
  for (const MarkViews& mark :
       collect_views(detections, calibration, places, set, options.floor_px)) {
    if (mark.views.size() < 2) continue;
    const Point point = solve_point(mark.views, options.min_angle_deg * units::deg);
    if (point.status == PointStatus::not_observable) continue;
    all.push_back(point.status == PointStatus::good ? point.disagreement_sigmas() : 1e6);
  }
  if (all.empty()) return {};
  return {median(all), all.size()};
}

/// Frames of the set only, with cameras renamed by `names`; an empty name drops a
/// frame.
Detections renamed(const Detections& detections, const std::string& set,
                   const std::map<std::string, std::string>& names) {
  Detections result;
  result.rig = detections.rig;
  result.lattice = detections.lattice;
  for (FrameDetections frame : detections.frames) {
    if (frame.set != set || names.at(frame.camera).empty()) continue;
    frame.camera = names.at(frame.camera);
    result.frames.push_back(std::move(frame));
  }
  return result;
}

std::map<std::string, std::string> named(const std::vector<std::string>& from,
                                         const std::vector<std::string>& to) {
  std::map<std::string, std::string> names;
  for (std::size_t i = 0; i < from.size(); ++i) names[from[i]] = to[i];
  return names;
}

std::vector<std::vector<std::string>> orders_of(const std::vector<std::string>& cameras) {
  std::vector<std::vector<std::string>> orders;
  if (cameras.size() <= kEveryOrder) {
    std::vector<std::string> order = cameras;
    std::sort(order.begin(), order.end());
    do orders.push_back(order);
    while (std::next_permutation(order.begin(), order.end()));
    return orders;
  }
  for (std::size_t a = 0; a < cameras.size(); ++a) {
    for (std::size_t b = a + 1; b < cameras.size(); ++b) {
      orders.push_back(cameras);
      std::swap(orders.back()[a], orders.back()[b]);
    }
  }
  return orders;
}

std::string exchanged_text(const std::vector<std::string>& from,
                           const std::vector<std::string>& to) {
  std::string text;
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (from[i] != to[i])
      text += fmt::format("{}{} shows what {} saw", text.empty() ? "" : ", ", from[i], to[i]);
  }
  return text;
}

bool same_size(const Calibration& calibration, const std::vector<std::string>& from,
               const std::vector<std::string>& to) {
  for (std::size_t i = 0; i < from.size(); ++i) {
    const CameraModel &a = calibration.camera(from[i]).camera.model,
                      &b = calibration.camera(to[i]).camera.model;
    if (a.width_px != b.width_px || a.height_px != b.height_px) return false;
  }
  return true;
}

/// Explains why most views do not meet: cameras exchanged in this set, or one that moved after the
/// calibration. Empty if half of the marks agree within three sigma. `now` is after correction of
/// the dots' shape.
std::vector<std::string> contradictions_of_cameras(const Detections& detections,
                                                   const Calibration& calibration,
                                                   const std::string& set,
                                                   const TriangulateOptions& options,
                                                   const Misses& now) {
  if (now.marks < kLeastMarks || now.median_sigmas <= kMissSigmas) return {};
  // Without the correction of dot shapes, dots on curved cloth also miss by over three sigma.
  const double solved = std::max(kMissSigmas, now.median_sigmas / 10);
  std::vector<std::string> cameras;
  for (const FrameDetections& frame : detections.frames)
    if (frame.set == set) cameras.push_back(frame.camera);
  const std::string missed = fmt::format(
      "set {}: the views of {} marks miss each other by {} sigma (median)", set, now.marks,
      now.median_sigmas < 1e5 ? fmt::format("{:.1f}", now.median_sigmas) : "more than 100000");
  for (const std::vector<std::string>& order : orders_of(cameras)) {
    if (order == cameras || !same_size(calibration, cameras, order)) continue;
    const Misses then =
        misses_with(renamed(detections, set, named(cameras, order)), calibration, set, options);
    if (then.median_sigmas > solved || 2 * then.marks < now.marks) continue;
    return {fmt::format(
        "{}: cameras are exchanged, {} (named so the {} marks agree within {:.1f} sigma); rename "
        "its files in the recording, or import the set again",
        missed, exchanged_text(cameras, order), then.marks, then.median_sigmas)};
  }
  if (cameras.size() >= 3) {
    std::string odd;
    double least = solved;
    for (const std::string& camera : cameras) {
      auto names = named(cameras, cameras);
      names[camera].clear();
      const Misses then = misses_with(renamed(detections, set, names), calibration, set, options);
      if (then.marks < kLeastMarks || then.median_sigmas > least) continue;
      least = then.median_sigmas;
      odd = camera;
    }
    if (!odd.empty())
      return {fmt::format(
          "{}: {} moved after the calibration, or its picture is of another set (without it the "
          "others agree within {:.1f} sigma); calibrate again, then take the set again",
          missed, odd, least)};
  }
  return {missed +
          ": a camera moved after the calibration, or a picture is of another set; calibrate "
          "again, then take the set again"};
}

SeenCloth seen_cloth(const Sheet& sheet, double strain, const Scene& scene, int threads) {
  SeenCloth seen{sheet, spans_of(sheet, strain)};
  for (const Obstacle& object : scene.obstacles) {
    const auto* mesh = std::get_if<MeshObject>(&object);
    seen.mesh_gaps_m.push_back(mesh != nullptr ? gaps_to_mesh(sheet, *mesh, threads)
                                               : std::vector<double>{});
  }
  return seen;
}

double strain_of(const MarkLattice& lattice, const TriangulateOptions& options) {
  constexpr double kStrain = 0.01;  // without a fabric: ten times the strain of hanging woven cloth
  return options.scene ? most_strain_of(*options.scene, lattice.patch_m) : kStrain;
}

/// Scale error of a calibration with uniform errors: at most a scale over half the patch.
double scale_sd_of(const Sheet& sheet, const MarkLattice& lattice) {
  const double calibration_m =
      sheet.error_budget ? sheet.error_budget->calibration_m.value_or(0) : 0;
  return calibration_m / (0.5 * lattice.patch_m.minCoeff());
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

void require_detected_print(const MarkLattice& lattice, const Scene& scene) {
  const Print print = print_of(scene);
  constexpr double kRounding_m = 1e-9;  // rounding of millimetres in a text file
  const auto same = [](const auto& one, const auto& other) {
    return (one - other).norm() < kRounding_m;
  };
  if (print.rows == lattice.rows && print.cols == lattice.cols &&
      same(print.patch_m, lattice.patch_m) && same(print.margin_m, lattice.margin_m) &&
      same(Eigen::Vector2d(print.pitch_m, print.dot_diameter_m),
           Eigen::Vector2d(lattice.pitch_m, lattice.dot_diameter_m)))
    return;
  throw bad_input(
      fmt::format(
          "the marks were detected with another print: {} x {} marks, pitch {} mm, diameter "
          "{} mm, patch {} x {} mm, margin {} x {} mm",
          lattice.rows, lattice.cols, lattice.pitch_m / mm, lattice.dot_diameter_m / mm,
          lattice.patch_m.x() / mm, lattice.patch_m.y() / mm, lattice.margin_m.x() / mm,
          lattice.margin_m.y() / mm),
      {.file = scene.print_file.string()}, "detect again with this print, or name its scene");
}

std::vector<std::string> contradictions_of(const Detections& detections,
                                           const Calibration& calibration, const std::string& set,
                                           const TriangulateOptions& options, const Misses& misses,
                                           const std::vector<SheetMark>& placed,
                                           const Sheet& sheet) {
  const std::vector<std::string> found =
      contradictions_of_cameras(detections, calibration, set, options, misses);
  // Points from rays that do not meet carry no evidence about lengths.
  if (!found.empty()) return found;
  return contradictions_of_sheet(detections.lattice, options, placed, sheet);
}

std::vector<std::string> contradictions_of_sheet(const MarkLattice& lattice,
                                                 const TriangulateOptions& options,
                                                 const std::vector<SheetMark>& placed,
                                                 const Sheet& sheet) {
  std::vector<std::string> found;
  const auto add = [&](const std::vector<std::string>& more) {
    found.insert(found.end(), more.begin(), more.end());
  };
  const double strain = strain_of(lattice, options);
  add(contradictions_of_pitch(placed, lattice.pitch_m, strain, scale_sd_of(sheet, lattice),
                              options.scene ? options.scene->print_file.string() : "print.toml"));
  if (!options.scene) return found;
  // Cloth lengths that contradict the print itself are no evidence about objects, and unsupported
  // level cloth is weaker evidence than an already contradicted object.
  if (found.empty()) {
    const SeenCloth seen = seen_cloth(sheet, strain, *options.scene, options.threads);
    add(contradictions_of_objects(seen, *options.scene));
    if (found.empty()) add(contradictions_of_support(seen, *options.scene));
  }
  const std::vector<std::string> held = contradictions_of_held(sheet, *options.scene, lattice);
  add(held);
  // If the cloth hangs from other points than stated, its centre of mass is no evidence.
  if (held.empty()) add(contradictions_of_gravity(MeasuredCloth(sheet), *options.scene, lattice));
  return found;
}

std::vector<Unseen> unseen_errors_of(const Detections& detections,
                                     const TriangulateOptions& options, const Sheet& sheet) {
  const MarkLattice& lattice = detections.lattice;
  const double strain = strain_of(lattice, options);
  std::vector<Unseen> unseen;
  if (options.scene)
    unseen = detection_limits(seen_cloth(sheet, strain, *options.scene, options.threads),
                              *options.scene);
  if (options.scene)
    for (const auto& [name, limits] : unseen_of_held(sheet, *options.scene, lattice))
      unseen.push_back({name, limits});
  unseen.push_back({"scale", scale_text(unseen_scale(sheet.marks, lattice.pitch_m, strain,
                                                     scale_sd_of(sheet, lattice)))});
  return unseen;
}

}  // namespace drape::triangulate
