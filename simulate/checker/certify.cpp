// SPDX-License-Identifier: Apache-2.0
#include "simulate/checker/certify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/files/csv.hpp"
#include "core/files/json_file.hpp"
#include "core/units.hpp"
#include "simulate/checker/layers.hpp"
#include "simulate/checker/mesh_contact.hpp"
#include "simulate/checker/scene.hpp"
#include "simulate/checker/sheet.hpp"

namespace drape::simulate {

namespace {

using checker::Mechanics;
using checker::Objects;
using checker::Point;
using checker::Real;
using checker::SheetSpec;
using checker::Support;

constexpr Real kSunk = 0.1e-3L;  // m; a particle deeper than this in an object cannot rest
// Relative to the tolerance: rounding of the file, places of contact
constexpr Real kResidualMargin = 1.05L;
constexpr Real kTouch = 5e-6L;  // m; a place nearer to an object than this may press on it
// A sharp edge or corner that presses sinks in elastically, so it may lie this deep.
constexpr Real kPressedEdge = 0.1e-3L;  // m
// Share of the spacing: layers that a grid step joins press no farther apart, for a sheared cell is
// no fold.
constexpr Real kNeighbours = 0.25L;
constexpr int kRounds = 400;
constexpr double kEnergyFraction = 1e-6;  // relative to the sum of the energies
constexpr double kSlipAllowed = 1e-5;     // relative to an element's limit: rounding of the file
constexpr double kStrainAllowed = 1e-9;
constexpr double kShearAllowed_rad = 1e-6;        // a sine's last digit at a right angle is 1.5e-8
constexpr double kCurvatureAllowed_per_m = 1e-6;  // last digits of a kilometre over (2 mm)^2: 3e-8
constexpr double kTwistFraction = 1e-9;           // relative to the twist stiffness
constexpr double kGapAllowed_m = 1e-6;
constexpr double kPinAllowed_m = 1e-6;
constexpr Real kMostTurned_deg = 90;  // farther the cloth is folded back in the clamp's own line
constexpr Real kMostOfMeasured = 2;   // beyond, more of the strain is guessed than was measured
constexpr double kPatchAllowed_m = 1e-6;  // rounding of the file

std::vector<Point> points_of(const Sheet& sheet) {
  std::vector<Point> points;
  for (const SheetMark& mark : sheet.marks) {
    const Eigen::Vector3d& p = mark.point_in_world;
    points.push_back({p.x(), p.y(), p.z()});
  }
  return points;
}

SheetSpec spec_of(const Sheet& sheet, const Fabric& fabric, const CertificateClaim& claim) {
  SimulateReport ignored;
  SheetSpec spec;
  spec.rows = sheet.rows;
  spec.cols = sheet.cols;
  spec.patch_warp_m = sheet.patch_m.x();
  spec.patch_weft_m = sheet.patch_m.y();
  spec.paper_model = claim.model == ClothModel::paper;
  spec.paper_mass = claim.paper_mass;
  spec.laws = make_laws(fabric, claim.segments, ignored, claim.reach);
  if (claim.memory) {
    add_internal_friction(fabric, claim.segments, spec.laws, ignored, claim.reach);
    spec.memory = *claim.memory;
  }
  if (spec.paper_model) spec.laws.twist_n_m = 0;
  return spec;
}

void compare(CertifyReport& report, const std::string& what, double claimed, Real found,
             double allowed) {
  report.lines.push_back({what, claimed, static_cast<double>(found), allowed, false});
}

void limit(CertifyReport& report, const std::string& what, double claimed, Real found, Real most) {
  report.lines.push_back(
      {what, claimed, static_cast<double>(found), static_cast<double>(most), true});
}

void compare_energies(CertifyReport& report, const CertificateClaim& claim, const Mechanics& found,
                      Real gravity_j) {
  if (!claim.gravity_j) return;
  const double sum = std::abs(*claim.gravity_j) + std::abs(*claim.stretch_j) +
                     std::abs(*claim.shear_j) + std::abs(*claim.bending_j) +
                     std::abs(*claim.twist_j);
  const double allowed = kEnergyFraction * sum;
  compare(report, "gravity energy (J)", *claim.gravity_j, gravity_j, allowed);
  compare(report, "stretch energy (J)", *claim.stretch_j, found.stretch_j, allowed);
  compare(report, "shear energy (J)", *claim.shear_j, found.shear_j, allowed);
  compare(report, "bending energy (J)", *claim.bending_j, found.bending_j, allowed);
  compare(report, "twist energy (J)", *claim.twist_j, found.twist_j, allowed);
}

/// The certificate's extremes include the strain 0.
void compare_strains(CertifyReport& report, const CertificateClaim& claim, const Mechanics& found) {
  if (claim.shear_most_rad)
    compare(report, "largest shear (rad)", *claim.shear_most_rad, found.shear_most_rad,
            kShearAllowed_rad);
  if (claim.curvature_most_per_m)
    compare(report, "largest curvature (1/m)", *claim.curvature_most_per_m,
            found.curvature_most_per_m, kCurvatureAllowed_per_m);
  compare(report, "least warp strain", claim.warp_least, std::min<Real>(0, found.strain_least[0]),
          kStrainAllowed);
  compare(report, "largest warp strain", claim.warp_most, std::max<Real>(0, found.strain_most[0]),
          kStrainAllowed);
  compare(report, "least weft strain", claim.weft_least, std::min<Real>(0, found.strain_least[1]),
          kStrainAllowed);
  compare(report, "largest weft strain", claim.weft_most, std::max<Real>(0, found.strain_most[1]),
          kStrainAllowed);
}

void judge_distances(CertifyReport& report, const CertificateClaim& claim, const Objects& objects,
                     const std::vector<Point>& points, const Sheet& sheet) {
  const int rows = sheet.rows, cols = sheet.cols;
  const checker::Distances found = distances_of(objects, points, rows, cols);
  if (claim.least_gap_object_m && found.least_to_object) {
    compare(report, "least distance of a particle to an object (m)", *claim.least_gap_object_m,
            *found.least_to_object, kGapAllowed_m);
  }
  compare(report, "deepest between particles (m)", claim.deepest_between_m, found.deepest_between,
          kGapAllowed_m);
  if (claim.at_rest) {
    limit(report, "depth of a particle in an object or the table (m)", 0, found.deepest_particle,
          kSunk);
    const Real spacing =
        std::max(Real(sheet.patch_m.x()) / (rows - 1), Real(sheet.patch_m.y()) / (cols - 1));
    const Real most = std::min(Real(claim.penetration_tolerance_m),
                               std::max(checker::kBetween_m, checker::kBetweenOfSide * spacing));
    limit(report, "depth between particles (m)", claim.deepest_between_m, found.deepest_between,
          most + Real(kGapAllowed_m));
    limit(report, "depth over the thickness of an object there", 0,
          checker::through_of(objects, points, rows, cols), checker::kThrough);
    limit(report, "places where the sheet passes through itself", 0,
          checker::crossings_of(points, rows, cols), 0);
  }
}

/// The place of a material point as a bilinear mixture of the particles around it.
Support place_of(const Sheet& sheet, const Eigen::Vector2d& material_m) {
  const Real row = Real(material_m.x()) / Real(sheet.patch_m.x()) * (sheet.rows - 1);
  const Real col = Real(material_m.y()) / Real(sheet.patch_m.y()) * (sheet.cols - 1);
  const int r = std::clamp(static_cast<int>(std::floor(row)), 0, sheet.rows - 2);
  const int c = std::clamp(static_cast<int>(std::floor(col)), 0, sheet.cols - 2);
  const Real u = row - r;
  const Real v = col - c;
  const int i = r * sheet.cols + c;
  return {{i, i + 1, i + sheet.cols, i + sheet.cols + 1},
          {(1 - u) * (1 - v), (1 - u) * v, u * (1 - v), u * v},
          {},
          true};
}

std::vector<Support> pins_of(CertifyReport& report, const Scene& scene, const Print& print,
                             const Sheet& sheet, const std::vector<Point>& points) {
  std::vector<Support> pins;
  for (const Pin& pin : scene.pins) {
    pins.push_back(place_of(sheet, pin.material_m(print)));
    if (!pin.point_in_world) continue;
    Real distance2 = 0;
    for (int axis = 0; axis < 3; ++axis) {
      Real off = -Real((*pin.point_in_world)[axis]);
      for (int k = 0; k < 4; ++k)
        off += pins.back().weight[k] * points[pins.back().particle[k]][axis];
      distance2 += off * off;
    }
    limit(report, "distance of a pinned point from its place (m)", 0, std::sqrt(distance2),
          kPinAllowed_m);
  }
  return pins;
}

/// Weight is added to the internal forces; returns the gravity energy (J).
Real add_weight(Mechanics& mechanics, const std::vector<Point>& points, const Scene& scene) {
  Real energy = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const Real weight = mechanics.mass[i] * Real(scene.gravity_m_per_s2[axis]);
      mechanics.force[i][axis] += weight;
      energy -= weight * points[i][axis];
    }
  }
  return energy;
}

