// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <nlohmann/json.hpp>

#include "core/fields/document.hpp"

namespace drape {
namespace {

/// Counts the lines that the parser has consumed. The character that ends a number may be a
/// newline, so the last character read is not counted yet.
struct LineCounter {
  const char* last = nullptr;
  int line = 1;

  void take(const char* at) {
    if (last != nullptr && *last == '\n') ++line;
    last = at;
  }
};

class CountingInput {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  CountingInput(const char* at, LineCounter* counter) : at_(at), counter_(counter) {}
  reference operator*() const { return *at_; }
  CountingInput& operator++() {
    counter_->take(at_++);
    return *this;
  }
  CountingInput operator++(int) {
    CountingInput before = *this;
    ++*this;
    return before;
  }
  bool operator==(const CountingInput& other) const { return at_ == other.at_; }

 private:
  const char* at_;
  LineCounter* counter_;
};

/// Builds the value while the text is parsed.
class ValueBuilder : public nlohmann::json_sax<nlohmann::json> {
 public:
  ValueBuilder(const LineCounter& counter, std::string file)
      : counter_(counter), file_(std::move(file)) {}

  Value root;

  bool null() override { return add({}); }
  bool boolean(bool value) override { return add(value); }
  bool number_integer(number_integer_t value) override { return add(value); }
  bool number_unsigned(number_unsigned_t value) override {
    constexpr auto most = static_cast<number_unsigned_t>(std::numeric_limits<std::int64_t>::max());
    return add(value <= most ? Value(value) : Value(static_cast<double>(value)));
  }
  bool number_float(number_float_t value, const string_t&) override { return add(value); }
  bool string(string_t& value) override { return add(std::move(value)); }
  bool binary(binary_t&) override { return false; }
  bool start_object(std::size_t) override { return open(Value::Table{}); }
  bool start_array(std::size_t) override { return open(Value::List{}); }
  bool key(string_t& value) override {
    count();
    key_ = std::move(value);
    return true;
  }
  bool end_array() override {
    open_.pop_back();
    return true;
  }
  bool end_object() override {
    refuse_double_keys(*open_.back()->get_if<Value::Table>());
    return end_array();
  }
  bool parse_error(std::size_t, const std::string&,
                   const nlohmann::json::exception& error) override {
    fail(fmt::format("not a JSON file: {}", error.what()), make_again, counter_.line);
  }

 private:
  /// Limit on nesting, so that recursive walks do not overflow the stack.
  static constexpr std::size_t kDeepest = 100;
  static constexpr std::size_t kMostEvents = 16'000'000;  ///< limit on keys and values

  [[noreturn]] void fail(const std::string& what, const char* remedy, int line) const {
    throw bad_input(what, {.file = file_, .line = line}, remedy);
  }
  void count() {
    if (++events_ > kMostEvents || open_.size() > kDeepest)
      fail(fmt::format("nested deeper than {} levels or too long", kDeepest), "give the right file",
           counter_.line);
  }
  Value* put(Value value) {
    count();
    value.line = counter_.line;
    if (open_.empty()) return &(root = std::move(value));
    if (auto* table = open_.back()->get_if<Value::Table>())
      return &table->emplace_back(std::move(key_), std::move(value)).second;
    return &open_.back()->append(std::move(value));
  }
  bool add(Value value) {
    put(std::move(value));
    return true;
  }
  bool open(Value value) {
    open_.push_back(put(std::move(value)));
    return true;
  }
  void refuse_double_keys(const Value::Table& table) const {
    std::vector<const std::pair<std::string, Value>*> sorted;
    sorted.reserve(table.size());
    for (const auto& member : table) sorted.push_back(&member);
    std::stable_sort(sorted.begin(), sorted.end(),
                     [](const auto* a, const auto* b) { return a->first < b->first; });
    for (std::size_t i = 1; i < sorted.size(); ++i)
      if (sorted[i]->first == sorted[i - 1]->first)
        fail(fmt::format("the key `{}` stands twice in one object", sorted[i]->first),
             "keep the right one", sorted[i]->second.line);
  }

  const LineCounter& counter_;
  std::string file_, key_;
  std::vector<Value*> open_;
  std::size_t events_ = 0;
};

}  // namespace

Value json_value(std::string_view text, const std::string& file) {
  LineCounter counter;
  ValueBuilder builder(counter, file);
  const char* begin = text.data();
  nlohmann::json::sax_parse(CountingInput(begin, &counter),
                            CountingInput(begin + text.size(), &counter), &builder);
  return std::move(builder.root);
}

}  // namespace drape
