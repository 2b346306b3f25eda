// SPDX-License-Identifier: Apache-2.0
#include "simulate/start/history.hpp"

#include <fmt/format.h>

#include <cmath>
#include <sstream>

#include "core/error.hpp"
#include "core/units.hpp"

namespace drape::simulate {
namespace {

constexpr double kSharpest = 20 * units::per_cm;  // a radius of 0.5 mm, that of a sharp crease
constexpr int kMostTimes = 50;
constexpr double kMostShake = 0.95;  // of gravity; a whole one would throw the cloth

class EventReader {
 public:
  EventReader(const Scene& scene, const std::string& text) : scene_(scene), text_(text) {
    std::istringstream stream(text);
    for (std::string word; stream >> word;) words_.push_back(word);
  }

  [[nodiscard]] PastEvent read() const {
    PastEvent event;
    if (is({"flat"})) return event;
    if (is({"bent", "#", "per", "cm", "along", "warp"}) ||
        is({"bent", "#", "per", "cm", "along", "weft"})) {
      event.kind = PastEvent::Kind::bent;
      event.direction = words_.back() == "weft" ? 1 : 0;
      event.curvature_per_m = number(1) * units::per_cm;
      if (event.curvature_per_m == 0 || std::abs(event.curvature_per_m) > kSharpest)
        refuse(fmt::format("a cloth is bent by more than 0 and at most {:g} per cm",
                           kSharpest / units::per_cm));
      return event;
    }
    if (is({"draped", "#", "times"})) {
      event.kind = PastEvent::Kind::draped;
      event.times = times();
      return event;
    }
    if (is({"shaken", "#", "times"}) || is({"shaken", "#", "times", "by", "#", "%"})) {
      event.kind = PastEvent::Kind::shaken;
      event.times = times();
      if (words_.size() > 3) event.part = number(4) * units::percent;
      if (!(event.part > 0) || event.part > kMostShake)
        refuse(fmt::format("a shake takes more than 0 and at most {:g} % of gravity",
                           100 * kMostShake));
      return event;
    }
    refuse("that is no event of a history");
  }

  [[noreturn]] void refuse(const std::string& why) const {
    throw bad_input(fmt::format("`{}`: {}", text_, why),
                    {.file = scene_.file.string(), .field = "start.history"},
                    "give texts like \"flat\", \"bent 1.5 per cm along warp\", \"draped 3 times\" "
                    "and, last, \"shaken 5 times by 40 %\"");
  }

 private:
  /// Word by word; # stands for anything.
  [[nodiscard]] bool is(const std::vector<std::string>& form) const {
    if (form.size() != words_.size()) return false;
    for (std::size_t i = 0; i < form.size(); ++i)
      if (form[i] != "#" && form[i] != words_[i]) return false;
    return true;
  }
  [[nodiscard]] double number(std::size_t word) const {
    std::istringstream stream(words_[word]);
    stream.imbue(std::locale::classic());
    double value = 0;
    if (!(stream >> value) || !stream.eof() || !std::isfinite(value))
      refuse(fmt::format("`{}` is no number", words_[word]));
    return value;
  }
  [[nodiscard]] int times() const {
    const double value = number(1);
    if (value != std::floor(value) || value < 1 || value > kMostTimes)
      refuse(fmt::format("times are a whole number from 1 to {}", kMostTimes));
    return static_cast<int>(value);
  }

  const Scene& scene_;
  const std::string& text_;
  std::vector<std::string> words_;
};

/// Takes every element to one strain.
void take_to(double strain, const FrictionStack& stack, std::vector<double>& slips) {
  const std::size_t m = stack.elements.size();
  for (std::size_t i = 0; i + m <= slips.size() && m > 0; i += m)
    static_cast<void>(stack.settle(strain, slips.data() + i));
}

void lay_flat(const ClothFriction& friction, ClothMemory& memory) {
  for (int d = 0; d < 2; ++d) take_to(0, friction.bending[d], memory.bending[d]);
  take_to(0, friction.shear, memory.shear);
}

}  // namespace

std::vector<PastEvent> history_of(const Scene& scene) {
  std::vector<PastEvent> history;
  for (const std::string& text : scene.start.history) {
    const EventReader reader(scene, text);
    history.push_back(reader.read());
    const bool last = &text == &scene.start.history.back();
    if (history.back().kind == PastEvent::Kind::shaken && !last)
      reader.refuse("a cloth is shaken where it lies, so nothing follows");
  }
  return history;
}

PastEvent shakes_of(const std::vector<PastEvent>& history) {
  if (history.empty() || history.back().kind != PastEvent::Kind::shaken) return {};
  return history.back();
}

std::string not_at_rest_before(int number) {
  return fmt::format(
      "drape {} of start.history did not come to rest: what is reported is that drape", number);
}

std::optional<ClothMemory> memory_after(const std::vector<PastEvent>& history,
                                        const ClothFriction& friction, ClothMemory fresh,
                                        const DrapeOnce& drape) {
  std::optional<ClothMemory> memory = fresh;
  for (const PastEvent& event : history) {
    if (event.kind == PastEvent::Kind::flat) memory = fresh;
    if (event.kind == PastEvent::Kind::bent)
      take_to(event.curvature_per_m, friction.bending[event.direction],
              memory->bending[event.direction]);
    for (int k = 0; event.kind == PastEvent::Kind::draped && k < event.times; ++k) {
      memory = drape(*memory);
      if (!memory) return memory;
      lay_flat(friction, *memory);
    }
    lay_flat(friction, *memory);
  }
  return memory;
}

}  // namespace drape::simulate
