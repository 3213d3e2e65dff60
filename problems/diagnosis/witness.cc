#include "problems/diagnosis/witness.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>

#include "problems/diagnosis/agreement.h"
#include "problems/diagnosis/false_gate.h"
#include "problems/diagnosis/score_test.h"
#include "problems/diagnosis/thresholds.h"
#include "problems/result/statistics.h"
#include "problems/trajectory/mocap_path.h"

namespace trueline {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// The sizes in a comparison of two streams.
using Unknowns = std::vector<EffectParameterInfo>;
using CorrectedRows = std::function<StreamRows(const VectorXd& sizes)>;

// Scores summed over blocks of `length` s.
MatrixXd BlockScores(const MatrixXd& scores, const std::vector<double>& t, double length) {
  std::map<long, VectorXd> sums;
  for (std::size_t i = 0; i < t.size(); ++i) {
    const VectorXd sum = scores.middleRows(3 * static_cast<Eigen::Index>(i), 3).colwise().sum();
    const auto [at, added] = sums.try_emplace(std::lround(std::floor(t[i] / length)), sum);
    if (!added) at->second += sum;
  }
  MatrixXd blocks(sums.size(), scores.cols());
  Eigen::Index row = 0;
  for (const auto& [block, sum] : sums) blocks.row(row++) = sum;
  return blocks;
}

// The linearised comparison: offsets of the streams first, then the sizes.
struct Linear {
  MatrixXd columns;
  VectorXd unit;  // of the columns, which are scaled to length one
  VectorXd weight;
  MatrixXd inverse;  // of the weighted normal matrix

  Linear(MatrixXd stacked, const VectorXd& weights) : columns(std::move(stacked)), weight(weights) {
    const MatrixXd weighted = weight.cwiseSqrt().asDiagonal() * columns;
    unit = weighted.colwise().norm().cwiseMax(1e-12).cwiseInverse();
    columns = columns * unit.asDiagonal();
    const MatrixXd scaled = weight.cwiseSqrt().asDiagonal() * columns;
    MatrixXd normal = scaled.transpose() * scaled;
    normal.diagonal().array() += kNoInformation;
    inverse = normal.llt().solve(MatrixXd::Identity(normal.rows(), normal.cols()));
  }
  VectorXd Solve(const VectorXd& r) const {
    return -inverse * (columns.transpose() * weight.cwiseProduct(r));
  }
  // The largest sigmas of the noise as white, and of the scatter of scores between blocks of any
  // length that leaves enough blocks. None if the flight is too short.
  std::optional<VectorXd> Sigmas(const VectorXd& residual, const std::vector<double>& t) const {
    const MatrixXd scores = weight.cwiseProduct(residual).asDiagonal() * columns;
    VectorXd variance = inverse.diagonal();
    bool enough = false;
    for (double length = 1.0;; length *= 1.5) {
      const MatrixXd blocks = BlockScores(scores, t, length);
      const auto count = static_cast<double>(blocks.rows());
      if (blocks.rows() < kFewestBlocks) break;
      enough = true;
      const MatrixXd half = blocks * inverse;
      const VectorXd scatter = half.cwiseAbs2().colwise().sum() * (count / (count - 3.0));
      variance = variance.cwiseMax(scatter);
    }
    if (!enough) return std::nullopt;
    return VectorXd(variance.cwiseSqrt().cwiseProduct(unit));
  }
};

// The sizes at which the corrected stream agrees best with mocap (Gauss-Newton from the start).
// `slopes_at` gives the derivatives: of rows without the stream's noise, which would otherwise be
// taken for a scale (errors in variables).
std::optional<SizeEstimate> BestSizes(const CorrectedRows& rows_at, const CorrectedRows& slopes_at,
                                      const Unknowns& unknowns) {
  const auto count = static_cast<Eigen::Index>(unknowns.size());
  const VectorXd steps = EachOf(unknowns, &EffectParameterInfo::step);
  const VectorXd most = EachOf(unknowns, &EffectParameterInfo::plausible);
  VectorXd sizes = EachOf(unknowns, &EffectParameterInfo::neutral), weight;
  for (int i = 0;; ++i) {
    const StreamRows rows = rows_at(sizes);
    const Eigen::Index offsets = rows.nuisances.cols();
    if (rows.t.size() < 2 * kFewestBlocks) return std::nullopt;
    MatrixXd columns(rows.r.size(), offsets + count);
    columns.leftCols(offsets) = rows.nuisances;
    const VectorXd here = slopes_at(sizes).r;
    for (Eigen::Index k = 0; k < count; ++k) {
      const VectorXd moved = sizes + steps[k] * VectorXd::Unit(count, k);
      columns.col(offsets + k) = (slopes_at(moved).r - here) / steps[k];
    }
    if (i == 0) weight = RobustWeightsByAxis(rows.r);
    for (int k = 0; k < kRepeats; ++k) {
      const Linear linear(columns, weight);
      weight = RobustWeightsByAxis(rows.r + linear.columns * linear.Solve(rows.r));
    }
    const Linear linear(columns, weight);
    const VectorXd solution = linear.Solve(rows.r);
    const VectorXd moves = solution.cwiseProduct(linear.unit).tail(count);
    const bool settled = (moves.array().abs() < kNegligible * steps.array()).all();
    sizes = (sizes + moves).cwiseMin(most).cwiseMax(-most);
    if (!settled && i < kMostIterations) continue;
    const auto sigmas = linear.Sigmas(rows.r + linear.columns * solution, rows.t);
    if (!sigmas || !sizes.allFinite() || !sigmas->allFinite()) return std::nullopt;
    // A search that has not settled is as uncertain as its last move.
    const VectorXd own = sigmas->tail(count);
    return SizeEstimate{sizes, (own.cwiseAbs2() + moves.cwiseAbs2()).cwiseSqrt()};
  }
}

void ShiftImu(double delay, FlightLog* log) {
  for (ImuSample& s : log->imu) s.t -= FromSeconds(delay);
}

// Sizes of effects that act on one stream, found together; the IMU's delay against mocap is found
// beside those that accelerations show.
class StreamFit {
 public:
  StreamFit(const FlightLog& log, const std::vector<VelocitySample>& path,
            StreamComparison comparison)
      : log_(log), path_(path), comparison_(std::move(comparison)) {}

