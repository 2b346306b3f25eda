// SPDX-License-Identifier: Apache-2.0
#include "core/cusick.hpp"

#include "core/units.hpp"

namespace drape {

using units::mm;

static void fields(Fields& f, CusickStart& start) {
  constexpr double kMicrojoule = 1e-6;
  f(Field{"file", "mesh beside this list, PLY in mm"}.plain_name(), start.file);
  f.otherwise({"points", "points of the mesh", 1, 0}, start.points);
  f({"specimen_area_mm2", "flat area of the specimen", mm * mm, 0}, start.specimen_area_m2);
  f({"at_rest", "true if at rest and accepted by the checker"}, start.at_rest);
  f.otherwise({"steps", "number of steps to rest", 1, 0}, start.steps);
  f.if_any({"residual_point_weights", "largest net force, in mean weights of a point"},
           start.residual);
  f.if_any({"energy_uj", "strain energy plus gravitational energy", kMicrojoule}, start.energy_j);
  f.if_any({"refusals", "reasons of the checker for a refusal"}, start.refusals);
  f.if_any({"checked_residual_point_weights", "the same, as computed by the checker"},
           start.checked_residual);
  f.if_any({"deepest_mm", "deepest penetration into the discs", mm}, start.deepest_m);
  f.if_any({"internal_friction_took_uj", "energy lost to internal friction", kMicrojoule},
           start.dissipated_j);
  f.otherwise({"hurried_loads", "number of load steps ended before the cloth was near rest", 1, 0},
              start.hurried_loads);
}

void fields(Fields& f, CusickFile& file) {
  f({"fabric", "name of the fabric"}, file.fabric);
  f.if_any({"disc_mm", "diameter of the discs", mm, above_zero}, file.disc_m);
  f.if_any({"specimen_mm", "diameter of the specimen", mm, above_zero}, file.specimen_m);
  f({"starts", "one drape per start"}, file.starts);
}

}  // namespace drape
