// SPDX-License-Identifier: Apache-2.0
#include "compare/crate/lab.hpp"

#include "core/files/toml_file.hpp"

namespace drape::compare {

Lab read_lab(const std::filesystem::path& file) {
  const TomlTable root = TomlTable::open(file, "lab");
  Lab lab{root.text("title"),        root.text("description"),        root.text("license"),
          root.text("license_name"), root.text_or("program_url", ""), {}};
  if (!lab.program_url.empty() && !lab.program_url.starts_with("https://") &&
      !lab.program_url.starts_with("http://"))
    root.reject("program_url", "this is not a URL", "write e.g. https://doi.org/...");
  if (!lab.license.starts_with("https://") && !lab.license.starts_with("http://"))
    root.reject("license", "the licence is not a URL",
                "write e.g. https://creativecommons.org/licenses/by/4.0/");
  for (const TomlTable& author : root.tables("author")) {
    lab.authors.push_back(
        {author.text("name"), author.text_or("orcid", ""), author.text_or("affiliation", "")});
    const std::string& orcid = lab.authors.back().orcid;
    if (!orcid.empty() && !orcid.starts_with("https://orcid.org/"))
      author.reject("orcid", "this is no ORCID", "write https://orcid.org/0000-...");
    author.finish();
  }
  if (lab.authors.empty()) root.reject("author", "there is no author", "add an [[author]]");
  root.finish();
  return lab;
}

}  // namespace drape::compare
