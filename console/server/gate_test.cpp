// SPDX-License-Identifier: Apache-2.0
#include "console/server/server.hpp"

#include <gmock/gmock.h>

#include <atomic>
#include <latch>
#include <thread>

#include <httplib.h>

namespace drape::console {
namespace {

constexpr const char* kToken = "0123456789abcdef0123456789abcdef";

Knock knock(const std::string& method, const std::string& route) {
  Knock one;
  one.method = method;
  one.path = std::string("/") + kToken + route;
  one.host = "127.0.0.1:8040";
  return one;
}

const Gate& gate() {
  static const Gate one(kToken, {"127.0.0.1:8040", "localhost:8040"});
  return one;
}

TEST(Gate, LetsInWhoHasTheToken) {
  const Gate::Answer answer = gate().ask(knock("GET", "/api/state"));
  EXPECT_EQ(answer.status, 0);
  EXPECT_EQ(answer.route, "/api/state");
}

TEST(Gate, EveryPathWithoutTheWholeTokenIs401) {
  for (const std::string& path :
       {std::string(), std::string("/"), std::string("/api/state"), std::string("//"),
        "/" + std::string(kToken).substr(1), "/" + std::string(kToken) + "0/",
        "/x/" + std::string(kToken) + "/", std::string("/0123456789ABCDEF0123456789ABCDEF/"),
        "/" + std::string(31, '0')}) {
    Knock one = knock("GET", "/");
    one.path = path;
    EXPECT_EQ(gate().ask(one).status, 401) << path;
  }
}

TEST(Gate, OtherNamesAndPagesFromElsewhereAreRefused) {
  Knock one = knock("GET", "/api/state");
  one.host = "evil.example:8040";
  EXPECT_EQ(gate().ask(one).status, 403);
  one = knock("POST", "/api/do");
  one.content_type = "application/json";
  EXPECT_EQ(gate().ask(one).status, 0);
  one.origin = "http://127.0.0.1:8040";
  EXPECT_EQ(gate().ask(one).status, 0);
  for (const char* origin :
       {"http://evil.example", "null", "https://127.0.0.1:8040", "", "http://127.0.0.1:8041"}) {
    one.origin = origin;
    EXPECT_EQ(gate().ask(one).status, 403) << origin;
  }
  one = knock("GET", "/api/state");
  one.fetch_site = "cross-site";
  EXPECT_EQ(gate().ask(one).status, 403);
  one.fetch_site = "same-origin";
  EXPECT_EQ(gate().ask(one).status, 0);
}

TEST(Gate, TheAddressAtWhichItWasReachedIsItsOwn) {
  Knock one = knock("GET", "/api/state");
  one.host = "192.168.1.5:8040";
  EXPECT_EQ(gate().ask(one).status, 403);
  one.reached = "192.168.1.5:8040";
  EXPECT_EQ(gate().ask(one).status, 0);
  one.host = "evil.example:8040";  // rebound to this machine
  EXPECT_EQ(gate().ask(one).status, 403);
  one.reached = "127.0.0.1:8040";
  one.host = "localhost:9000";
  EXPECT_EQ(gate().ask(one).status, 0) << "the other end of an ssh -L";
  one.origin = "http://127.0.0.1:9000";
  EXPECT_EQ(gate().ask(one).status, 403) << "a page of another name";
  one.origin = std::nullopt;
  one.host = one.reached = "";
  EXPECT_EQ(gate().ask(one).status, 403) << "nothing known of either";
}

TEST(Gate, ActsArePostedAsJson) {
  EXPECT_EQ(gate().ask(knock("GET", "/api/do")).status, 405);
  EXPECT_EQ(gate().ask(knock("PUT", "/api/do")).status, 405);
  EXPECT_EQ(gate().ask(knock("POST", "/api/state")).status, 405);
  EXPECT_EQ(gate().ask(knock("POST", "/api/do")).status, 415);
  Knock one = knock("POST", "/api/do");
  one.content_type = "text/plain";
  EXPECT_EQ(gate().ask(one).status, 415);
}

TEST(Gate, TokensDiffer) {
  const std::string one = make_token();
  EXPECT_EQ(one.size(), 32U);
  EXPECT_NE(one, make_token());
}

TEST(Events, AReaderThatIsSlowLosesOldOnesOnly) {
  Events events;
  std::uint64_t last = events.newest();
  for (int k = 0; k < 1000; ++k) events.send("job", std::to_string(k));
  const std::string text = events.after(last);
  EXPECT_THAT(text, testing::HasSubstr("data: 999\n\n"));
  EXPECT_THAT(text, testing::Not(testing::HasSubstr("data: 0\n")));
  EXPECT_EQ(last, 1000U);
  EXPECT_EQ(events.after(last), "");
}

TEST(WebServer, ListeningOnAllInterfacesAnswersWhereItIsReached) {
  ServerOptions options;
  options.address = "0.0.0.0";
  options.token = kToken;
  Events events;
  const auto server = make_server(options, events, [](const Request&) { return Response{}; });
  std::thread serving([&] { server->serve(); });
  const std::vector<std::string> addresses = server->addresses();
  EXPECT_THAT(addresses, testing::Each(testing::Not(testing::HasSubstr("0.0.0.0"))));
  const std::string own = addresses.back();
  const int port = std::stoi(own.substr(own.rfind(':') + 1));
  const auto status = [&](const char* reached, const std::string& host) {
    httplib::Client client(reached, port);
    const auto answer = client.Get(std::string("/") + kToken + "/api/state", {{"Host", host}});
    return answer ? answer->status : 0;
  };
  const std::string at = ":" + std::to_string(port);
  EXPECT_EQ(status("127.0.0.2", "127.0.0.2" + at), 200);
  EXPECT_EQ(status("127.0.0.2", "127.0.0.3" + at), 403);
  EXPECT_EQ(status("127.0.0.2", "evil.example" + at), 403);
  server->end();
  serving.join();
}

/// Requests that wait for a thread when the server ends are not made any more.
TEST(WebServer, EndsWithoutMakingTheAnswersThatWait) {
  constexpr int kClients = 48;
  ServerOptions options;
  options.token = kToken;
  Events events;
  std::atomic<int> made = 0;
  std::latch released(1);
  const auto server = make_server(options, events, [&](const Request&) {
    ++made;
    released.wait();
    return Response{};
  });
  std::thread serving([&] { server->serve(); });
  const std::string own = server->addresses().front();
  const int port = std::stoi(own.substr(own.rfind(':') + 1));
  std::vector<std::thread> clients;
  std::atomic<int> refused = 0;
  for (int k = 0; k < kClients; ++k)
    clients.emplace_back([&] {
      httplib::Client client("127.0.0.1", port);
      const auto answer = client.Get(std::string("/") + kToken + "/api/state");
      refused += !answer || answer->status == 503;
    });
  while (made < 16) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  const int before = made;
  server->end();
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  released.count_down();
  for (std::thread& client : clients) client.join();
  serving.join();
  EXPECT_LT(before, kClients) << "some wait";
  EXPECT_EQ(made, before);
  EXPECT_EQ(refused, kClients - before);
}

}  // namespace
}  // namespace drape::console
