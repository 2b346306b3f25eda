// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/mutations.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <iterator>
#include <random>
#include <regex>
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

/// Brackets inside brackets before a value, or dotted parts of a key, deeper than a stack may go.
void nest_at(std::string& text, std::size_t at, std::size_t how) {
  constexpr std::size_t kDeep = 100000;
  std::string deep;
  switch (how) {
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

void nest(std::string& text, Random& random) {
  const std::size_t at = text.find_first_of("0123456789\"", below(random, text.size()));
  if (at != std::string::npos) nest_at(text, at, below(random, 3));
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

/// A value of a text: a number, or a text with its quotes.
struct Token {
  std::size_t begin, size;
  bool is_number;
};

/// Values outside comments; keys before a colon or an equals sign are
/// none.
std::vector<Token> tokens_of(const std::string& text) {
  std::vector<Token> tokens;
  const auto part_of_word = [](char c) { return std::isalnum(c & 0xff) != 0 || c == '_'; };
  for (std::size_t at = 0; at < text.size(); ++at) {
    const bool begins = at == 0 || text[at - 1] == '\n';
    if ((text[at] == '#' && (begins || text[at - 1] == ' ')) || (text[at] == '%' && begins))
      at = std::min(text.find('\n', at), text.size() - 1);
    if (text[at] == '"' || text[at] == '\'') {
      const std::size_t close = text.find(text[at], at + 1);
      if (close == std::string::npos) break;
      const std::size_t next = text.find_first_not_of(" \t", close + 1);
      const bool is_key = next != std::string::npos && (text[next] == ':' || text[next] == '=');
      const std::string inside = text.substr(at + 1, close - at - 1);
      const bool is_value = at >= 6 && text.compare(at - 6, 6, "value=") == 0;
      if (is_value && inside.find_first_not_of("0123456789.eE+-") == std::string::npos)
        tokens.push_back({at + 1, inside.size(), true});
      else if (!is_key && (is_value || at == 0 || text[at - 1] != '='))
        tokens.push_back({at, close + 1 - at, false});
      at = close;
    } else if (std::isdigit(text[at] & 0xff) != 0 && (at == 0 || !part_of_word(text[at - 1]))) {
      std::size_t begin = at;
      while (begin > 0 && std::string_view("+-.").find(text[begin - 1]) != std::string_view::npos)
        --begin;
      at = std::min(text.find_first_not_of("0123456789.eE+-", at), text.size());
      const bool is_key = at < text.size() && (part_of_word(text[at]) || text[at] == ':');
      if (!is_key) tokens.push_back({begin, at - begin, true});
      --at;
    }
  }
  return tokens;
}

}  // namespace

Fault one_fault(const std::string& text, std::uint32_t seed) {
  Random random(seed);
  Fault fault{text, "", "", true};
  const std::vector<Token> tokens = tokens_of(text);
  std::vector<Token> numbers;
  std::copy_if(tokens.begin(), tokens.end(), std::back_inserter(numbers),
               [](const Token& token) { return token.is_number; });
  const bool is_closed = text.starts_with("{") || text.starts_with("<");
  const auto replace = [&](const std::vector<Token>& some, const auto& by) {
    if (some.empty()) return;
    const Token& token = some[below(random, some.size())];
    const auto [start, length] = line_at(text, token.begin);
    fault.line = text.substr(start, length);
    fault.text.replace(token.begin, token.size, by(token));
  };
  const auto one_of = [&](std::initializer_list<const char*> words) {
    return std::string(words.begin()[below(random, words.size())]);
  };
  constexpr std::array kFaults = {"dropped", "another type", "out of range", "not finite",
                                  "twice",   "structure",    "encoding",     "truncation",
                                  "nesting", "size"};
  fault.kind = kFaults[seed % kFaults.size()];
  switch (seed % kFaults.size()) {
    case 0:
      replace(tokens, [&](const Token& token) {
        // A list that lacks its last value is a shorter list.
        const std::size_t next = text.find_first_not_of(" \n", token.begin + token.size);
        fault.can_tell = next == std::string::npos || text[next] != ']';
        return std::string();
      });
      break;
    case 1:
      replace(tokens,
              [](const Token& token) { return std::string(token.is_number ? "\"seven\"" : "7"); });
      break;
    case 2:
      replace(numbers, [&](const Token& token) {
        const std::string number = text.substr(token.begin, token.size);
        const bool is_whole = number.find_first_not_of("0123456789") == std::string::npos;
        if (is_whole && number.size() < 10 && below(random, 2) == 0)
          return std::to_string((std::uint64_t{1} << 32) + std::stoull(number));
        return one_of({"1e300", "-1e300", "1e999", "99999999999999999999999"});
      });
      break;
    case 3:
      replace(numbers, [&](const Token&) { return one_of({"nan", ".nan", "NaN", "inf", "-inf"}); });
      break;
    case 4: {
      const auto [start, length] = line_at(text, below(random, text.size()));
      fault.line = text.substr(start, length);
      fault.text.insert(start, fault.line);
      fault.can_tell = std::regex_search(fault.line, std::regex("^ *\"?[\\w.]+\"? *[:=]|name="));
      break;
    }
    case 5: {
      const std::size_t at = text.find_first_of("[]{}<>", below(random, text.size()));
      if (at != std::string::npos) fault.text.erase(at, 1);
      fault.can_tell = at != std::string::npos && is_closed;
      break;
    }
    case 6:
      encode_otherwise(fault.text, random);
      fault.can_tell = fault.text.starts_with("\xff\xfe");
      break;
    case 7:
      fault.text.resize(below(random, text.find_last_not_of(" \n\r") + 1));
      fault.can_tell = is_closed;
      break;
    case 8:
      if (!tokens.empty())
        nest_at(fault.text, tokens[below(random, tokens.size())].begin, below(random, 2));
      break;
    default:
      replace(tokens, [](const Token& token) {
        return token.is_number ? std::string(1 << 18, '1')
                               : "\"" + std::string(1 << 18, 'x') + "\"";
      });
  }
  fault.can_tell = fault.can_tell && fault.text != text;
  return fault;
}

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
