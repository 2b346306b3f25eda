// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/metrics/metrics.hpp"
#include "compare/repeats/repeats.hpp"
#include "core/simulation_files.hpp"

namespace drape::compare {

/// One of several equilibria of a drape.
struct Branch : ListedBranch {
  std::string set_sha256;              ///< hash of the branches.json that lists all of them
  int of = 0;                          ///< number of equilibria found
  bool round = false;                  ///< true if the scene is symmetric about a vertical axis
  std::optional<double> least_j = {};  ///< energy of the lowest in its list, given or not
};

/// The entry for this sheet in branches.json in the folder above the sheet's, and that file;
/// nullopt if there is none. Throws Error(bad_input) for a list that cannot be read.
[[nodiscard]] std::optional<std::pair<std::filesystem::path, Branch>> branch_of(
    const std::filesystem::path& sheet);

/// The entry with that number in a list; nullopt if there is none.
[[nodiscard]] std::optional<Branch> branch_in(const Document& list, int number);

/// The list in the folder above a branch's sheet, if it still has the hash stated.
[[nodiscard]] std::optional<BranchList> list_above(const std::filesystem::path& sheet,
                                                   const std::string& sha256);

/// Summaries for people, without a full stop.
[[nodiscard]] std::string ensemble_sentence(const BranchList& list);
[[nodiscard]] std::string friction_sentence(const FrictionBand& band);
[[nodiscard]] std::string memory_sentence(const MemoryBand& band);

/// Base of the vertical axis of a round scene on the table: the centre of its first object.
[[nodiscard]] std::optional<Eigen::Vector2d> axis_of(const Scene& scene);

/// Mean distance after the rotation about a vertical axis that minimises it. On a round object a
/// rotated equilibrium is the same one, so only this distance shows which one the cloth took.
struct TurnedDistance {
  double mean_m = 0;
  double turn_rad = 0;     ///< rotation of the virtual sheet, from x to y
  bool half_turn = false;  ///< true if the sheet is also turned by half a turn in its own plane
  Eigen::Vector2d axis_in_world = Eigen::Vector2d::Zero();
};

/// Tries rotations in steps of one degree, with the sheet as it is and with every material point
/// exchanged with the opposite one; then refines the best by golden section. nullopt if no mark has
/// a position on the virtual sheet.
[[nodiscard]] std::optional<TurnedDistance> best_turn(const Sheet& measured,
                                                      const Surface& virtual_sheet,
                                                      const Eigen::Vector2d& axis_in_world);

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
  std::map<std::string, std::string> apart = {};

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

/// Reads a drape made by another program (core/drape_mesh.hpp, "drapebench/mesh/1", *.toml). A mesh
/// with texture coordinates is sampled at the measured marks and, between them, at least every 2 mm
/// of cloth, linear on its triangles; otherwise its vertices are the points. The mesh must be in
/// the bench's world, and adjacent points must be about as far apart as on the cloth, since
/// otherwise a unit is wrong. Throws Error(bad_input) that names file and field. `mesh`: file to
/// read instead of the mesh named in the description.
[[nodiscard]] Simulation read_other_mesh(const std::filesystem::path& file, const Sheet& measured,
                                         const std::filesystem::path& mesh = {});

/// Reads a mesh that states `correspondence = "none"` instead of [grid] or [uv]: only its surface
/// can be compared. nullopt if the description does not state it. Throws Error(bad_input).
[[nodiscard]] std::optional<OtherSurface> read_other_surface(
    const std::filesystem::path& file, const std::filesystem::path& mesh = {});

/// Content whose hash identifies a mesh in the store: the hashes of its description and of the
/// mesh.
[[nodiscard]] std::string other_mesh_content(const std::string& description_sha256,
                                             const std::string& mesh_sha256);

/// The hash of the description in such content; nullopt for other content.
[[nodiscard]] std::optional<std::string> description_in(const std::string& content);

/// Identity of the file as a sheet in the store, without reading the mesh: the hash of both files.
struct OtherMeshId {
  std::string sha256;
  std::filesystem::path mesh;
  std::string mesh_sha256;
};
/// nullopt if the file is not a "drapebench/mesh" or its mesh does not exist.
[[nodiscard]] std::optional<OtherMeshId> other_mesh_id(const std::filesystem::path& file);

}  // namespace drape::compare
