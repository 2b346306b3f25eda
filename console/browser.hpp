// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

#include "core/files/json_file.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {

/// One page in headless Chromium, driven over the DevTools protocol's pipe: keys only, no mouse.
class Browser {
 public:
  [[nodiscard]] static bool installed();

  Browser();
  ~Browser();
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;

  void open(const std::string& address);
  void size(int width_px, int height_px);
  /// A key by its name: "Tab", "Enter", "ArrowLeft", or one character.
  void press(const std::string& key);
  void type(const std::string& text);
  /// Tab until the element of this id has the focus. Throws when it is not reached.
  void tab_to(const std::string& id);
  [[nodiscard]] Json value_of(const std::string& expression);
  /// Until the expression is true. Throws with the page's text when that does not come.
  void wait_for(const std::string& expression);
  void screenshot(const std::filesystem::path& file);
  /// Errors of scripts, of the console and of loading, in order.
  [[nodiscard]] const std::vector<std::string>& errors() const { return errors_; }

 private:
  Json call(const std::string& method, Json parameters = Json::object());
  Json next_message();
  void take_event(const Json& message);

  TemporaryFolder profile_;
  pid_t pid_ = -1;
  int to_ = -1, from_ = -1;
  int id_ = 0;
  std::string session_, text_;
  std::vector<std::string> errors_;
};

}  // namespace drape::test
