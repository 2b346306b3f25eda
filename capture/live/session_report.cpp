// SPDX-License-Identifier: Apache-2.0
// How a session ends: which frames are kept, and what is reported of the cameras.
#include <utility>

#include "capture/live/clocks.hpp"
#include "capture/live/develop.hpp"
#include "capture/live/session.hpp"

namespace drape::capture {

void Session::add_cameras(LiveReport& report, const PairingResult& pairing) const {
  for (std::size_t c = 0; c < running_.size(); ++c) {
    const Running& r = running_[c];
    report.cameras.push_back({name(c), r.host->identity(), r.host->settings(),
                              r.host->on_host_clock() ? std::nullopt : newest_clock(r.clocks),
                              pairing.cameras[c], r.host->counters(), r.host->frames_without_room(),
                              r.host->launches(), r.longest_gap_s, r.longest_unnoticed_s});
  }
}

LiveReport Session::report_up_to_now(const PairingResult& pairing) const {
  LiveReport report = report_;
  add_cameras(report, pairing);
  return report;
}

LiveResult Session::finish() {
  LiveResult result;
  ended_ = true;
  const std::vector<FrameMark> all = marks();
  const PairingResult pairing = pair(all);
  give_out(pairing, true);
  std::vector<FrameMark> kept;
  const auto wanted = static_cast<std::size_t>(options_.frames);
  const auto counted = by_trigger() ? every_frame(all) : frames_of_sets(all, pairing, wanted);
  for (const std::size_t i : counted) {
    Arrival& a = arrivals_[i];
    kept.push_back(all[i]);
    kept.back().settled = a.settled;
    LiveFrame frame = develop(std::move(a.frame), running_[a.camera].host->pixel_format());
    frame.mark = kept.back();
    result.frames.push_back(std::move(frame));
  }
  result.pairing = pair(kept);
  add_cameras(report_, result.pairing);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const FramePlace& place = result.pairing.places[i];
    if (place.bin == FrameBin::unpaired)
      add_fault(report_.faults,
                {name(kept[i].camera), "a frame is in no set: " + to_string(place.why_unpaired),
                 remedy_for(place.why_unpaired)});
  }
  for (const LiveCameraReport& camera : report_.cameras)
    for (std::int64_t k = 0; k < camera.ledger.never_arrived; ++k)
      add_fault(report_.faults, {camera.name, "a frame never arrived",
                                 "check cable and switch; look for dropped packets on the "
                                 "network card"});
  for (std::size_t c = 0; c < running_.size(); ++c)
    if (report_.method == SyncMethod::line_trigger && running_[c].newest < 0)
      add_fault(report_.faults,
                {name(c), "no pulse came by the line: it sent no frame",
                 "see that pulses come by " + file_.cameras[c].settings.trigger_line});
  for (LiveFault& fault : ptp_faults(report_.cameras)) add_fault(report_.faults, fault);
  if (report_.paired_by == PairedBy::arrival) {
    for (PairedFrames& set : result.pairing.sets) set.spread_s.reset();
    for (LiveFrame& frame : result.frames) frame.mark.time_s.reset();
  }
  result.report = std::move(report_);
  return result;
}

std::string Session::remedy_for(Unpaired why) const {
  switch (why) {
    case Unpaired::partner_missing:
      return by_trigger() ? "see why the other cameras have no frame of that trigger"
                          : "use a trigger, or cameras of one frame rate";
    case Unpaired::repeated_id:
      return "look for a switch that sends packets twice; else replace the camera";
    case Unpaired::no_time:
      return "let nothing set the camera's clock; or use software_trigger";
    case Unpaired::no_trigger:
      return "let nothing else trigger the camera, and lower frame_rate_hz";
    case Unpaired::no:
      break;
  }
  return {};
}

const std::string& Session::name(std::size_t camera) const {
  return file_.cameras[camera].name;
}

}  // namespace drape::capture
