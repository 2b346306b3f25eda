// SPDX-License-Identifier: Apache-2.0
#include "compare/drape_input.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "simulate/drape/outline.hpp"
#include "simulate/fabric/fabric.hpp"
#include "simulate/fabric/import.hpp"
#include "simulate/start/start_file.hpp"
#include "tests/fuzz/kinds.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kKesSheet =
    "property,unit,warp,weft\nW,mg/cm2,13.8,\nEMT,%,4,8\nLT,-,0.7,0.7\nRT,%,55,55\n"
    "G,gf/cm.deg,0.6,0.7\n2HG,gf/cm,0.5,0.5\n2HG5,gf/cm,1.4,1.4\nB,gf.cm2/cm,0.088,0.059\n";
constexpr const char* kFastSheet =
    "property,unit,warp,weft\nW,g/m2,200,\nC,mm,17,16\nE5,%,0.4,0.6\nE20,%,1.1,1.7\n"
    "E100,%,2.9,4.4\nEB5,%,3.1,\n";
constexpr const char* kMaterial =
    R"({"schema":"1.1","custom":{"browzwear":{"mass":"105.6","bend":{"length":"43","width":52.8}}}})";
constexpr const char* kOtherMesh =
    "schema = \"drapebench/mesh/1\"\nname = \"Other 1.0\"\nmesh = \"other.ply\"\nunit_mm = "
    "1.0\nscene = \"A\"\n[grid]\ninner = \"weft\"\ninner_count = 2\nwarp_from_mm = "
    "40.0\nwarp_to_mm = 0.0\nweft_from_mm = 0.0\nweft_to_mm = 40.0\n";
constexpr const char* kOtherPly =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float "
    "z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n40 0 0\n0 40 "
    "0\n40 40 0\n3 0 1 2\n";
constexpr const char* kBranches = R"({"schema": "drapebench/branches/1",
 "scene_round_about_the_vertical": false, "members_at_rest": 3,
 "band": [{"row": 0, "col": 1, "mean_mm": [1, 2, 3], "low_mm": [1, 2, 3],
 "high_mm": [1, 2, 3], "radius95_mm": 0.5}],
 "friction_band": {"friction": 0.4,
 "pushes": [{"push_per_weight": [0.2, 0, 0], "ending": "at rest", "moves_mm": [[0.1, 0, 0]]}],
 "marks": [{"row": 0, "col": 1, "rest_mm": [1, 2, 3], "low_mm": [1, 2, 3],
 "high_mm": [1.1, 2, 3]}]},
 "beyond_first_order": {"marks_at": [[0, 1]], "rests": [{"ending": "at rest", "moves_mm": [[0, 1, 0]],
 "first_order_mm": [[0, 1, 0]]}]},
 "measured": {"nearest_branch": 1, "branch": null, "distance_mm": 2.5, "reach_mm": 1,
 "fraction_of_marks_in_band": 0.5, "started_there": "at rest", "started_there_distance_mm": 0.1},
 "branches": [{"branch": 1, "sheet": "branch-01/sheet.ply", "energy_uJ": 7188.8,
 "largest_residual_per_particle_weight": 6.3e-8, "stable": true, "starts": [0, 1],
 "hem_nodes": 4}]})";

constexpr const char* kOutline =
    "<svg xmlns='http://www.w3.org/2000/svg' width='20cm' height='20cm' viewBox='0 0 200 200'><g "
    "transform='translate(1,2) rotate(30 100 100) scale(.9)'><path d='M10 10h150a20 20 0 0 1 0 "
    "40V190C90 170 60 150 10 190Q0 100 10 10z'/><circle cx='80' cy='90' r='12'/></g></svg>";

/// Writes a file with this text, and optionally another beside it.
std::function<fs::path(const fs::path&)> with(const std::string& name, const std::string& text,
                                              const std::string& other = "",
                                              const std::string& other_text = "") {
  return [=](const fs::path& folder) {
    if (!other.empty()) write_durable(folder / other, other_text);
    write_durable(folder / name, text);
    return folder / name;
  };
}

/// Copies bench1's fabric with its curves.
fs::path make_fabric(const fs::path& folder) {
  fs::copy(source_root() / "rigs/bench1/fabrics", folder / "fabrics", fs::copy_options::recursive);
  fs::permissions(folder / "fabrics/A.toml", fs::perms::owner_write, fs::perm_options::add);
  return folder / "fabrics/A.toml";
}

fs::path make_published(const fs::path& folder) {
  write_durable(folder / "published.csv", read_text(source_root() / "rigs/fabrics/published.csv"));
  return folder / "published.csv";
}

/// Writes an imported fabric as its command does, which judges it.
void write_and_judge(const fs::path& file, const simulate::ImportedFabric& fabric) {
  fs::remove_all(file.parent_path() / "imported");
  static_cast<void>(simulate::write_imported(file.parent_path() / "imported", fabric));
}

void import_all(const fs::path& file) {
  for (const auto& fabric : simulate::read_published(file)) {
    try {
      static_cast<void>(simulate::import_published(fabric));
    } catch (const Error&) {  // a fabric without bending stiffness
    }
  }
}

}  // namespace

std::vector<Kind> stage_kinds() {
  return {
      {"fabric", make_fabric,
       [](const fs::path& f) { static_cast<void>(simulate::read_fabric(f)); }},
      {"kes", with("kes.csv", kKesSheet),
       [](const fs::path& f) { write_and_judge(f, simulate::import_kes(f, "cotton")); }},
      {"fast", with("fast.csv", kFastSheet),
       [](const fs::path& f) { write_and_judge(f, simulate::import_fast(f, "wool")); }, true,
       "EB5"},
      {"u3m", with("cupro.u3m", kMaterial),
       [](const fs::path& f) { write_and_judge(f, simulate::import_u3m(f, "cupro", "dyn.cm")); },
       true, "another type|size"},  // its numbers may be texts; its schema is not read
      // Numbers may be absent; all else are free texts.
      {"published", make_published, import_all, true, "."},
      {"other_mesh", with("other.toml", kOtherMesh, "other.ply", kOtherPly),
       [](const fs::path& f) {
         if (!compare::read_other_surface(f))
           static_cast<void>(compare::read_other_mesh(f, small_sheet()));
       }},
      {"start_mesh", with("other.toml", kOtherMesh, "other.ply", kOtherPly),
       [](const fs::path& f) {
         Print print;
         print.rows = print.cols = 2;
         print.pitch_m = 0.04;
         print.patch_m = {0.04, 0.04};
         print.margin_m = {0, 0};
         static_cast<void>(simulate::read_start(f, print));
       }},
      {"outline_svg", with("piece.svg", kOutline),
       [](const fs::path& f) { static_cast<void>(simulate::read_outline(f, 0.01)); }, true,
       "encoding"},  // XML knows UTF-16
      {"outline_csv",
       with("piece.csv", "ring,warp_mm,weft_mm\n0,0,0\n0,90,0\n0,0,80\n1,9,9\n1,9,20\n1,20,9\n"),
       [](const fs::path& f) { static_cast<void>(simulate::read_outline(f, 0.01)); }},
      {"branches", with("branches.json", kBranches, "branch-01/sheet.ply", "ply\n"),
       [](const fs::path& f) {
         static_cast<void>(compare::branch_of(f.parent_path() / "branch-01/sheet.ply"));
       },
       true, "out of range: .*(_mm|push)"},  // places without a limit
  };
}

}  // namespace drape::test
