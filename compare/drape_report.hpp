// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compare/drape_input.hpp"
#include "compare/metrics/alignment.hpp"
#include "compare/metrics/drapemeter.hpp"
#include "compare/metrics/metrics.hpp"
#include "compare/metrics/strain.hpp"
#include "compare/repeats/mark_repeats.hpp"
#include "core/run_report.hpp"

namespace drape::compare {

/// One row of the paper's tables with odd numbers ("Real Vs virtual").
struct RealVirtual {
  std::size_t simulation = 0;  ///< index into DrapeInput::simulations
  MarkComparison marks;
  DistanceStatistics statistics;
  NormalStatistics normal;
  std::optional<RigidAlignment> aligned;  ///< beside the statistics, never in them
  DistanceStatistics to_surface;          ///< each mark to the nearest point of the virtual sheet
  StrainMaps strain;
};

/// One row of the paper's tables with even numbers ("Virtual Vs virtual").
struct VirtualVirtual {
  std::size_t first = 0, second = 0;  ///< indices into DrapeInput::simulations
  std::string label;                  ///< "11x11: 5 seg vs 1 seg", "5 seg: 11x11 vs 21x21"
  std::string apart;                  ///< Simulation::apart_text() of both
  std::size_t paper_order = 0;        ///< place in the paper's tables
  DistanceStatistics statistics;
  SurfaceDistance surface;  ///< the two sheets as surfaces, in both directions
};

/// One equilibrium of a drape against the real cloth.
struct BranchComparison {
  RealVirtual as_placed;                 ///< at the place of the branch
  std::optional<TurnedDistance> turned;  ///< on a round object only

  /// The mean distance that says how much the real shape is like this branch.
  [[nodiscard]] double match_m() const;
};

/// The equilibria of one list, and the one to which the real shape is assigned.
struct BranchSet {
  std::string sha256;                      ///< hash of branches.json
  std::string label;                       ///< "21x21, 1 segment"
  std::vector<BranchComparison> branches;  ///< least energy first
  std::size_t nearest = 0;                 ///< smallest match_m(): the real shape's branch
  std::optional<std::size_t> runner_up;    ///< the next nearest
};

/// Distance to a surface without marks. It is at most the distance of corresponding points
/// and never stands in a table with it.
struct RealSurface {
  std::size_t surface = 0;        ///< index into DrapeInput::surfaces
  DistanceStatistics to_surface;  ///< each measured mark to the nearest point of the mesh
  /// First to second: the surface between the measured marks (cells with four of them) to the
  /// mesh. Absent when no cell was measured whole.
  std::optional<SurfaceDistance> both_directions;
};

/// Quality of the measurement of the real cloth.
struct Measurement {
  int marks = 0;
  int gaps = 0;
  std::optional<double> sigma_median_m;  ///< one mark, along its worst direction
  std::optional<double> sigma_max_m;
};

/// Everything found for one drape.
struct Report {
  std::string name;        ///< scene of the simulations, else the set of the measured sheet
  std::string label = {};  ///< the name, and what tells it from others of one run: "C (repeat 2)"
  Measurement measurement;
  std::vector<RealVirtual> real_virtual;  ///< 5 before 1 segments, fine before coarse grids
  std::vector<RealSurface> real_surface;  ///< index in DrapeInput::surfaces
  /// Equilibria of one drape. They are in no other table; where there is no other simulation, the
  /// nearest of each set stands in real_virtual too.
  std::vector<BranchSet> branch_sets;
  std::vector<VirtualVirtual> virtual_virtual;  ///< in the order of the paper's tables
  bool lattice_has_gaps_filled = false;  ///< virtual pairs use all marks of the lattice, gaps too
  /// Index into real_virtual of the simulation that speaks for the drape, by
  /// DrapeInput::speaks_before(): the rule stands before any distance is known.
  std::optional<std::size_t> headline;
  std::optional<Budget> budget;     ///< uncertainty of the headline's mean distance
  std::vector<RepeatLine> repeats;  ///< empty: laid once; else its own first
  /// The headline among the repeats that are not left out; absent where there is but its own.
  std::optional<MarkRepeats> among_repeats;
  double significance = 0.05;
  MatchVerdict match;
  std::vector<DrapemeterResult> drapemeters;  ///< index in DrapeInput::simulations
  DrapemeterResult measured_drapemeter;
  std::vector<std::string> no_go;  ///< why the measurement is NO-GO, the first cause first
  std::vector<std::string> warnings;

  [[nodiscard]] bool go() const { return no_go.empty(); }
  [[nodiscard]] const std::string& called() const { return label.empty() ? name : label; }
};

/// Simulations of one scene without a real cloth, as the paper's even tables.
struct VirtualGroup {
  std::string name;  ///< the scene
  std::vector<Simulation> simulations;
  std::vector<VirtualVirtual> pairs;    ///< indices into `simulations`
  std::vector<std::string> no_go = {};  ///< why their distances have no ground
};

}  // namespace drape::compare
