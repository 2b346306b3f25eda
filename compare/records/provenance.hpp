// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace drape::compare {

using HashedFiles = std::vector<std::pair<std::filesystem::path, std::string>>;  ///< SHA-256

/// One run record (*.run.json): how outputs were made, with paths absolute or relative to where we
/// are. Clock times are left behind.
struct StepRecord {
  std::string program, version;
  std::vector<std::string> arguments;
  HashedFiles inputs = {}, outputs = {};
  std::filesystem::path file = {};
  /// Inputs that people write and that hold the values that were read, whatever their bytes.
  std::set<std::filesystem::path> as_read = {};
};

/// Reads run records as they are asked for, and remembers them and the hashes of files.
class RecordBook {
 public:
  /// The record in the file's folder, or in the one above it, that lists it as an output. Damaged
  /// records count as absent.
  [[nodiscard]] const StepRecord* maker_of(const std::filesystem::path& file);
  /// Returns whether a record lists this content, or the file is one that people may write.
  [[nodiscard]] bool is_traced(const std::filesystem::path& file);
  /// SHA-256 of the file as it is now; nothing when it is not there.
  [[nodiscard]] std::optional<std::string> sha256(const std::filesystem::path& file);

 private:
  struct Folder {
    std::vector<StepRecord> records;
    std::map<std::filesystem::path, std::size_t> makers;  ///< index of the maker of each output
  };
  std::map<std::filesystem::path, Folder> folders_;
  std::map<std::filesystem::path, std::optional<std::string>> hashes_;
};

/// The record beside the output; of a branch, whose run made several sheets, the one above it that
/// lists the sheet. Throws Error(bad_input) for a record that cannot be read.
[[nodiscard]] std::optional<StepRecord> read_made_by(const std::filesystem::path& output);

/// Throws Error(bad_input) where a file beside `output`, or beside the record of its run (in its
/// folder, or in the one above that lists it), has another content than the record says.
void require_as_recorded(const std::filesystem::path& output);

/// Both files of each sheet, whichever of them is named.
[[nodiscard]] std::vector<std::filesystem::path> files_of_sheets(
    const std::vector<std::filesystem::path>& sheets);

/// A step of the chain from a number back to what was photographed and measured.
struct ChainLink {
  int depth = 0;
  std::filesystem::path file;
  std::string sha256;   ///< hash recorded by the step that used it
  std::string state;    ///< "unchanged", "altered", "not there" or "not traced"
  std::string made_by;  ///< command, or what an original file is
};

/// Everything that `file` was made from, depth first, down to files that no program made. Each file
/// is followed once; `followed` are those of chains before this one, and grows.
[[nodiscard]] std::vector<ChainLink> chain_of(RecordBook& book, const std::filesystem::path& file,
                                              const std::string& sha256,
                                              std::set<std::filesystem::path>& followed);

/// The files themselves, everything the records name and the records: each with the hashes that
/// records state of it. What a file was made from counts only while the file has such a hash: a
/// record from elsewhere can name any file of this machine, but not say what it holds.
[[nodiscard]] std::map<std::filesystem::path, std::set<std::string>> files_behind(
    RecordBook& book, const std::vector<std::filesystem::path>& files);

}  // namespace drape::compare
