// SPDX-License-Identifier: Apache-2.0
#include "capture/natural_order.hpp"

#include <algorithm>
#include <compare>

namespace drape::capture {
namespace {

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

/// Takes the leading digits of `text`, without leading zeros.
std::string_view take_number(std::string_view& text) {
  const auto end = std::find_if_not(text.begin(), text.end(), is_digit);
  std::string_view digits(text.begin(), end);
  text.remove_prefix(digits.size());
  digits.remove_prefix(std::min(digits.find_first_not_of('0'), digits.size()));
  return digits;
}

std::strong_ordering compare_naturally(std::string_view a, std::string_view b) {
  while (!a.empty() && !b.empty()) {
    if (is_digit(a.front()) && is_digit(b.front())) {
      const std::string_view number_a = take_number(a);
      const std::string_view number_b = take_number(b);
      if (const auto order = number_a.size() <=> number_b.size(); std::is_neq(order)) return order;
      if (const auto order = number_a <=> number_b; std::is_neq(order)) return order;
    } else {
      if (const auto order = a.front() <=> b.front(); std::is_neq(order)) return order;
      a.remove_prefix(1);
      b.remove_prefix(1);
    }
  }
  return a.size() <=> b.size();
}

}  // namespace

bool natural_less(std::string_view a, std::string_view b) {
  const std::strong_ordering order = compare_naturally(a, b);
  return std::is_eq(order) ? a < b : std::is_lt(order);
}

}  // namespace drape::capture
