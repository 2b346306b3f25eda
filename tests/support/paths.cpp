// SPDX-License-Identifier: Apache-2.0
#include "tests/support/paths.hpp"

#include <stdlib.h>  // mkdtemp

#include <cstdlib>
#include <stdexcept>

namespace drape::test {

namespace fs = std::filesystem;

fs::path source_root() {
  return DRAPE_SOURCE_ROOT;
}

fs::path program(const std::string& name) {
  const char* folder = name.ends_with("-host") ? "libexec/drapebench" : "bin";
  return fs::path(DRAPE_BINARY_ROOT) / folder / name;
}

fs::path test_data(const std::string& folder) {
  return source_root() / "tests" / "data" / folder;
}

std::optional<fs::path> reference_data(const std::string& folder) {
  const char* from_environment = std::getenv("DRAPE_REFERENCE_DATA");
  const fs::path root = from_environment != nullptr
                            ? fs::path(from_environment)
                            : source_root().parent_path() / "shared" / "data";
  if (!fs::is_directory(root / folder)) return std::nullopt;
  return root / folder;
}

TemporaryFolder::TemporaryFolder() {
  std::string name = (fs::temp_directory_path() / "drapebench-test-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("mkdtemp failed");
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

}  // namespace drape::test
