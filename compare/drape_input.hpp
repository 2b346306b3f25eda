// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "compare/asked_scene.hpp"
#include "compare/metrics/branches.hpp"
#include "compare/metrics/dense.hpp"
#include "core/levels.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"

namespace drape::compare {

/// Statements of the simulator about its result (certificate.json): every entry under its own name,
/// which ends in its unit.
struct Certificate {
  std::string sha256;
  std::vector<std::pair<std::string, std::string>> entries;
};

/// Properties shared by simulations that differ by discretisation and segments alone: model,
/// solver, fabric, scene and start (the last three as SHA-256), whether it began in the measured
/// shape, and the options that decide where a cloth can rest.
using Setup = std::map<std::string, std::string>;

struct Simulation {
  SheetFile sheet;
  std::optional<Certificate> certificate;
  std::optional<std::string> other_simulator = {};  ///< name of another program that made it
  std::filesystem::path other_file = {};            ///< its mesh
  std::optional<Branch> branch = {};                ///< one equilibrium of several
  std::optional<LevelsFile> levels = {};            ///< levels.json beside it: its meshes
  std::optional<SimulatedScene> scene = {};         ///< where its file is still what it read
  /// In what it differs from others of its group, beside mesh and segments: {"fabric", "B"}.
  std::vector<std::pair<std::string, std::string>> apart = {};

  [[nodiscard]] const SimulatedSource& source() const;
  /// Particles of a grid, whose size the sheet has; else the sheet samples a mesh.
  [[nodiscard]] bool is_grid() const { return !source().spacing_m; }
  [[nodiscard]] std::string discretisation() const;  ///< "2.5 mm", or "21x21" of a grid
  /// Larger is finer: any mesh before any grid.
  [[nodiscard]] std::pair<bool, double> fineness() const;
  /// "2.5 mm, 5 segments"; "21x21, 5 segments, fabric B"; "Blender 3.4, 111x111"
  [[nodiscard]] std::string run_label() const;
  [[nodiscard]] std::string label() const;  ///< the same, and "..., branch 3"
  /// Line segments per Kawabata curve; another simulator has none.
  [[nodiscard]] std::optional<int> segments() const;
  [[nodiscard]] std::string segments_text() const;  ///< "5", or empty
  [[nodiscard]] std::string apart_text() const;     ///< ", fabric B", or empty
  [[nodiscard]] Setup setup() const;
  /// Same model, fabric and scene: what an ensemble and its drape have in common.
  [[nodiscard]] bool is_of_cloth_of(const Simulation& other) const;
};

/// Fills `apart` of the simulations of one group.
void tell_apart(std::vector<Simulation>& simulations);

/// A mesh of another simulator that does not say which material point a vertex is: nothing in it
/// corresponds to a mark, so only distances to its surface can be given.
struct OtherSurface {
  std::filesystem::path file, mesh_file;  ///< its description, and the mesh
  std::string sha256, mesh_sha256;        ///< hash of both together (its identity), and of the mesh
  std::string simulator, scene;
  std::optional<std::string> fabric;
  TriangleMesh mesh;
};

/// A measured sheet and the simulations of the same drape.
struct DrapeInput {
  SheetFile measured;
  std::vector<Simulation> simulations;
  std::vector<OtherSurface> surfaces = {};
  std::optional<Scene> scene = {};  ///< scene of its speaker, where its file was found unchanged
  std::vector<SheetFile> repeats = {};  ///< the same cloth laid again; each says which repeat it is
  std::optional<PlacedDrape> placed = {};  ///< among the branches of speaking_branch()

  /// Its scene, so that a drape has one name in every run; the set where no scene is known.
  [[nodiscard]] std::string name() const;
  /// True where the first speaks for the drape rather than the second, in whatever order they were
  /// given: a run of drapebench before a branch and this before another simulator; of the scene
  /// that the marks were asked about; of the fabric that its scene names; of the scene's own start;
  /// of the finest mesh before the finest grid; with five segments, else the most. The names and
  /// hashes decide between what is left.
  [[nodiscard]] bool speaks_before(const Simulation& one, const Simulation& other) const;
  [[nodiscard]] const Simulation* speaker() const;  ///< null without simulations
  /// A branch of the list that says what start and friction leave of the drape, one of the
  /// speaker's cloth; null where there is none.
  [[nodiscard]] const Simulation* speaking_branch() const;
};

}  // namespace drape::compare
