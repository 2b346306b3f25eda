// SPDX-License-Identifier: Apache-2.0
#pragma once

// Builds the inner loops twice. The wider version performs the same operations on each element
// (neither may use fused multiply-add), so results do not depend on the processor.

// The arrays in these loops do not overlap, which the compiler cannot prove.
#if defined(__GNUC__) && !defined(__clang__)
#define DRAPE_INDEPENDENT _Pragma("GCC ivdep")
#define DRAPE_INLINE __attribute__((always_inline)) inline
#else
#define DRAPE_INDEPENDENT
#define DRAPE_INLINE inline
#endif

// Built twice; selected at run time by the processor.
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define DRAPE_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define DRAPE_WIDE
#endif
