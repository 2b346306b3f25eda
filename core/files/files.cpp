// SPDX-License-Identifier: Apache-2.0
#include "core/files/files.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <openssl/evp.h>
#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <memory>
#include <sstream>

#include "core/fields/records.hpp"
#include "core/files/json_file.hpp"
#include "core/files/new_folder.hpp"
#include "core/files/number_range.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

constexpr off_t kMostBytes = off_t{768} << 20,
                kMostText = off_t{256} << 20;  ///< largest file that is read whole
/// Largest file that is hashed, as results.sqlite is after each import, and what is read of it at
/// once.
constexpr off_t kMostHashed = off_t{8} << 30, kPart = off_t{1} << 20;
constexpr std::size_t kLongestName = 200;  ///< bytes; leaves room for suffixes below the limit, 255

[[noreturn]] void fail_to_write(const fs::path& file, int code) {
  throw bad_input(fmt::format("cannot write: {}", std::strerror(code)), {.file = file.string()},
                  "check the path, its permissions and the free space, then run again");
}

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

[[noreturn]] void fail_to_read(const fs::path& file, const std::string& why) {
  throw bad_input("cannot read: " + why, {.file = file.string()},
                  "check that the file exists and may be read");
}

/// A regular file, open for reading.
struct Readable {
  fs::path file;
  Descriptor descriptor;
  off_t size = 0;
};

/// Refuses a file of more than `most` bytes.
Readable opened(const fs::path& file, off_t most) {
  // Non-blocking: opening a pipe would wait for its other end.
  Descriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat status {};
  if (fd.get() < 0 || ::fstat(fd.get(), &status) != 0) fail_to_read(file, std::strerror(errno));
  if (S_ISDIR(status.st_mode)) fail_to_read(file, std::strerror(EISDIR));
  if (!S_ISREG(status.st_mode)) fail_to_read(file, "it is a device or a pipe, not a file");
  if (status.st_size > most)
    fail_to_read(file, fmt::format("it is larger than {} MiB", most >> 20));
  return {file, std::move(fd), status.st_size};
}

/// Fills `bytes` from position `from` of the file.
template <class Bytes>
void read_part(const Readable& readable, off_t from, Bytes& bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t got = ::pread(readable.descriptor.get(), bytes.data() + done, bytes.size() - done,
                                from + static_cast<off_t>(done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail_to_read(readable.file, std::strerror(errno));
    if (got == 0) fail_to_read(readable.file, "it became shorter while it was read");
    done += static_cast<std::size_t>(got);
  }
}

template <class Bytes>
Bytes whole_file(const fs::path& file, off_t most) {
  const Readable readable = opened(file, most);
  Bytes bytes(static_cast<std::size_t>(readable.size), {});
  read_part(readable, 0, bytes);
  return bytes;
}

/// SHA-256 of what is added part by part.
class Hash {
 public:
  Hash() {
    static const EVP_MD* const kind = EVP_MD_fetch(nullptr, "SHA256", nullptr);
    check(EVP_DigestInit_ex(context_.get(), kind, nullptr));
  }
  void add(std::span<const unsigned char> bytes) {
    check(EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()));
  }
  /// As hexadecimal digits.
  [[nodiscard]] std::string text() {
    constexpr std::string_view kDigits = "0123456789abcdef";
    unsigned char digest[EVP_MAX_MD_SIZE];
    unsigned int length = 0;
    check(EVP_DigestFinal_ex(context_.get(), digest, &length));
    std::string text;
    for (unsigned i = 0; i < length; ++i)
      (text += kDigits[digest[i] >> 4U]) += kDigits[digest[i] & 15U];
    return text;
  }

 private:
  static void check(int done) {
    if (done != 1) throw internal_error("SHA-256 failed");
  }
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_{EVP_MD_CTX_new(),
                                                                   &EVP_MD_CTX_free};
};

}  // namespace

std::string_view as_text(std::span<const unsigned char> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::optional<std::uint64_t> unsigned_at(std::string_view bytes, std::size_t offset,
                                         std::size_t width, bool little_endian) {
  if (offset > bytes.size() || bytes.size() - offset < width) return std::nullopt;
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < width; ++i)
    value = value << 8 |
            static_cast<unsigned char>(bytes[offset + (little_endian ? width - 1 - i : i)]);
  return value;
}

bool begins_as_picture(std::span<const unsigned char> bytes) {
  using namespace std::string_view_literals;
  const std::string_view all = as_text(bytes);
  if (all.substr(0, 132).find("DICM", 128) != all.npos) return false;
  for (const auto signature : {"\x89PNG\r\n\x1a\n"sv, "\xff\xd8\xff"sv, "II*\0"sv, "MM\0*"sv,
                               "II+\0"sv, "MM\0+"sv, "BM"sv, "P2"sv, "P3"sv, "P5"sv, "P6"sv})
    if (all.starts_with(signature)) return true;
  return false;
}

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

