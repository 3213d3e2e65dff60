// A simulator's file, judged by flights of the vehicle.
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <tuple>

#include "problems/common/error.h"
#include "problems/simulators/audit.h"
#include "problems/simulators/flight_estimate.h"
#include "problems/simulators/judge_flights.h"

namespace trueline {
namespace {

const char* RotorDrag(const std::string& parameter) {
  return parameter == "K_z" ? "rotor_inflow" : "rotor_speed_drag";
}
// What acts as linear drag: its name, and what it acts by.
std::map<std::string, const char*> OtherDrag(const std::string& parameter) {
  return {{RotorDrag(parameter), "S_h"}, {std::string("c_") + parameter.back(), "v_m"}};
}

// rad/s, of a rotor.
double MeanSpeed(const FlightLog& log) {
  double sum = 0.0;
  for (const ChannelsSample& sample : log.rotors) {
    for (const double speed : sample.values)
      sum += speed / static_cast<double>(sample.values.size());
  }
  return sum / static_cast<double>(log.rotors.size());
}

// What the file states, by the names that flights are compared by; `at` becomes the place. None
// where it does not state it.
std::optional<double> StatedBy(const VehicleFile& file, const NeutralVehicle& flight,
                               const std::string& parameter, const Reading** at) {
  const NeutralVehicle& v = file.vehicle;
  *at = file.Find(parameter == "k_m/k_f" ? "k_m" : parameter);
  if (parameter[0] == 'K') {  // linear drag, or what acts as it in hover or at the flight's speed
    double drag = *at != nullptr ? (*at)->Beside(flight) : 0.0;
    for (const auto& [name, by] : OtherDrag(parameter)) {
      const Reading* other = file.Find(name);
      if (other == nullptr) continue;
      drag -= other->Beside(flight) * flight.Get(by);
      if (*at == nullptr || (*at)->number == 0.0) *at = other;
    }
    return *at != nullptr ? std::optional(drag) : std::nullopt;
  }
  // 0 where rotors count from it; levers alone state no centre.
  if (parameter.starts_with("r_BM") && (*at != nullptr || file.Find("x") != nullptr)) {
    return v.Get(parameter);
  }
  const bool by_speed = parameter == "k_f" || parameter == "full_speed";
  if (*at == nullptr || (by_speed && file.target->by_thrust)) return std::nullopt;
  return parameter == "k_m/k_f" ? v.Get("k_m") / v.Get("k_f") : v.Get(parameter);
}

// Of an I_z beside I_x and I_y.
bool PlausibleYaw(const NeutralVehicle& v, double inertia) {
  constexpr double kLeast = 0.55, kMost = 1.02;  // of the sum; a plate has 1
  const double share = inertia / (v.Get("I_x") + v.Get("I_y"));
  return share > kLeast && share < kMost;
}

// k_m / I_z: which of the two is wrong. A flight shows their ratio only.
struct YawBlame {
  bool inertia = false;        // I_z is wrong, k_m right
  bool both = false;           // no body has this I_z, and another one alone does not mend it
  bool could_be_both = false;  // either would do
  double usual = 0.0;          // kg m^2, I_z of a quadrotor with these I_x and I_y
};
YawBlame BlameForYaw(const NeutralVehicle& file, double flight_k_m, double file_k_m,
                     double flight_k_f, const NeutralVehicle& flight, bool roll_or_pitch_wrong) {
  const double others = flight.Get("I_x") + flight.Get("I_y");
  const double other_inertia = file.Get("I_z") * file_k_m / flight_k_m;
  const auto plausible = [&](double inertia) { return PlausibleYaw(flight, inertia); };
  const double moment = file_k_m / flight_k_f;
  const bool moment_plausible = moment > kLeastMoment && moment < kMostMoment;
  YawBlame blame;
  if (roll_or_pitch_wrong || !plausible(file.Get("I_z"))) {
    blame.inertia = plausible(other_inertia);
  }
  blame.both = !blame.inertia && !plausible(file.Get("I_z"));
  blame.usual = kUsualYawInertia * others;
  blame.could_be_both = !blame.inertia && moment_plausible && plausible(other_inertia);
  return blame;
}

bool StatesRatio(const VehicleFile& file) {
  return std::ranges::any_of(file.Find("k_m")->field->unit.with,
                             [](const auto& with) { return std::string(with.first) == "k_f"; });
}

// By the number that the file states: k_m, or its ratio to k_f. By the ratio, too, where commands
// instead of speeds were logged, which show no k_f.
bool JudgeMoment(const FlightJudge& judge, const VehicleFile& file, double stated_ratio,
                 const FlightValue& ratio, const FlightValue& thrust) {
  const Reading* at = file.Find("k_m");
  if (StatesRatio(file) || !thrust.shown || file.target->by_thrust) {
    return judge.Compare("k_m/k_f", stated_ratio, ratio, &file, at);
  }
  return judge.Compare("k_m", file.vehicle.Get("k_m"),
                       {ratio.value * thrust.value, ratio.sigma * thrust.value, true}, &file, at);
}

constexpr std::array kByFlight = {"k_f", "I_x", "I_y", "r_BM_x", "r_BM_y",
                                  "K_x", "K_y", "K_z", "tau",    "full_speed"};

// Height of the rotors above the centre of mass, where the file has drag act at them: air speed
// then turns the vehicle. Blades that flap do, too: only a height that is too large is named.
void JudgeHeight(const FlightJudge& judge, const VehicleFile& file, const NeutralVehicle& flight,
                 const std::map<std::string, FlightValue>& values) {
  const double stated = file.vehicle.CentreFromRotors(2);
  const Reading* drag = file.Find("rotor_speed_drag");
  if (stated == 0.0 || drag == nullptr || drag->number == 0.0) return;
  FlightValue height;
  for (const auto& [turn, by, inertia] : {std::tuple("L_v", "K_y", -flight.Get("I_x")),
                                          std::tuple("M_u", "K_x", flight.Get("I_y"))}) {
    const FlightValue &moment = values.at(turn), &force = values.at(by);
    if (!moment.shown || !force.shown || std::abs(force.value) < kThreshold * force.sigma) return;
    const double each = -inertia * moment.value / (flight.Get("m") * force.value);
    height.value += 0.5 * each;
    height.sigma +=
        0.5 * std::abs(each) * std::hypot(moment.sigma / moment.value, force.sigma / force.value);
  }
  if (stated < height.value) return;
  judge.Compare("r_BM_z", stated, height, &file, file.Find("r_BM_z"));
}

const Reading* ArmIn(const VehicleFile& file) {
  const Reading* at = nullptr;
  for (const char* name : {"arm", "lever", "lever_x", "x_M", "x"}) {
    if (at == nullptr) at = file.Find(name);
  }
  return at;
}

// The vehicle of the flight, and its values, with drag as it is at the rotors' speeds of hover
// where the file has it go with those: files are compared at them.
NeutralVehicle AtHover(const VehicleFile& file, NeutralVehicle flight,
                       std::map<std::string, FlightValue>* values) {
  const double mean = flight.Get("S_h");
  flight.body.erase("S_h");
  for (const char* name : {"K_x", "K_y", "K_z"}) {
    if (file.Find(name) != nullptr || file.Find(RotorDrag(name)) == nullptr) continue;
    const double share = flight.Get("S_h") / mean;
    ScaleValues({name}, share, values), flight.body[name] *= share;
  }
  return flight;
}

// All rotors the other way round, where the flight yaws against what their spins make; `start` gets
// its spins. Where nothing shows the order of the rotors, that may be what is another.
void TurnSpinsByFlight(const VehicleFile& file, const FlightLog& log, bool ordered,
                       NeutralVehicle* start, Audit* audit) {
  if (FitFirst(log, InLogOrder(*start, log)).correlation.z() > -kGoesTogether) return;
  for (Numbers& rotor : start->rotors) rotor["spin"] *= -1.0;
  if (!ordered) {
    audit->warnings.push_back(log.directory +
                              ": yaws against the file's spins, or its columns come in another "
                              "order; state the rotors in log.yaml");
    return;
  }
  AddSpin(
      &file, -start->Get("spin", 0),
      "the vehicle yaws against the spins: all rotors turn the other way, or its z axis is another",
      audit);
}

// Which column is which of the file's rotors, by log.yaml, else by the flight or by nothing.
void WarnOfOrder(const FlightLog& log, const NeutralVehicle& file, Audit* audit) {
  const std::vector<int> order = LogOrder(file, log);
  const bool stated = StatesRotors(log, file);
  // Beside the places that are taken.
  const RotorOrder turns = OrderByFlight(log, InLogOrder(file, log));
  if (stated && !std::ranges::is_sorted(turns.rotors)) {
    audit->warnings.push_back(fmt::format(
        "{}: turns as if its columns were the rotors {} of log.yaml: its rotors, or their axes, "
        "are others",
        log.directory, fmt::join(turns.rotors, ", ")));
  } else if (stated && !std::ranges::is_sorted(order)) {
    audit->warnings.push_back(fmt::format(
        "{}: its columns are the file's rotors {} by their places; commands in the log's order fly "
        "the simulator only if they are sorted so",
        log.directory, fmt::join(order, ", ")));
  } else if (!std::ranges::is_sorted(order)) {
    audit->warnings.push_back(fmt::format(
        "{}: turns as if its columns were the file's rotors {}, and is compared so; if the columns "
        "come in the file's order, the file's places or spins are wrong: state the rotors in "
        "log.yaml",
        log.directory, fmt::join(order, ", ")));
  } else if (!stated && !turns.shown) {
    audit->warnings.push_back(
        log.directory +
        ": does not show which rotor a column is; the file's order is taken; state the rotors in "
        "log.yaml");
  }
}

// Mass and places of rotors as log.yaml states them, else the file's: a flight shows neither, and
// the fit holds them. False where neither the log nor the flight shows the order of the rotors.
bool HoldWhatIsKnown(const VehicleFile& file, const FlightLog& log, NeutralVehicle* start,
                     Audit* audit) {
  if (!log.vehicle || !log.vehicle->mass) {
    audit->not_judged.push_back(NotShown("m", log));
  } else {
    if (CompareWithLog("m", start->Get("m"), *log.vehicle->mass, "the mass", audit)) {
      Place(file, file.Find("m"), &audit->contradicted.back());
    }
    start->body["m"] = *log.vehicle->mass;
  }
  if (!StatesRotors(log, *start)) {
    const bool ordered = OrderByFlight(log, *start).shown;
    TurnSpinsByFlight(file, log, ordered, start, audit);
    return ordered;
  }
  CompareSpins(&file, log, LogOrder(*start, log), start, audit);
  const double arm = ArmOfRotors(log.vehicle->rotors);
  if (!(arm > 0.0) ||
      !CompareWithLog("arm", start->Get("arm"), arm, "the places of the rotors", audit)) {
    return true;
  }
  Place(file, ArmIn(file), &audit->contradicted.back());
  *start = With(*start, "arm", arm);
  return true;
}

void CorrectFile(const VehicleFile& file, const NeutralVehicle& flight, Audit* audit,
                 NeutralVehicle* after) {
  NeutralVehicle corrected = file.vehicle;
  std::vector<std::string> names;
  for (const Contradicted& entry : audit->contradicted) {
    if (!entry.flight_value) continue;
    std::string name = entry.parameter;
    if (name.starts_with("r_BM")) {
      corrected.body[name] += *entry.flight_value - entry.file_value;
    } else if (name.starts_with("K_") && file.Find(name) == nullptr) {
      for (const auto& [other, by] : OtherDrag(name)) {
        const Reading* reading = file.Find(other);
        if (reading == nullptr) continue;
        const double drag = other == "rotor_speed_drag"
                                ? 0.5 * (flight.Get("K_x") + flight.Get("K_y"))
                                : flight.Get(name);
        corrected.body[other] = reading->Beside(flight) * drag / entry.file_value;
        names.push_back(other);
      }
      continue;
    } else {
      corrected = With(corrected, name, *entry.flight_value);
    }
    names.push_back(name == "k_m/k_f" ? "k_m" : name);
  }
  const std::vector<std::string> texts = Corrected(file, corrected, names);
  std::vector<ParameterFile> files;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const std::filesystem::path& path = file.files[i]->path();
    audit->corrected.emplace_back(path.filename().string(), texts[i]);
    files.push_back(ParameterFile::Parse(path, texts[i]));
  }
  *after = file.target->tables ? corrected : ReadVehicleTexts(*file.target, files).vehicle;
}

// The flight's numbers together may predict worse than the file's, where the flight shows them
// roughly only.
void WarnOfWorse(Audit* audit) {
  constexpr double kWorse = 1.01;
  const double before = (*audit->before)[1], after = (*audit->after)[1];
  if (!(after > kWorse * before)) return;
  audit->warnings.push_back(
      fmt::format("the corrected file errs more on held-out flight than the file ({} for {} after "
                  "0.5 s): check its numbers by another flight",
                  ErrorInWords(after), ErrorInWords(before)));
}

// One file and the flights that judge it.
class FileByFlights {
 public:
  FileByFlights(const VehicleFile& file, const std::vector<FlightLog>& logs)
      : file_(file), logs_(logs), start_(file.vehicle), stated_(file.vehicle) {
    audit_.simulator = file.Name();
    ordered_ = HoldWhatIsKnown(file, logs.front(), &start_, &audit_);
    for (const FlightLog& log : logs) WarnOfOrder(log, start_, &audit_);
    flights_ = Estimates(logs, start_, &audit_);
    values_ = Together(flights_);
  }

