// SPDX-License-Identifier: Apache-2.0
#include "tests/support/gige_camera/debian_camera.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <stdexcept>

#include "tests/support/paths.hpp"

namespace drape::test {
namespace {

struct Prepared {
  std::string program, cannot;
};

const Prepared& prepared() {
  static const Prepared result = [] {
    const auto script = source_root() / "tests/support/gige_camera/debian_camera.sh";
    const auto folder = program("").parent_path().parent_path() / "debian_camera";
    const std::string line = "bash '" + script.string() + "' '" + folder.string() + "' 2>&1";
    FILE* pipe = ::popen(line.c_str(), "re");
    std::array<char, 1024> text{};
    const bool read = pipe != nullptr && std::fgets(text.data(), text.size(), pipe) != nullptr;
    const int status = pipe == nullptr ? -1 : ::pclose(pipe);
    std::string said = read ? text.data() : "";
    while (!said.empty() && said.back() == '\n') said.pop_back();
    return status == 0 ? Prepared{said, ""} : Prepared{"", said};
  }();
  return result;
}

/// The camera looks for its address among those of the network cards.
void add_loopback_address(const std::string& address) {
  const int descriptor = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ifreq request{};
  const std::string alias = "lo:" + address.substr(address.rfind('.') + 1);
  alias.copy(request.ifr_name, IFNAMSIZ - 1);
  sockaddr_in inet{};
  inet.sin_family = AF_INET;
  ::inet_pton(AF_INET, address.c_str(), &inet.sin_addr);
  std::memcpy(&request.ifr_addr, &inet, sizeof inet);
  const bool good = ::ioctl(descriptor, SIOCSIFADDR, &request) == 0;
  const std::string why = std::strerror(errno);
  ::close(descriptor);
  if (!good) throw std::runtime_error(address + " cannot be added to loopback: " + why);
}

/// Number of sockets in this network on the port of GigE Vision's control protocol.
int control_sockets() {
  std::ifstream table("/proc/thread-self/net/udp");
  int found = 0;
  for (std::string line; std::getline(table, line);)
    found += line.find(":0F74 ") != std::string::npos;
  return found;
}

}  // namespace

std::optional<std::string> DebianCamera::cannot() {
  if (prepared().program.empty()) return prepared().cannot;
  return std::nullopt;
}

DebianCamera::DebianCamera(const std::string& address, const std::string& serial)
    : address_(address), serial_(serial) {
  if (address != "127.0.0.1") add_loopback_address(address);
  switch_on();
}

void DebianCamera::switch_on() {
  const int before = control_sockets();
  process_ = ::fork();
  if (process_ == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int nowhere = ::open("/dev/null", O_RDWR);
    for (const int d : {0, 1, 2}) ::dup2(nowhere, d);
    ::execl(prepared().program.c_str(), "arv-fake-gv-camera-0.8", "-i", address_.c_str(), "-s",
            serial_.c_str(), static_cast<char*>(nullptr));
    ::_exit(127);
  }
  // It listens once it has one socket for itself and one for broadcast discovery.
  while (control_sockets() < before + 2) {
    if (::waitpid(process_, nullptr, WNOHANG) == process_)
      throw std::runtime_error("Debian's camera ended at once");
    ::usleep(10'000);
  }
}

DebianCamera::~DebianCamera() {
  if (starved_.joinable()) starved_.join();
  ::kill(process_, SIGKILL);
  ::waitpid(process_, nullptr, 0);
}

void DebianCamera::switch_off_and_on() {
  ::kill(process_, SIGKILL);
  ::waitpid(process_, nullptr, 0);
  switch_on();
}

void DebianCamera::starve(double seconds) {
  if (starved_.joinable()) starved_.join();
  ::kill(process_, SIGSTOP);
  starved_ = std::thread([this, seconds] {
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
    ::kill(process_, SIGCONT);
  });
}

bool DebianCamera::drew(const std::vector<std::uint8_t>& pixels, int width_px) {
  if (pixels.empty()) return false;
  const auto width = static_cast<std::size_t>(width_px);
  for (std::size_t first = 0; first < 255; ++first) {
    bool same = true;
    for (std::size_t i = 0; same && i < pixels.size(); ++i)
      same = pixels[i] == (first + i % width + i / width) % 255;
    if (same) return true;
  }
  return false;
}

}  // namespace drape::test
