// trueline-benchmark: estimators side by side on simulated and real flights.
#include <fmt/format.h>

#include <algorithm>

#include "apps/main/flags.h"
#include "problems/common/app.h"
#include "problems/common/error.h"
#include "problems/common/result_folder.h"
#include "problems/experiment/write_benchmark.h"
#include "problems/prediction/multi_step_experiment.h"
#include "problems/prediction/prediction_experiment.h"
#include "problems/prediction/wrench_experiment.h"
#include "problems/result/render.h"

DEFINE_string(config, "", "the experiment (YAML), as in config/experiments/");
DEFINE_string(out, "", "where results go; made if missing");
DEFINE_string(data, "", "folder of the training data, for public benchmarks");
DEFINE_string(test, "", "folder of flights to test on, for nanodrone.yaml; see --help");
DEFINE_int32(threads, 0, "flights at a time; 0 for all cores. The result is the same");
DEFINE_bool(short, false, "a trial: one seed, the ends of the sweep, 30 s of simulated flight");
DEFINE_bool(times, true, "state solve times in arcs.csv; without them its bytes never differ");
DEFINE_bool(report, true, "write report.html");
DEFINE_bool(verbose, false, "print the whole table, also where it is longer than a screen");
DEFINE_bool(quiet, false, "print nothing but errors");

namespace {

constexpr char kUsage[] = R"(Compares estimators on simulated and real flights.

