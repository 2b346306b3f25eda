// SPDX-License-Identifier: Apache-2.0
#include "compare/hems/hem_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

double circle_m2(double diameter_m) {
  return std::numbers::pi / 4 * diameter_m * diameter_m;
}

/// Throws if a sheet, whose numbers rest on its own specimen, is given another one.
void require_own_specimen(const HemRecord& record, const DrapemeterGeometry& asked) {
  const double own_m = std::sqrt(4 / std::numbers::pi * record.specimen_area_m2);
  if (std::abs(own_m - asked.specimen_m) <= kLengthTolerance * own_m) return;
  throw bad_input(
      fmt::format("the sheet's flat area is that of a round specimen of {:.1f} mm, not {:g} mm",
                  own_m / mm, asked.specimen_m / mm),
      {.file = record.file}, "leave --specimen-mm out: a sheet's specimen is its own flat area");
}

/// Throws unless the disc is inside the shadow and the shadow inside the flat specimen; otherwise a
/// length is in another unit or from another test.
void require_possible(const HemRecord& record, double scale_u, const DrapemeterGeometry& geometry) {
  const double more = 1 + kLengthTolerance + 2 * scale_u;
  const Hem& hem = record.hem;
  std::string wrong;
  if (record.specimen_area_m2 <= circle_m2(geometry.disc_m))
    wrong =
        fmt::format("of a flat specimen smaller than the disc of {:g} mm", geometry.disc_m / mm);
  else if (hem.area_m2 * more * more < circle_m2(geometry.disc_m))
    wrong = fmt::format("smaller than the disc of {:g} mm", geometry.disc_m / mm);
  else if (hem.area_m2 > more * more * record.specimen_area_m2)
    wrong = hem.flat_area_m2
                ? std::string("larger than the flat specimen")
                : fmt::format("larger than the specimen of {:g} mm", geometry.specimen_m / mm);
  const std::size_t half = hem.radius_m.size() / 2;
  for (std::size_t i = 0; i < half && !hem.flat_area_m2; ++i) {
    const double width_m = hem.radius_m[i] + hem.radius_m[i + half];
    if (wrong.empty() && width_m > more * geometry.specimen_m)
      wrong = fmt::format("{:.1f} mm wide, the specimen {:g} mm", width_m / mm,
                          geometry.specimen_m / mm);
  }
  if (wrong.empty()) return;
  throw bad_input(fmt::format("the drape is {} (area {:.4g} mm2)", wrong, hem.area_m2 / (mm * mm)),
                  {.file = record.file},
                  "give lengths in mm, and the test's own --disc-mm and --specimen-mm");
}

/// Warns if the shadow does not contain all of the disc, on which the cloth lies.
void warn_of_disc(HemRecord& record, double scale_u, const DrapemeterGeometry& geometry) {
  const double less = 1 - kLengthTolerance - 2 * scale_u;
  const auto least = std::min_element(record.hem.radius_m.begin(), record.hem.radius_m.end());
  if (least == record.hem.radius_m.end() || *least >= less * geometry.disc_m / 2) return;
  record.warnings.push_back(
      fmt::format("the hem comes to {:.1f} mm from its centre, inside the disc of {:g} mm: is the "
                  "disc another, or a length in another unit?",
                  *least / mm, geometry.disc_m / mm));
}

}  // namespace

void require_surface(double surface_m2, const DrapemeterGeometry& asked, const Where& where) {
  constexpr double kOfDiameter = 0.05;  // covers strain, and chords of coarse meshes
  const double own_m = std::sqrt(4 / std::numbers::pi * surface_m2);
  if (std::abs(own_m - asked.specimen_m) <= kOfDiameter * asked.specimen_m) return;
  throw bad_input(
      fmt::format("the mesh has the surface of a round specimen of {:.1f} mm, not {:g} mm",
                  own_m / mm, asked.specimen_m / mm),
      where, "give the specimen's --specimen-mm; meshes are in mm");
}

void evaluate(HemRecord& record, HemErrors errors, const HemReadOptions& options,
              double area_u_m2) {
  record.specimen_area_m2 =
      record.hem.flat_area_m2.value_or(circle_m2(options.geometry.specimen_m));
  if (record.own_specimen && options.specimen_stated)
    require_own_specimen(record, options.geometry);
  if (options.scale_u) errors.scale_u = std::hypot(errors.scale_u.value_or(0), *options.scale_u);
  // U is 2 standard uncertainties, and the relative error of an area is twice that of its scale.
  const double within_u = area_u_m2 / (4 * record.hem.area_m2);
  const double scale_u = std::hypot(errors.scale_u.value_or(0), within_u);
  require_possible(record, scale_u, options.geometry);
  warn_of_disc(record, scale_u, options.geometry);
  record.numbers = numbers_with_u(record.hem, errors, options.geometry);
  record.nodes = nodes_of(record.hem);
}

void require_geometry(const std::optional<double>& disc_m, const std::optional<double>& specimen_m,
                      const DrapemeterGeometry& asked, const Where& where) {
  const double disc = disc_m.value_or(asked.disc_m);
  const double specimen = specimen_m.value_or(asked.specimen_m);
  const auto same = [](double a_m, double b_m) { return std::abs(a_m - b_m) < 1e-3 * mm; };
  if (same(disc, asked.disc_m) && same(specimen, asked.specimen_m)) return;
  throw bad_input(
      fmt::format("this specimen of {:g} mm hangs over a disc of {:g} mm, not {:g} mm over {:g} mm",
                  specimen / mm, disc / mm, asked.specimen_m / mm, asked.disc_m / mm),
      where, fmt::format("give --disc-mm {:g} --specimen-mm {:g}", disc / mm, specimen / mm));
}

}  // namespace drape::compare
