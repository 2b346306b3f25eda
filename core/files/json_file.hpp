// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace drape {

/// Key order is kept, so that files read well and the same input gives the same bytes.
using Json = nlohmann::ordered_json;

/// The value that a text writes; throws Json::parse_error, and Error with the file's name for what
/// is too deep or has a key twice in one object. Calling the parser itself compiles it: seconds.
[[nodiscard]] Json parse_json(std::string_view text, const std::string& file = "");

/// The same; discarded (`is_discarded()`) where the text is no JSON.
[[nodiscard]] Json try_json(std::string_view text);

/// Pretty-printed durable write. Arrays of plain numbers stay on one line.
void write_json(const std::filesystem::path& file, const Json& json);

/// The text write_json writes.
[[nodiscard]] std::string pretty(const Json& json);

}  // namespace drape
