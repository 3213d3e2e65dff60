#include "problems/simulators/audit.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <tuple>

#include "problems/common/error.h"
#include "problems/simulators/describe_audit.h"
#include "problems/simulators/first_fit.h"
#include "problems/simulators/flight_terms.h"
#include "problems/simulators/judge_flights.h"

namespace trueline {
namespace {

constexpr double kShapeSigma = 0.1;  // relative, of I_z by I_x and I_y of a quadrotor

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
  constexpr double kFlattest = 1.02, kTallest = 0.55;  // of the sum; a plate has 1
  const double share = inertia / (v.Get("I_x") + v.Get("I_y"));
  return share > kTallest && share < kFlattest;
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

// Two readings of one flight: the mixture of both, which is no more certain where they differ.
void Mix(const FlightValue& other, FlightValue* value) {
  const double a = value->sigma * value->sigma, b = other.sigma * other.sigma;
  const double share = a / (a + b), apart = other.value - value->value;
  value->value += share * apart;
  value->sigma = std::sqrt((1.0 - share) * a + share * b + share * (1.0 - share) * apart * apart);
}

// Adds what the flight shows term by term. The fit shows thrust and drag, too.
void AddTerms(const FlightLog& log, FlightEstimate* flight) {
  for (const auto& [name, term] : TermsOf(log, *flight)) {
    FlightValue& value = flight->values[name];
    if (value.shown && (name[0] == 'K' || name == "k_f")) {
      Mix(term, &value);
    } else {
      value = term;
    }
  }
}

// m, where what the term is wrong by acts all the time.
ErrorByHorizon CostOfTerm(const FlightValue& flight, double simulated) {
  const double off = std::abs(simulated - flight.value) * flight.size;
  ErrorByHorizon cost{};
  for (std::size_t k = 0; k < cost.size(); ++k) {
    const double t = kHorizons[k];
    cost[k] = flight.moment ? 9.81 * off * std::pow(t, 4) / 24.0 : 0.5 * off * t * t;
  }
  return cost;
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

bool StatesRotors(const FlightLog& log, const NeutralVehicle& v) {
  return log.vehicle && log.vehicle->rotors.size() == v.rotors.size();
}

constexpr double kAlike = 0.1;  // relative, of factors by which two numbers are wrong

const Reading* ArmIn(const VehicleFile& file) {
  const Reading* at = nullptr;
  for (const char* name : {"arm", "lever", "lever_x", "x_M", "x"}) {
    if (at == nullptr) at = file.Find(name);
  }
  return at;
}

// The factor by which all of `names` differ alike, stated over shown, so that one other number may
// explain them, if it explains `others`, too. 1: they do not.
double OneFactor(const FlightJudge& judge, const std::vector<std::string>& names,
                 const std::vector<std::string>& others,
                 const std::function<double(const std::string&)>& stated,
                 std::map<std::string, FlightValue>& values) {
  double factor = 0.0, least = INFINITY, most = 0.0, gain = 0.0;
  for (const std::string& name : names) {
    const FlightValue& value = values[name];
    if (!value.shown || !judge.Differs(name, stated(name), value)) return 1.0;
    const double each = stated(name) / value.value;
    factor += each / static_cast<double>(names.size());
    least = std::min(least, each), most = std::max(most, each);
  }
  for (const std::string& name : others) {
    const FlightValue& value = values[name];
    if (!value.shown) return 1.0;
    const double off = stated(name) - value.value, left = stated(name) / factor - value.value;
    gain += (off * off - left * left) / std::pow(judge.Sigma(name, value), 2);
  }
  const bool explains = others.empty() || gain > kThreshold * kThreshold;
  return most < (1.0 + kAlike) * least && explains ? factor : 1.0;
}

// `names` of `values`, times `factor`.
void Scale(std::initializer_list<const char*> names, double factor,
           std::map<std::string, FlightValue>* values) {
  for (const char* name : names) {
    FlightValue& value = (*values)[name];
    value.value *= factor, value.sigma *= std::abs(factor);
  }
}

// A flight shows k_f / m, and k_f times the arm over I_x and over I_y. Where k_f, I_x and I_y are
// off by one factor and nobody has weighed the vehicle, one number explains it: the mass. Where I_x
// and I_y are, and yaw, where no arm acts, is not: the arm. The flights then get it. True where it
// is not told whether the arm is wrong or I_x and I_y.
bool JudgeMassAndArm(const FlightJudge& judge, const VehicleFile& file, double stated_ratio,
                     std::vector<FlightEstimate>* flights,
                     std::map<std::string, FlightValue>* values) {
  const NeutralVehicle& v = file.vehicle;
  const auto stated = [&](const std::string& name) { return v.Get(name); };
  const auto name_it = [&](const char* name, double factor, const Reading* at, const char* others) {
    const FlightValue &x = (*values)["I_x"], &y = (*values)["I_y"];
    const double in_file = v.Get(name), value = factor * in_file;
    const double sigma = 0.5 * value * std::hypot(x.sigma / x.value, y.sigma / y.value);
    if (!judge.Compare(name, in_file, {value, sigma, true}, &file, at)) return false;
    judge.audit->contradicted.back().text += fmt::format("; or {} by the inverse: state ", others);
    return true;
  };
  const bool known = (judge.log.vehicle && judge.log.vehicle->mass) || file.target->by_thrust;
  const double mass = OneFactor(judge, {"k_f"}, {"I_x", "I_y"}, stated, *values);
  if (!known && mass != 1.0 && name_it("m", mass, file.Find("m"), "k_f, I_x and I_y")) {
    Contradicted& entry = judge.audit->contradicted.back();
    entry.confused_with = {"k_f", "I_x", "I_y"}, entry.text += "the weighed mass in log.yaml";
    Scale({"k_f", "I_x", "I_y"}, mass, values), Scale({"k_m/k_f"}, 1.0 / mass, values);
    for (FlightEstimate& flight : *flights) {
      for (const char* name : {"m", "I_x", "I_y", "I_z"}) {
        flight.vehicle.body[name] *= mass, flight.constants[FindRotorConstant(name)] *= mass;
      }
      for (Numbers& rotor : flight.vehicle.rotors) rotor["k_f"] *= mass, rotor["k_m"] *= mass;
      flight.fitted_moment *= mass;
    }
  }
  const FlightValue& yaw = (*values)["k_m/k_f"];
  const double arm = OneFactor(judge, {"I_x", "I_y"}, {}, stated, *values);
  const bool by_inertia = yaw.shown && !judge.Differs("k_m/k_f", arm * stated_ratio, yaw);
  if (StatesRotors(judge.log, v) || arm == 1.0 || by_inertia) return false;
  if (!yaw.shown || !PlausibleYaw(v, v.Get("I_z")) || judge.Differs("k_m/k_f", stated_ratio, yaw) ||
      !name_it("arm", arm, ArmIn(file), "I_x and I_y")) {
    return true;
  }
  Contradicted& entry = judge.audit->contradicted.back();
  entry.confused_with = {"I_x", "I_y"}, entry.text += "the places of the rotors in log.yaml";
  Scale({"I_x", "I_y"}, arm, values);
  for (FlightEstimate& flight : *flights) {
    flight.vehicle = With(flight.vehicle, "arm", arm * v.Get("arm"));
    for (const char* name : {"I_x", "I_y"}) {
      flight.vehicle.body[name] *= arm, flight.constants[FindRotorConstant(name)] *= arm;
    }
  }
  return false;
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
    Scale({name}, share, values), flight.body[name] *= share;
  }
  return flight;
}

std::vector<FlightEstimate> Estimates(const std::vector<FlightLog>& logs,
                                      const NeutralVehicle& start, Audit* audit) {
  std::vector<FlightEstimate> flights;
  for (const FlightLog& log : logs) {
    flights.push_back(EstimateFromFlight(log, InLogOrder(start, log)));
    AddTerms(log, &flights.back());
    audit->logs.push_back(log.directory);
    for (const std::string& warning : flights.back().warnings) {
      audit->warnings.push_back(log.directory + ": " + warning);
    }
  }
  return flights;
}

// A number that the log's description states, too: weighed, or measured with a ruler. True if the
// file's is another.
bool CompareWithLog(const std::string& parameter, double in_file, double stated,
                    const std::string& by, Audit* audit) {
  const double tolerance = Tolerance(parameter, stated, stated);
  const bool wrong = std::abs(in_file - stated) > tolerance;
  const double sigma = tolerance / kThreshold;
  audit->compared.push_back(
      {parameter, UnitOf(parameter), in_file, stated, sigma, tolerance, wrong});
  if (!wrong) return false;
  Contradicted entry;
  entry.parameter = parameter, entry.unit = UnitOf(parameter);
  entry.file_value = in_file, entry.flight_value = stated, entry.sigma = sigma;
  entry.text = RatioInWords(in_file, stated) + "; by " + by + " in log.yaml";
  audit->contradicted.push_back(entry);
  return true;
}

// m, mean distance of the rotors from their middle.
double ArmOf(const std::vector<Rotor>& rotors) {
  const auto count = static_cast<double>(rotors.size());
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double arm = 0.0;
  for (const Rotor& rotor : rotors) middle += rotor.position / count;
  for (const Rotor& rotor : rotors) arm += (rotor.position - middle).head<2>().norm() / count;
  return arm;
}

void AddSpin(const VehicleFile* file, double spin, const std::string& text, Audit* audit) {
  Contradicted entry;
  entry.parameter = "spin", entry.file_value = spin, entry.text = text;
  if (file != nullptr) Place(*file, file->Find("spin"), &entry);
  audit->contradicted.push_back(entry);
}

// Rotors that turn the other way in log.yaml; `start` gets its spins. `order`: of the file's rotors
// in the log.
void CompareSpins(const VehicleFile* file, const FlightLog& log, const std::vector<int>& order,
                  NeutralVehicle* start, Audit* audit) {
  std::string others;
  double spin = 0.0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    double& stated = start->rotors[static_cast<std::size_t>(order[i])]["spin"];
    if (stated == log.vehicle->rotors[i].spin) continue;
    spin = stated, stated = log.vehicle->rotors[i].spin;
    others += fmt::format("{}{}", others.empty() ? "" : ", ", order[i]);
  }
  if (others.empty()) return;
  AddSpin(file, spin,
          fmt::format("rotors {} turn the other way than log.yaml says: spins, or the order of the "
                      "rotors",
                      others),
          audit);
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
  const double arm = ArmOf(log.vehicle->rotors);
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

// The flights' held-out errors with `vehicle`, whose rotors are in its file's order. Where exactly
// the centre of mass stands is no file's error unless it is named: the proof takes the flight's.
ErrorByHorizon ProofOf(const NeutralVehicle& vehicle, const std::vector<FlightEstimate>& flights,
                       const std::vector<FlightLog>& logs, const Audit& audit) {
  std::vector<NeutralVehicle> flown;
  for (std::size_t i = 0; i < logs.size(); ++i) {
    flown.push_back(InLogOrder(vehicle, logs[i]));
    for (const char* name : {"r_BM_x", "r_BM_y"}) {
      const bool named = std::ranges::find(audit.contradicted, name, &Contradicted::parameter) !=
                         audit.contradicted.end();
      if (!named) flown.back().body[name] = flights[i].vehicle.Get(name);
    }
  }
  return MeanErrors(flights, flown);
}

// A number that is contradicted is judged, by the file if not by the flight.
void JudgeOnce(Audit* audit) {
  std::erase_if(audit->not_judged, [&](const NotJudged& n) {
    return std::ranges::find(audit->contradicted, n.parameter, &Contradicted::parameter) !=
           audit->contradicted.end();
  });
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

}  // namespace

Audit AuditFiles(const std::vector<VehicleFile>& files) {
  Audit audit;
  const auto add = [&](const std::vector<Contradicted>& more) {
    audit.contradicted.insert(audit.contradicted.end(), more.begin(), more.end());
  };
  for (const VehicleFile& file : files) {
    audit.simulator += (audit.simulator.empty() ? "" : "; ") + file.Name();
    add(CheckVehicle(file));
    if (file.vehicle.Flies() || NotPositive(file)) continue;
    audit.warnings.push_back(fmt::format(
        "{} states no whole vehicle ({}); what depends on the rest is not checked: give its other "
        "files, too, after commas",
        file.Name(), file.vehicle.rotors.empty() ? "no rotors" : "no mass, inertia or places"));
  }
  add(CompareVehicles(files));
  for (const NeutralInfo& info : kNeutral) {
    if (*info.fly == '\0' && info.needs == 0) continue;
    const bool stated = std::ranges::any_of(
        files, [&](const VehicleFile& file) { return file.Find(info.name) != nullptr; });
    if (stated) audit.not_judged.push_back(NotShown(info.name, {}));
  }
  JudgeOnce(&audit);
  return audit;
}

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
  Audit audit;
  audit.simulator = file.Name();
  NeutralVehicle start = file.vehicle;
  const bool ordered = HoldWhatIsKnown(file, logs.front(), &start, &audit);
  for (const FlightLog& log : logs) WarnOfOrder(log, start, &audit);
  std::vector<FlightEstimate> flights = Estimates(logs, start, &audit);
  std::map<std::string, FlightValue> values = Together(flights);
  const FlightJudge judge{&audit, flights, start.Get("arm"), logs.front()};
  const Reading* at = nullptr;
  const std::optional<double> ratio = StatedBy(file, start, "k_m/k_f", &at);
  const bool by_arm = JudgeMassAndArm(judge, file, ratio.value_or(NAN), &flights, &values);
  JudgeHeight(judge, file, flights.front().vehicle, values);
  const NeutralVehicle flight = AtHover(file, flights.front().vehicle, &values);
  const auto stated = [&](const std::string& parameter) {
    return StatedBy(file, flight, parameter, &at);
  };

