// SPDX-License-Identifier: Apache-2.0
// Reads other tools' camera files; uses or refuses every key that changes the meaning of numbers.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <map>
#include <pugixml.hpp>
#include <ranges>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "calib/exchange/formats.hpp"
#include "core/fields/records.hpp"
#include "core/files/files.hpp"
#include "core/geometry/rigid_motion.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape::calib {

/// Names of lens models; those of Brown's come first.
enum class StorageLens { plumb_bob, radtan, rational_polynomial, brown, pinhole };
enum class KalibrCamera { pinhole };
enum class KalibrLens { radtan, none };
enum class MrcalLens { pinhole, opencv4, opencv5 };
enum class DiceLens { none, opencv };

}  // namespace drape::calib

template <>
inline constexpr std::string_view drape::names_of<drape::calib::StorageLens>[] = {
    "plumb_bob", "radtan", "rational_polynomial", "brown", "pinhole"};
template <>
inline constexpr std::string_view drape::names_of<drape::calib::KalibrCamera>[] = {"pinhole"};
template <>
inline constexpr std::string_view drape::names_of<drape::calib::KalibrLens>[] = {"radtan", "none"};
template <>
inline constexpr std::string_view drape::names_of<drape::calib::MrcalLens>[] = {
    "LENSMODEL_PINHOLE", "LENSMODEL_OPENCV4", "LENSMODEL_OPENCV5"};
template <>
inline constexpr std::string_view drape::names_of<drape::calib::DiceLens>[] = {
    "NO_LENS_DISTORTION", "OPENCV_LENS_DISTORTION"};

namespace drape::calib {

namespace fs = std::filesystem;

namespace {

/// Throws Error(bad_input) for a table that has a key twice.
void refuse_double_keys(const Value& value, const std::filesystem::path& file) {
  if (const auto* list = value.get_if<Value::List>())
    for (const Value& item : *list) refuse_double_keys(item, file);
  std::set<std::string_view> keys;
  if (const auto* table = value.get_if<Value::Table>())
    for (const auto& [key, member] : *table) {
      if (!keys.insert(key).second)
        throw bad_input(fmt::format("the key `{}` is given twice", printable(key)),
                        {.file = file.string(), .line = member.line}, "keep the right one");
      refuse_double_keys(member, file);
    }
}

/// Reads the record in a file's values; refuses a key that its description does not name.
template <class Record>
Record foreign_record(const std::filesystem::path& file, Value values) {
  refuse_double_keys(values, file);
  Record record{};
  std::vector<Error> faults =
      faults_of_reading(Document(Syntax::toml, std::move(values)), walk_through(record));
  for (Error& fault : faults) {
    Where where = fault.where();
    where.file = file.string();
    fault = Error(fault.kind(), fault.what_failed(), where, fault.what_to_do());
  }
  throw_if_any(std::move(faults));
  return record;
}

constexpr const char* kYamlRemedy = "give a file of cv::FileStorage, ROS or Kalibr";
constexpr int kDeepestLiteral = 50;

[[noreturn]] void refuse_file(const fs::path& file, const std::string& what,
                              const std::string& remedy, std::optional<int> line = {}) {
  throw bad_input(what, {.file = file.string(), .line = line}, remedy);
}

/// Reads a text character by character, with the line of the next one.
class Cursor {
 public:
  Cursor(const fs::path& file, std::string text, int line = 1)
      : file_(file), text_(std::move(text)), line_(line) {}

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
  int line_;
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

/// Parses a decimal number, nan or inf, without underscores; null for anything else.
Value number_value(std::string word) {
  std::erase(word, '_');
  if (word.starts_with("+")) word.erase(0, 1);
  double number = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (error == std::errc::result_out_of_range) return HUGE_VAL;
  if (error != std::errc() || end != word.data() + word.size()) return {};
  if (word.find_first_not_of("-0123456789") == std::string::npos && std::abs(number) < 1e15)
    return static_cast<std::int64_t>(number);
  return number;
}

/// Parses a text of YAML without quotes.
Value plain_value(const std::string& text) {
  if (text == "true" || text == "false") return text == "true";
  if (text == "null" || text == "~") return {};
  Value number = number_value(text);
  return number.is_null() ? Value(text) : number;
}

/// Reads a literal of Python, or one in brackets of YAML, where texts need no quotes.
class LiteralReader {
 public:
  LiteralReader(Cursor cursor, bool is_yaml) : in_(std::move(cursor)), is_yaml_(is_yaml) {}

  Value whole() {
    Value value = read(0);
    skip();
    if (!in_.at_end()) fail("something follows the literal");
    return value;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    if (is_yaml_) in_.fail("not YAML: " + what, kYamlRemedy);
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
    } else if (!is_yaml_ && in_.take('(')) {
      value = items(')', depth);
    } else if (at_text()) {
      std::string text;
      for (; at_text(); skip()) {  // adjacent texts are joined
        in_.while_true([](char c) { return c != '\'' && c != '"'; });
        text += quoted();
      }
      value = text;
    } else if (is_yaml_) {
      std::string word = in_.while_true(
          [](char c) { return std::string_view("[]{},:\n").find(c) == std::string_view::npos; });
      word.erase(word.find_last_not_of(" \t") + 1);
      if (word.empty()) fail("a value is missing");
      value = plain_value(word);
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
  bool is_yaml_;
};

/// Reads YAML as PyYAML and OpenCV write it: mappings and lists by indentation or in brackets, each
/// text on one line; tags and anchors have no meaning here.
class YamlReader {
 public:
  YamlReader(const fs::path& file, const std::string& text) : file_(file) {
    std::istringstream in(text);
    int number = 0;
    for (std::string line; std::getline(in, line);) {
      ++number;
      line.erase(comment_of(line));
      line.erase(line.find_last_not_of(" \t\r") + 1);
      const std::size_t indent = line.find_first_not_of(' ');
      if (line.empty() || line.starts_with("%") || line == "---" || line == "...") continue;
      lines_.push_back({indent, line.substr(indent), number});
    }
  }

  Value whole() {
    Value value = lines_.empty() ? Value() : block(lines_.front().indent, 0);
    if (at_ < lines_.size()) fail("its indentation fits no line before");
    return value;
  }

 private:
  struct Line {
    std::size_t indent;
    std::string text;
    int number;
  };

