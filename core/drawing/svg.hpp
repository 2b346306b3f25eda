// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace drape {

/// Escapes text for an element or a double-quoted attribute of XML or HTML.
[[nodiscard]] std::string xml(const std::string& text);

/// Shortest decimal text of a coordinate, with at most two decimals.
[[nodiscard]] std::string coordinate(double value);

[[nodiscard]] std::string base64(const std::vector<unsigned char>& bytes);

/// A standalone SVG picture, built element by element. Styles are attributes, so the picture looks
/// the same in its own file, in a page and in print.
class Svg {
 public:
  /// `title` is the text for screen readers, `origin` the coordinates of the upper left corner.
  Svg(double width, double height, const std::string& title,
      const Eigen::Vector2d& origin = Eigen::Vector2d::Zero());

  void rectangle(double x, double y, double width, double height, const std::string& style,
                 const std::string& hover = {});
  void circle(const Eigen::Vector2d& centre, double radius, const std::string& style,
              const std::string& hover = {});
  void line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const std::string& style);
  void polyline(const std::vector<Eigen::Vector2d>& points, const std::string& style);
  void polygon(const std::vector<Eigen::Vector2d>& points, const std::string& style);
  /// `anchor` is "start", "middle" or "end".
  void text(const Eigen::Vector2d& at, const std::string& text, double size,
            const std::string& anchor = "start", const std::string& style = {});
  /// Text that reads upwards, centred on a point.
  void text_upwards(const Eigen::Vector2d& at, const std::string& text, double size);
  void open_group(const std::string& style);
  void close_group();

  [[nodiscard]] std::string finish() const;

 private:
  void element(const std::string& tag, const std::string& attributes, const std::string& hover);
  std::string body_;
};

}  // namespace drape
