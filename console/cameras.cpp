// SPDX-License-Identifier: Apache-2.0
// Live cameras: the resident capture, stillness, and marks in its pictures.
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/inotify.h>
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <span>
#include <thread>
#include <tuple>
#include <utility>

#include "console/console.hpp"
#include "core/files/files.hpp"
#include "core/program/child.hpp"

namespace drape::console {
namespace {

constexpr std::size_t kKeptWords = 12;
constexpr std::size_t kLongestLine = 4096;
constexpr int kEnding_ms = 5000;  ///< time given to a capture to end before it is killed
constexpr std::chrono::seconds kAskedFor(3);             ///< an open page asks every second
constexpr std::chrono::milliseconds kPause(200);         ///< between two detections
constexpr std::chrono::milliseconds kPauseInVain(1000);  ///< after a detection without a picture
constexpr int kLowestPriority = 19;

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::span<const unsigned char> bytes_of(const std::string& text) {
  return {reinterpret_cast<const unsigned char*>(text.data()), text.size()};
}

/// Returns X of "GO: X stored" or "GO: X restored".
std::string stored_in(const std::string& line) {
  const std::string begin = "GO: ";
  for (const std::string end : {" stored", " restored"})
    if (line.starts_with(begin) && line.ends_with(end))
      return line.substr(begin.size(), line.size() - begin.size() - end.size());
  return {};
}

/// Event for "camera `X`: ...": it was lost or has returned.
std::optional<Json> turn_of(const std::string& line) {
  const std::string begin = "camera `";
  const std::size_t end = line.find("`: ");
  if (!line.starts_with(begin) || end == std::string::npos) return std::nullopt;
  return Json{{"camera", line.substr(begin.size(), end - begin.size())},
              {"back", line.find("`: it sends frames again") == end},
              {"words", line}};
}

/// Comment in a PGM file: its second line, without the `#`.
std::string comment_of(const std::string& pgm) {
  const std::string begin = "P5\n# ";
  if (!pgm.starts_with(begin)) return "{}";
  return pgm.substr(begin.size(), pgm.find('\n', begin.size()) - begin.size());
}

}  // namespace

std::string text_in(const fs::path& folder, Rig rig) {
  const auto beside = [&](fs::path& file) {
    if (!file.empty()) file = fs::proximate(fs::absolute(file), fs::absolute(folder));
  };
  for (fs::path* file : {&rig.target_file, &rig.print_file, &rig.recording}) beside(*file);
  for (fs::path& scene : rig.scenes) beside(scene);
  return text_of(rig);
}

std::string detect_rig_text(const BenchFiles& bench, const fs::path& folder,
                            const std::map<std::string, std::pair<int, int>>& px) {
  Rig rig;
  rig.name = bench.rig.name;
  rig.target_file = bench.rig.target_file;
  rig.estimate_scale_x = bench.rig.estimate_scale_x;
  rig.recording = folder / "recording";
  if (!bench.drapes.empty()) rig.print_file = bench.drapes.front().scene.print_file;
  for (RigCamera camera : bench.rig.cameras) {
    const auto size = px.find(camera.name);
    if (size == px.end() && !px.empty()) continue;
    if (!px.empty()) std::tie(camera.width_px, camera.height_px) = size->second;
    rig.cameras.push_back(std::move(camera));
  }
  return text_in(folder, std::move(rig));
}

/// The resident session `drape capture RIG --out RECORDING --preview FOLDER`: the cameras remain
/// open, and a name typed to it takes a set. Its pictures are files in a folder in memory.
/// Thread-safe.
class Cameras::Capture {
 public:
  explicit Capture(Cameras& cameras) : cameras_(cameras) {
    const Session& session = cameras.bench_.session;
    words_ = words_of("capture", session.rig_file, "--out", session.recording_folder, "--preview",
                      previews_.path());
    const int watch = ::inotify_init1(IN_CLOEXEC | IN_NONBLOCK);
    if (watch < 0 || ::inotify_add_watch(watch, previews_.path().c_str(), IN_MOVED_TO) < 0)
      throw internal_error(fmt::format("cannot watch a folder: {}", std::strerror(errno)));
    Pipe lines;
    pid_ = start_child(program_beside("drape"), words_,
                       {.in = keyboard_.reading(),
                        .out = lines.writing(),
                        .err = lines.writing(),
                        .background = true});
    keyboard_.close_reading();
    lines.close_writing();
    thread_ =
        std::thread([this, said = std::move(lines), watch]() mutable { listen(said, watch); });
  }
  /// Ends it like `q`: stored sets become part of the recording.
  ~Capture() {
    {
      const std::lock_guard lock(mutex_);
      keyboard_.close_writing();  // the end of its input acts like `q`
    }
    for (int waited = 0; pid_ > 0 && waited < kEnding_ms; waited += 50) ::usleep(50000);
    if (const pid_t pid = pid_; pid > 0) ::kill(pid, SIGTERM);
    thread_.join();
  }
  Capture(const Capture&) = delete;
  Capture& operator=(const Capture&) = delete;

