// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>

namespace drape::test {

/// Moves this process into a network of its own that holds only loopback, so that emulated cameras
/// neither meet each other nor anything outside. Call before any thread starts. Returns the reason
/// when the host forbids it. Calling again in the same process changes nothing.
[[nodiscard]] std::optional<std::string> enter_private_network();

}  // namespace drape::test

/// Enters the private network or skips the test and says why.
#define DRAPE_REQUIRE_PRIVATE_NETWORK()                          \
  if (const auto refused = drape::test::enter_private_network()) \
  GTEST_SKIP() << "emulated GigE cameras need a network of their own: " << *refused

namespace drape::test {

/// Tests with emulated cameras; skipped where there can be no network of their own for them.
class CameraTest : public testing::Test {
 protected:
  void SetUp() override { DRAPE_REQUIRE_PRIVATE_NETWORK(); }
};

}  // namespace drape::test
