// SPDX-License-Identifier: Apache-2.0
#include "triangulate/guards/guards.hpp"

#include <fmt/format.h>

#include "core/error.hpp"
#include "core/rig.hpp"
#include "core/rules.hpp"
#include "core/units.hpp"
#include "triangulate/guards/detection_limit.hpp"
#include "triangulate/guards/held.hpp"
#include "triangulate/guards/mesh_gaps.hpp"

namespace drape::triangulate {
namespace {

using units::mm;

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
  // Points from rays that do not meet say nothing about lengths.
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
  // Lengths of cloth prove nothing about objects if they contradict the print itself, and
  // unsupported level cloth proves less than an object that is already contradicted.
  if (found.empty()) {
    const SeenCloth seen = seen_cloth(sheet, strain, *options.scene, options.threads);
    add(contradictions_of_objects(seen, *options.scene));
    if (found.empty()) add(contradictions_of_support(seen, *options.scene));
  }
  const std::vector<std::string> held = contradictions_of_held(sheet, *options.scene, lattice);
  add(held);
  // If the cloth hangs from other points than stated, its centre of mass proves nothing.
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
