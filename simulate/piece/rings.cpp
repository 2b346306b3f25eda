// SPDX-License-Identifier: Apache-2.0
#include "simulate/piece/rings.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>
#include <utility>

#include "simulate/piece/numbers.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;

constexpr int kFine = 256;  // chords by which a curve's length is measured

/// Centre form of an arc (SVG 1.1, appendix F.6.5), as points for 0 .. 1.
std::function<Vector2d(double)> arc(const Vector2d& from, Vector2d radii, double turn_deg,
                                    bool large, bool sweep, const Vector2d& to) {
  const Eigen::Rotation2Dd turn(turn_deg * std::numbers::pi / 180);
  const Vector2d half = turn.inverse() * ((from - to) / 2);
  radii = radii.cwiseAbs();
  if (const double over = half.cwiseQuotient(radii).squaredNorm(); over > 1)
    radii *= std::sqrt(over);
  const Vector2d unit = half.cwiseQuotient(radii);
  const double square = unit.squaredNorm();
  const double height = std::sqrt(std::max(0.0, 1 / square - 1)) * (large == sweep ? -1 : 1);
  const Vector2d middle = height * Vector2d(unit.y(), -unit.x());
  const Vector2d centre = turn * middle.cwiseProduct(radii) + (from + to) / 2;
  const Vector2d first = unit - middle, last = -unit - middle;
  const double begin = std::atan2(first.y(), first.x());
  double angle = std::atan2(last.y(), last.x()) - begin;
  if (sweep && angle < 0) angle += 2 * std::numbers::pi;
  if (!sweep && angle > 0) angle -= 2 * std::numbers::pi;
  return [=](double t) -> Vector2d {
    const double a = begin + t * angle;
    return centre + turn * Vector2d(radii.x() * std::cos(a), radii.y() * std::sin(a));
  };
}

class PathReader {
 public:
  using Refuse = std::function<void(const std::string& why, std::size_t at)>;

  PathReader(const std::string& data, RingBuilder& builder, const Refuse& refuse)
      : numbers_(data), builder_(builder), refuse_(refuse) {}

  void read() {
    while (!numbers_.at_end()) {
      if (const auto letter = numbers_.letter()) {
        command_ = *letter;
      } else if (command_ == 0 || std::toupper(command_) == 'Z') {
        refuse_("no command stands where one must", numbers_.at());
      }
      step();
      before_ = command_;
      // Further pairs after a move are lines.
      if (command_ == 'M') command_ = 'L';
      if (command_ == 'm') command_ = 'l';
    }
    end_ring();
  }

 private:
  double number() {
    const auto value = numbers_.next();
    if (!value) refuse_("a number is missing", numbers_.at());
    return *value;
  }
  bool flag() {
    const auto value = numbers_.flag();
    if (!value) refuse_("a flag of an arc is missing", numbers_.at());
    return *value;
  }
  [[nodiscard]] bool relative() const { return std::islower(command_) != 0; }
  Vector2d pair() {
    const double x = number();
    const double y = number();
    return relative() ? Vector2d(here_ + Vector2d(x, y)) : Vector2d(x, y);
  }

  void end_ring() {
    if (!builder_.is_open()) return;
    if (!builder_.has_returned()) refuse_("a line is not closed", numbers_.at());
    builder_.close();
  }

  void line_to(const Vector2d& to) {
    need_ring();
    builder_.line_to(to);
    here_ = to;
  }
  /// After Z a path goes on from where its ring began.
  void need_ring() {
    if (before_ == 0) refuse_("the path does not begin with M", numbers_.at());
    if (!builder_.is_open()) builder_.begin(here_);
  }
  void cubic(const Vector2d& a, const Vector2d& b, const Vector2d& to) {
    need_ring();
    const Vector2d from = here_;
    builder_.curve([=](double t) -> Vector2d {
      const double s = 1 - t;
      return s * s * s * from + 3 * s * s * t * a + 3 * s * t * t * b + t * t * t * to;
    });
    control_ = b;
    here_ = to;
  }
  void quadratic(const Vector2d& control, const Vector2d& to) {
    const Vector2d from = here_;
    cubic((from + 2 * control) / 3, (to + 2 * control) / 3, to);
    control_ = control;
  }
  /// The mirror image of the last control point after a curve of the same kind.
  [[nodiscard]] Vector2d mirrored(const std::string& kinds) const {
    const bool same = kinds.find(static_cast<char>(std::toupper(before_))) != std::string::npos;
    return same ? Vector2d(2 * here_ - control_) : here_;
  }

