// SPDX-License-Identifier: Apache-2.0
#include "core/simulation_files.hpp"

#include <fmt/format.h>
#include <algorithm>

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
  if (*document.root().find_as<std::string>("schema") != format_of<Certificate>.schema())
    throw bad_input("the certificate is older: of a particle grid that is no longer simulated",
                    document.where("schema"), "simulate the drape again");
  return read_record<Certificate>(document);
}

void fields(Fields& f, DrapeLevelRecord& level) {
  f({"spacing_mm", "spacing of the mesh", mm, above_zero}, level.spacing_m);
  f({"points", "points of the mesh", 1, 3}, level.points);
  f({"at_rest", "true if at rest"}, level.at_rest);
  f({"status", "\"at rest\", or the reason why not"}, level.status);
  f({"steps", "number of steps to rest", 1, 0}, level.steps);
  f({"mean_distance_from_coarser_mm",
     "mean displacement of the marks from the coarser mesh; null for the coarsest", mm, 0},
    level.from_coarser_m);
}

void fields(Fields& f, LevelMark& one) {
  f({"row", "mark along the warp", 1, 0}, one.mark.row);
  f({"col", "mark along the weft", 1, 0}, one.mark.col);
  f({"place_mm", "position in the world on the finest mesh", mm}, one.place_in_world);
  f({"mesh_error_mm", "largest distance from the limit of infinite refinement", mm, 0}, one.left_m);
  f.if_any({"from_coarser_mm",
            "displacement from the next coarser mesh, on the branch of the finest", mm},
           one.from_coarser_m);
}

void fields(Fields& f, LevelsFile& file) {
  f({"sheet_sha256", "SHA-256 of the sheet.json beside it"}, file.sheet_sha256);
  f({"levels", "meshes from coarse to fine"}, file.levels);
  f({"mean_mesh_error_mm", "mean over the marks; null if not at rest or with a single level", mm,
     0},
    file.left_m);
  f({"marks", "marks of the print on the finest mesh"}, file.marks);
  f.rule(!file.levels.empty(), "levels", "names no mesh", make_again);
  f.rule(!file.left_m || !file.marks.empty(), "marks", "names no mark", make_again);
}

std::string mesh_error_sentence(const LevelsFile& file) {
  const DrapeLevelRecord& finest = file.levels.back();
  if (!finest.at_rest)
    return fmt::format("mesh error not known: the mesh of {:g} mm is not at rest ({})",
                       finest.spacing_m / mm, finest.status);
  if (!file.left_m)
    return fmt::format("mesh error not known: one mesh alone; `--spacing-mm {:g}` adds a finer one",
                       finest.spacing_m / mm / 2);
  double own_branch_m = 0, by_level_m = 0;
  for (const LevelMark& mark : file.marks) {
    if (!mark.from_coarser_m) continue;
    own_branch_m += mark.from_coarser_m->norm();
    by_level_m += finest.from_coarser_m.value_or(0);
  }
  const bool jumped = own_branch_m < 0.999 * by_level_m;  // else equal but for rounding
  return fmt::format(
      "mesh error up to {:.3f} mm in the mean of the marks{}; `--spacing-mm {:g}` {}",
      *file.left_m / mm,
      jumped ? fmt::format(", on a branch that lies {:.3f} mm from that of the next coarser mesh",
                           *finest.from_coarser_m / mm)
             : "",
      finest.spacing_m / mm / 2, jumped ? "shows whether it stays there" : "lowers it");
}

/// Describes the moves, which are absent if the cloth did not come to rest.
static void fields(Fields& f, std::optional<MarkMoves>& moves) {
  std::optional<double> step = moves ? std::optional(moves->step) : std::nullopt;
  f.if_any(
      {"step", "change of the value: per cent for a fabric value, else in its unit", 1, above_zero},
      step);
  if (!step) return moves.reset();
  if (!moves) moves.emplace();
  moves->step = *step;
  f.if_any({"half_width", "half width of a stand-in's interval, in the unit of step"},
           moves->half_width);
  Eigen::MatrixXd down_m = moves->down_m, up_m = moves->up_m;
  f({"down_mm", "displacement of each mark if the value is lowered by the step", mm}, down_m);
  f({"up_mm", "displacement of each mark if the value is raised by the step", mm}, up_m);
  const char* each = "must have x, y, z for each entry of marks_at";
  f.limit(down_m.cols() == 3, "down_mm", each, make_again);
  f.limit(up_m.cols() == 3 && up_m.rows() == down_m.rows(), "up_mm", each, make_again);
  if (down_m.cols() != 3 || up_m.cols() != 3) return;
  moves->down_m = down_m;
  moves->up_m = up_m;
}

