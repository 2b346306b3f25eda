// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/files/json_file.hpp"

namespace drape::test {

/// One page in a headless browser, driven by keys only, no mouse.
class Browser {
 public:
  Browser() = default;
  virtual ~Browser() = default;
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;

  virtual void open(const std::string& address) = 0;
  virtual void size(int width_px, int height_px) = 0;  ///< the page's size
  /// A key by its name: "Tab", "Enter", "ArrowLeft", or one character.
  virtual void press(const std::string& key) = 0;
  virtual void type(const std::string& text) = 0;
  [[nodiscard]] virtual Json value_of(const std::string& expression) = 0;
  /// Statements of a script that the page does not have.
  virtual void run(const std::string& script) = 0;
  virtual void screenshot(const std::filesystem::path& file) = 0;
  /// Errors of scripts, of the console and of loading, in order.
  [[nodiscard]] virtual std::vector<std::string> errors() = 0;

  /// Tab until the element of this id has the focus. Throws when it is not reached.
  void tab_to(const std::string& id);
  /// Waits for the button, goes to it by Tab and presses Enter.
  void press_button(const std::string& id);
  /// Until the expression is true. Throws with the page's text when that does not come.
  void wait_for(const std::string& expression);
};

/// "Chromium" or "Firefox"; null where it is not installed.
[[nodiscard]] std::unique_ptr<Browser> open_browser(const std::string& name);

/// Findings that axe-core calls serious or critical, and a page wider than a phone: words, none
/// when good. Without axe-core (npm) the width alone, and says so.
[[nodiscard]] Json serious_findings(Browser& browser);

/// A screenshot of this name in the folder DRAPE_SCREENSHOTS, where that is set.
void shoot(Browser& browser, const std::string& name);

}  // namespace drape::test
