// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/drape_input.hpp"

namespace drape::compare {

/// A row of the paper's tables with odd numbers ("Real Vs virtual").
struct RealVirtual {
  std::size_t simulation = 0;  ///< index into DrapeInput::simulations
  MarkComparison marks;
  DistanceStatistics statistics;
  NormalStatistics normal;
  std::optional<RigidAlignment> aligned;  ///< reported beside the statistics, never part of them
  DistanceStatistics to_surface;  ///< from each mark to the nearest point of the virtual sheet
  StrainMaps strain;
};

/// A row of the paper's tables with even numbers ("Virtual Vs virtual").
struct VirtualVirtual {
  std::size_t first = 0, second = 0;  ///< indices into DrapeInput::simulations
  std::string label;                  ///< "11x11: 5 seg vs 1 seg", "5 seg: 11x11 vs 21x21"
  std::string apart;                  ///< Simulation::apart_text() of both
  std::size_t paper_order = 0;        ///< position in the paper's tables
  DistanceStatistics statistics;
  SurfaceDistance surface;  ///< distance of the two sheets as surfaces, in both directions
};

/// Comparison of one equilibrium of a drape with the real cloth.
struct BranchComparison {
  RealVirtual as_placed;                 ///< at the position of the branch
  std::optional<TurnedDistance> turned;  ///< only on a round object

  /// Mean distance by which branches are compared with the real shape.
  [[nodiscard]] double match_m() const {
    return turned ? turned->mean_m : as_placed.statistics.mean_m;
  }
};

/// The equilibria in one list, and the one assigned to the real shape.
struct BranchSet {
  std::string sha256;                      ///< hash of branches.json
  std::string label;                       ///< "21x21, 1 segment"
  std::vector<BranchComparison> branches;  ///< sorted by energy, lowest first
  std::size_t nearest = 0;                 ///< branch with the smallest match_m()
  std::optional<std::size_t> runner_up;    ///< second nearest branch
};

/// Distance to a surface without marks. It is at most the distance of corresponding points and is
/// never in a table with it.
struct RealSurface {
  std::size_t surface = 0;        ///< index into DrapeInput::surfaces
  DistanceStatistics to_surface;  ///< from each measured mark to the nearest point of the mesh
  /// From the surface between the measured marks (cells with four of them) to the mesh, and back.
  /// Absent if no cell was measured completely.
  std::optional<SurfaceDistance> both_directions;
};

/// Results for one drape: its record, and what the record is made from.
struct Report : ReportedDrape {
  std::vector<RealVirtual> real_virtual;  ///< 5 segments before 1, fine grids before coarse
  std::vector<RealSurface> real_surface;  ///< in the order of DrapeInput::surfaces
  /// Equilibria of one drape. They appear in no other table, except that without other simulations
  /// the nearest of each set is in real_virtual too.
  std::vector<BranchSet> branch_sets;
  std::vector<VirtualVirtual> virtual_virtual;  ///< in the order of the paper's tables
  bool lattice_has_gaps_filled = false;  ///< virtual pairs use all marks of the lattice, also gaps
  /// Index into real_virtual of the simulation that represents the drape, chosen by
  /// DrapeInput::speaks_before() before any distance is known.
  std::optional<std::size_t> headline;
  /// The headline compared with the repeats used; absent if there is only the drape's own laying.
  std::optional<MarkRepeats> among_repeats;
  double significance = 0.05;
  std::vector<DrapemeterResult> drapemeters;  ///< in the order of DrapeInput::simulations
  DrapemeterResult measured_drapemeter;
  std::vector<std::string> warnings;

  [[nodiscard]] const RealVirtual& speaks() const { return real_virtual[*headline]; }
  [[nodiscard]] bool go() const { return no_go.empty(); }
  [[nodiscard]] const std::string& called() const { return label.empty() ? name : label; }
};

/// Simulations of one scene without a real cloth, as in the paper's even tables.
struct VirtualGroup {
  std::string name;  ///< name of the scene
  std::vector<Simulation> simulations;
  std::vector<VirtualVirtual> pairs;    ///< indices into `simulations`
  std::vector<std::string> no_go = {};  ///< reasons why their distances are unfounded
};

/// Requirements on a comparison.
struct Options {
  int min_marks = 10;  ///< the paper used 10 to 36 marks (section 5)
  /// Largest median sigma of a mark relative to the limit of the match; see judge_resolution().
  double max_sigma_ratio = 0.1;
  bool accept_unsettled = false;           ///< accept simulations that are not at rest
  std::optional<double> tolerance_m = {};  ///< limit of the match below three repeats
  double significance = 0.05;  ///< probability that a real repeat counts as outside the others
};

/// Distances of the measured marks, and of the surface between them, from a mesh.
[[nodiscard]] RealSurface compare_to_surface(const Sheet& measured, const TriangleMesh& mesh);

[[nodiscard]] Measurement measurement_of(const Sheet& sheet);

/// Compares one drape: distances between each measured mark and the same material point of each
/// simulation, and, between simulations, the pairs in the paper's tables only: 5 against 1 segments
/// at grids 11, 21 and 31; grids 11 against 21 at 1 and at 5 segments; 11 against 31 and 21 against
/// 31 at 5 segments (Bottino, Laurentini & Scalabrin, section 5). Throws Error(bad_input) for
/// sheets of different patches or scenes and for a simulation given twice.
[[nodiscard]] Report compare_drape(const DrapeInput& input, const Options& options);

/// Compares the paper's pairs among the simulations at the particles of their coarsest grid. Throws
/// like compare_drape.
[[nodiscard]] VirtualGroup compare_virtual_group(std::vector<Simulation> simulations);

/// A length in percent of the patch's (warp, weft) side.
[[nodiscard]] Eigen::Vector2d percent_of_patch(double length_m, const Eigen::Vector2d& patch_m);

/// The same for simulations without a real cloth: reasons are those that are NO-GO or not at rest.
void judge_group(const Options& options, VirtualGroup& group, std::vector<std::string>& warnings);

}  // namespace drape::compare
