// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "capture/host/camera_host.hpp"
#include "capture/live/live_capture.hpp"
#include "core/calibration.hpp"
#include "core/fields/records.hpp"
#include "core/recording.hpp"

namespace drape::capture {

/// The recording to which this process adds sets, locked against other programs. Each set
/// that is complete on disk becomes a line of recording.journal, written durably;
/// publish() moves them to recording.json. The next opening adopts lines left by a killed
/// capture.
class Journal {
 public:
  /// Throws Error(bad_input) if another program has locked the recording.
  Journal(const std::filesystem::path& folder, std::string recorded_on);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Folder in which a set is written until it is complete. Nothing reads it, and the next capture
  /// removes leftovers.
  [[nodiscard]] std::filesystem::path begin(const std::string& set) const;
  /// Writes a file of such a set; once it returns, the file is on disk under its name.
  static void write(const std::filesystem::path& file, std::string_view content);
  /// Renames a finished set's folder from begin() and adds it to the journal. If a burst is killed,
  /// all of its sets get the verdict of the last one added.
  void add(FrameSet set, const std::string& burst = {});
  /// Replaces a set by <set>.new, which was added before: the old one is renamed to
  /// <set>.take1, <set>.take2, ..., unless a killed capture has already done so. Only names
  /// change.
  void replace(const std::string& set);
  /// Restores the previous take under its name; the current one becomes the next take. Throws
  /// Error(usage) if there is no earlier take.
  void restore(const std::string& set);
  [[nodiscard]] bool holds(const std::string& set) const;
  /// Moves the added sets to recording.json, for others to read while the capture goes on; then
  /// removes the journal. An outdated run record of the recording is removed first.
  void publish();
  /// True if recording.json was written.
  [[nodiscard]] bool changed() const { return changed_; }

  [[nodiscard]] Recording& recording() { return recording_; }
  [[nodiscard]] const Recording& recording() const { return recording_; }
  /// Number of sets adopted from a killed capture.
  [[nodiscard]] std::size_t adopted() const { return adopted_; }
  /// Names of sets left out because their images no longer exist.
  [[nodiscard]] const std::vector<std::string>& gone() const { return gone_; }

 private:
  void adopt();
  void adopt_lines(const std::string& text);
  bool adopt(FrameSet set);
  void leave_out_gone(std::vector<FrameSet>::iterator first_adopted);
  void write_line(const std::string& text);
  void rename(const std::string& from, const std::string& to);
  /// Gives a set its name; one that has the name becomes the next take.
  void put_in_place(const std::string& from, const std::string& set);
  /// Number of the set's last .take; 0 where there is none.
  [[nodiscard]] int newest_take(const std::string& set) const;
  [[nodiscard]] std::string free_take(const std::string& set) const;

  Descriptor lock_, file_;
  bool is_new_ = false;  ///< the folder was created here
  bool waits_ = false;   ///< recording.json is incomplete
  bool changed_ = false;
  Recording recording_;
  std::size_t adopted_ = 0;
  std::vector<std::string> gone_;
};

/// Sets that a running or killed capture has stored and that recording.json may lack.
[[nodiscard]] std::vector<FrameSet> sets_in_journal(const std::filesystem::path& folder);

/// True if `set` is a stale entry of the journal: its images are one of `sets` by now, under the
/// final name. A capture was killed after writing recording.json and before removing the journal.
[[nodiscard]] bool is_renamed(const std::filesystem::path& folder, std::span<const FrameSet> sets,
                              const FrameSet& set);

/// An 8-bit grey picture owned by the caller.
struct GreyView {
  std::span<const std::uint8_t> pixels;
  int width_px = 0, height_px = 0;
};

struct MotionOptions {
  int block_px = 48;  ///< side of the tracked blocks, px of the picture
  int shrink = 1;     ///< pixels per side averaged first, which lifts faint texture above the noise
  double largest_px = 3;  ///< a block that moves farther is lost; px of the reduced picture
  double largest_sd_px =
      0.015;  ///< blocks with a larger uncertainty are ignored; px of the picture
  double least_correlation = 0.7;  ///< below, a block no longer shows the same content
};

/// Motion of one block's content, px of the picture.
struct BlockMotion {
  double x_px = 0, y_px = 0;     ///< centre of the block
  double dx_px = 0, dy_px = 0;   ///< position in the second picture minus position in the first
  double sd_px = 0;              ///< from the residual noise; infinite during the iteration
  double residual_variance = 0;  ///< variance of the grey residuals after matching
};

struct MotionResult {
  std::vector<BlockMotion> blocks;
  int textured = 0;  ///< blocks with texture above their noise
  int lost = 0;      ///< textured blocks without a match nearby; others are too uncertain
  /// Lost blocks whose loss noise cannot explain, given the noise of matched blocks scaled with the
  /// grey level.
  int gone = 0;

