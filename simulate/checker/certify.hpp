// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/certificate.hpp"
#include "core/rig.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "simulate/checker/mesh_rest.hpp"
#include "simulate/fabric/fabric.hpp"

namespace drape::simulate {

/// Stored files of a triangle drape, with the inputs that they refer to.
struct RestFiles {
  Sheet sheet;
  Certificate certificate;
  ClothShape shape;
  ClothMemory memory;  ///< memory of a cloth with internal friction
  std::vector<ContactForce> contact_forces;
  std::vector<std::filesystem::path> files;
};

/// Reads sheet, certificate, cloth.ply and, if they exist, memory.csv and contact_forces.csv from a
/// folder. Throws Error(bad_input) for a drape of the paper's model, and if the certificate states
/// another number of contact forces.
[[nodiscard]] RestFiles read_rest_files(const std::filesystem::path& folder);

/// Comparison of one value.
struct CertifyLine {
  std::string what;  ///< quantity with unit
  double claimed = 0, found = 0;
  double allowed = 0;  ///< largest difference, or limit of `found` if `is_limit`
  bool is_limit = false;
  [[nodiscard]] bool passes() const;
};

struct CertifyReport {
  std::vector<CertifyLine> lines;
  std::vector<std::string> refusals;  ///< reasons why the drape is not at rest, or not as claimed
  std::vector<std::string> warnings;
  [[nodiscard]] bool accepted() const;
};

/// Largest credible strains (warp, weft): twice the last measured ones, beyond which more of the
/// thread's curve is extrapolated than measured.
[[nodiscard]] Eigen::Vector2d strain_limits(const Fabric& fabric);

/// Judges stored files: the verdict of judge_mesh() on the cloth if the certificate claims a rest,
/// and whether the values in the certificate and the points of the sheet match the cloth.
/// `measured` holds pins without a position of their own; without it, those are held where they
/// are. Velocities are not stored and not judged.
[[nodiscard]] CertifyReport certify(const RestFiles& files, const Scene& scene,
                                    const Fabric& fabric, const Print& print,
                                    const std::optional<Sheet>& measured = std::nullopt);

}  // namespace drape::simulate
