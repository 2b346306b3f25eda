// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "core/detections.hpp"
#include "core/files/files.hpp"
#include "core/rig.hpp"
#include "core/units.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {

using namespace calib;

/// Corners of a real chessboard (tests/data/real-boards), and splits of its views into halves.
struct RealBoard {
  Detections detections;
  Rig rig;
  Target target;
  std::vector<std::pair<std::vector<std::string>, std::vector<std::string>>> halves;
};

inline constexpr const char* real_boards[] = {"bouguet",        "sourishg-1",     "pose2sim-cam01",
                                              "pose2sim-cam02", "pose2sim-cam03", "pose2sim-cam04"};

inline RealBoard real_board(const std::string& name) {
  RealBoard board;
  Target& target = board.target;
  target.kind = TargetKind::chessboard;
  std::istringstream lines(read_text(source_root() / "tests/data/real-boards" / (name + ".txt")));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string key, word;
    words >> key;
    if (key == "board") {
      words >> word >> target.rows >> word >> target.cols >> word >> target.pitch_m;
      target.pitch_m *= units::mm;
      board.detections.lattice.surface = Surface::target;
      board.detections.lattice.rows = target.rows;
      board.detections.lattice.cols = target.cols;
      board.detections.lattice.pitch_m = target.pitch_m;
    } else if (key == "camera") {
      RigCamera camera{"", 0, 0, 1e-6, 1e-6};
      words >> camera.name >> camera.width_px >> camera.height_px;
      board.rig.cameras.push_back(camera);
    } else if (key == "views") {
      while (words >> word) board.rig.free_poses.push_back(word);
    } else if (key == "half") {
      auto& [one, other] = board.halves.emplace_back();
      bool second = false;
      while (words >> word) {
        if (word == "|") {
          second = true;
        } else {
          (second ? other : one).push_back(word);
        }
      }
    } else if (key == "frame") {
      FrameDetections frame;
      words >> frame.set >> frame.camera;
      frame.width_px = board.rig.camera(frame.camera).width_px;
      frame.height_px = board.rig.camera(frame.camera).height_px;
      board.detections.frames.push_back(frame);
    } else {
      Detection d;
      double uu = 0, uv = 0, vv = 0;
      words >> d.mark.col >> d.centre_px.x() >> d.centre_px.y() >> uu >> uv >> vv;
      d.mark.row = std::stoi(key);
      d.covariance_px2 << uu, uv, uv, vv;
      d.semi_axes_px.setConstant(5);
      board.detections.frames.back().detections.push_back(d);
    }
  }
  return board;
}

}  // namespace drape::test
