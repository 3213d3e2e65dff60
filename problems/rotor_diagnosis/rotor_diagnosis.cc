#include "problems/rotor_diagnosis/rotor_diagnosis.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <set>

#include "problems/rotor_diagnosis/rotor_gain.h"
#include "problems/rotor_diagnosis/rotor_rows.h"

namespace trueline {
namespace {

constexpr double kAsGood = 6.0;          // of merit: within this, two effects fit alike
constexpr double kClearlyBetter = 10.0;  // of merit, of terms that are no effect

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

bool Plausible(const Candidate& candidate, const Eigen::VectorXd& value) {
  for (int i = 0; i < value.size(); ++i) {
    const EffectParameterInfo& info = candidate.info->parameters[i];
    if (std::abs(value[i]) > info.plausible) return false;
    if (!info.either_sign && value[i] < 0.0) return false;
  }
  return true;
}

bool Plausible(const RotorTested& t) { return Plausible(t.candidate, t.value); }

int DistinctIds(const std::vector<Candidate>& candidates) {
  std::set<std::string> ids;
  for (const Candidate& c : candidates) ids.insert(c.info->id);
  return static_cast<int>(ids.size());
}

// An effect that was found is not looked for again, but for the loss of another rotor.
std::vector<Candidate> Without(std::vector<Candidate> candidates,
                               const std::vector<RotorFound>& found) {
  std::erase_if(candidates, [&](const Candidate& c) {
    return std::any_of(found.begin(), found.end(), [&](const RotorFound& f) {
      const bool other_rotor = c.fixed.count("rotor") > 0 && f.candidate.fixed != c.fixed;
      return f.candidate.info->id == c.info->id && !other_rotor;
    });
  });
  return candidates;
}

CandidateReport Report(const RotorTested& t, double alpha, int clusters) {
  CandidateReport report{
      t.candidate.info->id, t.candidate.Label(), t.test.z(), t.p, {}, {}, {}, {}, {}};
  for (const EffectParameterInfo& info : t.candidate.info->parameters) {
    report.parameters.push_back(info.name);
    report.units.push_back(info.unit);
  }
  report.value = t.value;
  report.sigma = SizesFromSteps(*t.candidate.info, t.test.sigma);
  report.detectable = SizesFromSteps(*t.candidate.info, DetectableSize(t.test, alpha, clusters));
  return report;
}

// The best of those that stand out, or none.
const RotorTested* Best(const std::vector<RotorTested>& tested, double alpha) {
  const RotorTested* best = nullptr;
  for (const RotorTested& t : tested) {
    if (t.p >= alpha || !Plausible(t)) continue;
    if (best == nullptr || t.Merit() > best->Merit()) best = &t;
  }
  return best;
}

std::vector<std::string> ConfusedWith(const std::vector<RotorTested>& tested,
                                      const RotorTested& best) {
  std::set<std::string> ids;
  for (const RotorTested& t : tested) {
    const bool as_good = t.Merit() > best.Merit() - kAsGood && Plausible(t);
    if (as_good && t.candidate.info->id != best.candidate.info->id) {
      ids.insert(t.candidate.info->id);
    }
  }
  return {ids.begin(), ids.end()};
}

// A step's time, to a fraction of the spacing of those that were tried.
RotorFound Refined(const RotorTested& best, RotorSearch* search) {
  RotorTested sharp = best;
  if (best.candidate.fixed.count("t_step") > 0) {
    constexpr int kTried = 17;
    double range = StepSpacing(search->world().data);
    for (int round = 0; round < 2; ++round, range /= 8.0) {
      for (RotorTested& t : search->TestAll(StepsAround(sharp.candidate, range, kTried))) {
        if (t.gain > sharp.gain && Plausible(t)) sharp = t;
      }
    }
  }
  return {sharp.candidate, sharp.value};
}

std::vector<std::string> Stands(const std::vector<RotorDescribed>& described, double alpha,
                                double merit) {
  std::vector<std::string> names;
  for (const RotorDescribed& d : described) {
    if (d.p * static_cast<double>(described.size()) < alpha && d.merit > merit + kClearlyBetter) {
      names.push_back(d.name);
    }
  }
  return names;
}

// One round for each cause: test all, take the best, refit, drop what is explained away.
struct Rounds {
  std::vector<RotorFound> found;
  std::vector<double> p;
  std::vector<std::vector<std::string>> confused;

