// SPDX-License-Identifier: Apache-2.0
#include "compare/history/copies.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <map>

#include "core/files/files.hpp"

namespace drape::compare {

namespace fs = std::filesystem;

namespace {

constexpr const char* kFolder = ".files/";

fs::path folder_of_copies(const fs::path& store) {
  return real_store(store).string() + kFolder;
}

/// Copies that become durable together: written under temporary names, flushed, renamed, flushed
/// again. Two flushes of the whole file system in place of two for each of some thousand files.
class Copies {
 public:
  explicit Copies(fs::path folder) : folder_(std::move(folder)) {}

  /// `name` is a path of plain names inside the folder.
  void add(const std::string& name, const std::string& bytes) {
    const fs::path to = name_inside(folder_, name, {.file = folder_.string()});
    all_.push_back(to);
    // What another lab's store brought under this name is not believed to be this sheet.
    if (fs::is_regular_file(to) && read_text(to) == bytes) return;
    const fs::path place = to.parent_path(),
                   partial = place / ("." + to.filename().string() + ".partial");
    std::error_code error;
    fs::create_directories(place, error);
    if (error) fail(to, error.message());
    if (fs::weakly_canonical(place) !=
        fs::weakly_canonical(folder_ / ".") / fs::path(name).parent_path())
      throw bad_input("a link leads out of the folder of copies", {.file = place.string()},
                      "remove the link");
    require_replaceable(to);
    require_replaceable(partial);
    partial_[to] = partial;
    std::ofstream file(partial, std::ios::binary | std::ios::trunc);
    file << bytes << std::flush;
    if (!file) fail(to, std::strerror(errno));
  }

  std::vector<fs::path> finish() {
    if (partial_.empty()) return std::move(all_);
    flush();
    std::error_code error;
    for (const auto& [to, partial] : partial_) {
      fs::rename(partial, to, error);
      if (error) fail(to, error.message());
    }
    flush();
    return std::move(all_);
  }

 private:
  void flush() const {
    const int fd = ::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    const int reason = fd >= 0 && ::syncfs(fd) == 0 ? 0 : errno;
    if (fd >= 0) ::close(fd);
    if (reason != 0) fail(folder_, std::strerror(reason));
  }

  [[noreturn]] void fail(const fs::path& file, const std::string& reason) const {
    std::error_code ignored;
    for (const auto& [to, partial] : partial_) fs::remove(partial, ignored);  // frees a full disk
    throw bad_input("cannot write: " + reason, {.file = file.string()},
                    "check the path, its permissions and the free space, then run again");
  }

  fs::path folder_;
  std::vector<fs::path> all_;
  std::map<fs::path, fs::path> partial_;  ///< of each copy that is not there yet
};

/// Both files of a sheet under the hash of its .json, which says which sheet it is.
void copy_sheet(const SheetFile& sheet, Copies& copies) {
  for (const char* extension : {".ply", ".json"})
    copies.add(sheet.sha256.substr(0, 2) + '/' + sheet.sha256 + extension,
               read_text(fs::path(sheet.file).replace_extension(extension)));
}

/// The list that says which equilibrium a sheet is, under its own hash.
void copy_list(const Simulation& simulation, Copies& copies) {
  const std::string& sha256 = simulation.branch->set_sha256;
  copies.add(sha256.substr(0, 2) + '/' + sha256 + ".json",
             read_text(simulation.sheet.file.parent_path() / ".." / "branches.json"));
}

}  // namespace

std::vector<fs::path> keep_copies(const fs::path& store, const Session& session) {
  Copies copies(folder_of_copies(store));
  const auto add = [&](const Simulation& simulation) {
    if (!simulation.other_simulator) copy_sheet(simulation.sheet, copies);
    if (simulation.branch) copy_list(simulation, copies);
  };
  for (const DrapeFiles& drape : session.drapes) {
    copy_sheet(drape.input.measured, copies);
    for (const SheetFile& repeat : drape.input.repeats) copy_sheet(repeat, copies);
    for (const Simulation& simulation : drape.input.simulations) add(simulation);
  }
  for (const auto& group : session.virtual_only)
    for (const Simulation& simulation : group) add(simulation);
  return copies.finish();
}

std::vector<fs::path> take_copies(const fs::path& store, const fs::path& other) {
  const fs::path from = folder_of_copies(other);
  Copies copies(folder_of_copies(store));
  std::vector<fs::path> present;
  if (!fs::is_directory(from)) return present;
  for (const auto& entry : fs::recursive_directory_iterator(from)) {
    const std::string name = entry.path().lexically_relative(from).string();
    // What a killed program left begins with a dot.
    if (!entry.is_regular_file() || entry.path().filename().string().starts_with('.')) continue;
    // Nothing from elsewhere replaces a copy that is there.
    if (const fs::path there = folder_of_copies(store) / name; fs::is_regular_file(there)) {
      present.push_back(there);
      continue;
    }
    const std::vector<unsigned char> bytes = read_inside(from, name, {.file = from.string()});
    copies.add(name, {bytes.begin(), bytes.end()});
  }
  std::vector<fs::path> all = copies.finish();
  all.insert(all.end(), present.begin(), present.end());
  return all;
}

fs::path copy_of_same_name(const fs::path& store, const fs::path& other, const std::string& path) {
  const std::string beside = real_store(other).filename().string() + kFolder;
  return path.starts_with(beside) ? folder_of_copies(store) / path.substr(beside.size())
                                  : fs::path();
}

bool is_copy(const std::string& path) {
  return path.find(kFolder) != std::string::npos;
}

}  // namespace drape::compare
