#include "problems/import/stream_import.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <GeographicLib/LocalCartesian.hpp>
#include <algorithm>
#include <array>
#include <cmath>

#include "problems/common/error.h"
#include "problems/common/units.h"
#include "problems/import/shared_stamps.h"
#include "problems/log/csv_text.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

// Geodetic positions (WGS 84) in a local frame.

// Of longitudes (deg), which may lie on both sides of the date line.
double MedianLongitude(const std::vector<Eigen::Vector3d>& positions) {
  double sine = 0.0, cosine = 0.0;
  for (const Eigen::Vector3d& position : positions) {
    sine += std::sin(kDegree * position.y());
    cosine += std::cos(kDegree * position.y());
  }
  const double mean = std::atan2(sine, cosine) / kDegree;
  std::vector<double> differences;
  for (const Eigen::Vector3d& position : positions) {
    differences.push_back(std::remainder(position.y() - mean, 360.0));
  }
  return mean + UpperMedian(differences);
}

double MedianLatitude(const std::vector<Eigen::Vector3d>& positions) {
  std::vector<double> latitudes;
  for (const Eigen::Vector3d& position : positions) latitudes.push_back(position.x());
  return UpperMedian(latitudes);
}

// North, east and down (m) at the first position that lies near the median of all: the plane
// tangential to the ellipsoid there, and not the curved surface, so that distances are right. A
// receiver's first fix may be thousands of km off.
class LocalFrame {
 public:
  // Whether there is such a place (deg). Receivers without a fix report zeros.
  static bool IsPlace(double latitude, double longitude) {
    return std::abs(latitude) <= 90.0 && std::abs(longitude) <= 360.0 &&
           (latitude != 0.0 || longitude != 0.0);
  }
  // Latitude and longitude (deg) and height (m) of each position, in the file's order, before the
  // first call of the functions below.
  void Add(const Eigen::Vector3d& position) { positions_.push_back(position); }

  Eigen::Vector3d ToNed(const Eigen::Vector3d& position) {
    if (!frame_) SetOrigin();
    double east = 0.0, north = 0.0, up = 0.0;
    frame_->Forward(position.x(), position.y(), position.z(), east, north, up);
    return {north, east, -up};
  }
  // Within 10 km of the median.
  bool IsNear(const Eigen::Vector3d& position) {
    constexpr double kNear = 1e4;  // m
    if (!median_) SetOrigin();
    Eigen::Vector3d away = Eigen::Vector3d::Zero();  // the chord's, without the height
    median_->Forward(position.x(), position.y(), 0.0, away.x(), away.y(), away.z());
    return away.norm() < kNear;
  }

 private:
  // On a flight so long that its median lies far from its path, the first position.
  void SetOrigin() {
    median_.emplace(MedianLatitude(positions_), MedianLongitude(positions_), 0.0);
    auto first = std::find_if(positions_.begin(), positions_.end(),
                              [&](const Eigen::Vector3d& p) { return IsNear(p); });
    if (first == positions_.end()) first = positions_.begin();
    frame_.emplace(first->x(), first->y(), first->z());
    positions_ = {};
  }

  std::vector<Eigen::Vector3d> positions_;
  std::optional<GeographicLib::LocalCartesian> frame_;   // none before the origin is set
  std::optional<GeographicLib::LocalCartesian> median_;  // likewise; at height zero
};

// In SI units. Reading a native log refuses twice as much, which leaves room for turned axes.
constexpr double kLargestNumber = 5e8;
// Of a recording's rows: as many are left out without being asked.
constexpr double kFewFaults = 0.01;

// Why a row can't become a sample; of several the last one counts.
enum class RowFault { kNone, kMissing, kSigma, kQuaternion, kBeyond };
constexpr std::size_t kRowFaults = 5;

// Archive that fills a sample from a row and the sources of its fields.
class RowConverter {
 public:
  RowConverter(const ForeignRow& row, const StreamMap& map, TimeNs time, double gravity,
               LocalFrame* frame)
      : row_(row), source_(map.fields.begin()), time_(time), gravity_(gravity), frame_(frame) {}