  void Erase(std::size_t i) {
    found.erase(found.begin() + static_cast<long>(i));
    p.erase(p.begin() + static_cast<long>(i));
    confused.erase(confused.begin() + static_cast<long>(i));
  }
};

bool DropExplainedAway(const RotorSearch& search, double alpha, std::vector<Candidate>* candidates,
                       Rounds* rounds) {
  for (std::size_t i = rounds->found.size(); i-- > 0;) {
    const RotorFound& f = rounds->found[i];
    const double p = search.TestFound(rounds->found, i).p();
    if (p < alpha && Plausible(f.candidate, f.value)) continue;
    *candidates = Without(*candidates, {f});
    rounds->Erase(i);
    return true;
  }
  return false;
}

Rounds SearchCauses(std::vector<Candidate> candidates, const RotorDiagnosisOptions& options,
                    RotorSearch* search, RotorDiagnosis* diagnosis) {
  const int tried = std::max(1, DistinctIds(candidates));
  const double alpha = options.alpha / tried;
  Rounds rounds;
  for (int round = 0; round <= options.max_causes; ++round) {
    const std::vector<RotorTested> tested = search->TestAll(Without(candidates, rounds.found));
    if (round == 0) {
      for (const RotorTested& t : tested) {
        diagnosis->candidates.push_back(Report(t, alpha, search->clusters()));
      }
    }
    const RotorTested* best = Best(tested, alpha);
    const double merit = best == nullptr ? 0.0 : best->Merit();
    diagnosis->unexplained_by = Stands(search->described(), options.alpha, merit);
    if (best == nullptr || round == options.max_causes) break;
    if (!diagnosis->unexplained_by.empty()) break;
    rounds.p.push_back(std::min(1.0, best->p * tried));
    rounds.confused.push_back(ConfusedWith(tested, *best));
    rounds.found.push_back(Refined(*best, search));
    search->Fit(&rounds.found);
    while (DropExplainedAway(*search, alpha, &candidates, &rounds)) search->Fit(&rounds.found);
  }
  return rounds;
}

void StoreCauses(const RotorSearch& search, const Rounds& rounds, RotorDiagnosis* diagnosis) {
  for (std::size_t i = 0; i < rounds.found.size(); ++i) {
    const RotorFound& f = rounds.found[i];
    const ScoreTest test = search.TestFound(rounds.found, i);
    // An ordinary effect of the same kind is in the value as well.
    const Eigen::VectorXd sigma =
        (test.sigma.cwiseAbs2() + f.candidate.Ordinary().cwiseAbs2()).cwiseSqrt();
    diagnosis->causes.push_back(
        {f.candidate, f.value, sigma, rounds.p[i], rounds.confused[i], Gain()});
  }
}

// Noise far beyond what the options state, and disturbances beyond what flights have: no effect,
// but no clean flight either.
std::vector<std::string> ExtraordinaryNoise(const RotorNoise& learned, const RotorNoise& stated) {
  constexpr double kTimesStated = 3.0;
  constexpr double kForce = 0.5;  // m/s^2/sqrt(Hz)
  constexpr double kTurn = 10.0;  // rad/s^2/sqrt(Hz)
  std::vector<std::string> findings;
  const auto sensor = [&](double is, double said, const std::string& what) {
    if (is > kTimesStated * said) {
      findings.push_back(fmt::format("{} that scatters {:.1f} times as stated", what, is / said));
    }
  };
  sensor(learned.accel, stated.accel, "an accelerometer");
  sensor(learned.gyro, stated.gyro, "a gyro");
  sensor(learned.position, stated.position, "a position");
  sensor(learned.attitude, stated.attitude, "an attitude");
  if (learned.force_density > kForce) {
    findings.push_back(
        fmt::format("forces without a pattern of {:.2f} m/s^2/sqrt(Hz)", learned.force_density));
  }
  if (learned.angular_density > kTurn) {
    findings.push_back(fmt::format("moments without a pattern of {:.1f} rad/s^2/sqrt(Hz)",
                                   learned.angular_density));
  }
  return findings;
}

double RmsOf(const std::vector<Eigen::Matrix<double, 6, 1>>& values) {
  double sum = 0.0;
  for (const auto& v : values) sum += v.squaredNorm();
  return std::sqrt(sum / (6.0 * static_cast<double>(values.size())));
}

std::string VerdictOf(const RotorDiagnosis& diagnosis) {
  if (diagnosis.causes.empty()) return diagnosis.unexplained_by.empty() ? "clean" : "unexplained";
  const bool ambiguous = std::any_of(diagnosis.causes.begin(), diagnosis.causes.end(),
                                     [](const Cause& c) { return !c.confused_with.empty(); });
  return ambiguous ? "ambiguous" : "explained";
}

void StoreRows(const RotorSearch& search, const std::vector<Eigen::Matrix<double, 6, 1>>& before,
               RotorDiagnosis* diagnosis) {
  const std::vector<Eigen::Matrix<double, 6, 1>> after = SegmentDisturbances(search);
  const RotorData& data = search.world().data;
  std::vector<double> times;
  for (std::size_t i = 0; i < after.size(); ++i) {
    times.push_back(data.poses[i].t);
    diagnosis->rows.push_back({data.since_start + data.poses[i].t, before[i], after[i]});
  }
  diagnosis->rms_before = RmsOf(before);
  diagnosis->rms_after = RmsOf(after);
  diagnosis->whiteness_p = WhitenessOf(times, after);
}

}  // namespace

RotorDiagnosis DiagnoseRotors(const FlightLog& log, const RotorDiagnosisOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  RotorDiagnosis diagnosis;
  diagnosis.warnings = log.warnings;
  const auto& more = options.calibration.warnings;
  diagnosis.warnings.insert(diagnosis.warnings.end(), more.begin(), more.end());
  RotorSearch search(log, options.calibration);
  Rounds rounds;
  search.Fit(&rounds.found);
  diagnosis.base_seconds = SecondsSince(start);
  diagnosis.clusters = search.clusters();
  const auto before = SegmentDisturbances(search);
  rounds = SearchCauses(RotorCandidatesFor(search.world().data, search.world().model.num_rotors(),
                                           search.world().prior),
                        options, &search, &diagnosis);
  StoreCauses(search, rounds, &diagnosis);
  for (const std::string& what : ExtraordinaryNoise(search.noise(), options.calibration.noise)) {
    diagnosis.unexplained_by.push_back(what);
  }
  std::vector<std::string> unobservable;
  DescribeConstants(search.batch(), search.world().prior, &diagnosis.parameters, &unobservable);
  diagnosis.noise = search.noise();
  diagnosis.rotor_delay = search.options().data.rotor_delay;
  StoreRows(search, before, &diagnosis);
  if (options.measure_gain && !rounds.found.empty()) {
    const Gain gain = MeasureRotorGain(log, search, rounds.found);
    for (Cause& cause : diagnosis.causes) cause.gain = gain;
  }
  diagnosis.verdict = VerdictOf(diagnosis);
  diagnosis.seconds = SecondsSince(start);
  return diagnosis;
}

}  // namespace trueline
