// SPDX-License-Identifier: Apache-2.0
#include "console/server/server.hpp"

#include "core/error.hpp"

// After Eigen: the system's resolver header, included here, defines `_res` as a macro.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <httplib.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <thread>
#include <utility>

namespace drape::console {

// ---- events ------------------------------------------------------------------------------------

void Events::send(const std::string& name, const std::string& data) {
  {
    const std::lock_guard lock(mutex_);
    kept_.push_back(fmt::format("event: {}\ndata: {}\n\n", name, data));
    if (kept_.size() > kKept) kept_.pop_front();
    ++newest_;
  }
  wake_.notify_all();
}

std::string Events::wait(std::uint64_t& last, std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  wake_.wait_for(lock, patience, [&] { return closed_ || newest_ > last; });
  if (closed_) return {};
  const std::uint64_t new_ones = std::min<std::uint64_t>(newest_ - last, kept_.size());
  std::string text;
  for (auto it = kept_.end() - static_cast<std::ptrdiff_t>(new_ones); it != kept_.end(); ++it)
    text += *it;
  last = newest_;
  return text;
}

void Events::close() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  wake_.notify_all();
}

// ---- gate --------------------------------------------------------------------------------------

namespace {

/// Compares in constant time, wherever the texts differ.
bool equal(const std::string& a, const std::string& b) {
  unsigned char differ = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < a.size(); ++i)
    differ |= static_cast<unsigned char>(a[i] ^ (b.empty() ? 0 : b[i % b.size()]));
  return differ == 0;
}

/// True for a loopback name of this machine with any port, such as that of an `ssh -L` on the other
/// side. No page from elsewhere has it as its origin.
bool is_loopback(const std::string& host) {
  const std::string name = host.substr(0, host.rfind(':'));
  return name == "127.0.0.1" || name == "localhost" || name == "[::1]";
}

}  // namespace

Gate::Gate(std::string token, std::vector<std::string> hosts, std::string report_token)
    : token_(std::move(token)), report_token_(std::move(report_token)), hosts_(std::move(hosts)) {}

bool Gate::knows(const std::string& path) const {
  const std::string given = path.empty() ? "" : path.substr(1, path.find('/', 1) - 1);
  const bool of_report = !report_token_.empty() && equal(given, report_token_);
  return equal(given, token_) || of_report;
}

Gate::Answer Gate::ask(const Knock& knock) const {
  const std::size_t end = knock.path.find('/', 1);
  const std::string route = end == std::string::npos ? "" : knock.path.substr(end);
  const bool of_report = route == "/report.html";
  const std::string given = knock.path.empty() ? "" : knock.path.substr(1, end - 1);
  if (knock.path.empty() || knock.path[0] != '/' || !knows(knock.path) ||
      !equal(given, of_report && !report_token_.empty() ? report_token_ : token_))
    return {401, "open the address that `drape bench` printed: it holds the token"};
  if ((knock.reached.empty() || knock.host != knock.reached) &&
      !(is_loopback(knock.reached) && is_loopback(knock.host)) &&
      std::find(hosts_.begin(), hosts_.end(), knock.host) == hosts_.end())
    return {403, "this server is not called by that name"};
  if (knock.origin && *knock.origin != "http://" + knock.host)
    return {403, "a page from elsewhere may not ask"};
  const bool navigation = knock.method == "GET" && knock.fetch_mode == "navigate";
  if (knock.fetch_site && *knock.fetch_site != "same-origin" && *knock.fetch_site != "none" &&
      !navigation)
    return {403, "a page from elsewhere may not ask"};
  Answer answer;
  answer.route = route;
  const bool act = answer.route == "/api/do";
  if (knock.method != (act ? "POST" : "GET") && (act || knock.method != "HEAD"))
    return {405, act ? "POST only" : "GET only"};
  // A form of another page cannot send this type without a preflight request.
  if (act && !(knock.content_type && knock.content_type->starts_with("application/json")))
    return {415, "application/json only"};
  return answer;
}

std::string make_token() {
  std::array<unsigned char, 16> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw internal_error("the system gives no random numbers");
  std::string text;
  for (const unsigned char byte : bytes)
    for (const int digit : {byte >> 4, byte & 15}) text += "0123456789abcdef"[digit];
  return text;
}

namespace {

// ---- sockets that wait -------------------------------------------------------------------------

constexpr int kStrangers = 8;          ///< threads for requests without the token
constexpr std::size_t kWaiting = 256;  ///< sockets that wait; beyond it the longest is closed
constexpr int kGlance_ms = 20;         ///< interval at which an incomplete first line is read again
constexpr std::size_t kLongestMethod = 8;
using Clock = std::chrono::steady_clock;

/// Sockets whose request has not arrived yet: one thread waits for all of them, so that silent ones
/// do not occupy threads needed by clients with the token. Sockets are counted before they are
/// queued: if too many wait, the one waiting longest is closed.
class Lobby {
 public:
  /// `serve` answers a socket and closes it.
  Lobby(const ServerOptions& options, const Gate& gate, std::function<void(int socket)> serve)
      : patience_s_(options.stranger_s), gate_(gate), serve_(std::move(serve)) {
    if (bell_ < 0) throw internal_error("the system gives no event descriptor");
    watcher_ = std::thread([this] { watch(); });
    for (int k = 0; k < options.connections; ++k) workers_.emplace_back([this] { work(); });
  }
  ~Lobby() {
    close();
    ::close(bell_);
  }
  Lobby(const Lobby&) = delete;
  Lobby& operator=(const Lobby&) = delete;

