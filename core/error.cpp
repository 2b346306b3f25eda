// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <utility>

namespace drape {
namespace {

constexpr std::size_t kMostQuoted = 80;  ///< longest quotation in a message, bytes

/// Replaces line ends, after which a name could pretend to be a verdict.
std::string on_one_line(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return c == '\n' || c == '\r'; }, '?');
  return text;
}

/// Cuts a text that is too long to be quoted, between two characters of UTF-8.
std::string quotable(const std::string& given) {
  const std::string text = on_one_line(given);
  if (text.size() <= kMostQuoted) return text;
  std::size_t end = kMostQuoted - 3;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0) == 0x80) --end;
  return text.substr(0, end) + "...";
}

/// Shortens each quotation between two backquotes; file, line and remedy of an Error stay whole. An
/// unpaired backquote begins a quotation up to the end.
std::string with_short_quotations(const std::string& text) {
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t open = text.find('`', at);
    if (open == std::string::npos) return result + text.substr(at);
    const std::size_t close = std::min(text.find('`', open + 1), text.size());
    result += text.substr(at, open + 1 - at) + quotable(text.substr(open + 1, close - open - 1));
    at = close;
    if (close < text.size()) {
      result += '`';
      ++at;
    }
  }
  return result;
}

}  // namespace

std::string Where::describe() const {
  std::string text = on_one_line(file);
  if (line) text += fmt::format(":{}", *line);
  const auto append = [&text](const char* name, const std::string& value) {
    if (value.empty()) return;
    if (!text.empty()) text += ", ";
    text += fmt::format("{} `{}`", name, quotable(value));
  };
  append("field", field);
  append("camera", camera);
  append("set", set);
  return text;
}

Error::Error(ErrorKind kind, std::string what_failed, Where where, std::string what_to_do)
    : kind_(kind),
      what_failed_(with_short_quotations(what_failed)),
      where_(std::move(where)),
      what_to_do_(std::move(what_to_do)) {
  text_ = what_failed_;
  if (const std::string place = where_.describe(); !place.empty()) text_ += "\n  where: " + place;
  if (!what_to_do_.empty()) text_ += "\n  to do: " + what_to_do_;
}

Error::Error(std::vector<Error> faults) : Error(faults.front()) {
  if (faults.size() == 1) return;
  constexpr std::size_t kShown = 20;
  for (std::size_t i = 1; i < std::min(faults.size(), kShown); ++i) {
    const std::string place = faults[i].where_.describe();
    text_ += fmt::format("\n  also: {}{}{}; {}", place, place.empty() ? "" : ": ",
                         faults[i].what_failed_, faults[i].what_to_do_);
  }
  if (faults.size() > kShown) text_ += fmt::format("\n  and {} more", faults.size() - kShown);
  faults_ = std::make_shared<const std::vector<Error>>(std::move(faults));
}

std::vector<Error> Error::each() const {
  return faults_ ? *faults_ : std::vector<Error>{*this};
}

void throw_if_any(std::vector<Error> faults) {
  if (!faults.empty()) throw Error(std::move(faults));
}

Error bad_input(std::string what_failed, Where where, std::string what_to_do) {
  return {ErrorKind::bad_input, std::move(what_failed), std::move(where), std::move(what_to_do)};
}

Error usage_error(std::string what_failed, std::string what_to_do) {
  return {ErrorKind::usage, std::move(what_failed), {}, std::move(what_to_do)};
}

Error internal_error(std::string what_failed, Where where) {
  return {ErrorKind::internal, std::move(what_failed), std::move(where),
          "this is a fault of drapebench itself: please report it with the command line"};
}

}  // namespace drape
