// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "compare/hems/hem_files.hpp"
#include "core/error.hpp"

namespace drape::compare {

/// Cloth strains, and scales err: the widest of 304 published hems is 2.3 % wider than its
/// specimen.
inline constexpr double kLengthTolerance = 0.03;

/// The numbers and nodes of `record.hem`. Throws Error(bad_input) for a hem that no drape of the
/// geometry can have, with a scale that errs by `errors` and by what U of its area holds already.
void evaluate(HemRecord& record, HemErrors errors, const HemReadOptions& options,
              double area_u_m2 = 0);

/// A coefficient by another disc or specimen than the drape was made with would look like any
/// other: throws Error(bad_input) with the options that fit. What is absent is not known.
void require_geometry(const std::optional<double>& disc_m, const std::optional<double>& specimen_m,
                      const DrapemeterGeometry& asked, const Where& where);

/// Throws Error(bad_input) where a mesh whose flat area nobody states has a surface that no cloth
/// of the specimen has.
void require_surface(double surface_m2, const DrapemeterGeometry& asked, const Where& where);

}  // namespace drape::compare
