// SPDX-License-Identifier: Apache-2.0
#include "console/server/server.hpp"

#include <arpa/inet.h>
#include <fmt/ranges.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <charconv>
#include <chrono>
#include <csignal>
#include <list>
#include <set>
#include <sstream>
#include <utility>

#include "core/error.hpp"

namespace drape::console {

// ---- events ------------------------------------------------------------------------------------

void Events::send(const std::string& name, const std::string& data) {
  const std::lock_guard lock(mutex_);
  kept_.push_back(fmt::format("event: {}\ndata: {}\n\n", name, data));
  if (kept_.size() > kKept) kept_.pop_front();
  ++newest_;
  if (bell_) bell_();
}

std::string Events::after(std::uint64_t& last) const {
  const std::lock_guard lock(mutex_);
  const std::uint64_t new_ones = std::min<std::uint64_t>(newest_ - last, kept_.size());
  std::string text;
  for (auto it = kept_.end() - static_cast<std::ptrdiff_t>(new_ones); it != kept_.end(); ++it)
    text += *it;
  last = newest_;
  return text;
}

void Events::ring(std::function<void()> bell) {
  const std::lock_guard lock(mutex_);
  bell_ = std::move(bell);
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

bool Gate::knows(const std::string& path) const {
  const std::string given = path.empty() ? "" : path.substr(1, path.find('/', 1) - 1);
  const bool of_report = !report_token.empty() && equal(given, report_token);
  return equal(given, token) || of_report;
}

Gate::Answer Gate::ask(const Knock& knock) const {
  const std::size_t end = knock.path.find('/', 1);
  const std::string route = end == std::string::npos ? "" : knock.path.substr(end);
  const bool of_report = route == "/report.html";
  const std::string given = knock.path.empty() ? "" : knock.path.substr(1, end - 1);
  if (knock.path.empty() || knock.path[0] != '/' || !knows(knock.path) ||
      !equal(given, of_report && !report_token.empty() ? report_token : token))
    return {401, "open the address that `drape bench` printed: it holds the token"};
  if ((knock.reached.empty() || knock.host != knock.reached) &&
      !(is_loopback(knock.reached) && is_loopback(knock.host)) &&
      std::find(hosts.begin(), hosts.end(), knock.host) == hosts.end())
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
  return fmt::format("{:02x}", fmt::join(bytes, ""));
}

namespace {

// ---- requests and answers ----------------------------------------------------------------------

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using tcp = asio::ip::tcp;
using Parser = http::request_parser<http::string_body>;
using std::chrono::seconds;

constexpr seconds kStranger(2);                  ///< longest time for a socket to show a token
constexpr seconds kRequest(10);                  ///< longest time for a request to arrive
constexpr seconds kWrite(5);                     ///< longest time for which a client may not read
constexpr seconds kBeat(10);                     ///< interval of signals to a reader of events
constexpr std::chrono::milliseconds kPause(20);  ///< while no further socket can be opened
constexpr std::uint32_t kMostHead = 65536;       ///< bytes of request line and headers
constexpr std::size_t kMostBody = 65536;
constexpr std::size_t kMostPath = 4096;         ///< including its query
constexpr std::ptrdiff_t kMostStrangers = 256;  ///< sockets; beyond it the oldest is closed
constexpr std::size_t kMostReaders = 24;        ///< readers of events
constexpr std::size_t kAnswering = 16;          ///< threads

constexpr const char* kPagePolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Lets a coroutine go on after a failure, with its code.
auto noting(beast::error_code& failed) {
  return asio::redirect_error(asio::use_awaitable, failed);
}

/// Text of a part of a query, in which `+` is a space and %XX a byte.
std::string decoded(std::string_view text) {
  std::string plain;
  for (std::size_t k = 0; k < text.size(); ++k) {
    const char* digits = text.data() + k + 1;
    unsigned char byte = 0;
    const bool is_byte = text[k] == '%' && k + 2 < text.size() &&
                         std::from_chars(digits, digits + 2, byte, 16).ptr == digits + 2;
    plain += is_byte ? static_cast<char>(byte) : text[k] == '+' ? ' ' : text[k];
    if (is_byte) k += 2;
  }
  return plain;
}

std::map<std::string, std::string> query_of(const std::string& target) {
  std::istringstream parts(target.substr(std::min(target.find('?'), target.size())));
  parts.ignore();
  std::map<std::string, std::string> query;
  for (std::string part; std::getline(parts, part, '&');) {
    const std::size_t end = std::min(part.find('='), part.size());
    query[decoded(part.substr(0, end))] = end < part.size() ? decoded(part.substr(end + 1)) : "";
  }
  return query;
}

Knock knock_of(const Parser::value_type& in, const std::string& reached) {
  const auto text = [](const auto& view) { return std::string(view); };
  const auto header = [&](const char* name) {
    const auto found = in.find(name);
    return found == in.end() ? std::nullopt : std::optional(text(found->value()));
  };
  const std::string target = text(in.target());
  return {text(in.method_string()),
          target.substr(0, target.find_first_of("?#")),
          text(in[http::field::host]),
          reached,
          header("Origin"),
          header("Sec-Fetch-Site"),
          header("Sec-Fetch-Mode"),
          header("Content-Type")};
}

/// Fills in everything but the body.
template <class Body>
void set_head(http::response<Body>& out, const Response& response, bool keeps) {
  out.result(static_cast<unsigned>(response.status));
  out.keep_alive(keeps);
  out.set(http::field::content_type, response.type);
  out.set("Content-Security-Policy", kPagePolicy);
  out.set("X-Content-Type-Options", "nosniff");
  out.set("Referrer-Policy", "no-referrer");
  out.set("Cache-Control", "no-store");
  out.set("Cross-Origin-Resource-Policy", "same-origin");
  out.set("Cross-Origin-Opener-Policy", "same-origin");
  for (const auto& [name, value] : response.headers) out.set(name, value);
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

tcp::acceptor listener(asio::io_context& context, const ServerOptions& options) {
  try {
    const auto found = tcp::resolver(context).resolve(options.address, std::to_string(options.port),
                                                      tcp::resolver::passive);
    return {context, *found.begin()};
  } catch (const boost::system::system_error&) {
    throw usage_error(fmt::format("cannot listen on {} port {}", options.address, options.port),
                      "another console may run there: end it, or give --port 0 for any free one");
  }
}

// ---- server ------------------------------------------------------------------------------------

/// One thread serves all sockets, so that silent ones take none; others make the answers.
class HttpServer : public WebServer {
 public:
  HttpServer(const ServerOptions& options, Events& events,
             std::function<Response(const Request&)> answer)
      : options_(options),
        events_(events),
        answer_(std::move(answer)),
        acceptor_(listener(context_, options)),
        port_(acceptor_.local_endpoint().port()),
        gate_{options.token,
              {host("127.0.0.1"), host("localhost"), host("::1"), host(options.address)},
              options.report_token} {
    events_.ring([this] { asio::post(context_, [this] { wake_readers(); }); });
  }
  ~HttpServer() override { events_.ring({}); }

  [[nodiscard]] std::vector<std::string> addresses() const override {
    std::vector<std::string> all;
    for (const std::string& one : reached_at(options_.address))
      all.push_back(fmt::format("http://{}/{}/", host(one), options_.token));
    return all;
  }

  int serve() override {
    int signal = 0;
    for (const int one : {SIGINT, SIGTERM}) signals_.add(one);
    signals_.async_wait([&](beast::error_code failed, int number) {
      if (failed) return;
      signal = number;
      finish();
    });
    asio::co_spawn(context_, accept(), asio::detached);
    context_.run();
    return signal;
  }
  void end() override {
    asio::post(context_, [this] { finish(); });
  }

 private:
  struct Guest {
    beast::tcp_stream stream;
    bool is_known = false;    ///< true once it has shown a token
    bool is_reading = false;  ///< true while a request is awaited
  };
  /// A reader of events, woken by the next one.
  struct Reader {
    asio::steady_timer news;
    bool is_gone = false;
  };

  /// Address in the form of a Host header.
  [[nodiscard]] std::string host(const std::string& address) const {
    const bool is_v6 = address.find(':') != std::string::npos;
    return fmt::format("{}{}{}:{}", is_v6 ? "[" : "", address, is_v6 ? "]" : "", port_);
  }

  /// Address at which a client reached the server.
  [[nodiscard]] std::string reached(const tcp::socket& socket) const {
    beast::error_code gone;
    asio::ip::address own = socket.local_endpoint(gone).address();
    if (own.is_v6() && own.to_v6().is_v4_mapped())
      own = asio::ip::make_address_v4(asio::ip::v4_mapped, own.to_v6());
    const std::string text = own.to_string();
    return host(text.substr(0, text.find('%')));
  }

  void wake_readers() {
    for (const auto& reader : readers_) reader->news.cancel();
  }

  /// Ends everything that waits; answers that are being made still go out. The next signal ends the
  /// program.
  void finish() {
    ending_ = true;
    signals_.clear();
    signals_.cancel();
    acceptor_.close();
    for (Guest& guest : guests_)
      if (guest.is_reading) guest.stream.close();
    wake_readers();
  }

  asio::awaitable<void> accept() {
    while (!ending_) {
      beast::error_code failed;
      tcp::socket socket = co_await acceptor_.async_accept(noting(failed));
      if (failed) {
        asio::steady_timer pause(context_, kPause);
        co_await pause.async_wait(noting(failed));
        continue;
      }
      const auto guest = guests_.insert(guests_.end(), Guest{beast::tcp_stream(std::move(socket))});
      asio::co_spawn(context_, serve(*guest),
                     [this, guest](const std::exception_ptr&) { guests_.erase(guest); });
      const auto is_stranger = [](const Guest& one) {
        return !one.is_known && one.stream.socket().is_open();
      };
      if (std::count_if(guests_.begin(), guests_.end(), is_stranger) > kMostStrangers)
        std::find_if(guests_.begin(), guests_.end(), is_stranger)->stream.close();
    }
  }

  /// Answers the requests of a socket in turn.
  asio::awaitable<void> serve(Guest& guest) {
    const std::string at = reached(guest.stream.socket());
    beast::flat_buffer buffer;
    beast::error_code failed;
    guest.stream.socket().set_option(tcp::no_delay(true), failed);
    for (bool goes_on = true; goes_on && !ending_;) {
      Parser parser;
      guest.is_reading = true;
      Gate::Answer gate = co_await read(guest, at, buffer, parser);
      guest.is_reading = false;
      if (gate.status < 0) co_return;
      const auto& in = parser.get();
      if (gate.status == 0 && gate.route == "/api/events" && in.method() == http::verb::get) {
        if (readers_.size() < kMostReaders) {
          co_await send_events(guest.stream);
          co_return;
        }
        gate = {503, "too many pages are open"};
      }
      Response response = error_response(gate.status, gate.why);
      if (gate.status == 0) {
        const Request request{gate.route, query_of(std::string(in.target())), in.body()};
        response = co_await asio::co_spawn(
            makers_,
            [this, &request]() -> asio::awaitable<Response> { co_return answer_to(request); },
            asio::use_awaitable);
      }
      goes_on = gate.status == 0 && in.keep_alive() && !ending_;
      http::response<http::string_body> out;
      set_head(out, response, goes_on);
      out.content_length(response.body.size());
      if (in.method() != http::verb::head) out.body() = std::move(response.body);
      http::response_serializer<http::string_body> rest{out};
      for (failed = {}; !rest.is_done() && !failed;) {
        guest.stream.expires_after(kWrite);
        co_await http::async_write_some(guest.stream, rest, noting(failed));
      }
      goes_on = goes_on && !failed;
    }
    guest.stream.socket().shutdown(tcp::socket::shutdown_both, failed);
  }

  /// Reads the next request; its body only if it is let in. A negative status for a client that is
  /// gone or too slow.
  asio::awaitable<Gate::Answer> read(Guest& guest, const std::string& at,
                                     beast::flat_buffer& buffer, Parser& parser) {
    const char* unreadable = "the request cannot be read";
    beast::error_code failed;
    parser.header_limit(kMostHead);
    parser.body_limit(kMostBody);
    guest.stream.expires_after(guest.is_known ? kRequest : kStranger);
    co_await http::async_read_header(guest.stream, buffer, parser, noting(failed));
    Gate::Answer gate{400, unreadable};
    if (!failed) gate = gate_.ask(knock_of(parser.get(), at));
    if (gate.status == 0) {
      guest.is_known = true;
      if (parser.get().target().size() > kMostPath)
        co_return Gate::Answer{414, "the address is too long"};
      guest.stream.expires_after(kRequest);
      co_await http::async_read(guest.stream, buffer, parser, noting(failed));
      if (failed) gate = {failed == http::error::body_limit ? 413 : 400, unreadable};
    }
    if (failed == http::error::end_of_stream || !guest.stream.socket().is_open()) gate.status = -1;
    co_return gate;
  }

  Response answer_to(const Request& request) const {
    if (ending_) return error_response(503, "the console ends");
    try {
      if (request.route.empty())
        return {302, "text/plain", {}, {{"Location", "/" + options_.token + "/"}}};
      return answer_(request);
    } catch (const drape::Error& error) {
      const bool ours = error.kind() == ErrorKind::internal || error.kind() == ErrorKind::device;
      return error_response(ours ? 500 : 400, error.what());
    } catch (const std::exception& error) {
      return error_response(500, error.what());
    }
  }

  /// Sends events until the client is gone, which has nothing more to say.
  asio::awaitable<void> send_events(beast::tcp_stream& stream) {
    std::uint64_t last = events_.newest();
    beast::error_code failed, woken;
    const auto reader = std::make_shared<Reader>(Reader{asio::steady_timer(context_)});
    readers_.insert(reader);
    stream.socket().async_wait(tcp::socket::wait_read, [reader](beast::error_code) {
      reader->is_gone = true;
      reader->news.cancel();
    });
    http::response<http::empty_body> head;
    set_head(head, {200, "text/event-stream"}, false);
    http::response_serializer<http::empty_body> begin{head};
    stream.expires_after(kWrite);
    co_await http::async_write_header(stream, begin, noting(failed));
    while (!failed && !reader->is_gone && !ending_) {
      std::string text = events_.after(last);
      if (text.empty()) {
        reader->news.expires_after(kBeat);
        co_await reader->news.async_wait(noting(woken));
        text = woken ? events_.after(last) : ": alive\n\n";
      }
      stream.expires_after(kWrite);
      co_await asio::async_write(stream, asio::buffer(text), noting(failed));
    }
    readers_.erase(reader);
    stream.socket().shutdown(tcp::socket::shutdown_both, failed);
  }

  const ServerOptions options_;
  Events& events_;
  const std::function<Response(const Request&)> answer_;
  asio::io_context context_{1};
  tcp::acceptor acceptor_;
  const int port_;
  const Gate gate_;
  asio::signal_set signals_{context_};
  std::list<Guest> guests_;
  std::set<std::shared_ptr<Reader>> readers_;
  std::atomic<bool> ending_ = false;
  asio::thread_pool makers_{kAnswering};
};

}  // namespace

std::string dumped(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Response error_response(int status, const std::string& why) {
  return {status, "application/json", dumped({{"error", why}})};
}

std::unique_ptr<WebServer> make_server(const ServerOptions& options, Events& events,
                                       std::function<Response(const Request&)> answer) {
  return std::make_unique<HttpServer>(options, events, std::move(answer));
}

}  // namespace drape::console
