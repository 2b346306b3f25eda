// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <cstddef>
#include <vector>

// Closed outlines given by their distance from a centre at equal steps of an angle or of length.
namespace drape {

/// Fourier coefficients c_k, k = 0 .. most: radius(angle) = sum over k of Re(c_k exp(i k angle)).
[[nodiscard]] std::vector<std::complex<double>> spectrum_of(const std::vector<double>& radius,
                                                            int most);

/// Radii at `count` steps of the harmonics up to spectrum.size() - 1 < count / 2.
[[nodiscard]] std::vector<double> radii_of(std::vector<std::complex<double>> spectrum, int count);

/// Alternating crests and valleys around an outline that differ by at least `least`: an extreme
/// counts once the radius has changed from it by that much. Indices into the outline; equal numbers
/// of crests and valleys.
struct Extremes {
  std::vector<std::size_t> crests, valleys;
};
[[nodiscard]] Extremes extremes_of(const std::vector<double>& radius, double least);

}  // namespace drape
