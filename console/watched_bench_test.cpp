// SPDX-License-Identifier: Apache-2.0
// Who watches the live cameras takes nothing from the sets.
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <stdexcept>

#include "core/recording.hpp"
#include "tests/support/browser.hpp"
#include "tests/support/live_console.hpp"
#include "tests/support/trials.hpp"

// After Eigen: the system's resolver, which this includes, defines `_res` as a macro.
#include <httplib.h>

namespace drape::test {
namespace {

/// A client that asks for each picture that is announced, as the page does.
class Watcher {
 public:
  explicit Watcher(const RunningBench& server)
      : events_("127.0.0.1", server.port()),
        pictures_("127.0.0.1", server.port()),
        root_("/" + server.token() + "/api/") {
    for (httplib::Client* client : {&events_, &pictures_}) {
      client->set_keep_alive(true);
      client->set_read_timeout(60);
    }
    thread_ = std::thread([this] {
      std::string text;
      events_.Get(root_ + "events", [&](const char* data, std::size_t size) {
        text.append(data, size);
        for (auto end = text.find("\n\n"); end != std::string::npos; end = text.find("\n\n")) {
          look_at(text.substr(0, end));
          text.erase(0, end + 2);
        }
        return !ended_;
      });
    });
  }
  ~Watcher() {
    ended_ = true;
    events_.stop();
    thread_.join();
  }
  Watcher(const Watcher&) = delete;
  Watcher& operator=(const Watcher&) = delete;

  /// Delay of every picture, from the arrival of its frame in the capture.
  [[nodiscard]] std::vector<double> delays_ms() const {
    const std::lock_guard lock(mutex_);
    return delays_ms_;
  }

  /// When it heard of each set that is stored.
  [[nodiscard]] std::vector<std::chrono::steady_clock::time_point> shots() const {
    const std::lock_guard lock(mutex_);
    return shots_;
  }

 private:
  void look_at(const std::string& event) {
    if (event.find("event: shot") != std::string::npos) {
      const std::lock_guard lock(mutex_);
      shots_.push_back(std::chrono::steady_clock::now());
    }
    const std::size_t data = event.find("data: ");
    if (event.find("event: frame") == std::string::npos || data == std::string::npos) return;
    const std::string camera = parse_json(event.substr(data + 6))["camera"];
    const auto answer = pictures_.Get(root_ + "live?width=640&red=1&camera=" + camera);
    if (!answer || answer->status != 200) return;
    const Json facts = parse_json(answer->get_header_value("X-Facts"));
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    const std::lock_guard lock(mutex_);
    delays_ms_.push_back(1e-6 * static_cast<double>(now / std::chrono::nanoseconds(1) -
                                                    facts["arrived_ns"].get<std::int64_t>()));
  }

  httplib::Client events_, pictures_;
  std::string root_;
  std::atomic<bool> ended_ = false;
  mutable std::mutex mutex_;
  std::vector<double> delays_ms_;
  std::vector<std::chrono::steady_clock::time_point> shots_;
  std::thread thread_;
};

double quantile(std::vector<double> values, double fraction) {
  std::sort(values.begin(), values.end());
  return values.at(static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1)));
}

using Watched = LiveConsole;

