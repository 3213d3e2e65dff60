// Calibration by rotor speeds from a log to its files.
#include "problems/calibration/rotor_calibration.h"

#include <array>

#include "problems/calibration/calibration_config.h"
#include "problems/calibration/learn_rotor_noise.h"
#include "problems/calibration/write_calibration.h"
#include "problems/common/error.h"
#include "problems/common/parallel.h"
#include "problems/result/render.h"
#include "problems/simulation/simulate_rotor_flight.h"
#include "problems/simulation/streams.h"
#include "tests/common/test_files.h"
#include "tests/rotor/rotor_flight_fixture.h"

namespace trueline {
namespace {

std::filesystem::path Source() { return TRUELINE_TEST_SOURCE_DIR; }

FlightLog FlyFor(double duration) {
  RotorSimulation sim(WuestVehicle());
  return SimulateRotorFlight(sim, RandomPath(duration, 4), 3);
}

RotorCalibrationOptions Nominal() {
  RotorCalibrationOptions options(WuestVehicle());
  options.prior = DrawnPrior(WuestVehicle(), 2);
  options.learn_noise = false;
  return options;
}

const ParameterEstimate& Find(const RotorCalibration& c, const std::string& name) {
  for (const ParameterEstimate& p : c.parameters) {
    if (p.name == name) return p;
  }
  throw std::runtime_error(name);
}

TEST(RotorCalibration, AnInformativeFlightIsUsable) {
  FlightLog log = FlyFor(14.0);
  log.warnings = {"one of the log"};
  RotorCalibrationOptions options = Nominal();
  options.warnings = {"one of the configuration"};
  const RotorCalibration c = CalibrateRotors(log, options);
  EXPECT_THAT(c.warnings, ElementsAre("one of the log", "one of the configuration"));
  EXPECT_EQ(c.verdict.word, "usable") << (c.verdict.reasons.empty() ? "" : c.verdict.reasons[0]);
  EXPECT_EQ(c.parameters.size(), 18u);
  EXPECT_EQ(Find(c, "m").status, "identified");
  EXPECT_NEAR(Find(c, "m").value, 0.2463, 4.0 * Find(c, "m").sigma);
  ASSERT_EQ(c.predictions.size(), 3u);
  EXPECT_GT(c.predictions[1].count, 5);
  EXPECT_LT(c.predictions[1].after, 0.5 * c.predictions[1].before);  // the prior's mass is wrong
}

// A common scale of mass, inertia, k_f and k_m changes no output; nor does a common shift of all
// levers along z.
TEST(RotorCalibration, NamesWhatNoFlightShows) {
  RotorCalibrationOptions options = Nominal();
  options.hold_out = 0.0;
  for (const char* name : {"k_f", "k_m"}) options.prior.sigma[FindRotorConstant(name)] = 0.1;
  options.prior.sigma[FindRotorConstant("r_BI_z")] = 0.02;
  const RotorCalibration c = CalibrateRotors(FlyFor(8.0), options);
  std::string all;
  for (const std::string& combination : c.unobservable) all += combination + "\n";
  EXPECT_THAT(all, AllOf(HasSubstr("k_f"), HasSubstr("m with"), HasSubstr("r_BM_z")));
}

// What is predicted is the place of the pose sensor, not that of the centre of mass.
TEST(OpenLoop, StartsAtThePoseSensor) {
  RotorSimulation sim(WuestVehicle());
  sim.noise = {0.4, 0.03, 0.003, 0.005, 0.05, 0.3};
  const FlightLog log = SimulateRotorFlight(sim, RandomPath(9.0, 4), 3);
  RotorCalibrationOptions options(WuestVehicle());
  const RotorConstants truth = options.prior.mean;
  const auto errors = PredictOpenLoop(ModelFor(options, log), MakeRotorData(log, 4, options.data),
                                      sim.noise, truth, truth, {0.04}, 0.2);
  ASSERT_GT(errors.size(), 5u);
  const Eigen::Vector3d arm = truth.segment<3>(FindRotorConstant("r_BP_x"));
  double sum = 0.0;
  for (const OpenLoopError& e : errors) sum += e.error;
  EXPECT_GT(arm.norm(), 0.03);
  EXPECT_LT(sum / static_cast<double>(errors.size()), 0.3 * arm.norm());
}

// Half a flight may show inertia so badly that its fit lets the filter diverge. A diagnosis then
// has no held-out errors; it does not end.
TEST(OpenLoop, AFilterThatDivergesPredictsNothing) {
  const RotorSimulation sim(WuestVehicle());
  const RotorData data = MakeRotorData(FlyFor(3.0), 4, {});
  const RotorAeroModel model = EstimationModel(sim.vehicle);
  RotorConstants constants = PriorFromVehicle(WuestVehicle()).mean;
  EXPECT_FALSE(PredictOpenLoop(model, data, sim.noise, constants, constants, {0.5}, 0.1).empty());
  constants.segment<3>(kInertiaConstants) *= 1e-9;
  EXPECT_TRUE(PredictOpenLoop(model, data, sim.noise, constants, constants, {0.5}, 0.1).empty());
  EXPECT_TRUE(ForecastOpenLoop(model, data, sim.noise, constants, {0.5}, 0.1).empty());
}

TEST(LearnNoise, FindsTheNoiseThatFlew) {
  const RotorSimulation sim(WuestVehicle());
  const RotorData data = MakeRotorData(FlyFor(6.0), 4, {});
  RotorEkfOptions options;
  options.noise = sim.noise;
  options.noise.gyro *= 4.0;
  options.noise.force_density *= 0.25;
  options.prior = DrawnPrior(WuestVehicle(), 2);
  const LearnedNoise learned =
      LearnRotorNoise(EstimationModel(sim.vehicle), data, options, options.noise);
  EXPECT_GT(learned.gain, 100.0);
  EXPECT_NEAR(std::log(learned.noise.gyro / sim.noise.gyro), 0.0, 0.2);
  EXPECT_NEAR(std::log(learned.noise.force_density / sim.noise.force_density), 0.0, 0.7);
  EXPECT_NEAR(std::log(learned.noise.position / sim.noise.position), 0.0, 0.3);
}

// On one core no trial is run ahead of its turn. Rounding may differ: vectorised sums begin where
// malloc aligns their data.
TEST(LearnNoise, IsTheSameOnOneCoreAndOnMany) {
  const RotorSimulation sim(WuestVehicle());
  const RotorData data = MakeRotorData(FlyFor(2.0), 4, {});
  RotorEkfOptions options;
  options.noise = sim.noise;
  options.noise.gyro *= 4.0;
  options.prior = DrawnPrior(WuestVehicle(), 2);
  const RotorAeroModel model = EstimationModel(sim.vehicle);
  const auto learn = [&] { return LearnRotorNoise(model, data, options, options.noise); };
  const LearnedNoise many = learn();
  std::array<LearnedNoise, 2> one;
  ParallelFor(2, 2, [&](int i) { one[i] = learn(); });
  EXPECT_LT(many.noise.gyro, 0.5 * options.noise.gyro);
  EXPECT_NEAR(one[0].noise.gyro / many.noise.gyro, 1.0, 1e-9);
  EXPECT_NEAR(one[0].noise.force_density / many.noise.force_density, 1.0, 1e-9);
  EXPECT_NEAR(one[0].noise.position / many.noise.position, 1.0, 1e-9);
  EXPECT_EQ(one[0].runs, many.runs);
  EXPECT_NEAR(one[0].gain / many.gain, 1.0, 1e-9);
}

TEST(LearnRotorDelay, FindsLateStamps) {
  const RotorSimulation sim(WuestVehicle());
  RotorData data = MakeRotorData(FlyFor(6.0), 4, {});
  for (double& t : data.speed_times) t += 0.015;
  RotorEkfOptions options;
  options.noise = sim.noise;
  options.prior = DrawnPrior(WuestVehicle(), 2);
  EXPECT_NEAR(LearnRotorDelay(EstimationModel(sim.vehicle), data, options), -0.015, 0.0015);
}

// A low-pass of 12 Hz comes late by 0.225 / 12 s at frequencies well below it, and later near it.
TEST(LearnGyroDelay, FindsAFilter) {
  RotorSimulation sim(WuestVehicle());
  FlightLog log = FlyFor(6.0);
  RotorEkfOptions options;
  options.noise = sim.noise;
  options.prior = DrawnPrior(WuestVehicle(), 2);
  const auto learned = [&] {
    const RotorData data = MakeRotorData(log, 4, {});
    return LearnGyroDelay(EstimationModel(sim.vehicle), log, data, options, 0.0);
  };
  EXPECT_NEAR(learned(), 0.0, 0.0005);
  simulation::LowPassGyro(12.0, &log.imu);
  EXPECT_NEAR(learned(), 0.225 / 12.0, 0.002);
}

TEST(RotorCalibration, WritesWhatOthersRead) {
  const TestFolder folder;
  const std::filesystem::path& out = folder.directory();
  const FlightLog log = FlyFor(6.0);
  const RotorCalibrationOptions options = Nominal();
  const RotorCalibration c = CalibrateRotors(log, options);
  WriteCalibration(c, log, Provenance(log, 0, ToYaml(options)), out);
  const YAML::Node yaml = YAML::LoadFile((out / "calibration.yaml").string());
  EXPECT_NEAR(yaml["parameters"]["m"]["value"].as<double>(), Find(c, "m").value, 1e-5);
  EXPECT_EQ(yaml["parameters"]["I_x"]["unit"].as<std::string>(), "kg m^2");
  EXPECT_EQ(yaml["drive"].as<std::string>(), "rotors");
  EXPECT_GE(yaml["open_loop"].size(), 1u);
  EXPECT_THAT(ReadText(out / "windows.csv"), AllOf(HasSubstr(",filter,"), HasSubstr(",batch,")));
  EXPECT_THAT(ReadText(out / "trajectory.csv"), HasSubstr("t [s],estimator,kind,tau,x [m]"));
  EXPECT_EQ(RunReport("rotors", {"--result=" + out.string()}, out / "report.html"), "");
  EXPECT_THAT(ReadText(out / "report.html"), HasSubstr("Calibration by rotor speeds"));
  // The model of this flight is the prior of the next, except for the biases.
  const RotorCalibrationOptions next = ResolveRotorOptions("", (out / "model.yaml").string(), log);
  EXPECT_NEAR(next.prior.mean[0], Find(c, "m").value, 1e-6);
  EXPECT_NEAR(next.prior.sigma[0], Find(c, "m").sigma, 1e-5);
  EXPECT_EQ(next.prior.mean[FindRotorConstant("b_a_x")], 0.0);
}

constexpr double kMass = 0.2463;  // kg, of the vehicle that flies

// The flight that a model is brought to, and what it shows by itself.
const FlightLog& Again() {
  static const FlightLog log =
      SimulateRotorFlight(RotorSimulation(WuestVehicle()), RandomPath(12.0, 5), 7);
  return log;
}
const RotorCalibration& Alone() {
  static const RotorCalibration alone = CalibrateRotors(Again(), Nominal());
  return alone;
}

// The model's prior of these constants is what the calibration shows.
RotorCalibrationOptions WithModel(const RotorCalibration& shown,
                                  const std::vector<std::string>& names) {
  RotorCalibrationOptions options = Nominal();
  options.prior_without_model = options.prior;
  for (const std::string& name : names) {
    options.prior.mean[FindRotorConstant(name)] = Find(shown, name).value;
    options.prior.sigma[FindRotorConstant(name)] = Find(shown, name).sigma;
  }
  return options;
}

// The model is about as sharp as the flight, so that no sigma is half of the prior's.
TEST(RotorModel, OneThatAgreesSharpensWhatTheFlightShows) {
  const RotorCalibration first = CalibrateRotors(FlyFor(12.0), Nominal());
  std::vector<std::string> vehicle;
  for (const ParameterEstimate& p : first.parameters) {
    if (!p.name.starts_with("b_")) vehicle.push_back(p.name);
  }
  const RotorCalibrationOptions options = WithModel(first, vehicle);
  RotorCalibrationOptions used = Nominal();
  const RotorCalibration c = CalibrateRotors(Again(), options, &used);
  EXPECT_THAT(c.warnings, IsEmpty());
  EXPECT_EQ(used.prior.mean, options.prior.mean);
  EXPECT_LT(Find(c, "m").sigma, 0.9 * Find(Alone(), "m").sigma);
  EXPECT_NEAR(Find(c, "m").value, kMass, 4.0 * Find(c, "m").sigma);
  for (const ParameterEstimate& p : Alone().parameters) {
    EXPECT_EQ(Find(c, p.name).status, p.status) << p.name;
  }
}

// A load of 12 % of the mass, that the model's flight did not have.
TEST(RotorModel, OneOfAnotherMassIsNotUsed) {
  RotorCalibrationOptions options = WithModel(Alone(), {"m"});
  options.prior.mean[kMassConstant] = 0.88 * kMass;
  options.warnings = {"one of the configuration"};
  RotorCalibrationOptions used = Nominal();
  const RotorCalibration c = CalibrateRotors(Again(), options, &used);
  const auto said = ElementsAre("one of the configuration",
                                AllOf(HasSubstr("the model's m of 0.2167 +-"),
                                      HasSubstr("contradicts this flight, which alone shows 0.24"),
                                      HasSubstr("are not used as a prior")));
  EXPECT_THAT(c.warnings, said);
  EXPECT_THAT(used.warnings, said);
  EXPECT_EQ(used.prior.mean, Nominal().prior.mean);
  for (const ParameterEstimate& p : Alone().parameters) {
    EXPECT_DOUBLE_EQ(Find(c, p.name).value, p.value) << p.name;
    EXPECT_DOUBLE_EQ(Find(c, p.name).sigma, p.sigma) << p.name;
    EXPECT_EQ(Find(c, p.name).status, p.status) << p.name;
  }
}

// A pose sensor that was moved by 60 mm since. The constants beside it are the model's, too, so the
// fit with the model can hide it in them.
TEST(RotorModel, OneOfAnotherPlaceOfThePoseSensorIsNotUsed) {
  RotorCalibrationOptions options = WithModel(Alone(), {"m", "r_BM_x", "r_BP_x"});
  options.prior.mean[FindRotorConstant("r_BP_x")] += 0.06;
  const RotorCalibration c = CalibrateRotors(Again(), options);
  EXPECT_THAT(c.warnings, ElementsAre(HasSubstr("the model's r_BP_x of")));
  EXPECT_DOUBLE_EQ(Find(c, "r_BP_x").value, Find(Alone(), "r_BP_x").value);
}

// A weak rotor that this flight does not have makes the vehicle look light.
TEST(RotorModel, EffectsThatMakeItContradictTheFlightAreLeftOut) {
  RotorCalibrationOptions options = WithModel(Alone(), {"m", "r_BM_x", "r_BM_y"});
  options.effects = {{"rotor_loss", {{"rotor", 0}, {"factor", 0.9}}}};
  RotorCalibrationOptions used = Nominal();
  const RotorCalibration c = CalibrateRotors(Again(), options, &used);
  EXPECT_THAT(c.effects, IsEmpty());
  EXPECT_THAT(used.effects, IsEmpty());
  EXPECT_EQ(used.prior.mean, options.prior.mean);
  EXPECT_THAT(c.warnings, ElementsAre(HasSubstr("the effects are not used (rotor_loss")));
  EXPECT_LT(Find(c, "m").sigma, 0.9 * Find(Alone(), "m").sigma);
}

// Constants that are estimated state the effects that are parts of them; model.yaml holds the rest.
TEST(RotorCalibration, KeepsTheEffectsThatItsConstantsDoNotState) {
  RotorPrior prior = PriorFromVehicle(WuestVehicle());
  for (const char* name : {"K_x", "K_y"}) prior.sigma[FindRotorConstant(name)] = 0.1;
  const std::vector<Effect> kept =
      EffectsBesideConstants({{"linear_drag", {{"K_x", -0.3}, {"K_y", -0.2}, {"K_z", -0.1}}},
                              {"rotor_speed_drag", {{"k", 1e-4}}}},
                             prior);
  ASSERT_EQ(kept.size(), 2u);
  EXPECT_EQ(kept[0]["K_x"], 0.0);
  EXPECT_EQ(kept[0]["K_z"], -0.1);
  EXPECT_EQ(kept[1]["k"], 1e-4);
  prior.sigma[FindRotorConstant("K_z")] = 0.1;
  EXPECT_EQ(EffectsBesideConstants({{"linear_drag", {{"K_x", -0.3}}}}, prior).size(), 0u);
}

TEST(RotorCalibration, ForecastsCountFromTheSameTimeAsTheFit) {
  const FlightLog log = FlyFor(8.0);
  const RotorCalibration c = CalibrateRotors(log, Nominal());
  ASSERT_FALSE(c.open_loop.empty());
  EXPECT_GT(c.open_loop.front().t, c.pose_times.back() - 0.1);
}

TEST(RotorOptions, ShippedConfigurationsAreRead) {
  const FlightLog log = FlyFor(2.0);
  const RotorCalibrationOptions options =
      ResolveRotorOptions(Source() / "config/calibrate/rotors.yaml", "", log);
  EXPECT_EQ(options.prior.Free().size(), 18u);
  EXPECT_EQ(options.vehicle.model.num_rotors(), 4);
  for (const char* name :
       {"rotors_neurobem", "rotors_nanodrone", "rotors_nanobench", "rotors_indi_throw"}) {
    const auto file = Source() / "config/calibrate" / (std::string(name) + ".yaml");
    const RotorCalibrationOptions real = ResolveRotorOptions(file, "", log);
    EXPECT_EQ(real.prior.sigma[0], 0.0) << name;  // the vehicle was weighed
    EXPECT_GT(real.data.end, 0.0);
  }
  const RotorFlightConfig flight =
      ReadRotorFlight(YamlMap::FromFile(Source() / "config/rotors/random.yaml"));
  EXPECT_NEAR(flight.path.duration(), 20.0, 1e-9);
}

std::string ErrorOf(const std::string& text) {
  return trueline::ErrorOf([&] {
    RotorCalibrationOptions options = Nominal();
    const YamlMap map(YAML::Load(text), "rotors.yaml", "");
    ReadRotorOptions(map, &options);
    map.Finish();
  });
}

std::string MessageOf(const FlightLog& log) {
  return trueline::ErrorOf([&] { CalibrateRotors(log, Nominal()); });
}

TEST(RotorOptions, AnotherVehicleThanTheLogsIsSaid) {
  FlightLog log = FlyFor(2.0);
  const auto config = (Source() / "config/calibrate/rotors.yaml").string();
  const RotorCalibrationOptions same = ResolveRotorOptions(config, "", log);
  log.vehicle = Vehicle{same.prior.mean[kMassConstant], same.vehicle.model.rotors()};
  EXPECT_TRUE(ResolveRotorOptions(config, "", log).warnings.empty());
  log.vehicle->rotors[1].k_f *= 1.2;
  const auto warnings = ResolveRotorOptions(config, "", log).warnings;
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0], AllOf(HasSubstr("k_f of rotor 2"), HasSubstr("log.yaml")));
}

