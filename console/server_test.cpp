// SPDX-License-Identifier: Apache-2.0
// The server as strangers meet it: curl and raw sockets against the real program.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <random>

#include "core/files/files.hpp"
#include "tests/support/running_bench.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

const std::vector<std::string> kRoutes = {"",
                                          "/",
                                          "/app.js",
                                          "/three.js",
                                          "/api/state",
                                          "/api/events",
                                          "/api/do",
                                          "/api/picture",
                                          "/api/marks",
                                          "/api/live-marks",
                                          "/api/frame",
                                          "/api/coach",
                                          "/api/coverage",
                                          "/api/diff",
                                          "/api/sheet",
                                          "/api/history",
                                          "/api/report",
                                          "/report.html",
                                          "/no-such-thing"};

/// A socket that connects and writes; closed with the object.
class RawClient {
 public:
  explicit RawClient(int port) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = ::connect(socket_, reinterpret_cast<sockaddr*>(&to), sizeof to) == 0;
  }
  ~RawClient() { ::close(socket_); }
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;

  void send(const std::string& text) const {
    [[maybe_unused]] const ssize_t sent = ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL);
  }
  void finish() const { ::shutdown(socket_, SHUT_WR); }
  /// Reads until the server closes.
  [[nodiscard]] std::string rest() const {
    std::string text;
    char buffer[4096];
    for (ssize_t got = 0; (got = ::recv(socket_, buffer, sizeof buffer, 0)) > 0;)
      text.append(buffer, static_cast<std::size_t>(got));
    return text;
  }
  [[nodiscard]] bool connected() const { return connected_; }

 private:
  int socket_;
  bool connected_ = false;
};

class Server : public testing::Test {
 protected:
  Server() : bench_({"C"}), server_(bench_.rig(), bench_.folder() / "out") {}
  [[nodiscard]] std::string at(const std::string& route) const {
    return "'" + server_.address() + route + "'";
  }

  SmallBench bench_;
  RunningBench server_;
};

TEST_F(Server, WithoutTheTokenEveryRouteIs401) {
  int asked = 0;
  for (const std::string& route : kRoutes) {
    for (const char* method : {"GET", "POST", "PUT", "DELETE", "OPTIONS", "PATCH"}) {
      for (const std::string& path : {route, "/" + std::string(32, '0') + route}) {
        const CurlAnswer answer = curl(fmt::format(
            "-X {} -H 'Content-Type: application/json' '{}{}'", method, server_.origin(), path));
        EXPECT_EQ(answer.status, 401) << method << " " << path;
        EXPECT_THAT(answer.body, Not(HasSubstr(server_.token())));
        ++asked;
      }
    }
  }
  EXPECT_EQ(asked, 2 * 6 * static_cast<int>(kRoutes.size()));
  EXPECT_EQ(curl("-I '" + server_.origin() + "/api/state'").status, 401);
}

TEST_F(Server, OtherNamesPagesAndTypesAreRefused) {
  EXPECT_EQ(curl(at("api/state")).status, 200);
  EXPECT_EQ(curl("-H 'Host: evil.example' " + at("api/state")).status, 403);
  EXPECT_EQ(curl("-H 'Origin: http://evil.example' " + at("api/state")).status, 403);
  EXPECT_EQ(curl("-H 'Sec-Fetch-Site: cross-site' " + at("api/state")).status, 403);
  const std::string act = "--data-binary '{\"do\":\"note\",\"text\":\"x\"}' ";
  const std::string json = "-H 'Content-Type: application/json' ";
  EXPECT_EQ(curl(json + "-H 'Origin: http://evil.example' " + act + at("api/do")).status, 403);
  EXPECT_EQ(curl(act + at("api/do")).status, 415) << "a form of another page";
  EXPECT_EQ(curl(json + "-H 'Origin: " + server_.origin() + "' " + act + at("api/do")).status, 200);
  const CurlAnswer page = curl("-D - " + at(""));
  EXPECT_THAT(page.body, HasSubstr("Content-Security-Policy: default-src 'none'"));
  EXPECT_THAT(page.body, HasSubstr("X-Content-Type-Options: nosniff"));
  EXPECT_THAT(page.body, Not(HasSubstr("unsafe")));
  EXPECT_THAT(page.body, Not(HasSubstr("Access-Control-Allow")));
}

