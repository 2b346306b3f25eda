// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/kinds.hpp"

#include "core/error.hpp"

namespace drape::test {

std::vector<Kind> all_kinds() {
  std::vector<Kind> all = core_kinds();
  for (const auto& more : {stage_kinds(), image_kinds(), result_kinds()})
    all.insert(all.end(), more.begin(), more.end());
  return all;
}

std::string broken_promise(const Kind& kind, const std::filesystem::path& file, bool& refused) {
  try {
    kind.read(file);
  } catch (const Error& error) {
    refused = true;
    if (error.kind() != ErrorKind::bad_input) return std::string("not bad input: ") + error.what();
    if (error.where().file.empty()) return std::string("no file is named: ") + error.what();
  } catch (const std::exception& other) {
    return std::string("no drape::Error: ") + other.what();
  }
  return {};
}

}  // namespace drape::test
