// SPDX-License-Identifier: Apache-2.0
// Image files with large claims, of another type, or in other places.
#include <sys/stat.h>
#include <zlib.h>

#include "core/files/files.hpp"
#include "tests/faults/hostile_bench.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kImport = "import images --out out/recording";

std::string big_endian(std::uint32_t value) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>((value >> shift) & 0xff);
  return bytes;
}

std::string chunk(const std::string& type, const std::string& data) {
  const std::string body = type + data;
  const uLong crc = ::crc32_z(0, reinterpret_cast<const Bytef*>(body.data()), body.size());
  return big_endian(static_cast<std::uint32_t>(data.size())) + body +
         big_endian(static_cast<std::uint32_t>(crc));
}

/// Returns `count` zero bytes, compressed by zlib.
std::string zeros(std::size_t count) {
  z_stream stream{};
  if (::deflateInit(&stream, 9) != Z_OK) throw std::runtime_error("deflateInit");
  std::string result, block(1 << 20, '\0'), out(1 << 16, '\0');
  while (true) {
    const std::size_t size = std::min(count, block.size());
    count -= size;
    stream.next_in = reinterpret_cast<Bytef*>(block.data());
    stream.avail_in = static_cast<uInt>(size);
    int status = Z_OK;
    do {
      stream.next_out = reinterpret_cast<Bytef*>(out.data());
      stream.avail_out = static_cast<uInt>(out.size());
      status = ::deflate(&stream, count == 0 ? Z_FINISH : Z_NO_FLUSH);
      result.append(out.data(), out.size() - stream.avail_out);
    } while (stream.avail_out == 0);
    if (status == Z_STREAM_END) break;
  }
  ::deflateEnd(&stream);
  return result;
}

/// A black PNG; `pixels` can be fewer bytes than it claims.
std::string png(std::uint32_t width, std::uint32_t height, int bits, int colour, std::size_t bytes,
                const std::string& before_pixels = {}) {
  const std::string head = big_endian(width) + big_endian(height) + static_cast<char>(bits) +
                           static_cast<char>(colour) + std::string(3, '\0');
  return "\x89PNG\r\n\x1a\n" + chunk("IHDR", head) + before_pixels + chunk("IDAT", zeros(bytes)) +
         chunk("IEND", "");
}

std::string good_png() {
  return png(64, 48, 8, 0, 65 * 48);
}

HostileFile image(const std::string& name, const std::string& file,
                  const std::function<std::string()>& bytes) {
  return {name,
          [file, bytes](const HostileBench& b) {
            b.write("images/set/cam0.png", good_png());
            b.write("images/set/" + file, bytes());
          },
          kImport};
}

std::string tiff(std::uint16_t count) {
  std::string text("II*\0\x08\0\0\0", 8);
  text += static_cast<char>(count & 0xff);
  text += static_cast<char>(count >> 8);
  const auto entry = [&](int tag, std::uint32_t value) {
    text += static_cast<char>(tag & 0xff);
    text += static_cast<char>(tag >> 8);
    text += std::string("\x04\0\x01\0\0\0", 6);
    for (int i = 0; i < 4; ++i) text += static_cast<char>((value >> (8 * i)) & 0xff);
  };
  entry(256, 0x7fffffff);
  entry(257, 0x7fffffff);
  entry(258, 8);
  entry(259, 1);
  entry(262, 1);
  entry(273, 8);
  entry(278, 0x7fffffff);
  entry(279, 4);
  return text + std::string(4, '\0');
}

}  // namespace

