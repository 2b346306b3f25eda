// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "core/sheet.hpp"

namespace drape::compare {

/// Table and objects of a scene: each value of its file under its path ("object.1.x_mm"), a mesh as
/// the SHA-256 of its content.
using Surroundings = std::map<std::string, std::string>;

/// A sheet as read, with the SHA-256 of its .json (which carries everything).
struct SheetFile {
  std::filesystem::path file;
  std::string sha256;      ///< hash of <stem>.json: the sheet's identity in the store
  std::string ply_sha256;  ///< hash of <stem>.ply
  Sheet sheet;
  std::optional<RepeatId> repeat = {};   ///< absent: it says no laying
  std::optional<AskedScene> asked = {};  ///< absent: its marks were asked about none

  /// The scene that the file says to be of; a measured one may say none.
  [[nodiscard]] std::string scene() const;
  [[nodiscard]] std::string face() const { return repeat ? repeat->face : std::string(); }
  [[nodiscard]] const MeasuredSource& measured() const;  ///< its source, where it was measured
  [[nodiscard]] bool has_content(const std::string& hash) const;  ///< either file has this hash
};

/// Reads both files of a sheet, whichever is named. Throws Error(bad_input) also where they are not
/// what their run record says.
[[nodiscard]] SheetFile read_sheet_file(const std::filesystem::path& file);

}  // namespace drape::compare
