// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/recording/record.hpp"
#include "core/program/program.hpp"

namespace drape::capture {

struct CaptureCommand {
  std::filesystem::path rig, recording;
  std::string set;
  int frames = 1;
  bool average = false;
  FrameFormat format = FrameFormat::png;
  std::optional<std::filesystem::path> calibration;
  double patience_s = 20;
  std::filesystem::path preview;  ///< of a session: folder for pictures of what the cameras see
};

/// A session: the cameras stay open, Enter takes the next set of the rig's list. Whoever leads it,
/// a person or the console, types lines to its standard input (the name of a set; nothing: the next
/// of the rig; `r`: the last one again; `r NAME`: that one, what was there is kept as NAME.take1;
/// `exposure_us 3000 CAMERA` or `gain_db 2 CAMERA`: set it, until the end; `q` or the end of the
/// input: end) and reads its standard
/// error: `next: ...` when it waits for a line, `GO: NAME stored` once the set is in
/// recording.json, `GO: CAMERA has exposure_us = ...`, `NO-GO: reason; to do: ...`, and a line for
/// each camera that is lost or back.
int run_session(const CaptureCommand& command, std::vector<std::string> arguments,
                const CommonOptions& common);

// What the subcommands of drape-capture do; each returns the exit code.
int run_capture(const CaptureCommand& command, std::vector<std::string> arguments,
                const CommonOptions& common);
int run_import(const std::filesystem::path& folder, const std::filesystem::path& recording,
               const std::optional<std::string>& recorded_on, bool allow_missing,
               std::vector<std::string> arguments, const CommonOptions& common);
int run_verify(const std::filesystem::path& recording, const CommonOptions& common);

}  // namespace drape::capture
