// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <concepts>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace drape {

/// A value of a TOML or JSON file, with everything nested in it. Keys keep their order.
class Value {
 public:
  using List = std::vector<Value>;
  using Table = std::vector<std::pair<std::string, Value>>;

  Value() = default;
  Value(bool value) : content_(value) {}
  template <std::integral T>
  Value(T value) : content_(static_cast<std::int64_t>(value)) {}
  Value(double value) : content_(value) {}
  Value(std::string value) : content_(std::move(value)) {}
  Value(std::string_view value) : content_(std::string(value)) {}
  Value(const char* value) : content_(std::string(value)) {}
  Value(List value) : content_(std::move(value)) {}
  Value(Table value) : content_(std::move(value)) {}

  [[nodiscard]] bool is_null() const { return std::holds_alternative<std::nullptr_t>(content_); }
  template <class T>
  [[nodiscard]] const T* get_if() const {
    return std::get_if<T>(&content_);
  }
  template <class T>
  [[nodiscard]] T* get_if() {
    return std::get_if<T>(&content_);
  }
  /// True for an integer or a floating-point number.
  [[nodiscard]] bool is_number() const { return get_if<double>() || get_if<std::int64_t>(); }
  [[nodiscard]] double number() const;

  /// Member of a table; null if there is none or the value is not a table.
  [[nodiscard]] const Value* find(std::string_view key) const;
  /// The same if it holds a T.
  template <class T>
  [[nodiscard]] const T* find_as(std::string_view key) const {
    const Value* member = find(key);
    return member == nullptr ? nullptr : member->get_if<T>();
  }
  /// Member of a table, appended if missing; a null value becomes a table.
  Value& operator[](std::string_view key);
  /// Appends an item to a list; a null value becomes a list.
  Value& append(Value item);

  int line = 0;  ///< 1-based line in its file; 0 if it comes from no file

 private:
  std::variant<std::nullptr_t, bool, std::int64_t, double, std::string, List, Table> content_;
};

/// JSON in the layout of drapebench: one key per line, arrays of plain numbers on one line.
[[nodiscard]] std::string pretty(const Value& value);

/// JSON on one line.
[[nodiscard]] std::string one_line(const Value& value);

/// TOML text; tables follow the plain values, as the format requires.
[[nodiscard]] std::string toml_text(const Value& table);

/// Every plain value as text, with its path ("object.1.x_mm"; tables in a list count from 1). A
/// list of plain values is one entry. Paths are in alphabetical order.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> flat(const Value& table);

/// Describes one named value of a record. `unit` is the SI value of one unit of the file: memory =
/// file * unit.
struct Field {
  static constexpr double infinity = std::numeric_limits<double>::infinity();
  static constexpr std::size_t no_index = std::numeric_limits<std::size_t>::max();

  std::string_view name = {};
  std::string_view meaning = {};  ///< noun and unit; also the help of an option
  double unit = 1;
  double least = -infinity, most = infinity;  ///< inclusive limits in the file's unit
  std::string_view remedy = {};               ///< remedy if the value is missing or out of range

  std::string_view option = {};    ///< "-o": a second name; "SHEET": a positional argument
  std::string_view excludes = {};  ///< option that excludes this one
  bool one_per_flag = false;       ///< true if each flag of a list takes one word only
  bool is_name = false;            ///< true for text that must be valid as one component of a path
  std::size_t index = no_index;    ///< index within a list; set by the walk

  // Copies with one property changed: `f(Field{"set", "frame set"}.plain_name(), set)`.
  [[nodiscard]] constexpr Field plain_name() const { return with(&Field::is_name, true); }
  [[nodiscard]] constexpr Field called(std::string_view also) const {
    return with(&Field::option, also);
  }
  [[nodiscard]] constexpr Field without(std::string_view other) const {
    return with(&Field::excludes, other);
  }
  [[nodiscard]] constexpr Field per_flag() const { return with(&Field::one_per_flag, true); }
  [[nodiscard]] constexpr Field item(std::size_t at) const { return with(&Field::index, at); }
  template <class T>
  [[nodiscard]] constexpr Field with(T Field::*property, T value) const {
    Field copy = *this;
    copy.*property = value;
    return copy;
  }
};

/// Value of `least` for numbers that must exceed 0.
inline constexpr double above_zero = std::numeric_limits<double>::denorm_min();

/// Names of an enumeration in files, in the order of its values from 0; specialised beside the
/// enum.
template <class Enum>
inline constexpr std::string_view names_of[] = {""};

/// Name of an enumeration value in files.
template <class Enum>
[[nodiscard]] constexpr std::string_view name_of(Enum value) {
  return names_of<Enum>[static_cast<std::size_t>(value)];
}

/// Name, version and syntax of a file format; specialised beside its record:
/// `template <> inline constexpr Format format_of<Scene>{"scene", Syntax::toml};`
template <class Record>
inline constexpr int format_of = 0;