  bool turns_wrong = false;
  for (const char* name : kByFlight) {
    const std::string parameter = name;
    const std::optional<double> value = stated(parameter);
    if (!value) continue;
    const auto shown = values.find(parameter);
    // Along which axis the centre of mass is off is known by the order of the rotors only.
    if (parameter.starts_with("r_BM") && !ordered) {
      audit.not_judged.push_back({parameter, "state the rotors in log.yaml"});
      continue;
    }
    if (shown == values.end() || !shown->second.shown) {
      audit.not_judged.push_back(NotShown(parameter, logs.front()));
      continue;
    }
    // A file that knows no drag lacks the effect; its zero is no wrong number.
    if (parameter[0] == 'K' && *value == 0.0) continue;
    double from_file = *value;
    const FlightValue& by_flight = shown->second;
    if (parameter == "tau") {  // of lags up and down the flight shows what lies between
      const auto [low, high] = std::minmax({from_file, file.vehicle.Get("tau_down")});
      if (by_flight.value > low && by_flight.value < high) {
        audit.compared.push_back(
            {parameter, "s", *value, by_flight.value, by_flight.sigma, high - low, false});
        continue;
      }
      from_file = std::clamp(by_flight.value, low, high);
    }
    const bool wrong = judge.Compare(parameter, from_file, by_flight, &file, at);
    if (!wrong || !parameter.starts_with("I_")) continue;
    turns_wrong = true;
    if (!by_arm) continue;
    audit.contradicted.back().confused_with = {"arm"};
    audit.contradicted.back().text +=
        "; or the arm by the inverse: state the places of the rotors in log.yaml";
  }
  if (ratio && values["k_m/k_f"].shown) {
    FlightValue value = values["k_m/k_f"];
    const double k_f = flight.Get("k_f");
    // Beside inertia that may be right with another arm no I_z looks right.
    YawBlame blame;
    if (!by_arm) {
      blame = BlameForYaw(file.vehicle, value.value * k_f, *ratio * k_f, k_f, flight, turns_wrong);
    }
    if (blame.inertia) {
      const double inertia = file.vehicle.Get("I_z") * *ratio / value.value;
      judge.Compare("I_z", file.vehicle.Get("I_z"),
                    {inertia, inertia * value.sigma / value.value, true}, &file, file.Find("I_z"));
    }
    if (blame.both) {
      const double in_file = file.vehicle.Get("I_z");
      const double sigma =
          std::hypot(kShapeSigma * blame.usual,
                     kUsualYawInertia * (values["I_x"].sigma + values["I_y"].sigma));
      judge.Compare("I_z", in_file, {blame.usual, sigma, true}, &file, file.Find("I_z"));
      value.value *= blame.usual / in_file;
      value.sigma =
          std::hypot(value.sigma * blame.usual / in_file, sigma / blame.usual * value.value);
    }
    if (!blame.inertia && JudgeMoment(judge, file, *ratio, value, values["k_f"])) {
      Contradicted& moment = audit.contradicted.back();
      if (blame.could_be_both) {
        moment.confused_with = {"I_z"};
        moment.text += "; or I_z by the inverse: a flight shows their ratio";
      }
      if (moment.parameter == "k_m/k_f" && !StatesRatio(file)) {
        moment.confused_with.emplace_back("k_f");
        moment.text += "; or k_f by the inverse: commands do not show it";
      }
    }
  }
  AddLacks(values, stated("K_x").value_or(0.0) != 0.0, file.vehicle.States("tau"), &audit);

