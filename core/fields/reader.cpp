// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/fields/records.hpp"
#include "core/files/files.hpp"
#include "core/files/number_range.hpp"
#include "core/program/words.hpp"

namespace drape {
namespace {

constexpr std::int64_t kMostWhole = 1 << 30;  ///< largest whole number in a file that people edit
constexpr std::size_t kShownBytes = 60;       ///< longest quotation of a text in a message

/// Key without its unit: "diameter" from "diameter_mm".
std::string_view stem(std::string_view key) {
  return key.substr(0, key.find('_'));
}

std::string quote(std::string_view text) {
  return fmt::format("`{}{}`", printable(std::string(text.substr(0, kShownBytes))),
                     text.size() > kShownBytes ? "..." : "");
}

std::string words_to_use(std::span<const std::string_view> words) {
  std::string list;
  for (std::size_t i = 0; i < words.size(); ++i)
    list += fmt::format("{}`{}`", i == 0 ? "" : i + 1 == words.size() ? " or " : ", ", words[i]);
  return "use " + list;
}

/// Describes the range of a field: "a number above 0", "a whole number from 1 to 4".
std::string range_of(const Field& field, const char* number) {
  const bool below = std::isfinite(field.most), above = std::isfinite(field.least);
  if (field.least == above_zero || (field.least == 1 && std::string_view(number) != "number"))
    return fmt::format("a {} above 0{}", number,
                       below ? fmt::format(" and up to {}", field.most) : "");
  if (above && below) return fmt::format("a {} from {} to {}", number, field.least, field.most);
  if (above && field.least == 0) return fmt::format("0 or a {} above it", number);
  if (above) return fmt::format("a {} from {} on", number, field.least);
  return fmt::format("a {} up to {}", number, field.most);
}

class Reader : public Fields {
 public:
  explicit Reader(const Document& document)
      : document_(document), syntax_(document.syntax()), root_(document.root()) {
    places_.push_back({});
    places_.back().value = &root_;
    if (root_.get_if<Value::Table>() == nullptr) {
      add_fault("", "an object is expected here", make_again);
      places_.back().value = nullptr;
    } else {
      mark_read("schema");
    }
  }

  std::vector<Error> finish() {
    end();
    return std::move(faults_);
  }

  void rule(bool holds, std::string_view field, std::string_view what,
            std::string_view remedy) override {
    const Place& here = places_.back();
    if (!holds && here.value != nullptr && faults_.size() == here.faults_before)
      add_fault(path_of(field), std::string(what), remedy);
  }
  void limit(bool holds, std::string_view field, std::string_view what,
             std::string_view remedy) override {
    const Place& here = places_.back();
    const std::string_view name = field.substr(0, field.find('.'));
    const bool is_good = std::find(here.bad.begin(), here.bad.end(), name) == here.bad.end();
    if (!holds && here.value != nullptr && is_good)
      add_fault(path_of(field), std::string(what), remedy);
  }
  [[nodiscard]] bool reads() const override { return true; }

 private:
  /// A record or list being walked through. A null value is missing or wrong, as already reported.
  struct Place {
    const Value* value = nullptr;
    std::string name = {};                ///< key, or index within a list
    std::vector<bool> read = {};          ///< true for each member of the table that was read
    std::vector<std::string> known = {};  ///< keys that were requested
    std::vector<std::string> bad = {};    ///< keys whose value is invalid
    std::vector<std::pair<std::string, std::size_t>> missing = {};  ///< key, index of its error
    std::size_t next = 0, faults_before = 0;
  };

  static std::string key_of(const Field& field) {
    return field.index == Field::no_index ? std::string(field.name) : std::to_string(field.index);
  }

  [[nodiscard]] std::string path_of(std::string_view field) const {
    std::string path;
    for (std::size_t i = 1; i < places_.size(); ++i) path += places_[i].name + ".";
    return path + std::string(field);
  }

  /// Name of the field in messages: "width_mm", "cells.3", "--grid".
  [[nodiscard]] std::string label(const Field& field) const {
    if (syntax_ == Syntax::options)
      return !field.option.empty() && field.option.front() != '-' ? std::string(field.option)
                                                                  : shown_path(syntax_, field.name);
    if (field.index == Field::no_index) return std::string(field.name);
    return shown_path(Syntax::toml, fmt::format("{}.{}", places_.back().name, field.index));
  }

