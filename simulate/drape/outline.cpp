// SPDX-License-Identifier: Apache-2.0
#include "simulate/drape/outline.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numbers>
#include <optional>
#include <pugixml.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/files/files.hpp"
#include "core/geometry/vectors.hpp"
#include "core/matching.hpp"
#include "core/units.hpp"

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;
using Eigen::Affine2d;
using Eigen::Vector2d;
using units::mm;

constexpr int kFine = 256;  ///< chords for measuring the length of a curve
constexpr std::size_t kMostCorners =
    20000;                           ///< limit on the corners of an outline, after dividing curves
constexpr double kFarthest_m = 10;   ///< largest distance of a corner from that of the patch
constexpr double kSamePlace = 1e-3;  ///< fraction of the spacing; closer points are the same

/// Collects closed rings of lines and curves as polygons (warp, weft) in metres. Curves are divided
/// into pieces of equal length, about the spacing; corners are kept.
class RingBuilder {
 public:
  explicit RingBuilder(double spacing_m) : spacing_m_(spacing_m) {}

  /// Transform of the following points: from the file's units to (weft, warp) in metres.
  Affine2d to_metres = Affine2d::Identity();

  void begin(const Vector2d& at) {
    ring_.clear();
    open_ = true;
    add(to_metres * at);
  }
  void line_to(const Vector2d& to) { add(to_metres * to); }
  /// Adds a curve: `place` gives its points for 0 .. 1, starting at the current one, in file units.
  void curve(const std::function<Vector2d(double)>& place) {
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
  /// Closes the ring; merges corners that coincide.
  void close() {
    if (has_returned()) ring_.pop_back();
    if (!ring_.empty()) rings_.push_back(ring_);
    ring_.clear();
    open_ = false;
  }
  [[nodiscard]] bool is_open() const { return open_; }
  /// True if the current point is the start of the ring, within a thousandth of the spacing.
  [[nodiscard]] bool has_returned() const {
    return ring_.size() > 1 && (ring_.front() - ring_.back()).norm() < kSamePlace * spacing_m_;
  }

  /// True for more corners, or longer lines, than any cloth has; later input is ignored.
  [[nodiscard]] bool is_beyond_limits() const { return beyond_limits_; }

  [[nodiscard]] const std::vector<Polygon>& rings() const { return rings_; }

 private:
  void add(const Vector2d& metres) {
    beyond_limits_ = beyond_limits_ || !(metres.cwiseAbs().maxCoeff() < kFarthest_m) ||
                     ++corners_ > kMostCorners;
    if (beyond_limits_) return;
    // Swaps the axes: x of a drawing is the weft.
    const Vector2d place(metres.y(), metres.x());
    if (!ring_.empty() && (ring_.back() - place).norm() < kSamePlace * spacing_m_) return;
    ring_.push_back(place);
  }

  double spacing_m_;
  bool open_ = false, beyond_limits_ = false;
  std::size_t corners_ = 0;
  Polygon ring_;
  std::vector<Polygon> rings_;
};

/// Reads numbers from SVG attributes, separated by spaces and commas, or by nothing if a sign or a
/// second decimal point starts the next (SVG 1.1, section 8.3.9). Locale-independent.
class NumberReader {
 public:
  explicit NumberReader(std::string text) : text_(std::move(text)) {}

  /// Reads a number; nullopt, without advancing, if there is no finite one.
  [[nodiscard]] std::optional<double> next() {
    skip();
    const char* begin = text_.data() + at_;
    const char* end = text_.data() + text_.size();
    if (begin < end && *begin == '+') ++begin;  // from_chars does not accept it
    double value = 0;
    const auto [after, error] = std::from_chars(begin, end, value);
    if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
    at_ = static_cast<std::size_t>(after - text_.data());
    return value;
  }
  /// Reads a flag of an arc: the single character 0 or 1.
  [[nodiscard]] std::optional<bool> flag() {
    skip();
    if (at_ >= text_.size() || (text_[at_] != '0' && text_[at_] != '1')) return std::nullopt;
    return text_[at_++] == '1';
  }
  /// Reads a letter; nullopt if there is none.
  [[nodiscard]] std::optional<char> letter() {
    skip();
    if (at_ >= text_.size() || std::isalpha(static_cast<unsigned char>(text_[at_])) == 0)
      return std::nullopt;
    return text_[at_++];
  }
  [[nodiscard]] bool at_end() {
    skip();
    return at_ == text_.size();
  }
  [[nodiscard]] std::size_t at() const { return at_; }

