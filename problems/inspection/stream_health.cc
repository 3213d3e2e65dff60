#include "problems/inspection/stream_health.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>

#include "problems/import/shared_stamps.h"
#include "problems/inspection/clear.h"
#include "problems/inspection/stuck.h"
#include "problems/log/imu_health.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr double kSpikeSigmas = 15.0;
constexpr double kRareSpikes = 0.005;    // share: more often is no spike but vibration
constexpr double kUsualVibration = 5.0;  // m/s^2
constexpr double kMostLostSpeed = 0.01;  // of the mean speed

struct Spikes {
  int count = 0;
  double largest = 0.0;
};

// Samples that stand apart from the two on either side by many sigmas and by `least` of the middle
// of these.
template <class LeastAt>
Spikes FindSpikes(const std::vector<double>& values, const LeastAt& least) {
  if (values.size() < 50) return {};
  std::vector<double> off(values.size(), 0.0);
  for (std::size_t i = 2; i + 2 < values.size(); ++i) {
    std::array<double, 4> around = {values[i - 2], values[i - 1], values[i + 1], values[i + 2]};
    std::sort(around.begin(), around.end());
    const double middle = 0.5 * (around[1] + around[2]);
    off[i] = values[i] - middle;
    if (std::abs(off[i]) <= least(middle)) off[i] = 0.0;
    // Beyond all of its neighbours, and these near each other.
    if (std::abs(off[i]) < 3.0 * (around[3] - around[0])) off[i] = 0.0;
  }
  std::vector<double> steps;
  for (std::size_t i = 1; i < values.size(); ++i) steps.push_back(values[i] - values[i - 1]);
  const double limit = kSpikeSigmas * SigmaByMedian(steps);
  Spikes spikes;
  for (const double o : off) {
    if (std::abs(o) <= limit) continue;
    ++spikes.count;
    spikes.largest = std::max(spikes.largest, std::abs(o));
  }
  return spikes.count < kRareSpikes * static_cast<double>(values.size()) ? spikes : Spikes();
}

Spikes FindSpikes(const std::vector<double>& values, double least) {
  return FindSpikes(values, [least](double) { return least; });
}

template <class Sample>
StreamHealth TimingOf(const Stream& stream, const std::vector<Sample>& samples,
                      std::optional<TimeNs> jump) {
  StreamHealth health;
  health.stream = stream.name;
  health.count = samples.size();
  std::vector<double> steps;
  std::size_t repeats = 0;
  std::vector<double> before;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    std::vector<double> now = NumbersOf(stream, samples[i]);
    if (i > 0 && samples[i].t != jump) {
      steps.push_back(SecondsBetween(samples[i - 1].t, samples[i].t));
    }
    repeats += i > 0 && now == before;
    before = std::move(now);
  }
  if (steps.empty()) return health;
  const double step = LowerMedian(steps);
  health.rate = step > 0.0 ? 1.0 / step : 0.0;
  health.jitter = SigmaByMedian(steps);
  health.repeats = static_cast<double>(repeats) / static_cast<double>(steps.size());
  for (const double s : steps) {
    if (s <= kLongStep * step) continue;
    ++health.gaps;
    health.lost += s;
    health.longest = std::max(health.longest, s);
  }
  return health;
}

template <class Sample>
int PositionSpikes(const std::vector<Sample>& samples) {
  int most = 0;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Sample& sample : samples) values.push_back(sample.p_E[axis]);
    most = std::max(most, FindSpikes(values, 0.1).count);
  }
  return most;
}

// Spikes of the rotor that has most of them.
struct RotorSpikes {
  std::size_t rotor = 0;  // from 0
  Spikes spikes;
};

RotorSpikes SpikesOfRotors(const std::vector<ChannelsSample>& samples) {
  RotorSpikes most;
  for (std::size_t k = 0; k < samples.front().values.size(); ++k) {
    std::vector<double> values;
    for (const ChannelsSample& sample : samples) values.push_back(sample.values[k]);
    // What stands still drives nothing, and motors take longer than one sample to change so.
    const double turning = kLittle * Quantile(values, 0.9);
    const Spikes spikes = FindSpikes(values, [turning](double speed) {
      return speed > turning ? kLittle * speed : std::numeric_limits<double>::infinity();
    });
    if (spikes.count > most.spikes.count) most = {k, spikes};
  }
  return most;
}