TEST_F(Watched, FiveWatchersLoseNoSet) {
  const char* wanted = std::getenv("DRAPE_WATCHED_SETS");
  const int sets = wanted != nullptr ? std::atoi(wanted) : trial_count(5, 600);
  begin_four(sets);
  const RunningBench server(bench.rig(), out(), 0, false);
  await(server, is_ready);
  std::vector<std::unique_ptr<Watcher>> watchers;
  for (int k = 0; k < 5; ++k) watchers.push_back(std::make_unique<Watcher>(server));
  const auto since = std::chrono::steady_clock::now();
  std::vector<std::chrono::steady_clock::time_point> pressed;
  const double cpu_before_s = server.cpu_s();
  for (int k = 0; k < sets; ++k) {
    const std::string set = fmt::format("watched_{:03}", k);
    await(server, [](const Json& state) {  // the marks of few sets wait to be measured
      return std::count_if(state["jobs"].begin(), state["jobs"].end(),
                           [](const Json& job) { return job["state"] == "waiting"; }) < 10;
    });
    pressed.push_back(std::chrono::steady_clock::now());
    ASSERT_EQ(server.act({{"do", "take"}, {"set", set}}), 200);
    const Json state = await(server, [&](const Json& now) { return is_recorded(now, set); });
    ASSERT_TRUE(is_recorded(state, set)) << "lost: " << words(state);
    await(server, is_ready);
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - since;
  std::vector<double> delays_ms;
  for (const auto& watcher : watchers) {
    const std::vector<double> some = watcher->delays_ms();
    EXPECT_GT(some.size(), static_cast<std::size_t>(sets)) << "a watcher saw too few pictures";
    delays_ms.insert(delays_ms.end(), some.begin(), some.end());
  }
  for (int k = 0; k < 100 && watchers.front()->shots().size() < pressed.size(); ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  // A reader that is slow may miss a shot: then the figure is not known.
  const auto shots = watchers.front()->shots();
  std::vector<double> stored_ms;
  for (std::size_t k = 0; shots.size() == pressed.size() && k < shots.size(); ++k)
    stored_ms.push_back(std::chrono::duration<double, std::milli>(shots[k] - pressed[k]).count());
  if (!stored_ms.empty())
    std::printf("from the key to stored and announced: p50 %.0f ms, p95 %.0f ms\n",
                quantile(stored_ms, 0.5), quantile(stored_ms, 0.95));
  std::printf(
      "%d sets of 4 x 1.3 MP in %.0f s, five watchers: %zu pictures, from frame to client p50 "
      "%.0f ms, p95 %.0f ms; server %.2f cores, at most %.0f MB\n",
      sets, took.count(), delays_ms.size(), quantile(delays_ms, 0.5), quantile(delays_ms, 0.95),
      (server.cpu_s() - cpu_before_s) / took.count(), server.memory_mb());
  EXPECT_LE(server.memory_mb(), kMost_mb);
  EXPECT_EQ(read_recording(out() / "recording").sets.size(), static_cast<std::size_t>(sets));
}

struct Cost {
  double cpu_s = 0;
  long largest_kB = 0;  ///< its processes
  int exit_code = 0;
};

/// CPU time of a command, from a process of its own: this one's children hold those of the tests
/// before.
Cost cost_of(const std::string& line) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
  const pid_t pid = ::fork();
  if (pid == 0) {
    const Outcome outcome = run_line(line);
    if (outcome.exit_code != 0) std::printf("%s\n", outcome.text.c_str());
    std::fflush(stdout);
    rusage used{};
    ::getrusage(RUSAGE_CHILDREN, &used);
    const Cost cost{static_cast<double>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
                        1e-6 * static_cast<double>(used.ru_utime.tv_usec + used.ru_stime.tv_usec),
                    used.ru_maxrss, outcome.exit_code};
    ::_exit(::write(ends[1], &cost, sizeof cost) == sizeof cost ? 0 : 1);
  }
  ::close(ends[1]);
  Cost cost;
  const bool reported = ::read(ends[0], &cost, sizeof cost) == sizeof cost;
  ::close(ends[0]);
  ::waitpid(pid, nullptr, 0);
  if (!reported) throw std::runtime_error("no cost of " + line);
  return cost;
}

/// The same frames by GStreamer's source of Aravis and its PNG encoder, which nobody here wrote.
TEST_F(Watched, ALongCaptureCostsWhatOthersCost) {
  const char* wanted = std::getenv("DRAPE_WATCHED_SETS");
  const int sets = wanted != nullptr ? std::atoi(wanted) : trial_count(0, 1000);
  if (sets == 0) GTEST_SKIP() << "DRAPE_LONG_TESTS=1 is missing";
  if (run_line("gst-inspect-1.0 aravissrc").exit_code != 0)
    GTEST_SKIP() << "GStreamer's aravissrc is absent";
  begin_four(1);
  const Cost ours = cost_of(fmt::format("'{}' capture '{}' --set drape --frames {} --out '{}'",
                                        program("drape").string(), bench.rig().string(), sets,
                                        (out() / "recording").string()));
  EXPECT_EQ(ours.exit_code, 0);
  EXPECT_EQ(read_recording(out() / "recording").sets.size(), static_cast<std::size_t>(sets));
  const int others = std::min(sets, 100);
  std::string line = "gst-launch-1.0 -q";
  for (int c = 0; c < 4; ++c)
    line += fmt::format(
        " aravissrc camera-name=127.0.0.{} num-buffers={} packet-size=8192 "
        "features='TriggerMode=Off'"
        " ! pngenc ! multifilesink location='{}/cam{}-%04d.png'",
        2 + c, others, bench.folder().string(), c);
  const Cost gstreamer = cost_of(line);
  EXPECT_EQ(gstreamer.exit_code, 0);
  const double theirs_s = gstreamer.cpu_s * sets / others;
  std::printf(
      "%d sets of 4 x 1.3 MP: largest process %ld MB, %.1f CPU s; GStreamer %.1f CPU s (from %d)\n",
      sets, ours.largest_kB / 1024, ours.cpu_s, theirs_s, others);
  EXPECT_LE(ours.largest_kB, 200 * 1024);
  EXPECT_LE(ours.cpu_s, 1.5 * theirs_s);
}

}  // namespace
}  // namespace drape::test
