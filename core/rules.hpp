// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "core/error.hpp"
#include "core/rig.hpp"
#include "core/scene.hpp"

namespace drape {

/// Rules about a file beyond those of its description. Each error names file, line, field and
/// remedy; an empty list means that the file describes a possible bench. read_scene(),
/// read_target() and read_print() apply them, so every program that measures or simulates does;
/// compare reads scenes as they were used.

/// Finds uncertainties wider than the object itself, and a drape without support.
[[nodiscard]] std::vector<Error> faults_of(const Scene& scene);
/// Finds objects whose position is incompatible with the table. Only `drape check` applies this, to
/// a scene as typed: a measured position that contradicts the table is a NO-GO of the measurement.
[[nodiscard]] std::vector<Error> faults_of_places(const Scene& scene);

/// Finds pins and clamps that lie outside the printed cloth or stretch the cloth between them too
/// far, and a start above the ceiling.
[[nodiscard]] std::vector<Error> faults_of(const Scene& scene, const Print& print);
/// Reads the scene's print and checks both against each other. Throws all errors at once.
[[nodiscard]] Print print_of(const Scene& scene);

/// Finds unknown tag families, repeated tag ids and tags that would overlap a dot.
[[nodiscard]] std::vector<Error> faults_of(const Target& target);
[[nodiscard]] std::vector<Error> faults_of(const Print& print);

/// Finds names in `stand_ins` that match no value of the file.
[[nodiscard]] std::vector<Error> faults_of_stand_ins(const Document& document,
                                                     std::vector<std::string> also_known = {});

/// Warns of values that are unusual but possible.
[[nodiscard]] std::vector<std::string> warnings_of(const Scene& scene);
[[nodiscard]] std::vector<std::string> warnings_of(const Print& print);

/// The tag families that detect supports, with the number of tags in each.
[[nodiscard]] std::vector<std::pair<std::string, int>> known_tag_families();

/// True if a target has half-turn symmetry, so that no picture distinguishes corner (0, 0) from the
/// opposite one: a chessboard with an even sum of rows and columns, or a grid of dots without tags
/// and hollow dots.
[[nodiscard]] bool is_ambiguous(const Target& target);

}  // namespace drape