void fields(Fields& f, ValueEffect& effect) {
  f({"value", "name of the fabric value"}, effect.value);
  f({"mean_distance_mm_per_percent", "change of the mean distance", mm}, effect.change_m);
  f({"mean_way_of_marks_mm_per_percent", "mean displacement of the marks", mm}, effect.moved_m);
  fields(f, effect.moves);
}

void fields(Fields& f, SceneEffect& effect) {
  f({"value", "name of the scene's value"}, effect.value);
  f.if_any({"mean_distance_mm_per_unit", "change of the mean distance", mm},
           effect.change_m_per_unit);
  fields(f, effect.moves);
  f.if_any({"absent", "reason why there are no displacements"}, effect.absent);
}

void fields(Fields& f, VariantEffect& effect) {
  std::string from = effect.continued ? "base" : "start";
  f({"what", "changed part of the model"}, effect.what);
  f({"from", "base: started from the base's rest; start: from the scene's start"}, from);
  effect.continued = from == "base";
  f({"at_rest", "true if it came to rest"}, effect.at_rest);
  f({"mean_distance_mm", "mean distance of the marks", mm}, effect.distance_m);
  f({"change_mm", "change of the mean distance relative to the base", mm}, effect.change_m);
  f({"mean_way_of_marks_mm", "mean displacement of the marks", mm}, effect.moved_m);
}

void marks_at(Fields& f, std::vector<MarkId>& marks) {
  std::vector<std::array<int, 2>> places;
  for (const MarkId& mark : marks) places.push_back({mark.row, mark.col});
  f.if_any({"marks_at", "row and column of each mark", 1, 0, kMostMarks}, places);
  marks.clear();
  for (const auto& [row, col] : places) marks.push_back({row, col});
}

void fields(Fields& f, SensitivityFile& file) {
  f.if_any({"spacing_mm", "spacing of the base's finest mesh", mm, above_zero}, file.spacing_m);
  f.if_any({"rows", "particles along the warp, if the base is a grid"}, file.rows);
  f.if_any({"cols", "particles along the weft, if the base is a grid"}, file.cols);
  f.otherwise({"segments", "segments of each curve"}, file.segments);
  f.otherwise({"model", "cloth model"}, file.model);
  f.otherwise({"status", "status of the base: \"at rest\", or the reason why not"}, file.status);
  f({"marks", "number of marks of the mean", 1, 0}, file.marks);
  marks_at(f, file.marks_at);
  f.if_any({"no_go", "cause of the NO-GO of the reference or the start"}, file.no_go);
  f({"mean_distance_mm", "mean distance of the base", mm}, file.distance_m);
  std::optional<std::vector<ValueEffect>> values;
  if (!file.values.empty()) values = file.values;
  f({"sensitivities", "effects of fabric values; null if the base has no first-order response"},
    values);
  file.values = values.value_or(std::vector<ValueEffect>());
  f.if_any({"scene_sensitivities", "effects of the scene's values"}, file.scene);
  f.if_any({"variants", "the same drape with one part of the model changed"}, file.variants);
  const auto one_row_each = [&](const auto& effects) {
    return std::all_of(effects.begin(), effects.end(), [&](const auto& effect) {
      return !effect.moves ||
             effect.moves->down_m.rows() == static_cast<Eigen::Index>(file.marks_at.size());
    });
  };
  f.rule(one_row_each(file.values) && one_row_each(file.scene), "marks_at",
         "does not have one entry for each row of down_mm and up_mm", make_again);
}