  void add_fault(const std::string& path, std::string what, std::string_view remedy) {
    if (syntax_ == Syntax::options)
      faults_.push_back(usage_error(std::move(what), std::string(remedy)));
    else
      faults_.push_back(bad_input(std::move(what), document_.where(path), std::string(remedy)));
  }

  /// Reports a value of the wrong kind or out of range. `advice` applies to files that people edit,
  /// unless the field states its own remedy.
  void wrong(const Field& field, std::string what, const std::string& advice) {
    places_.back().bad.push_back(key_of(field));
    const std::string_view remedy = !field.remedy.empty()     ? field.remedy
                                    : syntax_ == Syntax::json ? std::string_view(make_again)
                                                              : std::string_view(advice);
    add_fault(path_of(key_of(field)), std::move(what), remedy);
  }
  void wrong_kind(const Field& field, const std::string& expected) {
    wrong(field, fmt::format("`{}` is not {}", label(field), expected),
          fmt::format("give {}", expected));
  }

  void mark_read(std::string_view key) {
    Place& here = places_.back();
    const auto& table = *here.value->get_if<Value::Table>();
    here.read.resize(table.size());
    for (std::size_t i = 0; i < table.size(); ++i)
      if (table[i].first == key) here.read[i] = true;
  }

  /// Finds the value in the current record or list; null if it is absent or null.
  const Value* find(const Field& field) {
    Place& here = places_.back();
    if (here.value == nullptr) return nullptr;
    if (const auto* list = here.value->get_if<Value::List>())
      return field.index < list->size() ? &(*list)[field.index] : nullptr;
    const auto& table = *here.value->get_if<Value::Table>();
    here.read.resize(table.size());
    if (syntax_ != Syntax::json &&
        std::find(here.known.begin(), here.known.end(), field.name) == here.known.end())
      here.known.emplace_back(field.name);
    for (std::size_t step = 0; step < table.size(); ++step) {  // files usually keep the order
      const std::size_t at = (here.next + step) % table.size();
      if (table[at].first != field.name) continue;
      here.read[at] = true;
      here.next = at;
      return table[at].second.is_null() ? nullptr : &table[at].second;
    }
    return nullptr;
  }

  /// Finds a required value; if it is missing, reports that once and returns null.
  const Value* need(const Field& field) {
    const Value* value = find(field);
    Place& here = places_.back();
    if (value != nullptr || here.value == nullptr) return value;
    here.bad.push_back(key_of(field));
    here.missing.emplace_back(field.name, faults_.size());
    const std::string name =
        syntax_ == Syntax::toml ? shown_path(syntax_, path_of(key_of(field))) : label(field);
    const std::string advice = syntax_ == Syntax::toml   ? fmt::format("add `{} = ...`", field.name)
                               : syntax_ == Syntax::json ? std::string(make_again)
                                                         : "give it";
    add_fault(path_of(key_of(field)), fmt::format("`{}` is missing", name),
              field.remedy.empty() ? std::string_view(advice) : field.remedy);
    return nullptr;
  }

  bool present(const Field& field, bool, Absence) override { return find(field) != nullptr; }

  /// Refuses a number that is not finite or out of its range.
  bool is_in_range(const Field& field, double value, const char* number) {
    if (!(std::abs(value) <= largest_number)) {
      wrong_kind(field, std::isfinite(value) ? fmt::format("a number up to {:g}", largest_number)
                                             : std::string("a finite number"));
      return false;
    }
    if (value >= field.least && value <= field.most) return true;
    const std::string range = range_of(field, number);
    wrong(field,
          syntax_ == Syntax::json ? fmt::format("`{}` is {}, not {}", label(field), value, range)
                                  : fmt::format("`{}` is {}", label(field), value),
          "give " + range);
    return false;
  }

  void number(const Field& field, double& result) override {
    const Value* value = need(field);
    if (value == nullptr) return;
    if (!value->is_number()) return wrong_kind(field, "a finite number");
    const double found = value->number();
    if (is_in_range(field, found, "number")) result = found * field.unit;
  }

  void integer(const Field& field, std::int64_t& result, std::int64_t least,
               std::int64_t most) override {
    const Value* value = need(field);
    if (value == nullptr) return;
    const bool is_counted = syntax_ == Syntax::toml;
    if (is_counted) least = std::max(least, -kMostWhole), most = std::min(most, kMostWhole);
    const auto* found = value->get_if<std::int64_t>();
    if (found == nullptr || *found < least || *found > most)
      return wrong_kind(field, is_counted ? "a whole number up to 2^30"
                               : syntax_ == Syntax::options
                                   ? std::string("a whole number")
                                   : fmt::format("a whole number up to {}", most));
    if (is_in_range(field, static_cast<double>(*found), "whole number")) result = *found;
  }

