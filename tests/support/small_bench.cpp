// SPDX-License-Identifier: Apache-2.0
#include "tests/support/small_bench.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <set>
#include <stdexcept>

#include "core/files/files.hpp"

namespace drape::test {

namespace fs = std::filesystem;

Outcome run_line(const std::string& line) {
  Outcome outcome;
  FILE* stream = ::popen(("exec 2>&1; " + line).c_str(), "r");
  if (stream == nullptr) throw std::runtime_error("popen failed");
  std::array<char, 4096> buffer;
  for (std::size_t got = 0; (got = ::fread(buffer.data(), 1, buffer.size(), stream)) > 0;) {
    outcome.text.append(buffer.data(), got);
  }
  const int status = ::pclose(stream);
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return outcome;
}

void adopt_descendants() {
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
}

void await_descendants() {
  while (::waitpid(-1, nullptr, 0) > 0 || errno == EINTR) {
  }
}

namespace {

constexpr const char* kScenes[] = {"A", "C", "E"};

void replace_in(const fs::path& file, const std::string& from, const std::string& to) {
  std::string text = read_text(file);
  const auto at = text.find(from);
  if (at == std::string::npos) throw std::runtime_error(file.string() + " does not hold " + from);
  write_durable(file, text.replace(at, from.size(), to));
}

void make_rig(const fs::path& rig, const std::vector<std::string>& scenes) {
  const fs::path source = source_root() / "rigs/bench1";
  fs::create_directory(rig);
  for (const char* name : {"rig.toml", "target.toml", "print.toml"}) fs::copy(source / name, rig);
  for (const char* name : {"scenes", "fabrics"})
    fs::copy(source / name, rig / name, fs::copy_options::recursive);
  fs::create_directory(rig / "recording");
  for (const fs::directory_entry& entry : fs::directory_iterator(source / "recording")) {
    const fs::path to = rig / "recording" / entry.path().filename();
    if (entry.is_directory()) fs::create_directory_symlink(entry.path(), to);
    if (entry.is_regular_file()) fs::copy(entry.path(), to);
  }
  replace_in(rig / "rig.toml", "spacing_mm = 2.5", "spacing_mm = 10");
  replace_in(rig / "rig.toml", "segments = [1, 5]", "segments = [1]");
  std::string list;
  for (const std::string& scene : scenes)
    list += (list.empty() ? "" : ", ") + ("\"scenes/" + scene + ".toml\"");
  replace_in(rig / "rig.toml", R"(["scenes/A.toml", "scenes/C.toml", "scenes/E.toml"])",
             "[" + list + "]");
}

std::string line_of(const fs::path& folder, const std::string& out, const std::string& more) {
  // The date of a run is in the store; with a fixed one equal histories give equal bytes.
  return "cd " + folder.string() + " && SOURCE_DATE_EPOCH=0 exec " + program("drape").string() +
         " run rig --single --out " + out + " " + more;
}

/// Waits for the test program that is currently making the bench.
class OneAtATime {
 public:
  explicit OneAtATime(const fs::path& file)
      : descriptor_(::open(file.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0644)) {
    if (descriptor_ < 0 || ::flock(descriptor_, LOCK_EX) != 0)
      throw std::runtime_error("cannot lock " + file.string());
  }
  ~OneAtATime() { ::close(descriptor_); }
  OneAtATime(const OneAtATime&) = delete;
  OneAtATime& operator=(const OneAtATime&) = delete;

 private:
  int descriptor_;
};

}  // namespace

const FinishedBench& finished_bench() {
  static const FinishedBench bench = [] {
    const fs::path folder = program("drape").parent_path().parent_path() / "tests/finished_bench";
    const OneAtATime lock(folder.string() + ".lock");
    const auto run = [&] { return run_line(line_of(folder, "out", "")); };
    if (fs::exists(folder)) {  // Every step is valid, or from other programs.
      const Outcome again = run();
      if (again.exit_code <= 1 && again.text.find(" 0 made,") != std::string::npos)
        return FinishedBench{folder, again};
      fs::remove_all(folder);
    }
    fs::create_directories(folder);
    make_rig(folder / "rig", {std::begin(kScenes), std::end(kScenes)});
    FinishedBench made{folder, run()};
    if (made.outcome.exit_code > 1 || made.outcome.exit_code < 0)
      throw std::runtime_error(made.outcome.text);
    return made;
  }();
  return bench;
}

void copy_finished_bench(const fs::path& to) {
  const fs::path& folder = finished_bench().folder;
  const OneAtATime lock(folder.string() + ".lock");
  fs::copy(folder / "out", to, fs::copy_options::recursive);
}

SmallBench::SmallBench(const std::vector<std::string>& scenes) {
  make_rig(rig(), scenes);
}

SmallBench::SmallBench(const std::vector<std::string>& scenes, Measured) : SmallBench(scenes) {
  const std::set<std::string> wanted(scenes.begin(), scenes.end());
  fs::create_directory(folder() / "out");
  for (const fs::directory_entry& entry : fs::directory_iterator(finished_bench().folder / "out")) {
    const std::string name = entry.path().filename().string();
    const bool other = entry.is_directory() && name.size() == 1 && !wanted.contains(name);
    if (other || name.starts_with("results.sqlite") || name.starts_with("report")) continue;
    fs::copy(entry.path(), folder() / "out" / name,
             fs::copy_options::recursive | fs::copy_options::copy_symlinks);
  }
}

std::string SmallBench::line(const std::string& out, const std::string& more) const {
  return line_of(folder(), out, more);
}

Outcome SmallBench::run(const std::string& out, const std::string& more) const {
  return run_line(line(out, more));
}

void SmallBench::replace(const std::string& file, const std::string& from,
                         const std::string& to) const {
  replace_in(rig() / file, from, to);
}

}  // namespace drape::test
