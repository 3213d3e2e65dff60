#include "apps/python/log_arrays.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <pybind11/stl.h>

#include <cmath>

#include "problems/common/error.h"

namespace trueline {
namespace {

using Row = std::vector<double>;

// Archive that lists the names of a sample's columns.
struct NameList {
  std::vector<std::string> names = {"t"};

  template <class Value>
  void operator()(const Field& field, const Value&) {
    for (const char* name : field.columns) {
      if (name != nullptr) names.emplace_back(name);
    }
  }
  void operator()(const Field& field, const std::vector<double>& values) {
    for (std::size_t k = 1; k <= values.size(); ++k) {
      names.push_back(fmt::format("{}{}", field.columns[0], k));
    }
  }
};

// Archive that appends a sample's numbers to a row.
struct RowWriter {
  Row row;

  void operator()(const Field&, const Eigen::Vector3d& v) {
    row.insert(row.end(), v.begin(), v.end());
  }
  void operator()(const Field&, const Eigen::Quaterniond& q) {
    row.insert(row.end(), {q.w(), q.x(), q.y(), q.z()});
  }
  void operator()(const Field&, double value) { row.push_back(value); }
  void operator()(const Field&, const std::vector<double>& values) {
    row.insert(row.end(), values.begin(), values.end());
  }
};

// Archive that takes a sample's numbers from a row.
struct RowReader {
  const double* next;

  void operator()(const Field&, Eigen::Vector3d& v) {
    for (double& value : v) value = *next++;
  }
  void operator()(const Field&, Eigen::Quaterniond& q) {
    for (double* value : {&q.w(), &q.x(), &q.y(), &q.z()}) *value = *next++;
  }
  void operator()(const Field&, double& value) { value = *next++; }
  void operator()(const Field&, int& value) { value = static_cast<int>(std::lround(*next++)); }
  void operator()(const Field&, std::vector<double>& values) {
    for (double& value : values) value = *next++;
  }
};

template <class Sample>
std::vector<std::string> NamesOf(const Sample& sample, const Stream& stream) {
  NameList list;
  Sample::Describe(list, sample, stream);
  return list.names;
}

template <class Sample>
StreamArray ArrayOf(const std::vector<Sample>& samples, const Stream& stream) {
  StreamArray array{NamesOf(samples.front(), stream), {}};
  Row all;
  for (const Sample& sample : samples) {
    RowWriter writer{{ToSeconds(sample.t)}};
    Sample::Describe(writer, sample, stream);
    all.insert(all.end(), writer.row.begin(), writer.row.end());
  }
  const std::vector<std::size_t> shape = {samples.size(), array.columns.size()};
  array.rows = pybind11::array_t<double>(shape, all.data());
  return array;
}

// A sample of a stream whose rows have `numbers` beside the time.
template <class Sample>
Sample EmptySample(std::size_t numbers) {
  Sample sample{};
  if constexpr (requires { sample.values; }) sample.values.resize(numbers);
  return sample;
}

template <class Sample>
std::vector<Sample> SamplesOf(const pybind11::array_t<double>& rows, const Stream& stream) {
  const std::size_t given = rows.ndim() == 2 ? static_cast<std::size_t>(rows.shape(1)) : 0;
  Sample sample = EmptySample<Sample>(given > 0 ? given - 1 : 0);
  const std::vector<std::string> names = NamesOf(sample, stream);
  if (names.size() != given || given < 2) {
    throw InputError(fmt::format("{}: an array of {} columns (t and the stream's own) is needed",
                                 stream.name, names.size()));
  }
  std::vector<Sample> samples;
  for (pybind11::ssize_t i = 0; i < rows.shape(0); ++i) {
    const double t = rows.at(i, 0);
    if (!(std::abs(t) < 9e9)) {
      throw InputError(fmt::format("{}: the time in row {} is no time in s", stream.name, i));
    }
    sample.t = std::llround(t * 1e9);
    RowReader reader{rows.data(i, 1)};
    Sample::Describe(reader, sample, stream);
    samples.push_back(sample);
  }
  return samples;
}

}  // namespace

std::vector<std::string> StreamNames() {
  std::vector<std::string> names;
  const FlightLog log;
  ForEachStream(log, [&](const Stream& stream, const auto&) { names.emplace_back(stream.name); });
  return names;
}

std::map<std::string, StreamArray> ArraysOf(const FlightLog& log) {
  std::map<std::string, StreamArray> arrays;
  ForEachStream(log, [&](const Stream& stream, const auto& samples) {
    if (!samples.empty()) arrays[stream.name] = ArrayOf(samples, stream);
  });
  return arrays;
}

void SetStreams(const std::map<std::string, pybind11::array_t<double>>& arrays, FlightLog* log) {
  std::size_t known = 0;
  ForEachStream(*log, [&](const Stream& stream, auto& samples) {
    const auto found = arrays.find(stream.name);
    if (found == arrays.end()) return;
    samples = SamplesOf<SampleOf<decltype(samples)>>(found->second, stream);
    ++known;
  });
  if (known == arrays.size()) return;
  throw InputError(fmt::format("a log has the streams {}", fmt::join(StreamNames(), " ")));
}

}  // namespace trueline