  Audit Run() {
    const Reading* at = nullptr;
    const std::optional<double> ratio = StatedBy(file_, start_, "k_m/k_f", &at);
    JudgeMass();
    const bool by_arm = JudgeArm(ratio.value_or(NAN));
    JudgeHeight(Judge(), file_, flights_.front().vehicle, values_);
    flight_ = AtHover(file_, flights_.front().vehicle, &values_);
    const bool turns_wrong = JudgeNumbers(by_arm);
    if (ratio && values_["k_m/k_f"].shown) JudgeYaw(*ratio, by_arm, turns_wrong);
    const bool has_drag = StatedBy(file_, flight_, "K_x", &at).value_or(0.0) != 0.0;
    AddLacks(values_, has_drag, stated_.States("tau"), &audit_);
    const std::vector<Contradicted> of_itself = CheckVehicle(file_);
    LeaveToFile(of_itself);
    AddFindingsOfFile(of_itself, Prove());
    AddNotJudged();
    JudgeOnce(&audit_);
    return audit_;
  }

 private:
  FlightJudge Judge() { return {&audit_, flights_, start_.Get("arm"), logs_.front()}; }

  double OneFactor(const std::vector<std::string>& names, const std::vector<std::string>& others) {
    return Judge().OneFactor(
        names, others, [&](const std::string& name) { return stated_.Get(name); }, values_);
  }

