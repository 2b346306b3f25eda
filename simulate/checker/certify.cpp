// SPDX-License-Identifier: Apache-2.0
#include "simulate/checker/certify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/units.hpp"
#include "simulate/fabric/fitted_laws.hpp"

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;
using units::mm;

constexpr double kEnergyFraction = 1e-6;    // relative to the internal energy
constexpr double kStrainAllowed = 1e-9;     // rounding
constexpr double kShearAllowed_rad = 1e-6;  // last digit of a sine near 90 degrees: 1.5e-8 rad
constexpr double kCurvatureAllowed_per_m = 1e-6;  // last digits of a metre over (1 mm)^2: 1e-10
constexpr double kTwistFraction = 1e-9;           // relative to the twist stiffness
constexpr double kPlaceAllowed_m = 1e-6;  // tolerance of distances, and of the sheet on the surface
constexpr double kMostOfMeasured = 2;  // beyond this, more of a curve is extrapolated than measured

void compare(CertifyReport& report, const std::string& what, double claimed, double found,
             double allowed) {
  report.lines.push_back({what, claimed, found, allowed, false});
}

void compare_strains(CertifyReport& report, const Certificate& claim, const MeshStrains& found) {
  if (!claim.strains) return;
  compare(report, "largest shear (rad)", claim.strains->shear_most_rad, found.shear_most_rad,
          kShearAllowed_rad);
  compare(report, "largest curvature (1/m)", claim.strains->curvature_most_per_m,
          found.curvature_most_per_m, kCurvatureAllowed_per_m);
  for (int d = 0; d < 2; ++d) {
    const std::string thread = d == 0 ? "warp" : "weft";
    const Eigen::Vector2d& claimed = d == 0 ? claim.strains->warp : claim.strains->weft;
    compare(report, "least " + thread + " strain", claimed[0], found.least[d], kStrainAllowed);
    compare(report, "largest " + thread + " strain", claimed[1], found.most[d], kStrainAllowed);
  }
}

void compare_numbers(CertifyReport& report, const Certificate& claim, const ClothLaws& laws,
                     const MeshJudgement& found) {
  compare_strains(report, claim, found.strains);
  compare(report, "twist stiffness (N m)", claim.twist_n_m, laws.twist_n_m,
          kTwistFraction * laws.twist_n_m);
  if (claim.energies && claim.energies->internal_j)
    compare(report, "internal energy (J)", *claim.energies->internal_j, found.energy_j,
            kEnergyFraction * found.energy_j);
  if (claim.distances) {
    const CertificateDistances& distances = *claim.distances;
    if (distances.to_object_m && found.to_object_m)
      compare(report, "least distance to an object (m)", *distances.to_object_m, *found.to_object_m,
              kPlaceAllowed_m);
    compare(report, "least distance to the table (m)", distances.to_table_m, found.to_table_m,
            kPlaceAllowed_m);
    if (claim.at_rest)
      compare(report, "deepest in an object (m)", distances.deepest_m, found.deepest_m,
              kPlaceAllowed_m);
  }
  if (claim.at_rest)
    report.lines.push_back({"residual force (of a point's weight)", claim.residual.value_or(1),
                            found.residual, claim.residual_tolerance, true});
}

/// Largest distance (m) of the sheet's points from their positions on the cloth.
double off_cloth_m(const Sheet& sheet, const MeshJudgement& found, CertifyReport& report) {
  double farthest = 0;
  for (std::size_t i = 0; i < found.places.size(); ++i) {
    const SheetMark& mark = sheet.marks[i];
    if (found.places[i]) {
      farthest = std::max(farthest, (*found.places[i] - mark.point_in_world).norm());
      continue;
    }
    report.refusals.push_back(fmt::format("mark ({}, {}) of the sheet lies beside the cloth",
                                          mark.mark.row, mark.mark.col));
    break;
  }
  return farthest;
}

