// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

#include "console/session.hpp"

namespace drape::console {

/// A private folder for temporary files, in memory if possible. Only its owner can access it. It is
/// removed with this object; one whose program was killed is removed when the same user makes the
/// next.
class MemoryFolder {
 public:
  /// Throws Error(bad_input) if `place` is not writable.
  explicit MemoryFolder(const fs::path& place = fs::is_directory("/dev/shm") ? "/dev/shm" : "/tmp");
  ~MemoryFolder();
  MemoryFolder(const MemoryFolder&) = delete;
  MemoryFolder& operator=(const MemoryFolder&) = delete;

  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
  int lock_ = -1;  ///< held during the life of the program
};

/// A frame scaled for the screen.
struct Picture {
  std::string jpeg;
  double saturated_fraction = 0;  ///< fraction of pixels at the sensor's largest value
};

/// Scales a frame (PNG, JPEG or TIFF; 8 or 16 bits) down to a width in px and paints every screen
/// pixel red that contains a saturated sensor pixel. Throws Error(bad_input) if the bytes are not a
/// picture.
[[nodiscard]] Picture make_picture(std::span<const unsigned char> bytes, int width_px,
                                   bool mark_saturation);

/// Cache of pictures of recorded frames, emptied when it is full. Thread-safe.
class PictureShelf {
 public:
  [[nodiscard]] Picture picture(const Recording& recording, const FrameSet& set,
                                const RecordedFrame& frame, int width_px, bool mark_saturation);

 private:
  static constexpr std::size_t kMostBytes = 32U << 20U;
  std::mutex mutex_;
  std::map<std::string, Picture> pictures_;
  std::size_t bytes_ = 0;
};

/// Criteria for a hand-held target that is still, in a pose of which no set was taken yet.
struct StillOptions {
  double still_s = 0.8;  ///< time without motion, s; a hand that holds a board pauses longer
  int pictures = 3;      ///< least number per camera in that time
  /// A pixel has changed if it differs by more than this fraction of the picture's contrast and by
  /// so many standard deviations of its noise: an edge that moved by a tenth of a picture pixel.
  double changed_contrast = 0.1, changed_sigmas = 6;
  double moving_fraction =
      5e-4;  ///< fraction of pixels changed since the last picture that counts as motion
  /// Means of blocks distinguish a new position from a tremor: a dot must leave its block.
  int block_px = 16;
  double new_fraction = 0.02;  ///< fraction of blocks changed since the last set, in so many views:
  int new_views = 2;           ///< that counts as a new pose
};

/// Grey levels of a picture, by row and column.
using Grey = Eigen::Matrix<unsigned char, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Analyses the scaled pictures that the cameras send while waiting. Not thread-safe.
class StillWatch {
 public:
  explicit StillWatch(std::vector<std::string> cameras, StillOptions options = {});

  /// Takes a picture (8 bits, any format that OpenCV reads) of a camera at a time in s.
  void see(const std::string& camera, std::span<const unsigned char> bytes, double at_s);
  /// True if a set is due; the pictures seen last are then taken as those of the set.
  [[nodiscard]] bool is_due(double at_s);
  /// Time without motion in the pictures of each camera, without cameras that sent
  /// none.
  [[nodiscard]] std::map<std::string, double> still_s(double at_s) const;
  /// Called if the set was refused, so that the same pose is due again.
  void forget_last_set();

 private:
  struct View {
    Grey last, of_set;
    double still_since_s = 0, seen_s = 0;
    int still_pictures = 0;
  };
  [[nodiscard]] bool moved(const Grey& before, const Grey& now) const;
  [[nodiscard]] bool is_new(const Grey& before, const Grey& now) const;

  std::vector<std::string> cameras_;
  StillOptions options_;
  std::map<std::string, View> views_;
};

struct Bench;

/// The newest picture of a live camera.
struct LivePicture {
  std::uint64_t number = 0;
  int width_px = 0;
  bool mark_saturation = false;
  std::string jpeg, facts;  ///< facts: ASCII JSON as written by `drape capture --preview`
};

/// The live cameras: the resident capture session and its messages, stillness, and marks in their
/// pictures. Thread-safe.
class Cameras {
 public:
  explicit Cameras(Bench& bench);
  ~Cameras();

  void open();  ///< throws Error(bad_input) while they are open
  void close();
  void shut();  ///< called before the objects to which they report are destroyed
  void take(const std::string& set);
  /// Has the capture take or restore a set by a line typed to it.
  void take_by(const std::string& set, const std::string& line);
  /// Sets exposure or gain until the cameras are closed; the value in use comes with the pictures.
  void light(const std::string& camera, const std::string& name, double value);
  [[nodiscard]] bool runs() const;
  /// Set that the capture is taking.
  [[nodiscard]] std::string taking() const {
    const std::lock_guard lock(mutex_);
    return taking_;
  }
  [[nodiscard]] bool automatic() const { return automatic_; }
  void automatic(bool on);
  [[nodiscard]] Json json() const;
  /// nullopt before the camera's first picture.
  [[nodiscard]] std::optional<LivePicture> picture(const std::string& camera, int width_px,
                                                   bool mark_saturation);
  /// Marks in the live pictures, in their pixels: found now, or last if another request looks; null
  /// without pictures.
  [[nodiscard]] std::shared_ptr<const Detections> marks(Surface surface);
  /// Time without motion in each camera's pictures; keeps watching for some
  /// seconds.
  [[nodiscard]] Json still_json();

 private:
  class Capture;
  void heard(const std::string& line);
  void ended(const std::string& sentence);
  void refuse(const std::string& why);
  void look(const std::string& camera);
  void type(const std::string& line);
  void require_open() const;
  [[nodiscard]] std::shared_ptr<const Detections> marks_now(Surface surface);
  [[nodiscard]] std::string newest(const std::string& camera, std::uint64_t& number) const;

  Bench& bench_;
  mutable std::mutex mutex_;  ///< guards the next four members
  std::map<Surface, std::shared_ptr<const Detections>> found_;
  std::string taking_;
  std::vector<std::string> words_;  ///< last lines printed by the capture
  bool ready_ = false;
  std::atomic<bool> automatic_ = false;
  std::mutex watch_mutex_;  ///< guards the next two members
  std::optional<StillWatch> watch_;
  double still_asked_s_ = -1e9;  ///< time of the last request for stillness
  std::mutex looking_;           ///< held while marks are searched, in the folder
  std::optional<MemoryFolder> live_folder_;
  std::mutex live_mutex_;  ///< lets many pages share one scaling
  std::map<std::string, LivePicture> live_;
  mutable std::mutex capture_mutex_;
  std::unique_ptr<Capture> capture_;
};

}  // namespace drape::console
