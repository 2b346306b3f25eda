// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace drape {

/// Reason why a program stopped; the value is the exit code (1 is reserved for NO-GO).
enum class ErrorKind { usage = 2, bad_input = 3, device = 4, internal = 5 };

/// Location of an error. Parts that are unknown or do not apply stay empty.
struct Where {
  std::string file = {};         ///< path as the user gave it
  std::optional<int> line = {};  ///< 1-based line of the file
  std::string field = {};        ///< key, column or JSON pointer
  std::string camera = {};       ///< camera name
  std::string set = {};          ///< frame set of the recording

  /// Describes the location, e.g. "rig.toml:12, field `camera.width_px`"; empty if unknown.
  [[nodiscard]] std::string describe() const;
};

/// The only exception type of the drapebench libraries: what failed, where, and what to do.
class Error : public std::exception {
 public:
  Error(ErrorKind kind, std::string what_failed, Where where, std::string what_to_do);
  /// Combines several errors of one file; the first names the others. `faults` is not empty.
  explicit Error(std::vector<Error> faults);

  [[nodiscard]] const char* what() const noexcept override { return text_.c_str(); }
  [[nodiscard]] ErrorKind kind() const noexcept { return kind_; }
  [[nodiscard]] const std::string& what_failed() const noexcept { return what_failed_; }
  [[nodiscard]] const Where& where() const noexcept { return where_; }
  [[nodiscard]] const std::string& what_to_do() const noexcept { return what_to_do_; }
  /// All errors as single ones, this one first.
  [[nodiscard]] std::vector<Error> each() const;

 private:
  ErrorKind kind_;
  std::string what_failed_;
  Where where_;
  std::string what_to_do_;
  std::string text_;
  std::shared_ptr<const std::vector<Error>> faults_;  ///< every error, if there are several
};

/// Throws one Error that names them all; does nothing if there are none.
void throw_if_any(std::vector<Error> faults);

/// Short constructors of an Error by kind.
[[nodiscard]] Error bad_input(std::string what_failed, Where where, std::string what_to_do);
[[nodiscard]] Error usage_error(std::string what_failed, std::string what_to_do);
[[nodiscard]] Error internal_error(std::string what_failed, Where where = {});

}  // namespace drape
