// SPDX-License-Identifier: Apache-2.0
// What stands beside a simulated sheet: certificate.json and history.csv.
#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "compare/store/inputs.hpp"
#include "core/error.hpp"
#include "core/files/csv.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

constexpr int kCertificateVersion = 1;

std::string scalar_text(const Json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_null()) return "not stated";
  if (value.is_number_float()) return fmt::format("{:.6g}", value.get<double>());
  return value.dump();
}

/// Numbers and words of an array in one line.
std::string list_text(const Json& array) {
  std::string text;
  for (const Json& item : array) {
    if (!text.empty()) text += "; ";
    text += scalar_text(item);
  }
  return text.empty() ? "none" : text;
}

/// Every scalar under its path. Objects in an array are called by their first text.
void flatten(const Json& value, const std::string& path, Certificate& certificate) {
  if (value.is_object()) {
    for (const auto& [key, member] : value.items()) {
      if (path.empty() && key == "schema") continue;
      flatten(member, path.empty() ? key : fmt::format("{}.{}", path, key), certificate);
    }
    return;
  }
  if (value.is_array() && !value.empty() && value.front().is_object()) {
    for (std::size_t i = 0; i < value.size(); ++i) {
      Json item = value[i];
      std::string name = std::to_string(i);
      for (auto member = item.begin(); member != item.end(); ++member) {
        if (!member->is_string()) continue;
        name = member->get<std::string>();
        item.erase(member);
        break;
      }
      flatten(item, fmt::format("{}.{}", path, name), certificate);
    }
    return;
  }
  if (value.is_array()) {
    certificate.entries.emplace_back(path, list_text(value));
    return;
  }
  certificate.entries.emplace_back(path, scalar_text(value));
  const std::string_view name = path;
  if (value.is_boolean() &&
      (name.ends_with("penetration_accepted") || name.ends_with("penetration.accepted")))
    certificate.penetration_accepted = value.get<bool>();
}

}  // namespace

Certificate read_certificate(const fs::path& file) {
  const JsonNode root = JsonNode::open(file, "certificate", kCertificateVersion);
  Certificate certificate;
  certificate.sha256 = sha256_of_file(file);
  flatten(root.raw(), "", certificate);
  return certificate;
}

History read_history(const fs::path& file) {
  const std::string text = read_text(file);
  std::size_t begin = 0;
  while (begin < text.size() && text[begin] == '#') {
    const std::size_t end = text.find('\n', begin);
    begin = end == std::string::npos ? text.size() : end + 1;
  }
  const std::string head = text.substr(begin, text.find_first_of("\r\n", begin) - begin);
  std::vector<std::string> names;
  for (std::size_t at = 0; at <= head.size();) {
    const std::size_t comma = std::min(head.find(',', at), head.size());
    names.push_back(head.substr(at, comma - at));
    at = comma + 1;
  }
  return {names, read_csv(file, names).columns};
}

void require_of_sheet(const Certificate& certificate, const Sheet& sheet, const fs::path& file) {
  const auto& source = std::get<SimulatedSource>(sheet.source);
  const std::pair<const char*, std::string> of_sheet[] = {
      {"options.rows", std::to_string(sheet.rows)},
      {"options.cols", std::to_string(sheet.cols)},
      {"options.segments", std::to_string(source.segments)},
      {"at_rest", source.status == "at rest" ? "yes" : "no"}};
  for (const auto& [name, wanted] : of_sheet)
    for (const auto& [entry, value] : certificate.entries)
      if (entry == name && value != wanted)
        throw bad_input(fmt::format("the certificate says `{}`, the sheet beside it `{}`: one of "
                                    "them is of another run",
                                    value, wanted),
                        {.file = file.string(), .field = name}, "simulate the drape again");
}

}  // namespace drape::compare
