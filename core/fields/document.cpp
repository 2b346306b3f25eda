// SPDX-License-Identifier: Apache-2.0
#include "core/fields/document.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>

#include "core/files/files.hpp"

namespace drape {
namespace {

/// Appends values in a canonical spelling: keys sorted, numbers as binary64, null omitted.
void add_canonical(const Value& value, std::string& out) {
  if (const auto* table = value.get_if<Value::Table>()) {
    std::vector<const std::pair<std::string, Value>*> sorted;
    for (const auto& member : *table)
      if (!member.second.is_null()) sorted.push_back(&member);
    std::sort(sorted.begin(), sorted.end(),
              [](const auto* a, const auto* b) { return a->first < b->first; });
    out += '{';
    for (const auto* member : sorted) {
      out += one_line(member->first) + ":";
      add_canonical(member->second, out);
      out += ',';
    }
    out += '}';
  } else if (const auto* list = value.get_if<Value::List>()) {
    out += '[';
    for (const Value& item : *list) {
      add_canonical(item, out);
      out += ',';
    }
    out += ']';
  } else {
    out += value.is_number() ? fmt::format("{}", value.number()) : one_line(value);
  }
}

}  // namespace

struct Document::Content {
  std::filesystem::path file;
  Syntax syntax = Syntax::options;
  Value root = Value::Table{};
  std::string sha256;
};

namespace fields_detail {
Value parse_toml(std::string_view text, const std::string& file);
}

Document::Document(std::filesystem::path file, Syntax syntax, std::string_view bytes) {
  Value root = syntax == Syntax::toml ? fields_detail::parse_toml(bytes, file.string())
                                      : json_value(bytes, file.string());
  content_ = std::make_shared<const Content>(
      Content{std::move(file), syntax, std::move(root), sha256_of(bytes)});
}

Document::Document(Syntax syntax, Value root)
    : content_(std::make_shared<const Content>(Content{{}, syntax, std::move(root), {}})) {}

Document Document::read(const std::filesystem::path& file) {
  return {file, file.extension() == ".toml" ? Syntax::toml : Syntax::json, read_text(file)};
}

const std::filesystem::path& Document::file() const {
  static const std::filesystem::path none;
  return content_ ? content_->file : none;
}

Syntax Document::syntax() const {
  return content_ ? content_->syntax : Syntax::options;
}

const Value& Document::root() const {
  static const Value empty = Value::Table{};
  return content_ ? content_->root : empty;
}

const std::string& Document::sha256() const {
  static const std::string none;
  return content_ ? content_->sha256 : none;
}

std::string Document::values_sha256() const {
  std::string text;
  add_canonical(root(), text);
  return sha256_of(text);
}

std::filesystem::path Document::beside(const std::filesystem::path& relative) const {
  return syntax() == Syntax::options ? relative
                                     : (file().parent_path() / relative).lexically_normal();
}

Where Document::where(std::string_view path) const {
  const Value* value = &root();
  int line = value->line;
  for (std::size_t begin = 0; value != nullptr && begin < path.size();) {
    const std::size_t end = std::min(path.find('.', begin), path.size());
    const std::string_view part = path.substr(begin, end - begin);
    std::size_t index = 0;
    const auto* list = value->get_if<Value::List>();
    if (list == nullptr)
      value = value->find(part);
    else if (std::from_chars(part.begin(), part.end(), index).ec == std::errc() &&
             index < list->size())
      value = &(*list)[index];
    else
      value = nullptr;
    if (value != nullptr && value->line > 0) line = value->line;
    begin = end + 1;
  }
  return {.file = file().string(),
          .line = line > 0 ? std::optional(line) : std::nullopt,
          .field = shown_path(syntax(), path)};
}

std::string shown_path(Syntax syntax, std::string_view path) {
  if (syntax == Syntax::options) {
    std::string name = "--" + std::string(path.substr(0, path.find('.')));
    std::replace(name.begin(), name.end(), '_', '-');
    return name;
  }
  std::string shown;
  for (std::size_t begin = 0; begin <= path.size() && !path.empty();) {
    const std::size_t end = std::min(path.find('.', begin), path.size());
    const std::string_view part = path.substr(begin, end - begin);
    std::size_t index = 0;
    const bool is_index = std::from_chars(part.begin(), part.end(), index).ptr == part.end();
    if (syntax == Syntax::json) shown += '/';
    if (syntax == Syntax::toml && !shown.empty()) shown += '.';
    shown += syntax == Syntax::toml && is_index && !part.empty() ? std::to_string(index + 1)
                                                                 : std::string(part);
    begin = end + 1;
  }
  return shown;
}

}  // namespace drape