  void truth(const Field& field, bool& result) override {
    const Value* value = need(field);
    if (value == nullptr) return;
    if (const auto* found = value->get_if<bool>())
      result = *found;
    else
      wrong_kind(field, "true or false");
  }

  const std::string* need_text(const Field& field) {
    const Value* value = need(field);
    const auto* found = value == nullptr ? nullptr : value->get_if<std::string>();
    if (value != nullptr && found == nullptr) wrong_kind(field, "a text");
    if (found == nullptr || found->size() <= largest_text) return found;
    wrong_kind(field, fmt::format("a text of at most {} bytes", largest_text));
    return nullptr;
  }

  void text(const Field& field, std::string& result) override {
    const std::string* found = need_text(field);
    if (found == nullptr) return;
    if (field.is_name) {
      try {
        require_plain_name(*found, document_.where(path_of(key_of(field))));
      } catch (const Error& error) {
        places_.back().bad.push_back(key_of(field));
        add_fault(path_of(key_of(field)), error.what_failed(), error.what_to_do());
        return;
      }
    }
    result = *found;
  }

  void path(const Field& field, std::filesystem::path& result) override {
    if (const std::string* found = need_text(field)) result = document_.beside(*found);
  }

  void raw(const Field& field, Value& result) override {
    if (const Value* value = need(field)) result = *value;
  }

  bool word(const Field& field, std::size_t& index,
            std::span<const std::string_view> words) override {
    const std::string* found = need_text(field);
    if (found == nullptr) return false;
    const auto at = std::find(words.begin(), words.end(), *found);
    if (at != words.end()) {
      index = static_cast<std::size_t>(at - words.begin());
      return true;
    }
    std::string meant = most_similar(*found, {words.begin(), words.end()});
    if (!meant.empty()) meant = fmt::format(", did you mean `{}`?", meant);
    places_.back().bad.push_back(key_of(field));
    add_fault(path_of(key_of(field)),
              fmt::format("`{}` is {}, which is not known", label(field), quote(*found)),
              field.remedy.empty() ? words_to_use(words) + meant : std::string(field.remedy));
    return false;
  }

  void numbers(const Field& field, double* first, Eigen::Index rows, Eigen::Index cols) override {
    const Value* value = need(field);
    if (value == nullptr) return;
    const auto list_of = [](const Value& list, Eigen::Index size) -> const Value::List* {
      const auto* items = list.get_if<Value::List>();
      return items != nullptr && static_cast<Eigen::Index>(items->size()) == size ? items : nullptr;
    };
    const auto refuse = [&] {
      wrong_kind(field, cols == 1 ? fmt::format("an array of {} finite numbers", rows)
                                  : fmt::format("an array of {} rows of {} finite numbers ({}x{})",
                                                rows, cols, rows, cols));
    };
    const Value::List* list = list_of(*value, rows);
    if (list == nullptr) return refuse();
    for (Eigen::Index row = 0; row < rows; ++row) {
      const Value& item = (*list)[static_cast<std::size_t>(row)];
      const Value::List* cells = cols == 1 ? nullptr : list_of(item, cols);
      if (cols != 1 && cells == nullptr) return refuse();
      for (Eigen::Index col = 0; col < cols; ++col) {
        const Value& cell = cells == nullptr ? item : (*cells)[static_cast<std::size_t>(col)];
        if (!cell.is_number() || !(std::abs(cell.number()) <= largest_number)) return refuse();
        if (!is_in_range(field, cell.number(), "number")) return;
        first[row + col * rows] = cell.number() * field.unit;
      }
    }
  }

  /// Enters a record or list, with or without a value.
  void enter(const Field& field, const Value* value) {
    Place place;
    place.value = value;
    place.name = key_of(field);
    place.faults_before = faults_.size();
    places_.push_back(std::move(place));
  }

  void begin(const Field& field) override {
    const Value* value = need(field);
    if (value != nullptr && value->get_if<Value::Table>() == nullptr) {
      wrong_kind(field, syntax_ == Syntax::json ? "an object" : "a table");
      value = nullptr;
    }
    enter(field, value);
  }

