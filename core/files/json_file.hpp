// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace drape {

/// Keeps the order of keys, so that files are readable and the same input gives the same bytes.
using Json = nlohmann::ordered_json;

/// Parses JSON text. Throws Error(bad_input) with file and line for invalid JSON, deep nesting and
/// a repeated key. Calling Json::parse directly costs seconds of compile time per source.
[[nodiscard]] Json parse_json(std::string_view text, const std::string& file = "");

/// Like parse_json, but returns a discarded value (`is_discarded()`) if the text is not JSON.
[[nodiscard]] Json try_json(std::string_view text);

/// Pretty-printed durable write. Arrays of plain numbers stay on one line.
void write_json(const std::filesystem::path& file, const Json& json);

/// The text that write_json writes.
[[nodiscard]] std::string pretty(const Json& json);

}  // namespace drape
