// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

/// Big-endian numbers, as in GigE Vision packets.
namespace drape::test::wire {

inline void put(std::vector<std::uint8_t>& to, std::uint64_t value, int bytes) {
  for (int i = bytes - 1; i >= 0; --i) to.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

inline void put16(std::vector<std::uint8_t>& to, std::uint64_t value) {
  put(to, value, 2);
}
inline void put32(std::vector<std::uint8_t>& to, std::uint64_t value) {
  put(to, value, 4);
}
inline void put64(std::vector<std::uint8_t>& to, std::uint64_t value) {
  put(to, value, 8);
}

[[nodiscard]] inline std::uint64_t get(const std::uint8_t* from, int bytes) {
  std::uint64_t value = 0;
  for (int i = 0; i < bytes; ++i) value = value << 8 | from[i];
  return value;
}

[[nodiscard]] inline std::uint32_t get16(const std::uint8_t* from) {
  return static_cast<std::uint32_t>(get(from, 2));
}
[[nodiscard]] inline std::uint32_t get32(const std::uint8_t* from) {
  return static_cast<std::uint32_t>(get(from, 4));
}

}  // namespace drape::test::wire