  void step() {
    switch (std::toupper(command_)) {
      case 'M': {
        end_ring();
        begin_ = here_ = pair();
        builder_.begin(here_);
        return;
      }
      case 'Z':
        if (builder_.is_open()) builder_.close();
        here_ = begin_;
        return;
      case 'L':
        return line_to(pair());
      case 'H': {
        const double x = number();
        return line_to({relative() ? here_.x() + x : x, here_.y()});
      }
      case 'V': {
        const double y = number();
        return line_to({here_.x(), relative() ? here_.y() + y : y});
      }
      case 'C': {
        const Vector2d a = pair(), b = pair();
        return cubic(a, b, pair());
      }
      case 'S': {
        const Vector2d a = mirrored("CS"), b = pair();
        return cubic(a, b, pair());
      }
      case 'Q': {
        const Vector2d control = pair();
        return quadratic(control, pair());
      }
      case 'T': {
        const Vector2d control = mirrored("QT");
        return quadratic(control, pair());
      }
      case 'A': {
        const double rx = number(), ry = number(), turn = number();
        const bool large = flag(), sweep = flag();
        const Vector2d to = pair();
        // A radius of 0 makes a line (SVG 1.1, appendix F.6.2).
        if (rx == 0 || ry == 0 || to == here_) return line_to(to);
        need_ring();
        builder_.curve(arc(here_, {rx, ry}, turn, large, sweep, to));
        here_ = to;
        return;
      }
      default:
        refuse_(std::string("`") + command_ + "` is no command", numbers_.at());
    }
  }

  NumberReader numbers_;
  RingBuilder& builder_;
  const Refuse& refuse_;
  char command_ = 0, before_ = 0;
  Vector2d here_ = Vector2d::Zero(), begin_ = Vector2d::Zero(), control_ = Vector2d::Zero();
};

}  // namespace

void RingBuilder::add(const Vector2d& metres) {
  beyond_limits_ =
      beyond_limits_ || !(metres.cwiseAbs().maxCoeff() < kFarthest_m) || ++corners_ > kMostCorners;
  if (beyond_limits_) return;
  // Exchanged: a drawing's x is the weft.
  const Vector2d place(metres.y(), metres.x());
  if (!ring_.empty() && (ring_.back() - place).norm() < kSamePlace * spacing_m_) return;
  ring_.push_back(place);
}

void RingBuilder::begin(const Vector2d& at) {
  ring_.clear();
  open_ = true;
  add(to_metres * at);
}

void RingBuilder::line_to(const Vector2d& to) {
  add(to_metres * to);
}

void RingBuilder::curve(const std::function<Vector2d(double)>& place) {
  std::vector<Vector2d> fine;
  std::vector<double> path_m = {0};
  for (int k = 0; k <= kFine; ++k) {
    fine.push_back(to_metres * place(static_cast<double>(k) / kFine));
    if (k > 0) path_m.push_back(path_m.back() + (fine[k] - fine[k - 1]).norm());
  }
  beyond_limits_ = beyond_limits_ || !(path_m.back() < kMostCorners * spacing_m_);
  if (beyond_limits_) return;
  const int pieces = std::max(1, static_cast<int>(std::ceil(path_m.back() / spacing_m_)));
  for (int piece = 1; piece <= pieces; ++piece) {
    const double at = path_m.back() * piece / pieces;
    const auto after = std::lower_bound(path_m.begin() + 1, path_m.end() - 1, at);
    const auto k = static_cast<std::size_t>(after - path_m.begin());
    const double part =
        path_m[k] > path_m[k - 1] ? (at - path_m[k - 1]) / (path_m[k] - path_m[k - 1]) : 1;
    add(fine[k - 1] + part * (fine[k] - fine[k - 1]));
  }
}

bool RingBuilder::has_returned() const {
  return ring_.size() > 1 && (ring_.front() - ring_.back()).norm() < kSamePlace * spacing_m_;
}

void RingBuilder::close() {
  if (has_returned()) ring_.pop_back();
  if (!ring_.empty()) rings_.push_back(ring_);
  ring_.clear();
  open_ = false;
}

void add_path(const std::string& data, RingBuilder& builder, const PathReader::Refuse& refuse) {
  PathReader(data, builder, refuse).read();
}

}  // namespace drape::simulate
