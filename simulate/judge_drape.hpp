// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <limits>
#include <vector>

#include "core/certificate.hpp"
#include "simulate/checker/mesh_rest.hpp"
#include "simulate/drape/level.hpp"

namespace drape::simulate {

/// The shape of a mesh in the frame of its state.
[[nodiscard]] ClothShape shape_of(const MaterialMesh& mesh, const MeshCloth::State& state);

/// A moment of a drape in the world as the checker judges it: the numbers of its files. `scene`, in
/// the world, has the friction with which it was draped, and must outlive the result.
[[nodiscard]] MeshRest rest_of(const DrapeLevel& level, const ClothMoment& moment,
                               const Scene& scene, double residual_tolerance);

/// Judgement of the checker. `most_strain`: see strain_limits() (checker/certify.hpp).
[[nodiscard]] MeshJudgement judge_drape(
    const DrapeLevel& level, const ClothMoment& moment, const Scene& scene,
    double residual_tolerance,
    const Eigen::Vector2d& most_strain =
        Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity()));

// The parts of a certificate that the checker states.
[[nodiscard]] CertificateCheck certificate_check(const MeshJudgement& judged);
[[nodiscard]] CertificateDistances certificate_distances(const DrapeLevel& level,
                                                         const ClothMoment& moment,
                                                         const MeshJudgement& judged);

/// Writes the moment's cloth.ply and, where there are any, contact_forces.csv and memory.csv into a
/// folder; the files.
[[nodiscard]] std::vector<std::filesystem::path> write_rest(const std::filesystem::path& folder,
                                                            const DrapeLevel& level,
                                                            const ClothMoment& moment);

}  // namespace drape::simulate
