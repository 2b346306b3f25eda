// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>

#include "core/files/json_file.hpp"

namespace drape::test {

/// Most memory of a server; a sanitizer takes as much again, and more, for itself.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr double kMost_mb = 1500;
#else
inline constexpr double kMost_mb = 250;
#endif

/// `drape-bench RIG --replay --out OUT --port 0` as a process of its own, ended with the object.
class RunningBench {
 public:
  /// `limit_kb`: largest file that it may write; 0: none. Without `replay` it opens the rig's
  /// cameras. Throws when it does not listen.
  RunningBench(const std::filesystem::path& rig, const std::filesystem::path& out, int limit_kb = 0,
               bool replay = true);
  ~RunningBench();
  RunningBench(const RunningBench&) = delete;
  RunningBench& operator=(const RunningBench&) = delete;

  [[nodiscard]] const std::string& address() const { return address_; }  ///< with its last `/`
  [[nodiscard]] std::string origin() const;  ///< "http://127.0.0.1:PORT"
  [[nodiscard]] int port() const;
  [[nodiscard]] std::string token() const;
  [[nodiscard]] bool runs() const;
  [[nodiscard]] double memory_mb() const;  ///< resident, the most so far
  [[nodiscard]] double cpu_s() const;      ///< CPU time of the server alone, so far
  void kill();                             ///< as a power cut would
  int end(int signal);                     ///< asks it to end; its exit code, -1: by the signal
  void hold_job();                         ///< stops the program of a job, once there is one
  void let_job_go();

  /// Answers of curl, which is foreign to this project.
  [[nodiscard]] Json get(const std::string& route) const;
  [[nodiscard]] int act(const Json& what) const;  ///< status
  /// Until nothing runs or waits; the state then. Throws when that does not come.
  [[nodiscard]] Json idle_state() const;

 private:
  [[nodiscard]] std::string about(const std::string& what) const;

  pid_t pid_ = -1, held_ = -1;
  std::string address_;
};

/// Status and body of a request by curl; `arguments` in shell quotes where needed.
struct CurlAnswer {
  int status = 0;  ///< 0: no answer
  std::string body;
};
[[nodiscard]] CurlAnswer curl(const std::string& arguments);

}  // namespace drape::test
