// SPDX-License-Identifier: Apache-2.0
#include "core/program/program.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <sstream>
#include <system_error>
#include <utility>

#include "core/fields/records.hpp"
#include "core/program/words.hpp"

namespace drape {
namespace {

constexpr int kUsage = 2;

/// Collects the names of the options and commands of a program and its subcommands.
void add_names(const CLI::App& app, std::vector<std::string>& names) {
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  for (const CLI::App* command : app.get_subcommands({})) {
    names.push_back(command->get_name());
    add_names(*command, names);
  }
}

/// Suggests, for each unknown word, its replacement or the most similar name.
void suggest(const CLI::App& app, const std::vector<std::pair<std::string, std::string>>& moved) {
  std::vector<std::string> known;
  add_names(app, known);
  for (const std::string& word : app.remaining(true)) {
    const std::string name = word.substr(0, word.find('='));
    const auto gone = std::find_if(moved.begin(), moved.end(),
                                   [&](const auto& one) { return one.first == name; });
    if (gone != moved.end()) {
      std::fprintf(stderr, "`%s` is gone: %s\n", name.c_str(), gone->second.c_str());
      continue;
    }
    const std::string best = most_similar(name, known);
    if (!best.empty() && best != name) std::fprintf(stderr, "did you mean `%s`?\n", best.c_str());
  }
}

using GivenWords = std::vector<std::pair<const CLI::Option*, std::string>>;

/// Collects the words given to the program and its subcommand.
void add_given(const CLI::App& app, GivenWords& given) {
  for (const CLI::Option* option : app.get_options())
    for (const std::string& word : option->results()) given.emplace_back(option, word);
  for (const CLI::App* command : app.get_subcommands()) add_given(*command, given);
}

/// Throws if a word is empty, or an output of the program is also one of its inputs.
void check_words(const CLI::App& app) {
  GivenWords given;
  add_given(app, given);
  for (const auto& [out, file] : given) {
    std::error_code absent;
    if (file.empty())
      throw usage_error(out->get_name() + " is empty",
                        "give a value; is a shell's variable unset?");
    if (!out->check_lname("out") || !std::filesystem::is_regular_file(file, absent)) continue;
    for (const auto& [other, word] : given)
      if (other != out && std::filesystem::equivalent(file, word, absent))
        throw usage_error("--out would be written over what is read: " + word,
                          "give another file with --out");
  }
}

}  // namespace

Command::Command(const std::string& description, const std::string& name)
    : Command(std::make_shared<CLI::App>(description, name), name) {}

void Command::read_records(std::vector<Error>& faults) const {
  for (const auto& read : records_)
    for (Error& fault : read()) faults.push_back(std::move(fault));
  if (const Command* command = chosen()) command->read_records(faults);
}

Command* Command::add_subcommand(const std::string& name, const std::string& description) {
  const std::shared_ptr<CLI::App> app(app_, app_->add_subcommand(name, description));
  if (shared_ > 0) app->footer("Also --json, --quiet, --threads N and --version.");
  subcommands_.push_back(std::unique_ptr<Command>(new Command(app, name)));
  return subcommands_.back().get();
}

void Command::require_subcommand(int least, int most) {
  app_->require_subcommand(static_cast<std::size_t>(least), static_cast<std::size_t>(most));
}

void Command::fallthrough() {
  app_->fallthrough();
  shared_ = app_->get_options().size();
}

void Command::footer(const std::string& text) {
  app_->footer(text);
}

void Command::set_version(const std::string& text) {
  app_->set_version_flag("--version", text);
}

bool Command::parsed() const {
  return app_->parsed();
}

std::size_t Command::count(const std::string& name) const {
  return app_->count(name);
}

const Command* Command::chosen() const {
  for (const auto& command : subcommands_)
    if (command->parsed()) return command.get();
  return nullptr;
}

void Command::moved(const std::string& option, const std::string& replacement) {
  moved_.emplace_back(option, replacement);
}

int Command::parse(int argc, char** argv) {
  try {
    const auto own = std::count(name_.begin(), name_.end(), ' ');
    app_->parse(argc - static_cast<int>(own), argv + own);
    std::vector<Error> faults;
    read_records(faults);  // first, so that --json applies to the errors below too
    const auto options = app_->get_options();
    for (std::size_t i = shared_; chosen() != nullptr && i < options.size(); ++i)
      if (options[i]->count() > 0)
        throw usage_error("`" + chosen()->name() + "` takes no " + options[i]->get_name() + " (" +
                              options[i]->results()[0] + ")",
                          "see its --help");
    check_words(*app_);
    throw_if_any(std::move(faults));
    return -1;
  } catch (const CLI::ParseError& error) {
    std::ostringstream answer, refusal;
    const int code = app_->exit(error, answer, refusal);
    print_text(answer.str());
    print_message(refusal.str());
    if (code == 0) return 0;
    suggest(*app_, moved_);
    return kUsage;
  }
}

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
  OptionDeclarer(CLI::App& app, std::shared_ptr<Value> given)
      : app_(app), given_(std::move(given)) {}
  /// Tells the parser which options exclude which, once all are declared.
  void exclude() const {
    for (const auto& [option, other] : excluded_) option->excludes(app_.get_option(other));
  }

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
    if (type.empty())
      add(field, app_.add_flag_function(
                     names_of_option(field),
                     [given = given_, name = std::string(field.name)](std::int64_t) {
                       (*given)[name] = true;
                     },
                     std::string(field.meaning)));
    else
      add_valued(field, kind, type, now, false, 1, 1, false);
  }

  void add(const Field& field, CLI::Option* option) {
    if (!field.excludes.empty())
      excluded_.emplace_back(option, shown_path(Syntax::options, field.excludes));
    absence_.reset();
  }

  /// Adds an option that takes `least` to `most` words; `commas`: they are separated by commas too.
  void add_valued(const Field& field, Kind kind, const std::string& type, const std::string& now,
                  bool is_list, int least, int most, bool commas) {
    const auto take = [given = given_, name = std::string(field.name), kind,
                       is_list](const std::vector<std::string>& words) {
      Value& value = (*given)[name];
      value = is_list ? Value(Value::List{}) : Value();
      for (const std::string& word : words) {
        if (is_list)
          value.append(value_of_word(word, kind));
        else
          value = value_of_word(word, kind);
      }
    };
    CLI::Option* option = app_.add_option_function<std::vector<std::string>>(
        names_of_option(field), take, std::string(field.meaning));
    option->type_name(type)->required(!absence_)->expected(least, most);
    if (absence_ == Absence::unchanged && !now.empty()) option->default_str(now);
    // Otherwise it would consume the next argument.
    if (field.one_per_flag || least == most) option->allow_extra_args(false);
    if (most == 1) option->multi_option_policy(CLI::MultiOptionPolicy::Throw);
    if (commas) option->delimiter(',');
    add(field, option);
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
    declare(field, Kind::number, ranged("FLOAT", field),
            fmt::format("{:.12g}", value / field.unit));
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
    add_valued(field, Kind::number, ranged("FLOAT", field), now, true, size, size, true);
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
    constexpr int kMostWords = 1 << 29;  // unlimited; help shows it as "..."
    const bool any = wanted_ == Field::no_index;
    add_valued(field, kind_of_item_, type_of_item_, now_of_list_, true,
               any ? 1 : static_cast<int>(wanted_), any ? kMostWords : static_cast<int>(wanted_),
               commas_ && !field.one_per_flag);
  }

  CLI::App& app_;
  std::shared_ptr<Value> given_;
  std::optional<Absence> absence_;
  std::vector<std::pair<CLI::Option*, std::string>> excluded_;
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
  OptionDeclarer declarer(*app_, given);
  show(declarer);
  declarer.exclude();
  records_.push_back([read = std::move(read), given] {
    return faults_of_reading(Document(Syntax::options, *given), read);
  });
}

}  // namespace drape
