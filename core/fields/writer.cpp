// SPDX-License-Identifier: Apache-2.0
#include "core/fields/records.hpp"
#include "core/files/files.hpp"

namespace drape {
namespace {

class Writer : public Fields {
 public:
  explicit Writer(Value& root) { open_.push_back(&root); }

 private:
  Value& put(const Field& field, Value value) {
    Value& here = *open_.back();
    if (here.get_if<Value::List>() != nullptr) return here.append(std::move(value));
    auto& table = *here.get_if<Value::Table>();
    return table.emplace_back(field.name, std::move(value)).second;
  }

  bool present(const Field& field, bool has_value, Absence absence) override {
    if (!has_value && absence == Absence::null) put(field, {});
    return has_value;
  }
  void number(const Field& field, double& value) override { put(field, value / field.unit); }
  void integer(const Field& field, std::int64_t& value, std::int64_t, std::int64_t) override {
    put(field, value);
  }
  void truth(const Field& field, bool& value) override { put(field, value); }
  void text(const Field& field, std::string& value) override { put(field, value); }
  void path(const Field& field, std::filesystem::path& value) override {
    put(field, value.generic_string());
  }
  void raw(const Field& field, Value& value) override { put(field, value); }
  bool word(const Field& field, std::size_t& index,
            std::span<const std::string_view> words) override {
    put(field, words[index]);
    return true;
  }
  void numbers(const Field& field, double* first, Eigen::Index rows, Eigen::Index cols) override {
    Value::List list;
    for (Eigen::Index row = 0; row < rows; ++row) {
      Value::List cells;
      for (Eigen::Index col = 0; col < cols; ++col)
        (cols == 1 ? list : cells).emplace_back(first[row + col * rows] / field.unit);
      if (cols != 1) list.emplace_back(std::move(cells));
    }
    put(field, std::move(list));
  }
  void begin(const Field& field) override { open_.push_back(&put(field, Value::Table{})); }
  std::size_t begin_list(const Field& field, std::size_t size, std::size_t) override {
    open_.push_back(&put(field, Value::List{}));
    return size;
  }
  std::vector<std::string> begin_members(const Field& field,
                                         std::vector<std::string> keys) override {
    begin(field);
    return keys;
  }
  void end() override { open_.pop_back(); }

  std::vector<Value*> open_;
};

/// Visits every alternative once, and one item of each list.
class SchemaWriter : public Fields {
 public:
  SchemaWriter(Value& root, Syntax syntax) : syntax_(syntax) { open_.push_back(&root); }

  [[nodiscard]] bool documents() const override { return true; }
  static Value object() {
    Value schema;
    schema["type"] = "object";
    schema["properties"] = Value::Table{};
    schema["required"] = Value::List{};
    schema["additionalProperties"] = false;
    return schema;
  }

 private:
  static Value type(const char* name) {
    Value schema;
    schema["type"] = name;
    return schema;
  }

  Value& put(const Field& field, Value schema) {
    if (!field.meaning.empty() && field.index == Field::no_index)
      schema["description"] = field.meaning;
    const bool is_nullable = absence_ == Absence::null && syntax_ == Syntax::json;
    const bool is_required = !absence_;  // a reader accepts null as well as absence
    absence_.reset();
    if (is_nullable) {
      Value either;
      either["anyOf"].append(std::move(schema));
      either["anyOf"].append(type("null"));
      schema = std::move(either);
    }
    Value& here = *open_.back();
    const char* slot = here.find("properties") == nullptr
                           ? here.find("items") != nullptr ? "items" : "additionalProperties"
                           : nullptr;
    Value* placed = nullptr;
    if (slot != nullptr) {
      placed = &(here[slot] = std::move(schema));
    } else {
      Value& properties = here["properties"];
      if (Value* other = const_cast<Value*>(properties.find(field.name))) {
        if (other->find("oneOf") == nullptr) {
          Value several;
          several["oneOf"].append(std::move(*other));
          *other = std::move(several);
        }
        return (*other)["oneOf"].append(std::move(schema));
      }
      if (is_required) here["required"].append(field.name);
      placed = &(properties[field.name] = std::move(schema));
    }
    return is_nullable
               ? placed->get_if<Value::Table>()->front().second.get_if<Value::List>()->front()
               : *placed;
  }

  static Value ranged(Value schema, const Field& field) {
    if (field.least == above_zero)
      schema["exclusiveMinimum"] = 0;
    else if (field.least > -Field::infinity)
      schema["minimum"] = field.least;
    if (field.most < Field::infinity) schema["maximum"] = field.most;
    return schema;
  }

