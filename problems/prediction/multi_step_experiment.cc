#include "problems/prediction/multi_step_experiment.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "problems/common/app.h"
#include "problems/common/error.h"

namespace trueline {

void Serialize(YamlArchive* a, StabilisedProcessNumbers* n) {
  a->Positive("length_s", &n->length);
  a->Positive("jitter", &n->jitter);
  a->Positive("jitter_time_s", &n->jitter_time);
  a->Positive("constant", &n->constant);
  a->Positive("coloured", &n->coloured);
  a->Positive("coloured_time_s", &n->coloured_time);
  a->Positive("white", &n->white);
  a->Positive("growth", &n->growth);
  a->NotNegative("returning", &n->returning);
  a->Positive("return_time_s", &n->return_time);
  a->Positive("cruise", &n->cruise);
  std::vector<double> sizes(n->sizes.begin(), n->sizes.end());
  a->Value("sizes", &sizes);
  a->Require(sizes.size() == n->sizes.size() && *std::min_element(sizes.begin(), sizes.end()) > 0,
             "sizes", "needs four positive numbers");
  std::copy_n(sizes.begin(), std::min(sizes.size(), n->sizes.size()), n->sizes.begin());
}

namespace {

std::vector<PublishedScore> ReadPublished(const YamlMap& map) {
  std::vector<PublishedScore> published;
  for (const YamlMap& entry : map.Children("published")) {
    const auto four = [&](const char* key) {
      const auto values = entry.Get<std::vector<double>>(key);
      if (values.size() != 4) entry.Fail(key, "needs p, v, R and w");
      return values;
    };
    published.push_back({entry.Get<std::string>("name"),
                         entry.GetChoice("average", {"concatenated", "within"}, "concatenated"),
                         four("sums"),
                         {}});
    for (const char* horizon : {"h1", "h10", "h50"}) {
      if (entry.Has(horizon)) published.back().at.emplace_back(horizon, four(horizon));
    }
    entry.Finish();
  }
  return published;
}

std::vector<std::string> Trajectories(const std::vector<PredictionRun>& runs) {
  std::set<std::string> names;
  for (const PredictionRun& run : runs) names.insert(run.trajectory);
  return {names.begin(), names.end()};
}

std::vector<const PredictionRun*> Select(const std::vector<PredictionRun>& runs,
                                         const std::string& trajectory, bool of_it) {
  std::vector<const PredictionRun*> selected;
  for (const PredictionRun& run : runs) {
    if ((run.trajectory == trajectory) == of_it) selected.push_back(&run);
  }
  return selected;
}

// Scores the baselines and the fit on the runs of one trajectory.
void ScoreAll(const MultiStepExperiment& experiment, const PredictionFit& fit,
              const std::string& trajectory, const std::vector<const PredictionRun*>& runs,
              int threads, MultiStepResult* result) {
  const PredictionModel model(experiment.setup.vehicle, fit.processes, fit.numbers);
  for (const Predictor& predictor :
       {NaivePredictor(), PublishedPhysics(0.0), PublishedPhysics(experiment.drag),
        VehiclePredictor("rotor by rotor", model.prediction, fit.numbers)}) {
    result->rows.push_back({trajectory, predictor.name, Score(predictor, runs, threads)});
  }
  result->tubes.push_back({trajectory, ShareHeld(model, fit, runs, threads)});
}

// The folder must not hold a run of the training folder: its score would not be held out.
void RefuseTrained(const std::vector<PredictionRun>& training,
                   const std::vector<PredictionRun>& tested) {
  for (const PredictionRun& run : tested) {
    for (const PredictionRun& known : training) {
      for (Eigen::Index row = 0; row < known.states.cols(); ++row) {
        if (known.states.col(row) != run.states.col(0)) continue;
        throw InputError("--test: " + run.name + " starts as a part of " + known.name +
                         " of --data; test on flights that the fit has not seen");
      }
    }
  }
}

// The concatenated average pairs a window with the one that starts kSteps later.
void WarnOfFewWindows(const std::vector<PredictionRun>& runs, bool quiet) {
  for (const std::string& trajectory : Trajectories(runs)) {
    int windows = 0;
    for (const PredictionRun* run : Select(runs, trajectory, true)) windows += run->num_windows();
    if (windows >= PredictionWindow::kSteps) continue;
    Warn(fmt::format("the runs of {} hold {} windows; the concatenated average needs {} and is not "
                     "shown (.nan)",
                     trajectory, windows, PredictionWindow::kSteps),
         quiet);
  }
}

}  // namespace

const PredictionFit& MultiStepResult::FitFor(const std::string& trajectory) const {
  for (const MultiStepFold& fold : folds) {
    if (fold.trajectory == trajectory) return fold.fit;
  }
  return fit;
}

MultiStepExperiment ReadMultiStepExperiment(const std::filesystem::path& file) {
  const YamlMap map = YamlMap::FromFile(file);
  MultiStepExperiment experiment;
  ReadHead(file, "multi_step", map, &experiment);
  PredictionSetup& setup = experiment.setup;
  setup.numbers.assign(std::begin(kStateNumbers), std::end(kStateNumbers));
  setup.vehicle = ReadPredictedVehicle(map, &setup.numbers);
  YamlArchive a(map);
  a.Map("processes", [&](YamlArchive* processes) {
    for (std::size_t i = 0; i < kProcessNames.size(); ++i) {
      processes->Nested(kProcessNames[i], &setup.processes[i]);
    }
    processes->Value("learn", &setup.learn_processes);
  });
  a.Count("windows", &setup.windows);
  a.Count("rounds", &setup.rounds);
  a.Count("iterations", &setup.iterations);
  a.NotNegative("drag", &experiment.drag);
  a.Count("predictions_stride", &experiment.predictions_stride);
  experiment.published = ReadPublished(map);
  map.Finish();
  return experiment;
}

void ShortenMultiStepExperiment(MultiStepExperiment* experiment) {
  experiment->setup.windows = 30;
  experiment->setup.rounds = 1;
  experiment->setup.iterations = 3;
}

MultiStepResult RunMultiStepExperiment(const MultiStepExperiment& experiment,
                                       const std::filesystem::path& training,
                                       const std::filesystem::path& test, int threads, bool quiet) {
  const std::vector<PredictionRun> runs = ReadPredictionRuns(training);
  const std::vector<std::string> trajectories = Trajectories(runs);
  std::vector<PredictionRun> tested;
  if (!test.empty()) {
    tested = ReadPredictionRuns(test);
    WarnOfFewWindows(tested, quiet);
    RefuseTrained(runs, tested);
  } else if (trajectories.size() < 2) {
    throw InputError(training.string() +
                     ": holds one trajectory only; give another folder by --test, or add runs");
  }
  if (test.empty()) WarnOfFewWindows(runs, quiet);
  MultiStepResult result;
  result.trained_on = trajectories;
  const auto progress = [&](const std::string& what) {
    if (!quiet) fmt::print(stderr, "{}\n", what);
  };
  std::vector<const PredictionRun*> all;
  for (const PredictionRun& run : runs) all.push_back(&run);
  progress(fmt::format("fitting to {} runs", all.size()));
  result.fit = FitPrediction(experiment.setup, all, threads);
  for (const std::string& trajectory : Trajectories(tested)) {
    progress("predicting " + trajectory);
    ScoreAll(experiment, result.fit, trajectory, Select(tested, trajectory, true), threads,
             &result);
  }
  result.predicted = test.empty() ? runs : std::move(tested);
  if (!test.empty()) return result;
  for (const std::string& trajectory : trajectories) {
    progress("leaving out " + trajectory);
    MultiStepFold fold{trajectory, {}, {}};
    for (const std::string& name : trajectories) {
      if (name != trajectory) fold.trained_on.push_back(name);
    }
    fold.fit = FitPrediction(experiment.setup, Select(runs, trajectory, false), threads);
    ScoreAll(experiment, fold.fit, trajectory, Select(runs, trajectory, true), threads, &result);
    result.folds.push_back(std::move(fold));
  }
  return result;
}

}  // namespace trueline
