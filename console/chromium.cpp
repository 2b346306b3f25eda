// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <map>
#include <stdexcept>

#include "console/browser.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {
namespace {

constexpr int kAnswer_ms = 120000;

class Chromium final : public Browser {
 public:
  Chromium();
  ~Chromium() override;

  void open(const std::string& address) override;
  void size(int width_px, int height_px) override;
  void press(const std::string& key) override;
  void type(const std::string& text) override;
  [[nodiscard]] Json value_of(const std::string& expression) override;
  void run(const std::string& script) override { static_cast<void>(value_of(script + "; 0")); }
  void screenshot(const std::filesystem::path& file) override;
  [[nodiscard]] std::vector<std::string> errors() override { return errors_; }

 private:
  Json call(const std::string& method, Json parameters = Json::object());
  Json next_message();
  void take_event(const Json& message);

  TemporaryFolder profile_;
  pid_t pid_ = -1;
  int to_ = -1, from_ = -1;
  int id_ = 0;
  std::string session_, text_;
  std::vector<std::string> errors_;
};

Chromium::Chromium() {
  std::array<int, 2> in{}, out{};
  if (::pipe2(in.data(), O_CLOEXEC) != 0 || ::pipe2(out.data(), O_CLOEXEC) != 0)
    throw std::runtime_error("no pipe");
  const std::string profile = "--user-data-dir=" + (profile_.path() / "profile").string();
  pid_ = ::fork();
  if (pid_ == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int nothing = ::open("/dev/null", O_RDWR);
    // Above 3 and 4 first, so that neither of them is overwritten before it is used.
    const int read = ::fcntl(in[0], F_DUPFD, 10), write = ::fcntl(out[1], F_DUPFD, 10);
    ::dup2(read, 3);
    ::dup2(write, 4);
    ::dup2(nothing, STDOUT_FILENO);
    ::dup2(nothing, STDERR_FILENO);
    ::execlp("chromium", "chromium", "--headless", "--no-sandbox", "--disable-gpu",
             "--disable-quic", "--no-first-run", "--disable-background-networking",
             "--disable-component-update", "--disable-sync", "--use-angle=swiftshader",
             "--enable-unsafe-swiftshader", "--remote-debugging-pipe", profile.c_str(),
             "about:blank", nullptr);
    ::_exit(127);
  }
  ::close(in[0]);
  ::close(out[1]);
  to_ = in[1];
  from_ = out[0];
  const Json target = call("Target.createTarget", {{"url", "about:blank"}});
  const Json attached =
      call("Target.attachToTarget", {{"targetId", target["targetId"]}, {"flatten", true}});
  session_ = attached["sessionId"].get<std::string>();
  for (const char* domain : {"Page", "Runtime", "Log"}) call(std::string(domain) + ".enable");
  size(1280, 1000);
}

Chromium::~Chromium() {
  ::close(to_);
  ::close(from_);
  ::kill(pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
}

Json Chromium::next_message() {
  for (;;) {
    if (const std::size_t end = text_.find('\0'); end != std::string::npos) {
      Json message = parse_json(text_.substr(0, end));
      text_.erase(0, end + 1);
      return message;
    }
    pollfd wait{from_, POLLIN, 0};
    std::array<char, 65536> buffer;
    if (::poll(&wait, 1, kAnswer_ms) <= 0) throw std::runtime_error("the browser is silent");
    const ssize_t got = ::read(from_, buffer.data(), buffer.size());
    if (got <= 0) throw std::runtime_error("the browser has ended");
    text_.append(buffer.data(), static_cast<std::size_t>(got));
  }
}

void Chromium::take_event(const Json& message) {
  const std::string method = message.value("method", "");
  if (!message.contains("params")) return;
  const Json& what = message["params"];
  if (method == "Runtime.exceptionThrown") errors_.push_back(what["exceptionDetails"].dump());
  if (method == "Runtime.consoleAPICalled" && what["type"] == "error")
    errors_.push_back(what["args"].dump());
  if (method == "Log.entryAdded" && what["entry"]["level"] == "error")
    errors_.push_back(what["entry"].dump());
}

Json Chromium::call(const std::string& method, Json parameters) {
  Json message = {{"id", ++id_}, {"method", method}, {"params", std::move(parameters)}};
  if (!session_.empty()) message["sessionId"] = session_;
  const std::string text = message.dump() + '\0';
  if (::write(to_, text.data(), text.size()) != static_cast<ssize_t>(text.size()))
    throw std::runtime_error("the browser does not listen");
  for (;;) {
    Json answer = next_message();
    if (answer.value("id", 0) != id_) {
      take_event(answer);
      continue;
    }
    if (answer.contains("error")) throw std::runtime_error(method + ": " + answer["error"].dump());
    return answer["result"];
  }
}

void Chromium::open(const std::string& address) {
  call("Page.navigate", {{"url", address}});
}

void Chromium::size(int width_px, int height_px) {
  call("Emulation.setDeviceMetricsOverride",
       {{"width", width_px}, {"height", height_px}, {"deviceScaleFactor", 1}, {"mobile", false}});
}

void Chromium::press(const std::string& key) {
  static const std::map<std::string, int> codes = {{"Tab", 9},         {"Enter", 13},
                                                   {"ArrowLeft", 37},  {"ArrowUp", 38},
                                                   {"ArrowRight", 39}, {"ArrowDown", 40}};
  Json event = {{"type", "keyDown"}, {"key", key}};
  if (const auto found = codes.find(key); found != codes.end()) {
    event["code"] = key;
    event["windowsVirtualKeyCode"] = found->second;
    if (key == "Enter") event["text"] = "\r";
  } else {
    event["text"] = key;
  }
  call("Input.dispatchKeyEvent", event);
  event["type"] = "keyUp";
  event.erase("text");
  call("Input.dispatchKeyEvent", event);
}

void Chromium::type(const std::string& text) {
  call("Input.insertText", {{"text", text}});
}

Json Chromium::value_of(const std::string& expression) {
  const Json result =
      call("Runtime.evaluate",
           {{"expression", expression}, {"returnByValue", true}, {"awaitPromise", true}})["result"];
  return result.contains("value") ? result["value"] : Json();
}

void Chromium::screenshot(const std::filesystem::path& file) {
  write_picture(file, call("Page.captureScreenshot")["data"].get<std::string>());
}

}  // namespace

std::unique_ptr<Browser> open_chromium() {
  if (std::system("command -v chromium > /dev/null 2>&1") != 0) return nullptr;
  return std::make_unique<Chromium>();
}

}  // namespace drape::test
