// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/fields/records.hpp"
#include "simulate/fabric/curve.hpp"
#include "simulate/fabric/kes.hpp"
#include "simulate/fabric/memory.hpp"

namespace drape::simulate {

/// Both branches of a Kawabata test in SI units: strain (1), angle (rad) or curvature (1/m) against
/// force per width (N/m) or moment per width (N).
struct KawabataCurve {
  std::filesystem::path file;
  std::vector<double> x;          ///< strictly increasing
  std::vector<double> loading;    ///< at x
  std::vector<double> unloading;  ///< at x
  /// For a loop made from KES numbers, which is not closed at its ends: the range of x over which
  /// friction builds up. Absent if the ends of the loop determine it.
  std::optional<double> slip = std::nullopt;
};

/// One kind of test in fabric.toml: a CSV or numbers for each direction. Index 0 is warp, 1
/// weft.
template <class Numbers>
struct KawabataTest {
  std::array<std::optional<std::filesystem::path>, 2> curve;
  std::array<std::optional<Numbers>, 2> numbers;
};
struct BendingTest : KawabataTest<BendingNumbers> {
  std::optional<double> bias_bending_n_m;  ///< bending stiffness at 45 degrees (N m)
};

/// Content of fabric.toml.
struct FabricFile {
  Document document;
  std::string name;
  double areal_density_g_per_m2 = 0;
  std::vector<std::string> stand_ins;  ///< names of values that were assumed, not measured
  std::optional<KawabataTest<TensileNumbers>> tensile;
  KawabataTest<ShearNumbers> shear;
  BendingTest bending;
};
void fields(Fields& f, FabricFile& fabric);

/// A fabric (fabric.toml, one CSV per Kawabata curve; paper section 2.1). Index 0 is warp, 1 weft.
struct Fabric {
  FabricFile stated;
  std::filesystem::path file;
  std::string name;
  double areal_density_kg_per_m2 = 0;
  KawabataCurve tensile[2];
  KawabataCurve shear[2];
  KawabataCurve bending[2];
  std::optional<double> bias_bending_n_m;  ///< bending stiffness at 45 degrees (N m)
  std::vector<std::string> stand_ins;      ///< names of quantities that were assumed, not measured
  std::vector<std::string> warnings;       ///< unusual or implausible values, see plausible.hpp

  /// The fabric file and its curves, in a fixed order.
  [[nodiscard]] std::vector<std::filesystem::path> files() const;
};

/// Reads and checks a fabric. Throws Error naming file, line and column for a value that is not a
/// number, abscissae that do not increase, a header with another unit, and values of no textile.
[[nodiscard]] Fabric read_fabric(const std::filesystem::path& file);

/// SHA-256 of the fabric file and its curves together.
[[nodiscard]] std::string fabric_sha256(const Fabric& fabric);

/// Single curve of a tensile test: the loading branch, since gravity loads the cloth from its
/// relaxed state and the unloading branch does not start at the origin.
[[nodiscard]] SampledCurve merged_tensile(const KawabataCurve& curve);

/// Single odd curve of a shear or bending test on x >= 0: mean of both branches and of both signs
/// (paper section 5).
[[nodiscard]] SampledCurve merged_loop(const KawabataCurve& curve);

/// Half the distance between the branches of a shear or bending test, mean of both signs.
[[nodiscard]] HalfWidth half_width(const KawabataCurve& curve);

/// Half the mean distance between the branches over the middle half of the test, lost by merging.
[[nodiscard]] double half_hysteresis(const KawabataCurve& curve);

}  // namespace drape::simulate

template <>
inline constexpr drape::Format drape::format_of<drape::simulate::FabricFile>{
    "fabric", Syntax::toml, 1, "a fabric: its mass and its Kawabata tests"};