TEST_F(Server, NoPathLeavesTheRig) {
  for (const char* route : {"../../etc/passwd", "..%2f..%2fetc/passwd", "%2e%2e/%2e%2e/etc/passwd",
                            "/etc/passwd", "./token", "token", "session.jsonl", "console/token",
                            "..\\token", "report.html/../token", "report.html%00.js"}) {
    const CurlAnswer answer = curl("--path-as-is " + at(route));
    EXPECT_NE(answer.status, 200) << route;
    EXPECT_THAT(answer.body, Not(HasSubstr("root:"))) << route;
    EXPECT_THAT(answer.body, Not(HasSubstr(server_.token()))) << route;
  }
  for (const char* query : {"set=../../../etc&camera=passwd", "set=drape_C&camera=../drape_C/cam0",
                            "set=drape_C/../drape_C&camera=cam0", "set=&camera=", "camera=cam0"}) {
    EXPECT_EQ(curl(at(std::string("api/picture?") + query)).status, 400) << query;
  }
  for (const char* name : {"../C", "", "C/../../x"})
    EXPECT_EQ(curl(at(std::string("api/sheet?drape=") + name)).status, 400) << name;
  EXPECT_EQ(curl(at("api/diff?a=--help&b=1")).status, 400);
  EXPECT_EQ(server_.act({{"do", "take"}, {"set", "../../x"}}), 400);
  EXPECT_EQ(server_.act({{"do", "format the disk"}}), 400);
  EXPECT_EQ(curl("-o /dev/null " + at("api/picture?set=drape_C&camera=cam0&width=320")).status,
            200);
}

TEST_F(Server, BodiesAndAddressesHaveALimit) {
  const fs::path large = bench_.folder() / "large";
  write_durable(large, std::string(1 << 20, 'x'));
  const CurlAnswer answer = curl(fmt::format(
      "-H 'Content-Type: application/json' --data-binary '@{}' {}", large.string(), at("api/do")));
  EXPECT_NE(answer.status, 200);
  EXPECT_NE(curl(at("api/state?" + std::string(6000, 'x'))).status, 200);
  EXPECT_EQ(curl(at("api/state")).status, 200);
}

/// The report's scripts see their address, so its token opens nothing else.
TEST_F(Server, TheReportIsReadUnderATokenOfItsOwn) {
  write_durable(bench_.folder() / "out/report.html", "<html>mine</html>");
  const std::string token = server_.get("api/state")["report_token"];
  EXPECT_NE(token, server_.token());
  const std::string root = server_.origin() + "/" + token;
  const CurlAnswer report = curl("-D - '" + root + "/report.html'");
  EXPECT_THAT(report.body, HasSubstr("mine"));
  EXPECT_THAT(report.body, HasSubstr("Content-Security-Policy: sandbox allow-scripts"));
  EXPECT_THAT(report.body, Not(HasSubstr("allow-same-origin")));
  EXPECT_THAT(report.body, Not(HasSubstr("allow-popups")));
  EXPECT_THAT(report.body, Not(HasSubstr(server_.token())));
  for (const char* route : {"/", "/api/state", "/api/events", "/app.js", "/api/do"})
    EXPECT_EQ(curl("'" + root + route + "'").status, 401) << route;
  EXPECT_EQ(curl(at("report.html")).status, 401);
}