using Eigen::Index;
using Eigen::MatrixX3d;

namespace {

constexpr double uj = 1e-6;

void row_and_col(Fields& f, MarkId& mark) {
  f({"row", "mark along the warp", 1, 0}, mark.row);
  f({"col", "mark along the weft", 1, 0}, mark.col);
}

/// Requires one move per mark of each counted equilibrium; `known`: number of marks in the band.
void require_moves(Fields& f, const std::vector<OtherRest>& rests, std::size_t known) {
  for (const OtherRest& rest : rests)
    f.rule(!rest.moves_m || rest.moves_m->size() == known, "marks",
           "moves_mm has not three numbers for each mark", make_again);
}

}  // namespace

MatrixX3d one_a_row(const std::vector<Eigen::Vector3d>& moves) {
  MatrixX3d all(static_cast<Index>(moves.size()), 3);
  for (Index k = 0; k < all.rows(); ++k) all.row(k) = moves[static_cast<std::size_t>(k)];
  return all;
}

MatrixX3d OtherRest::moves() const {
  return one_a_row(*moves_m);
}

int FrictionBand::counted() const {
  return static_cast<int>(std::count_if(pushes.begin(), pushes.end(), [](const OtherRest& push) {
    return push.moves_m.has_value();
  }));
}

std::vector<double> FrictionBand::reach_m() const {
  std::vector<double> reach(marks.size(), 0.0);
  for (const OtherRest& push : pushes)
    for (std::size_t k = 0; push.moves_m && k < reach.size(); ++k)
      reach[k] = std::max(reach[k], (*push.moves_m)[k].norm());
  return reach;
}

MatrixX3d MemoryBand::extreme_m(double sign) const {
  MatrixX3d best = MatrixX3d::Zero(static_cast<Index>(marks.size()), 3);
  for (const OtherRest& end : ends)
    if (end.moves_m && sign * end.moves().col(2).mean() > sign * best.col(2).mean())
      best = end.moves();
  return best;
}

void fields(Fields& f, ListedBranch& branch) {
  f({"branch", "rank by energy; 1 is the lowest", 1, 1}, branch.number);
  f({"sheet", "path from the folder of this file"}, branch.sheet);
  f({"energy_uJ", "energy on the coarsest mesh, with heights from the world origin", uj},
    branch.energy_j);
  f({"largest_residual_per_particle_weight",
     "largest net force on a free point, in mean weights of a point", 1, 0},
    branch.residual);
  f({"stable", "false at a saddle point of the energy"}, branch.stable);
  f({"starts", "starts that ended there", 1, 0}, branch.starts);
  f.otherwise({"fraction", "fraction of the starts", 1, 0, 1}, branch.fraction);
  f.if_any({"sought", "true if found only by the search; absent if a start ended there"},
           branch.sought);
  f.otherwise({"friction", "friction of the scene", 1, 0}, branch.friction);
  f.otherwise(
      {"farthest_member_mm", "mean distance between the branch and its farthest member", mm, 0},
      branch.farthest_member_m);
  f({"hem_nodes", "number of folds along the hem", 1, 0}, branch.hem_nodes);
  f.otherwise(
      {"hem_radius_spectrum_mm", "Fourier amplitudes of the hem's radius, orders 0 to 8", mm},
      branch.hem_amplitudes_m);
  f.if_any({"spacing_mm", "spacing of the mesh of the sheet", mm, 0}, branch.spacing_m);
  f.if_any({"polish_mm", "mean displacement of the marks from the coarsest mesh", mm, 0},
           branch.polish_m);
  f.if_any({"not_polished", "reason why there is no equilibrium on the finer mesh"},
           branch.not_polished);
}

void fields(Fields& f, UnseenBranches& unseen) {
  f({"rests", "starts that ended on a branch", 1, 0}, unseen.rests);
  f({"seen_once", "branches reached by exactly one start", 1, 0}, unseen.seen_once);
  f({"fraction", "estimated fraction of starts that end on branches not seen", 1, 0, 1},
    unseen.fraction);
  f({"upper95", "upper 95 % bound of fraction", 1, 0, 1}, unseen.upper95);
}

