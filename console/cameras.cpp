// SPDX-License-Identifier: Apache-2.0
#include "console/cameras.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <tuple>

#include "console/console.hpp"
#include "core/statistics/sample.hpp"

namespace drape::console {
namespace {

// ---- folder in memory --------------------------------------------------------------------------

constexpr std::string_view kName = "drape-bench-";
constexpr int kAttempts = 10;

/// Opens and locks the folder; negative if another program holds it, or if it is not a folder.
int locked(const fs::path& folder) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (fd >= 0 && ::flock(fd, LOCK_EX | LOCK_NB) == 0) return fd;
  if (fd >= 0) ::close(fd);
  return -1;
}

/// Removes folders that nobody holds, because their programs were killed.
void remove_left_behind(const fs::path& place) {
  std::error_code ignored;
  std::vector<fs::path> found;
  for (fs::directory_iterator at(place, ignored), end; at != end; at.increment(ignored))
    if (at->path().filename().string().starts_with(kName)) found.push_back(at->path());
  for (const fs::path& folder : found) {
    const int fd = locked(folder);
    if (fd < 0) continue;
    struct stat seen {};
    if (::fstat(fd, &seen) == 0 && seen.st_uid == ::geteuid()) fs::remove_all(folder, ignored);
    ::close(fd);
  }
}

}  // namespace

MemoryFolder::MemoryFolder(const fs::path& place) {
  remove_left_behind(place);
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    std::string name = (place / fmt::format("{}XXXXXX", kName)).string();
    if (::mkdtemp(name.data()) == nullptr)
      throw bad_input(fmt::format("cannot be made: {}", std::strerror(errno)), {.file = name},
                      "free memory, or the disk");
    path_ = name;
    lock_ = locked(path_);
    if (lock_ >= 0 && fs::exists(path_)) return;
    if (lock_ >= 0) ::close(lock_);  // another program removed it before it was locked
  }
  throw internal_error(fmt::format("{} cannot be locked", path_.string()));
}

MemoryFolder::~MemoryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
  ::close(lock_);
}

namespace {

// ---- pictures for the screen -------------------------------------------------------------------

constexpr int kLeastWidth = 80, kMostWidth = 1600;
constexpr int kJpegQuality = 80;
constexpr std::size_t kMostPixels = std::size_t{1} << 26;  // largest picture of a recording
constexpr int kLongestSide = 32767;                        // px; a JPEG has room for 65500

/// Grey levels of a picture; empty if it cannot be read.
cv::Mat decoded(std::span<const unsigned char> bytes, int more_flags = 0) {
  const cv::Mat raw(1, static_cast<int>(bytes.size()), CV_8UC1,
                    const_cast<unsigned char*>(bytes.data()));
  try {
    if (begins_as_picture(bytes))
      return cv::imdecode(raw, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION | more_flags);
  } catch (const cv::Exception&) {
    // As if it were empty.
  }
  return {};
}

}  // namespace

