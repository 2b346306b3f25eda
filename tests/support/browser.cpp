// SPDX-License-Identifier: Apache-2.0
#include "tests/support/browser.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <stdexcept>
#include <thread>

#include "core/files/files.hpp"
#include "core/program/child.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;
constexpr int kMostTabs = 300;
constexpr int kMostLooks = 4500;  ///< looks of 200 ms; a whole drape on a busy machine
constexpr int kAnswer_ms = 120000;
constexpr int kMostWaits = 1200;  ///< waits of 100 ms, until Firefox listens

std::string from_base64(const std::string& text) {
  std::string bytes;
  unsigned value = 0;
  int bits = 0;
  for (const char c : text) {
    const std::string_view kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const auto digit = kDigits.find(c);
    if (digit == std::string_view::npos) break;
    value = (value << 6U) | static_cast<unsigned>(digit);
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes += static_cast<char>((value >> static_cast<unsigned>(bits)) & 255U);
  }
  return bytes;
}

void write_picture(const fs::path& file, const Json& base64) {
  write_durable(file, from_base64(base64.get<std::string>()));
}

/// A browser in a process group of its own, killed with its content processes.
class OwnProcess : public Browser {
 protected:
  ~OwnProcess() override {
    ::kill(-pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }

  /// `in` and `out`: the descriptors that it has as 3 and 4; -1: none.
  void start(std::vector<std::string> words, int in = -1, int out = -1) {
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    pid_ = ::fork();
    if (pid_ != 0) return;
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::setpgid(0, 0);
    ::setenv("HOME", profile_.path().c_str(), 1);
    const int nothing = ::open("/dev/null", O_RDWR);
    // Above 3 and 4 first, so that neither of them is overwritten before it is used.
    const int read = ::fcntl(in, F_DUPFD, 10), write = ::fcntl(out, F_DUPFD, 10);
    if (read >= 0) ::dup2(read, 3);
    if (write >= 0) ::dup2(write, 4);
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::dup2(nothing, stream);
    ::execvp(arguments[0], arguments.data());
    ::_exit(127);
  }

  void take_more(int from) {
    pollfd wait{from, POLLIN, 0};
    std::array<char, 65536> buffer;
    if (::poll(&wait, 1, kAnswer_ms) <= 0) throw std::runtime_error("the browser is silent");
    const ssize_t got = ::read(from, buffer.data(), buffer.size());
    if (got <= 0) throw std::runtime_error("the browser has ended");
    text_.append(buffer.data(), static_cast<std::size_t>(got));
  }

  TemporaryFolder profile_;
  int id_ = 0;
  std::string text_;  ///< messages that it sent

 private:
  pid_t pid_ = -1;
};

/// Over the DevTools protocol's pipe.
class Chromium final : public OwnProcess {
 public:
  Chromium() {
    start({"chromium", "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic",
           "--no-first-run", "--disable-background-networking", "--disable-component-update",
           "--disable-sync", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
           "--remote-debugging-pipe", "--user-data-dir=" + (profile_.path() / "profile").string(),
           "about:blank"},
          to_.reading(), from_.writing());
    to_.close_reading();
    from_.close_writing();
    const Json target = call("Target.createTarget", {{"url", "about:blank"}});
    const Json attached =
        call("Target.attachToTarget", {{"targetId", target["targetId"]}, {"flatten", true}});
    session_ = attached["sessionId"].get<std::string>();
    for (const char* domain : {"Page", "Runtime", "Log"}) call(std::string(domain) + ".enable");
    size(1280, 1000);
  }

  void open(const std::string& address) override { call("Page.navigate", {{"url", address}}); }

  void size(int width_px, int height_px) override {
    call("Emulation.setDeviceMetricsOverride",
         {{"width", width_px}, {"height", height_px}, {"deviceScaleFactor", 1}, {"mobile", false}});
  }