checker::LayerReach layer_reach_of(const CertificateClaim& claim, const Sheet& sheet) {
  const Real thickness = claim.cloth_thickness_m;
  const Real spacing = std::min(Real(sheet.patch_m.x()) / (sheet.rows - 1),
                                Real(sheet.patch_m.y()) / (sheet.cols - 1));
  return {thickness + kTouch, std::min(thickness, kNeighbours * spacing) + kTouch};
}

/// Pins, and wherever the sheet may press on something.
std::vector<Support> all_supports(const CertificateClaim& claim, const Objects& objects,
                                  const std::vector<Point>& points,
                                  const checker::LayerReach& reach, std::vector<Support> supports) {
  const auto add = [&](const std::vector<Support>& more) {
    supports.insert(supports.end(), more.begin(), more.end());
  };
  add(supports_of(objects, points, claim.rows, claim.cols, kTouch));
  add(checker::edge_supports_of(objects, points, claim.rows, claim.cols, kPressedEdge));
  if (claim.cloth_thickness_m > 0)
    add(checker::layer_supports_of(points, claim.rows, claim.cols, reach));
  return supports;
}

/// Forces left by the stated contact forces and the pins; nothing where one of them cannot
/// be.
std::optional<checker::Balance> stated_balance(const CertificateClaim& claim,
                                               const Objects& objects,
                                               const std::vector<Point>& points,
                                               const checker::LayerReach& reach,
                                               const Mechanics& mechanics,
                                               const std::vector<Support>& pins, Real most_n) {
  if (claim.contact_forces.empty()) return std::nullopt;
  std::vector<Point> sum = mechanics.force;
  const std::size_t itself = objects.scene->obstacles.size() + 1;
  for (const ContactForce& stated : claim.contact_forces) {
    if (static_cast<std::size_t>(stated.shape) == itself) {
      if (claim.cloth_thickness_m > 0 &&
          checker::add_stated_layers(points, claim.cols, objects.scene->friction, reach, stated,
                                     sum))
        continue;
      return std::nullopt;
    }
    if (!add_stated(objects, points, claim.cols, objects.scene->friction, kTouch, stated, sum))
      return std::nullopt;
  }
  return checker::balance(sum, pins, objects.scene->friction, most_n, kRounds);
}

