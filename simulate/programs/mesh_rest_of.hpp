// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "simulate/checker/mesh_rest.hpp"
#include "simulate/mesh/mesh_cloth.hpp"

namespace drape::simulate {

/// A mesh drape as the checker judges it, without what holds it.
[[nodiscard]] inline MeshRest mesh_rest_of(const MaterialMesh& mesh, const MeshCloth::State& state,
                                           const ClothLaws& laws, const ClothMemory& memory) {
  MeshRest rest;
  rest.material_m = mesh.points_m;
  rest.triangles = mesh.triangles;
  for (const MaterialMesh::Edge& edge : mesh.edges) rest.sides.push_back({edge.from, edge.to});
  const auto points = static_cast<std::ptrdiff_t>(mesh.points_m.size());
  rest.points_m.assign(state.begin(), state.begin() + points);
  rest.of_sides.assign(state.begin() + points, state.end());
  rest.laws = laws;
  rest.memory = memory;
  return rest;
}

}  // namespace drape::simulate
