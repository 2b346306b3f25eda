// SPDX-License-Identifier: Apache-2.0
#include "core/files/json_file.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <limits>
#include <set>

#include "core/fields/document.hpp"
#include "core/files/files.hpp"

namespace drape {
namespace {

/// Levels of objects and arrays in a file; whatever walks through it then fits the stack.
constexpr int kDeepest = 100;
constexpr std::size_t kMostEvents = 16'000'000;  ///< keys, values, begins and ends

bool is_finite(const Json& value) {
  return value.is_number() && std::isfinite(value.get<double>());
}

bool is_plain_array(const Json& json) {
  if (!json.is_array()) return false;
  for (const Json& item : json) {
    if (item.is_structured() && !is_plain_array(item)) return false;
    if (item.is_string() && item.get_ref<const std::string&>().size() > 24) return false;
  }
  return true;
}

/// File names need not be UTF-8, JSON must be.
std::string one_line(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

void print(const Json& json, int indent, std::string& out) {
  const std::string pad(static_cast<std::size_t>(indent) + 1, ' ');
  if (json.is_object() && !json.empty()) {
    out += "{";
    bool first = true;
    for (const auto& [key, value] : json.items()) {
      out += first ? "\n" : ",\n";
      out += pad + one_line(key) + ": ";
      print(value, indent + 1, out);
      first = false;
    }
    out += "\n" + std::string(static_cast<std::size_t>(indent), ' ') + "}";
  } else if (json.is_array() && !json.empty() && !is_plain_array(json)) {
    out += "[";
    bool first = true;
    for (const Json& value : json) {
      out += first ? "\n" : ",\n";
      out += pad;
      print(value, indent + 1, out);
      first = false;
    }
    out += "\n" + std::string(static_cast<std::size_t>(indent), ' ') + "]";
  } else {
    out += one_line(json);
  }
}

}  // namespace

JsonNode::JsonNode(std::shared_ptr<const Json> root, const Json* value, std::string file,
                   std::string pointer)
    : root_(std::move(root)), value_(value), file_(std::move(file)), pointer_(std::move(pointer)) {}

JsonNode JsonNode::open(const std::filesystem::path& file, const std::string& name, int version) {
  std::shared_ptr<const Json> root;
  try {
    root = std::make_shared<const Json>(parse_json(read_text(file), file.string()));
  } catch (const Json::exception& error) {
    throw bad_input(fmt::format("not a JSON file: {}", error.what()), {.file = file.string()},
                    make_again);
  }
  JsonNode node(root, root.get(), file.string(), "");
  const std::string schema = node.text("schema");
  const std::string prefix = fmt::format("drapebench/{}/", name);
  int found = 0;
  const char* end = schema.data() + schema.size();
  if (schema.rfind(prefix, 0) != 0 ||
      std::from_chars(schema.data() + prefix.size(), end, found).ptr != end || found < 1) {
    throw bad_input(fmt::format("`{}` is not a {}<n> file", schema, prefix), node.where("schema"),
                    "give a file of that kind");
  }
  if (found > version) {
    throw bad_input(fmt::format("the schema `{}` is newer than this program, which reads {}{}",
                                schema, prefix, version),
                    {.file = file.string(), .field = "/schema"}, "use a newer drapebench");
  }
  return node;
}

void JsonNode::reject(const std::string& key, const std::string& what) const {
  throw bad_input(what, where(key), make_again);
}

Where JsonNode::where(const std::string& key) const {
  return {.file = file_, .field = pointer_ + "/" + key};
}

const Json& JsonNode::member(const std::string& key) const {
  if (!value_->is_object())
    throw bad_input("an object is expected here", {.file = file_, .field = pointer_}, make_again);
  const auto found = value_->find(key);
  if (found == value_->end()) reject(key, fmt::format("`{}` is missing", key));
  return *found;
}

bool JsonNode::has(const std::string& key) const {
  if (!value_->is_object()) return false;
  const auto found = value_->find(key);
  return found != value_->end() && !found->is_null();
}

JsonNode JsonNode::at(const std::string& key) const {
  return {root_, &member(key), file_, pointer_ + "/" + key};
}

std::vector<JsonNode> JsonNode::items(const std::string& key) const {
  const Json& array = member(key);
  if (!array.is_array()) reject(key, fmt::format("`{}` is not an array", key));
  std::vector<JsonNode> nodes;
  for (std::size_t i = 0; i < array.size(); ++i)
    nodes.push_back(JsonNode(root_, &array[i], file_, fmt::format("{}/{}/{}", pointer_, key, i)));
  return nodes;
}

std::vector<std::pair<std::string, JsonNode>> JsonNode::members() const {
  if (!value_->is_object())
    throw bad_input("an object is expected here", {.file = file_, .field = pointer_}, make_again);
  std::vector<std::pair<std::string, JsonNode>> result;
  for (const auto& [key, value] : value_->items())
    result.emplace_back(key, JsonNode(root_, &value, file_, pointer_ + "/" + key));
  return result;
}

double JsonNode::number(const std::string& key) const {
  const Json& value = member(key);
  if (!is_finite(value)) reject(key, fmt::format("`{}` is not a finite number", key));
  return value.get<double>();
}

std::optional<double> JsonNode::optional_number(const std::string& key) const {
  return has(key) ? std::optional(number(key)) : std::nullopt;
}

int JsonNode::integer(const std::string& key) const {
  const Json& value = member(key);
  constexpr auto most = std::numeric_limits<int>::max();
  const bool fits = value.is_number_unsigned()
                        ? value.get<std::uint64_t>() <= static_cast<std::uint64_t>(most)
                        : value.is_number_integer() && value.get<std::int64_t>() >= -most;
  if (!fits) reject(key, fmt::format("`{}` is not a whole number up to {}", key, most));
  return value.get<int>();
}

std::optional<int> JsonNode::optional_integer(const std::string& key) const {
  return has(key) ? std::optional(integer(key)) : std::nullopt;
}

bool JsonNode::boolean(const std::string& key) const {
  const Json& value = member(key);
  if (!value.is_boolean()) reject(key, fmt::format("`{}` is not true or false", key));
  return value.get<bool>();
}

std::string JsonNode::text(const std::string& key) const {
  const Json& value = member(key);
  if (!value.is_string()) reject(key, fmt::format("`{}` is not a text", key));
  return value.get<std::string>();
}

std::optional<std::string> JsonNode::optional_text(const std::string& key) const {
  return has(key) ? std::optional(text(key)) : std::nullopt;
}

std::string JsonNode::name(const std::string& key) const {
  std::string found = text(key);
  require_plain_name(found, where(key));
  return found;
}

std::vector<std::string> JsonNode::texts(const std::string& key) const {
  const Json& array = member(key);
  if (!array.is_array()) reject(key, fmt::format("`{}` is not an array of texts", key));
  std::vector<std::string> texts;
  for (const Json& item : array) {
    if (!item.is_string()) reject(key, fmt::format("`{}` is not an array of texts", key));
    texts.push_back(item.get<std::string>());
  }
  return texts;
}

Eigen::MatrixXd JsonNode::matrix(const std::string& key) const {
  const Json& value = member(key);
  if (!value.is_array()) reject(key, fmt::format("`{}` is not an array of rows", key));
  const Eigen::Index rows = static_cast<Eigen::Index>(value.size());
  const Eigen::Index columns =
      rows == 0 || !value[0].is_array() ? 0 : static_cast<Eigen::Index>(value[0].size());
  Eigen::MatrixXd result(rows, columns);
  for (Eigen::Index row = 0; row < rows; ++row) {
    const Json& cells = value[static_cast<std::size_t>(row)];
    if (!cells.is_array() || static_cast<Eigen::Index>(cells.size()) != columns)
      reject(key, fmt::format("`{}` is not an array of equal rows", key));
    for (Eigen::Index column = 0; column < columns; ++column) {
      const Json& cell = cells[static_cast<std::size_t>(column)];
      if (!is_finite(cell))
        reject(key, fmt::format("`{}` holds something that is not a finite number", key));
      result(row, column) = cell.get<double>();
    }
  }
  return result;
}

Eigen::VectorXd JsonNode::vector(const std::string& key, Eigen::Index size) const {
  const Json& value = member(key);
  if (!value.is_array() || static_cast<Eigen::Index>(value.size()) != size)
    reject(key, fmt::format("`{}` is not an array of {} numbers", key, size));
  Eigen::VectorXd result(size);
  for (Eigen::Index i = 0; i < size; ++i) {
    const Json& cell = value[static_cast<std::size_t>(i)];
    if (!is_finite(cell))
      reject(key, fmt::format("`{}` holds something that is not a finite number", key));
    result(i) = cell.get<double>();
  }
  return result;
}

namespace {
template <int n>
Eigen::Matrix<double, n, n> square(const JsonNode& node, const std::string& key) {
  const Eigen::MatrixXd found = node.matrix(key);
  if (found.rows() != n || found.cols() != n)
    node.reject(key, fmt::format("`{}` is not {}x{}", key, n, n));
  return found;
}
}  // namespace

Eigen::Matrix2d JsonNode::matrix2(const std::string& key) const {
  return square<2>(*this, key);
}
Eigen::Matrix3d JsonNode::matrix3(const std::string& key) const {
  return square<3>(*this, key);
}

Json parse_json(std::string_view text, const std::string& file) {
  std::vector<std::set<std::string>> keys(kDeepest + 2);  // of the open objects, by depth
  std::size_t events = 0;
  return Json::parse(text, [&](int depth, Json::parse_event_t event, const Json& value) {
    if (++events > kMostEvents || depth > kDeepest)
      throw bad_input(fmt::format("nested deeper than {} levels or too long", kDeepest),
                      {.file = file}, "give the right file");
    if (event == Json::parse_event_t::object_start) keys[depth + 1].clear();
    if (event == Json::parse_event_t::key && !keys[depth].insert(value).second)
      throw bad_input(fmt::format("the key `{}` stands twice in one object", value), {.file = file},
                      "keep the right one");
    return true;
  });
}

Json try_json(std::string_view text) {
  return Json::parse(text, nullptr, false);
}

Json to_json(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  Json rows = Json::array();
  for (Eigen::Index row = 0; row < matrix.rows(); ++row)
    rows.push_back(to_json_vector(matrix.row(row).transpose()));
  return rows;
}

Json to_json_vector(const Eigen::Ref<const Eigen::VectorXd>& vector) {
  Json cells = Json::array();
  for (Eigen::Index i = 0; i < vector.size(); ++i) cells.push_back(vector(i));
  return cells;
}

std::string pretty(const Json& json) {
  std::string text;
  print(json, 0, text);
  return text + "\n";
}

void write_json(const std::filesystem::path& file, const Json& json) {
  write_durable(file, pretty(json));
}

}  // namespace drape
