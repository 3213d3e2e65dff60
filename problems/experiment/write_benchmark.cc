#include "problems/experiment/write_benchmark.h"

#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <cmath>

#include "problems/common/atomic_file.h"
#include "problems/common/parallel.h"
#include "problems/result/csv_file.h"

namespace trueline {
namespace {

std::string Number(double value, const char* format = "{:.6g}") {  // empty for NaN
  return std::isnan(value) ? "" : fmt::format(fmt::runtime(format), value);
}

// Calls `write(file, job, row)` for all rows of one kind; no file without rows, except for arcs.
template <class Row, class Write>
void WriteTable(const ExperimentRun& run, std::vector<Row> JobResult::*rows,
                const std::filesystem::path& path, const char* header, const Write& write) {
  const bool none = std::ranges::all_of(
      run.outcomes, [&](const JobOutcome& outcome) { return (outcome.result.*rows).empty(); });
  if (none && !std::is_same_v<Row, ArcRow>) {
    std::filesystem::remove(path);  // of an earlier run
    return;
  }
  WriteCsv(path, header, [&](std::ostream& out) {
    for (const JobOutcome& outcome : run.outcomes) {
      for (const Row& row : outcome.result.*rows) write(out, outcome.job, row);
    }
  });
}

void WriteTiming(const ExperimentRun& run, int threads, const std::filesystem::path& path) {
  WriteFileAtomically(
      path, fmt::format("threads: {}\nwall_time: {:.3f}  # s\nflights: {}\n"
                        "flights_reused: {}  # from an earlier run\n",
                        CoresFor(threads), run.wall_time, run.outcomes.size(), run.reused));
}

std::string Share(int part, int whole) {
  return whole > 0 ? fmt::format("{:.0f} %", 100.0 * part / whole) : "-";
}

std::string ForecastTable(const std::vector<JobOutcome>& outcomes) {
  const std::vector<ForecastSummary> forecasts = SummariseForecasts(outcomes);
  if (forecasts.empty()) return "";
  std::string text = fmt::format("\n{:<18}{:<22}{:>6}{:>9}{:>12}{:>8}{:>12}{:>9}{:>9}{:>9}\n",
                                 "log", "label", "gamma", "sweep", "horizon [s]", "count",
                                 "median [m]", "in 50", "in 90", "in 95");
  for (const ForecastSummary& f : forecasts) {
    text += fmt::format("{:<18.17}{:<22.21}{:>6}{:>9}{:>12}{:>8}{:>12.3f}{:>9}{:>9}{:>9}\n", f.log,
                        f.label, f.gamma, Number(f.x), f.horizon, f.count, f.median_error,
                        Share(f.inside[0], f.count), Share(f.inside[1], f.count),
                        Share(f.inside[2], f.count));
  }
  return text;
}

}  // namespace

void WriteBenchmark(const Experiment& experiment, const ExperimentRun& run, int threads, bool times,
                    const std::filesystem::path& directory) {
  WriteTable(run, &JobResult::arcs, directory / "arcs.csv",
             "log,estimator,gamma,tau,t_start [s],t_end [s],final_point_error [m],predicted_sigma "
             "[m],iterations [1],solve_time [s],truth,label,sweep,seed,inside_95 [1],counted "
             "[1],bound [m]",
             [times](std::ostream& out, const Job& job, const ArcRow& r) {
               fmt::print(out, "{},{},{},{},{:.9f},{:.9f},{},{:.6g},{},{},{},{},{},{},{},{},{}\n",
                          job.log, r.estimator, r.gamma, r.tau, r.begin, r.end, Number(r.error),
                          r.predicted_sigma, r.iterations, times ? Number(r.solve_time) : "",
                          r.truth, r.label, Number(job.x), job.seed,
                          r.truth == "none" ? "" : fmt::format("{}", int(r.inside_95)),
                          int(r.counted), Number(r.bound));
             });
  WriteTable(run, &JobResult::convergence, directory / "convergence.csv",
             "log,label,gamma,sweep,seed,quantity,tolerance,windows,time [s]",
             [](std::ostream& out, const Job& job, const ConvergenceRow& r) {
               fmt::print(out, "{},{},{},{},{},{},{},{},{}\n", job.log, r.label, r.gamma,
                          Number(job.x), job.seed, r.quantity, r.tolerance, r.windows,
                          Number(r.time));
             });
  WriteTable(run, &JobResult::starts, directory / "starts.csv",
             "log,label,gamma,sweep,seed,tau,starts,same_optimum,iterations_mean,iterations_max",
             [](std::ostream& out, const Job& job, const StartsRow& r) {
               fmt::print(out, "{},{},{},{},{},{},{},{},{:.4g},{}\n", job.log, r.label, r.gamma,
                          Number(job.x), job.seed, r.tau, r.starts, r.same_optimum,
                          r.iterations_mean, r.iterations_max);
             });
  WriteTable(run, &JobResult::forecasts, directory / "forecasts.csv",
             "log,label,gamma,sweep,seed,tau,horizon [s],error [m],sigma [m],rank [1]",
             [](std::ostream& out, const Job& job, const ForecastRow& r) {
               fmt::print(out, "{},{},{},{},{},{},{},{:.6g},{:.6g},{:.6g}\n", job.log, r.label,
                          r.gamma, Number(job.x), job.seed, r.tau, r.horizon, r.error, r.sigma,
                          r.rank);
             });
  WriteTable(run, &JobResult::paths, directory / "trajectory.csv",
             "label,kind,tau,t [s],x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s]",
             [](std::ostream& out, const Job&, const PathRow& r) {
               fmt::print(out, "{},{},{},{:.6f},{:.4f},{:.4f},{:.4f},{},{},{}\n", r.label, r.kind,
                          r.tau, r.t, r.x, r.y, r.z, Number(r.vx, "{:.4f}"), Number(r.vy, "{:.4f}"),
                          Number(r.vz, "{:.4f}"));
             });
  WriteTable(run, &JobResult::estimates, directory / "estimates.csv",
             "label,tau,t [s],name,unit,value,sigma,truth",
             [](std::ostream& out, const Job&, const EstimateRow& r) {
               fmt::print(out, "{},{},{:.6f},{},{},{:.6g},{:.6g},{}\n", r.label, r.tau, r.t, r.name,
                          r.unit, r.value, r.sigma, Number(r.truth));
             });
  WriteFileAtomically(directory / "summary.yaml", SummaryYaml(experiment, run));
  WriteTiming(run, threads, directory / "timing.yaml");
}

std::string BenchmarkTable(const Experiment& experiment, const ExperimentRun& run) {
  std::string text =
      fmt::format("{:<18}{:<22}{:>6}{:>9}{:>8}{:>9}{:>9}{:>9}{:>7}{:>9}{:>9}\n", "log", "label",
                  "gamma", experiment.sweep.name.empty() ? "" : "sweep", "arcs", "mean [m]",
                  "median", "rms", "in 95", "iter.", "bound");
  for (const GroupSummary& g : SummariseGroups(run.outcomes)) {
    text +=
        fmt::format("{:<18.17}{:<22.21}{:>6}{:>9}{:>8}{:>9.3f}{:>9.3f}{:>9.3f}{:>7}{:>9.1f}{:>9}\n",
                    g.log, g.label, g.gamma, Number(g.x), g.error.count, g.error.mean,
                    g.error.median, g.rms, Share(g.inside_95, g.error.count + g.diverged),
                    g.iterations_mean, Number(g.bound_rms, "{:.3f}"));
  }
  text += ForecastTable(run.outcomes);
  const auto times = SummariseConvergence(run.outcomes);
  if (times.empty()) return text;
  text += fmt::format("\n{:<18}{:<22}{:>6}{:>9}{:>20}{:>11}{:>11}{:>15}\n", "log", "label", "gamma",
                      "sweep", "inside", "tolerance", "flights", "median [s]");
  for (const ConvergenceSummary& c : times) {
    text += fmt::format(
        "{:<18.17}{:<22.21}{:>6}{:>9}{:>20}{:>11}{:>11}{:>15}\n", c.log, c.label, c.gamma,
        Number(c.x), c.quantity, c.tolerance, Share(c.converged, c.flights),
        std::isinf(c.median_time) ? "not reached" : fmt::format("{:.1f}", c.median_time));
  }
  return text;
}

}  // namespace trueline
