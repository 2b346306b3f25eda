// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/calibration.hpp"
#include "core/certificate.hpp"
#include "core/cusick.hpp"
#include "core/detections.hpp"
#include "core/levels.hpp"
#include "core/sensitivity.hpp"
#include "core/sheet.hpp"

namespace drape::test {

/// A kind of file: a good one made in a folder, and its reader.
struct Kind {
  std::string name;
  std::function<std::filesystem::path(const std::filesystem::path& folder)> make;
  std::function<void(const std::filesystem::path& file)> read;
  bool refuses = true;  ///< false: what is wrong is left out, or read as out of date
};

[[nodiscard]] std::vector<Kind> core_kinds();
[[nodiscard]] std::vector<Kind> stage_kinds();
/// Files from cameras and screens, decoded by OpenCV.
[[nodiscard]] std::vector<Kind> image_kinds();
/// Files that comparisons, studies and people's tables leave, and the store.
[[nodiscard]] std::vector<Kind> result_kinds();
[[nodiscard]] std::vector<Kind> all_kinds();

/// 2 x 2 marks, two of them measured.
[[nodiscard]] Sheet small_sheet();
/// A cloth of triangles with every part that may be absent.
[[nodiscard]] Certificate small_certificate();
[[nodiscard]] LevelsFile small_levels();
/// Two marks, a value of each kind, one without moves.
[[nodiscard]] SensitivityFile small_sensitivity();
/// One drape that the checker refuses.
[[nodiscard]] CusickFile small_cusick();
[[nodiscard]] Detections small_detections();
[[nodiscard]] Calibration small_calibration();

/// Reads the file; empty, or why the reader did not keep the promise of one Error(bad_input) that
/// names a file. Sets `refused` when it threw one.
[[nodiscard]] std::string broken_promise(const Kind& kind, const std::filesystem::path& file,
                                         bool& refused);

}  // namespace drape::test
