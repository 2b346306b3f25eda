// SPDX-License-Identifier: Apache-2.0
#include "compare/repeats/sheet_file.hpp"

#include "compare/records/provenance.hpp"
#include "core/files/files.hpp"

namespace drape::compare {

namespace fs = std::filesystem;

std::string SheetFile::scene() const {
  if (const auto* simulated = std::get_if<SimulatedSource>(&sheet.source)) return simulated->scene;
  return repeat ? repeat->scene : asked ? asked->name : std::string();
}

const MeasuredSource& SheetFile::measured() const {
  return std::get<MeasuredSource>(sheet.source);
}

bool SheetFile::has_content(const std::string& hash) const {
  return hash == sha256 || hash == ply_sha256;
}

SheetFile read_sheet_file(const fs::path& file) {
  require_as_recorded(file);
  const fs::path json = fs::path(file).replace_extension(".json");
  SheetFile read{file, {}, {}, read_sheet(file)};
  read.sha256 = sha256_of_file(json);
  read.ply_sha256 = sha256_of_file(fs::path(file).replace_extension(".ply"));
  if (read.sheet.is_measured()) {
    read.repeat = read.measured().repeat;
    read.asked = read.measured().asked_scene;
  }
  return read;
}

}  // namespace drape::compare
