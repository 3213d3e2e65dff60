#include <fmt/ranges.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "problems/inspection/clear.h"
#include "problems/inspection/examination.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr std::size_t kMostOrdered = 6;  // rotors; permutations of eight take too long
constexpr double kLeastMotorLag = 0.12;  // s, of commands, which motors follow late

constexpr double kMostThrustRatio = 3.0;  // thrust stated against weight; more is no wrong k_f

// Torque per squared speed by each rotor as the vehicle file states it, one column a rotor.
Eigen::Matrix3Xd Stated(const std::vector<Rotor>& rotors) {
  Eigen::Matrix3Xd torque(3, static_cast<Eigen::Index>(rotors.size()));
  for (std::size_t i = 0; i < rotors.size(); ++i) {
    const Rotor& r = rotors[i];
    torque.col(static_cast<Eigen::Index>(i)) =
        r.k_f * r.position.cross(r.axis) + r.spin * r.k_m * r.axis;
  }
  return torque;
}

struct Order {
  std::vector<std::size_t> channel;  // of each rotor of the vehicle
  double roll, pitch, yaw;           // cosines
  double Places() const { return std::min(roll, pitch); }
};

// What each rotor is stated to do, in the order of the channels.
Eigen::Matrix3Xd ByChannel(const Eigen::Matrix3Xd& stated,
                           const std::vector<std::size_t>& channel) {
  Eigen::Matrix3Xd sorted = stated;
  for (std::size_t i = 0; i < channel.size(); ++i) {
    sorted.col(static_cast<Eigen::Index>(channel[i])) = stated.col(static_cast<Eigen::Index>(i));
  }
  return sorted;
}

Order TryOrder(const MomentSums& seen, const Eigen::Matrix3Xd& stated,
               const std::vector<std::size_t>& channel) {
  const Eigen::Matrix3Xd effects = ByChannel(stated, channel);
  return {channel, seen.Cosine(0, effects.row(0)), seen.Cosine(1, effects.row(1)),
          seen.Cosine(2, effects.row(2))};
}

// Shares, added up over the axes, of what the channels explain that an order of the stated rotors
// explains. Yaw counts where the flight shows it, whichever way all spins are turned.
double ExplainedBy(const RotorLayout& layout, const MomentSums& seen,
                   const Eigen::Matrix3Xd& stated, const std::vector<std::size_t>& channel) {
  const Order order = TryOrder(seen, stated, channel);
  const double yaw = layout.explained.z() < kLittle ? 0.0 : order.yaw * order.yaw;
  return std::copysign(order.roll * order.roll, order.roll) +
         std::copysign(order.pitch * order.pitch, order.pitch) + yaw;
}

// The order as read, then all others.
std::vector<std::vector<std::size_t>> OrdersOf(std::size_t count) {
  std::vector<std::size_t> channel(count);
  std::iota(channel.begin(), channel.end(), 0U);
  std::vector<std::vector<std::size_t>> orders = {channel};
  if (count > kMostOrdered) return orders;
  while (std::next_permutation(channel.begin(), channel.end())) orders.push_back(channel);
  return orders;
}

// Whether `order` explains more than `other`, in the whole flight and by the jackknife.
bool IsBetter(const RotorLayout& layout, const Eigen::Matrix3Xd& stated,
              const std::vector<std::size_t>& order, const std::vector<std::size_t>& other,
              double sigmas) {
  const auto gain = [&](const MomentSums& seen) {
    return ExplainedBy(layout, seen, stated, order) - ExplainedBy(layout, seen, stated, other);
  };
  std::vector<double> gains;
  for (const MomentSums& part : layout.without) gains.push_back(gain(part));
  return gain(*layout.all) > std::max(kHardly, sigmas * JackknifeSigma(gains));
}

// The order that explains the accelerations best, and how many others explain them alike.
struct BestOrder {
  Order order;
  std::size_t alike = 0;
};

