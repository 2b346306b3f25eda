// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "compare/metrics/branches.hpp"
#include "compare/metrics/surface.hpp"
#include "compare/repeats/mark_repeats.hpp"
#include "core/levels.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"

namespace drape::compare {

/// The scene used by a simulation, if its file has not changed since.
struct SimulatedScene {
  std::string set;  ///< frame set of the recording that shows the drape; can be empty
  Surroundings surroundings;
  double friction = 0;
  bool own_fabric = false;  ///< true if the simulated fabric is the one named by the scene
};

/// `scene` has the content that was simulated; `inputs` are the run's input files with their
/// SHA-256, including any mesh. nullopt if they do not contain a mesh of the scene.
[[nodiscard]] std::optional<SimulatedScene> read_simulated_scene(
    const std::filesystem::path& scene,
    const std::vector<std::pair<std::filesystem::path, std::string>>& inputs);

/// Describes how two scenes differ in solids and table, which marks can touch; stated uncertainties
/// and tags may differ. `in_other` names the other scene.
[[nodiscard]] std::optional<std::string> difference_of(
    const Surroundings& asked, const Surroundings& other,
    const std::string& in_other = "in the simulation");

/// Statements of the simulator about its result (certificate.json), each under its own name, which
/// ends in its unit.
struct Certificate {
  std::string sha256;
  std::vector<std::pair<std::string, std::string>> entries;
};

/// Properties common to simulations that differ only in discretisation and segments: model, solver,
/// fabric, scene and start (the last three as SHA-256), whether it started from the measured shape,
/// and the options that affect where a cloth can rest.
using Setup = std::map<std::string, std::string>;

struct Simulation {
  SheetFile sheet;
  std::optional<Certificate> certificate;
  std::optional<std::string> other_simulator = {};  ///< name of another program that made the sheet
  std::filesystem::path other_file = {};            ///< mesh of the other program
  std::optional<Branch> branch = {};                ///< set for one equilibrium of several
  std::optional<LevelsFile> levels = {};            ///< its meshes, from the levels.json beside it
  std::optional<SimulatedScene> scene = {};         ///< absent if the scene file has changed since
  /// Differences from others of its group, other than mesh and segments: {"fabric", "B"}.
  std::vector<std::pair<std::string, std::string>> apart = {};

  [[nodiscard]] const SimulatedSource& source() const {
    return std::get<SimulatedSource>(sheet.sheet.source);
  }
  /// True for particles of a grid, whose size the sheet has; else the sheet samples a mesh.
  [[nodiscard]] bool is_grid() const { return !source().spacing_m; }
  /// "2.5 mm", or "21x21" for a grid.
  [[nodiscard]] std::string discretisation() const { return sheet.sheet.discretisation(); }
  /// Sort key, larger for finer: any mesh is finer than any grid.
  [[nodiscard]] std::pair<bool, double> fineness() const;
  /// Label such as "2.5 mm, 5 segments"; "21x21, 5 segments, fabric B"; "Blender 3.4, 111x111".
  [[nodiscard]] std::string run_label() const;
  [[nodiscard]] std::string label() const;  ///< the same, with "..., branch 3" for a branch
  /// Line segments per Kawabata curve; nullopt for another simulator.
  [[nodiscard]] std::optional<int> segments() const {
    return other_simulator ? std::nullopt : std::optional(source().segments);
  }
  [[nodiscard]] std::string segments_text() const {  ///< "5", or empty
    return other_simulator ? "" : std::to_string(source().segments);
  }
  [[nodiscard]] std::string apart_text() const;  ///< ", fabric B", or empty
  [[nodiscard]] Setup setup() const;
  /// True if model, fabric and scene are equal, as between an ensemble and its drape.
  [[nodiscard]] bool is_of_cloth_of(const Simulation& other) const;
};

/// Fills in `apart` for the simulations of one group.
void tell_apart(std::vector<Simulation>& simulations);

/// A mesh of another simulator that does not identify material points, so that only distances to
/// its surface can be computed.
struct OtherSurface {
  std::filesystem::path file, mesh_file;  ///< its description, and the mesh file
  std::string sha256, mesh_sha256;  ///< hash of both files together (its identity), and of the mesh
  std::string simulator, scene;
  std::optional<std::string> fabric;
  TriangleMesh mesh;
};

/// A measured sheet and the simulations of the same drape.
struct DrapeInput {
  SheetFile measured;
  std::vector<Simulation> simulations;
  std::vector<OtherSurface> surfaces = {};
  std::optional<Scene> scene = {};         ///< scene of its speaker, if its file is unchanged
  std::vector<SheetFile> repeats = {};     ///< other layings of the same cloth, with their names
  std::optional<PlacedDrape> placed = {};  ///< position among the branches of speaking_branch()

  /// Name of its scene, so that a drape has the same name in every run; that of the set if unknown.
  [[nodiscard]] std::string name() const;
  /// True if the first simulation represents the drape rather than the second, whatever the order
  /// given. Preferred are a drapebench run over a branch, and that over another simulator; the
  /// scene used for the marks; the fabric named in the scene; the scene's own start; the finest
  /// mesh, then the finest grid; five segments, then the most. Remaining ties are decided by names
  /// and hashes.
  [[nodiscard]] bool speaks_before(const Simulation& one, const Simulation& other) const;
  [[nodiscard]] const Simulation* speaker() const;  ///< null if there are no simulations
  /// A branch of the speaker's cloth from the list that states the effect of start and friction on
  /// the drape; null if there is none.
  [[nodiscard]] const Simulation* speaking_branch() const;
};

}  // namespace drape::compare
