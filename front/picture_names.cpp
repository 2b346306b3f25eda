// SPDX-License-Identifier: Apache-2.0
#include "front/picture_names.hpp"

#include <algorithm>
#include <cctype>
#include <set>

namespace drape {
namespace {

bool is_digit(char c) {
  return std::isdigit(static_cast<unsigned char>(c)) != 0;
}

/// Splits a name into text (maybe empty) and numbers in turn; numbers are at odd indices.
std::vector<std::string> parts_of(const std::string& name) {
  std::vector<std::string> parts(1);
  for (const char c : name) {
    if (is_digit(c) != (parts.size() % 2 == 0)) parts.emplace_back();
    parts.back() += c;
  }
  return parts;
}

bool is_separator(char c) {
  return c == '-' || c == '_' || c == '.' || c == ' ';
}

/// Joins the text around the number, with one separator if two would meet.
std::string joined(std::string before, std::string after) {
  while (!before.empty() && is_separator(before.back())) before.pop_back();
  const std::size_t skip =
      std::find_if_not(after.begin(), after.end(), is_separator) - after.begin();
  const std::string separator = skip > 0 && !before.empty() && skip < after.size() ? "_" : "";
  return before + separator + after.substr(skip);
}

PictureName split_at(const std::vector<std::string>& parts, std::size_t number) {
  std::string before, after;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (i < number) before += parts[i];
    if (i > number) after += parts[i];
  }
  return {joined(before, after), parts[number]};
}

}  // namespace

std::vector<PictureName> read_picture_names(const std::vector<std::string>& names) {
  std::vector<std::vector<std::string>> all;
  std::set<std::size_t> numbers;
  for (const std::string& name : names) {
    all.push_back(parts_of(name));
    numbers.insert(all.back().size() / 2);
  }
  std::size_t view = 0, most = 0;
  for (std::size_t place = 1; numbers.size() == 1 && place < 2 * *numbers.begin(); place += 2) {
    std::set<std::string> values;
    for (const std::vector<std::string>& parts : all) values.insert(parts[place]);
    if (values.size() < most) continue;
    most = values.size();
    view = place;
  }
  std::vector<PictureName> result;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::size_t last = all[i].size() / 2 * 2;  // index after the last number
    if (last == 0) {
      result.push_back({"", names[i]});
    } else {
      result.push_back(split_at(all[i], view > 0 ? view : last - 1));
    }
  }
  return result;
}

}  // namespace drape
