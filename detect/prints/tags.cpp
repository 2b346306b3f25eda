// SPDX-License-Identifier: Apache-2.0
#include "detect/prints/tags.hpp"

#include <fmt/format.h>

#include "core/error.hpp"
#include "detect/families/tag_family.hpp"

namespace drape::detect {

PageArea tag_on_page(const TagLook& look, int id, const Eigen::Vector2d& centre_m) {
  const TagFamily tags(look.family, look.border_modules);
  if (id < 0 || id >= tags.count()) {
    throw bad_input(fmt::format("the family {} has no tag {}", look.family, id), {.field = "tags"},
                    fmt::format("give ids from 0 to {}", tags.count() - 1));
  }
  const int count = tags.total_modules();
  const double module_m = look.edge_m / tags.edge_modules();
  const Eigen::Vector2d corner = centre_m - Eigen::Vector2d::Constant(module_m * count / 2);
  PageArea area;
  for (int y = 0; y < count; ++y) {
    for (int x = 0; x < count; ++x) {
      int run = 0;
      while (x + run < count && tags.black(id, x + run, y)) ++run;
      if (run == 0) continue;
      area.boxes.push_back(
          {corner + module_m * Eigen::Vector2d(x, y), module_m * Eigen::Vector2d(run, 1)});
      x += run;
    }
  }
  return area;
}

}  // namespace drape::detect