  [[nodiscard]] std::string shown() const {
    return Call{{words_.begin(), words_.end() - 2}}.shown();
  }
  [[nodiscard]] bool runs() const { return pid_ > 0; }

  /// Throws Error(device) if the session has ended.
  void type(const std::string& line) {
    const std::lock_guard lock(mutex_);
    const std::string text = line + "\n";
    if (keyboard_.writing() < 0 || pid_ <= 0 ||
        ::write(keyboard_.writing(), text.data(), text.size()) != static_cast<ssize_t>(text.size()))
      throw Error(ErrorKind::device, "the cameras are not open", {}, "open them again");
  }

  /// The newest picture of a camera (PGM) and its number; empty before the first.
  [[nodiscard]] std::string picture(const std::string& camera, std::uint64_t& number) const {
    {
      const std::lock_guard lock(mutex_);
      const auto found = numbers_.find(camera);
      if (found == numbers_.end()) return {};
      number = found->second;
    }
    return read_text(previews_.path() / (camera + ".pgm"));
  }

 private:
  void listen(Pipe& lines, int watch) {
    std::string text, last;
    while (lines.reading() >= 0) {
      std::array<pollfd, 2> watched = {{{lines.reading(), POLLIN, 0}, {watch, POLLIN, 0}}};
      if (::poll(watched.data(), watched.size(), -1) < 0) continue;
      alignas(inotify_event) std::array<char, 8192> buffer;
      if (watched[1].revents != 0) {
        const ssize_t got = ::read(watch, buffer.data(), buffer.size());
        for (ssize_t at = 0; at < got;) {
          const auto* event = reinterpret_cast<const inotify_event*>(buffer.data() + at);
          at += static_cast<ssize_t>(sizeof *event + event->len);
          const fs::path name = event->len > 0 ? event->name : "";
          if (name.extension() != ".pgm") continue;
          std::uint64_t number = 0;
          {
            const std::lock_guard lock(mutex_);
            number = ++numbers_[name.stem()];
          }
          cameras_.bench_.session.tell("frame",
                                       {{"camera", name.stem().string()}, {"number", number}});
          cameras_.look(name.stem());
        }
      }
      if (watched[0].revents != 0) {
        lines.take(text);
        for (auto end = text.find('\n'); end != std::string::npos; end = text.find('\n')) {
          last = text.substr(0, end);
          text.erase(0, end + 1);
          cameras_.heard(last);
        }
        if (text.size() > kLongestLine) text.clear();
      }
    }
    ::close(watch);
    static_cast<void>(await_child(pid_));
    pid_ = 0;
    cameras_.ended(last);
  }

