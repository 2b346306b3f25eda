// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <memory>

#include "core/fields/records.hpp"
#include "core/program/command.hpp"

namespace drape {
namespace {

enum class Kind { whole, number, words };

/// Converts a word to a number; whole numbers are decimal, without the octal meaning of a leading
/// 0. Other words stay text; the record's reader refuses them where it needs a number.
Value value_of_word(const std::string& word, Kind kind) {
  const char* begin = word.data() + (word.starts_with('+') ? 1 : 0);
  const char* end = word.data() + word.size();
  const char* digits = begin + (begin != end && *begin == '-' ? 1 : 0);
  const bool in_eights = end - digits > 1 && *digits == '0' && digits[1] >= '0' && digits[1] <= '9';
  std::int64_t whole = 0;
  double number = 0;
  if (kind == Kind::whole && !in_eights && std::from_chars(begin, end, whole).ptr == end &&
      begin != end)
    return whole;
  if (kind == Kind::number && std::from_chars(begin, end, number).ptr == end && begin != end)
    return number;
  return word;
}

/// Declares an option for each field of a record. The given words become values under the names of
/// the fields.
class OptionDeclarer : public Fields {
 public:
  using Add = std::function<void(const OptionSpec&,
                                 const std::function<void(const std::vector<std::string>&)>&)>;

  OptionDeclarer(Add add, std::shared_ptr<Value> given)
      : add_(std::move(add)), given_(std::move(given)) {}

 private:
  /// Option names such as "--out,-o", or the name of a positional argument.
  static std::string names_of_option(const Field& field) {
    if (!field.option.empty() && field.option.front() != '-') return std::string(field.option);
    const std::string name = shown_path(Syntax::options, field.name);
    return field.option.empty() ? name : fmt::format("{},{}", name, field.option);
  }

  void declare(const Field& field, Kind kind, const std::string& type, const std::string& now) {
    if (list_ != nullptr) {  // the single item that represents a list
      kind_of_item_ = kind;
      type_of_item_ = type;
      if (size_ > 0) now_of_list_ += (now_of_list_.empty() ? "" : ",") + now;
      commas_ = kind != Kind::words || field.is_name || type.find('{') != std::string::npos;
      return;
    }
    OptionSpec spec{.names = names_of_option(field),
                    .type = type,
                    .now = absence_ == Absence::unchanged ? now : "",
                    .description = std::string(field.meaning)};
    spec.required = !absence_ && !type.empty();
    add(field, spec, kind, false);
  }

  void add(const Field& field, OptionSpec& spec, Kind kind, bool is_list) {
    if (!field.excludes.empty()) spec.excludes = shown_path(Syntax::options, field.excludes);
    absence_.reset();
    add_(spec, [given = given_, name = std::string(field.name), kind, is_list,
                is_flag = spec.type.empty()](const std::vector<std::string>& words) {
      Value& value = (*given)[name];
      value = is_flag ? Value(true) : is_list ? Value(Value::List{}) : Value();
      for (const std::string& word : words) {
        if (is_list)
          value.append(value_of_word(word, kind));
        else
          value = value_of_word(word, kind);
      }
    });
  }

  /// Type with its range: "INT in [5 - 401]", "FLOAT:POSITIVE".
  static std::string ranged(const char* type, const Field& field) {
    const bool below = std::isfinite(field.most);
    if (field.least == above_zero)
      return below ? fmt::format("{}:above 0, up to {}", type, field.most)
                   : fmt::format("{}:POSITIVE", type);
    if (std::isfinite(field.least) && below)
      return fmt::format("{0}:{0} in [{1} - {2}]", type, field.least, field.most);
    if (std::isfinite(field.least)) return fmt::format("{0}:{0} from {1}", type, field.least);
    return below ? fmt::format("{0}:{0} up to {1}", type, field.most) : type;
  }

