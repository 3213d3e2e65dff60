// Conversion of rows of a foreign file to samples of one native stream.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "problems/import/import_map.h"

namespace trueline {

// A stream that takes the rows of its file one after another.
class RowTaker {
 public:
  virtual ~RowTaker() = default;
  virtual void Bind(const ForeignCsv& csv) = 0;  // after the first row was read
  virtual void Take(const ForeignCsv& csv) = 0;
  virtual void Finish(std::vector<std::string>* warnings) = 0;  // after the last row
};

// The stamp of a row, in native time.
class StampReader {
 public:
  StampReader(const TimeSource& time, const std::string& file);
  void Bind(const ForeignCsv& csv) { time_.column.Bind(csv); }
  TimeNs Read(const ForeignCsv& csv) const;
  [[noreturn]] void FailUnsorted(const ForeignCsv& csv, TimeNs previous, TimeNs now) const;

 private:
  TimeSource time_;
  TimeNs offset_ = 0;
};

std::string LeftOut(const std::string& stream, std::size_t unsorted, std::size_t missing,
                    std::size_t out_of_range, std::size_t off_median);

// `bind` connects the stream's sources to the file; `convert` makes a sample of a row, or no value
// if a value is missing.
template <class Sample>
class StreamImport : public RowTaker {
 public:
  using BindSources = std::function<void(const ForeignCsv&)>;
  using Convert = std::function<std::optional<Sample>(const ForeignCsv&)>;

  StreamImport(std::string name, StreamMap map, const std::string& file, BindSources bind,
               Convert convert, std::vector<Sample>* samples)
      : name_(std::move(name)),
        map_(std::move(map)),
        stamps_(map_.time, file),
        bind_(std::move(bind)),
        convert_(std::move(convert)),
        samples_(samples) {}

  void Bind(const ForeignCsv& csv) override {
    stamps_.Bind(csv);
    map_.filter.Bind(csv);
    bind_(csv);
  }

  void Take(const ForeignCsv& csv) override {
    if (!map_.filter.Accepts(csv)) return;
    std::optional<Sample> sample = convert_(csv);
    if (!sample) {
      if (!map_.skip_missing) csv.FailMissing(name_);
      ++missing_;
      return;
    }
    sample->t = stamps_.Read(csv);
    if (!samples_->empty() && sample->t <= samples_->back().t) {
      if (!map_.drop_unsorted) stamps_.FailUnsorted(csv, samples_->back().t, sample->t);
      ++unsorted_;
      return;
    }
    map_.filter.Remember(csv);
    samples_->push_back(std::move(*sample));
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
        LeftOut(name_, unsorted_, missing_, static_cast<std::size_t>(map_.filter.out_of_range()),
                off_median);
    if (!text.empty()) warnings->push_back(text);
  }

 private:
  std::string name_;
  StreamMap map_;
  StampReader stamps_;
  BindSources bind_;
  Convert convert_;
  std::vector<Sample>* samples_;
  std::size_t missing_ = 0;
  std::size_t unsorted_ = 0;
};

}  // namespace trueline
