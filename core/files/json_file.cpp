// SPDX-License-Identifier: Apache-2.0
#include "core/files/json_file.hpp"

#include "core/fields/document.hpp"
#include "core/files/files.hpp"

namespace drape {

Json parse_json(std::string_view text, const std::string& file) {
  static_cast<void>(json_value(text, file));  // refuses depth, length and keys given twice
  return Json::parse(text);
}

Json try_json(std::string_view text) {
  return Json::parse(text, nullptr, false);
}

std::string pretty(const Json& json) {
  // File names may not be UTF-8, but JSON must be.
  return pretty(json_value(json.dump(-1, ' ', false, Json::error_handler_t::replace)));
}

void write_json(const std::filesystem::path& file, const Json& json) {
  write_durable(file, pretty(json));
}

}  // namespace drape
