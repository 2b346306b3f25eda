// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <array>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace drape {

/// A pipe whose writing end a child holds, or its reading end.
class Pipe {
 public:
  Pipe();  ///< throws Error(internal) when the system has none left
  ~Pipe();
  Pipe(Pipe&& other) noexcept;
  Pipe& operator=(Pipe&& other) noexcept;

  [[nodiscard]] int reading() const { return ends_[0]; }  ///< -1 once closed
  [[nodiscard]] int writing() const { return ends_[1]; }
  void close_reading();
  void close_writing();
  /// Appends what is there, of which the last `most` bytes are kept; closes at the end of the
  /// stream.
  void take(std::string& text, std::size_t most = std::string::npos);

 private:
  std::array<int, 2> ends_;
};

/// Descriptors that a child gets; -1: those of this process.
struct ChildStreams {
  int in = -1, out = -1, err = -1;
  int progress = -1;           ///< told to it as DRAPE_PROGRESS_FD
  std::vector<int> kept = {};  ///< more that it inherits, under the numbers they have here
  /// With an input of its own, or an empty one, and out of reach of Ctrl-C: this process ends its
  /// children in order.
  bool background = false;
  bool quiet = false;  ///< output that `out` and `err` do not take goes nowhere
};

/// Starts a program that dies with this process. Several threads may call it. Throws
/// Error(internal) when it is missing or cannot be started.
[[nodiscard]] pid_t start_child(const std::filesystem::path& program,
                                const std::vector<std::string>& arguments,
                                const ChildStreams& streams);

struct ChildEnd {
  int exit_code = 0;  ///< 128 + signal where a signal ended it
  int signal = 0;     ///< 0: none
};
[[nodiscard]] ChildEnd await_child(pid_t child);

/// Runs a program in the background, to its end, with its errors unheard; appends what it printed.
[[nodiscard]] ChildEnd run_child(const std::filesystem::path& program,
                                 const std::vector<std::string>& arguments, std::string& output);

/// Fraction (0..1) and text.
using ChildProgress = std::function<void(double, const std::string&)>;

/// Passes each whole line of progress on, and leaves the rest.
void pass_progress(std::string& text, const ChildProgress& progress);

/// A program beside the running one.
[[nodiscard]] std::filesystem::path program_beside(const std::string& name);

}  // namespace drape
