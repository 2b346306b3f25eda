// SPDX-License-Identifier: Apache-2.0
#include "compare/report/page.hpp"

#include <fmt/format.h>

#include <vector>

#include "core/drawing/svg.hpp"
#include "core/files/files.hpp"

namespace drape::compare {
namespace {

/// A block of JSON that no text in it can end: `<` is escaped.
std::string data_block(const std::string& id, const Value& data) {
  std::string json;
  for (const char c : one_line(data)) json += c == '<' ? std::string("\\u003c") : std::string(1, c);
  return "<script type=\"application/json\" id=\"" + id + "\">" + json + "</script>\n";
}

}  // namespace

std::string script_hash(const std::string& script) {
  const std::string hex = sha256_of(std::string_view(script));
  std::vector<unsigned char> bytes;
  for (std::size_t i = 0; i < hex.size(); i += 2)
    bytes.push_back(static_cast<unsigned char>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  return "sha256-" + base64(bytes);
}

std::string page_of(const std::string& title, const std::string& kind, const Value& data,
                    const std::map<std::string, std::string>& jpegs) {
  Value pictures = Value::Table{};
  for (const auto& [name, bytes] : jpegs)
    pictures[name] =
        "data:image/jpeg;base64," + base64(std::vector<unsigned char>(bytes.begin(), bytes.end()));
  const std::string script = page_script();
  return fmt::format(
             "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
             "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
             "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
             "'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'; script-src "
             "'{}'\">\n<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n<div id=\"page\">"
             "<p>This page draws its numbers by a script of its own, which is off. The same "
             "numbers are in report.json and in the .csv files beside it.</p></div>\n",
             script_hash(script), xml(title), page_style()) +
         data_block(kind, data) + data_block("pictures", pictures) + "<script>" + script +
         "</script>\n</body>\n</html>\n";
}

}  // namespace drape::compare