  // A flight that shows a number roughly only leaves it to the file.
  const auto roughly = [&](const std::string& name) {
    return std::ranges::find(audit.not_judged, name, &NotJudged::parameter) !=
           audit.not_judged.end();
  };
  const auto judged = [&](const std::string& name) {
    return std::ranges::any_of(audit.compared, [&](const Compared& c) {
      if (roughly(c.parameter)) return false;
      if (c.parameter.starts_with("k_m")) return name == "k_m" || name == "I_z";
      if (c.parameter[0] != 'K') return c.parameter == name;
      return name == "K" || c.parameter == name || OtherDrag(c.parameter).contains(name);
    });
  };
  const std::vector<Contradicted> of_itself = CheckVehicle(file);
  // What may as well be an error of another number is that where the file names it.
  std::erase_if(audit.contradicted, [&](const Contradicted& entry) {
    return std::ranges::any_of(of_itself, [&](const Contradicted& finding) {
      return !judged(finding.parameter) &&
             std::ranges::find(entry.confused_with, finding.parameter) != entry.confused_with.end();
    });
  });

  judge.AddCosts();
  NeutralVehicle corrected;
  CorrectFile(file, flight, &audit, &corrected);
  audit.before = ProofOf(file.vehicle, flights, logs, audit);
  audit.after = ProofOf(corrected, flights, logs, audit);
  WarnOfWorse(&audit);
  // What the file says of itself counts where no flight has judged it, and comes first; what
  // follows from an error that the flights have named does not count.
  VehicleFile without = file;
  without.vehicle = corrected;
  const std::vector<Contradicted> left = CheckVehicle(without);
  std::vector<Contradicted> by_file;
  for (const Contradicted& finding : of_itself) {
    const auto among = [&](const std::vector<Contradicted>& all) {
      return std::ranges::find(all, finding.parameter, &Contradicted::parameter) != all.end();
    };
    if (judged(finding.parameter) || !among(left) || among(audit.contradicted)) continue;
    const auto rough = std::ranges::find(audit.compared, finding.parameter, &Compared::parameter);
    if (rough == audit.compared.end()) {
      by_file.push_back(finding);
      continue;
    }
    // A range that the flight's own number leaves, too, shows no error. A rough size is better than
    // none.
    VehicleFile flown = file;
    flown.vehicle = With(file.vehicle, finding.parameter, rough->flight_value);
    if (among(CheckVehicle(flown))) continue;
    by_file.push_back(finding);
    by_file.back().flight_value = rough->flight_value, by_file.back().sigma = rough->sigma;
  }
  audit.contradicted.insert(audit.contradicted.begin(), by_file.begin(), by_file.end());
  for (const NeutralInfo& info : kNeutral) {
    const Reading* reading = file.Find(info.name);
    if (reading == nullptr || reading->number == 0.0 || judged(info.name)) continue;
    if (!roughly(info.name)) audit.not_judged.push_back(NotShown(info.name, logs.front()));
  }
  for (const char* name : {"I_xy", "I_xz", "I_yz", "J_r", "damping", "quadratic_damping"}) {
    const Reading* reading = file.Find(name);
    if (reading == nullptr || reading->number == 0.0) continue;
    audit.not_judged.push_back({name, "no flight judges it against a file"});
  }
  JudgeOnce(&audit);
  return audit;
}

// Logs show k_m / I_z: of a quadrotor's usual I_z beside I_x and I_y.
void TakeUsualYaw(double held, std::map<std::string, FlightValue>* values) {
  const FlightValue &x = (*values)["I_x"], &y = (*values)["I_y"];
  FlightValue& moment = (*values)["k_m/k_f"];
  if (!x.shown || !y.shown) return;
  Scale({"k_m/k_f"}, kUsualYawInertia * (x.value + y.value) / held, values);
  moment.sigma = std::hypot(moment.sigma, kShapeSigma * moment.value);
}

// What the descriptions of two logs state of the rotors; `flown` gets the simulator's.
void CompareStated(const FlightLog& simulated, const FlightLog& log, NeutralVehicle* flown,
                   Audit* audit) {
  if (!StatesRotors(simulated, *flown) || !StatesRotors(log, *flown)) return;
  CompareSpins(nullptr, simulated, LogOrder(*flown, simulated), flown, audit);
  const double arm = ArmOf(simulated.vehicle->rotors);
  if (CompareWithLog("arm", arm, ArmOf(log.vehicle->rotors), "the places of the rotors", audit)) {
    *flown = With(*flown, "arm", arm);
  }
}

Audit AuditLogs(const FlightLog& simulated, const std::vector<FlightLog>& logs) {
  Audit audit;
  audit.simulator = simulated.directory;
  const bool states = logs.front().vehicle && !logs.front().vehicle->rotors.empty();
  NeutralVehicle start = VehicleOfLog(states ? logs.front() : simulated);
  const auto mass = [](const FlightLog& log) {
    return log.vehicle ? log.vehicle->mass : std::nullopt;
  };
  if (mass(logs.front())) start.body["m"] = *mass(logs.front());
  NeutralVehicle flown = start;
  CompareStated(simulated, logs.front(), &flown, &audit);
  if (mass(simulated)) flown.body["m"] = *mass(simulated);
  const bool weighed = mass(simulated) && mass(logs.front());
  if (weighed) CompareWithLog("m", flown.Get("m"), start.Get("m"), "the masses", &audit);
  std::vector<FlightEstimate> flights = Estimates(logs, start, &audit);
  // Both are fitted from one start: what differs is the simulator's.
  std::vector<FlightEstimate> in_simulator = Estimates({simulated}, flown, &audit);
  audit.logs.pop_back();
  std::map<std::string, FlightValue> values = Together(flights), simulator = Together(in_simulator);
  const FlightJudge judge{&audit, flights, start.Get("arm"), logs.front()};
  const double factor = OneFactor(
      judge, {"k_f"}, {"I_x", "I_y"},
      [&](const std::string& name) { return simulator[name].value; }, values);
  if (!weighed && factor != 1.0) {
    Scale({"k_f", "I_x", "I_y"}, 1.0 / factor, &simulator), Scale({"k_m/k_f"}, factor, &simulator);
    const double sigma = start.Get("m") * values["I_x"].sigma / values["I_x"].value;
    judge.Compare("m", flown.Get("m") / factor, {start.Get("m"), sigma, true}, nullptr, nullptr);
  }
  TakeUsualYaw(start.Get("I_z"), &values), TakeUsualYaw(start.Get("I_z"), &simulator);
  bool turned = false;  // drag along other axes than the body's changes that along them, too
  for (const auto& [name, b] : values) {
    if (turned && name.starts_with("K_")) continue;
    const auto a = simulator.find(name);
    const bool fitted = b.size == 0.0 && (name == "L_v" || name == "M_u");  // beside others
    if (a == simulator.end() || name == "k_m" || fitted) continue;
    if (!a->second.shown || !b.shown) {
      if (b.size == 0.0) audit.not_judged.push_back(NotShown(name, logs.front()));
      continue;
    }
    const FlightValue both{b.value, std::hypot(a->second.sigma, b.sigma), true};
    // A simulator that knows nothing of an effect lacks it; its zero is no wrong number.
    const bool none = std::abs(a->second.value) < std::max(kThreshold * a->second.sigma,
                                                           Tolerance(name, 0.0, start.Get("arm")));
    const bool drag = name == "K_x" || name == "K_y" || name == "K_z";
    // Yaw that lags the speeds is an offset of the log's clocks.
    const bool late = name == "J_r_yaw" && a->second.value < 0.0;
    if (b.size > 0.0 && (none || late) && !drag) continue;
    if (!judge.Compare(name, a->second.value, both, nullptr, nullptr)) continue;
    if (name == "k_m/k_f") {
      audit.contradicted.back().confused_with = {"I_z"};
      audit.contradicted.back().text += "; or I_z by the inverse: a flight shows their ratio";
    }
    if (b.size == 0.0) continue;
    turned = turned || name == "K_twice";
    Contradicted& entry = audit.contradicted.back();
    entry.cost = CostOfTerm(b, a->second.value);
    entry.text += (entry.text.empty() ? "" : "; ") + std::string(FindNeutral(name)->meaning);
  }
  judge.AddCosts();
  audit.before = ProofOf(in_simulator.front().vehicle, flights, logs, audit);
  audit.after = audit.best;
  JudgeOnce(&audit);
  return audit;
}

}  // namespace trueline
