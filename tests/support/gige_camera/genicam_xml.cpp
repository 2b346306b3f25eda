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

constexpr const char* kFeatures[] = {"DeviceVendorName",
                                     "DeviceModelName",
                                     "DeviceVersion",
                                     "DeviceSerialNumber",
                                     "SensorWidth",
                                     "SensorHeight",
                                     "Width",
                                     "Height",
                                     "OffsetX",
                                     "OffsetY",
                                     "PixelFormat",
                                     "PayloadSize",
                                     "AcquisitionMode",
                                     "AcquisitionStart",
                                     "AcquisitionStop",
                                     "ExposureTime",
                                     "ExposureAuto",
                                     "Gain",
                                     "GainAuto",
                                     "AcquisitionFrameRate",
                                     "TriggerSelector",
                                     "TriggerMode",
                                     "TriggerSource",
                                     "TriggerSoftware",
                                     "ActionDeviceKey",
                                     "ActionGroupKey",
                                     "ActionGroupMask",
                                     "PtpEnable",
                                     "PtpDataSetLatch",
                                     "PtpStatus",
                                     "PtpOffsetFromMaster",
                                     "GevHeartbeatTimeout",
                                     "GevTimestampTickFrequency",
                                     "GevTimestampControlLatch",
                                     "GevTimestampValue",
                                     "GevSCPSPacketSize",
                                     "GevSCPD"};

std::string features() {
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
  xml += choice("PixelFormat", reg::pixel_format, {{"Mono8", 0x01080001}, {"Mono16", 0x01100007}});
  xml += int_reg("PayloadSize", reg::payload_size, "RO");
  xml += choice("AcquisitionMode", reg::acquisition_mode, {{"Continuous", 0}, {"SingleFrame", 1}});
  xml += command("AcquisitionStart", reg::acquisition, 1);
  xml += command("AcquisitionStop", reg::acquisition, 0);
  xml += real("ExposureTime", reg::exposure_us, 10, 1e7, "us");
  xml += choice("ExposureAuto", reg::exposure_auto, automatic);
  xml += real("Gain", reg::gain_db, 0, 24, "dB");
  xml += choice("GainAuto", reg::gain_auto, automatic);
  xml += real("AcquisitionFrameRate", reg::frame_rate_hz, 0.1, 1000, "Hz");
  xml += choice("TriggerSelector", reg::trigger_selector, {{"FrameStart", 0}});
  xml += choice("TriggerMode", reg::trigger_mode, {{"Off", 0}, {"On", 1}});
  xml +=
      choice("TriggerSource", reg::trigger_source, {{"Software", 0}, {"Line1", 1}, {"Action1", 2}});
  xml += command("TriggerSoftware", reg::trigger_software, 1);
  xml += integer("ActionDeviceKey", reg::action_device_key, 0, most(0xFFFFFFFF), 1);
  xml += integer("ActionGroupKey", reg::action_group_key, 0, most(0xFFFFFFFF), 1);
  xml += integer("ActionGroupMask", reg::action_group_mask, 0, most(0xFFFFFFFF), 1);
  xml += boolean("PtpEnable", reg::ptp_enable);
  xml += command("PtpDataSetLatch", reg::ptp_latch, 1);
  xml +=
      choice("PtpStatus", reg::ptp_status, {{"Disabled", 0}, {"Listening", 1}, {"Slave", 2}}, "RO");
  xml += int_reg("PtpOffsetFromMaster", reg::ptp_offset_ns, "RO", 8, "Signed");
  xml += integer("GevHeartbeatTimeout", reg::heartbeat_ms, 500, most(60000), 1);
  xml += int_reg("GevTimestampTickFrequency", reg::tick_high, "RO", 8);
  xml += command("GevTimestampControlLatch", reg::timestamp_control, 2);
  xml += int_reg("GevTimestampValue", reg::timestamp_high, "RO", 8);
  xml += integer("GevSCPSPacketSize", reg::packet_size, 576, most(65000), 1);
  xml += integer("GevSCPD", reg::packet_delay, 0, most(1000000), 1);
  return xml;
}

}  // namespace

std::string genicam_xml(bool ieee1588_names) {
  std::string root = "<Category Name=\"Root\" NameSpace=\"Standard\">";
  for (const char* feature : kFeatures) root += fmt::format("<pFeature>{}</pFeature>", feature);
  root += "</Category>\n";
  std::string xml =
      "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
      "<RegisterDescription ModelName=\"TestCamera\" VendorName=\"Drapebench\" "
      "StandardNameSpace=\"None\" SchemaMajorVersion=\"1\" SchemaMinorVersion=\"1\" "
      "SchemaSubMinorVersion=\"0\" MajorVersion=\"1\" MinorVersion=\"0\" SubMinorVersion=\"0\" "
      "ProductGuid=\"5b6b0ac1-0000-4000-8000-000000000001\" "
      "VersionGuid=\"5b6b0ac1-0000-4000-8000-000000000002\" "
      "xmlns=\"http://www.genicam.org/GenApi/Version_1_1\">\n" +
      root + features() + "<Port Name=\"Device\"/>\n</RegisterDescription>\n";
  if (!ieee1588_names) return xml;
  for (const auto& [name, older] : {std::pair<std::string, std::string>{"PtpEnable", "GevIEEE1588"},
                                    {"PtpDataSetLatch", "GevIEEE1588DataSetLatch"},
                                    {"PtpStatus", "GevIEEE1588Status"},
                                    {"PtpOffsetFromMaster", "GevIEEE1588OffsetFromMaster"}})
    for (std::size_t at = xml.find(name); at != std::string::npos; at = xml.find(name, at))
      xml.replace(at, name.size(), older), at += older.size();
  return xml;
}

}  // namespace drape::test
