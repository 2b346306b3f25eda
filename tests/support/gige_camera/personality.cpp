// SPDX-License-Identifier: Apache-2.0
// Vendors' feature names are from their public feature lists and from Aravis' own vendor table.
#include "tests/support/gige_camera/personality.hpp"

#include <algorithm>

namespace drape::test {
namespace {

using Formats = std::vector<std::pair<std::string, std::uint32_t>>;

constexpr std::uint64_t kMega = 1'000'000;

const Formats kUsual = {{"Mono8", 0x01080001},
                        {"Mono10", 0x01100003},
                        {"Mono12", 0x01100005},
                        {"Mono12Packed", 0x010C0006}};

Personality named(const std::string& name) {
  Personality p;
  p.name = name;
  return p;
}

Personality only(const std::string& format, std::uint32_t code) {
  Personality p = named("only_" + format);
  p.pixel_formats = {{format, code}};
  return p;
}

std::vector<Personality> vendors() {
  std::vector<Personality> list;
  Personality p = named("basler_ace");
  p.vendor = "Basler";
  p.model = "acA1300-60gm";
  p.tick_hz = 125 * kMega;
  p.exposure = "ExposureTimeAbs";
  p.gain = "GainRaw";
  p.rate = "AcquisitionFrameRateAbs";
  p.rate_switch = "AcquisitionFrameRateEnable";
  p.ieee1588_names = true;
  p.pixel_formats = kUsual;
  list.push_back(p);

  p = named("basler_ace_2");
  p.vendor = "Basler";
  p.model = "a2A1920-51gmBAS";
  p.latch = Latch::sfnc;
  p.rate_switch = "AcquisitionFrameRateEnable";
  p.pixel_formats = {{"Mono8", 0x01080001}, {"Mono12", 0x01100005}, {"Mono12p", 0x010C0047}};
  list.push_back(p);

  p = named("flir_blackfly");
  p.vendor = "FLIR";
  p.model = "Blackfly BFLY-PGE-13E4M";
  p.tick_hz = 125 * kMega;
  p.rate_switch = "AcquisitionFrameRateEnabled";
  p.trigger_sources = {"Software", "Line0", "Line1"};
  p.pixel_formats = kUsual;
  list.push_back(p);

  p = named("ids_ueye");
  p.vendor = "IDS Imaging Development Systems GmbH";
  p.model = "GV-5240CP-M";
  p.latch = Latch::sfnc;
  p.trigger_sources = {"Software", "Line0"};
  list.push_back(p);

  p = named("hikrobot");
  p.vendor = "Hikrobot";
  p.model = "MV-CA013-20GM";
  p.tick_hz = 100 * kMega;
  p.rate_switch = "AcquisitionFrameRateEnable";
  p.trigger_sources = {"Line0", "Software", "Action1"};
  p.pixel_formats = kUsual;
  p.gamma_on = true;
  list.push_back(p);

  p = named("allied_vision");
  p.vendor = "Allied Vision Technologies";
  p.model = "Mako G-131B";
  p.tick_hz = 36'858'974;
  p.exposure = "ExposureTimeAbs";
  p.rate = "AcquisitionFrameRateAbs";
  p.trigger_sources = {"Software", "Line1"};
  p.pixel_formats = kUsual;
  list.push_back(p);

  p = named("the_imaging_source");
  p.vendor = "The Imaging Source Europe GmbH";
  p.model = "DMK 33GX273";
  p.latch = Latch::none;
  p.trigger_sources = {"Software", "Line1"};
  list.push_back(p);

  p = named("dalsa_genie_nano");
  p.vendor = "Teledyne DALSA";
  p.model = "Nano-M1280";
  p.tick_hz = kMega;
  p.trigger_sources = {"Software", "Line1", "Action1"};
  list.push_back(p);

  p = named("lucid_triton");
  p.vendor = "Lucid Vision Labs";
  p.model = "TRI013S-M";
  p.latch = Latch::sfnc;
  p.extended_ids = true;
  p.resend = false;  // the emulator supports resends for 16-bit ids only
  p.rate_switch = "AcquisitionFrameRateEnable";
  p.trigger_sources = {"Software", "Line0", "Action1"};
  list.push_back(p);
  return list;
}

std::vector<Personality> adversaries() {
  std::vector<Personality> list;
  const auto add = [&](const std::string& name, const auto& change) {
    list.push_back(named(name));
    change(list.back());
  };
  add("tick_1_mhz", [](Personality& p) { p.tick_hz = kMega; });
  add("tick_125_mhz", [](Personality& p) { p.tick_hz = 125 * kMega; });
  add("no_latch", [](Personality& p) { p.latch = Latch::none; });
  add("no_tick_rate", [](Personality& p) {
    p.tick_hz = 0;
    p.latch = Latch::none;
  });
  add("no_source_port", [](Personality& p) { p.source_port = false; });
  add("no_resend", [](Personality& p) { p.resend = false; });
  add("extended_ids", [](Personality& p) {
    p.extended_ids = true;
    p.resend = false;
  });
  add("exposure_raw", [](Personality& p) { p.exposure = "ExposureTimeRaw"; });
  add("locked_while_streaming", [](Personality& p) { p.locked_while_streaming = true; });
  add("no_trigger_selector", [](Personality& p) { p.trigger_selector = false; });
  add("latin_1_vendor", [](Personality& p) { p.vendor = "Cam\xE9ra \x1B[31mM\xFCnchen"; });
  add("packets_of_576", [](Personality& p) { p.packet_size = 576; });
  add("chunks_on", [](Personality& p) { p.chunks_on = true; });
  add("gamma_on", [](Personality& p) { p.gamma_on = true; });
  return list;
}

}  // namespace

bool Personality::has_trigger(const std::string& source) const {
  return std::find(trigger_sources.begin(), trigger_sources.end(), source) != trigger_sources.end();
}

const std::vector<Personality>& personalities() {
  static const std::vector<Personality> all = [] {
    std::vector<Personality> list = vendors();
    for (const Personality& p : adversaries()) list.push_back(p);
    for (const auto& [name, code] : Formats{{"Mono10Packed", 0x010C0004},
                                            {"Mono10p", 0x010A0046},
                                            {"Mono12p", 0x010C0047},
                                            {"Mono14", 0x01100025},
                                            {"BayerRG8", 0x01080009},
                                            {"BayerGB12p", 0x010C0055},
                                            {"RGB8", 0x02180014},
                                            {"YUV422_8_UYVY", 0x0210001F}})
      list.push_back(only(name, code));
    return list;
  }();
  return all;
}

}  // namespace drape::test
