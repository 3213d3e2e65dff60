#include "problems/inspection/fix_agreement.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>

#include "problems/inspection/clear.h"
#include "problems/inspection/following_filter.h"
#include "problems/log/fixes.h"
#include "problems/result/statistics.h"
#include "problems/trajectory/mocap_path.h"

namespace trueline {
namespace {

constexpr std::size_t kFewestOfGate = 5;                  // fixes
constexpr double kFixLagReach = 2.0, kFixLagStep = 0.02;  // s

// What a fix differs from mocap by.
struct Off {
  int gate;
  Eigen::Vector3d off;  // m
};
using Offs = std::vector<Off>;

Eigen::Vector3d MedianOf(std::span<const Off> offs) {
  Eigen::Vector3d median;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    values.reserve(offs.size());
    for (const Off& one : offs) values.push_back(one.off[axis]);
    median[axis] = LowerMedian(values);
  }
  return median;
}

using Middles = std::map<int, Eigen::Vector3d>;

std::map<int, Offs> ByGate(const Offs& offs) {
  std::map<int, Offs> gates;
  for (const Off& one : offs) gates[one.gate].push_back(one);
  return gates;
}

// The displacement of each gate, or of all of them.
Middles MiddlesOf(const Offs& offs, bool by_gate) {
  Middles middles;
  const Eigen::Vector3d of_all = MedianOf(offs);
  for (const auto& [gate, own] : ByGate(offs)) middles[gate] = by_gate ? MedianOf(own) : of_all;
  return middles;
}

// m, median distance from these displacements.
double Spread(std::span<const Off> offs, const Middles& middles) {
  std::vector<double> distances;
  distances.reserve(offs.size());
  for (const Off& one : offs) distances.push_back((one.off - middles.at(one.gate)).norm());
  return LowerMedian(distances);
}

// Fixes that mocap covers, before and after a change; `changed`: the same of those that change.
struct Side {
  Offs all, changed;
};
struct Change {
  Side before, after;
  Offs others;  // fixes that stay as they are
};

Change ChangeOf(const FlightLog& log, const std::vector<Fix>& fixes,
                const std::vector<Fix>& changed) {
  Change change;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    const Fix &old = fixes[i], &now = changed[i];
    const auto was = PositionAt(log.mocap, old.t), is = PositionAt(log.mocap, now.t);
    if (!was || !is) continue;
    change.before.all.push_back({old.gate, old.p_E - *was});
    change.after.all.push_back({now.gate, now.p_E - *is});
    if (old.t == now.t && old.p_E == now.p_E) {
      change.others.push_back(change.after.all.back());
      continue;
    }
    change.before.changed.push_back(change.before.all.back());
    change.after.changed.push_back(change.after.all.back());
  }
  return change;
}

double SpreadOf(const Side& side, bool by_gate) {
  return Spread(side.changed, MiddlesOf(side.all, by_gate));
}

bool IsSmallerInHalves(const Change& change) {
  const std::size_t half = change.before.changed.size() / 2;
  const std::span<const Off> before(change.before.changed), after(change.after.changed);
  const Middles was = MiddlesOf(change.before.all, false), is = MiddlesOf(change.after.all, false);
  return Spread(after.first(half), is) < Spread(before.first(half), was) &&
         Spread(after.subspan(half), is) < Spread(before.subspan(half), was);
}

// A part of the fixes that is right agrees with mocap as well as the others do.
bool FitsLikeOthers(const Change& change) {
  if (change.others.size() < 2 * kFewestOfGate) return true;
  return SpreadOf(change.after, false) <
         kLikely * Spread(change.others, MiddlesOf(change.after.all, false));
}

std::vector<Fix> Later(std::vector<Fix> fixes, double seconds) {
  for (Fix& fix : fixes) fix.t += FromSeconds(seconds);
  return fixes;
}

// At the lag that brings more than half of the fixes nearest to mocap.
Offs OffsAtBestLag(const FlightLog& log) {
  Offs best;
  double least = std::numeric_limits<double>::infinity();
  const int reach = static_cast<int>(std::round(kFixLagReach / kFixLagStep));
  for (int k = -reach; k <= reach; ++k) {
    Offs tried = ChangeOf(log, log.fixes, Later(log.fixes, -k * kFixLagStep)).after.all;
    if (tried.size() < kCovers * static_cast<double>(log.fixes.size())) continue;
    const double spread = Spread(tried, MiddlesOf(tried, false));
    if (spread >= least) continue;
    least = spread;
    best = std::move(tried);
  }
  return best;
}

void NoteGate(Examination* e, int gate, const Eigen::Vector3d& apart) {
  Finding finding{"gate_apart", "fixes", Level::kNote, apart.norm(), "m"};
  finding.text = fmt::format(
      "fixes of gate {} differ from mocap by ({:.2f}, {:.2f}, {:.2f}) m more than those of other "
      "gates; they are not compared with other streams",
      gate, apart.x(), apart.y(), apart.z());
  finding.remedy = "check this gate's place on the map; trueline diagnose tells more";
  e->Add(finding);
}

}  // namespace

void LeaveOutGatesApart(Examination* e) {
  if (e->fixed.fixes.size() < 2 * kFewestOfGate) return;
  const Offs offs = OffsAtBestLag(e->fixed);
  if (offs.size() < 2 * kFewestOfGate) return;
  const Eigen::Vector3d middle = MedianOf(offs);
  const double spread = Spread(offs, MiddlesOf(offs, false)), sigma = MedianSigma(e->fixed.fixes);
  if (spread > kLikely * sigma) return;  // most fixes differ by more than a lag
  const double usual = std::max(spread, sigma);
  for (const auto& [gate, own] : ByGate(offs)) {
    const Eigen::Vector3d apart = MedianOf(own) - middle;
    if (own.size() < kFewestOfGate || apart.norm() < kLikely * usual) continue;
    NoteGate(e, gate, apart);
    std::erase_if(e->fixed.fixes, [id = gate](const Fix& fix) { return fix.gate == id; });
  }
}

bool BringsFixesToMocap(const Examination& e, const std::vector<Fix>& before,
                        const std::vector<Fix>& changed) {
  const Change change = ChangeOf(e.fixed, before, changed);
  if (change.before.changed.size() < 2 * kFewestOfGate || !IsSmallerInHalves(change)) return false;
  if (!FitsLikeOthers(change)) return false;
  const double after = SpreadOf(change.after, false);
  const double by_gates = SpreadOf(change.before, true);
  const auto clearly = [](double less, double more) {
    return less * less < kExplains * more * more;
  };
  return clearly(after, SpreadOf(change.before, false)) &&
         (after < kAlikeRest * by_gates || clearly(SpreadOf(change.after, true), by_gates));
}

bool BringsFixesToMocap(const Examination& e, const StreamRepair& change) {
  FlightLog changed;
  changed.fixes = e.fixed.fixes;
  ApplyRepair("fixes", change, e.sources, &changed);
  return BringsFixesToMocap(e, e.fixed.fixes, changed.fixes);
}

}  // namespace trueline
