// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "console/tasks/memory_folder.hpp"
#include "console/tasks/process.hpp"
#include "core/detections.hpp"

namespace drape::console {

/// Marks in the scaled pictures of live cameras, found repeatedly by `drape detect` while a page
/// requests them, on a thread of the lowest priority. Thread-safe.
class LiveMarks {
 public:
  /// The newest picture (PGM) of each camera; empty while there is none.
  using Newest = std::function<std::map<std::string, std::string>()>;
  /// Text of a rig whose cameras have these sizes in px, to be read from a folder.
  using RigOf = std::function<std::string(const std::filesystem::path& folder,
                                          const std::map<std::string, std::pair<int, int>>& px)>;

  LiveMarks(Newest newest, RigOf rig_of);
  ~LiveMarks();
  LiveMarks(const LiveMarks&) = delete;
  LiveMarks& operator=(const LiveMarks&) = delete;

  /// Last marks found on this surface, in pixels of the pictures; null before the first detection.
  /// Keeps detection running for some seconds.
  [[nodiscard]] std::shared_ptr<const Detections> look(Surface surface);

 private:
  void work();
  [[nodiscard]] std::shared_ptr<const Detections> look_now(Surface surface);

  Newest newest_;
  RigOf rig_of_;
  MemoryFolder folder_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::chrono::steady_clock::time_point asked_ = {};
  Surface surface_ = Surface::target;  ///< surface requested last
  std::map<Surface, std::shared_ptr<const Detections>> found_;
  std::atomic<pid_t> child_ = 0;
  std::atomic<bool> ending_ = false;
  std::thread thread_;
};

}  // namespace drape::console
