// SPDX-License-Identifier: Apache-2.0
#include "simulate/simulate.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/files/files.hpp"
#include "core/simulation_files.hpp"
#include "core/units.hpp"
#include "simulate/checker/certify.hpp"
#include "simulate/start/history.hpp"
#include "simulate/start/start.hpp"

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

Eigen::Matrix3d world_from_local(const DrapeLevel& level) {
  return Eigen::AngleAxisd(level.drape().local.yaw_rad, Vector3d::UnitZ()).toRotationMatrix();
}

ClothShape shape_of(const DrapeLevel& level, const ClothMoment& moment) {
  ClothShape shape = shape_of(level.cloth().mesh(), moment.state);
  for (Vector3d& point : shape.points_m) point = level.drape().local.to_world(point);
  for (Vector3d& slope : shape.of_sides) slope = world_from_local(level) * slope;
  return shape;
}

std::vector<ContactForce> forces_in_world(const DrapeLevel& level, const ClothMoment& moment) {
  std::vector<ContactForce> forces = level.contact_forces(moment);
  for (ContactForce& force : forces)
    force.force_in_world = world_from_local(level) * force.force_in_world;
  return forces;
}

/// Text that distinguishes a model from its variants.
std::string model_text(const SimulateOptions& options) {
  std::string text(drape::name_of(options.model));
  if (options.internal_friction) text += ", internal friction";
  if (options.model == ClothModel::triangles && !options.reach) text += ", whole curves";
  return text;
}

SimulatedSource source_of(const Scene& scene, const Fabric& fabric, const SimulateOptions& options,
                          const std::string& status) {
  SimulatedSource source;
  source.scene = scene.name;
  source.fabric = fabric.name;
  source.scene_sha256 = scene.document.sha256();
  source.fabric_sha256 = fabric_sha256(fabric);
  source.segments = options.segments;
  source.model = model_text(options);
  source.status = status;
  source.from_measured = options.from_measured || scene.start.mode == StartMode::measured;
  if (options.model == ClothModel::triangles) source.spacing_m = options.drape.spacing_m;
  return source;
}

/// Parts of a certificate common to both models.
Certificate certificate_of(const LocalScene& local, const FittedLaws& fitted,
                           const SimulateOptions& options) {
  Certificate certificate;
  certificate.start = {local.placed.flat.centre_in_world, local.placed.flat.yaw_rad,
                       local.placed.marks_used, local.placed.placement_rms_mm * mm};
  certificate.twist_n_m = fitted.laws.twist_n_m;
  certificate.curves = fitted.curves;
  certificate.segments = options.segments;
  certificate.reach = options.reach;
  certificate.internal_friction = options.internal_friction;
  certificate.friction = local.scene.friction;
  certificate.warnings = fitted.warnings;
  return certificate;
}

/// Warns if a drape strains the cloth beyond the fitted range of a curve.
void judge_reach(Certificate& certificate) {
  if (!certificate.reach || certificate.segments == 1 || !certificate.strains) return;
  const CertificateStrains& found = *certificate.strains;
  for (const CurveReport& curve : certificate.curves) {
    const double most = curve.name == "tensile warp"         ? found.warp.y()
                        : curve.name == "tensile weft"       ? found.weft.y()
                        : curve.name.starts_with("bending ") ? found.curvature_most_per_m
                                                             : found.shear_most_rad;
    if (curve.segments == 1 || most <= curve.range ||
        curve.name.find("friction") != std::string::npos)
      continue;
    certificate.warnings.push_back(fmt::format(
        "{}: the cloth is strained {:.1f} times as far as its curve was fitted; --fit whole fits "
        "all that was measured",
        curve.name, most / curve.range));
  }
}

LevelsFile levels_of(const DrapeCase& drape_case, const Drape& drape) {
  LevelsFile file;
  for (const LevelReport& one : drape.levels)
    file.levels.push_back({.spacing_m = one.spacing_m,
                           .points = one.points,
                           .at_rest = one.rest.at_rest,
                           .status = one.rest.at_rest ? "at rest" : one.rest.why,
                           .steps = one.rest.motion.steps + one.rest.steps,
                           .from_coarser_m = one.moved_m});
  if (!drape.at_rest() || drape.mesh_error_m.size() == 0) return file;
  const Eigen::MatrixX3d &places = drape.marks_of_level.back(),
                         &coarser = *(drape.marks_of_level.end() - 2);
  for (std::size_t k = 0; k < drape.marks.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    if (!places.row(row).allFinite()) continue;
    const Vector3d place = drape_case.local.to_world(places.row(row).transpose());
    file.marks.push_back({drape.marks[k], place, drape.mesh_error_m[row], std::nullopt});
    if (coarser.row(row).allFinite())
      file.marks.back().from_coarser_m =
          place - drape_case.local.to_world(coarser.row(row).transpose());
  }
  double sum = 0;
  for (const LevelMark& mark : file.marks) sum += mark.left_m;
  if (!file.marks.empty()) file.left_m = sum / static_cast<double>(file.marks.size());
  return file;
}

