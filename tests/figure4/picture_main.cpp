// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cstdlib>
#include <exception>

#include "core/files/files.hpp"
#include "tests/figure4/picture.hpp"

namespace drape::test {
namespace {

constexpr unsigned kMeshes = 6;  // irregular meshes used; the first is drawn

int draw(const std::string& file, int side) {
  const SphereScene scene = read_sphere_scene();
  std::vector<Panel> panels;
  const auto judge = [&](const std::string& title, SphereDrape drape, bool in_picture) {
    const Asymmetry lacks = asymmetry(drape);
    const double area = plan_area(scene, drape);
    fmt::print(
        "{}: {}, mirror u -> -u {:.2f} mm, u <-> v {:.2f} mm, mean height {:.1f} mm, plan "
        "area {:.1f} %\n",
        title, drape.at_rest ? "at rest" : "not at rest", lacks.middle_mm, lacks.diagonal_mm,
        mean_height_mm(scene, drape), 100 * area);
    if (in_picture)
      panels.push_back({title,
                        fmt::format("mirror image off by {:.1f} mm, plan area {:.0f} %",
                                    lacks.middle_mm, 100 * area),
                        std::move(drape)});
  };
  judge("quads (particle grid)", drape_grid(scene, side), true);
  for (unsigned seed = 1; seed <= kMeshes; ++seed)
    judge("our triangles", drape_mesh(scene, irregular_mesh(scene.print, side, seed), 0.05, side),
          seed == 1);
  judge("plain triangles, one diagonal",
        drape_mesh(scene, one_diagonal_mesh(scene.print, side), 1, side), true);
  for (unsigned seed = 1; seed <= kMeshes; ++seed)
    judge("plain triangles, irregular",
          drape_mesh(scene, irregular_mesh(scene.print, side, seed), 1, side), seed == 1);
  judge("one diagonal, strain at the points",
        drape_mesh(scene, one_diagonal_mesh(scene.print, side), 0.05, side), false);
  write_durable(file, svg_of(panels, sphere_of(scene)));
  return 0;
}

}  // namespace
}  // namespace drape::test

int main(int count, char** arguments) {
  const int side = count == 3 ? std::atoi(arguments[2]) : 15;
  if (count < 2 || count > 3 || side < 5) {
    fmt::print(stderr,
               "paper_figure4 FILE.svg [PARTICLES PER SIDE, 15]: draws the paper's Fig. 4\n");
    return 2;
  }
  try {
    return drape::test::draw(arguments[1], side);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 3;
  }
}
