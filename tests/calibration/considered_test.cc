// Unmodelled effects as an uncertainty of the constants.
#include "problems/calibration/considered.h"

#include "problems/common/error.h"
#include "problems/effects/declaration.h"
#include "tests/common/test_files.h"
#include "tests/rotor/rotor_flight_fixture.h"

namespace trueline {
namespace {

std::vector<ConsideredEffect> Read(const std::string& yaml) {
  return ReadConsidered(YamlMap(YAML::Load(yaml), "c.yaml", "consider"));
}

// Good sensors, so that effects are significant at sizes at which the model is still linear.
RotorNoise Quiet() { return {0.2, 0.02, 0.001, 0.001, 0.02, 0.1}; }

FlightLog Flown() {
  RotorSimulation sim(WuestVehicle());
  sim.noise = Quiet();
  return SimulateRotorFlight(sim, RandomPath(8.0, 4), 3);
}

RotorCalibrationOptions Considering(const std::string& yaml) {
  RotorCalibrationOptions options(WuestVehicle());
  options.prior = DrawnPrior(WuestVehicle(), 2);
  options.noise = Quiet();
  options.learn_noise = false;
  options.hold_out = 0.0;
  options.widen = false;
  options.considered = Read(yaml);
  return options;
}

// The linear step of ConsideredCovariance equals the change of the fit with the effect in the
// model, to a few per cent.
TEST(Considered, SlowIsWhatAModelWithTheEffectWouldMoveTheConstantsBy) {
  const FlightLog log = Flown();
  for (const Effect& effect :
       std::vector<Effect>{{"linear_drag", {{"K_x", 0.1}}},
                           {"translational_lift", {{"k", 0.02}}},
                           {"rotor_loss", {{"rotor", 0}, {"factor", 1.001}}}}) {
    RotorCalibrationOptions options = Considering("{}");
    const RotorBatchOptions batch{options.noise, options.prior};
    const RotorAeroModel model = ModelFor(options, log);
    const RotorData data = MakeRotorData(log, 4, {});
    const RotorBatchResult fit = RunRotorBatch(model, data, batch);
    options.effects = {effect};
    const RotorAeroModel with = ModelFor(options, log);
    const RotorConstants added = RotorExtensionOf(options.effects).added;
    const Eigen::MatrixXd cov =
        ConsideredCovariance(model, data, batch, fit, {{with, added, nullptr}});
    RotorBatchOptions extended = batch;
    extended.prior.mean += added;
    const RotorBatchResult moved = RunRotorBatch(with, data, extended);
    double largest = 0.0;
    for (const int i : options.prior.Free()) {
      const double shift = std::abs(moved.mean[i] - fit.mean[i]), sigma = std::sqrt(fit.cov(i, i));
      EXPECT_NEAR(std::sqrt(cov(i, i)), shift, 0.1 * shift + 0.05 * sigma)
          << effect.id << ", " << kRotorConstants[i].name;
      largest = std::max(largest, shift / sigma);
    }
    EXPECT_GT(largest, 0.3) << effect.id << " moves nothing";
  }
}

TEST(Considered, SlowWidensIntervalsAndLeavesValues) {
  const FlightLog log = Flown();
  const RotorCalibration plain = CalibrateRotors(log, Considering("{}"));
  const RotorCalibration wide = CalibrateRotors(log, Considering("rotor_loss: {factor: 0.02}"));
  const int m = FindRotorConstant("m");
  EXPECT_EQ(wide.batch.mean[m], plain.batch.mean[m]);
  // Four rotors that differ by 2 %: total thrust, and with it mass, by 1 %.
  const double added = std::sqrt(wide.batch.cov(m, m) - plain.batch.cov(m, m));
  EXPECT_NEAR(added / plain.batch.mean[m], 0.01, 0.002);
}

TEST(Considered, WhatTheModelHasIsLeftOut) {
  const FlightLog log = Flown();
  RotorCalibrationOptions options =
      Considering("{linear_drag: {K_x: 0.1, K_y: 0.1}, rotor_loss: {factor: 0.01}}");
  EXPECT_EQ(ConsideredVariants(log, options, {}).size(), 6u);
  options.prior.sigma[FindRotorConstant("K_x")] = 0.3;
  EXPECT_EQ(ConsideredVariants(log, options, {}).size(), 5u);
  options.effects = {{"rotor_loss", {{"rotor", 1}, {"factor", 0.9}}}};
  EXPECT_EQ(ConsideredVariants(log, options, {}).size(), 1u);
}

TEST(Considered, NamesAreTheCataloguesAndMistakesAreNamed) {
  for (const EffectInfo* declared : CausesOf(DriveKind::kRotors)) {
    const EffectInfo& info = *declared;
    if (info.id.ends_with("_step") || info.id == "ground_effect") continue;
    for (const EffectParameterInfo& parameter : info.parameters) {
      EXPECT_EQ(Read(info.id + ": {" + parameter.name + ": 0.1}").size(), 1u) << info.id;
    }
  }
  const auto refused = [](const std::string& yaml) { return ErrorOf([&] { Read(yaml); }); };
  EXPECT_THAT(refused("gust: {x: 1}"),
              AllOf(HasSubstr("can't be considered"), HasSubstr("rotor_tilt")));
  EXPECT_THAT(refused("rotor_loss: {share: 1}"), HasSubstr("known here: factor"));
  EXPECT_THAT(refused("rotor_loss: {factor: 0}"), HasSubstr("above zero"));
}

}  // namespace
}  // namespace trueline
