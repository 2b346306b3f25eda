// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace drape::console {

struct ConsoleOptions {
  std::filesystem::path rig;        ///< folder of the rig, or its rig.toml
  std::filesystem::path recording;  ///< empty for that of the rig
  std::filesystem::path out;        ///< empty for out/<rig name>, as in `drape run`
  bool replay = false;              ///< use the recording's sets instead of cameras
  std::string address = "127.0.0.1";
  int port = 8040;  ///< 0 for any free one
};

/// The bench in a browser: one rig, one output folder, one web server. Every action is written to
/// `<out>/console/session.jsonl` before it is answered, and every result is a file written by the
/// programs, so that the next Console on the same folder shows the same state.
class Console {
 public:
  /// Listens immediately. Throws Error(usage) for an address in use, Error(bad_input) for a rig
  /// that cannot be read or a folder in use by another console.
  explicit Console(const ConsoleOptions& options);
  ~Console();
  Console(const Console&) = delete;
  Console& operator=(const Console&) = delete;

  [[nodiscard]] std::vector<std::string> addresses()
      const;     ///< address of the page, including the token
  void serve();  ///< runs until stop() is called from another thread
  void stop();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace drape::console
