// SPDX-License-Identifier: Apache-2.0
#pragma once

// Builds the inner loops twice. The wider form computes each element with the same operations
// (no fused multiply-add is allowed in either), so the bytes do not change with the processor.

// No two arrays of these loops overlap, and the compiler cannot prove it.
#if defined(__GNUC__) && !defined(__clang__)
#define DRAPE_INDEPENDENT _Pragma("GCC ivdep")
#define DRAPE_INLINE __attribute__((always_inline)) inline
#else
#define DRAPE_INDEPENDENT
#define DRAPE_INLINE inline
#endif

// Built twice; the processor chooses.
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define DRAPE_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define DRAPE_WIDE
#endif
