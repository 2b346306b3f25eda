// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <utility>

#include "tests/support/gige_camera/registers.hpp"

namespace drape::test {
namespace {

using Entries = std::vector<std::pair<std::string, std::uint32_t>>;

std::string reg_node(const std::string& kind, const std::string& name, std::uint32_t address,
                     int bytes, const std::string& access, const std::string& more) {
  return fmt::format(
      "<{0} Name=\"{1}\"><Address>0x{2:x}</Address><Length>{3}</Length>"
      "<AccessMode>{4}</AccessMode><pPort>Device</pPort><Cachable>NoCache</Cachable>{5}</{0}>\n",
      kind, name, address, bytes, access, more);
}

std::string int_reg(const std::string& name, std::uint32_t address, const std::string& access,
                    int bytes = 4, const std::string& sign = "Unsigned") {
  return reg_node("IntReg", name, address, bytes, access,
                  "<Sign>" + sign + "</Sign><Endianess>BigEndian</Endianess>");
}

std::string text(const std::string& name, std::uint32_t address, int bytes) {
  return reg_node("StringReg", name, address, bytes, "RO", "");
}

std::string integer(const std::string& name, std::uint32_t address, std::uint32_t least,
                    const std::string& most, int step, const std::string& access = "RW") {
  return fmt::format(
             "<Integer "
             "Name=\"{0}\"><pValue>{0}Reg</pValue><Min>{1}</Min>{2}<Inc>{3}</Inc></Integer>\n",
             name, least, most, step) +
         int_reg(name + "Reg", address, access);
}

std::string real(const std::string& name, std::uint32_t address, double least, double most,
                 const std::string& unit) {
  return fmt::format(
             "<Float Name=\"{0}\"><pValue>{0}Reg</pValue><Min>{1}</Min><Max>{2}</Max>"
             "<Unit>{3}</Unit></Float>\n",
             name, least, most, unit) +
         reg_node("FloatReg", name + "Reg", address, 8, "RW", "<Endianess>BigEndian</Endianess>");
}

std::string choice(const std::string& name, std::uint32_t address, const Entries& entries,
                   const std::string& access = "RW") {
  std::string node = fmt::format("<Enumeration Name=\"{}\">", name);
  for (const auto& [entry, value] : entries)
    node += fmt::format("<EnumEntry Name=\"{}\"><Value>{}</Value></EnumEntry>", entry, value);
  return node + fmt::format("<pValue>{}Reg</pValue></Enumeration>\n", name) +
         int_reg(name + "Reg", address, access);
}

std::string command(const std::string& name, std::uint32_t address, int value) {
  return fmt::format(
             "<Command Name=\"{0}\"><pValue>{0}Reg</pValue><CommandValue>{1}</CommandValue>"
             "</Command>\n",
             name, value) +
         int_reg(name + "Reg", address, "WO");
}

std::string boolean(const std::string& name, std::uint32_t address) {
  return fmt::format(
             "<Boolean Name=\"{0}\"><pValue>{0}Reg</pValue><OnValue>1</OnValue>"
             "<OffValue>0</OffValue></Boolean>\n",
             name) +
         int_reg(name + "Reg", address, "RW");
}

std::string most(std::uint32_t value) {
  return fmt::format("<Max>{}</Max>", value);
}

std::string action_keys() {
  return integer("ActionDeviceKey", reg::action_device_key, 0, most(0xFFFFFFFF), 1) +
         integer("ActionGroupKey", reg::action_group_key, 0, most(0xFFFFFFFF), 1) +
         integer("ActionGroupMask", reg::action_group_mask, 0, most(0xFFFFFFFF), 1);
}

std::string features(const Personality& p) {
  const Entries automatic = {{"Off", 0}, {"Once", 1}, {"Continuous", 2}};
  std::string xml;
  xml += text("DeviceVendorName", reg::manufacturer, 32);
  xml += text("DeviceModelName", reg::model, 32);
  xml += text("DeviceVersion", reg::device_version, 32);
  xml += text("DeviceSerialNumber", reg::serial, 16);
  xml += int_reg("SensorWidth", reg::sensor_width, "RO");
  xml += int_reg("SensorHeight", reg::sensor_height, "RO");
  xml += integer("Width", reg::width, 1, "<pMax>SensorWidth</pMax>", 1);
  xml += integer("Height", reg::height, 1, "<pMax>SensorHeight</pMax>", 1);
  xml += integer("OffsetX", reg::offset_x, 0, "<pMax>SensorWidth</pMax>", 1);
  xml += integer("OffsetY", reg::offset_y, 0, "<pMax>SensorHeight</pMax>", 1);
  xml += choice("PixelFormat", reg::pixel_format, p.pixel_formats);
  xml += int_reg("PayloadSize", reg::payload_size, "RO");
  xml += choice("AcquisitionMode", reg::acquisition_mode, {{"Continuous", 0}, {"SingleFrame", 1}});
  xml += command("AcquisitionStart", reg::acquisition, 1);
  xml += command("AcquisitionStop", reg::acquisition, 0);
  xml += p.exposure == "ExposureTimeRaw"
             ? integer(p.exposure, reg::exposure_raw_us, 10, most(10'000'000), 1)
             : real(p.exposure, reg::exposure_us, 10, 1e7, "us");
  xml += choice("ExposureAuto", reg::exposure_auto, automatic);
  xml += p.gain == "GainRaw" ? integer(p.gain, reg::gain_raw, 0, most(500), 1)
                             : real(p.gain, reg::gain_db, 0, 24, "dB");
  xml += choice("GainAuto", reg::gain_auto, automatic);
  xml += real(p.rate, reg::frame_rate_hz, 0.1, 1000, "Hz");
  if (!p.rate_switch.empty()) xml += boolean(p.rate_switch, reg::rate_switch);
  if (p.chunks_on) xml += boolean("ChunkModeActive", reg::chunks);
  if (p.gamma_on) xml += boolean("GammaEnable", reg::gamma_switch);
  if (p.trigger_selector)
    xml += choice("TriggerSelector", reg::trigger_selector, {{"FrameStart", 0}});
  xml += choice("TriggerMode", reg::trigger_mode, {{"Off", 0}, {"On", 1}});
  Entries sources;
  for (const std::string& source : p.trigger_sources)
    sources.emplace_back(source, source == "Software" ? 0 : source == "Action1" ? 2 : 1);
  xml += choice("TriggerSource", reg::trigger_source, sources);
  xml += command("TriggerSoftware", reg::trigger_software, 1);
  if (p.has_trigger("Action1")) xml += action_keys();
  xml += boolean("PtpEnable", reg::ptp_enable);
  xml += command("PtpDataSetLatch", reg::ptp_latch, 1);
  xml +=
      choice("PtpStatus", reg::ptp_status, {{"Disabled", 0}, {"Listening", 1}, {"Slave", 2}}, "RO");
  xml += int_reg("PtpOffsetFromMaster", reg::ptp_offset_ns, "RO", 8, "Signed");
  xml += integer("GevHeartbeatTimeout", reg::heartbeat_ms, 500, most(60000), 1);
  if (p.latch == Latch::gev) {
    xml += int_reg("GevTimestampTickFrequency", reg::tick_high, "RO", 8);
    xml += command("GevTimestampControlLatch", reg::timestamp_control, 2);
    xml += int_reg("GevTimestampValue", reg::timestamp_high, "RO", 8);
  } else if (p.latch == Latch::sfnc) {
    xml += command("TimestampLatch", reg::latch, 1);
    xml += int_reg("TimestampLatchValue", reg::latched_ns, "RO", 8);
  }
  xml += integer("GevSCPSPacketSize", reg::packet_size, 576, most(65000), 1);
  xml += integer("GevSCPD", reg::packet_delay, 0, most(1000000), 1);
  return xml;
}

}  // namespace

std::string genicam_xml(const Personality& p) {
  const std::string nodes = features(p);
  // Every node that is not the register of another one is a feature.
  std::string root = "<Category Name=\"Root\" NameSpace=\"Standard\">";
  for (std::size_t at = nodes.find(" Name=\""); at != std::string::npos;
       at = nodes.find(" Name=\"", at)) {
    at += 7;
    const std::string name = nodes.substr(at, nodes.find('"', at) - at);
    const bool is_entry = nodes.compare(at - 16, 9, "EnumEntry") == 0;
    if (!is_entry && !name.ends_with("Reg")) root += fmt::format("<pFeature>{}</pFeature>", name);
  }
  root += "</Category>\n";
  std::string xml =
      "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
      "<RegisterDescription ModelName=\"TestCamera\" VendorName=\"Drapebench\" "
      "StandardNameSpace=\"None\" SchemaMajorVersion=\"1\" SchemaMinorVersion=\"1\" "
      "SchemaSubMinorVersion=\"0\" MajorVersion=\"1\" MinorVersion=\"0\" SubMinorVersion=\"0\" "
      "ProductGuid=\"5b6b0ac1-0000-4000-8000-000000000001\" "
      "VersionGuid=\"5b6b0ac1-0000-4000-8000-000000000002\" "
      "xmlns=\"http://www.genicam.org/GenApi/Version_1_1\">\n" +
      root + nodes + "<Port Name=\"Device\"/>\n</RegisterDescription>\n";
  if (!p.ieee1588_names) return xml;
  for (const auto& [name, older] : {std::pair<std::string, std::string>{"PtpEnable", "GevIEEE1588"},
                                    {"PtpDataSetLatch", "GevIEEE1588DataSetLatch"},
                                    {"PtpStatus", "GevIEEE1588Status"},
                                    {"PtpOffsetFromMaster", "GevIEEE1588OffsetFromMaster"}})
    for (std::size_t at = xml.find(name); at != std::string::npos; at = xml.find(name, at))
      xml.replace(at, name.size(), older), at += older.size();
  return xml;
}

}  // namespace drape::test
