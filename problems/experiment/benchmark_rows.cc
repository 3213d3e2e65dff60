#include "problems/experiment/benchmark_rows.h"

#include <fmt/format.h>

#include <sstream>

#include "problems/common/error.h"
#include "problems/log/csv_text.h"

namespace trueline {
namespace {

constexpr char kHeader[] = "trueline benchmark job 1";
constexpr char kEnd[] = "end";

// Takes the fields of one line in order.
class Fields {
 public:
  Fields(std::string_view line, std::string where) : where_(std::move(where)) {
    SplitFields(line, ',', &fields_);
  }
  std::string Text() {
    if (next_ >= fields_.size()) Fail();
    return std::string(fields_[next_++]);
  }
  double Number() {
    double value = 0.0;
    if (!ParseNumber(Text(), &value)) Fail();
    return value;
  }
  int Int() { return static_cast<int>(Number()); }

 private:
  [[noreturn]] void Fail() const {
    throw InputError(where_ + ": not the row of a job file; delete the file");
  }
  std::string where_;
  std::vector<std::string_view> fields_;
  std::size_t next_ = 0;
};

std::string Line(const ArcRow& r) {
  return fmt::format("arc,{},{},{},{},{:.9f},{:.9f},{},{},{},{},{},{},{},{}\n", r.label,
                     r.estimator, r.gamma, r.tau, r.begin, r.end, r.error, r.predicted_sigma,
                     int(r.inside_95), r.truth, int(r.counted), r.iterations, r.bound,
                     r.solve_time);
}

ArcRow ParseArc(Fields f) {
  ArcRow r;
  r.label = f.Text(), r.estimator = f.Text(), r.gamma = f.Int(), r.tau = f.Int();
  r.begin = f.Number(), r.end = f.Number(), r.error = f.Number(), r.predicted_sigma = f.Number();
  r.inside_95 = f.Int() != 0, r.truth = f.Text(), r.counted = f.Int() != 0;
  r.iterations = f.Int(), r.bound = f.Number(), r.solve_time = f.Number();
  return r;
}

std::string Line(const ConvergenceRow& r) {
  return fmt::format("convergence,{},{},{},{},{},{}\n", r.label, r.gamma, r.quantity, r.tolerance,
                     r.windows, r.time);
}

ConvergenceRow ParseConvergence(Fields f) {
  ConvergenceRow r;
  r.label = f.Text(), r.gamma = f.Int(), r.quantity = f.Text();
  r.tolerance = f.Number(), r.windows = f.Int(), r.time = f.Number();
  return r;
}

std::string Line(const StartsRow& r) {
  return fmt::format("starts,{},{},{},{},{},{},{}\n", r.label, r.gamma, r.tau, r.starts,
                     r.same_optimum, r.iterations_mean, r.iterations_max);
}

StartsRow ParseStarts(Fields f) {
  StartsRow r;
  r.label = f.Text(), r.gamma = f.Int(), r.tau = f.Int(), r.starts = f.Int();
  r.same_optimum = f.Int(), r.iterations_mean = f.Number(), r.iterations_max = f.Int();
  return r;
}

std::string Line(const PathRow& r) {
  return fmt::format("path,{},{},{},{:.9f},{:.4f},{:.4f},{:.4f}\n", r.label, r.kind, r.tau, r.t,
                     r.x, r.y, r.z);
}

PathRow ParsePath(Fields f) {
  PathRow r;
  r.label = f.Text(), r.kind = f.Text(), r.tau = f.Int();
  r.t = f.Number(), r.x = f.Number(), r.y = f.Number(), r.z = f.Number();
  return r;
}

void ParseLine(const std::string& line, const std::string& where, JobResult* result) {
  const std::size_t comma = line.find(',');
  const std::string kind = line.substr(0, comma);
  const std::string_view rest = std::string_view(line).substr(std::min(comma + 1, line.size()));
  if (kind == "arc") {
    result->arcs.push_back(ParseArc(Fields(rest, where)));
  } else if (kind == "convergence") {
    result->convergence.push_back(ParseConvergence(Fields(rest, where)));
  } else if (kind == "starts") {
    result->starts.push_back(ParseStarts(Fields(rest, where)));
  } else if (kind == "path") {
    result->paths.push_back(ParsePath(Fields(rest, where)));
  } else {
    throw InputError(where + ": not the row of a job file; delete the file");
  }
}

}  // namespace

std::string ToText(const JobResult& result) {
  std::string text = fmt::format("{}\n", kHeader);
  for (const ArcRow& row : result.arcs) text += Line(row);
  for (const ConvergenceRow& row : result.convergence) text += Line(row);
  for (const StartsRow& row : result.starts) text += Line(row);
  for (const PathRow& row : result.paths) text += Line(row);
  return text + kEnd + "\n";
}

JobResult ParseJobResult(const std::string& text, const std::string& file) {
  std::istringstream stream(text);
  JobResult result;
  std::string line;
  if (!std::getline(stream, line) || line != kHeader) {
    throw ErrorAt(file, 1, "is no job file of this version; delete it");
  }
  for (int number = 2; std::getline(stream, line); ++number) {
    if (line == kEnd) return result;
    ParseLine(line, fmt::format("{}:{}", file, number), &result);
  }
  throw ErrorAt(file, 0, "is cut off; delete it");
}

}  // namespace trueline