void judge_balance(CertifyReport& report, const CertificateClaim& claim, const Objects& objects,
                   const std::vector<Point>& points, const checker::LayerReach& reach,
                   const Mechanics& mechanics, const std::vector<Support>& pins) {
  const Scene& scene = *objects.scene;
  Real mass = 0;
  for (const Real m : mechanics.mass) mass += m;
  const Real mean_weight =
      mass * Real(scene.gravity_m_per_s2.norm()) / static_cast<Real>(mechanics.mass.size());
  const Real most = kResidualMargin * Real(claim.residual_tolerance);
  checker::Balance found{HUGE_VALL, 0};
  if (const auto stated =
          stated_balance(claim, objects, points, reach, mechanics, pins, most * mean_weight)) {
    found = *stated;
    report.contacts = static_cast<int>(claim.contact_forces.size() + pins.size());
  }
  if (!(found.largest <= most * mean_weight)) {
    if (!claim.contact_forces.empty())
      report.warnings.emplace_back(
          "the stated contact forces do not balance the sheet: others are sought");
    const std::vector<Support> supports = all_supports(claim, objects, points, reach, pins);
    const checker::Balance sought =
        checker::balance(mechanics.force, supports, scene.friction, most * mean_weight, kRounds);
    if (sought.largest < found.largest) found = sought;
    report.contacts = static_cast<int>(supports.size());
  }
  report.rounds = found.rounds;
  report.residual = static_cast<double>(found.largest / mean_weight);
  limit(report, "residual force (of a particle's weight)", claim.residual,
        found.largest / mean_weight, most);
}

