// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "core/files/files.hpp"

namespace drape {

/// A pipe of which a child process holds one end.
class Pipe {
 public:
  Pipe();  ///< throws Error(internal) if the system is out of descriptors

  [[nodiscard]] int reading() const { return reading_.get(); }  ///< -1 when closed
  [[nodiscard]] int writing() const { return writing_.get(); }
  void close_reading() { reading_.reset(); }
  void close_writing() { writing_.reset(); }
  /// Appends available data, keeping the last `most` bytes; closes the pipe at the end of the
  /// stream.
  void take(std::string& text, std::size_t most = std::string::npos);

 private:
  Descriptor reading_, writing_;
};

/// Descriptors passed to a child; -1 inherits those of this process.
struct ChildStreams {
  int in = -1, out = -1, err = -1;
  int progress = -1;           ///< announced to the child as DRAPE_PROGRESS_FD
  std::vector<int> kept = {};  ///< further inherited descriptors, under the same numbers
  /// Runs with `in` or an empty input, shielded from Ctrl-C: this process ends its children in
  /// order.
  bool background = false;
  bool quiet = false;  ///< discards output that `out` and `err` do not capture
};

/// Words of a command line: text, paths and whole numbers.
template <class... Parts>
[[nodiscard]] std::vector<std::string> words_of(const Parts&... parts) {
  const auto word = [](const auto& part) {
    if constexpr (std::is_arithmetic_v<std::decay_t<decltype(part)>>)
      return std::to_string(part);
    else
      return std::filesystem::path(part).string();
  };
  return {word(parts)...};
}

/// Starts a program that dies with this process. Thread-safe. Throws Error(internal) if the program
/// is missing or cannot be started.
[[nodiscard]] pid_t start_child(const std::filesystem::path& program,
                                const std::vector<std::string>& arguments,
                                const ChildStreams& streams);

struct ChildEnd {
  int exit_code = 0;  ///< 128 + signal if a signal ended it
  int signal = 0;     ///< 0 if none
};
[[nodiscard]] ChildEnd await_child(pid_t child);

/// Runs a program in its own process group and waits; appends only its standard output.
[[nodiscard]] ChildEnd run_child(const std::filesystem::path& program,
                                 const std::vector<std::string>& arguments, std::string& output);

/// Progress callback: fraction (0..1) and text.
using ChildProgress = std::function<void(double, const std::string&)>;

/// Passes each complete progress line on and keeps the remainder in `text`.
void pass_progress(std::string& text, const ChildProgress& progress);

/// Returns the error that a program started with --json printed, or the first problem that `drape
/// check` found; nullopt if there is none. `where` is one phrase in Where::file.
[[nodiscard]] std::optional<Error> error_printed(const std::string& output, int exit_code);

/// Path of a program in the folder of the running one.
[[nodiscard]] std::filesystem::path program_beside(const std::string& name);

}  // namespace drape
