// SPDX-License-Identifier: Apache-2.0
#include "front/picture_names.hpp"

#include <algorithm>
#include <cctype>
#include <regex>
#include <set>

namespace drape {
namespace {

bool is_digit(char c) {
  return std::isdigit(static_cast<unsigned char>(c)) != 0;
}

/// Date and time in a name as written by cameras: "2018-09-17__16-38-56", "20180917_163856789".
const std::regex& time_in_name() {
  static const std::regex kTime(
      "((?:19|20)[0-9]{2})([-_.]?)(0[1-9]|1[0-2])\\2(0[1-9]|[12][0-9]|3[01])[-_. T]*"
      "([01][0-9]|2[0-3])([-_.hH:]?)([0-5][0-9])[-_.mM:]?([0-5][0-9][0-9]{0,6})");
  return kTime;
}

/// Joins each date and time in a name to one number.
std::string with_joined_time(const std::string& name) {
  return std::regex_replace(name, time_in_name(), "$1$3$4$5$7$8");
}

std::string without_time(const std::string& name) {
  return std::regex_replace(name, time_in_name(), "");
}

/// Digits of a number without leading zeros.
std::string digits_of(const std::string& number) {
  return number.substr(std::min(number.find_first_not_of('0'), number.size() - 1));
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

std::vector<PictureName> read_picture_names(const std::vector<std::string>& given) {
  // Times are ignored if the names differ without them.
  std::vector<std::string> names;
  std::transform(given.begin(), given.end(), std::back_inserter(names), without_time);
  if (std::set<std::string>(names.begin(), names.end()).size() < names.size())
    std::transform(given.begin(), given.end(), names.begin(), with_joined_time);
  std::vector<std::vector<std::string>> all;
  std::set<std::size_t> numbers;
  for (const std::string& name : names) {
    all.push_back(parts_of(name));
    numbers.insert(all.back().size() / 2);
  }
  std::size_t view = 0, most = 0;
  for (std::size_t place = 1; numbers.size() == 1 && place < 2 * *numbers.begin(); place += 2) {
    std::set<std::string> values;
    for (const std::vector<std::string>& parts : all) values.insert(digits_of(parts[place]));
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
  // Equal numbers become equal texts, sorted like the numbers.
  const auto is_number = [](const std::string& text) {
    return std::all_of(text.begin(), text.end(), is_digit);
  };
  std::size_t widest = 0, narrowest = 0;
  for (const PictureName& name : result) {
    if (!is_number(name.view)) continue;
    widest = std::max(widest, digits_of(name.view).size());
    narrowest = narrowest == 0 ? name.view.size() : std::min(narrowest, name.view.size());
  }
  const std::size_t width = std::max(widest, narrowest);
  for (PictureName& name : result) {
    if (!is_number(name.view)) continue;
    const std::string digits = digits_of(name.view);
    name.view = std::string(width - digits.size(), '0') + digits;
  }
  return result;
}

}  // namespace drape
