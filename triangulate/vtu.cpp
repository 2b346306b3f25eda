// SPDX-License-Identifier: Apache-2.0
#include "triangulate/vtu.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <pugixml.hpp>
#include <sstream>
#include <string_view>

#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape::triangulate {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostPoints = 5'000'000;
constexpr std::size_t kMostBytes = std::size_t{1} << 30;  ///< of one array once it is uncompressed

/// Bytes of base64 up to the first character that is none; `used` characters were read.
std::string from_base64(std::string_view text, std::size_t wanted, std::size_t& used) {
  const auto value_of = [](char c) -> int {
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    return c == '+' ? 62 : c == '/' ? 63 : -1;
  };
  std::string bytes;
  for (used = 0; bytes.size() < wanted && used + 4 <= text.size(); used += 4) {
    std::uint32_t group = 0;
    int count = 0;
    for (int i = 0; i < 4; ++i) {
      const int value = value_of(text[used + static_cast<std::size_t>(i)]);
      group = group << 6 | static_cast<std::uint32_t>(std::max(0, value));
      count += value >= 0;
    }
    if (count < 2) break;
    for (int i = 0; i + 1 < count; ++i) bytes += static_cast<char>(group >> (16 - 8 * i) & 0xff);
  }
  return bytes;
}

class Vtu {
 public:
  explicit Vtu(const fs::path& file) : file_(file), text_(read_text(file)) {
    // Raw bytes would end the XML: what lies behind the underscore is cut off before it is parsed.
    const std::size_t open = text_.find("<AppendedData");
    std::string head = text_.substr(0, open);
    if (open != std::string::npos) {
      const std::size_t begin = text_.find('>', open);
      const std::size_t mark = text_.find('_', begin);
      if (mark == std::string::npos) fail("its appended data do not begin");
      raw_ = text_.substr(open, begin - open).find("\"raw\"") != std::string::npos;
      appended_ = std::string_view(text_).substr(mark + 1);
      head += "</VTKFile>";
    }
    if (!document_.load_string(head.c_str())) fail("it is no XML of VTK");
    root_ = document_.child("VTKFile");
    if (root_.attribute("type").value() != std::string_view("UnstructuredGrid"))
      fail("it is no unstructured grid");
    big_endian_ = root_.attribute("byte_order").value() == std::string_view("BigEndian");
    wide_ = root_.attribute("header_type").value() == std::string_view("UInt64");
    const std::string_view compressor = root_.attribute("compressor").value();
    if (!compressor.empty() && compressor != "vtkZLibDataCompressor")
      fail(fmt::format("its compressor is {}", compressor));
    compressed_ = !compressor.empty();
  }

  [[nodiscard]] std::vector<std::pair<std::string, std::vector<double>>> columns() const {
    const pugi::xml_node grid = root_.child("UnstructuredGrid"), piece = grid.child("Piece");
    if (!piece || piece.next_sibling("Piece")) fail("it has not one piece");
    const std::size_t points = piece.attribute("NumberOfPoints").as_ullong();
    if (points == 0 || points > kMostPoints) fail(fmt::format("it states {} points", points));
    std::vector<std::pair<std::string, std::vector<double>>> result;
    const auto add = [&](const pugi::xml_node& array, const std::string& name) {
      const std::size_t parts = std::max(1U, array.attribute("NumberOfComponents").as_uint(1));
      if (parts > 100) fail(fmt::format("{} has {} components", name, parts));
      const std::vector<double> values = values_of(array, parts * points);
      for (std::size_t part = 0; part < parts; ++part) {
        std::vector<double> column(points);
        for (std::size_t i = 0; i < points; ++i) column[i] = values[i * parts + part];
        constexpr std::array axes = {"X_mm", "Y_mm", "Z_mm"};
        result.emplace_back(name.empty() ? axes.at(part)
                            : parts == 1 ? name
                                         : fmt::format("{}_{}", name, part),
                            std::move(column));
      }
    };
    const pugi::xml_node place = piece.child("Points").child("DataArray");
    if (place.attribute("NumberOfComponents").as_uint() != 3) fail("its points have not 3 parts");
    add(place, "");
    for (const pugi::xml_node& array : piece.child("PointData").children("DataArray"))
      add(array, array.attribute("Name").value());
    return result;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw bad_input(what, {.file = file_.string()},
                    "write it as VTU, ASCII or binary, compressed by zlib or not at all");
  }

