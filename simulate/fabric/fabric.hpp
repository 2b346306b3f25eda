// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/fields/fields.hpp"
#include "core/fields/records.hpp"
#include "core/simulation_files.hpp"
#include "simulate/fabric/laws.hpp"

namespace drape::simulate {

struct KawabataCurve;

// Scalar results that a KES sheet lists for one direction, in its units, for fabrics without plots.
// Each is checked against the range of textiles; the error names the likely unit mistake.

/// Two of EMT, LT and WT, or all three if consistent within 3 %.
struct TensileNumbers {
  std::optional<double> emt_percent, lt, wt_gf_cm_per_cm2, rt_percent;
};
struct ShearNumbers {
  double g_gf_per_cm_deg = 0;
  std::optional<double> hg2_gf_per_cm, hg5_gf_per_cm;  ///< full widths at 0.5 and 5 degrees
  std::optional<double> slip_angle_deg;
};
struct BendingNumbers {
  double b_gf_cm2_per_cm = 0;
  std::optional<double> hb2_gf_cm_per_cm, slip_curvature_per_cm;
};
void fields(Fields& f, TensileNumbers& numbers);
void fields(Fields& f, ShearNumbers& numbers);
void fields(Fields& f, BendingNumbers& numbers);

// Curves derived from these numbers, with `file` as their file.

/// f = A (exp(b strain) - 1) through the origin and 500 gf/cm at EMT, with b from LT = 2 (1/x -
/// 1/(exp(x) - 1)), x = b EMT (LT above 1 gives a concave curve). Unloading is the same with LT RT;
/// RT defaults to 60 %.
[[nodiscard]] KawabataCurve curve_of(const TensileNumbers& numbers,
                                     const std::filesystem::path& file);
/// Shear curve up to 8 degrees.
[[nodiscard]] KawabataCurve curve_of(const ShearNumbers& numbers,
                                     const std::filesystem::path& file);
/// Bending curve up to 2.5 1/cm.
[[nodiscard]] KawabataCurve curve_of(const BendingNumbers& numbers,
                                     const std::filesystem::path& file);

/// G (gf/(cm deg)) from the extension EB5 of a strip at 45 degrees under T = 5 gf/cm: G = T / (4
/// EB5). Throws for a value outside the range of textiles.
[[nodiscard]] double shear_from_bias_extension(double eb5_percent, const Where& where);

/// Typical woven cloth, for fabrics of which only B and G are known.
inline const TensileNumbers kUsualTensile = {3, 0.7, {}, 60};

/// Both branches of a Kawabata test in SI units: strain (1), angle (rad) or curvature (1/m) against
/// force per width (N/m) or moment per width (N).
struct KawabataCurve {
  std::filesystem::path file;
  std::vector<double> x;          ///< strictly increasing
  std::vector<double> loading;    ///< at x
  std::vector<double> unloading;  ///< at x
  /// Range of x over which friction builds up, for a loop made from KES numbers, which is open at
  /// its ends. Absent if the ends of the loop determine it.
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
  std::vector<std::string> warnings;       ///< unusual or implausible values, see judge()

  /// The fabric file and its curves, in a fixed order.
  [[nodiscard]] std::vector<std::filesystem::path> files() const;
};

/// Reads and checks a fabric. Throws Error naming file, line and column for a value that is not a
/// number, abscissae that do not increase, a header with another unit, and impossible values.
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

struct Fabric;

/// Comparison of a fabric's density and bending with measured fabrics.
struct Plausibility {
  std::vector<Error> problems;        ///< impossible values: wrong unit or misplaced decimal point
  std::vector<std::string> warnings;  ///< rare values, each with file and field
};

/// Compares areal density and bending along warp, weft and at 45 degrees with 618 measured fabrics,
/// and the loops of KES numbers with their slopes. A simulation only warns of problems, since it
/// accepts sheets that are not textiles.
[[nodiscard]] Plausibility judge(const Fabric& fabric);

/// Throws the first problem of judge(), for callers that require a textile.
void require_textile(const Fabric& fabric);

/// Usual range of bending stiffness (gf cm2/cm) at an areal density (g/m2): nine of ten fabrics,
/// extended tenfold on either side.
struct UsualBending {
  double from, to;  ///< g/m2
  double least, most;
  double least_possible, most_possible;
};
[[nodiscard]] UsualBending usual_bending(double density_g_per_m2);

/// Constitutive laws of a cloth, fitted to its measured curves.
struct FittedLaws {
  ClothLaws laws;
  std::vector<CurveReport> curves;
  std::vector<std::string> warnings;  ///< warnings about the fabric and its twist stiffness
};

/// Fits the measured curves up to `reach`, or over the whole measurement without one (a single line
/// over the range of the paper's section 5). `internal_friction` splits the loops of bending and
/// shear into elastic curves and friction elements (laws.friction). Throws Error(bad_input) for a
/// curve that does not rise everywhere.
[[nodiscard]] FittedLaws fit_laws(const Fabric& fabric, int segments,
                                  const std::optional<CurveReach>& reach = std::nullopt,
                                  bool internal_friction = false);

/// SVG of the six Kawabata curves with both branches, each with the line (one segment) and the
/// piecewise linear curve of `segments` used in simulation.
[[nodiscard]] std::string curves_svg(const Fabric& fabric, int segments);

}  // namespace drape::simulate

template <>
inline constexpr drape::Format drape::format_of<drape::simulate::FabricFile>{
    "fabric", Syntax::toml, 1, "a fabric: its mass and its Kawabata tests"};
