// SPDX-License-Identifier: Apache-2.0
#include "tests/support/small_bench.hpp"

#include <sys/prctl.h>
#include <sys/wait.h>

#include <array>
#include <cerrno>
#include <cstdio>
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

SmallBench::SmallBench(const std::vector<std::string>& scenes) {
  const fs::path source = source_root() / "rigs/bench1";
  fs::create_directory(rig());
  for (const char* name : {"rig.toml", "target.toml", "print.toml"}) fs::copy(source / name, rig());
  for (const char* name : {"scenes", "fabrics"}) {
    fs::copy(source / name, rig() / name, fs::copy_options::recursive);
  }
  fs::create_directory(rig() / "recording");
  for (const fs::directory_entry& entry : fs::directory_iterator(source / "recording")) {
    const fs::path to = rig() / "recording" / entry.path().filename();
    if (entry.is_directory()) fs::create_directory_symlink(entry.path(), to);
    if (entry.is_regular_file()) fs::copy(entry.path(), to);
  }
  replace("rig.toml", "grids = [11, 21, 31]", "grids = [11]");
  replace("rig.toml", "segments = [1, 5]", "segments = [1]");
  std::string list;
  for (const std::string& scene : scenes)
    list += (list.empty() ? "" : ", ") + ("\"scenes/" + scene + ".toml\"");
  replace("rig.toml", R"(["scenes/A.toml", "scenes/C.toml", "scenes/E.toml"])", "[" + list + "]");
}

std::string SmallBench::line(const std::string& out, const std::string& more) const {
  // The store holds the date of a run; equal histories are to be equal bytes.
  return "cd " + folder().string() + " && SOURCE_DATE_EPOCH=0 exec " + program("drape").string() +
         " run rig --single --out " + out + " " + more;
}

Outcome SmallBench::run(const std::string& out, const std::string& more) const {
  return run_line(line(out, more));
}

void SmallBench::replace(const std::string& file, const std::string& from,
                         const std::string& to) const {
  std::string text = read_text(rig() / file);
  const auto at = text.find(from);
  if (at == std::string::npos) throw std::runtime_error(file + " does not hold " + from);
  write_durable(rig() / file, text.replace(at, from.size(), to));
}

}  // namespace drape::test
