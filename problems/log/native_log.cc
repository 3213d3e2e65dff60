#include "problems/log/native_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "problems/common/atomic_file.h"
#include "problems/common/error.h"
#include "problems/log/csv_text.h"
#include "problems/log/imu_health.h"
#include "problems/log/log_yaml.h"
#include "problems/log/stream_reader.h"
#include "problems/log/text_file.h"
#include "problems/result/statistics.h"

namespace trueline {

namespace fs = std::filesystem;

FlightLog ReadNativeLog(const fs::path& directory) {
  FlightLog log = ReadCommandLog(directory);
  if (!log.imu.empty()) {
    RequirePositions(log, directory.string());
    return log;
  }
  throw ErrorAt((directory / "imu.csv").string(), 0,
                "is missing; every log needs it, but for trueline diagnose --against");
}

FlightLog ReadCommandLog(const fs::path& directory) {
  if (!fs::exists(directory)) {
    throw ErrorAt(directory.string(), 0, "does not exist; give the path of a recorded log");
  }
  if (!fs::is_directory(directory)) {
    throw ErrorAt(directory.string(), 0,
                  "is no directory; a native log is a directory with log.yaml and imu.csv");
  }
  FlightLog log;
  log.directory = directory.string();
  const fs::path whole = fs::absolute(directory).lexically_normal();
  const fs::path yaml = directory / "log.yaml";
  ReadLogYaml(yaml, &log);
  if (log.name.empty()) log.name = whole.filename().string();
  log.sha256["log.yaml"] = Sha256OfFile(yaml);
  ReadStreams(directory, &log);
  log.imu.shrink_to_fit();  // by far the longest streams
  log.attitude.shrink_to_fit();
  if (log.imu.empty()) return log;
  for (const std::string& warning : ImuWarnings(log.imu)) log.warnings.push_back(warning);
  return log;
}

std::vector<std::string> NativeLogFiles() {
  std::vector<std::string> files = {"log.yaml"};
  const FlightLog log;
  ForEachStream(log, [&](const Stream& stream, const auto&) {
    files.push_back(std::string(stream.name) + ".csv");
  });
  return files;
}

void WriteNativeLog(const FlightLog& log, const fs::path& directory) {
  WriteStreams(log, directory);
  WriteFileAtomically(directory / "log.yaml", LogYaml(log));
}

namespace {

namespace fs = std::filesystem;

constexpr double kNormTolerance = 1e-2;    // of a quaternion written with three decimals
constexpr double kStrangeNorm = 1.1e-3;    // off from 1 by more than three decimals explain
constexpr double kLongestPause = 86400.0;  // s
constexpr std::size_t kFlushAt = 1 << 16;  // bytes

fs::path FileOf(const fs::path& directory, const Stream& stream) {
  return directory / (std::string(stream.name) + ".csv");
}

// Archive that lists the columns of a stream, those of channels as many as the sample has.
struct ColumnList {
  std::vector<Column> columns;

  template <class Value>
  void operator()(const Field& field, const Value&) {
    for (const char* name : field.columns) {
      if (name != nullptr) columns.push_back({name, field.unit});
    }
  }
  void operator()(const Field& field, const std::vector<double>& values) {
    if (values.empty()) columns.push_back({field.columns[0], field.unit, true});
    for (std::size_t k = 1; k <= values.size(); ++k) {
      columns.push_back({fmt::format("{}{}", field.columns[0], k), field.unit});
    }
  }
};

template <class Sample>
std::vector<Column> ColumnsOf(const Sample& sample, const Stream& stream) {
  ColumnList list;
  Sample::Describe(list, sample, stream);
  return list.columns;
}

std::string Header(const std::vector<Column>& columns) {
  std::string header = "t [s]";
  for (const Column& column : columns) header += fmt::format(",{} [{}]", column.name, column.unit);
  return header;
}

// Archive that fills a sample from the row last read, in the order of ColumnList.
class RowParser {
 public:
  // norms: of quaternions, less 1.
  RowParser(StreamReader* row, std::vector<double>* norms) : row_(row), norms_(norms) {}

