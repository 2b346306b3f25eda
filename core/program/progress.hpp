// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>

namespace drape {

/// Reports the progress of a long step. On a terminal: one line on stderr with the remaining time.
/// Under the front door (environment variable DRAPE_PROGRESS_FD): one line "<fraction> <what>" per
/// update on that descriptor. Otherwise silent.
class Progress {
 public:
  /// `quiet` suppresses the line on the terminal.
  Progress(std::string step, bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `fraction` is 0..1, `what` e.g. "camera cam1". Cheap to call often: output is rate-limited.
  void update(double fraction, const std::string& what);

 private:
  std::string step_;
  int descriptor_ = -1;
  bool terminal_ = false;
  bool line_open_ = false;
  std::chrono::steady_clock::time_point started_;
  std::chrono::steady_clock::time_point shown_;
};

/// Formats "[#####.....]  50 %  detect: camera cam1, 3 s, 3 s left".
[[nodiscard]] std::string progress_line(const std::string& step, double fraction,
                                        const std::string& what, double elapsed_s);

}  // namespace drape