/// Checks that sheet, certificate and print belong to the same cloth.
void compare_sheet(CertifyReport& report, const RestFiles& files, const Print& print,
                   const MeshJudgement& found) {
  const auto refuse = [&](std::string text) { report.refusals.push_back(std::move(text)); };
  const auto* source = std::get_if<SimulatedSource>(&files.sheet.source);
  if (source == nullptr) return refuse("the sheet is a measured one");
  if ((source->status == "at rest") != files.certificate.at_rest)
    refuse(fmt::format("the sheet says `{}`, the certificate `{}`", source->status,
                       files.certificate.status));
  if (source->segments != files.certificate.segments)
    refuse("sheet and certificate state other numbers of segments");
  if (!((files.sheet.patch_m - print.patch_m).cwiseAbs().maxCoeff() <= kPlaceAllowed_m))
    refuse(fmt::format("the sheet is of a patch of {:g} x {:g} mm, the print has {:g} x {:g} mm",
                       files.sheet.patch_m.x() / mm, files.sheet.patch_m.y() / mm,
                       print.patch_m.x() / mm, print.patch_m.y() / mm));
  report.lines.push_back({"distance of the sheet from the cloth (m)", 0,
                          off_cloth_m(files.sheet, found, report), kPlaceAllowed_m, true});
}

std::vector<HeldPoint> pins_of(const Scene& scene, const Print& print,
                               const std::optional<Sheet>& measured) {
  std::vector<HeldPoint> pins;
  for (const Pin& pin : scene.pins) {
    pins.push_back({pin.material_m(print), pin.point_in_world});
    if (pin.point_in_world || !measured) continue;
    if (const SheetMark* mark = measured->find(pin.mark)) pins.back().place = mark->point_in_world;
  }
  return pins;
}

}  // namespace

bool CertifyLine::passes() const {
  return is_limit ? found <= allowed : std::abs(claimed - found) <= allowed;
}

bool CertifyReport::accepted() const {
  return refusals.empty() && std::all_of(lines.begin(), lines.end(),
                                         [](const CertifyLine& line) { return line.passes(); });
}

RestFiles read_rest_files(const fs::path& folder) {
  RestFiles files;
  const fs::path certificate = folder / "certificate.json", forces = folder / "contact_forces.csv";
  files.certificate = read_certificate(certificate);
  if (!std::holds_alternative<CertificateMesh>(files.certificate.cloth))
    throw bad_input("the drape is of the paper's model, which its own residual forces judge",
                    {.file = certificate.string(), .field = "/options/cloth"},
                    "give the folder of a drape without --paper");
  files.sheet = read_sheet(folder / "sheet.ply");
  files.shape = read_cloth_shape(folder / "cloth.ply");
  files.files = {folder / "sheet.ply", folder / "sheet.json", certificate, folder / "cloth.ply"};
  if (files.certificate.internal_friction) {
    files.files.push_back(folder / "memory.csv");
    files.memory = read_memory(files.files.back());
  }
  const int stated = files.certificate.distances ? files.certificate.distances->contact_forces : 0;
  if (stated == 0) return files;
  files.files.push_back(forces);
  files.contact_forces = read_contact_forces(forces);
  if (files.contact_forces.size() != static_cast<std::size_t>(stated))
    throw bad_input(fmt::format("{} contact forces, the certificate states {}",
                                files.contact_forces.size(), stated),
                    {.file = forces.string()}, "simulate the drape again");
  return files;
}

Eigen::Vector2d strain_limits(const Fabric& fabric) {
  return kMostOfMeasured * Eigen::Vector2d(fabric.tensile[0].x.back(), fabric.tensile[1].x.back());
}

CertifyReport certify(const RestFiles& files, const Scene& scene, const Fabric& fabric,
                      const Print& print, const std::optional<Sheet>& measured) {
  const Certificate& claim = files.certificate;
  Scene judged_in = scene;
  judged_in.friction = claim.friction;
  MeshRest rest;
  rest.shape = files.shape;
  rest.laws = fit_laws(fabric, claim.segments, claim.reach, claim.internal_friction).laws;
  rest.memory = files.memory;
  rest.scene = &judged_in;
  rest.pins = pins_of(scene, print, measured);
  rest.contact_forces = files.contact_forces;
  if (claim.distances) rest.layers_apart_m = claim.distances->layers_apart_m.value_or(0);
  rest.gravity_m_per_s2 = scene.gravity_m_per_s2;
  rest.residual_tolerance = claim.residual_tolerance;
  rest.most_strain = strain_limits(fabric);
  for (const SheetMark& mark : files.sheet.marks) rest.asked_m.push_back(mark.material_m);
  const MeshJudgement found = judge_mesh(rest);
  CertifyReport report;
  if (claim.at_rest) report.refusals = found.refusals;
  compare_numbers(report, claim, rest.laws, found);
  compare_sheet(report, files, print, found);
  if (claim.friction != scene.friction)
    report.warnings.push_back(
        fmt::format("judged with the friction {:g} of the certificate, the "
                    "scene has {:g}",
                    claim.friction, scene.friction));
  return report;
}

}  // namespace drape::simulate