 private:
  void skip() {
    while (at_ < text_.size() &&
           (text_[at_] == ',' || std::isspace(static_cast<unsigned char>(text_[at_])) != 0))
      ++at_;
  }

  std::string text_;
  std::size_t at_ = 0;
};

/// Points for 0 .. 1 of an arc in centre form (SVG 1.1, appendix F.6.5).
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

/// Adds the rings of path data (SVG 1.1, section 8.3). `refuse` throws with its message and the
/// position of the first wrong character or of a ring that is left open.
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
      // Further coordinate pairs after a move are lines.
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
  /// After Z a path continues from the start of its ring.
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
  /// Reflection of the last control point after a curve of the same kind.
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
        // An arc with a zero radius is a line (SVG 1.1, appendix F.6.2).
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

constexpr int kDeepest = 100;  // nesting depth of groups

constexpr const char* kHidden =
    "delete hidden layers, apply transforms, clips and masks, and export as plain SVG";

/// Elements that draw nothing.
const std::set<std::string> kSilent = {"title", "desc", "metadata", "defs", "style"};

/// Style properties that move, clip or change a shape (CSS Transforms 1 and 2, CSS Masking 1, SVG
/// 2).
const std::set<std::string> kReshaping = {"transform",
                                          "transform-origin",
                                          "transform-box",
                                          "translate",
                                          "rotate",
                                          "scale",
                                          "clip-path",
                                          "clip",
                                          "mask",
                                          "d",
                                          "x",
                                          "y",
                                          "cx",
                                          "cy",
                                          "r",
                                          "rx",
                                          "ry",
                                          "width",
                                          "height"};

std::string without_comments(const std::string& text) {
  std::string plain;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t from = std::min(text.find("/*", at), text.size());
    plain += text.substr(at, from - at);
    const std::size_t to = text.find("*/", from + 2);
    at = to == std::string::npos ? text.size() : to + 2;
  }
  return plain;
}

std::string first_word(const std::string& text) {
  const std::size_t from = std::min(text.find_first_not_of(" \t\r\n"), text.size());
  return text.substr(from, text.find_first_of(" \t\r\n!", from) - from);
}

/// True if a property hides a shape or makes it differ from what its element states.
bool hides_or_reshapes(const std::string& property, const std::string& value) {
  if (property == "display") return value == "none";
  if (property == "visibility") return value == "hidden" || value == "collapse";
  if (property == "opacity") return NumberReader(value).next().value_or(1) == 0;
  return kReshaping.contains(property) && value != "none";
}

class SvgReader {
 public:
  SvgReader(const fs::path& file, double spacing_m) : file_(file), builder_(spacing_m) {}

  std::vector<Polygon> read() {
    const std::string text = read_text(file_);
    pugi::xml_document document;
    const auto parsed = document.load_buffer(text.data(), text.size());
    if (!parsed)
      throw bad_input(fmt::format("this is no XML: {} at byte {}", parsed.description(),
                                  static_cast<long>(parsed.offset)),
                      {.file = file_.string()}, "export the outline as plain SVG");
    const pugi::xml_node svg = document.child("svg");
    if (!svg) refuse(svg, "the file has no <svg>", "export the outline as plain SVG");
    svg.find_node([this](const pugi::xml_node& node) {
      if (std::string(node.name()) != "style") return false;
      std::string sheet;
      for (const pugi::xml_node& part : node.children()) sheet += part.value();
      require_plain_style(node, sheet);
      return false;
    });
    if (text.find("<?xml-stylesheet") != std::string::npos)
      refuse(svg, "its style stands in another file", kHidden);
    if (svg.attribute("transform")) refuse(svg, "its transform is not read", kHidden);
    visit(svg, scale_of(svg), 0);
    return builder_.rings();
  }

 private:
  [[noreturn]] void refuse(const pugi::xml_node& node, const std::string& why,
                           const std::string& what_to_do) const {
    std::string name = node.name();
    if (const std::string id = node.attribute("id").value(); !id.empty()) name += " id=" + id;
    throw bad_input(why, {.file = file_.string(), .field = name}, what_to_do);
  }

