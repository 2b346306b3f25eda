// SPDX-License-Identifier: Apache-2.0
#include "simulate/objects/cloth_shape.hpp"

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/mesh_file.hpp"
#include "core/units.hpp"

namespace drape::simulate {
namespace {

using units::mm;

static_assert(std::endian::native == std::endian::little, "numbers are written as they stand");

template <class Number>
void put(std::string& bytes, Number value) {
  const std::size_t at = bytes.size();
  bytes.resize(at + sizeof(value));
  std::memcpy(bytes.data() + at, &value, sizeof(value));
}

}  // namespace

void write_cloth_shape(const std::filesystem::path& file, const ClothShape& shape) {
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

ClothShape read_cloth_shape(const std::filesystem::path& file) {
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

}  // namespace drape::simulate