void fields(Fields& f, RefusedStarts& one) {
  f({"starts", "starts that ended in this equilibrium", 1, 0}, one.starts);
  f({"why", "reason for the refusal"}, one.why);
}

void fields(Fields& f, BandMark& one) {
  row_and_col(f, one.mark);
  f({"mean_mm", "mean position in the world", mm}, one.mean_in_world);
  f({"low_mm", "2.5 % quantile per axis", mm}, one.low_in_world);
  f({"high_mm", "97.5 % quantile per axis", mm}, one.high_in_world);
  f({"radius95_mm", "radius about the mean that contains 95 % of the drapes", mm, 0},
    one.radius95_m);
}

void fields(Fields& f, OtherRest& rest) {
  f.if_any({"what", "loading history of this rest; absent if it is that of the drape"}, rest.what);
  f({"ending", "\"at rest\", or the reason why it is not counted"}, rest.ending);
  f.if_any({"push_per_weight", "largest push, in weights of the cloth, world axes"},
           rest.push_per_weight);
  f.if_any({"moves_mm", "displacement of each mark; absent if not counted", mm}, rest.moves_m);
}

void fields(Fields& f, MarkInterval& one) {
  row_and_col(f, one.mark);
  f({"rest_mm", "position at rest", mm}, one.rest_in_world);
  f({"low_mm", "minimum over all rests, per axis", mm}, one.low_in_world);
  f({"high_mm", "maximum over all rests, per axis", mm}, one.high_in_world);
}

void fields(Fields& f, FrictionBand& band) {
  f({"friction", "friction of the scene", 1, 0}, band.friction);
  f({"pushes", "rests after pushes that grew and were released; empty without friction"},
    band.pushes);
  f.if_any(
      {"other_frictions", "rests from the same start with the lowest and the highest friction"},
      band.ends);
  f({"marks", "range of positions of each mark"}, band.marks);
  require_moves(f, band.pushes, band.marks.size());
  require_moves(f, band.ends, band.marks.size());
  for (const OtherRest& push : band.pushes)
    f.rule(push.push_per_weight.has_value(), "pushes", "a push has no push_per_weight", make_again);
}

void fields(Fields& f, MemoryBand& band) {
  f({"place_of_rest",
     "height of the rest between the ends: 0 lowest, 1 highest; null if no other end counts", 1, 0,
     1},
    band.place_of_rest);
  f({"ends", "rests after other loading histories"}, band.ends);
  f({"marks", "marks in the order of the moves"}, band.marks);
  f.rule(!band.marks.empty(), "marks", "names no mark", make_again);
  require_moves(f, band.ends, band.marks.size());
}

void fields(Fields& f, ErringRest& rest) {
  f({"ending", "at rest, or why it counts for nothing"}, rest.ending);
  f.if_any({"moves_mm", "way of each mark; absent: it counts for nothing", mm}, rest.moves_m);
  f.if_any({"first_order_mm", "way of each mark to first order", mm}, rest.first_order_m);
}

void fields(Fields& f, BeyondFirstOrder& beyond) {
  marks_at(f, beyond.marks_at);
  f({"rests", "each with its own errors"}, beyond.rests);
  for (const ErringRest& rest : beyond.rests)
    for (const auto* moves : {&rest.moves_m, &rest.first_order_m})
      f.rule(moves->has_value() == rest.moves_m.has_value() &&
                 (!*moves || (*moves)->size() == beyond.marks_at.size()),
             "marks_at", "a rest has not three numbers for each mark", make_again);
}

void fields(Fields& f, OtherFriction& other) {
  f({"friction", "friction coefficient", 1, 0}, other.friction);
  f({"ending", "\"at rest\", or the reason why it is not counted"}, other.ending);
  f({"distance_mm", "mean distance from the measured drape", mm, 0}, other.distance_m);
}

