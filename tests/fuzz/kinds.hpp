// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/sheet.hpp"
#include "core/simulation_files.hpp"

namespace drape::test {

/// A kind of file: makes a valid one in a folder, and reads it.
struct Kind {
  std::string name;
  std::function<std::filesystem::path(const std::filesystem::path& folder)> make;
  std::function<void(const std::filesystem::path& file)> read;
  bool refuses = true;  ///< false if errors are skipped, or read as out of date
  /// Regular expression of the faults that nobody can tell, each as "kind: line before it".
  std::string free = "$^";
};

[[nodiscard]] std::vector<Kind> core_kinds();
[[nodiscard]] std::vector<Kind> stage_kinds();
/// Files from cameras and screens, decoded by OpenCV.
[[nodiscard]] std::vector<Kind> image_kinds();
/// Files written by comparisons and studies, tables of people, and the store.
[[nodiscard]] std::vector<Kind> result_kinds();
/// Calibrations and points of other programs, and folders of pictures.
[[nodiscard]] std::vector<Kind> foreign_kinds();
[[nodiscard]] std::vector<Kind> all_kinds();

/// 2 x 2 marks, two of them measured.
[[nodiscard]] Sheet small_sheet();
/// A cloth of triangles with every optional part.
[[nodiscard]] Certificate small_certificate();
[[nodiscard]] LevelsFile small_levels();
/// Two marks and a value of each kind, one of them without displacements.
[[nodiscard]] SensitivityFile small_sensitivity();
/// One drape refused by the checker.
[[nodiscard]] CusickFile small_cusick();
[[nodiscard]] Detections small_detections();
[[nodiscard]] Calibration small_calibration();

/// Reads the file; empty if the reader returned a value or threw one Error(bad_input) that names a
/// file, otherwise what it did. Sets `refused` if it threw one.
[[nodiscard]] std::string broken_promise(const Kind& kind, const std::filesystem::path& file,
                                         bool& refused);

}  // namespace drape::test