/// The scene with the start that the options select.
Scene started(Scene scene, const SimulateOptions& options) {
  if (options.from_measured) scene.start.mode = StartMode::measured;
  return scene;
}

SimulateResult simulate_paper(const Scene& scene, const Fabric& fabric, const Print& print,
                              const std::optional<Sheet>& measured,
                              const SimulateOptions& options) {
  const LocalScene local = local_scene(scene, measured, Surroundings(scene).top_z_m());
  FittedLaws fitted = fit_laws(fabric, options.segments, options.reach);
  fitted.laws.twist_n_m = 0;  // The model has no twist stiffness, so no warning about it applies.
  fitted.warnings = fabric.warnings;
  SimulateResult result;
  Certificate& certificate = result.certificate;
  certificate = certificate_of(local, fitted, options);
  PaperOptions model = options.paper;
  model.thickness_m = options.drape.thickness_m;
  PaperDrape drape =
      run_paper_model(local, print, fitted.laws, model, certificate, options.progress);
  result.sheet = std::move(drape.sheet);
  for (SheetMark& mark : result.sheet.marks)
    mark.point_in_world = local.to_world(mark.point_in_world);
  result.history = std::move(drape.history);
  result.sheet.source = source_of(scene, fabric, options, certificate.status);
  return result;
}

CertificateCheck certificate_check(const MeshJudgement& judged) {
  return {.accepted = judged.accepted(),
          .residual = judged.residual,
          .side_residual = judged.side_residual,
          .deepest_m = judged.deepest_m,
          .crossings = judged.crossings,
          .places = judged.places_pressed,
          .refused = judged.refusals};
}

CertificateDistances certificate_distances(const DrapeLevel& level, const ClothMoment& moment,
                                           const MeshJudgement& judged) {
  CertificateDistances distances{
      .to_object_m = judged.to_object_m,
      .to_table_m = judged.to_table_m,
      .to_itself_m = judged.to_itself_m,
      .deepest_m = judged.deepest_m,
      .crossings = judged.crossings,
      .hold_error_m = judged.hold_error_m,
      .layers_apart_m = {},
      .contact_forces = static_cast<int>(level.contact_forces(moment).size())};
  if (moment.layers_apart_m > 0) distances.layers_apart_m = moment.layers_apart_m;
  return distances;
}

/// Writes the state's cloth.ply and, if not empty, contact_forces.csv and memory.csv.
void write_rest(const fs::path& folder, const DrapeLevel& level, const ClothMoment& moment) {
  write_cloth_shape(folder / "cloth.ply", shape_of(level, moment));
  if (const auto forces = forces_in_world(level, moment); !forces.empty())
    write_durable(folder / "contact_forces.csv", contact_forces_csv(forces));
  if (level.cloth().laws().friction)
    write_durable(folder / "memory.csv", memory_csv(moment.memory));
}

/// Number of positions along an edge of the patch, about `step_m` apart. They include the print's
/// marks, without interpolation, if a fraction of the pitch divides edge and margin to a hundredth
/// of a step, as with sides that are typed to a tenth of a millimetre.
int places_along(double side_m, double margin_m, double pitch_m, double step_m) {
  const auto divides = [](double part_m, double length_m) {
    const double times = length_m / part_m;
    return std::abs(times - std::round(times)) < 0.01;
  };
  const int first = std::max(1, static_cast<int>(std::lround(pitch_m / step_m)));
  for (int parts = first; parts <= 4 * first; ++parts)
    if (divides(pitch_m / parts, side_m) && divides(pitch_m / parts, margin_m))
      return static_cast<int>(std::lround(side_m * parts / pitch_m)) + 1;
  return static_cast<int>(std::lround(side_m / step_m)) + 1;
}

constexpr double kFirstMeshes = 14;  // mesh points along an edge: enough for a fold or two
// A crease concentrates its bend on a few points, so strains grow with the mesh: on the finest one
// they reach four times those of the first run.
constexpr double kFinerMeshes = 4;
constexpr int kFirstSegments = 5;       // as in the paper
constexpr double kFirstResidual = 0.1;  // in mean weights of a point; changes strains by 0.1 %

}  // namespace