  /// Largest motion of a block minus three standard deviations; 0 without blocks.
  [[nodiscard]] double largest_px() const;
  /// True if something moved out of range: a block is certainly gone, or over a tenth are lost.
  [[nodiscard]] bool is_lost() const { return gone > 0 || 10 * lost > textured; }
};

/// Tracks every textured block of one picture in others of the same size: least squares on the grey
/// values with an unknown brightness offset, iterated to sub-pixel convergence (Lucas and Kanade,
/// 1981). Data of the first picture are computed once and take four bytes per pixel.
class BlockFollower {
 public:
  BlockFollower(const GreyView& from, const MotionOptions& options);

  /// Throws Error(usage) if the pictures differ in size.
  [[nodiscard]] MotionResult motion_to(const GreyView& to) const;
  /// Motion across their edges of blocks with structure in one direction only, which motion_to()
  /// omits: a lower bound of their true motion. `gone` counts those whose loss the block's own
  /// noise cannot explain.
  [[nodiscard]] MotionResult motion_across_edges_to(const GreyView& to) const;
  [[nodiscard]] int textured() const;
  /// Number of blocks that can be matched with the required uncertainty, at the noise of the first
  /// picture, `from`.
  [[nodiscard]] int findable(const GreyView& from) const;
  [[nodiscard]] bool has_size_of(const GreyView& other) const;

 private:
  struct First;
  std::shared_ptr<const First> first_;
};

/// The static background behind a cloth, as shown in the reference set.
class Background {
 public:
  explicit Background(const GreyView& reference);

  /// Largest of five medians of block motion: over each quarter of the picture and all of it,
  /// so that a rotation about the axis shows too. Blocks covered by the cloth match nothing
  /// or are outvoted. nullopt if fewer than `kLeastBlocks` match in each region (the camera
  /// moved out of range or the cloth covers the background), or if the picture has another
  /// size.
  [[nodiscard]] std::optional<double> shift_px(const GreyView& now) const;
  /// True if the reference has enough texture above its noise to reveal a shift.
  [[nodiscard]] bool is_textured() const { return findable_ >= kLeastBlocks; }
  /// Largest shift that can be tracked.
  [[nodiscard]] double reach_px() const { return options_.shrink * options_.largest_px; }

 private:
  /// Chance matches are rare: none in 9,168 blocks of bench1 in another camera's pictures.
  static constexpr int kLeastBlocks = 8;

  MotionOptions options_;
  BlockFollower blocks_;
  int findable_;
};

struct StillOptions {
  double largest_motion_px = 0.05;  ///< largest allowed motion of the cloth during a burst
  double largest_shift_px =
      0.5;  ///< largest allowed shift of a background against the reference set
  std::optional<std::filesystem::path> calibration;  ///< calibration.json, for speeds in mm
};

struct CameraStill {
  std::string name;
  /// Largest motion of a block between two frames of the burst; absent if it went out of range.
  std::optional<double> motion_px;
  std::optional<double> speed_mm_per_s;  ///< speed of that block at the distance of the target
  std::optional<double> background_shift_px;
  bool lost = false;  ///< blocks moved out of range
  /// True if nothing could be tracked in at least one frame: structure in one direction only, or
  /// none above the noise.
  bool not_judged = false;
  /// True if the background was not found in at least one frame, so the shift is unknown.
  bool background_lost = false;
};

/// Motion of the cloth during a burst, and shift of the cameras since the reference set of
/// cameras.toml. Unknown without a second frame or a reference.
struct StillReport {
  std::vector<CameraStill> cameras;
  /// Largest over all cameras; absent if that of one camera is out of range.
  std::optional<double> motion_px, speed_mm_per_s, background_shift_px;
  std::optional<double> sync_error_mm;  ///< speed times largest spread of a set
  bool cloth_moved = false;
  std::vector<LiveFault> moved_cameras;
  std::optional<std::string> calibration_no_go;  ///< why no speed is given

  [[nodiscard]] std::optional<LiveFault> cloth_fault() const;
  /// Cameras for which it is unknown whether the cloth was still, unless another saw it move.
  [[nodiscard]] std::vector<std::string> not_judged() const;
};

/// Compares the sets of a burst as they arrive with the first one and with the reference set of
/// cameras.toml. Takes four bytes of memory per pixel of the first set.
class StillWatch {
 public:
  /// Throws Error(bad_input) if the reference set lacks a camera, has another image size, or has
  /// too little texture to reveal a shift.
  StillWatch(const CamerasFile& cameras, const StillOptions& options);
  void look(const LiveSet& set);
  [[nodiscard]] const StillReport& report() const { return report_; }

 private:
  /// First frame of a camera: blocks of the full picture, and of a reduced one, in which a
  /// repeating pattern cannot cause a false match.
  struct First {
    BlockFollower fine, coarse;
    std::optional<double> time_s;
  };
  /// Comparison of a frame with the first one and with the reference.
  struct Sight {
    std::optional<First> first;  ///< for the first set
    MotionResult fine, coarse;   ///< for later sets
    MotionResult edges;          ///< used if nothing else can be tracked
    std::optional<double> background_shift_px;
  };

  [[nodiscard]] Sight see(std::size_t c, const LiveFrame& now) const;
  void add_motion(std::size_t c, const LiveFrame& now, const Sight& sight);
  void add_place(std::size_t c, const Sight& sight);

