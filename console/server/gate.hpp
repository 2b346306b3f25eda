// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace drape::console {

/// Parts of a request that decide whether it is answered.
struct Knock {
  std::string method;
  std::string path;  ///< as sent, still escaped
  std::string host;
  std::string reached = {};  ///< address and port at which the client reached this machine
  std::optional<std::string> origin, fetch_site, fetch_mode, content_type;
};

/// Who may ask. The token is the first part of every path: it needs no cookie, which other ports of
/// the same machine would get too, and a page from elsewhere cannot know it.
class Gate {
 public:
  /// `hosts`: names with port under which this server may be called, beside the address at which it
  /// was reached; any other (DNS rebinding) is refused. `report_token` opens the report alone.
  Gate(std::string token, std::vector<std::string> hosts, std::string report_token = {});

  struct Answer {
    int status = 0;  ///< 0: let in
    std::string why = {};
    std::string route = {};  ///< the path without the token, from its `/`
  };
  [[nodiscard]] Answer ask(const Knock& knock) const;
  /// True where a path begins with a token.
  [[nodiscard]] bool knows(const std::string& path) const;

 private:
  std::string token_, report_token_;
  std::vector<std::string> hosts_;
};

inline constexpr std::size_t kTokenLength = 32;

/// 128 random bits as 32 hexadecimal digits, from the system. Throws Error(internal).
[[nodiscard]] std::string make_token();

}  // namespace drape::console
