// SPDX-License-Identifier: Apache-2.0
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
#include <cstdlib>
#include <fstream>
#include <map>
#include <stdexcept>

#include "console/browser.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;
constexpr int kReply_ms = 120000;
constexpr int kMostWaits = 1200;  ///< of 100 ms, until it listens

/// Nothing is fetched from elsewhere; any free port, which it writes into its profile.
constexpr const char* kPreferences =
    "user_pref('marionette.port', 0);\n"
    "user_pref('app.update.enabled', false);\n"
    "user_pref('browser.shell.checkDefaultBrowser', false);\n"
    "user_pref('datareporting.policy.dataSubmissionEnabled', false);\n"
    "user_pref('toolkit.telemetry.server', '');\n"
    "user_pref('network.captive-portal-service.enabled', false);\n"
    "user_pref('network.connectivity-service.enabled', false);\n"
    "user_pref('webgl.force-enabled', true);\n";

/// Of scripts and of console.error(), of pages of this machine.
constexpr const char* kErrors = R"(
  const scripts = Services.console.getMessageArray().filter(m =>
    m instanceof Ci.nsIScriptError && !(m.flags & Ci.nsIScriptError.warningFlag) &&
    (m.sourceName || '').startsWith('http://127.0.0.1')).map(m => m.toString());
  const said = Cc['@mozilla.org/consoleAPI-storage;1'].getService(Ci.nsIConsoleAPIStorage)
    .getEvents().filter(e => e.level === 'error' && e.filename.startsWith('http://127.0.0.1')).map(e => String(e.arguments));
  return [...scripts, ...said];)";

class Firefox final : public Browser {
 public:
  Firefox() {
    fs::create_directories(profile_.path() / "profile");
    std::ofstream(profile_.path() / "profile/user.js") << kPreferences;
    const std::string profile = (profile_.path() / "profile").string();
    pid_ = ::fork();
    if (pid_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      ::setpgid(0, 0);
      const int nothing = ::open("/dev/null", O_RDWR);
      for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::dup2(nothing, stream);
      ::setenv("HOME", profile_.path().c_str(), 1);
      ::execlp("firefox", "firefox", "--headless", "--marionette", "--remote-allow-system-access",
               "--no-remote", "--profile", profile.c_str(), "about:blank", nullptr);
      ::_exit(127);
    }
    connect_to(port());
    static_cast<void>(next_message());  // its greeting
    call("WebDriver:NewSession", {{"capabilities", {{"alwaysMatch", Json::object()}}}});
    size(1280, 1000);
  }
  ~Firefox() override {
    ::close(socket_);
    ::kill(-pid_, SIGKILL);  // its content processes too
    ::waitpid(pid_, nullptr, 0);
  }

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
    const Json answer = call("WebDriver:TakeScreenshot", {{"full", false}});
    write_picture(file, answer["value"].get<std::string>());
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
      pollfd wait{socket_, POLLIN, 0};
      std::array<char, 65536> buffer;
      if (::poll(&wait, 1, kReply_ms) <= 0) throw std::runtime_error("firefox is silent");
      const ssize_t got = ::read(socket_, buffer.data(), buffer.size());
      if (got <= 0) throw std::runtime_error("firefox has ended");
      text_.append(buffer.data(), static_cast<std::size_t>(got));
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

  TemporaryFolder profile_;
  pid_t pid_ = -1;
  int socket_ = -1, id_ = 0;
  std::string text_;
};

}  // namespace

std::unique_ptr<Browser> open_firefox() {
  if (std::system("command -v firefox > /dev/null 2>&1") != 0) return nullptr;
  return std::make_unique<Firefox>();
}

}  // namespace drape::test
