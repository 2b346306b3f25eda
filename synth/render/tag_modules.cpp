// SPDX-License-Identifier: Apache-2.0
#include "synth/render/tag_modules.hpp"

#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h11.h>
#include <fmt/format.h>

#include <cstdlib>
#include <memory>

#include "core/error.hpp"

namespace drape::synth {
namespace {

using Family = std::shared_ptr<apriltag_family_t>;

Family family_named(const std::string& name) {
  if (name == "tag36h11") return {tag36h11_create(), tag36h11_destroy};
  if (name == "tag25h9") return {tag25h9_create(), tag25h9_destroy};
  if (name == "tag16h5") return {tag16h5_create(), tag16h5_destroy};
  throw bad_input(fmt::format("the tag family `{}` cannot be drawn", name),
                  {.field = "tags.family"}, "use tag36h11, tag25h9 or tag16h5");
}

}  // namespace

std::vector<Rectangle> tag_modules(const std::string& family_name, int id, double edge_m,
                                   const FacePoint& centre) {
  const Family family = family_named(family_name);
  if (id < 0 || static_cast<std::uint32_t>(id) >= family->ncodes) {
    throw bad_input(fmt::format("the family {} has no tag {}", family_name, id), {.field = "tags"},
                    fmt::format("give ids from 0 to {}", family->ncodes - 1));
  }
  const std::shared_ptr<image_u8_t> image(apriltag_to_image(family.get(), id), [](image_u8_t* i) {
    std::free(i->buf);
    std::free(i);
  });
  const int count = family->total_width;
  const double module_m = edge_m / family->width_at_border;
  const FacePoint corner = centre - FacePoint::Constant(module_m * count / 2);
  // The library draws its tags half a turn from what its detector calls upright.
  const auto black = [&](int x, int y) {
    return image->buf[(count - 1 - y) * image->stride + count - 1 - x] < 128;
  };
  std::vector<Rectangle> modules;
  for (int y = 0; y < count; ++y) {
    for (int x = 0; x < count; ++x) {
      int run = 0;
      while (x + run < count && black(x + run, y)) ++run;
      if (run == 0) continue;
      modules.push_back(
          {corner + module_m * FacePoint(x, y), corner + module_m * FacePoint(x + run, y + 1)});
      x += run;
    }
  }
  return modules;
}

}  // namespace drape::synth