  void press(const std::string& key) override {
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

  void type(const std::string& text) override { call("Input.insertText", {{"text", text}}); }

  [[nodiscard]] Json value_of(const std::string& expression) override {
    const Json result = call(
        "Runtime.evaluate",
        {{"expression", expression}, {"returnByValue", true}, {"awaitPromise", true}})["result"];
    return result.contains("value") ? result["value"] : Json();
  }

  void run(const std::string& script) override { static_cast<void>(value_of(script + "; 0")); }
  void screenshot(const fs::path& file) override {
    write_picture(file, call("Page.captureScreenshot")["data"]);
  }
  [[nodiscard]] std::vector<std::string> errors() override { return errors_; }

 private:
  Json next_message() {
    std::size_t end = 0;
    while ((end = text_.find('\0')) == std::string::npos) take_more(from_.reading());
    Json message = parse_json(text_.substr(0, end));
    text_.erase(0, end + 1);
    return message;
  }

  void take_event(const Json& message) {
    const std::string method = message.value("method", "");
    if (!message.contains("params")) return;
    const Json& what = message["params"];
    if (method == "Runtime.exceptionThrown") errors_.push_back(what["exceptionDetails"].dump());
    if (method == "Runtime.consoleAPICalled" && what["type"] == "error")
      errors_.push_back(what["args"].dump());
    if (method == "Log.entryAdded" && what["entry"]["level"] == "error")
      errors_.push_back(what["entry"].dump());
  }

  Json call(const std::string& method, Json parameters = Json::object()) {
    Json message = {{"id", ++id_}, {"method", method}, {"params", std::move(parameters)}};
    if (!session_.empty()) message["sessionId"] = session_;
    const std::string text = message.dump() + '\0';
    if (::write(to_.writing(), text.data(), text.size()) != static_cast<ssize_t>(text.size()))
      throw std::runtime_error("the browser does not listen");
    for (;;) {
      Json answer = next_message();
      if (answer.value("id", 0) != id_) {
        take_event(answer);
        continue;
      }
      if (answer.contains("error"))
        throw std::runtime_error(method + ": " + answer["error"].dump());
      return answer["result"];
    }
  }

  Pipe to_, from_;
  std::string session_;
  std::vector<std::string> errors_;
};

/// Options that let it fetch nothing and take any free port, which it writes into its profile.
constexpr const char* kPreferences =
    "user_pref('marionette.port', 0);\n"
    "user_pref('app.update.enabled', false);\n"
    "user_pref('browser.shell.checkDefaultBrowser', false);\n"
    "user_pref('datareporting.policy.dataSubmissionEnabled', false);\n"
    "user_pref('toolkit.telemetry.server', '');\n"
    "user_pref('network.captive-portal-service.enabled', false);\n"
    "user_pref('network.connectivity-service.enabled', false);\n"
    "user_pref('webgl.force-enabled', true);\n";

/// Errors of scripts and of console.error(), of pages of this machine.
constexpr const char* kErrors = R"(
  const scripts = Services.console.getMessageArray().filter(m =>
    m instanceof Ci.nsIScriptError && !(m.flags & Ci.nsIScriptError.warningFlag) &&
    (m.sourceName || '').startsWith('http://127.0.0.1')).map(m => m.toString());
  const said = Cc['@mozilla.org/consoleAPI-storage;1'].getService(Ci.nsIConsoleAPIStorage)
    .getEvents().filter(e => e.level === 'error' && e.filename.startsWith('http://127.0.0.1')).map(e => String(e.arguments));
  return [...scripts, ...said];)";

/// Over Marionette's socket.
class Firefox final : public OwnProcess {
 public:
  explicit Firefox(const std::string& program) {
    fs::create_directories(profile_.path() / "profile");
    std::ofstream(profile_.path() / "profile/user.js") << kPreferences;
    const std::string profile = (profile_.path() / "profile").string();
    start({program, "--headless", "--marionette", "--remote-allow-system-access", "--no-remote",
           "--profile", profile, "about:blank"});
    connect_to(port());
    static_cast<void>(next_message());  // its greeting
    call("WebDriver:NewSession", {{"capabilities", {{"alwaysMatch", Json::object()}}}});
    size(1280, 1000);
  }
  ~Firefox() override { ::close(socket_); }

  void open(const std::string& address) override { call("WebDriver:Navigate", {{"url", address}}); }

  /// A window cannot be as narrow as a phone, the page in it can.
  void size(int width_px, int height_px) override {
    inside_browser(fmt::format(
        "const one = gBrowser.selectedBrowser; one.style.setProperty('width', '{}px'); "
        "one.style.setProperty('height', '{}px'); one.style.setProperty('flex', 'none');",
        width_px, height_px));
    wait_for(fmt::format("window.innerWidth === {}", width_px));
  }

  void press(const std::string& key) override {
    static const std::map<std::string, std::string> codes = {
        {"Tab", "\uE004"},     {"Enter", "\uE007"},      {"ArrowLeft", "\uE012"},
        {"ArrowUp", "\uE013"}, {"ArrowRight", "\uE014"}, {"ArrowDown", "\uE015"}};
    const auto found = codes.find(key);
    strike({found == codes.end() ? key : found->second});
    // Behind the last element Tab leads out of the page to the browser's own bars; keys still reach
    // the page here, but a button without focus does not hear Enter. A hand would Tab on through
    // them.
    if (key == "Tab" && value_of("document.hasFocus()") == false)
      inside_browser("gBrowser.selectedBrowser.focus();");
  }

  void type(const std::string& text) override {
    std::vector<std::string> keys;
    for (const char c : text) keys.emplace_back(1, c);
    strike(keys);
  }

  [[nodiscard]] Json value_of(const std::string& expression) override {
    return script("return (" + expression + ");");
  }
  void run(const std::string& text) override { static_cast<void>(script(text)); }

  void screenshot(const fs::path& file) override {
    write_picture(file, call("WebDriver:TakeScreenshot", {{"full", false}})["value"]);
  }

  [[nodiscard]] std::vector<std::string> errors() override {
    return inside_browser(kErrors).get<std::vector<std::string>>();
  }

