#include "problems/diagnosis/diagnosis.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <set>

#include "problems/common/error.h"
#include "problems/diagnosis/false_gate.h"
#include "problems/diagnosis/gain.h"
#include "problems/diagnosis/search.h"

namespace trueline {
namespace {

constexpr double kAsGood = 6.0;  // of twice the log likelihood: within this, two effects fit alike

constexpr int kRefits = 8;  // at most, of a model with a new cause

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// The log with the filter's attitude where it has none, and mocap among the fixes where asked for.
FlightLog Prepare(const FlightLog& log, DiagnosisOptions* options) {
  FlightLog data = log;
  DriveOptions& drive = options->vgd.drive;
  if (data.attitude.empty() || drive.attitude == AttitudeSource::kComplementaryFilter) {
    data.attitude = RunComplementaryFilter(data.imu, drive.filter);
    drive.attitude = AttitudeSource::kLogged;
  }
  if (!options->fit_to_mocap) return data;
  if (log.mocap.empty()) {
    throw ErrorAt(log.directory + "/mocap.csv", 0,
                  "is not there or empty; --fit_to=mocap needs it (use --fit_to=fixes)");
  }
  TimeNs next = log.mocap.front().t;
  for (const PoseSample& pose : log.mocap) {
    if (pose.t < next) continue;
    data.fixes.push_back({pose.t, pose.p_E, options->mocap_sigma, -1});
    next = pose.t + FromSeconds(options->mocap_interval);
  }
  std::sort(data.fixes.begin(), data.fixes.end(),
            [](const Fix& a, const Fix& b) { return a.t < b.t; });
  return data;
}

// Drag is judged by what the flight shows of it, not by what is usual: a prior would make any
// unusual drag look like an effect.
VgdOptions OpenPriors(VgdOptions options) {
  constexpr double kOpenDrag = 1.0;  // 1/s
  for (int i = 0; i < 2; ++i) {
    options.priors[i].sigma = std::max(kOpenDrag, options.priors[i].sigma);
  }
  return options;
}

CandidateScope ScopeOf(const FlightLog& log, const DiagnosisOptions& options) {
  const bool accelerometer = options.vgd.drive.thrust == ThrustSource::kAccelerometer;
  return {accelerometer, options.vgd.drag_measurement.enabled, !log.attitude.empty(),
          SecondsBetween(log.imu.front().t, log.imu.back().t)};
}

int DistinctIds(const std::vector<Candidate>& candidates) {
  std::set<std::string> ids;
  for (const Candidate& c : candidates) ids.insert(c.info->id);
  return static_cast<int>(ids.size());
}

// What is found is not looked for again; a step may happen once.
std::vector<Candidate> Without(std::vector<Candidate> candidates, const std::vector<Found>& found) {
  std::erase_if(candidates, [&](const Candidate& c) {
    return std::any_of(found.begin(), found.end(), [&](const Found& f) {
      const bool same_id = f.candidate.info->id == c.info->id;
      return same_id && (c.fixed.count("gate") == 0 || f.candidate.fixed == c.fixed);
    });
  });
  return candidates;
}

bool Plausible(const Candidate& candidate, const Eigen::VectorXd& value) {
  for (int i = 0; i < value.size(); ++i) {
    const EffectParameterInfo& info = candidate.info->parameters[i];
    if (std::abs(value[i]) > info.plausible) return false;
    if (!info.either_sign && value[i] < 0.0) return false;
  }
  return true;
}

bool Plausible(const Tested& t) {
  return Plausible(t.candidate, t.candidate.Neutral() + t.test.value);
}

CandidateReport Report(const Tested& t, double alpha, int clusters) {
  CandidateReport report{
      t.candidate.info->id, t.candidate.Label(), t.test.z(), t.p, {}, {}, {}, {}, {}};
  for (const EffectParameterInfo& info : t.candidate.info->parameters) {
    report.parameters.push_back(info.name);
    report.units.push_back(info.unit);
  }
  report.value = t.candidate.Neutral() + t.test.value;
  report.sigma = t.test.sigma;
  report.detectable = DetectableSize(t.test, alpha, clusters);
  return report;
}

// The best of those that stand out, or none.
const Tested* Best(const std::vector<Tested>& tested, double alpha) {
  const Tested* best = nullptr;
  for (const Tested& t : tested) {
    if (t.p >= alpha || !Plausible(t)) continue;
    if (best == nullptr || t.Merit() > best->Merit()) best = &t;
  }
  return best;
}

std::vector<std::string> ConfusedWith(const std::vector<Tested>& tested, const Tested& best) {
  std::set<std::string> ids;
  for (const Tested& t : tested) {
    const bool as_good = t.Merit() > best.Merit() - kAsGood && Plausible(t);
    if (as_good && t.candidate.info->id != best.candidate.info->id)
      ids.insert(t.candidate.info->id);
  }
  return {ids.begin(), ids.end()};
}

double RmsOfFixes(const BaseFlight& flight, const Eigen::VectorXd& whitened) {
  const int count = 3 * static_cast<int>(flight.plan().fixes.size());
  return std::sqrt(whitened.head(count).squaredNorm() / std::max(1, count));
}

// Whitened residuals by fix and force sample; `before` and `after` hold measurement rows alike.
std::vector<RowReport> RowReports(const BaseFlight& flight, const Eigen::VectorXd& before,
                                  const Eigen::VectorXd& after) {
  const FlightPlan& plan = flight.plan();
  std::vector<RowReport> rows;
  int row = 0;
  for (const std::size_t i : plan.fixes) {
    const Fix& fix = flight.log().fixes[i];
    rows.push_back({fix.t, true, fix.gate, before.segment<3>(row), after.segment<3>(row)});
    row += 3;
  }
  for (const std::size_t i : plan.forces) {
    Eigen::Vector3d b = Eigen::Vector3d::Zero(), a = b;
    b.head<2>() = before.segment<2>(row);
    a.head<2>() = after.segment<2>(row);
    rows.push_back({flight.forces()[i].t, false, -1, b, a});
    row += 2;
  }
  return rows;
}

// Probability of a correlation between neighbouring fixes as large as this, were they white.
double WhitenessOf(const std::vector<RowReport>& rows) {
  constexpr double kNeighbours = 0.3;  // s
  double products = 0.0, squares = 0.0;
  const RowReport* last = nullptr;
  for (const RowReport& row : rows) {
    if (!row.fix) continue;
    if (last != nullptr && SecondsBetween(last->t, row.t) < kNeighbours) {
      const Eigen::Vector3d product = last->after.cwiseProduct(row.after);
      products += product.sum();
      squares += product.squaredNorm();  // its variance, heavy tails and all
    }
    last = &row;
  }
  return squares > 0.0 ? std::erfc(std::abs(products) / std::sqrt(2.0 * squares)) : 1.0;
}

// One round for each cause: test all, take the best, refit, drop what is explained away.
struct Rounds {
  std::vector<Found> found;
  std::vector<double> p;
  std::vector<std::vector<std::string>> confused;
};

// Causes that do not stand any more beside the others, once refitted, go; true if any did. What
// went is not tried again.
bool DropExplainedAway(const CauseSearch& search, double alpha, std::vector<Candidate>* candidates,
                       Rounds* rounds) {
  for (std::size_t i = rounds->found.size(); i-- > 0;) {
    const Found& f = rounds->found[i];
    const double p = search.TestFound(rounds->found, i).p();
    if (p < alpha && Plausible(f.candidate, f.value)) continue;
    *candidates = Without(*candidates, {f});
    rounds->found.erase(rounds->found.begin() + static_cast<long>(i));
    rounds->p.erase(rounds->p.begin() + static_cast<long>(i));
    rounds->confused.erase(rounds->confused.begin() + static_cast<long>(i));
    return true;
  }
  return false;
}

void StoreCauses(const CauseSearch& search, const Rounds& rounds, Diagnosis* diagnosis) {
  for (std::size_t i = 0; i < rounds.found.size(); ++i) {
    const Found& f = rounds.found[i];
    const ScoreTest test = search.TestFound(rounds.found, i);
    // An ordinary effect of the same kind is in the value as well.
    const Eigen::VectorXd sigma =
        (test.sigma.cwiseAbs2() + f.candidate.Ordinary().cwiseAbs2()).cwiseSqrt();
    diagnosis->causes.push_back(
        {f.candidate, f.value, sigma, rounds.p[i], rounds.confused[i], Gain()});
  }
}

void StoreModel(const CauseSearch& search, Diagnosis* diagnosis) {
  const ThetaVector value = search.Parameters(), sigma = search.Sigmas();
  for (int i = 0; i < kThetaSize; ++i) {
    const bool named = i < 9;
    diagnosis->parameters.push_back({named ? kImuDrivenNames[i] : (i == 9 ? "b_ax" : "b_ay"),
                                     named ? kImuDrivenUnits[i] : "m/s^2", value[i], sigma[i]});
  }
  diagnosis->noise = search.fit().noise;
  diagnosis->clusters = search.plan().clusters;
}

// Unmodelled motion or noise far beyond what flights have: no effect, but no clean flight either.
std::vector<std::string> ExtraordinaryNoise(const NoiseStrengths& noise) {
  std::vector<std::string> findings;
  const auto note = [&](double value, double usual, const std::string& what) {
    if (value > usual) findings.push_back(fmt::format(fmt::runtime(what), value));
  };
  note(noise.gust, 0.35, "forces from outside of {:.2f} m/s^2 that come and go");
  note(noise.process.acceleration, 0.25,
       "accelerations of {:.2f} m/s^2/sqrt(Hz) without a pattern");
  note(noise.process.tilt / kDegree, 2.0, "a tilt of the attitude that wanders by {:.1f} deg");
  note(noise.process.heading / kDegree, 6.0, "a heading that wanders by {:.1f} deg");
  note(noise.fix_scale, 2.0, "fixes that scatter {:.1f} times as much as the detector states");
  return findings;
}

// Where terms that are no effect explain clearly more than any effect does.
constexpr double kClearlyBetter = 10.0;  // of merit

std::vector<std::string> Stands(const std::vector<CauseSearch::Described>& described, double alpha,
                                double merit) {
  std::vector<std::string> names;
  for (const auto& d : described) {
    if (d.p * static_cast<double>(described.size()) < alpha && d.merit > merit + kClearlyBetter) {
      names.push_back(d.name);
    }
  }
  return names;
}

// Tests, takes the best and refits, until nothing stands out.
Rounds SearchCauses(std::vector<Candidate> candidates, const DiagnosisOptions& options,
                    CauseSearch* search, Diagnosis* diagnosis) {
  const int tried = std::max(1, DistinctIds(candidates));
  const double alpha = options.alpha / tried;
  Rounds rounds;
  for (int round = 0; round <= options.max_causes; ++round) {
    const std::vector<Tested> tested = search->TestAll(Without(candidates, rounds.found));
    if (round == 0) {
      for (const Tested& t : tested) {
        diagnosis->candidates.push_back(Report(t, alpha, search->plan().clusters));
      }
    }
    const Tested* best = Best(tested, alpha);
    const double merit = best == nullptr ? 0.0 : best->Merit();
    diagnosis->unexplained_by = Stands(search->TestLibrary(), options.alpha, merit);
    if (best == nullptr || round == options.max_causes) break;
    if (!diagnosis->unexplained_by.empty()) break;
    rounds.found.push_back({best->candidate, best->candidate.Neutral() + best->test.value});
    rounds.p.push_back(std::min(1.0, best->p * tried));
    rounds.confused.push_back(ConfusedWith(tested, *best));
    search->Fit(&rounds.found, kRefits);
    while (DropExplainedAway(*search, alpha, &candidates, &rounds)) {
      search->Fit(&rounds.found, kRefits);
    }
  }
  return rounds;
}

Cause CauseOf(const FalseGate& found) {
  Candidate candidate{&InfoOf("false_gate"),
                      {{"gate", found.gate},
                       {"dx", found.offset.x()},
                       {"dy", found.offset.y()},
                       {"dz", found.offset.z()}}};
  Cause cause{candidate, {}, {}, found.p, {}, Gain()};
  cause.value = Eigen::VectorXd::Constant(1, found.fraction);
  cause.sigma = Eigen::VectorXd::Constant(1, found.sigma);
  return cause;
}

FlightLog WithoutFixes(const FlightLog& log, const std::vector<std::size_t>& fixes) {
  FlightLog kept = log;
  const std::set<std::size_t> left_out(fixes.begin(), fixes.end());
  kept.fixes.clear();
  for (std::size_t i = 0; i < log.fixes.size(); ++i) {
    if (left_out.count(i) == 0) kept.fixes.push_back(log.fixes[i]);
  }
  return kept;
}

// A false gate that is still there once the catalogue's effects have explained what they can: a
// camera that is turned far enough sets all fixes of a pass aside, too.
std::optional<FalseGate> FalseGateBeyondEffects(const FlightLog& data,
                                                const DiagnosisOptions& options,
                                                CauseSearch* search) {
  const double alpha = options.alpha / 100.0;
  auto found = FindFalseGate(search->flight(), search->fit(), alpha);
  if (!found) return std::nullopt;
  CauseSearch trial(data, OpenPriors(options.vgd));
  std::vector<Found> none;
  trial.Fit(&none, 0);
  Diagnosis scratch;
  SearchCauses(CandidatesFor(data, ScopeOf(data, options)), options, &trial, &scratch);
  return FindFalseGate(trial.flight(), trial.fit(), alpha) ? found : std::nullopt;
}

std::string VerdictOf(const Diagnosis& diagnosis) {
  if (diagnosis.causes.empty()) return diagnosis.unexplained_by.empty() ? "clean" : "unexplained";
  const bool ambiguous = std::any_of(diagnosis.causes.begin(), diagnosis.causes.end(),
                                     [](const Cause& c) { return !c.confused_with.empty(); });
  return ambiguous ? "ambiguous" : "explained";
}

}  // namespace

Diagnosis Diagnose(const FlightLog& log, const DiagnosisOptions& given) {
  const auto start = std::chrono::steady_clock::now();
  DiagnosisOptions options = given;
  FlightLog data = Prepare(log, &options);
  Diagnosis diagnosis;
  diagnosis.warnings = log.warnings;
  auto search = std::make_unique<CauseSearch>(data, OpenPriors(options.vgd));
  std::vector<Found> none;
  search->Fit(&none, 0);
  diagnosis.rms_before = RmsOfFixes(search->flight(), search->Whitened());
  const auto false_gate = FalseGateBeyondEffects(data, options, search.get());
  FlightLog gain_log = log;
  if (false_gate) {
    search.reset();
    if (!options.fit_to_mocap) gain_log = WithoutFixes(log, false_gate->fixes);
    data = WithoutFixes(data, false_gate->fixes);
    search = std::make_unique<CauseSearch>(data, OpenPriors(options.vgd));
    search->Fit(&none, 0);
    diagnosis.causes.push_back(CauseOf(*false_gate));
  }
  diagnosis.base_seconds = SecondsSince(start);
  const Eigen::VectorXd before = search->Whitened();
  const Rounds rounds =
      SearchCauses(CandidatesFor(data, ScopeOf(data, options)), options, search.get(), &diagnosis);
  StoreCauses(*search, rounds, &diagnosis);
  StoreModel(*search, &diagnosis);
  for (const std::string& what : ExtraordinaryNoise(search->fit().noise)) {
    diagnosis.unexplained_by.push_back(what);
  }
  const Eigen::VectorXd after = search->Whitened();
  diagnosis.rms_after = RmsOfFixes(search->flight(), after);
  diagnosis.rows = RowReports(search->flight(), before, after);
  diagnosis.whiteness_p = WhitenessOf(diagnosis.rows);
  if (options.measure_gain && !diagnosis.causes.empty() && !log.fixes.empty()) {
    const Gain gain = MeasureGain(log, gain_log, options, *search, rounds.found);
    for (Cause& cause : diagnosis.causes) cause.gain = gain;
  }
  diagnosis.verdict = VerdictOf(diagnosis);
  diagnosis.seconds = SecondsSince(start);
  return diagnosis;
}

}  // namespace trueline