TEST_F(Server, HalfOpenAndSlowClientsDoNotHoldTheOperatorBack) {
  rlimit limit{};
  ::getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = limit.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &limit);
  const int kClients = static_cast<int>(std::min<rlim_t>(3000, limit.rlim_max - 100));
  std::vector<std::unique_ptr<RawClient>> clients;
  for (int k = 0; k < kClients; ++k) {
    clients.push_back(std::make_unique<RawClient>(server_.port()));
    ASSERT_TRUE(clients.back()->connected());
    const std::string stranger = "/" + std::string(32, '0') + "/api/st";
    clients.back()->send(k % 3 == 0   ? ""
                         : k % 3 == 1 ? "GET " + stranger
                                      : "GET " + stranger + " ");
  }
  const auto since = std::chrono::steady_clock::now();
  ASSERT_EQ(server_.act({{"do", "take"}, {"set", "stage_z000"}}), 200);
  const std::chrono::duration<double> answered = std::chrono::steady_clock::now() - since;
  EXPECT_LT(answered.count(), 1) << "behind " << kClients << " sockets";
  EXPECT_EQ(server_.idle_state()["jobs"].back()["state"], "done") << "a job has its descriptors";
  for (const auto& client : clients) EXPECT_THAT(client->rest(), Not(HasSubstr("200 OK")));
  // Those with the token are cut at the deadline of their request.
  for (const std::string& begin :
       {"GET /" + server_.token() + "/api/st",
        "POST /" + server_.token() + "/api/do HTTP/1.1\r\nContent-Length: 60000\r\n"}) {
    const RawClient client(server_.port());
    client.send(begin);
    EXPECT_THAT(client.rest(), Not(HasSubstr("200 OK")));
  }
}

TEST_F(Server, FuzzedRequestsDoNotEndIt) {
  const char* wanted = std::getenv("DRAPE_FUZZ_REQUESTS");
  const int requests = wanted != nullptr ? std::atoi(wanted) : 3000;
  const std::string root = "/" + server_.token();
  std::vector<std::string> seeds;
  for (const std::string& route : kRoutes) {
    if (route == "/api/events" || route == "/three.js") continue;
    seeds.push_back(
        fmt::format("GET {}{}?set=drape_C&camera=cam0&width=80 HTTP/1.1\r\nHost: "
                    "127.0.0.1:{}\r\nRange: bytes=0-9\r\nConnection: close\r\n\r\n",
                    root, route, server_.port()));
  }
  const std::string body = R"({"do":"drop","set":"drape_C","job":1,"text":"x"})";
  seeds.push_back(fmt::format(
      "POST {}/api/do HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nContent-Type: application/json\r\n"
      "Connection: close\r\nContent-Length: {}\r\n\r\n{}",
      root, server_.port(), body.size(), body));
  std::mt19937 random(20261123);
  const auto below = [&](std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
  };
  int answered = 0;
  for (int k = 0; k < requests; ++k) {
    std::string text = seeds[below(seeds.size())];
    // The first bytes stay in half of them, so that many come past the gate.
    const std::size_t from = below(2) == 0 ? root.size() + 6 : 0;
    for (std::size_t times = below(6); times > 0; --times) {
      const std::size_t at = from + below(text.size() - from);
      switch (below(4)) {
        case 0:
          text[at] = static_cast<char>(below(256));
          break;
        case 1:
          text.erase(at, 1 + below(8));
          break;
        case 2:
          text.insert(at, std::string(1 + below(300), static_cast<char>(below(256))));
          break;
        default:
          text.insert(at, text.substr(below(text.size()), below(40)));
      }
      if (text.size() <= from + 1) break;
    }
    const RawClient client(server_.port());
    client.send(text);
    client.finish();
    answered += client.rest().starts_with("HTTP/1.1 ");
  }
  EXPECT_GT(answered, requests / 4);
  EXPECT_TRUE(server_.runs());
  EXPECT_EQ(curl(at("api/state")).status, 200);
  EXPECT_LT(server_.memory_mb(), kMost_mb);
  RecordProperty("requests", requests);
}

