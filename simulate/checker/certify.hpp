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

/// Stored bytes of a drape of triangles, and what they were made from.
struct RestFiles {
  Sheet sheet;
  Certificate certificate;
  ClothShape shape;
  ClothMemory memory;  ///< memory of a cloth with internal friction
  std::vector<ContactForce> contact_forces;
  std::vector<std::filesystem::path> files;
};

/// Reads sheet, certificate, cloth.ply and where they exist memory.csv and contact_forces.csv of a
/// folder. Throws Error(bad_input) for a drape of the paper's model, and where the certificate
/// states another number of contact forces.
[[nodiscard]] RestFiles read_rest_files(const std::filesystem::path& folder);

/// One compared number.
struct CertifyLine {
  std::string what;  ///< with unit
  double claimed = 0, found = 0;
  double allowed = 0;  ///< difference, or limit of `found` where `is_limit`
  bool is_limit = false;
  [[nodiscard]] bool passes() const;
};

struct CertifyReport {
  std::vector<CertifyLine> lines;
  std::vector<std::string> refusals;  ///< reasons why it is no rest, or not what is claimed
  std::vector<std::string> warnings;
  [[nodiscard]] bool accepted() const;
};

/// Strains (warp, weft) beyond which more of a thread's curve is guessed than was measured: twice
/// the last measured ones.
[[nodiscard]] Eigen::Vector2d strain_limits(const Fabric& fabric);

/// Judges stored bytes: what judge_mesh() says of the cloth where the certificate claims a rest,
/// whether the numbers of the certificate and the points of the sheet are the cloth's. `measured`
/// holds the pins without a place of their own; without it those are where they are. Velocities are
/// in no file and are not judged.
[[nodiscard]] CertifyReport certify(const RestFiles& files, const Scene& scene,
                                    const Fabric& fabric, const Print& print,
                                    const std::optional<Sheet>& measured = std::nullopt);

}  // namespace drape::simulate