  void Add(const Candidate& candidate) {
    candidates_.push_back(candidate);
    const Unknowns& more = candidate.info->parameters;
    unknowns_.insert(unknowns_.end(), more.begin(), more.end());
  }

  std::optional<SizeEstimate> Run() {
    const bool acceleration = comparison_.stream == "mocap acceleration";
    const auto asked = [&](const std::string& id) {
      return std::ranges::count(candidates_, id, &Candidate::id) > 0;
    };
    const auto& alike = comparison_.alike;
    const bool any = std::ranges::any_of(alike, asked);
    for (const std::string& id : alike) {
      if (any && !asked(id)) Add({&InfoOf(id), {}});
    }
    if (acceleration) unknowns_.push_back({"delay", "s", 0.002, 0.2, 0.0});
    const auto rows_of = [&](const FlightLog& log) {
      return [&](const VectorXd& sizes) {
        FlightLog corrected = CorrectLog(log, EffectsAt(sizes), path_);
        if (acceleration) ShiftImu(sizes[sizes.size() - 1], &corrected);
        return WithStated(sizes, comparison_.rows(corrected));
      };
    };
    std::optional<SizeEstimate> best;
    FlightLog log = log_;
    for (int pass = 0; pass < comparison_.passes; ++pass) {
      const FlightLog noiseless = comparison_.noiseless(log);
      const auto rest = BestSizes(rows_of(log), rows_of(noiseless), unknowns_);
      if (!rest) return std::nullopt;
      best = SizeEstimate{best ? Corrected(best->value) + rest->value : rest->value, rest->sigma};
      if (pass + 1 < comparison_.passes) log = CorrectLog(log, EffectsAt(rest->value), path_);
    }
    return best;
  }

 private:
  // Calls `visit(candidate, at, column)` with the place of each one's sizes among the unknowns, and
  // with the column of the offsets that states it; none for an effect that corrects the log.
  template <class Visit>
  void ForEachCandidate(Visit&& visit) const {
    Eigen::Index at = 0;
    for (const Candidate& c : candidates_) {
      const auto stated = comparison_.stated_by.find(c.id());
      const bool corrects = stated == comparison_.stated_by.end();
      visit(c, at, corrects ? std::nullopt : std::optional(stated->second));
      at += c.size();
    }
  }
  // What the log of the next pass is corrected for.
  VectorXd Corrected(const VectorXd& sizes) const {
    VectorXd corrected = sizes - EachOf(unknowns_, &EffectParameterInfo::neutral);
    ForEachCandidate([&](const Candidate& c, Eigen::Index at, std::optional<int> column) {
      if (column) corrected.segment(at, c.size()).setZero();
    });
    return corrected;
  }
  std::vector<Effect> EffectsAt(const VectorXd& sizes) const {
    std::vector<Effect> effects;
    ForEachCandidate([&](const Candidate& c, Eigen::Index at, std::optional<int> column) {
      if (!column) effects.push_back(c.At(sizes.segment(at, c.size())));
    });
    return effects;
  }
  // Rows less what the effects of these sizes do that one of their columns states.
  StreamRows WithStated(const VectorXd& sizes, StreamRows rows) const {
    ForEachCandidate([&](const Candidate&, Eigen::Index at, std::optional<int> column) {
      if (!column) return;
      rows.r -= sizes[at] * rows.nuisances.col(*column);
      rows.nuisances.col(*column).setZero();
    });
    return rows;
  }

