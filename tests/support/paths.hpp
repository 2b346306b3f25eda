// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>

namespace drape::test {

/// Root of the source tree (rigs/, tests/data/ below it).
[[nodiscard]] std::filesystem::path source_root();

/// Path of a program: <build>/bin, or <build>/libexec/drapebench for internal ones.
[[nodiscard]] std::filesystem::path program(const std::string& name);

/// A folder of tests/data: numbers with known answers, present in every clone (sources in README).
[[nodiscard]] std::filesystem::path test_data(const std::string& folder);

/// A folder of the reference data ($DRAPE_REFERENCE_DATA, else ../shared/data beside the source
/// tree), or nullopt if it is absent.
[[nodiscard]] std::optional<std::filesystem::path> reference_data(const std::string& folder);

/// A new empty folder, removed with the object.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace drape::test