  void operator()(const Field&, Eigen::Vector3d& vector) {
    for (double& value : vector) value = Next();
  }
  void operator()(const Field& field, Eigen::Quaterniond& q) {
    for (double* value : {&q.w(), &q.x(), &q.y(), &q.z()}) *value = Next();
    const double norm = q.norm();
    if (std::abs(norm - 1.0) > kNormTolerance) {
      cut_off_ = row_->DropAsCutOff();
      if (cut_off_) return;
      row_->Fail(field.columns[0],
                 fmt::format("the quaternion's norm is {:.6g}, not 1; remove the row or check the "
                             "order of the columns",
                             norm));
    }
    norms_->push_back(std::abs(norm - 1.0));
    // A norm that is correct to the last digits stays, so that reading returns what was written.
    if (std::abs(norm - 1.0) > 1e-12) q.normalize();
  }
  void operator()(const Field& field, double& value) {
    value = Next();
    if (!field.is_sigma || value >= kLeastSigma) return;
    row_->Fail(field.columns[0],
               fmt::format("found {}; a standard deviation must be positive, {} or more", value,
                           kLeastSigma));
  }
  void operator()(const Field& field, int& id) {
    const double value = Next();
    const bool good = value == std::floor(value) && value >= kNoGate && value <= kMostId;
    if (!good) {
      row_->Fail(field.columns[0],
                 fmt::format("found {}; an id is a whole number from 0 to {}, or {} for none",
                             value, kMostId, kNoGate));
    }
    id = static_cast<int>(value);
  }
  void operator()(const Field&, std::vector<double>& values) { values = row_->values(); }

  bool cut_off() const { return cut_off_; }  // the row is truncated inside a number

 private:
  double Next() { return row_->value(next_++); }

  StreamReader* row_;
  std::vector<double>* norms_;
  int next_ = 0;
  bool cut_off_ = false;
};

// The IMU's time spans the flight: a clock that was set within it would make the flight last years.
void CheckPause(TimeNs before, const StreamReader& reader) {
  const double pause = SecondsBetween(before, reader.time());
  if (pause <= kLongestPause) return;
  reader.Fail("t", fmt::format("comes {:.6g} s after the row before: was the clock set here? "
                               "Remove the rows before or after it, or correct their stamps",
                               pause));
}

// All rows of a file have the same digits, so some quaternions that are further from norm 1 than
// most have a number that is not theirs.
void WarnOfStrangeNorms(const fs::path& path, std::vector<double> norms,
                        std::vector<std::string>* warnings) {
  if (norms.empty()) return;
  const double usual = UpperMedian(norms);
  const double limit = std::max(kStrangeNorm, 20.0 * usual);
  const auto count = std::count_if(norms.begin(), norms.end(), [&](double n) { return n > limit; });
  if (count == 0) return;
  warnings->push_back(fmt::format(
      "{}: {} of {} quaternions have a norm that differs from 1 by up to {:.2g}, the "
      "others by {:.2g}: a column holds wrong numbers there; look at the logger",
      path.string(), count, norms.size(), *std::max_element(norms.begin(), norms.end()), usual));
}

template <class Sample>
std::vector<Sample> ReadStream(const fs::path& path, const Stream& stream,
                               std::vector<std::string>* warnings) {
  Sample sample{};
  StreamReader reader(path, ColumnsOf(sample, stream), warnings);
  std::vector<Sample> samples;
  std::vector<double> norms;
  while (reader.Next()) {
    if (samples.empty()) samples.reserve(reader.EstimatedRows());
    RowParser row(&reader, &norms);
    sample.t = reader.time();
    Sample::Describe(row, sample, stream);
    if (row.cut_off()) break;
    if (stream.name == std::string_view("imu") && !samples.empty()) {
      CheckPause(samples.back().t, reader);
    }
    samples.push_back(sample);
  }
  if (samples.empty()) {
    throw ErrorAt(path.string(), 0,
                  "has a header but no rows; record the stream or remove the file");
  }
  WarnOfStrangeNorms(path, norms, warnings);
  return samples;
}

// Archive that writes a sample's numbers.
struct RowWriter {
  fmt::memory_buffer buffer;