  const FlightLog& log_;
  const std::vector<VelocitySample>& path_;
  StreamComparison comparison_;
  std::vector<Candidate> candidates_;
  Unknowns unknowns_;
};

// The IMU's delay against mocap, s.
SizeEstimate ImuDelay(const FlightLog& log, const MocapComparison& mocap) {
  constexpr double kUnknown = 0.01;  // s
  std::optional<SizeEstimate> delay;
  if (mocap.HasOwnAttitude()) {
    delay = StreamFit(log, mocap.path(), AgainstAcceleration(mocap, false)).Run();
  }
  return delay ? *delay : SizeEstimate{VectorXd::Zero(1), VectorXd::Constant(1, kUnknown)};
}

// The share of a false gate: fixes that mocap shows to be displaced by the gate's offset.
std::optional<SizeEstimate> FalseShare(const FlightLog& recorded, const Candidate& candidate) {
  const Eigen::Vector3d offset = OffsetOf(candidate);
  DisplacedFixes fixes;
  for (const Fix& fix : recorded.fixes) {
    const auto p_E = fix.gate < 0 ? std::nullopt : PositionAt(recorded.mocap, fix.t);
    if (p_E) fixes.Add(fix.p_E - *p_E, fix.sigma, offset);
  }
  const auto [count, displaced] = fixes;
  if (count < 2 * kFewestBlocks) return std::nullopt;
  const double share = displaced / static_cast<double>(count);
  const double sigma = std::sqrt((share * (1.0 - share) + 1.0 / count) / count);
  return SizeEstimate{VectorXd::Constant(1, share), VectorXd::Constant(1, sigma)};
}

Witness Silent(const std::string& why) { return {"", "silent", {}, {}, why}; }

Witness WitnessOf(const Cause& cause, const std::string& stream, const SizeEstimate& sizes) {
  Witness witness{stream, "", sizes.value, sizes.sigma, ""};
  const EffectInfo& info = *cause.candidate.info;
  witness.says = WitnessVerdict(witness, cause);
  witness.text =
      fmt::format("{} shows {}; the fit says {}", stream, SizesText(info, sizes.value, sizes.sigma),
                  SizesText(info, cause.value, cause.sigma));
  return witness;
}

// The sizes that one stream shows of causes that act on it. `delay`: of the IMU against the stream.
void AskOne(const FlightLog& log, const std::vector<VelocitySample>& path,
            const StreamComparison& comparison, const std::vector<Cause*>& causes,
            const std::function<SizeEstimate()>& delay = {}) {
  StreamFit comparing(log, path, comparison);
  for (const Cause* cause : causes) comparing.Add(cause->candidate);
  const std::optional<SizeEstimate> sizes = comparing.Run();
  Eigen::Index at = 0;
  for (Cause* cause : causes) {
    const int size = cause->candidate.size();
    if (!sizes) {
      if (cause->witness.text.empty())
        cause->witness = Silent("too little of the flight is covered");
      continue;
    }
    SizeEstimate own{sizes->value.segment(at, size), sizes->sigma.segment(at, size)};
    at += size;
    own.sigma =
        (own.sigma.cwiseAbs2() + (comparison.own_errors * cause->candidate.Ordinary()).cwiseAbs2())
            .cwiseSqrt();
    const CorrectionStage stage = cause->candidate.info->correct_at;
    if (delay && (stage == CorrectionStage::kClock || stage == CorrectionStage::kFixClock)) {
      const SizeEstimate of_imu = comparison.stream == "mocap acceleration"
                                      ? SizeEstimate{sizes->value.tail(1), sizes->sigma.tail(1)}
                                      : delay();
      own.value -= of_imu.value.head<1>();
      own.sigma[0] = std::hypot(own.sigma[0], of_imu.sigma[0]);
    }
    cause->witness = WitnessOf(*cause, comparison.stream, own);
    cause->witness.independent = comparison.independent;
    if (comparison.independent || cause->witness.says != "confirms") continue;
    cause->witness.says = "silent";
    cause->witness.text +=
        "; this confirms nothing, since the fit used the same positions and attitude";
  }
}

void AskMocap(const FlightLog& log, const FlightLog& recorded, const MocapComparison& mocap,
              std::vector<Cause>* causes) {
  const bool fitted_to_mocap = IsFittedToMocap(log);
  std::map<std::string, std::pair<StreamComparison, std::vector<Cause*>>> asked;  // by stream
  for (Cause& cause : *causes) {
    if (cause.candidate.IsFalseGate()) {
      const auto share = FalseShare(recorded, cause.candidate);
      cause.witness = share ? WitnessOf(cause, "mocap position", *share)
                            : Silent("too few fixes are under mocap");
    } else if (const auto comparison =
                   ComparisonFor(*cause.candidate.info, mocap, fitted_to_mocap)) {
      asked.try_emplace(comparison->stream, *comparison, std::vector<Cause*>())
          .first->second.second.push_back(&cause);
    } else {
      cause.witness = Silent("no stream shows this effect without the model of the vehicle");
    }
  }
  const auto delay = [&] { return ImuDelay(log, mocap); };
  for (const auto& [stream, asking] : asked) {
    AskOne(log, mocap.path(), asking.first, asking.second, delay);
  }
}

// The gyroscope measures how the vehicle turned: where mocap's attitude does not determine an error
// of the logged attitude, the gyroscope does. mocap's acceleration is compared through the thrust,
// which has the larger errors. An error that grows with time looks like the gyroscope's bias.
void AskGyro(const FlightLog& log, const std::vector<VelocitySample>& path,
             std::vector<Cause>* causes) {
  std::vector<Cause*> asking;
  for (Cause& cause : *causes) {
    const EffectInfo& info = *cause.candidate.info;
    const bool known =
        cause.witness.says != "silent" && cause.witness.stream != "mocap acceleration";
    if (info.enters == EntersAt::kAttitude && !info.drifts && !known) asking.push_back(&cause);
  }
  if (asking.empty() || log.imu.empty() || log.attitude.empty()) return;
  FlightLog apart = log;
  apart.attitude.clear();
  for (const AttitudeSample& s : log.attitude) {
    const bool near =
        !apart.attitude.empty() && s.t < apart.attitude.back().t + FromSeconds(kAttitudeSpacing);
    if (!near) apart.attitude.push_back(s);
  }
  AskOne(apart, path, AgainstGyroscope(), asking);
}

}  // namespace

