// SPDX-License-Identifier: Apache-2.0
#include "simulate/refine/refine.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/statistics/convergence.hpp"
#include "core/units.hpp"
#include "simulate/checker/certify.hpp"
#include "simulate/equilibrium/prolong.hpp"
#include "simulate/equilibrium/run.hpp"
#include "simulate/start/clamps.hpp"
#include "simulate/start/local_frame.hpp"
#include "simulate/world.hpp"

namespace drape::simulate {

namespace {

using Eigen::MatrixX3d;
using Eigen::Vector3d;

constexpr double kFirstStep_s = 0.03;  // first pseudo-time step on a finer grid
constexpr int kMost = 401;             // particles per side, as of any drape

/// Weights of four neighbouring of `count` points in a place at `u` spacings from the first one.
struct Cubic {
  int first = 0;
  std::array<double, 4> weight{};
};
Cubic cubic_at(int count, double u) {
  Cubic cubic;
  const int points = std::min(4, count);
  cubic.first = std::clamp(static_cast<int>(std::floor(u)) - 1, 0, count - points);
  for (int a = 0; a < points; ++a) {
    cubic.weight[a] = 1;
    for (int b = 0; b < points; ++b)
      if (b != a) cubic.weight[a] *= (u - cubic.first - b) / (a - b);
  }
  return cubic;
}

/// Layers press on each other, which the solver then has to look for.
bool meets_itself(const Rest& rest, const Surroundings& surroundings) {
  return std::any_of(rest.contact_forces.begin(), rest.contact_forces.end(),
                     [&](const ContactForce& f) { return f.shape >= surroundings.count(); });
}

/// A sheet in the frame of its drape.
struct Here {
  GridSpec grid;
  Field position;
};

/// Friction's springs start unloaded: what the coarse grid's held is not carried over, so that the
/// sheet slides until friction holds it here.
StaticDrape rest_on(const StaticCase& the_case, const GridSpec& grid, const Here& coarse,
                    StaticOptions how) {
  Cloth cloth(grid, the_case.laws, the_case.mass);
  cloth.clamp(clamps_on(the_case.scene, grid).places);
  how.falls = Falls::where_stalled;
  how.paced = false;
  how.first_step_s = kFirstStep_s;
  StaticDrape drape;
  if (how.meets_itself)
    how.cloth_thickness_m = thickness_on(grid, how.cloth_thickness_m, drape.start.report.warnings);
  const StartState state = make_start(the_case.scene, the_case.print, grid, the_case.measured,
                                      the_case.surroundings.top_z_m(), 0);
  StaticSolver solver(cloth, the_case.surroundings, how);
  solver.contacts().hold(state.holds, state.hold_in_world);
  solver.position = prolong(coarse.position, coarse.grid, grid);
  (void)lift_out(the_case.surroundings, solver.position);
  drape.report = solver.solve();
  drape.position = solver.position;
  drape.iterations = drape.report.iterations;
  return drape;
}

/// A rest is one of the print and start only where what they hold stands where they hold it.
void require_held(const StaticCase& the_case, const Here& coarse) {
  constexpr double kHeld_m = 1e-6;  // rounding of the file
  const StartState state = make_start(the_case.scene, the_case.print, coarse.grid,
                                      the_case.measured, the_case.surroundings.top_z_m(), 0);
  double most_m = 0;
  for (std::size_t k = 0; k < state.holds.size(); ++k) {
    Vector3d place = Vector3d::Zero();
    for (int i = 0; i < 4; ++i)
      place += state.holds[k].weight[i] * at(coarse.position, state.holds[k].particle[i]);
    most_m = std::max(most_m, (place - state.hold_in_world[k]).norm());
  }
  if (most_m > kHeld_m)
    throw bad_input(
        fmt::format("a point of the cloth that the scene holds lies {:.3g} mm from its place there "
                    "in the sheet to refine: the print or the start has changed since",
                    most_m / units::mm),
        {.file = the_case.scene.file.string(), .field = "pin"}, "simulate it again");
}

void require_refinable(const SimulateOptions& options, const Rest& rest) {
  const auto require = [](bool good, const char* what, const char* to_do) {
    if (!good) throw bad_input(what, {}, to_do);
  };
  require(!options.internal_friction,
          "a cloth with internal friction is not refined: its memory belongs to its grid",
          "simulate it on the finer grid itself");
  require(options.model == ClothModel::consistent, "the model `paper` is not refined",
          "use --model consistent");
  require(!options.round && rest.sheet.gaps.empty(), "a sheet with gaps is not refined",
          "give a drape of the whole patch");
}

/// Distance of the limit beyond the finer of two grids, in displacements from one to the other.
double beyond(double fine_m, double coarse_m, double order) {
  return 1 / (std::pow(coarse_m / fine_m, order) - 1);
}

}  // namespace

void RefineOptions::check() const {
  if (finest < 5 || finest > kMost)
    throw usage_error("the finest grid is not in 5 .. 401 particles per side", "give --finest 61");
  if (!(goal_m > 0)) throw usage_error("the goal is not above 0", "give --goal-mm 0.5");
}

std::optional<std::size_t> Refinement::finest_at_rest() const {
  for (std::size_t k = grids.size(); k > 0; --k)
    if (grids[k - 1].at_rest()) return k - 1;
  return std::nullopt;
}

std::vector<GridSpec> refined_grids(const GridSpec& coarse, int finest) {
  std::vector<GridSpec> grids;
  for (int k = 1;; ++k) {
    const double factor = std::pow(std::numbers::sqrt2, k);
    const auto points = [&](int n) { return 1 + static_cast<int>(std::lround((n - 1) * factor)); };
    const GridSpec next{points(coarse.rows), points(coarse.cols), coarse.patch_m};
    if (std::max(next.rows, next.cols) > finest) return grids;
    grids.push_back(next);
  }
}

MatrixX3d places_of_marks(const Sheet& sheet, const Print& print) {
  MatrixX3d places(print.rows * print.cols, 3);
  for (int k = 0; k < places.rows(); ++k) {
    const Eigen::Vector2d at_m = print.material_m({k / print.cols, k % print.cols});
    const Cubic warp = cubic_at(sheet.rows, at_m.x() / sheet.patch_m.x() * (sheet.rows - 1));
    const Cubic weft = cubic_at(sheet.cols, at_m.y() / sheet.patch_m.y() * (sheet.cols - 1));
    Vector3d place = Vector3d::Zero();
    for (int a = 0; a < 4; ++a) {
      for (int b = 0; b < 4; ++b) {
        const double weight = warp.weight[a] * weft.weight[b];
        if (weight == 0) continue;
        const int i = (warp.first + a) * sheet.cols + weft.first + b;
        place += weight * sheet.marks[static_cast<std::size_t>(i)].point_in_world;
      }
    }
    places.row(k) = place;
  }
  return places;
}

Refinement refine(const Scene& scene, const Fabric& fabric, const Print& print,
                  const std::optional<Sheet>& measured, const SimulateOptions& given,
                  const Rest& rest, const RefineOptions& how) {
  how.check();
  given.check();
  require_refinable(given, rest);
  const LocalScene local = local_scene(scene, measured, Surroundings(scene).top_z_m());
  const Surroundings surroundings(local.scene);
  SimulateReport fitted;
  const ClothLaws laws = make_laws(fabric, given.segments, fitted, given.reach);
  const StaticCase the_case{local.scene, print, local.measured, surroundings, laws, given.mass};

  Refinement refinement;
  refinement.goal_m = how.goal_m;
  refinement.coarse = {rest.sheet.rows, rest.sheet.cols, rest.sheet.patch_m};
  refinement.coarse_places_m = places_of_marks(rest.sheet, print);
  Here coarse{refinement.coarse, Field(3 * rest.sheet.marks.size(), 0.0)};
  for (std::size_t i = 0; i < rest.sheet.marks.size(); ++i)
    put_at(coarse.position, static_cast<int>(i),
           local.to_local(rest.sheet.marks[i].point_in_world));
  require_held(the_case, coarse);
  bool meets = meets_itself(rest, surroundings);
  std::vector<double> spacing_m{coarse.grid.warp_spacing_m()};
  std::vector<const MatrixX3d*> places_m{&refinement.coarse_places_m};
  const std::vector<GridSpec> grids = refined_grids(refinement.coarse, how.finest);
  if (grids.empty())
    throw usage_error(fmt::format("{}x{} particles are refined to more than {} only",
                                  refinement.coarse.rows, refinement.coarse.cols, how.finest),
                      "give a greater --finest");
  refinement.grids.reserve(grids.size());  // places_m points into it
  for (const GridSpec& grid : grids) {
    SimulateOptions options = given;
    options.rows = grid.rows;
    options.cols = grid.cols;
    StaticOptions solver = static_options(local.scene, options);
    solver.meets_itself = meets;
    StaticDrape drape = rest_on(the_case, grid, coarse, solver);
    if (has_to_meet_itself(grid, solver, drape.position, drape.report)) {
      solver.meets_itself = meets = true;
      drape = rest_on(the_case, grid, coarse, solver);
    }
    RefinedGrid& found = refinement.grids.emplace_back();
    found.result.report = fitted;
    finish_static(the_case, fabric, grid, options, drape, found.result);
    take_to_world(local, mass_kg(fabric, print, options), found.result);
    judge_rest(found.result, scene, fabric, print, options);
    if (!found.result.sheet.gaps.empty()) break;
    found.places_m = places_of_marks(found.result.sheet, print);
    found.apart_m = (found.places_m - *places_m.back()).rowwise().norm().mean();
    if (!found.at_rest()) break;
    spacing_m.push_back(grid.warp_spacing_m());
    places_m.push_back(&found.places_m);
    const std::size_t n = places_m.size();
    refinement.left = n == 2 ? left_of(spacing_m[1], spacing_m[0], *places_m[1], *places_m[0])
                             : left_of({spacing_m[n - 1], spacing_m[n - 2], spacing_m[n - 3]},
                                       {places_m[n - 1], places_m[n - 2], places_m[n - 3]});
    if (refinement.left->mean_m() <= how.goal_m) break;
    coarse = {grid, drape.position};
  }
  return refinement;
}

using units::mm;

std::string folder_of(const RefinedGrid& grid) {
  return fmt::format("{}x{}", grid.result.sheet.rows, grid.result.sheet.cols);
}

Json refinement_json(const Refinement& refinement, const Print& print, const RefineOptions& how,
                     const std::string& rest_sha256, const std::filesystem::path& folder) {
  Json json;
  json["schema"] = "drapebench/refinement/1";
  json["rest_sha256"] = rest_sha256;
  json["finest_allowed"] = how.finest;
  json["goal_mm"] = how.goal_m / mm;
  json["grids"] = Json::array();
  for (const RefinedGrid& grid : refinement.grids) {
    const std::string sheet = folder_of(grid) + "/sheet.ply";
    json["grids"].push_back(
        {{"rows", grid.result.sheet.rows},
         {"cols", grid.result.sheet.cols},
         {"sheet", sheet},
         {"sheet_sha256", sha256_of_file(folder / folder_of(grid) / "sheet.json")},
         {"at_rest", grid.at_rest()},
         {"status", grid.result.report.sentence},
         {"steps", grid.result.report.steps},
         {"mean_distance_from_coarser_mm", grid.apart_m ? Json(*grid.apart_m / mm) : Json()}});
  }
  const auto finest = refinement.finest_at_rest();
  json["used"] = finest ? Json(*finest) : Json();
  json["order"] =
      refinement.left && refinement.left->order ? Json(*refinement.left->order) : Json();
  json["mean_left_mm"] = refinement.left ? Json(refinement.left->mean_m() / mm) : Json();
  json["sentence"] = left_sentence(refinement);
  json["marks"] = Json::array();
  if (!finest || !refinement.left) return json;
  for (int k = 0; k < print.rows * print.cols; ++k) {
    const Eigen::Vector3d place = refinement.grids[*finest].places_m.row(k) / mm;
    const Eigen::Vector3d left = refinement.left->moves_m.row(k) / mm;
    json["marks"].push_back({{"row", k / print.cols},
                             {"col", k % print.cols},
                             {"place_mm", to_json_vector(place)},
                             {"left_mm", to_json_vector(left)}});
  }
  return json;
}

std::string left_sentence(const Refinement& refinement) {
  const auto finest = refinement.finest_at_rest();
  if (!finest || !refinement.left) return "no finer grid came to rest";
  const GridLeft& left = *refinement.left;
  const RefinedGrid& grid = refinement.grids[*finest];
  const std::string coarse = fmt::format("{}x{}", refinement.coarse.rows, refinement.coarse.cols);
  std::string text = fmt::format(
      "{:.3f} mm may be left to a grid without end: {} moves the marks by {:.3f} mm from {}",
      left.mean_m() / mm, folder_of(grid), *grid.apart_m / mm,
      *finest > 0 ? folder_of(refinement.grids[*finest - 1]) : coarse);
  if (left.order)
    text += fmt::format(", and over three grids the error falls by order {:.1f}{}", *left.order,
                        *left.order > kModelOrder ? ", of which the model's 2 is relied on" : "");
  else
    text += fmt::format(", and the error is taken to fall by order 1, for {}",
                        *finest > 0 ? "three grids show none of 1 to 3" : "two grids show none");
  if (*finest > 0)
    text += fmt::format("; {} lies {:.3f} mm away", coarse,
                        (grid.places_m - refinement.coarse_places_m).rowwise().norm().mean() / mm);
  if (*finest + 1 < refinement.grids.size())
    text += fmt::format("; {} is {}", folder_of(refinement.grids.back()),
                        refinement.grids.back().result.report.sentence);
  if (left.mean_m() > refinement.goal_m)
    text += fmt::format("; the goal of {:g} mm is missed", refinement.goal_m / mm);
  return text;
}

GridLeft left_of(double fine_spacing_m, double coarse_spacing_m, const MatrixX3d& fine_m,
                 const MatrixX3d& coarse_m) {
  return {std::nullopt,
          beyond(fine_spacing_m, coarse_spacing_m, kLeastOrder) * (fine_m - coarse_m)};
}

GridLeft left_of(const std::array<double, 3>& spacing_m,
                 const std::array<const MatrixX3d*, 3>& places_m) {
  const MatrixX3d fine_m = *places_m[0] - *places_m[1];
  const MatrixX3d rough_m = *places_m[1] - *places_m[2];
  const std::optional<double> order =
      order_of(spacing_m, (fine_m.array() * rough_m.array()).sum() / fine_m.squaredNorm());
  if (!order) return left_of(spacing_m[0], spacing_m[1], *places_m[0], *places_m[1]);
  return {order, beyond(spacing_m[0], spacing_m[1], std::min(*order, kModelOrder)) * fine_m};
}

}  // namespace drape::simulate
