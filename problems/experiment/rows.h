// The result of one job of an experiment: rows for the tables of the whole run.
#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "problems/common/error.h"
#include "problems/log/csv_text.h"
#include "problems/rotor/rotor_state.h"

namespace trueline {

// Rows of results as text. A row type lists its fields once, in
//   template <class Archive> void Fields(Archive& archive) { archive(label, gamma, error); }
// and this archive writes them to a line or reads them back, numbers without loss. A field is a
// string without commas, a number, an Eigen vector, a row, or a std::vector of these.
class RowText {
 public:
  // Appends the fields to `line`.
  explicit RowText(std::string* line) : line_(line) {}
  // Reads them from `line`. Throws InputError at `where` for a line that is no such row.
  RowText(std::string_view line, std::string where) : where_(std::move(where)) {
    SplitFields(line, ',', &fields_);
  }
  template <class... T>
  void operator()(T&... fields) {
    (Field(fields), ...);
  }
  [[noreturn]] void Fail() const {
    throw InputError(where_ + ": not the row of a job file; delete the file");
  }

 private:
  void Field(std::string& text) {
    if (line_ != nullptr) {
      *line_ += (line_->empty() || line_->back() == '\n' ? "" : ",") + text;
    } else if (next_ < fields_.size()) {
      text = fields_[next_++];
    } else {
      Fail();
    }
  }
  template <class T>
  void Field(std::vector<T>& values) {
    int count = static_cast<int>(values.size());
    Field(count);
    if (count < 0 || (line_ == nullptr && count > static_cast<int>(fields_.size()))) Fail();
    values.resize(count);
    for (T& value : values) Field(value);
  }
  template <class T>
  void Field(T& value) {
    if constexpr (std::is_arithmetic_v<T>) {
      std::string text = fmt::format("{}", +value);
      double number = 0.0;
      Field(text);
      if (line_ != nullptr) return;
      if (!ParseNumber(text, &number)) Fail();
      value = static_cast<T>(number);
    } else if constexpr (requires { value.Fields(*this); }) {
      value.Fields(*this);
    } else {
      for (double& number : value) Field(number);
    }
  }

  std::string* line_ = nullptr;  // null: reading
  std::string where_;
  std::vector<std::string_view> fields_;
  std::size_t next_ = 0;
};

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

  template <class Archive>
  void Fields(Archive& archive) {
    archive(label, estimator, gamma, tau, begin, end, error, predicted_sigma, inside_95, truth,
            counted, iterations, bound, solve_time);
  }
};

// The time from which a quantity stays within its tolerance of the truth.
struct ConvergenceRow {
  std::string label;
  int gamma = 0;
  std::string quantity;
  double tolerance = 0.0;  // SI
  int windows = 0;         // that give it
  double time = 0.0;       // s from the first fix; NaN: not within the flight

  template <class Archive>
  void Fields(Archive& archive) {
    archive(label, gamma, quantity, tolerance, windows, time);
  }
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

  template <class Archive>
  void Fields(Archive& archive) {
    archive(label, gamma, tau, starts, same_optimum, iterations_mean, iterations_max);
  }
};

// A forecast against mocap (vgd/vgd.h).
struct ForecastRow {
  std::string label;
  int gamma = 0;
  int tau = 0;
  double horizon = 0.0;  // s
  double error = 0.0;    // m
  double sigma = 0.0;    // m
  double rank = 0.0;

  template <class Archive>
  void Fields(Archive& archive) {
    archive(label, gamma, tau, horizon, error, sigma, rank);
  }
};

struct PathRow {
  std::string label;  // of the estimator; "truth", "fixes"
  std::string kind;   // fit | prediction | mocap | fix
  int tau = 0;
  double t = 0.0, x = 0.0, y = 0.0, z = 0.0;  // s, m
  double vx = 0.0, vy = 0.0, vz = 0.0;        // m/s in E; NaN of fixes

  template <class Archive>
  void Fields(Archive& archive) {
    archive(label, kind, tau, t, x, y, z, vx, vy, vz);
  }
};

// A parameter as one window estimates it.
struct EstimateRow {
  std::string label;
  int tau = 0;
  double t = 0.0;  // s, end of the window's last pass
  std::string name, unit;
  double value = 0.0, sigma = 0.0;
  double truth = 0.0;  // NaN: not known

  template <class Archive>
  void Fields(Archive& archive) {
    archive(label, tau, t, name, unit, value, sigma, truth);
  }
};

// Estimates of one rotor-driven flight. Errors are estimate less truth; NaN if it diverged.
struct TrialRow {
  struct Estimate {
    RotorConstants error, sigma;

    template <class Archive>
    void Fields(Archive& archive) {
      archive(error, sigma);
    }
  };
  struct Moment {    // of the filter
    double t = 0.0;  // s
    Estimate estimate;

    template <class Archive>
    void Fields(Archive& archive) {
      archive(t, estimate);
    }
  };
  RotorConstants first_guess;  // less truth
  // `ordinary` is an extended filter that flies everything once, as Wuest et al. 2019 have it.
  Estimate filter, ordinary, batch;
  RotorConstants bound;                        // sigma
  double filter_nees = 0.0, batch_nees = 0.0;  // by degree of freedom
  double path_error = 0.0;                     // m
  std::vector<Moment> history;                 // about every 0.2 s

  template <class Archive>
  void Fields(Archive& archive) {
    archive(first_guess, filter, ordinary, batch, bound, filter_nees, batch_nees, path_error,
            history);
  }
};

struct JobResult {
  std::vector<ArcRow> arcs;
  std::vector<ConvergenceRow> convergence;
  std::vector<StartsRow> starts;
  std::vector<ForecastRow> forecasts;
  std::vector<PathRow> paths;
  std::vector<EstimateRow> estimates;
  std::vector<TrialRow> trials;

  template <class Visit>
  void ForEachTable(const Visit& visit) {
    visit("arc", arcs);
    visit("convergence", convergence);
    visit("starts", starts);
    visit("forecast", forecasts);
    visit("path", paths);
    visit("estimate", estimates);
    visit("trial", trials);
  }
};

// A job's result as text without loss, and the inverse.
std::string ToText(JobResult result);
// Throws InputError if `text` is not a job's result; `file` is for the message.
JobResult ParseJobResult(const std::string& text, const std::string& file);

}  // namespace trueline
