// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/kinds.hpp"

#include <algorithm>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "tests/formats/formats.hpp"

namespace drape::test {
namespace {

/// A described format, read only by its description.
Kind kind_of(const DescribedFormat& format) {
  std::string name(format.format.name);
  std::replace(name.begin(), name.end(), '-', '_');
  const std::string file = name + (format.format.syntax == Syntax::toml ? ".toml" : ".json");
  return {name,
          [=](const std::filesystem::path& folder) {
            write_durable(folder / file, format.example);
            return folder / file;
          },
          [=](const std::filesystem::path& path) {
            const Document document = Document::read(path);
            require_format(document, format.format);
            throw_if_any(format.faults(document));
          },
          true, R"(out of range: +"\w+": \d+,?\s)"};  // counts have no limit
}

}  // namespace

std::vector<Kind> all_kinds() {
  std::vector<Kind> all = core_kinds();
  for (const auto& more : {stage_kinds(), image_kinds(), result_kinds(), foreign_kinds()})
    all.insert(all.end(), more.begin(), more.end());
  for (const DescribedFormat& format : all_formats()) {
    const Kind kind = kind_of(format);
    if (std::none_of(all.begin(), all.end(),
                     [&](const Kind& one) { return one.name == kind.name; }))
      all.push_back(kind);
  }
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
