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
  f({"at_rest", "at rest, and accepted by the checker"}, start.at_rest);
  f.otherwise({"steps", "steps to rest", 1, 0}, start.steps);
  f.if_any({"residual_point_weights", "largest force left, in mean weights of a point"},
           start.residual);
  f.if_any({"energy_uj", "energy of cloth and height", kMicrojoule}, start.energy_j);
  f.if_any({"refusals", "the checker's reasons"}, start.refusals);
  f.if_any({"checked_residual_point_weights", "the same as the checker finds it"},
           start.checked_residual);
  f.if_any({"deepest_mm", "deepest point in the discs", mm}, start.deepest_m);
  f.if_any({"internal_friction_took_uj", "energy that internal friction took", kMicrojoule},
           start.dissipated_j);
  f.otherwise({"hurried_loads", "loads left before the cloth was near rest", 1, 0},
              start.hurried_loads);
}

void fields(Fields& f, CusickFile& file) {
  f({"fabric", "name of the fabric"}, file.fabric);
  f.if_any({"disc_mm", "diameter of the discs", mm, above_zero}, file.disc_m);
  f.if_any({"specimen_mm", "diameter of the specimen", mm, above_zero}, file.specimen_m);
  f({"starts", "one drape a start"}, file.starts);
}

}  // namespace drape
