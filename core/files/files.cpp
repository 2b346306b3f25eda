// SPDX-License-Identifier: Apache-2.0
#include "core/files/files.hpp"
#include "core/files/inside.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/evp.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

namespace drape {
namespace {

namespace fs = std::filesystem;

constexpr off_t kMostBytes = off_t{768} << 20,
                kMostText = off_t{256} << 20;  ///< largest file that is read
constexpr std::size_t kLongestName = 200;  ///< bytes; leaves room for suffixes below the limit, 255

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

/// Creates the folder of `file` with its parents, durably.
void make_folder(const fs::path& folder, const fs::path& file) {
  std::error_code unreachable;
  if (fs::is_directory(folder, unreachable)) return;
  const fs::path above = folder.has_parent_path() ? folder.parent_path() : fs::path(".");
  if (above != folder) make_folder(above, file);
  if (::mkdir(folder.c_str(), 0777) != 0 && errno != EEXIST) fail_to_write(file, errno);
  sync_folder(above, file);
}

/// Like name_inside, but refuses a link that leads out of the folder.
fs::path linked_inside(const fs::path& folder, const std::string& name, const Where& where) {
  fs::path file = name_inside(folder, name, where);
  std::error_code unreachable;
  const fs::path real = fs::weakly_canonical(fs::absolute(file), unreachable);
  const fs::path inner = real.lexically_relative(fs::weakly_canonical(fs::absolute(folder)));
  if (unreachable || inner.empty() || *inner.begin() == "..")
    throw bad_input(fmt::format("`{}` is a link that leads out of its folder", printable(name)),
                    where, "bring the file itself");
  return file;
}

template <class Bytes>
Bytes whole_file(const fs::path& file, off_t most) {
  const auto fail = [&](const std::string& why) {
    throw bad_input("cannot read: " + why, {.file = file.string()},
                    "check that the file exists and may be read");
  };
  // Non-blocking: opening a pipe would wait for its other end.
  const Descriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat status {};
  if (fd.get() < 0 || ::fstat(fd.get(), &status) != 0) fail(std::strerror(errno));
  if (S_ISDIR(status.st_mode)) fail(std::strerror(EISDIR));
  if (!S_ISREG(status.st_mode)) fail("it is a device or a pipe, not a file");
  if (status.st_size > most) fail(fmt::format("it is larger than {} MiB", most >> 20));
  Bytes bytes(static_cast<std::size_t>(status.st_size), {});
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t got =
        ::pread(fd.get(), bytes.data() + done, bytes.size() - done, static_cast<off_t>(done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail(std::strerror(errno));
    if (got == 0) fail("it became shorter while it was read");
    done += static_cast<std::size_t>(got);
  }
  return bytes;
}

}  // namespace

std::vector<unsigned char> read_bytes(const fs::path& file) {
  return whole_file<std::vector<unsigned char>>(file, kMostBytes);
}

std::string read_text(const fs::path& file) {
  return whole_file<std::string>(file, kMostText);
}

void write_durable(const fs::path& file, std::string_view content) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  make_folder(folder, file);
  // The temporary name is fixed, so a killed run leaves at most one such file; the next run
  // replaces it.
  const fs::path partial = folder / ("." + file.filename().string() + ".partial");
  require_replaceable(file);
  require_replaceable(partial);
  try {
    const Descriptor fd(::open(partial.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
    if (fd.get() < 0) fail_to_write(file, errno);
    write_all(fd.get(), content, file);
    if (::fsync(fd.get()) != 0) fail_to_write(file, errno);
    if (::rename(partial.c_str(), file.c_str()) != 0) fail_to_write(file, errno);
  } catch (const Error&) {
    ::unlink(partial.c_str());  // Frees the space it used on a full disk.
    throw;
  }
  sync_folder(folder, file);
}

void require_replaceable(const fs::path& file) {
  struct stat status {};
  if (::lstat(file.c_str(), &status) != 0 || S_ISREG(status.st_mode)) return;
  throw bad_input("a folder, link or device stands where a file is to be written",
                  {.file = file.string()}, "remove it, or give another place");
}

void remove_durable(const fs::path& file) {
  if (::unlink(file.c_str()) == 0)
    sync_folder(file.has_parent_path() ? file.parent_path() : fs::path("."), file);
  else if (errno != ENOENT && errno != ENOTDIR)
    fail_to_write(file, errno);
}

void require_target(const fs::path& file) {
  std::error_code unreadable;
  if (!fs::is_symlink(file, unreadable) || fs::exists(file, unreadable)) return;
  throw bad_input(fmt::format("the link leads to {}, which is not there",
                              printable(fs::read_symlink(file, unreadable).string())),
                  {.file = file.string()}, "copy the file itself, or remove the link");
}

void require_plain_name(const std::string& name, const Where& where) {
  const bool plain = !name.empty() && name.size() <= kLongestName && name.front() != '.' &&
                     name.front() != '-' && std::none_of(name.begin(), name.end(), [](char c) {
                       return c == '/' || c == '\\' || c == ',' ||
                              static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
                     });
  if (plain) return;
  throw bad_input(
      fmt::format("`{}` cannot be a name", printable(name.substr(0, kLongestName))), where,
      "use 1 to 200 bytes without /, \\, comma or control characters, and no . or - in front");
}

fs::path name_inside(const fs::path& folder, const std::string& name, const Where& where) {
  for (std::size_t begin = 0; begin <= name.size();) {
    const std::size_t end = std::min(name.find('/', begin), name.size());
    require_plain_name(name.substr(begin, end - begin), where);
    begin = end + 1;
  }
  return folder / name;
}

std::vector<unsigned char> read_inside(const fs::path& folder, const std::string& name,
                                       const Where& where) {
  return read_bytes(linked_inside(folder, name, where));
}

void write_inside(const fs::path& folder, const std::string& name, std::string_view content,
                  const Where& where) {
  write_durable(linked_inside(folder, name, where), content);
}

WriterLock::WriterLock(const fs::path& file, const std::string& held) : file_(file) {
  if (file.has_parent_path()) make_folder(file.parent_path(), file);
  for (;;) {
    fd_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644);
    if (fd_ < 0) fail_to_write(file, errno);
    if (::flock(fd_, LOCK_EX | LOCK_NB) != 0) {
      ::close(fd_);
      throw bad_input(held, {.file = file.parent_path().string()},
                      "wait for it to end, or give another place to write to");
    }
    // The previous holder may have removed the file between the two calls.
    struct stat ours {
    }, there{};
    if (::fstat(fd_, &ours) == 0 && ::lstat(file.c_str(), &there) == 0 &&
        ours.st_ino == there.st_ino)
      return;
    ::close(fd_);
  }
}

WriterLock::~WriterLock() {
  ::unlink(file_.c_str());
  ::close(fd_);
}

TemporaryFolder::TemporaryFolder(const std::string& purpose) {
  std::error_code error;
  std::string name = (fs::temp_directory_path(error) / "drapebench-XXXXXX").string();
  if (error || ::mkdtemp(name.data()) == nullptr)
    throw bad_input(purpose, {.file = name}, "set TMPDIR to a folder that can be written");
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

std::string sha256_of(std::span<const unsigned char> bytes) {
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int length = 0;
  if (EVP_Digest(bytes.data(), bytes.size(), digest, &length, EVP_sha256(), nullptr) != 1)
    throw internal_error("SHA-256 failed");
  return fmt::format("{:02x}", fmt::join(digest, digest + length, ""));
}

std::string sha256_of(std::string_view text) {
  return sha256_of(std::span(reinterpret_cast<const unsigned char*>(text.data()), text.size()));
}

std::string sha256_of_file(const fs::path& file) {
  return sha256_of(read_bytes(file));
}

std::string printable(std::string text) {
  // Marks that reorder text: U+061C, U+200E to U+200F, U+202A to U+202E, U+2066 to U+2069.
  static constexpr std::array<std::string_view, 12> kReorder = {
      "\xd8\x9c",     "\xe2\x80\x8e", "\xe2\x80\x8f", "\xe2\x80\xaa",
      "\xe2\x80\xab", "\xe2\x80\xac", "\xe2\x80\xad", "\xe2\x80\xae",
      "\xe2\x81\xa6", "\xe2\x81\xa7", "\xe2\x81\xa8", "\xe2\x81\xa9"};
  std::string shown;
  shown.reserve(text.size());
  for (std::size_t i = 0; i < text.size();) {
    const std::string_view rest = std::string_view(text).substr(i);
    const auto* reorder =
        std::find_if(kReorder.begin(), kReorder.end(),
                     [&](std::string_view mark) { return rest.starts_with(mark); });
    const auto byte = static_cast<unsigned char>(rest[0]);
    const bool second_set = byte == 0xc2 && rest.size() > 1 &&
                            static_cast<unsigned char>(rest[1]) >= 0x80 &&
                            static_cast<unsigned char>(rest[1]) < 0xa0;  // U+0080 to U+009F
    const bool control = (byte < 0x20 && rest[0] != '\n' && rest[0] != '\t') || byte == 0x7f;
    const bool hidden = reorder != kReorder.end() || second_set || control;
    shown += hidden ? '?' : rest[0];
    i += reorder != kReorder.end() ? reorder->size() : second_set ? 2 : 1;
  }
  return shown;
}

}  // namespace drape
