// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "core/error.hpp"
#include "core/rig.hpp"
#include "core/scene.hpp"

namespace drape {

/// Rules about a file that was read, beyond those of its description: each fault with file, line,
/// field and remedy. An empty list means that the bench can be as the file says. read_scene(),
/// read_target() and read_print() ask them, so every program does that measures or simulates;
/// compare reads scenes as they were used.

/// Uncertainties wider than the object itself, a drape that nothing holds.
[[nodiscard]] std::vector<Error> faults_of(const Scene& scene);
/// Objects that are not where a table can carry them. Asked of typed scenes by `drape check`: a
/// place that was measured and contradicts the table is a NO-GO of the measurement.
[[nodiscard]] std::vector<Error> faults_of_places(const Scene& scene);

/// Pins and clamps that hold no point of the print's cloth, or more cloth than there is between
/// them; a start from above the room.
[[nodiscard]] std::vector<Error> faults_of(const Scene& scene, const Print& print);
/// Reads the scene's print and asks the rules between both. Throws every fault at once.
[[nodiscard]] Print print_of(const Scene& scene);

/// Tags of a family that is not known, two of one id, and tags that would lie over a dot.
[[nodiscard]] std::vector<Error> faults_of(const Target& target);
[[nodiscard]] std::vector<Error> faults_of(const Print& print);

/// Names in `stand_ins` that no value of the file has.
[[nodiscard]] std::vector<Error> faults_of_stand_ins(const Document& document,
                                                     std::vector<std::string> also_known = {});

/// Values that are odd, but possible.
[[nodiscard]] std::vector<std::string> warnings_of(const Scene& scene);
[[nodiscard]] std::vector<std::string> warnings_of(const Print& print);

/// The tag families that detect knows, and how many tags each has.
[[nodiscard]] std::vector<std::pair<std::string, int>> known_tag_families();

}  // namespace drape