  StillOptions options_;
  std::optional<Calibration> calibration_;
  std::vector<Background> backgrounds_;  ///< per camera; empty without a reference
  std::vector<First> first_;             ///< per camera
  double spread_s_ = 0;
  StillReport report_;
};

/// Examines all sets of `live` in order as one burst.
[[nodiscard]] StillReport look_still(const LiveResult& live, const CamerasFile& cameras,
                                     const StillOptions& options);

/// Lossless formats; PGM is many times faster to write and takes twice the space.
enum class FrameFormat { png, pgm };

struct RecordOptions {
  std::filesystem::path
      folder;  ///< folder of the recording: a new one, or one to which the set is added
  std::string set;
  int frames = 1;        ///< several frames are stored as <set>_000, <set>_001, ...
  bool average = false;  ///< store one set, the mean of all frames
  bool retake = false;   ///< the set exists: store as <set>.new for Journal::replace
  double largest_spread_s = 0;
  QualityLimits limits;
  std::string recorded_on;  ///< ISO date
  FrameFormat format = FrameFormat::png;
  StillOptions still;
};

struct RecordResult {
  std::vector<std::string> sets;   ///< names of the stored sets
  std::vector<LiveFault> refused;  ///< frames and sets that were refused, with reason and remedy
  std::vector<std::string> files;  ///< image files, relative to the folder
  StillReport still;
  std::size_t averaged = 0;                ///< frames per camera in the average
  std::optional<LiveFault> short_average;  ///< stored as NO-GO, with fewer frames than requested
  std::vector<double> spread_bounds_s;     ///< bounds for sets of unknown spread
};

/// Throws Error(usage) if the name, or its form for a burst or retake, cannot be that of a set or
/// is reserved for the recording's own files.
void require_set_name(const std::string& set);

/// Throws Error(bad_input) if an existing recording has other cameras or image sizes than the rig,
/// since both would be measured together.
void require_cameras_of_rig(const Recording& recording, const CamerasFile& rig);

/// Stores the sets of a capture as they arrive: <set>/<camera>.png or .pgm (8 bit, or 16
/// bit with the sensor's value in the high bits), <set>/<camera>.<format>.raw if grey does
/// not hold all the data, and <set>/capture.json. Refuses a set as a whole if one of its
/// frames is black, saturated, blurred or not of the rig's size, its spread is too large,
/// or a camera has moved since the reference set. An average is also refused if the cloth
/// moved.
class Recorder {
 public:
  /// Throws Error(bad_input) if the recording already holds a set of this name (for several frames,
  /// one that begins with it), or has other cameras.
  Recorder(const CamerasFile& cameras, RecordOptions options, Journal& journal);

  void add(LiveSet set, const LiveReport& report);
  /// Stores the average. The manifest is written when the journal is published.
  [[nodiscard]] RecordResult finish();

 private:
  /// Reason why the stored sets are not valid measurements; nullopt if they are.
  [[nodiscard]] std::optional<std::string> reason_against() const;
  [[nodiscard]] std::string folder_of(const std::string& set) const;
  void sum_up(LiveSet set, const LiveReport& report);
  void store(const std::string& name, const LiveSet& set,
             const std::vector<FrameQuality>& qualities, std::size_t averaged,
             const LiveReport& report);

  const CamerasFile& cameras_;
  RecordOptions options_;
  Journal& journal_;
  StillWatch still_;
  RecordResult result_;
  std::size_t taken_ = 0, summed_ = 0;
  /// For the average: the first set, and sums over all sets on the 16-bit scale.
  std::optional<LiveSet> first_;
  LiveReport first_report_;
  std::vector<std::vector<std::uint32_t>> sums_;
};

struct CameraDetails {
  LiveCameraReport report;
  std::int64_t frame_index = 0;
  std::optional<double> time_s;
  std::string pixel_format;
  int bits = 8;
  std::optional<std::string> raw_file, raw_sha256;
  FrameQuality quality;
};

/// capture.json of a set: times, spread, settings read back, clocks, ledger so far, stillness,
/// faults, and why the set is no valid measurement, if so.
struct SetDetails {
  std::string set;
  std::optional<std::string> no_go;
  std::string recorded_on;
  LiveReport report;  ///< `cameras` below has its cameras
  LiveSet moment;     ///< without its frames
  std::size_t averaged = 1;
  StillReport still;
  StillOptions still_options;
  std::vector<CameraDetails> cameras;
};
void fields(Fields& f, SetDetails& details);

/// The part of capture.json that an import keeps.
struct SetNotes {
  std::string set;  ///< name of the set when captured
  std::optional<std::string> no_go, cloth;
  std::optional<double> motion_px, camera_shift_px;
};
void fields(Fields& f, SetNotes& notes);

}  // namespace drape::capture

template <>
inline constexpr std::string_view drape::names_of<drape::capture::FrameFormat>[] = {"png", "pgm"};

template <>
inline constexpr drape::Format drape::format_of<drape::capture::SetDetails>{
    "capture", Syntax::json, 1, "details of a captured set"};
template <>
inline constexpr drape::Format drape::format_of<drape::capture::SetNotes>{"capture"};
