// SPDX-License-Identifier: Apache-2.0
#include "console/browser.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <thread>

#include "core/files/files.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;
constexpr int kMostTabs = 300;
constexpr int kMostLooks = 1500;  ///< of 200 ms

std::string from_base64(const std::string& text) {
  std::string bytes;
  unsigned value = 0;
  int bits = 0;
  for (const char c : text) {
    const std::string_view kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const auto digit = kDigits.find(c);
    if (digit == std::string_view::npos) break;
    value = (value << 6U) | static_cast<unsigned>(digit);
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes += static_cast<char>((value >> static_cast<unsigned>(bits)) & 255U);
  }
  return bytes;
}

}  // namespace

void Browser::tab_to(const std::string& id) {
  for (int k = 0; k < kMostTabs; ++k) {
    if (value_of("document.activeElement ? document.activeElement.id : ''") == id) return;
    press("Tab");
  }
  throw std::runtime_error(fmt::format("Tab does not lead to #{}; the page says: {}", id,
                                       value_of("document.body.innerText").dump()));
}

void Browser::press_button(const std::string& id) {
  wait_for(fmt::format("document.getElementById('{0}') && !document.getElementById('{0}').disabled",
                       id));
  tab_to(id);
  press("Enter");
}

void Browser::wait_for(const std::string& expression) {
  for (int k = 0; k < kMostLooks; ++k) {
    if (value_of("Boolean(" + expression + ")") == true) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  throw std::runtime_error(fmt::format("`{}` does not come true; the page says: {}", expression,
                                       value_of("document.body.innerText").dump()));
}

Json serious_findings(Browser& browser) {
  Json found = Json::array();
  browser.size(390, 800);
  if (browser.value_of("document.scrollingElement.scrollWidth <= window.innerWidth") != true)
    found.push_back("the page is wider than a phone");
  browser.size(1280, 1000);
  const fs::path axe = fs::path(program("drape")).parent_path().parent_path() /
                       "npm/node_modules/axe-core/axe.min.js";
  if (!fs::is_regular_file(axe)) {
    std::printf("axe-core is absent: npm install --prefix BUILD/npm axe-core\n");
    return found;
  }
  browser.run(read_text(axe));
  const Json said = browser.value_of(
      "axe.run(document, {rules: {}}).then(r => r.violations.filter(v => ['serious', "
      "'critical'].includes(v.impact)).map(v => v.id + ': ' + v.nodes.map(n => "
      "n.html).join(' ')))");
  if (!said.is_array()) return {"axe-core does not answer"};
  found.insert(found.end(), said.begin(), said.end());
  return found;
}

void shoot(Browser& browser, const std::string& name) {
  const char* shots = std::getenv("DRAPE_SCREENSHOTS");
  if (shots != nullptr) browser.screenshot(fs::path(shots) / name);
}

void write_picture(const std::filesystem::path& file, const std::string& base64) {
  write_durable(file, from_base64(base64));
}

}  // namespace drape::test