namespace detail {
template <class T>
inline constexpr bool is_optional = false;
template <class T>
inline constexpr bool is_optional<std::optional<T>> = true;
template <class T>
inline constexpr bool is_list = false;
template <class T>
inline constexpr bool is_list<std::vector<T>> = true;
template <class T>
inline constexpr bool is_array = false;
template <class T, std::size_t n>
inline constexpr bool is_array<std::array<T, n>> = true;
template <class T>
inline constexpr bool is_members = false;
template <class T>
inline constexpr bool is_members<std::map<std::string, T>> = true;
template <class T>
inline constexpr bool is_members<std::vector<std::pair<std::string, T>>> = true;
}  // namespace detail

/// Walks through the values of a record, described by one ordinary function:
///
///   void fields(Fields& f, Pin& pin) {
///     f({"row", "mark along the warp", 1, 0}, pin.row);
///     f({"at_mm", "point in the world; absent: measured", units::mm}, pin.at_m);  // optional
///   }
///
/// Derived classes read, write or document every record. A value that file and struct represent
/// differently goes through a local variable: `double d = 2 * r; f(..., d); r = d / 2;`.
class Fields {
 public:
  virtual ~Fields() = default;

  /// Describes a required value. An optional one may be absent or null and is written as null; for
  /// a list, every item is described.
  template <class T>
  void operator()(const Field& field, T& value) {
    if constexpr (detail::is_optional<T>) {
      optional(field, value, Absence::null);
    } else if constexpr (std::is_same_v<T, bool>) {
      truth(field, value);
    } else if constexpr (std::is_enum_v<T>) {
      auto index = static_cast<std::size_t>(value);
      word(field, index, names_of<T>);
      value = static_cast<T>(index);
    } else if constexpr (std::is_integral_v<T>) {
      auto wide = static_cast<std::int64_t>(value);
      integer(field, wide, least_of<T>(), most_of<T>());
      value = static_cast<T>(wide);
    } else if constexpr (std::is_same_v<T, double>) {
      number(field, value);
    } else if constexpr (std::is_same_v<T, std::string>) {
      text(field, value);
    } else if constexpr (std::is_same_v<T, std::filesystem::path>) {
      path(field, value);
    } else if constexpr (std::is_same_v<T, Value>) {
      raw(field, value);
    } else if constexpr (std::is_base_of_v<Eigen::DenseBase<T>, T>) {
      eigen(field, value);
    } else if constexpr (detail::is_members<T>) {
      members(field, value);
    } else if constexpr (detail::is_list<T>) {
      value.resize(begin_list(field, value.size(), Field::no_index));
      for (std::size_t i = 0; i < value.size(); ++i) (*this)(field.item(i), value[i]);
      end();
    } else if constexpr (detail::is_array<T>) {
      const std::size_t size = begin_list(field, value.size(), value.size());
      for (std::size_t i = 0; i < size; ++i) (*this)(field.item(i), value[i]);
      end();
    } else {
      begin(field);
      fields(*this, value);  // found in the record's own namespace
      end();
    }
  }

  /// Describes a value whose default holds if the file omits it; shown by the command line.
  template <class T>
  void otherwise(const Field& field, T& value) {
    if (present(field, true, Absence::unchanged)) (*this)(field, value);
  }

  /// Describes an optional value or a list that is omitted if empty.
  template <class T>
  void if_any(const Field& field, T& value) {
    if constexpr (detail::is_optional<T>) {
      optional(field, value, Absence::omitted);
    } else if (present(field, !value.empty(), Absence::omitted)) {
      (*this)(field, value);
    } else {
      value.clear();
    }
  }

  /// Describes a value that the file holds only if the condition is true.
  template <class T>
  void when(bool holds, const Field& field, T& value) {
    if (documents() ? present(field, true, Absence::omitted) : holds) (*this)(field, value);
  }

  /// Describes one of several record types, chosen by the word in `tag`, next to the tag.
  template <class... Records>
  void one_of(const Field& tag, std::variant<Records...>& value,
              const std::string_view (&words)[sizeof...(Records)]) {
    std::size_t index = value.index();
    if (!documents()) {
      if (word(tag, index, words)) alternative(value, index);
      return;
    }
    for (index = 0; index < sizeof...(Records); ++index) {
      begin_alternative(tag, words, index);
      alternative(value, index);
    }
    end_alternatives();
  }

  /// Describes one of several record types under a name of its own, selected by its index.
  template <class... Records>
  void one_of(const Field& field, std::variant<Records...>& value, std::size_t index) {
    const std::size_t first = documents() ? 0 : index;
    const std::size_t last = documents() ? sizeof...(Records) : index + 1;
    for (std::size_t i = first; i < last; ++i) {
      begin(field);
      alternative(value, i);
      end();
    }
  }

  /// A rule between values of the record. Readers apply it if the record has no other error so far.
  /// `field` locates it: a name, or a path such as "camera.2.name".
  virtual void rule(bool /*holds*/, std::string_view /*field*/, std::string_view /*what*/,
                    std::string_view /*remedy*/) {}
  /// A rule about a single value. Readers apply it if that value is valid.
  virtual void limit(bool /*holds*/, std::string_view /*field*/, std::string_view /*what*/,
                     std::string_view /*remedy*/) {}
  /// True if this walk reads values from a file or a command line.
  [[nodiscard]] virtual bool reads() const { return false; }
  /// True if this walk writes a schema, which visits every alternative.
  [[nodiscard]] virtual bool documents() const { return false; }

