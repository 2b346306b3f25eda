// SPDX-License-Identifier: Apache-2.0
// Marks on the drapes of shared/data/grid-drapes (another discretisation, all parameters known), as
// a bench would measure them, compared with statements an operator might make about them.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/files/files.hpp"
#include "core/geometry/body.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"
#include "tests/support/bench1_truth.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/trials.hpp"
#include "triangulate/guards/guards.hpp"
#include "triangulate/guards/held.hpp"
#include "triangulate/guards/objects.hpp"

namespace drape::triangulate {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::HasSubstr;
using testing::IsEmpty;
using units::deg;
using units::mm;

class Normal {
 public:
  explicit Normal(std::uint64_t seed) : random_(seed) {}
  double operator()() {
    return std::sqrt(-2 * std::log(1 - random_.uniform())) *
           std::cos(2 * std::numbers::pi * random_.uniform());
  }
  Vector3d vector() { return {(*this)(), (*this)(), (*this)()}; }
  SplitMix64& even() { return random_; }

 private:
  SplitMix64 random_;
};

/// A drape with marks as a bench measures them, and its true scene.
struct DrawnDrape {
  std::string name;
  Scene scene;
  Sheet sheet;
  MarkLattice lattice;

  /// All guards that use a scene, except for the pitch and the cameras.
  [[nodiscard]] std::vector<std::string> contradictions(const Scene& stated) const {
    const SeenCloth seen{sheet, spans_of(sheet, 0.01)};
    std::vector<std::string> found = contradictions_of_objects(seen, stated);
    if (found.empty()) found = contradictions_of_support(seen, stated);
    const auto held = contradictions_of_held(sheet, stated, lattice);
    found.insert(found.end(), held.begin(), held.end());
    if (!held.empty()) return found;
    const auto gravity = contradictions_of_gravity(MeasuredCloth(sheet), stated, lattice);
    found.insert(found.end(), gravity.begin(), gravity.end());
    return found;
  }
};

/// Marks every 22 mm at nodes of the grid. One in eight is a gap, and so are those that face down;
/// covariances of a bench: 0.02 mm, 0.04 mm along z.
DrawnDrape drawn(const fs::path& folder, Normal& normal) {
  DrawnDrape drape;
  drape.name = folder.filename();
  drape.scene = read_scene(folder / "scene.toml");
  MarkLattice& lattice = drape.lattice;
  lattice.rows = lattice.cols = 10;
  lattice.pitch_m = 22 * mm;
  lattice.margin_m = {11 * mm, 11 * mm};
  lattice.patch_m = {220 * mm, 220 * mm};
  for (Pin& pin : drape.scene.pins)  // they name marks of another print
    pin.at_material_m = Vector2d(10 + 20 * pin.mark.row, 10 + 20 * pin.mark.col) * mm;
  drape.sheet.rows = drape.sheet.cols = 10;
  drape.sheet.patch_m = lattice.patch_m;
  const Csv rest = read_csv(folder / "rest.csv", {"warp_mm", "weft_mm", "x_mm", "y_mm", "z_mm"});
  const auto node = [&](int i, int k) -> Vector3d {
    const auto at = static_cast<std::size_t>(21 * i + k);
    return Vector3d(rest.columns[2][at], rest.columns[3][at], rest.columns[4][at]) * mm;
  };
  const Eigen::Matrix3d covariance_m2 = (Vector3d(0.02, 0.02, 0.04) * mm).cwiseAbs2().asDiagonal();
  for (int row = 0; row < 10; ++row) {
    for (int col = 0; col < 10; ++col) {
      const int i = 2 * row + 1, k = 2 * col + 1;
      const Vector3d up = (node(i, k + 1) - node(i, k - 1)).cross(node(i - 1, k) - node(i + 1, k));
      const bool hangs = !drape.scene.pins.empty();
      const bool is_seen = hangs || up.normalized().z() > -0.3;
      if (!is_seen || normal.even().below(8) == 0) {
        drape.sheet.gaps.push_back({{row, col}, "seen by one camera"});
        continue;
      }
      const Vector3d error = Vector3d(0.02, 0.02, 0.04).cwiseProduct(normal.vector()) * mm;
      drape.sheet.marks.push_back({{row, col},
                                   lattice.margin_m + lattice.pitch_m * Vector2d(row, col),
                                   node(i, k) + error,
                                   covariance_m2,
                                   3,
                                   0.05});
    }
  }
  return drape;
}

std::vector<fs::path> drape_folders() {
  std::vector<fs::path> folders;
  const auto data = test::reference_data("grid-drapes");
  if (!data) return folders;
  for (const auto& entry : fs::directory_iterator(*data))
    if (entry.is_directory()) folders.push_back(entry.path());
  std::sort(folders.begin(), folders.end());
  return folders;
}

/// Moves the object within the uncertainty of a ruler.
void state_by_ruler(Scene& scene, Normal& normal) {
  for (Obstacle& object : scene.obstacles) {
    Change change = Change::Zero();
    change.head<3>() = 0.5 * normal.vector();
    change[4] = 0.5 * normal();
    object = changed(object, change);
  }
  for (Pin& pin : scene.pins) *pin.point_in_world += 0.5 * mm * normal.vector();
}

class DrawnMarks : public testing::Test {
 protected:
  void SetUp() override {
    if (drape_folders().empty()) GTEST_SKIP() << "the reference data lack grid-drapes";
  }
};

TEST_F(DrawnMarks, GiveNoAlarmWhereAllIsStatedWithinItsUncertainty) {
  int alarms = 0, hangs = 0, trials = 0;
  for (const fs::path& folder : drape_folders()) {
    Normal normal(static_cast<std::uint64_t>(trials));
    const DrawnDrape drape = drawn(folder, normal);
    Scene stated = drape.scene;
    state_by_ruler(stated, normal);
    const auto found = drape.contradictions(stated);
    EXPECT_THAT(found, IsEmpty()) << drape.name;
    alarms += !found.empty();
    hangs += !drape.scene.pins.empty();
    ++trials;
  }
  fmt::print("{} of {} drapes ({} hung) with an alarm\n", alarms, trials, hangs);
}

struct Slip {
  const char* name;
  const char* key;  ///< key that the message names
  void (*make)(Scene&);
};

TEST_F(DrawnMarks, NameEveryMistakeAboutPinsWithWhatIsTrue) {
  const std::vector<Slip> slips = {
      {"pin 15 mm beside", "pin 1, at_mm",
       [](Scene& s) { s.pins[0].point_in_world->x() += 15 * mm; }},
      {"rods 6 mm too high", "at_mm",
       [](Scene& s) {
         for (Pin& p : s.pins) p.point_in_world->z() += 6 * mm;
       }},
      {"the other hem", "at_mm",
       [](Scene& s) {
         for (Pin& p : s.pins) p.at_material_m->x() = 220 * mm - p.at_material_m->x();
       }},
      {"the other diagonal", "at_mm",
       [](Scene& s) { s.pins[1].at_material_m->x() = 220 * mm - s.pins[1].at_material_m->x(); }},
      {"warp and weft exchanged", "at_mm",
       [](Scene& s) {
         for (Pin& p : s.pins) std::swap(p.at_material_m->x(), p.at_material_m->y());
       }},
      {"the other face", "at_mm",
       [](Scene& s) { std::swap(s.pins[0].point_in_world, s.pins[1].point_in_world); }},
      {"centimetres", "at_mm",
       [](Scene& s) {
         for (Pin& p : s.pins) *p.point_in_world *= 0.1;
       }},
      {"material in centimetres", "at_mm",
       [](Scene& s) {
         for (Pin& p : s.pins) *p.at_material_m *= 0.1;
       }},
      {"inches", "at_mm",
       [](Scene& s) {
         for (Pin& p : s.pins) *p.point_in_world /= 25.4;
       }},
      {"sign of y", "at_mm",
       [](Scene& s) {
         for (Pin& p : s.pins) p.point_in_world->y() *= -1;
       }},
      {"x and y exchanged", "at_mm",
       [](Scene& s) {
         for (Pin& p : s.pins) std::swap(p.point_in_world->x(), p.point_in_world->y());
       }},
      {"everything 10 mm beside", "at_mm",
       [](Scene& s) {
         for (Pin& p : s.pins) p.point_in_world->y() += 10 * mm;
       }},
      {"gravity tilted by 3 degrees", "gravity_m_per_s2",
       [](Scene& s) {
         s.gravity_m_per_s2 = Eigen::AngleAxisd(3 * deg, Vector3d::UnitX()) * s.gravity_m_per_s2;
       }},
      {"gravity along y", "gravity_m_per_s2",
       [](Scene& s) {
         s.gravity_m_per_s2 = {0, 0.35 * 9.80665, -0.937 * 9.80665};
       }},
  };
  const int most = test::trial_count(2, 27) * static_cast<int>(slips.size());
  int silent = 0, trials = 0, suggested = 0, right = 0;
  for (const fs::path& folder : drape_folders()) {
    Normal normal(static_cast<std::uint64_t>(trials));
    const DrawnDrape drape = drawn(folder, normal);
    if (drape.scene.pins.empty() || trials >= most) continue;
    for (const Slip& slip : slips) {
      Scene stated = drape.scene;
      slip.make(stated);
      const auto found = drape.contradictions(stated);
      ++trials;
      silent += found.empty();
      EXPECT_THAT(found, testing::Contains(HasSubstr(slip.key))) << drape.name << ": " << slip.name;
      const auto other = suggested_holding(drape.sheet, stated, drape.lattice);
      if (!other) continue;
      ++suggested;
      EXPECT_THAT(drape.contradictions(other->scene), IsEmpty()) << drape.name << ": " << slip.name;
      // It does not matter which pin holds which true point.
      const auto is_held = [&](const Pin& truth) {
        return std::any_of(other->scene.pins.begin(), other->scene.pins.end(), [&](const Pin& pin) {
          return (*pin.at_material_m - *truth.at_material_m).norm() < 1e-9 &&
                 (*pin.point_in_world - *truth.point_in_world).norm() <=
                     std::max(other->expanded_m, 1e-9);
        });
      };
      const bool is_right = std::all_of(drape.scene.pins.begin(), drape.scene.pins.end(), is_held);
      right += is_right;
      EXPECT_TRUE(is_right) << drape.name << ": " << slip.name << ": " << other->what;
    }
  }
  fmt::print("{} of {} silent; {} suggestions, {} right\n", silent, trials, suggested, right);
  EXPECT_EQ(silent, 0);
}

/// Difference between two objects as stated in their scenes: mm, and degrees of rotation.
Change difference(const Obstacle& one, const Obstacle& other) {
  Change change = Change::Zero();
  if (const auto* a = std::get_if<Box>(&one)) {
    const auto& b = std::get<Box>(other);
    change.head<3>() = (a->world_from_box.translation_m - b.world_from_box.translation_m) / mm;
    change[2] -= 0.5 * (a->size_m.z() - b.size_m.z()) / mm;
    const Eigen::Matrix3d turn = a->world_from_box.rotation.transpose() * b.world_from_box.rotation;
    const bool is_square = std::abs(a->size_m.x() - a->size_m.y()) < 0.5 * mm;
    change[3] = std::remainder(std::atan2(turn(1, 0), turn(0, 0)) / deg, is_square ? 90 : 180);
    change[4] = (a->size_m - b.size_m).cwiseAbs().maxCoeff() / mm;
  } else if (const auto* ball = std::get_if<Sphere>(&one)) {
    const auto& b = std::get<Sphere>(other);
    change.head<2>() = (ball->centre_in_world - b.centre_in_world).head<2>() / mm;
    change[4] = 2 * (ball->radius_m - b.radius_m) / mm;
  } else if (const auto* body = std::get_if<Cylinder>(&one)) {
    const auto& b = std::get<Cylinder>(other);
    change.head<3>() =
        (body->world_from_cylinder.translation_m - b.world_from_cylinder.translation_m) / mm;
    change[4] = 2 * (body->radius_m - b.radius_m) / mm;
  }
  return change;
}

TEST_F(DrawnMarks, SuggestAPoseThatIsTrueWithinItsRange) {
  const int count = test::trial_count(8, 100);
  int trials = 0, contradicted = 0, suggested = 0, good = 0;
  for (int k = 0; trials < count; ++k) {
    const auto folders = drape_folders();
    const fs::path& folder = folders.at(static_cast<std::size_t>(k) % folders.size());
    Normal normal(static_cast<std::uint64_t>(1000 + k));
    const DrawnDrape drape = drawn(folder, normal);
    if (drape.scene.obstacles.empty()) continue;
    Scene stated = drape.scene;
    const bool is_box = std::holds_alternative<Box>(stated.obstacles[0]);
    Change change = Change::Zero();
    const double turn = 2 * std::numbers::pi * normal.even().uniform();
    const double by_mm = 8 + 17 * normal.even().uniform();
    const std::uint64_t kind = normal.even().below(is_box ? 3 : 1);
    if (kind != 1) change.head<2>() = by_mm * Vector2d(std::cos(turn), std::sin(turn));
    if (kind != 0)
      change[3] = (normal.even().below(2) == 0 ? 1 : -1) * (10 + 25 * normal.even().uniform());
    stated.obstacles[0] = changed(stated.obstacles[0], change);
    ++trials;
    const SeenCloth seen{drape.sheet, spans_of(drape.sheet, 0.01)};
    if (contradictions_of_objects(seen, stated).empty()) continue;
    ++contradicted;
    const ObjectSuggestion found = suggested_object(seen, stated, 0);
    if (!found.one) continue;
    ++suggested;
    Scene other = stated;
    other.obstacles[0] = found.one->object;
    const bool is_go = drape.contradictions(other).empty();
    const Change off = difference(found.one->object, drape.scene.obstacles[0]);
    const bool is_true = (off.cwiseAbs() - found.one->within).maxCoeff() <= 0.1;  // as printed
    good += is_go && is_true;
    EXPECT_TRUE(is_go) << drape.name << ": " << found.one->text;
    if (!is_true) fmt::print("{}: {}, beyond its U\n", drape.name, found.one->text);
  }
  fmt::print("{} wrong poses, {} contradicted, {} suggestions, {} of them GO and true\n", trials,
             contradicted, suggested, good);
  EXPECT_GE(suggested, 0.6 * trials);
  EXPECT_GE(good, 0.93 * suggested);
}

/// Marks from bench1's renderer that face two cameras, with a bench's covariance.
DrawnDrape bench1_drape(const std::string& name, Normal& normal) {
  DrawnDrape drape;
  drape.name = name;
  drape.scene = read_scene(test::source_root() / "rigs/bench1/scenes" / (name + ".toml"));
  drape.lattice = {Surface::cloth,     11, 11, 20 * mm, 4 * mm, {220 * mm, 220 * mm},
                   {10 * mm, 10 * mm}, ""};
  drape.sheet.rows = drape.sheet.cols = 11;
  drape.sheet.patch_m = drape.lattice.patch_m;
  for (const test::TrueDot& dot : test::bench1_truth().drapes.at(name)) {
    if (dot.facing_views(70) < 2) {
      drape.sheet.gaps.push_back({dot.mark, "seen by one camera"});
      continue;
    }
    drape.sheet.marks.push_back(
        {dot.mark, drape.lattice.margin_m + 20 * mm * Vector2d(dot.mark.row, dot.mark.col),
         dot.point_in_world + 0.02 * mm * normal.vector(),
         std::pow(0.02 * mm, 2) * Eigen::Matrix3d::Identity(), 3, 0.05});
  }
  return drape;
}

void change_object(Scene& scene, const Vector3d& by_mm, double larger_mm = 0) {
  scene.obstacles[0] = changed(
      scene.obstacles[0], (Change() << by_mm.x(), by_mm.y(), by_mm.z(), 0, larger_mm).finished());
}

void turn_to(Scene& scene, double yaw_deg) {
  std::get<Box>(scene.obstacles[0]).world_from_box.rotation =
      Eigen::AngleAxisd(yaw_deg * deg, Vector3d::UnitZ()).toRotationMatrix();
}

void take_objects(Scene& scene, const std::string& of) {
  scene.obstacles =
      read_scene(test::source_root() / "rigs/bench1/scenes" / (of + ".toml")).obstacles;
}

void raise_all(Scene& scene, double by_mm) {
  change_object(scene, {0, 0, by_mm});
  scene.table_z_m += by_mm * mm;
}

TEST(Bench1Marks, NameEveryMistakeAboutObjectsAndTable) {
  struct ObjectSlip {
    const char* drape;
    const char* what;
    void (*make)(Scene&);
  };
  const std::vector<ObjectSlip> slips = {
      {"A", "radius for the diameter",
       [](Scene& s) {
         change_object(s, {0, 0, 0}, -45);
       }},
      {"A", "diameter of another ball",
       [](Scene& s) {
         change_object(s, {0, 0, 0}, -10);
       }},
      {"A", "circumference in cm",
       [](Scene& s) {
         change_object(s, {0, 0, 0}, 28.3 - 90);
       }},
      {"A", "places ten times",
       [](Scene& s) {
         change_object(s, {36, -27, 0});
       }},
      {"A", "12 mm beside",
       [](Scene& s) {
         change_object(s, {12, 0, 0});
       }},
      {"A", "everything 10 mm too low", [](Scene& s) { raise_all(s, -10); }},
      {"A", "everything 10 mm too high", [](Scene& s) { raise_all(s, 10); }},
      {"A", "the box of C", [](Scene& s) { take_objects(s, "C"); }},
      {"A", "the box of E", [](Scene& s) { take_objects(s, "E"); }},
      {"C", "yaw with the other sign", [](Scene& s) { turn_to(s, -14); }},
      {"C", "turned by 31 degrees", [](Scene& s) { turn_to(s, 45); }},
      {"C", "8 mm beside along x",
       [](Scene& s) {
         change_object(s, {8, 0, 0});
       }},
      {"C", "8 mm beside along y",
       [](Scene& s) {
         change_object(s, {0, -8, 0});
       }},
      {"C", "x and y exchanged",
       [](Scene& s) {
         change_object(s, {8, -8, 0});
       }},
      {"C", "a corner for the centre",
       [](Scene& s) {
         change_object(s, {64, 64, 0});
       }},
      {"C", "5 mm too small",
       [](Scene& s) {
         change_object(s, {0, 0, 0}, -5);
       }},
      {"C", "5 mm too large",
       [](Scene& s) {
         change_object(s, {0, 0, 0}, 5);
       }},
      {"C", "size in cm",
       [](Scene& s) {
         change_object(s, {0, 0, 0}, 12.8 - 128);
       }},
      {"C", "the ball of A", [](Scene& s) { take_objects(s, "A"); }},
      {"C", "the box of E", [](Scene& s) { take_objects(s, "E"); }},
      {"C", "everything 5 mm too low", [](Scene& s) { raise_all(s, -5); }},
      {"E", "places ten times",
       [](Scene& s) {
         change_object(s, {45, 18, 0});
       }},
      {"E", "6 mm too small",
       [](Scene& s) {
         change_object(s, {0, 0, 0}, -6);
       }},
      {"E", "6 mm too large",
       [](Scene& s) {
         change_object(s, {0, 0, 0}, 6);
       }},
      {"E", "turned by 45 degrees", [](Scene& s) { turn_to(s, 37); }},
      {"E", "the box of C", [](Scene& s) { take_objects(s, "C"); }},
      {"E", "everything 5 mm too low", [](Scene& s) { raise_all(s, -5); }},
  };
  Normal normal(1);
  const DrawnDrape a = bench1_drape("A", normal), c = bench1_drape("C", normal),
                   e = bench1_drape("E", normal);
  for (const DrawnDrape* drape : {&a, &c, &e})
    EXPECT_THAT(drape->contradictions(drape->scene), IsEmpty()) << drape->name;
  int silent = 0;
  for (const ObjectSlip& slip : slips) {
    const DrawnDrape& drape = *slip.drape == 'A' ? a : *slip.drape == 'C' ? c : e;
    Scene stated = drape.scene;
    slip.make(stated);
    const auto found = drape.contradictions(stated);
    silent += found.empty();
    EXPECT_THAT(found, testing::Contains(HasSubstr(drape.name + ".toml")))
        << slip.drape << ": " << slip.what;
  }
  fmt::print("{} of {} silent\n", silent, slips.size());
}

}  // namespace
}  // namespace drape::triangulate
