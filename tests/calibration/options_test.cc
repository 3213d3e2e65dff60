// Options from YAML and flags: round trip, strictness, models of earlier flights, shipped files.
#include <fstream>
#include <functional>
#include <sstream>

#include "problems/calibration/calibration_config.h"
#include "problems/calibration/write_calibration.h"
#include "problems/common/error.h"
#include "tests/common/test_files.h"
#include "tests/vgd/flights.h"

namespace trueline {
namespace {

std::filesystem::path ConfigFile(const std::string& name) {
  return std::filesystem::path(TRUELINE_TEST_SOURCE_DIR) / "config/calibrate" / name;
}

// A file of its own for each test.
std::string Written(const std::string& text) {
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  const auto path = std::filesystem::path(testing::TempDir()) /
                    (std::string(test->test_suite_name()) + test->name() + ".yaml");
  std::ofstream(path) << text;
  return path.string();
}

std::string ErrorOfConfig(const std::string& text) {
  return trueline::ErrorOf([&] { FromYaml<VgdOptions>(YamlMap::FromFile(Written(text))); });
}

CalibrationFlags Flags(const std::function<void(CalibrationFlags*)>& change) {
  CalibrationFlags flags;
  flags.estimators = "vgd";
  change(&flags);
  return flags;
}

std::string ErrorOfFlags(const CalibrationFlags& flags) {
  return trueline::ErrorOf([&] { ResolveCalibrationOptions(flags); });
}

std::string Text(const YAML::Node& node) {
  YAML::Emitter emitter;
  emitter.SetDoublePrecision(12);
  emitter << node;
  return emitter.c_str();
}

VgdOptions EveryOptionChanged() {
  VgdOptions o;
  o.gamma = 4;
  o.min_window_fixes = 9;
  for (int i = 0; i < kMotionSize; ++i) {
    ParameterPrior& prior = o.priors[i];
    prior = {prior.mean - 0.01, 0.9 * prior.sigma, 0.9 * prior.lower, prior.upper + 0.02};
  }
  o.ranges = RangeUse::kStart;
  o.start = SearchStart::kRandom;
  o.start_seed = 5;
  o.loss = FixLoss::kCauchy;
  o.loss_scale = 3.0;
  o.whiten = false;
  o.process = {0.2, 1.5, 0.03, 0.04, 2.5, 0.11, 1.7};
  o.adapt_drift = false;
  o.knot_interval = 0.4;
  o.drag_measurement = {false, 0.07, 0.3, 2.0};
  o.solver = VgdSolver::kGradientDescent;
  o.max_iterations = 77;
  o.tolerance = 1e-5;
  o.max_block = 0.02;
  o.passes = {0.9, 4, 5.0, {DivideFixes::kNever, 6.0, 2.0, 0.4, 0.6, 50.0, 0.05, 0.1, 0.2, 0.02}};
  o.drive = {ThrustSource::kLevelFlight,
             AttitudeSource::kComplementaryFilter,
             {0.2, 0.01},
             0.03,
             20.0,
             {0.002, 0.06, 0.07},
             0.4,
             {}};  // effects come from a model file
  return o;
}

TEST(VgdOptions, SurviveYamlAndBack) {
  const VgdOptions changed = EveryOptionChanged();
  const std::string text = Text(ToYaml(changed));
  const VgdOptions read = FromYaml<VgdOptions>(YamlMap(YAML::Load(text), "memory", ""));
  EXPECT_EQ(Text(ToYaml(read)), text);
  // And no option was left out of either direction.
  const std::string defaults = Text(ToYaml(VgdOptions()));
  std::istringstream a(text), b(defaults);
  for (std::string x, y; std::getline(a, x) && std::getline(b, y);) {
    if (x.back() == ':') continue;
    EXPECT_NE(x, y) << "not changed by this test";
  }
  for (int i = 0; i < kMotionSize; ++i) {
    EXPECT_NEAR(read.priors[i].mean, changed.priors[i].mean, 1e-9);
    EXPECT_NEAR(read.priors[i].upper, changed.priors[i].upper, 1e-9);
  }
  EXPECT_NEAR(read.process.tilt, 0.03, 1e-9);
  EXPECT_EQ(read.drive.thrust, ThrustSource::kLevelFlight);
  EXPECT_EQ(read.passes.min_fixes, 4);
}

TEST(VgdOptions, TheDefaultFileStatesTheDefaults) {
  EXPECT_EQ(Text(ToYaml(FromYaml<EstimatorOptions>(YamlMap::FromFile(ConfigFile("default.yaml"))))),
            Text(ToYaml(EstimatorOptions())));
}

TEST(VgdOptions, EveryShippedFileRunsAFlight) {
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(ConfigFile(""))) {
    SCOPED_TRACE(entry.path().string());
    if (entry.path().filename().string().starts_with("rotors")) continue;  // of the other drive
    const VgdOptions options = FromYaml<EstimatorOptions>(YamlMap::FromFile(entry.path())).vgd;
    SimulationConfig config = testing_simulation::ReadShipped("hippodrome", 15.0);
    const testing_vgd::Flight flight(config, 3, options);
    const EstimatorRun run = RunVgd(flight.data, options);
    ASSERT_FALSE(run.windows.empty());
    for (const WindowEstimate& window : run.windows) {
      for (const ParameterEstimate& p : window.parameters) {
        EXPECT_TRUE(std::isfinite(p.value) && p.sigma > 0.0 && std::isfinite(p.sigma)) << p.name;
      }
      EXPECT_TRUE(!window.arc || window.arc->cov.determinant() > 0.0);
    }
    EXPECT_GT(SummariseArcs(run).error.count, 0);
    EXPECT_LT(SummariseArcs(run).error.median, 2.0);
    ++files;
  }
  EXPECT_GE(files, 4);
}

TEST(VgdOptions, RefuseWhatIsWrongByFileLineAndKey) {
  EXPECT_THAT(ErrorOfConfig("gamma: 3\ngama: 4\n"),
              AllOf(HasSubstr(".yaml:2: 'gama': unknown key"), HasSubstr("gamma")));
  EXPECT_THAT(ErrorOfConfig("priors:\n  K_x: {mean: -0.5, sgima: 1}\n"),
              AllOf(HasSubstr(".yaml:2"), HasSubstr("sgima")));
  EXPECT_THAT(ErrorOfConfig("priors: {K_z: {mean: 1}}\n"), HasSubstr("K_z"));
  EXPECT_THAT(ErrorOfConfig("loss: hubber\n"), AllOf(HasSubstr(":1: 'loss'"), HasSubstr("huber")));
  EXPECT_THAT(ErrorOfConfig("gamma: three\n"), HasSubstr(":1: 'gamma'"));
  EXPECT_THAT(ErrorOfConfig("gamma: 0\n"), HasSubstr("must be 1 or more"));
  EXPECT_THAT(ErrorOfConfig("min_fixes: 0\n"), HasSubstr("must be 1 or more"));
  EXPECT_THAT(ErrorOfConfig("max_iterations: -3\n"), HasSubstr("must be 1 or more"));
  EXPECT_THAT(ErrorOfConfig("tolerance: 0\n"), HasSubstr("must be above zero"));
  EXPECT_THAT(ErrorOfConfig("knot_interval_s: .nan\n"), HasSubstr("must be a finite number"));
  EXPECT_THAT(ErrorOfConfig("process: {tilt_deg: -1}\n"), HasSubstr("must be zero or above"));
  EXPECT_THAT(ErrorOfConfig("drive: {filter_k_p_per_s: -1}\n"), HasSubstr("must be zero or above"));
  EXPECT_THAT(ErrorOfConfig("priors:\n  K_x: {lower: -0.1}\n"),
              AllOf(HasSubstr(":2"), HasSubstr("needs lower < mean < upper")));
}

TEST(CalibrationFlags, AreCheckedAndOutrankTheFile) {
  EXPECT_THAT(ErrorOfFlags(Flags([](auto* f) { f->estimators = "vgd,ukf"; })),
              AllOf(HasSubstr("'ukf' is not known; use one of:"), HasSubstr("vgd")));
  EXPECT_THAT(ErrorOfFlags(Flags([](auto* f) { f->estimators = ""; })),
              HasSubstr("names no estimator"));
  EXPECT_THAT(ErrorOfFlags(Flags([](auto* f) { f->gamma_sweep = "1,x"; })),
              HasSubstr("'x' is not a window length"));
  EXPECT_THAT(ErrorOfFlags(Flags([](auto* f) { f->gamma = -2; })),
              HasSubstr("'-2' is not a window length"));
  EXPECT_THAT(ErrorOfFlags(Flags([](auto* f) { f->thrust = "baro"; })),
              HasSubstr("use accelerometer, level_flight or as_published"));
  EXPECT_THAT(ErrorOfFlags(Flags([](auto* f) {
                f->config = Written("ranges: start\n");
                f->model = "model.yaml";
              })),
              HasSubstr("--model=model.yaml is a prior"));
  const CalibrationOptions options = ResolveCalibrationOptions(Flags([](auto* f) {
    f->config = Written("gamma: 5\nloss: none\n");
    f->gamma_sweep = "1,4";
    f->thrust = "level_flight";
    f->gamma = 2;
  }));
  EXPECT_EQ(options.methods.vgd.gamma, 2);
  EXPECT_EQ(options.methods.vgd.loss, FixLoss::kNone);
  EXPECT_EQ(options.methods.vgd.drive.thrust, ThrustSource::kLevelFlight);
  EXPECT_THAT(options.gamma_sweep, ElementsAre(1, 4));
}

const char kModel[] =
    "parameters:\n"
    "  K_x: {value: -0.41, sigma: 0.02, unit: 1/s}\n"
    "  K_y: {value: -0.44, sigma: 0.03, unit: 1/s}\n"
    "  b_az: {value: 0.1, sigma: 0.04, unit: m/s^2}\n"
    "  phi_E_Ep: {value: 0.5, sigma: 0.01, unit: rad}\n"
    "  phi_I_B: {value: 0.01, sigma: 0.005, unit: rad}\n"
    "  theta_I_B: {value: -0.02, sigma: 0.006, unit: rad}\n"
    "  psi_I_B: {value: 0.03, sigma: 0.007, unit: rad}\n"
    "effects: []\n";

std::string ErrorOfModel(const std::string& from, const std::string& to) {
  std::string text = kModel;
  text.replace(text.find(from), from.size(), to);
  return ErrorOfFlags(Flags([&](auto* f) { f->model = Written(text); }));
}

TEST(ApplyModel, MakesTheVehiclesConstantsThePrior) {
  VgdOptions options;
  ApplyModel(Written(kModel), &options);
  EXPECT_EQ(options.priors[0].mean, -0.41);
  EXPECT_EQ(options.priors[0].sigma, 0.02);
  EXPECT_EQ(options.priors[7].mean, -0.02);
  EXPECT_EQ(options.priors[3].mean, 0.0);  // the AHRS error is the flight's own
  EXPECT_EQ(options.priors[3].sigma, VgdOptions().priors[3].sigma);
}

CalibrationOptions OptionsOfModel(const std::string& effects, const std::string& provenance) {
  std::string text = kModel;
  text.replace(text.find("[]"), 2, effects);
  return ResolveCalibrationOptions(Flags([&](auto* f) { f->model = Written(text + provenance); }));
}

std::vector<FlightLog> LogWithDigest(const std::string& digest) {
  FlightLog log;
  log.sha256["imu.csv"] = digest;
  return {log};
}

const char kEffects[] =
    "[{id: wind, w_x: 2.9, w_y: -2.0}, {id: drag_step, t_step: 49.9, factor: 2.2}, "
    "{id: rotor_drag, k: 0.03}, "
    "{id: term, where: force_x, with: t(50;40), size: 0.1, unit: m/s^2}]";
const char kProvenance[] = "provenance: {sha256: {imu.csv: 00ff}}\n";

std::vector<std::string> IdsOf(const std::vector<Effect>& effects) {
  std::vector<std::string> ids;
  for (const Effect& effect : effects) ids.push_back(effect.id);
  return ids;
}

// The air of another day is not that of this flight, and a part that broke then may be repaired.
TEST(LimitModelTo, LeavesOutWhatBelongsToAnotherFlight) {
  CalibrationOptions options = OptionsOfModel(kEffects, kProvenance);
  LimitModelTo(LogWithDigest("1234"), "", &options);
  EXPECT_EQ(options.effects.size(), 4U);
  const std::string file = Written(std::string(kModel) + kProvenance);
  LimitModelTo(LogWithDigest("1234"), file, &options);
  EXPECT_THAT(IdsOf(options.effects), ElementsAre("rotor_drag"));
  const ForceEffects& forces = options.methods.vgd.drive.force_effects;
  EXPECT_TRUE(forces.wind_E.isZero(0.0));
  EXPECT_EQ(forces.air_forces.size(), 1U);
  ASSERT_EQ(options.warnings.size(), 1U);
  EXPECT_THAT(options.warnings[0],
              AllOf(HasSubstr("wind (w_x 2.9 m/s, w_y -2 m/s)"),
                    HasSubstr("drag_step (t_step 49.9 s, factor 2.2)"), HasSubstr("times time"),
                    HasSubstr("K_x and K_y held before that")));
  // The model states drag before the step; the other constants are the vehicle's.
  EXPECT_EQ(options.methods.vgd.priors[InTheta("K_x")].sigma, DefaultPriors()[0].sigma);
  EXPECT_EQ(options.methods.vgd.priors[InTheta("b_az")].sigma, 0.04);
}

TEST(LimitModelTo, KeepsTheEffectsOfItsOwnFlight) {
  CalibrationOptions options = OptionsOfModel(kEffects, kProvenance);
  LimitModelTo(LogWithDigest("00ff"), Written(std::string(kModel) + kProvenance), &options);
  EXPECT_EQ(options.effects.size(), 4U);
  EXPECT_EQ(options.methods.vgd.drive.force_effects.wind_E.x(), 2.9);
  EXPECT_EQ(options.methods.vgd.priors[InTheta("b_az")].sigma,
            DefaultPriors()[InTheta("b_az")].sigma);
  ASSERT_EQ(options.warnings.size(), 1U);
  EXPECT_THAT(options.warnings[0], HasSubstr("fitted to this very flight"));
}

// Each of them was data of the model.
TEST(LimitModelTo, AModelOfSeveralFlightsIsTheOwnOfEach) {
  YAML::Node node;
  node["provenance"] = Provenance(LogWithDigest("00ff")[0], 0, {}, LogWithDigest("1234"));
  const std::string provenance = YAML::Dump(node) + "\n";
  for (const char* digest : {"00ff", "1234", "5678"}) {
    CalibrationOptions options = OptionsOfModel("[]", provenance);
    LimitModelTo(LogWithDigest(digest), Written(kModel + provenance), &options);
    EXPECT_EQ(options.warnings.size(), digest == std::string("5678") ? 0U : 1U) << digest;
  }
}

// What is written by hand states no flight: it is meant for this one.
TEST(LimitModelTo, KeepsTheEffectsOfAModelThatStatesNoFlight) {
  CalibrationOptions options = OptionsOfModel(kEffects, "");
  LimitModelTo(LogWithDigest("1234"), Written(kModel), &options);
  EXPECT_EQ(options.effects.size(), 4U);
  EXPECT_TRUE(options.warnings.empty());
}

TEST(LimitModelTo, RefusesForcesThatAnEstimatorDoesNotTake) {
  CalibrationOptions options = OptionsOfModel(kEffects, kProvenance);
  options.estimators = {"ekf"};
  const std::string file = Written(std::string(kModel) + kProvenance);
  EXPECT_THAT(trueline::ErrorOf([&] { LimitModelTo(LogWithDigest("00ff"), file, &options); }),
              HasSubstr("'ekf' does not take"));
}

TEST(ApplyModel, RefusesWhatIsWrong) {
  EXPECT_THAT(ErrorOfModel("-0.44, ", ".nan, "), HasSubstr("'parameters.K_y.value'"));
  EXPECT_THAT(ErrorOfModel("sigma: 0.03", "sigma: 0"), HasSubstr("above zero"));
  EXPECT_THAT(ErrorOfModel("unit: m/s^2", "unit: g"), HasSubstr("must be m/s^2"));
  EXPECT_THAT(ErrorOfModel("  K_x: {value: -0.41, sigma: 0.02, unit: 1/s}\n", ""),
              HasSubstr("K_x"));
  EXPECT_THAT(ErrorOfModel("effects: []", "effects: [{id: rain}]"), HasSubstr("'rain'"));
  EXPECT_THAT(ErrorOfModel("effects: []", "effects: [{id: wind, w_x: 1.0}]"),
              HasSubstr("'w_y' lacks; wind takes w_x, w_y"));
  EXPECT_THAT(ErrorOfModel("effects: []", "effects: [{id: rotor_drag, k: 0.03, kk: 1}]"),
              HasSubstr("rotor_drag takes k"));
  EXPECT_THAT(ErrorOfFlags(Flags([](auto* f) { f->model = "/nowhere/model.yaml"; })),
              HasSubstr("/nowhere/model.yaml"));
}

}  // namespace
}  // namespace trueline