std::vector<HostileFile> hostile_images() {
  return {
      image("png_claims_2_31_px", "cam1.png",
            [] { return png(0x7fffffff, 0x7fffffff, 8, 0, 100); }),
      image("png_bomb_of_900_megapixels", "cam1.png",
            [] { return png(30000, 30000, 1, 0, std::size_t{3751} * 30000); }),
      image("png_of_all_pixels_allowed_in_64_bits", "cam1.png",
            [] { return png(11585, 11585, 16, 6, std::size_t{11585 * 8 + 1} * 11585); }),
      image(
          "png_animation", "cam1.png",
          [] { return png(64, 48, 8, 0, 65 * 48, chunk("acTL", big_endian(2) + big_endian(0))); }),
      image("png_of_no_size", "cam1.png", [] { return png(0, 0, 8, 0, 1); }),
      image("png_text_bomb", "cam1.png",
            [] {
              return png(
                  64, 48, 8, 0, 65 * 48,
                  chunk("zTXt", std::string("Comment\0\0", 9) + zeros(std::size_t{1} << 30)));
            }),
      image("png_profile_bomb", "cam1.png",
            [] {
              return png(64, 48, 8, 0, 65 * 48,
                         chunk("iCCP", std::string("icc\0\0", 5) + zeros(std::size_t{1} << 30)));
            }),
      image("tiff_claims_2_31_px", "cam1.tif", [] { return tiff(8); }),
      image("tiff_of_65535_entries", "cam1.tif", [] { return tiff(65535); }),
      image("jpeg_of_nothing", "cam1.jpg", [] { return std::string("\xff\xd8\xff\xd9"); }),
      image("jpeg_of_65535_px_without_data", "cam1.jpg",
            [] {
              return std::string(
                  "\xff\xd8\xff\xc0\0\x0b\x08\xff\xff\xff\xff\x01\x01\x11\0"
                  "\xff\xda\0\x08\x01\x01\0\0\x3f\0\xff\xd9",
                  27);
            }),
      image("empty_image", "cam1.png", [] { return std::string(); }),
      image("text_as_image", "cam1.png",
            [] { return std::string("#!/bin/sh\ntouch /tmp/owned\n"); }),
      image("script_as_image_name", "cam1" + kScriptName + ".png", good_png),
      image("formula_as_image_name", "=1+2.png", good_png),
      image("newline_as_image_name", "cam\n1.png", good_png),
      {"pipe_as_image",
       [](const HostileBench& b) {
         b.write("images/set/cam0.png", good_png());
         ::mkfifo((b.lab() / "images/set/cam1.png").c_str(), 0600);
       },
       kImport},
      {"endless_device_as_image",
       [](const HostileBench& b) {
         b.write("images/set/cam0.png", good_png());
         fs::create_symlink("/dev/zero", b.lab() / "images/set/cam1.png");
       },
       kImport},
      {"link_to_the_secret_as_image",
       [](const HostileBench& b) {
         b.write("images/set/cam0.png", good_png());
         fs::create_symlink(b.outside() / "secret.txt", b.lab() / "images/set/cam1.png");
       },
       kImport},
      {"folder_that_holds_itself",
       [](const HostileBench& b) {
         b.write("images/set/cam0.png", good_png());
         fs::create_directory_symlink("..", b.lab() / "images/set/again");
         fs::create_directory_symlink("images", b.lab() / "images/loop");
       },
       kImport},
      {"pipe_as_rig",
       [](const HostileBench& b) {
         fs::remove(b.lab() / "rig/rig.toml");
         ::mkfifo((b.lab() / "rig/rig.toml").c_str(), 0600);
       },
       "check rig"},
      {"frame_of_another_width",
       [](const HostileBench& b) {
         b.edit("rig/recording/recording.json", [](Json& json) {
           for (Json& set : json["sets"])
             for (Json& frame : set["frames"]) frame["width_px"] = 1000000;
         });
       },
       "run rig --single --out out"},
      {"set_twice_in_the_manifest",
       [](const HostileBench& b) {
         b.edit("rig/recording/recording.json",
                [](Json& json) { json["sets"].push_back(json["sets"][0]); });
       },
       "run rig --single --out out"},
      {"frame_twice_in_the_manifest",
       [](const HostileBench& b) {
         b.edit("rig/recording/recording.json", [](Json& json) {
           json["sets"][0]["frames"].push_back(json["sets"][0]["frames"][0]);
         });
       },
       "run rig --single --out out"},
      {"output_is_a_device", [](const HostileBench&) {},
       "compare out/C/sheet.json out/C/simulations/10mm-1/sheet.json --report /dev/null"},
  };
}

}  // namespace drape::test