void find_refusals(CertifyReport& report, const Sheet& sheet, const Print& print,
                   const CertificateClaim& claim) {
  if (sheet.is_measured()) report.refusals.emplace_back("the sheet is a measured one");
  if (sheet.rows != claim.rows || sheet.cols != claim.cols)
    report.refusals.push_back(fmt::format("the sheet has {}x{} points, the certificate {}x{}",
                                          sheet.rows, sheet.cols, claim.rows, claim.cols));
  const std::size_t whole = static_cast<std::size_t>(sheet.rows) * sheet.cols;
  if (sheet.marks.size() != whole) {
    report.refusals.push_back(
        fmt::format("{} of {} points are missing", whole - sheet.marks.size(), whole));
  }
  if (!((sheet.patch_m - print.patch_m).cwiseAbs().maxCoeff() <= kPatchAllowed_m))
    report.refusals.push_back(
        fmt::format("the sheet is of a patch of {:g} x {:g} mm, the print has {:g} x {:g} mm",
                    sheet.patch_m.x() / units::mm, sheet.patch_m.y() / units::mm,
                    print.patch_m.x() / units::mm, print.patch_m.y() / units::mm));
  if (claim.at_rest && !(claim.residual <= claim.residual_tolerance))
    report.refusals.emplace_back("the claimed residual is above the tolerance");
  if (claim.at_rest && !(claim.residual_tolerance <= checker::kMostResidual))
    report.refusals.push_back(
        fmt::format("the residual tolerance is {:g} of a particle's weight; a rest is at most {:g}",
                    claim.residual_tolerance, checker::kMostResidual));
  if (!(claim.cloth_thickness_m >= 0 && claim.cloth_thickness_m <= checker::kThickestCloth_m))
    report.refusals.push_back(fmt::format("layers of cloth are kept {:g} mm apart, at most {:g}",
                                          claim.cloth_thickness_m / units::mm,
                                          checker::kThickestCloth_m / units::mm));
}

constexpr double kMicro = 1e-6;

CheckReport check_of(const CertifyReport& judged) {
  CheckReport check;
  check.accepted = judged.accepted();
  check.residual = judged.residual;
  check.places = judged.contacts;
  check.refused = judged.refusals;
  for (const CertifyLine& line : judged.lines) {
    if (line.passes()) continue;
    check.refused.push_back(
        line.is_limit
            ? fmt::format("{}: {:.3g}, at most {:.3g}", line.what, line.found, line.allowed)
            : fmt::format("{}: {:.9g}, stated {:.9g}", line.what, line.found, line.claimed));
  }
  return check;
}

std::vector<ContactForce> read_stated(const std::filesystem::path& file, int stated) {
  std::vector<ContactForce> forces = read_contact_forces(file);
  if (forces.size() != static_cast<std::size_t>(stated))
    throw bad_input(
        fmt::format("{} contact forces, where the certificate states {}", forces.size(), stated),
        {.file = file.string()}, "simulate again");
  return forces;
}

}  // namespace

bool CertifyLine::passes() const {
  return is_limit ? found <= allowed : std::abs(found - claimed) <= allowed;
}

