// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "capture/host/channel.hpp"
#include "core/recording.hpp"

namespace drape::capture {

/// The recording that this process adds sets to. It is held by a lock, so that no second program
/// writes into it. Each set that is whole on the disk becomes a line of recording.journal, written
/// durably; publish() makes them part of recording.json. Lines that a killed capture left are made
/// part of it when the recording is opened the next time.
class Journal {
 public:
  /// Throws Error(bad_input) when another program holds the recording.
  Journal(const std::filesystem::path& folder, std::string recorded_on);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Folder in which a set is written before it is whole: nothing reads it, and the next capture
  /// removes it.
  [[nodiscard]] std::filesystem::path begin(const std::string& set) const;
  /// A file of such a set. It is on the disk, and has its name there once add() has returned.
  static void write(const std::filesystem::path& file, std::string_view content);
  /// Gives the set its name and acknowledges it. Its files stand in the folder of begin(). Of a
  /// burst that is killed, every set has the verdict that its last one was added with.
  void add(FrameSet set, const std::string& burst = {});
  /// <set>.new, which was added, takes the name of the set that is there, which is called
  /// <set>.take1, .take2, ... from now on, unless a killed capture has renamed that one already.
  /// Nothing of either changes but the name.
  void replace(const std::string& set);
  [[nodiscard]] bool holds(const std::string& set) const;
  /// Makes what was added part of recording.json, so that others read it while the capture goes on;
  /// the journal is gone. A run record of the recording as it was goes before.
  void publish();
  /// Was recording.json written?
  [[nodiscard]] bool changed() const { return changed_; }

  [[nodiscard]] Recording& recording() { return recording_; }
  [[nodiscard]] const Recording& recording() const { return recording_; }
  /// Sets of a killed capture.
  [[nodiscard]] std::size_t adopted() const { return adopted_; }
  /// Sets of one of which no image is there any more: they are left out.
  [[nodiscard]] const std::vector<std::string>& gone() const { return gone_; }

 private:
  void adopt();
  void adopt_lines(const std::string& text);
  bool adopt(FrameSet set);
  void leave_out_gone(std::vector<FrameSet>::iterator first_adopted);
  void write_line(const std::string& text);
  void rename(const std::string& from, const std::string& to);

  Descriptor lock_, file_;
  bool is_new_ = false;  ///< the folder was made here
  bool waits_ = false;   ///< recording.json lacks something
  bool changed_ = false;
  Recording recording_;
  std::size_t adopted_ = 0;
  std::vector<std::string> gone_;
};

/// Sets that a capture, which goes on or was killed, has stored and recording.json may lack.
[[nodiscard]] std::vector<FrameSet> sets_in_journal(const std::filesystem::path& folder);

/// True where no image of `set` is below `folder` any more, because one of `sets` is it by its last
/// name: a capture was killed after recording.json was written, before the journal was removed.
[[nodiscard]] bool is_renamed(const std::filesystem::path& folder, std::span<const FrameSet> sets,
                              const FrameSet& set);

}  // namespace drape::capture
