// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "calib/acceptance/positions.hpp"
#include "core/files/files.hpp"
#include "core/program/run_record.hpp"

namespace drape::calib {
namespace {

namespace fs = std::filesystem;

/// True if a file holds detections; an unreadable file does not.
bool is_detections(const fs::path& file) {
  try {
    require_format(Document::read(file), format_of<Detections>);
    return true;
  } catch (const Error&) {
    return false;
  }
}

}  // namespace

CalibrationEvidence detections_behind(const fs::path& calibration, const fs::path& tested) {
  const fs::path file = run_record_path(calibration);
  const std::string name = calibration.filename().string();
  CalibrationEvidence evidence;
  if (!fs::is_regular_file(file)) {
    evidence.missing = fmt::format("there is no {} beside {}", file.filename().string(), name);
    return evidence;
  }
  const RunFile record = read_run_file(file);
  if (!record.wrote(sha256_of_file(calibration))) {
    evidence.missing =
        fmt::format("{} is the record of another file than {}", file.filename().string(), name);
    return evidence;
  }
  evidence.missing = fmt::format("{} names no detections", file.filename().string());
  const std::string tested_now = sha256_of_file(tested);
  for (const RecordedFile& input : record.inputs) {
    const std::string& recorded = input.sha256;
    // A file that was moved or replaced is still recognised by its hash.
    const fs::path named = recorded == tested_now ? tested : place_of(file, input);
    if (!fs::is_regular_file(named)) {
      if (named.extension() == ".json")
        evidence.missing = fmt::format("{}, from which {} was made, is not there",
                                       named.lexically_normal().string(), name);
      continue;
    }
    if (!is_detections(named)) continue;
    if (recorded == tested_now || sha256_of_file(named) == recorded)
      return {read_detections(named), named.lexically_normal().string(), ""};
    evidence.missing = fmt::format("{}, from which {} was made, has another content now",
                                   named.lexically_normal().string(), name);
  }
  return evidence;
}

}  // namespace drape::calib