// Mass after the earlier flight is not the one that its model states, and nothing drops now.
TEST(RotorOptions, AStepOfAnotherFlightIsLeftOut) {
  FlightLog log = FlyFor(2.0);
  log.sha256["imu.csv"] = "1234";
  const TestFolder folder;
  const std::string file = folder / "rotor_step_model.yaml";
  const auto options = [&](const std::string& digest) {
    std::ofstream(file) << "parameters:\n"
                           "  m: {value: 0.24, sigma: 0.001, unit: kg}\n"
                           "  I_x: {value: 6e-4, sigma: 1e-6, unit: kg m^2}\n"
                           "effects:\n"
                           "  - {id: payload_step, t_step: 7.0, mass: 0.04}\n"
                           "  - {id: rotor_tilt, roll: 0.02, pitch: 0.0}\n"
                           "provenance: {sha256: {imu.csv: "
                        << digest << "}}\n";
    return ResolveRotorOptions(Source() / "config/calibrate/rotors.yaml", file, log);
  };
  const RotorCalibrationOptions other = options("5678"), own = options("1234");
  ASSERT_EQ(other.effects.size(), 1u);
  EXPECT_EQ(other.effects[0].id, "rotor_tilt");
  EXPECT_GT(other.prior.sigma[kMassConstant], 0.01);
  EXPECT_EQ(other.prior.sigma[kInertiaConstants], 1e-6);
  ASSERT_EQ(other.warnings.size(), 1u);
  EXPECT_THAT(other.warnings[0], AllOf(HasSubstr("payload_step (t_step 7 s, mass 0.04 kg)"),
                                       HasSubstr("the model's m held before that")));
  EXPECT_EQ(own.effects.size(), 2u);
}