  Cameras& cameras_;
  std::vector<std::string> words_;
  MemoryFolder previews_;
  mutable std::mutex mutex_;
  std::map<std::string, std::uint64_t> numbers_;
  Pipe keyboard_;
  std::atomic<pid_t> pid_ = 0;
  std::thread thread_;
};

/// Marks in the scaled pictures of live cameras, found repeatedly by `drape detect` while a page
/// requests them, on a thread of the lowest priority. Thread-safe.
class Cameras::LiveMarks {
 public:
  explicit LiveMarks(const Cameras& cameras) : cameras_(cameras), thread_([this] { work(); }) {}
  ~LiveMarks() {
    ending_ = true;
    wake_.notify_all();
    while (child_ > 0 && ::kill(child_, SIGKILL) != 0) std::this_thread::yield();
    thread_.join();
  }
  LiveMarks(const LiveMarks&) = delete;
  LiveMarks& operator=(const LiveMarks&) = delete;

  [[nodiscard]] std::shared_ptr<const Detections> look(Surface surface) {
    const std::lock_guard lock(mutex_);
    asked_ = Clock::now();
    surface_ = surface;
    wake_.notify_all();
    const auto found = found_.find(surface);
    return found == found_.end() ? nullptr : found->second;
  }

 private:
  using Clock = std::chrono::steady_clock;

  void work() {
    ::setpriority(PRIO_PROCESS, 0, kLowestPriority);  // for this thread, and the programs it starts
    while (!ending_) {
      Surface surface = Surface::target;
      {
        std::unique_lock lock(mutex_);
        const auto is_asked = [this] { return ending_ || Clock::now() - asked_ < kAskedFor; };
        wake_.wait(lock, is_asked);
        surface = surface_;
      }
      std::shared_ptr<const Detections> seen;
      try {
        if (!ending_) seen = look_now(surface);
      } catch (const Error&) {
        // If a picture cannot be read now, the next one is used.
      }
      std::unique_lock lock(mutex_);
      found_[surface] = seen;
      wake_.wait_for(lock, seen ? kPause : kPauseInVain, [this] { return ending_.load(); });
    }
  }

