// SPDX-License-Identifier: Apache-2.0
#include "console/server/gate.hpp"

#include <sys/random.h>

#include <algorithm>
#include <array>

#include "core/error.hpp"

namespace drape::console {
namespace {

/// Takes the same time wherever the texts differ.
bool equal(const std::string& a, const std::string& b) {
  unsigned char differ = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < a.size(); ++i)
    differ |= static_cast<unsigned char>(a[i] ^ (b.empty() ? 0 : b[i % b.size()]));
  return differ == 0;
}

}  // namespace

Gate::Gate(std::string token, std::vector<std::string> hosts)
    : token_(std::move(token)), hosts_(std::move(hosts)) {}

Gate::Answer Gate::ask(const Knock& knock) const {
  const std::size_t end = knock.path.find('/', 1);
  const std::string given = knock.path.empty() ? "" : knock.path.substr(1, end - 1);
  if (knock.path.empty() || knock.path[0] != '/' || !equal(given, token_))
    return {401, "open the address that `drape bench` printed: it holds the token"};
  if ((knock.reached.empty() || knock.host != knock.reached) &&
      std::find(hosts_.begin(), hosts_.end(), knock.host) == hosts_.end())
    return {403, "this server is not called by that name"};
  if (knock.origin && *knock.origin != "http://" + knock.host)
    return {403, "a page from elsewhere may not ask"};
  const bool navigation = knock.method == "GET" && knock.fetch_mode == "navigate";
  if (knock.fetch_site && *knock.fetch_site != "same-origin" && *knock.fetch_site != "none" &&
      !navigation)
    return {403, "a page from elsewhere may not ask"};
  Answer answer;
  answer.route = end == std::string::npos ? "" : knock.path.substr(end);
  const bool act = answer.route == "/api/do";
  if (knock.method != (act ? "POST" : "GET") && (act || knock.method != "HEAD"))
    return {405, act ? "POST only" : "GET only"};
  // A form of another page cannot send this type without asking first.
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