  void enter(int socket) {
    {
      const std::lock_guard lock(mutex_);
      entered_.push_back({socket, Clock::now()});
    }
    ring();
  }

  /// Closes all waiting sockets, and waits for those being served.
  void close() {
    {
      const std::lock_guard lock(mutex_);
      if (std::exchange(ending_, true)) return;
    }
    ring();
    wake_.notify_all();
    watcher_.join();
    for (std::thread& worker : workers_) worker.join();
  }

 private:
  struct Guest {
    int socket = -1;
    Clock::time_point since;
    bool has_begun = false;  ///< true if a part of its first line has arrived
    bool is_known = false, is_ready = false, is_gone = false;
  };

  void ring() const {
    const std::uint64_t one = 1;
    static_cast<void>(::write(bell_, &one, sizeof one));
  }

  /// Peeks at the beginning of the first line without removing it.
  void look_at(Guest& guest) const {
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
                     gate_.knows(text.substr(path, text.find(' ', path) - path));
  }

  void watch() {
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
        if (guest.is_ready && (guest.is_known || strangers < kStrangers)) {
          strangers += guest.is_known ? 0 : 1;
          ready_.push_back(guest);
          wake_.notify_one();
          guest.socket = -1;
        } else if (guest.is_gone || waited.count() > patience_s_ || ending_) {
          ::close(guest.socket);
          guest.socket = -1;
        }
      }
      std::erase_if(guests, [](const Guest& guest) { return guest.socket < 0; });
      guests.insert(guests.end(), entered_.begin(), entered_.end());
      entered_.clear();
      while (guests.size() > (ending_ ? 0 : kWaiting)) {
        ::close(guests.front().socket);
        guests.erase(guests.begin());
      }
      if (ending_) return;
    }
  }

  void work() {
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
      serve_(guest.socket);
      if (guest.is_known) continue;
      const std::lock_guard lock(mutex_);
      --strangers_;
    }
  }

  const double patience_s_;  ///< for the first line of a request, s
  const Gate& gate_;
  const std::function<void(int)> serve_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<Guest> entered_;
  std::deque<Guest> ready_;
  int strangers_ = 0;  ///< number being served
  bool ending_ = false;
  const int bell_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);  ///< signalled when a socket enters
  std::thread watcher_;
  std::vector<std::thread> workers_;
};

// ---- server ------------------------------------------------------------------------------------

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
    auto* address = reinterpret_cast<sockaddr*>(&own);
    char host[NI_MAXHOST] = "", service[NI_MAXSERV] = "";
    if (::getsockname(socket_, address, &size) != 0 ||
        ::getnameinfo(address, size, host, sizeof host, service, sizeof service,
                      NI_NUMERICHOST | NI_NUMERICSERV) != 0)
      return;
    const std::string name = host, mapped = "::ffff:";
    ip = name.starts_with(mapped) && name.find('.') != std::string::npos
             ? name.substr(mapped.size())
             : name.substr(0, name.find('%'));
    port = std::atoi(service);
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

std::string error_json(const std::string& sentence) {
  return dumped({{"error", sentence}});
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

/// Runs tasks immediately, since sockets wait in the lobby.
struct NoQueue : httplib::TaskQueue {
  void enqueue(std::function<void()> task) override { task(); }
  void shutdown() override {}
};

class HttpServer : public WebServer, private httplib::Server {
 public:
  HttpServer(const ServerOptions& options, Events& events,
             std::function<Response(const Request&)> answer)
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
    lobby_.emplace(options_, *gate_, [this](int socket) { answer_all(socket); });
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
      out.set_content(error_json("the request cannot be read"), "application/json");
      return HandlerResponse::Handled;
    }));
  }

  [[nodiscard]] std::vector<std::string> addresses() const override {
    std::vector<std::string> all;
    for (const std::string& one : reached_at(options_.address))
      all.push_back(fmt::format("http://{}/{}/", host(one), options_.token));
    return all;
  }

  void serve() override {
    listen_after_bind();
    lobby_->close();
  }
  void end() override { stop(); }

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
    out.set_content(error_json(why), "application/json");
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
      response = {ours ? 500 : 400, "application/json", error_json(error.what())};
    } catch (const std::exception& error) {
      response = {500, "application/json", error_json(error.what())};
    }
    out.headers.clear();
    add_headers(out, response.policy);
    for (const auto& [name, value] : response.headers) out.set_header(name, value);
    out.status = response.status;
    out.set_content(response.body, response.type);
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
  const std::function<Response(const Request&)> answer_;
  std::optional<Gate> gate_;
  std::atomic<int> watchers_ = 0;
  std::optional<Lobby> lobby_;
  // State of the request served by this thread.
  static inline thread_local bool refused_ = false;
  static inline thread_local DeadlineStream* stream_ = nullptr;
  static inline thread_local std::string local_address_;  ///< at which the client reached it
};

}  // namespace

std::string dumped(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::unique_ptr<WebServer> make_server(const ServerOptions& options, Events& events,
                                       std::function<Response(const Request&)> answer) {
  return std::make_unique<HttpServer>(options, events, std::move(answer));
}

}  // namespace drape::console