TEST_F(Server, ASecondConsoleOnTheSameFolderIsRefused) {
  const Outcome second = run_line(
      fmt::format("'{}' '{}' --replay --out '{}' --port 0", program("drape-bench").string(),
                  bench_.rig().string(), (bench_.folder() / "out").string()));
  EXPECT_EQ(second.exit_code, 3);
  EXPECT_THAT(second.text, HasSubstr("another console works on this folder"));
  const Outcome port = run_line(fmt::format("'{}' '{}' --replay --out '{}' --port {}",
                                            program("drape-bench").string(), bench_.rig().string(),
                                            (bench_.folder() / "other").string(), server_.port()));
  EXPECT_EQ(port.exit_code, 2);
  EXPECT_THAT(port.text, HasSubstr("cannot listen"));
}

bool is_taken(const Json& state, const std::string& set) {
  for (const Json& one : state["sets"])
    if (one["name"] == set) return one["taken"] == true;
  return false;
}

TEST(ServerFaults, KilledAndStartedAgainItShowsTheStateAgain) {
  const SmallBench bench({"C"});
  const fs::path out = bench.folder() / "out";
  std::string token, before;
  {
    RunningBench server(bench.rig(), out);
    token = server.token();
    ASSERT_EQ(server.act({{"do", "operator"}, {"text", "Ada <b>"}}), 200);
    ASSERT_EQ(server.act({{"do", "take"}, {"set", "stage_z000"}}), 200);
    before = server.idle_state()["sets"].dump();
    // The next job is running or about to when the power fails.
    ASSERT_EQ(server.act({{"do", "take"}, {"set", "drape_C"}}), 200);
    server.kill();
  }
  const RunningBench server(bench.rig(), out);
  EXPECT_EQ(server.token(), token) << "an open page goes on";
  const Json state = server.idle_state();
  EXPECT_EQ(state["operator"], "Ada <b>");
  EXPECT_TRUE(is_taken(state, "stage_z000"));
  EXPECT_TRUE(is_taken(state, "drape_C"));
  EXPECT_EQ(state["sets"][0], parse_json(before)[0]) << "marks measured before are there";
  EXPECT_EQ(fs::status(out / "console/token").permissions(),
            fs::perms::owner_read | fs::perms::owner_write);
}

TEST(ServerFaults, ATokenThatAnotherUserPlantedIsReplaced) {
  const SmallBench bench({"C"});
  const fs::path out = bench.folder() / "out", file = out / "console/token";
  fs::create_directories(file.parent_path());
  const std::string planted(32, 'a');
  write_durable(file, planted);
  fs::permissions(file, fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_EQ(RunningBench(bench.rig(), out).token(), planted) << "one of its own is kept";
  write_durable(file, planted);
  fs::permissions(file, fs::perms::owner_read | fs::perms::owner_write);
  if (::chown(file.c_str(), 65534, 65534) != 0) GTEST_SKIP() << "missing: the right to chown";
  EXPECT_NE(RunningBench(bench.rig(), out).token(), planted);
}

TEST(ServerFaults, AFullDiskIsSaidInASentenceAndNothingStoredIsLost) {
  const SmallBench bench({"C"});
  const fs::path out = bench.folder() / "out";
  int stored = 0;
  {
    const RunningBench server(bench.rig(), out, 8);
    const std::string note(1000, 'n');
    CurlAnswer answer;
    for (int k = 0; k < 20; ++k) {
      answer =
          curl(fmt::format("-H 'Content-Type: application/json' --data-binary "
                           "'{{\"do\":\"note\",\"text\":\"{}\"}}' '{}api/do'",
                           note, server.address()));
      if (answer.status != 200) break;
      ++stored;
    }
    EXPECT_NE(answer.status, 200);
    EXPECT_THAT(answer.body, HasSubstr("session log cannot be written"));
    EXPECT_THAT(answer.body, HasSubstr("free the disk"));
    EXPECT_GT(stored, 0);
    EXPECT_EQ(server.get("api/state")["rig"], "bench1") << "it still answers";
  }
  const RunningBench server(bench.rig(), out);
  int found = 0;
  const Json state = server.get("api/state");
  for (const Json& entry : state["log"]) found += entry.contains("note");
  EXPECT_EQ(found, stored);
}

}  // namespace
}  // namespace drape::test
