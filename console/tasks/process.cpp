// SPDX-License-Identifier: Apache-2.0
#include "console/tasks/process.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <array>

#include "core/error.hpp"
#include "core/files/json_file.hpp"
#include "core/program/child.hpp"
#include "core/program/shell_word.hpp"

namespace drape::console {
namespace {

constexpr std::size_t kMostOutput = 64U << 20U;
constexpr std::size_t kMostLine = 4096;

std::string text_of(const Json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_string() ? found->get<std::string>() : std::string();
}

/// Sentence from a program's --json ending.
std::string sentence_of(const std::string& output, const ChildEnd& end) {
  const std::size_t begin = output.find('{');
  const Json json = begin == std::string::npos ? Json() : try_json(output.substr(begin));
  if (json.is_object()) {
    const Json problems =
        json.value("problems", Json());  // from `drape check`, with which a run begins
    const Json error =
        problems.is_array() && !problems.empty() ? problems[0] : json.value("error", Json());
    if (error.is_object()) {
      std::string text = text_of(error, "what_failed");
      if (const std::string where = text_of(error, "where"); !where.empty())
        text += " (" + where + ")";
      if (const std::string act = text_of(error, "what_to_do"); !act.empty())
        text += "; to do: " + act;
      return text;
    }
    for (const char* key : {"sentence", "cause"})
      if (std::string text = text_of(json, key); !text.empty()) return text;
  }
  if (end.signal != 0) return fmt::format("ended by signal {}", end.signal);
  return end.exit_code == 0 ? "done" : fmt::format("ended with code {}", end.exit_code);
}

}  // namespace

std::string Call::shown() const {
  std::string text = "drape";
  for (const std::string& word : words) text += " " + shell_word(word);
  return text;
}

CallEnd run_call(const Call& call, const ChildProgress& progress, std::atomic<pid_t>& child) {
  if (call.before) call.before();
  std::vector<std::string> words = call.words;
  words.emplace_back("--json");
  Pipe output, steps;
  const pid_t pid =
      start_child(program_beside("drape"), words,
                  {.out = output.writing(), .progress = steps.writing(), .background = true});
  child = pid;
  output.close_writing();
  steps.close_writing();
  CallEnd end;
  std::string lines;
  while (output.reading() >= 0 || steps.reading() >= 0) {
    std::array<pollfd, 2> watched = {{{output.reading(), POLLIN, 0}, {steps.reading(), POLLIN, 0}}};
    if (::poll(watched.data(), watched.size(), -1) < 0) continue;
    if (watched[0].revents != 0) output.take(end.output, kMostOutput);
    if (watched[1].revents != 0) steps.take(lines, kMostLine);
    pass_progress(lines, progress);
  }
  child = 0;
  const ChildEnd ended = await_child(pid);
  end.exit_code = ended.exit_code;
  end.sentence = sentence_of(end.output, ended);
  return end;
}

}  // namespace drape::console