BestOrder FindOrder(const RotorLayout& layout, const Eigen::Matrix3Xd& stated) {
  const auto orders = OrdersOf(layout.rotors.size());
  std::vector<double> explained;
  for (const auto& order : orders) {
    explained.push_back(ExplainedBy(layout, *layout.all, stated, order));
  }
  const auto most = std::max_element(explained.begin(), explained.end());
  const auto& best = orders[static_cast<std::size_t>(most - explained.begin())];
  BestOrder found{TryOrder(*layout.all, stated, best), 0};
  for (std::size_t k = 0; k < orders.size(); ++k) {
    if (*most - explained[k] > kMajority || orders[k] == best) continue;
    found.alike += !IsBetter(layout, stated, best, orders[k], kLikely);
  }
  return found;
}

std::string ChannelsText(const std::vector<std::size_t>& channels) {
  std::vector<std::size_t> from_one;
  from_one.reserve(channels.size());
  for (const std::size_t i : channels) from_one.push_back(i + 1);
  return fmt::format("{}", fmt::join(from_one, ", "));
}

void AddOrder(Examination* e, const RotorLayout& layout, const Order& as_read,
              const BestOrder& found) {
  const Order& best = found.order;
  Finding finding{&fault::kRotorOrder, layout.stream, Level::kFatal,
                  best.Places() - as_read.Places()};
  finding.text = fmt::format(
      "the channels of {}.csv are not in the order of the vehicle's rotors: rotors 1 to {} are "
      "channels {}{}. So ordered, their effect on roll and pitch agrees with the stated places "
      "(cosines {:.2f}, {:.2f}); as read {:.2f}, {:.2f}",
      layout.stream, best.channel.size(), ChannelsText(best.channel),
      found.alike > 0 ? fmt::format(", or one of {} other orders that fit alike", found.alike) : "",
      best.roll, best.pitch, as_read.roll, as_read.pitch);
  if (found.alike > 0) {
    finding.remedy = "check the order of the columns; the flight does not show which one is right";
    e->Add(finding);
    return;
  }
  finding.remedy = "give the columns in that order";
  e->AddRepaired(finding, {.order = best.channel});
}

// Whether all rotors turn the body against their stated spins, in every part of the flight.
bool TurnsTheOtherWay(const RotorLayout& layout, const Vehicle& vehicle, const Order& order) {
  const Eigen::RowVectorXd yaw = ByChannel(Stated(vehicle.rotors), order.channel).row(2);
  const auto is_reversed = [&](const MomentSums& seen) { return seen.Cosine(2, yaw) < -kMostly; };
  return is_reversed(*layout.all) &&
         std::all_of(layout.without.begin(), layout.without.end(), is_reversed);
}

void CheckSpins(Examination* e, const RotorLayout& layout, const Order& order) {
  std::vector<std::size_t> wrong;
  std::size_t shown = 0;
  for (std::size_t i = 0; i < order.channel.size(); ++i) {
    const int spin = layout.SpinOf(order.channel[i]);
    shown += spin != 0;
    if (spin * e->log.vehicle->rotors[i].spin < 0) wrong.push_back(i);
  }
  if (layout.explained.z() < kLittle) return;
  const bool all = wrong.size() == shown && TurnsTheOtherWay(layout, *e->log.vehicle, order);
  if (!all && (2 * shown < order.channel.size() || wrong.empty())) return;
  Finding finding{all ? &fault::kRotorSpinsReversed : &fault::kRotorSpin, layout.stream,
                  Level::kFatal, static_cast<double>(all ? order.channel.size() : wrong.size())};
  finding.text =
      all ? fmt::format(
                "every spin of the vehicle is turned round: the rotors that are stated to "
                "spin clockwise seen from above turn the body clockwise (cosine about yaw "
                "{:.2f}, {:.0f} % of the yaw acceleration explained)",
                order.yaw, 100.0 * layout.explained.z())
          : fmt::format(
                "rotors {} turn the body about yaw the other way than their stated spin says",
                ChannelsText(wrong));
  finding.remedy = all ? "change the sign of every `spin` (+1 is clockwise seen from above)"
                       : "check the spins of these rotors, or the order of all";
  finding.repaired = all;
  if (all) {
    e->result.repairs.reverse_spins = true;
    for (Rotor& rotor : e->fixed.vehicle->rotors) rotor.spin = -rotor.spin;
  }
  e->Add(finding);
}

