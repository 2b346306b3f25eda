// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace drape::compare {

/// Text made safe inside an element or a double-quoted attribute.
[[nodiscard]] std::string xml(const std::string& text);

/// Shortest text of a coordinate with at most two decimals.
[[nodiscard]] std::string coordinate(double value);

/// A standalone SVG picture, built element by element. Styles are attributes, so the picture looks
/// the same in its own file, in the report and in print.
class Svg {
 public:
  /// `title` is what a screen reader says, `origin` the coordinates of the upper left corner.
  Svg(double width, double height, const std::string& title,
      const Eigen::Vector2d& origin = Eigen::Vector2d::Zero());

  void rectangle(double x, double y, double width, double height, const std::string& style,
                 const std::string& hover = {});
  void circle(const Eigen::Vector2d& centre, double radius, const std::string& style,
              const std::string& hover = {});
  void line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const std::string& style);
  void polyline(const std::vector<Eigen::Vector2d>& points, const std::string& style);
  void polygon(const std::vector<Eigen::Vector2d>& points, const std::string& style);
  /// `anchor` is start, middle or end.
  void text(const Eigen::Vector2d& at, const std::string& text, double size,
            const std::string& anchor = "start", const std::string& style = {});
  void image(double x, double y, double width, double height, const std::string& data_uri,
             const std::string& id = {});
  void open_group(const std::string& style);
  void close_group();

  [[nodiscard]] std::string finish() const;

 private:
  void element(const std::string& tag, const std::string& attributes, const std::string& hover);
  std::string head_;
  std::string body_;
};

/// Viridis (van der Walt & Smith 2015): even steps in lightness, safe for colour-blind readers and
/// in grey print. Lengths in mm.
class ErrorScale {
 public:
  /// From 0 to a round number at or above `largest_mm`.
  explicit ErrorScale(double largest_mm);
  [[nodiscard]] std::string colour(double value_mm) const;
  [[nodiscard]] bool is_dark(double value_mm) const;  ///< whether text on it must be light
  [[nodiscard]] double top_mm() const { return top_mm_; }
  [[nodiscard]] double step_mm() const { return step_mm_; }
  /// Bar with ticks and the words "distance real to virtual (mm)"; 40 units high.
  void draw(Svg& svg, double x, double y, double width) const;

 private:
  double top_mm_ = 1;
  double step_mm_ = 1;
};

/// 1, 2, 2.5 or 5 times a power of ten, so that about `count` steps reach `largest`.
[[nodiscard]] double round_step(double largest, int count);

/// Multiples of a step from one value to another, both included within a millionth of a step.
[[nodiscard]] std::vector<double> ticks(double low, double high, double step);

[[nodiscard]] std::string base64(const std::vector<unsigned char>& bytes);
/// "data:image/jpeg;base64,..."
[[nodiscard]] std::string jpeg_data_uri(const std::vector<unsigned char>& bytes);

}  // namespace drape::compare