  /// Checks single declarations, or a whole style sheet regardless of what its rules select.
  void require_plain_style(const pugi::xml_node& node, const std::string& style) const {
    const std::string text = without_comments(in_small_letters(style));
    if (text.find("@import") != std::string::npos)
      refuse(node, "its style stands in another file", kHidden);
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t end = std::min(text.find_first_of("{};", at), text.size());
      const std::string part = text.substr(at, end - at);
      if (const std::size_t colon = part.find(':'); colon != std::string::npos)
        require_plain(node, first_word(part.substr(0, colon)), first_word(part.substr(colon + 1)));
      at = end + 1;
    }
  }
  void require_plain(const pugi::xml_node& node, const std::string& property,
                     const std::string& value) const {
    if (hides_or_reshapes(property, value))
      refuse(node, fmt::format("it is not seen as it is drawn ({}: {})", property, value), kHidden);
  }
  /// Throws for shapes that a viewer hides or moves: they are not the cloth.
  void require_shown(const pugi::xml_node& node) const {
    for (const char* name : {"display", "visibility", "opacity", "clip-path", "mask"})
      if (const pugi::xml_attribute attribute = node.attribute(name))
        require_plain(node, name, in_small_letters(attribute.value()));
    require_plain_style(node, node.attribute("style").value());
  }

  /// A length with unit, in metres; nullopt without a unit.
  [[nodiscard]] std::optional<double> length_m(const pugi::xml_node& node, const char* name) const {
    static const std::regex form(R"(\s*([0-9.eE+-]+)\s*(?:(mm|cm|in|px)\s*)?)");
    const std::string text = node.attribute(name).value();
    std::smatch match;
    if (!has_form(text, match, form)) return std::nullopt;
    NumberReader numbers(match[1].str());
    const auto value = numbers.next();
    if (!value || !numbers.at_end() || !(*value > 0)) return std::nullopt;
    const std::string unit = match[2];
    if (unit == "mm") return *value * mm;
    if (unit == "cm") return *value * 10 * mm;
    if (unit == "in") return *value * 25.4 * mm;
    return *value * 25.4 / 96 * mm;
  }

  /// Transform from drawing units to (weft, warp) in metres.
  [[nodiscard]] Affine2d scale_of(const pugi::xml_node& svg) const {
    const auto width = length_m(svg, "width"), height = length_m(svg, "height");
    const std::string remedy =
        "write e.g. <svg width=\"220mm\" height=\"220mm\" viewBox=\"0 0 220 220\">";
    if (!width || !height) refuse(svg, "its width and height do not state a size", remedy);
    Affine2d scale = Affine2d::Identity();
    if (!svg.attribute("viewBox")) {
      scale.linear() *= 25.4 / 96 * mm;
      return scale;
    }
    NumberReader numbers(svg.attribute("viewBox").value());
    double box[4] = {};
    for (double& value : box) {
      const auto next = numbers.next();
      if (!next) refuse(svg, "its viewBox has not four numbers", remedy);
      value = *next;
    }
    if (!numbers.at_end()) refuse(svg, "its viewBox has not four numbers", remedy);
    if (!(box[2] > 0 && box[3] > 0)) refuse(svg, "its viewBox has no area", remedy);
    const double along_x = *width / box[2], along_y = *height / box[3];
    if (std::abs(along_x / along_y - 1) > 1e-4)
      refuse(svg, "its viewBox has other proportions than its width and height", remedy);
    scale.linear() *= along_x;
    scale.translation() = -along_x * Vector2d(box[0], box[1]);
    return scale;
  }

  /// Product of a list of transforms (SVG 1.1, section 7.6).
  [[nodiscard]] Affine2d transform_of(const pugi::xml_node& node) const {
    Affine2d all = Affine2d::Identity();
    const std::string text = node.attribute("transform").value();
    if (text.size() > longest_matched)
      refuse(node, "its transform is too long", "export the outline as plain SVG");
    static const std::regex one(R"(\s*(?:,\s*)?([a-zA-Z]+)\s*\(([^)]*)\)\s*)");
    std::size_t at = 0;
    for (std::sregex_iterator
             it(text.begin(), text.end(), one, std::regex_constants::match_continuous),
         end;
         it != end; ++it) {
      at += static_cast<std::size_t>(it->length());
      NumberReader numbers((*it)[2].str());
      std::vector<double> v;
      while (const auto value = numbers.next()) v.push_back(*value);
      if (!numbers.at_end()) v.clear();  // with a unit, or not a number
      const std::string name = (*it)[1];
      Affine2d t = Affine2d::Identity();
      if (name == "matrix" && v.size() == 6) {
        t.matrix().topRows<2>() << v[0], v[2], v[4], v[1], v[3], v[5];
      } else if (name == "translate" && (v.size() == 1 || v.size() == 2)) {
        t.translation() = Vector2d(v[0], v.size() == 2 ? v[1] : 0);
      } else if (name == "scale" && (v.size() == 1 || v.size() == 2)) {
        t.linear() = Vector2d(v[0], v.back()).asDiagonal();
      } else if (name == "rotate" && (v.size() == 1 || v.size() == 3)) {
        const Vector2d centre = v.size() == 3 ? Vector2d(v[1], v[2]) : Vector2d(0, 0);
        t = Eigen::Translation2d(centre) * Eigen::Rotation2Dd(v[0] * units::deg) *
            Eigen::Translation2d(-centre);
      } else if ((name == "skewX" || name == "skewY") && v.size() == 1) {
        t.linear()(name == "skewX" ? 0 : 1, name == "skewX" ? 1 : 0) = std::tan(v[0] * units::deg);
      } else {
        refuse(node, fmt::format("`{}({})` is no transform", name, (*it)[2].str()),
               "export the outline as plain SVG");
      }
      all = all * t;
    }
    if (at != text.size())
      refuse(node, "its transform cannot be read", "export the outline as plain SVG");
    return all;
  }

  double number(const pugi::xml_node& node, const char* name, std::optional<double> otherwise) {
    const pugi::xml_attribute attribute = node.attribute(name);
    if (!attribute && otherwise) return *otherwise;
    NumberReader numbers(attribute.value());
    const auto value = numbers.next();
    if (!value || !numbers.at_end())
      refuse(node, fmt::format("its {} is no number", name), "write it without a unit");
    return *value;
  }

  void visit(const pugi::xml_node& node, const Affine2d& outer, int depth) {
    if (depth > kDeepest) refuse(node, "groups lie too deep in each other", "ungroup the outline");
    require_shown(node);
    const Affine2d here = depth == 0 ? outer : outer * transform_of(node);
    for (const pugi::xml_node& child : node.children()) {
      if (child.type() == pugi::node_pcdata)
        refuse(node, "a text stands between its shapes", "save the drawing again");
      if (child.type() != pugi::node_element) continue;
      const std::string name = child.name();
      // Editors store their settings in elements with a namespace prefix.
      if (kSilent.contains(name) || name.find(':') != std::string::npos) continue;
      if (name == "g") {
        visit(child, here, depth + 1);
      } else {
        require_shown(child);
        builder_.to_metres = here * transform_of(child);
        draw(child, name);
        if (builder_.is_beyond_limits())
          refuse(child,
                 fmt::format("it reaches beyond {:g} m, or has more than {} corners", kFarthest_m,
                             kMostCorners),
                 "check its size and units, or give a wider --spacing-mm");
      }
    }
  }

  void draw(const pugi::xml_node& node, const std::string& name) {
    if (name == "path") {
      PathReader(node.attribute("d").value(), builder_,
                 [&](const std::string& why, std::size_t at) {
                   refuse(node, fmt::format("{}, at character {} of its path", why, at + 1),
                          "close every line of the outline (z)");
                 })
          .read();
    } else if (name == "polygon") {
      polygon(node);
    } else if (name == "rect") {
      if (node.attribute("rx") || node.attribute("ry"))
        refuse(node, "its corners are rounded", "convert the rectangle to a path");
      const double x = number(node, "x", 0), y = number(node, "y", 0);
      const double w = number(node, "width", {}), h = number(node, "height", {});
      builder_.begin({x, y});
      for (const Vector2d& p : {Vector2d(x + w, y), Vector2d(x + w, y + h), Vector2d(x, y + h)})
        builder_.line_to(p);
      builder_.close();
    } else if (name == "circle" || name == "ellipse") {
      const Vector2d centre(number(node, "cx", 0), number(node, "cy", 0));
      const Vector2d radii = name == "circle"
                                 ? Vector2d::Constant(number(node, "r", {}))
                                 : Vector2d(number(node, "rx", {}), number(node, "ry", {}));
      const auto place = [&](double t) -> Vector2d {
        const double angle = 2 * std::numbers::pi * t;
        return centre + Vector2d(radii.x() * std::cos(angle), radii.y() * std::sin(angle));
      };
      builder_.begin(place(0));
      builder_.curve(place);
      builder_.close();
    } else {
      refuse(node, fmt::format("<{}> is no closed outline", name),
             "keep closed paths, polygons, rectangles, circles and ellipses alone");
    }
  }

  void polygon(const pugi::xml_node& node) {
    NumberReader numbers(node.attribute("points").value());
    bool first = true;
    while (const auto x = numbers.next()) {
      const auto y = numbers.next();
      if (!y) refuse(node, "its points are an odd number of numbers", "write x,y pairs");
      first ? builder_.begin({*x, *y}) : builder_.line_to({*x, *y});
      first = false;
    }
    if (first || !numbers.at_end()) refuse(node, "its points cannot be read", "write x,y pairs");
    builder_.close();
  }

  fs::path file_;
  RingBuilder builder_;
};

