// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace drape::console {

struct ConsoleOptions {
  std::filesystem::path rig;        ///< folder of the rig, or its rig.toml
  std::filesystem::path recording;  ///< empty: the rig's
  std::filesystem::path out;        ///< empty: out/<rig name>, as `drape run` has it
  bool replay = false;              ///< the recording's sets instead of cameras
  std::string address = "127.0.0.1";
  int port = 8040;  ///< 0: any free one
};

/// The bench in a browser: one rig, one output folder, one web server. Everything that is pressed
/// is in `<out>/console/session.jsonl` before it is answered, everything that is made is a file
/// that the programs wrote, so that the next Console on the same folder shows the same state.
class Console {
 public:
  /// Listens at once. Throws Error(usage) for an address in use, Error(bad_input) for a rig that
  /// cannot be read or a folder on which another console works.
  explicit Console(const ConsoleOptions& options);
  ~Console();
  Console(const Console&) = delete;
  Console& operator=(const Console&) = delete;

  [[nodiscard]] std::vector<std::string> addresses()
      const;     ///< address of the page, with the token
  void serve();  ///< until stop() is called from another thread
  void stop();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace drape::console