  void operator()(const Field&, Eigen::Vector3d& vector) {
    if (source_->series) {
      const std::optional<Eigen::Vector3d> value = source_->series->At(time_);
      if (!value) Add(RowFault::kMissing);
      if (value) vector = source_->axes * *value;
      ++source_;
      return;
    }
    const std::vector<double> numbers = Numbers();
    vector = source_->axes * Eigen::Map<const Eigen::Vector3d>(numbers.data());
    if (source_->geodetic && !LocalFrame::IsPlace(numbers[0], numbers[1])) Add(RowFault::kMissing);
    if (source_->geodetic) vector = Eigen::Vector3d(numbers.data());  // see GeodeticConverter
    if (source_->geodetic && fault_ == RowFault::kNone) frame_->Add(vector);
    if (source_->attitude) {
      const Eigen::Quaterniond to_body =
          Attitude().value_or(Eigen::Quaterniond::Identity()).conjugate();
      if (source_->in_earth) vector = to_body * vector;
      if (source_->without_gravity) vector -= to_body * Eigen::Vector3d(0.0, 0.0, gravity_);
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
    if (field.is_sigma && value < kLeastSigma) {
      Add(RowFault::kSigma, source_->numbers.index(),
          fmt::format("found {}; a standard deviation must be positive, {} m or more: correct it, "
                      "give 'sigma: {{constant: ...}}', or set 'skip_missing: true' in the map",
                      value, kLeastSigma));
    }
    ++source_;
  }
  void operator()(const Field& field, int& id) {
    double value = 0.0;
    (*this)(field, value);
    if (fault_ == RowFault::kNone) id = static_cast<int>(std::lround(value));
  }
  void operator()(const Field&, std::vector<double>& values) {
    values = Numbers();
    ++source_;
  }

  RowFault fault() const { return fault_; }
  // Whether the row has none of the stream's numbers, as where a table has rows of several streams.
  bool IsOfOthers() const { return fault_ == RowFault::kMissing && !has_any_; }
  // The error for the fault, with its place.
  InputError Error(const std::string& stream) const {
    if (fault_ == RowFault::kQuaternion) return attitude_->NormError(row_, norm_);
    return fault_ == RowFault::kMissing ? row_.MissingError(stream) : row_.ErrorIn(column_, why_);
  }

 private:
  // Of several faults of one kind the last one is told.
  void Add(RowFault fault, int column = -1, std::string why = "") {
    if (fault < fault_) return;
    fault_ = fault;
    column_ = column;
    why_ = std::move(why);
  }

  std::optional<Eigen::Quaterniond> Attitude() {
    std::optional<double> bad_norm;
    has_any_ = has_any_ || source_->attitude->HasAny(row_);
    auto value = source_->attitude->Value(row_, &bad_norm);
    if (!value) Add(bad_norm ? RowFault::kQuaternion : RowFault::kMissing);
    if (bad_norm) {
      norm_ = *bad_norm;
      attitude_ = &*source_->attitude;
    }
    return value;
  }

  std::vector<double> Numbers() {
    std::vector<double> values = source_->numbers.Values(row_);
    const bool is_constant = source_->numbers.Constant().has_value();
    for (std::size_t i = 0; i < values.size(); ++i) {
      has_any_ = has_any_ || (!is_constant && std::isfinite(values[i]));
      if (!std::isfinite(values[i])) {
        Add(RowFault::kMissing);
      } else if (std::abs(values[i]) > kLargestNumber) {
        Add(RowFault::kBeyond, source_->numbers.index(i),
            fmt::format("found {:.4g} in SI units, which is beyond anything that flies",
                        values[i]));
      }
    }
    return values;
  }

  const ForeignRow& row_;
  std::vector<FieldSource>::const_iterator source_;
  TimeNs time_;
  double gravity_;
  LocalFrame* frame_;
  RowFault fault_ = RowFault::kNone;
  bool has_any_ = false;
  int column_ = -1;  // of the fault, with its words
  std::string why_;
  const SourceAttitude* attitude_ = nullptr;  // of the quaternion that can't be
  double norm_ = 1.0;
};

// Archive that calls visit(source, vector) for the vectors of a sample and their sources.
template <class Visit>
struct VectorVisitor {
  std::vector<FieldSource>::const_iterator source;
  const Visit& visit;

