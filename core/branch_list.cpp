// SPDX-License-Identifier: Apache-2.0
#include "core/branch_list.hpp"

#include <algorithm>

#include "core/sensitivity.hpp"
#include "core/units.hpp"

namespace drape {

using Eigen::Index;
using Eigen::MatrixX3d;
using units::mm;

namespace {

constexpr double uj = 1e-6;

void row_and_col(Fields& f, MarkId& mark) {
  f({"row", "mark along the warp", 1, 0}, mark.row);
  f({"col", "mark along the weft", 1, 0}, mark.col);
}

/// Requires one move per mark of each counted equilibrium; `known`: number of marks in the band.
void require_moves(Fields& f, const std::vector<OtherRest>& rests, std::size_t known) {
  for (const OtherRest& rest : rests)
    f.rule(!rest.moves_m || rest.moves_m->size() == known, "marks",
           "moves_mm has not three numbers for each mark", make_again);
}

}  // namespace

MatrixX3d one_a_row(const std::vector<Eigen::Vector3d>& moves) {
  MatrixX3d all(static_cast<Index>(moves.size()), 3);
  for (Index k = 0; k < all.rows(); ++k) all.row(k) = moves[static_cast<std::size_t>(k)];
  return all;
}

MatrixX3d OtherRest::moves() const {
  return one_a_row(*moves_m);
}

int FrictionBand::counted() const {
  return static_cast<int>(std::count_if(pushes.begin(), pushes.end(), [](const OtherRest& push) {
    return push.moves_m.has_value();
  }));
}

std::vector<double> FrictionBand::reach_m() const {
  std::vector<double> reach(marks.size(), 0.0);
  for (const OtherRest& push : pushes)
    for (std::size_t k = 0; push.moves_m && k < reach.size(); ++k)
      reach[k] = std::max(reach[k], (*push.moves_m)[k].norm());
  return reach;
}

MatrixX3d MemoryBand::extreme_m(double sign) const {
  MatrixX3d best = MatrixX3d::Zero(static_cast<Index>(marks.size()), 3);
  for (const OtherRest& end : ends)
    if (end.moves_m && sign * end.moves().col(2).mean() > sign * best.col(2).mean())
      best = end.moves();
  return best;
}

void fields(Fields& f, ListedBranch& branch) {
  f({"branch", "rank by energy; 1 is the lowest", 1, 1}, branch.number);
  f({"sheet", "path from the folder of this file"}, branch.sheet);
  f({"energy_uJ", "energy on the coarsest mesh, with heights from the world origin", uj},
    branch.energy_j);
  f({"largest_residual_per_particle_weight",
     "largest net force on a free point, in mean weights of a point", 1, 0},
    branch.residual);
  f({"stable", "false at a saddle point of the energy"}, branch.stable);
  f({"starts", "starts that ended there", 1, 0}, branch.starts);
  f.otherwise({"fraction", "fraction of the starts", 1, 0, 1}, branch.fraction);
  f.if_any({"sought", "true if found only by the search; absent if a start ended there"},
           branch.sought);
  f.otherwise({"friction", "friction of the scene", 1, 0}, branch.friction);
  f.otherwise(
      {"farthest_member_mm", "mean distance between the branch and its farthest member", mm, 0},
      branch.farthest_member_m);
  f({"hem_nodes", "number of folds along the hem", 1, 0}, branch.hem_nodes);
  f.otherwise(
      {"hem_radius_spectrum_mm", "Fourier amplitudes of the hem's radius, orders 0 to 8", mm},
      branch.hem_amplitudes_m);
  f.if_any({"spacing_mm", "spacing of the mesh of the sheet", mm, 0}, branch.spacing_m);
  f.if_any({"polish_mm", "mean displacement of the marks from the coarsest mesh", mm, 0},
           branch.polish_m);
  f.if_any({"not_polished", "reason why there is no equilibrium on the finer mesh"},
           branch.not_polished);
}

void fields(Fields& f, UnseenBranches& unseen) {
  f({"rests", "starts that ended on a branch", 1, 0}, unseen.rests);
  f({"seen_once", "branches reached by exactly one start", 1, 0}, unseen.seen_once);
  f({"fraction", "estimated fraction of starts that end on branches not seen", 1, 0, 1},
    unseen.fraction);
  f({"upper95", "upper 95 % bound of fraction", 1, 0, 1}, unseen.upper95);
}

void fields(Fields& f, RefusedStarts& one) {
  f({"starts", "starts that ended in this equilibrium", 1, 0}, one.starts);
  f({"why", "reason for the refusal"}, one.why);
}

void fields(Fields& f, BandMark& one) {
  row_and_col(f, one.mark);
  f({"mean_mm", "mean position in the world", mm}, one.mean_in_world);
  f({"low_mm", "2.5 % quantile per axis", mm}, one.low_in_world);
  f({"high_mm", "97.5 % quantile per axis", mm}, one.high_in_world);
  f({"radius95_mm", "radius about the mean that contains 95 % of the drapes", mm, 0},
    one.radius95_m);
}

void fields(Fields& f, OtherRest& rest) {
  f.if_any({"what", "loading history of this rest; absent if it is that of the drape"}, rest.what);
  f({"ending", "\"at rest\", or the reason why it is not counted"}, rest.ending);
  f.if_any({"push_per_weight", "largest push, in weights of the cloth, world axes"},
           rest.push_per_weight);
  f.if_any({"moves_mm", "displacement of each mark; absent if not counted", mm}, rest.moves_m);
}

void fields(Fields& f, MarkInterval& one) {
  row_and_col(f, one.mark);
  f({"rest_mm", "position at rest", mm}, one.rest_in_world);
  f({"low_mm", "minimum over all rests, per axis", mm}, one.low_in_world);
  f({"high_mm", "maximum over all rests, per axis", mm}, one.high_in_world);
}

void fields(Fields& f, FrictionBand& band) {
  f({"friction", "friction of the scene", 1, 0}, band.friction);
  f({"pushes", "rests after pushes that grew and were released; empty without friction"},
    band.pushes);
  f.if_any(
      {"other_frictions", "rests from the same start with the lowest and the highest friction"},
      band.ends);
  f({"marks", "range of positions of each mark"}, band.marks);
  require_moves(f, band.pushes, band.marks.size());
  require_moves(f, band.ends, band.marks.size());
  for (const OtherRest& push : band.pushes)
    f.rule(push.push_per_weight.has_value(), "pushes", "a push has no push_per_weight", make_again);
}

void fields(Fields& f, MemoryBand& band) {
  f({"place_of_rest",
     "height of the rest between the ends: 0 lowest, 1 highest; null if no other end counts", 1, 0,
     1},
    band.place_of_rest);
  f({"ends", "rests after other loading histories"}, band.ends);
  f({"marks", "marks in the order of the moves"}, band.marks);
  f.rule(!band.marks.empty(), "marks", "names no mark", make_again);
  require_moves(f, band.ends, band.marks.size());
}

void fields(Fields& f, ErringRest& rest) {
  f({"ending", "at rest, or why it counts for nothing"}, rest.ending);
  f.if_any({"moves_mm", "way of each mark; absent: it counts for nothing", mm}, rest.moves_m);
  f.if_any({"first_order_mm", "way of each mark to first order", mm}, rest.first_order_m);
}

void fields(Fields& f, BeyondFirstOrder& beyond) {
  marks_at(f, beyond.marks_at);
  f({"rests", "each with its own errors"}, beyond.rests);
  for (const ErringRest& rest : beyond.rests)
    for (const auto* moves : {&rest.moves_m, &rest.first_order_m})
      f.rule(moves->has_value() == rest.moves_m.has_value() &&
                 (!*moves || (*moves)->size() == beyond.marks_at.size()),
             "marks_at", "a rest has not three numbers for each mark", make_again);
}

void fields(Fields& f, OtherFriction& other) {
  f({"friction", "friction coefficient", 1, 0}, other.friction);
  f({"ending", "\"at rest\", or the reason why it is not counted"}, other.ending);
  f({"distance_mm", "mean distance from the measured drape", mm, 0}, other.distance_m);
}

void fields(Fields& f, PlacedDrape& placed) {
  f({"branch", "branch of the drape; null if none, or undecided without reach_mm", 1, 1},
    placed.branch);
  f({"nearest_branch", "nearest branch; null if none was found", 1, 1}, placed.nearest);
  f.if_any({"distance_mm", "mean distance of the marks from the nearest member", mm, 0},
           placed.distance_m);
  f.if_any({"reach_mm",
            "distance below which a drape counts as on a branch; absent if branches are no farther "
            "apart",
            mm, 0},
           placed.reach_m);
  f.if_any({"apart_mm", "distance between the nearest branch and the next one", mm, 0},
           placed.apart_m);
  f.if_any({"marks", "number of marks compared", 1, 0}, placed.marks);
  f.if_any({"fraction_of_marks_in_band", "fraction of the marks within their bands", 1, 0, 1},
           placed.inside_fraction);
  f({"started_there", "result of a start from the measured shape"}, placed.started_there);
  f({"started_there_distance_mm", "mean distance from the measured drape after that start", mm, 0},
    placed.started_there_m);
  f.if_any({"other_frictions", "the same start with both ends of an unmeasured friction's range"},
           placed.other_frictions);
}

void fields(Fields& f, BranchList& list) {
  f({"scene_round_about_the_vertical", "true if the scene is symmetric about a vertical axis"},
    list.round);
  f.otherwise({"linking_distance_mm", "equilibria closer than this are one branch", mm, 0},
              list.linked_m);
  f.otherwise({"starts_not_at_rest", "starts that did not come to rest", 1, 0}, list.not_at_rest);
  f.otherwise({"refused", "equilibria refused by the checker"}, list.refused);
  f({"branches", "equilibria by energy, lowest first"}, list.branches);
  f.if_any({"starts", "number of seeded starts", 1, 0}, list.starts);
  f.if_any({"unseen", "estimate of the starts that end on branches not seen"}, list.unseen);
  f.if_any({"members_at_rest", "starts that came to rest", 1, 0}, list.members_at_rest);
  f.otherwise({"band", "95 % bands of the marks; empty below 20 members"}, list.band);
  f.if_any({"friction_band", "positions in which friction can hold the drape"}, list.friction_band);
  f.if_any({"internal_friction_band", "positions in which internal friction can hold the drape"},
           list.memory_band);
  f.if_any({"beyond_first_order", "drapes of the own start with errors in all stated values"},
           list.beyond_first_order);
  f.if_any({"measured", "the real drape among the branches"}, list.measured);
}

}  // namespace drape
