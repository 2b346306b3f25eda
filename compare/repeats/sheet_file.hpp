// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "core/sheet.hpp"

namespace drape::compare {

/// Table and objects of a scene: each value of its file by path ("object.1.x_mm"); a mesh by the
/// SHA-256 of its content.
using Surroundings = std::map<std::string, std::string>;

/// A sheet as read, with the SHA-256 of its .json (which contains everything).
struct SheetFile {
  std::filesystem::path file;
  std::string sha256;      ///< hash of <stem>.json, which identifies the sheet in the store
  std::string ply_sha256;  ///< hash of <stem>.ply
  Sheet sheet;
  std::optional<RepeatId> repeat = {};   ///< absent if it names no laying
  std::optional<AskedScene> asked = {};  ///< absent if its marks were measured without a scene

  /// The scene named in the file; a measured sheet may name none.
  [[nodiscard]] std::string scene() const;
  [[nodiscard]] std::string face() const { return repeat ? repeat->face : std::string(); }
  [[nodiscard]] const MeasuredSource& measured() const;  ///< source; must be a measured sheet
  [[nodiscard]] bool has_content(const std::string& hash) const;  ///< if either has this hash
};

/// Reads both files of a sheet, given either. Throws Error(bad_input) also if they differ from
/// their run record.
[[nodiscard]] SheetFile read_sheet_file(const std::filesystem::path& file);

}  // namespace drape::compare