void CheckLag(Examination* e, const RotorLayout& layout) {
  const double least = layout.stream == "motors" ? kLeastMotorLag : kPlaceClock.lag;
  if (layout.lag <= least && layout.lag >= -kPlaceClock.lag) return;
  AddClockOffset(
      e, -layout.lag, {.stream = layout.stream, .level = Level::kBiases, .sigma = 0.01},
      fmt::format("the body answers {:.2f} s {} than the stamps of {}.csv say (roll, pitch and yaw "
                  "accelerations explained to {:.0f}, {:.0f} and {:.0f} %)",
                  std::abs(layout.lag), layout.lag > 0.0 ? "later" : "earlier", layout.stream,
                  100.0 * layout.explained.x(), 100.0 * layout.explained.y(),
                  100.0 * layout.explained.z()));
}

std::string NoOrderText(const RotorLayout& layout, const BestOrder& best) {
  if (best.order.Places() < kMostly) {
    return fmt::format(
        "{}.csv: no order of its channels agrees with the rotors' places (cosines {:.2f} and "
        "{:.2f} at best)",
        layout.stream, best.order.roll, best.order.pitch);
  }
  return fmt::format(
      "{}.csv: the flight does not show whether its channels are in the order of the vehicle's "
      "rotors: channels {} explain the accelerations best, and other orders as well{}",
      layout.stream, ChannelsText(best.order.channel),
      layout.all->spans_all() ? ""
                              : ", as the speeds move in fewer directions than there are rotors");
}

void CheckLayout(Examination* e, const RotorLayout& layout) {
  CheckLag(e, layout);
  if (!e->log.vehicle || e->log.vehicle->rotors.empty()) {
    e->result.notes.push_back(fmt::format(
        "{}.csv: the log states no rotors, so that their order and spin are found but not compared "
        "(--vehicle=FILE gives them)",
        layout.stream));
    return;
  }
  if (e->log.vehicle->rotors.size() != layout.rotors.size()) return;
  const Eigen::Matrix3Xd stated = Stated(e->log.vehicle->rotors);
  const auto as_read = OrdersOf(layout.rotors.size()).front();
  const Order read = TryOrder(*layout.all, stated, as_read);
  const BestOrder best = FindOrder(layout, stated);
  const bool other = best.order.Places() > kMostly &&
                     IsBetter(layout, stated, best.order.channel, as_read, kShown);
  if (other) {
    AddOrder(e, layout, read, best);
    if (best.alike == 0) CheckSpins(e, layout, best.order);
    return;
  }
  const bool fits = read.Places() > kMostly;
  if (fits) CheckSpins(e, layout, read);
  if (!fits || best.alike > 0) e->result.notes.push_back(NoOrderText(layout, best));
}

// N, of all rotors as the vehicle file states them.
double ThrustOf(const std::vector<Rotor>& rotors, const ChannelsSample& sample) {
  double thrust = 0.0;
  for (std::size_t i = 0; i < rotors.size(); ++i) {
    thrust += rotors[i].k_f * sample.values[i] * sample.values[i];
  }
  return thrust;
}