  // Names one number, stated at `at`, that is wrong instead of `others`. True if it is.
  bool NameOne(const char* name, double factor, const Reading* at,
               const std::vector<std::string>& others, const std::string& remedy) {
    const FlightValue &x = values_["I_x"], &y = values_["I_y"];
    const double in_file = stated_.Get(name), value = factor * in_file;
    const double sigma = 0.5 * value * std::hypot(x.sigma / x.value, y.sigma / y.value);
    if (!Judge().Compare(name, in_file, {value, sigma, true}, &file_, at)) return false;
    audit_.contradicted.back().confused_with = others;
    audit_.contradicted.back().text += remedy;
    return true;
  }

  void ScaleFlights(std::initializer_list<const char*> names, double factor) {
    for (FlightEstimate& flight : flights_) {
      for (const char* name : names) {
        flight.vehicle.body[name] *= factor, flight.constants[FindRotorConstant(name)] *= factor;
      }
    }
  }

  // A flight shows k_f / m, and k_f times the arm over I_x and over I_y. Where k_f, I_x and I_y are
  // off by one factor and nobody has weighed the vehicle, one number explains it: the mass. The
  // flights then get it.
  void JudgeMass() {
    const FlightLog& log = logs_.front();
    const bool known = (log.vehicle && log.vehicle->mass) || file_.target->by_thrust;
    const double mass = OneFactor({"k_f"}, {"I_x", "I_y"});
    const bool is_mass =
        !known && mass != 1.0 &&
        NameOne("m", mass, file_.Find("m"), {"k_f", "I_x", "I_y"},
                "; or k_f, I_x and I_y by the inverse: state the weighed mass in log.yaml");
    if (!is_mass) return;
    ScaleValues({"k_f", "I_x", "I_y"}, mass, &values_);
    ScaleValues({"k_m/k_f"}, 1.0 / mass, &values_);
    ScaleFlights({"m", "I_x", "I_y", "I_z"}, mass);
    for (FlightEstimate& flight : flights_) {
      for (Numbers& rotor : flight.vehicle.rotors) rotor["k_f"] *= mass, rotor["k_m"] *= mass;
      flight.fitted_moment *= mass;
    }
  }

