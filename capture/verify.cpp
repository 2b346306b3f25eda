// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "capture/capture.hpp"
#include "capture/folder_layout.hpp"
#include "capture/recording/journal.hpp"
#include "capture/ticker.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/parallel.hpp"

namespace drape::capture {
namespace {

struct Item {
  const FrameSet* set;
  const RecordedFrame* frame;
  std::optional<RecordingFault> fault;
};

void verify_one(const Recording& recording, Item& item) {
  try {
    static_cast<void>(read_frame(recording, *item.set, *item.frame));
  } catch (const Error& error) {
    item.fault = {item.set->name, item.frame->camera, item.frame->file, error.what_failed()};
  }
}

/// Checks the details stored with a live set: times, settings, ledger, stillness.
std::optional<RecordingFault> details_fault(const Recording& recording, const FrameSet& set) {
  if (!set.details_sha256) return std::nullopt;
  const std::string file = set.name + "/capture.json";
  if (!std::filesystem::exists(recording.folder / file))
    return RecordingFault{set.name, "", file, "the details of the set are missing"};
  if (sha256_of_file(recording.folder / file) == *set.details_sha256) return std::nullopt;
  return RecordingFault{set.name, "", file, "the details of the set were altered"};
}

}  // namespace

VerifyReport verify_recording(const std::filesystem::path& recording_folder,
                              const CaptureOptions& options) {
  options.check();
  const std::vector<FrameSet> in_journal = sets_in_journal(recording_folder);
  if (!in_journal.empty() && !std::filesystem::exists(recording_folder / "recording.json"))
    throw bad_input(
        fmt::format("not a recording yet: {} sets of a capture that goes on, or was ended, are in "
                    "its journal",
                    in_journal.size()),
        {.file = (recording_folder / "recording.journal").string()},
        "wait for its end; the next `drape capture` into this folder takes them over");
  const Recording recording = read_recording(recording_folder);
  std::vector<Item> items;
  std::set<std::string> listed;
  for (const FrameSet& set : recording.sets) {
    for (const RecordedFrame& frame : set.frames) {
      items.push_back({&set, &frame, std::nullopt});
      listed.insert(frame.file);
    }
  }

  Ticker ticker(options, items.size());
  parallel_for(items.size(), options.threads, [&](std::size_t i) {
    verify_one(recording, items[i]);
    ticker.done(items[i].frame->file);
  });

  VerifyReport report{recording.sets.size(), items.size(), {}, {}, {}, {}};
  for (const FrameSet& set : in_journal)
    if (!is_renamed(recording_folder, recording.sets, set) &&
        std::none_of(recording.sets.begin(), recording.sets.end(),
                     [&](const FrameSet& one) { return one.name == set.name; }))
      report.in_journal.push_back(set.name);
  for (Item& item : items) {
    if (item.fault) report.faults.push_back(std::move(*item.fault));
  }
  for (const FrameSet& set : recording.sets) {
    if (set.no_go) report.no_go.push_back(set.name + ": " + *set.no_go);
    if (auto fault = details_fault(recording, set)) report.faults.push_back(std::move(*fault));
  }
  for (const std::string& file : image_files_below(recording_folder)) {
    if (!listed.contains(file)) report.not_listed.push_back(file);
  }
  return report;
}

}  // namespace drape::capture
