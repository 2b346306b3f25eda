// SPDX-License-Identifier: Apache-2.0
// Actions of the console, each with its options and preconditions.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <signal.h>

#include <algorithm>

#include "console/console.hpp"
#include "core/program/words.hpp"

namespace drape::console {

// ---- jobs --------------------------------------------------------------------------------------

namespace {

/// Verdict of a program, or why it failed and what to do, from its --json ending.
std::string sentence_of(const StepResult& end) {
  if (const auto error = error_printed(end.output, end.exit_code)) {
    std::string text = error->what_failed();
    if (const std::string where = error->where().describe(); !where.empty())
      text += " (" + where + ")";
    return error->what_to_do().empty() ? text : text + "; to do: " + error->what_to_do();
  }
  const Json json = try_json(end.output.substr(std::min(end.output.find('{'), end.output.size())));
  if (json.is_object())
    for (const char* key : {"sentence", "cause"})
      if (const auto found = json.find(key); found != json.end() && found->is_string())
        if (std::string text = *found; !text.empty()) return text;
  if (!end.fault.empty()) return end.fault;
  return end.exit_code == 0 ? "done" : fmt::format("ended with code {}", end.exit_code);
}

constexpr std::size_t kMostWaiting = 40;
constexpr std::size_t kMostEnded = 20;
constexpr const char* kStates[] = {"waiting", "running", "done", "NO-GO", "failed", "cancelled"};

bool is_over(const Job& job) {
  return job.state != JobState::waiting && job.state != JobState::running;
}

/// Also true if that cannot be determined.
bool is_needed(const Call& call) {
  try {
    return !call.needed || call.needed();
  } catch (const std::exception&) {
    return true;
  }
}

}  // namespace

std::string Call::shown() const {
  std::string text = "drape";
  for (const std::string& word : words) text += " " + shell_word(word);
  return text;
}

StepResult run_call(const Call& call, const ChildProgress& progress,
                    const std::function<int()>& asked_to_end) {
  if (call.before) call.before();
  Step step{.stage = "drape",
            .what = call.words.front(),
            .program = program_beside("drape"),
            .arguments = call.words,
            .background = true,
            .niceness = call.niceness};
  step.arguments.emplace_back("--json");
  StepResult end;
  run_steps(
      {step}, 1,
      [&](std::size_t, double fraction, const std::string& now) {
        if (!now.empty()) progress(fraction, now);
      },
      [&](std::size_t, const StepResult& result) { end = result; }, asked_to_end);
  return end;
}

Json Job::json() const {
  Json json = {{"id", id},
               {"kind", kind},
               {"what", what},
               {"state", kStates[static_cast<int>(state)]},
               {"fraction", fraction},
               {"now", now},
               {"sentence", sentence}};
  json["commands"] = Json::array();
  for (const Call& call : calls) json["commands"].push_back(call.shown());
  return json;
}

Jobs::Jobs(std::function<void(const Job&)> changed, std::function<void(const Job&)> ended)
    : changed_(std::move(changed)), ended_(std::move(ended)), thread_([this] { work(); }) {}

Jobs::~Jobs() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  cancelled_ = true;
  wake_.notify_all();
  thread_.join();
}

int Jobs::add(std::string kind, std::string what, std::vector<Call> calls) {
  Job job;
  {
    const std::lock_guard lock(mutex_);
    const auto waiting =
        std::count_if(jobs_.begin(), jobs_.end(), [](const Job& one) { return !is_over(one); });
    if (static_cast<std::size_t>(waiting) >= kMostWaiting)
      throw bad_input("too much waits already", {}, "let it end, or cancel it");
    job.id = next_id_++;
    job.kind = std::move(kind);
    job.what = std::move(what);
    job.calls = std::move(calls);
    jobs_.push_back(job);
    while (jobs_.size() > kMostEnded && is_over(jobs_.front())) jobs_.pop_front();
  }
  changed_(job);
  wake_.notify_all();
  return job.id;
}