// The model's drag is free; the configuration has none.
TEST(RotorOptions, ThePriorWithoutTheModelIsKept) {
  FlightLog log = FlyFor(2.0);
  log.sha256["imu.csv"] = "1234";
  const TestFolder folder;
  const std::string file = folder / "rotor_prior_model.yaml";
  const auto options = [&](const std::string& digest) {
    std::ofstream(file) << "parameters:\n"
                           "  m: {value: 0.24, sigma: 0.001, unit: kg}\n"
                           "  K_x: {value: -0.3, sigma: 0.01, unit: 1/s}\n"
                           "effects:\n"
                           "  - {id: linear_drag, K_x: 0.0, K_y: -0.1, K_z: 0.0}\n"
                           "provenance: {sha256: {imu.csv: "
                        << digest << "}}\n";
    return ResolveRotorOptions("", file, log);
  };
  const RotorCalibrationOptions other = options("5678"), own = options("1234");
  EXPECT_FALSE(own.prior_without_model);
  ASSERT_TRUE(other.prior_without_model);
  const RotorPrior& without = *other.prior_without_model;
  const int K_x = FindRotorConstant("K_x"), K_y = FindRotorConstant("K_y");
  EXPECT_EQ(other.prior.sigma[kMassConstant], 0.001);
  EXPECT_EQ(without.mean[kMassConstant], *log.vehicle->mass);
  EXPECT_GT(without.sigma[kMassConstant], 0.01);
  EXPECT_EQ(other.prior.sigma[K_x], 0.01);
  EXPECT_EQ(without.mean[K_x], 0.0);
  EXPECT_NEAR(without.sigma[K_x], 0.31, 1e-12);
  EXPECT_NEAR(without.mean[K_y], -0.1, 1e-12);
  EXPECT_NEAR(other.of_effects[K_y], -0.1, 1e-12);
  EXPECT_NEAR(other.of_effects[K_x], 0.0, 1e-12);
}

TEST(RotorOptions, WrongOnesAreRefusedByName) {
  EXPECT_THAT(ErrorOf("prior:\n  mass: 0.1"),
              AllOf(HasSubstr("rotors.yaml:2"), HasSubstr("mass"), HasSubstr("r_BM_x")));
  EXPECT_THAT(ErrorOf("hold_out: 0.9"), HasSubstr("at most 0.8"));
  EXPECT_THAT(ErrorOf("noise: {sigma_gyro: 0}"), HasSubstr("above zero"));
  EXPECT_THAT(ErrorOf("speed: 3"), HasSubstr("speed"));
  EXPECT_THAT(ErrorOf("prior: {m: .nan}"), HasSubstr("finite"));
  FlightLog log = FlyFor(2.0);
  EXPECT_THAT(MessageOf(log), AllOf(HasSubstr("too short"), HasSubstr("hold_out: 0")));
  log.rotors.clear();
  EXPECT_THROW(CalibrateRotors(log, Nominal()), InputError);
}

}  // namespace
}  // namespace trueline