// Thrust over mass and specific force, at every sample of the rotors in flight; 1 if all is right.
// A vehicle that idles on the ground has much less thrust than in flight.
std::vector<double> ThrustRatios(const FlightLog& log) {
  std::vector<double> all;
  for (const ChannelsSample& sample : log.rotors) {
    all.push_back(ThrustOf(log.vehicle->rotors, sample));
  }
  const double usual = LowerMedian(all);
  std::vector<double> ratios;
  for (std::size_t i = 0, k = 0; i < all.size(); ++i) {
    while (k + 1 < log.imu.size() && log.imu[k + 1].t <= log.rotors[i].t) ++k;
    const double force = log.imu[k].accel.norm();
    if (std::abs(SecondsBetween(log.imu[k].t, log.rotors[i].t)) > kHarmless) continue;
    if (all[i] < 0.5 * usual || force < 0.5 * log.gravity) continue;
    ratios.push_back(all[i] / (*log.vehicle->mass * force));
  }
  return ratios;
}

bool StatesThrust(const FlightLog& log) {
  if (!log.vehicle || !log.vehicle->mass || log.vehicle->rotors.empty()) return false;
  return log.rotors.size() >= 100 && log.rotors.front().values.size() == log.vehicle->rotors.size();
}

// Speeds in rpm, or in revolutions per second, that are read as rad/s give the thrust of another
// vehicle.
void CheckThrust(Examination* e) {
  if (!StatesThrust(e->fixed)) return;
  const std::vector<double> ratios = ThrustRatios(e->fixed);
  if (ratios.size() < 50) return;
  const double ratio = LowerMedian(ratios);
  if (!(ratio > 0.0) || std::abs(std::log(ratio)) < std::log(kMostThrustRatio)) return;
  const double factor = 1.0 / std::sqrt(ratio);  // of the speeds
  const auto is = [&](double unit) { return std::abs(std::log(factor / unit)) < kOtherUnit; };
  const bool rpm = is(kRpm), unit = rpm || is(2.0 * M_PI);
  const double error = e->log.gravity * std::min(1.0, std::abs(1.0 - ratio));
  const Level level = unit ? Level::kFatal : Level::kBiases;
  Finding finding{unit ? &fault::kRotorUnit : &fault::kRotorThrust, "rotors", level, ratio, error};
  finding.text = fmt::format(
      "in flight the rotors of rotors.csv give {:.3g} times the thrust that mass times specific "
      "force needs, by k_f, mass and speeds as stated{}",
      ratio,
      unit ? fmt::format(": the speeds are in {}, not in rad/s", rpm ? "rpm" : "revolutions per s")
           : "");
  finding.remedy = rpm    ? "state `unit: rpm` for the rotors"
                   : unit ? "multiply the speeds by 2 pi (`scale: 6.2831853`)"
                          : "check k_f of the rotors, the mass and the unit of the speeds (rad/s)";
  if (!unit) return e->Add(finding);
  e->AddRepaired(finding, {.channel_scale = rpm ? kRpm : 2.0 * M_PI});
}

}  // namespace

void CheckRotors(Examination* e) {
  CheckThrust(e);
  for (const char* stream : {"rotors", "motors"}) {
    const bool speeds = std::string(stream) == "rotors";
    const auto& channels = speeds ? e->fixed.rotors : e->fixed.motors;
    // Motors follow their commands by 20 to 80 ms.
    const UsualLag usual = {-kPlaceClock.lag, speeds ? kPlaceClock.lag : kLeastMotorLag};
    auto layout = FindLayout(e->fixed, channels, usual, kFarLag);
    if (!layout) continue;
    layout->stream = stream;
    if (layout->explained.head<2>().minCoeff() < kLittle) {
      e->result.notes.push_back(
          fmt::format("{}.csv explains {:.0f} % of the roll and {:.0f} % of the pitch "
                      "acceleration: too little to "
                      "show order and spin",
                      stream, 100.0 * layout->explained.x(), 100.0 * layout->explained.y()));
      continue;
    }
    CheckLayout(e, *layout);
    if (!e->result.rotors) e->result.rotors = layout;
  }
}

}  // namespace trueline