double area_of(const Polygon& ring) {
  return std::abs(signed_area(ring));
}

[[noreturn]] void refuse_size(const fs::path& file) {
  throw bad_input(fmt::format("the outline reaches beyond {:g} m, or has more than {} corners",
                              kFarthest_m, kMostCorners),
                  {.file = file.string()}, "check its size and units");
}

std::vector<Polygon> rings_of_csv(const fs::path& file, double spacing_m) {
  const Csv csv = read_csv(file, {"ring", "warp_mm", "weft_mm"});
  RingBuilder builder(spacing_m);
  builder.to_metres.linear() *= mm;
  std::set<double> begun;
  for (std::size_t row = 0; row < csv.lines.size(); ++row) {
    const double ring = csv.columns[0][row];
    const Vector2d drawn(csv.columns[2][row], csv.columns[1][row]);
    if (row > 0 && ring == csv.columns[0][row - 1]) {
      builder.line_to(drawn);
      continue;
    }
    if (row > 0) builder.close();
    if (!begun.insert(ring).second)
      throw bad_input(fmt::format("ring {:g} goes on after another one", ring),
                      {.file = file.string(), .line = csv.lines[row], .field = "ring"},
                      "let the corners of a ring stand together, or give it a number of its own");
    builder.begin(drawn);
  }
  if (builder.is_open()) builder.close();
  if (builder.is_beyond_limits()) refuse_size(file);
  return builder.rings();
}

