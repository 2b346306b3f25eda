// SPDX-License-Identifier: Apache-2.0
#include "core/certificate.hpp"

#include "core/units.hpp"

namespace drape {

using units::deg;
using units::mm;
using units::percent;

namespace {

constexpr double kMicro = 1e-6;

constexpr std::string_view kCloths[] = {"triangles", "grid"};

/// Options of a certificate, in a table of their own in the file.
struct CertificateOptions {
  Certificate& of;
};
void fields(Fields& f, CertificateOptions& options) {
  f.one_of({"cloth", "discretisation"}, options.of.cloth, kCloths);
  f({"segments", "line segments per Kawabata curve", 1, 1}, options.of.segments);
  f.if_any({"curves_fitted_up_to", "limits of the fit; absent if it covers the measured range"},
           options.of.reach);
  f({"internal_friction", "true if both branches of the hysteresis loops are used"},
    options.of.internal_friction);
  f({"friction", "friction coefficient of cloth on objects and on cloth", 1, 0},
    options.of.friction);
}

}  // namespace

void fields(Fields& f, CurveReach& reach) {
  f({"strain_percent", "strain along warp and weft", percent, 0}, reach.tensile);
  f({"shear_deg", "shear angle", deg, 0}, reach.shear_rad);
  f({"curvature_per_cm", "curvature", units::per_cm, 0}, reach.curvature_per_m);
}

void fields(Fields& f, CurveReport& curve) {
  f({"curve", "name of the Kawabata test"}, curve.name);
  f({"segments_used", "number of distinct slopes", 1, 1}, curve.segments);
  const bool tensile = curve.name.starts_with("tensile"), shear = curve.name.starts_with("shear");
  const bool bends = !tensile && !shear;
  const auto error = [&](const char* force, const char* moment, const char* meaning,
                         double& value) {
    f.when(!bends, {force, meaning, units::gf_per_cm, 0}, value);
    f.when(bends, {moment, meaning, units::gf_cm_per_cm, 0}, value);
  };
  error("fit_rms_error_gf_per_cm", "fit_rms_error_gf_cm_per_cm", "root mean square error",
        curve.rms_error);
  error("fit_largest_error_gf_per_cm", "fit_largest_error_gf_cm_per_cm", "largest error",
        curve.largest_error);
  error("half_hysteresis_gf_per_cm", "half_hysteresis_gf_cm_per_cm",
        "half the distance between the merged branches", curve.half_hysteresis);
  f.when(tensile, {"first_slope_n_per_m", "slope at zero strain"}, curve.first_slope);
  f.when(tensile, {"fit_range_percent", "largest fitted strain", percent, 0}, curve.range);
  f.when(shear, {"first_slope_gf_per_cm_deg", "slope at zero shear", units::gf_per_cm_deg},
         curve.first_slope);
  f.when(shear, {"fit_range_deg", "largest fitted shear angle", deg, 0}, curve.range);
  f.when(bends, {"first_slope_gf_cm2_per_cm", "slope at zero curvature", units::gf_cm2_per_cm},
         curve.first_slope);
  f.when(bends, {"fit_range_per_cm", "largest fitted curvature", units::per_cm, 0}, curve.range);
}

void fields(Fields& f, CertificateCheck& check) {
  f({"accepted", "true if the checker finds the cloth at rest"}, check.accepted);
  f({"largest_residual_per_particle_weight",
     "largest net force on a free point, in mean weights of a point", 1, 0},
    check.residual);
  f({"largest_side_residual_per_particle_weight",
     "largest net moment of a side over the mean side length, in the same unit", 1, 0},
    check.side_residual);
  f({"deepest_in_an_object_mm", "deepest penetration of the cloth into an object", mm},
    check.deepest_m);
  f({"places_through_itself", "places where the cloth passes through itself", 1, 0},
    check.crossings);
  f({"places_that_press", "number of contacts that press on the cloth", 1, 0}, check.places);
  f({"refused", "reasons for a refusal"}, check.refused);
}

void fields(Fields& f, CertificateStrains& strains) {
  f({"warp_percent", "minimum and maximum", percent}, strains.warp);
  f({"weft_percent", "minimum and maximum", percent}, strains.weft);
  f({"largest_shear_deg", "largest shear angle", deg, 0}, strains.shear_most_rad);
  f({"largest_curvature_per_cm", "largest curvature", units::per_cm, 0},
    strains.curvature_most_per_m);
}

void fields(Fields& f, CertificateDistances& distances) {
  f({"least_particle_to_object_mm",
     "smallest distance of a point from an object; null without objects", mm},
    distances.to_object_m);
  f({"least_particle_to_table_mm", "smallest distance of a point from the table", mm},
    distances.to_table_m);
  f({"least_to_itself_mm", "smallest distance between layers; null if none are near", mm, 0},
    distances.to_itself_m);
  f({"deepest_between_particles_mm", "deepest penetration into an object between the points", mm,
     0},
    distances.deepest_m);
  f({"triangles_through_itself", "places where the cloth passes through itself", 1, 0},
    distances.crossings);
  f({"largest_pin_error_mm", "largest distance of a held point from its prescribed position", mm,
     0},
    distances.hold_error_m);
  f.if_any(
      {"layers_apart_mm", "distance below which layers press on each other; absent if they do not",
       mm, above_zero},
      distances.layers_apart_m);
  f({"contact_forces_stated", "number of rows of contact_forces.csv beside it", 1, 0},
    distances.contact_forces);
}

void fields(Fields& f, CertificateEnergies& energies) {
  f.if_any({"start_uJ", "total of gravity, cloth, contact and motion at the start", kMicro},
           energies.start_j);
  f({"end_uJ", "total at the end", kMicro}, energies.end_j);
  f({"kinetic_uJ", "kinetic energy at the end", kMicro, 0}, energies.kinetic_j);
  f.if_any({"internal_uJ", "strain energy of the cloth at the end", kMicro}, energies.internal_j);
  f.if_any({"lost_to_internal_friction_uJ", "lost to the cloth's internal friction", kMicro},
           energies.internal_friction_j);
  f.if_any({"lost_to_damping_and_air_uJ", "lost to damping and air", kMicro}, energies.viscous_j);
}

void fields(Fields& f, CertificateStart& start) {
  f({"centre_mm", "centre of the flat start in the world", mm}, start.centre_in_world);
  f({"yaw_deg", "rotation of the start about the vertical", deg}, start.yaw_rad);
  f({"placed_by_marks", "number of measured marks used to position it", 1, 0}, start.marks);
  f({"placement_rms_mm", "RMS horizontal distance of those marks", mm, 0}, start.placement_rms_m);
}

void fields(Fields& f, CertificateLevel& level) {
  f({"spacing_mm", "spacing of the mesh", mm, above_zero}, level.spacing_m);
  f({"points", "points of the mesh", 1, 3}, level.points);
  f({"steps", "number of steps of its descents", 1, 0}, level.steps);
}

void fields(Fields& f, CertificateMesh& mesh) {
  f({"spacing_mm", "spacing of the finest mesh", mm, above_zero}, mesh.spacing_m);
  f({"coarsest_mm", "spacing of the coarsest mesh, on which the cloth falls", mm, above_zero},
    mesh.coarsest_m);
  f({"seed", "seed of the mesh's jitter"}, mesh.seed);
  f({"cloth_thickness_mm", "distance below which layers press on each other; 0 if they do not", mm,
     0},
    mesh.thickness_m);
  f({"levels", "meshes from coarse to fine"}, mesh.levels);
}

void fields(Fields& f, CertificateGrid& grid) {
  f({"rows", "particles along the warp", 1, 3}, grid.rows);
  f({"cols", "particles along the weft", 1, 3}, grid.cols);
  f({"damping_per_s", "beta / m of the paper's F = -beta v", 1, 0}, grid.damping_per_s);
  f({"air_drag_kg_per_m3", "c of F = -c area |v| v", 1, 0}, grid.air_drag_kg_per_m3);
  f({"kinetic_damping", "true if velocities are set to zero at peaks of kinetic energy"},
    grid.kinetic_damping);
  f({"step_share", "time step relative to the stability limit", 1, above_zero}, grid.step_fraction);
  f({"steps", "number of Runge-Kutta steps", 1, 0}, grid.steps);
  f({"max_steps", "largest number of steps", 1, 1}, grid.most_steps);
  f({"steps_cut_at_an_impact", "number of steps shortened at an impact", 1, 0},
    grid.backtracked_steps);
  f({"kinetic_stops", "number of peaks of kinetic energy", 1, 0}, grid.kinetic_stops);
  f({"springs_with_k_st_clamped_at_0", "number of springs whose K'st is clamped to 0 at the end", 1,
     0},
    grid.clamped_springs);
}

void fields(Fields& f, Certificate& certificate) {
  f({"at_rest", "true if at rest and accepted by the checker"}, certificate.at_rest);
  f({"status", "\"at rest\", or the reason why not"}, certificate.status);
  f({"largest_residual_per_particle_weight",
     "largest net force on a free point, in mean weights of a point; null if diverged", 1, 0},
    certificate.residual);
  f({"residual_tolerance", "largest residual that counts as at rest, in the same unit", 1, 0},
    certificate.residual_tolerance);
  f({"independent_check", "verdict of the checker; null if not checked"}, certificate.check);
  f({"simulated_time_s", "simulated duration of the fall", 1, 0}, certificate.time_s);
  f({"strain", "extreme strains; null if diverged"}, certificate.strains);
  f({"distance", "distances; null if diverged"}, certificate.distances);
  f({"energy", "energies; null if diverged"}, certificate.energies);
  f({"start", "position of the cloth at the start"}, certificate.start);
  f({"twist_stiffness_uNm", "twist stiffness", kMicro}, certificate.twist_n_m);
  f({"curves", "approximations of the Kawabata curves"}, certificate.curves);
  CertificateOptions options{certificate};
  f({"options", "options that affect the result"}, options);
  f({"warnings", "warnings"}, certificate.warnings);
}

Certificate read_certificate(const std::filesystem::path& file) {
  const Document document = Document::read(file);
  require_format(document, format_of<Certificate>);
  const Value* schema = document.root().find("schema");
  if (*schema->get_if<std::string>() != format_of<Certificate>.schema())
    throw bad_input("the certificate is older: of a particle grid that is no longer simulated",
                    document.where("schema"), "simulate the drape again");
  return read_record<Certificate>(document);
}

}  // namespace drape
