// SPDX-License-Identifier: Apache-2.0
#include "simulate/start/history.hpp"

#include <fmt/format.h>

#include <cmath>
#include <sstream>

#include "core/matching.hpp"
#include "core/units.hpp"

namespace drape::simulate {
namespace {

constexpr double kSharpest = 20 * units::per_cm;  // curvature of a sharp crease, radius 0.5 mm
constexpr int kMostTimes = 50;
constexpr double kMostShake = 0.95;  // fraction of gravity; 1 is weightlessness

[[noreturn]] void refuse(const Scene& scene, const std::string& text, const std::string& why) {
  throw bad_input(fmt::format("`{}`: {}", text, why),
                  {.file = scene.file.string(), .field = "start.history"},
                  "give texts like \"flat\", \"bent 1.5 per cm along warp\", \"draped 3 times\" "
                  "and, last, \"shaken 5 times by 40 %\"");
}

PastEvent event_of(const Scene& scene, const std::string& text) {
  static const std::regex flat(R"(\s*flat\s*)"),
      bent(R"(\s*bent\s+(\S+)\s+per\s+cm\s+along\s+(warp|weft)\s*)"),
      draped(R"(\s*draped\s+(\S+)\s+times\s*)"),
      shaken(R"(\s*shaken\s+(\S+)\s+times(?:\s+by\s+(\S+)\s+%)?\s*)");
  std::smatch words;
  const auto number = [&](std::size_t word) {
    std::istringstream stream(words[word]);
    stream.imbue(std::locale::classic());
    double value = 0;
    if (!(stream >> value) || !stream.eof() || !std::isfinite(value))
      refuse(scene, text, fmt::format("`{}` is no number", words[word].str()));
    return value;
  };
  const auto times = [&] {
    const double value = number(1);
    if (value != std::floor(value) || value < 1 || value > kMostTimes)
      refuse(scene, text, fmt::format("times are a whole number from 1 to {}", kMostTimes));
    return static_cast<int>(value);
  };
  PastEvent event;
  if (has_form(text, flat)) return event;
  if (has_form(text, words, bent)) {
    event.kind = PastEvent::Kind::bent;
    event.direction = words[2] == "weft" ? 1 : 0;
    event.curvature_per_m = number(1) * units::per_cm;
    if (event.curvature_per_m == 0 || std::abs(event.curvature_per_m) > kSharpest)
      refuse(scene, text,
             fmt::format("a cloth is bent by more than 0 and at most {:g} per cm",
                         kSharpest / units::per_cm));
  } else if (has_form(text, words, draped)) {
    event.kind = PastEvent::Kind::draped;
    event.times = times();
  } else if (has_form(text, words, shaken)) {
    event.kind = PastEvent::Kind::shaken;
    event.times = times();
    if (words[2].matched) event.part = number(2) * units::percent;
    if (!(event.part > 0) || event.part > kMostShake)
      refuse(
          scene, text,
          fmt::format("a shake takes more than 0 and at most {:g} % of gravity", 100 * kMostShake));
  } else {
    refuse(scene, text, "that is no event of a history");
  }
  return event;
}

/// Brings every element to the same strain.
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
    history.push_back(event_of(scene, text));
    const bool last = &text == &scene.start.history.back();
    if (history.back().kind == PastEvent::Kind::shaken && !last)
      refuse(scene, text, "a cloth is shaken where it lies, so nothing follows");
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
