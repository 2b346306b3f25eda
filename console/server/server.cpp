// SPDX-License-Identifier: Apache-2.0
#include "console/server/server.hpp"

#include "console/server/gate.hpp"
#include "console/server/lobby.hpp"
#include "core/error.hpp"
#include "core/files/json_file.hpp"

// After Eigen: the system's resolver header, included here, defines `_res` as a macro.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <httplib.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <optional>

namespace drape::console {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::size_t kMostHead = 65536;  ///< bytes of request line and headers
constexpr std::size_t kMostPath = 4096;   ///< including its query
constexpr int kBacklog = 512;        ///< connections held by the system until they are accepted
constexpr int kMostRequests = 1000;  ///< per connection
constexpr auto kIdle = std::chrono::milliseconds(5000);
constexpr auto kGlance = std::chrono::milliseconds(250);
constexpr auto kBeat = std::chrono::seconds(10);  ///< interval of signals to a reader of events

constexpr const char* kPagePolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
    "connect-src "
    "'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// A socket with a deadline for the whole request, so that a client that sends a byte now and then
/// occupies its thread no longer than a silent one.
class DeadlineStream : public httplib::Stream {
 public:
  DeadlineStream(int socket, const ServerOptions& options) : socket_(socket), options_(options) {}

  void begin_request() {
    let_in(options_.stranger_s);
    left_ = kMostHead + options_.body_bytes;
  }
  /// Extends the deadline for the rest of the request.
  void let_in(double seconds) {
    until_ = Clock::now() +
             std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  }

  [[nodiscard]] bool wait_for_request(std::chrono::milliseconds patience) const {
    return begin_ < end_ || ready(POLLIN, static_cast<int>(patience.count()));
  }

  [[nodiscard]] bool is_readable() const override { return begin_ < end_ || ready(POLLIN, 0); }
  [[nodiscard]] bool is_writable() const override {
    // A connection closed by the client is readable without data.
    char byte = 0;
    if (::recv(socket_, &byte, 1, MSG_PEEK | MSG_DONTWAIT) == 0) return false;
    return ready(POLLOUT, 0);
  }

  ssize_t read(char* to, size_t size) override {
    if (begin_ == end_) {
      const auto left =
          std::chrono::duration_cast<std::chrono::milliseconds>(until_ - Clock::now());
      if (left.count() <= 0 || left_ == 0 || !ready(POLLIN, static_cast<int>(left.count())))
        return -1;
      const ssize_t got =
          ::recv(socket_, buffer_.data(), std::min(buffer_.size(), left_), MSG_NOSIGNAL);
      if (got <= 0) return got;
      begin_ = 0;
      end_ = static_cast<std::size_t>(got);
      left_ -= end_;
    }
    const std::size_t taken = std::min(size, end_ - begin_);
    std::memcpy(to, buffer_.data() + begin_, taken);
    begin_ += taken;
    return static_cast<ssize_t>(taken);
  }

  ssize_t write(const char* from, size_t size) override {
    std::size_t done = 0;
    while (done < size) {
      if (!ready(POLLOUT, static_cast<int>(1000 * options_.write_s))) return -1;
      const ssize_t sent = ::send(socket_, from + done, size - done, MSG_NOSIGNAL | MSG_DONTWAIT);
      if (sent < 0 && (errno == EINTR || errno == EAGAIN)) continue;
      if (sent <= 0) return -1;
      done += static_cast<std::size_t>(sent);
    }
    return static_cast<ssize_t>(size);
  }

  void get_remote_ip_and_port(std::string&, int&) const override {}
  /// Address at which the client reached the server, in the form of a Host header.
  void get_local_ip_and_port(std::string& ip, int& port) const override {
    sockaddr_storage own{};
    socklen_t size = sizeof own;
    char text[INET6_ADDRSTRLEN] = "";
    if (::getsockname(socket_, reinterpret_cast<sockaddr*>(&own), &size) != 0) return;
    if (own.ss_family == AF_INET) {
      const auto& v4 = reinterpret_cast<const sockaddr_in&>(own);
      ::inet_ntop(AF_INET, &v4.sin_addr, text, sizeof text);
      ip = text;
      port = ntohs(v4.sin_port);
    } else if (own.ss_family == AF_INET6) {
      const auto& v6 = reinterpret_cast<const sockaddr_in6&>(own);
      ::inet_ntop(AF_INET6, &v6.sin6_addr, text, sizeof text);
      const std::string name = text, mapped = "::ffff:";
      ip = name.starts_with(mapped) && name.find('.') != std::string::npos
               ? name.substr(mapped.size())
               : name;
      port = ntohs(v6.sin6_port);
    }
  }
  [[nodiscard]] socket_t socket() const override { return socket_; }

 private:
  [[nodiscard]] bool ready(short what, int patience_ms) const {
    pollfd watched{socket_, what, 0};
    int found = 0;
    while ((found = ::poll(&watched, 1, patience_ms)) < 0 && errno == EINTR) {
    }
    return found > 0 && (watched.revents & (what | POLLHUP | POLLERR)) != 0;
  }

