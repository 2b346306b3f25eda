// SPDX-License-Identifier: Apache-2.0
#include "detect/print_tags.hpp"

#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h10.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagStandard41h12.h>
#include <fmt/format.h>

#include <array>
#include <cstdlib>
#include <memory>

#include "core/error.hpp"

namespace drape {
namespace {

struct Family {
  const char* name;
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};

constexpr std::array<Family, 5> kFamilies = {
    {{"tag36h11", tag36h11_create, tag36h11_destroy},
     {"tag36h10", tag36h10_create, tag36h10_destroy},
     {"tag25h9", tag25h9_create, tag25h9_destroy},
     {"tag16h5", tag16h5_create, tag16h5_destroy},
     {"tagStandard41h12", tagStandard41h12_create, tagStandard41h12_destroy}}};

using FamilyPointer = std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)>;

FamilyPointer family_named(const std::string& name) {
  std::string known;
  for (const Family& family : kFamilies) {
    if (name == family.name) return {family.create(), family.destroy};
    known += (known.empty() ? "" : ", ") + std::string(family.name);
  }
  throw bad_input(fmt::format("the tag family `{}` is not known", name), {.field = "tags.family"},
                  "use one of " + known);
}

/// The library's picture of a tag, one byte per module, freed as the library allocated it.
struct Modules {
  explicit Modules(image_u8_t* library_image) : image(library_image) {}
  ~Modules() {
    std::free(image->buf);
    std::free(image);
  }
  Modules(const Modules&) = delete;
  Modules& operator=(const Modules&) = delete;
  /// The library's pictures stand on their heads beside what OpenCV draws and bench1 shows.
  [[nodiscard]] bool black(int x, int y) const {
    return image->buf[(image->height - 1 - y) * image->stride + image->width - 1 - x] < 128;
  }
  image_u8_t* image;
};

}  // namespace

PageArea tag_on_page(const std::string& family, int id, double edge_m,
                     const Eigen::Vector2d& centre_m) {
  const FamilyPointer tags = family_named(family);
  if (id < 0 || static_cast<std::uint32_t>(id) >= tags->ncodes) {
    throw bad_input(fmt::format("the family {} has no tag {}", family, id), {.field = "tags"},
                    fmt::format("give ids from 0 to {}", tags->ncodes - 1));
  }
  const Modules modules(apriltag_to_image(tags.get(), id));
  const int count = tags->total_width;
  const double module_m = edge_m / tags->width_at_border;
  const Eigen::Vector2d corner = centre_m - Eigen::Vector2d::Constant(module_m * count / 2);
  PageArea area;
  for (int y = 0; y < count; ++y) {
    for (int x = 0; x < count; ++x) {
      int run = 0;
      while (x + run < count && modules.black(x + run, y)) ++run;
      if (run == 0) continue;
      area.boxes.push_back(
          {corner + module_m * Eigen::Vector2d(x, y), module_m * Eigen::Vector2d(run, 1)});
      x += run;
    }
  }
  return area;
}

}  // namespace drape