  void operator()(const Field&, Eigen::Vector3d& vector) { visit(*source++, &vector); }
  void operator()(const Field&, auto&) { ++source; }
};
template <class Sample, class Visit>
void ForEachVector(const StreamMap& map, const Stream& stream, Sample* sample, const Visit& visit) {
  VectorVisitor<Visit> visitor{map.fields.begin(), visit};
  Sample::Describe(visitor, *sample, stream);
}

bool IsGeodetic(const StreamMap& map) {
  return std::any_of(map.fields.begin(), map.fields.end(),
                     [](const FieldSource& source) { return source.geodetic; });
}

// Where a position is: its time, in the local frame, and whether that is near the median.
struct TimedPlace {
  TimeNs t;
  Eigen::Vector3d p_E;
  bool is_near;
};

// Whether a place far from the median is reached by a speed that no vehicle has, from the nearest
// one in time that lies near it. `places` in the order of time.
std::vector<bool> StraysOf(const std::vector<TimedPlace>& places) {
  constexpr double kFastest = 1000.0;  // m/s
  std::vector<bool> strays(places.size(), false);
  for (const bool backwards : {false, true}) {
    const TimedPlace* near = nullptr;
    for (std::size_t k = 0; k < places.size(); ++k) {
      const std::size_t i = backwards ? places.size() - 1 - k : k;
      const TimedPlace& place = places[i];
      if (place.is_near) near = &place;
      if (near == nullptr) continue;
      const double seconds = std::abs(SecondsBetween(near->t, place.t));
      if ((place.p_E - near->p_E).norm() > kFastest * seconds) strays[i] = true;
    }
  }
  return strays;
}

// Keeps the samples i of which keep(i) holds. Returns how many are removed.
template <class Sample, class Keep>
std::size_t KeepOnly(const Keep& keep, std::vector<Sample>* samples) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < samples->size(); ++i) {
    if (!keep(i)) continue;
    // Numbers moved to themselves would be lost.
    if (kept != i) (*samples)[kept] = std::move((*samples)[i]);
    ++kept;
  }
  const std::size_t removed = samples->size() - kept;
  samples->resize(kept);
  return removed;
}

// The text "stream: rows left out: 3 of a kind, 5 of another".
class LeftOut {
 public:
  explicit LeftOut(const std::string& stream) : stream_(stream) {}

  // `first`: what is wrong with the first one, where that may be news.
  void Add(std::size_t count, const std::string& reason, const std::string& first = "") {
    if (count == 0) return;
    text_ += fmt::format("{} {} {}", text_.empty() ? "" : ",", count, reason);
    if (!first.empty()) text_ += fmt::format(" (the first: {})", first);
  }
  void WarnTo(std::vector<std::string>* warnings) const {
    if (text_.empty()) return;
    warnings->push_back(fmt::format("{}: rows left out:{}", stream_, text_));
  }

 private:
  std::string stream_, text_;
};

// Orders samples by time. A stamp more than a day from the median is a damaged one. Returns how
// many are removed.
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
  return before - samples->size();
}

template <class Sample>
class SampleImport : public StreamImport {
 public:
  SampleImport(const Stream& stream, const StreamMap& map, const std::string& file, double gravity,
               std::shared_ptr<LocalFrame> frame, std::map<std::string, std::string>* source,
               std::vector<Sample>* samples)
      : stream_(stream),
        map_(map),
        stamps_(map.time, file),
        gravity_(gravity),
        frame_(std::move(frame)),
        source_(source),
        samples_(samples) {}

  const StreamMap& map() const override { return map_; }

