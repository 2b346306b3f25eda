// SPDX-License-Identifier: Apache-2.0
// One walk over every described format: the schema in docs/schemas is the description's, and each
// spoiled value of a good file is refused by the name of its field.
// DRAPE_WRITE_SCHEMAS=1 writes the schemas.
#include "tests/formats/formats.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <ostream>
#include <regex>
#include <set>

#include "core/files/files.hpp"
#include "tests/architecture/source_files.hpp"
#include "tests/support/paths.hpp"

namespace drape {

void PrintTo(const DescribedFormat& format, std::ostream* out) {
  *out << format.format.name;
}

namespace test {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

class Formats : public testing::TestWithParam<DescribedFormat> {
 protected:
  [[nodiscard]] std::vector<std::string> faults_of(const Value& root) const {
    std::vector<std::string> texts;
    for (const Error& error : GetParam().faults(Document(GetParam().format.syntax, root)))
      texts.emplace_back(error.what());
    return texts;
  }
};

TEST_P(Formats, HaveTheirSchemaInDocs) {
  if (GetParam().format.syntax != Syntax::json) return;
  const auto file =
      source_root() / "docs/schemas" / (std::string(GetParam().format.name) + ".schema.json");
  if (std::getenv("DRAPE_WRITE_SCHEMAS") != nullptr) write_durable(file, pretty(GetParam().schema));
  EXPECT_EQ(read_text(file), pretty(GetParam().schema))
      << "write it again: DRAPE_WRITE_SCHEMAS=1 formats_test";
}

TEST_P(Formats, ReadTheirExampleAndRefuseAKeyGivenTwice) {
  const bool is_toml = GetParam().format.syntax == Syntax::toml;
  const std::string& text = GetParam().example;
  const std::string file = is_toml ? "a.toml" : "a.json";
  EXPECT_THAT(GetParam().faults(Document(file, GetParam().format.syntax, text)), IsEmpty());
  const std::string twice =
      is_toml ? "schema = \"\"\n" + text : "{\"schema\": \"\"," + text.substr(text.find('{') + 1);
  try {
    const Document document(file, GetParam().format.syntax, twice);
    ADD_FAILURE() << "a key that is given twice was read";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("schema"));
  }
}

/// A location in a file: keys of tables, the first item of a list.
using Place = std::vector<std::string>;

Value& at(Value& root, const Place& place) {
  Value* value = &root;
  for (const std::string& key : place)
    value = key.empty() ? &value->get_if<Value::List>()->front() : &(*value)[key];
  return *value;
}

/// The schema of a value that can be null, or of the alternative selected by the value's tag.
Value resolved(const Value& schema, const Value& value) {
  if (const Value* either = schema.find("anyOf")) return either->get_if<Value::List>()->front();
  const Value* several = schema.find("oneOf");
  if (several == nullptr || several->get_if<Value::List>() == nullptr) return schema;
  Value merged = schema;
  for (const Value& branch : *several->get_if<Value::List>()) {
    const auto* properties = branch.find("properties")->get_if<Value::Table>();
    const auto& [tag, word] = properties->front();
    if (word.find("const") == nullptr) {  // a record under a name of its own
      if (value.find(tag) != nullptr) return branch;
      continue;
    }
    const Value* given = value.find(tag);
    if (given == nullptr || one_line(*given) != one_line(*word.find("const"))) continue;
    for (const auto& [key, one] : *properties)
      if (key != tag) merged["properties"][key] = one;
    for (const Value& key : *branch.find("required")->get_if<Value::List>())
      merged["required"].append(key);
  }
  return merged;
}

/// Visits each value of a file with its schema, and whether it is required.
void each_value(const Value& schema_of_it, Value& root, const Place& place, bool is_required,
                const std::function<void(const Value&, const Place&, bool)>& visit) {
  const Value value = at(root, place);
  const Value schema = resolved(schema_of_it, value);
  if (!place.empty() && !place.back().empty()) visit(schema, place, is_required);
  if (const auto* list = value.get_if<Value::List>()) {
    Place first = place;
    first.emplace_back();
    if (!list->empty() && schema.find("items") != nullptr)
      each_value(*schema.find("items"), root, first, false, visit);
  }
  const Value* properties = schema.find("properties");
  if (properties == nullptr || value.get_if<Value::Table>() == nullptr) return;
  for (const auto& [key, one] : *properties->get_if<Value::Table>()) {
    if (key == "schema" || value.find(key) == nullptr || value.find(key)->is_null()) continue;
    bool required = false;
    for (const Value& name : *schema.find("required")->get_if<Value::List>())
      required = required || *name.get_if<std::string>() == key;
    required = required && one.find("anyOf") == nullptr;  // null and absent are read alike
    Place next = place;
    next.push_back(key);
    each_value(one, root, next, required, visit);
  }
}

/// Values that a schema does not allow.
std::vector<Value> wrong_values(const Value& schema) {
  std::vector<Value> wrong;
  if (schema.find("enum") != nullptr) return {"no such word", 7};
  const Value* type = schema.find("type");
  if (type == nullptr) return {};
  const std::string& name = *type->get_if<std::string>();
  if (name == "array" || name == "object") return {5, "text"};
  if (name == "string") return {7};
  if (name == "boolean") return {3};
  wrong = {"text", std::numeric_limits<double>::quiet_NaN()};
  if (const Value* least = schema.find("minimum")) wrong.emplace_back(least->number() - 1);
  if (schema.find("exclusiveMinimum") != nullptr) wrong.emplace_back(0.0);
  if (const Value* most = schema.find("maximum")) wrong.emplace_back(most->number() + 1);
  return wrong;
}

TEST_P(Formats, RefuseEverySpoiledValueByName) {
  Value good = Document("a", GetParam().format.syntax, GetParam().example).root();
  int spoiled = 0;
  each_value(GetParam().schema, good, {}, true,
             [&](const Value& schema, const Place& place, bool is_required) {
               const auto expect_refused = [&](const Value& root, const std::string& how) {
                 ++spoiled;
                 EXPECT_THAT(faults_of(root), Contains(HasSubstr(place.back()))) << how;
               };
               for (const Value& wrong : wrong_values(schema)) {
                 Value root = good;
                 at(root, place) = wrong;
                 expect_refused(root, one_line(wrong));
               }
               if (!is_required) return;
               Value root = good;
               Place parent = place;
               parent.pop_back();
               std::erase_if(*at(root, parent).get_if<Value::Table>(),
                             [&](const auto& member) { return member.first == place.back(); });
               expect_refused(root, "left out");
             });
  EXPECT_GT(spoiled, 0);
}

TEST(AllFormats, HoldEveryFormatOfTheSources) {
  static const std::regex named(R"re(format_of<[^>]+>\s*\{\s*"([a-z-]+)")re");
  std::set<std::string> missing;
  for (const SourceFile& file : cpp_files()) {
    if (!file.is_header()) continue;
    const std::string text = read_text(source_root() / file.path);
    for (std::sregex_iterator it(text.begin(), text.end(), named), end; it != end; ++it)
      missing.insert((*it)[1]);
  }
  EXPECT_GT(missing.size(), 20);
  for (const DescribedFormat& format : all_formats())
    missing.erase(std::string(format.format.name));
  EXPECT_THAT(missing, IsEmpty()) << "formats without an example: add them to stage_formats()";
}

INSTANTIATE_TEST_SUITE_P(All, Formats, testing::ValuesIn(all_formats()), [](const auto& format) {
  std::string name(format.param.format.name);
  std::erase(name, '-');
  return name;
});

}  // namespace
}  // namespace test
}  // namespace drape