  int socket_;
  const ServerOptions& options_;
  Clock::time_point until_;
  std::size_t left_ = 0;
  std::array<char, 8192> buffer_;
  std::size_t begin_ = 0, end_ = 0;
};

std::string text_page(const std::string& sentence) {
  return Json{{"error", sentence}}.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::optional<std::string> header(const httplib::Request& request, const char* name) {
  if (!request.has_header(name)) return std::nullopt;
  return request.get_header_value(name);
}

/// Addresses at which a listener can be reached; all interfaces if it listens on all of them.
std::vector<std::string> reached_at(const std::string& address) {
  if (address != "0.0.0.0" && address != "::") return {address};
  std::vector<std::string> all;
  ifaddrs* first = nullptr;
  if (::getifaddrs(&first) != 0) return {"127.0.0.1"};
  for (const ifaddrs* one = first; one != nullptr; one = one->ifa_next) {
    char text[INET_ADDRSTRLEN] = "";
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET ||
        (one->ifa_flags & IFF_UP) == 0 || (one->ifa_flags & IFF_LOOPBACK) != 0)
      continue;
    const auto* v4 = reinterpret_cast<const sockaddr_in*>(one->ifa_addr);
    all.emplace_back(::inet_ntop(AF_INET, &v4->sin_addr, text, sizeof text));
  }
  ::freeifaddrs(first);
  all.emplace_back("127.0.0.1");
  return all;
}

}  // namespace

/// Runs tasks immediately, since sockets wait in the lobby.
struct NoQueue : httplib::TaskQueue {
  void enqueue(std::function<void()> task) override { task(); }
  void shutdown() override {}
};

