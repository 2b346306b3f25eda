// SPDX-License-Identifier: Apache-2.0
#include "tests/support/v4l2_guest/v4l2_guest.hpp"

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <stdexcept>

#include "core/files/files.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;

constexpr int kLongest_s = 2400;  ///< boot and job; about 40 on an idle host

struct Shell {
  int exit_code = -1;
  std::string output;
};

Shell shell(const std::string& line) {
  Shell result;
  FILE* pipe = ::popen((line + " 2>&1 </dev/null").c_str(), "re");
  if (pipe == nullptr) return result;
  char buffer[4096];
  while (const std::size_t got = std::fread(buffer, 1, sizeof buffer, pipe))
    result.output.append(buffer, got);
  const int status = ::pclose(pipe);
  if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  return result;
}

std::string last_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  const std::size_t at = text.rfind('\n');
  return at == std::string::npos ? text : text.substr(at + 1);
}

/// A device node is not sufficient: without the processor's own module the guest hangs in it.
std::string why_no_kvm() {
  if (::access("/dev/kvm", R_OK | W_OK) != 0) return "/dev/kvm is not there or not allowed";
  if (!fs::exists("/sys/module/kvm_intel") && !fs::exists("/sys/module/kvm_amd"))
    return "neither kvm_intel nor kvm_amd is loaded";
  return "";
}

std::string shared_folder(const std::string& tag, const fs::path& folder, const char* more) {
  return fmt::format(
      " -fsdev local,id={0},path='{1}',security_model=none,multidevs=remap{2}"
      " -device virtio-9p-pci,fsdev={0},mount_tag={0}",
      tag, folder.string(), more);
}

/// A shell line that reads the libraries of a program ahead in the background. Read page by page on
/// use, those for image files alone take an emulated machine 15 s.
std::string read_ahead(const std::vector<fs::path>& programs) {
  std::string files;
  for (const fs::path& program : programs)
    files += "'" + program.string() + "'\n" +
             shell("ldd '" + program.string() + "' | grep -o '/[^ ]*'").output;
  std::replace(files.begin(), files.end(), '\n', ' ');
  return fmt::format("cat {} >/dev/null 2>&1 &\n", files);
}

/// Debian's kernel, unpacked if possible, since an emulated machine takes long to unpack it.
fs::path kernel_of(const fs::path& guest) {
  const fs::path unpacked = guest / "vmlinux";
  return fs::exists(unpacked) ? unpacked : guest / "vmlinuz";
}

/// Runs the guest to its end; `timeout` ends one that does not boot or hangs in its job.
Shell boot(const fs::path& guest, const fs::path& folder, const std::string& accelerator) {
  const std::string qemu = fmt::format(
      "exec timeout --kill-after=5 {} qemu-system-x86_64 {} -smp 2 -m 768 -nographic -nodefaults"
      " -no-reboot -serial stdio -kernel '{}' -initrd '{}'"
      " -append 'console=ttyS0 panic=-1 quiet mitigations=off nokaslr no_timer_check tsc=reliable"
      " random.trust_cpu=on apparmor=0 drape_folder={}'",
      kLongest_s, accelerator, kernel_of(guest).string(), (guest / "initrd.gz").string(),
      folder.string());
  return shell(qemu + shared_folder("host", "/", ",readonly=on") +
               shared_folder("folder", folder, ""));
}

}  // namespace

std::string guest_camera(int index) {
  return fmt::format("platform:vivid-{:03}", index);
}

GuestRun run_in_guest(const fs::path& folder, const std::string& job,
                      const std::vector<fs::path>& later) {
  GuestRun run;
  const fs::path guest = program("").parent_path().parent_path() / "v4l2_guest";
  const fs::path script = source_root() / "tests/support/v4l2_guest/prepare.sh";
  const Shell prepared = shell(fmt::format("bash '{}' '{}'", script.string(), guest.string()));
  if (prepared.exit_code == 77) {
    run.cannot = last_line(prepared.output);
    return run;
  }
  // Only missing features of the host may skip a test: a failing script is an error.
  if (prepared.exit_code != 0)
    throw std::runtime_error("preparing the V4L2 guest failed: " + prepared.output);
  write_durable(folder / "job.sh",
                fmt::format("cd '{}'\n{}{}", folder.string(), read_ahead(later), job));
  Shell machine;
  run.without_kvm = why_no_kvm();
  if (run.without_kvm.empty()) {
    machine = boot(guest, folder, "-accel kvm -cpu host");
    if (!fs::exists(folder / "booted")) run.without_kvm = "the guest does not boot with KVM";
  }
  if (!fs::exists(folder / "booted"))
    machine = boot(guest, folder, "-accel tcg,thread=multi -cpu max,la57=off");
  if (!fs::exists(folder / "booted")) {
    run.cannot = "the guest does not boot here: " + last_line(machine.output);
    return run;
  }
  run.output = fs::exists(folder / "output.txt") ? read_text(folder / "output.txt") : "";
  std::ifstream(folder / "exit_code") >> run.exit_code;
  return run;
}

}  // namespace drape::test
