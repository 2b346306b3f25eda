// SPDX-License-Identifier: Apache-2.0
#include "simulate/fabric/plausible.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <tuple>

#include "core/units.hpp"
#include "simulate/fabric/fabric.hpp"

namespace drape::simulate {
namespace {

/// Areal density (g/m2) and bending stiffness (gf cm2/cm) of 618 fabrics measured on a cantilever
/// (after Feng et al. 2022): in each bin 5 % lie below the first stiffness and 5 % above the
/// second, for the smaller and the larger of warp and weft.
struct DensityBin {
  double from, to, least_b, most_b;
};
constexpr std::array<DensityBin, 8> kFabrics{{{0, 60, 0.0046591, 0.11028},
                                              {60, 110, 0.0054912, 0.27147},
                                              {110, 165, 0.015967, 0.59069},
                                              {165, 220, 0.016561, 0.62418},
                                              {220, 262, 0.014392, 0.68584},
                                              {262, 320, 0.039686, 0.94155},
                                              {320, 420, 0.063295, 1.8732},
                                              {420, 900, 0.15424, 2.6756}}};
constexpr double kLightest = 15.77, kHeaviest = 758.4;  // 5 % of the lightest and heaviest bin
constexpr double kOtherUnit = 10;  // factor beyond the quantiles where no fabric was measured

constexpr const char* kWeigh =
    "weigh a piece of known area; is a decimal point lost, or is it mg/cm2, kg/m2 or oz/yd2?";

class Judge {
 public:
  explicit Judge(const Fabric& fabric)
      : fabric_(fabric), density_(fabric.areal_density_kg_per_m2 / units::g_per_m2) {}

  void density() {
    const std::string key = "areal_density_g_per_m2";
    const std::string what =
        fmt::format("an areal density of {:g} g/m2; fabrics have {:.0f} to {:.0f}", density_,
                    kLightest, kHeaviest);
    if (density_ > kFabrics.back().to)
      problem(key, what, kWeigh);
    else if (density_ < kLightest || density_ > kHeaviest)
      warning(key, what);
  }

  void bending(int direction) {
    const KawabataCurve& curve = fabric_.bending[direction];
    const double stiffness = stiffness_of(curve);
    const UsualBending usual = usual_bending(density_);
    const std::string what = fmt::format(
        "bending stiffness {:.3g} gf cm2/cm at {:g} g/m2; nine of ten fabrics of {:g} to {:g} g/m2 "
        "have {:.2g} to {:.2g}",
        stiffness, density_, usual.from, usual.to, usual.least, usual.most);
    const std::string key = direction == 0 ? "bending.warp" : "bending.weft";
    if (stiffness < usual.least_possible || stiffness > usual.most_possible) {
      problem(curve.file == fabric_.file ? key + "_kes.b_gf_cm2_per_cm" : key, what,
              "is it in uN m (98 times as large), in dyn cm2/cm (981 times) or in gf cm (per "
              "sample)?");
    } else if (stiffness < usual.least || stiffness > usual.most) {
      warning(key, what);
    }
  }

  /// Checks the bias stiffness: cloth bends at 45 degrees about as along its threads. In the
  /// published fabrics (rigs/fabrics/published.csv) it stays within twice the range of both.
  void bias() {
    constexpr double kBeyond = 5;  // half of a misplaced decimal point
    if (!fabric_.bias_bending_n_m) return;
    const double bias = *fabric_.bias_bending_n_m / units::gf_cm2_per_cm;
    const double warp = stiffness_of(fabric_.bending[0]), weft = stiffness_of(fabric_.bending[1]);
    if (bias >= std::min(warp, weft) / kBeyond && bias <= std::max(warp, weft) * kBeyond) return;
    problem("bending.bias_stiffness_gf_cm2_per_cm",
            fmt::format("{:g} gf cm2/cm at 45 degrees, {:.3g} and {:.3g} along warp and weft", bias,
                        warp, weft),
            "is a decimal point lost, or is it in uN m (98 times as large)?");
  }

  /// Checks the loops: the unloading branch must be positive at the largest strain of KES, and a
  /// shear loop at least as wide at 5 degrees as at 0.5.
  void loops() {
    for (const int direction : {0, 1}) {
      const std::string key = direction == 0 ? "warp" : "weft";
      for (const auto& [kind, curve, width, slope] :
           {std::tuple{"bending", &fabric_.bending[direction], "2HB", "B"},
            std::tuple{"shear", &fabric_.shear[direction], "2HG5", "G"}})
        if (curve->file == fabric_.file && curve->unloading.back() < 0)
          warning(fmt::format("{}.{}_kes", kind, key),
                  fmt::format("let go at the largest strain of the test the cloth would not go "
                              "back: {} is too large or {} too small",
                              width, slope));
      const auto& numbers = fabric_.stated.shear.numbers[direction];
      if (numbers && numbers->hg2_gf_per_cm && numbers->hg5_gf_per_cm &&
          *numbers->hg2_gf_per_cm > *numbers->hg5_gf_per_cm)
        warning(fmt::format("shear.{}_kes", key),
                fmt::format("2HG {:g} gf/cm is above 2HG5 {:g}: are the two exchanged?",
                            *numbers->hg2_gf_per_cm, *numbers->hg5_gf_per_cm));
    }
  }

  [[nodiscard]] Plausibility result() && { return std::move(result_); }

 private:
  /// Mean slope in gf cm2/cm between the ends of the curve.
  static double stiffness_of(const KawabataCurve& curve) {
    return (curve.loading.back() - curve.loading.front()) / (curve.x.back() - curve.x.front()) /
           units::gf_cm2_per_cm;
  }
  void problem(const std::string& key, const std::string& what, const char* advice) {
    result_.problems.push_back(bad_input(what, fabric_.stated.document.where(key), advice));
  }
  void warning(const std::string& field, const std::string& what) {
    result_.warnings.push_back(fmt::format("{}, {}: {}", fabric_.file.string(), field, what));
  }

  const Fabric& fabric_;
  double density_;
  Plausibility result_;
};

}  // namespace

UsualBending usual_bending(double density_g_per_m2) {
  const auto bin = std::find_if(kFabrics.begin(), kFabrics.end() - 1,
                                [&](const DensityBin& one) { return density_g_per_m2 < one.to; });
  return {bin->from,
          bin->to,
          bin->least_b,
          bin->most_b,
          bin->least_b / kOtherUnit,
          bin->most_b * kOtherUnit};
}

Plausibility judge(const Fabric& fabric) {
  Judge judge(fabric);
  judge.density();
  for (const int direction : {0, 1}) judge.bending(direction);
  judge.bias();
  judge.loops();
  return std::move(judge).result();
}

void require_textile(const Fabric& fabric) {
  const Plausibility plausibility = judge(fabric);
  if (!plausibility.problems.empty()) throw plausibility.problems.front();
}

}  // namespace drape::simulate