 private:
  [[nodiscard]] int port() const {
    for (int k = 0; k < kMostWaits; ++k) {
      int found = 0;
      if (std::ifstream(profile_.path() / "profile/MarionetteActivePort") >> found) return found;
      ::usleep(100'000);
    }
    throw std::runtime_error("firefox does not start");
  }

  void connect_to(int port) {
    socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::connect(socket_, reinterpret_cast<sockaddr*>(&to), sizeof to) != 0)
      throw std::runtime_error("firefox does not listen");
  }

  /// Length, colon, JSON.
  Json next_message() {
    for (;;) {
      if (const std::size_t colon = text_.find(':'); colon != std::string::npos) {
        const std::size_t size = std::stoul(text_.substr(0, colon));
        if (text_.size() > colon + size) {
          Json message = parse_json(text_.substr(colon + 1, size));
          text_.erase(0, colon + 1 + size);
          return message;
        }
      }
      take_more(socket_);
    }
  }

  Json call(const std::string& command, const Json& parameters) {
    const std::string body = Json::array({0, ++id_, command, parameters}).dump();
    const std::string text = fmt::format("{}:{}", body.size(), body);
    for (std::size_t sent = 0; sent < text.size();) {
      const ssize_t now = ::send(socket_, text.data() + sent, text.size() - sent, MSG_NOSIGNAL);
      if (now <= 0) throw std::runtime_error("firefox does not read");
      sent += static_cast<std::size_t>(now);
    }
    const Json answer = next_message();
    if (!answer[2].is_null()) throw std::runtime_error(command + ": " + answer[2].dump());
    return answer[3];
  }

  Json script(const std::string& text) {
    // The sandbox stays from one script to the next, so that one may use what another loaded.
    return call("WebDriver:ExecuteScript",
                {{"script", text}, {"args", Json::array()}, {"newSandbox", false}})["value"];
  }

  Json inside_browser(const std::string& text) {
    call("Marionette:SetContext", {{"value", "chrome"}});
    Json value = script(text);
    call("Marionette:SetContext", {{"value", "content"}});
    return value;
  }

  void strike(const std::vector<std::string>& keys) {
    Json actions = Json::array();
    for (const std::string& key : keys)
      for (const char* what : {"keyDown", "keyUp"})
        actions.push_back({{"type", what}, {"value", key}});
    call("WebDriver:PerformActions",
         {{"actions", Json::array({{{"type", "key"}, {"id", "keys"}, {"actions", actions}}})}});
  }

  int socket_ = -1;
};

}  // namespace

std::unique_ptr<Browser> open_browser(const std::string& name) {
  const auto is_here = [](const std::string& program) {
    return std::system(("command -v " + program + " > /dev/null 2>&1").c_str()) == 0;
  };
  if (name == "Chromium") return is_here("chromium") ? std::make_unique<Chromium>() : nullptr;
  for (const char* program : {"firefox", "firefox-esr"})
    if (is_here(program)) return std::make_unique<Firefox>(program);
  return nullptr;
}

void Browser::tab_to(const std::string& id) {
  for (int k = 0; k < kMostTabs; ++k) {
    if (value_of("document.activeElement ? document.activeElement.id : ''") == id) return;
    press("Tab");
  }
  throw std::runtime_error(fmt::format("Tab does not lead to #{}; the page says: {}", id,
                                       value_of("document.body.innerText").dump()));
}

void Browser::press_button(const std::string& id) {
  wait_for(fmt::format("document.getElementById('{0}') && !document.getElementById('{0}').disabled",
                       id));
  tab_to(id);
  press("Enter");
}

void Browser::wait_for(const std::string& expression) {
  for (int k = 0; k < kMostLooks; ++k) {
    if (value_of("Boolean(" + expression + ")") == true) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  throw std::runtime_error(fmt::format("`{}` does not come true; the page says: {}", expression,
                                       value_of("document.body.innerText").dump()));
}

Json serious_findings(Browser& browser) {
  Json found = Json::array();
  browser.size(390, 800);
  if (browser.value_of("document.scrollingElement.scrollWidth <= window.innerWidth") != true)
    found.push_back("the page is wider than a phone");
  browser.size(1280, 1000);
  const fs::path axe = fs::path(program("drape")).parent_path().parent_path() /
                       "npm/node_modules/axe-core/axe.min.js";
  if (!fs::is_regular_file(axe)) {
    std::printf("axe-core is absent: npm install --prefix BUILD/npm axe-core\n");
    return found;
  }
  browser.run(read_text(axe));
  const Json said = browser.value_of(
      "axe.run(document, {rules: {}}).then(r => r.violations.filter(v => ['serious', "
      "'critical'].includes(v.impact)).map(v => v.id + ': ' + v.nodes.map(n => "
      "n.html).join(' ')))");
  if (!said.is_array()) return {"axe-core does not answer"};
  found.insert(found.end(), said.begin(), said.end());
  return found;
}

void shoot(Browser& browser, const std::string& name) {
  const char* shots = std::getenv("DRAPE_SCREENSHOTS");
  if (shots != nullptr) browser.screenshot(fs::path(shots) / name);
}

}  // namespace drape::test