ClothShape shape_of(const MaterialMesh& mesh, const MeshCloth::State& state) {
  ClothShape shape;
  shape.material_m = mesh.points_m;
  shape.triangles = mesh.triangles;
  for (const MaterialMesh::Edge& edge : mesh.edges) shape.sides.push_back({edge.from, edge.to});
  const auto points = static_cast<std::ptrdiff_t>(mesh.points_m.size());
  shape.points_m.assign(state.begin(), state.begin() + points);
  shape.of_sides.assign(state.begin() + points, state.end());
  return shape;
}

MeshRest rest_of(const DrapeLevel& level, const ClothMoment& moment, const Scene& scene,
                 double residual_tolerance) {
  MeshRest rest;
  rest.shape = shape_of(level, moment);
  rest.laws = level.cloth().laws();
  rest.memory = moment.memory;
  rest.scene = &scene;
  for (std::size_t k = 0; k < level.pinned().size(); ++k)
    rest.pins.push_back({rest.shape.material_m[level.pinned()[k]],
                         level.drape().local.to_world(level.pinned_at()[k])});
  rest.contact_forces = forces_in_world(level, moment);
  rest.layers_apart_m = moment.layers_apart_m;
  rest.gravity_m_per_s2 = scene.gravity_m_per_s2;
  rest.residual_tolerance = residual_tolerance;
  return rest;
}

MeshJudgement judge_drape(const DrapeLevel& level, const ClothMoment& moment, const Scene& scene,
                          double residual_tolerance, const Vector2d& most_strain) {
  MeshRest rest = rest_of(level, moment, scene, residual_tolerance);
  rest.most_strain = most_strain;
  return judge_mesh(rest);
}

void SimulateOptions::check() const {
  const auto require = [](bool good, const char* what, const char* to_do) {
    if (!good) throw usage_error(what, to_do);
  };
  require(!internal_friction || model == ClothModel::triangles,
          "the model `paper` has no internal friction", "leave out --paper or --internal-friction");
  require(segments >= 1 && segments <= 20, "a curve has 1 to 20 segments", "give --segments 5");
  require(drape.spacing_m > 0 && drape.coarsest_m > 0, "a mesh has no spacing",
          "give --spacing-mm 2.5");
  require(drape.thickness_m >= 0 && drape.thickness_m <= 0.01,
          "the cloth's thickness is not in 0 .. 10 mm", "give 0.5, or 0 to let it pass itself");
}

Sheet sheet_of(const DrapeLevel& level, const ClothMoment& moment, double step_m) {
  const Print& print = level.drape().print;
  const LocalScene& local = level.drape().local;
  Sheet sheet;
  sheet.rows = places_along(print.patch_m.x(), print.margin_m.x(), print.pitch_m, step_m);
  sheet.cols = places_along(print.patch_m.y(), print.margin_m.y(), print.pitch_m, step_m);
  sheet.patch_m = print.patch_m;
  std::vector<Vector2d> material_m;
  for (int r = 0; r < sheet.rows; ++r)
    for (int c = 0; c < sheet.cols; ++c)
      material_m.push_back(
          {sheet.patch_m.x() * r / (sheet.rows - 1), sheet.patch_m.y() * c / (sheet.cols - 1)});
  const Eigen::MatrixX3d places = level.places(moment, material_m);
  for (std::size_t i = 0; i < material_m.size(); ++i) {
    const int row = static_cast<int>(i) / sheet.cols, col = static_cast<int>(i) % sheet.cols;
    const Vector3d place = places.row(static_cast<Eigen::Index>(i));
    if (!place.allFinite()) {
      sheet.gaps.push_back({{row, col}, "beside the cloth"});
      continue;
    }
    SheetMark mark;
    mark.mark = {row, col};
    mark.material_m = material_m[i];
    mark.point_in_world = local.to_world(place);
    sheet.marks.push_back(mark);
  }
  return sheet;
}