  trueline benchmark --config=config/experiments/figure11.yaml --out=out/figure11
      error and iterations against the window length, as figure 11 of Li et al. 2019;
      writes out/figure11/arcs.csv, summary.yaml and report.html, and prints the table
  trueline benchmark --config=config/experiments/noise.yaml --out=out/noise --short
      a trial in seconds: one seed, the ends of the sweep, 30 s of flight
  TRUELINE_DATA=data trueline benchmark --config=config/experiments/real_flights.yaml --out=out/real
      recorded flights, imported on the fly from the folder data
  trueline benchmark --config=config/experiments/rotors_figure3.yaml --out=out/figure3
      random, Lissajous and designed flights calibrated by rotor speeds, as Boehm et al. 2020
  trueline benchmark --config=config/experiments/nanodrone.yaml --data=train --out=out/nanodrone
      the NanoDrone benchmark: predicts every trajectory in train/*.csv.gz by a fit to the others;
      with --test=FOLDER, the flights in FOLDER by a fit to all of train
  trueline benchmark --config=config/experiments/neurobem.yaml --data=neurobem --out=out/neurobem
      force and moment of the NeuroBEM flights in neurobem/*.csv.gz, beside published predictions

Flights run on all cores; the result does not depend on how many. Stopped in between, the same
command goes on where it stopped (out/jobs holds what is finished).
problems/experiment/experiment.h lists the keys of an experiment.

Exit codes: 0 done, 2 bad input or usage, 3 no flight gave a result, 1 a defect.)";

bool HasResult(const trueline::JobOutcome& outcome) { return outcome.failure.empty(); }

// Finished flights are kept in OUT/jobs, which only one run at a time may fill.
trueline::FileLock LockJobs(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  trueline::FileLock lock(folder, false);
  if (lock.locked()) return lock;
  throw trueline::InputError(FLAGS_out +
                             ": another trueline benchmark is at work in this folder; wait for "
                             "its end, or give another --out");
}

void Publish(const std::string& verb, bool report, const std::string& table,
             const std::string& brief, trueline::ResultFolder* out) {
  trueline::Publish(verb, report, FLAGS_quiet, trueline::OneScreen(table, brief, FLAGS_verbose),
                    out);
}

// Warns of flights without a result and publishes the others.
int Finish(const trueline::ExperimentRun& run, const std::string& verb, const std::string& table,
           const std::string& brief, trueline::ResultFolder* out) {
  for (const trueline::JobOutcome& outcome : run.outcomes) {
    if (HasResult(outcome)) continue;
    trueline::Warn(fmt::format("no result for {}, seed {}: {}", outcome.job.log, outcome.job.seed,
                               outcome.failure),
                   FLAGS_quiet);
  }
  const bool any = std::any_of(run.outcomes.begin(), run.outcomes.end(), HasResult);
  Publish(verb, FLAGS_report && (any || verb == "benchmark"), table, brief, out);
  return any ? trueline::kExitDone : trueline::kExitNoResult;
}

int RunRotors(const std::filesystem::path& jobs_folder) {
  trueline::RotorExperiment experiment = trueline::ReadRotorExperiment(FLAGS_config);
  if (FLAGS_short) trueline::ShortenRotorExperiment(&experiment);
  trueline::ResultFolder out(FLAGS_out, "trueline-benchmark");  // fails before the work
  const trueline::FileLock lock = LockJobs(jobs_folder);
  const std::vector<trueline::Job> jobs =
      trueline::MakeRotorJobs(experiment, jobs_folder, FLAGS_threads, FLAGS_quiet);
  const trueline::ExperimentRun run =
      trueline::RunJobs(jobs, jobs_folder, FLAGS_threads, FLAGS_quiet);
  trueline::WriteRotorExperiment(experiment, run, out.path());
  return Finish(run, "rotor_experiment", trueline::RotorExperimentTable(experiment, run),
                trueline::RotorExperimentBrief(experiment, run), &out);
}

int RunMultiStep() {
  trueline::MultiStepExperiment experiment = trueline::ReadMultiStepExperiment(FLAGS_config);
  if (FLAGS_data.empty()) throw trueline::InputError("--data: the folder of the runs is needed");
  experiment.inputs = {FLAGS_data, FLAGS_test, FLAGS_short};
  if (FLAGS_short) trueline::ShortenMultiStepExperiment(&experiment);
  trueline::ResultFolder out(FLAGS_out, "trueline-benchmark");
  const trueline::MultiStepResult result = trueline::RunMultiStepExperiment(
      experiment, FLAGS_data, FLAGS_test, FLAGS_threads, FLAGS_quiet);
  trueline::WriteMultiStep(experiment, result, out.path());
  trueline::WritePredictions(experiment, result, FLAGS_threads, out.path());
  Publish("multi_step", FLAGS_report, trueline::MultiStepTable(experiment, result),
          trueline::MultiStepBrief(result), &out);
  return trueline::kExitDone;
}

int RunWrench() {
  trueline::WrenchExperiment experiment = trueline::ReadWrenchExperiment(FLAGS_config);
  if (FLAGS_data.empty()) throw trueline::InputError("--data: the folder of the flights is needed");
  if (!FLAGS_test.empty()) {
    throw trueline::InputError("--test: this experiment names its test flights under 'folds'");
  }
  experiment.inputs = {FLAGS_data, "", FLAGS_short};
  if (FLAGS_short) experiment.stride *= 20;
  trueline::ResultFolder out(FLAGS_out, "trueline-benchmark");
  const trueline::WrenchResult result =
      trueline::RunWrenchExperiment(experiment, FLAGS_data, FLAGS_threads, FLAGS_quiet);
  trueline::WriteWrench(experiment, result, out.path());
  Publish("wrench", FLAGS_report, trueline::WrenchTable(experiment, result),
          trueline::WrenchBrief(result), &out);
  return trueline::kExitDone;
}

int Run() {
  if (FLAGS_config.empty() || FLAGS_out.empty()) {
    throw trueline::InputError("--config and --out are needed; see trueline benchmark --help");
  }
  const std::string kind = trueline::ExperimentKind(FLAGS_config);
  if (kind == "multi_step") return RunMultiStep();
  if (kind == "wrench") return RunWrench();
  if (!FLAGS_data.empty() || !FLAGS_test.empty()) {
    throw trueline::InputError(
        "--data and --test belong to public benchmarks; this experiment "
        "names its flights itself");
  }
  const std::filesystem::path jobs_folder = std::filesystem::path(FLAGS_out) / "jobs";
  if (trueline::IsRotorExperiment(FLAGS_config)) return RunRotors(jobs_folder);
  trueline::Experiment experiment = trueline::ReadExperiment(FLAGS_config);
  if (FLAGS_short) trueline::ShortenExperiment(&experiment);
  trueline::ResultFolder out(FLAGS_out, "trueline-benchmark");
  const trueline::FileLock lock = LockJobs(jobs_folder);
  const trueline::ExperimentRun run =
      trueline::RunJobs(trueline::MakeJobs(experiment), jobs_folder, FLAGS_threads, FLAGS_quiet);
  trueline::WriteBenchmark(experiment, run, FLAGS_threads, FLAGS_times, out.path());
  return Finish(run, "benchmark", trueline::BenchmarkTable(experiment, run),
                trueline::BenchmarkBrief(run), &out);
}

}  // namespace

TRUELINE_VERB("benchmark", kUsage, Run);
