// SPDX-License-Identifier: Apache-2.0
// Jobs for the other programs, and their ends.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <exception>

#include "console/bench.hpp"
#include "core/error.hpp"
#include "core/units.hpp"

namespace drape::console {

void Bench::detect(const std::string& set) {
  {
    const std::lock_guard lock(mutex_);
    held_out_.erase(set);
  }
  jobs_.add("detect", set, {detect_call(set)});
}

/// Detects sets that waited when the server before this one ended.
void Bench::detect_what_lacks() {
  std::vector<std::string> sets;
  const auto recorded = recording();  // keeps its sets alive in the loop
  for (const FrameSet& one : recorded->sets)
    if (is_taken(one.name) && !facts(one.name)) sets.push_back(one.name);
  if (sets.empty()) return;
  log_.add("bench", fmt::format("measures the marks of {}", fmt::join(sets, ", ")),
           {{"sentence", "their present pictures were not looked at yet"}});
  try {
    for (const std::string& set : sets) detect(set);
  } catch (const Error& error) {  // the others are measured where a key needs them
    trouble_ = error.what();
  }
}

void Bench::require_not_being_taken(const std::vector<std::string>& sets) const {
  const std::lock_guard lock(mutex_);
  if (std::find(sets.begin(), sets.end(), taking_) != sets.end())
    throw bad_input("the set is being taken", {.set = taking_}, "wait for its pictures");
}

void Bench::ask(const std::string& pressed, const std::string& kind, const std::string& what,
                std::vector<Call> calls) {
  const std::string job = kind + " " + what;
  log_.add(operator_name(), pressed, {{"asked", job}});
  try {
    jobs_.add(kind, what, std::move(calls));
  } catch (const Error& error) {
    log_.add("bench", job, {{"ended", "refused"}, {"sentence", error.what()}});
    throw;
  }
}

void Bench::job_changed(const Job& job) {
  if (job.state == JobState::running && job.now.empty() && job.fraction == 0) {
    try {
      log_.add("bench", "begins", {{"begins", job.kind + " " + job.what}});
    } catch (const std::exception& error) {
      const std::lock_guard lock(mutex_);
      trouble_ = error.what();
    }
  }
  tell_("job", job.json());
}

void Bench::job_ended(const Job& job) {
  try {
    const Json json = job.json();
    log_.add(
        "bench", job.kind + " " + job.what,
        {{"ended", json["state"]}, {"sentence", job.sentence}, {"commands", json["commands"]}});
    if (job.kind == "detect" && job.state != JobState::failed && is_target_set(job.what))
      log_held_out(job.what);
    {
      const std::lock_guard lock(mutex_);
      trouble_.clear();
      if (job.kind == "doctor") {
        const Json report = try_json(job.output);
        doctor_ = report.is_object() ? report.value("checks", Json()) : Json();
      }
    }
    if (job.kind == "detect" && job.state != JobState::cancelled && is_target_set(job.what))
      looked_at(job.what);
    if (job.kind == "detect" && plate_of(job.what) != nullptr) show_object(job.what);
    if (job.kind == "calibrate") calibrated();
  } catch (const std::exception& error) {
    const std::lock_guard lock(mutex_);
    trouble_ = error.what();
  }
  tell_("state", Json::object());
}

/// Logs how well the calibration before it measures a set that it did not use.
void Bench::log_held_out(const std::string& set) {
  const auto by = calibration();
  const auto seen = detections(set);
  if (!by || !seen || std::find(by->sets.begin(), by->sets.end(), set) != by->sets.end()) return;
  const auto measured = measure_target(*by, target_, seen->frames);
  if (!measured) return;
  Json facts = {{"held_out", set},
                {"rms_mm", measured->rms_m / units::mm},
                {"points", measured->points},
                {"calibrated_with", by->sets.size()}};
  log_.add("bench", "held-out error", facts);
  const std::lock_guard lock(mutex_);
  held_out_[set] = std::move(facts);
}

}  // namespace drape::console
