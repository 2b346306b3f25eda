// SPDX-License-Identifier: Apache-2.0
#include "console/server/lobby.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>

#include "console/server/gate.hpp"
#include "core/error.hpp"

namespace drape::console {
namespace {

constexpr int kGlance_ms = 20;  ///< interval at which an incomplete first line is read again
constexpr std::size_t kLongestMethod = 8;

}  // namespace

Lobby::Lobby(Options options, std::function<bool(const std::string&)> knows,
             std::function<void(int, bool)> serve)
    : options_(options),
      knows_(std::move(knows)),
      serve_(std::move(serve)),
      bell_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (bell_ < 0) throw internal_error("the system gives no event descriptor");
  watcher_ = std::thread([this] { watch(); });
  for (int k = 0; k < options_.workers; ++k) workers_.emplace_back([this] { work(); });
}

Lobby::~Lobby() {
  close();
  ::close(bell_);
}

void Lobby::enter(int socket) {
  {
    const std::lock_guard lock(mutex_);
    entered_.push_back({socket, Clock::now()});
  }
  const std::uint64_t one = 1;
  static_cast<void>(::write(bell_, &one, sizeof one));
}

void Lobby::close() {
  {
    const std::lock_guard lock(mutex_);
    if (ending_) return;
    ending_ = true;
  }
  const std::uint64_t one = 1;
  static_cast<void>(::write(bell_, &one, sizeof one));
  wake_.notify_all();
  watcher_.join();
  for (std::thread& worker : workers_) worker.join();
}

/// Peeks at the beginning of the first line without removing it.
void Lobby::look_at(Guest& guest) const {
  std::array<char, kLongestMethod + kTokenLength + 4> begin;
  const ssize_t got = ::recv(guest.socket, begin.data(), begin.size(), MSG_PEEK | MSG_DONTWAIT);
  if (got <= 0) {
    guest.is_gone = got == 0;
    return;
  }
  const std::string text(begin.data(), static_cast<std::size_t>(got));
  const std::size_t path = text.find('/');
  const bool is_whole = text.size() == begin.size() || text.find('\n') != std::string::npos ||
                        (path != std::string::npos && text.size() > path + kTokenLength + 1);
  guest.has_begun = true;
  guest.is_ready = is_whole;
  guest.is_known = is_whole && path != std::string::npos &&
                   knows_(text.substr(path, text.find(' ', path) - path));
}

void Lobby::watch() {
  std::vector<Guest> guests;
  std::vector<pollfd> watched;
  for (;;) {
    watched.assign(1, {bell_, POLLIN, 0});
    for (const Guest& guest : guests)
      watched.push_back({guest.has_begun ? -1 : guest.socket, POLLIN, 0});
    static_cast<void>(::poll(watched.data(), watched.size(), guests.empty() ? 1000 : kGlance_ms));
    std::uint64_t rung = 0;
    static_cast<void>(::read(bell_, &rung, sizeof rung));
    for (std::size_t k = 0; k < guests.size(); ++k)
      if (guests[k].has_begun || watched[k + 1].revents != 0) look_at(guests[k]);
    const std::lock_guard lock(mutex_);
    const auto now = Clock::now();
    int strangers = strangers_;
    for (const Guest& guest : ready_) strangers += guest.is_known ? 0 : 1;
    for (Guest& guest : guests) {
      const std::chrono::duration<double> waited = now - guest.since;
      if (guest.is_ready && (guest.is_known || strangers < options_.strangers)) {
        strangers += guest.is_known ? 0 : 1;
        ready_.push_back(guest);
        wake_.notify_one();
        guest.socket = -1;
      } else if (guest.is_gone || waited.count() > options_.patience_s || ending_) {
        ::close(guest.socket);
        guest.socket = -1;
      }
    }
    std::erase_if(guests, [](const Guest& guest) { return guest.socket < 0; });
    guests.insert(guests.end(), entered_.begin(), entered_.end());
    entered_.clear();
    while (guests.size() > (ending_ ? 0 : options_.waiting)) {
      ::close(guests.front().socket);
      guests.erase(guests.begin());
    }
    if (ending_) return;
  }
}

void Lobby::work() {
  for (;;) {
    Guest guest;
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [this] { return ending_ || !ready_.empty(); });
      if (ready_.empty()) return;
      guest = ready_.front();
      ready_.pop_front();
      if (!guest.is_known) ++strangers_;
    }
    serve_(guest.socket, guest.is_known);
    if (guest.is_known) continue;
    const std::lock_guard lock(mutex_);
    --strangers_;
  }
}

}  // namespace drape::console