void write_new_folder(const fs::path& named,
                      const std::vector<std::pair<std::string, std::string>>& files,
                      const std::function<void(const fs::path&)>& judge) {
  const fs::path folder = named.has_filename() ? named : named.parent_path();
  const fs::path above = folder.has_parent_path() ? folder.parent_path() : fs::path(".");
  const fs::path partial = above / ("." + folder.filename().string() + ".partial");
  const WriterLock lock(partial.string() + ".lock", "another program writes a new folder here");
  if (fs::exists(folder))
    throw bad_input("the folder exists", {.file = folder.string()},
                    "name a new folder; nothing in this one was changed");
  std::error_code ignored;
  fs::remove_all(partial, ignored);
  try {
    for (const auto& [name, text] : files) write_durable(partial / name, text);
    if (judge) judge(partial);
    if (::rename(partial.c_str(), folder.c_str()) != 0) fail_to_write(folder, errno);
  } catch (const Error& error) {
    fs::remove_all(partial, ignored);
    Where where = error.where();
    if (where.file.starts_with(partial.string()))
      where.file.replace(0, partial.string().size(), folder.string());
    throw Error(error.kind(), error.what_failed(), where, error.what_to_do());
  }
  sync_folder(above, folder);
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
    held_ = Descriptor(::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644));
    if (held_.get() < 0) fail_to_write(file, errno);
    if (::flock(held_.get(), LOCK_EX | LOCK_NB) != 0)
      throw bad_input(held, {.file = file.parent_path().string()},
                      "wait for it to end, or give another place to write to");
    // The previous holder may have removed the file between the two calls.
    struct stat ours {
    }, there{};
    if (::fstat(held_.get(), &ours) == 0 && ::lstat(file.c_str(), &there) == 0 &&
        ours.st_ino == there.st_ino)
      return;
  }
}

WriterLock::~WriterLock() {
  ::unlink(file_.c_str());
}

void Descriptor::reset() {
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
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
  Hash hash;
  hash.add(bytes);
  return hash.text();
}

std::string sha256_of(std::string_view text) {
  return sha256_of(std::span(reinterpret_cast<const unsigned char*>(text.data()), text.size()));
}

std::string sha256_of_file(const fs::path& file) {
  const Readable readable = opened(file, kMostHashed);
  Hash hash;
  std::vector<unsigned char> part;
  for (off_t at = 0; at < readable.size; at += kPart) {
    part.resize(static_cast<std::size_t>(std::min(kPart, readable.size - at)));
    read_part(readable, at, part);
    hash.add(part);
  }
  return hash.text();
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

namespace {

constexpr std::size_t kMostBytesOfCsv = 16 << 20;  ///< a byte may take 50 bytes of memory as cells
constexpr std::size_t kMostColumns = 1000;         ///< limits the memory for a line of commas

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::vector<std::string> cells_of(const std::string& line, const Where& where) {
  std::vector<std::string> cells(1);
  bool quoted = false, was_quoted = false, is_blank = true;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"') {
      cells.back() += line[++i];
      is_blank = false;
    } else if (line[i] == '"' && (quoted || is_blank)) {
      quoted = !quoted;
      was_quoted = true;
    } else if (line[i] == ',' && !quoted) {
      if (!was_quoted) cells.back() = trimmed(cells.back());
      was_quoted = false;
      is_blank = true;
      if (cells.size() == kMostColumns)
        throw bad_input(fmt::format("more than {} cells", kMostColumns), where, "remove some");
      cells.emplace_back();
    } else {
      cells.back() += line[i];
      is_blank = is_blank && std::string_view(" \t\r").find(line[i]) != std::string_view::npos;
    }
  }
  if (quoted) throw bad_input("a quote does not end on its line", where, "close it");
  if (!was_quoted) cells.back() = trimmed(cells.back());
  return cells;
}

double number_of(const std::string& cell, const Where& where) {
  double value = 0;
  const auto [end, failed] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  const bool is_number =
      failed == std::errc() && end == cell.data() + cell.size() && std::isfinite(value);
  if (!is_number || std::abs(value) > largest_number)
    throw bad_input(
        fmt::format("`{}` is {}", cell, is_number ? "too large" : "not a finite number"), where,
        "give a decimal number such as 0.25, without unit");
  return value;
}

}  // namespace

std::size_t CsvText::column(const std::string& name) const {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end())
    throw bad_input(fmt::format("the column `{}` is missing", name), {.file = file.string()},
                    fmt::format("there are: {}", fmt::join(names, ",")));
  return static_cast<std::size_t>(found - names.begin());
}