  // Where I_x and I_y are off by one factor, and yaw, where no arm acts, is not: the arm. The
  // flights then get it. True where it is not told whether the arm is wrong or I_x and I_y.
  bool JudgeArm(double stated_ratio) {
    const FlightValue& yaw = values_["k_m/k_f"];
    const double arm = OneFactor({"I_x", "I_y"}, {});
    const bool by_inertia = yaw.shown && !Judge().Differs("k_m/k_f", arm * stated_ratio, yaw);
    if (StatesRotors(logs_.front(), stated_) || arm == 1.0 || by_inertia) return false;
    if (!yaw.shown || !PlausibleYaw(stated_, stated_.Get("I_z")) ||
        Judge().Differs("k_m/k_f", stated_ratio, yaw) ||
        !NameOne("arm", arm, ArmIn(file_), {"I_x", "I_y"},
                 "; or I_x and I_y by the inverse: state the places of the rotors in log.yaml")) {
      return true;
    }
    ScaleValues({"I_x", "I_y"}, arm, &values_);
    for (FlightEstimate& flight : flights_) {
      flight.vehicle = With(flight.vehicle, "arm", arm * stated_.Get("arm"));
    }
    ScaleFlights({"I_x", "I_y"}, arm);
    return false;
  }

  // True where I_x or I_y is wrong.
  bool JudgeNumbers(bool by_arm) {
    bool turns_wrong = false;
    for (const char* name : kByFlight) {
      if (!JudgeNumber(name) || name[0] != 'I') continue;
      turns_wrong = true;
      if (!by_arm) continue;
      audit_.contradicted.back().confused_with = {"arm"};
      audit_.contradicted.back().text +=
          "; or the arm by the inverse: state the places of the rotors in log.yaml";
    }
    return turns_wrong;
  }

