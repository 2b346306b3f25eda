// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error.hpp"

namespace drape {

/// Key order is kept, so that files read well and the same input gives the same bytes.
using Json = nlohmann::ordered_json;

/// A place in a JSON file that a program wrote: typed getters whose errors name the file and
/// the JSON pointer of the field.
class JsonNode {
 public:
  /// Parses the file and checks its "schema" key "drapebench/<name>/<n>"; a newer n is refused.
  static JsonNode open(const std::filesystem::path& file, const std::string& name, int version);

  [[nodiscard]] bool has(const std::string& key) const;  ///< present and not null
  [[nodiscard]] JsonNode at(const std::string& key) const;
  [[nodiscard]] std::vector<JsonNode> items(const std::string& key) const;
  [[nodiscard]] std::vector<std::pair<std::string, JsonNode>> members() const;
  [[nodiscard]] double number(const std::string& key) const;  ///< finite
  [[nodiscard]] std::optional<double> optional_number(const std::string& key) const;
  [[nodiscard]] int integer(const std::string& key) const;
  [[nodiscard]] std::optional<int> optional_integer(const std::string& key) const;
  [[nodiscard]] bool boolean(const std::string& key) const;
  [[nodiscard]] std::string text(const std::string& key) const;
  [[nodiscard]] std::optional<std::string> optional_text(const std::string& key) const;
  /// A text that can be one component of a path (require_plain_name).
  [[nodiscard]] std::string name(const std::string& key) const;
  [[nodiscard]] std::vector<std::string> texts(const std::string& key) const;
  [[nodiscard]] Eigen::VectorXd vector(const std::string& key, Eigen::Index size) const;
  [[nodiscard]] Eigen::Vector2d vector2(const std::string& key) const { return vector(key, 2); }
  [[nodiscard]] Eigen::Vector3d vector3(const std::string& key) const { return vector(key, 3); }
  [[nodiscard]] Eigen::Matrix2d matrix2(const std::string& key) const;  ///< array of rows
  [[nodiscard]] Eigen::Matrix3d matrix3(const std::string& key) const;  ///< array of rows
  [[nodiscard]] Eigen::MatrixXd matrix(const std::string& key) const;   ///< any size, rows equal

  [[noreturn]] void reject(const std::string& key, const std::string& what) const;
  /// File and field, for errors found elsewhere.
  [[nodiscard]] Where where(const std::string& key) const;
  [[nodiscard]] const Json& raw() const { return *value_; }

 private:
  JsonNode(std::shared_ptr<const Json> root, const Json* value, std::string file,
           std::string pointer);
  [[nodiscard]] const Json& member(const std::string& key) const;

  std::shared_ptr<const Json> root_;
  const Json* value_;
  std::string file_;
  std::string pointer_;
};

/// Array (of rows) for a vector (matrix).
[[nodiscard]] Json to_json(const Eigen::Ref<const Eigen::MatrixXd>& matrix);
[[nodiscard]] Json to_json_vector(const Eigen::Ref<const Eigen::VectorXd>& vector);

/// The value that a text writes; throws Json::parse_error, and Error with the file's name for what
/// is too deep or has a key twice in one object. Calling the parser itself compiles it: seconds.
[[nodiscard]] Json parse_json(std::string_view text, const std::string& file = "");

/// The same; discarded (`is_discarded()`) where the text is no JSON.
[[nodiscard]] Json try_json(std::string_view text);

/// Pretty-printed durable write. Arrays of plain numbers stay on one line.
void write_json(const std::filesystem::path& file, const Json& json);

/// The text write_json writes.
[[nodiscard]] std::string pretty(const Json& json);

}  // namespace drape