void fields(Fields& f, PlacedDrape& placed) {
  f({"branch", "branch of the drape; null if none, or undecided without reach_mm", 1, 1},
    placed.branch);
  f({"nearest_branch", "nearest branch; null if none was found", 1, 1}, placed.nearest);
  f.if_any({"distance_mm", "mean distance of the marks from the nearest member", mm, 0},
           placed.distance_m);
  f.if_any({"reach_mm",
            "distance below which a drape counts as on a branch; absent if branches are no farther "
            "apart",
            mm, 0},
           placed.reach_m);
  f.if_any({"apart_mm", "distance between the nearest branch and the next one", mm, 0},
           placed.apart_m);
  f.if_any({"marks", "number of marks compared", 1, 0}, placed.marks);
  f.if_any({"fraction_of_marks_in_band", "fraction of the marks within their bands", 1, 0, 1},
           placed.inside_fraction);
  f({"started_there", "result of a start from the measured shape"}, placed.started_there);
  f({"started_there_distance_mm", "mean distance from the measured drape after that start", mm, 0},
    placed.started_there_m);
  f.if_any({"other_frictions", "the same start with both ends of an unmeasured friction's range"},
           placed.other_frictions);
}

void fields(Fields& f, BranchList& list) {
  f({"scene_round_about_the_vertical", "true if the scene is symmetric about a vertical axis"},
    list.round);
  f.otherwise({"linking_distance_mm", "equilibria closer than this are one branch", mm, 0},
              list.linked_m);
  f.otherwise({"starts_not_at_rest", "starts that did not come to rest", 1, 0}, list.not_at_rest);
  f.otherwise({"refused", "equilibria refused by the checker"}, list.refused);
  f({"branches", "equilibria by energy, lowest first"}, list.branches);
  f.if_any({"starts", "number of seeded starts", 1, 0}, list.starts);
  f.if_any({"unseen", "estimate of the starts that end on branches not seen"}, list.unseen);
  f.if_any({"members_at_rest", "starts that came to rest", 1, 0}, list.members_at_rest);
  f.otherwise({"band", "95 % bands of the marks; empty below 20 members"}, list.band);
  f.if_any({"friction_band", "positions in which friction can hold the drape"}, list.friction_band);
  f.if_any({"internal_friction_band", "positions in which internal friction can hold the drape"},
           list.memory_band);
  f.if_any({"beyond_first_order", "drapes of the own start with errors in all stated values"},
           list.beyond_first_order);
  f.if_any({"measured", "the real drape among the branches"}, list.measured);
}

static void fields(Fields& f, CusickStart& start) {
  constexpr double kMicrojoule = 1e-6;
  f(Field{"file", "mesh beside this list, PLY in mm"}.plain_name(), start.file);
  f.otherwise({"points", "points of the mesh", 1, 0}, start.points);
  f({"specimen_area_mm2", "flat area of the specimen", mm * mm, 0}, start.specimen_area_m2);
  f({"at_rest", "true if at rest and accepted by the checker"}, start.at_rest);
  f.otherwise({"steps", "number of steps to rest", 1, 0}, start.steps);
  f.if_any({"residual_point_weights", "largest net force, in mean weights of a point"},
           start.residual);
  f.if_any({"energy_uj", "strain energy plus gravitational energy", kMicrojoule}, start.energy_j);
  f.if_any({"refusals", "reasons of the checker for a refusal"}, start.refusals);
  f.if_any({"checked_residual_point_weights", "the same, as computed by the checker"},
           start.checked_residual);
  f.if_any({"deepest_mm", "deepest penetration into the discs", mm}, start.deepest_m);
  f.if_any({"internal_friction_took_uj", "energy lost to internal friction", kMicrojoule},
           start.dissipated_j);
  f.otherwise({"hurried_loads", "number of load steps ended before the cloth was near rest", 1, 0},
              start.hurried_loads);
}

void fields(Fields& f, CusickFile& file) {
  f({"fabric", "name of the fabric"}, file.fabric);
  f.if_any({"disc_mm", "diameter of the discs", mm, above_zero}, file.disc_m);
  f.if_any({"specimen_mm", "diameter of the specimen", mm, above_zero}, file.specimen_m);
  f({"starts", "one drape per start"}, file.starts);
}

}  // namespace drape