// Of the mean speed: rms error of a straight line between samples. Where every second sample is
// left out the line errs by four times as much, if the speeds are smooth; these samples show it.
double LostBetweenSamples(const std::vector<ChannelsSample>& samples, double step) {
  double squares = 0.0, mean = 0.0, n = 0.0;
  for (std::size_t i = 1; i + 1 < samples.size(); ++i) {
    const ChannelsSample &before = samples[i - 1], &now = samples[i], &after = samples[i + 1];
    const double span = SecondsBetween(before.t, after.t);
    if (!(span > 0.0) || span > 3.0 * step) continue;
    const double share = SecondsBetween(before.t, now.t) / span;
    for (std::size_t k = 0; k < now.values.size(); ++k) {
      const double line = (1.0 - share) * before.values[k] + share * after.values[k];
      squares += std::pow(now.values[k] - line, 2);
      mean += now.values[k];
      n += 1.0;
    }
  }
  return mean > 0.0 ? 0.25 * std::sqrt(squares * n) / mean : 0.0;
}

void AddAxes(const std::vector<ImuSample>& imu, StreamHealth* health) {
  for (std::size_t axis = 0; axis < kImuAxes.size(); ++axis) {
    const SensorSizes& sizes = axis < 3 ? kAccelerometer : kGyroscope;
    std::vector<double> values;
    for (const ImuSample& sample : imu) values.push_back(AxisValue(sample, axis));
    const Spikes spikes = FindSpikes(values, sizes.spike);
    health->axes.push_back({kImuAxes[axis], QuantumOf(values), spikes.count, spikes.largest,
                            NoiseOf(WelchSpectrum(values, health->rate), sizes.quiet)});
  }
}

class HealthFindings {
 public:
  HealthFindings(const FlightLog& log, std::vector<Finding>* findings)
      : log_(log), findings_(findings) {}

