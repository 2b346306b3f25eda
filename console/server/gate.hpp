// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace drape::console {

/// Parts of a request that decide whether it is accepted.
struct Knock {
  std::string method;
  std::string path;  ///< as sent, still percent-encoded
  std::string host;
  std::string reached = {};  ///< address and port at which the client reached this machine
  std::optional<std::string> origin, fetch_site, fetch_mode, content_type;
};

/// Access control. The token is the first part of every path: unlike a cookie it is not sent to
/// other ports of the same machine, and a page from elsewhere cannot know it.
class Gate {
 public:
  /// `hosts`: names with port under which this server can be addressed, besides that at which it
  /// was reached; others (DNS rebinding) are refused. `report_token` opens only the report.
  Gate(std::string token, std::vector<std::string> hosts, std::string report_token = {});

  struct Answer {
    int status = 0;  ///< 0 if accepted
    std::string why = {};
    std::string route = {};  ///< the path without the token, from its `/` on
  };
  [[nodiscard]] Answer ask(const Knock& knock) const;
  /// True if a path begins with a token.
  [[nodiscard]] bool knows(const std::string& path) const;

 private:
  std::string token_, report_token_;
  std::vector<std::string> hosts_;
};

inline constexpr std::size_t kTokenLength = 32;

/// 128 random bits from the system as 32 hexadecimal digits. Throws Error(internal).
[[nodiscard]] std::string make_token();

}  // namespace drape::console
