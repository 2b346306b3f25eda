// SPDX-License-Identifier: Apache-2.0
#include "core/geometry/outline.hpp"

#include <algorithm>
#include <cmath>
#include <unsupported/Eigen/FFT>

namespace drape {

std::vector<std::complex<double>> spectrum_of(const std::vector<double>& radius, int most) {
  std::vector<std::complex<double>> spectrum;
  Eigen::FFT<double>().fwd(spectrum, radius);
  spectrum.resize(static_cast<std::size_t>(most) + 1);
  for (auto& one : spectrum) one *= 2 / static_cast<double>(radius.size());
  spectrum.front() /= 2;
  return spectrum;
}

std::vector<double> radii_of(std::vector<std::complex<double>> spectrum, int count) {
  spectrum.resize(count);
  std::vector<std::complex<double>> sums;
  Eigen::FFT<double>({}, Eigen::FFT<double>::Unscaled).inv(sums, spectrum);
  std::vector<double> radius;
  for (const std::complex<double>& sum : sums) radius.push_back(sum.real());
  return radius;
}

Extremes extremes_of(const std::vector<double>& radius, double least) {
  Extremes found;
  // Starting at the lowest point, the first significant extreme is a crest.
  const auto start = static_cast<std::size_t>(std::ranges::min_element(radius) - radius.begin());
  bool climbing = true;
  std::size_t extreme = start;
  for (std::size_t i = 1; i <= radius.size(); ++i) {
    const std::size_t here = (start + i) % radius.size();
    if (climbing ? radius[here] > radius[extreme] : radius[here] < radius[extreme]) extreme = here;
    if (std::abs(radius[extreme] - radius[here]) < least) continue;
    (climbing ? found.crests : found.valleys).push_back(extreme);
    climbing = !climbing;
    extreme = here;
  }
  // The walk ends in the valley where it started.
  if (!climbing) found.valleys.push_back(extreme);
  return found;
}

}  // namespace drape
