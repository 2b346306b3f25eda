// SPDX-License-Identifier: Apache-2.0
#include "simulate/judge_drape.hpp"

#include <Eigen/Geometry>

#include "core/files/files.hpp"

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;

Eigen::Matrix3d world_from_local(const DrapeLevel& level) {
  return Eigen::AngleAxisd(level.drape().local.yaw_rad, Eigen::Vector3d::UnitZ())
      .toRotationMatrix();
}

ClothShape shape_of(const DrapeLevel& level, const ClothMoment& moment) {
  ClothShape shape = shape_of(level.cloth().mesh(), moment.state);
  for (Eigen::Vector3d& point : shape.points_m) point = level.drape().local.to_world(point);
  for (Eigen::Vector3d& slope : shape.of_sides) slope = world_from_local(level) * slope;
  return shape;
}

std::vector<ContactForce> forces_in_world(const DrapeLevel& level, const ClothMoment& moment) {
  std::vector<ContactForce> forces = level.contact_forces(moment);
  for (ContactForce& force : forces)
    force.force_in_world = world_from_local(level) * force.force_in_world;
  return forces;
}

}  // namespace

ClothShape shape_of(const MaterialMesh& mesh, const MeshCloth::State& state) {
  ClothShape shape;
  shape.material_m = mesh.points_m;
  shape.triangles = mesh.triangles;
  for (const MaterialMesh::Edge& edge : mesh.edges) shape.sides.push_back({edge.from, edge.to});
  const auto points = static_cast<std::ptrdiff_t>(mesh.points_m.size());
  shape.points_m.assign(state.begin(), state.begin() + points);
  shape.of_sides.assign(state.begin() + points, state.end());
  return shape;
}

MeshRest rest_of(const DrapeLevel& level, const ClothMoment& moment, const Scene& scene,
                 double residual_tolerance) {
  MeshRest rest;
  rest.shape = shape_of(level, moment);
  rest.laws = level.cloth().laws();
  rest.memory = moment.memory;
  rest.scene = &scene;
  for (std::size_t k = 0; k < level.pinned().size(); ++k)
    rest.pins.push_back({rest.shape.material_m[level.pinned()[k]],
                         level.drape().local.to_world(level.pinned_at()[k])});
  rest.contact_forces = forces_in_world(level, moment);
  rest.layers_apart_m = moment.layers_apart_m;
  rest.gravity_m_per_s2 = scene.gravity_m_per_s2;
  rest.residual_tolerance = residual_tolerance;
  return rest;
}

MeshJudgement judge_drape(const DrapeLevel& level, const ClothMoment& moment, const Scene& scene,
                          double residual_tolerance, const Eigen::Vector2d& most_strain) {
  MeshRest rest = rest_of(level, moment, scene, residual_tolerance);
  rest.most_strain = most_strain;
  return judge_mesh(rest);
}

CertificateCheck certificate_check(const MeshJudgement& judged) {
  return {.accepted = judged.accepted(),
          .residual = judged.residual,
          .side_residual = judged.side_residual,
          .deepest_m = judged.deepest_m,
          .crossings = judged.crossings,
          .places = judged.places_pressed,
          .refused = judged.refusals};
}

CertificateDistances certificate_distances(const DrapeLevel& level, const ClothMoment& moment,
                                           const MeshJudgement& judged) {
  CertificateDistances distances{
      .to_object_m = judged.to_object_m,
      .to_table_m = judged.to_table_m,
      .to_itself_m = judged.to_itself_m,
      .deepest_m = judged.deepest_m,
      .crossings = judged.crossings,
      .hold_error_m = judged.hold_error_m,
      .layers_apart_m = {},
      .contact_forces = static_cast<int>(level.contact_forces(moment).size())};
  if (moment.layers_apart_m > 0) distances.layers_apart_m = moment.layers_apart_m;
  return distances;
}

std::vector<fs::path> write_rest(const fs::path& folder, const DrapeLevel& level,
                                 const ClothMoment& moment) {
  std::vector<fs::path> files = {folder / "cloth.ply"};
  write_cloth_shape(files.back(), shape_of(level, moment));
  if (const auto forces = forces_in_world(level, moment); !forces.empty()) {
    files.push_back(folder / "contact_forces.csv");
    write_durable(files.back(), contact_forces_csv(forces));
  }
  if (level.cloth().laws().friction) {
    files.push_back(folder / "memory.csv");
    write_durable(files.back(), memory_csv(moment.memory));
  }
  return files;
}

}  // namespace drape::simulate