  void AddRow(const ForeignRow& row) override {
    if (!bound_) Bind(row);
    if (!map_.filter.Accepts(row)) return;
    Sample sample{};
    if (HasSeries()) sample.t = stamps_.Read(row);
    RowConverter converter(row, map_, sample.t, gravity_, frame_.get());
    Sample::Describe(converter, sample, stream_);
    if (converter.IsOfOthers() && !map_.skip_missing) {
      if (of_others_++ == 0) first_of_others_ = converter.Error(stream_.name).what();
      return;
    }
    if (converter.fault() != RowFault::kNone) return AddFault(converter);
    ++whole_;
    if (!HasSeries()) sample.t = stamps_.Read(row);
    if (IsLeftOut(sample.t)) {
      ++left_out_by_map_;
      return;
    }
    if (map_.unsorted != Unsorted::kSort && !samples_->empty() && sample.t < samples_->back().t) {
      if (map_.unsorted == Unsorted::kRefuse) {
        stamps_.FailUnsorted(row, samples_->back().t, sample.t);
      }
      ++unsorted_;
      return;
    }
    map_.filter.Remember(row);
    samples_->push_back(std::move(sample));
    places_.push_back(row.Place());
    unstamped_.push_back(map_.time.of_row && row.IsUnstamped());
    unstamped_count_ += unstamped_.back() ? 1 : 0;
  }

  std::size_t rows() const override { return places_.size(); }
  double Covered() const override {
    std::vector<TimeNs> stamps;
    for (const Sample& sample : *samples_) stamps.push_back(sample.t);
    return CoveredBy(std::move(stamps));
  }
  const char* name() const override { return stream_.name; }

