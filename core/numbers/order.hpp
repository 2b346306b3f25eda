// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace drape {

/// The element at `place`, counted from 0, of the ascending order of more than `place` values.
template <typename T>
[[nodiscard]] T order_statistic(std::vector<T> values, std::size_t place) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(place);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Of at least one value; of an even number the upper one of the two in the middle.
template <typename T>
[[nodiscard]] T median(std::vector<T> values) {
  const std::size_t middle = values.size() / 2;
  return order_statistic(std::move(values), middle);
}

}  // namespace drape
