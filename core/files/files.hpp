// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace drape {

/// Whole file as text. Throws Error(bad_input) naming the file when it cannot be read.
[[nodiscard]] std::string read_text(const std::filesystem::path& file);

/// Whole file as bytes. Throws like read_text.
[[nodiscard]] std::vector<unsigned char> read_bytes(const std::filesystem::path& file);

/// Writes all or nothing, durably: temporary name, fsync, rename, fsync of the folder. Creates
/// missing folders. Throws Error(bad_input) naming the file and the system's reason.
void write_durable(const std::filesystem::path& file, std::string_view content);

/// Lower-case hexadecimal SHA-256.
[[nodiscard]] std::string sha256_of(std::span<const unsigned char> bytes);
[[nodiscard]] std::string sha256_of(std::string_view text);
[[nodiscard]] std::string sha256_of_file(const std::filesystem::path& file);

}  // namespace drape