  void Timing(const StreamHealth& h) {
    const bool imu = h.stream == "imu";
    if (imu && h.rate < kUsualImuRate) {
      Add(fault::kImuSlow, h, h.rate < kLeastImuRate ? Level::kFatal : Level::kWidens, h.rate,
          fmt::format("the IMU is logged at {:.3g} Hz; {}", h.rate,
                      h.rate < kLeastImuRate ? "no manoeuvre can be integrated"
                                             : "fast manoeuvres are integrated poorly"),
          "log it at 100 Hz or more");
    }
    if (imu && h.rate > kFastestImuRate) {
      Add(fault::kImuFast, h, Level::kFatal, h.rate,
          fmt::format("the IMU is logged at {:.3g} Hz, faster than any sensor: its stamps are not "
                      "in the unit that is stated",
                      h.rate),
          "state the `unit` of its time; days, as a spreadsheet counts them, have `scale: 86400`");
    }
    if (h.stream != "fixes" && h.rate > 0.0 && h.jitter > kLittle / h.rate) {
      Add(fault::kJitter, h, imu || h.stream == "attitude" ? Level::kWidens : Level::kNote,
          h.jitter,
          fmt::format("the steps between stamps scatter by {:.1f} ms about {:.1f} ms",
                      1e3 * h.jitter, 1e3 / h.rate),
          "log the time of measurement, not that of arrival");
    }
    const double span = log_.imu.empty() ? static_cast<double>(h.count) / h.rate + h.lost
                                         : SecondsBetween(log_.imu.front().t, log_.imu.back().t);
    const bool drives = h.stream == "rotors" || h.stream == "motors";
    const bool long_gap = h.longest > kHarmless;
    if (h.gaps > 0 && (imu || h.stream == "attitude" || (drives && long_gap))) {
      Add(fault::kGaps, h, h.lost > 0.02 * span ? Level::kBiases : Level::kWidens, h.lost,
          fmt::format("gaps: {}, the longest {:.3f} s", h.gaps, h.longest),
          "log on a faster card or at a lower rate");
    }
    if (h.IsHeld()) {
      Add(fault::kRepeats, h, imu || h.stream == "fixes" ? Level::kBiases : Level::kWidens,
          h.repeats,
          fmt::format(
              "{:.0f} % of the samples repeat the one before: the sensor is slower than the "
              "{:.0f} Hz of its stamps, which are late by up to a held sample",
              100.0 * h.repeats, h.rate),
          "keep the rows where a value changes (`new_where` in the map)");
      findings_->back().repaired = !imu;
    }
    if (h.spikes > 0 && !drives) {
      Add(fault::kSpikes, h, Level::kBiases, h.spikes,
          fmt::format("{} positions stand apart from those before and after", h.spikes),
          "leave them out (`accept: [{columns: [...], median: {window: 7, within: 0.1}}]`)");
    }
  }
  void Imu(const StreamHealth& h) {
    for (const Saturation& at : ImuSaturations(log_.imu)) {
      Add(fault::kSaturation, h, Level::kBiases, at.episodes.duration,
          fmt::format("{} stays at its extreme value {:.4g} {} times, {:.3f} s in all, first at "
                      "{:.3f} s",
                      at.axis, at.at, at.episodes.count, at.episodes.duration, at.episodes.first),
          "set a larger range of the sensor, or cut that part");
    }
    for (const AxisHealth& axis : h.axes) Axis(h, axis);
    for (std::size_t first : {0, 3}) DeadAxis(h, first);
  }
  // A rotor that never changes while the others do is not measured. One that is off in a test is.
  void DeadRotors(const StreamHealth& h, const std::vector<ChannelsSample>& samples) {
    const std::vector<std::size_t> still = StillChannels(samples);
    if (still.empty() || still.size() == samples.front().values.size()) return;
    for (const std::size_t k : still) {
      Add(fault::kDeadRotor, h, Level::kBiases, static_cast<double>(k + 1),
          fmt::format("rotor {} stays at {:.6g} for the whole log, while others change", k + 1,
                      samples.front().values[k]),
          "check the column of this rotor in the map");
    }
  }
  void SlowRotors(const StreamHealth& h, const std::vector<ChannelsSample>& samples) {
    // Motors take longer to change a speed than a step at an IMU's usual rate.
    if (h.stream != "rotors" || !(h.rate > 0.0) || h.rate >= kUsualImuRate) return;
    const double lost = LostBetweenSamples(samples, 1.0 / h.rate);
    if (lost < kMostLostSpeed) return;
    Add(fault::kRotorsSlow, h, Level::kBiases, lost,
        fmt::format("the speeds are logged at {:.3g} Hz and change between two samples: a straight "
                    "line errs by about {:.1f} % of the mean speed (rms)",
                    h.rate, 100.0 * lost),
        "log them at 100 Hz or more; the moments of inertia come out wrong otherwise");
  }
  // A model that is driven by rotors takes their speeds as they are.
  void SpikesOf(const StreamHealth& h, const RotorSpikes& most) {
    if (most.spikes.count == 0) return;
    Add(fault::kSpikes, h, Level::kBiases, most.spikes.count,
        fmt::format("{} samples of rotor {} stand apart from those before and after, by up to "
                    "{:.4g} rad/s: no motor changes so fast",
                    most.spikes.count, most.rotor + 1, most.spikes.largest),
        "leave them out (`accept: [{columns: [...], median: {window: 7, within: ...}}]`)");
  }
  void Stuck(const StreamHealth& h, const std::vector<StuckColumn>& columns) {
    for (const StuckColumn& stuck : columns) {
      Add(fault::kStuck, h, Level::kBiases, stuck.stretch.Seconds(),
          fmt::format("{} stays at {:.6g} for {} samples, {:.3f} to {:.3f} s, while the sensor's "
                      "other columns change",
                      stuck.column, stuck.value, stuck.count, ToSeconds(stuck.stretch.from),
                      ToSeconds(stuck.stretch.until)),
          "look at the sensor and the logger; cut that part of the flight");
    }
  }