class WebServer::Impl : public httplib::Server {
 public:
  Impl(const ServerOptions& options, Events& events, Answer answer)
      : options_(options), events_(events), answer_(std::move(answer)) {
    new_task_queue = [] { return new NoQueue; };
    set_payload_max_length(options_.body_bytes);
    set_tcp_nodelay(true);
    // Instead of the library's SO_REUSEPORT, by which a second console would get half the requests.
    set_socket_options([](socket_t socket) {
      const int yes = 1;
      ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    const bool bound = options_.port == 0 ? (options_.port = bind_to_any_port(options_.address)) > 0
                                          : bind_to_port(options_.address, options_.port);
    if (!bound)
      throw usage_error(fmt::format("cannot listen on {} port {}", options_.address, options_.port),
                        "another console may run there: end it, or give --port 0 for any free one");
    ::listen(svr_sock_, kBacklog);  // with the library's 5 concurrent connections would be lost
    gate_.emplace(options_.token,
                  std::vector<std::string>{host("127.0.0.1"), host("localhost"), host("::1"),
                                           host(options_.address)},
                  options_.report_token);
    Lobby::Options lobby;
    lobby.workers = options_.connections;
    lobby.patience_s = options_.stranger_s;
    lobby_.emplace(
        lobby, [this](const std::string& path) { return gate_->knows(path); },
        [this](int socket, bool) { answer_all(socket); });
    set_pre_routing_handler([this](const httplib::Request& in, httplib::Response& out) {
      return is_let_in(in, out) ? HandlerResponse::Unhandled : HandlerResponse::Handled;
    });
    const Handler respond = [this](const httplib::Request& in, httplib::Response& out) {
      this->respond(in, out);
    };
    Get("/.*", respond);
    Post("/.*", respond);
    // Requests that the library itself refuses (such as a line that is not HTTP) have neither a
    // token nor a sentence.
    set_error_handler(HandlerWithResponse([](const httplib::Request&, httplib::Response& out) {
      if (!out.body.empty()) return HandlerResponse::Handled;
      add_headers(out, {});
      out.set_content(text_page("the request cannot be read"), "application/json");
      return HandlerResponse::Handled;
    }));
  }

  [[nodiscard]] std::vector<std::string> addresses() const {
    std::vector<std::string> all;
    for (const std::string& one : reached_at(options_.address))
      all.push_back(fmt::format("http://{}/{}/", host(one), options_.token));
    return all;
  }

  void serve() {
    listen_after_bind();
    lobby_->close();
  }

 private:
  /// Address in the form of a Host header.
  [[nodiscard]] std::string host(const std::string& address) const {
    const bool is_v6 = address.find(':') != std::string::npos;
    return fmt::format("{}{}{}:{}", is_v6 ? "[" : "", address, is_v6 ? "]" : "", options_.port);
  }

  bool process_and_close_socket(socket_t socket) override {
    lobby_->enter(socket);
    return true;
  }

  /// Answers all requests of a socket, then closes it.
  void answer_all(socket_t socket) {
    DeadlineStream stream(socket, options_);
    stream_ = &stream;
    int port = 0;
    stream.get_local_ip_and_port(local_address_, port);
    for (int count = 1; count <= kMostRequests && !events_.closed(); ++count) {
      if (!is_asked(stream)) break;
      stream.begin_request();
      bool closed = false;
      refused_ = false;
      if (!process_request(stream, count == kMostRequests, closed, nullptr) || closed || refused_)
        break;
    }
    ::shutdown(socket, SHUT_RDWR);
    ::close(socket);
  }

  /// Polls for a stop, so that open pages do not delay the end.
  [[nodiscard]] bool is_asked(const DeadlineStream& stream) const {
    for (auto waited = kGlance; waited <= kIdle && !events_.closed(); waited += kGlance)
      if (stream.wait_for_request(kGlance)) return true;
    return false;
  }

  static void add_headers(httplib::Response& out, const std::string& policy) {
    out.set_header("Content-Security-Policy", policy.empty() ? kPagePolicy : policy);
    out.set_header("X-Content-Type-Options", "nosniff");
    out.set_header("Referrer-Policy", "no-referrer");
    out.set_header("Cache-Control", "no-store");
    out.set_header("Cross-Origin-Resource-Policy", "same-origin");
    out.set_header("Cross-Origin-Opener-Policy", "same-origin");
  }

  void refuse(httplib::Response& out, int status, const std::string& why) const {
    out.status = status;
    out.set_content(text_page(why), "application/json");
  }

  /// Path as sent, without its query.
  static std::string path_of(const httplib::Request& in) {
    return in.target.substr(0, in.target.find_first_of("?#"));
  }

  /// Checks access before a body is read.
  bool is_let_in(const httplib::Request& in, httplib::Response& out) {
    add_headers(out, {});
    const Gate::Answer gate =
        gate_->ask({in.method, path_of(in), in.get_header_value("Host"), host(local_address_),
                    header(in, "Origin"), header(in, "Sec-Fetch-Site"),
                    header(in, "Sec-Fetch-Mode"), header(in, "Content-Type")});
    const bool long_one = in.target.size() > kMostPath;
    if (gate.status == 0 && !long_one) {
      stream_->let_in(options_.request_s);
      return true;
    }
    refused_ = true;  // so its body is not read
    gate.status != 0 ? refuse(out, gate.status, gate.why)
                     : refuse(out, 414, "the address is too long");
    return false;
  }

  void respond(const httplib::Request& in, httplib::Response& out) {
    const std::string path = path_of(in);
    const std::size_t end = path.find('/', 1);
    if (end == std::string::npos) return out.set_redirect("/" + options_.token + "/");
    const std::string route = path.substr(end);
    if (route == "/api/events") return watch(out);
    Request request;
    request.route = route;
    for (const auto& [key, value] : in.params) request.query[key] = value;
    request.body = in.body;
    Response response;
    try {
      response = answer_(request);
    } catch (const drape::Error& error) {
      const bool ours = error.kind() == ErrorKind::internal || error.kind() == ErrorKind::device;
      response = {ours ? 500 : 400, "application/json", text_page(error.what())};
    } catch (const std::exception& error) {
      response = {500, "application/json", text_page(error.what())};
    }
    add_policy(out, response.policy);
    for (const auto& [name, value] : response.headers) out.set_header(name, value);
    out.status = response.status;
    out.set_content(response.body, response.type);
  }

  static void add_policy(httplib::Response& out, const std::string& policy) {
    if (policy.empty()) return;
    out.headers.erase("Content-Security-Policy");
    out.set_header("Content-Security-Policy", policy);
  }

  void watch(httplib::Response& out) {
    if (++watchers_ > options_.watchers) {
      --watchers_;
      return refuse(out, 503, "too many pages are open");
    }
    auto last = std::make_shared<std::uint64_t>(events_.newest());
    auto beat = std::make_shared<Clock::time_point>();
    out.set_chunked_content_provider(
        "text/event-stream",
        [this, last, beat](std::size_t, httplib::DataSink& sink) {
          if (events_.closed()) {
            sink.done();
            return true;
          }
          std::string text = events_.wait(*last, std::chrono::milliseconds(500));
          if (text.empty() && Clock::now() - *beat > kBeat) text = ": alive\n\n";
          if (text.empty()) return sink.is_writable();
          *beat = Clock::now();
          return sink.write(text.data(), text.size());
        },
        [this](bool) { --watchers_; });
  }

  ServerOptions options_;
  Events& events_;
  Answer answer_;
  std::optional<Gate> gate_;
  std::atomic<int> watchers_ = 0;
  std::optional<Lobby> lobby_;
  // State of the request served by this thread.
  static thread_local bool refused_;
  static thread_local DeadlineStream* stream_;
  static thread_local std::string local_address_;  ///< at which the client reached this machine
};

thread_local bool WebServer::Impl::refused_ = false;
thread_local DeadlineStream* WebServer::Impl::stream_ = nullptr;
thread_local std::string WebServer::Impl::local_address_;

WebServer::WebServer(const ServerOptions& options, Events& events, Answer answer)
    : impl_(std::make_unique<Impl>(options, events, std::move(answer))) {}

WebServer::~WebServer() = default;

std::vector<std::string> WebServer::addresses() const {
  return impl_->addresses();
}

void WebServer::serve() {
  impl_->serve();
}

void WebServer::stop() {
  impl_->stop();
}

}  // namespace drape::console
