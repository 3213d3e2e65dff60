#include "problems/import/stream_import.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/log/csv_text.h"

namespace trueline {
namespace {

// The stamp of a row, in native time.
class StampReader {
 public:
  StampReader(const TimeSource& time, const std::string& file) : time_(time) {
    const auto found = std::find_if(time.offset_by_file.begin(), time.offset_by_file.end(),
                                    [&](const auto& entry) { return Fits(entry.first, file); });
    if (found != time.offset_by_file.end()) offset_ = FromSeconds(found->second);
  }

  void Bind(const ForeignCsv& csv) { time_.column.Bind(csv); }

  TimeNs Read(const ForeignCsv& csv) const {
    const int column = time_.column.index();
    if (!time_.factor) return csv.Time(column, time_.exponent) + offset_;
    const double count = csv.Number(column);
    if (!std::isfinite(count)) csv.Fail(column, "the time stamp is missing; every row needs one");
    return FromSeconds(count * *time_.factor) + offset_;
  }

  [[noreturn]] void FailUnsorted(const ForeignCsv& csv, TimeNs previous, TimeNs now) const {
    csv.Fail(time_.column.index(),
             fmt::format("{} s does not come after {} s before; sort the rows, or set 'unsorted: "
                         "drop' in the map",
                         TimeText(now), TimeText(previous)));
  }

 private:
  TimeSource time_;
  TimeNs offset_ = 0;
};

// Archive that fills a sample from a row and the sources of its fields.
class RowConverter {
 public:
  RowConverter(const ForeignCsv& csv, const std::vector<FieldSource>& sources)
      : csv_(csv), source_(sources.begin()) {}

  void operator()(const Field&, Eigen::Vector3d& vector) {
    vector = source_->axes * Eigen::Map<const Eigen::Vector3d>(Numbers().data());
    if (source_->attitude) {
      const auto q_E_B = source_->attitude->Value(csv_);
      missing_ |= !q_E_B;
      if (q_E_B) vector = q_E_B->conjugate() * vector;
    }
    ++source_;
  }
  void operator()(const Field&, Eigen::Quaterniond& q) {
    const auto value = (source_++)->attitude->Value(csv_);
    missing_ |= !value;
    if (value) q = *value;
  }
  void operator()(const Field&, double& value) {
    value = Numbers()[0];
    ++source_;
  }
  void operator()(const Field& field, int& id) {
    double value = 0.0;
    (*this)(field, value);
    if (!missing_) id = static_cast<int>(std::lround(value));
  }
  void operator()(const Field&, std::vector<double>& values) {
    values = Numbers();
    ++source_;
  }

  bool missing() const { return missing_; }  // a value is missing

 private:
  std::vector<double> Numbers() {
    std::vector<double> values = source_->numbers.Values(csv_);
    for (const double value : values) missing_ |= !std::isfinite(value);
    return values;
  }

  const ForeignCsv& csv_;
  std::vector<FieldSource>::const_iterator source_;
  bool missing_ = false;
};

std::string LeftOut(const std::string& stream, std::size_t unsorted, std::size_t missing,
                    std::size_t out_of_range, std::size_t off_median) {
  std::string text;
  const auto add = [&](std::size_t count, const char* reason) {
    if (count == 0) return;
    text += fmt::format("{} {} {}", text.empty() ? "" : ",", count, reason);
  };
  add(unsorted, "that came too late");
  add(missing, "with missing values");
  add(out_of_range, "out of range");
  add(off_median, "far from the running median");
  return text.empty() ? text : fmt::format("{}: rows left out:{}", stream, text);
}

template <class Sample>
class SampleImport : public StreamImport {
 public:
  SampleImport(const Stream& stream, const StreamMap& map, const std::string& file,
               std::vector<Sample>* samples)
      : stream_(stream), map_(map), stamps_(map.time, file), samples_(samples) {}

  std::size_t input() const override { return map_.input; }

  void AddRow(const ForeignCsv& csv) override {
    if (!bound_) Bind(csv);
    if (!map_.filter.Accepts(csv)) return;
    Sample sample{};
    RowConverter row(csv, map_.fields);
    Sample::Describe(row, sample, stream_);
    if (row.missing()) {
      if (!map_.skip_missing) csv.FailMissing(stream_.name);
      ++missing_;
      return;
    }
    sample.t = stamps_.Read(csv);
    if (!samples_->empty() && sample.t <= samples_->back().t) {
      if (!map_.drop_unsorted) stamps_.FailUnsorted(csv, samples_->back().t, sample.t);
      ++unsorted_;
      return;
    }
    map_.filter.Remember(csv);
    samples_->push_back(std::move(sample));
  }

  void Finish(std::vector<std::string>* warnings) override {
    const std::vector<bool> mask = map_.filter.MedianMask();
    std::size_t kept = 0;
    for (std::size_t i = 0; i < mask.size(); ++i) {
      if (mask[i]) (*samples_)[kept++] = std::move((*samples_)[i]);
    }
    const std::size_t off_median = mask.size() - kept;
    if (!mask.empty()) samples_->resize(kept);
    const std::string text =
        LeftOut(stream_.name, unsorted_, missing_,
                static_cast<std::size_t>(map_.filter.out_of_range()), off_median);
    if (!text.empty()) warnings->push_back(text);
  }

 private:
  void Bind(const ForeignCsv& csv) {
    stamps_.Bind(csv);
    map_.filter.Bind(csv);
    for (FieldSource& source : map_.fields) {
      source.numbers.Bind(csv);
      if (source.attitude) source.attitude->Bind(csv);
    }
    bound_ = true;
  }

  Stream stream_;
  StreamMap map_;
  StampReader stamps_;
  std::vector<Sample>* samples_;
  bool bound_ = false;
  std::size_t missing_ = 0;
  std::size_t unsorted_ = 0;
};

}  // namespace

std::vector<std::unique_ptr<StreamImport>> MakeImports(const ImportMap& map,
                                                       const std::vector<std::string>& files,
                                                       const std::optional<double>& fix_sigma,
                                                       FlightLog* log) {
  std::vector<std::unique_ptr<StreamImport>> imports;
  ForEachStream(*log, [&](const Stream& stream, auto& samples) {
    const auto found = map.streams.find(stream.name);
    if (found == map.streams.end()) return;
    StreamMap own = found->second;
    for (FieldSource& source : own.fields) {
      if (fix_sigma && source.key == "sigma") source.numbers = NumberSource(*fix_sigma);
    }
    imports.push_back(std::make_unique<SampleImport<SampleOf<decltype(samples)>>>(
        stream, own, files[own.input], &samples));
  });
  return imports;
}

}  // namespace trueline
