// SPDX-License-Identifier: Apache-2.0
#include "compare/compare.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <numeric>
#include <tuple>

namespace drape::compare {
namespace {

using units::mm;

constexpr double kSurfaceSpacing_m = 5 * mm;  ///< spacing of samples of two simulated surfaces

struct PaperPair {
  int grid, segments, other_grid, other_segments;
};

/// Rows of the paper's tables 2, 4, .. 12, in order; 31x31 with one segment is included in the
/// first group because the tables treat every grid alike.
constexpr std::array<PaperPair, 7> kPairs{{{11, 5, 11, 1},
                                           {21, 5, 21, 1},
                                           {31, 5, 31, 1},
                                           {11, 1, 21, 1},
                                           {11, 5, 21, 5},
                                           {11, 5, 31, 5},
                                           {21, 5, 31, 5}}};

/// A branch belongs to no pair: the paper compares grids and segments, not equilibria.
bool is(const Simulation& simulation, int grid, int segments) {
  return !simulation.branch && simulation.is_grid() && simulation.sheet.sheet.rows == grid &&
         simulation.sheet.sheet.cols == grid && simulation.segments() == segments;
}

std::string label_of(const PaperPair& pair) {
  if (pair.grid == pair.other_grid) {
    return fmt::format("{0}x{0}: {1} seg vs {2} seg", pair.grid, pair.segments,
                       pair.other_segments);
  }
  return fmt::format("{0} seg: {1}x{1} vs {2}x{2}", pair.segments, pair.grid, pair.other_grid);
}

void check_patch(const DrapeInput& input, const Simulation& simulation) {
  const Eigen::Vector2d &real = input.measured.sheet.patch_m,
                        &simulated = simulation.sheet.sheet.patch_m;
  if ((real - simulated).cwiseAbs().maxCoeff() <= 0.01 * mm) return;
  throw bad_input(
      fmt::format("the simulated patch is {:g} x {:g} mm, the measured one {:g} x {:g} mm",
                  simulated.x() / mm, simulated.y() / mm, real.x() / mm, real.y() / mm),
      {.file = simulation.sheet.file.string(), .field = "patch_mm"},
      "compare a simulation of the same cloth, or correct the print file");
}

void require_scene(const std::vector<Simulation>& group, const std::string& scene,
                   const Where& where) {
  if (group.empty() || group.front().source().scene == scene) return;
  throw bad_input(fmt::format("scene `{}` stands in the group of scene `{}`", scene,
                              group.front().source().scene),
                  where, "put the measured sheet of each drape before its simulations");
}

/// Requires one scene per group, and no two simulations that the tables could not distinguish.
void check_group(const std::vector<Simulation>& simulations) {
  using Key = std::tuple<std::string, int, Setup, std::string, int>;
  std::map<Key, const Simulation*> seen;
  for (const Simulation& simulation : simulations) {
    const SimulatedSource& source = simulation.source();
    require_scene(simulations, source.scene,
                  {.file = simulation.sheet.file.string(), .field = "source.scene"});
    const Key key(simulation.discretisation(), source.segments, simulation.setup(),
                  simulation.branch ? simulation.branch->set_sha256 : std::string(),
                  simulation.branch ? simulation.branch->number : 0);
    const auto [first, fresh] = seen.emplace(key, &simulation);
    if (fresh) continue;
    throw bad_input(fmt::format("{} is given twice for one drape, here and in {}",
                                simulation.label(), first->second->sheet.file.string()),
                    {.file = simulation.sheet.file.string()},
                    "give each mesh, grid and number of segments once per measured sheet");
  }
}

std::vector<std::size_t> paper_order(const DrapeInput& input) {
  std::vector<std::size_t> order(input.simulations.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto key = [&](std::size_t i) {
    const Simulation& s = input.simulations[i];
    const auto [is_mesh, fineness] = s.fineness();
    return std::tuple(-s.source().segments, !is_mesh, -fineness, -s.sheet.sheet.cols);
  };
  std::ranges::sort(order, [&](std::size_t a, std::size_t b) {
    if (key(a) != key(b)) return key(a) < key(b);
    return a != b && input.speaks_before(input.simulations[a], input.simulations[b]);
  });
  return order;
}

/// Distances of the measured marks, without the excluded ones, from the nearest point of the mesh.
DistanceStatistics to_surface_of(const Sheet& measured, const std::vector<Excluded>& excluded,
                                 const TriangleMesh& mesh) {
  const NearestSurface nearest(mesh);
  std::vector<double> distances, sigmas;
  for (const SheetMark& mark : measured.marks) {
    if (std::ranges::find(excluded, mark.mark, &Excluded::mark) != excluded.end()) continue;
    const Eigen::Vector3d difference =
        mark.point_in_world - nearest.nearest(mark.point_in_world).point;
    distances.push_back(difference.norm());
    if (mark.covariance_m2) sigmas.push_back(distance_sigma_m(difference, *mark.covariance_m2));
  }
  return statistics_of(distances, sigmas);
}

RealVirtual compare_real(const DrapeInput& input, const std::vector<Surface>& surfaces,
                         std::size_t simulation) {
  RealVirtual row;
  row.simulation = simulation;
  row.marks = compare_marks(input.measured.sheet, surfaces[simulation]);
  if (row.marks.marks.empty()) {
    throw bad_input(
        "no measured mark has a place on the simulated sheet",
        {.file = input.simulations[simulation].sheet.file.string(), .field = "material_mm"},
        "check that both sheets use the same print file");
  }
  const std::vector<MarkError>& marks = row.marks.marks;
  row.statistics = statistics_of(marks);
  row.normal = normal_statistics_of(marks);
  row.aligned = align(marks);
  if (const auto& move = row.aligned) {
    row.statistics.shape_m = move->after.mean_m;
    row.statistics.place_m = move->centroid_shift_m;
    row.statistics.turn_rad = move->turn_rad;
  }
  row.strain = strain_maps(input.measured.sheet, surfaces[simulation]);
  row.to_surface = to_surface_of(input.measured.sheet, row.marks.excluded,
                                 mesh_of(input.simulations[simulation].sheet.sheet));
  return row;
}

/// Throws if a mesh seems to be in a larger unit than stated. The smallest such mistake, cm for
/// inches, reduces the area to 1 / 2.54^2; the limit is between that and the whole cloth.
void require_area(const OtherSurface& surface, const Eigen::Vector2d& patch_m) {
  constexpr double kLeastPart = 1 / 2.54;
  const double part = area_m2(surface.mesh) / patch_m.prod();
  if (part >= kLeastPart) return;
  throw bad_input(fmt::format("the mesh has {:.2g} of the cloth's area", part),
                  {.file = surface.file.string(), .field = "unit_mm"},
                  "give 10 for a mesh in cm, 25.4 in inches, 1000 in metres");
}

std::vector<RealSurface> compare_surfaces(const DrapeInput& input) {
  std::vector<RealSurface> rows;
  for (std::size_t i = 0; i < input.surfaces.size(); ++i) {
    const OtherSurface& surface = input.surfaces[i];
    for (std::size_t k = 0; k < i; ++k) {
      if (input.surfaces[k].sha256 == surface.sha256)
        throw bad_input("this mesh is given twice for one drape", {.file = surface.file.string()},
                        "give each mesh once per measured sheet");
    }
    require_scene(input.simulations, surface.scene,
                  {.file = surface.file.string(), .field = "scene"});
    require_area(surface, input.measured.sheet.patch_m);
    rows.push_back(compare_to_surface(input.measured.sheet, surface.mesh));
    rows.back().surface = i;
  }
  return rows;
}

/// Equilibria grouped by their list, each sorted by energy.
std::vector<BranchSet> compare_branches(const DrapeInput& input,
                                        const std::vector<Surface>& surfaces) {
  std::map<std::string, std::map<int, std::size_t>> lists;
  for (std::size_t i = 0; i < input.simulations.size(); ++i) {
    if (const auto& branch = input.simulations[i].branch)
      lists[branch->set_sha256][branch->number] = i;
  }
  const auto axis = input.scene ? axis_of(*input.scene) : std::nullopt;
  std::vector<BranchSet> sets;
  for (const auto& [sha256, numbers] : lists) {
    BranchSet set{sha256, {}, {}, 0, {}};
    for (const auto& [number, i] : numbers) {
      set.label = input.simulations[i].run_label();
      BranchComparison one{compare_real(input, surfaces, i), {}};
      if (input.simulations[i].branch->round && axis)
        one.turned = best_turn(input.measured.sheet, surfaces[i], *axis);
      set.branches.push_back(std::move(one));
    }
    std::vector<std::size_t> order(set.branches.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, {}, [&](std::size_t k) { return set.branches[k].match_m(); });
    set.nearest = order[0];
    if (order.size() > 1) set.runner_up = order[1];
    sets.push_back(std::move(set));
  }
  return sets;
}

/// If nothing else was simulated, uses the branch nearest to the real shape to represent its set.
void stand_in_for_runs(const DrapeInput& input, Report& report) {
  for (const Simulation& simulation : input.simulations)
    if (!simulation.branch && !simulation.other_simulator) return;
  for (const BranchSet& set : report.branch_sets)
    report.real_virtual.push_back(set.branches[set.nearest].as_placed);
}

std::vector<VirtualVirtual> virtual_pairs(const std::vector<Simulation>& simulations,
                                          const std::vector<Surface>& surfaces,
                                          const std::vector<Eigen::Vector2d>& places) {
  std::vector<VirtualVirtual> pairs;
  for (std::size_t order = 0; order < kPairs.size(); ++order) {
    const PaperPair& pair = kPairs[order];
    for (std::size_t a = 0; a < surfaces.size(); ++a) {
      if (!is(simulations[a], pair.grid, pair.segments)) continue;
      for (std::size_t b = 0; b < surfaces.size(); ++b) {
        const Simulation &first = simulations[a], &second = simulations[b];
        if (!is(second, pair.other_grid, pair.other_segments) || first.setup() != second.setup())
          continue;
        const std::vector<double> distances = distances_between(surfaces[a], surfaces[b], places);
        if (distances.empty()) continue;
        pairs.push_back({a, b, label_of(pair), first.apart_text(), order,
                         statistics_of(distances, {}),
                         surface_distance(mesh_of(first.sheet.sheet), mesh_of(second.sheet.sheet),
                                          kSurfaceSpacing_m)});
      }
    }
  }
  return pairs;
}

std::vector<Surface> surfaces_of(const std::vector<Simulation>& simulations) {
  std::vector<Surface> surfaces;
  surfaces.reserve(simulations.size());
  for (const Simulation& simulation : simulations)
    surfaces.emplace_back(simulation.sheet.sheet, simulation.sheet.file.string());
  return surfaces;
}

/// See Report::headline.
std::optional<std::size_t> headline_of(const DrapeInput& input, const Report& report) {
  const std::vector<RealVirtual>& rows = report.real_virtual;
  const auto first = std::ranges::min_element(
      rows, [&](const Simulation& a, const Simulation& b) { return input.speaks_before(a, b); },
      [&](const RealVirtual& row) -> const Simulation& {
        return input.simulations[row.simulation];
      });
  if (first == rows.end()) return std::nullopt;
  return static_cast<std::size_t>(first - rows.begin());
}

/// Passes on the NO-GO of a sheet that positioned a simulation, with its first cause, stated once,
/// and that of another simulator's mesh.
void judge_placing(const Simulation& simulation, const std::optional<std::string>& said,
                   std::vector<std::string>& no_go) {
  const auto& cause = simulation.sheet.sheet.no_go;
  if (cause && simulation.other_simulator)
    no_go.push_back(fmt::format("simulation {}: {}", simulation.label(), *cause));
  else if (cause && cause != said)
    no_go.push_back(fmt::format("simulation {} was placed by a sheet that is NO-GO: {}",
                                simulation.label(), *cause));
}

void judge_measurement(const Options& options, Report& report) {
  for (const RealVirtual& row : report.real_virtual) {
    if (row.statistics.marks >= options.min_marks) continue;
    report.no_go.push_back(fmt::format("only {} marks could be compared, {} are asked for",
                                       row.statistics.marks, options.min_marks));
    break;
  }
  if (!report.measurement.sigma_median_m)
    report.no_go.emplace_back(
        "the measured marks carry no covariance, so their uncertainty is unknown");
}

void judge_simulation(const Simulation& simulation, const Options& options,
                      std::vector<std::string>& no_go, std::vector<std::string>& warnings) {
  if (!simulation.other_simulator && simulation.source().status != "at rest")
    (options.accept_unsettled ? warnings : no_go)
        .push_back(
            fmt::format("simulation {}: {}", simulation.label(), simulation.source().status));
}

/// Requires that objects and table of a simulation are those with which the marks were measured;
/// other values of its scene, such as friction, may differ.
void judge_scenes(const DrapeInput& input, Report& report) {
  const auto& asked = input.measured.asked;
  std::map<std::string, std::vector<std::string>> differences;  // labels by difference
  std::vector<std::string> unknown, without_mesh;
  for (const Simulation& simulation : input.simulations) {
    if (!asked || simulation.other_simulator) continue;
    if (simulation.scene) {
      if (const auto why = difference_of(asked->surroundings, simulation.scene->surroundings))
        differences[*why].push_back(simulation.label());
    } else if (simulation.source().scene_sha256 != asked->sha256) {
      unknown.push_back(simulation.label());
    } else if (std::ranges::any_of(asked->surroundings, [](const auto& value) {
                 return value.first.ends_with(".file");
               })) {
      without_mesh.push_back(simulation.label());
    }
  }
  if (!without_mesh.empty())
    report.warnings.push_back(fmt::format(
        "no run record names the mesh that was simulated, so nothing says that it is the one that "
        "the marks were asked about: {}",
        fmt::join(without_mesh, "; ")));
  if (!unknown.empty())
    report.no_go.push_back(fmt::format(
        "simulated from another content of the scene file than the marks were asked about, which "
        "is not there any more, so nothing says that its objects are the same (simulation {}); "
        "simulate again",
        fmt::join(unknown, "; ")));
  for (const auto& [why, labels] : differences)
    report.no_go.push_back(
        fmt::format("the simulated objects are not those that the marks were asked about: {} "
                    "(simulation {}); correct the scene and simulate again, or ask the marks about "
                    "it by drape triangulate --scene",
                    why, fmt::join(labels, "; ")));
  if (!asked && !input.simulations.empty())
    report.warnings.emplace_back(
        "the marks were asked about no scene, so nothing says whether they contradict the "
        "simulation's objects and table: measure with drape triangulate --scene SCENE.toml");
}

/// Adds one warning for all simulations positioned by another measured sheet.
void warn_of_other_starts(const DrapeInput& input, Report& report) {
  std::vector<std::string> labels;
  for (const RealVirtual& row : report.real_virtual) {
    const Simulation& simulation = input.simulations[row.simulation];
    const auto& start = simulation.source().start_sha256;
    if (start && !input.measured.has_content(*start)) labels.push_back(simulation.label());
  }
  if (!labels.empty())
    report.warnings.push_back(
        fmt::format("placed by another measured sheet than this one: {}", fmt::join(labels, "; ")));
}

void warn_of_branches(const DrapeInput& input, Report& report) {
  for (const BranchSet& set : report.branch_sets) {
    const Simulation& one = input.simulations[set.branches[0].as_placed.simulation];
    const Branch& first = *one.branch;
    if (!one.is_of_cloth_of(*input.speaker()))
      report.warnings.push_back(fmt::format(
          "branches of {}: of another model, fabric or scene than {}, which speaks for the drape, "
          "so that they count for neither match nor U",
          set.label, input.speaker()->label()));
    if (first.round && !set.branches[0].turned) {
      report.warnings.push_back(fmt::format(
          "branches of {}: the scene is round, but its file was not found, so that a branch turned "
          "about the vertical counts as another shape",
          set.label));
    }
    if (set.branches.size() < static_cast<std::size_t>(first.of)) {
      report.warnings.push_back(
          fmt::format("branches of {}: {} of the {} that were found are given", set.label,
                      set.branches.size(), first.of));
    }
  }
}

/// Throws Error(bad_input) if the measured sheet and a mesh or simulation belong to two drapes:
/// neither scene nor frame set agree. A mesh has the set of the simulations of its scene. Returns
/// a reason for each scene of another name whose set is unknown, since it may be another drape.
std::vector<std::string> require_one_drape(const DrapeInput& input) {
  const std::string own = input.measured.scene(), own_set = input.measured.measured().set;
  std::map<std::string, std::string> sets;  // set of each scene, from the simulations that state it
  for (const Simulation& one : input.simulations)
    if (one.scene && !one.scene->set.empty()) sets.emplace(one.source().scene, one.scene->set);
  std::vector<std::string> unknown;
  const auto check = [&](const std::string& scene, const std::string& set, const std::string& label,
                         const std::filesystem::path& file) {
    if (scene == own || set == own_set) return;
    if (!set.empty())
      throw bad_input(
          fmt::format("scene `{}` with frame set `{}` is another drape than that of {}, frame set "
                      "`{}`{}",
                      scene, set, input.measured.file.string(), own_set,
                      own.empty() ? "" : fmt::format(" of scene `{}`", own)),
          {.file = file.string(), .field = "source.scene"},
          "put the measured sheet of each drape before its simulations; one that was taken in a "
          "set of another name says its scene by drape triangulate --scene");
    if (!own.empty())
      unknown.push_back(
          fmt::format("nothing says that scene `{}` of {} is the drape of scene `{}` that was "
                      "measured; simulate again, or write `{}` as the scene of a mesh that is",
                      scene, label, own, own));
  };
  for (const Simulation& one : input.simulations) {
    const std::string& scene = one.source().scene;
    check(scene, one.scene ? one.scene->set : sets[scene], one.label(), one.sheet.file);
  }
  for (const OtherSurface& one : input.surfaces)
    check(one.scene, sets[one.scene], one.simulator, one.file);
  return unknown;
}

/// Sets no_go to all reasons why the distances cannot be trusted (the first cause first: sheets
/// that are NO-GO, marks, simulations), and adds warnings.
void judge(const DrapeInput& input, const Options& options, const std::vector<std::string>& unknown,
           Report& report) {
  const auto& measured = input.measured.sheet.no_go;
  if (measured) report.no_go.push_back(*measured);
  for (const Simulation& simulation : input.simulations)
    judge_placing(simulation, measured, report.no_go);
  report.no_go.insert(report.no_go.end(), unknown.begin(), unknown.end());
  judge_scenes(input, report);
  judge_measurement(options, report);
  for (const RealVirtual& row : report.real_virtual)
    judge_simulation(input.simulations[row.simulation], options, report.no_go, report.warnings);
  warn_of_other_starts(input, report);
  warn_of_branches(input, report);
  if (input.simulations.empty())
    report.no_go.emplace_back(input.surfaces.empty()
                                  ? "no simulation was given"
                                  : "no mark has a place on any mesh that was given: only "
                                    "surfaces could be compared");
}

}  // namespace

Measurement measurement_of(const Sheet& sheet) {
  Measurement measurement;
  measurement.marks = static_cast<int>(sheet.marks.size());
  measurement.gaps = static_cast<int>(sheet.gaps.size());
  std::vector<double> sigmas;
  for (const SheetMark& mark : sheet.marks)
    if (const auto sigma_m = worst_sigma_m(mark)) sigmas.push_back(*sigma_m);
  if (sigmas.empty() || sigmas.size() != sheet.marks.size()) return measurement;
  measurement.sigma_median_m = quantile(sigmas, 0.5);
  measurement.sigma_max_m = *std::ranges::max_element(sigmas);
  return measurement;
}

Eigen::Vector2d percent_of_patch(double length_m, const Eigen::Vector2d& patch_m) {
  return 100.0 * length_m * patch_m.cwiseInverse();
}

RealSurface compare_to_surface(const Sheet& measured, const TriangleMesh& mesh) {
  RealSurface row;
  row.to_surface = to_surface_of(measured, {}, mesh);
  const TriangleMesh real = mesh_of(measured);
  if (!real.triangles.empty())
    row.both_directions = surface_distance(real, mesh, kSurfaceSpacing_m);
  return row;
}

Report compare_drape(const DrapeInput& input, const Options& options) {
  check_group(input.simulations);
  const std::vector<std::string> unknown = require_one_drape(input);
  for (const Simulation& simulation : input.simulations) check_patch(input, simulation);
  Report report;
  report.name = input.name();
  report.measurement = measurement_of(input.measured.sheet);
  if (input.measured.sheet.marks.empty()) {
    report.no_go = {input.measured.sheet.no_go.value_or("the measured sheet has no mark")};
    return report;
  }
  const std::vector<Surface> surfaces = surfaces_of(input.simulations);
  for (const std::size_t i : paper_order(input)) {
    if (!input.simulations[i].branch)
      report.real_virtual.push_back(compare_real(input, surfaces, i));
  }
  report.branch_sets = compare_branches(input, surfaces);
  stand_in_for_runs(input, report);
  report.headline = headline_of(input, report);
  report.real_surface = compare_surfaces(input);
  const Sheet& measured = input.measured.sheet;
  const std::string file = input.measured.file.string();
  report.lattice_has_gaps_filled = LatticeCoordinates::of(measured, file).has_value();
  report.virtual_virtual =
      virtual_pairs(input.simulations, surfaces, lattice_places_of(measured, file));
  const auto drapemeter_of = [&](const Sheet& sheet) {
    return input.scene ? drapemeter(sheet, *input.scene)
                       : DrapemeterResult{{}, "the scene file was not found"};
  };
  report.measured_drapemeter = drapemeter_of(input.measured.sheet);
  for (const Simulation& simulation : input.simulations)
    report.drapemeters.push_back(drapemeter_of(simulation.sheet.sheet));
  judge(input, options, unknown, report);
  return report;
}

VirtualGroup compare_virtual_group(std::vector<Simulation> simulations) {
  check_group(simulations);
  VirtualGroup group{simulations.front().source().scene, std::move(simulations), {}};
  const auto coarsest = std::ranges::min_element(group.simulations, {}, [](const Simulation& one) {
    return std::pair(!one.is_grid(), one.sheet.sheet.marks.size());
  });
  group.pairs = virtual_pairs(group.simulations, surfaces_of(group.simulations),
                              places_of(coarsest->sheet.sheet));
  return group;
}

void judge_group(const Options& options, VirtualGroup& group, std::vector<std::string>& warnings) {
  for (const Simulation& simulation : group.simulations) {
    judge_placing(simulation, std::nullopt, group.no_go);
    judge_simulation(simulation, options, group.no_go, warnings);
  }
}

}  // namespace drape::compare
