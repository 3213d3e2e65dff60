#include "problems/rotor_diagnosis/rotor_diagnosis.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "problems/diagnosis/confirm.h"
#include "problems/diagnosis/verdict.h"
#include "problems/rotor_diagnosis/rotor_confirm.h"
#include "problems/rotor_diagnosis/rotor_gain.h"
#include "problems/rotor_diagnosis/rotor_rounds.h"
#include "problems/rotor_diagnosis/rotor_rows.h"

namespace trueline {
namespace {

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void StoreCauses(const RotorSearch& search, const RotorRounds& rounds, RotorDiagnosis* diagnosis) {
  for (std::size_t i = 0; i < rounds.found.size(); ++i) {
    const RotorFound& f = rounds.found[i];
    const ScoreTest test = search.TestFound(rounds.found, i);
    // The value includes an ordinary effect of the same kind, so its usual size adds to the sigma.
    const Eigen::VectorXd sigma =
        (test.sigma.cwiseAbs2() + f.candidate.Ordinary().cwiseAbs2()).cwiseSqrt();
    diagnosis->causes.push_back(
        {f.candidate, f.value, sigma, rounds.p[i], rounds.confused[i], Gain(), Gain(), {}, {}});
  }
}

// Reports learned sensor noise far beyond the stated one, and disturbances beyond those of ordinary
// flights. Neither is an effect, but such a flight is not clean.
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
        fmt::format("unmodelled white forces of {:.2f} m/s^2/sqrt(Hz)", learned.force_density));
  }
  if (learned.angular_density > kTurn) {
    findings.push_back(fmt::format("unmodelled white moments of {:.1f} rad/s^2/sqrt(Hz)",
                                   learned.angular_density));
  }
  return findings;
}

double RmsOf(const std::vector<Eigen::Matrix<double, 6, 1>>& values) {
  double sum = 0.0;
  for (const auto& v : values) sum += v.squaredNorm();
  return std::sqrt(sum / (6.0 * static_cast<double>(values.size())));
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

RotorDiagnosis DiagnoseOne(const FlightLog& log, const RotorDiagnosisOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  RotorDiagnosis diagnosis;
  diagnosis.warnings = log.warnings;
  const auto& more = options.calibration.warnings;
  diagnosis.warnings.insert(diagnosis.warnings.end(), more.begin(), more.end());
  RotorSearch search(log, options.calibration);
  std::vector<RotorFound> none;
  search.Fit(&none);
  diagnosis.base_seconds = SecondsSince(start);
  diagnosis.clusters = search.clusters();
  const auto before = SegmentDisturbances(search);
  const RotorWorld& base = search.world();
  const RotorRounds rounds =
      SearchRotorCauses(RotorCandidatesFor(base.data, base.model.num_rotors(), base.prior),
                        options.alpha, options.max_causes, &search);
  diagnosis.candidates = rounds.candidates;
  diagnosis.unexplained_by = rounds.unexplained_by;
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
  return diagnosis;
}

}  // namespace

RotorDiagnosis DiagnoseRotors(const std::vector<FlightLog>& logs,
                              const RotorDiagnosisOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  RotorDiagnosis diagnosis = DiagnoseOne(logs.front(), options);
  for (std::size_t i = 1; i < logs.size(); ++i) {
    AddRotorRepeats(logs[i], options, &diagnosis.causes);
  }
  Confirm(&diagnosis.causes);
  diagnosis.verdict = VerdictOf(diagnosis.causes, {}, diagnosis.unexplained_by);
  diagnosis.seconds = SecondsSince(start);
  return diagnosis;
}

}  // namespace trueline
