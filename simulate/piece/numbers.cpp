// SPDX-License-Identifier: Apache-2.0
#include "simulate/piece/numbers.hpp"

#include <cctype>
#include <charconv>
#include <cmath>

namespace drape::simulate {

void NumberReader::skip() {
  while (at_ < text_.size() &&
         (text_[at_] == ',' || std::isspace(static_cast<unsigned char>(text_[at_])) != 0))
    ++at_;
}

std::optional<double> NumberReader::next() {
  skip();
  const char* begin = text_.data() + at_;
  const char* end = text_.data() + text_.size();
  if (begin < end && *begin == '+') ++begin;  // which from_chars does not take
  double value = 0;
  const auto [after, error] = std::from_chars(begin, end, value);
  if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
  at_ = static_cast<std::size_t>(after - text_.data());
  return value;
}

std::optional<bool> NumberReader::flag() {
  skip();
  if (at_ >= text_.size() || (text_[at_] != '0' && text_[at_] != '1')) return std::nullopt;
  return text_[at_++] == '1';
}

std::optional<char> NumberReader::letter() {
  skip();
  if (at_ >= text_.size() || std::isalpha(static_cast<unsigned char>(text_[at_])) == 0)
    return std::nullopt;
  return text_[at_++];
}

bool NumberReader::at_end() {
  skip();
  return at_ == text_.size();
}

}  // namespace drape::simulate
