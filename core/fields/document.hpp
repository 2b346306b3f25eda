// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "core/error.hpp"
#include "core/fields/value.hpp"

namespace drape {

/// TOML for files that people edit, JSON for files of programs, options for a command line.
enum class Syntax { toml, json, options };

/// Remedy for an unreadable file that drapebench itself wrote.
inline constexpr const char* make_again =
    "the file is written by drapebench: make it again with the program that wrote it";

/// A file read once: its values with their line numbers, and the hash of the bytes read. Copies
/// share their content.
class Document {
 public:
  Document() = default;  ///< without a file: an empty table
  Document(std::filesystem::path file, Syntax syntax, std::string_view bytes);
  /// Wraps values that come from no file.
  Document(Syntax syntax, Value root);

  /// Reads the file; its extension sets the syntax. Throws Error(bad_input) with file and line.
  [[nodiscard]] static Document read(const std::filesystem::path& file);

  [[nodiscard]] const std::filesystem::path& file() const;
  [[nodiscard]] Syntax syntax() const;
  [[nodiscard]] const Value& root() const;
  /// Hash of the bytes, which proves the content.
  [[nodiscard]] const std::string& sha256() const;
  /// Hash of the values, which ignores comments, spelling and the order of keys.
  [[nodiscard]] std::string values_sha256() const;

  /// File, line and field for an error; `path` like "object.0.size_mm", list indices from 0.
  [[nodiscard]] Where where(std::string_view path) const;
  /// Path of a file that this one refers to, resolved against its folder.
  [[nodiscard]] std::filesystem::path beside(const std::filesystem::path& relative) const;

 private:
  struct Content;
  std::shared_ptr<const Content> content_;
};

/// `path` as shown to users: "object.1.size_mm" (TOML, indices count from 1), "/object/0/size_mm"
/// (JSON pointer) or "--size-mm".
[[nodiscard]] std::string shown_path(Syntax syntax, std::string_view path);

/// Parses a JSON text with limits on depth and length; each key may occur once. Throws
/// Error(bad_input) with `file` and line.
[[nodiscard]] Value json_value(std::string_view text, const std::string& file = "");

}  // namespace drape