SimulateResult result_of(const Scene& scene, const Fabric& fabric, const FittedLaws& fitted,
                         const SimulateOptions& options,
                         std::shared_ptr<const DrapeCase> drape_case, Drape drape) {
  SimulateResult result;
  Certificate& certificate = result.certificate;
  certificate = certificate_of(drape_case->local, fitted, options);
  const DrapeLevel& level = *drape.level;
  const RestReport& end = drape.levels.back().rest;
  certificate.at_rest = end.at_rest;
  certificate.status = end.at_rest ? "at rest" : end.why;
  certificate.residual = end.descent.residual;
  certificate.residual_tolerance = options.drape.descent.residual;
  certificate.time_s = drape.levels.front().rest.motion.time_s;
  std::optional<MeshJudgement> judged;
  if (end.at_rest) {
    judged = judge_drape(level, drape.rest, scene, certificate.residual_tolerance,
                         strain_limits(fabric));
    certificate.at_rest = judged->accepted();
    certificate.check = certificate_check(*judged);
    certificate.distances = certificate_distances(level, drape.rest, *judged);
    if (!certificate.at_rest)
      certificate.status = "still, but the checker refuses it: " + judged->refusals.front();
  }
  certificate.strains = level.strains(drape.rest);
  CertificateEnergies energies;
  energies.end_j = level.energy_j(drape.rest) + drape_case->local.gravity_offset_j(level.mass_kg());
  if (judged) energies.internal_j = judged->energy_j;
  if (options.internal_friction) energies.internal_friction_j = end.descent.dissipated_j;
  certificate.energies = energies;
  CertificateMesh mesh{.spacing_m = options.drape.spacing_m,
                       .coarsest_m = options.drape.coarsest_m,
                       .seed = options.drape.seed,
                       .thickness_m = options.drape.thickness_m,
                       .levels = {}};
  for (const LevelReport& one : drape.levels)
    mesh.levels.push_back({one.spacing_m, one.points, one.rest.motion.steps + one.rest.steps});
  certificate.cloth = mesh;
  certificate.warnings.insert(certificate.warnings.end(), drape.warnings.begin(),
                              drape.warnings.end());
  for (std::string& warning : warnings_of_scene(
           scene, certificate.distances ? certificate.distances->to_object_m : std::nullopt,
           options.drape.spacing_m))
    certificate.warnings.push_back(std::move(warning));
  if (!options.internal_friction && !history_of(scene).empty())
    certificate.warnings.emplace_back(
        "start.history leaves no trace: without --internal-friction the cloth has no memory");
  judge_reach(certificate);
  result.levels = levels_of(*drape_case, drape);
  result.sheet = sheet_of(level, drape.rest, options.drape.spacing_m);
  result.sheet.source = source_of(scene, fabric, options, certificate.status);
  result.drape_case = std::move(drape_case);
  result.drape = std::move(drape);
  return result;
}

SimulateResult simulate(const Scene& scene, const Fabric& fabric, const Print& print,
                        const std::optional<Sheet>& measured, const SimulateOptions& options) {
  options.check();
  if (options.model == ClothModel::paper)
    return simulate_paper(scene, fabric, print, measured, options);
  const FittedLaws fitted =
      fit_laws(fabric, options.segments, options.reach, options.internal_friction);
  const Scene begun = started(scene, options);
  auto made = std::make_shared<const DrapeCase>(
      drape_case(begun, print, measured, fitted.laws, options.outline));
  Drape drape = drape_cloth(*made, options.drape, {}, options.progress);
  return result_of(begun, fabric, fitted, options, std::move(made), std::move(drape));
}

std::optional<CurveReach> find_reach(const Scene& scene, const Fabric& fabric, const Print& print,
                                     const std::optional<Sheet>& measured) {
  const DrapeCase first = drape_case(scene, print, measured, fit_laws(fabric, kFirstSegments).laws);
  DrapeOptions options;
  options.spacing_m = options.coarsest_m = print.patch_m.maxCoeff() / kFirstMeshes;
  options.motion.residual = options.descent.residual = kFirstResidual;
  const Drape drape = drape_cloth(first, options);
  if (!drape.at_rest()) return std::nullopt;
  const CertificateStrains strains = drape.level->strains(drape.rest);
  return CurveReach{.tensile = {kFinerMeshes * std::max(strains.warp.y(), 0.0),
                                kFinerMeshes * std::max(strains.weft.y(), 0.0)},
                    .shear_rad = kFinerMeshes * strains.shear_most_rad,
                    .curvature_per_m = kFinerMeshes * strains.curvature_most_per_m};
}

std::vector<fs::path> output_files(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const char* name :
       {"sheet.json", "sheet.ply", "certificate.json", "levels.json", "cloth.ply",
        "contact_forces.csv", "memory.csv", "history.csv", kSensitivityName})
    files.push_back(folder / name);
  return files;
}

void write_outputs(const fs::path& out, const SimulateResult& result, RunRecord& record) {
  // Files of an earlier run do not belong to this drape.
  for (const fs::path& file : output_files(out))
    if (fs::is_regular_file(fs::symlink_status(file))) remove_durable(file);
  write_sheet(out / "sheet.ply", result.sheet);
  write_record(out / "certificate.json", result.certificate);
  if (result.levels) {
    LevelsFile levels = *result.levels;
    levels.sheet_sha256 = sha256_of_file(out / "sheet.json");
    write_record(out / "levels.json", levels);
  }
  if (result.drape) write_rest(out, *result.drape->level, result.drape->rest);
  if (!result.history.empty()) write_durable(out / "history.csv", history_csv(result.history));
  for (const fs::path& file : output_files(out))
    if (fs::is_regular_file(file)) record.output(file);
}

}  // namespace drape::simulate
