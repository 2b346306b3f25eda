// SPDX-License-Identifier: Apache-2.0
#include "compare/history/copies.hpp"

#include "core/files/files.hpp"
#include "core/files/inside.hpp"

namespace drape::compare {

namespace fs = std::filesystem;

namespace {

constexpr const char* kFolder = ".files/";

/// Both files of a sheet under the hash of its .json, which says which sheet it is.
void copy_sheet(const fs::path& folder, const SheetFile& sheet, std::vector<fs::path>& copies) {
  for (const char* extension : {".ply", ".json"}) {
    const fs::path from = fs::path(sheet.file).replace_extension(extension);
    const fs::path to = folder / sheet.sha256.substr(0, 2) / (sheet.sha256 + extension);
    const std::string text = read_text(from);
    // What another lab's store brought under this name is not believed to be this sheet.
    if (!fs::is_regular_file(to) || read_text(to) != text) write_durable(to, text);
    copies.push_back(to);
  }
}

}  // namespace

std::vector<fs::path> keep_copies(const fs::path& store, const Session& session) {
  const fs::path folder = store.string() + kFolder;
  std::vector<fs::path> copies;
  const auto add = [&](const Simulation& simulation) {
    if (!simulation.other_simulator) copy_sheet(folder, simulation.sheet, copies);
  };
  for (const DrapeFiles& drape : session.drapes) {
    copy_sheet(folder, drape.input.measured, copies);
    for (const Simulation& simulation : drape.input.simulations) add(simulation);
  }
  for (const auto& group : session.virtual_only)
    for (const Simulation& simulation : group) add(simulation);
  return copies;
}

std::vector<fs::path> take_copies(const fs::path& store, const fs::path& other) {
  const fs::path from = other.string() + kFolder;
  std::vector<fs::path> copies;
  if (!fs::is_directory(from)) return copies;
  for (const auto& entry : fs::recursive_directory_iterator(from)) {
    if (!entry.is_regular_file()) continue;
    const std::string name = entry.path().lexically_relative(from).string();
    const std::vector<unsigned char> bytes = read_inside(from, name, {.file = from.string()});
    const fs::path folder = store.string() + kFolder;
    copies.push_back(folder / name);
    if (!fs::is_regular_file(copies.back()))
      write_inside(folder, name, {reinterpret_cast<const char*>(bytes.data()), bytes.size()},
                   {.file = folder.string()});
  }
  return copies;
}

bool is_copy(const std::string& path) {
  return path.find(kFolder) != std::string::npos;
}

}  // namespace drape::compare
