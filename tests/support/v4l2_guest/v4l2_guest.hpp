// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace drape::test {

/// Bus paths of the guest's cameras: 0 to 2 show what is written to /dev/video1, 3, 5 (their
/// capture nodes are /dev/video0, 2, 4); 3 is a webcam with a test picture (/dev/video6).
[[nodiscard]] std::string guest_camera(int index);

struct GuestRun {
  std::optional<std::string> cannot;  ///< why this host cannot run a guest; the rest is empty then
  int exit_code = -1;                 ///< exit code of the job; -1 if it did not end
  std::string output;                 ///< output of the job
  std::string without_kvm;            ///< why it ran in software emulation; empty if in KVM
};

/// Boots Debian's stock kernel with four vivid cameras in QEMU as an ordinary user, and runs the
/// shell lines `job` in it. The guest sees the host's files read-only, so it runs the programs of
/// this build, and `folder` writable under the same path; `later` are programs that the job runs
/// late, whose libraries are read ahead. Uses KVM if the host has it, otherwise software emulation.
/// Returns when the guest has powered off.
[[nodiscard]] GuestRun run_in_guest(const std::filesystem::path& folder, const std::string& job,
                                    const std::vector<std::filesystem::path>& later);

}  // namespace drape::test