bool CsvText::has(const std::string& name) const {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::optional<double> CsvText::number(std::size_t row, const std::string& name) const {
  const std::string& cell = rows.at(row)[column(name)];
  if (cell.empty()) return std::nullopt;
  return number_of(cell, {.file = file.string(), .line = lines[row], .field = name});
}

CsvText read_csv_text(const std::filesystem::path& file) {
  CsvText csv{file, 0, {}, {}, {}};
  std::string text = read_text(file);
  if (text.size() > kMostBytesOfCsv)
    throw bad_input("it is larger than 16 MiB", {.file = file.string()}, "name the right file");
  if (text.find('\0') != std::string::npos)
    throw bad_input("it is no text, or text of two bytes a letter (UTF-16)",
                    {.file = file.string()}, "save it as CSV in UTF-8");
  if (text.starts_with("\xef\xbb\xbf")) text.erase(0, 3);  // byte order mark of spreadsheets
  // Lines end with \n, \r\n, or \r as older spreadsheets write them.
  if (text.find('\n') == std::string::npos) std::replace(text.begin(), text.end(), '\r', '\n');
  std::istringstream stream(std::move(text));
  int number = 1;
  for (std::string line; std::getline(stream, line); ++number) {
    line = trimmed(line);
    if (line.empty() || line.front() == '#') continue;
    const Where where{.file = file.string(), .line = number};
    std::vector<std::string> cells = cells_of(line, where);
    if (csv.names.empty()) {
      if (cells.size() == 1 && line.find_first_of(";\t") != std::string::npos)
        throw bad_input("semicolons or tabs part its columns", where,
                        "save it with commas between columns and points in numbers");
      csv.names = std::move(cells);
      csv.head_line = number;
      std::vector<std::string> names = csv.names;
      std::ranges::sort(names);
      for (std::size_t i = 1; i < names.size(); ++i)
        if (!names[i].empty() && names[i] == names[i - 1])
          throw bad_input(fmt::format("two columns are named `{}`", printable(names[i])), where,
                          "keep the right one");
      continue;
    }
    if (cells.size() != csv.names.size())
      throw bad_input(fmt::format("{} cells instead of {}", cells.size(), csv.names.size()), where,
                      "give one number per column: commas part columns, points decimals");
    csv.rows.push_back(std::move(cells));
    csv.lines.push_back(number);
  }
  if (csv.names.empty())
    throw bad_input("the file holds no column headers", {.file = file.string()},
                    "the first line names the columns with their units");
  return csv;
}

Csv read_csv(const std::filesystem::path& file, const std::vector<std::string>& names) {
  const CsvText text = read_csv_text(file);
  if (!names.empty() && text.names != names) {
    throw bad_input(fmt::format("the column headers are `{}`", fmt::join(text.names, ",")),
                    {.file = file.string(), .line = text.head_line},
                    fmt::format("the first line must be `{}`: units are part of the names",
                                fmt::join(names, ",")));
  }
  Csv csv{file, text.names, std::vector<std::vector<double>>(text.names.size()), text.lines};
  for (std::size_t row = 0; row < text.rows.size(); ++row)
    for (std::size_t i = 0; i < csv.names.size(); ++i)
      csv.columns[i].push_back(
          number_of(text.rows[row][i],
                    {.file = file.string(), .line = text.lines[row], .field = csv.names[i]}));
  return csv;
}

std::string csv_cell(const std::string& text) {
  std::string cell = text;
  if (!text.empty() && std::string_view("=+-@\t\r").find(text.front()) != std::string_view::npos) {
    const char* begin = text.data() + (text.front() == '+' ? 1 : 0);
    const char* end = text.data() + text.size();
    double number = 0;
    if (std::from_chars(begin, end, number).ptr != end) cell.insert(cell.begin(), '\'');
  }
  if (cell.find_first_of(",\"\n\r#") == std::string::npos) return cell;
  std::string quoted = "\"";
  for (const char c : cell) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

std::string csv_text(const std::vector<std::string>& names,
                     const std::vector<std::vector<double>>& columns) {
  std::string text = fmt::format("{}\n", fmt::join(names, ","));
  for (std::size_t row = 0; !columns.empty() && row < columns.front().size(); ++row)
    for (std::size_t i = 0; i < columns.size(); ++i)
      text += fmt::format("{}{}", columns[i].at(row), i + 1 < columns.size() ? "," : "\n");
  return text;
}

Json parse_json(std::string_view text, const std::string& file) {
  static_cast<void>(json_value(text, file));  // refuses depth, length and keys given twice
  return Json::parse(text);
}

Json try_json(std::string_view text) {
  return Json::parse(text, nullptr, false);
}

std::string pretty(const Json& json) {
  // File names may not be UTF-8, but JSON must be.
  return pretty(json_value(json.dump(-1, ' ', false, Json::error_handler_t::replace)));
}

void write_json(const std::filesystem::path& file, const Json& json) {
  write_durable(file, pretty(json));
}

}  // namespace drape
