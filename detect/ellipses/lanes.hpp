// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstring>

// Compiles functions twice, with 256-bit vectors and without; the choice is made at program start.
// Sums are over whole lanes in a fixed order, so both versions give the same bytes.
#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define DRAPE_WIDE_VECTORS __attribute__((target_clones("avx2", "default")))
#else
#define DRAPE_WIDE_VECTORS
#endif

namespace drape::detect {

constexpr int lanes = 8;
using Lane = float __attribute__((vector_size(lanes * sizeof(float))));

/// Sum of a lane's values in a fixed order.
inline __attribute__((always_inline)) float total(const Lane& sum) {
  return ((sum[0] + sum[4]) + (sum[1] + sum[5])) + ((sum[2] + sum[6]) + (sum[3] + sum[7]));
}

/// Sum of a[i] * b[i] in a fixed order; `count` is a multiple of `lanes`.
inline __attribute__((always_inline)) float lane_sum(const float* a, const float* b, int count) {
  Lane sum = {};
  for (int i = 0; i < count; i += lanes) {
    Lane u, v;
    std::memcpy(&u, a + i, sizeof u);
    std::memcpy(&v, b + i, sizeof v);
    sum += u * v;
  }
  return total(sum);
}

}  // namespace drape::detect