  // True if the flights contradict the number.
  bool JudgeNumber(const std::string& parameter) {
    const Reading* at = nullptr;
    const std::optional<double> value = StatedBy(file_, flight_, parameter, &at);
    if (!value) return false;
    const auto shown = values_.find(parameter);
    // Along which axis the centre of mass is off is known by the order of the rotors only.
    if (parameter.starts_with("r_BM") && !ordered_) {
      audit_.not_judged.push_back({parameter, "state the rotors in log.yaml"});
      return false;
    }
    if (shown == values_.end() || !shown->second.shown) {
      audit_.not_judged.push_back(NotShown(parameter, logs_.front()));
      return false;
    }
    // A file that knows no drag lacks the effect; its zero is no wrong number.
    if (parameter[0] == 'K' && *value == 0.0) return false;
    double from_file = *value;
    const FlightValue& by_flight = shown->second;
    if (parameter == "tau") {  // of lags up and down the flight shows what lies between
      const auto [low, high] = std::minmax({from_file, stated_.Get("tau_down")});
      if (by_flight.value > low && by_flight.value < high) {
        audit_.compared.push_back(
            {parameter, "s", *value, by_flight.value, by_flight.sigma, high - low, false});
        return false;
      }
      from_file = std::clamp(by_flight.value, low, high);
    }
    return Judge().Compare(parameter, from_file, by_flight, &file_, at);
  }

