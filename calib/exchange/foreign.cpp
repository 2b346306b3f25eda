// SPDX-License-Identifier: Apache-2.0
#include "calib/exchange/foreign.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <pugixml.hpp>
#include <regex>
#include <string>

#include "core/files/files.hpp"

namespace drape::calib {
namespace {

namespace fs = std::filesystem;

constexpr int kDeepestLiteral = 50;

[[noreturn]] void refuse_file(const fs::path& file, const std::string& what,
                              const std::string& remedy, std::optional<int> line = {}) {
  throw bad_input(what, {.file = file.string(), .line = line}, remedy);
}

Value value_of_node(const cv::FileNode& node) {
  if (node.isInt()) return static_cast<int>(node);
  if (node.isReal()) return static_cast<double>(node);
  if (node.isString()) return static_cast<std::string>(node);
  if (node.isSeq()) {
    Value::List list;
    for (const cv::FileNode& item : node) list.push_back(value_of_node(item));
    return list;
  }
  Value::Table table;
  if (node.isMap())
    for (const std::string& key : node.keys()) table.emplace_back(key, value_of_node(node[key]));
  return table;
}

/// Converts YAML for OpenCV's parser: adds its first line, and indents lists below their key.
std::string for_storage(std::string text) {
  if (!text.starts_with("%YAML"))
    text.insert(0, text.starts_with("---") ? "%YAML:1.0\n" : "%YAML:1.0\n---\n");
  static const std::regex kItem("(^|\n)( *)- ");
  return std::regex_replace(text, kItem, "$1$2  - ");
}

/// Reads a text character by character, with the line of the next one.
class Cursor {
 public:
  Cursor(const fs::path& file, std::string text) : file_(file), text_(std::move(text)) {}

  [[nodiscard]] bool at_end() const { return at_ >= text_.size(); }
  [[nodiscard]] char peek(std::size_t ahead = 0) const {
    return at_ + ahead < text_.size() ? text_[at_ + ahead] : '\0';
  }
  char next() {
    const char c = peek();
    line_ += c == '\n';
    ++at_;
    return c;
  }
  bool take(char wanted) {
    if (at_end() || peek() != wanted) return false;
    next();
    return true;
  }
  template <class Belongs>
  std::string while_true(Belongs belongs) {
    std::string taken;
    while (!at_end() && belongs(peek())) taken += next();
    return taken;
  }
  [[noreturn]] void fail(const std::string& what, const std::string& remedy) const {
    refuse_file(file_, what, remedy, line_);
  }
  [[nodiscard]] int line() const { return line_; }

 private:
  fs::path file_;
  std::string text_;
  std::size_t at_ = 0;
  int line_ = 1;
};

bool is_space(char c) {
  return std::isspace(static_cast<unsigned char>(c)) != 0;
}
bool is_word(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.';
}
bool is_number_part(char c) {
  return is_word(c) || c == '+' || c == '-';
}

/// Parses a number as strtod does, without underscores; null for anything else.
Value number_value(std::string word) {
  word.erase(std::remove(word.begin(), word.end(), '_'), word.end());
  char* end = nullptr;
  const double number = std::strtod(word.c_str(), &end);
  if (word.empty() || *end != '\0') return {};
  if (word.find_first_not_of("+-0123456789") == std::string::npos && std::abs(number) < 1e15)
    return static_cast<std::int64_t>(number);
  return number;
}

class PythonReader {
 public:
  explicit PythonReader(Cursor cursor) : in_(std::move(cursor)) {}

