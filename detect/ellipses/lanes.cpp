// SPDX-License-Identifier: Apache-2.0
#include "detect/ellipses/lanes.hpp"

namespace drape::detect {

DRAPE_WIDE_VECTORS float lane_dot(const float* a, const float* b, int count) {
  return lane_sum(a, b, count);
}

DRAPE_WIDE_VECTORS void neighbour_sums(const float* plane, const float* used, const GridRows& grid,
                                       const std::array<float*, 10>& sums) {
  const int one = grid.stride, two = 2 * one, three = 3 * one;
  const float* const __restrict here = used;
  const float* const __restrict from = plane;
  const std::array<float*, 10> to = sums;
#pragma GCC ivdep
  for (int i = 0; i < grid.count; ++i) {
    const float* const p = from + i;
    // Above and below by as many rows: the pixels there, and those one, two and three beside them.
    const float up1 = p[-one] + p[one], up2 = p[-two] + p[two], up3 = p[-three] + p[three];
    const float side1 = p[-1] + p[1], side2 = p[-2] + p[2], side3 = p[-3] + p[3];
    const float at11 = (p[-one - 1] + p[-one + 1]) + (p[one - 1] + p[one + 1]);
    const float at12 = (p[-one - 2] + p[-one + 2]) + (p[one - 2] + p[one + 2]);
    const float at13 = (p[-one - 3] + p[-one + 3]) + (p[one - 3] + p[one + 3]);
    const float at21 = (p[-two - 1] + p[-two + 1]) + (p[two - 1] + p[two + 1]);
    const float at22 = (p[-two - 2] + p[-two + 2]) + (p[two - 2] + p[two + 2]);
    const float at23 = (p[-two - 3] + p[-two + 3]) + (p[two - 3] + p[two + 3]);
    const float at31 = (p[-three - 1] + p[-three + 1]) + (p[three - 1] + p[three + 1]);
    const float at32 = (p[-three - 2] + p[-three + 2]) + (p[three - 2] + p[three + 2]);
    const float at33 = (p[-three - 3] + p[-three + 3]) + (p[three - 3] + p[three + 3]);
    to[0][i] = here[i] * p[0];
    to[1][i] = here[i] * (side1 + up1);
    to[2][i] = here[i] * at11;
    to[3][i] = here[i] * (side2 + up2);
    to[4][i] = here[i] * (at12 + at21);
    to[5][i] = here[i] * at22;
    to[6][i] = here[i] * (side3 + up3);
    to[7][i] = here[i] * (at13 + at31);
    to[8][i] = here[i] * (at23 + at32);
    to[9][i] = here[i] * at33;
  }
}

DRAPE_WIDE_VECTORS void offset_products(const FourPlanes& of, int offset,
                                        std::array<float, 4>& sums) {
  const FourPlanes all = of;
  Lane sum[4] = {};
  for (int n = 0; n < all.count; ++n) {
    const int place = all.places[n];
    for (int k = 0; k < 4; ++k) {
      Lane u, v;
      std::memcpy(&u, all.planes[k] + place, sizeof u);
      std::memcpy(&v, all.planes[k] + place + offset, sizeof v);
      sum[k] += u * v;
    }
  }
  for (int k = 0; k < 4; ++k) sums[k] = total(sum[k]);
}

}  // namespace drape::detect