bool CertifyReport::accepted() const {
  return refusals.empty() && std::all_of(lines.begin(), lines.end(),
                                         [](const CertifyLine& line) { return line.passes(); });
}

CertifyReport certify(const Sheet& sheet, const Scene& scene, const Fabric& fabric,
                      const Print& print, const CertificateClaim& claim) {
  CertifyReport report;
  find_refusals(report, sheet, print, claim);
  if (!report.refusals.empty()) return report;
  const std::vector<Point> points = points_of(sheet);
  const checker::Clamps clamps = checker::clamps_of(scene, sheet, points);
  report.refusals = clamps.refusals;
  if (!report.refusals.empty()) return report;
  SheetSpec spec = spec_of(sheet, fabric, claim);
  spec.clamped = clamps.halves;
  Mechanics mechanics = mechanics_of(spec, points);
  if (claim.memory) {
    if (!mechanics.memory_fits) {
      report.refusals.emplace_back("the sheet's memory is not that of this grid and fabric");
      return report;
    }
    limit(report, "force of a friction element over its limit", 1, mechanics.friction_over_limit,
          1 + Real(kSlipAllowed));
  }
  const Real gravity_j = add_weight(mechanics, points, scene);
  compare_energies(report, claim, mechanics, gravity_j);
  compare_strains(report, claim, mechanics);
  if (claim.twist_n_m)
    compare(report, "twist stiffness (N m)", *claim.twist_n_m, spec.laws.twist_n_m,
            kTwistFraction * spec.laws.twist_n_m);
  if (claim.at_rest) {
    for (const int d : {0, 1})
      limit(report,
            d == 0 ? "warp strain over the last measured" : "weft strain over the last measured", 0,
            mechanics.strain_most[d] / Real(fabric.tensile[d].x.back()), kMostOfMeasured);
  }
  const Objects objects(scene);
  judge_distances(report, claim, objects, points, sheet);
  std::vector<Support> pins = pins_of(report, scene, print, sheet, points);
  if (!scene.clamps.empty()) {
    limit(report, "distance of a clamped point from its place (m)", 0, clamps.farthest_m,
          kPinAllowed_m);
    pins.insert(pins.end(), clamps.supports.begin(), clamps.supports.end());
    if (claim.at_rest)
      limit(report, "angle at which the cloth leaves a clamp, to its direction (deg)", 0,
            clamps.turned_rad / Real(units::deg), kMostTurned_deg);
  }
  if (claim.at_rest)
    judge_balance(report, claim, objects, points, layer_reach_of(claim, sheet), mechanics, pins);
  return report;
}

CertificateClaim claim_of(const SimulateResult& result, const SimulateOptions& options) {
  const SimulateReport& report = result.report;
  CertificateClaim claim;
  claim.at_rest = report.status == RestStatus::at_rest;
  claim.rows = options.rows;
  claim.cols = options.cols;
  claim.segments = options.segments;
  claim.reach = options.reach;
  claim.model = options.model;
  claim.paper_mass = options.mass == MassRule::paper;
  claim.residual = report.residual;
  claim.residual_tolerance = report.residual_tolerance;
  claim.warp_least = report.strains.warp_least;
  claim.warp_most = report.strains.warp_most;
  claim.weft_least = report.strains.weft_least;
  claim.weft_most = report.strains.weft_most;
  claim.shear_most_rad = report.strains.shear_most_rad;
  claim.curvature_most_per_m = report.strains.curvature_most_per_m;
  claim.twist_n_m = report.twist_n_m;
  claim.least_gap_object_m = report.least_gap_object_m;
  claim.deepest_between_m = report.deepest_between_m;
  claim.penetration_tolerance_m = report.penetration_tolerance_m;
  claim.cloth_thickness_m = report.cloth_thickness_m;
  claim.memory = result.memory;
  claim.contact_forces = result.contact_forces;
  if (!result.history.empty()) {
    const HistoryRow& last = result.history.back();
    claim.gravity_j = last.gravity_j;
    claim.stretch_j = last.stretch_j;
    claim.shear_j = last.shear_j;
    claim.bending_j = last.bending_j;
    claim.twist_j = last.twist_j;
  }
  return claim;
}