  std::vector<ClockPart> Parts() const override {
    if (map_.unsorted != Unsorted::kSort) return {};
    std::vector<TimeNs> stamps;
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < places_.size(); ++i) {
      if (!IsKept(i)) continue;
      stamps.push_back((*samples_)[i].t);
      places.push_back(places_[i]);
    }
    return PartsByClock(stamps, places);
  }

  std::size_t Keep(const ClockPart& part) override {
    std::size_t left_out = 0;
    for (std::size_t i = 0; i < places_.size(); ++i) {
      const bool inside = places_[i] >= part.begin && places_[i] < part.end;
      left_out += IsKept(i) && !inside ? 1 : 0;
    }
    kept_ = kept_.value_or(part);
    kept_->begin = std::max(kept_->begin, part.begin);
    kept_->end = std::min(kept_->end, part.end);
    return left_out;
  }

  void Finish(std::vector<std::string>* warnings) override {
    RefuseManyFaults();
    std::vector<bool> mask = map_.filter.MedianMask();
    const auto off_median = static_cast<std::size_t>(std::count(mask.begin(), mask.end(), false));
    mask.resize(samples_->size(), true);
    KeepOnly([&](std::size_t i) { return mask[i] && IsKept(i); }, samples_);
    const std::size_t all = places_.size();
    places_ = {};
    const bool sort = map_.unsorted == Unsorted::kSort;
    if (sort) unsorted_ = Sort(samples_);
    const SharedStamps shared = SpreadShared(stream_, samples_);
    unsorted_ += shared.dropped;
    const std::size_t strays = IsGeodetic(map_) ? ToLocalFrame() : 0;
    if (IntegrateVelocities()) {
      warnings->push_back(fmt::format(
          "{}: there is no position; velocities are integrated to one, from (0, 0, 0) on: what "
          "depends on the place or on slow drift can't be judged",
          stream_.name));
    }
    LeftOut left_out(stream_.name);
    if (const std::string wraps = stamps_.WrapText(); !wraps.empty()) {
      warnings->push_back(fmt::format("{}: {}; that is undone", stream_.name, wraps));
    }
    if (shared.spread > 0) {
      warnings->push_back(fmt::format("{}: {}", stream_.name, SpreadText(shared.spread, all)));
    }
    State(shared.spread, unsorted_ + strays, all + (sort ? 0 : unsorted_));
    left_out.Add(left_out_by_map_, "of the times that the map leaves out");
    left_out.Add(shared.repeated, "that repeat the one before, stamp and all");
    AddUnstampedTo(all, &left_out, warnings);
    left_out.Add(strays,
                 "more than 10 km from the others, reached by a jump that no vehicle makes");
    left_out.Add(unsorted_,
                 sort ? "of the time of another, or of no possible time" : "that came too late");
    AddFaultsTo(&left_out);
    left_out.Add(static_cast<std::size_t>(map_.filter.out_of_range()), "out of range");
    left_out.Add(off_median, "far from the running median");
    left_out.WarnTo(warnings);
    for (const std::string& broken : map_.filter.BrokenExpectations()) {
      warnings->push_back(fmt::format("{}: {}", stream_.name, broken));
    }
  }

 private:
  bool IsLeftOut(TimeNs t) const {
    constexpr double kRounding = 1e-7;  // s
    return std::any_of(map_.leave_out.begin(), map_.leave_out.end(), [&](const auto& part) {
      return ToSeconds(t) > part[0] - kRounding && ToSeconds(t) < part[1] + kRounding;
    });
  }

  bool HasSeries() const {
    return std::any_of(map_.fields.begin(), map_.fields.end(),
                       [](const FieldSource& source) { return source.series != nullptr; });
  }

  void Bind(const ForeignRow& row) {
    stamps_.Bind(row);
    BindColumns(row, &map_);
    bound_ = true;
  }

  bool IsKept(std::size_t i) const {
    if (HasTwoClocks() && unstamped_[i] != TakesUnstamped()) return false;
    return !kept_ || (places_[i] >= kept_->begin && places_[i] < kept_->end);
  }

  // --- Rows without a time of measurement; they use the time of recording

  bool HasTwoClocks() const { return unstamped_count_ > 0 && unstamped_count_ < unstamped_.size(); }
  // Of two clocks, that of measurement, unless hardly a row has it.
  bool TakesUnstamped() const {
    constexpr std::size_t kFewStamped = 10;  // one row of so many
    return kFewStamped * (unstamped_.size() - unstamped_count_) < unstamped_.size();
  }
  void AddUnstampedTo(std::size_t all, LeftOut* left_out,
                      std::vector<std::string>* warnings) const {
    if (HasTwoClocks() && !TakesUnstamped()) {
      left_out->Add(unstamped_count_,
                    "whose time of measurement is not set, where that of others is");
    } else if (unstamped_count_ > 0) {
      left_out->Add(all - unstamped_count_,
                    "with a time of measurement, which nearly all others lack");
      warnings->push_back(fmt::format(
          "{}: {} rows have no time of measurement (their stamps are zero): they have the time of "
          "recording, which comes late; where that matters, shift them by 'time: {{offset: ...}}'",
          stream_.name, unstamped_count_));
    }
  }

  // Shares of the rows that inspection.h tells of, in the log's `source`.
  void State(std::size_t spread, std::size_t lost, std::size_t all) {
    for (const Faults& faults : faults_) lost += map_.skip_missing ? 0 : faults.count;
    const auto state = [&](const char* what, std::size_t count) {
      const double share = static_cast<double>(count) / static_cast<double>(std::max(all, count));
      if (count == 0 || share <= kFewFaults) return;
      (*source_)[fmt::format("{} {}", stream_.name, what)] = fmt::format("{:.3f}", share);
    };
    state(kSpreadShare, spread);
    state(kLostShare, lost);
  }

  // Returns how many samples are left out because their position is a receiver's error.
  std::size_t ToLocalFrame() {
    std::vector<TimedPlace> places;
    for (Sample& sample : *samples_) {
      Eigen::Vector3d position = Eigen::Vector3d::Zero();
      ForEachVector(map_, stream_, &sample, [&](const FieldSource& source, Eigen::Vector3d* v) {
        if (!source.geodetic) return;
        position = *v;
        *v = frame_->ToNed(position);
      });
      places.push_back({sample.t, frame_->ToNed(position), frame_->IsNear(position)});
    }
    const std::vector<bool> strays = StraysOf(places);
    return KeepOnly([&](std::size_t i) { return !strays[i]; }, samples_);
  }

  // Puts the integrals in the place of velocities. False where there are none.
  bool IntegrateVelocities() {
    bool any = false;
    Eigen::Vector3d position = Eigen::Vector3d::Zero(), before = position;
    TimeNs t = 0;
    for (Sample& sample : *samples_) {
      ForEachVector(map_, stream_, &sample, [&](const FieldSource& source, Eigen::Vector3d* v) {
        if (!source.is_velocity) return;
        if (any) position += 0.5 * SecondsBetween(t, sample.t) * (before + *v);
        before = std::exchange(*v, position);
        any = true;
      });
      t = sample.t;
    }
    return any;
  }

  // --- Rows that can't become samples

  struct Faults {
    std::size_t count = 0;
    std::string first;  // with its place
  };
  const Faults& Of(RowFault fault) const { return faults_[static_cast<std::size_t>(fault)]; }

  // A file made by hand can be repaired where it is wrong; a recording has damaged rows now and
  // then.
  void AddFault(const RowConverter& converter) {
    if (map_.channel.empty() && !map_.skip_missing) throw converter.Error(stream_.name);
    Faults& faults = faults_[static_cast<std::size_t>(converter.fault())];
    if (faults.count++ == 0) faults.first = converter.Error(stream_.name).what();
  }

  // Single rows are damaged; where many are so, the map is wrong or the log is.
  void RefuseManyFaults() const {
    const auto refuse_all = [](const std::string& first, std::size_t rows) {
      throw InputError(fmt::format(
          "{}; all {} rows lack values or have 'not a number': the sensor gave none, or the map "
          "names the wrong columns",
          first, rows));
    };
    if (whole_ == 0 && of_others_ > 0) refuse_all(first_of_others_, of_others_);
    const Faults& quaternions = Of(RowFault::kQuaternion);
    if (map_.skip_missing && quaternions.count > whole_) throw InputError(quaternions.first);
    std::size_t count = 0, all = whole_;
    const Faults* most = nullptr;
    for (const Faults& faults : faults_) {
      all += faults.count;
      const bool allowed = map_.skip_missing && &faults != &Of(RowFault::kBeyond);
      if (allowed || faults.count == 0) continue;
      count += faults.count;
      if (most == nullptr || faults.count > most->count) most = &faults;
    }
    if (static_cast<double>(count) <= kFewFaults * static_cast<double>(all)) return;
    if (count == all && most == &Of(RowFault::kMissing)) refuse_all(most->first, all);
    throw InputError(fmt::format("{}; {} of {} rows can't be used: {}", most->first, count, all,
                                 most == &Of(RowFault::kBeyond)
                                     ? "the log is damaged, or the map's 'unit' or 'scale' is wrong"
                                     : "repair the log, or leave them out by 'skip_missing: true' "
                                       "in the map"));
  }

  void AddFaultsTo(LeftOut* left_out) const {
    const Faults& missing = Of(RowFault::kMissing);
    const Faults& sigma = Of(RowFault::kSigma);
    const Faults& quaternion = Of(RowFault::kQuaternion);
    const Faults& beyond = Of(RowFault::kBeyond);
    const bool expected = map_.skip_missing;
    left_out->Add(of_others_, "with none of its values");
    left_out->Add(missing.count + sigma.count, "with missing values",
                  expected            ? ""
                  : missing.count > 0 ? missing.first
                                      : sigma.first);
    left_out->Add(quaternion.count, "with a quaternion whose norm is not 1",
                  expected ? "" : quaternion.first);
    left_out->Add(beyond.count, "with impossible values", beyond.first);
  }

  Stream stream_;
  StreamMap map_;
  StampReader stamps_;
  double gravity_;  // m/s^2
  std::shared_ptr<LocalFrame> frame_;
  std::map<std::string, std::string>* source_;  // of the log
  std::vector<Sample>* samples_;
  bool bound_ = false;
  std::size_t whole_ = 0;      // rows with all values
  std::size_t of_others_ = 0;  // rows with none
  std::string first_of_others_;
  std::array<Faults, kRowFaults> faults_;
  std::vector<std::size_t> places_;  // of the samples, in the file
  std::vector<bool> unstamped_;      // likewise
  std::size_t unstamped_count_ = 0;
  std::optional<ClockPart> kept_;  // of the file; none: all of it
  std::size_t unsorted_ = 0, left_out_by_map_ = 0;
};

}  // namespace

void BindColumns(const ForeignRow& row, StreamMap* stream) {
  if (!stream->time.of_row) stream->time.column.Bind(row);
  stream->filter.Bind(row);
  for (FieldSource& source : stream->fields) {
    if (!source.input) source.numbers.Bind(row);
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
        stream, own, files[own.input], map.gravity, frame, &log->source, &samples));
  });
  return imports;
}

}  // namespace trueline