  static std::size_t comment_of(const std::string& line) {
    char quote = 0;
    for (std::size_t i = 0; i < line.size(); ++i) {
      const char c = line[i];
      if (quote != 0)
        quote = c == quote ? '\0' : quote;
      else if (c == '"' || c == '\'')
        quote = c;
      else if (c == '#' && (i == 0 || is_space(line[i - 1])))
        return i;
    }
    return line.size();
  }
  [[noreturn]] void fail(const std::string& what) const {
    const int line = lines_.empty() ? 1 : lines_[std::min(at_, lines_.size() - 1)].number;
    refuse_file(file_, "not YAML: " + what, kYamlRemedy, line);
  }
  static bool is_item(const std::string& text) { return text == "-" || text.starts_with("- "); }

  static std::string without_tag(std::string text) {
    const auto trim = [&](std::size_t from) {
      text.erase(0, std::min(text.find_first_not_of(" \t", from), text.size()));
    };
    trim(0);
    if (text.starts_with("!") || text.starts_with("&"))
      trim(std::min(text.find_first_of(" \t"), text.size()));
    return text;
  }

  /// Position behind the colon of a key; npos if the line has none.
  static std::size_t end_of_key(const std::string& text) {
    const bool is_quoted = text.front() == '"' || text.front() == '\'';
    std::size_t from = is_quoted ? text.find(text.front(), 1) : 0;
    if (is_quoted && from != std::string::npos) from = text.find(':', from);
    if (!is_quoted)
      from = text.ends_with(":") ? std::min(text.find(": "), text.size() - 1) : text.find(": ");
    return from == std::string::npos ? from : from + 1;
  }

  /// The list, mapping or value whose lines begin at this indentation.
  Value block(std::size_t indent, int depth) {
    if (depth > kDeepestLiteral) fail("nested too deeply");
    const int number = lines_[at_].number;
    Value value;
    if (is_item(lines_[at_].text)) {
      Value::List list;
      while (at_ < lines_.size() && lines_[at_].indent == indent && is_item(lines_[at_].text)) {
        Line& line = lines_[at_];
        const std::string item = without_tag(line.text.substr(1));
        if (item.empty()) {
          list.push_back(below(indent + 1, depth));
          continue;
        }
        line.indent += line.text.size() - item.size();  // a block of its own begins there
        line.text = item;
        list.push_back(block(line.indent, depth + 1));
      }
      value = std::move(list);
    } else if (std::string("[{").find(lines_[at_].text.front()) != std::string::npos ||
               end_of_key(lines_[at_].text) == std::string::npos) {
      value = inline_value(lines_[at_].text);
    } else {
      Value::Table table;
      while (at_ < lines_.size() && lines_[at_].indent == indent && !is_item(lines_[at_].text)) {
        const std::size_t end = end_of_key(lines_[at_].text);
        if (end == std::string::npos) fail("a colon behind a key is missing");
        std::string rest = lines_[at_].text.substr(end), key = lines_[at_].text.substr(0, end - 1);
        if (key.starts_with('"') || key.starts_with('\''))
          key = key.substr(1, key.rfind(key[0]) - 1);
        rest = without_tag(rest);
        const int of_key = lines_[at_].number;
        const bool is_inline = !rest.empty();
        table.emplace_back(key, is_inline ? inline_value(rest) : below(indent, depth));
        table.back().second.line = of_key;
      }
      value = std::move(table);
    }
    value.line = number;
    return value;
  }
  /// The block below a key or a dash; null if there is none.
  Value below(std::size_t indent, int depth) {
    ++at_;
    if (at_ == lines_.size() || lines_[at_].indent < indent) return {};
    if (lines_[at_].indent == indent && !is_item(lines_[at_].text)) return {};
    return block(lines_[at_].indent, depth + 1);
  }

  /// A value that begins on this line; one in brackets may end on a later one.
  Value inline_value(std::string text) {
    const int first = lines_[at_++].number;
    if (text.front() == '"' || text.front() == '\'') {
      if (text.size() < 2 || text.find(text.front(), 1) != text.size() - 1)
        fail("a text does not end");
      return text.substr(1, text.size() - 2);
    }
    if (text.front() != '[' && text.front() != '{') return plain_value(text);
    std::ptrdiff_t open = 0;
    const auto count = [&](const std::string& part) {
      for (const char c : part) open += (c == '[' || c == '{') - (c == ']' || c == '}');
    };
    count(text);
    for (int line = first; at_ < lines_.size() && open > 0; ++at_) {
      count(lines_[at_].text);
      text += std::string(static_cast<std::size_t>(lines_[at_].number - line), '\n');
      text += lines_[at_].text;
      line = lines_[at_].number;
    }
    return LiteralReader(Cursor(file_, text, first), true).whole();
  }

