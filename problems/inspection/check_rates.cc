#include <algorithm>
#include <cmath>
#include <utility>

#include "problems/common/units.h"
#include "problems/inspection/clear.h"
#include "problems/inspection/examination.h"
#include "problems/inspection/force_fit.h"
#include "problems/inspection/position_witness.h"

namespace trueline {
namespace {

constexpr double kLeastRate = 0.05;    // rad/s
constexpr double kMostImuJump = 60.0;  // s

// A form of a stream's attitude.
struct Form {
  StreamRepair repair;
  std::string text;
};

std::vector<Form> QuaternionForms() {
  return {{{}, "as it is read"},
          {{.inverse = true}, "the inverse: the rotation from earth to body"},
          {{.quaternion = {3, 0, 1, 2}}, "x, y, z, w where w, x, y, z is read"},
          {{.quaternion = {1, 2, 3, 0}}, "w, x, y, z where x, y, z, w is read"},
          {{.quaternion = {3, 0, 1, 2}, .inverse = true},
           "x, y, z, w where w, x, y, z is read, and the inverse"},
          {{.quaternion = {1, 2, 3, 0}, .inverse = true},
           "w, x, y, z where x, y, z, w is read, and the inverse"}};
}

// Angles in any order, one of them of the other sign (two are other axes), the heading or the
// others in a unit of their own: deg read as rad, or where they hardly change rad read as deg.
std::vector<Form> AngleForms(const std::vector<AttitudeSample>& attitude,
                             const FileAttitude& file) {
  constexpr std::array<const char*, 3> kAngles = {"roll", "pitch", "yaw"};
  const Eigen::Quaterniond to_earth(file.axes.earth), to_body(file.axes.body);
  Eigen::Vector3d most = Eigen::Vector3d::Zero();
  for (const AttitudeSample& sample : attitude) {
    const auto angles = AnglesOf(to_earth.conjugate() * sample.q_Ep_I * to_body, file.form);
    most = most.cwiseMax(angles.cwiseAbs());
  }
  const auto other = [](double largest) {
    return largest < M_PI * kDegree ? 1.0 / kDegree : kDegree;
  };
  const double tilt = other(most.head<2>().maxCoeff()), yaw = other(0.5 * most.z());
  const std::array<Eigen::Vector3d, 3> units = {
      {{1.0, 1.0, 1.0}, {1.0, 1.0, yaw}, {tilt, tilt, 1.0}}};
  std::vector<Form> forms = {{{}, "as it is read"}};
  for (const std::string& order : AngleOrders()) {
    for (int flip = -1; flip < 3; ++flip) {
      for (const Eigen::Vector3d& unit : units) {
        Form form{{.angle_order = order, .angle_factor = unit}, "they turn in the order " + order};
        if (flip >= 0) {
          form.repair.angle_factor[flip] *= -1.0;
          form.text +=
              fmt::format(", {} of the other sign", kAngles[static_cast<std::size_t>(flip)]);
        }
        if (unit != units[0]) form.text += ", yaw in another unit than roll and pitch";
        forms.push_back(std::move(form));
      }
    }
  }
  return forms;
}

FileAttitude SourceOf(const Examination& e, const std::string& stream) {
  const auto own = e.sources.find(stream);
  return own == e.sources.end() ? FileAttitude{} : own->second;
}

std::vector<Form> FormsOf(const std::vector<AttitudeSample>& attitude, const FileAttitude& file) {
  if (file.HasAngles()) return AngleForms(attitude, file);
  std::vector<Form> forms = QuaternionForms();
  if (file.form == "matrix") forms.resize(2);
  return forms;
}

std::vector<AttitudeSample> InForm(const std::vector<AttitudeSample>& attitude, const Form& form,
                                   const FileAttitude& file) {
  std::vector<AttitudeSample> read = attitude;
  for (AttitudeSample& sample : read) sample.q_Ep_I = Reread(sample.q_Ep_I, form.repair, file);
  return read;
}

std::optional<VectorMatch> MatchAt(const RunningIntegral<3>& gyro,
                                   const std::vector<AttitudeTurn>& turns, double lag) {
  const PairsAt pairs = RatePairs(gyro, turns, false);
  return MatchVectors([&](double more) { return pairs(lag + more); }, {0.0});
}

// How well a form explains the rates; a form that needs no turn of axes and keeps gravity vertical
// is preferred.
struct FormTrial {
  Form form;
  double correlation, unturned, plain, gain;
  Eigen::Vector3d force;  // mean, in the attitude's earth