  static Value list_of(Value items, Eigen::Index size) {
    Value list = type("array");
    list["items"] = std::move(items);
    list["minItems"] = size;
    list["maxItems"] = size;
    return list;
  }

  bool present(const Field&, bool, Absence absence) override {
    absence_ = absence;
    return true;
  }
  void number(const Field& field, double&) override { put(field, ranged(type("number"), field)); }
  void integer(const Field& field, std::int64_t&, std::int64_t, std::int64_t) override {
    put(field, ranged(type("integer"), field));
  }
  void truth(const Field& field, bool&) override { put(field, type("boolean")); }
  void text(const Field& field, std::string&) override {
    Value schema = type("string");
    if (field.is_name) {
      schema["minLength"] = 1;
      schema["maxLength"] = 200;
      schema["pattern"] = "^[^./\\\\,\\u0000-\\u001f-][^/\\\\,\\u0000-\\u001f]*$";
    }
    put(field, std::move(schema));
  }
  void path(const Field& field, std::filesystem::path&) override { put(field, type("string")); }
  void raw(const Field& field, Value&) override { put(field, Value::Table{}); }
  bool word(const Field& field, std::size_t&, std::span<const std::string_view> words) override {
    Value schema;
    for (const std::string_view word : words) schema["enum"].append(word);
    put(field, std::move(schema));
    return true;
  }
  void numbers(const Field& field, double*, Eigen::Index rows, Eigen::Index cols) override {
    Value cell = ranged(type("number"), field);
    put(field, list_of(cols == 1 ? std::move(cell) : list_of(std::move(cell), cols), rows));
  }
  void begin(const Field& field) override { open_.push_back(&put(field, object())); }
  std::size_t begin_list(const Field& field, std::size_t, std::size_t wanted) override {
    Value list = type("array");
    list["items"] = Value::Table{};
    if (wanted != Field::no_index)
      list = list_of(Value::Table{}, static_cast<Eigen::Index>(wanted));
    open_.push_back(&put(field, std::move(list)));
    return 1;
  }
  std::vector<std::string> begin_members(const Field& field, std::vector<std::string>) override {
    Value table = type("object");
    table["additionalProperties"] = Value::Table{};
    open_.push_back(&put(field, std::move(table)));
    return {""};
  }
  void end() override { open_.pop_back(); }

  // Fields beside a tag: one `oneOf` object per tag word; common fields stay outside.
  void begin_alternative(const Field& tag, std::span<const std::string_view> words,
                         std::size_t index) override {
    if (index == 0) {
      std::size_t ignored = 0;
      word(tag, ignored, words);
      (*open_.back())["additionalProperties"] = Value();
    } else {
      open_.pop_back();
    }
    Value branch;
    branch["properties"][tag.name]["const"] = words[index];
    branch["required"] = Value::List{};
    open_.push_back(&(*open_.back())["oneOf"].append(std::move(branch)));
  }
  void end_alternatives() override {
    open_.pop_back();
    auto& table = *open_.back()->get_if<Value::Table>();
    std::erase_if(table, [](const auto& member) { return member.second.is_null(); });
    (*open_.back())["unevaluatedProperties"] = false;
  }

  Syntax syntax_;
  std::vector<Value*> open_;
  std::optional<Absence> absence_;
};

}  // namespace

Value written(const Walk& walk) {
  Value root = Value::Table{};
  Writer writer(root);
  walk(writer);
  return root;
}

Value written(const Format& format, const Walk& walk) {
  Value root = Value::Table{};
  root["schema"] = format.schema();
  Writer writer(root);
  walk(writer);
  return root;
}

Value schema_of(const Format& format, const Walk& walk) {
  Value root;
  root["$schema"] = "https://json-schema.org/draft/2020-12/schema";
  root["$id"] = "urn:drapebench:" + std::string(format.name) + ":" + std::to_string(format.version);
  root["title"] = format.schema();
  if (!format.meaning.empty()) root["description"] = format.meaning;
  const Value object = SchemaWriter::object();
  for (const auto& [key, value] : *object.get_if<Value::Table>()) root[key] = value;
  root["properties"]["schema"]["const"] = format.schema();
  root["required"].append("schema");
  SchemaWriter writer(root, format.syntax);
  walk(writer);
  return root;
}

void write_value(const std::filesystem::path& file, const Value& value) {
  write_durable(file, file.extension() == ".toml" ? toml_text(value) : pretty(value));
}

}  // namespace drape
