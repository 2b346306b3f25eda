// SPDX-License-Identifier: Apache-2.0
#include "tests/faults/hostile_bench.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <stdexcept>

#include "core/files/files.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;

/// One finished run for all tests.
const fs::path& finished_run() {
  static const SmallBench bench({"C"}, measured);
  static const fs::path folder = [] {
    const Outcome outcome = bench.run("out");
    if (outcome.exit_code != 0) throw std::runtime_error(outcome.text);
    return bench.folder();
  }();
  return folder;
}

std::map<std::string, std::string> content_of(const fs::path& folder) {
  std::map<std::string, std::string> content;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    content[entry.path().string()] = entry.is_regular_file() ? read_text(entry.path()) : "";
  return content;
}

constexpr std::uintmax_t kMostOwn = 100 << 20;  ///< bytes; larger files were made by the test

bool is_page(const fs::path& file) {
  return file.extension() == ".html" || file.extension() == ".svg";
}

}  // namespace

HostileBench::HostileBench() {
  fs::create_directory(lab());
  for (const char* name : {"rig", "out"})
    fs::copy(finished_run() / name, lab() / name,
             fs::copy_options::recursive | fs::copy_options::copy_symlinks);
  fs::create_directory(outside());
  write_durable(outside() / "secret.txt", kSecret + "\n");
  before_ = content_of(outside());
}

void HostileBench::write(const std::string& file, const std::string& text) const {
  write_durable(lab() / file, text);
}

void HostileBench::replace(const std::string& file, const std::string& from,
                           const std::string& to) const {
  std::string text = read_text(lab() / file);
  const auto at = text.find(from);
  if (at == std::string::npos) throw std::runtime_error(file + " lacks " + from);
  write(file, text.replace(at, from.size(), to));
}

void HostileBench::edit(const std::string& file, const std::function<void(Json&)>& change) const {
  Json json = parse_json(read_text(lab() / file));
  change(json);
  write(file, json.dump(1));
}

void HostileBench::forge_records() const {
  const fs::path own = fs::canonical(lab());
  // An attacker cannot hash what is outside.
  const auto forge = [&own](Json& files, const fs::path& folder) {
    for (Json& file : files) {
      const fs::path path = fs::weakly_canonical(folder / file.value("file", ""));
      if (fs::is_regular_file(path) && path.string().starts_with(own.string() + "/"))
        file["sha256"] = sha256_of_file(path);
    }
  };
  for (const auto& entry : fs::recursive_directory_iterator(finished_run() / "out")) {
    const fs::path record = lab() / entry.path().lexically_relative(finished_run());
    if (!record.string().ends_with(".run.json") || !fs::is_regular_file(record)) continue;
    try {
      Json json = parse_json(read_text(record));
      const std::string before = json.dump();
      for (const char* list : {"inputs", "outputs"}) forge(json.at(list), record.parent_path());
      if (json.dump() != before) write_durable(record, json.dump(1));
    } catch (const std::exception&) {
      continue;  // A record that is itself damaged remains as the test made it.
    }
  }
}

HostileBench::Met HostileBench::run(const std::string& arguments) const {
  const std::string line =
      fmt::format("exec 2>&1; cd '{}' && ulimit -t 10 && SOURCE_DATE_EPOCH=0 exec '{}' {}",
                  lab().string(), program("drape").string(), arguments);
  int ends[2];
  if (::pipe(ends) != 0) throw std::runtime_error("pipe");
  const pid_t pid = ::fork();
  if (pid == 0) {
    ::dup2(ends[1], STDOUT_FILENO);
    ::close(ends[0]);
    ::close(ends[1]);
    ::execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
    ::_exit(127);
  }
  ::close(ends[1]);
  Met met;
  std::array<char, 4096> buffer;
  for (ssize_t got = 0; (got = ::read(ends[0], buffer.data(), buffer.size())) > 0;)
    met.text.append(buffer.data(), static_cast<std::size_t>(got));
  ::close(ends[0]);
  int status = 0;
  rusage used{};
  ::wait4(pid, &status, 0, &used);
  met.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  met.memory_kB = used.ru_maxrss;
  return met;
}

std::string HostileBench::harm(const Outcome& outcome) const {
  if (content_of(outside()) != before_) return "something outside was changed";
  for (const auto& entry : fs::directory_iterator(folder_.path()))
    if (entry.path() != lab() && entry.path() != outside())
      return entry.path().string() + " was made";
  // The secret in plain text, and in base64 that starts with it.
  const std::string leaks[] = {kSecret, "U0VDUkVULTcyNjEtT0Y"};
  for (const std::string& leak : leaks)
    if (outcome.text.find(leak) != std::string::npos) return "the secret was printed";
  if (outcome.text.find('\x1b') != std::string::npos) return "an escape sequence was printed";
  for (const auto& entry : fs::recursive_directory_iterator(lab())) {
    if (!entry.is_regular_file() || entry.is_symlink()) continue;
    if (entry.file_size() > kMostOwn) continue;
    const std::string text = read_text(entry.path());
    for (const std::string& leak : leaks)
      if (text.find(leak) != std::string::npos) return "the secret is in " + entry.path().string();
    if (is_page(entry.path()) && text.find("<ran") != std::string::npos)
      return "a name is not escaped in " + entry.path().string();
    if (entry.path().extension() == ".csv" &&
        entry.path().string().find("/out/") != std::string::npos &&
        (text.find(",=HYPER") != std::string::npos || text.find("\n=HYPER") != std::string::npos))
      return "a formula stands in " + entry.path().string();
  }
  return {};
}

}  // namespace drape::test
