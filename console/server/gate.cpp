// SPDX-License-Identifier: Apache-2.0
#include "console/server/gate.hpp"

#include <sys/random.h>

#include <algorithm>
#include <array>

#include "core/error.hpp"

namespace drape::console {
namespace {

/// Compares in constant time, wherever the texts differ.
bool equal(const std::string& a, const std::string& b) {
  unsigned char differ = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < a.size(); ++i)
    differ |= static_cast<unsigned char>(a[i] ^ (b.empty() ? 0 : b[i % b.size()]));
  return differ == 0;
}

/// True for a loopback name of this machine with any port, such as that of an `ssh -L` on the other
/// side. No page from elsewhere has it as its origin.
bool is_loopback(const std::string& host) {
  const std::string name = host.substr(0, host.rfind(':'));
  return name == "127.0.0.1" || name == "localhost" || name == "[::1]";
}

}  // namespace

Gate::Gate(std::string token, std::vector<std::string> hosts, std::string report_token)
    : token_(std::move(token)), report_token_(std::move(report_token)), hosts_(std::move(hosts)) {}

bool Gate::knows(const std::string& path) const {
  const std::string given = path.empty() ? "" : path.substr(1, path.find('/', 1) - 1);
  const bool of_report = !report_token_.empty() && equal(given, report_token_);
  return equal(given, token_) || of_report;
}

Gate::Answer Gate::ask(const Knock& knock) const {
  const std::size_t end = knock.path.find('/', 1);
  const std::string route = end == std::string::npos ? "" : knock.path.substr(end);
  const bool of_report = route == "/report.html";
  const std::string given = knock.path.empty() ? "" : knock.path.substr(1, end - 1);
  if (knock.path.empty() || knock.path[0] != '/' || !knows(knock.path) ||
      !equal(given, of_report && !report_token_.empty() ? report_token_ : token_))
    return {401, "open the address that `drape bench` printed: it holds the token"};
  if ((knock.reached.empty() || knock.host != knock.reached) &&
      !(is_loopback(knock.reached) && is_loopback(knock.host)) &&
      std::find(hosts_.begin(), hosts_.end(), knock.host) == hosts_.end())
    return {403, "this server is not called by that name"};
  if (knock.origin && *knock.origin != "http://" + knock.host)
    return {403, "a page from elsewhere may not ask"};
  const bool navigation = knock.method == "GET" && knock.fetch_mode == "navigate";
  if (knock.fetch_site && *knock.fetch_site != "same-origin" && *knock.fetch_site != "none" &&
      !navigation)
    return {403, "a page from elsewhere may not ask"};
  Answer answer;
  answer.route = route;
  const bool act = answer.route == "/api/do";
  if (knock.method != (act ? "POST" : "GET") && (act || knock.method != "HEAD"))
    return {405, act ? "POST only" : "GET only"};
  // A form of another page cannot send this type without a preflight request.
  if (act && !(knock.content_type && knock.content_type->starts_with("application/json")))
    return {415, "application/json only"};
  return answer;
}

std::string make_token() {
  std::array<unsigned char, 16> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw internal_error("the system gives no random numbers");
  std::string text;
  for (const unsigned char byte : bytes)
    for (const int digit : {byte >> 4, byte & 15}) text += "0123456789abcdef"[digit];
  return text;
}

}  // namespace drape::console