bool Jobs::cancel(int id) {
  JobState before = JobState::done;
  const Job job = change(id, [&](Job& one) {
    before = one.state;
    if (before == JobState::running) cancelled_ = true;
    if (before != JobState::waiting) return;
    one.state = JobState::cancelled;
    one.sentence = "taken back before it began";
  });
  if (before == JobState::waiting) ended_(job);
  return before == JobState::waiting || before == JobState::running;
}

std::vector<Job> Jobs::list() const {
  const std::lock_guard lock(mutex_);
  return {jobs_.begin(), jobs_.end()};
}

bool Jobs::idle() const {
  const std::lock_guard lock(mutex_);
  return std::all_of(jobs_.begin(), jobs_.end(), is_over);
}

/// Returns the job as changed; one without id if there is none.
Job Jobs::change(int id, const std::function<void(Job&)>& how) {
  Job job;
  {
    const std::lock_guard lock(mutex_);
    const auto found = std::ranges::find(jobs_, id, &Job::id);
    if (found == jobs_.end()) return job;
    how(*found);
    job = *found;
  }
  changed_(job);
  return job;
}

void Jobs::work() {
  for (;;) {
    Job job;
    {
      std::unique_lock lock(mutex_);
      const auto next = [this] { return std::ranges::find(jobs_, JobState::waiting, &Job::state); };
      wake_.wait(lock, [&] { return ending_ || next() != jobs_.end(); });
      if (ending_) return;
      cancelled_ = false;
      job = *next();
      next()->state = JobState::running;
    }
    run(std::move(job));
  }
}

void Jobs::run(Job job) {
  std::erase_if(job.calls, [](const Call& call) { return !is_needed(call); });
  change(job.id, [&](Job& one) { one.calls = job.calls; });
  JobState state = JobState::done;
  std::string sentence, output;
  for (std::size_t k = 0; k < job.calls.size() && !cancelled_ && state != JobState::failed; ++k) {
    try {
      const StepResult end = run_call(
          job.calls[k],
          [&](double fraction, const std::string& now) {
            change(job.id, [&](Job& one) {
              one.fraction =
                  (static_cast<double>(k) + fraction) / static_cast<double>(job.calls.size());
              one.now = now;
            });
          },
          [this] { return cancelled_ ? SIGTERM : 0; });
      sentence = sentence_of(end);
      output = end.output;
      if (end.exit_code == 1) state = JobState::no_go;
      if (end.exit_code > 1) state = JobState::failed;
    } catch (const std::exception& error) {  // exceptions beyond this thread end the console
      sentence = error.what();
      state = JobState::failed;
    }
  }
  if (cancelled_) {
    state = JobState::cancelled;
    sentence = "cancelled; what was finished is kept";
  }
  ended_(change(job.id, [&](Job& one) {
    one.state = state;
    one.sentence = sentence;
    one.output = output;
    one.now.clear();
    if (state == JobState::done || state == JobState::no_go) one.fraction = 1;
  }));
}

