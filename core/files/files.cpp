// SPDX-License-Identifier: Apache-2.0
#include "core/files/files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/evp.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>

#include "core/error.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail_to_write(const fs::path& file, int code) {
  throw bad_input(fmt::format("cannot write: {}", std::strerror(code)), {.file = file.string()},
                  "check the path, its permissions and the free space, then run again");
}

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

void write_all(int fd, std::string_view content, const fs::path& file) {
  while (!content.empty()) {
    const ssize_t written = ::write(fd, content.data(), content.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      fail_to_write(file, errno);
    }
    content.remove_prefix(static_cast<std::size_t>(written));
  }
}

void sync_folder(const fs::path& folder, const fs::path& file) {
  const Descriptor fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (fd.get() < 0 || ::fsync(fd.get()) != 0) fail_to_write(file, errno);
}

}  // namespace

std::vector<unsigned char> read_bytes(const fs::path& file) {
  const Descriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
  std::vector<unsigned char> bytes;
  const off_t size = fd.get() < 0 ? -1 : ::lseek(fd.get(), 0, SEEK_END);
  if (size >= 0) {
    bytes.resize(static_cast<std::size_t>(size));
    std::size_t done = 0;
    while (done < bytes.size()) {
      const ssize_t got =
          ::pread(fd.get(), bytes.data() + done, bytes.size() - done, static_cast<off_t>(done));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) break;
      done += static_cast<std::size_t>(got);
    }
    if (done == bytes.size() && !fs::is_directory(file)) return bytes;
    errno = fs::is_directory(file) ? EISDIR : EIO;
  }
  throw bad_input(fmt::format("cannot read: {}", std::strerror(errno)), {.file = file.string()},
                  "check that the file exists and may be read");
}

std::string read_text(const fs::path& file) {
  const std::vector<unsigned char> bytes = read_bytes(file);
  return {bytes.begin(), bytes.end()};
}

void write_durable(const fs::path& file, std::string_view content) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (failed) fail_to_write(file, failed.value());
  // The temporary name is fixed, so a killed run leaves at most one of them, which the next
  // replaces.
  const fs::path partial = folder / ("." + file.filename().string() + ".partial");
  {
    const Descriptor fd(::open(partial.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
    if (fd.get() < 0) fail_to_write(file, errno);
    write_all(fd.get(), content, file);
    if (::fsync(fd.get()) != 0) fail_to_write(file, errno);
  }
  if (::rename(partial.c_str(), file.c_str()) != 0) fail_to_write(file, errno);
  sync_folder(folder, file);
}

std::string sha256_of(std::span<const unsigned char> bytes) {
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int length = 0;
  if (EVP_Digest(bytes.data(), bytes.size(), digest, &length, EVP_sha256(), nullptr) != 1) {
    throw internal_error("SHA-256 failed");
  }
  std::string text;
  for (unsigned int i = 0; i < length; ++i) text += fmt::format("{:02x}", digest[i]);
  return text;
}

std::string sha256_of(std::string_view text) {
  return sha256_of(std::span(reinterpret_cast<const unsigned char*>(text.data()), text.size()));
}

std::string sha256_of_file(const fs::path& file) {
  return sha256_of(read_bytes(file));
}

}  // namespace drape
