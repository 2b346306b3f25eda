// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include "core/error.hpp"

namespace drape::test {

/// Returns the error thrown by a call; the test fails if nothing is thrown.
template <class Call>
[[nodiscard]] Error error_of(Call call) {
  try {
    static_cast<void>(call());
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "the call is not refused";
  return internal_error("none");
}

}  // namespace drape::test