  template <class Number>
  void operator()(const Field&, const Number& value) {
    fmt::format_to(std::back_inserter(buffer), ",{}", value);
  }
  void operator()(const Field& field, const Eigen::Vector3d& vector) {
    for (const double value : vector) (*this)(field, value);
  }
  void operator()(const Field& field, const Eigen::Quaterniond& q) {
    for (const double value : {q.w(), q.x(), q.y(), q.z()}) (*this)(field, value);
  }
  void operator()(const Field& field, const std::vector<double>& values) {
    for (const double value : values) (*this)(field, value);
  }
};

template <class Sample>
void WriteStream(const Stream& stream, const std::vector<Sample>& samples, const fs::path& path) {
  AtomicFile file(path);
  file.stream() << Header(ColumnsOf(samples.front(), stream)) << '\n';
  RowWriter row;
  const auto flush = [&] {
    file.stream().write(row.buffer.data(), static_cast<std::streamsize>(row.buffer.size()));
    row.buffer.clear();
  };
  for (const Sample& sample : samples) {
    row.buffer.append(TimeText(sample.t));
    Sample::Describe(row, sample, stream);
    row.buffer.push_back('\n');
    if (row.buffer.size() > kFlushAt) flush();
  }
  flush();
  file.Commit();
}

}  // namespace

void ReadStreams(const fs::path& directory, FlightLog* log) {
  const auto lacks = [&](const char* name) { return !fs::exists(directory / name); };
  if (lacks("imu.csv") && lacks("motors.csv") && lacks("rotors.csv")) {
    throw ErrorAt((directory / "imu.csv").string(), 0,
                  fmt::format("is missing; every log needs '{}'",
                              Header(ColumnsOf(ImuSample{}, Stream{"imu"}))));
  }
  ForEachStream(*log, [&](const Stream& stream, auto& samples) {
    const fs::path path = FileOf(directory, stream);
    if (!fs::exists(path)) return;
    samples = ReadStream<SampleOf<decltype(samples)>>(path, stream, &log->warnings);
    log->sha256[path.filename().string()] = Sha256OfFile(path);
  });
  if (!ReadsWithoutPositions(*log)) RequirePositions(*log, directory.string());
}

bool IsNativeLog(const fs::path& folder) {
  std::error_code unknown;
  return fs::exists(folder / "log.yaml", unknown);
}

bool HoldsNativeStreams(const fs::path& folder) {
  if (IsNativeLog(folder)) return true;
  std::error_code unknown;
  if (!fs::is_regular_file(folder / "imu.csv", unknown)) return false;
  std::string_view line;
  LineReader lines(folder / "imu.csv");
  if (!lines.NextFilled(&line)) return true;  // whose reader says that it is empty
  const std::vector<HeaderColumn> header = SplitHeader(line);
  const auto has = [&](const char* name) {
    return std::ranges::find(header, name, &HeaderColumn::name) != header.end();
  };
  return has("t") && has("ax") && has("ay") && has("az") && has("gx") && has("gy") && has("gz");
}

bool HasPositions(const FlightLog& log) {
  return !log.fixes.empty() || !log.mocap.empty() || !log.pose.empty();
}

bool ReadsWithoutPositions(const FlightLog& log) {
  return !log.imu.empty() && (!log.motors.empty() || !log.rotors.empty());
}

void RequirePositions(const FlightLog& log, const std::string& directory) {
  if (HasPositions(log)) return;
  throw ErrorAt(
      directory, 0,
      std::string(
          "has neither fixes.csv nor mocap.csv, nor pose.csv; add position fixes from gate "
          "detections, a ground truth that fixes can be sampled from, or a pose sensor's output") +
          (ReadsWithoutPositions(log) ? kWithoutPositions : ""));
}

void WriteStreams(const FlightLog& log, const fs::path& directory) {
  ForEachStream(log, [&](const Stream& stream, const auto& samples) {
    const fs::path path = FileOf(directory, stream);
    if (samples.empty()) {
      fs::remove(path);
    } else {
      WriteStream(stream, samples, path);
    }
  });
}

NativeFolder::NativeFolder(const FlightLog& log, bool wanted) : path_(log.directory) {
  if (!wanted || (!log.directory.empty() && IsNativeLog(path_))) return;
  std::string copy = (fs::temp_directory_path() / "trueline-XXXXXX").string();
  if (mkdtemp(copy.data()) == nullptr) {
    throw InputError(copy + ": can't be made; free space in the folder for temporary files");
  }
  path_ = copy_ = copy;
  WriteNativeLog(log, copy_);
}

NativeFolder::~NativeFolder() {
  std::error_code gone_already;
  if (!copy_.empty()) fs::remove_all(copy_, gone_already);
}

std::string StreamTable(const FlightLog& log) {
  std::string table = fmt::format("{:<10}{:>9}{:>12}{:>18}{:>18}{:>11}\n", "stream", "samples",
                                  "rate [Hz]", "from [s]", "to [s]", "span [s]");
  ForEachStream(log, [&](const Stream& stream, const auto& samples) {
    if (samples.empty()) return;
    const TimeNs from = samples.front().t, to = samples.back().t;
    table +=
        fmt::format("{:<10}{:>9}{:>12.2f}{:>18.3f}{:>18.3f}{:>11.3f}", stream.name, samples.size(),
                    MeanRate(samples), ToSeconds(from), ToSeconds(to), SecondsBetween(from, to));
    const auto channel = log.source.find(stream.name);
    if (channel != log.source.end()) table += "  " + channel->second;
    table += "\n";
  });
  if (!log.gates.empty()) table += fmt::format("{} gates\n", log.gates.size());
  return table;
}

}  // namespace trueline