  [[nodiscard]] std::uint64_t whole_at(std::string_view bytes, std::size_t at,
                                       std::size_t width) const {
    if (at > bytes.size() || bytes.size() - at < width) fail("an array ends early");
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < width; ++i) {
      const std::size_t k = big_endian_ ? i : width - 1 - i;
      value = value << 8 | static_cast<unsigned char>(bytes[at + k]);
    }
    return value;
  }

  /// Bytes of an array behind its header; `text` is base64 unless `raw`.
  [[nodiscard]] std::string bytes_of(std::string_view text, bool raw) const {
    const std::size_t width = wide_ ? 8 : 4;
    const auto take = [&](std::size_t count, std::size_t& used) {
      if (count > kMostBytes) fail("an array is larger than 1 GiB");
      if (!raw) return from_base64(text, count, used);
      used = std::min(count, text.size());
      return std::string(text.substr(0, used));
    };
    std::size_t used = 0;
    if (!compressed_) {
      const std::uint64_t size = whole_at(take(width, used), 0, width);
      if (size > kMostBytes) fail("an array is larger than 1 GiB");
      std::string all = take(width + size, used);
      if (all.size() < width + size) fail("an array ends early");
      return all.substr(width, size);
    }
    const std::uint64_t blocks = whole_at(take(width, used), 0, width);
    if (blocks > text.size()) fail("an array states more blocks than the file has bytes");
    const std::string header = take(width * (3 + blocks), used);
    const std::uint64_t full = whole_at(header, width, width),
                        last = whole_at(header, 2 * width, width);
    std::uint64_t packed = 0;
    for (std::uint64_t i = 0; i < blocks; ++i) packed += whole_at(header, width * (3 + i), width);
    if (full > kMostBytes || packed > text.size() || blocks * full > kMostBytes)
      fail("an array is larger than 1 GiB");
    text.remove_prefix(used);
    const std::string data = take(packed, used);
    if (data.size() < packed) fail("an array ends early");
    std::string result;
    std::size_t at = 0;
    for (std::uint64_t i = 0; i < blocks; ++i) {
      const std::uint64_t size = whole_at(header, width * (3 + i), width);
      std::string block(i + 1 == blocks && last > 0 ? last : full, '\0');
      uLongf length = block.size();
      if (at > data.size() || data.size() - at < size ||
          ::uncompress(reinterpret_cast<Bytef*>(block.data()), &length,
                       reinterpret_cast<const Bytef*>(data.data() + at), size) != Z_OK ||
          length != block.size())
        fail("an array cannot be uncompressed");
      result += block;
      at += size;
    }
    return result;
  }

  [[nodiscard]] std::vector<double> values_of(const pugi::xml_node& array,
                                              std::size_t count) const {
    const std::string_view format = array.attribute("format").value();
    std::vector<double> values;
    if (format == "ascii") {
      std::istringstream in(array.child_value());
      for (std::string word; in >> word;) {
        char* end = nullptr;
        values.push_back(std::strtod(word.c_str(), &end));
        if (*end != '\0') fail(fmt::format("`{}` is no number", printable(word)));
      }
      if (values.size() != count) fail("an array has not as many numbers as it states");
      return values;
    }
    std::string bytes;
    if (format == "appended") {
      const std::size_t offset = array.attribute("offset").as_ullong();
      if (offset >= appended_.size()) fail("an array lies behind the file's end");
      bytes = bytes_of(appended_.substr(offset), raw_);
    } else {
      std::string text = array.child_value();
      std::erase_if(text, [](char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; });
      bytes = bytes_of(text, false);
    }
    const std::string_view type = array.attribute("type").value();
    const std::size_t width = type.ends_with("64")   ? 8
                              : type.ends_with("32") ? 4
                              : type.ends_with("16") ? 2
                                                     : 1;
    if (bytes.size() != width * count) fail("an array has not as many numbers as it states");
    values.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint64_t whole = whole_at(bytes, i * width, width);
      if (type == "Float64")
        values.push_back(std::bit_cast<double>(whole));
      else if (type == "Float32")
        values.push_back(std::bit_cast<float>(static_cast<std::uint32_t>(whole)));
      else if (type.starts_with("UInt"))
        values.push_back(static_cast<double>(whole));
      else if (type.starts_with("Int"))
        values.push_back(static_cast<double>(static_cast<std::int64_t>(whole << (64 - 8 * width)) >>
                                             (64 - 8 * width)));
      else
        fail(fmt::format("an array is of type `{}`", type));
    }
    return values;
  }

  fs::path file_;
  std::string text_;
  std::string_view appended_;
  pugi::xml_document document_;
  pugi::xml_node root_;
  bool raw_ = false, big_endian_ = false, wide_ = false, compressed_ = false;
};

}  // namespace

std::vector<std::pair<std::string, std::vector<double>>> vtu_columns(const fs::path& file) {
  return Vtu(file).columns();
}

}  // namespace drape::triangulate