CertificateClaim read_claim(const std::filesystem::path& folder) {
  using units::mm;
  using units::percent;
  const JsonNode root = JsonNode::open(folder / "certificate.json", "certificate", 1);
  const JsonNode options = root.at("options");
  const JsonNode strain = root.at("strain");
  const JsonNode distance = root.at("distance");
  CertificateClaim claim;
  claim.at_rest = root.boolean("at_rest");
  claim.rows = options.integer("rows");
  claim.cols = options.integer("cols");
  claim.segments = options.integer("segments");
  if (options.has("curves_fitted_up_to")) {
    const JsonNode reach = options.at("curves_fitted_up_to");
    const Eigen::Vector2d tensile = reach.vector2("strain_percent") * percent;
    claim.reach = {.tensile = {tensile[0], tensile[1]},
                   .shear_rad = reach.number("shear_deg") * units::deg,
                   .curvature_per_m = reach.number("curvature_per_cm") * units::per_cm};
  }
  claim.model = options.text("model") == "paper" ? ClothModel::paper : ClothModel::consistent;
  claim.paper_mass = options.text("mass") == "paper";
  claim.residual = root.number("largest_residual_per_particle_weight");
  claim.residual_tolerance = root.number("residual_tolerance");
  const Eigen::Vector2d warp = strain.vector2("warp_percent") * percent;
  const Eigen::Vector2d weft = strain.vector2("weft_percent") * percent;
  claim.warp_least = warp[0];
  claim.warp_most = warp[1];
  claim.weft_least = weft[0];
  claim.weft_most = weft[1];
  if (const auto shear = strain.optional_number("largest_shear_deg"))
    claim.shear_most_rad = *shear * units::deg;
  if (const auto curvature = strain.optional_number("largest_curvature_per_cm"))
    claim.curvature_most_per_m = *curvature * units::per_cm;
  if (const auto twist = root.optional_number("twist_stiffness_uNm"))
    claim.twist_n_m = *twist * kMicro;
  if (const auto gap = distance.optional_number("least_particle_to_object_mm"))
    claim.least_gap_object_m = *gap * mm;
  claim.deepest_between_m = distance.number("deepest_between_particles_mm") * mm;
  // Certificates of before these were options.
  claim.penetration_tolerance_m =
      options.optional_number("penetration_tolerance_mm").value_or(0.5) * mm;
  claim.cloth_thickness_m = options.optional_number("cloth_thickness_mm").value_or(0) * mm;
  if (options.has("internal_friction") && options.boolean("internal_friction"))
    claim.memory = read_memory(folder / "memory.csv");
  if (const int stated = distance.optional_integer("contact_forces_stated").value_or(0); stated > 0)
    claim.contact_forces = read_stated(folder / "contact_forces.csv", stated);
  const Csv history = read_csv(folder / "history.csv", history_columns());
  if (!history.lines.empty()) {
    claim.gravity_j = history.columns[2].back() * kMicro;
    claim.stretch_j = history.columns[3].back() * kMicro;
    claim.shear_j = history.columns[4].back() * kMicro;
    claim.bending_j = history.columns[5].back() * kMicro;
    claim.twist_j = history.columns[6].back() * kMicro;
  }
  return claim;
}

void judge_rest(SimulateResult& result, const Scene& scene, const Fabric& fabric,
                const Print& print, const SimulateOptions& options) {
  SimulateReport& report = result.report;
  if (report.status != RestStatus::at_rest || options.round) return;
  report.check = check_of(certify(result.sheet, scene, fabric, print, claim_of(result, options)));
  if (report.check->accepted) return;
  report.status = RestStatus::refused;
  report.sentence = "still, but refused by the checker: " + report.check->refused.front();
  std::get<SimulatedSource>(result.sheet.source).status = report.sentence;
}

}  // namespace drape::simulate