  [[nodiscard]] std::shared_ptr<const Detections> look_now(Surface surface) {
    Recording recording{folder_.path() / "recording", "live pictures", {}, {}};
    FrameSet set{"live", {}};
    std::map<std::string, std::pair<int, int>> sizes;
    const auto bench = cameras_.bench_.session.bench();
    for (const RigCamera& one : bench->rig.cameras) {
      const std::string& camera = one.name;
      std::uint64_t number = 0;
      const std::string pgm = cameras_.newest(camera, number);
      if (pgm.empty()) continue;
      const cv::Mat raw(1, static_cast<int>(pgm.size()), CV_8UC1, const_cast<char*>(pgm.data()));
      const cv::Mat image = cv::imdecode(raw, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
      if (image.empty()) return nullptr;
      std::vector<unsigned char> png;
      cv::imencode(".png", image, png, {cv::IMWRITE_PNG_COMPRESSION, 1});
      const std::string file = "live/" + camera + ".png";
      write_inside(recording.folder, file, as_text(png), {.camera = camera});
      set.frames.push_back({camera, file, sha256_of(png), image.cols, image.rows, {}});
      sizes[camera] = {image.cols, image.rows};
    }
    if (set.frames.empty()) return nullptr;
    recording.sets.push_back(set);
    write_recording(recording);
    write_durable(folder_.path() / "rig.toml", detect_rig_text(*bench, folder_.path(), sizes));
    const Call call{words_of("detect", recording.folder, "--rig", folder_.path() / "rig.toml",
                             "--surface", surface == Surface::target ? "target" : "cloth", "--sets",
                             "live", "--out", folder_.path() / "marks.json", "--threads", 1)};
    const CallEnd end = run_call(
        call, [](double, const std::string&) {}, child_);
    if (end.exit_code > 1) return nullptr;
    return std::make_shared<const Detections>(read_detections(folder_.path() / "marks.json"));
  }

  const Cameras& cameras_;
  MemoryFolder folder_;
  std::mutex mutex_;
  std::condition_variable wake_;
  Clock::time_point asked_ = {};
  Surface surface_ = Surface::target;  ///< surface requested last
  std::map<Surface, std::shared_ptr<const Detections>> found_;
  std::atomic<pid_t> child_ = 0;
  std::atomic<bool> ending_ = false;
  std::thread thread_;
};

Cameras::Cameras(Bench& bench) : bench_(bench) {
  if (bench.session.options.replay) return;
  std::vector<std::string> names;
  const auto files = bench.session.bench();  // holds what is looked through
  for (const RigCamera& camera : files->rig.cameras) names.push_back(camera.name);
  watch_.emplace(names);
  live_marks_ = std::make_unique<LiveMarks>(*this);
}

Cameras::~Cameras() = default;

void Cameras::open() {
  const std::lock_guard lock(capture_mutex_);
  if (capture_ && capture_->runs()) throw bad_input("the cameras are open", {}, "take a set");
  bench_.session.add(bench_.session.who(), "opens the cameras");
  capture_ = std::make_unique<Capture>(*this);
}

/// Makes the stored sets part of the recording.
void Cameras::close() {
  std::unique_ptr<Capture> closing;
  {
    const std::lock_guard lock(capture_mutex_);
    if (!capture_ || !capture_->runs()) throw bad_input("the cameras are closed", {}, "open them");
    closing = std::move(capture_);
  }
  bench_.session.add(bench_.session.who(), "closes the cameras");
}

void Cameras::shut() {
  live_marks_.reset();
  std::unique_ptr<Capture> closing;
  const std::lock_guard lock(capture_mutex_);
  closing.swap(capture_);
}

bool Cameras::runs() const {
  const std::lock_guard lock(capture_mutex_);
  return capture_ && capture_->runs();
}

std::string Cameras::taking() const {
  const std::lock_guard lock(mutex_);
  return taking_;
}

bool Cameras::automatic() const {
  const std::lock_guard lock(mutex_);
  return automatic_;
}

void Cameras::automatic(bool on) {
  {
    const std::lock_guard lock(mutex_);
    automatic_ = on;
  }
  const std::lock_guard lock(watch_mutex_);
  if (on) watch_->forget_last_set();
}

void Cameras::require_open() const {
  const std::lock_guard lock(mutex_);
  if (!ready_) throw bad_input("the cameras are not ready", {}, "wait, or open them again");
  if (!taking_.empty()) throw bad_input("a set is being taken", {.set = taking_}, "wait for it");
}

/// Types a line to the capture, after it is in the log.
void Cameras::type(const std::string& line) {
  const std::lock_guard lock(capture_mutex_);
  bench_.session.add(bench_.session.who(), "pressed " + line);
  if (!capture_) throw Error(ErrorKind::device, "the cameras are not open", {}, "open them");
  capture_->type(line);
}

/// Types a line that stores a set.
void Cameras::take_by(const std::string& set, const std::string& line) {
  require_open();
  {
    const std::lock_guard lock(mutex_);
    taking_ = set;
  }
  try {
    type(line);
  } catch (const Error&) {
    const std::lock_guard lock(mutex_);
    taking_.clear();
    throw;
  }
}

void Cameras::take(const std::string& set) {
  take_by(set, bench_.files.recorded(set) ? "r " + set : set);
}

void Cameras::undo(const std::string& set) {
  take_by(set, "u " + set);
}

void Cameras::light(const std::string& camera, const std::string& name, double value) {
  static_cast<void>(bench_.session.bench()->rig.camera(camera));
  require_open();
  type(fmt::format("{} {} {}", name, value, camera));
}

void Cameras::ended(const std::string& sentence) {
  std::string refused;
  {
    const std::lock_guard lock(mutex_);
    ready_ = false;
    refused = std::exchange(taking_, "");
  }
  if (!refused.empty()) bench_.session.tell("refused", {{"set", refused}, {"why", sentence}});
  heard("the cameras are closed: " + sentence);
  end_automatic(bench_, "the cameras are closed", false);
}

void Cameras::heard(const std::string& line) {
  std::string set = stored_in(line), refused, why;
  {
    const std::lock_guard lock(mutex_);
    const bool waits = line.starts_with("next: ");
    // Only a requested set, by a name from the rig.
    if (set != taking_) set.clear();
    if (waits && !taking_.empty()) {
      refused = std::exchange(taking_, "");
      if (!words_.empty()) why = words_.back();
    }
    words_.push_back(line);
    if (words_.size() > kKeptWords) words_.erase(words_.begin());
    ready_ = ready_ || waits;
  }
  if (!refused.empty()) {
    bench_.session.tell("refused", {{"set", refused}, {"why", why}});
    const std::lock_guard lock(watch_mutex_);
    watch_->forget_last_set();
  }
  if (const auto turn = turn_of(line)) bench_.session.tell("camera", *turn);
  try {
    if (!set.empty()) {
      bench_.session.add("bench", line.substr(4), {{"taken", set}});
      {
        const std::lock_guard lock(mutex_);
        taking_.clear();
      }
      take_in(bench_, set);
    } else if (!line.starts_with("next: ")) {
      bench_.session.add("capture", line);
    }
  } catch (const Error& error) {
    bench_.session.trouble(error.what());
  }
  bench_.session.tell("state", Json::object());
}

Json Cameras::json() const {
  if (bench_.session.options.replay) return {};
  Json json;
  {
    const std::lock_guard lock(capture_mutex_);
    json["runs"] = capture_ && capture_->runs();
    json["command"] = capture_ ? capture_->shown() : "";
  }
  const std::lock_guard lock(mutex_);
  json["ready"] = ready_;
  json["taking"] = taking_;
  json["automatic"] = automatic_;
  json["words"] = words_;
  json["doctor"] = bench_.session.doctor();
  return json;
}

std::string Cameras::newest(const std::string& camera, std::uint64_t& number) const {
  const std::lock_guard lock(capture_mutex_);
  return capture_ ? capture_->picture(camera, number) : std::string();
}

std::optional<LivePicture> Cameras::picture(const std::string& camera, int width_px,
                                            bool mark_saturation) {
  static_cast<void>(bench_.session.bench()->rig.camera(camera));
  const std::lock_guard lock(live_mutex_);
  std::uint64_t number = 0;
  const std::string bytes = newest(camera, number);
  if (bytes.empty()) return std::nullopt;
  LivePicture& kept = live_[camera];
  if (kept.number != number || kept.width_px != width_px || kept.mark_saturation != mark_saturation)
    kept = {number, width_px, mark_saturation,
            make_picture(bytes_of(bytes), width_px, mark_saturation).jpeg, comment_of(bytes)};
  return kept;
}

std::shared_ptr<const Detections> Cameras::marks(Surface surface) {
  return live_marks_ ? live_marks_->look(surface) : nullptr;
}

/// Processes a new picture of a live camera.
void Cameras::look(const std::string& camera) {
  bool takes = bench_.jobs.idle();
  {
    const std::lock_guard lock(mutex_);
    takes = takes && automatic_ && ready_ && taking_.empty();
  }
  {
    const std::lock_guard lock(watch_mutex_);
    if (!takes && now_s() - still_asked_s_ > kAskedFor.count()) return;
  }
  std::uint64_t number = 0;
  const std::string bytes = newest(camera, number);
  {
    const std::lock_guard lock(watch_mutex_);
    if (bytes.empty()) return;
    watch_->see(camera, bytes_of(bytes), now_s());
    if (!takes || !watch_->is_due(now_s())) return;
  }
  try {
    take_still_pose(bench_);
  } catch (const Error& error) {
    bench_.session.trouble(error.what());
  }
}

Json Cameras::still_json() {
  Json json = Json::object();
  const std::lock_guard lock(watch_mutex_);
  still_asked_s_ = now_s();
  if (watch_)
    for (const auto& [camera, still_s] : watch_->still_s(now_s()))
      json[camera] = std::round(10 * still_s) / 10;
  return json;
}

}  // namespace drape::console