 private:
  void Axis(const StreamHealth& h, const AxisHealth& axis) {
    const bool accel = axis.axis[0] == 'a';
    const SensorSizes& sizes = accel ? kAccelerometer : kGyroscope;
    if (axis.spikes > 0) {
      // Turn and thrust are integrated sample by sample; x and y of the accelerometer are robust
      // means.
      const bool harmful =
          axis.largest_spike / h.rate > sizes.harmful && (!accel || axis.axis == "az");
      Add(fault::kSpikes, h, harmful ? Level::kBiases : Level::kWidens, axis.spikes,
          fmt::format("{} samples of {} stand apart from those before and after, by up to {:.3g} "
                      "{}",
                      axis.spikes, axis.axis, axis.largest_spike, accel ? "m/s^2" : "rad/s"),
          "find out whether these are knocks of the vehicle or faults of the logger");
    }
    if (accel && axis.noise.vibration > kUsualVibration) {
      Add(fault::kVibration, h, Level::kWidens, axis.noise.vibration,
          fmt::format(
              "{} vibrates by {:.1f} m/s^2 (rms above 20 Hz){}", axis.axis, axis.noise.vibration,
              axis.noise.peak > 0.0 ? fmt::format(", most at {:.0f} Hz", axis.noise.peak) : ""),
          "mount the board more softly; balance the propellers");
    }
    if (axis.noise.cutoff > 0.0) {
      Add(fault::kFiltered, h, Level::kNote, axis.noise.cutoff,
          fmt::format("{} is filtered: above {:.0f} Hz less noise is left than any MEMS sensor "
                      "has ({:.1e} {}/sqrt(Hz))",
                      axis.axis, axis.noise.cutoff, axis.noise.density, accel ? "m/s^2" : "rad/s"),
          "log the samples before the filter; it delays them and hides vibration");
    }
  }
  // The three axes of a sensor are of one kind, so one of them without noise is not measured, or in
  // another unit. Too much noise may be vibration.
  void DeadAxis(const StreamHealth& h, std::size_t first) {
    for (std::size_t k = 0; k < 3; ++k) {
      const AxisHealth& axis = h.axes[first + k];
      const double others = std::min(h.axes[first + (k + 1) % 3].noise.density,
                                     h.axes[first + (k + 2) % 3].noise.density);
      if (!(axis.noise.density < kHardly * others)) continue;
      Add(fault::kDeadAxis, h, Level::kBiases, axis.noise.density / others,
          fmt::format("{} has {:.1g} times the noise of the sensor's other axes: it is in another "
                      "unit, or not measured",
                      axis.axis, axis.noise.density / others),
          "check the unit and the column of this axis");
    }
  }
  void Add(const FaultKind& kind, const StreamHealth& h, Level level, double size,
           const std::string& text, const char* remedy) {
    Finding finding{&kind, h.stream, level, size};
    finding.text = h.stream + ".csv: " + text;
    finding.remedy = remedy;
    findings_->push_back(finding);
  }

  const FlightLog& log_;
  std::vector<Finding>* findings_;
};

constexpr std::size_t kLongestWindow = 512;
constexpr double kVibration = 20.0;  // Hz, above which no vehicle's motion lies
constexpr double kLine = 10.0;       // of the density about it, for a line

double MedianOver(const Spectrum& spectrum, double from, double to) {
  std::vector<double> inside;
  for (std::size_t i = 0; i < spectrum.frequency.size(); ++i) {
    if (spectrum.frequency[i] >= from && spectrum.frequency[i] <= to) {
      inside.push_back(spectrum.density[i]);
    }
  }
  return inside.empty() ? 0.0 : LowerMedian(inside);
}

// The uppermost tenth of the band does not count: a sensor's own filter for the sampling ends
// there.
double CutoffOf(const Spectrum& spectrum, double quiet) {
  const double nyquist = spectrum.frequency.back();
  double cutoff = 0.0;
  for (std::size_t i = spectrum.frequency.size(); i-- > 0;) {
    if (spectrum.density[i] >= quiet * quiet) break;
    cutoff = spectrum.frequency[i];
  }
  return cutoff < 0.9 * nyquist ? cutoff : 0.0;
}

}  // namespace