  Value whole() {
    Value value = read(0);
    skip();
    if (!in_.at_end()) fail("something follows the literal");
    return value;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    in_.fail("not a Python literal: " + what, "write the model again with mrcal");
  }
  void skip() {
    for (;;) {
      in_.while_true(is_space);
      if (in_.peek() == '\\' && in_.peek(1) == '\n') {
        in_.next();
      } else if (in_.peek() == '#') {
        in_.while_true([](char c) { return c != '\n'; });
      } else {
        return;
      }
    }
  }
  Value::List items(char closing, int depth) {
    Value::List list;
    for (skip(); !in_.take(closing); skip()) {
      if (in_.at_end()) fail("a bracket is not closed");
      list.push_back(read(depth + 1));
      skip();
      if (!in_.take(',') && in_.peek() != closing) fail("a comma is missing");
    }
    return list;
  }
  Value table(int depth) {
    Value::Table table;
    for (skip(); !in_.take('}'); skip()) {
      if (in_.at_end()) fail("a bracket is not closed");
      const Value key = read(depth + 1);
      skip();
      if (key.get_if<std::string>() == nullptr || !in_.take(':')) fail("a key is no text");
      table.emplace_back(*key.get_if<std::string>(), read(depth + 1));
      table.back().second.line = key.line;
      skip();
      if (!in_.take(',') && in_.peek() != '}') fail("a comma is missing");
    }
    return table;
  }
  std::string quoted() {
    const char quote = in_.next();
    const bool is_long = in_.peek() == quote && in_.peek(1) == quote;
    if (is_long) in_.next(), in_.next();
    std::string text;
    for (;;) {
      if (in_.at_end() || (!is_long && in_.peek() == '\n')) fail("a text does not end");
      if (in_.peek() == quote && (!is_long || (in_.peek(1) == quote && in_.peek(2) == quote)))
        break;
      if (in_.peek() == '\\') text += in_.next();  // escapes are kept as written
      text += in_.next();
    }
    for (int i = 0; i < (is_long ? 3 : 1); ++i) in_.next();
    return text;
  }
  bool at_text() const {
    std::size_t at = 0;
    while (at < 2 && std::string_view("bBrRuU").find(in_.peek(at)) != std::string_view::npos) ++at;
    return in_.peek(at) == '\'' || in_.peek(at) == '"';
  }
  Value read(int depth) {
    if (depth > kDeepestLiteral) fail("nested too deeply");
    skip();
    const int line = in_.line();
    Value value;
    if (in_.take('{')) {
      value = table(depth);
    } else if (in_.take('[')) {
      value = items(']', depth);
    } else if (in_.take('(')) {
      value = items(')', depth);
    } else if (at_text()) {
      std::string text;
      for (; at_text(); skip()) {  // adjacent texts are joined
        in_.while_true([](char c) { return c != '\'' && c != '"'; });
        text += quoted();
      }
      value = text;
    } else {
      const std::string word = in_.while_true(is_number_part);
      if (word == "True" || word == "False")
        value = word == "True";
      else if (word != "None" && (value = number_value(word)).is_null())
        fail(fmt::format("`{}` is no value", printable(word)));
    }
    value.line = line;
    return value;
  }

  Cursor in_;
};

Value parameter_value(const pugi::xml_node& node, const fs::path& file) {
  const std::string type = node.attribute("type").value(), text = node.attribute("value").value();
  if (type == "string") return text;
  if (type == "bool") return text == "true";
  if (Value number = number_value(text); !number.is_null()) return number;
  refuse_file(file, fmt::format("`{}` is `{}`, no {}", node.attribute("name").value(), text, type),
              "write the calibration again with DICe");
}

Value list_value(const pugi::xml_node& node, const fs::path& file, int depth = 0) {
  if (depth > kDeepestLiteral) refuse_file(file, "nested too deeply", "give the right file");
  Value::Table table;
  for (const pugi::xml_node& child : node.children()) {
    const std::string name = child.attribute("name").value();
    if (std::string_view(child.name()) == "ParameterList")
      table.emplace_back(name, list_value(child, file, depth + 1));
    else if (std::string_view(child.name()) == "Parameter")
      table.emplace_back(name, parameter_value(child, file));
  }
  return table;
}

/// Reads the statements of a MATLAB script that assign values to fields.
class MatlabReader {
 public:
  explicit MatlabReader(Cursor cursor) : in_(std::move(cursor)) {}