 protected:
  /// Meaning of an absent value, and how it is written.
  enum class Absence { null, omitted, unchanged };

  virtual bool present(const Field&, bool has_value, Absence) = 0;
  virtual void number(const Field&, double&) = 0;
  virtual void integer(const Field&, std::int64_t&, std::int64_t least, std::int64_t most) = 0;
  virtual void truth(const Field&, bool&) = 0;
  virtual void text(const Field&, std::string&) = 0;
  virtual void path(const Field&, std::filesystem::path&) = 0;
  virtual void raw(const Field&, Value&) = 0;
  /// Index of a word in `words`; false if the file holds none of them.
  virtual bool word(const Field&, std::size_t& index, std::span<const std::string_view> words) = 0;
  /// A vector (cols 1) or a matrix as a list of rows; column-major in memory.
  virtual void numbers(const Field&, double* first, Eigen::Index rows, Eigen::Index cols) = 0;
  virtual void begin(const Field&) = 0;
  /// Number of items. `wanted` is the number that the file must hold.
  virtual std::size_t begin_list(const Field&, std::size_t size, std::size_t wanted) = 0;
  /// Keys of a table whose keys are not known in advance.
  virtual std::vector<std::string> begin_members(const Field&, std::vector<std::string> keys) = 0;
  virtual void end() = 0;
  virtual void begin_alternative(const Field& /*tag*/, std::span<const std::string_view> /*words*/,
                                 std::size_t /*index*/) {}
  virtual void end_alternatives() {}

 private:
  template <class T>
  static constexpr std::int64_t least_of() {
    return std::is_signed_v<T> ? static_cast<std::int64_t>(std::numeric_limits<T>::min()) : 0;
  }
  template <class T>
  static constexpr std::int64_t most_of() {
    constexpr auto most = static_cast<std::uint64_t>(std::numeric_limits<T>::max());
    constexpr auto widest = std::numeric_limits<std::int64_t>::max();
    return most < static_cast<std::uint64_t>(widest) ? static_cast<std::int64_t>(most) : widest;
  }

  template <class T>
  void optional(const Field& field, std::optional<T>& value, Absence absence) {
    if (!present(field, value.has_value(), absence)) return value.reset();
    (*this)(field, value ? *value : value.emplace());
  }

  template <class T>
  void eigen(const Field& field, T& value) {
    static_assert(std::is_same_v<typename T::Scalar, double> && !T::IsRowMajor);
    constexpr int rows = T::RowsAtCompileTime, cols = T::ColsAtCompileTime;
    if constexpr (rows != Eigen::Dynamic && cols != Eigen::Dynamic) {
      numbers(field, value.data(), rows, cols);
    } else if constexpr (cols == 1) {
      value.resize(static_cast<Eigen::Index>(
          begin_list(field, static_cast<std::size_t>(value.size()), Field::no_index)));
      for (Eigen::Index i = 0; i < value.size(); ++i)
        number(field.item(static_cast<std::size_t>(i)), value[i]);
      end();
    } else {
      std::vector<Eigen::VectorXd> list(static_cast<std::size_t>(value.rows()));
      for (std::size_t i = 0; i < list.size(); ++i)
        list[i] = value.row(static_cast<Eigen::Index>(i)).transpose();
      (*this)(field, list);
      if (!reads()) return;
      const Eigen::Index width = list.empty() ? 0 : list.front().size();
      bool equal = true;
      for (const Eigen::VectorXd& row : list) equal = equal && row.size() == width;
      limit(equal, field.name, "its rows are not equally long", field.remedy);
      value.resize(static_cast<Eigen::Index>(list.size()), width);
      for (std::size_t i = 0; i < list.size() && equal; ++i)
        value.row(static_cast<Eigen::Index>(i)) = list[i].transpose();
    }
  }

  template <class T>
  void members(const Field& field, T& value) {
    std::vector<std::string> keys;
    for (const auto& [key, member] : value) keys.push_back(key);
    keys = begin_members(field, std::move(keys));
    T result;
    for (std::size_t i = 0; i < keys.size(); ++i) {
      typename T::value_type::second_type member{};
      for (auto& [key, old] : value)
        if (key == keys[i]) member = std::move(old);
      Field one = field;
      one.name = keys[i];
      one.index = Field::no_index;
      (*this)(one, member);
      result.insert(result.end(), {keys[i], std::move(member)});
    }
    end();
    value = std::move(result);
  }

  template <class Variant, std::size_t at = 0>
  void alternative(Variant& value, std::size_t index) {
    if constexpr (at < std::variant_size_v<Variant>) {
      if (index != at) return alternative<Variant, at + 1>(value, index);
      if (value.index() != at) value.template emplace<at>();
      fields(*this, std::get<at>(value));
    }
  }
};

}  // namespace drape
