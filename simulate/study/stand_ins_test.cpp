// SPDX-License-Identifier: Apache-2.0
// Which values count as not measured, by the words in the file.
#include <gtest/gtest.h>

#include "simulate/study/sensitivity.hpp"

namespace drape::simulate {
namespace {

TEST(StandIns, AreWhatFilesAndImportsCallThem) {
  Fabric fabric;
  fabric.bias_bending_n_m = 1e-6;
  const auto named = [&](const std::string& text) {
    fabric.stand_ins = {text};
    std::string values;
    for (std::size_t i = 0; i < std::size(names_of<FabricValue>); ++i)
      if (is_stand_in(fabric, static_cast<FabricValue>(i)))
        values += std::string(names_of<FabricValue>[i]) + " ";
    return values;
  };
  EXPECT_EQ(named("tensile curves: EMT 3 %, LT 0.7, RT 60 %"), "tensile_warp tensile_weft ");
  EXPECT_EQ(named("shear: G 0.6 gf/(cm deg)"), "shear ");  // as `drape fabric import` writes it
  EXPECT_EQ(named("bending curves"), "bending_warp bending_weft ");
  EXPECT_EQ(named("areal_density_g_per_m2"), "areal_density ");
  EXPECT_EQ(named("bias bending stiffness"), "twist ");
  EXPECT_EQ(named("bending at 45 degrees"), "twist ");
  EXPECT_EQ(named("bending hysteresis"), "");
  EXPECT_EQ(named("all"),
            "tensile_warp tensile_weft shear bending_warp bending_weft twist areal_density ");
  fabric.bias_bending_n_m.reset();
  EXPECT_EQ(named("nothing"), "twist ");
}

}  // namespace
}  // namespace drape::simulate