  // k_m, or I_z, of which a flight shows the ratio. `ratio`: k_m / k_f as stated.
  void JudgeYaw(double ratio, bool by_arm, bool turns_wrong) {
    FlightValue value = values_["k_m/k_f"];
    const double k_f = flight_.Get("k_f"), in_file = stated_.Get("I_z");
    const Reading* at = file_.Find("I_z");
    // Beside inertia that may be right with another arm no I_z looks right.
    YawBlame blame;
    if (!by_arm) {
      blame = BlameForYaw(stated_, value.value * k_f, ratio * k_f, k_f, flight_, turns_wrong);
    }
    if (blame.inertia) {
      const double inertia = in_file * ratio / value.value;
      Judge().Compare("I_z", in_file, {inertia, inertia * value.sigma / value.value, true}, &file_,
                      at);
      return;
    }
    if (blame.both) {
      const double sigma =
          std::hypot(kShapeSigma * blame.usual,
                     kUsualYawInertia * (values_["I_x"].sigma + values_["I_y"].sigma));
      Judge().Compare("I_z", in_file, {blame.usual, sigma, true}, &file_, at);
      value.value *= blame.usual / in_file;
      value.sigma =
          std::hypot(value.sigma * blame.usual / in_file, sigma / blame.usual * value.value);
    }
    if (!JudgeMoment(Judge(), file_, ratio, value, values_["k_f"])) return;
    Contradicted& moment = audit_.contradicted.back();
    if (blame.could_be_both) {
      moment.confused_with = {"I_z"};
      moment.text += "; or I_z by the inverse: a flight shows their ratio";
    }
    if (moment.parameter == "k_m/k_f" && !StatesRatio(file_)) {
      moment.confused_with.emplace_back("k_f");
      moment.text += "; or k_f by the inverse: commands do not show it";
    }
  }

  // A flight that shows a number roughly only leaves it to the file.
  bool IsRough(const std::string& name) const { return Names(audit_.not_judged, name); }
  bool IsJudged(const std::string& name) const {
    return std::ranges::any_of(audit_.compared, [&](const Compared& c) {
      if (IsRough(c.parameter)) return false;
      if (c.parameter.starts_with("k_m")) return name == "k_m" || name == "I_z";
      if (c.parameter[0] != 'K') return c.parameter == name;
      return name == "K" || c.parameter == name || OtherDrag(c.parameter).contains(name);
    });
  }

  // What may as well be an error of another number is that where the file names it. Drag is stated
  // for each kg: where the file's mass is none that a vehicle has, a flight does not judge it.
  void LeaveToFile(const std::vector<Contradicted>& of_itself) {
    const bool by_mass = Names(of_itself, "m") && !IsJudged("m");
    std::erase_if(audit_.contradicted, [&](const Contradicted& entry) {
      if (by_mass && entry.parameter.starts_with("K_")) {
        audit_.not_judged.push_back({entry.parameter, "state the weighed mass in the log"});
        return true;
      }
      return std::ranges::any_of(of_itself, [&](const Contradicted& finding) {
        return !IsJudged(finding.parameter) &&
               std::ranges::find(entry.confused_with, finding.parameter) !=
                   entry.confused_with.end();
      });
    });
  }

