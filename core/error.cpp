// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"

#include <fmt/format.h>

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
