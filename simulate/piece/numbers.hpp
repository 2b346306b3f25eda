// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>

namespace drape::simulate {

/// Numbers of SVG's attributes, parted by spaces and commas, or by nothing where a sign or a second
/// point begins the next (SVG 1.1, section 8.3.9). Independent of the locale.
class NumberReader {
 public:
  explicit NumberReader(std::string text) : text_(std::move(text)) {}

  /// Nothing where no finite number stands; the place then stays.
  [[nodiscard]] std::optional<double> next();
  /// A flag of an arc: the single character 0 or 1.
  [[nodiscard]] std::optional<bool> flag();
  /// A letter; nothing where none stands.
  [[nodiscard]] std::optional<char> letter();
  [[nodiscard]] bool at_end();
  [[nodiscard]] std::size_t at() const { return at_; }

 private:
  void skip();

  std::string text_;
  std::size_t at_ = 0;
};

}  // namespace drape::simulate
