// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "capture/host/camera_host.hpp"
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

}  // namespace drape::capture