namespace {

using units::mm;

constexpr std::size_t kLongestNote = 2000, kLongestName = 80, kMostLayings = 100;
constexpr std::size_t kLeastSets = 3;  ///< least sets for a joint calibration of the cameras
constexpr int kLeastViews = 2;  ///< least number of cameras that see an automatically taken pose

/// Options of all actions; the table says which of them an action has.
struct Asked {
  std::string set, drape, camera, text;
  std::optional<std::string> face;
  std::optional<double> exposure_us, gain_db;
  bool on = false;
  int job = 0;
};

// ---- calls of the other programs -------------------------------------------------------------

Call detect_call(const Bench& bench, const std::string& set) {
  const auto files = bench.session.bench();
  const ObjectTags* plate = files->plate_of(set);
  Call call{
      words_of("detect", bench.session.recording_folder, "--rig", bench.files.look_rig_file(),
               "--surface", plate != nullptr || files->is_target_set(set) ? "target" : "cloth",
               "--sets", set, "--out", bench.files.look_file(set), "--threads", 1),
      [&bench] {
        write_where_new(bench.files.look_rig_file(),
                        detect_rig_text(*bench.session.bench(), bench.session.own));
      }};
  if (plate != nullptr) call.words.insert(call.words.end(), {"--target", plate->target.string()});
  return call;
}

/// Calls for the plates that were taken, in order: they locate the objects before a run.
std::vector<Call> object_calls(const Bench& bench, const Drape& drape) {
  const Files& files = bench.files;
  std::vector<Call> calls;
  for (const ObjectTags& plate : drape.scene.tags) {
    if (!files.is_taken(plate.set)) continue;
    Call call{object_arguments(files.look(), drape.scene, plate, calls.size(),
                               files.look_file(plate.set), bench.session.run.calibration())};
    call.words.insert(call.words.begin(), "object");
    calls.push_back(std::move(call));
  }
  return calls;
}

/// Writes the rig with only the sets that were taken, so that a bench is measured from these.
void write_rig(const Bench& bench) {
  const Session& session = bench.session;
  const Files& files = bench.files;
  const auto all = session.bench();
  Rig rig = all->rig;
  rig.recording = session.recording_folder;
  std::erase_if(rig.free_poses, [&](const std::string& set) { return !files.is_taken(set); });
  std::erase_if(rig.stages, [&](const TargetStage& stage) { return !files.is_taken(stage.set); });
  rig.scenes.clear();
  rig.repeats.clear();
  for (const Drape& drape : all->drapes)
    if (files.is_taken(drape.scene.set)) rig.scenes.push_back(drape.scene.file);
  for (const Laying& one : session.layings())
    if (one.named && files.is_taken(one.set) && files.is_taken(all->drape(one.drape).scene.set))
      rig.repeats.push_back({one.drape, one.set, one.repeat, one.face});
  const std::string text =
      fmt::format("# Made by `drape bench`: {} with the sets that were taken.\n",
                  session.rig_file.filename().string()) +
      text_in(session.own, std::move(rig));
  write_where_new(files.look().rig(), text);
  // `drape run` looks for it beside the rig.
  const fs::path accepted = session.rig_file.parent_path() / "acceptance.json";
  const fs::path copy = session.own / "acceptance.json";
  if (fs::is_regular_file(accepted))
    write_durable(copy, read_text(accepted));
  else
    fs::remove(copy);
}

Call run_call_of(Bench& bench, const std::vector<std::string>& more) {
  Call call{words_of("run", bench.files.look().rig(), "--recording", bench.session.recording_folder,
                     "--out", bench.session.out),
            [&bench] { write_rig(bench); }};
  call.words.insert(call.words.end(), more.begin(), more.end());
  return call;
}

// ---- preconditions ---------------------------------------------------------------------------

void require_not_being_taken(const Bench& bench, const std::vector<std::string>& sets) {
  const std::string taking = bench.cameras.taking();
  if (!taking.empty() && std::find(sets.begin(), sets.end(), taking) != sets.end())
    throw bad_input("the set is being taken", {.set = taking}, "wait for its pictures");
}

bool can_calibrate(const Bench& bench) {
  const std::vector<std::string> sets = bench.files.taken_target_sets();
  const auto files = bench.session.bench();
  const std::vector<TargetStage>& stages = files->rig.stages;
  return sets.size() >= kLeastSets &&
         std::ranges::find(stages, sets.front(), &TargetStage::set) != stages.end();
}

/// Requires that the drape's set and plates were taken, and that none of them is being taken.
void require_drape(const Bench& bench, const Drape& drape) {
  const Files& files = bench.files;
  if (!files.is_taken(drape.scene.set))
    throw bad_input("the drape's set was not taken", {.set = drape.scene.set}, "take it");
  for (const ObjectTags& plate : drape.scene.tags)
    if (!files.is_taken(plate.set))
      throw bad_input(
          fmt::format(
              "the plate of tags is {}, but the scene asks for it",
              bench.session.word_on(plate.set) == std::optional(false) ? "left out" : "not taken"),
          {.file = drape.scene.file.string(), .field = "tags_set", .set = plate.set},
          "take it, or take its tags_ lines out of the scene");
  require_not_being_taken(bench, bench.session.sets_of(drape));
}

void require_short_text(const std::string& text) {
  const bool plain =
      std::none_of(text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; });
  if (text.size() > kLongestName || !plain)
    throw bad_input("a name has at most 80 bytes and no control characters", {},
                    "write it shorter");
}