Picture make_picture(std::span<const unsigned char> bytes, int width_px, bool mark_saturation) {
  const cv::Mat image = decoded(bytes, cv::IMREAD_ANYDEPTH);
  if (image.empty() || (image.depth() != CV_8U && image.depth() != CV_16U) ||
      image.total() > kMostPixels || std::max(image.rows, image.cols) > kLongestSide)
    throw bad_input("the image cannot be read", {}, "take the set again");
  const double full = image.depth() == CV_16U ? 65535 : 255;
  // Sensors with 10 or 12 bits use the high bits of 16.
  const cv::Mat bright = image >= (image.depth() == CV_16U ? full - 63 : full);
  const int width = std::min(std::clamp(width_px, kLeastWidth, kMostWidth), image.cols);
  const cv::Size size(
      width, std::max(1, static_cast<int>(
                             std::lround(static_cast<double>(image.rows) * width / image.cols))));
  cv::Mat small, mask, shown;
  cv::resize(image, small, size, 0, 0, cv::INTER_AREA);
  if (small.depth() == CV_16U) small.convertTo(small, CV_8U, 1.0 / 257);
  shown = small;
  Picture picture;
  picture.saturated_fraction =
      static_cast<double>(cv::countNonZero(bright)) / static_cast<double>(image.total());
  if (mark_saturation) {
    cv::cvtColor(small, shown, cv::COLOR_GRAY2BGR);
    cv::Mat spread;
    bright.convertTo(spread, CV_32F);
    cv::resize(spread, spread, size, 0, 0, cv::INTER_AREA);
    shown.setTo(cv::Scalar(40, 40, 230), spread > 0);
  }
  std::vector<unsigned char> jpeg;
  cv::imencode(".jpg", shown, jpeg, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
  picture.jpeg.assign(jpeg.begin(), jpeg.end());
  return picture;
}

Picture PictureShelf::picture(const Recording& recording, const FrameSet& set,
                              const RecordedFrame& frame, int width_px, bool mark_saturation) {
  const std::string key = fmt::format("{} {} {}", frame.sha256, width_px, mark_saturation);
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = pictures_.find(key); found != pictures_.end()) return found->second;
  }
  Picture made = make_picture(read_frame(recording, set, frame), width_px, mark_saturation);
  const std::lock_guard lock(mutex_);
  if (bytes_ + made.jpeg.size() > kMostBytes) {
    pictures_.clear();
    bytes_ = 0;
  }
  if (pictures_.emplace(key, made).second) bytes_ += made.jpeg.size();
  return made;
}

namespace {

// ---- stillness ---------------------------------------------------------------------------------

constexpr int kLevels = 256;
constexpr double kLost_s = 2;  ///< time without a picture
constexpr double kMedianToSigma = 1.4826;
using Counts = std::array<std::int64_t, kLevels>;

double grey_contrast(const Grey& image) {
  Counts counts{};
  for (const unsigned char level : image.reshaped()) ++counts[level];
  return counted_quantile(counts, 0.95) - counted_quantile(counts, 0.05);
}

}  // namespace

StillWatch::StillWatch(std::vector<std::string> cameras, StillOptions options)
    : cameras_(std::move(cameras)), options_(options) {
  for (const std::string& camera : cameras_) views_[camera] = {};
}

bool StillWatch::moved(const Grey& before, const Grey& now) const {
  if (before.rows() != now.rows() || before.cols() != now.cols()) return true;
  Counts counts{};
  const Eigen::MatrixXi change = (now.cast<int>() - before.cast<int>()).cwiseAbs();
  for (const int levels : change.reshaped()) ++counts[static_cast<std::size_t>(levels)];
  // Edges are few, so the median is noise; rounding to whole levels has 1/sqrt(12) of a level.
  const double sigma =
      std::max(kMedianToSigma * counted_quantile(counts, 0.5), std::sqrt(2.0 / 12.0));
  const double limit =
      std::max(options_.changed_contrast * grey_contrast(now), options_.changed_sigmas * sigma);
  std::int64_t changed = 0;
  for (int level = 0; level < kLevels; ++level)
    if (level > limit) changed += counts[static_cast<std::size_t>(level)];
  return static_cast<double>(changed) > options_.moving_fraction * static_cast<double>(now.size());
}

bool StillWatch::is_new(const Grey& before, const Grey& now) const {
  if (before.rows() != now.rows() || before.cols() != now.cols()) return true;
  const int size = options_.block_px;
  const double limit = options_.changed_contrast * grey_contrast(now) * size * size;
  const Eigen::MatrixXi difference = now.cast<int>() - before.cast<int>();
  int blocks = 0, changed = 0;
  for (int top = 0; top + size <= difference.rows(); top += size)
    for (int left = 0; left + size <= difference.cols(); left += size, ++blocks)
      if (std::abs(difference.block(top, left, size, size).sum()) > limit) ++changed;
  return changed > options_.new_fraction * blocks;
}

