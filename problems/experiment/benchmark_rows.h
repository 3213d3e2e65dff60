// The result of one job of a benchmark: rows for the tables of the whole run.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace trueline {

// One arc of one estimator at one gamma.
struct ArcRow {
  std::string label;
  std::string estimator;
  int gamma = 0;
  int tau = 0;
  double begin = 0.0, end = 0.0;  // s, the log's own clock
  double error = 0.0;             // m, final-point error; NaN where there is no truth
  double predicted_sigma = 0.0;   // m
  bool inside_95 = false;
  std::string truth;     // mocap | fixes | none
  bool counted = false;  // arcs with truth from fixes do not count if the log has mocap
  int iterations = 0;
  double bound = 0.0;       // m, root of the bound on the mean squared error; NaN: not asked for
  double solve_time = 0.0;  // s
};

// The time from which a quantity stays within its tolerance of the truth.
struct ConvergenceRow {
  std::string label;
  int gamma = 0;
  std::string quantity;
  double tolerance = 0.0;  // SI
  int windows = 0;         // that give it
  double time = 0.0;       // s from the first fix; NaN: not within the flight
};

// One window solved from random starts.
struct StartsRow {
  std::string label;
  int gamma = 0;
  int tau = 0;
  int starts = 0;
  int same_optimum = 0;
  double iterations_mean = 0.0;
  int iterations_max = 0;
};

struct PathRow {
  std::string label;  // of the estimator; "truth", "fixes"
  std::string kind;   // fit | prediction | mocap | fix
  int tau = 0;
  double t = 0.0, x = 0.0, y = 0.0, z = 0.0;  // s, m
};

struct JobResult {
  std::vector<ArcRow> arcs;
  std::vector<ConvergenceRow> convergence;
  std::vector<StartsRow> starts;
  std::vector<PathRow> paths;
};

// A job's result as text, with all digits that the tables show, and the inverse.
std::string ToText(const JobResult& result);
// Throws InputError if `text` is not a whole job file; `file` is for the message.
JobResult ParseJobResult(const std::string& text, const std::string& file);

}  // namespace trueline
