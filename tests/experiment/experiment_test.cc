// Experiments: what is wrong is refused with file, line and remedy; sweeps and overrides reach the
// flights and estimators.
#include "problems/common/error.h"
#include "tests/common/test_files.h"
#include "tests/experiment/short_experiment.h"

namespace trueline::testing_benchmark {
namespace {

const std::string kVgd = "estimators:\n  - {name: vgd}\n";

std::vector<Job> Jobs(const std::string& text) {
  const TemporaryFolder folder;
  return MakeJobs(ReadExperiment(WriteExperiment(folder.path(), text)));
}

std::string ErrorOf(const std::string& text) {
  return trueline::ErrorOf([&] { Jobs(text); });
}

TEST(Experiment, UnknownKeysAreRefusedWithFileAndLine) {
  EXPECT_THAT(ErrorOf(Hippodrome() + kVgd + "gamas: [1]\n"),
              AllOf(HasSubstr("experiment.yaml:6"), HasSubstr("'gamas'"), HasSubstr("gammas")));
  EXPECT_THAT(ErrorOf(Hippodrome() + "estimators:\n  - {name: vgd, lable: x}\n"),
              AllOf(HasSubstr("experiment.yaml:5"), HasSubstr("lable"), HasSubstr("label")));
}

TEST(Experiment, WrongEstimatorNamesTheKnownOnes) {
  EXPECT_THAT(ErrorOf(Hippodrome() + "estimators:\n  - {name: vdg}\n"),
              AllOf(HasSubstr("experiment.yaml:5"), HasSubstr("'vdg'"), HasSubstr("ekf")));
}

TEST(Experiment, WrongOptionOfAnEstimatorIsFoundAtItsLine) {
  EXPECT_THAT(ErrorOf(Hippodrome() + "estimators:\n  - {name: vgd}\n  - name: ekf\n    options:\n"
                                     "      loss: square\n"),
              AllOf(HasSubstr("experiment.yaml:8"), HasSubstr("'square'"), HasSubstr("huber")));
}

TEST(Experiment, WrongOverrideIsFoundAtItsLine) {
  EXPECT_THAT(
      ErrorOf(Hippodrome(", detector.sigma_facto: 0.2") + kVgd),
      AllOf(HasSubstr("experiment.yaml:3"), HasSubstr("sigma_facto"), HasSubstr("sigma_factor")));
}

TEST(Experiment, SweepKeysNeedAKnownRootAndAFlightThatTheyChange) {
  const std::string sweep = "sweep: {name: x, keys: [%], values: [1]}\n";
  const auto with = [&](const std::string& key) {
    std::string text = sweep;
    return ErrorOf(Hippodrome() + kVgd + text.replace(text.find('%'), 1, key));
  };
  EXPECT_THAT(with("detector.sigma_factor"),
              AllOf(HasSubstr("experiment.yaml:6"), HasSubstr("simulation.")));
  EXPECT_THAT(with("fixes.sigma_factor"),
              AllOf(HasSubstr("experiment.yaml:2"), HasSubstr("changes nothing")));
  EXPECT_THAT(with("simulation.detector.sigma_facto"),
              AllOf(HasSubstr("experiment.yaml:6"), HasSubstr("sigma_facto")));
}

TEST(Experiment, MissingPartsAndDoubleLabelsAreRefused) {
  EXPECT_THAT(ErrorOf(kVgd), HasSubstr("'logs'"));
  EXPECT_THAT(ErrorOf(Hippodrome()), HasSubstr("estimators"));
  EXPECT_THAT(ErrorOf(Hippodrome() + "estimators: [{name: vgd}, {name: vgd}]\n"),
              HasSubstr("label 'vgd' is used twice"));
  EXPECT_THAT(ErrorOf("simulations: [{config: nowhere.yaml}]\n" + kVgd),
              AllOf(HasSubstr("experiment.yaml:1"), HasSubstr("does not exist")));
  EXPECT_THAT(
      ErrorOf("logs: [{log: '${TRUELINE_NOT_SET}/a'}]\n" + kVgd),
      AllOf(HasSubstr("experiment.yaml:1"), HasSubstr("TRUELINE_NOT_SET"), HasSubstr("export")));
  EXPECT_THAT(ErrorOf(Hippodrome() + kVgd + "bound: nobody\n"), HasSubstr("label"));
}

TEST(Experiment, NamesBecomeFieldsOfCsvFiles) {
  EXPECT_THAT(ErrorOf(Hippodrome() + "estimators:\n  - {name: vgd, label: 'a,b'}\n"),
              AllOf(HasSubstr("experiment.yaml:5"), HasSubstr("without commas")));
  EXPECT_THAT(ErrorOf(Hippodrome() + kVgd + "sweep: {name: '', keys: [simulation.duration]}\n"),
              AllOf(HasSubstr("experiment.yaml:6"), HasSubstr("without commas")));
  EXPECT_THAT(ErrorOf(Hippodrome() + kVgd + "sweep: {keys: [simulation.duration]}\n"),
              AllOf(HasSubstr("experiment.yaml:6"), HasSubstr("name"), HasSubstr("is missing")));
}

TEST(Experiment, QuantitiesOfConvergenceAreKnownAndTolerancesPositive) {
  const auto with = [](const std::string& convergence) {
    return ErrorOf(Hippodrome() + kVgd + "convergence: " + convergence + "\n");
  };
  EXPECT_EQ(with("{b_az: 0.1, b_gx: 0.01, K_x: 0.1, final_point_error: 1}"), "no error");
  EXPECT_THAT(with("{b_az: 0.1, b_azz: 0.1}"),
              AllOf(HasSubstr("experiment.yaml:6"), HasSubstr("'convergence.b_azz'"),
                    HasSubstr("b_az"), HasSubstr("final_point_error")));
  EXPECT_THAT(with("{b_az: 0}"), AllOf(HasSubstr("experiment.yaml:6"), HasSubstr("above zero")));
  EXPECT_THAT(with("{b_az: .inf}"), AllOf(HasSubstr("experiment.yaml:6"), HasSubstr("finite")));
  EXPECT_THAT(with("{b_az: 0.1, b_az: 0.2}"), HasSubstr("twice"));
  EXPECT_THAT(with("[b_az]"), AllOf(HasSubstr("experiment.yaml:6"), HasSubstr("mapping")));
}

TEST(Experiment, ParametersConvergeOnSimulatedFlightsOnly) {
  const TemporaryFolder log;
  const std::string logs = "logs: [{log: " + log.path().string() + "}]\n" + kVgd;
  EXPECT_THAT(ErrorOf(logs + "convergence: {K_x: 0.1}\n"),
              AllOf(HasSubstr("experiment.yaml:4"), HasSubstr("simulat")));
  EXPECT_EQ(ErrorOf(logs + "convergence: {final_point_error: 1}\n"), "no error");
}

TEST(Experiment, FilesAndFoldersAreNotTakenForEachOther) {
  const TemporaryFolder folder;
  const std::string path = folder.path().string(), file = path + "/flight.csv";
  std::ofstream(file) << "t\n";
  EXPECT_THAT(ErrorOf("logs: [{log: " + file + "}]\n" + kVgd),
              AllOf(HasSubstr("experiment.yaml:1"), HasSubstr("not a folder"),
                    HasSubstr("trueline convert")));
  EXPECT_THAT(ErrorOf("simulations: [{config: " + path + "}]\n" + kVgd),
              AllOf(HasSubstr("experiment.yaml:1"), HasSubstr("is a folder")));
  EXPECT_THAT(ErrorOf(Hippodrome() + "estimators: [{name: vgd, config: " + path + "}]\n"),
              AllOf(HasSubstr("experiment.yaml:4"), HasSubstr("is a folder")));
}

TEST(Experiment, SweepOverridesFlightAndEstimator) {
  const std::vector<Job> jobs = Jobs(
      Hippodrome(", detector.sigma_factor: 0.3") +
      "estimators: [{name: vgd, options: {loss_scale_sigmas: 7, max_iterations: 9}}]\n"
      "seeds: {first: 5, count: 2}\n"
      "sweep:\n  name: noise\n  points:\n"
      "    - {x: 1, set: {simulation.detector.fixes: [4, 6]}}\n"
      "    - {x: 2, set: {simulation.detector.sigma_factor: 0.05, options.max_iterations: 3}}\n");
  ASSERT_EQ(jobs.size(), 4U);
  const auto& first = std::get<SimulationConfig>(jobs[0].flight);
  const auto& last = std::get<SimulationConfig>(jobs[3].flight);
  EXPECT_EQ(first.duration, 25.0);
  EXPECT_EQ(first.detector.fixes_min, 4);
  EXPECT_EQ(first.detector.fixes_max, 6);
  EXPECT_EQ(first.detector.sigma_factor, 0.3);
  EXPECT_EQ(last.detector.fixes_min, 15);
  EXPECT_EQ(last.detector.sigma_factor, 0.05);
  EXPECT_EQ(jobs[0].estimators[0].options.vgd.max_iterations, 9);
  EXPECT_EQ(jobs[3].estimators[0].options.vgd.max_iterations, 3);
  EXPECT_EQ(jobs[3].estimators[0].options.vgd.loss_scale, 7.0);
  EXPECT_EQ(jobs[0].seed, 5U);
  EXPECT_EQ(jobs[3].seed, 6U);
  EXPECT_EQ(jobs[3].x, 2.0);
}

TEST(Experiment, OptionsOfAFlightHoldForAllEstimatorsUnlessTheySayOtherwise) {
  const std::vector<Job> jobs = Jobs(
      Hippodrome() + "    options: {drive: {thrust: level_flight}, max_iterations: 11}\n" +
      "estimators:\n  - {name: vgd}\n  - {name: vgd, label: b, options: {max_iterations: 4}}\n");
  const auto& estimators = jobs.front().estimators;
  EXPECT_EQ(estimators[0].options.vgd.drive.thrust, ThrustSource::kLevelFlight);
  EXPECT_EQ(estimators[1].options.vgd.drive.thrust, ThrustSource::kLevelFlight);
  EXPECT_EQ(estimators[0].options.vgd.max_iterations, 11);
  EXPECT_EQ(estimators[1].options.vgd.max_iterations, 4);
}

TEST(Experiment, OptionsOfOneEstimatorAndSweepPointDoNotLeakIntoAnother) {
  const std::vector<Job> jobs = Jobs(
      Hippodrome() + "estimators:\n  - {name: vgd, label: a}\n  - {name: vgd, label: b, config: " +
      (SourceFolder() / "config/calibrate/rigid.yaml").string() +
      ", options: {max_iterations: 4}}\n  - {name: vgd, label: c}\n"
      "sweep: {name: t, keys: [options.tolerance, simulation.vehicle.mass], values: [0.1, 0.2]}\n");
  ASSERT_EQ(jobs.size(), 2U);
  for (const Job& job : jobs) {
    for (const JobEstimator& estimator : job.estimators) {
      const bool rigid = estimator.label == "b";
      EXPECT_EQ(estimator.options.vgd.process.tilt == 0.0, rigid) << estimator.label << job.x;
      EXPECT_EQ(estimator.options.vgd.max_iterations == 4, rigid) << estimator.label << job.x;
      EXPECT_EQ(estimator.options.vgd.tolerance, job.x);
    }
  }
}

TEST(Experiment, KeysOfJobsDifferWhereAnythingDiffers) {
  const std::string seeds = "seeds: {first: 1, count: 2}\n";
  const auto a = Jobs(Hippodrome() + kVgd + seeds);
  const auto same = Jobs(Hippodrome() + kVgd + seeds);
  const auto flight = Jobs(Hippodrome(", turbulence.memory: 0.9") + kVgd + seeds);
  const auto gammas = Jobs(Hippodrome() + kVgd + seeds + "gammas: [2]\n");
  const auto options =
      Jobs(Hippodrome() + "estimators: [{name: vgd, options: {tolerance: 0.01}}]\n" + seeds);
  EXPECT_NE(a[0].key, a[1].key);
  EXPECT_EQ(a[0].key, same[0].key);
  EXPECT_NE(a[0].key, flight[0].key);
  EXPECT_NE(a[0].key, gammas[0].key);
  EXPECT_NE(a[0].key, options[0].key);
}

TEST(Overlay, MergeLeavesItsArgumentsAlone) {
  const YAML::Node base = YAML::Load("{a: {b: 1, c: 2}, d: 3}");
  const YAML::Node merged = Merge(base, YAML::Load("{a: {b: 5}, e: [1, 2]}"));
  EXPECT_EQ(merged["a"]["b"].as<int>(), 5);
  EXPECT_EQ(merged["a"]["c"].as<int>(), 2);
  EXPECT_EQ(merged["e"][1].as<int>(), 2);
  EXPECT_EQ(base["a"]["b"].as<int>(), 1);
  const YAML::Node set = WithSetting(base, "a.x.y", YAML::Node(7));
  EXPECT_EQ(set["a"]["x"]["y"].as<int>(), 7);
  EXPECT_EQ(set["a"]["c"].as<int>(), 2);
  EXPECT_FALSE(base["a"]["x"].IsDefined());
}

}  // namespace
}  // namespace trueline::testing_benchmark
