// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/store/store.hpp"

namespace drape::compare {

/// Authors and licence of published results (lab.toml, schema drapebench/lab/1).
struct Lab {
  struct Author {
    std::string name;
    std::string orcid;        ///< https://orcid.org/...; empty if not given
    std::string affiliation;  ///< empty if not given
  };
  std::string title, description;
  std::string license, license_name;  ///< URL and name
  std::string program_url;  ///< URL of the programs; if empty they are named by their hash
  std::vector<Author> authors;
};
void fields(Fields& f, Lab& lab);

}  // namespace drape::compare

template <>
inline constexpr drape::Format drape::format_of<drape::compare::Lab>{
    "lab", Syntax::toml, 1, "authors and licence of published results"};

namespace drape::compare {

/// Counts returned by write_crate().
struct Crate {
  int files = 0;
  int actions = 0;                    ///< number of program runs
  std::vector<std::string> findings;  ///< files behind the numbers that are missing; empty if none
};

/// Writes the results of one run, or of the whole store, into the new folder `out`: tables as CSV,
/// copies of every file behind them down to photographs and curves, and ro-crate-metadata.json, a
/// Process Run Crate 0.6 on RO-Crate 1.3, in which each run record is a CreateAction with its
/// program, inputs and outputs. A crate that cannot be finished leaves no
/// folder. Throws Error(usage) for a run that is not in the store, Error(bad_input) for a folder
/// that exists.
[[nodiscard]] Crate write_crate(const StoreReader& store, std::optional<int> run, const Lab& lab,
                                const std::filesystem::path& out);

}  // namespace drape::compare