std::string SizesText(const EffectInfo& info, const VectorXd& value, const VectorXd& sigma) {
  std::vector<std::string> texts;
  for (Eigen::Index i = 0; i < value.size(); ++i) {
    const EffectParameterInfo& parameter = info.parameters[i];
    if (!Shown(parameter, sigma[i])) continue;
    texts.push_back(fmt::format("{} = {:.3g} +- {:.2g}{}", parameter.name, value[i], sigma[i],
                                AfterNumber(parameter.unit)));
  }
  return texts.empty() ? "nothing of it" : fmt::format("{}", fmt::join(texts, ", "));
}

bool Shown(const EffectParameterInfo& parameter, double sigma) {
  return sigma < 10.0 * parameter.plausible;
}

std::string WitnessVerdict(const Witness& witness, const Cause& cause) {
  const auto count = static_cast<double>(cause.value.size());
  const double apart_by_chance = ChiSquareTail(kApartSigmas * kApartSigmas, 1.0);
  const double critical = std::sqrt(ChiSquareCritical(apart_by_chance, count));
  const VectorXd neutral = cause.candidate.Neutral();
  const VectorXd both = (witness.sigma.cwiseAbs2() + cause.sigma.cwiseAbs2()).cwiseSqrt();
  const bool apart = (cause.value - witness.value).cwiseQuotient(both).norm() > critical;
  const double share = ShareLeft(witness.value - neutral, cause.value - neutral, both);
  if (apart && share < kMostOf) return "refutes";
  const VectorXd usual =
      (witness.sigma.cwiseAbs2() + cause.candidate.Ordinary().cwiseAbs2()).cwiseSqrt();
  const bool shows = (witness.value - neutral).cwiseQuotient(usual).norm() > critical;
  return shows && share > 0.0 ? "confirms" : "silent";
}

void WidenByWitness(Cause* cause) {
  const Witness& witness = cause->witness;
  if (witness.value.size() != cause->value.size() || witness.says == "refutes") return;
  const VectorXd both = witness.sigma.cwiseAbs2() + cause->sigma.cwiseAbs2();
  const VectorXd apart = cause->value - witness.value;
  const auto by_chance = apart.array().square() <= kChanceSigmas * kChanceSigmas * both.array();
  const VectorXd beyond = by_chance.select(VectorXd::Zero(apart.size()), BeyondChance(apart, both));
  cause->sigma = (cause->sigma.cwiseAbs2() + beyond).cwiseSqrt();
}

void AskWitnesses(const FlightLog& log, const FlightLog& recorded,
                  const std::vector<VelocitySample>& fitted, std::vector<Cause>* causes) {
  if (causes->empty()) return;
  if (log.mocap.empty()) {
    for (Cause& cause : *causes) cause.witness = Silent("the log holds no mocap");
    AskGyro(log, fitted, causes);
    return;
  }
  const MocapComparison mocap(log);
  AskMocap(log, recorded, mocap, causes);
  AskGyro(log, mocap.path(), causes);
}

}  // namespace trueline
