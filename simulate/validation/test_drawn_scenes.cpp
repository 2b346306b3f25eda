// SPDX-License-Identifier: Apache-2.0
#include "simulate/validation/test_drawn_scenes.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <fstream>
#include <random>

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using units::mm;

class Dice {
 public:
  explicit Dice(int seed) : engine_(static_cast<unsigned>(seed)) {}
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_()) / 4294967296.0;
  }
  bool coin() { return between(0, 1) < 0.5; }
  Eigen::Matrix3d turn() {
    const Vector3d axis(between(-1, 1), between(-1, 1), between(-1, 1));
    return Eigen::AngleAxisd(between(0, std::numbers::pi), axis.normalized()).toRotationMatrix();
  }

 private:
  std::mt19937 engine_;
};

/// Closed surface about the origin: a lattice of `rings` x `around` points and two poles.
template <class Place>
void write_obj(const std::filesystem::path& file, int rings, int around, const Place& place) {
  std::ofstream out(file);
  const auto write = [&](const Vector3d& p) {
    out << fmt::format("v {:.6f} {:.6f} {:.6f}\n", p.x() / mm, p.y() / mm, p.z() / mm);
  };
  write(place(Vector3d::UnitZ()));
  for (int i = 1; i < rings; ++i)
    for (int j = 0; j < around; ++j) {
      const double polar = std::numbers::pi * i / rings, turn = 2 * std::numbers::pi * j / around;
      write(place(Vector3d(std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn),
                           std::cos(polar))));
    }
  write(place(-Vector3d::UnitZ()));
  const auto at = [&](int i, int j) { return 2 + (i - 1) * around + j % around; };
  const int last = 2 + (rings - 1) * around;
  for (int j = 0; j < around; ++j) {
    out << fmt::format("f 1 {} {}\n", at(1, j), at(1, j + 1));
    for (int i = 1; i + 1 < rings; ++i)
      out << fmt::format("f {0} {1} {2}\nf {0} {2} {3}\n", at(i, j), at(i + 1, j), at(i + 1, j + 1),
                         at(i, j + 1));
    out << fmt::format("f {} {} {}\n", last, at(rings - 1, j + 1), at(rings - 1, j));
  }
}

MeshObject drawn_mesh(Dice& dice, bool edged, double reach, const std::filesystem::path& file) {
  const int rings = static_cast<int>(dice.between(12, 36));
  const int around = 2 * rings;  // 500 to 5,000 facets
  const double lobes = std::floor(dice.between(2, 6)), deep = dice.between(0.05, 0.2);
  write_obj(file, rings, around, [&](const Vector3d& n) -> Vector3d {
    if (edged) {
      // A hexagonal prism on the lattice of a ball: its edges run across the facets.
      double far = std::abs(n.z()) / 0.8;
      for (int k = 0; k < 3; ++k) {
        const double turn = std::numbers::pi * k / 3;
        far = std::max(far, std::abs(n.x() * std::cos(turn) + n.y() * std::sin(turn)));
      }
      return reach / far * n;
    }
    const double across = n.head<2>().squaredNorm();
    return reach * (1 + deep * across * std::cos(lobes * std::atan2(n.y(), n.x()))) * n;
  });
  MeshObject mesh;
  mesh.file = file;
  return mesh;
}

}  // namespace

DrawnScene drawn_scene(int index, const std::filesystem::path& folder) {
  Dice dice(index);
  DrawnScene drawn;
  ClothLaws& laws = drawn.laws;
  laws.density_kg_per_m2 = dice.between(0.08, 0.3);
  for (int k = 0; k < 2; ++k) laws.tensile[k] = {dice.between(300, 2000), {}};
  laws.shear = {dice.between(20, 80), {}};
  for (int k = 0; k < 2; ++k) laws.bending[k] = {dice.between(3e-6, 3e-5), {}};
  laws.twist_n_m = dice.between(3e-6, 1.5e-5);
  Print& print = drawn.print;
  print.rows = print.cols = 6;
  const double side = dice.between(120, 180) * mm;
  print.pitch_m = side / 6;
  print.patch_m = {side, side};
  print.margin_m = {side / 12, side / 12};
  Scene& scene = drawn.scene;
  scene.name = fmt::format("drawn {}", index);
  scene.file = folder / "scene.toml";
  scene.friction = dice.between(0, 1) < 0.2 ? 0 : dice.between(0.1, 0.6);
  scene.table_z_m = 0;
  const double reach = dice.between(20, 40) * mm;
  const int kind = index % 7;
  double top = 0;
  switch (kind) {
    case 0:
      scene.obstacles = {Sphere{{0, 0, reach}, reach}};
      top = 2 * reach;
      break;
    case 1:
    case 2: {
      Box box;
      box.size_m = {2 * reach, dice.between(0.6, 1) * 2 * reach,
                    dice.between(0.6, 1.2) * 2 * reach};
      box.edge_radius_m = kind == 1 ? 0 : dice.between(0.5, 5) * mm;
      box.world_from_box.translation_m.z() = box.size_m.z() / 2;
      top = box.size_m.z();
      scene.obstacles = {box};
      break;
    }
    case 3: {
      Cylinder body;
      body.radius_m = reach;
      body.height_m = dice.between(1, 3) * reach;
      body.edge_radius_m = dice.coin() ? 0 : dice.between(0.5, 3) * mm;
      const bool lies = dice.coin();
      if (lies)
        body.world_from_cylinder.rotation =
            Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d::UnitX()).toRotationMatrix();
      body.world_from_cylinder.translation_m.z() = lies ? reach : body.height_m / 2;
      top = lies ? 2 * reach : body.height_m;
      scene.obstacles = {body};
      break;
    }
    case 4:
    case 5: {
      MeshObject mesh =
          drawn_mesh(dice, kind == 5, reach, folder / fmt::format("drawn-{}.obj", index));
      mesh.world_from_mesh.rotation = dice.turn();
      mesh.world_from_mesh.translation_m.z() = 1.6 * reach;
      top = 3.2 * reach;  // not lower than any corner
      scene.obstacles = {mesh};
      break;
    }
    default:
      break;
  }
  scene.start.mode = StartMode::flat;
  scene.start.yaw_rad = dice.between(0, 1.5);
  const double off = 0.15 * side;
  scene.start.centre_in_world =
      Vector3d(dice.between(-off, off), dice.between(-off, off), top + 2 * mm);
  if (kind == 6) {
    // Two pins closer than the cloth between them is long: a fold hangs down and touches itself.
    scene.table_z_m = -0.5;
    scene.start.centre_in_world = Vector3d::Zero();
    scene.start.yaw_rad = 0;
    const double near = dice.between(0.05, 0.3) * side;
    for (const double sign : {-1.0, 1.0}) {
      Pin pin;
      pin.at_material_m = Eigen::Vector2d(0, sign < 0 ? 0 : side);
      pin.point_in_world = Vector3d(sign * near / 2, side / 2, 0);
      scene.pins.push_back(pin);
    }
  }
  return drawn;
}

}  // namespace drape::simulate
