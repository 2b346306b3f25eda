// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "console/tasks/memory_folder.hpp"
#include "core/program/child.hpp"

namespace drape::console {

/// The resident session `drape capture RIG --out RECORDING --preview FOLDER`: the cameras remain
/// open, and a name typed to it takes a set. Its pictures are files in a folder in memory.
/// Thread-safe.
class CaptureSession {
 public:
  /// Callbacks from its own threads: a line that it printed, a camera with a new picture, and its
  /// end with its last sentence.
  struct Reports {
    std::function<void(const std::string& line)> said;
    std::function<void(const std::string& camera, std::uint64_t number)> picture;
    std::function<void(const std::string& sentence)> ended;
  };

  CaptureSession(const std::filesystem::path& rig, const std::filesystem::path& recording,
                 Reports reports);
  /// Ends it like `q`: stored sets become part of the recording.
  ~CaptureSession();
  CaptureSession(const CaptureSession&) = delete;
  CaptureSession& operator=(const CaptureSession&) = delete;

  [[nodiscard]] std::string shown() const;  ///< the command line
  [[nodiscard]] bool runs() const { return pid_ > 0; }
  /// Throws Error(device) if the session has ended.
  void type(const std::string& line);
  /// The newest picture of a camera (PGM) and its number; empty before the first.
  [[nodiscard]] std::string picture(const std::string& camera, std::uint64_t& number) const;

 private:
  void listen(Pipe& lines, int watch);

  std::vector<std::string> words_;
  MemoryFolder previews_;
  Reports reports_;
  mutable std::mutex mutex_;
  std::map<std::string, std::uint64_t> numbers_;
  Pipe keyboard_;
  std::atomic<pid_t> pid_ = 0;
  std::thread thread_;
};

}  // namespace drape::console