// ---- the actions -----------------------------------------------------------------------------

/// Logs the action, so that it is still named if the server ends before it is done.
void ask(Bench& bench, const std::string& kind, const std::string& what, std::vector<Call> calls) {
  const std::string job = kind + " " + what;
  bench.session.add(bench.session.who(), "pressed " + job, {{"asked", job}});
  try {
    bench.jobs.add(kind, what, std::move(calls));
  } catch (const Error& error) {
    bench.session.add("bench", job, {{"ended", "refused"}, {"sentence", error.what()}});
    throw;
  }
}

/// Records which side of the cloth faces up.
void name_face(Bench& bench, const std::string& set, const std::string& face) {
  for (const Laying& one : bench.session.layings())
    if (one.set == set && one.face == face) return;
  require_short_text(face);
  bench.session.add(bench.session.who(), fmt::format("{}: `{}` lies up", set, face),
                    {{"face_of", set}, {"face", face}});
}

void take(Bench& bench, const Asked& asked) {
  Session& session = bench.session;
  const std::string& set = asked.set;
  session.require_set(set);
  if (asked.face && session.bench()->plate_of(set) == nullptr && !session.drape_of(set).empty())
    name_face(bench, set, *asked.face);
  if (!session.options.replay) return bench.cameras.take(set);
  static_cast<void>(bench.files.recording()->set(set));
  session.add(session.who(),
              fmt::format("{} {}", bench.files.is_taken(set) ? "took again" : "took", set),
              {{"taken", set}});
  take_in(bench, set);
}

void undo(Bench& bench, const Asked& asked) {
  bench.session.require_set(asked.set);
  if (bench.files.earlier_takes(asked.set).empty())
    throw bad_input("the set was taken once only", {.set = asked.set}, "retake it");
  bench.cameras.take_by(asked.set, "u " + asked.set);
}

void drop(Bench& bench, const Asked& asked) {
  bench.session.require_set(asked.set);
  if (!bench.files.is_taken(asked.set))
    throw bad_input("the set was not taken", {.set = asked.set}, "take it first");
  bench.session.add(bench.session.who(), "left out " + asked.set, {{"dropped", asked.set}});
}

void lay(Bench& bench, const Asked& asked) {
  const auto files = bench.session.bench();
  const Drape& drape = files->drape(asked.drape);
  const std::vector<Laying> known = bench.session.layings(asked.drape);
  if (!bench.files.is_taken(drape.scene.set))
    throw bad_input("the first laying was not taken", {.set = drape.scene.set}, "take it first");
  if (known.size() >= kMostLayings) throw bad_input("these are enough layings", {}, "run them");
  std::size_t k = known.size() + 1;
  const auto name = [&] { return fmt::format("{}_{}", drape.scene.set, k); };
  while (files->is_target_set(name()) || !bench.session.drape_of(name()).empty()) ++k;
  bench.session.add(bench.session.who(), fmt::format("lays {} once more", asked.drape),
                    {{"laying", name()},
                     {"drape", asked.drape},
                     {"repeat", std::to_string(k)},
                     {"face", known.back().face}});
}

void light(Bench& bench, const Asked& asked) {
  if (asked.exposure_us.has_value() == asked.gain_db.has_value())
    throw bad_input("the request lacks a value", {.field = "exposure_us"}, "write a number");
  const bool gain = asked.gain_db.has_value();
  bench.cameras.light(asked.camera, gain ? "gain_db" : "exposure_us",
                      gain ? *asked.gain_db : *asked.exposure_us);
}

void calibrate(Bench& bench, const Asked&) {
  if (!can_calibrate(bench))
    throw bad_input(
        "a calibration needs a stage of the target, which is the world, and two more sets", {},
        "take them first");
  const std::vector<std::string> sets = bench.files.taken_target_sets();
  require_not_being_taken(bench, sets);
  std::vector<Call> calls;
  for (const std::string& set : sets) {
    calls.push_back(detect_call(bench, set));
    calls.back().needed = [&bench, set] { return bench.files.facts(set) == nullptr; };
  }
  calls.push_back(run_call_of(bench, {"--until", "calib"}));
  ask(bench, "calibrate", fmt::format("with {} sets", sets.size()), std::move(calls));
}

