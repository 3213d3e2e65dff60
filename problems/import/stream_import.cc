#include "problems/import/stream_import.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/common/error.h"
#include "problems/import/local_frame.h"
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

  void Bind(const ForeignRow& row) {
    if (!time_.of_row) time_.column.Bind(row);
  }

  TimeNs Read(const ForeignRow& row) const {
    if (time_.of_row) return row.Stamp() + offset_;
    const int column = time_.column.index();
    if (!time_.factor) return row.Time(column, time_.exponent) + offset_;
    const double count = row.Number(column);
    if (!std::isfinite(count)) row.Fail(column, "the time stamp is missing; every row needs one");
    return FromSeconds(count * *time_.factor) + offset_;
  }

  [[noreturn]] void FailUnsorted(const ForeignRow& row, TimeNs previous, TimeNs now) const {
    row.Fail(time_.column.index(),
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
  // `skip_missing`: a value that can't be is missing; otherwise it is an error.
  RowConverter(const ForeignRow& row, const StreamMap& map, LocalFrame* frame)
      : row_(row), source_(map.fields.begin()), frame_(frame), skip_missing_(map.skip_missing) {}

  void operator()(const Field&, Eigen::Vector3d& vector) {
    const std::vector<double> numbers = Numbers();
    vector = source_->axes * Eigen::Map<const Eigen::Vector3d>(numbers.data());
    if (source_->geodetic) missing_ |= !LocalFrame::IsPlace(numbers[0], numbers[1]);
    if (source_->geodetic && !missing_) vector = frame_->ToNed(numbers[0], numbers[1], numbers[2]);
    if (source_->attitude) {
      const auto q_E_B = Attitude();
      if (q_E_B) vector = q_E_B->conjugate() * vector;
    }
    ++source_;
  }
  void operator()(const Field&, Eigen::Quaterniond& q) {
    const auto value = Attitude();
    if (value) q = *value;
    ++source_;
  }
  void operator()(const Field& field, double& value) {
    value = Numbers()[0];
    if (field.is_sigma && value < kLeastSigma) RefuseSigma(value);
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

  bool missing() const { return missing_; }  // a value is missing, or can't be
  // Why a quaternion can't be, with its place; empty if its norm is 1.
  const std::string& bad_quaternion() const { return bad_quaternion_; }

 private:
  std::optional<Eigen::Quaterniond> Attitude() {
    std::optional<double> bad_norm;
    auto value = source_->attitude->Value(row_, &bad_norm);
    missing_ |= !value;
    if (bad_norm) RefuseQuaternion(*bad_norm);
    return value;
  }

  void RefuseQuaternion(double norm) {
    const InputError error = source_->attitude->NormError(row_, norm);
    if (!skip_missing_) throw error;
    bad_quaternion_ = error.what();
  }

  std::vector<double> Numbers() {
    std::vector<double> values = source_->numbers.Values(row_);
    for (const double value : values) missing_ |= !std::isfinite(value);
    return values;
  }

  void RefuseSigma(double value) {
    missing_ = true;
    if (skip_missing_) return;
    row_.Fail(source_->numbers.index(),
              fmt::format("found {}; a standard deviation must be positive, {} m or more: correct "
                          "it, give 'sigma: {{constant: ...}}', or set 'skip_missing: true' in the "
                          "map",
                          value, kLeastSigma));
  }

  const ForeignRow& row_;
  std::vector<FieldSource>::const_iterator source_;
  LocalFrame* frame_;
  bool skip_missing_;
  bool missing_ = false;
  std::string bad_quaternion_;
};

std::string LeftOut(const std::string& stream, std::size_t unsorted, const char* unsorted_reason,
                    std::size_t missing, std::size_t bad_quaternions, std::size_t out_of_range,
                    std::size_t off_median) {
  std::string text;
  const auto add = [&](std::size_t count, const char* reason) {
    if (count == 0) return;
    text += fmt::format("{} {} {}", text.empty() ? "" : ",", count, reason);
  };
  add(unsorted, unsorted_reason);
  add(missing, "with missing values");
  add(bad_quaternions, "with a quaternion whose norm is not 1");
  add(out_of_range, "out of range");
  add(off_median, "far from the running median");
  return text.empty() ? text : fmt::format("{}: rows left out:{}", stream, text);
}

// Orders samples by time and keeps the first of each stamp. A stamp more than a day from the median
// is a damaged one. Returns how many are removed.
template <class Sample>
std::size_t Sort(std::vector<Sample>* samples) {
  constexpr TimeNs kDay = 86400 * kNsPerSecond;
  if (samples->empty()) return 0;
  const std::size_t before = samples->size();
  const auto earlier = [](const Sample& a, const Sample& b) { return a.t < b.t; };
  std::stable_sort(samples->begin(), samples->end(), earlier);
  const std::size_t half = before / 2;
  const auto middle = static_cast<double>((*samples)[half].t);
  std::erase_if(*samples, [&](const Sample& s) {
    return std::abs(static_cast<double>(s.t) - middle) > static_cast<double>(kDay);
  });
  const auto same = [](const Sample& a, const Sample& b) { return a.t == b.t; };
  samples->erase(std::unique(samples->begin(), samples->end(), same), samples->end());
  return before - samples->size();
}

template <class Sample>
class SampleImport : public StreamImport {
 public:
  SampleImport(const Stream& stream, const StreamMap& map, const std::string& file,
               std::shared_ptr<LocalFrame> frame, std::vector<Sample>* samples)
      : stream_(stream),
        map_(map),
        stamps_(map.time, file),
        frame_(std::move(frame)),
        samples_(samples) {}

  const StreamMap& map() const override { return map_; }

  void AddRow(const ForeignRow& row) override {
    if (!bound_) Bind(row);
    if (!map_.filter.Accepts(row)) return;
    Sample sample{};
    RowConverter converter(row, map_, frame_.get());
    Sample::Describe(converter, sample, stream_);
    if (!converter.bad_quaternion().empty()) {
      if (bad_quaternions_++ == 0) first_bad_quaternion_ = converter.bad_quaternion();
      return;
    }
    if (converter.missing()) {
      if (!map_.skip_missing) row.FailMissing(stream_.name);
      ++missing_;
      return;
    }
    ++whole_;
    sample.t = stamps_.Read(row);
    if (map_.unsorted != Unsorted::kSort && !samples_->empty() && sample.t <= samples_->back().t) {
      if (map_.unsorted == Unsorted::kRefuse) {
        stamps_.FailUnsorted(row, samples_->back().t, sample.t);
      }
      ++unsorted_;
      return;
    }
    map_.filter.Remember(row);
    samples_->push_back(std::move(sample));
  }

  void Finish(std::vector<std::string>* warnings) override {
    // Single rows are damaged; where most are so, the map is wrong.
    if (bad_quaternions_ > whole_) throw InputError(first_bad_quaternion_);
    const std::vector<bool> mask = map_.filter.MedianMask();
    std::size_t kept = 0;
    for (std::size_t i = 0; i < mask.size(); ++i) {
      if (mask[i]) (*samples_)[kept++] = std::move((*samples_)[i]);
    }
    const std::size_t off_median = mask.size() - kept;
    if (!mask.empty()) samples_->resize(kept);
    if (map_.unsorted == Unsorted::kSort) unsorted_ = Sort(samples_);
    const std::string text =
        LeftOut(stream_.name, unsorted_,
                map_.unsorted == Unsorted::kSort ? "of the time of another, or of no possible time"
                                                 : "that came too late",
                missing_, bad_quaternions_, static_cast<std::size_t>(map_.filter.out_of_range()),
                off_median);
    if (!text.empty()) warnings->push_back(text);
  }

 private:
  void Bind(const ForeignRow& row) {
    stamps_.Bind(row);
    BindColumns(row, &map_);
    bound_ = true;
  }

  Stream stream_;
  StreamMap map_;
  StampReader stamps_;
  std::shared_ptr<LocalFrame> frame_;
  std::vector<Sample>* samples_;
  bool bound_ = false;
  std::size_t whole_ = 0;  // rows with all values
  std::size_t missing_ = 0;
  std::size_t bad_quaternions_ = 0;
  std::string first_bad_quaternion_;  // with its place
  std::size_t unsorted_ = 0;
};

}  // namespace

void BindColumns(const ForeignRow& row, StreamMap* stream) {
  if (!stream->time.of_row) stream->time.column.Bind(row);
  stream->filter.Bind(row);
  for (FieldSource& source : stream->fields) {
    source.numbers.Bind(row);
    if (source.attitude) source.attitude->Bind(row);
  }
}

std::vector<std::unique_ptr<StreamImport>> MakeImports(const ImportMap& map,
                                                       const std::vector<std::string>& files,
                                                       const std::optional<double>& fix_sigma,
                                                       FlightLog* log) {
  std::vector<std::unique_ptr<StreamImport>> imports;
  const auto frame = std::make_shared<LocalFrame>();  // geodetic positions share their origin
  ForEachStream(*log, [&](const Stream& stream, auto& samples) {
    const auto found = map.streams.find(stream.name);
    if (found == map.streams.end()) return;
    StreamMap own = found->second;
    for (FieldSource& source : own.fields) {
      if (fix_sigma && source.key == "sigma") source.numbers = NumberSource(*fix_sigma);
    }
    imports.push_back(std::make_unique<SampleImport<SampleOf<decltype(samples)>>>(
        stream, own, files[own.input], frame, &samples));
  });
  return imports;
}

}  // namespace trueline
