// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error.hpp"
#include "core/fields/fields.hpp"

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

  [[nodiscard]] const std::filesystem::path& file() const { return content_->file; }
  [[nodiscard]] Syntax syntax() const { return content_->syntax; }
  [[nodiscard]] const Value& root() const { return content_->root; }
  /// Hash of the bytes, which proves the content.
  [[nodiscard]] const std::string& sha256() const { return content_->sha256; }
  /// Hash of the values, which ignores comments, spelling and the order of keys.
  [[nodiscard]] std::string values_sha256() const;

  /// File, line and field for an error; `path` like "object.0.size_mm", list indices from 0.
  [[nodiscard]] Where where(std::string_view path) const;
  /// Path of a file that this one refers to, resolved against its folder.
  [[nodiscard]] std::filesystem::path beside(const std::filesystem::path& relative) const;

 private:
  struct Content {
    std::filesystem::path file;
    Syntax syntax = Syntax::options;
    Value root = Value::Table{};
    std::string sha256;
  };
  std::shared_ptr<const Content> content_ = std::make_shared<const Content>();
};

/// `path` as shown to users: "object.1.size_mm" (TOML, indices count from 1), "/object/0/size_mm"
/// (JSON pointer) or "--size-mm".
[[nodiscard]] std::string shown_path(Syntax syntax, std::string_view path);

/// Parses a JSON text with limits on depth and length; each key may occur once. Throws
/// Error(bad_input) with `file` and line.
[[nodiscard]] Value json_value(std::string_view text, const std::string& file = "");

/// Name, version and syntax of a file format.
struct Format {
  std::string_view name;
  Syntax syntax = Syntax::json;
  int version = 1;
  std::string_view meaning = {};

  [[nodiscard]] std::string schema() const;  ///< "drapebench/scene/1"
};

/// A function that walks through the fields of one record.
using Walk = std::function<void(Fields&)>;

template <class Record>
[[nodiscard]] Walk walk_through(Record& record) {
  return [&record](Fields& f) { fields(f, record); };
}

/// Reads the values of `document` into the record behind `walk`. Returns every error of the file in
/// the order of the description; an empty list means that the record is valid.
[[nodiscard]] std::vector<Error> faults_of_reading(const Document& document, const Walk& walk);

/// Throws if the document has another format or a newer version.
void require_format(const Document& document, const Format& format);

[[nodiscard]] Value written(const Format& format, const Walk& walk);
[[nodiscard]] Value written(const Walk& walk);

/// JSON Schema 2020-12 of a format.
[[nodiscard]] Value schema_of(const Format& format, const Walk& walk);

/// Reads a record from a document. Throws one Error(bad_input) with every error. A member
/// `document` of the record keeps the document, with the hashes of what was read.
template <class Record>
[[nodiscard]] Record read_record(const Document& document) {
  require_format(document, format_of<Record>);
  Record record{};
  if constexpr (requires { record.document = document; }) record.document = document;
  throw_if_any(faults_of_reading(document, walk_through(record)));
  return record;
}
template <class Record>
[[nodiscard]] Record read_record(const std::filesystem::path& file) {
  return read_record<Record>(Document::read(file));
}

/// Values of a record in the order of its description, preceded by a `schema` key if the record is
/// a file format.
template <class Record>
[[nodiscard]] Value value_of(Record record) {
  if constexpr (std::is_same_v<std::remove_cv_t<decltype(format_of<Record>)>, Format>)
    return written(format_of<Record>, walk_through(record));
  else
    return written(walk_through(record));
}

/// Throws Error(usage) if a record made by a program violates its description.
template <class Record>
void check_record(const Record& record) {
  Record copy = record;
  throw_if_any(faults_of_reading(Document(Syntax::options, value_of(record)), walk_through(copy)));
}

/// Content of the record's file.
template <class Record>
[[nodiscard]] std::string text_of(const Record& record) {
  const Value value = value_of(record);
  return format_of<Record>.syntax == Syntax::toml ? toml_text(value) : pretty(value);
}

/// Writes the record's file durably (files.hpp).
void write_value(const std::filesystem::path& file, const Value& value);
template <class Record>
void write_record(const std::filesystem::path& file, const Record& record) {
  write_value(file, value_of(record));
}

/// A format with a valid example; used to generate schemas, fuzz seeds and invalid inputs.
struct DescribedFormat {
  Format format;
  Value schema;
  std::string example;  ///< content of a valid file
  std::function<std::vector<Error>(const Document&)> faults;
};

/// Describes the format of `Record`; `example` is the content of a valid file.
template <class Record>
[[nodiscard]] DescribedFormat described(std::string example) {
  Record record{};
  return {format_of<Record>, schema_of(format_of<Record>, walk_through(record)), std::move(example),
          [](const Document& document) {
            Record read{};
            if constexpr (requires { read.document = document; }) read.document = document;
            return faults_of_reading(document, walk_through(read));
          }};
}
template <class Record>
[[nodiscard]] DescribedFormat described(const Record& example) {
  return described<Record>(text_of(example));
}

}  // namespace drape