  // The corrected vehicle, and what the numbers cost in prediction.
  NeutralVehicle Prove() {
    Judge().AddCosts();
    NeutralVehicle corrected;
    CorrectFile(file_, flight_, &audit_, &corrected);
    audit_.before = ProofOf(stated_, flights_, logs_, audit_);
    audit_.after = ProofOf(corrected, flights_, logs_, audit_);
    WarnOfWorse(&audit_);
    return corrected;
  }

  // What the file says of itself counts where no flight has judged it, and comes first; what
  // follows from an error that the flights have named does not count.
  void AddFindingsOfFile(const std::vector<Contradicted>& of_itself,
                         const NeutralVehicle& corrected) {
    const auto with = [&](const NeutralVehicle& vehicle) {
      VehicleFile changed = file_;
      changed.vehicle = vehicle;
      return CheckVehicle(changed);
    };
    const std::vector<Contradicted> left = with(corrected);
    std::vector<Contradicted> by_file;
    for (const Contradicted& finding : of_itself) {
      const std::string& name = finding.parameter;
      if (IsJudged(name) || !Names(left, name) || Names(audit_.contradicted, name)) continue;
      const auto rough = std::ranges::find(audit_.compared, name, &Compared::parameter);
      const bool is_rough = rough != audit_.compared.end();
      // A range that the flight's own number leaves, too, shows no error. A rough size is better
      // than none.
      if (is_rough && Names(with(With(stated_, name, rough->flight_value)), name)) continue;
      by_file.push_back(finding);
      if (!is_rough) continue;
      by_file.back().flight_value = rough->flight_value, by_file.back().sigma = rough->sigma;
    }
    audit_.contradicted.insert(audit_.contradicted.begin(), by_file.begin(), by_file.end());
  }

  void AddNotJudged() {
    const auto is_stated = [&](const char* name) {
      const Reading* reading = file_.Find(name);
      return reading != nullptr && reading->number != 0.0;
    };
    for (const NeutralInfo& info : kNeutral) {
      if (!is_stated(info.name) || IsJudged(info.name) || IsRough(info.name)) continue;
      audit_.not_judged.push_back(NotShown(info.name, logs_.front()));
    }
    for (const char* name : {"I_xy", "I_xz", "I_yz", "J_r", "damping", "quadratic_damping"}) {
      if (is_stated(name)) {
        audit_.not_judged.push_back({name, "no flight judges it against a file"});
      }
    }
  }

  const VehicleFile& file_;
  const std::vector<FlightLog>& logs_;
  NeutralVehicle start_;          // with what the log states; where fits start
  const NeutralVehicle& stated_;  // by the file
  bool ordered_ = false;          // which column is which rotor is known
  Audit audit_;
  std::vector<FlightEstimate> flights_;
  std::map<std::string, FlightValue> values_;
  NeutralVehicle flight_;  // that the file is compared with
};

}  // namespace

Audit AuditByFlights(const std::vector<VehicleFile>& files, const std::vector<FlightLog>& logs) {
  VehicleFile file = files.front();
  if (!file.vehicle.Flies()) {
    if (const auto bad = NotPositive(file)) {
      throw ErrorAt(
          bad->file, bad->line,
          fmt::format("{} = {:.4g} {}: {}", bad->parameter, bad->file_value, bad->unit, bad->text));
    }
    throw ErrorAt(
        file.files.front()->path().string(), 0,
        "states no whole vehicle (mass, inertia, and rotors with places and thrust); give "
        "its other files, too, after commas");
  }
  // A hover by the file's mass may be another.
  if (!logs.front().rotors.empty()) LineariseAt(MeanSpeed(logs.front()), &file);
  return FileByFlights(file, logs).Run();
}

}  // namespace trueline