  Value whole() {
    Value root = Value::Table{};
    for (skip(); !in_.at_end(); skip()) {
      const std::string name = in_.while_true(is_word);
      skip();
      if (name.empty() || !in_.take('=')) fail();
      Value* at = &root;
      for (std::size_t begin = 0; begin <= name.size();) {
        const std::size_t end = std::min(name.find('.', begin), name.size());
        at = &(*at)[name.substr(begin, end - begin)];
        begin = end + 1;
        if (begin <= name.size() && !at->is_null() && at->get_if<Value::Table>() == nullptr) fail();
      }
      if (!at->is_null()) in_.fail("`" + name + "` is given twice", "keep the right one");
      *at = read();
      skip();
      in_.take(';');
    }
    return root;
  }

 private:
  [[noreturn]] void fail() const {
    in_.fail("this is no statement such as `stereoParams.TranslationOfCamera2 = [-120 0 3];`",
             "a display holds no values: write jsonencode(toStruct(stereoParams)) into a file");
  }
  void skip() {
    for (;;) {
      in_.while_true([](char c) { return is_space(c) || c == ';'; });
      if (in_.peek() == '.' && in_.peek(1) == '.' && in_.peek(2) == '.')
        in_.while_true([](char c) { return c != '\n'; });
      else if (in_.peek() == '%')
        in_.while_true([](char c) { return c != '\n'; });
      else
        return;
    }
  }
  Value scalar() {
    if (const char quote = in_.peek(); quote == '\'' || quote == '"') {
      in_.next();
      const std::string text = in_.while_true([&](char c) { return c != quote && c != '\n'; });
      if (!in_.take(quote)) fail();
      return text;
    }
    const std::string word = in_.while_true(is_number_part);
    if (word == "true" || word == "false") return word == "true";
    Value number = number_value(word);
    if (number.is_null()) fail();
    return number;
  }
  /// Reads a matrix as a list of rows; a single row or column becomes a list.
  Value matrix() {
    Value::List rows;
    Value::List row;
    const auto end_row = [&] {
      if (!row.empty()) rows.emplace_back(std::exchange(row, {}));
    };
    for (;;) {
      in_.while_true([](char c) { return c == ' ' || c == '\t' || c == '\r' || c == ','; });
      if (in_.at_end()) fail();
      if (in_.peek() == '.' && in_.peek(1) == '.' && in_.peek(2) == '.') {
        in_.while_true([](char c) { return c != '\n'; });
        in_.next();
      } else if (in_.take(']')) {
        break;
      } else if (in_.take(';') || in_.take('\n')) {
        end_row();
      } else {
        row.push_back(scalar());
      }
    }
    end_row();
    if (rows.size() == 1) return rows.front();
    const auto is_single = [](const Value& r) { return r.get_if<Value::List>()->size() == 1; };
    if (std::all_of(rows.begin(), rows.end(), is_single))
      std::transform(rows.begin(), rows.end(), rows.begin(),
                     [](const Value& r) { return r.get_if<Value::List>()->front(); });
    return rows;
  }
  Value read() {
    in_.while_true(is_space);
    return in_.take('[') ? matrix() : scalar();
  }

  Cursor in_;
};

}  // namespace

Value storage_value(const fs::path& file) {
  std::string text = read_text(file);
  if (const fs::path ending = file.extension(); ending == ".yaml" || ending == ".yml")
    text = for_storage(std::move(text));
  cv::FileStorage storage;
  try {
    storage.open(text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
    if (storage.isOpened()) return value_of_node(storage.root());
  } catch (const cv::Exception&) {
    // Parse errors of OpenCV are treated like a file that it cannot open.
  }
  refuse_file(file, "OpenCV cannot read the file", "give a file of cv::FileStorage or YAML");
}

Value python_value(const fs::path& file) {
  return PythonReader(Cursor(file, read_text(file))).whole();
}

Value parameter_list_value(const fs::path& file) {
  pugi::xml_document document;
  const std::string text = read_text(file);
  const pugi::xml_parse_result result = document.load_string(text.c_str());
  const pugi::xml_node root = document.child("ParameterList");
  if (!result || !root)
    refuse_file(file, "the file is no ParameterList", "give the calibration that DICe wrote");
  return list_value(root, file);
}

Value matlab_value(const fs::path& file) {
  const std::string text = read_text(file);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first != std::string::npos && text[first] == '{') return json_value(text, file.string());
  return MatlabReader(Cursor(file, text)).whole();
}

}  // namespace drape::calib