void measure(Bench& bench, const Asked& asked) {
  require_drape(bench, bench.session.bench()->drape(asked.drape));
  if (const auto why = bench.files.why_superseded(bench.session.run.calibration()))
    throw bad_input("the cameras are not calibrated: " + *why, {}, "calibrate first");
  Call call = run_call_of(bench, {"--until", "triangulate", "--drape", asked.drape});
  ask(bench, "measure", asked.drape, {std::move(call)});
}

void run(Bench& bench, const Asked& asked) {
  const auto files = bench.session.bench();
  bool any = false;
  for (const Drape& drape : files->drapes) {
    if (asked.drape.empty() ? !bench.files.is_taken(drape.scene.set)
                            : asked.drape != drape.scene.name)
      continue;
    require_drape(bench, drape);
    any = true;
  }
  if (!asked.drape.empty()) static_cast<void>(files->drape(asked.drape));
  if (!any) throw bad_input("no drape was taken", {}, "take one first");
  if (bench.files.taken_target_sets().size() < kLeastSets)
    throw bad_input("the cameras are not calibrated", {}, "calibrate first");
  require_not_being_taken(bench, bench.files.taken_target_sets());
  std::vector<std::string> more;
  if (!asked.drape.empty()) more = {"--drape", asked.drape};
  if (const std::string who = bench.session.who(); who != "operator")
    more.push_back("--operator=" + who);
  ask(bench, "simulate", asked.drape.empty() ? "all drapes that were taken" : asked.drape,
      {run_call_of(bench, more)});
}

/// Next free pose to take; stages have their own keys, since only the operator knows the height.
std::string next_free_pose(const Bench& bench) {
  const auto files = bench.session.bench();
  for (const std::string& set : files->rig.free_poses)
    if (!bench.files.is_taken(set)) return set;
  return {};
}

void automatic(Bench& bench, const Asked& asked) {
  if (asked.on && next_free_pose(bench).empty())
    throw bad_input("the rig has no free pose that was not taken", {},
                    "add names to free_poses in rig.toml");
  bench.session.add(bench.session.who(),
                    asked.on ? "lets poses be taken by themselves" : "takes poses by key");
  bench.cameras.automatic(asked.on);
}

/// Runs the doctor, which opens the cameras itself.
void doctor(Bench& bench, const Asked&) {
  if (bench.cameras.runs())
    throw bad_input("the cameras are open", {}, "close them, then ask the doctor");
  Call call{words_of("doctor", bench.session.rig_file, "--out", bench.session.out)};
  if (bench.files.calibration())
    call.words.insert(call.words.end(),
                      {"--calibration", bench.session.run.calibration().string()});
  ask(bench, "doctor", "the cameras", {std::move(call)});
}

void open(Bench& bench, const Asked&) {
  for (const Job& job : bench.jobs.list())
    if (job.kind == "doctor" && job.state == JobState::running)
      throw bad_input("the doctor looks at the cameras", {}, "wait for it");
  bench.cameras.open();
}

void note(Bench& bench, const Asked& asked) {
  if (asked.text.empty() || asked.text.size() > kLongestNote)
    throw bad_input("a note has 1 to 2000 bytes", {}, "write it shorter");
  bench.session.add(bench.session.who(), "note", {{"note", asked.text}});
}

void name_operator(Bench& bench, const Asked& asked) {
  require_short_text(asked.text);
  bench.session.add(asked.text.empty() ? "operator" : asked.text, "is at the bench",
                    {{"operator", asked.text}});
}

void cancel(Bench& bench, const Asked& asked) {
  if (!bench.jobs.cancel(asked.job))
    throw bad_input("nothing that runs has this number", {}, "it may have ended already");
  bench.session.add(bench.session.who(), fmt::format("pressed cancel of {}", asked.job));
}

// ---- table of actions ------------------------------------------------------------------------

struct Action {
  void (*perform)(Bench&, const Asked&);
  std::set<std::string_view> options;
  const char* no_recording = nullptr;  ///< why a recording does not allow it; null if it does
  const char* instead = "reload the page";
};

constexpr const char* kNoCameras = "a recording has no cameras";

