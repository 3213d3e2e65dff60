// What mocap says of a cause: it shows the size that is hidden, and refutes one that is not there.
#include "problems/diagnosis/witness.h"

#include "problems/diagnosis/agreement.h"
#include "problems/diagnosis/gain.h"
#include "problems/diagnosis/imu_flight.h"
#include "problems/diagnosis/rules.h"
#include "tests/common/matchers.h"
#include "tests/diagnosis/expect_cause.h"
#include "tests/simulation/short_flight.h"
#include "tests/vgd/tilt_noise.h"

namespace trueline {
namespace {

struct Stated {
  std::string id;
  std::map<std::string, double> values;
};

FlightLog FlyFor(double seconds, const std::vector<Stated>& hidden, std::uint64_t seed) {
  SimulationConfig config = testing_simulation::ReadShipped("iros2016", seconds);
  for (const Stated& effect : hidden) config.effects.push_back({effect.id, effect.values});
  return testing_simulation::Fly(config, seed).log;
}

// A cause as a fit would state it, with a sigma of a twelfth of the size.
Cause CauseOf(const Stated& stated) {
  Candidate candidate{&InfoOf(stated.id), {}};
  for (const EffectIndexInfo& index : candidate.info->indices) {
    candidate.fixed[index.name] = stated.values.at(index.name);
  }
  Eigen::VectorXd value(candidate.size());
  for (int i = 0; i < value.size(); ++i) {
    value[i] = stated.values.at(candidate.info->parameters[i].name);
  }
  const Eigen::VectorXd sigma = Eigen::VectorXd::Constant(value.size(), value.norm() / 12.0);
  return {candidate, value, sigma, 1e-6, {}, {}, {}, {}};
}

Witness Ask(const FlightLog& log, const Stated& stated,
            const std::vector<VelocitySample>& fitted = {}) {
  std::vector<Cause> causes{CauseOf(stated)};
  AskWitnesses(log, log, fitted, &causes);
  return causes[0].witness;
}

const std::vector<Stated>& SensorEffects() {
  static const std::vector<Stated> effects = {
      {"accel_scale_z", {{"s", 0.1}}},
      {"accel_bias_drift", {{"d", 0.01}}},
      {"imu_lever_arm", {{"r_x", 0.06}, {"r_y", -0.05}, {"r_z", 0.04}}},
      {"ahrs_acceleration_error", {{"k", 0.8}}},
      {"ahrs_drag_error", {{"k", 0.5}}},
      {"heading_drift", {{"d", 0.008}}},
      {"heading_distortion", {{"a_sin", 0.15}, {"a_cos", -0.1}}},
      {"attitude_latency", {{"tau", 0.08}}},
      {"fix_latency", {{"tau", 0.12}}},
      {"fix_scale", {{"s", 0.1}}},
      {"camera_misalignment", {{"roll", 0.1}, {"pitch", 0.1}, {"yaw", -0.1}}},
      {"gate_moved", {{"gate", 1}, {"dx", 0.5}, {"dy", -0.4}, {"dz", 0.2}}}};
  return effects;
}

TEST(Witness, ShowsTheHiddenSize) {
  std::uint64_t seed = 61;
  for (const Stated& hidden : SensorEffects()) {
    const FlightLog log = FlyFor(40.0, {hidden}, seed++);
    const Witness witness = Ask(log, hidden);
    EXPECT_EQ(witness.says, "confirms") << hidden.id << ": " << witness.text;
    const Cause cause = CauseOf(hidden);
    ASSERT_EQ(witness.value.size(), cause.value.size()) << hidden.id << ": " << witness.text;
    for (int i = 0; i < cause.value.size(); ++i) {
      // The simulator's own sensor errors are of the ordinary size.
      const double ordinary = cause.candidate.Ordinary()[i];
      EXPECT_NEAR(witness.value[i], cause.value[i], 3.3 * std::hypot(witness.sigma[i], ordinary))
          << hidden.id << ": " << witness.text;
    }
  }
}

TEST(Witness, RefutesWhatIsNotThere) {
  const FlightLog log = FlyFor(40.0, {}, 60);
  for (const Stated& stated : SensorEffects()) {
    const Witness witness = Ask(log, stated);
    EXPECT_EQ(witness.says, "refutes") << stated.id << ": " << witness.text;
    EXPECT_THAT(witness.text, HasSubstr("the fit says")) << stated.id;
  }
  EXPECT_EQ(Ask(log, {"tilt_scale", {{"s", 0.14}}}).says, "refutes");
}

// Without mocap: sparse fixes resolve no acceleration, so that an effect which follows it must be
// seen without a path.
TEST(Witness, TheGyroscopeShowsWhatTurnsTheAttitude) {
  const FlightLog none = FlyFor(40.0, {}, 60);
  std::uint64_t seed = 81;
  for (const Stated& hidden :
       {Stated{"ahrs_acceleration_error", {{"k", 0.8}}}, Stated{"ahrs_drag_error", {{"k", 0.5}}},
        Stated{"attitude_latency", {{"tau", 0.08}}}, Stated{"tilt_scale", {{"s", 0.14}}}}) {
    const auto shown_on = [&](const FlightLog& flown) {
      FlightLog log = flown;
      log.mocap.clear();
      return Ask(log, hidden, MocapComparison(flown).path());
    };
    const Witness witness = shown_on(FlyFor(40.0, {hidden}, seed++));
    EXPECT_EQ(witness.stream, "gyroscope") << hidden.id;
    EXPECT_EQ(witness.says, "confirms") << hidden.id << ": " << witness.text;
    // The simulated filter has an ordinary gain, too.
    const Cause cause = CauseOf(hidden);
    EXPECT_NEAR(witness.value[0], cause.value[0],
                3.3 * std::hypot(witness.sigma[0], cause.candidate.Ordinary()[0]))
        << witness.text;
    EXPECT_EQ(shown_on(none).says, "refutes") << hidden.id;
  }
}

// On the seconds that are asked for, and whatever constant offsets the stream has.
TEST(Agreement, IsBetterWithTheStreamCorrected) {
  std::uint64_t seed = 71;
  for (const Stated& hidden : SensorEffects()) {
    const FlightLog log = FlyFor(60.0, {hidden}, seed++);
    const MocapComparison mocap(log);
    const Cause cause = CauseOf(hidden);
    const auto comparison = ComparisonFor(*cause.candidate.info, mocap, false);
    ASSERT_TRUE(comparison) << hidden.id;
    const auto distances = [&](const FlightLog& corrected) {
      return DistancesFromMocap(comparison->rows(corrected), [](double t) { return t >= 20.0; });
    };
    const FlightLog corrected = CorrectLog(log, {cause.effect()}, mocap.path());
    const Gain gain = GainBetween(distances(log), distances(corrected));
    EXPECT_GT(gain.arcs, 10) << hidden.id;
    EXPECT_LE(gain.arcs, 40) << hidden.id;
    EXPECT_TRUE(ClearGain({gain, {}})) << hidden.id << ": " << gain.before << " to " << gain.after;
    FlightLog biased = corrected;
    for (ImuSample& s : biased.imu) s.accel += Eigen::Vector3d(0.3, -0.2, 0.1);
    EXPECT_NEAR(GainBetween(distances(biased), distances(corrected)).before, gain.after,
                0.02 * gain.after)
        << hidden.id;
  }
}

// Of a true effect the fit may state a wrong size: three times the true one.
TEST(Witness, RefutesAWrongSize) {
  const FlightLog log = FlyFor(40.0, {{"fix_scale", {{"s", 0.1}}}}, 62);
  EXPECT_EQ(Ask(log, {"fix_scale", {{"s", 0.3}}}).says, "refutes");
  EXPECT_EQ(Ask(log, {"fix_scale", {{"s", 0.11}}}).says, "confirms");
}

TEST(Witness, TwoEffectsOnOneStreamAreFoundTogether) {
  const Stated scale{"fix_scale", {{"s", 0.1}}}, latency{"fix_latency", {{"tau", 0.15}}};
  const FlightLog log = FlyFor(40.0, {scale, latency}, 63);
  std::vector<Cause> causes{CauseOf(scale), CauseOf(latency)};
  AskWitnesses(log, log, {}, &causes);
  for (const Cause& cause : causes) EXPECT_EQ(cause.witness.says, "confirms") << cause.witness.text;
}

TEST(Witness, TellsTheShareOfAFalseGate) {
  const Stated hidden{"false_gate",
                      {{"fraction", 0.2}, {"gate", -1}, {"dx", 0.5}, {"dy", 1.5}, {"dz", 0.1}}};
  const Witness witness = Ask(FlyFor(40.0, {hidden}, 64), hidden);
  EXPECT_EQ(witness.says, "confirms") << witness.text;
  EXPECT_EQ(Ask(FlyFor(40.0, {}, 64), hidden).says, "refutes");
}

TEST(Witness, SaysWhyItCanNotTell) {
  FlightLog log = FlyFor(40.0, {}, 65);
  EXPECT_THAT(Ask(log, {"wind", {{"w_x", 1.0}, {"w_y", 0.0}}}).text, HasSubstr("no stream"));
  FlightLog brief = log;
  brief.mocap.resize(500);  // 4 s
  EXPECT_THAT(Ask(brief, SensorEffects()[0]).text, HasSubstr("too little"));
  log.mocap.clear();
  const Witness none = Ask(log, SensorEffects()[0]);
  EXPECT_EQ(none.says, "silent");
  EXPECT_THAT(none.text, HasSubstr("no mocap"));
}

// A log whose mocap holds positions alone often repeats the logged attitude in its place.
TEST(Witness, AttitudeThatMocapOnlyRepeatsIsJudgedByTheGyroscope) {
  FlightLog log = FlyFor(40.0, {}, 66);
  const Stated tilt{"tilt_scale", {{"s", 0.2}}};
  EXPECT_EQ(Ask(log, tilt).stream, "mocap attitude");
  std::size_t next = 0;
  for (PoseSample& pose : log.mocap) {
    while (next + 1 < log.attitude.size() && log.attitude[next].t < pose.t) ++next;
    pose.t = log.attitude[next].t;
    pose.q_E = log.attitude[next].q_Ep_I;
  }
  const auto repeated = [](const PoseSample& a, const PoseSample& b) { return a.t == b.t; };
  log.mocap.erase(std::unique(log.mocap.begin(), log.mocap.end(), repeated), log.mocap.end());
  const Witness witness = Ask(log, tilt);
  EXPECT_EQ(witness.stream, "gyroscope");
  EXPECT_EQ(witness.says, "refutes") << witness.text;
}

// A log whose mocap repeats the logged attitude, both late by `tau` s.
FlightLog LateAttitude(double tau) {
  FlightLog log = FlyFor(40.0, {}, 67);
  log.mocap.clear();
  for (AttitudeSample& sample : log.attitude) sample.t += FromSeconds(tau);
  return log;
}

// Without mocap: of errors that are alike at one frequency of turns, each by itself.
TEST(Witness, GyroscopeTellsErrorsOfTheAttitudeApart) {
  const std::vector<Stated> errors = {{"tilt_scale", {{"s", 0.12}}},
                                      {"attitude_latency", {{"tau", 0.06}}},
                                      {"ahrs_drag_error", {{"k", 0.4}}}};
  for (const Stated& hidden : errors) {
    FlightLog log = FlyFor(60.0, {hidden}, 68);
    log.mocap.clear();
    for (const Stated& asked : errors) {
      const Witness witness = Ask(log, asked);
      EXPECT_EQ(witness.stream, "gyroscope");
      EXPECT_EQ(witness.says, asked.id == hidden.id ? "confirms" : "refutes") << witness.text;
    }
  }
}

// Errors that come and go within a second are part of the logged tilt, but no share of it.
TEST(Witness, ADriftOfTheAttitudeIsNoScaleOfItsTilt) {
  FlightLog log = FlyFor(40.0, {}, 69);
  log.mocap.clear();
  AddTiltNoise(0.015, 1.0, &log.attitude);
  const Witness witness = Ask(log, {"tilt_scale", {{"s", 0.12}}});
  EXPECT_EQ(witness.says, "refutes") << witness.text;
  EXPECT_NEAR(witness.value[0], 0.0, 3.3 * std::hypot(witness.sigma[0], 0.01));
}

TEST(Witness, GyroscopeTellsALargeLatency) {
  const auto ask = [](double tau) {
    return Ask(LateAttitude(tau), {"attitude_latency", {{"tau", 0.14}}});
  };
  const Witness late = ask(0.14), in_time = ask(0.0);
  EXPECT_EQ(late.stream, "gyroscope");
  EXPECT_EQ(late.says, "confirms") << late.text;
  EXPECT_NEAR(late.value[0], 0.14, 3.0 * late.sigma[0]) << late.text;
  EXPECT_EQ(in_time.says, "refutes") << in_time.text;
}

TEST(Witness, ASizeThatItContradictsGetsAWiderSigma) {
  Cause cause{{&InfoOf("tilt_scale"), {}}, {}, {}, 1e-6, {}, {}, {}, {}};
  const auto widened = [&](double size, const std::string& says) {
    cause.value = Eigen::VectorXd::Constant(1, 0.2);
    cause.sigma = cause.witness.sigma = Eigen::VectorXd::Constant(1, 0.01);
    cause.witness.value = Eigen::VectorXd::Constant(1, size);
    cause.witness.says = says;
    WidenByWitness(&cause);
    return cause.sigma[0];
  };
  EXPECT_DOUBLE_EQ(widened(0.205, "confirms"), 0.01);
  EXPECT_NEAR(widened(0.12, "silent"), std::sqrt(0.08 * 0.08 - 0.01 * 0.01), 1e-12);
  EXPECT_DOUBLE_EQ(widened(0.01, "refutes"), 0.01);
}

TEST(Witness, AnotherSizeOfTheEffectDoesNotRefuteIt) {
  Cause cause{{&InfoOf("tilt_scale"), {}}, {}, {}, 1e-6, {}, {}, {}, {}};
  cause.value = Eigen::VectorXd::Constant(1, 0.2);
  cause.sigma = Eigen::VectorXd::Constant(1, 0.01);
  Witness witness;
  witness.sigma = Eigen::VectorXd::Constant(1, 0.01);
  const auto says = [&](double size) {
    witness.value = Eigen::VectorXd::Constant(1, size);
    return WitnessVerdict(witness, cause);
  };
  EXPECT_EQ(says(0.21), "confirms");
  EXPECT_EQ(says(0.12), "confirms");
  EXPECT_EQ(says(0.3), "confirms");
  EXPECT_EQ(says(0.05), "refutes");
  EXPECT_EQ(says(-0.2), "refutes");
}

// The fit finds a scale of the tilt, but mocap's attitude is the same: the model's thrust or
// acceleration is wrong, and not the attitude.
TEST(Witness, SlowARefutedCauseIsSetAside) {
  FlightLog log = testing_diagnosis::FlyHiding({}, 29);
  for (AttitudeSample& sample : log.attitude) testing_diagnosis::ScaleTilt(&sample.q_Ep_I);
  for (PoseSample& sample : log.mocap) testing_diagnosis::ScaleTilt(&sample.q_E);
  const Diagnosis diagnosis = testing_diagnosis::DiagnoseQuickly(log);
  for (const Cause& cause : diagnosis.causes) EXPECT_NE(cause.candidate.id(), "tilt_scale");
  ASSERT_FALSE(diagnosis.set_aside.empty());
  EXPECT_EQ(diagnosis.set_aside[0].candidate.id(), "tilt_scale");
  EXPECT_EQ(diagnosis.set_aside[0].witness.says, "refutes");
  EXPECT_THAT(diagnosis.set_aside[0].because, HasSubstr("mocap attitude shows"));
  EXPECT_EQ(diagnosis.verdict, "unexplained");
}

TEST(Diagnose, SlowNoWindIsLookedForIndoors) {
  FlightLog log = testing_diagnosis::FlyHiding({{"wind", {{"w_x", 1.0}, {"w_y", -0.6}}}}, 22);
  log.environment = "indoors";
  const Diagnosis diagnosis = testing_diagnosis::DiagnoseQuickly(log);
  for (const Cause& cause : diagnosis.causes) EXPECT_NE(cause.candidate.id(), "wind");
  for (const CandidateReport& candidate : diagnosis.candidates) EXPECT_NE(candidate.id, "wind");
  EXPECT_NE(diagnosis.verdict, "clean");
}

}  // namespace
}  // namespace trueline