bool StreamHealth::IsHeld() const {
  const bool is_sensor = stream == "imu" || stream == "attitude" || stream == "mocap" ||
                         stream == "pose" || stream == "fixes";
  return is_sensor && repeats > kLittle;
}

std::vector<StreamHealth> CheckStreams(const FlightLog& log, std::optional<TimeNs> jump,
                                       std::vector<Finding>* findings) {
  std::vector<StreamHealth> all;
  HealthFindings add(log, findings);
  ForEachStream(log, [&](const Stream& stream, const auto& samples) {
    if (samples.empty()) return;
    using Sample = SampleOf<decltype(samples)>;
    const bool imu = std::is_same_v<Sample, ImuSample>;
    StreamHealth health = TimingOf(stream, samples, imu ? jump : std::nullopt);
    if constexpr (requires(Sample s) { s.p_E; }) health.spikes = PositionSpikes(samples);
    if constexpr (std::is_same_v<Sample, ImuSample>) AddAxes(samples, &health);
    add.Timing(health);
    add.Stuck(health, FindStuck(ColumnsOf(stream, samples)));
    if constexpr (std::is_same_v<Sample, ImuSample>) add.Imu(health);
    if constexpr (std::is_same_v<Sample, ChannelsSample>) {
      if (health.stream == "rotors") {
        const RotorSpikes most = SpikesOfRotors(samples);
        health.spikes = most.spikes.count;
        add.SpikesOf(health, most);
      }
      add.SlowRotors(health, samples);
      add.DeadRotors(health, samples);
    }
    all.push_back(std::move(health));
  });
  return all;
}

Spectrum WelchSpectrum(const std::vector<double>& values, double rate) {
  std::size_t window = kLongestWindow;
  while (window > values.size()) window /= 2;
  if (window < kLongestWindow / 8) return {};
  Spectrum spectrum;
  spectrum.density.assign(window / 2 + 1, 0.0);
  for (std::size_t k = 0; k <= window / 2; ++k) {
    spectrum.frequency.push_back(static_cast<double>(k) * rate / static_cast<double>(window));
  }
  std::vector<double> hann(window);
  double power = 0.0;
  for (std::size_t i = 0; i < window; ++i) {
    hann[i] = 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * static_cast<double>(i) /
                                   static_cast<double>(window));
    power += hann[i] * hann[i];
  }
  Eigen::FFT<double> fft;
  std::vector<double> piece(window);
  std::vector<std::complex<double>> transform;
  int pieces = 0;
  for (std::size_t begin = 0; begin + window <= values.size(); begin += window / 2, ++pieces) {
    double mean = 0.0;
    for (std::size_t i = 0; i < window; ++i)
      mean += values[begin + i] / static_cast<double>(window);
    for (std::size_t i = 0; i < window; ++i) piece[i] = hann[i] * (values[begin + i] - mean);
    fft.fwd(transform, piece);
    for (std::size_t k = 0; k <= window / 2; ++k) {
      const double sides = k == 0 || k == window / 2 ? 1.0 : 2.0;
      spectrum.density[k] += sides * std::norm(transform[k]) / (rate * power);
    }
  }
  for (double& d : spectrum.density) d /= pieces;
  return spectrum;
}

Noise NoiseOf(const Spectrum& spectrum, double quiet) {
  Noise noise;
  if (spectrum.frequency.size() < 4) return noise;
  const double nyquist = spectrum.frequency.back(), bin = spectrum.frequency[1];
  noise.density = std::sqrt(MedianOver(spectrum, 0.5 * nyquist, nyquist));
  noise.cutoff = CutoffOf(spectrum, quiet);
  const double floor = MedianOver(spectrum, kVibration, nyquist);
  double highest = kLine * floor;
  for (std::size_t i = 0; i < spectrum.frequency.size(); ++i) {
    if (spectrum.frequency[i] < kVibration) continue;
    noise.vibration += bin * spectrum.density[i];
    if (spectrum.density[i] <= highest || spectrum.frequency[i] < 1.25 * kVibration) continue;
    highest = spectrum.density[i];
    noise.peak = spectrum.frequency[i];
  }
  noise.vibration = std::sqrt(noise.vibration);
  return noise;
}

}  // namespace trueline
