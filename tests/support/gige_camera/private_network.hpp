// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>

namespace drape::test {

/// Moves this process into a separate network with only loopback, so that emulated cameras see
/// neither each other's nor outside traffic. Call before starting threads. Returns the reason if
/// the host forbids it. Calling it again in the same process has no effect.
[[nodiscard]] std::optional<std::string> enter_private_network();

}  // namespace drape::test

/// Enters the private network, or skips the test with the reason.
#define DRAPE_REQUIRE_PRIVATE_NETWORK()                          \
  if (const auto refused = drape::test::enter_private_network()) \
  GTEST_SKIP() << "emulated GigE cameras need a network of their own: " << *refused

namespace drape::test {

/// Tests with emulated cameras; skipped if a private network is not possible.
class CameraTest : public testing::Test {
 protected:
  void SetUp() override { DRAPE_REQUIRE_PRIVATE_NETWORK(); }
};

}  // namespace drape::test
