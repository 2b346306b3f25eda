// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/rig.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "simulate/fabric/fabric.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {

/// Claims of a certificate; SI.
struct CertificateClaim {
  bool at_rest = false;
  int rows = 0, cols = 0, segments = 0;
  std::optional<CurveReach>
      reach;  ///< to where the curves were fitted; absent: all that was measured
  ClothModel model = ClothModel::consistent;
  bool paper_mass = false;  ///< total / particles instead of area
  double residual = 0;      ///< in weights of a particle
  double residual_tolerance = 0;
  double warp_least = 0, warp_most = 0, weft_least = 0, weft_most = 0;  ///< strains
  /// Absent: not compared.
  std::optional<double> shear_most_rad, curvature_most_per_m, twist_n_m;
  std::optional<double> least_gap_object_m;
  double deepest_between_m = 0;
  double penetration_tolerance_m = 0;  ///< largest depth of the sheet between its particles
  double cloth_thickness_m = 0;        ///< layers press this far apart; 0: they do not press
  std::optional<ClothMemory> memory;   ///< state of a cloth with internal friction, from memory.csv
  std::vector<ContactForce> contact_forces;  ///< from contact_forces.csv; empty: sought
  /// Energies of the last row of history.csv; absent: not compared.
  std::optional<double> gravity_j, stretch_j, shear_j, bending_j, twist_j;
};

/// The claim of a run in memory.
[[nodiscard]] CertificateClaim claim_of(const SimulateResult& result,
                                        const SimulateOptions& options);

/// The claim in certificate.json and history.csv of a folder.
[[nodiscard]] CertificateClaim read_claim(const std::filesystem::path& folder);

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
  std::vector<std::string> refusals;  ///< reasons why nothing can be compared, e.g. missing points
  /// Oddities with which the sheet can rest: stated contact forces that do not hold it.
  std::vector<std::string> warnings;
  int contacts = 0;     ///< places where the sheet may push on an object
  int rounds = 0;       ///< steps of the search for contact forces
  double residual = 0;  ///< that they leave, of a particle's weight
  [[nodiscard]] bool accepted() const;
};

/// Judges a simulated sheet independently, in long double and with code of its own: energies per
/// element, forces as their derivatives by dual numbers, signed distances, and whether contact and
/// pin forces within the friction cones exist that balance every particle to `residual_tolerance`
/// (the law of contact is not asked, so any sheet that can rest there is accepted). What it has in
/// common with the simulator: the readers of files and the approximation of the Kawabata curves,
/// and the distance of triangle meshes. A sheet at rest may neither pass through itself nor reach
/// deeper into an object between its particles than the certificate's own tolerance. Velocities are
/// in no file and are not judged. A sheet that does not claim to be at rest is only compared in its
/// numbers.
[[nodiscard]] CertifyReport certify(const Sheet& sheet, const Scene& scene, const Fabric& fabric,
                                    const Print& print, const CertificateClaim& claim);

/// Puts what a result calls at rest before certify() and notes the judgement in its report; a sheet
/// that is refused gets the status RestStatus::refused, so that nothing stores it as at rest. Round
/// specimens, whose sheets have gaps, are not judged.
void judge_rest(SimulateResult& result, const Scene& scene, const Fabric& fabric,
                const Print& print, const SimulateOptions& options);

}  // namespace drape::simulate