bool crosses(const Vector2d& a, const Vector2d& b, const Vector2d& c, const Vector2d& d) {
  const auto side = [](const Vector2d& p, const Vector2d& q, const Vector2d& r) {
    return cross(q - p, r - p);
  };
  return side(a, b, c) * side(a, b, d) < 0 && side(c, d, a) * side(c, d, b) < 0;
}

std::string place_of(const Vector2d& at) {
  return fmt::format("warp {:.1f}, weft {:.1f} mm", at.x() / mm, at.y() / mm);
}

bool runs_along(const Polygon& one, const Polygon& other, double same_m) {
  return std::all_of(one.begin(), one.end(),
                     [&](const Vector2d& corner) { return distance_m(other, corner) < same_m; });
}

/// Refuses lines that cross or come closer to each other than `same_m`: each must have cloth on one
/// side only.
class LinesApart {
 public:
  LinesApart(const std::vector<Polygon>& rings, double same_m, const fs::path& file)
      : rings_(rings), same_m_(same_m), file_(file) {
    for (std::size_t r = 0; r < rings.size(); ++r)
      for (std::size_t i = 0; i < rings[r].size(); ++i)
        lines_.push_back({rings[r][i], rings[r][(i + 1) % rings[r].size()], r, i});
    std::sort(lines_.begin(), lines_.end(), [](const Line& a, const Line& b) {
      return std::pair(a.low(), std::pair(a.ring, a.corner)) <
             std::pair(b.low(), std::pair(b.ring, b.corner));
    });
  }

  void check() const {
    for (const Polygon& ring : rings_)
      for (std::size_t i = 0; i < ring.size(); ++i)
        check_corner(ring[i], ring[(i + 1) % ring.size()], ring[(i + 2) % ring.size()]);
    for (std::size_t i = 0; i < lines_.size(); ++i)
      for (std::size_t k = i + 1; k < lines_.size() && lines_[k].low() < lines_[i].high() + same_m_;
           ++k)
        check_pair(lines_[i], lines_[k]);
  }

 private:
  struct Line {
    Vector2d from, to;
    std::size_t ring = 0, corner = 0;
    [[nodiscard]] double low() const { return std::min(from.x(), to.x()); }
    [[nodiscard]] double high() const { return std::max(from.x(), to.x()); }
  };

