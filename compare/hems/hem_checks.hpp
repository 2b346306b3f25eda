// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "compare/hems/hem_files.hpp"
#include "core/error.hpp"

namespace drape::compare {

/// Tolerance of lengths for strain and scale: the widest of 304 published hems is 2.3 % wider than
/// its specimen.
inline constexpr double kLengthTolerance = 0.03;

/// Computes the numbers and nodes of `record.hem`. Throws Error(bad_input) for a hem impossible for
/// the geometry, allowing for the scale's `errors` and what U of its area already contains.
void evaluate(HemRecord& record, HemErrors errors, const HemReadOptions& options,
              double area_u_m2 = 0);

/// Throws Error(bad_input), naming the options that fit, if disc or specimen differ from those of
/// the drape: the resulting coefficient would look like any other. Absent values are unknown.
void require_geometry(const std::optional<double>& disc_m, const std::optional<double>& specimen_m,
                      const DrapemeterGeometry& asked, const Where& where);

/// Throws Error(bad_input) if the surface of a mesh of unknown flat area is impossible for the
/// specimen.
void require_surface(double surface_m2, const DrapemeterGeometry& asked, const Where& where);

}  // namespace drape::compare
