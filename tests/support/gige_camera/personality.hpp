// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

namespace drape::test {

/// Names of the clock's latch: GigE Vision 1, SFNC 2, or none.
enum class Latch { gev, sfnc, none };

/// Differences between cameras: names of their features and behaviour of their registers.
struct Personality {
  std::string name = "plain";
  std::string vendor = "Drapebench", model = "TestCamera";
  std::uint64_t tick_hz = 1'000'000'000;
  Latch latch = Latch::gev;
  bool source_port = true;  ///< has the register for the stream's source port
  bool resend = true;
  bool extended_ids = false;
  bool trigger_selector = true;
  bool locked_while_streaming = false;  ///< and it streams when it is switched on
  bool chunks_on = false;
  bool gamma_on = false;
  bool ieee1588_names = false;
  std::string exposure = "ExposureTime", gain = "Gain", rate = "AcquisitionFrameRate";
  std::string rate_switch;  ///< must be on for the rate to be accepted; or empty
  std::vector<std::string> trigger_sources = {"Software", "Line1", "Action1"};
  std::vector<std::pair<std::string, std::uint32_t>> pixel_formats = {{"Mono8", 0x01080001},
                                                                      {"Mono16", 0x01100007}};
  std::uint32_t packet_size = 1400;

  [[nodiscard]] bool has_trigger(const std::string& source) const;
};

inline void PrintTo(const Personality& personality, std::ostream* out) {
  *out << personality.name;
}

/// Names and behaviour of vendors' cameras, cameras with unusual behaviour, and cameras with one
/// pixel format each.
[[nodiscard]] const std::vector<Personality>& personalities();

}  // namespace drape::test