  // Share of it that points up or down.
  double upright() const { return force.norm() > 0.0 ? std::abs(force.z()) / force.norm() : 0.0; }
};

std::vector<FormTrial> TryForms(const Examination& e, const std::string& stream,
                                const std::vector<AttitudeSample>& attitude,
                                const RunningIntegral<3>& gyro, double lag) {
  const FileAttitude source = SourceOf(e, stream);
  std::vector<FormTrial> trials;
  for (const Form& form : FormsOf(attitude, source)) {
    std::vector<AttitudeSample> read = InForm(attitude, form, source);
    const VectorMatch match =
        MatchAt(gyro, TurnsOf(read, LogClock(e.fixed), kMostPairs), lag).value_or(VectorMatch{});
    for (AttitudeSample& sample : read) sample.t -= FromSeconds(lag);
    const auto force = MeanForceInEarth(e.fixed, read, 0.5);
    trials.push_back({form, match.correlation, match.unturned, match.plain, match.gain,
                      force.value_or(Eigen::Vector3d::Zero())});
  }
  return trials;
}

// Of angles: as read, unless another form explains much more. An angle of the other sign also looks
// like a mirrored gyroscope: then the mean force in earth axes, which is gravity, is the larger one
// by the right form.
const FormTrial& BestAngles(const std::vector<FormTrial>& trials) {
  const FormTrial& as_read = trials.front();
  const FormTrial* best = &as_read;
  for (const FormTrial& trial : trials) {
    // A larger unit of two angles only drowns the noise of the third.
    const bool is_size =
        std::abs(std::log(trial.gain)) < std::abs(std::log(as_read.gain)) + kOtherUnit;
    if (is_size && trial.correlation > kAlike && trial.unturned > best->unturned) best = &trial;
  }
  const double left = RestOf(best->unturned);
  if (left > kExplains * RestOf(as_read.unturned)) return as_read;
  if (RestOf(as_read.plain) < kExplains * left) return as_read;  // by other axes of the body
  best = &*std::find_if(trials.begin(), trials.end(), [&](const FormTrial& trial) {
    return RestOf(trial.unturned) <= left / kExplains;  // the usual forms come first
  });
  if (left < kExplains * RestOf(as_read.plain)) return *best;
  return best->force.norm() > as_read.force.norm() ? *best : as_read;
}

const FormTrial& BestQuaternion(const std::vector<FormTrial>& trials) {
  double best = 0.0, straight = 0.0;
  for (const FormTrial& trial : trials) {
    best = std::max(best, trial.correlation);
    if (trial.upright() > 0.7) straight = std::max(straight, trial.unturned);
  }
  const auto good = [&](const FormTrial& t) { return t.correlation > best - 2.0 * kClearly; };
  if (good(trials.front()) && trials.front().unturned > best - 4.0 * kClearly) {
    return trials.front();
  }
  // As read, other axes of the IMU explain more than any other form does without them.
  if (trials.front().plain > straight + 0.5 * kClearly && trials.front().upright() > 0.7) {
    return trials.front();
  }
  for (const FormTrial& trial : trials) {  // one that explains all without a turn
    if (straight > best - 4.0 * kClearly && trial.unturned > straight - kClearly &&
        trial.upright() > 0.7) {
      return trial;
    }
  }
  for (const FormTrial& trial : trials) {
    if (good(trial) && trial.upright() > 0.7) return trial;
  }
  return *std::find_if(trials.begin(), trials.end(), good);
}

void RepairForm(Examination* e, const std::string& stream, const FormTrial& as_read,
                const FormTrial& best) {
  const double size = best.correlation - as_read.unturned;
  const bool angles = SourceOf(*e, stream).HasAngles();
  e->AddRepaired(
      {angles ? &fault::kAngleForm : &fault::kQuaternionForm, stream, Level::kFatal, size,
       e->log.gravity},
      fmt::format(
          "the {0} of {1}.csv are in another form: {2}. So read, its turn rates agree with the "
          "gyroscope's to a correlation of {3:.3f}; as read, {4:.3f}",
          angles ? "angles" : "quaternions", stream, best.form.text, best.unturned,
          as_read.unturned),
      angles ? "state `order` and `scale` of `euler` so"
             : "give the columns in their order (and `inverse: true` where it says so)",
      best.form.repair);
}

void AddClock(Examination* e, const std::string& stream, const VectorMatch& match) {
  if (std::abs(match.lag) < kTurnClock.lag || std::abs(match.lag) < kShown * match.lag_sigma)
    return;
  const double error = e->log.gravity * match.seen_rms * std::min(1.0, std::abs(match.lag));
  AddClockOffset(
      e, match.lag,
      {.stream = stream,
       .level = LevelOfLag(match, error),
       .error = error,
       .sigma = match.lag_sigma},
      fmt::format("the turns of {}.csv come {} than those of the gyroscope{} (correlation {:.3f}, "
                  "as stamped {:.3f}): the clocks disagree{}",
                  stream, LateText(match.lag), OrElseText(match), match.correlation,
                  match.unshifted,
                  match.correlation < kSound ? ", or it is of another flight of such laps" : ""));
}

std::string NotShown(const VectorMatch& match) {
  if (match.seen_rms < kLeastRate) {
    return fmt::format("the vehicle turns by {:.3f} rad/s only", match.seen_rms);
  }
  if (match.correlation < kAlike) {
    return fmt::format("no lag within 5 s and no rotation makes them agree (correlation {:.2f})",
                       match.correlation);
  }
  return "";
}

void AddUnlike(Examination* e, const std::string& stream, const VectorMatch& match) {
  if (match.seen_rms < kMovingRate || match.correlation >= kMajority) return;
  e->Add(
      {&fault::kRatesDisagree, stream, Level::kFatal, match.correlation, e->log.gravity},
      fmt::format("{}.csv turns by {:.2f} rad/s (rms), and no lag within 5 s, no rotation and no "
                  "form of its quaternion makes it agree with the gyroscope (correlation {:.2f})",
                  stream, match.seen_rms, match.correlation),
      "check that both streams are of one flight and one vehicle, and that their clocks differ "
      "by less than 5 s and drift by less than 0.01 s/s");
}

// Another attitude that agrees with the gyroscope, although this one does at no lag: the fault is
// not in this one's clock. Null if there is none.
const RateWitness* WitnessAgainst(const Examination& e, const VectorMatch& match) {
  if (match.correlation >= kSound) return nullptr;
  const auto good = std::find_if(e.rates.begin(), e.rates.end(), [](const RateWitness& rate) {
    return rate.match.correlation > kGood;
  });
  return good == e.rates.end() ? nullptr : &*good;
}

void AddOtherFlight(Examination* e, const std::string& stream, const VectorMatch& match,
                    const RateWitness& good) {
  e->Add({&fault::kRatesDisagree, stream, Level::kFatal, match.correlation, e->log.gravity},
         fmt::format("the turns of {}.csv agree with the gyroscope's to a correlation of {:.2f} at "
                     "best ({}), those of {}.csv to {:.3f}: it is of another flight of such laps, "
                     "or badly tracked",
                     stream, match.correlation, LateText(match.lag), good.stream,
                     good.match.correlation),
         "check that both streams are of one flight; leave this one out of the map");
}

// Where an AHRS that follows acceleration explains as much as a lag or a turn of axes does: the
// attitude without its error, and the match with that.
std::optional<FollowingFit> ExplainedByFilter(Examination* e, const RunningIntegral<3>& gyro,
                                              const VectorMatch& match) {
  const bool late = std::abs(match.lag) > std::max(kTurnClock.lag, kShown * match.lag_sigma);
  if (!late && IsIdentity(PlainTurn(match, kOtherAxes))) return std::nullopt;
  if (e->fixed.attitude.empty() ||
      TurnBetween(match.turn, Eigen::Matrix3d::Identity()).norm() > kTurnByFilter)
    return std::nullopt;
  const LogClock clock(e->fixed);
  auto fit = FitFollowing(
      e->fixed, e->fixed.attitude,
      [&](const std::vector<AttitudeSample>& attitude) {
        return MatchAt(gyro, TurnsOf(attitude, clock, kMostPairs), 0.0);
      },
      &VectorMatch::unturned);
  if (!fit || RestOf(match.correlation) < kExplains * RestOf(fit->match.unturned)) {
    return std::nullopt;
  }
  e->result.notes.push_back(fmt::format(
      "the clock and the axes of attitude.csv against the gyroscope's: {} at best, turned by "
      "{:.1f} deg; a filter that takes acceleration for tilt with a gain of {:.2g} 1/s "
      "(ahrs_acceleration_error) explains as much",
      LateText(match.lag), TurnSize(match.turn), fit->gain));
  return fit;
}

// Reads the stream in the form that the gyroscope shows, where it is another one.
void CheckForm(Examination* e, const std::string& stream, const RunningIntegral<3>& gyro,
               double lag) {
  const auto trials = TryForms(*e, stream, AttitudesOf(e->fixed, stream), gyro, lag);
  const FormTrial& best =
      SourceOf(*e, stream).HasAngles() ? BestAngles(trials) : BestQuaternion(trials);
  if (&best != &trials.front()) RepairForm(e, stream, trials.front(), best);
}

void CheckStream(Examination* e, const std::string& stream, const RunningIntegral<3>& gyro) {
  if (AttitudesOf(e->fixed, stream).size() < kFewest) return;
  MotionComparison comparison{"turn rates against the gyroscope", stream, {}, {}};
  const LogClock clock(e->fixed);
  const auto match_of = [&](bool of_earth) {
    const auto turns = TurnsOf(AttitudesOf(e->fixed, stream), clock, kMostPairs);
    return MatchVectors(RatePairs(gyro, turns, of_earth), {});
  };
  const bool has_angles = SourceOf(*e, stream).HasAngles();
  auto match = match_of(false);
  if (has_angles) {  // of another form they show no lag
    CheckForm(e, stream, gyro, match && match->correlation > kSound ? match->lag : 0.0);
    match = match_of(false);
  }
  const auto as_inverse = match_of(true);
  if (as_inverse && match && as_inverse->correlation > match->correlation + 2.0 * kClearly) {
    match = as_inverse;
  }
  if (!match) {
    comparison.not_shown = "they share too little time at any lag within 5 s";
    e->result.comparisons.push_back(comparison);
    return;
  }
  const auto filter = stream == "attitude" ? ExplainedByFilter(e, gyro, *match) : std::nullopt;
  if (filter) match = filter->match;
  comparison.match = match;
  comparison.not_shown = NotShown(*match);
  if (!comparison.not_shown.empty()) {
    AddUnlike(e, stream, *match);
    e->result.comparisons.push_back(comparison);
    return;
  }
  if (!has_angles) CheckForm(e, stream, gyro, match->lag);
  if (const RateWitness* good = WitnessAgainst(*e, *match)) {
    AddOtherFlight(e, stream, *match, *good);
  } else {
    AddClock(e, stream, *match);
    AddClockDrift(e, stream, *match, "the gyroscope", kTurnClock.drift);
  }
  std::vector<AttitudeSample> attitude = AttitudesOf(e->fixed, stream);
  if (filter) attitude = WithoutFollowing(e->fixed, attitude, filter->gain);
  auto repaired = MatchVectors(RatePairs(gyro, TurnsOf(attitude, clock, kMostPairs), false), {0.0});
  if (repaired) {
    repaired->or_else = match->or_else;
    e->rates.push_back({stream, *repaired, PlainTurn(*repaired, kOtherAxes)});
    const VectorMatch as_recorded = *match;
    comparison.match = repaired;
    comparison.match->lag = as_recorded.lag;
    comparison.match->lag_sigma = as_recorded.lag_sigma;
    comparison.match->drift = as_recorded.drift;
    comparison.match->drift_sigma = as_recorded.drift_sigma;
    comparison.match->unshifted = as_recorded.unshifted;
  }
  e->result.comparisons.push_back(comparison);
}

// The longest step of the IMU's stamps: its index, and its length beyond an ordinary one (s).
struct Step {
  std::size_t after = 0;
  double seconds = 0.0;
};

Step LongestStep(const std::vector<ImuSample>& imu) {
  Step longest;
  for (std::size_t i = 1; i < imu.size(); ++i) {
    const double seconds = SecondsBetween(imu[i - 1].t, imu[i].t);
    if (seconds > longest.seconds) longest = {i, seconds};
  }
  return longest;
}

bool HasGap(const std::vector<AttitudeSample>& attitude, TimeNs from, TimeNs to) {
  for (std::size_t i = 1; i < attitude.size(); ++i) {
    if (attitude[i].t <= from || attitude[i - 1].t >= to) continue;
    if (SecondsBetween(attitude[i - 1].t, attitude[i].t) > kAttitudeGap) return true;
  }
  return false;
}

// Lag of one part of the turns alone.
std::optional<VectorMatch> MatchPart(const RunningIntegral<3>& gyro,
                                     std::vector<AttitudeTurn> turns, double from, double to,
                                     double reach) {
  std::erase_if(turns, [=](const AttitudeTurn& t) { return t.from < from || t.to > to; });
  auto match = MatchVectors(RatePairs(gyro, turns, false), {reach});
  if (match && match->correlation < kSound) match.reset();
  return match;
}

void AddImuJump(Examination* e, const std::string& through, const Step& step, double jump) {
  e->Add({&fault::kClockJump, "imu", Level::kFatal, jump, e->log.gravity},
         fmt::format("the clock of imu.csv jumps by {:.2f} s at {:.2f} s: {}.csv runs through, and "
                     "its turns come "
                     "{} after the jump than before; nothing is missing",
                     jump, ToSeconds(e->log.imu[step.after].t), through, LateText(-jump)),
         fmt::format("subtract {:.3f} s from the stamps of the IMU's clock after the jump, or "
                     "calibrate the parts "
                     "before and after it as flights of their own",
                     jump));
}

void StretchClock(double factor, FlightLog* log) {
  const TimeNs begin = log->imu.front().t;
  ForEachStream(*log, [&](const Stream&, auto& samples) {
    for (auto& sample : samples) {
      sample.t = begin + FromSeconds(factor * SecondsBetween(begin, sample.t));
    }
  });
}

}  // namespace

void AddClockOffset(Examination* e, double lag, Finding finding, const std::string& text) {
  finding.kind = &fault::kClockOffset;
  finding.size = lag;
  e->AddRepaired(std::move(finding), text,
                 fmt::format("add {:+.3f} s to its stamps (time: offset)", -lag),
                 {.time_offset = -lag});
}

void AddClockDrift(Examination* e, const std::string& stream, const VectorMatch& match,
                   const std::string& reference, double least) {
  if (std::isinf(match.drift_sigma)) {
    e->result.notes.push_back(
        fmt::format("whether the clock of {}.csv drifts against that of {}: too few parts of the "
                    "flight show how late it is",
                    stream, reference));
    return;
  }
  if (!(std::abs(match.drift) > std::max(least, kShown * match.drift_sigma))) return;
  const double span = SecondsBetween(e->log.imu.front().t, e->log.imu.back().t);
  const double error =
      e->log.gravity * match.seen_rms * std::min(1.0, std::abs(match.drift) * span);
  e->Add(
      {&fault::kClockDrift, stream, LevelOfError(error), match.drift, error, match.drift_sigma},
      fmt::format("the clock of {}.csv runs {:.0f} ms a minute {} than that of {}", stream,
                  6e4 * std::abs(match.drift), match.drift > 0.0 ? "faster" : "slower", reference),
      DriftRemedy(e->log, match.drift) + ", then inspect again");
  e->drifting.push_back(stream);
}

void FindCopies(Examination* e) {
  for (const char* stream : {"mocap", "pose"}) {
    if (RepeatsAttitude(e->log, AttitudesOf(e->log, stream))) e->copies.emplace_back(stream);
  }
}

std::optional<TimeNs> CheckImuJump(Examination* e) {
  const std::vector<ImuSample>& imu = e->log.imu;
  const Step step = LongestStep(imu);
  if (step.seconds < kNearLag || step.seconds > kMostImuJump) return std::nullopt;
  const RunningIntegral<3> gyro = GyroIntegral(e->log);
  const LogClock clock(e->log);
  const double at = clock(imu[step.after - 1].t), end = clock(imu.back().t);
  for (const char* stream : {"mocap", "pose"}) {
    const std::vector<AttitudeSample> attitude = AttitudesOf(e->log, stream);
    if (attitude.size() < kFewest || e->IsCopy(stream)) continue;
    if (HasGap(attitude, imu[step.after - 1].t, imu[step.after].t)) continue;
    const auto turns = TurnsOf(attitude, clock, 2 * kMostPairs);
    const auto before = MatchPart(gyro, turns, 0.0, at, kNearLag);
    const auto after = MatchPart(gyro, turns, at, end, step.seconds + kNearLag);
    if (!before || !after) continue;
    const double jump = before->lag - after->lag;
    if (std::abs(jump - step.seconds) > 0.1 * step.seconds) continue;
    AddImuJump(e, stream, step, jump);
    return imu[step.after].t;
  }
  return std::nullopt;
}

void CheckRates(Examination* e) {
  const RunningIntegral<3> gyro = GyroIntegral(e->fixed);
  for (const char* stream : {"attitude", "mocap", "pose"}) CheckStream(e, stream, gyro);
}

// Turn rates go with the inverse of the unit of time, accelerations with its square.
void CheckTimeScale(Examination* e) {
  if (!ReadsGravity(e->fixed)) return;  // the accelerometer's unit is another
  for (const char* stream : {"fixes", "mocap", "pose"}) {
    const auto witness = PositionWitnessOf(*e, stream);
    if (!witness) continue;
    const auto turns = MatchLongTurns(*e, witness->of_attitude);
    if (!turns || turns->correlation < kSound) continue;
    const double gain = turns->gain;
    if (std::abs(std::log(gain)) < kOtherUnit) continue;
    const auto scale = FitPositionScale(BodyForce(e->fixed, witness->attitude), witness->bends);
    const double square = 2.0 * std::log(gain);
    if (!scale || !(std::abs(std::log(scale->value) - square) < kOtherUnit * std::abs(square))) {
      continue;
    }
    e->Add(
        {&fault::kTimeScale, "imu", Level::kFatal, gain, e->log.gravity},
        fmt::format("the stamps of the whole log have another unit or rate: the turns of {} are "
                    "{:.3g} times "
                    "those of the gyroscope, and the accelerations of {} {:.3g} times those of the "
                    "accelerometer, which is about the square",
                    witness->of_attitude, gain, stream, scale->value),
        fmt::format(
            "multiply all stamps by {:.4g}: state the unit of the time, or its `scale`, in the map",
            gain));
    return StretchClock(gain, &e->fixed);
  }
}

}  // namespace trueline