/// Reads the options that the action has.
Asked read_asked(const Document& request, const Action& action) {
  Asked a;
  throw_if_any(faults_of_reading(request, [&](Fields& f) {
    std::string name;
    f({"do", "action"}, name);
    const auto has = [&](std::string_view option) { return action.options.contains(option); };
    if (has("set")) f({"set", "set of the rig"}, a.set);
    if (has("face")) f({"face", "side of the cloth that lies up"}, a.face);
    if (has("drape"))
      f.otherwise({"drape", "drape of the rig; none: all that were taken"}, a.drape);
    if (has("camera")) f({"camera", "camera of the rig"}, a.camera);
    if (has("exposure_us")) f({"exposure_us", "exposure", 1, 0, 1e9}, a.exposure_us);
    if (has("gain_db")) f({"gain_db", "gain", 1, 0, 1e9}, a.gain_db);
    if (has("on")) f({"on", "begin or end"}, a.on);
    if (has("job")) f({"job", "number of the job"}, a.job);
    if (has("text")) f({"text", "words for the log"}, a.text);
  }));
  return a;
}

}  // namespace

void perform(Bench& bench, const std::string& text) {
  static const std::map<std::string, Action> actions = {
      {"take", {take, {"set", "face"}}},
      {"undo", {undo, {"set"}, kNoCameras}},
      {"drop", {drop, {"set"}}},
      {"lay",
       {lay,
        {"drape"},
        "a recording holds no further laying",
        "name a set of it as [[repeat]] in rig.toml"}},
      {"light",
       {light,
        {"camera", "exposure_us", "gain_db"},
        "a recording is exposed already: exposure and gain can only be read",
        "open the rig without --replay"}},
      {"calibrate", {calibrate, {}}},
      {"measure", {measure, {"drape"}}},
      {"run", {run, {"drape"}}},
      {"automatic", {automatic, {"on"}, kNoCameras}},
      {"open", {open, {}, kNoCameras}},
      {"close", {[](Bench& of, const Asked&) { of.cameras.close(); }, {}, kNoCameras}},
      {"doctor", {doctor, {}, kNoCameras}},
      {"cancel", {cancel, {"job"}}},
      {"note", {note, {"text"}}},
      {"operator", {name_operator, {"text"}}},
  };
  const Document request(Syntax::json, json_value(text));
  const auto* word = request.root().find_as<std::string>("do");
  const auto found = word == nullptr ? actions.end() : actions.find(*word);
  if (found == actions.end())
    throw bad_input("the server knows no such action", {.field = word == nullptr ? "do" : *word},
                    "reload the page");
  const Action& action = found->second;
  if (action.no_recording != nullptr && bench.session.options.replay)
    throw bad_input(action.no_recording, {}, action.instead);
  action.perform(bench, read_asked(request, action));
  bench.session.tell("state", Json::object());
}

// ---- consequences of a job -------------------------------------------------------------------

void take_in(Bench& bench, const std::string& set) {
  bench.session.tell("shot", {{"set", set}});
  bench.jobs.add("detect", set, {detect_call(bench, set)});
}

/// Detects sets that were waiting when the previous server ended.
static void detect_what_lacks(Bench& bench) {
  std::vector<std::string> sets;
  const auto recorded = bench.files.recording();  // keeps its sets alive during the loop
  for (const FrameSet& one : recorded->sets)
    if (bench.session.word_on(one.name) == std::optional(true) && !bench.files.facts(one.name))
      sets.push_back(one.name);
  if (sets.empty()) return;
  bench.session.add("bench", fmt::format("measures the marks of {}", fmt::join(sets, ", ")),
                    {{"sentence", "their present pictures were not looked at yet"}});
  try {
    for (const std::string& set : sets) bench.jobs.add("detect", set, {detect_call(bench, set)});
  } catch (const Error& error) {  // the others are measured when an action needs them
    bench.session.trouble(error.what());
  }
}

void end_automatic(Bench& bench, const std::string& words, bool good) {
  if (!bench.cameras.automatic()) return;
  bench.cameras.automatic(false);
  bench.session.add("bench", words);
  bench.session.tell("ended", {{"words", words}, {"good", good}});
}

