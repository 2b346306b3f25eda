// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/mutations.hpp"

#include <array>
#include <random>
#include <vector>

namespace drape::test {
namespace {

using Random = std::mt19937;

/// A random position below `size`, independent of the library's distributions.
std::size_t below(Random& random, std::size_t size) {
  return size == 0 ? 0 : random() % size;
}

void flip_byte(std::string& text, Random& random) {
  text[below(random, text.size())] = static_cast<char>(random() & 0xFF);
}

void insert_byte(std::string& text, Random& random) {
  constexpr std::string_view kTelling = "{}[]\",:=#\n\\-.eE0\x80\xff";
  text.insert(below(random, text.size()), 1, kTelling[below(random, kTelling.size())]);
}

void remove_bytes(std::string& text, Random& random) {
  text.erase(below(random, text.size()), 1 + below(random, 8));
}

void cut_end(std::string& text, Random& random) {
  text.resize(below(random, text.size()));
}

std::pair<std::size_t, std::size_t> line_at(const std::string& text, std::size_t place) {
  const std::size_t start = place == 0 ? 0 : text.rfind('\n', place - 1) + 1;
  const std::size_t end = text.find('\n', start);
  return {start, (end == std::string::npos ? text.size() : end + 1) - start};
}

void double_line(std::string& text, Random& random) {
  const auto [start, length] = line_at(text, below(random, text.size()));
  const std::string line = text.substr(start, length);
  text.insert(below(random, 2) == 0 ? start : line_at(text, below(random, text.size())).first,
              line);
}

void drop_line(std::string& text, Random& random) {
  const auto [start, length] = line_at(text, below(random, text.size()));
  text.erase(start, length);
}

constexpr std::array kExtreme = {"0",
                                 "-1",
                                 "1e308",
                                 "-1e308",
                                 "1e-320",
                                 "1e99",
                                 "null",
                                 "nan",
                                 "inf",
                                 "99999999999999999999",
                                 "true",
                                 "\"\"",
                                 "[]",
                                 "{}",
                                 "2147483648",
                                 "-9223372036854775808",
                                 "18446744073709551615",
                                 "\"../../etc/passwd\"",
                                 "[[[]]]",
                                 "[1, \"two\", null]"};

/// Replaces a quoted text, list or table by a value of another type.
void change_type(std::string& text, Random& random) {
  const std::size_t start = text.find_first_of("\"[{", below(random, text.size()));
  if (start == std::string::npos) return;
  const char close = text[start] == '[' ? ']' : text[start] == '{' ? '}' : '"';
  const std::size_t end = text.find(close, start + 1);
  if (end == std::string::npos) return;
  text.replace(start, end + 1 - start, kExtreme[below(random, kExtreme.size())]);
}

void replace_number(std::string& text, Random& random) {
  const std::size_t start = text.find_first_of("0123456789", below(random, text.size()));
  if (start == std::string::npos) return;
  const std::size_t end = text.find_first_not_of("0123456789.eE+-", start);
  text.replace(start, (end == std::string::npos ? text.size() : end) - start,
               kExtreme[below(random, kExtreme.size())]);
}

/// Brackets inside brackets where a value stands, or dotted parts of a key, deeper than a stack may
/// go.
void nest(std::string& text, Random& random) {
  constexpr std::size_t kDeep = 100000;
  const std::size_t at = text.find_first_of("0123456789\"", below(random, text.size()));
  if (at == std::string::npos) return;
  std::string deep;
  switch (below(random, 3)) {
    case 0:
      deep = std::string(kDeep, '[') + "1" + std::string(kDeep, ']');
      break;
    case 1:
      for (std::size_t i = 0; i < kDeep; ++i) deep += "{\"a\":";
      break;
    default:
      for (std::size_t i = 0; i < kDeep; ++i) deep += "a.";
      text.insert(line_at(text, at).first, deep + "a = 1\n");
      return;
  }
  text.insert(at, deep);
}

/// A word of a quarter of a megabyte where a word begins.
void widen(std::string& text, Random& random) {
  text.insert(below(random, text.size()), 1 << 18, "x1,\n"[below(random, 4)]);
}

/// The same characters as UTF-16, behind a byte order mark, or with the line ends of Windows.
void encode_otherwise(std::string& text, Random& random) {
  std::string other;
  switch (below(random, 3)) {
    case 0:
      other = "\xff\xfe";
      for (const char c : text) other += {c, '\0'};
      break;
    case 1:
      other = "\xef\xbb\xbf" + text;
      break;
    default:
      for (const char c : text) other += c == '\n' ? std::string("\r\n") : std::string(1, c);
  }
  text = other;
}

}  // namespace

std::string spoiled(const std::string& text, std::uint32_t seed) {
  constexpr std::array kMutations = {flip_byte,      insert_byte,     remove_bytes,   cut_end,
                                     double_line,    drop_line,       replace_number, change_type,
                                     replace_number, change_type,     replace_number, nest,
                                     widen,          encode_otherwise};
  Random random(seed);
  std::string result = text;
  const std::size_t count = 1 + below(random, 3);
  for (std::size_t i = 0; i < count && !result.empty(); ++i) {
    kMutations[below(random, kMutations.size())](result, random);
  }
  return result;
}

}  // namespace drape::test