  std::size_t begin_list(const Field& field, std::size_t, std::size_t wanted) override {
    const Value* value = need(field);
    const auto* list = value == nullptr ? nullptr : value->get_if<Value::List>();
    const bool fits = wanted == Field::no_index || (list != nullptr && list->size() == wanted);
    if (value != nullptr && (list == nullptr || !fits)) {
      wrong_kind(field, wanted == Field::no_index ? std::string("an array")
                                                  : fmt::format("an array of {} values", wanted));
      list = nullptr;
    }
    enter(field, list == nullptr ? nullptr : value);
    return list == nullptr ? 0 : list->size();
  }

  std::vector<std::string> begin_members(const Field& field, std::vector<std::string>) override {
    begin(field);
    std::vector<std::string> keys;
    if (places_.back().value == nullptr) return keys;
    for (const auto& [key, value] : *places_.back().value->get_if<Value::Table>())
      keys.push_back(key);
    return keys;
  }

  void end() override {
    if (places_.back().value != nullptr && syntax_ == Syntax::toml) refuse_unknown_keys();
    const bool is_bad = faults_.size() != places_.back().faults_before;
    std::string name = std::move(places_.back().name);
    places_.pop_back();
    if (is_bad && !places_.empty()) places_.back().bad.push_back(std::move(name));
  }

  void refuse_unknown_keys() {
    Place& here = places_.back();
    const auto* table = here.value->get_if<Value::Table>();
    if (table == nullptr) return;
    here.read.resize(table->size());
    for (std::size_t i = 0; i < table->size(); ++i) {
      const std::string& key = (*table)[i].first;
      if (here.read[i] || explains_missing(here, key)) continue;
      std::string meant;
      for (const std::string& other : here.known)
        if (stem(other) == stem(key)) meant = other;
      const std::string advice =
          !meant.empty() ? fmt::format("did you mean `{}`? Units are part of the names", meant)
          : !(meant = most_similar(key, here.known)).empty()
              ? fmt::format("did you mean `{}`?", meant)
              : "remove it or correct its name";
      add_fault(path_of(key),
                fmt::format("unknown key {}", quote(shown_path(syntax_, path_of(key)))), advice);
    }
  }

  /// True if an unknown key differs from a missing one by its unit only; both are then one error.
  bool explains_missing(Place& here, const std::string& key) {
    if (key.find("uncertainty") != std::string::npos) return false;
    for (auto& [name, fault] : here.missing) {
      if (stem(name) != stem(key)) continue;
      faults_[fault] = bad_input(
          fmt::format("`{}` is missing, {} is not a key here", shown_path(syntax_, path_of(name)),
                      quote(shown_path(syntax_, path_of(key)))),
          document_.where(path_of(key)),
          fmt::format("units are part of the names: write `{}` and convert the value", name));
      name.clear();
      return true;
    }
    return false;
  }

  const Document& document_;
  Syntax syntax_;
  const Value& root_;
  std::vector<Place> places_;
  std::vector<Error> faults_;
};

}  // namespace

std::string Format::schema() const {
  return fmt::format("drapebench/{}/{}", name, version);
}

void require_format(const Document& document, const Format& format) {
  const bool is_json = document.syntax() == Syntax::json;
  const Where where = document.where("schema");
  const Value* value = document.root().find("schema");
  const auto* found = value == nullptr ? nullptr : value->get_if<std::string>();
  if (document.root().get_if<Value::Table>() == nullptr)
    throw bad_input("an object is expected here", {.file = where.file}, make_again);
  if (found == nullptr)
    throw bad_input(value == nullptr ? "`schema` is missing" : "`schema` is not a text", where,
                    is_json ? make_again : fmt::format("add `schema = \"{}\"`", format.schema()));
  const std::string prefix = fmt::format("drapebench/{}/", format.name);
  int version = 0;
  const char* end = found->data() + found->size();
  if (found->rfind(prefix, 0) != 0 ||
      std::from_chars(found->data() + prefix.size(), end, version).ptr != end || version < 1)
    throw bad_input(
        is_json ? fmt::format("{} is not a {}<n> file", quote(*found), prefix)
                : fmt::format("the schema is {}, this version reads `{}`", quote(*found),
                              format.schema()),
        where, is_json ? "give a file of that kind" : "use a newer drapebench, or the right file");
  if (version > format.version)
    throw bad_input(fmt::format("the schema {} is newer than this program, which reads {}",
                                quote(*found), format.schema()),
                    where, "use a newer drapebench");
}

std::vector<Error> faults_of_reading(const Document& document, const Walk& walk) {
  Reader reader(document);
  walk(reader);
  return reader.finish();
}

}  // namespace drape
