// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <limits>
#include <vector>

#include "core/certificate.hpp"
#include "simulate/checker/mesh_rest.hpp"
#include "simulate/drape/level.hpp"

namespace drape::simulate {

/// Shape of a mesh, in the frame of its state.
[[nodiscard]] ClothShape shape_of(const MaterialMesh& mesh, const MeshCloth::State& state);

/// State of a drape in the world as the checker judges it, with the values of its files. `scene`,
/// in world coordinates, has the friction used for the drape and must outlive the result.
[[nodiscard]] MeshRest rest_of(const DrapeLevel& level, const ClothMoment& moment,
                               const Scene& scene, double residual_tolerance);

/// Verdict of the checker. For `most_strain` see strain_limits() (checker/certify.hpp).
[[nodiscard]] MeshJudgement judge_drape(
    const DrapeLevel& level, const ClothMoment& moment, const Scene& scene,
    double residual_tolerance,
    const Eigen::Vector2d& most_strain =
        Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity()));

// Parts of a certificate that the checker determines.
[[nodiscard]] CertificateCheck certificate_check(const MeshJudgement& judged);
[[nodiscard]] CertificateDistances certificate_distances(const DrapeLevel& level,
                                                         const ClothMoment& moment,
                                                         const MeshJudgement& judged);

/// Writes the state's cloth.ply and, if not empty, contact_forces.csv and memory.csv into a folder;
/// returns the paths.
[[nodiscard]] std::vector<std::filesystem::path> write_rest(const std::filesystem::path& folder,
                                                            const DrapeLevel& level,
                                                            const ClothMoment& moment);

}  // namespace drape::simulate
