// SPDX-License-Identifier: Apache-2.0
#include "simulate/objects/cloth_files.hpp"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <variant>

#include "core/drape_mesh.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"
#include "simulate/fabric/laws.hpp"

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;
using units::mm;

static_assert(std::endian::native == std::endian::little, "numbers are written as they stand");

template <class Number>
void put(std::string& bytes, Number value) {
  const std::size_t at = bytes.size();
  bytes.resize(at + sizeof(value));
  std::memcpy(bytes.data() + at, &value, sizeof(value));
}

const std::vector<std::string>& contact_force_columns() {
  static const std::vector<std::string> names = {
      "object",   "particle_1", "particle_2", "particle_3", "particle_4", "weight_1",
      "weight_2", "weight_3",   "weight_4",   "force_x_N",  "force_y_N",  "force_z_N"};
  return names;
}

constexpr int kIndices = 5;

}  // namespace

void write_cloth_shape(const fs::path& file, const ClothShape& shape) {
  const auto number = [](const char* name) { return fmt::format("property double {}\n", name); };
  std::string bytes = "ply\nformat binary_little_endian 1.0\ncomment drapebench cloth, mm\n";
  bytes += fmt::format("element vertex {}\n", shape.points_m.size());
  for (const char* name : {"x", "y", "z", "u", "v"}) bytes += number(name);
  bytes += fmt::format("element face {}\nproperty list uchar int vertex_indices\n",
                       shape.triangles.size());
  bytes += fmt::format("element side {}\nproperty int from\nproperty int to\n", shape.sides.size());
  for (const char* name : {"x", "y", "z"}) bytes += number(name);
  bytes += "end_header\n";
  for (std::size_t i = 0; i < shape.points_m.size(); ++i) {
    for (const double x : shape.points_m[i]) put(bytes, x / mm);
    for (const double x : shape.material_m[i]) put(bytes, x / mm);
  }
  for (const std::array<int, 3>& triangle : shape.triangles) {
    put(bytes, std::uint8_t{3});
    for (const int corner : triangle) put(bytes, std::int32_t{corner});
  }
  for (std::size_t s = 0; s < shape.sides.size(); ++s) {
    for (const int end : shape.sides[s]) put(bytes, std::int32_t{end});
    for (const double x : shape.of_sides[s]) put(bytes, x);
  }
  write_durable(file, bytes);
}

ClothShape read_cloth_shape(const fs::path& file) {
  const MeshFile mesh = read_mesh_file(file);
  if (mesh.uvs.size() != mesh.points.size() || mesh.sides.empty())
    throw bad_input("the mesh has no material coordinates or no element `side`",
                    {.file = file.string()}, "give the cloth.ply of a simulation");
  ClothShape shape;
  for (const Eigen::Vector2d& uv : mesh.uvs) shape.material_m.emplace_back(uv * mm);
  for (const Eigen::Vector3d& point : mesh.points) shape.points_m.emplace_back(point * mm);
  for (const auto& triangle : mesh.triangles)
    shape.triangles.push_back({static_cast<int>(triangle[0].point),
                               static_cast<int>(triangle[1].point),
                               static_cast<int>(triangle[2].point)});
  for (const MeshSide& side : mesh.sides) {
    shape.sides.push_back({static_cast<int>(side.ends[0]), static_cast<int>(side.ends[1])});
    shape.of_sides.push_back(side.slope);
  }
  return shape;
}

std::string contact_forces_csv(const std::vector<ContactForce>& forces) {
  std::vector<std::vector<double>> columns(contact_force_columns().size());
  for (const ContactForce& f : forces) {
    columns[0].push_back(f.shape);
    for (int k = 0; k < 4; ++k) {
      columns[1 + k].push_back(f.particle[k]);
      columns[5 + k].push_back(f.weight[k]);
    }
    for (int axis = 0; axis < 3; ++axis) columns[9 + axis].push_back(f.force_in_world[axis]);
  }
  return csv_text(contact_force_columns(), columns);
}

std::vector<ContactForce> read_contact_forces(const fs::path& file) {
  const Csv csv = read_csv(file, contact_force_columns());
  std::vector<ContactForce> forces(csv.lines.size());
  for (std::size_t i = 0; i < forces.size(); ++i) {
    for (int c = 0; c < kIndices; ++c) {
      const double index = csv.columns[c][i];
      if (!(index >= 0 && index < std::numeric_limits<int>::max() && index == std::floor(index))) {
        throw bad_input("an index that is no whole number from 0",
                        {.file = file.string(), .line = csv.lines[i], .field = csv.names[c]},
                        "simulate again");
      }
      (c == 0 ? forces[i].shape : forces[i].particle[c - 1]) = static_cast<int>(index);
    }
    for (int k = 0; k < 4; ++k) forces[i].weight[k] = csv.columns[5 + k][i];
    for (int axis = 0; axis < 3; ++axis) forces[i].force_in_world[axis] = csv.columns[9 + axis][i];
  }
  return forces;
}

std::vector<fs::path> files_of(const Scene& scene, const Fabric& fabric) {
  std::vector<fs::path> files = {scene.file};
  for (const fs::path& file : fabric.files()) files.push_back(file);
  files.push_back(scene.print_file);
  for (const Obstacle& obstacle : scene.obstacles) {
    if (const auto* mesh = std::get_if<MeshObject>(&obstacle)) files.push_back(mesh->file);
  }
  return files;
}

}  // namespace drape::simulate
