// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "core/error.hpp"
#include "core/fields/value.hpp"

namespace drape {

/// TOML is for what people edit, JSON for what programs write, options for a command line.
enum class Syntax { toml, json, options };

/// Remedy of a file that drapebench writes and cannot read.
inline constexpr const char* make_again =
    "the file is written by drapebench: make it again with the program that wrote it";

/// A file that was read once: its values with their lines, and the hash of the bytes that were
/// read. Copies share one content.
class Document {
 public:
  Document() = default;  ///< no file; holds an empty table
  Document(std::filesystem::path file, Syntax syntax, std::string_view bytes);
  /// Values that stand in no file.
  Document(Syntax syntax, Value root);

  /// Reads the file; its ending tells the syntax. Throws Error(bad_input) with file and line.
  [[nodiscard]] static Document read(const std::filesystem::path& file);

  [[nodiscard]] const std::filesystem::path& file() const;
  [[nodiscard]] Syntax syntax() const;
  [[nodiscard]] const Value& root() const;
  /// Hash of the bytes: proof.
  [[nodiscard]] const std::string& sha256() const;
  /// Hash of the values: the same whatever comments, spelling and order of keys are.
  [[nodiscard]] std::string values_sha256() const;

  /// File, line and field for an error; `path` as "object.0.size_mm", lists counting from 0.
  [[nodiscard]] Where where(std::string_view path) const;
  /// A file that this one names, relative to it.
  [[nodiscard]] std::filesystem::path beside(const std::filesystem::path& relative) const;

 private:
  struct Content;
  std::shared_ptr<const Content> content_;
};

/// `path` as people read it: "object.1.size_mm" (TOML, lists count from 1), "/object/0/size_mm"
/// (JSON pointer) or "--size-mm".
[[nodiscard]] std::string shown_path(Syntax syntax, std::string_view path);

/// The value that a JSON text writes, within bounds of depth and length, each key once. Throws
/// Error(bad_input) with `file` and line.
[[nodiscard]] Value json_value(std::string_view text, const std::string& file = "");

}  // namespace drape