void StillWatch::see(const std::string& camera, std::span<const unsigned char> bytes, double at_s) {
  const auto found = views_.find(camera);
  if (found == views_.end()) return;
  const cv::Mat image = decoded(bytes);
  if (image.empty()) return;
  View& view = found->second;
  Grey now = Eigen::Map<const Grey>(image.data, image.rows, image.cols);
  if (moved(view.last, now)) {
    view.still_since_s = at_s;
    view.still_pictures = 0;
  }
  ++view.still_pictures;
  view.last = std::move(now);
  view.seen_s = at_s;
}

std::map<std::string, double> StillWatch::still_s(double at_s) const {
  std::map<std::string, double> all;
  for (const auto& [name, view] : views_)
    if (at_s - view.seen_s < kLost_s && view.last.size() > 0)
      all[name] = view.seen_s - view.still_since_s;
  return all;
}

bool StillWatch::is_due(double at_s) {
  int new_views = 0;
  for (const std::string& name : cameras_) {
    const View& one = views_[name];
    if (one.still_pictures < options_.pictures || at_s - one.still_since_s < options_.still_s)
      return false;
    if (is_new(one.of_set, one.last)) ++new_views;
  }
  const int wanted = std::min(options_.new_views, static_cast<int>(cameras_.size()));
  const bool ready = new_views >= wanted;
  if (ready)
    for (auto& [name, one] : views_) one.of_set = one.last;
  return ready;
}

void StillWatch::forget_last_set() {
  for (auto& [name, view] : views_) {
    view.of_set = {};
    view.still_pictures = 0;
  }
}

namespace {

constexpr std::size_t kKeptWords = 12;
constexpr std::size_t kLongestLine = 4096;
constexpr int kEnding_ms = 5000;   ///< time given to a capture to end before it is killed
constexpr double kAskedFor_s = 3;  ///< an open page asks every second
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
    Pipe lines;
    pid_ = start_child(program_beside("drape"), words_,
                       {.in = keyboard_.reading(),
                        .out = lines.writing(),
                        .err = lines.writing(),
                        .background = true});
    keyboard_.close_reading();
    lines.close_writing();
    thread_ = std::thread([this, said = std::move(lines)]() mutable { listen(said); });
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
  void listen(Pipe& lines) {
    std::string text, last;
    while (lines.reading() >= 0) {
      lines.take(text);
      for (auto end = text.find('\n'); end != std::string::npos; end = text.find('\n')) {
        const std::string line = text.substr(0, end), picture = "picture: ";
        text.erase(0, end + 1);
        if (line.starts_with(picture)) {
          show(line.substr(picture.size()));
        } else {
          last = line;
          cameras_.heard(line);
        }
      }
      if (text.size() > kLongestLine) text.clear();
    }
    static_cast<void>(await_child(pid_));
    pid_ = 0;
    cameras_.ended(last);
  }

