// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace drape {

std::string Where::describe() const {
  std::string text = file;
  if (line) text += fmt::format(":{}", *line);
  const auto append = [&text](const char* name, const std::string& value) {
    if (value.empty()) return;
    if (!text.empty()) text += ", ";
    text += fmt::format("{} `{}`", name, value);
  };
  append("field", field);
  append("camera", camera);
  append("set", set);
  return text;
}

Error::Error(ErrorKind kind, std::string what_failed, Where where, std::string what_to_do)
    : kind_(kind),
      what_failed_(std::move(what_failed)),
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