  bool present(const Field&, bool, Absence absence) override {
    absence_ = absence;
    return true;
  }
  void number(const Field& field, double& value) override {
    declare(field, Kind::number, ranged("FLOAT", field), fmt::format("{}", value / field.unit));
  }
  void integer(const Field& field, std::int64_t& value, std::int64_t least, std::int64_t) override {
    declare(field, Kind::whole, ranged(least == 0 ? "UINT" : "INT", field),
            fmt::format("{}", value));
  }
  void truth(const Field& field, bool&) override { declare(field, Kind::words, "", ""); }
  void text(const Field& field, std::string& value) override {
    declare(field, Kind::words, "TEXT", value);
  }
  void path(const Field& field, std::filesystem::path& value) override {
    declare(field, Kind::words, "TEXT", value.string());
  }
  void raw(const Field&, Value&) override {}
  bool word(const Field& field, std::size_t& index,
            std::span<const std::string_view> words) override {
    declare(field, Kind::words, fmt::format("TEXT:{{{}}}", fmt::join(words, ",")),
            std::string(words[index]));
    return true;
  }
  void numbers(const Field& field, double* first, Eigen::Index rows, Eigen::Index cols) override {
    const auto size = static_cast<int>(rows * cols);
    std::string now;
    for (int i = 0; i < size; ++i)
      now += fmt::format("{}{}", i == 0 ? "" : " ", first[i] / field.unit);
    OptionSpec spec{.names = names_of_option(field),
                    .type = ranged("FLOAT", field),
                    .now = absence_ == Absence::unchanged ? now : "",
                    .description = std::string(field.meaning)};
    spec.required = !absence_;
    spec.least = spec.most = size;
    spec.commas = true;
    add(field, spec, Kind::number, true);
  }
  void begin(const Field&) override {}
  std::size_t begin_list(const Field& field, std::size_t size, std::size_t wanted) override {
    list_ = &field;
    size_ = size;
    wanted_ = wanted;
    now_of_list_.clear();
    return std::max<std::size_t>(size, 1);
  }
  std::vector<std::string> begin_members(const Field&, std::vector<std::string>) override {
    return {};
  }
  void end() override {
    if (list_ == nullptr) return;
    const Field& field = *std::exchange(list_, nullptr);
    OptionSpec spec{.names = names_of_option(field),
                    .type = type_of_item_,
                    .now = absence_ == Absence::unchanged ? now_of_list_ : "",
                    .description = std::string(field.meaning)};
    spec.required = !absence_;
    constexpr int kMostWords = 1 << 29;  // unlimited; help shows it as "..."
    spec.least = wanted_ == Field::no_index ? 1 : static_cast<int>(wanted_);
    spec.most = wanted_ == Field::no_index ? kMostWords : static_cast<int>(wanted_);
    spec.one_per_flag = field.one_per_flag;
    spec.commas = commas_ && !field.one_per_flag;
    add(field, spec, kind_of_item_, true);
  }

  Add add_;
  std::shared_ptr<Value> given_;
  std::optional<Absence> absence_;
  const Field* list_ = nullptr;  ///< list whose item is being described
  std::size_t size_ = 0, wanted_ = 0;
  Kind kind_of_item_ = Kind::words;
  std::string type_of_item_, now_of_list_;
  bool commas_ = false;
};

}  // namespace

void Command::add_walk(std::function<void(Fields&)> read,
                       const std::function<void(Fields&)>& show) {
  auto given = std::make_shared<Value>(Value::Table{});
  std::vector<OptionSpec> specs;
  OptionDeclarer declarer(
      [&](const OptionSpec& spec, const auto& take) {
        specs.push_back(spec);
        add_spec(spec, take);
      },
      given);
  show(declarer);
  for (const OptionSpec& spec : specs) exclude(spec);
  records_.push_back([read = std::move(read), given] {
    return faults_of_reading(Document(Syntax::options, *given), read);
  });
}

}  // namespace drape