  [[noreturn]] void refuse(const std::string& what, const std::string& remedy) const {
    throw bad_input(what, {.file = file_.string()}, remedy);
  }
  [[nodiscard]] bool is_near(const Line& line, const Vector2d& p) const {
    return distance_m({line.from, line.to}, p) < same_m_;
  }
  [[nodiscard]] bool follows(const Line& a, const Line& b) const {
    return a.ring == b.ring && b.corner == (a.corner + 1) % rings_[a.ring].size();
  }

  /// Intersection of the infinite lines through both.
  static Vector2d crossing(const Line& a, const Line& b) {
    const Vector2d along = a.to - a.from, other = b.to - b.from, apart = b.from - a.from;
    return a.from + cross(apart, other) / cross(along, other) * along;
  }

  void check_corner(const Vector2d& before, const Vector2d& corner, const Vector2d& after) const {
    if (distance_m({before, corner}, after) < same_m_ ||
        distance_m({corner, after}, before) < same_m_)
      refuse("the outline runs back on itself at " + place_of(corner),
             "draw a cut as a slit with a width, and leave out what is drawn by mistake");
  }

  void check_pair(const Line& a, const Line& b) const {
    if (follows(a, b) || follows(b, a)) return;
    if (std::min(a.from.y(), a.to.y()) > std::max(b.from.y(), b.to.y()) + same_m_ ||
        std::min(b.from.y(), b.to.y()) > std::max(a.from.y(), a.to.y()) + same_m_)
      return;
    if (crosses(a.from, a.to, b.from, b.to))
      refuse("two lines of the outline cross near " + place_of(crossing(a, b)),
             "an outline must not cross itself, nor its holes");
    if (!is_near(a, b.from) && !is_near(a, b.to) && !is_near(b, a.from) && !is_near(b, a.to))
      return;
    const Polygon &one = rings_[a.ring], &other = rings_[b.ring];
    if (a.ring != b.ring && runs_along(one, other, same_m_) && runs_along(other, one, same_m_))
      refuse("the ring about " + place_of(a.from) + " stands there twice", "keep one of the two");
    const Vector2d at = is_near(a, b.from)   ? b.from
                        : is_near(a, b.to)   ? b.to
                        : is_near(b, a.from) ? a.from
                                             : a.to;
    refuse("two lines of the outline touch near " + place_of(at),
           "an outline must not touch itself, nor its holes: leave cloth between them");
  }

  const std::vector<Polygon>& rings_;
  double same_m_;
  const fs::path& file_;
  std::vector<Line> lines_;
};

void check_holes(const ClothOutline& outline) {
  const auto refuse = [&](const Polygon& ring, const char* what, const char* remedy) {
    throw bad_input("the ring about " + place_of(ring.front()) + what,
                    {.file = outline.file.string()}, remedy);
  };
  for (const Polygon& hole : outline.holes) {
    if (!contains(outline.outer, hole.front()))
      refuse(hole, " is not inside the largest one",
             "a piece of cloth has one outer line; drape two apart");
    for (const Polygon& other : outline.holes)
      if (&other != &hole && contains(other, hole.front()))
        refuse(hole, " is inside a hole", "an island is a piece of its own: drape it apart");
  }
}

}  // namespace

ClothOutline read_outline(const fs::path& file, double spacing_m) {
  const bool svg = file.extension() == ".svg";
  if (!svg && file.extension() != ".csv")
    throw bad_input("an outline is an .svg or a .csv file", {.file = file.string()},
                    "export the outline as SVG, or write its corners as ring,warp_mm,weft_mm");
  std::vector<Polygon> rings =
      svg ? SvgReader(file, spacing_m).read() : rings_of_csv(file, spacing_m);
  if (rings.empty())
    throw bad_input("the file has no closed outline", {.file = file.string()},
                    "draw one closed path, polygon, rectangle, circle or ellipse");
  for (const Polygon& ring : rings)
    if (ring.size() < 3)
      throw bad_input("the ring about " + place_of(ring.front()) +
                          " has fewer than three corners in different places",
                      {.file = file.string()}, "draw a cut as a slit with a width");
  std::stable_sort(rings.begin(), rings.end(),
                   [](const Polygon& a, const Polygon& b) { return area_of(a) > area_of(b); });
  LinesApart(rings, kSamePlace * spacing_m, file).check();
  ClothOutline outline;
  outline.outer = std::move(rings.front());
  outline.holes.assign(std::make_move_iterator(rings.begin() + 1),
                       std::make_move_iterator(rings.end()));
  outline.file = file;
  check_holes(outline);
  return outline;
}

}  // namespace drape::simulate
