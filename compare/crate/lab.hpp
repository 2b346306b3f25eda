// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace drape::compare {

/// Who answers for published results, and how they may be used (lab.toml, schema drapebench/lab/1).
struct Lab {
  struct Author {
    std::string name;
    std::string orcid;        ///< https://orcid.org/...; empty: not given
    std::string affiliation;  ///< empty: not given
  };
  std::string title, description;
  std::string license, license_name;  ///< URL and name
  std::string program_url;  ///< where others find the programs; empty: named by their hash
  std::vector<Author> authors;
};
/// Throws Error(bad_input) where a key is missing, wrong or unknown.
[[nodiscard]] Lab read_lab(const std::filesystem::path& file);

}  // namespace drape::compare
