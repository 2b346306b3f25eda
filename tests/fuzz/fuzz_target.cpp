// SPDX-License-Identifier: Apache-2.0
// libFuzzer's entry: one program for all readers; $DRAPE_FUZZ_KIND selects one, and without it all
// are listed (preset `fuzz`).
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "core/files/files.hpp"
#include "tests/fuzz/kinds.hpp"
#include "tests/fuzz/mutations.hpp"
#include "tests/support/paths.hpp"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);

namespace drape::test {
namespace {

struct Target {
  TemporaryFolder folder;
  Kind kind;
  std::filesystem::path file;
  std::string good;

  Target() {
    const char* name = std::getenv("DRAPE_FUZZ_KIND");
    for (const Kind& one : all_kinds())
      if (name != nullptr && one.name == name) kind = one;
    if (kind.name.empty()) {
      for (const Kind& one : all_kinds()) std::puts(one.name.c_str());
      std::fflush(stdout);
      std::filesystem::remove_all(folder.path());
      std::_Exit(2);  // exit() would be a finding
    }
    file = kind.make(folder.path());
    good = read_text(file);
  }
};

Target& target() {
  static Target the_target;
  return the_target;
}

}  // namespace
}  // namespace drape::test

using drape::test::target;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // Not durably, since a crash of the machine here would lose nothing of value.
  std::ofstream(target().file, std::ios::binary)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  bool refused = false;
  const std::string broken = drape::test::broken_promise(target().kind, target().file, refused);
  if (broken.empty()) return 0;
  std::fprintf(stderr, "%s\n", broken.c_str());
  std::abort();
}

/// Half of the inputs have changed types, lines and numbers, the others bytes chosen by coverage.
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t most, unsigned seed) {
  if (seed % 2 == 0 && size > 3) return LLVMFuzzerMutate(data, size, most);
  const std::string from =
      size > 3 ? std::string(reinterpret_cast<const char*>(data), size) : target().good;
  const std::string text = drape::test::spoiled(from, seed);
  std::copy_n(text.begin(), std::min(most, text.size()), data);
  return std::min(most, text.size());
}