void take_still_pose(Bench& bench) {
  const std::string set = next_free_pose(bench);
  set.empty() ? end_automatic(bench, "every pose of the rig is taken", false)
              : bench.cameras.take(set);
}

/// Excludes a pose that few cameras see; otherwise calibrates with it.
static void use_still_pose(Bench& bench, const std::string& set) {
  if (!bench.cameras.automatic()) return;
  const auto seen = bench.files.marks(set);
  const auto sees = [](const FrameDetections& one) { return !one.detections.empty(); };
  const auto views = seen ? std::ranges::count_if(seen->frames, sees) : 0;
  if (views < kLeastViews) {
    const std::string why = "fewer than two cameras see the target";
    bench.session.add("bench", fmt::format("left out {}: {}", set, why), {{"dropped", set}});
    bench.session.tell("refused", {{"set", set}, {"why", why}});
  } else if (can_calibrate(bench)) {
    calibrate(bench, {});
  } else if (next_free_pose(bench).empty()) {
    end_automatic(bench, "every pose of the rig is taken", false);
  }
}

/// Logs how well the previous calibration measures a set that it did not use.
static void log_held_out(Bench& bench, const std::string& set) {
  const auto by = bench.files.calibration();
  const auto seen = bench.files.marks(set);
  if (!by || !seen || std::find(by->sets.begin(), by->sets.end(), set) != by->sets.end()) return;
  const auto measured = measure_target(*by, bench.session.bench()->target, seen->frames);
  if (!measured) return;
  bench.session.add("bench", "held-out error",
                    {{"held_out", set},
                     {"rms_mm", measured->rms_m / mm},
                     {"points", measured->points},
                     {"calibrated_with", by->sets.size()}});
}

static void follow(Bench& bench, const Job& job) {
  const auto files = bench.session.bench();
  if (job.kind == "doctor") {
    const Json report = try_json(job.output);
    bench.session.doctor(report.is_object() ? report.value("checks", Json()) : Json());
  } else if (job.kind == "calibrate") {
    if (!bench.cameras.automatic()) return;
    if (coach_view(bench).value("reached", false))
      end_automatic(
          bench, "The goal is reached: more poses change a measured point by less than 5 %", true);
    else if (next_free_pose(bench).empty())
      end_automatic(bench, "every pose of the rig is taken", false);
  } else if (job.kind == "detect" && files->is_target_set(job.what)) {
    if (job.state != JobState::failed) log_held_out(bench, job.what);
    if (job.state != JobState::cancelled) use_still_pose(bench, job.what);
  } else if (job.kind == "detect" && files->plate_of(job.what) && bench.files.calibration()) {
    const std::string name = bench.session.drape_of(job.what);
    bench.jobs.add("object", name, object_calls(bench, files->drape(name)));
  }
}

/// Called when a job has ended: logs it and starts what follows from it.
static void job_ended(Bench& bench, const Job& job) {
  try {
    const Json json = job.json();
    bench.session.add(
        "bench", job.kind + " " + job.what,
        {{"ended", json["state"]}, {"sentence", job.sentence}, {"commands", json["commands"]}});
    bench.session.trouble("");
    follow(bench, job);
  } catch (const std::exception& error) {
    bench.session.trouble(error.what());
  }
  bench.session.tell("state", Json::object());
}

// ---- the parts together ------------------------------------------------------------------------

Bench::Bench(const ConsoleOptions& options, Tell tell)
    : session(options, std::move(tell)),
      files(session),
      cameras(*this),
      jobs(
          [this](const Job& job) {
            if (job.state == JobState::running && job.now.empty() && job.fraction == 0) try {
                session.add("bench", "begins", {{"begins", job.kind + " " + job.what}});
              } catch (const Error& error) {
                session.trouble(error.what());
              }
            session.tell("job", job.json());
          },
          [this](const Job& job) { job_ended(*this, job); }) {
  if (options.replay) static_cast<void>(read_recording(session.recording_folder));
  detect_what_lacks(*this);
  if (!options.replay) cameras.open();
}

/// Ends the cameras first, while everything to which they report still exists.
}  // namespace drape::console
