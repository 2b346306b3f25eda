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

/// One run record (*.run.json): how outputs were made, with paths absolute or relative to the
/// current folder, without clock times.
struct StepRecord {
  std::string program, version;
  std::vector<std::string> arguments;
  HashedFiles inputs = {}, outputs = {};
  std::filesystem::path file = {};
  /// Inputs written by people whose values are those that were read, even if their bytes changed.
  std::set<std::filesystem::path> as_read = {};
};

/// Reads run records on demand, and caches them and the hashes of files.
class RecordBook {
 public:
  /// The record in the file's folder, or in the folder above it, that lists it as an output.
  /// Damaged records count as absent.
  [[nodiscard]] const StepRecord* maker_of(const std::filesystem::path& file);
  /// Returns whether a record lists this content, or the file is one that people may write.
  [[nodiscard]] bool is_traced(const std::filesystem::path& file);
  /// SHA-256 of the file as it is now; nullopt if it does not exist.
  [[nodiscard]] std::optional<std::string> sha256(const std::filesystem::path& file);

 private:
  struct Folder {
    std::vector<StepRecord> records;
    std::map<std::filesystem::path, std::size_t> makers;  ///< index of the record of each output
  };
  std::map<std::filesystem::path, Folder> folders_;
  std::map<std::filesystem::path, std::optional<std::string>> hashes_;
};

/// The record beside the output; for a branch, whose run made several sheets, the record above that
/// lists the sheet. Throws Error(bad_input) for a record that cannot be read.
[[nodiscard]] std::optional<StepRecord> read_made_by(const std::filesystem::path& output);

/// Throws Error(bad_input) if a file beside `output`, or beside the record of its run (in its
/// folder or the one above), differs from the record.
void require_as_recorded(const std::filesystem::path& output);

/// A step in the chain from a number back to photographs and measurements.
struct ChainLink {
  int depth = 0;
  std::filesystem::path file;
  std::string sha256;   ///< hash recorded by the step that used the file
  std::string state;    ///< "unchanged", "altered", "not there" or "not traced"
  std::string made_by;  ///< command, or kind of an original file
};

/// Everything from which `file` was made, depth first, down to files that no program made. Each
/// file is followed once; `followed` contains those of earlier chains and is extended.
[[nodiscard]] std::vector<ChainLink> chain_of(RecordBook& book, const std::filesystem::path& file,
                                              const std::string& sha256,
                                              std::set<std::filesystem::path>& followed);

/// The files themselves, all files named by their records, and the records, each with the hashes
/// stated for it. A source counts only if it has one of these hashes: a record from elsewhere can
/// name any file of this machine, but does not know its content.
[[nodiscard]] std::map<std::filesystem::path, std::set<std::string>> files_behind(
    RecordBook& book, const std::vector<std::filesystem::path>& files);

}  // namespace drape::compare