  void show(const std::string& camera) {
    std::uint64_t number = 0;
    {
      const std::lock_guard lock(mutex_);
      number = ++numbers_[camera];
    }
    cameras_.bench_.session.tell("frame", {{"camera", camera}, {"number", number}});
    cameras_.look(camera);
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

Cameras::Cameras(Bench& bench) : bench_(bench) {
  if (bench.session.options.replay) return;
  std::vector<std::string> names;
  const auto files = bench.session.bench();  // holds what is looked through
  for (const RigCamera& camera : files->rig.cameras) names.push_back(camera.name);
  watch_.emplace(names);
  live_folder_.emplace();
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
  if (!runs()) throw bad_input("the cameras are closed", {}, "open them");
  shut();
  bench_.session.add(bench_.session.who(), "closes the cameras");
}

void Cameras::shut() {
  std::unique_ptr<Capture> closing;  // ends after the lock, which its thread takes
  const std::lock_guard lock(capture_mutex_);
  closing.swap(capture_);
}

bool Cameras::runs() const {
  const std::lock_guard lock(capture_mutex_);
  return capture_ && capture_->runs();
}

void Cameras::automatic(bool on) {
  automatic_ = on;
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

void Cameras::light(const std::string& camera, const std::string& name, double value) {
  static_cast<void>(bench_.session.bench()->rig.camera(camera));
  require_open();
  type(fmt::format("{} {} {}", name, value, camera));
}

void Cameras::ended(const std::string& sentence) {
  {
    const std::lock_guard lock(mutex_);
    ready_ = false;
  }
  refuse(sentence);
  heard("the cameras are closed: " + sentence);
  end_automatic(bench_, "the cameras are closed", false);
}

/// Tells why the set that is being taken is not stored, if there is one.
void Cameras::refuse(const std::string& why) {
  std::string set;
  {
    const std::lock_guard lock(mutex_);
    set = std::exchange(taking_, "");
  }
  if (set.empty()) return;
  bench_.session.tell("refused", {{"set", set}, {"why", why}});
  const std::lock_guard lock(watch_mutex_);
  watch_->forget_last_set();
}

void Cameras::heard(const std::string& line) {
  const bool waits = line.starts_with("next: ");
  std::string set = stored_in(line), before;
  {
    const std::lock_guard lock(mutex_);
    // Only a requested set, by a name from the rig, of which the line has the printable form.
    set = set == printable(taking_) ? taking_ : "";
    if (!words_.empty()) before = words_.back();
    words_.push_back(line);
    if (words_.size() > kKeptWords) words_.erase(words_.begin());
    ready_ = ready_ || waits;
  }
  if (waits) refuse(before);
  if (const auto turn = turn_of(line)) bench_.session.tell("camera", *turn);
  try {
    if (!set.empty()) {
      bench_.session.add("bench", line.substr(4), {{"taken", set}});
      {
        const std::lock_guard lock(mutex_);
        taking_.clear();
      }
      take_in(bench_, set);
    } else if (!waits) {
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
  json["automatic"] = automatic_.load();
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
  // One request looks at a time; the others get what was found before.
  if (const std::unique_lock looks(looking_, std::try_to_lock); live_folder_ && looks) {
    std::shared_ptr<const Detections> seen;
    try {
      seen = marks_now(surface);
    } catch (const Error&) {
      // If a picture cannot be read now, the next one is used.
    }
    const std::lock_guard lock(mutex_);
    found_[surface] = seen;
  }
  const std::lock_guard lock(mutex_);
  return found_[surface];
}

/// Finds the marks by `drape detect` at the lowest priority; null without a picture.
std::shared_ptr<const Detections> Cameras::marks_now(Surface surface) {
  const fs::path& folder = live_folder_->path();
  Recording recording{folder / "recording", "live pictures", {}, {}};
  FrameSet set{"live", {}};
  std::map<std::string, std::pair<int, int>> sizes;
  const auto bench = bench_.session.bench();
  for (const RigCamera& one : bench->rig.cameras) {
    const std::string& camera = one.name;
    std::uint64_t number = 0;
    const std::string pgm = newest(camera, number);
    if (pgm.empty()) continue;
    const cv::Mat image = decoded(bytes_of(pgm));
    if (image.empty()) return nullptr;
    const std::string file = "live/" + camera + ".pgm";
    write_inside(recording.folder, file, pgm, {.camera = camera});
    set.frames.push_back({camera, file, sha256_of(pgm), image.cols, image.rows, {}});
    sizes[camera] = {image.cols, image.rows};
  }
  if (set.frames.empty()) return nullptr;
  recording.sets.push_back(set);
  write_recording(recording);
  write_durable(folder / "rig.toml", detect_rig_text(*bench, folder, sizes));
  const Call call{words_of("detect", recording.folder, "--rig", folder / "rig.toml", "--surface",
                           surface == Surface::target ? "target" : "cloth", "--sets", "live",
                           "--out", folder / "marks.json", "--threads", 1),
                  {},
                  {},
                  kLowestPriority};
  if (run_call(call).exit_code > 1) return nullptr;
  return std::make_shared<const Detections>(read_detections(folder / "marks.json"));
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
    if (!takes && now_s() - still_asked_s_ > kAskedFor_s) return;
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