  fs::path file_;
  std::vector<Line> lines_;
  std::size_t at_ = 0;
};

/// Refuses a text beside elements: one whose first bracket was lost is no element any longer.
void refuse_stray_text(const pugi::xml_node& node, const fs::path& file) {
  for (const pugi::xml_node& child : node.children())
    if (child.type() == pugi::node_pcdata)
      refuse_file(file, fmt::format("`{}` stands outside any element", printable(child.value())),
                  "write the file again");
}

/// An element of cv::FileStorage's XML: a table of its children, or its words.
Value element_value(const pugi::xml_node& node, const fs::path& file, int depth = 0) {
  if (depth > kDeepestLiteral) refuse_file(file, "nested too deeply", "give the right file");
  Value::Table table;
  for (const pugi::xml_node& child : node.children())
    if (child.type() == pugi::node_element)
      table.emplace_back(child.name(), element_value(child, file, depth + 1));
  Value::List words;
  if (!table.empty()) {
    refuse_stray_text(node, file);
    if (table.front().first != "_") return table;
    for (auto& [name, item] : table) words.push_back(std::move(item));
    return words;
  }
  std::istringstream in(node.child_value());
  for (std::string word; in >> word;) {
    Value number = number_value(word);
    words.push_back(number.is_null() ? Value(word) : std::move(number));
  }
  if (std::string_view(node.name()) == "data" || words.size() > 1) return words;
  return words.empty() ? Value() : words.front();
}

Value parameter_value(const pugi::xml_node& node, const fs::path& file) {
  const std::string type = node.attribute("type").value(), text = node.attribute("value").value();
  if (type == "string") return text;
  if (type == "bool" && (text == "true" || text == "false")) return text == "true";
  if (Value number = number_value(text); type != "bool" && !number.is_null()) return number;
  refuse_file(file, fmt::format("`{}` is `{}`, no {}", node.attribute("name").value(), text, type),
              "write the calibration again with DICe");
}

Value list_value(const pugi::xml_node& node, const fs::path& file, int depth = 0) {
  if (depth > kDeepestLiteral) refuse_file(file, "nested too deeply", "give the right file");
  refuse_stray_text(node, file);
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
      if (name.empty() || std::ranges::count(name, '.') > kDeepestLiteral || !in_.take('=')) fail();
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
  void blanks() {
    in_.while_true([](char c) { return c == ' ' || c == '\t' || c == '\r'; });
  }
  /// Reads a matrix as a list of rows; a single row or column becomes a list.
  Value matrix() {
    Value::List rows;
    Value::List row;
    const auto end_row = [&] {
      if (!row.empty()) rows.emplace_back(std::exchange(row, {}));
    };
    for (;;) {
      blanks();
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
        blanks();
        if (!in_.take(',')) continue;
        blanks();
        if (std::string_view(",;]\n").find(in_.peek()) != std::string_view::npos) fail();
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

/// Reads YAML, XML or JSON of cv::FileStorage, and YAML of ROS and Kalibr. OpenCV's own parser
/// wraps large numbers, takes the first of two keys, and dies of deep nesting.
Value storage_value(const fs::path& file) {
  const std::string text = read_text(file);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first != std::string::npos && text[first] == '{') return json_value(text, file.string());
  if (first == std::string::npos || text[first] != '<') return YamlReader(file, text).whole();
  pugi::xml_document document;
  const bool is_read = static_cast<bool>(document.load_string(text.c_str()));
  if (!is_read || !document.child("opencv_storage"))
    refuse_file(file, "it is no XML of cv::FileStorage", "give a file of cv::FileStorage or YAML");
  return element_value(document.child("opencv_storage"), file);
}

/// Reads a Python literal: dictionary, list or tuple of numbers, texts, True, False and None.
Value python_value(const fs::path& file) {
  return LiteralReader(Cursor(file, read_text(file)), false).whole();
}

/// Reads XML of Trilinos' ParameterList: a list becomes a table, a parameter has its stated type.
Value parameter_list_value(const fs::path& file) {
  pugi::xml_document document;
  const std::string text = read_text(file);
  const pugi::xml_parse_result result = document.load_string(text.c_str());
  const pugi::xml_node root = document.child("ParameterList");
  if (!result || !root)
    refuse_file(file, "the file is no ParameterList", "give the calibration that DICe wrote");
  return list_value(root, file);
}

/// Reads MATLAB's JSON (jsonencode of toStruct), or statements `name.field = [1 2; 3 4];`. Matrices
/// become lists of rows.
Value matlab_value(const fs::path& file) {
  const std::string text = read_text(file);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first != std::string::npos && text[first] == '{') return json_value(text, file.string());
  return MatlabReader(Cursor(file, text)).whole();
}

constexpr std::string_view kCalibrateAgain =
    "calibrate with a pinhole lens of Brown's terms, at full resolution";

[[nodiscard]] Error refused(const fs::path& file, const std::string& field, const std::string& what,
                            const std::string& what_to_do) {
  return bad_input(what, {.file = file.string(), .field = field}, what_to_do);
}

/// Accepts keys without effect here, separated by spaces.
void inert(Fields& f, std::string_view names) {
  for (const auto name : std::views::split(names, ' ')) {
    std::optional<Value> ignored;
    f.if_any({std::string_view(name.begin(), name.end()), "not used"}, ignored);
  }
}

/// Requires numbers to be 0 that would otherwise change the lens or the picture.
void zero(Fields& f, std::initializer_list<std::string_view> names) {
  for (const std::string_view name : names) {
    std::optional<double> number;
    f.if_any({.name = name, .remedy = kCalibrateAgain}, number);
    f.limit(!number || *number == 0, name,
            fmt::format("`{}` makes another lens of the numbers", name), kCalibrateAgain);
  }
}

// cv::FileStorage and ROS

/// OpenCV's typed matrix, or the plain map of ROS.
struct StorageMatrix {
  std::optional<int> rows, cols;
  std::optional<std::string> element, type;
  std::vector<double> data;  ///< row by row

  [[nodiscard]] Eigen::Matrix3d square() const {
    return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data.data());
  }
  [[nodiscard]] Eigen::Vector3d vector() const { return {data[0], data[1], data[2]}; }
};

void fields(Fields& f, StorageMatrix& matrix) {
  f.if_any({"rows", "rows", 1, 0, 1000}, matrix.rows);
  f.if_any({"cols", "columns", 1, 0, 1000}, matrix.cols);
  f.if_any({"dt", "type of an element"}, matrix.element);
  f.if_any({"type_id", "type of the element"}, matrix.type);
  f({"data", "elements, row by row"}, matrix.data);
  f.rule(!matrix.element || matrix.element->size() == 1, "dt", "its elements are no single numbers",
         "write a matrix of doubles");
  f.rule(matrix.type.value_or("opencv-matrix") == "opencv-matrix", "type_id", "it is no matrix",
         "write a matrix of doubles");
  f.rule(matrix.rows.has_value() == matrix.cols.has_value(), "rows",
         "rows and columns are never one without the other", "export the camera again");
  f.rule(!matrix.rows || !matrix.cols ||
             static_cast<std::size_t>(*matrix.rows) * *matrix.cols == matrix.data.size(),
         "data", "rows times columns is another number of elements", "export the camera again");
}

struct Region {
  int x_px = 0, y_px = 0;
};

void fields(Fields& f, Region& region) {
  f.otherwise({"x_offset", "first column"}, region.x_px);
  f.otherwise({"y_offset", "first row"}, region.y_px);
  inert(f, "width height do_rectify");
  f.rule(region.x_px == 0 && region.y_px == 0, "x_offset", "the pictures are cut out",
         kCalibrateAgain);
}

struct StorageFile {
  std::optional<StorageLens> lens, camera;
  int width_px = 0, height_px = 0;
  StorageMatrix k;
  std::optional<StorageMatrix> distortion, rotation, vector, translation_m, tvec;
  std::optional<int> binning_x, binning_y;
  std::optional<Region> region;
};

void fields(Fields& f, StorageFile& file) {
  // The lens is read first, since it can cause the other errors.
  f.if_any({.name = "distortion_model", .remedy = kCalibrateAgain}, file.lens);
  f.if_any({.name = "camera_model", .remedy = kCalibrateAgain}, file.camera);
  zero(f, {"fisheye_model", "skew", "xi"});
  f({.name = "image_width", .least = 1, .remedy = "add image_width (px)"}, file.width_px);
  f({.name = "image_height", .least = 1, .remedy = "add image_height (px)"}, file.height_px);
  f({.name = "camera_matrix", .remedy = "give the file that OpenCV's calibration wrote"}, file.k);
  f.if_any({"distortion_coefficients", "k1 k2 p1 p2 k3"}, file.distortion);
  f.if_any({"cam_from_world_rotation", "rows of the matrix"}, file.rotation);
  f.if_any({"rvec", "rotation vector, rad"}, file.vector);
  f.if_any({"cam_from_world_translation_m", "m"}, file.translation_m);
  f.if_any({"tvec", "m"}, file.tvec);
  f.if_any({"binning_x", "pixels joined along a row", 1, 0}, file.binning_x);
  f.if_any({"binning_y", "pixels joined along a column", 1, 0}, file.binning_y);
  f.if_any({"roi", "part of the picture"}, file.region);
  f.rule(file.binning_x.value_or(0) < 2 && file.binning_y.value_or(0) < 2, "binning_x",
         "the pictures are binned", kCalibrateAgain);
  inert(f,
        "camera_name header rectification_matrix projection_matrix R P calibration_time "
        "calibration_Time nframes nr_of_frames nrOfFrames board_width board_height "
        "board_Width board_Height square_size square_Size marker_size aspectRatio "
        "fix_aspect_ratio flags avg_reprojection_error Avg_Reprojection_Error "
        "per_view_reprojection_errors Per_View_Reprojection_Errors extrinsic_parameters "
        "Extrinsic_Parameters image_points Image_points grid_points newobj_points");
}

/// Unifies names that differ between tools; a list of numbers becomes a matrix.
Value with_plain_names(Value value) {
  static const std::map<std::string, std::string> kNames = {
      {"Camera_Matrix", "camera_matrix"},
      {"cameraMatrix", "camera_matrix"},
      {"K", "camera_matrix"},
      {"Distortion_Coefficients", "distortion_coefficients"},
      {"distCoeffs", "distortion_coefficients"},
      {"D", "distortion_coefficients"},
      {"image_Width", "image_width"},
      {"width", "image_width"},
      {"image_Height", "image_height"},
      {"height", "image_height"}};
  auto* table = value.get_if<Value::Table>();
  for (std::size_t i = 0; table != nullptr && i < table->size(); ++i) {
    auto& [key, member] = (*table)[i];
    if (const auto found = kNames.find(key); found != kNames.end()) key = found->second;
    const auto* list = member.get_if<Value::List>();
    if (list == nullptr || key == "R" || key == "P") continue;
    Value::List flat;
    for (const Value& item : *list) {
      const auto* row = item.get_if<Value::List>();
      row == nullptr ? flat.push_back(item)
                     : void(flat.insert(flat.end(), row->begin(), row->end()));
    }
    member = Value::Table{{"data", std::move(flat)}};
  }
  return value;
}

/// Rotation nearest to a matrix with rounded elements. Throws Error(bad_input) naming the field for
/// any other matrix.
Eigen::Matrix3d rotation_of(const Eigen::Matrix3d& matrix, const fs::path& file,
                            const std::string& field) {
  constexpr double kRounded = 1e-4;  // tolerance for elements with five digits
  const double fault = (matrix * matrix.transpose() - Eigen::Matrix3d::Identity()).norm();
  if (!(fault < kRounded) || matrix.determinant() < 0)
    throw refused(file, field, "the matrix is not a rotation", "export the camera again");
  return fault < 1e-12 ? matrix : nearest_rotation(matrix);
}

/// Rotation by a vector of at most one turn.
Eigen::Matrix3d rotation_by(const Eigen::Vector3d& vector_rad, const fs::path& file,
                            const std::string& field) {
  if (!(vector_rad.norm() <= 2 * EIGEN_PI))
    throw refused(file, field, "its rotation is more than a whole turn",
                  "give the rotation vector in radians");
  return rotation_about(vector_rad);
}

/// A lens of up to nine numbers: fx fy cx cy, then k1 k2 p1 p2 k3 in OpenCV's order.
BrownLens lens_of(std::vector<double> v) {
  v.resize(9, 0);
  return {v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8]};
}

/// Reads fx, fy, cx, cy from a camera matrix, whose other elements must be as expected.
BrownLens lens_of_matrix(const Eigen::Matrix3d& k, const fs::path& file, const std::string& field) {
  const double tolerance = 1e-9 * std::abs(k(0, 0));
  if (std::abs(k(2, 0)) > tolerance || std::abs(k(2, 1)) > tolerance)
    throw refused(file, field, "its last row is not (0, 0, 1)",
                  "is it MATLAB's transpose? write rows as columns");
  if (std::abs(k(2, 2) - 1) > 1e-9)
    throw refused(file, field, fmt::format("its last element is {:g}, not 1", k(2, 2)),
                  "give the matrix in px, as the calibration wrote it");
  if (std::abs(k(0, 1)) > tolerance || std::abs(k(1, 0)) > tolerance)
    throw refused(file, field, "the pixels are skewed", "calibrate without skew");
  return lens_of({k(0, 0), k(1, 1), k(0, 2), k(1, 2)});
}

/// Sets k1 k2 p1 p2 k3, given in OpenCV's order; further terms must be 0.
void set_terms(BrownLens& lens, std::vector<double> terms, const fs::path& file,
               const std::string& field) {
  constexpr std::size_t kCounts[] = {0, 4, 5, 8, 12, 14};
  if (std::find(std::begin(kCounts), std::end(kCounts), terms.size()) == std::end(kCounts))
    throw refused(file, field, fmt::format("{} numbers are no lens of OpenCV", terms.size()),
                  "give 4 or 5: k1 k2 p1 p2 k3");
  if (std::any_of(terms.begin() + std::min<std::ptrdiff_t>(5, std::ssize(terms)), terms.end(),
                  [](double term) { return term != 0; }))
    throw refused(file, field, "more than Brown's five terms are used",
                  "calibrate with k1 k2 p1 p2 k3 only");
  terms.resize(5, 0);
  lens.k1 = terms[0], lens.k2 = terms[1], lens.p1 = terms[2], lens.p2 = terms[3];
  lens.k3 = terms[4];
}

Camera camera_of_storage(const fs::path& file, double unit_m) {
  const auto read = foreign_record<StorageFile>(file, with_plain_names(storage_value(file)));
  if (read.k.data.size() != 9)
    throw refused(file, "camera_matrix", "the camera matrix is not 3 x 3",
                  "give the file that OpenCV's calibration wrote");
  Camera camera;
  BrownLens lens = lens_of_matrix(read.k.square(), file, "camera_matrix");
  if (read.distortion) set_terms(lens, read.distortion->data, file, "distortion_coefficients");
  camera.model.lens = lens;
  camera.model.width_px = read.width_px, camera.model.height_px = read.height_px;
  const auto& translation = read.translation_m ? read.translation_m : read.tvec;
  const bool twice = (read.rotation && read.vector) || (read.translation_m && read.tvec);
  if (twice || !translation || translation->data.size() != 3 || (!read.rotation && !read.vector) ||
      (read.rotation && read.rotation->data.size() != 9) ||
      (read.vector && read.vector->data.size() != 3))
    throw refused(file, "cam_from_world_rotation",
                  twice ? "the file has two poses" : "the file has no pose",
                  "give cam_from_world_rotation and cam_from_world_translation_m, or rvec and tvec "
                  "in metres");
  camera.cam_from_world.translation_m = unit_m * translation->vector();
  camera.cam_from_world.rotation =
      read.rotation ? read.rotation->square() : rotation_by(read.vector->vector(), file, "rvec");
  camera.name = file.stem().string();
  return camera;
}

// Kalibr

/// Pose of a camera relative to another one.
using FromOther = Pose<frame::Camera, frame::Camera>;

struct KalibrEntry {
  KalibrCamera camera{};
  KalibrLens lens{};
  std::vector<double> intrinsics, distortion;
  std::array<int, 2> resolution{};
  std::optional<Eigen::Matrix4d> from_previous;
  std::string topic;
};

void fields(Fields& f, KalibrEntry& entry) {
  f({.name = "camera_model", .remedy = kCalibrateAgain}, entry.camera);
  f({.name = "distortion_model", .remedy = kCalibrateAgain}, entry.lens);
  f({"intrinsics", "fx fy cx cy, px"}, entry.intrinsics);
  f({"distortion_coeffs", "k1 k2 p1 p2"}, entry.distortion);
  f({"resolution", "width and height, px", 1, 1}, entry.resolution);
  f.if_any({"T_cn_cnm1", "this camera from the one before, 4 x 4, m"}, entry.from_previous);
  f.otherwise({"rostopic", "topic of the pictures"}, entry.topic);
  zero(f, {"line_delay"});
  inert(f, "cam_overlaps timeshift_cam_imu T_cam_imu");
  f.rule(entry.intrinsics.size() == 4, "intrinsics", "not four numbers", "give fx, fy, cx, cy");
  f.rule(entry.lens == KalibrLens::none || entry.distortion.size() == 4, "distortion_coeffs",
         "not four numbers", "give k1, k2, p1, p2");
  f.rule(entry.lens != KalibrLens::none ||
             std::ranges::all_of(entry.distortion, [](double term) { return term == 0; }),
         "distortion_coeffs", "coefficients of no distortion model",
         "give the distortion_model to which they belong");
}

std::vector<Camera> cameras_of_kalibr(const fs::path& file, double unit_m) {
  const Value root = storage_value(file);
  const auto* table = root.get_if<Value::Table>();
  std::vector<std::pair<std::string, KalibrEntry>> entries;
  for (std::size_t i = 0; table != nullptr && i < table->size(); ++i) {
    const auto& [key, value] = (*table)[i];
    if (key != fmt::format("cam{}", i))
      throw refused(file, key, "the cameras are not cam0, cam1, ... in order",
                    "give the camchain that Kalibr wrote");
    entries.emplace_back(key, foreign_record<KalibrEntry>(file, value));
  }
  std::vector<Camera> cameras;
  for (const auto& [key, entry] : entries) {
    Camera camera;
    BrownLens lens = lens_of(entry.intrinsics);
    if (entry.lens == KalibrLens::radtan)
      set_terms(lens, entry.distortion, file, key + ".distortion_coeffs");
    camera.model = {lens, entry.resolution[0], entry.resolution[1]};
    if (entry.from_previous.has_value() == cameras.empty())
      throw refused(file, key + ".T_cn_cnm1",
                    cameras.empty() ? "the first camera has one before it" : "it is missing",
                    "give the camchain that Kalibr wrote");
    if (entry.from_previous) {
      const Eigen::Matrix4d& step = *entry.from_previous;
      if (step.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
        throw refused(file, key + ".T_cn_cnm1", "its last row is not (0, 0, 0, 1)",
                      "is it transposed? write rows as columns");
      camera.cam_from_world =
          FromOther{rotation_of(step.topLeftCorner<3, 3>(), file, key + ".T_cn_cnm1"),
                    step.topRightCorner<3, 1>()} *
          cameras.back().cam_from_world;
    }
    // "/left/image_raw" belongs to the camera `left`.
    const std::size_t end = entry.topic.rfind('/');
    const std::size_t begin =
        end == std::string::npos || end == 0 ? end : entry.topic.rfind('/', end - 1);
    camera.name = begin == std::string::npos || begin + 1 >= end
                      ? key
                      : entry.topic.substr(begin + 1, end - begin - 1);
    cameras.push_back(std::move(camera));
  }
  std::set<std::string> names;
  for (Camera& camera : cameras) {
    names.insert(camera.name);
    camera.cam_from_world.translation_m *= unit_m;
  }
  for (std::size_t i = 0; i < cameras.size() && names.size() < cameras.size(); ++i)
    cameras[i].name = entries[i].first;
  return cameras;
}

// mrcal

struct MrcalModel {
  MrcalLens lens{};
  std::vector<double> intrinsics;
  std::array<int, 2> size_px{};
  std::optional<std::vector<double>> extrinsics, rt_cam_ref;
};

void fields(Fields& f, MrcalModel& model) {
  constexpr std::string_view kAgain =
      "write the model again with mrcal, as LENSMODEL_PINHOLE, _OPENCV4 or _OPENCV5";
  f({.name = "lensmodel", .remedy = kAgain}, model.lens);
  f({.name = "intrinsics", .remedy = kAgain}, model.intrinsics);
  f({.name = "imagersize", .least = 1, .remedy = kAgain}, model.size_px);
  f.if_any({.name = "extrinsics", .remedy = kAgain}, model.extrinsics);
  f.if_any({.name = "rt_cam_ref", .remedy = kAgain}, model.rt_cam_ref);
  inert(f,
        "valid_intrinsics_region optimization_inputs icam_intrinsics "
        "icam_intrinsics_optimization_inputs");
  const std::size_t wanted = model.lens == MrcalLens::pinhole   ? 4
                             : model.lens == MrcalLens::opencv4 ? 8
                                                                : 9;
  f.rule(model.intrinsics.size() == wanted, "intrinsics",
         fmt::format("{} numbers where {} belong", model.intrinsics.size(), wanted), kAgain);
  f.rule(model.extrinsics.has_value() != model.rt_cam_ref.has_value(), "rt_cam_ref",
         model.extrinsics ? "two poses" : "the model has no pose", kAgain);
  for (const auto& pose : {model.extrinsics, model.rt_cam_ref})
    f.rule(!pose || pose->size() == 6, "rt_cam_ref", "a pose is not six numbers", kAgain);
}

Camera camera_of_mrcal(const fs::path& file, double unit_m) {
  const auto model = foreign_record<MrcalModel>(file, python_value(file));
  Camera camera;
  camera.model = {lens_of(model.intrinsics), model.size_px[0], model.size_px[1]};
  const std::vector<double>& pose = model.rt_cam_ref ? *model.rt_cam_ref : *model.extrinsics;
  camera.cam_from_world.rotation = rotation_by({pose[0], pose[1], pose[2]}, file, "rt_cam_ref");
  camera.cam_from_world.translation_m = unit_m * Eigen::Vector3d(pose[3], pose[4], pose[5]);
  camera.name = file.stem().string();
  return camera;
}

// DICe

struct DiceRotation {
  std::array<std::string, 3> rows;
};

void fields(Fields& f, DiceRotation& rotation) {
  f({"ROW 0", "first row"}, rotation.rows[0]);
  f({"ROW 1", "second row"}, rotation.rows[1]);
  f({"ROW 2", "third row"}, rotation.rows[2]);
}

struct DiceCamera {
  std::string id, size;
  DiceLens lens{};
  BrownLens terms;
  double alpha_deg = 0, beta_deg = 0, gamma_deg = 0;
  Eigen::Vector3d translation{0, 0, 0};
  std::optional<DiceRotation> rotation;
};

void fields(Fields& f, DiceCamera& camera) {
  f.otherwise({.name = "LENS_DISTORTION_MODEL", .remedy = kCalibrateAgain}, camera.lens);
  f.otherwise({"CAMERA_ID", "name"}, camera.id);
  f({"IMAGE_HEIGHT_WIDTH", "{ height, width }, px"}, camera.size);
  BrownLens& lens = camera.terms;
  f({"FX", "px"}, lens.fx_px);
  f({"FY", "px"}, lens.fy_px);
  f({"CX", "px"}, lens.cx_px);
  f({"CY", "px"}, lens.cy_px);
  for (const auto& [name, term] : {std::pair{"K1", &lens.k1},
                                   {"K2", &lens.k2},
                                   {"K3", &lens.k3},
                                   {"P1", &lens.p1},
                                   {"P2", &lens.p2}})
    f.otherwise({name, "term of the lens"}, *term);
  zero(f, {"FS", "K4", "K5", "K6", "S1", "S2", "S3", "S4", "T1", "T2"});
  f.otherwise({"ALPHA", "degrees about x", 1, -360, 360}, camera.alpha_deg);
  f.otherwise({"BETA", "degrees about y", 1, -360, 360}, camera.beta_deg);
  f.otherwise({"GAMMA", "degrees about z", 1, -360, 360}, camera.gamma_deg);
  f.otherwise({"TX", "of the target's unit"}, camera.translation.x());
  f.otherwise({"TY", "of the target's unit"}, camera.translation.y());
  f.otherwise({"TZ", "of the target's unit"}, camera.translation.z());
  f.if_any({"rotation_3x3_matrix", "rows of the matrix"}, camera.rotation);
  inert(f, "PIXEL_DEPTH LENS COMMENTS");
  f.rule(
      !camera.rotation || (camera.alpha_deg == 0 && camera.beta_deg == 0 && camera.gamma_deg == 0),
      "ALPHA", "angles and a matrix", "keep one of them");
}

struct DiceSystem {
  std::string format, type;
  bool relative = false;
  std::map<std::string, DiceCamera> cameras;
};

/// Reads numbers in braces: "{ 1200, 1920 }".
std::vector<double> braced(const std::string& text, std::size_t count, const fs::path& file,
                           const std::string& field) {
  std::string plain = text;
  std::replace_if(
      plain.begin(), plain.end(), [](char c) { return c == '{' || c == '}' || c == ','; }, ' ');
  std::istringstream in(plain);
  std::vector<double> numbers{std::istream_iterator<double>(in), {}};
  if (!text.starts_with('{') || !text.ends_with('}') || !in.eof() || numbers.size() != count ||
      !std::all_of(numbers.begin(), numbers.end(), [](double v) { return std::isfinite(v); }))
    throw refused(file, field, fmt::format("`{}` is not {} numbers", printable(text), count),
                  "write the calibration again with DICe");
  return numbers;
}

void fields(Fields& f, DiceSystem& system) {
  f({"xml_file_format", "DICe_xml_camera_system_file"}, system.format);
  f({"system_type_3D", "tool that calibrated"}, system.type);
  f.otherwise({"extrinsics_relative_camera_to_camera", "poses from camera 0"}, system.relative);
  inert(f, "avg_epipolar_error avg_reprojection_error checker_board_type");
  for (int i = 0; i < 10; ++i) {
    std::optional<DiceCamera> camera;
    const std::string name = fmt::format("CAMERA {}", i);
    f.if_any({name, "camera"}, camera);
    if (camera) system.cameras.emplace(name, *camera);
  }
  f.rule(system.format == "DICe_xml_camera_system_file", "xml_file_format",
         "this is no camera system", "give the calibration that DICe wrote");
  f.rule(!system.cameras.empty(), "CAMERA 0", "there is no camera",
         "give the calibration that DICe wrote");
}

std::vector<Camera> cameras_of_dice(const fs::path& file, double unit_m) {
  const auto system = foreign_record<DiceSystem>(file, parameter_list_value(file));
  std::vector<Camera> cameras;
  for (const auto& [key, read] : system.cameras) {
    const BrownLens& lens = read.terms;
    const bool is_bent =
        lens.k1 != 0 || lens.k2 != 0 || lens.k3 != 0 || lens.p1 != 0 || lens.p2 != 0;
    if (read.lens == DiceLens::none && is_bent)
      throw refused(file, key + ".LENS_DISTORTION_MODEL", "no lens is named for its terms",
                    "add LENS_DISTORTION_MODEL");
    Camera camera;
    const auto size = braced(read.size, 2, file, key + ".IMAGE_HEIGHT_WIDTH");
    if (!std::ranges::all_of(size,
                             [](double v) { return v >= 1 && v < 65536 && v == std::floor(v); }))
      throw refused(file, key + ".IMAGE_HEIGHT_WIDTH", "these are no numbers of pixels",
                    "write the calibration again with DICe");
    camera.model = {lens, static_cast<int>(size[1]), static_cast<int>(size[0])};
    using Eigen::AngleAxisd, Eigen::Vector3d, units::deg;
    Eigen::Matrix3d rotation = (AngleAxisd(read.gamma_deg * deg, Vector3d::UnitZ()) *
                                AngleAxisd(read.beta_deg * deg, Vector3d::UnitY()) *
                                AngleAxisd(read.alpha_deg * deg, Vector3d::UnitX()))
                                   .toRotationMatrix();
    for (int row = 0; read.rotation && row < 3; ++row) {
      const auto numbers = braced(read.rotation->rows[row], 3, file, key + ".rotation_3x3_matrix");
      rotation.row(row) << numbers[0], numbers[1], numbers[2];
    }
    camera.cam_from_world.rotation = rotation_of(rotation, file, key + ".rotation_3x3_matrix");
    camera.cam_from_world.translation_m = unit_m * read.translation;
    if (system.relative && !cameras.empty())
      camera.cam_from_world =
          FromOther{camera.cam_from_world.rotation, camera.cam_from_world.translation_m} *
          cameras.front().cam_from_world;
    camera.name = read.id.empty() ? "cam" + key.substr(7) : read.id;
    cameras.push_back(std::move(camera));
  }
  return cameras;
}

// MATLAB

struct MatlabCamera {
  std::optional<Eigen::Matrix3d> transposed, k;
  std::vector<double> radial, tangential;
  std::array<int, 2> size_px{};
  std::optional<std::string> units;
};

void fields(Fields& f, MatlabCamera& camera) {
  f.if_any({"IntrinsicMatrix", "transpose of the camera matrix"}, camera.transposed);
  f.if_any({"K", "camera matrix"}, camera.k);
  f({"RadialDistortion", "k1 k2 k3"}, camera.radial);
  f({"TangentialDistortion", "p1 p2"}, camera.tangential);
  f({"ImageSize", "height and width, px", 1, 1}, camera.size_px);
  f.if_any({"WorldUnits", "unit of lengths"}, camera.units);
  zero(f, {"Skew"});
  inert(f,
        "WorldPoints TranslationVectors RotationVectors ReprojectionErrors ReprojectedPoints "
        "DetectedKeypoints EstimateSkew EstimateTangentialDistortion "
        "NumRadialDistortionCoefficients NumPatterns MeanReprojectionError Version "
        "FocalLength PrincipalPoint RotationMatrices PatternExtrinsics");
  f.rule(camera.transposed.has_value() != camera.k.has_value(), "IntrinsicMatrix",
         camera.k ? "two camera matrices" : "the camera matrix is missing", "give one of both");
  f.rule(camera.radial.size() == 2 || camera.radial.size() == 3, "RadialDistortion",
         "not two or three numbers", "give k1, k2 and k3");
  f.rule(camera.tangential.size() == 2, "TangentialDistortion", "not two numbers", "give p1, p2");
}

struct MatlabStereo {
  MatlabCamera first, second;
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
};

void fields(Fields& f, MatlabStereo& stereo) {
  f({"CameraParameters1", "first camera"}, stereo.first);
  f({"CameraParameters2", "second camera"}, stereo.second);
  f({"RotationOfCamera2", "transpose of camera 2 from camera 1"}, stereo.rotation);
  f({"TranslationOfCamera2", "camera 1's centre in camera 2"}, stereo.translation);
  inert(f,
        "FundamentalMatrix EssentialMatrix MeanReprojectionError NumPatterns WorldPoints "
        "WorldUnits Version RectificationParams");
}

std::optional<double> unit_named(const std::optional<std::string>& name) {
  static const std::map<std::string, double> kUnits = {
      {"millimeters", 1e-3}, {"mm", 1e-3}, {"centimeters", 1e-2}, {"cm", 1e-2},
      {"meters", 1},         {"m", 1},     {"inches", 0.0254},    {"in", 0.0254}};
  const auto found = name ? kUnits.find(*name) : kUnits.end();
  return found == kUnits.end() ? std::nullopt : std::optional(found->second);
}

std::vector<Camera> cameras_of_matlab(const fs::path& file, std::optional<double> unit_m) {
  Value root = matlab_value(file);
  // The values can be nested in a variable's name or in the member of an object.
  while (root.get_if<Value::Table>() != nullptr && root.get_if<Value::Table>()->size() == 1) {
    const Value inner = root.get_if<Value::Table>()->front().second;
    root = inner;
  }
  const auto stereo = foreign_record<MatlabStereo>(file, std::move(root));
  const auto named = unit_named(stereo.first.units);
  if (!unit_m) unit_m = named;
  if (!unit_m || unit_named(stereo.second.units) != named)
    throw refused(file, "CameraParameters1.WorldUnits", "the unit of its lengths is not named",
                  "give it with --unit-mm");
  std::vector<Camera> cameras(2);
  for (int i = 0; i < 2; ++i) {
    const MatlabCamera& read = i == 0 ? stereo.first : stereo.second;
    Camera& camera = cameras[i];
    BrownLens lens =
        lens_of_matrix(read.k ? *read.k : Eigen::Matrix3d(read.transposed->transpose()), file,
                       fmt::format("CameraParameters{}.IntrinsicMatrix", i + 1));
    lens.cx_px -= 1, lens.cy_px -= 1;  // the corner pixel's centre is (1, 1)
    lens.k1 = read.radial[0], lens.k2 = read.radial[1];
    lens.k3 = read.radial.size() > 2 ? read.radial[2] : 0;
    lens.p1 = read.tangential[0], lens.p2 = read.tangential[1];
    camera.model = {lens, read.size_px[1], read.size_px[0]};
    camera.name = fmt::format("camera{}", i + 1);
  }
  cameras[1].cam_from_world = {rotation_of(stereo.rotation.transpose(), file, "RotationOfCamera2"),
                               *unit_m * stereo.translation};
  return cameras;
}

// COLMAP

constexpr std::string_view kExportAgain = "export the model as text again";

/// A line of a COLMAP text, in words.
struct Words {
  std::vector<std::string> words;
  Where where;

  [[nodiscard]] double number(std::size_t at) const {
    const Value value = at < words.size() ? number_value(words[at]) : Value();
    if (!value.is_number() || !std::isfinite(value.number()))
      throw bad_input(
          fmt::format("`{}` is no number", at < words.size() ? printable(words[at]) : ""), where,
          std::string(kExportAgain));
    return value.number();
  }
  [[nodiscard]] int whole(std::size_t at) const {
    const double value = number(at);
    if (!(value >= 0 && value < 1 << 30 && value == std::floor(value)))
      throw bad_input(fmt::format("`{}` is no whole number", words[at]), where,
                      std::string(kExportAgain));
    return static_cast<int>(value);
  }
};

/// Lines of a COLMAP text except comments.
std::vector<Words> lines_of_text(const fs::path& file) {
  std::istringstream in(read_text(file));
  std::vector<Words> lines;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    if (line.starts_with('#')) continue;
    std::istringstream words(line);
    lines.push_back(
        {{std::istream_iterator<std::string>(words), {}}, {.file = file.string(), .line = number}});
  }
  return lines;
}

/// Number of COLMAP's parameters, and the positions of fx, fy, cx, cy, k1, k2, p1, p2, k3 among
/// them; -1 if absent.
struct ColmapLens {
  std::size_t parameters;
  std::array<int, 9> places;
};

const std::map<std::string, ColmapLens>& colmap_lenses() {
  static const std::map<std::string, ColmapLens> kLenses = {
      {"SIMPLE_PINHOLE", {3, {0, 0, 1, 2, -1, -1, -1, -1, -1}}},
      {"PINHOLE", {4, {0, 1, 2, 3, -1, -1, -1, -1, -1}}},
      {"SIMPLE_RADIAL", {4, {0, 0, 1, 2, 3, -1, -1, -1, -1}}},
      {"RADIAL", {5, {0, 0, 1, 2, 3, 4, -1, -1, -1}}},
      {"OPENCV", {8, {0, 1, 2, 3, 4, 5, 6, 7, -1}}},
      {"FULL_OPENCV", {12, {0, 1, 2, 3, 4, 5, 6, 7, 8}}}};
  return kLenses;
}

CameraModel colmap_model(const Words& line) {
  const std::string name = line.words.size() > 1 ? line.words[1] : "";
  const auto known = colmap_lenses().find(name);
  if (known == colmap_lenses().end())
    throw bad_input(fmt::format("the lens is `{}`, not Brown's", printable(name)), line.where,
                    std::string(kCalibrateAgain));
  const auto& [parameters, places] = known->second;
  CameraModel model;
  model.width_px = line.whole(2), model.height_px = line.whole(3);
  std::vector<double> p;
  for (std::size_t i = 4; i < line.words.size(); ++i) p.push_back(line.number(i));
  if (p.size() != parameters)
    throw bad_input(fmt::format("{} has {} numbers, not {}", name, parameters, p.size()),
                    line.where, std::string(kExportAgain));
  std::array<double, 9> v{};
  for (std::size_t i = 0; i < 9; ++i)
    if (const int at = places[i]; at >= 0) v[i] = p[static_cast<std::size_t>(at)];
  for (std::size_t i = 9; i < p.size(); ++i)
    if (p[i] != 0)
      throw bad_input("more than Brown's five terms are used", line.where,
                      "calibrate with the model OPENCV");
  constexpr double kHalfPixel = 0.5;  // COLMAP's corner pixel has its centre at (0.5, 0.5)
  model.lens =
      BrownLens{v[0], v[1], v[2] - kHalfPixel, v[3] - kHalfPixel, v[4], v[5], v[6], v[7], v[8]};
  return model;
}

std::vector<Camera> cameras_of_colmap(const fs::path& lenses, std::optional<double> unit_m) {
  if (!unit_m)
    throw usage_error("COLMAP's lengths have no unit",
                      "give --unit-mm, 1000 for a model that drapebench wrote");
  std::map<int, CameraModel> models;
  for (const Words& line : lines_of_text(lenses))
    if (!line.words.empty() && !models.emplace(line.whole(0), colmap_model(line)).second)
      throw bad_input("a camera twice", line.where, std::string(kExportAgain));
  std::vector<Camera> cameras;
  const auto lines = lines_of_text(lenses.parent_path() / "images.txt");
  std::set<int> images;
  for (std::size_t i = 0; i < lines.size(); i += 2) {  // each image's second line has its points
    const Words& line = lines[i];
    if (line.words.empty() && i + 1 == lines.size()) break;
    if (line.words.size() < 10)
      throw bad_input("not IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME", line.where,
                      std::string(kExportAgain));
    if (!images.insert(line.whole(0)).second)
      throw bad_input("an image twice", line.where, std::string(kExportAgain));
    const Eigen::Quaterniond q(line.number(1), line.number(2), line.number(3), line.number(4));
    if (!(std::abs(q.norm() - 1) < 1e-4))
      throw bad_input(fmt::format("the quaternion has the length {:g}, not 1", q.norm()),
                      line.where, std::string(kExportAgain));
    const auto model = models.find(line.whole(8));
    if (model == models.end())
      throw bad_input(fmt::format("camera {} is not in cameras.txt", line.words[8]), line.where,
                      std::string(kExportAgain));
    Camera camera;
    camera.model = model->second;
    camera.cam_from_world = {
        q.normalized().toRotationMatrix(),
        *unit_m * Eigen::Vector3d(line.number(5), line.number(6), line.number(7))};
    camera.name =
        fs::path(fmt::format("{}", fmt::join(line.words.begin() + 9, line.words.end(), " ")))
            .stem()
            .string();
    cameras.push_back(std::move(camera));
  }
  return cameras;
}

}  // namespace

std::vector<Camera> cameras_of(const fs::path& file, ExchangeFormat format,
                               const ImportOptions& options) {
  const auto read = [&]() -> std::vector<Camera> {
    const double metre = options.unit_m.value_or(1);
    switch (format) {
      case ExchangeFormat::opencv:
      case ExchangeFormat::ros:
        return {camera_of_storage(file, metre)};
      case ExchangeFormat::mrcal:
        return {camera_of_mrcal(file, metre)};
      case ExchangeFormat::kalibr:
        return cameras_of_kalibr(file, metre);
      case ExchangeFormat::dice:
        return cameras_of_dice(file, options.unit_m.value_or(units::mm));
      case ExchangeFormat::matlab:
        return cameras_of_matlab(file, options.unit_m);
      case ExchangeFormat::colmap:
        return cameras_of_colmap(file, options.unit_m);
    }
    throw internal_error("a format of no name");
  };
  std::vector<Camera> cameras = read();
  for (Camera& camera : cameras)
    camera.cam_from_world.rotation =
        rotation_of(camera.cam_from_world.rotation, file, "cam_from_world_rotation");
  return cameras;
}

}  // namespace drape::calib
