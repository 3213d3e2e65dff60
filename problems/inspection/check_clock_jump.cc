// A clock that was set in flight, or a recorder that held fixes back: a part of the fixes fits
// mocap at another lag than the rest.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/inspection/examination.h"
#include "problems/inspection/fix_agreement.h"
#include "problems/inspection/vector_match.h"

namespace trueline {
namespace {

constexpr double kLongestJump = 1.5;      // s, each way
constexpr double kJumpStep = 0.05;        // s
constexpr double kLeastClockJump = 0.15;  // s
constexpr std::size_t kCoarseParts = 16;
constexpr std::size_t kLeastFixes = 12;  // of a part

// Of differences between fixes and mocap.
struct Differences {
  double n = 0.0, squares = 0.0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();

  Differences Plus(const Differences& o, double sign) const {
    return {n + sign * o.n, squares + sign * o.squares, sum + sign * o.sum};
  }
  double MeanSquareAbout(const Eigen::Vector3d& mean) const {
    return std::max(0.0, (squares - 2.0 * mean.dot(sum)) / n + mean.squaredNorm());
  }
};

// One part of the fixes at a lag, the rest at another one. Indices of fixes and lags.
struct Division {
  std::size_t from = 0, to = 0, lag = 0, rest_lag = 0;
};

class LaggedFixes {
 public:
  explicit LaggedFixes(const FlightLog& log) {
    const PairsAt pairs_at = FixPairs(log);
    for (const VectorPair& pair : pairs_at(0.0)) times_.push_back(pair.t);
    const int reach = static_cast<int>(std::round(kLongestJump / kJumpStep));
    for (int k = -reach; k <= reach; ++k) {
      lags_.push_back(k * kJumpStep);
      upto_.push_back(UpTo(pairs_at(lags_.back())));
    }
  }

  std::size_t size() const { return times_.size(); }
  double time(std::size_t i) const { return times_[i]; }
  double lag(std::size_t k) const { return lags_[k]; }
  std::size_t lags() const { return lags_.size(); }

  Differences Part(const Division& d, std::size_t lag) const {
    return upto_[lag][d.to].Plus(upto_[lag][d.from], -1.0);
  }
  Differences Rest(const Division& d, std::size_t lag) const {
    return upto_[lag].back().Plus(Part(d, lag), -1.0);
  }
  // Mean square of both parts about their common mean: the frames may differ by a constant.
  double MeanSquare(const Division& d) const {
    const Differences part = Part(d, d.lag), rest = Rest(d, d.rest_lag);
    if (part.n < kLeastFixes || rest.n < kLeastFixes) {
      return std::numeric_limits<double>::infinity();
    }
    const Differences both = part.Plus(rest, 1.0);
    return both.MeanSquareAbout(both.sum / both.n);
  }

 private:
  // Sums over the fixes before each; a fix without mocap at this lag adds nothing.
  std::vector<Differences> UpTo(const std::vector<VectorPair>& pairs) const {
    std::vector<Differences> sums = {Differences()};
    std::size_t next = 0;
    for (const double t : times_) {
      Differences sum = sums.back();
      while (next < pairs.size() && pairs[next].t < t) ++next;
      if (next < pairs.size() && pairs[next].t == t) {
        const Eigen::Vector3d off = pairs[next].seen - pairs[next].sure;
        sum = sum.Plus({1.0, off.squaredNorm(), off}, 1.0);
      }
      sums.push_back(sum);
    }
    return sums;
  }

  std::vector<double> times_, lags_;
  std::vector<std::vector<Differences>> upto_;
};

void KeepBetter(const LaggedFixes& fixes, const Division& tried, double* least, Division* best) {
  const double cost = fixes.MeanSquare(tried);
  if (cost >= *least) return;
  *least = cost;
  *best = tried;
}

// Over all runs of sixteenths of the fixes and all pairs of lags; then the ends fix by fix.
Division BestDivision(const LaggedFixes& fixes) {
  Division best;
  double least = std::numeric_limits<double>::infinity();
  const auto end_of = [&](std::size_t part) { return fixes.size() * part / kCoarseParts; };
  for (std::size_t from = 0; from < kCoarseParts; ++from) {
    for (std::size_t to = from + 1; to <= kCoarseParts; ++to) {
      for (std::size_t lag = 0; lag < fixes.lags(); ++lag) {
        for (std::size_t rest = 0; rest < fixes.lags(); ++rest) {
          KeepBetter(fixes, {end_of(from), end_of(to), lag, rest}, &least, &best);
        }
      }
    }
  }
  Division tried = best;
  for (tried.from = 0; tried.from < best.to; ++tried.from) {
    KeepBetter(fixes, tried, &least, &best);
  }
  tried = best;
  for (tried.to = best.from + 1; tried.to <= fixes.size(); ++tried.to) {
    KeepBetter(fixes, tried, &least, &best);
  }
  return best;
}

// The fixes, the part moved by one lag and the rest by another.
std::vector<Fix> Moved(const FlightLog& log, const LaggedFixes& lagged, const Division& d,
                       std::size_t lag, std::size_t rest_lag) {
  std::vector<Fix> fixes = log.fixes;
  const LogClock clock(log);
  for (Fix& fix : fixes) {
    const double t = clock(fix.t);
    const bool in_part = t >= lagged.time(d.from) && t <= lagged.time(d.to - 1);
    fix.t -= FromSeconds(lagged.lag(in_part ? lag : rest_lag));
  }
  return fixes;
}

// Each of the two comes nearer to mocap at its own lag than at that of the other.
bool IsJump(const Examination& e, const LaggedFixes& fixes, const Division& d) {
  const auto moved = [&](std::size_t lag, std::size_t rest) {
    return Moved(e.fixed, fixes, d, lag, rest);
  };
  const std::vector<Fix> own = moved(d.lag, d.rest_lag);
  return std::abs(fixes.lag(d.lag) - fixes.lag(d.rest_lag)) >= kLeastClockJump &&
         BringsFixesToMocap(e, moved(d.rest_lag, d.rest_lag), own) &&
         BringsFixesToMocap(e, moved(d.lag, d.lag), own);
}

}  // namespace

void CheckClockJump(Examination* e) {
  const LaggedFixes fixes(e->fixed);
  if (fixes.size() < 2 * kLeastFixes) return;
  const Division best = BestDivision(fixes);
  if (best.to == 0 || !IsJump(*e, fixes, best)) return;
  Finding finding{"clock_jump", "fixes", Level::kBiases,
                  fixes.lag(best.lag) - fixes.lag(best.rest_lag), "s"};
  finding.text = fmt::format(
      "the clock of fixes.csv jumps: against mocap, fixes from {:.2f} to {:.2f} s come {} than the "
      "others",
      fixes.time(best.from), fixes.time(best.to - 1), LateText(finding.size));
  finding.remedy = "calibrate the parts before and after the jump as flights of their own";
  e->Add(finding);
}

}  // namespace trueline
